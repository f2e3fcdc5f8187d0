//! `mbd simulate`: free motion by Runge-Kutta steps through the interpreter.

use std::fmt::Write as _;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use multibody::codegen::model::{Gravity, JointKind, Value};
use multibody::codegen::plan::{Plan, PlanOptions};
use multibody::runtime::integrate::{Rk4, Stepper};
use multibody::runtime::interp::RankLoss;
use multibody::runtime::tree::Source;
use multibody::runtime::{Interpreter, System};

use super::args::SimulateArgs;
use super::output::{note, write_file};
use super::plot::{self, Panel};
use super::{source, Failure, Outcome};

/// Rows of the table unless the user says otherwise.
const ROWS: u64 = 1000;
/// More steps than anybody waits for.
const MOST_STEPS: f64 = 1e10;

/// What was recorded.
#[derive(Default)]
pub struct Record {
    /// Times, s.
    pub t: Vec<f64>,
    /// Coordinates, a list for each time.
    pub q: Vec<Vec<f64>>,
    /// Velocities.
    pub v: Vec<Vec<f64>>,
    /// Momenta.
    pub p: Vec<Vec<f64>>,
    /// Kinetic and potential energy, J.
    pub energy: Vec<(f64, f64)>,
}

impl Record {
    /// Largest kinetic energy, J.
    pub fn scale(&self) -> f64 {
        self.energy.iter().map(|e| e.0).fold(0.0, f64::max)
    }

    /// Energy minus that of the start, relative to the largest kinetic energy.
    pub fn errors(&self) -> Vec<f64> {
        let start = self.energy.first().map_or(0.0, |e| e.0 + e.1);
        let scale = self.scale();
        let scale = if scale > 0.0 { scale } else { 1.0 };
        self.energy.iter().map(|e| (e.0 + e.1 - start) / scale).collect()
    }
}

/// Simulates and writes.
pub fn run(args: &SimulateArgs, out: &mut dyn Write) -> Outcome {
    let path = &args.model.model;
    let mut model = source::model_of(&args.model)?;
    let damped = model.joints.iter().any(|j| j.damping.iter().any(|d| *d != Value::ZERO));
    if args.no_damping {
        model.joints.iter_mut().for_each(|j| j.damping.fill(Value::ZERO));
    }
    let plan = Plan::new(&model, PlanOptions { snap: args.snap, ..PlanOptions::default() });
    source::tell_notices(path, &plan.notices);
    if plan.dims.drive_v > 0 {
        note(format_args!("{}: notice: prescribed joints are held at zero", path.display()));
    }
    let steps = (args.time / args.step * (1.0 - 1e-12)).ceil().max(1.0);
    if steps > MOST_STEPS {
        return Err(Failure::new(format!("{steps:.0} steps are too many"), "raise --step or lower --time"));
    }
    let steps = steps as u64;
    let every = args.every.unwrap_or(steps.div_ceil(ROWS));
    let (q, v) = start(&plan, args)?;
    let csv = args.csv.clone().unwrap_or_else(|| PathBuf::from(format!("{}.csv", model.name)));
    let svg = args.svg.clone().unwrap_or_else(|| PathBuf::from(format!("{}.svg", model.name)));
    if csv == svg {
        return Err(Failure::new(
            format!("table and plot are both to be written to `{}`", csv.display()),
            "give --csv and --svg two names",
        ));
    }
    let clock = Instant::now();
    let record = simulate(&plan, (q, v), args.time, steps, every)?;
    let seconds = clock.elapsed().as_secs_f64();
    let picture = plot::svg(&title(&plan, args.time, steps), &panels(&plan, &record)).map_err(|e| {
        Failure::new(format!("cannot draw the plot: {e}"), "look at the numbers in the table; --csv names it")
    })?;
    write_file(&csv, &table(&plan, &record))?;
    write_file(&svg, &picture)?;
    let worst = record.errors().into_iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    writeln!(out, "{}: {} s in {steps} steps of {} s", model.name, args.time, args.time / steps as f64)?;
    match damped && !args.no_damping {
        true => writeln!(out, "energy: changes by up to {worst:.1e} of the largest kinetic energy, {:.3e} J (the model has dampers; --no-damping leaves them out)", record.scale())?,
        false => writeln!(out, "energy error: at most {worst:.1e} of the largest kinetic energy, {:.3e} J", record.scale())?,
    }
    writeln!(out, "speed: {:.0} steps/s (interpreter, four evaluations a step)", steps as f64 / seconds)?;
    writeln!(out, "table: {} ({} rows)\nplot: {}", csv.display(), record.t.len(), svg.display())?;
    Ok(())
}

/// Title of the plot.
pub fn title(plan: &Plan, time: f64, steps: u64) -> String {
    format!("{}: {time} s of free motion in {steps} steps", plan.model.name)
}

/// Initial coordinates and velocities: those of the arguments, or those that the help states.
fn start(plan: &Plan, args: &SimulateArgs) -> Outcome<(Vec<f64>, Vec<f64>)> {
    let list = |what: &str, given: &Option<Vec<f64>>, names: Vec<String>, default: Vec<f64>| match given {
        None => Ok(default),
        Some(list) if list.len() == names.len() => Ok(list.clone()),
        Some(list) => Err(Failure::new(
            format!("--{what} has {} numbers, expected {}", list.len(), names.len()),
            format!("in order: {}", names.join(", ")),
        )),
    };
    let names = plan.coordinate_names();
    let mut q = list("q", &args.q, names.clone(), default_start(plan))?;
    let v = list("v", &args.v, plan.velocity_names(), vec![0.1; plan.dims.nv])?;
    let interpreter: Interpreter<f64> = Interpreter::new(plan.tree(&plan.default_params()), [0.0; 3]);
    for at in interpreter.quaternions() {
        let norm = q[at..at + 4].iter().fold(0.0_f64, |n, x| n.hypot(*x));
        if (norm - 1.0).abs() > 1e-3 {
            return Err(Failure::new(
                format!("--q: {} have length {norm}, expected 1", names[at..at + 4].join(", ")),
                "give a unit quaternion x, y, z, w",
            ));
        }
        q[at..at + 4].iter_mut().for_each(|x| *x /= norm);
    }
    Ok((q, v))
}

/// The start that the help states: see `mbd simulate --help`.
pub fn default_start(plan: &Plan) -> Vec<f64> {
    let interpreter: Interpreter<f64> = Interpreter::new(plan.tree(&plan.default_params()), [0.0; 3]);
    let mut q = interpreter.neutral();
    let mut angle = 0.3;
    for slot in &plan.slots {
        let Some(Source::State { q: at, .. }) = slot.at else { continue };
        match plan.model.joints[slot.joint].kind {
            JointKind::Pin { .. } | JointKind::Helical { .. } => {
                q[at] = angle;
                angle = -angle;
            }
            JointKind::Slider { .. } => q[at] = 0.05,
            _ => {}
        }
    }
    q
}

/// Steps and records, through the interpreter.
pub fn simulate(plan: &Plan, (q, v): (Vec<f64>, Vec<f64>), time: f64, steps: u64, every: u64) -> Outcome<Record> {
    let params = plan.default_params();
    let gravity = match plan.model.gravity {
        // As the fields of generated code start.
        Gravity::Input => [0.0, 0.0, -9.81],
        Gravity::Constant(_) => plan.gravity(&params),
    };
    let mut system = Interpreter::new(plan.tree(&params), gravity);
    // A second one for the energy, so that the first is left as the integrator knows it.
    let mut observer = system.clone();
    observer.check_rank(&q).map_err(|e| rank_failure(plan, &e))?;
    let (mut q, mut p) = (q, vec![0.0; plan.dims.nv]);
    system.momenta(&q, &v, &mut p);
    let h = time / steps as f64;
    let mut rk4 = Rk4::new(&system);
    let mut record = Record::default();
    let mut progress = Progress::new(time);
    for k in 0..=steps {
        let t = k as f64 * h;
        if k % every == 0 || k == steps {
            let mut v = vec![0.0; plan.dims.nv];
            observer.velocities(&q, &p, &mut v);
            record.energy.push(observer.energy(&q, &p));
            record.t.push(t);
            record.v.push(v);
            record.q.push(q.clone());
            record.p.push(p.clone());
        }
        if k == steps {
            break;
        }
        rk4.step(&mut system, t, h, &mut q, &mut p).map_err(|e| {
            progress.clear();
            Failure::new(format!("the simulation failed: {e}"), format!("--step was {h}; nothing was written"))
        })?;
        progress.show(t);
    }
    progress.clear();
    Ok(record)
}

/// A mechanism that cannot move by its own laws.
pub fn rank_failure(plan: &Plan, e: &RankLoss) -> Failure {
    let name = plan.velocity_names().get(e.velocity).cloned().unwrap_or_default();
    Failure::new(
        format!("the mass matrix is singular: freedom `{name}` moves an inertia of {:e}", e.inertia),
        "give the bodies behind this joint mass and inertia, or the joint an armature",
    )
}

/// A line on a terminal that tells how far a long run is.
struct Progress {
    time: f64,
    next: Instant,
    shown: bool,
    calls: u32,
}

impl Progress {
    fn new(time: f64) -> Self {
        Progress { time, next: Instant::now() + Duration::from_secs(1), shown: false, calls: 0 }
    }

    fn show(&mut self, t: f64) {
        // Asking for the time at every step would cost as much as a small step.
        self.calls = self.calls.wrapping_add(1);
        if self.calls & 255 != 0 || Instant::now() < self.next || !std::io::stderr().is_terminal() {
            return;
        }
        self.next = Instant::now() + Duration::from_millis(250);
        self.shown = true;
        let _ = write!(std::io::stderr(), "\rt = {t:.3} of {} s", self.time);
    }

    fn clear(&mut self) {
        if std::mem::take(&mut self.shown) {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}

/// The table: time, coordinates, velocities, momenta, energies.
fn table(plan: &Plan, record: &Record) -> String {
    let (coordinates, velocities) = (plan.coordinate_names(), plan.velocity_names());
    let named = |letter: &str, names: &[String]| -> Vec<String> {
        names.iter().map(|n| quoted(&format!("{letter}.{n}"))).collect()
    };
    let mut header = vec!["t".to_string()];
    header.extend(named("q", &coordinates));
    header.extend(named("v", &velocities));
    header.extend(named("p", &velocities));
    header.extend(["kinetic", "potential", "energy"].map(String::from));
    let mut text = header.join(",") + "\n";
    for (k, t) in record.t.iter().enumerate() {
        let (kinetic, potential) = record.energy[k];
        let _ = write!(text, "{t}");
        for x in record.q[k].iter().chain(&record.v[k]).chain(&record.p[k]) {
            let _ = write!(text, ",{x}");
        }
        let _ = writeln!(text, ",{kinetic},{potential},{}", kinetic + potential);
    }
    text
}

/// A field of a CSV file.
fn quoted(name: &str) -> String {
    match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_string(),
    }
}

/// The plot: coordinates by unit, then the energy.
pub fn panels(plan: &Plan, record: &Record) -> Vec<Panel> {
    let names = plan.coordinate_names();
    let units = units(plan);
    let labels = [("rad", "angle [rad]"), ("m", "position [m]"), ("", "quaternion component")];
    let mut panels = Vec::new();
    for (unit, label) in labels {
        let chosen: Vec<usize> = (0..names.len()).filter(|&k| units[k] == unit).collect();
        if chosen.is_empty() {
            continue;
        }
        let line = |k: usize| (names[k].clone(), record.q.iter().map(|q| q[k]).collect());
        panels.push(Panel {
            label: label.to_string(),
            t: record.t.clone(),
            lines: chosen.into_iter().map(line).collect(),
        });
    }
    let label = "relative energy change".to_string();
    panels.push(Panel { label, t: record.t.clone(), lines: vec![(String::new(), record.errors())] });
    panels
}

/// Unit of every coordinate.
fn units(plan: &Plan) -> Vec<&'static str> {
    let free = plan.slots.iter().filter(|s| matches!(s.at, Some(Source::State { .. })));
    free.flat_map(|slot| -> &'static [&'static str] {
        match plan.model.joints[slot.joint].kind {
            JointKind::Pin { .. } | JointKind::Helical { .. } => &["rad"],
            JointKind::Slider { .. } => &["m"],
            JointKind::Cylindrical { .. } => &["m", "rad"],
            JointKind::Universal { .. } => &["rad", "rad"],
            JointKind::Planar { .. } => &["m", "m", "rad"],
            JointKind::Spherical => &["", "", "", ""],
            JointKind::Floating => &["m", "m", "m", "", "", "", ""],
            JointKind::Fixed => &[],
        }
    })
    .copied()
    .collect()
}
