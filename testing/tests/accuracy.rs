//! Rewriting for speed does not cost accuracy: exact and fast programs against the same formulas in double-double.
//!
//! The reference is the exact program run on numbers of 106 bits; sines and cosines are rounded to 53 bits in all three, so
//! that what is compared are the roundings of the algebra. The error of a state is the largest of its results, relative to
//! the largest result of the array it stands in. Fast programs are run with fused multiply-adds and without.
//!
//! Limits, for every model: the median error at most 2 times, the worst error of all states at most 3 times that of the
//! exact program. Errors below two roundings of the largest result are not compared: there the exact program may be exact
//! by chance.

use std::ops::{Add, Div, Mul, Neg, Sub};

use mbd_codegen::generate::{trace, GroupProgram};
use mbd_codegen::import::{load, Base, ImportOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::{Arithmetic, Group, Options};
use mbd_runtime::Scalar;
use mbd_testing::random::{random_model, Knobs};
use mbd_testing::state::{random_state, State};
use twofloat::TwoFloat;

/// A double-double number as a scalar.
#[derive(Clone, Copy)]
struct Wide(TwoFloat);

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl $trait for Wide {
            type Output = Wide;
            fn $name(self, other: Wide) -> Wide {
                Wide($trait::$name(self.0, other.0))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl Neg for Wide {
    type Output = Wide;
    fn neg(self) -> Wide {
        Wide(-self.0)
    }
}

impl Scalar for Wide {
    fn constant(x: f64) -> Self {
        Wide(x.into())
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Scalar::sin_cos(self.0.hi());
        (Self::constant(s), Self::constant(c))
    }
    fn sqrt(self) -> Self {
        Wide(self.0.sqrt())
    }
}

/// Inputs of a program in their order.
fn inputs(group: &GroupProgram, s: &State, p: &[f64]) -> Vec<f64> {
    let array = |name: &str| -> Vec<f64> {
        match name {
            "q" => s.q.clone(),
            "p" => p.to_vec(),
            "v" | "a" => s.v.clone(),
            "self.tau" => s.tau.clone(),
            "self.drive_q" => s.drive[0].clone(),
            "self.drive_v" => s.drive[1].clone(),
            "self.drive_a" => s.drive[2].clone(),
            "self.wrenches" => s.wrenches.concat(),
            "self.params" => s.params.clone(),
            "self.gravity" => s.gravity.to_vec(),
            other => panic!("unknown input {other}"),
        }
    };
    group.inputs.iter().flat_map(|a| array(&a.name)).collect()
}

/// Largest error of the results, relative to the largest in each part.
fn error(results: &[f64], reference: &[Wide], parts: &[usize]) -> f64 {
    let mut worst: f64 = 0.0;
    let mut at = 0;
    for &len in parts {
        let (r, w) = (&results[at..at + len], &reference[at..at + len]);
        at += len;
        let size = w.iter().fold(0.0_f64, |m, x| m.max(x.0.hi().abs()));
        let off = r.iter().zip(w).fold(0.0_f64, |m, (r, w)| m.max((w.0 - TwoFloat::from(*r)).hi().abs()));
        assert!(off.is_finite());
        if size > 0.0 {
            worst = worst.max(off / size);
        }
    }
    worst
}

/// Compares one output of a plan on many states; gives the ratios of the medians and of the worst errors.
fn compare(name: &str, plan: &Plan, group: Group, states: u64) -> [f64; 2] {
    let program = |arithmetic| {
        let options = Options { arithmetic, ..Options::default() };
        trace(plan, group, &options).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let (exact, fast) = (program(Arithmetic::Exact), program(Arithmetic::Fast));
    let parts = match group {
        Group::Rates => vec![plan.dims.nq, plan.dims.nv],
        _ => vec![exact.program.outputs.len()],
    };
    // Errors of the exact program, of the fast one with fused operations, and without.
    let mut errors: [Vec<f64>; 3] = Default::default();
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
        for (errors, results) in errors.iter_mut().zip(&results) {
            errors.push(error(results, &reference, &parts));
        }
    }
    errors.iter_mut().for_each(|e| e.sort_by(f64::total_cmp));
    // Below this, errors are not compared.
    let floor = f64::EPSILON;
    let median = |e: &[f64]| e[e.len() / 2].max(floor);
    let worst = |e: &[f64]| e[e.len() - 1].max(floor);
    let [e, fused, plain] = &errors;
    let medians = [fused, plain].map(|f| median(f) / median(e));
    let worsts = [fused, plain].map(|f| worst(f) / worst(e));
    println!(
        "{name} {}: exact {:.1e} (worst {:.1e}); fused times {:.2} ({:.2}), plain times {:.2} ({:.2})",
        group.name(),
        median(e),
        worst(e),
        medians[0],
        worsts[0],
        medians[1],
        worsts[1]
    );
    [medians[0].max(medians[1]), worsts[0].max(worsts[1])]
}

fn check(name: &str, plan: &Plan, group: Group, states: u64) {
    let [median, worst] = compare(name, plan, group, states);
    assert!(median <= 2.0, "{name}, {}: the median error is {median:.2} times as large", group.name());
    assert!(worst <= 3.0, "{name}, {}: the worst error is {worst:.2} times as large", group.name());
}

#[test]
fn rates_of_the_models() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../models");
    for (file, base, states) in [
        ("double_pendulum.toml", Base::Fixed, 1000),
        ("spherical_pendulum.toml", Base::Fixed, 1000),
        ("satellite.toml", Base::Fixed, 1000),
        ("chain6.toml", Base::Fixed, 1000),
        ("chain10_planar.toml", Base::Fixed, 1000),
        ("ur5.urdf", Base::Fixed, 1000),
        ("panda_arm.urdf", Base::Fixed, 1000),
        ("panda.urdf", Base::Fixed, 500),
        ("iiwa14.urdf", Base::Fixed, 1000),
        ("solo12.urdf", Base::Floating, 500),
        ("g1.urdf", Base::Floating, 200),
    ] {
        let text = std::fs::read_to_string(format!("{root}/{file}")).expect("the model");
        let (model, findings) = load(file, &text, &ImportOptions { base, gravity: None });
        let model = model.unwrap_or_else(|| panic!("{findings}"));
        check(file, &Plan::new(&model, Options::default().plan), Group::Rates, states);
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
