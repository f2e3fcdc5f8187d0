//! Machine code made at run time against the programs that it was made of, and against the interpreter.
//!
//! In exact arithmetic all give the same bits, except for the signs of zeros: straight-line and rolled code, trees and
//! loops, both precisions. In fast arithmetic machine code gives the bits of its programs, which round products and sums
//! as the processor does.

use std::collections::BTreeSet;
#[cfg(target_arch = "x86_64")]
use std::process::Command;

use mbd_codegen::jit::{best_lanes, CompileError, Compiled, Number};
use mbd_codegen::model::Model;
use mbd_codegen::options::{EliminationStrategy, PlanOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::{search, Arithmetic, Options, Output, Precision, RolledCode};
use mbd_runtime::kernel::{self, Level};
use mbd_runtime::{
    Accelerated, Conjugate, Constrained, Differentiable, Energetic, Interpreter, Packed, Scalar, System,
};
use mbd_testing::chains::general;
use mbd_testing::closed::{random_loops, LoopKnobs};
use mbd_testing::conformance::{chain, closed, exact, fast, sampled, tree, Case, Run};
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::relative_error;
use mbd_testing::state::{random_state, State};
use mbd_testing::toml::to_toml;

use crate::fuzzed;

/// Machine code of a plan with the inputs of a state.
pub fn compiled<S: Number>(plan: &Plan, options: &Options, s: &State) -> Compiled<S> {
    let mut compiled = Compiled::from_plan(plan.clone(), options.clone()).expect("options");
    *compiled.inputs() = s.interpreter_of(plan, |x, _| S::constant(x));
    // Keeps the other inputs.
    compiled.set_parameters(&s.params.iter().map(|x| S::constant(*x)).collect::<Vec<S>>());
    compiled
}

/// What machine code of a case must give on this processor.
fn runs(case: &Case) -> Vec<Run> {
    match kernel::level() {
        Level::Plain => case.runs(),
        _ => case.fused_runs(),
    }
}

/// Numbers of outputs.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    compared: usize,
    /// Those of several states at once.
    in_lanes: usize,
    /// Those that were not compared, because they are too large for machine code.
    too_large: usize,
    /// Those that are rolled, each seed counted once.
    rolled: usize,
}

impl Counts {
    fn add(&mut self, other: Counts) {
        self.compared += other.compared;
        self.in_lanes += other.in_lanes;
        self.too_large += other.too_large;
        self.rolled += other.rolled;
    }

    /// Asserts that so many outputs were compared, also of several states at once, and that hardly any was too large.
    #[track_caller]
    fn suffice(self, least: usize) {
        println!("{self:?}");
        assert!(self.compared >= least && self.too_large * 20 <= self.compared, "{self:?}");
        assert!(self.in_lanes >= least / 2 || best_lanes() < 4, "{self:?}");
    }
}

/// Every output of a case by machine code and by its program.
fn compare<S: Number>(case: &Case) -> Counts {
    let mut machine = compiled::<S>(&case.plan, &case.options, &case.state);
    let mut counts = Counts::default();
    for run in runs(case) {
        let given: Vec<Vec<S>> =
            run.arrays().into_iter().map(|array| array.iter().map(|x| S::constant(*x)).collect()).collect();
        let arguments = given.iter().zip(&run.inputs).filter(|(_, array)| !array.field);
        let arguments: Vec<&[S]> = arguments.map(|(given, _)| &given[..]).collect();
        // Memory that was used before must not matter.
        let mut found: Vec<Vec<S>> = run.lengths.iter().map(|len| vec![S::constant(f64::NAN); *len]).collect();
        let mut results: Vec<&mut [S]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        match machine.evaluate(run.output, &arguments, &mut results) {
            Err(CompileError::TooLarge { .. }) => {
                counts.too_large += 1;
                continue;
            }
            result => result.unwrap_or_else(|e| panic!("{}: {:?}: {e}", case.name, run.output)),
        }
        let found: Vec<f64> = found.concat().into_iter().map(|x| x.to_f64()).collect();
        run.check(&format!("{}\n{}", case.name, to_toml(&case.plan.model)), &found);
        counts.compared += 1;
        counts.rolled += usize::from(run.rolled);
    }
    counts
}

/// The same of as many states at once as a vector of some length has doubles.
fn compare_lanes<const L: usize>(case: &Case) -> Counts {
    let machine = compiled::<f64>(&case.plan, &case.options, &case.state);
    let (mut counts, runs) = (Counts::default(), runs(case));
    let mut lanes = match machine.lanes::<L>() {
        Err(CompileError::TooLarge { .. }) => return Counts { too_large: runs.len(), ..counts },
        lanes => lanes.unwrap_or_else(|e| panic!("{}: {e}", case.name)),
    };
    for run in runs {
        let packed = |array: &[f64]| -> Vec<Packed<L>> { array.iter().map(|x| Packed::constant(*x)).collect() };
        let given: Vec<Vec<Packed<L>>> = run.arrays().into_iter().map(packed).collect();
        let arguments = given.iter().zip(&run.inputs).filter(|(_, array)| !array.field);
        let arguments: Vec<&[Packed<L>]> = arguments.map(|(given, _)| &given[..]).collect();
        let mut found: Vec<Vec<Packed<L>>> =
            run.lengths.iter().map(|len| vec![Packed::constant(f64::NAN); *len]).collect();
        let mut results: Vec<&mut [Packed<L>]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        match lanes.evaluate(run.output, &arguments, &mut results) {
            Err(CompileError::TooLarge { .. }) => {
                counts.too_large += 1;
                continue;
            }
            result => result.unwrap_or_else(|e| panic!("{}: {:?}: {e}", case.name, run.output)),
        }
        let found = found.concat();
        for lane in 0..L {
            let found: Vec<f64> = found.iter().map(|x| x.0[lane]).collect();
            let whose = format!("{}, lane {lane} of {L}\n{}", case.name, to_toml(&case.plan.model));
            run.check(&whose, &found);
        }
        counts.in_lanes += 1;
    }
    counts
}

/// Compares the cases of some seeds.
fn compare_all(case: fn(u64) -> Case, seeds: u64) -> Counts {
    let names: BTreeSet<String> = (0..seeds).map(|seed| case(seed).name).collect();
    let mut all = Counts::default();
    for case in sampled(case, seeds) {
        let mut counts = match case.options.precision {
            Precision::F64 => {
                if best_lanes() >= 4 {
                    all.add(compare_lanes::<4>(&case));
                }
                if best_lanes() >= 8 {
                    all.add(compare_lanes::<8>(&case));
                }
                compare::<f64>(&case)
            }
            Precision::F32 => compare::<f32>(&case),
        };
        counts.rolled *= usize::from(names.contains(&case.name));
        all.add(counts);
    }
    all
}

#[test]
fn trees() {
    compare_all(tree, 24).suffice(450);
}

#[test]
fn loops() {
    compare_all(closed, 12).suffice(300);
}

#[test]
fn rolled_code() {
    let counts = compare_all(chain, 12);
    counts.suffice(240);
    assert!(counts.rolled > 60, "{counts:?}");
}

#[test]
fn fast_arithmetic() {
    let mut all = Counts::default();
    for case in fast() {
        match case.options.precision {
            Precision::F64 => {
                match best_lanes() {
                    0..4 => {}
                    4..8 => all.add(compare_lanes::<4>(&case)),
                    8.. => all.add(compare_lanes::<8>(&case)),
                }
                all.add(compare::<f64>(&case));
            }
            Precision::F32 => all.add(compare::<f32>(&case)),
        }
    }
    all.suffice(75);
}

/// The environment variable that tells [`at_a_lower_level`] the level.
#[cfg(target_arch = "x86_64")]
const LEVEL: &str = "MBD_TEST_LEVEL";

/// Processors with fewer instructions than this one: other machine code, with fewer registers or by Cranelift. The level holds
/// for a whole program, so that each has one of its own.
#[test]
#[cfg(target_arch = "x86_64")]
fn lower_levels() {
    for level in [Level::Fused, Level::Plain].into_iter().filter(|level| *level < kernel::level()) {
        let program = std::env::current_exe().expect("this program has a path");
        let run = Command::new(program)
            .args(["--exact", "machine_code::at_a_lower_level", "--ignored", "--nocapture"])
            .env(LEVEL, format!("{level:?}"))
            .output()
            .expect("this program starts");
        let [out, err] = [&run.stdout, &run.stderr].map(|text| String::from_utf8_lossy(text));
        assert!(run.status.success() && out.contains("1 passed"), "{level:?}:\n{out}{err}");
    }
}

#[test]
#[cfg(target_arch = "x86_64")]
#[ignore = "`lower_levels` runs it, with the level in the environment"]
fn at_a_lower_level() {
    let Ok(wanted) = std::env::var(LEVEL) else { return };
    let most = if wanted == "Plain" { Level::Plain } else { Level::Fused };
    assert_eq!(kernel::limit_level(most), most);
    compare_all(tree, 10).suffice(100);
    compare_all(closed, 5).suffice(60);
    compare_all(chain, 4).suffice(40);
    for case in [tree(5).fast(), chain(7).fast()] {
        assert!(compare::<f64>(&case).compared > 5, "{}", case.name);
    }
    (1150..1170).for_each(|seed| {
        fuzzed::compare(seed);
    });
}

/// The functions of the traits by machine code in exact arithmetic and by the interpreter.
fn compare_traits(whose: &str, plan: &Plan, s: &State) {
    let options = exact(EliminationStrategy::Fastest, RolledCode::Auto);
    let (mut c, mut i) = (compiled::<f64>(plan, &options, s), s.interpreter(plan));
    let check = |what: &str, found: &[f64], expected: &[f64]| {
        mbd_testing::assert_same_bits(whose, what, &plan.model, found, expected);
    };
    let state = || (zeros(plan.dims.nq), zeros(plan.dims.nv), zeros(plan.dims.nv));
    let (q, (mut p, mut p2)) = (&s.q, (zeros(plan.dims.nv), zeros(plan.dims.nv)));
    c.conjugate_momenta(q, &s.v, &mut p);
    i.conjugate_momenta(q, &s.v, &mut p2);
    check("momenta", &p, &p2);
    let ((mut qd, mut pd, mut a), (mut qd2, mut pd2, mut a2)) = (state(), state());
    c.rates_at(0.0, q, &p, &mut qd, &mut pd);
    i.rates_at(0.0, q, &p, &mut qd2, &mut pd2);
    check("rates", &[&qd[..], &pd].concat(), &[&qd2[..], &pd2].concat());
    c.coordinate_rates(q, &s.v, &mut qd);
    i.coordinate_rates(q, &s.v, &mut qd2);
    check("coordinate rates", &qd, &qd2);
    c.generalized_accelerations(q, &s.v, &mut a);
    i.generalized_accelerations(q, &s.v, &mut a2);
    check("accelerations", &a, &a2);
    let (e, e2) = (c.energies(q, &p), i.energies(q, &p));
    check("energy", &[e.0, e.1], &[e2.0, e2.1]);
    let (mut d, mut d2) = (c.zero_derivatives(), i.zero_derivatives());
    c.rate_derivatives(0.0, q, &p, &mut d);
    i.rate_derivatives(0.0, q, &p, &mut d2);
    for (to, from) in d.blocks_mut().into_iter().flatten().zip(d2.blocks_mut().into_iter().flatten()) {
        check("derivatives", &to.concat(), &from.concat());
    }
    if plan.constraints.is_empty() {
        return;
    }
    let ([mut r, mut r2], [mut g, mut g2]) = ([c.zero_rows(), i.zero_rows()], [c.zero_entries(), i.zero_entries()]);
    c.constraint_residuals(q, &mut r, &mut g);
    i.constraint_residuals(q, &mut r2, &mut g2);
    check("residuals", &[&r[..], &g].concat(), &[&r2[..], &g2].concat());
    c.project_momenta(0.0, q, &mut p, &mut a, &mut r);
    i.project_momenta(0.0, q, &mut p2, &mut a2, &mut r2);
    check("projection", &[&p[..], &a, &r].concat(), &[&p2[..], &a2, &r2].concat());
    let (mut x, mut x2) = (c.zero_rows(), i.zero_rows());
    c.position_correction(q, &mut r, &mut a, &mut x);
    i.position_correction(q, &mut r2, &mut a2, &mut x2);
    check("correction", &[&r[..], &a, &x].concat(), &[&r2[..], &a2, &x2].concat());
    c.multipliers(0.0, q, &s.v, &mut r);
    i.multipliers(0.0, q, &s.v, &mut r2);
    check("multipliers", &r, &r2);
}

/// New parameters count from the next call on: in machine code of one state and of each lane, whose angles may be large, and in
/// the interpreter, which is made anew when it has to compute something.
#[test]
fn parameters_change_between_calls() {
    let outputs = [Output::Rates, Output::Momenta, Output::Accelerations];
    let distribution = Distribution { bodies: (2, 6), params: 0.5, ..Distribution::default() };
    let mut changed = 0;
    for seed in 0..3 {
        let model = random_model(seed, &distribution);
        for options in [exact(EliminationStrategy::Fastest, RolledCode::Auto), Options::default()] {
            let plan = search::plan(&model, options.plan);
            let s = random_state(&plan, seed);
            let params = |k: usize| s.params.iter().map(|x| x * (1.0 + 0.1 * k as f64)).collect::<Vec<f64>>();
            let mut kept = compiled::<f64>(&plan, &options, &s);
            let mut lanes = kept.lanes::<2>().expect("machine code");
            for round in 0..3 {
                let given: [Vec<f64>; 2] = [params(round), params(2 * round + 1)];
                given.iter().enumerate().for_each(|(lane, row)| lanes.set_field(lane, 5, row));
                for output in outputs {
                    let spec = output.spec();
                    let mut q = s.q.clone();
                    if round == 1 && kept.lie_joints().is_empty() {
                        q[0] = 1e9;
                    }
                    let arguments: Vec<&[f64]> = vec![&q, &s.v];
                    let expected = given.each_ref().map(|row| {
                        let mut fresh = compiled::<f64>(&plan, &options, &s);
                        fresh.set_parameters(row);
                        results_of(&mut fresh, output, &arguments)
                    });
                    kept.set_parameters(&given[1]);
                    assert_eq!(results_of(&mut kept, output, &arguments), expected[1], "seed {seed}, {output:?}");
                    if options.arithmetic == Arithmetic::Exact {
                        let interpreted = interpreted_results_of(&mut kept, output, &arguments);
                        assert_eq!(interpreted, expected[1], "seed {seed}, {output:?}, interpreted");
                    }
                    let packed = arguments.iter().map(|x| x.iter().map(|x| Packed([*x; 2])).collect::<Vec<_>>());
                    let packed: Vec<_> = packed.collect();
                    let packed: Vec<&[Packed<2>]> = packed.iter().map(|x| &x[..]).collect();
                    let lengths = spec.results.iter().map(|r| r.len(kept.sizes()));
                    let mut found: Vec<Vec<Packed<2>>> = lengths.map(|len| vec![Packed([0.0; 2]); len]).collect();
                    let mut places: Vec<&mut [Packed<2>]> = found.iter_mut().map(Vec::as_mut_slice).collect();
                    lanes.evaluate(output, &packed, &mut places).expect("machine code");
                    for (lane, expected) in expected.iter().enumerate() {
                        let found: Vec<f64> = found.concat().iter().map(|x| x.0[lane]).collect();
                        assert_eq!(&found, expected, "seed {seed}, {output:?}, lane {lane}");
                    }
                    changed += usize::from(expected[0] != expected[1]);
                }
            }
        }
    }
    assert!(changed > 25, "parameters changed {changed} results");
}

/// All results of an output, one after the other.
fn results_of(machine: &mut Compiled, output: Output, arguments: &[&[f64]]) -> Vec<f64> {
    let lengths = output.spec().results.iter().map(|r| r.len(machine.sizes()));
    let mut found: Vec<Vec<f64>> = lengths.map(zeros).collect();
    let mut places: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
    machine.evaluate(output, arguments, &mut places).expect("machine code");
    found.concat()
}

/// The same by the interpreter, through a clone.
fn interpreted_results_of(machine: &mut Compiled, output: Output, arguments: &[&[f64]]) -> Vec<f64> {
    let mut machine = machine.clone().interpreted();
    let lengths = output.spec().results.iter().map(|r| r.len(machine.sizes()));
    let mut found: Vec<Vec<f64>> = lengths.map(zeros).collect();
    let mut places: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
    machine.evaluate_or_interpret(output, arguments, &mut places).expect("the interpreter");
    found.concat()
}

#[test]
fn many_models() {
    let compared: usize = (1000..1150).map(|seed| fuzzed::compare_and_count(seed).1).sum();
    assert!(compared >= 290, "{compared} of 300 outputs");
}

/// The interpreter in place of machine code that is not to be had, by every output of a tree and of loops.
#[test]
fn outputs_without_machine_code_are_interpreted() {
    let closed = random_loops(3, &LoopKnobs::plain());
    let open = random_model(3, &Distribution { bodies: (4, 4), ..Distribution::default() });
    let open = search::plan(&open, PlanOptions::quick());
    let closed = (search::plan(&closed.model, PlanOptions::quick()), closed.state);
    for (plan, s) in [(open.clone(), random_state(&open, 3)), closed] {
        let options = exact(EliminationStrategy::Single, RolledCode::Auto);
        let mut c = compiled::<f64>(&plan, &options, &s);
        let mut without = c.clone().interpreted();
        let constrained = !plan.constraints.is_empty();
        for output in Output::available(constrained) {
            let inputs = s.inputs(&s.v, &s.v);
            let arguments: Vec<&[f64]> = output.spec().inputs.iter().map(|array| inputs[array.name]).collect();
            let lengths: Vec<usize> = output.spec().results.iter().map(|r| r.len(c.sizes())).collect();
            let results = || lengths.iter().map(|len| zeros(*len)).collect::<Vec<_>>();
            let (mut by_code, mut by_interpreter, mut wrong) = (results(), results(), zeros(lengths[0] + 1));
            let mut to: Vec<&mut [f64]> = by_code.iter_mut().map(Vec::as_mut_slice).collect();
            c.evaluate(output, &arguments, &mut to).expect("machine code");
            let mut to: Vec<&mut [f64]> = by_interpreter.iter_mut().map(Vec::as_mut_slice).collect();
            without.evaluate_or_interpret(output, &arguments, &mut to).expect("the interpreter");
            let (found, expected) = (by_interpreter.concat(), by_code.concat());
            mbd_testing::assert_same_bits("without machine code", output.name(), &plan.model, &found, &expected);
            let error = without.evaluate_or_interpret(output, &arguments, &mut [&mut wrong]);
            assert!(matches!(error, Err(CompileError::Arrays { .. })), "{output:?}: {error:?}");
        }
        let rows = without.evaluate_or_interpret(Output::Multipliers, &[&s.q, &s.v], &mut [&mut zeros(plan.dims.rows)]);
        assert_eq!(rows.is_ok(), constrained, "multipliers without constraints: {rows:?}");
    }
}

fn zeros(n: usize) -> Vec<f64> {
    vec![0.0; n]
}

#[test]
fn traits_have_the_bits_of_the_interpreter() {
    for seed in 0..6 {
        let model = random_model(seed, &Distribution { bodies: (2, 6), ..Distribution::default() });
        let plan = search::plan(&model, PlanOptions::default());
        compare_traits(&format!("seed {seed}"), &plan, &random_state(&plan, seed));
        let system = random_loops(seed, &LoopKnobs::plain());
        let plan = search::plan(&system.model, PlanOptions::default());
        compare_traits(&format!("loops, seed {seed}"), &plan, &system.state);
    }
}

/// Rewritten and fused operations round differently. The tolerance, relative to the largest result, allows for a few
/// hundred roundings and for their growth by the condition of the inertia, which is below 1e3 here.
#[test]
fn fast_code_is_as_accurate() {
    for seed in 0..30 {
        let model = random_model(seed, &Distribution { bodies: (2, 9), ..Distribution::default() });
        let exact = exact(EliminationStrategy::Fastest, RolledCode::Auto);
        let fast = Options { arithmetic: Arithmetic::Fast, ..exact };
        let plan = search::plan(&model, fast.plan);
        let s = random_state(&plan, seed);
        let (mut c, mut i): (Compiled, Interpreter<f64>) = (compiled(&plan, &fast, &s), s.interpreter(&plan));
        let (mut a, mut a2) = (zeros(s.v.len()), zeros(s.v.len()));
        c.generalized_accelerations(&s.q, &s.v, &mut a);
        i.generalized_accelerations(&s.q, &s.v, &mut a2);
        let off = relative_error(&a, &a2, 1.0);
        assert!(off <= 1e-11, "seed {seed}: {off:e}\n{}", to_toml(&model));
    }
}

/// Angles beyond the range of the main path of sine and cosine, alone and among small ones, in straight-line and rolled
/// code and of like branches: exact code has the bits of the interpreter, and fast code differs by roundings.
#[test]
fn large_angles() {
    let models: Vec<(Model, RolledCode)> = (0..12)
        .map(|seed| {
            (random_model(seed, &Distribution { bodies: (2, 9), ..Distribution::default() }), RolledCode::Never)
        })
        .chain((0..4).map(|seed| (general(seed, 9), RolledCode::Always)))
        .collect();
    for (seed, (model, rolled)) in models.iter().enumerate() {
        let options = exact(EliminationStrategy::Fastest, *rolled);
        let plan = search::plan(model, options.plan);
        let s = random_state(&plan, seed as u64);
        let fast = Options { arithmetic: Arithmetic::Fast, ..options.clone() };
        let [mut c, mut f] = [&options, &fast].map(|options| compiled::<f64>(&plan, options, &s));
        let mut i = s.interpreter(&plan);
        // Quaternions stay as they are.
        let angles: Vec<usize> = match i.lie_joints().is_empty() {
            true => (0..plan.dims.nq).collect(),
            false => continue,
        };
        for k in angles {
            let mut q = s.q.clone();
            q[k] = 3.0e6 + 0.1 * k as f64;
            let [mut a, mut a2, mut a3] = [0; 3].map(|_| zeros(s.v.len()));
            c.generalized_accelerations(&q, &s.v, &mut a);
            f.generalized_accelerations(&q, &s.v, &mut a2);
            i.generalized_accelerations(&q, &s.v, &mut a3);
            mbd_testing::assert_same_bits("large angles", "accelerations", model, &a, &a3);
            // As above; a coordinate that is a length of that size makes the inertia worse by its square.
            let off = relative_error(&a2, &a3, 1.0);
            assert!(off <= 1e-3, "{seed}: {off:e}\n{}", to_toml(model));
        }
    }
}

/// `n` bodies side by side, without a run of links that code could be rolled over.
fn comb(n: usize) -> Model {
    let mut model = random_model(3, &Distribution { bodies: (n, n), ..Distribution::default() });
    model.joints.iter_mut().for_each(|joint| joint.parent = None);
    model
}

#[test]
fn large_mechanisms_are_interpreted() {
    let options = exact(EliminationStrategy::Single, RolledCode::Auto);
    let model = comb(1400);
    let mut c = Compiled::<f64>::new(&model, &options).expect("options");
    let error = c.prepare(Output::Rates).expect_err("so many bodies");
    assert!(matches!(error, CompileError::TooLarge { output: Output::Rates, .. }), "{error:?}");
    let mut i = c.plan().interpreter(&c.plan().default_params());
    let (q, p) = (c.neutral(), vec![0.1; c.plan().dims.nv]);
    let [mut qd, mut pd, mut qd2, mut pd2] = [0; 4].map(|_| zeros(p.len()));
    (qd, qd2) = (vec![0.0; q.len()], {
        qd2.resize(q.len(), qd[0]);
        qd2
    });
    c.rates_at(0.0, &q, &p, &mut qd, &mut pd);
    i.rates_at(0.0, &q, &p, &mut qd2, &mut pd2);
    assert_eq!((qd, pd), (qd2, pd2));
}

#[test]
fn wrong_arrays_are_refused() {
    let model = random_model(1, &Distribution { bodies: (3, 3), ..Distribution::default() });
    let mut c = Compiled::<f64>::new(&model, &Options::default()).expect("options");
    let (q, mut m) = (c.neutral(), vec![0.0; 2]);
    let error = c.evaluate(Output::MassMatrix, &[&q], &mut [&mut m]).expect_err("too short");
    let nv = c.plan().dims.nv;
    assert_eq!(
        error.to_string(),
        format!("`mass_matrix`: its results have the lengths [{}], and [2] were given", nv * nv)
    );
    let error = c.evaluate(Output::Multipliers, &[&q, &q], &mut [&mut m]).expect_err("no constraints");
    assert!(error.to_string().contains("loops or couplings"), "{error}");
}

#[test]
fn threads_share_the_code() {
    let model = random_model(5, &Distribution { bodies: (6, 6), ..Distribution::default() });
    let c = Compiled::<f64>::new(&model, &Options::default()).expect("options");
    let (q, p) = (c.neutral(), c.zero_momenta());
    let rates = |mut c: Compiled<f64>| {
        let (mut qd, mut pd) = (c.neutral(), c.zero_momenta());
        (0..100).for_each(|_| c.rates_at(0.0, &q, &p, &mut qd, &mut pd));
        (qd, pd)
    };
    std::thread::scope(|scope| {
        let all: Vec<_> = (0..4).map(|_| c.clone()).map(|c| scope.spawn(|| rates(c))).collect();
        let all: Vec<_> = all.into_iter().map(|thread| thread.join().expect("no thread panics")).collect();
        assert!(all.windows(2).all(|pair| pair[0] == pair[1]));
    });
}
