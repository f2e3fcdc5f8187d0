//! Rows of feet that stand on the ground are solved where their legs begin: what functions for sets of modes and pieces
//! then compute, what it costs, and what they tell where a leg cannot follow its foot.

use mbd_codegen::factored::{factored, Choice, FactoredProgram};
use mbd_codegen::generate::{trace, Arithmetic, Options, Output, OutputProgram, RolledCode};
use mbd_codegen::jit::Compiled;
use mbd_codegen::model::Model;
use mbd_codegen::modes::words;
use mbd_codegen::options::PlanOptions;
use mbd_codegen::plan::Plan;
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::rolled::{together, Together};
use mbd_codegen::search;
use mbd_codegen::symbolic::Program;
use mbd_runtime::contact::{rows_that_act, Mode, Reducible};
use mbd_runtime::Constrained;
use mbd_testing::random::{legged, with_feet, Rng};
use mbd_testing::relative_error;
use mbd_testing::state::{random_state, State};

const OUTPUTS: [Output; 3] = [Output::Rates, Output::ProjectMomenta, Output::Multipliers];

/// Ways to compute an output.
const OWN: &str = "by its own function";
const TOGETHER: &str = "with like legs together";
const PIECES: &str = "in pieces";

fn fast() -> Options {
    let mut options = Options { arithmetic: Arithmetic::Fast, ..Options::default() };
    options.plan.rolled = RolledCode::Never;
    options
}

fn shipped(name: &str) -> Model {
    let path = format!("{}/../models/contacts/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Model::load(path).unwrap_or_else(|e| panic!("{e}"))
}

/// The plan in a set of modes.
fn acting(full: &Plan, modes: &[Mode]) -> Plan {
    full.acting(&rows_that_act(full.dims.rows, &full.contacts::<f64>(), modes))
}

/// What a system computes, through the traits that motions use.
fn computed<Y>(system: &mut Y, state: &State, output: Output) -> Vec<f64>
where
    Y: Constrained<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>, Rows = Vec<f64>>,
{
    let (mut qd, mut v) = (vec![0.0; state.q.len()], vec![0.0; state.v.len()]);
    let (mut p, mut rows) = (momenta(state), system.zero_rows());
    match output {
        Output::Rates => {
            system.rates_at(0.0, &state.q, &momenta(state), &mut qd, &mut p);
            [qd, p].concat()
        }
        Output::ProjectMomenta => {
            system.project_momenta(0.0, &state.q, &mut p, &mut v, &mut rows);
            [v, p, rows].concat()
        }
        _ => {
            system.multipliers(0.0, &state.q, &state.v, &mut rows);
            rows
        }
    }
}

/// What the interpreter computes, which solves all rows at the ground.
fn interpreted(full: &Plan, modes: &[Mode], state: &State, output: Output) -> Vec<f64> {
    let acts = rows_that_act(full.dims.rows, &full.contacts::<f64>(), modes);
    computed(&mut state.interpreter_acting(full, &acts), state, output)
}

fn momenta(state: &State) -> Vec<f64> {
    state.v.iter().map(|v| 0.7 * v - 0.1).collect()
}

/// The largest difference, as a part of the largest number.
fn error(a: &[f64], b: &[f64]) -> f64 {
    relative_error(a, b, 0.0)
}

/// The programs of an output in a set of modes with early rows.
struct Early<'a> {
    output: Output,
    /// A function of its own, and one with like legs together where there are some.
    own: OutputProgram<Program>,
    together: Option<Together>,
    pieces: &'a FactoredProgram,
    /// The pieces of the modes.
    first: Choice,
}

impl<'a> Early<'a> {
    /// `None` where no rows are early.
    fn new(full: &Plan, pieces: &'a FactoredProgram, modes: &[Mode], output: Output) -> Option<Self> {
        let plan = acting(full, modes);
        let contacts = plan.early_contacts(Arithmetic::Fast);
        let plan = plan.with_early_contacts(&contacts);
        (!contacts.is_empty()).then(|| Early {
            output,
            own: trace(&plan, output, &fast()).unwrap_or_else(|e| panic!("{e}")),
            together: together(&plan, output, &fast()).map(|both| both.program),
            pieces,
            first: pieces.choose(modes).expect("modes of the model"),
        })
    }

    /// Results, each with how it was computed, and with whether all early rows act.
    fn at(&self, state: &State) -> Vec<(&'static str, Vec<f64>, bool)> {
        let fused = |a: f64, b: f64, c: f64| a.mul_add(b, c);
        let second = if self.output == Output::Multipliers { state.v.clone() } else { momenta(state) };
        let given = state.inputs_of(&self.own.inputs, &second, &[]);
        let flagged = |way, mut result: Vec<f64>| {
            let act = result.pop().expect("whether early rows act");
            assert!(act == 0.0 || (act - 1.0).abs() < 1e-12, "{way}: {act}");
            (way, result, act != 0.0)
        };
        let mut all = vec![flagged(OWN, self.own.program.evaluate(&given, fused))];
        if let Some(both) = &self.together {
            all.push(flagged(TOGETHER, both.program.evaluate(&given, fused)));
            assert_eq!(flagged(TOGETHER, both.apart.evaluate(&given, fused)), all[1]);
        }
        // Which rows act is an input of pieces that no operation reads.
        let choice = self.pieces.with_late(&self.first, &given, fused);
        all.push((PIECES, self.pieces.evaluate(&choice, &given, fused), choice == self.first));
        all
    }
}

/// Compares random states in random sets of modes. Gives how many results had early rows that acted, how many had some that did
/// not, and how many were computed with like legs together.
fn compare(what: &str, plan: &Plan, output: Output, count: usize, seed: u64) -> [usize; 3] {
    let (model, full) = (&plan.model, plan.with_contacts());
    let Some(pieces) = factored(&full, output, &fast()) else { return [0; 3] };
    let mut rng = Rng::new(seed, 5);
    let mut counts = [0; 3];
    for k in 0..count {
        let each = model.contacts.iter().map(|contact| match contact.friction > 0.0 {
            true => rng.pick(&[Mode::Open, Mode::Slide, Mode::Stick, Mode::Stick]),
            false => rng.pick(&[Mode::Open, Mode::Open, Mode::Slide]),
        });
        let modes: Vec<Mode> = each.collect();
        let state = random_state(&full, seed + 1000 * k as u64);
        let Some(early) = Early::new(&full, &pieces.program, &modes, output) else { continue };
        let expected = interpreted(&full, &modes, &state, output);
        for (way, result, act) in early.at(&state) {
            counts[usize::from(!act)] += 1;
            counts[2] += usize::from(way == TOGETHER);
            // Where early rows do not act, pieces have taken the late ones, and a function leaves it to the one for all modes.
            if act || way == PIECES {
                let (name, words, error) = (output.name(), words(&modes), error(&result, &expected));
                assert!(error < 1e-9, "{what}, {name} in `{words}` {way}: {error:e}");
            }
        }
    }
    counts
}

#[test]
fn early_rows_bind_as_rows_at_the_ground_do() {
    let mut sum = [0; 3];
    // With eliminations that are searched for, and with one joint at a time.
    let searched = search::plan(&shipped("quadruped"), PlanOptions::default());
    let plain = Plan::new(&shipped("quadruped_hop"), 1e-9);
    for (k, output) in OUTPUTS.into_iter().enumerate() {
        for plan in [&searched, &plain] {
            let counts = compare(&plan.model.name, plan, output, 12, 7 + k as u64);
            (0..3).for_each(|k| sum[k] += counts[k]);
        }
    }
    println!(
        "{} times all early rows acted, {} times not; {} times legs were computed together",
        sum[0], sum[1], sum[2]
    );
    assert!(sum[0] > 50 && sum[2] > 20, "{sum:?}");
}

#[test]
fn early_rows_of_random_robots_bind_as_rows_at_the_ground_do() {
    let mut sum = [0; 3];
    for seed in 0..18 {
        let plan = Plan::new(&legged(seed), 1e-9);
        let counts = compare(&format!("seed {seed}"), &plan, OUTPUTS[seed as usize % 3], 4, seed);
        (0..3).for_each(|k| sum[k] += counts[k]);
    }
    println!(
        "{} times all early rows acted, {} times not; {} times legs were computed together",
        sum[0], sum[1], sum[2]
    );
    assert!(sum[0] > 50, "{sum:?}");
}

#[test]
fn early_rows_of_random_mechanisms_bind_as_rows_at_the_ground_do() {
    let mut sum = [0; 3];
    for seed in 0..20 {
        if let Some(model) = with_feet(seed) {
            let plan = Plan::new(&model, 1e-9);
            let counts = compare(&format!("seed {seed}"), &plan, OUTPUTS[seed as usize % 3], 3, seed);
            (0..3).for_each(|k| sum[k] += counts[k]);
        }
    }
    println!(
        "{} times all early rows acted, {} times not; {} times legs were computed together",
        sum[0], sum[1], sum[2]
    );
    assert!(sum[0] > 40, "{sum:?}");
}

#[test]
fn a_straight_leg_leaves_its_foot_to_late_rows() {
    let model = shipped("quadruped_hop");
    let full = Plan::new(&model, 1e-9).with_contacts();
    let modes = [Mode::Stick, Mode::Open, Mode::Stick, Mode::Open];
    let at = |joint: &str| full.coordinate_names().iter().position(|name| name == joint).expect("a joint");
    let knee = at("knee_fl");
    for output in OUTPUTS {
        let pieces = factored(&full, output, &fast()).expect("limbs").program;
        let mut state = random_state(&full, 3);
        let acts = rows_that_act(full.dims.rows, &full.contacts::<f64>(), &modes);
        let machine = Compiled::<f64>::from_plan(full.clone(), fast().of_model(true)).expect("options");
        let mut machine = machine.acting(&acts);
        machine.inputs().tau.clone_from(&state.tau);
        let early = Early::new(&full, &pieces, &modes, output).expect("early rows");
        let mut straight = 0;
        // The contact point, hip and knee are in line where the knee is bent a little, by where the ball of the foot touches.
        for k in -100..=100 {
            state.q[knee] = 3e-3 * f64::from(k);
            let all = early.at(&state);
            assert_eq!(all.len(), 3, "two legs stand, and two do not");
            let acts = all[0].2;
            let expected = interpreted(&full, &modes, &state, output);
            straight += usize::from(!acts);
            for (way, result, act) in &all {
                assert_eq!(*act, acts, "{} {way} at {}", output.name(), state.q[knee]);
                let error = error(result, &expected);
                let holds = *act || *way == PIECES;
                assert!(!holds || error < 1e-10, "{} {way} at {}: {error:e}", output.name(), state.q[knee]);
            }
            // Machine code made at run time: where early rows do not act the interpreter first, and code without them later.
            let often = if acts { 1 } else { Compiled::<f64>::WORTHWHILE / 30 };
            for _ in 0..often {
                let error = error(&computed(&mut machine, &state, output), &expected);
                assert!(error < 1e-10, "{} at {} in machine code: {error:e}", output.name(), state.q[knee]);
            }
        }
        println!("{}: a foot is left to late rows in {straight} of 201 positions", output.name());
        assert!((1..70).contains(&straight), "{straight}");
    }
}

/// Heights are read one lane after the other: a loop over legs would read those of four lanes for a pair.
#[test]
fn legs_on_hills_are_computed_one_after_the_other() {
    let path = format!("{}/../models/contacts/quadruped.toml", env!("CARGO_MANIFEST_DIR"));
    let plane = std::fs::read_to_string(&path).expect("the model");
    let heights = [[0.0, 0.1, 0.0, 0.1, 0.0]; 5];
    let field = format!("type = \"height_field\"\nspacing = [1, 1]\nheights = {heights:?}");
    let hills = plane.replacen("type = \"plane\"", &field, 1);
    let legs = [(&plane, true), (&hills, false)];
    for (text, expected) in legs {
        let model = read::model(&path, text, &ImportOptions::default()).unwrap_or_else(|findings| panic!("{findings}"));
        let full = Plan::new(&model.model, 1e-9).with_contacts();
        let mut modes = vec![Mode::Open; model.model.contacts.len()];
        modes[..4].fill(Mode::Stick);
        let plan = acting(&full, &modes);
        let plan = plan.with_early_contacts(&plan.early_contacts(Arithmetic::Fast));
        assert!(plan.early_tolerance.is_some());
        assert_eq!(together(&plan, Output::Rates, &fast()).is_some(), expected);
    }
}

#[test]
fn a_leg_at_a_stop_has_no_early_rows() {
    let model = shipped("quadruped");
    let full = Plan::new(&model, 1e-9).with_contacts();
    let mut modes = vec![Mode::Open; model.contacts.len()];
    let contact = |name: &str| model.contacts.iter().position(|c| c.name == name).expect("a contact");
    (modes[contact("sole_fl")], modes[contact("sole_hr")]) = (Mode::Stick, Mode::Stick);
    assert_eq!(acting(&full, &modes).early_contacts(Arithmetic::Fast), [contact("sole_fl"), contact("sole_hr")]);
    modes[contact("knee_hr/upper")] = Mode::Slide;
    assert_eq!(acting(&full, &modes).early_contacts(Arithmetic::Fast), [contact("sole_fl")]);
    // A foot that slides has one row, which hip and thigh can follow.
    (modes[contact("sole_hr")], modes[contact("sole_hl")]) = (Mode::Slide, Mode::Slide);
    assert_eq!(acting(&full, &modes).early_contacts(Arithmetic::Fast).len(), 3);
}

#[test]
fn a_robot_with_one_leg_has_early_rows() {
    let mut count = 0;
    for seed in 0..40 {
        let plan = Plan::new(&legged(seed), 1e-9);
        if plan.model.contacts.len() > 1 {
            continue;
        }
        // Those of the first seeds are compared with the interpreter above.
        assert!(factored(&plan.with_contacts(), Output::Rates, &fast()).is_some(), "seed {seed}");
        let on_foot = acting(&plan.with_contacts(), &[Mode::Stick]);
        let early = on_foot.with_early_contacts(&on_foot.early_contacts(Arithmetic::Fast));
        let operations = |plan: &Plan| {
            trace(plan, Output::Rates, &fast()).unwrap_or_else(|e| panic!("{e}")).program.counts().total()
        };
        let [with, without] = [&early, &on_foot].map(operations);
        println!("seed {seed}: {with} operations in place of {without}");
        assert!(10 * with < 9 * without, "seed {seed}: {with} {without}");
        count += 1;
    }
    assert!(count > 5, "{count}");
}

#[test]
fn three_feet_of_a_quadruped_cost_less_than_another_flight() {
    let full = Plan::new(&shipped("quadruped"), 1e-9).with_contacts();
    let pieces = factored(&full, Output::Rates, &fast()).expect("limbs").program;
    let exact = Options { arithmetic: Arithmetic::Exact, ..fast() };
    let late = factored(&full, Output::Rates, &exact).expect("limbs").program;
    let count = |pieces: &FactoredProgram, feet: usize| {
        let mut modes = vec![Mode::Open; full.model.contacts.len()];
        modes[..feet].fill(Mode::Stick);
        pieces.counts_of(&pieces.choose(&modes).expect("modes of the model")).total()
    };
    let counts: Vec<[usize; 2]> = (0..=4).map(|feet| [count(&pieces, feet), count(&late, feet)]).collect();
    println!("operations of early and late rows with 0 to 4 feet: {counts:?}");
    assert!(counts[3][0] < 175 * counts[0][0] / 100, "{counts:?}");
    assert!(counts[4][0] < 70 * counts[4][1] / 100, "{counts:?}");
    println!("of all pieces: {} {}", pieces.counts().total(), late.counts().total());
}
