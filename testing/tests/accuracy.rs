//! Rewriting for speed does not cost accuracy: exact and fast programs against the same formulas in double-double.
//!
//! The reference is the exact program run on numbers of 106 bits; see `wide` for how errors are measured. Fast programs are
//! run with fused multiply-adds and without.
//!
//! Limits, for every model: the median error at most 2 times, the worst error of all states at most 3 times that of the
//! exact program. Errors below two roundings of the largest result are not compared: there the exact program may be exact
//! by chance.

mod wide;

use mbd_codegen::generate::trace;
use mbd_codegen::import::Base;
use mbd_codegen::plan::Plan;
use mbd_codegen::{Arithmetic, Group, Options};
use mbd_runtime::Scalar;
use mbd_testing::random::{random_model, Knobs};
use mbd_testing::state::random_state;
use wide::{inputs, model, Errors, Wide, MODELS};

/// Compares one output of a plan on many states; gives the ratios of the medians and of the worst errors.
fn compare(name: &str, plan: &Plan, group: Group, states: u64) -> [f64; 2] {
    let program = |arithmetic| {
        let options = Options { arithmetic, ..Options::default() };
        trace(plan, group, &options).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let (exact, fast) = (program(Arithmetic::Exact), program(Arithmetic::Fast));
    let parts = match group {
        Group::Rates => vec![0..plan.dims.nq, plan.dims.nq..exact.program.outputs.len()],
        _ => vec![0..exact.program.outputs.len(); 1],
    };
    // Errors of the exact program, of the fast one with fused operations, and without; part by part.
    let mut errors = vec![[(); 3].map(|()| Errors::default()); parts.len()];
    for seed in 0..states {
        let s = random_state(plan, seed);
        let mut p = vec![0.0; plan.dims.nv];
        s.interpreter(plan).momenta(&s.q, &s.v, &mut p);
        let given = inputs(&exact, &s, &p);
        let wide: Vec<Wide> = given.iter().map(|x| Wide::constant(*x)).collect();
        let reference = exact.program.evaluate(&wide, |a, b, c| a * b + c);
        let plain = |a: f64, b: f64, c: f64| a * b + c;
        let results = [
            exact.program.evaluate(&given, plain),
            fast.program.evaluate(&given, f64::mul_add),
            fast.program.evaluate(&given, plain),
        ];
        for (errors, part) in errors.iter_mut().zip(&parts) {
            for (errors, results) in errors.iter_mut().zip(&results) {
                errors.add(&results[part.clone()], &reference[part.clone()]);
            }
        }
    }
    let mut ratios = [0.0_f64; 2];
    for errors in errors {
        let size = errors[0].typical();
        let [exact, fused, plain] = errors.map(|e| e.sorted());
        // Below this, errors are not compared.
        let median = |e: &[f64]| e[e.len() / 2].max(f64::EPSILON);
        let worst = |e: &[f64]| e[e.len() - 1].max(f64::EPSILON);
        let medians = [&fused, &plain].map(|f| median(f) / median(&exact));
        let worsts = [&fused, &plain].map(|f| worst(f) / worst(&exact));
        println!(
            "{name} {}: size {:.1e} exact {:.1e} (worst {:.1e}); fused times {:.2} ({:.2}), plain times {:.2} ({:.2})",
            group.name(),
            size,
            median(&exact),
            worst(&exact),
            medians[0],
            worsts[0],
            medians[1],
            worsts[1]
        );
        ratios = [ratios[0].max(medians[0]).max(medians[1]), ratios[1].max(worsts[0]).max(worsts[1])];
    }
    ratios
}

fn check(name: &str, plan: &Plan, group: Group, states: u64) {
    let [median, worst] = compare(name, plan, group, states);
    assert!(median <= 2.0, "{name}, {}: the median error is {median:.2} times as large", group.name());
    assert!(worst <= 3.0, "{name}, {}: the worst error is {worst:.2} times as large", group.name());
}

#[test]
fn rates_of_the_models() {
    for (file, base) in MODELS {
        let states = if base == Base::Floating { 400 } else { 1000 };
        check(file, &Plan::new(&model(file, base), Options::default().plan), Group::Rates, states);
    }
}

#[test]
fn every_output_of_random_trees() {
    for seed in 0..20 {
        let model = random_model(seed, &Knobs::everything(seed, 6));
        let plan = Plan::new(&model, Options::default().plan);
        for group in Group::ALL {
            check(&format!("tree {seed}"), &plan, group, 1000);
        }
    }
}
