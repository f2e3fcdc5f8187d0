//! Tables (Markdown) and figures of the measurements.

use std::fmt::Write as _;

use crate::scenes::Scene;

use super::figure::{Figure, Line};
use super::long::Row as LongRow;
use super::sample::Sample;
use super::stress::Row as StressRow;
use super::work::Variant;
use super::Measured;

/// Errors for which the tables give the work.
const TARGETS: [f64; 5] = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12];

/// Runs of one method by one program, from coarse to fine settings.
pub struct Series<'a> {
    /// Variant, with the program if it is not this one.
    pub name: String,
    /// Method.
    pub method: &'a str,
    /// Runs that reached the end.
    pub samples: Vec<&'a Sample>,
}

/// Series of samples with the same program, variant and method, in the order of their first sample.
pub fn series(samples: &[Sample]) -> Vec<Series<'_>> {
    let mut all: Vec<Series> = Vec::new();
    for sample in samples {
        let name = match sample.tool == "multibody" {
            true => sample.variant.clone(),
            false => sample.tool.clone(),
        };
        let found = all.iter().position(|s| s.name == name && s.method == sample.method);
        let at = found.unwrap_or_else(|| {
            all.push(Series { name, method: &sample.method, samples: Vec::new() });
            all.len() - 1
        });
        if sample.failure.is_none() && sample.end_error.is_some_and(f64::is_finite) {
            all[at].samples.push(sample);
        }
    }
    all
}

impl Series<'_> {
    /// Time (s) and evaluations for an error at the end, by linear interpolation of logarithms between two runs; the
    /// smallest where several pairs of runs give one.
    pub fn cost(&self, error: f64) -> Option<(f64, f64)> {
        let point = |s: &Sample| (s.end_error.unwrap_or(f64::INFINITY).max(1e-17), s.cpu_s, s.evaluations as f64);
        let mut best: Option<(f64, f64)> = None;
        let mut offer = |cost: (f64, f64)| {
            if best.is_none_or(|b| cost.0 < b.0) {
                best = Some(cost);
            }
        };
        for pair in self.samples.windows(2) {
            let ((e0, t0, n0), (e1, t1, n1)) = (point(pair[0]), point(pair[1]));
            if e0 > error && e1 <= error {
                let w = (e0 / error).ln() / (e0 / e1).ln();
                let between = |a: f64, b: f64| (a.max(1e-12).ln() * (1.0 - w) + b.max(1e-12).ln() * w).exp();
                offer((between(t0, t1), between(n0, n1)));
            }
        }
        if let Some(first) = self.samples.first().map(|s| point(s)).filter(|p| p.0 <= error) {
            offer((first.1, first.2));
        }
        best
    }
}

/// A time as a number with a unit.
fn seconds(s: f64) -> String {
    match s {
        s if s < 1e-3 => format!("{:.3} ms", s * 1e3),
        s if s < 1.0 => format!("{:.1} ms", s * 1e3),
        s => format!("{s:.1} s"),
    }
}

/// Table of one scene: time and evaluations for given errors at the end.
pub fn work(measured: &Measured) -> String {
    let Measured { scene, reference, samples } = measured;
    let mut text = format!("### {} (`{}`), {} s\n\n", scene.title, scene.name, scene.t_end);
    let Some(reference) = reference else {
        let _ = writeln!(text, "No reference: see the table of failures.\n");
        return text;
    };
    let _ = writeln!(text, "Reference: {}, two runs apart by {:.0e}.\n", reference.how, reference.error);
    let _ = writeln!(text, "| method | {} |", TARGETS.map(|e| format!("{e:.0e}")).join(" | "));
    let _ = writeln!(text, "|---|{}", "---|".repeat(TARGETS.len()));
    for series in series(samples) {
        let cells = TARGETS.map(|e| match series.cost(e) {
            Some((t, n)) if e >= 10.0 * reference.error => format!("{} ({n:.0})", seconds(t)),
            _ => "–".to_string(),
        });
        if cells.iter().any(|c| c != "–") {
            let _ = writeln!(text, "| {}: {} | {} |", series.name, series.method, cells.join(" | "));
        }
    }
    text.push('\n');
    text
}

/// Lines of figures: program or variant, method.
const LINES: [(&str, &str); 16] = [
    ("generated", "rk4"),
    ("generated", "tsit5"),
    ("generated", "dop853"),
    ("generated", "verner9"),
    ("generated", "adams"),
    ("generated", "gauss4"),
    ("generated", "radau5"),
    ("generated", "rodas5p"),
    ("generated, accelerations", "verner9"),
    ("interpreted", "verner9"),
    ("generated, f32", "dop853"),
    ("pinocchio", "rk4"),
    ("pinocchio", "dop853"),
    ("mujoco", "rk4"),
    ("mujoco", "implicitfast"),
    ("drake", "runge_kutta3"),
];

/// Figure of one scene.
pub fn figure(measured: &Measured) -> Option<Figure> {
    let all = series(&measured.samples);
    let (code, interpreted) = (all.iter().any(|s| s.name == Variant::Hamilton.name()), Variant::Interpreted.name());
    let chosen: Vec<&Series> = LINES
        .iter()
        // Scenes without generated code show the interpreter's lines instead.
        .filter_map(|(name, method)| {
            let place = match *name {
                name if code => name,
                "generated" => interpreted,
                _ => return None,
            };
            all.iter().find(|s| s.name == place && s.method.eq_ignore_ascii_case(method))
        })
        .filter(|s| s.samples.len() > 1)
        .collect();
    if chosen.is_empty() {
        return None;
    }
    let lines = |y: fn(&Sample) -> f64| -> Vec<Line> {
        let line = |s: &&Series| {
            let points = s.samples.iter().map(|p| (p.end_error.unwrap_or(1.0).max(1e-16), y(p)));
            Line {
                name: format!("{}: {}", s.name, s.method),
                points: points.filter(|p| p.0 < 10.0).collect(),
                thin: code && s.name != Variant::Hamilton.name(),
            }
        };
        chosen.iter().map(line).collect()
    };
    let error = || "error of a coordinate at the end [rad, m]".to_string();
    Some(Figure {
        title: format!("{}: {} s", measured.scene.title, measured.scene.t_end),
        x: [error(), error()],
        y: ["time of the processor [s]".into(), "evaluations of the rates".into()],
        lines: [lines(|s| s.cpu_s), lines(|s| s.evaluations as f64)],
    })
}

/// Ratios of our time to that of the rivals, for the scenes that they ran.
pub fn ratios(measured: &[Measured]) -> String {
    let mut text = String::from(
        "| scene | error | best explicit | RK4 / Pinocchio RK4 | DOP853 / Pinocchio DOP853 | best / best of MuJoCo | best / Drake |\n|---|---|---|---|---|---|---|\n",
    );
    for scene in measured.iter().filter(|m| m.samples.iter().any(|s| s.tool != "multibody")) {
        let all = series(&scene.samples);
        for error in [1e-4, 1e-6, 1e-8, 1e-10] {
            let least = |wanted: &dyn Fn(&&Series) -> bool| {
                let costs = all.iter().filter(wanted).filter_map(|s| Some((s.cost(error)?.0, s.method)));
                costs.min_by(|a, b| a.0.total_cmp(&b.0))
            };
            let of = |name: &str, method: &str| {
                least(&|s: &&Series| s.name == name && (method.is_empty() || s.method.eq_ignore_ascii_case(method)))
            };
            let explicit = |s: &&Series| {
                let entry = multibody::runtime::catalogue::entry(s.method);
                s.name == Variant::Hamilton.name() && entry.is_some_and(|e| !e.implicit)
            };
            let Some((best, name)) = least(&explicit) else { continue };
            let ratio = |a: Option<(f64, &str)>, b: Option<(f64, &str)>| match (a, b) {
                (Some(a), Some(b)) => format!("{:.3}", a.0 / b.0),
                (Some(_), None) => "not reached by them".to_string(),
                _ => "–".to_string(),
            };
            let ours = |method| of(Variant::Hamilton.name(), method);
            let _ = writeln!(
                text,
                "| {} | {error:.0e} | {name}, {} | {} | {} | {} | {} |",
                scene.scene.name,
                seconds(best),
                ratio(ours("rk4"), of("pinocchio", "rk4")),
                ratio(ours("dop853"), of("pinocchio", "dop853")),
                ratio(Some((best, name)), of("mujoco", "")),
                ratio(Some((best, name)), of("drake", "")),
            );
        }
    }
    text.push('\n');
    text
}

/// Table of the long runs of one scene.
pub fn long(scene: &Scene, rows: &[LongRow]) -> String {
    let mut text = format!("### {} (`{}`)\n\n", scene.title, scene.name);
    text += "| method | setting | work | time | energy error | trajectory error | energy, projected | trajectory, projected |\n|---|---|---|---|---|---|---|---|\n";
    let number = |x: Option<f64>| x.map_or("–".to_string(), |x| format!("{x:.1e}"));
    for row in rows.iter().filter(|r| !r.projected) {
        let projected = rows.iter().find(|r| r.projected && r.method == row.method);
        let energy = |r: &LongRow| r.failure.clone().unwrap_or_else(|| format!("{:.1e}", r.energy));
        let _ = writeln!(
            text,
            "| {} | {:.1e} | {:.2} | {:.2} | {} | {} | {} | {} |",
            row.method,
            row.setting,
            row.work,
            row.time,
            energy(row),
            number(row.trajectory),
            projected.map_or("–".to_string(), energy),
            number(projected.and_then(|r| r.trajectory)),
        );
    }
    text.push('\n');
    text
}

/// Table of the stress runs: one line for each scene and number type, with the largest error and the messages of the
/// methods that stopped.
pub fn stress(rows: &[StressRow]) -> String {
    let mut text = String::from("| scene | method | setting | error at the end, or why not |\n|---|---|---|---|\n");
    for row in rows {
        let result = match &row.result {
            Ok(error) => format!("{error:.1e}"),
            Err(said) => said.clone(),
        };
        let _ = writeln!(text, "| {} | {} | {} | {result} |", row.scene, row.method, row.setting);
    }
    text.push('\n');
    text
}
