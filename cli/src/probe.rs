//! The error of a fixed step: one step compared with two of half its size, at several states of the run.

use std::cell::RefCell;
use std::rc::Rc;

use multibody::codegen::plan::Plan;
use multibody::runtime::integrate::Step;

use super::displacement::{components, displacement, range};
use super::motion::{driver, mechanism, Drift, Record, Settings};
use super::timed::Timed;
use super::Outcome;

/// Number of states at which steps are compared.
const PLACES: usize = 8;
/// Difference of one step and two halves above which the step does not follow the motion: rad, and for positions a part
/// of the largest range of a position in the run.
const FAR: f64 = 0.1;
/// Differences below this are never far, m: a mechanism that hardly moves has no range.
const NEAR: f64 = 1e-9;

/// Errors of single steps of a run with a fixed step.
pub struct Probe {
    /// Largest difference of a coordinate, rad or m; infinite where a step fails.
    pub error: f64,
    /// Whether the step does not follow the motion.
    pub lost: bool,
    /// How many states were tried.
    pub places: usize,
}

/// Compares steps of `h` s with halved ones at states of the record.
pub fn probe(plan: &Plan, settings: &Settings, record: &Record, h: f64) -> Outcome<Probe> {
    let mut system = Timed::new(settings.driven(mechanism(plan, settings.interpreted)?));
    let components = components(plan);
    let range = range(&components, &record.q);
    let stride = record.q.len().div_ceil(PLACES);
    let mut found = Probe { error: 0.0, lost: false, places: 0 };
    let (instants, rows) = (settings.instants(), record.t.iter().zip(&record.q).zip(&record.p));
    for ((&t, q), p) in rows.step_by(stride) {
        // No step goes over a change of the control.
        let next = instants.iter().find(|instant| **instant > t);
        if next.is_none_or(|next| t + h > next * (1.0 + 1e-12)) {
            continue;
        }
        if let Some(control) = &settings.control {
            control.enter(t);
        }
        found.places += 1;
        let mut end = |parts: f64| -> Option<(Vec<f64>, Vec<f64>)> {
            let met = Rc::new(RefCell::new(Drift::default()));
            let mut driver = driver(plan, settings, &mut system, Step::Fixed(h / parts), (t, q, p), &met).ok()?;
            driver.run(&mut system, t + h).ok()?;
            let (mut q, mut p) = (q.clone(), p.clone());
            driver.state(&system, &mut q, &mut p);
            Some((q, p))
        };
        let (Some(one), Some(two)) = (end(1.0), end(2.0)) else {
            return Ok(Probe { error: f64::INFINITY, lost: true, ..found });
        };
        let x = displacement(&system, (&one.0, &one.1), (&two.0, &two.1));
        for (x, component) in x.iter().zip(&components) {
            let far = component.position.map_or(FAR, |_| (FAR * range).max(NEAR));
            found.error = found.error.max(x.abs());
            found.lost |= x.is_nan() || x.abs() > far;
        }
    }
    Ok(found)
}
