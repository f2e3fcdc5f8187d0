//! What a simulation can be trusted for: refusals before it and warnings after it.

use std::path::Path;

use multibody::codegen::plan::Plan;
use multibody::runtime::integrate::Step;

use super::condition::{self, Doubt};
use super::energy::Verdict;
use super::motion::{interpreter, Record, Settings};
use super::output::note;
use super::probe::Probe;
use super::{source, Failure, Outcome};

/// Tolerances from here on leave no digit: momenta are then wrong by their own size in every step.
pub const MEANINGLESS: f64 = 1.0;
/// Distance of two doubles, rad or m, from which on a coordinate has no digits.
const APART: f64 = 1.0;
/// Difference of the length of a quaternion from one above which its scaling is reported.
pub const UNIT: f64 = 1e-9;

fn warn(path: &Path, what: &str, help: &str) {
    note(format_args!("{}: warning: {what}\n  help: {help}", path.display()));
}

/// Looks at the start of a run, whose steps are chosen by their error or not.
///
/// # Errors
/// Coordinates without digits. Steps by the error where the mass matrix is singular but for rounding: no step is small enough.
pub fn start(path: &Path, plan: &Plan, q: &[f64], adaptive: bool) -> Outcome {
    if let Some((name, apart)) = condition::spacing(plan, q).filter(|s| s.1 >= APART) {
        let what =
            format!("the start has no digits: doubles near the value of `{name}` are {apart:.1e} rad or m apart");
        return Err(Failure::new(what, "start nearer to zero: --q, or the model's `start`"));
    }
    if plan.dims.nv > condition::LARGEST {
        let (n, most) = (plan.dims.nv, condition::LARGEST);
        note(format_args!(
            "{}: the condition of the mass matrix was not computed: {n} velocities, more than {most}",
            path.display()
        ));
    }
    let mut interpreter = interpreter::<f64>(plan);
    if let Some(Doubt { what, help, singular }) = condition::of_mass_matrix(plan, |m| interpreter.mass_matrix(q, m)) {
        let what = format!("at the start, {what}");
        if singular && adaptive {
            interpreter.check_rank(q).map_err(|e| source::rank_failure(&e))?;
            return Err(Failure::new(
                format!("{what}; no step has an error that could be allowed"),
                format!("{help}; with fixed steps (--step) a motion is computed all the same"),
            ));
        }
        warn(path, &what, &help);
    }
    Ok(())
}

/// Reports what is wrong with a run. Returns whether any digit of it can be trusted.
pub fn tell(path: &Path, plan: &Plan, settings: &Settings, record: &Record, found: (Verdict, Option<Probe>)) -> bool {
    let (energy, probe) = found;
    if let Some((what, help)) = &energy.warning {
        warn(path, what, help);
    }
    let lost = probe.is_some_and(|probe| probe.lost);
    if lost {
        let what =
            "the step is far too large: it does not follow the motion, and two steps of half its size end elsewhere";
        warn(path, what, "lower --step, or leave it out for steps by the error");
    }
    let farthest = record.q.iter().filter_map(|q| condition::spacing(plan, q)).max_by(|a, b| a.1.total_cmp(&b.1));
    if let (Step::Adaptive(tolerances), Some((name, apart))) = (settings.step, farthest) {
        if apart > tolerances.rotations {
            let what =
                format!("doubles near the values of `{name}` are {apart:.1e} rad or m apart, more than the tolerance");
            warn(path, &what, "start nearer to zero, or raise --tolerance");
        }
    }
    !(energy.lost || lost)
}

/// Reports a run whose errors have reached the size of its motion. Returns whether any digit is left.
pub fn digits(path: &Path, some_left: bool) -> bool {
    if !some_left {
        let help = "lower --tolerance or --step; where errors grow exponentially, lower --time";
        warn(path, "no digit of the motion is left at the end", help);
    }
    some_left
}
