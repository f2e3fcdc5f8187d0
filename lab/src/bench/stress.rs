//! Stress runs: every method on every scene.

use crate::scenes::{self, Scene};
use multibody::runtime::catalogue;
use multibody::runtime::integrate::{Solver, Step};
use multibody::runtime::{Energetic, Interpreter, Real};
use serde::Serialize;

use super::erased::Erased;
use super::sample::step;
use super::work::{fits, generated, reference, single};
use mbd_cli::note;

/// Result of one run.
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

/// Tolerance of adaptive methods; the others use the scene's step.
const TOLERANCE: f64 = 1e-8;
/// Tolerance of adaptive methods in single precision.
const SINGLE: f64 = 1e-4;
/// Number of steps times degrees of freedom after which a run is stopped with a message.
const STEPS: u64 = 5_000_000;

/// Runs all scenes with all methods, or those of a list, in f64 and f32, and checks the models that must be rejected.
pub fn rows(scenes: &[Scene], methods: &[String]) -> Vec<Row> {
    let mut rows = Vec::new();
    for scene in scenes {
        note(format_args!("{}: stress", scene.name));
        let reference = reference(scene).map(|r| r.q);
        let (mut double, _) = generated(scene);
        let mut simple = single(scene);
        for entry in catalogue::entries().filter(|e| fits(scene, e)) {
            if methods.is_empty() || methods.iter().any(|m| m == entry.name) {
                rows.push(one(scene, &mut double, entry, reference.as_deref(), TOLERANCE, "f64"));
                rows.push(one(scene, &mut simple, entry, reference.as_deref(), SINGLE, "f32"));
            }
        }
    }
    for refused in scenes::refused() {
        let (model, findings) = refused.read();
        let said = findings.to_string();
        let result = Err(match model {
            Some(_) => "ACCEPTED".to_string(),
            None => format!("refused: {}", said.lines().next().unwrap_or_default()),
        });
        rows.push(Row { scene: refused.name.into(), method: String::new(), setting: String::new(), result });
    }
    rows
}

fn one<S: Real + 'static>(
    scene: &Scene,
    system: &mut Erased<S>,
    entry: &catalogue::Entry,
    reference: Option<&[f64]>,
    tolerance: f64,
    numbers: &str,
) -> Row {
    let setting = if entry.adaptive { tolerance } else { scene.rk4_step };
    let result = go(scene, system, entry.name, step(entry.name, setting), reference);
    let setting = format!("{setting:.0e}, {numbers}");
    Row { scene: scene.name.into(), method: entry.name.into(), setting, result }
}

fn go<S: Real + 'static>(
    scene: &Scene,
    system: &mut Erased<S>,
    method: &str,
    step: Step,
    reference: Option<&[f64]>,
) -> Result<f64, String> {
    let mut interpreter: Interpreter<S> = scene.interpreter();
    let q: Vec<S> = scene.q.iter().map(|x| S::constant(*x)).collect();
    interpreter.check_rank(&q).map_err(|e| e.to_string())?;
    let (q, p) = scene.start(system);
    let method = catalogue::any(method, system, true).ok_or("no such method")?;
    let mut driver = Solver::new(system, method, step, S::zero(), &q, &p).map_err(|e| e.to_string())?;
    driver.limits.steps = STEPS / scene.v.len() as u64;
    driver.run(system, S::constant(scene.t_end)).map_err(|e| e.to_string())?;
    let (mut q, mut p) = (q.clone(), p.clone());
    driver.state(system, &mut q, &mut p);
    let (kinetic, potential) = system.energies(&q, &p);
    if !q.iter().chain(&p).all(|x| x.is_finite()) || !(kinetic + potential).is_finite() {
        return Err("NOT FINITE AND NOT SAID".into());
    }
    let q: Vec<f64> = q.iter().map(|x| x.to_f64()).collect();
    reference.map(|reference| super::sample::end_error(&q, reference)).ok_or_else(|| "no reference".to_string())
}
