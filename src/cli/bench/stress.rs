//! What every scene says to every method.

use multibody::runtime::integrate::catalogue::{self, Start};
use multibody::runtime::integrate::Step;
use multibody::runtime::{Energetic, Real};
use multibody::scenes::{self, Scene};
use serde::Serialize;

use super::sample::step;
use super::work::reference;
use crate::cli::output::note;

/// What came of one run.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Scene.
    pub scene: String,
    /// Method.
    pub method: String,
    /// Tolerance or step, and number type.
    pub setting: String,
    /// Largest error of a coordinate at the end, or why it stopped.
    pub result: Result<f64, String>,
}

/// Tolerance of adaptive methods; others take the scene's step.
const TOLERANCE: f64 = 1e-8;

/// Scenes of more freedoms are run by the adaptive explicit methods only: others would take hours.
const LARGE: usize = 200;

/// All scenes with all methods, interpreted, in f64 and f32, and the models that are refused.
pub fn rows(scenes: &[Scene], methods: &[String]) -> Vec<Row> {
    let mut rows = Vec::new();
    for scene in scenes {
        let reference = reference(scene).map(|r| r.q);
        note(format_args!("{}: stress", scene.name));
        for entry in catalogue::entries() {
            if !methods.is_empty() && !methods.iter().any(|m| m == entry.name) {
                continue;
            }
            if scene.v.len() > LARGE && (entry.implicit || !entry.adaptive) {
                continue;
            }
            rows.push(one::<f64>(scene, entry, reference.as_deref(), TOLERANCE, "f64"));
            if !entry.implicit && scene.v.len() <= LARGE {
                rows.push(one::<f32>(scene, entry, reference.as_deref(), 1e-4, "f32"));
            }
        }
    }
    for refused in scenes::refused() {
        let (model, findings) = refused.read();
        let said = findings.to_string();
        let result = match model {
            Some(_) => Err("accepted".to_string()),
            None => Err(format!("refused: {}", said.lines().next().unwrap_or_default())),
        };
        rows.push(Row { scene: refused.name.into(), method: String::new(), setting: String::new(), result });
    }
    rows
}

fn one<S: Real + 'static>(
    scene: &Scene,
    entry: &catalogue::Entry,
    reference: Option<&[f64]>,
    tolerance: f64,
    numbers: &str,
) -> Row {
    let setting = if entry.adaptive { tolerance } else { scene.rk4_step };
    let result = go::<S>(scene, entry.name, step(entry.name, setting, false), reference);
    let setting = format!("{setting:.0e}, {numbers}");
    Row { scene: scene.name.into(), method: entry.name.into(), setting, result }
}

fn go<S: Real + 'static>(scene: &Scene, method: &str, step: Step, reference: Option<&[f64]>) -> Result<f64, String> {
    let mut system = scene.interpreter::<S>();
    let q: Vec<S> = scene.q.iter().map(|x| S::constant(*x)).collect();
    system.check_rank(&q).map_err(|e| e.to_string())?;
    let (q, p) = scene.start(&mut system);
    let start = Start { q: &q, p: &p, step, compensated: true };
    let made = catalogue::any(method, &mut system, &start).ok_or("no such method")?;
    let mut driver = made.map_err(|e| e.to_string())?;
    driver.limits().steps = 2_000_000;
    driver.run(&mut system, S::constant(scene.t_end)).map_err(|e| e.to_string())?;
    let (mut q, mut p) = (q.clone(), p.clone());
    driver.state(&system, &mut q, &mut p);
    let finite = q.iter().chain(&p).all(|x| x.is_finite());
    if !finite {
        return Err("NOT FINITE AND NOT SAID".into());
    }
    let (kinetic, potential) = system.state_energy(&q, &p);
    if !(kinetic + potential).is_finite() {
        return Err("ENERGY NOT FINITE AND NOT SAID".into());
    }
    let q: Vec<f64> = q.iter().map(|x| x.to_f64()).collect();
    reference.map(|reference| super::sample::end_error(&q, reference)).ok_or_else(|| "no reference".to_string())
}
