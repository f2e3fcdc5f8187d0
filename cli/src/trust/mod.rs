//! `mbd simulate --trust`: the motion once more with smaller errors, the growth of errors, and what is left of the
//! digits.

mod report;
mod tangent;

use std::fmt::Display;
use std::io::Write;

use multibody::codegen::plan::Plan;
use multibody::runtime::catalogue::{self, BoxedMethod};
use multibody::runtime::constrained::{Effort, Projection, WithPostStep};
use multibody::runtime::integrate::{Radau5, Solver, Step, StepError, Tolerances, Verner9};
use multibody::runtime::wide::Wide;
use multibody::runtime::{Constrained, Differentiable, Interpreter, Real, Scalar, System};

use super::args::Trust;
use super::displacement::displacement;
use super::motion::{interpreter, momenta, simulate, Driver, Record, Settings};
use super::{Failure, Outcome};
use report::Findings;

/// By what the tolerance of the second run is smaller; a fixed step is divided by [`FINER`].
const TENTH: f64 = 0.1;
const FINER: f64 = 4.0;
/// Tolerance of the second run in double-double numbers, where steps are fixed and there is none to go by.
const WIDE_TOLERANCE: f64 = 1e-15;
/// Residual, m and rad, at which loops count as closed in double-double numbers.
const WIDE_CLOSED: f64 = 1e-26;

/// Errors of a run at the times of its rows: displacement (rad, m; rotations as a vector in outer axes) and velocities.
struct Errors {
    /// Displacements from the run to the better one.
    x: Vec<Vec<f64>>,
    /// Errors of the velocities at the end.
    v: Vec<f64>,
    /// What the run was compared with.
    with: String,
}

/// Runs the motion of a record again, and reports. Returns whether digits are left at the end.
pub fn run(plan: &Plan, settings: &Settings, record: &Record, how: Trust, out: &mut dyn Write) -> Outcome<bool> {
    let errors = match how {
        Trust::Tenth => again(plan, settings, record)?,
        Trust::Wide => wide(plan, settings, record)?,
    };
    let growth = match settings.control {
        None => tangent::growth(plan, settings, record).map_err(|e| e.to_string()),
        Some(_) => Err("the tangent flow does not know the control".to_string()),
    };
    let findings = Findings::new(plan, record, &errors, growth.as_ref().ok());
    let shown = growth.as_ref().map_err(|e| e as &dyn Display);
    findings.write(plan, record, &errors, shown, out)?;
    Ok(findings.some_left())
}

/// The second run by the same method.
fn again(plan: &Plan, settings: &Settings, record: &Record) -> Outcome<Errors> {
    let (step, with) = match settings.step {
        Step::Fixed(h) => (Step::Fixed(h / FINER), format!("steps of {} s", h / FINER)),
        Step::Adaptive(tolerances) => {
            let finer = scaled(tolerances, TENTH);
            (Step::Adaptive(finer), format!("tolerance {:.1e}", finer.rotations))
        }
    };
    let start = (record.q[0].clone(), record.v[0].clone());
    let better = simulate(plan, start, &Settings { step, ..settings.clone() }).map_err(|e| match e {
        Failure::Message(what, help) => Failure::new(format!("--trust, at {with}: {what}"), help),
        other => other,
    })?;
    let rows = better.q.iter().zip(&better.p);
    Ok(errors(plan, record, rows, better.v.last(), with))
}

/// The second run in double-double numbers.
fn wide(plan: &Plan, settings: &Settings, record: &Record) -> Outcome<Errors> {
    let tolerances = match settings.step {
        Step::Fixed(_) => Tolerances::new(WIDE_TOLERANCE),
        Step::Adaptive(tolerances) => scaled(tolerances, TENTH),
    };
    let mut system = interpreter::<Wide>(plan);
    let of = |x: &[f64]| x.iter().map(|x| Wide::constant(*x)).collect::<Vec<Wide>>();
    let q = of(&record.q[0]);
    let p = momenta(&mut system, &q, &of(&record.v[0]));
    let (mut rows, mut v) = (Vec::new(), system.zero_momenta());
    let ran = sample(&mut system, (&q, &p), tolerances, settings, WIDE_CLOSED, &record.t, |system, q, p| {
        system.velocities(q, p, &mut v);
        rows.push((q.iter().map(|x| x.to_f64()).collect(), p.iter().map(|x| x.to_f64()).collect()));
    });
    ran.map_err(|e| Failure::new(format!("--trust wide: {e}"), "lower --time, or take --trust without `wide`"))?;
    let v: Vec<f64> = v.iter().map(|x| x.to_f64()).collect();
    let with = format!("tolerance {:.1e} in double-double numbers", tolerances.rotations);
    Ok(errors(plan, record, rows.iter().map(|(q, p)| (q, p)), Some(&v), with))
}

/// Tolerances times a factor.
fn scaled(mut tolerances: Tolerances, factor: f64) -> Tolerances {
    let parts = [&mut tolerances.coordinates, &mut tolerances.momenta];
    parts.into_iter().for_each(|t| (t.absolute, t.relative) = (t.absolute * factor, t.relative * factor));
    tolerances.rotations *= factor;
    tolerances
}

/// The errors of a record against the rows of a better one.
fn errors<'a>(
    plan: &Plan,
    record: &Record,
    rows: impl Iterator<Item = (&'a Vec<f64>, &'a Vec<f64>)>,
    v: Option<&Vec<f64>>,
    with: String,
) -> Errors {
    let system = interpreter::<f64>(plan);
    let own = record.q.iter().zip(&record.p);
    let x = own.zip(rows).map(|(own, better)| displacement(&system, own, better)).collect();
    let last = record.v.last().into_iter().flatten();
    let v = last.zip(v.into_iter().flatten()).map(|(a, b)| (a - b).abs()).collect();
    Errors { x, v, with }
}

/// Runs from a state through given times, the first of which is zero, and looks at the state at each of them.
fn sample<S: Real>(
    system: &mut Interpreter<S>,
    (q, p): (&Vec<S>, &Vec<S>),
    tolerances: Tolerances,
    settings: &Settings,
    closed: f64,
    times: &[f64],
    mut look: impl FnMut(&mut Interpreter<S>, &Vec<S>, &Vec<S>),
) -> Result<(), StepError> {
    let (mut q, mut p) = (q.clone(), p.clone());
    let mut driver = driver(system, (&q, &p), tolerances, settings, closed)?;
    for time in times {
        driver.run(system, S::constant(*time))?;
        driver.state(system, &mut q, &mut p);
        look(system, &q, &p);
    }
    Ok(())
}

/// A method for any scalar: that of order nine, or Radau IIA where the settings name an implicit method. More of the
/// catalogue for every scalar would only take time to compile.
fn driver<'a, Y>(
    system: &mut Y,
    (q, p): (&Y::Coordinates, &Y::Momenta),
    tolerances: Tolerances,
    settings: &Settings,
    closed: f64,
) -> Result<Driver<'a, Y>, StepError>
where
    Y: Differentiable + Constrained + 'a,
    Y::Scalar: Real,
{
    let (t, step) = (Y::Scalar::zero(), Step::Adaptive(tolerances));
    let implicit = catalogue::entry(settings.method).is_some_and(|e| e.implicit);
    let mut method: BoxedMethod<'a, Y> =
        if implicit { Box::new(Radau5::new(system)) } else { Box::new(Verner9::new(system)) };
    if !system.rows().is_empty() {
        let effort = Effort { tolerance: closed, ..Effort::default() };
        let hold = Projection::new(system, settings.hold, effort);
        method = Box::new(WithPostStep::new(system, method, hold));
    }
    Solver::new(system, method, step, t, q, p)
}
