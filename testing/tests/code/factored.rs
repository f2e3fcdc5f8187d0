//! Code of contacts put together from pieces: the bits of code for each set of modes, and how many operations it has.

use mbd_codegen::factored::{factored, FactoredProgram};
use mbd_codegen::generate::{trace, Arithmetic, Options, Output, RolledCode};
use mbd_codegen::model::Model;
use mbd_codegen::modes::words;
use mbd_codegen::plan::Plan;
use mbd_runtime::contact::{rows_that_act, Mode};
use mbd_runtime::Constrained;
use mbd_testing::random::{with_contacts, Rng};
use mbd_testing::state::random_state;

const OUTPUTS: [Output; 3] = [Output::Rates, Output::ProjectMomenta, Output::Multipliers];

fn exact() -> Options {
    let mut options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    options.plan.rolled = RolledCode::Never;
    options
}

fn shipped(name: &str) -> Model {
    let path = format!("{}/../models/contacts/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Model::load(path).unwrap_or_else(|e| panic!("{e}"))
}

/// Sets of modes: flight, and random ones.
fn sets(all: &FactoredProgram, contacts: usize, count: usize, rng: &mut Rng) -> Vec<Vec<Mode>> {
    let random = |rng: &mut Rng| {
        let mut modes = vec![Mode::Open; contacts];
        for group in &all.groups {
            let of_group = &group.modes[rng.below(group.modes.len())].modes;
            group.contacts.iter().zip(of_group).for_each(|(contact, mode)| modes[*contact] = *mode);
        }
        modes
    };
    let mut sets = vec![vec![Mode::Open; contacts]];
    sets.extend((1..count).map(|_| random(rng)));
    sets
}

/// Whether two lists of numbers have the same bits. Zeros may differ in their signs.
fn same(a: &[f64], b: &[f64]) -> bool {
    let equal = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (*a == 0.0 && *b == 0.0);
    a.len() == b.len() && a.iter().zip(b).all(equal)
}

/// Compares random sets of modes in pieces, by functions of their own, by one function for all modes, and interpreted.
/// Gives the program in pieces, and how many times the operations of a set's own function it executes at most.
fn compare(what: &str, model: &Model, output: Output, count: usize, seed: u64) -> Option<(FactoredProgram, f64)> {
    let full = Plan::new(model, 1e-9).with_contacts();
    let options = exact();
    let all = factored(&full, output, &options)?;
    let masked = trace(&full.masked(), output, &options).unwrap_or_else(|e| panic!("{e}"));
    let (nq, nv, rows) = (full.dims.nq, full.dims.nv, full.dims.rows);
    let mut most = 0.0_f64;
    for modes in sets(&all.program, model.contacts.len(), count, &mut Rng::new(seed, 5)) {
        let choice = all.program.choose(&modes).expect("modes of the model");
        let acts = rows_that_act(rows, &full.contacts::<f64>(), &modes);
        let own = trace(&full.acting(&acts), output, &options).unwrap_or_else(|e| panic!("{e}"));
        let mut state = random_state(&full, seed);
        state.acts = acts.iter().map(|acts| f64::from(u8::from(*acts))).collect();
        let p: Vec<f64> = state.v.iter().map(|v| 0.7 * v - 0.1).collect();
        let given = |inputs| state.inputs_of(inputs, if output == Output::Multipliers { &state.v } else { &p }, &p);
        let fused = |a: f64, b: f64, c: f64| a * b + c;
        let mut interpreter = state.interpreter_acting(&full, &acts);
        let (mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
        let mut of_rows = vec![0.0; rows];
        let interpreted = match output {
            Output::Rates => {
                interpreter.rates(&state.q, &p, &mut v, &mut qd, &mut pd);
                [qd, pd].concat()
            }
            Output::ProjectMomenta => {
                pd.copy_from_slice(&p);
                interpreter.project_momenta(0.0, &state.q, &mut pd, &mut v, &mut of_rows);
                [v, pd, of_rows].concat()
            }
            _ => {
                interpreter.multipliers(0.0, &state.q, &state.v, &mut of_rows);
                of_rows
            }
        };
        let ways = [
            ("in pieces", all.program.evaluate(&choice, &given(&all.inputs), fused)),
            ("by its own function", own.program.evaluate(&given(&own.inputs), fused)),
            ("by one function for all modes", masked.program.evaluate(&given(&masked.inputs), fused)),
        ];
        for (way, result) in ways {
            let (name, words) = (output.name(), words(&modes));
            assert!(
                same(&result, &interpreted),
                "{what}, {name} in `{words}`, {way}: {result:?}, but interpreted {interpreted:?}"
            );
        }
        let counts = [all.program.counts_of(&choice), own.program.counts()].map(|counts| counts.total() as f64);
        most = most.max(counts[0] / counts[1].max(1.0));
    }
    Some((all.program, most))
}

#[test]
fn random_mechanisms_have_the_same_bits_in_every_way() {
    let mut mechanisms = 0;
    for seed in 0.. {
        if mechanisms == 100 {
            break;
        }
        // More contacts on one limb have thousands of modes, each of which is traced.
        let Some(model) = with_contacts(seed).filter(|model| model.contacts.len() <= 4) else { continue };
        let output = OUTPUTS[seed as usize % 3];
        let all = compare(&format!("seed {seed}"), &model, output, 6, seed);
        assert!(all.is_some(), "seed {seed} is refused");
        mechanisms += 1;
    }
}

#[test]
fn shipped_scenes_have_the_same_bits_in_every_way() {
    for name in ["hopper", "simplest_walker", "rocking_block", "ball_on_box", "newtons_cradle", "fourbar_stop"] {
        for output in OUTPUTS {
            compare(name, &shipped(name), output, 12, 3).unwrap_or_else(|| panic!("{name} is refused"));
        }
    }
}

#[test]
fn a_quadruped_has_fewer_pieces_than_sets_of_modes() {
    let model = shipped("quadruped_hop");
    for output in OUTPUTS {
        let (all, most) = compare("quadruped_hop", &model, output, 30, 1).expect("limbs");
        assert_eq!(all.sequences.len(), 81);
        // Four feet in order, each of which is open, slides or sticks: the trunk does not ask which foot is open.
        assert!((31..81).contains(&all.trunks.len()), "{}", all.trunks.len());
        let total = all.counts().total();
        let each: usize = (0..81)
            .map(|k| {
                let limbs = [k / 27, k / 9 % 3, k / 3 % 3, k % 3];
                all.counts_of(&all.choice(limbs.to_vec())).total()
            })
            .sum();
        assert!(3 * total < each, "{}: {total} operations of pieces, {each} of functions", output.name());
        assert!(most < 1.03, "{}: {most}", output.name());
    }
}

#[test]
fn stops_do_not_multiply_the_trunks() {
    let model = shipped("quadruped");
    let (all, _) = compare("quadruped", &model, Output::Rates, 20, 1).expect("limbs");
    let sets: usize = all.groups.iter().map(|group| group.modes.len()).product();
    assert_eq!(sets, 20_736);
    assert!(all.trunks.len() < 100, "{}", all.trunks.len());
}
