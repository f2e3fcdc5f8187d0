//! One measured run.

use std::time::Instant;

use multibody::runtime::catalogue::{self, BoxedMethod};
use multibody::runtime::integrate::{Solver, Statistics, Step, StepError, Tolerances};
use multibody::runtime::{Energetic, Real, Scalar, System};
use serde::{Deserialize, Serialize};

/// A run and its result, one line of JSON. The rivals' programs write the same format.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Sample {
    /// Program.
    pub tool: String,
    /// Variant of the program: code, formulation, number type.
    pub variant: String,
    /// Scene.
    pub scene: String,
    /// Method.
    pub method: String,
    /// Tolerance of adaptive methods, step (s) of others, as text.
    pub setting: String,
    /// Processor time, s: the smallest of several runs.
    pub cpu_s: f64,
    /// Evaluations of the rates.
    pub evaluations: u64,
    /// Steps, rejections, Jacobians, iterations.
    pub steps: u64,
    pub rejections: u64,
    pub jacobians: u64,
    pub iterations: u64,
    /// Largest error of a coordinate at the end, rad or m.
    pub end_error: Option<f64>,
    /// Change of the energy over the run, J; for conservative scenes only.
    pub energy_error: Option<f64>,
    /// Coordinates at the end, in the order of the model; for rivals only.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub q: Vec<f64>,
    /// Why the run stopped early.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// Shortest time that is measured, s; shorter runs are repeated.
const SHORTEST: f64 = 0.02;
/// Number of evaluations after which a run is stopped, because no method needs as many for a useful error.
pub const MOST: u64 = 20_000_000;

/// Where a run starts, and how its steps are chosen.
pub struct Start<'a, Y: System> {
    /// Coordinates.
    pub q: &'a Y::Coordinates,
    /// Momenta.
    pub p: &'a Y::Momenta,
    /// Fixed step, or tolerances.
    pub step: Step,
    /// Whether sums are compensated, where the method supports it.
    pub compensated: bool,
}

/// Makes a method for a system, with compensated sums or without.
pub type Maker<'m, Y> = dyn Fn(&Y, bool) -> Option<BoxedMethod<'static, Y>> + 'm;

/// Step of a method at a setting.
pub fn step(method: &str, setting: f64) -> Step {
    match catalogue::entry(method).is_some_and(|e| e.adaptive) {
        false => Step::Fixed(setting),
        true => Step::Adaptive(Tolerances::new(setting)),
    }
}

/// Result of one run: the state at the end and the work.
pub struct Run<Y: System> {
    /// Coordinates.
    pub q: Y::Coordinates,
    /// Momenta.
    pub p: Y::Momenta,
    /// Evaluations and steps.
    pub statistics: Statistics,
    /// Time, s.
    pub seconds: f64,
    /// Failure, if there was one.
    pub failure: Option<StepError>,
}

/// Runs once from zero to `t_end`, s.
pub fn run<Y>(
    system: &mut Y,
    make: &Maker<'_, Y>,
    start: &Start<'_, Y>,
    t_end: f64,
) -> Option<Result<Run<Y>, StepError>>
where
    Y: System,
    Y::Scalar: Real,
{
    let clock = Instant::now();
    let method = make(system, start.compensated)?;
    let mut driver = match Solver::new(system, method, start.step, Y::Scalar::zero(), start.q, start.p) {
        Ok(driver) => driver,
        Err(e) => return Some(Err(e)),
    };
    driver.limits.steps = MOST / 4;
    let failure = driver.run(system, Y::Scalar::constant(t_end)).err();
    let (mut q, mut p) = (start.q.clone(), start.p.clone());
    driver.state(system, &mut q, &mut p);
    let seconds = clock.elapsed().as_secs_f64();
    Some(Ok(Run { q, p, statistics: driver.statistics(), seconds, failure }))
}

/// Runs, repeats short runs for their time, and compares the end with a reference.
pub fn measure<Y>(
    system: &mut Y,
    make: &Maker<'_, Y>,
    start: &Start<'_, Y>,
    t_end: f64,
    reference: &[f64],
    mut sample: Sample,
) -> Option<Sample>
where
    Y: Energetic,
    Y::Scalar: Real,
{
    let total = |(kinetic, potential): (Y::Scalar, Y::Scalar)| kinetic.to_f64() + potential.to_f64();
    let before = total(system.energies(start.q, start.p));
    let run = match run(system, make, start, t_end)? {
        Ok(run) => run,
        Err(e) => {
            sample.failure = Some(e.to_string());
            return Some(sample);
        }
    };
    let mut seconds = run.seconds;
    let mut spent = seconds;
    while spent < SHORTEST && run.failure.is_none() {
        let Some(Ok(again)) = self::run(system, make, start, t_end) else { break };
        seconds = seconds.min(again.seconds);
        spent += again.seconds;
    }
    sample.cpu_s = seconds;
    let Statistics { evaluations, steps, rejections, jacobians, iterations, .. } = run.statistics;
    sample = Sample { evaluations, steps, rejections, jacobians, iterations, ..sample };
    match run.failure {
        Some(e) => sample.failure = Some(e.to_string()),
        None => {
            let q: Vec<f64> = run.q.as_ref().iter().map(|x| x.to_f64()).collect();
            sample.end_error = Some(end_error(&q, reference));
            sample.energy_error = Some(total(system.energies(&run.q, &run.p)) - before);
        }
    }
    Some(sample)
}

/// Largest difference of two lists of coordinates.
pub fn end_error(q: &[f64], reference: &[f64]) -> f64 {
    q.iter().zip(reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
