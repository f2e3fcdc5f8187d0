//! Random models by machine code and by the interpreter, in exact arithmetic: the same bits, except for signs of zeros. In
//! single precision, where constants that the generator computes have fewer roundings than those of the interpreter, the
//! program is run operation by operation in the interpreter's place.
//!
//! The tests run some of them, `cargo run --release -p mbd-testing --example fuzz_machine_code` any number.

use mbd_codegen::code::compile;
use mbd_codegen::jit::{self, CompileError, Compiled};
use mbd_codegen::options::{EliminationStrategy, LikeBranches, PlanOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::{search, Arithmetic, Options, Output, Precision, RolledCode};
use mbd_testing::branches::{tree, NUMBERS};
use mbd_testing::chains::{general, planar};
use mbd_testing::closed::{movable_loops, LoopKnobs};
use mbd_testing::conformance::{evaluate, exact};
use mbd_testing::fused::Number;
use mbd_testing::random::{random_model, Distribution, Rng};
use mbd_testing::state::{random_state, State};

/// What is drawn for a seed beside the mechanism.
struct Draw {
    /// Of forty seeds, one has the eliminations with the fewest operations, and one the fastest ones. The search takes most of
    /// the time of these.
    elimination: EliminationStrategy,
    /// One seed of eight is in single precision.
    single: bool,
}

impl Draw {
    fn new(seed: u64) -> Draw {
        let mut rng = Rng::new(seed, 0xf022);
        let elimination = match rng.below(40) {
            0 => EliminationStrategy::Fewest,
            1 => EliminationStrategy::Fastest,
            _ => EliminationStrategy::Single,
        };
        Draw { elimination, single: rng.below(8) == 0 }
    }
}

/// Options of the programs of a seed: of five, one has like branches, and one has rolled code.
fn options<S: jit::Number>(seed: u64) -> Options {
    let rolled = if seed % 5 == 2 { RolledCode::Always } else { RolledCode::Auto };
    let plan = PlanOptions { branches: LikeBranches::Together, ..exact(Draw::new(seed).elimination, rolled).plan };
    Options { arithmetic: Arithmetic::Exact, precision: S::PRECISION, plan, ..Options::default() }
}

/// A random mechanism in a random state: of five, one has loops (unless none that is drawn can move), one has like
/// branches, one is a chain.
fn mechanism(seed: u64) -> (Plan, State) {
    let options = match Draw::new(seed).elimination {
        EliminationStrategy::Single => PlanOptions::quick(),
        elimination => PlanOptions { elimination, ..PlanOptions::default() },
    };
    let closed = seed.is_multiple_of(5).then(|| movable_loops(seed, &LoopKnobs::everything(seed, 4))).flatten();
    if let Some(system) = closed {
        return (search::plan(&system.model, options), system.state);
    }
    let model = match seed % 5 {
        1 => tree(seed, NUMBERS[seed as usize / 5 % NUMBERS.len()]),
        2 if seed.is_multiple_of(2) => general(seed, 3 + seed as usize % 4),
        2 => planar(seed, 3 + seed as usize % 6),
        _ => random_model(seed, &Distribution::everything(seed, 5)),
    };
    let plan = search::plan(&model, options);
    let state = random_state(&plan, seed);
    (plan, state)
}

/// Compares the rates and one more output of a random model; all outputs take their turns. Returns that output.
///
/// # Panics
/// If bits differ.
pub fn compare(seed: u64) -> Output {
    compare_and_count(seed).0
}

/// The same; returns also how many of the two were compared: programs may be too large for machine code.
///
/// # Panics
/// If bits differ.
pub fn compare_and_count(seed: u64) -> (Output, usize) {
    match Draw::new(seed).single {
        true => compare_in::<f32>(seed),
        false => compare_in::<f64>(seed),
    }
}

fn compare_in<S: jit::Number + Number>(seed: u64) -> (Output, usize) {
    let (plan, s) = mechanism(seed);
    let numbers = |list: &[f64]| -> Vec<S> { list.iter().map(|x| S::constant(*x)).collect() };
    let options = options::<S>(seed);
    let mut machine = Compiled::<S>::from_plan(plan.clone(), options.clone()).expect("options");
    *machine.inputs() = s.interpreter_of(&plan, |x, _| S::constant(x));
    machine.set_parameters(&numbers(&s.params));
    let mut interpreter = machine.clone().interpreted();
    let (p, a): (Vec<f64>, _) = (s.v.iter().map(|x| 0.7 * x - 0.1).collect(), vec![0.3; s.v.len()]);
    let has = |output: &Output| *output != Output::ParameterDerivatives;
    let available: Vec<Output> = Output::available(!plan.constraints.is_empty()).filter(has).collect();
    let other = available[(seed / 5) as usize % available.len()];
    let mut count = 0;
    for output in [Output::Rates, other] {
        let given = s.inputs(&p, &a);
        let given: Vec<Vec<S>> = output.spec().inputs.iter().map(|array| numbers(given[array.name])).collect();
        let arguments: Vec<&[S]> = given.iter().map(Vec::as_slice).collect();
        let results = |of: &Compiled<S>| -> Vec<Vec<S>> {
            output.spec().results.iter().map(|r| vec![S::zero(); r.len(of.sizes())]).collect()
        };
        let [mut found, mut expected] = [results(&machine), results(&machine)];
        let mut to: Vec<&mut [S]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        match machine.evaluate(output, &arguments, &mut to) {
            Err(CompileError::TooLarge { .. }) => continue,
            done => done.unwrap_or_else(|e| panic!("seed {seed}: {output:?}: {e}")),
        }
        let expected = match S::PRECISION {
            Precision::F64 => {
                let mut to: Vec<&mut [S]> = expected.iter_mut().map(Vec::as_mut_slice).collect();
                let interpreted = interpreter.evaluate_or_interpret(output, &arguments, &mut to);
                interpreted.unwrap_or_else(|e| panic!("seed {seed}: {output:?}: {e}"));
                expected.concat()
            }
            Precision::F32 => {
                let program = compile(&plan, output, &options).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
                evaluate(&program.program, &numbers(&s.inputs_of(&program.inputs, &p, &a)))
            }
        };
        let whose = format!("seed {seed}, {:?}", S::PRECISION);
        let [found, expected] =
            [found.concat(), expected].map(|all| all.into_iter().map(S::widened).collect::<Vec<f64>>());
        mbd_testing::assert_same_bits(&whose, output.name(), &plan.model, &found, &expected);
        count += 1;
    }
    (other, count)
}
