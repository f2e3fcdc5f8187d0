//! Random models by machine code and by the interpreter, in exact arithmetic: the same bits, except for signs of zeros.
//!
//! The tests run some of them, `cargo run --release -p mbd-testing --example fuzz_machine_code` any number.

use mbd_codegen::jit::{CompileError, Compiled};
use mbd_codegen::options::{EliminationStrategy, LikeBranches, PlanOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::{search, Arithmetic, Options, Output, RolledCode};
use mbd_testing::branches::{tree, NUMBERS};
use mbd_testing::chains::{general, planar};
use mbd_testing::closed::{movable_loops, LoopKnobs};
use mbd_testing::conformance::exact;
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::{random_state, State};

/// Options of the programs of a seed: of five, one has like branches, and one has rolled code.
fn options(seed: u64) -> Options {
    let rolled = if seed % 5 == 2 { RolledCode::Always } else { RolledCode::Auto };
    let plan = PlanOptions { branches: LikeBranches::Together, ..exact(EliminationStrategy::Single, rolled).plan };
    Options { arithmetic: Arithmetic::Exact, plan, ..Options::default() }
}

/// A random mechanism in a random state: of five, one has loops (unless none that is drawn can move), one has like
/// branches, one is a chain.
fn mechanism(seed: u64) -> (Plan, State) {
    let quick = PlanOptions::quick();
    let closed = seed.is_multiple_of(5).then(|| movable_loops(seed, &LoopKnobs::everything(seed, 4))).flatten();
    if let Some(system) = closed {
        return (search::plan(&system.model, quick), system.state);
    }
    let model = match seed % 5 {
        1 => tree(seed, NUMBERS[seed as usize / 5 % NUMBERS.len()]),
        2 if seed.is_multiple_of(2) => general(seed, 3 + seed as usize % 4),
        2 => planar(seed, 3 + seed as usize % 6),
        _ => random_model(seed, &Distribution::everything(seed, 5)),
    };
    let plan = search::plan(&model, quick);
    let state = random_state(&plan, seed);
    (plan, state)
}

/// Compares the rates and one more output of a random model; all outputs take their turns. Returns that output.
///
/// # Panics
/// If bits differ.
pub fn compare(seed: u64) -> Output {
    let (plan, s) = mechanism(seed);
    let mut machine = Compiled::<f64>::from_plan(plan.clone(), options(seed)).expect("options");
    *machine.inputs() = s.interpreter(&plan);
    machine.set_parameters(&s.params);
    let mut interpreter = machine.clone().interpreted();
    let (p, a): (Vec<f64>, _) = (s.v.iter().map(|x| 0.7 * x - 0.1).collect(), vec![0.3; s.v.len()]);
    let has = |output: &Output| *output != Output::ParameterDerivatives;
    let available: Vec<Output> = Output::available(!plan.constraints.is_empty()).filter(has).collect();
    let other = available[(seed / 5) as usize % available.len()];
    for output in [Output::Rates, other] {
        let arguments: Vec<&[f64]> = output.spec().inputs.iter().map(|array| s.inputs(&p, &a)[array.name]).collect();
        let results = |of: &Compiled| output.spec().results.iter().map(|r| vec![0.0; r.len(of.sizes())]).collect();
        let [mut found, mut expected]: [Vec<Vec<f64>>; 2] = [results(&machine), results(&machine)];
        let mut to: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        match machine.evaluate(output, &arguments, &mut to) {
            Err(CompileError::TooLarge { .. }) => continue,
            done => done.unwrap_or_else(|e| panic!("seed {seed}: {output:?}: {e}")),
        }
        let mut to: Vec<&mut [f64]> = expected.iter_mut().map(Vec::as_mut_slice).collect();
        let interpreted = interpreter.evaluate_or_interpret(output, &arguments, &mut to);
        interpreted.unwrap_or_else(|e| panic!("seed {seed}: {output:?}: {e}"));
        let whose = format!("seed {seed}");
        mbd_testing::assert_same_bits(&whose, output.name(), &plan.model, &found.concat(), &expected.concat());
    }
    other
}
