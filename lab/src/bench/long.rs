//! Long runs, in which each method has as many evaluations as the classical method RK4: errors of energy and
//! trajectory.

use std::time::Instant;

use crate::scenes::Scene;
use multibody::runtime::catalogue;
use multibody::runtime::integrate::{EnergyProjection, Solver, Step};
use multibody::runtime::{Energetic, System};
use serde::Serialize;

use super::erased::Erased;
use super::sample::{end_error, step};
use super::work::{generated, reference};
use mbd_cli::note;

/// One method on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Scene.
    pub scene: String,
    /// Method.
    pub method: String,
    /// Tolerance or step.
    pub setting: f64,
    /// Whether steps are projected onto the energy.
    pub projected: bool,
    /// Evaluations divided by those of RK4 at its step.
    pub work: f64,
    /// Time divided by RK4's.
    pub time: f64,
    /// Largest energy error over the run, relative to the energy above that of rest at the lowest position.
    pub energy: f64,
    /// Error of a coordinate at the end of the scene's short run, rad or m.
    pub trajectory: Option<f64>,
    /// Why the run stopped early.
    pub failure: Option<String>,
}

/// Default methods of long runs.
const METHODS: [&str; 5] = ["rk4", "ab6", "dop853", "verner9", "adams"];

/// The methods of a list, or the default ones; the classical one comes first, because its work is the reference.
pub fn methods(asked: &[String]) -> Vec<String> {
    let usual = METHODS.map(String::from);
    let rest = if asked.is_empty() { &usual[..] } else { asked };
    let rest = rest.iter().filter(|m| *m != "rk4" && catalogue::entry(m).is_some());
    std::iter::once("rk4".to_string()).chain(rest.cloned()).collect()
}

/// Energy at the start above the nearest minimum of the potential energy. The minimum is found by a motion whose
/// momenta are reduced at every step, so that it comes to rest there.
pub fn height(scene: &Scene, system: &mut Erased<f64>) -> f64 {
    let total = |(kinetic, potential): (f64, f64)| kinetic + potential;
    let (mut q, mut p) = scene.start(system);
    let before = total(system.energies(&q, &p));
    let (mut qd, mut pd) = (q.clone(), p.clone());
    let mut least = before;
    for k in 0..200_000 {
        system.rates_at(0.0, &q, &p, &mut qd, &mut pd);
        let h = scene.rk4_step;
        p.iter_mut().zip(&pd).for_each(|(p, pd)| *p = 0.99 * (*p + h * pd));
        system.rates_at(0.0, &q, &p, &mut qd, &mut pd);
        q.iter_mut().zip(&qd).for_each(|(q, qd)| *q += h * qd);
        if k % 100 == 0 {
            least = least.min(system.energies(&q, &p).1);
        }
    }
    before - least
}

/// A run over `t_end`, s, during which the energy is observed.
struct Long {
    evaluations: u64,
    seconds: f64,
    energy: f64,
    /// Coordinates at the end.
    q: Vec<f64>,
    failure: Option<String>,
}

/// Number of steps between two evaluations of the energy. Evaluated at every step, it would cost as much as the steps
/// of cheap methods.
const LOOK: u64 = 16;

fn long(scene: &Scene, system: &mut Erased<f64>, method: &str, step: Step, project: bool, t_end: f64) -> Option<Long> {
    let (mut q, mut p) = scene.start(system);
    let method = catalogue::any(method, system, true)?;
    let mut driver = Solver::new(system, method, step, 0.0, &q, &p).ok()?;
    let total = |(kinetic, potential): (f64, f64)| kinetic + potential;
    let before = total(system.energies(&q, &p));
    let mut projection = EnergyProjection::new(system, &q, &p, 3);
    let (mut energy, mut failure) = (0.0_f64, None);
    let clock = Instant::now();
    let mut looking = 0.0;
    for k in 0_u64.. {
        if driver.time() >= t_end {
            break;
        }
        let done = driver.advance(system, t_end);
        if project {
            driver.project(system, &mut projection);
        }
        if let Err(e) = done {
            failure = Some(e.to_string());
            break;
        }
        if k % LOOK == 0 {
            let clock = Instant::now();
            driver.state(system, &mut q, &mut p);
            energy = energy.max((total(system.energies(&q, &p)) - before).abs());
            looking += clock.elapsed().as_secs_f64();
        }
    }
    let seconds = clock.elapsed().as_secs_f64() - looking;
    driver.state(system, &mut q, &mut p);
    Some(Long { evaluations: driver.statistics().evaluations, seconds, energy, q, failure })
}

/// The setting at which a method needs as many evaluations as RK4 at its step. It is found by bisection on a short run
/// and corrected on longer ones.
fn setting(scene: &Scene, system: &mut Erased<f64>, method: &str, t_end: f64) -> Option<f64> {
    let rk4 = 4.0 / scene.rk4_step;
    let adaptive = catalogue::entry(method)?.adaptive;
    let mut work = |setting: f64, t_end: f64| -> Option<f64> {
        let run = long(scene, system, method, step(method, setting), false, t_end)?;
        run.failure.is_none().then(|| run.evaluations as f64 / t_end / rk4)
    };
    let short = (t_end / 1000.0).max(scene.t_end);
    // Powers of ten between which the setting is bisected; a failure counts as too little work.
    let (mut coarse, mut fine) = if adaptive { (0.0, -14.0) } else { (scene.rk4_step.log10() + 1.5, -5.5) };
    for _ in 0..10 {
        let middle = 0.5 * (coarse + fine);
        match work(10.0_f64.powf(middle), short) {
            Some(n) if n > 1.0 => fine = middle,
            _ => coarse = middle,
        }
    }
    let mut at = 0.5 * (coarse + fine);
    if !adaptive {
        return Some(10.0_f64.powf(at));
    }
    // log(work) decreases with log(tolerance) at this slope.
    let slope = match (work(10.0_f64.powf(at - 1.0), short), work(10.0_f64.powf(at + 1.0), short)) {
        (Some(more), Some(less)) if more > 1.05 * less => 0.5 * (more / less).log10(),
        _ => 0.1,
    };
    // A rough motion can need more work than its first part; the last correction therefore uses the whole run.
    for part in [0.1, 0.1, 1.0, 1.0] {
        match work(10.0_f64.powf(at), part * t_end) {
            Some(n) if part == 1.0 && (0.9..1.02).contains(&n) => break,
            Some(n) => at = (at + n.log10() / slope).clamp(-14.0, -1.0),
            None => at -= 1.0,
        }
    }
    Some(10.0_f64.powf(at))
}

/// Runs some methods on one scene, each with as many evaluations as `steps` steps of RK4.
pub fn scene(scene: &Scene, methods: &[String], steps: u64) -> Vec<Row> {
    let (mut system, _) = generated(scene);
    let height = height(scene, &mut system);
    let reference = reference(scene);
    let t_end = scene.rk4_step * steps as f64;
    let mut rows = Vec::new();
    let mut rk4_seconds = f64::NAN;
    for method in methods {
        let setting = match method.as_str() {
            "rk4" => Some(scene.rk4_step),
            _ => setting(scene, &mut system, method, t_end),
        };
        let Some(setting) = setting else { continue };
        for project in [false, true] {
            note(format_args!("{}: {method}{}", scene.name, if project { ", projected" } else { "" }));
            let step = step(method, setting);
            let Some(run) = long(scene, &mut system, method, step, project, t_end) else { continue };
            if method == "rk4" && !project {
                rk4_seconds = run.seconds;
            }
            let short = reference.as_ref().and_then(|reference| {
                let run = long(scene, &mut system, method, step, project, scene.t_end)?;
                run.failure.is_none().then(|| end_error(&run.q, &reference.q))
            });
            rows.push(Row {
                scene: scene.name.into(),
                method: method.clone(),
                setting,
                projected: project,
                work: run.evaluations as f64 / (4.0 * steps as f64),
                time: run.seconds / rk4_seconds,
                energy: run.energy / height,
                trajectory: short,
                failure: run.failure,
            });
        }
    }
    rows
}
