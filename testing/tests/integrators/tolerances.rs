//! Errors at the end of motions with exact solutions, against the tolerance.

use std::fmt::Write;

use mbd_codegen::read::Base;
use mbd_codegen::search;
use mbd_runtime::catalogue::{self, Entry};
use mbd_runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use mbd_runtime::integrate::{Solver, Statistics, Step, StepError, Tolerances};
use mbd_runtime::{Interpreter, System};
use mbd_testing::largest_difference;
use mbd_testing::motions::{Motion, MOTIONS};

/// Length of the runs, s: some tens to some hundreds of radians.
const END: f64 = 10.0;
/// The methods whose error at the end stays within a hundred times the tolerance. The others have no share of their own
/// ([`Stepper::share`](mbd_runtime::integrate::Stepper::share)); their errors fall with the tolerance, too.
const GOOD: [&str; 5] = ["verner9", "dop853", "adams", "gauss16", "radau5"];
const FACTOR: f64 = 100.0;

/// Error at the end of a motion from a state, and the work.
fn run(
    (motion, system): (&Motion, &Interpreter<f64>),
    (q, p): (&Vec<f64>, &Vec<f64>),
    method: &str,
    tolerance: f64,
) -> Result<(f64, Statistics), StepError> {
    let mut system = system.clone();
    let mut method = catalogue::any(method, &system, false).expect("the catalogue has the method");
    if motion.constrained {
        let close = Projection::new(&system, Stabilisation::Mass, Effort::default());
        method = Box::new(WithPostStep::new(&system, method, close));
    }
    let mut solver = Solver::new(&mut system, method, Step::Adaptive(Tolerances::new(tolerance)), 0.0, q, p)?;
    solver.run(&mut system, END)?;
    let (mut q, mut p) = (system.neutral(), system.zero_momenta());
    solver.state(&system, &mut q, &mut p);
    Ok((motion.error(&system, END, &q), solver.statistics()))
}

/// Errors at the end and evaluations for tolerances `10⁻ᵏ`.
fn errors(motion: &Motion, method: &str, exponents: impl Iterator<Item = i32>) -> Vec<(f64, f64, Statistics)> {
    let (system, q, p) = motion.start();
    let one = |k: i32| {
        let tolerance = 10.0_f64.powi(-k);
        let run = run((motion, &system), (&q, &p), method, tolerance);
        let (error, work) = run.unwrap_or_else(|e| panic!("{}, {method}, {tolerance:e}: {e}", motion.name));
        (tolerance, error, work)
    };
    exponents.map(one).collect()
}

/// Adds a line to `wrong` where an error is too large, or does not fall with the tolerance although it is far above it.
fn check(motion: &Motion, method: &str, errors: &[(f64, f64, Statistics)], wrong: &mut Vec<String>) {
    // An implicit step is solved to sixteen roundings of the state, which is of size one.
    let rounding = |work: &Statistics| 16.0 * f64::EPSILON * work.steps as f64;
    for (tolerance, error, work) in errors {
        if GOOD.contains(&method) && *error > FACTOR * tolerance + rounding(work) {
            wrong.push(format!("{}, {method}, {tolerance:e}: {:.0} tolerances", motion.name, error / tolerance));
        }
    }
    // Errors this far below the bound of a hundred tolerances are of either sign and one may happen to be small, so that
    // the next is compared with that of two decades before.
    let decades = if GOOD.contains(&method) { 100.0 } else { 10.0 };
    for (k, (tolerance, error, work)) in errors.iter().enumerate() {
        let before = errors[..k].iter().rfind(|(larger, ..)| larger / tolerance > 0.9 * decades);
        let Some((_, before, _)) = before else { continue };
        if error >= before && *error > 10.0 * tolerance + rounding(work) {
            wrong.push(format!("{}, {method}, {tolerance:e}: {before:e}, then {error:e}", motion.name));
        }
    }
}

/// A few tolerances of the methods above: all of them take minutes.
#[test]
fn errors_stay_within_a_hundred_tolerances() {
    let mut wrong = Vec::new();
    for motion in MOTIONS {
        for method in GOOD {
            let list: &[i32] = if method == "radau5" { &[4, 6] } else { &[4, 6, 8, 10] };
            check(&motion, method, &errors(&motion, method, list.iter().copied()), &mut wrong);
        }
        check(&motion, "rkf45", &errors(&motion, "rkf45", [4, 6].into_iter()), &mut wrong);
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// `gauss16` takes few steps, each of which uses up what it is allowed, and an arm makes errors of the first second grow
/// a hundredfold. Errors of single steps that were estimated too small stopped it at 1e-11 with tolerances of 1e-12 and less.
#[test]
fn gauss16_keeps_its_digits_on_an_arm() {
    let plan = search::plan(&crate::wide::model("ur5.urdf", Base::Fixed), Default::default());
    let system = plan.default_interpreter::<f64>();
    let q: Vec<f64> = (0..6).map(|k| if k % 2 == 0 { 0.3 } else { -0.3 }).collect();
    let mut p = system.zero_momenta();
    system.clone().momenta(&q, &[0.5; 6], &mut p);
    let end = |method: &str, tolerance: f64| {
        let mut system = system.clone();
        let method = catalogue::any(method, &system, false).expect("the catalogue has the method");
        let step = Step::Adaptive(Tolerances::new(tolerance));
        let mut solver = Solver::new(&mut system, method, step, 0.0, &q, &p).expect("a start");
        solver.run(&mut system, 5.0).expect("a motion");
        let (mut q, mut p) = (q.clone(), p.clone());
        solver.state(&system, &mut q, &mut p);
        q
    };
    let right = end("verner9", 1e-14);
    for (tolerance, bound) in [(1e-10, 1e-9), (1e-12, 5e-12), (1e-13, 2e-12)] {
        let off = largest_difference(&end("gauss16", tolerance), &right);
        println!("gauss16 at {tolerance:e}: {off:.1e}");
        assert!(off < bound, "gauss16 at {tolerance:e} errs by {off:e}");
    }
}

/// By how much the motion makes an error at the start grow until the end: the largest error there of a coordinate, in
/// units of a change of one momentum relative to its size, or of one coordinate, as [`Tolerances`] counts them.
fn growth(motion: &Motion) -> f64 {
    let (system, q, p) = motion.start();
    let largest = p.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // Small enough that the motion is linear in it, and far above the tolerance of the runs.
    let change = 1e-7;
    let one = |k: usize| {
        let mut p = p.clone();
        p[k] += change * p[k].abs().max(1e-3 * largest);
        run((motion, &system), (&q, &p), "verner9", 1e-12).map_or(f64::NAN, |(error, _)| error / change)
    };
    let of_momenta = (0..p.len()).map(one).fold(0.0, f64::max);
    // Other coordinates than those of joints with quaternions can be changed one by one.
    let other = |k: usize| {
        let mut q = q.clone();
        q[k] += change;
        run((motion, &system), (&q, &p), "verner9", 1e-12).map_or(f64::NAN, |(error, _)| error / change)
    };
    let plain = if system.quaternions().count() == 0 { q.len() } else { 0 };
    (0..plain).map(other).fold(of_momenta, f64::max)
}

const HEAD: &str = "# Errors against the tolerance

The error at the end divided by the tolerance, and the evaluations of the rates in brackets, of all methods that choose
their steps: motions of 10 s with exact solutions (`testing/src/motions.rs`), `Tolerances::new`. The error is the
largest of a coordinate, rad or m; of a rotation the angle. The growth of a motion is the error at the end in units of a
change of one momentum at the start, relative to its size, or of one coordinate: what becomes of one step that uses up
the tolerance. Where `radau5` takes tens of thousands of steps, its error is round-off of its iteration.

This file is written by

```text
cargo test -p mbd-testing --test integrators all_methods_at_all_tolerances -- --ignored
```
";

/// Run it by `cargo test -p mbd-testing --test integrators all_methods_at_all_tolerances -- --ignored`. It writes
/// `reports/tolerances.md`.
#[test]
#[ignore = "some minutes; writes a report"]
fn all_methods_at_all_tolerances() {
    let (mut text, mut wrong) = (HEAD.to_string(), Vec::new());
    for motion in MOTIONS {
        let _ = write!(text, "\n## {}\n\nGrowth {:.1}.\n\n| method |", motion.name, growth(&motion));
        (4..=12).for_each(|k| text += &format!(" 1e-{k} |"));
        text += &format!("\n|---|{}\n", "---|".repeat(9));
        for Entry { name, .. } in catalogue::entries().filter(|e| e.adaptive) {
            let errors = errors(&motion, name, 4..=12);
            check(&motion, name, &errors, &mut wrong);
            let _ = write!(text, "| {name} |");
            for (tolerance, error, work) in errors {
                let ratio = error / tolerance;
                let digits = usize::from(ratio < 10.0);
                let _ = write!(text, " {ratio:.digits$} ({}) |", work.evaluations);
            }
            text.push('\n');
        }
    }
    println!("{text}");
    std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/../reports/tolerances.md"), text).unwrap();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
