//! Rewriting for speed does not cost accuracy: exact and fast programs are compared with the same formulas in
//! double-double.
//!
//! The reference is the exact program run on numbers of 106 bits; see `wide` for how errors are measured. Fast programs
//! are run with fused multiply-adds and without.
//!
//! Limits, for every model: the median error is at most 2 times that of the exact program, and the error that 99 of 100
//! states stay below at most 3 times. Errors below two roundings of the largest result are not compared: there the
//! exact program may be exact by chance.

use crate::wide::{model, Errors, Spread, Wide, MODELS};
use mbd_codegen::generate::trace;
use mbd_codegen::plan::Plan;
use mbd_codegen::read::Base;
use mbd_codegen::search;
use mbd_codegen::{Arithmetic, Options, Output};
use mbd_runtime::Scalar;
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::random_state;

/// Compares one output of a plan on many states; gives the ratios of the medians and of the worst errors.
fn compare(name: &str, plan: &Plan, output: Output, states: u64) -> Spread {
    let program = |arithmetic| {
        let options = Options { arithmetic, ..Options::default() };
        trace(plan, output, &options).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let (exact, fast) = (program(Arithmetic::Exact), program(Arithmetic::Fast));
    let parts = match output {
        Output::Rates => vec![0..plan.dims.nq, plan.dims.nq..exact.program.outputs.len()],
        _ => vec![0..exact.program.outputs.len(); 1],
    };
    // For each part: errors of the exact program, of the fast one with fused operations, and of the fast one without.
    let mut errors = vec![[(); 3].map(|()| Errors::default()); parts.len()];
    for seed in 0..states {
        let s = random_state(plan, seed);
        let mut p = vec![0.0; plan.dims.nv];
        s.interpreter(plan).momenta(&s.q, &s.v, &mut p);
        let given = s.inputs_of(&exact.inputs, &p, &s.v);
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
    let mut worst = Spread { median: 0.0, worst: 0.0 };
    for errors in errors {
        let [exact, fused, plain] = errors.each_ref().map(Spread::new);
        let [fused, plain] = [fused, plain].map(|s| s.times(exact));
        println!(
            "{name} {}: size {:.1e}, exact {:.1e} (worst {:.1e}); fused times {:.2} ({:.2}), plain times {:.2} ({:.2})",
            output.name(),
            errors[0].typical(),
            exact.median,
            exact.worst,
            fused.median,
            fused.worst,
            plain.median,
            plain.worst
        );
        worst = worst.larger(fused).larger(plain);
    }
    worst
}

fn check(name: &str, plan: &Plan, output: Output, states: u64) {
    let times = compare(name, plan, output, states);
    assert!(times.within_limits(), "{name}, {}: errors are {times:.2?} times as large", output.name());
}

#[test]
fn rates_of_the_models() {
    for (file, base) in MODELS {
        let states = if base == Base::Floating { 400 } else { 1000 };
        check(file, &search::plan(&model(file, base), Options::default().plan), Output::Rates, states);
    }
}

#[test]
fn every_output_of_random_trees() {
    for seed in 0..8 {
        let model = random_model(seed, &Distribution::everything(seed, 6));
        let plan = search::plan(&model, Options::default().plan);
        for output in Output::available(false) {
            check(&format!("tree {seed}"), &plan, output, 600);
        }
    }
}
