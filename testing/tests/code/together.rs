//! Like branches of one node that are computed together, against the interpreter.
//!
//! In exact arithmetic the operations are those of the sweeps, and what branches hand to their parent is added in the
//! order of the interpreter: results are the same bit for bit, those of machine code made at run time too. In fast
//! arithmetic the errors are small, and code that computes one branch after the other (for several states) has the bits
//! of code that computes all at once.

use mbd_codegen::generate::{trace, InputArray};
use mbd_codegen::jit::Number;
use mbd_codegen::model::Model;
use mbd_codegen::options::{EliminationStrategy, LikeBranches, PlanOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::read::Base;
use mbd_codegen::rolled::{together, Vectors};
use mbd_codegen::{search, Arithmetic, Options, Output, Precision};
use mbd_runtime::{Real, Scalar};
use mbd_testing::branches::{on_feet, tree, with_loops, On, NUMBERS};
use mbd_testing::state::{random_state, State};
use mbd_testing::{assert_same_bits, relative_error};

use crate::wide::Wide;
use crate::{machine_code, wide};

fn options(arithmetic: Arithmetic, elimination: EliminationStrategy) -> Options {
    let branches = LikeBranches::Together;
    let plan = PlanOptions { elimination, branches, ..PlanOptions::default() };
    Options { arithmetic, plan, ..Options::default() }
}

/// Compares all outputs that compute like branches together with the interpreter. Returns the number of branches in the
/// sets of the rates.
fn compare(what: &str, model: &Model, plan: &Plan, options: &Options) -> usize {
    let s = random_state(plan, 7);
    let nv = plan.dims.nv;
    let mut i = s.interpreter(plan);
    let (mut p, mut a) = (vec![0.0; nv], vec![0.0; nv]);
    i.momenta(&s.q, &s.v, &mut p);
    i.accelerations(&s.q, &s.v, &mut a);
    let mut branches = 0;
    for output in Output::available(!plan.constraints.is_empty()) {
        let Some(both) = together(plan, output, options) else { continue };
        assert_ne!(output, Output::Energy, "{what}: energies add up over all nodes in order");
        let given = s.inputs_of(&both.inputs, &p, &a);
        let expected = evaluated::<f64>(plan, options, &s, (output, true), &both.inputs, &given);
        let straight = trace(plan, output, options).expect("a program").program;
        let exact = || {
            let given: Vec<Wide> = given.iter().map(|x| Wide::constant(*x)).collect();
            straight.evaluate(&given, |a, b, c| a * b + c).into_iter().map(Wide::to_f64).collect()
        };
        if output == Output::Rates {
            branches = both.program.program.loops.iter().map(|l| l.branches.len()).sum();
        }
        for fused in [|a: f64, b: f64, c: f64| a * b + c, |a: f64, b: f64, c: f64| a.mul_add(b, c)] {
            let results = both.program.program.evaluate(&given, fused);
            let apart = both.program.apart.evaluate(&given, fused);
            assert_same_bits(what, &format!("{output:?}, apart"), model, &apart, &results);
            if options.arithmetic == Arithmetic::Exact {
                assert_same_bits(what, output.name(), model, &results, &expected);
            }
            assert_near(&format!("{what}: {output:?}"), &results, &expected, &exact);
        }
        let doubles = evaluated::<f64>(plan, options, &s, (output, false), &both.inputs, &given);
        let singles = evaluated::<f32>(plan, options, &s, (output, false), &both.inputs, &given);
        match options.arithmetic {
            Arithmetic::Exact => {
                assert_same_bits(what, &format!("{output:?}, machine code"), model, &doubles, &expected);
                let given: Vec<f32> = given.iter().map(|x| *x as f32).collect();
                let program = Options { precision: Precision::F32, ..options.clone() };
                let program = together(plan, output, &program).expect("the same branches").program;
                let expected = program.apart.evaluate(&given, |a, b, c| a * b + c);
                let expected: Vec<f64> = expected.into_iter().map(f64::from).collect();
                assert_same_bits(what, &format!("{output:?}, machine code, f32"), model, &singles, &expected);
            }
            Arithmetic::Fast => {
                assert_near(&format!("{what}: {output:?} by machine code"), &doubles, &expected, &exact);
                let off = relative_error(&singles, &expected, 1.0);
                assert!(off <= 1e-2, "{what}: {output:?} by machine code, f32, is {off:e} off");
            }
        }
        let apart = both.program.apart.counts().total();
        if options.arithmetic == Arithmetic::Exact {
            assert_eq!(apart, straight.counts().total(), "{what}: {output:?} has other operations");
        }
    }
    branches
}

/// Asserts that results are as good as the interpreter's: some hundred roundings and their growth by a usual condition of the
/// inertia away from them, or, where the condition is worse, not much farther than them from `exact` results.
fn assert_near(what: &str, results: &[f64], expected: &[f64], exact: &impl Fn() -> Vec<f64>) {
    let off = relative_error(results, expected, 1.0);
    if off <= 1e-11 {
        return;
    }
    let exact = exact();
    let [own, theirs] = [results, expected].map(|found| relative_error(found, &exact, 1.0));
    assert!(own <= 3.0 * theirs, "{what} is {off:e} off, {own:e} from exact results and the interpreter {theirs:e}");
}

/// An output by machine code, or by the interpreter; `given` are the entries of its inputs.
fn evaluated<S: Number>(
    plan: &Plan,
    options: &Options,
    s: &State,
    (output, interpreted): (Output, bool),
    inputs: &[InputArray],
    mut given: &[f64],
) -> Vec<f64> {
    let mut machine = machine_code::compiled::<S>(plan, options, s);
    if interpreted {
        machine = machine.interpreted();
    }
    let arrays = inputs.iter().map(|array| (array, given.split_off(..array.len()).expect("as many entries")));
    let arguments = arrays.filter(|(array, _)| !array.field);
    let arguments: Vec<Vec<S>> = arguments.map(|(_, array)| array.iter().map(|x| S::constant(*x)).collect()).collect();
    let arguments: Vec<&[S]> = arguments.iter().map(Vec::as_slice).collect();
    let lengths = output.spec().results.iter().map(|array| array.len(machine.sizes()));
    let mut found: Vec<Vec<S>> = lengths.map(|len| vec![S::constant(f64::NAN); len]).collect();
    let mut results: Vec<&mut [S]> = found.iter_mut().map(Vec::as_mut_slice).collect();
    match interpreted {
        true => machine.evaluate_or_interpret(output, &arguments, &mut results).expect("an output"),
        false => machine.evaluate(output, &arguments, &mut results).expect("machine code"),
    }
    found.concat().into_iter().map(|x| x.to_f64()).collect()
}

/// Compares with freedoms that are eliminated one by one. Returns the numbers of branches in exact and in fast arithmetic.
fn compare_single(what: &str, model: &Model) -> [usize; 2] {
    [Arithmetic::Exact, Arithmetic::Fast].map(|arithmetic| {
        let options = options(arithmetic, EliminationStrategy::Single);
        let plan = search::plan(model, options.plan);
        compare(&format!("{what}, {arithmetic:?}"), model, &plan, &options)
    })
}

fn add(sum: &mut [usize; 2], more: [usize; 2]) {
    sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}

/// Compares on one tree for each seed. Returns the number of branches.
fn compare_trees(seeds: std::ops::Range<u64>) -> usize {
    let mut branches = 0;
    for seed in seeds {
        let numbers = NUMBERS[seed as usize % 4];
        let model = tree(seed, numbers);
        let elimination = match seed % 5 {
            0 if model.joints.len() < 8 => EliminationStrategy::Fastest,
            1 if model.joints.len() < 8 => EliminationStrategy::Fewest,
            _ => EliminationStrategy::Single,
        };
        let plan = search::plan(&model, options(Arithmetic::Exact, elimination).plan);
        for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
            let what = format!("seed {seed}, {numbers:?}, {arithmetic:?}");
            branches += compare(&what, &model, &plan, &options(arithmetic, elimination));
        }
    }
    branches
}

#[test]
fn random_trees() {
    // The odd branch between them leaves some sets without equal distances.
    let branches = compare_trees(0..15);
    assert!(branches > 40, "only {branches} branches are computed together");
}

#[test]
#[ignore = "takes a minute: cargo test -p mbd-testing --test code together -- --ignored"]
fn more_random_trees() {
    let branches = compare_trees(15..75);
    assert!(branches > 200, "only {branches} branches are computed together");
}

/// Branches with loops inside of them, on a floating body and on the ground; and loops that close by way of the body, whose rows
/// are solved at other places than in the sweeps: in fast arithmetic only.
#[test]
fn loops_in_branches() {
    compare_loops(0..6);
}

#[test]
#[ignore = "takes half a minute: cargo test -p mbd-testing --test code together -- --ignored"]
fn more_loops_in_branches() {
    compare_loops(6..18);
}

fn compare_loops(seeds: std::ops::Range<u64>) {
    let (mut branches, least) = ([[0; 2]; 3], 2 * seeds.clone().count() / 3);
    for seed in seeds {
        let (numbers, number) = (NUMBERS[seed as usize % 4], seed as usize % 3);
        let on = [On::Trunk, On::Ground, On::TrunkBoth][number];
        let model = with_loops(seed, numbers, on);
        add(&mut branches[number], compare_single(&format!("seed {seed}, {numbers:?}, {on:?}"), &model));
    }
    let [on_trunk, on_ground, both_on_trunk] = branches;
    assert!(on_trunk.iter().chain(&on_ground).all(|n| *n > least), "only {branches:?} branches are computed together");
    assert!(both_on_trunk[0] == 0 && both_on_trunk[1] > least, "{branches:?} branches are computed together");
}

/// Legs whose feet constraints bind to the ground.
#[test]
fn feet_on_the_ground() {
    compare_feet(0..5);
}

#[test]
#[ignore = "takes half a minute: cargo test -p mbd-testing --test code together -- --ignored"]
fn more_feet_on_the_ground() {
    compare_feet(5..25);
}

fn compare_feet(seeds: std::ops::Range<u64>) {
    let (mut branches, least) = ([0; 2], 2 * seeds.clone().count());
    for seed in seeds {
        let numbers = NUMBERS[seed as usize % 4];
        let model = on_feet(seed, numbers);
        add(&mut branches, compare_single(&format!("seed {seed}, {numbers:?}"), &model));
    }
    assert!(branches.iter().all(|n| *n >= least), "only {branches:?} branches are computed together");
}

#[test]
fn legs_of_solo12() {
    let model = wide::model("solo12.urdf", Base::Floating);
    let plan = search::plan(&model, Options::default().searches());
    for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
        let options = options(arithmetic, EliminationStrategy::Fastest);
        assert_eq!(compare("solo12", &model, &plan, &options), 4);
        let (both, straight) = (together(&plan, Output::Rates, &options), trace(&plan, Output::Rates, &options));
        let (both, straight) = (both.expect("legs").program, straight.expect("a program").program);
        let chosen = Options { plan: PlanOptions::default(), ..options };
        assert_eq!(both.pays(&straight, &chosen), Some(Vectors::Any), "the default computes the legs together");
    }
}

/// Legs on the ground and arms on a waist that is in no set: a humanoid that hangs from its pelvis.
#[test]
fn limbs_of_a_hanging_g1() {
    let model = wide::model("g1.urdf", Base::Fixed);
    for elimination in [EliminationStrategy::Single, EliminationStrategy::Fastest] {
        let plan = search::plan(&model, options(Arithmetic::Exact, elimination).plan);
        for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
            let options = options(arithmetic, elimination);
            assert_eq!(compare("g1", &model, &plan, &options), 4, "{elimination:?}, {arithmetic:?}");
        }
    }
}

/// Also the legs and the arms of a humanoid.
#[test]
#[ignore = "takes half a minute: cargo test -p mbd-testing --test code together -- --ignored"]
fn limbs_of_g1() {
    let model = wide::model("g1.urdf", Base::Floating);
    let plan = search::plan(&model, Options::default().searches());
    for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
        assert_eq!(compare("g1", &model, &plan, &options(arithmetic, EliminationStrategy::Fastest)), 4);
    }
}
