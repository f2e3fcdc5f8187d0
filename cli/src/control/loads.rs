//! What joints are asked for in a run, against what they are made for.

use multibody::codegen::model::{JointBounds, Unit};
use multibody::codegen::plan::Plan;
use multibody::runtime::tree::Source;

/// Excess over a bound that is rounding or the error of a method, relative to the bound.
const NEARLY: f64 = 1e-6;
/// Joints that are named in a line of the report.
const NAMED: usize = 4;

/// A bound that was passed.
#[derive(Clone, Copy, Debug)]
struct Passed {
    /// Time at which a step first ended beyond it, s.
    first: f64,
    /// The value that was farthest beyond it.
    worst: f64,
    bound: f64,
}

/// A velocity, its coordinate where it has one, and the bounds of its joint.
#[derive(Clone, Debug)]
struct Freedom {
    name: String,
    unit: Unit,
    coordinate: Option<usize>,
    bounds: JointBounds,
    position: Option<Passed>,
    velocity: Option<Passed>,
    /// Largest effort, N m or N.
    effort: f64,
    /// Time at the limit of the effort, s.
    limited: f64,
}

/// Loads of all velocities.
#[derive(Clone, Debug, Default)]
pub struct Loads {
    freedoms: Vec<Freedom>,
    controlled: bool,
}

fn pass(passed: &mut Option<Passed>, t: f64, value: f64, bound: f64) {
    if value.abs().max(bound.abs()).max(1.0) * NEARLY >= (value - bound).abs() {
        return;
    }
    let entry = passed.get_or_insert(Passed { first: t, worst: value, bound });
    if (value - bound).abs() > (entry.worst - entry.bound).abs() {
        (entry.worst, entry.bound) = (value, bound);
    }
}

impl Loads {
    /// The bounds of a plan's joints.
    pub fn new(plan: &Plan, controlled: bool) -> Loads {
        let names = plan.velocity_names();
        let mut freedoms = Vec::new();
        for slot in &plan.slots {
            let Some(Source::State { q, v }) = slot.at else { continue };
            let joint = &plan.model.joints[slot.joint];
            let spec = joint.kind.spec();
            freedoms.extend(spec.freedoms.iter().enumerate().map(|(k, freedom)| Freedom {
                name: names[v + k].clone(),
                unit: freedom.unit,
                coordinate: spec.group.is_none().then_some(q + k),
                bounds: joint.bounds,
                position: None,
                velocity: None,
                effort: 0.0,
                limited: 0.0,
            }));
        }
        Loads { freedoms, controlled }
    }

    /// A state at the end of a step, or at a row within it; times do not decrease.
    pub fn motion(&mut self, t: f64, q: &[f64], v: &[f64]) {
        for (freedom, v) in self.freedoms.iter_mut().zip(v) {
            if let (Some([lower, upper]), Some(at)) = (freedom.bounds.range, freedom.coordinate) {
                if q[at] > upper {
                    pass(&mut freedom.position, t, q[at], upper);
                } else if q[at] < lower {
                    pass(&mut freedom.position, t, q[at], lower);
                }
            }
            if let Some(bound) = freedom.bounds.velocity.filter(|bound| v.abs() > *bound) {
                pass(&mut freedom.velocity, t, *v, bound.copysign(*v));
            }
        }
    }

    /// Efforts that act for `h` s, and whether each is at its limit.
    pub fn efforts(&mut self, h: f64, tau: &[f64], limited: impl Fn(usize) -> bool) {
        for (k, (freedom, tau)) in self.freedoms.iter_mut().zip(tau).enumerate() {
            freedom.effort = freedom.effort.max(tau.abs());
            freedom.limited += if limited(k) { h } else { 0.0 };
        }
    }

    /// Lines of the report.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let [push, turn] = [Unit::Metre, Unit::Radian].map(|unit| {
            let of_unit = self.freedoms.iter().filter(|f| f.unit == unit && f.effort > 0.0);
            of_unit.max_by(|a, b| a.effort.total_cmp(&b.effort))
        });
        let largest: Vec<String> = [(turn, "N m"), (push, "N")]
            .into_iter()
            .filter_map(|(freedom, unit)| freedom.map(|f| format!("{:.3} {unit} at `{}`", f.effort, f.name)))
            .collect();
        if self.controlled && !largest.is_empty() {
            lines.push(format!("efforts: at most {}", largest.join(", ")));
        }
        let limited = self.freedoms.iter().filter(|f| f.limited > 0.0).map(|f| {
            let (bound, unit) = (f.bounds.effort.unwrap_or_default(), if f.unit == Unit::Metre { "N" } else { "N m" });
            format!("`{}` for {:.3} s at {bound} {unit}", f.name, f.limited)
        });
        lines.extend(line("efforts at their limits", limited.collect()));
        let told = |passed: &Passed, f: &Freedom, per: &str| {
            let (name, unit) = (&f.name, f.unit.symbol());
            format!("`{name}` from {:.3} s on, {:.3} {unit}{per} of {:.3}", passed.first, passed.worst, passed.bound)
        };
        let positions = self.freedoms.iter().filter_map(|f| f.position.as_ref().map(|p| told(p, f, "")));
        lines.extend(line("positions beyond their ranges", positions.collect()));
        let speeds = self.freedoms.iter().filter_map(|f| f.velocity.as_ref().map(|p| told(p, f, "/s")));
        lines.extend(line("speeds beyond their limits", speeds.collect()));
        lines
    }
}

/// A line that names the first of several joints.
fn line(what: &str, joints: Vec<String>) -> Option<String> {
    let more = match joints.len().saturating_sub(NAMED) {
        0 => String::new(),
        n => format!("; and {n} more"),
    };
    let named: Vec<&str> = joints.iter().take(NAMED).map(String::as_str).collect();
    (!named.is_empty()).then(|| format!("{what}: {}{more}", named.join("; ")))
}
