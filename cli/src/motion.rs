//! A simulation with machine code made for it, or with the interpreter, and the record of its motion.

use std::cell::RefCell;
use std::io::{IsTerminal, Write as _};
use std::rc::Rc;
use std::time::{Duration, Instant};

use multibody::codegen::jit::Compiled;
use multibody::codegen::model::Gravity;
use multibody::codegen::plan::Plan;
use multibody::codegen::{Arithmetic, Options, Output};
use multibody::runtime::catalogue::{self, BoxedMethod};
use multibody::runtime::constrained::{
    ConstraintError, Effort, PostStep, Projection, SingularPosition, Stabilisation, WithPostStep,
};
use multibody::runtime::contact::{ImpactOrder, RegimeChoice, RegimeRules};
use multibody::runtime::integrate::{Control, EnergyProjection, Solver, Statistics, Step, StepError};
use multibody::runtime::{Constrained, Differentiable, Interpreter, Real, Scalar, System};

use super::control::{Controller, Driven, Loads};
use super::energy::Balance;
use super::interrupt;
use super::output::{mentioned, note};
use super::timed::Timed;
use super::{loops, source, Failure, Outcome};

/// Settings of a simulation.
#[derive(Clone)]
pub struct Settings<'a> {
    /// Name of the method in the catalogue.
    pub method: &'a str,
    /// Fixed steps, or tolerances of adaptive steps.
    pub step: Step,
    /// Length, s.
    pub time: f64,
    /// Time from one row to the next, s; the last row is at the end.
    pub every: f64,
    /// Whether every step is projected onto the energy of the start.
    pub project: bool,
    /// How loops are kept closed.
    pub hold: Stabilisation,
    /// Whether the interpreter computes everything.
    pub interpreted: bool,
    /// How contacts are followed.
    pub regimes: RegimeRules,
    /// How contacts act that collide at the same instant.
    pub impacts: ImpactOrder,
    /// What moves the joints, if anything does.
    pub control: Option<Rc<Controller>>,
}

impl Settings<'_> {
    /// A mechanism with the control, of which the motion is at its start.
    pub fn driven(&self, mechanism: Compiled) -> Driven {
        if let Some(control) = &self.control {
            control.enter(0.0);
        }
        Driven::new(mechanism, self.control.clone())
    }

    /// Times at which the control changes, and the end, s.
    pub fn instants(&self) -> Vec<f64> {
        let mut times = self.control.as_ref().map_or(Vec::new(), |control| control.instants(self.time));
        times.push(self.time);
        times
    }

    /// Whether the method needs no derivatives of the rates.
    pub fn is_explicit(&self) -> bool {
        catalogue::EXPLICIT.iter().any(|entry| entry.name == self.method)
    }

    /// The method for a mechanism.
    pub fn method<Y: Differentiable<Scalar = f64> + 'static>(&self, system: &Y) -> Outcome<BoxedMethod<'static, Y>> {
        catalogue::any(self.method, system, false)
            .ok_or_else(|| Failure::new(format!("no method `{}`", self.method), "mbd simulate --help lists them"))
    }

    /// Whether steps are chosen by their error.
    pub fn is_adaptive(&self) -> bool {
        self.regimes.choice != RegimeChoice::TimeSteps && matches!(self.step, Step::Adaptive(_))
    }

    /// What the ends of steps may do.
    fn effort(&self) -> Effort {
        match self.step {
            Step::Adaptive(t) if t.control == Control::Full => Effort::within(t.rotations),
            _ => Effort::default(),
        }
    }
}

/// Number of singular positions that are shown.
const SHOWN: usize = 4;
/// Steps after which the pace of a run is known.
const KNOWN: u64 = 20_000;
/// Steps of a whole run from which on they are said to be many.
const MANY: f64 = 1e7;
/// Way of a joint in a step, rad or m, below which the step is not as short as that for the sake of the motion: accurate methods
/// take a tenth of a radian in one.
const HARDLY: f64 = 1e-3;

/// Record of a simulation.
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
    /// Joint forces of the control, a list for each time; empty without control.
    pub efforts: Vec<Vec<f64>>,
    /// What the control and the motion made of the joints' bounds.
    pub loads: Loads,
    /// Time at which the run was interrupted, s.
    pub interrupted: Option<f64>,
    /// Why the run would take very many steps, and what to do about it, where that was told.
    pub crawls: Option<[String; 2]>,
    /// Energy at the ends of steps, which has the error of the method without that of the dense output.
    pub ends: Ends,
    /// Evaluations, steps and rejections.
    pub statistics: Statistics,
    /// Computing times.
    pub spent: Spent,
    /// Residuals and ranks of loops and couplings.
    pub drift: Drift,
    /// What the energy may change by.
    pub balance: Balance,
}

/// Loops and couplings at the ends of steps.
#[derive(Clone, Debug, Default)]
pub struct Drift {
    /// Largest residual before the position correction, m or rad.
    pub found: f64,
    /// Largest residual after the position correction, m or rad.
    pub left: f64,
    /// Number of singular positions, and the first of them.
    pub singular: (u32, Vec<SingularPosition>),
}

/// Energy at the ends of steps.
#[derive(Default)]
pub struct Ends {
    /// Times, s: for each row, the end of the first step that reaches it.
    pub t: Vec<f64>,
    /// Change of the energy since the start, J.
    pub change: Vec<f64>,
    /// Largest change at any step, J.
    worst: f64,
    /// Largest kinetic energy, J.
    pub scale: f64,
}

/// Computing times, s.
#[derive(Clone, Copy, Default)]
pub struct Spent {
    /// Total.
    pub total: f64,
    /// Making machine code of the rates, before the run; `None` where the interpreter computes them.
    pub compiled: Option<f64>,
    /// Evaluations of the rates in steps.
    pub rates: f64,
    /// Derivatives of the rates.
    pub derivatives: f64,
    /// Projection and position correction.
    pub constraints: f64,
    /// Dense output, energies and rows.
    pub output: f64,
    /// Reading the clock.
    pub clock: f64,
}

impl Ends {
    fn relative(&self, x: f64) -> f64 {
        x / if self.scale > 0.0 { self.scale } else { 1.0 }
    }

    /// Largest change of the energy, relative to the largest kinetic energy.
    pub fn worst(&self) -> f64 {
        self.relative(self.worst)
    }

    /// Changes relative to the largest kinetic energy.
    pub fn changes(&self) -> Vec<f64> {
        self.change.iter().map(|x| self.relative(*x)).collect()
    }
}

/// Observer of the states of a simulation.
struct Observer {
    mechanism: Compiled,
    /// The same with its control.
    driven: Driven,
    record: Record,
    start: f64,
    residual: Vec<f64>,
    entries: Vec<f64>,
}

impl Observer {
    fn velocities(&mut self, q: &[f64], p: &[f64]) -> Vec<f64> {
        let mut v = vec![0.0; p.len()];
        self.mechanism.velocities(q, p, &mut v);
        v
    }

    /// What acts in a step from `t` of `h` s, whose states `dense` gives.
    fn work(&mut self, t: f64, h: f64, mut dense: impl FnMut(f64) -> (Vec<f64>, Vec<f64>)) {
        let Observer { mechanism, driven, record: Record { balance, loads, .. }, .. } = self;
        balance.work(mechanism, h, |theta, weight| {
            let (q, p) = dense(theta);
            let power = driven.power(t + theta * h, &q, &p);
            if let Some(control) = driven.control().filter(|_| weight > 0.0) {
                loads.efforts(weight * h, &driven.inputs().tau, |k| control.limited(k));
            }
            (q, p, power)
        });
    }

    fn row(&mut self, t: f64, q: &[f64], p: &[f64]) {
        let v = self.velocities(q, p);
        self.record.loads.motion(t, q, &v);
        self.record.energy.push(self.mechanism.energy(q, p));
        self.record.t.push(t);
        self.record.v.push(v);
        self.record.q.push(q.to_vec());
        self.record.p.push(p.to_vec());
        if let Some(control) = self.driven.control() {
            // A row at the time of a jump is behind it.
            self.record.efforts.push(control.behind(t, || self.driven.efforts(t, q, p)));
        }
    }

    /// The end of a step of `h` s.
    fn end(&mut self, t: f64, h: f64, q: &[f64], p: &[f64], kept: bool) {
        let Observer { mechanism, record, residual, entries, .. } = self;
        if !residual.is_empty() {
            mechanism.constraint_residuals(&q.to_vec(), residual, entries);
            record.drift.left = record.drift.left.max(loops::largest(mechanism.rows(), residual));
        }
        let (kinetic, potential) = self.mechanism.energy(q, p);
        let v = self.velocities(q, p);
        self.record.loads.motion(t, q, &v);
        self.record.balance.step(&mut self.mechanism, h, (q, p), (kinetic, potential));
        let (change, ends) = (kinetic + potential - self.start, &mut self.record.ends);
        (ends.scale, ends.worst) = (ends.scale.max(kinetic), ends.worst.max(change.abs()));
        if kept {
            ends.t.push(t);
            ends.change.push(change);
        }
    }
}

/// [`Projection`], with what it met.
struct Keeper {
    hold: Projection<Timed>,
    met: Rc<RefCell<Drift>>,
}

impl PostStep<Timed> for Keeper {
    fn close(
        &mut self,
        system: &mut Timed,
        t: f64,
        remembers: bool,
        q: &mut Vec<f64>,
        p: &mut Vec<f64>,
    ) -> Result<(), ConstraintError> {
        self.hold.close(system, t, remembers, q, p)?;
        let mut met = self.met.borrow_mut();
        met.found = met.found.max(self.hold.drift());
        let (count, last) = self.hold.singular_positions();
        if count > met.singular.0 {
            met.singular.0 = count;
            let room = met.singular.1.len() < SHOWN;
            met.singular.1.extend(last.filter(|_| room));
        }
        Ok(())
    }
}

/// Gives gravity that is an input the default value of the field in generated code.
pub fn set_gravity<S: Scalar>(plan: &Plan, interpreter: &mut Interpreter<S>) {
    if plan.model.gravity == Gravity::Input {
        interpreter.gravity = [0.0, 0.0, -9.81].map(S::constant);
    }
}

/// An interpreter over any scalar, with the default parameters.
pub fn interpreter<S: Scalar>(plan: &Plan) -> Interpreter<S> {
    let mut interpreter = plan.default_interpreter();
    set_gravity(plan, &mut interpreter);
    interpreter
}

/// Machine code of a plan with the default parameters, in exact arithmetic, which gives the bits of the interpreter; with
/// `interpreted` the interpreter itself.
pub fn mechanism(plan: &Plan, interpreted: bool) -> Outcome<Compiled> {
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let mut mechanism = Compiled::from_plan(plan.clone(), options)
        .map_err(|e| Failure::new(e.to_string(), "simulate with --interpreted"))?;
    set_gravity(plan, mechanism.inputs());
    Ok(if interpreted { mechanism.interpreted() } else { mechanism })
}

/// Momenta of given velocities; with constraints, of the nearest velocities in the metric of the mass matrix that
/// satisfy them.
pub fn momenta<S: Real>(interpreter: &mut Interpreter<S>, q: &Vec<S>, v: &[S]) -> Vec<S> {
    let (mut p, mut v) = (interpreter.zero_momenta(), v.to_vec());
    interpreter.momenta(q, &v, &mut p);
    let mut rows = interpreter.zero_rows();
    if !rows.is_empty() {
        interpreter.project_momenta(S::zero(), q, &mut p, &mut v, &mut rows);
    }
    p
}

/// A solver with a method of the catalogue.
pub type Driver<'a, Y> = Solver<Y, BoxedMethod<'a, Y>>;

/// The method of the settings at the start of a motion, with the given step.
pub fn driver(
    plan: &Plan,
    settings: &Settings,
    system: &mut Timed,
    step: Step,
    (t, q, p): (f64, &Vec<f64>, &Vec<f64>),
    met: &Rc<RefCell<Drift>>,
) -> Outcome<Driver<'static, Timed>> {
    let mut method = settings.method(system)?;
    if !system.rows().is_empty() {
        let hold = Projection::new(system, settings.hold, settings.effort());
        method = Box::new(WithPostStep::new(system, method, Keeper { hold, met: met.clone() }));
    }
    Solver::new(system, method, step, t, q, p).map_err(|e| failure(plan, settings, &e))
}

/// Simulates from given coordinates and velocities, and records the motion.
pub fn simulate(plan: &Plan, (q, v): (Vec<f64>, Vec<f64>), settings: &Settings) -> Outcome<Record> {
    let mut mechanism = mechanism(plan, settings.interpreted)?;
    let interpreter = mechanism.inputs();
    interpreter.check_rank(&q).map_err(|e| source::rank_failure(&e))?;
    let p = momenta(interpreter, &q, &v);
    let (residual, entries) = (interpreter.zero_rows(), interpreter.zero_entries());
    let (kinetic, potential) = interpreter.energy(&q, &p);
    let clock = Instant::now();
    let compiled =
        !settings.interpreted && mentioned("making machine code", || mechanism.prepare(Output::Rates)).is_ok();
    let compiled = compiled.then(|| clock.elapsed().as_secs_f64());
    let mut observer = Observer {
        mechanism: mechanism.clone(),
        driven: settings.driven(mechanism.clone()),
        record: Record {
            balance: Balance::new(plan, settings)?,
            loads: Loads::new(plan, settings.control.is_some()),
            ..Record::default()
        },
        start: kinetic + potential,
        residual,
        entries,
    };
    let mut system = Timed::new(settings.driven(mechanism));
    let met = Rc::new(RefCell::new(Drift::default()));
    let mut driver = driver(plan, settings, &mut system, settings.step, (0.0, &q, &p), &met)?;
    let mut projection = settings.project.then(|| EnergyProjection::new(&mut system, &q, &p, 3));
    observer.end(0.0, 0.0, &q, &p, true);
    observer.row(0.0, &q, &p);
    let clock = Instant::now();
    go(&mut driver, &mut system, settings, &mut projection, &mut observer).map_err(|e| failure(plan, settings, &e))?;
    let total = clock.elapsed().as_secs_f64();
    let mut record = observer.record;
    record.statistics = driver.statistics();
    [record.spent.rates, record.spent.derivatives, record.spent.constraints, record.spent.clock] = system.seconds();
    let met = met.borrow();
    (record.drift.found, record.drift.singular) = (met.found, met.singular.clone());
    (record.spent.total, record.spent.compiled) = (total, compiled);
    Ok(record)
}

/// Makes all steps to the end.
fn go(
    driver: &mut Driver<Timed>,
    system: &mut Timed,
    settings: &Settings,
    projection: &mut Option<EnergyProjection<Timed>>,
    observer: &mut Observer,
) -> Result<(), StepError> {
    let (time, every) = (settings.time, settings.every);
    let rows = (time / every * (1.0 - 1e-12)).ceil().max(1.0) as u64;
    let at = |row: u64| if row < rows { row as f64 * every } else { time };
    let (mut row, mut steps, mut progress) = (1, 0_u64, Progress::new(time));
    let (mut q, mut p) = (observer.record.q[0].clone(), observer.record.p[0].clone());
    let mut instants = settings.instants().into_iter();
    let mut until = instants.next().unwrap_or(time);
    while driver.time() < time {
        if interrupt::asked() {
            let end = driver.time();
            observer.record.interrupted = Some(end);
            if observer.record.t.last().is_some_and(|last| *last < end) {
                // A row at the end, as where a motion is not interrupted.
                driver.state(system, &mut q, &mut p);
                observer.row(end, &q, &p);
            }
            break;
        }
        driver.advance(system, until).inspect_err(|_| progress.clear())?;
        if let Some(projection) = projection {
            driver.project(system, projection);
        }
        let clock = Instant::now();
        system.output = true;
        let ((start, h), end) = (driver.last_step(), driver.time());
        // A time that differs from the end by rounding only counts as the end.
        let near = end - 1e-9 * h;
        let kept = row <= rows && at(row) <= end.max(near);
        while row <= rows && at(row) < near {
            driver.dense(system, (at(row) - start) / h, &mut q, &mut p);
            observer.row(at(row), &q, &p);
            row += 1;
        }
        if observer.record.balance.changes() {
            observer.work(start, h, |theta| {
                driver.dense(system, theta, &mut q, &mut p);
                (q.clone(), p.clone())
            });
        }
        driver.state(system, &mut q, &mut p);
        if std::mem::take(&mut system.reordered) {
            observer.mechanism.reorder_rows(&q);
            observer.driven.reorder_rows(&q);
        }
        observer.end(end, h, &q, &p, kept);
        if row <= rows && at(row) <= end + 1e-9 * h {
            observer.row(at(row), &q, &p);
            row += 1;
        }
        system.output = false;
        if end >= until && end < time {
            until = instants.next().unwrap_or(time);
            if let Some(control) = &settings.control {
                control.enter(end);
                driver.resume(system, end, &q, &p).inspect_err(|_| progress.clear())?;
            }
        }
        observer.record.spent.output += clock.elapsed().as_secs_f64();
        steps += 1;
        if observer.record.crawls.is_none() {
            observer.record.crawls = crawls(settings, (steps, end), observer.record.v.last());
            if let Some([what, help]) = &observer.record.crawls {
                progress.clear();
                note(format_args!("hint: {what}\n  help: {help}"));
            }
        }
        progress.show(end);
    }
    progress.clear();
    Ok(())
}

/// What is told of a run by an explicit method that chooses steps so small that it would need very many of them, in which
/// hardly anything moves, and what to do. `v`: the velocities of the last row, rad/s or m/s.
fn crawls(settings: &Settings, (steps, t): (u64, f64), v: Option<&Vec<f64>>) -> Option<[String; 2]> {
    if steps < KNOWN || !settings.is_adaptive() || !settings.is_explicit() {
        return None;
    }
    let all = steps as f64 * (settings.time / t);
    let fastest = v.into_iter().flatten().fold(0.0, |most: f64, v| most.max(v.abs()));
    if all <= MANY || t / steps as f64 * fastest > HARDLY {
        return None;
    }
    let what = format!(
        "{steps} steps have led to {t:.1e} s: a step is {:.1e} s on the average, and {} s would take {all:.0e} of them. Unless \
         the mechanism moves as fast as that, the model is stiff or nearly singular",
        t / steps as f64,
        settings.time
    );
    let take = "take `--method rodas5p` or `--method radau5`, which need few steps for such models";
    let help = match settings.control.as_ref().is_some_and(|control| !control.has_derivatives()) {
        true => format!("leave --gravity-compensation out, and {take}"),
        false => take.to_string(),
    };
    Some([what, help])
}

/// The failure of a run that did not reach its end: what happened, when, and what to do.
fn failure(plan: &Plan, settings: &Settings, e: &StepError) -> Failure {
    let names = plan.velocity_names();
    let what = match e {
        StepError::NotFinite { index, .. } if *index < 2 * names.len() => {
            let kind = if *index < names.len() { "coordinate" } else { "momentum" };
            format!("the simulation failed: {e} (it is the {kind} of `{}`)", names[index % names.len()])
        }
        StepError::Constraint { error, .. } => match loops::named(plan, error) {
            Some(name) => format!("the simulation failed at {name}: {e}"),
            None => format!("the simulation failed: {e}"),
        },
        _ => format!("the simulation failed: {e}"),
    };
    let time = e.time();
    let before = match time > 0.0 {
        true => format!("; --time {} shows what came before", 0.999 * time),
        false => String::new(),
    };
    let help = match (e, settings.step) {
        (StepError::NoEstimate { .. }, _) => "give --step, in s: for example --step 0.001".to_string(),
        (StepError::Constraint { error: ConstraintError::Energy { .. }, .. }, _)
            if matches!(settings.hold, Stabilisation::None | Stabilisation::Momenta) =>
        {
            format!("keep the loops closed at every step: --hold mass{before}; nothing was written")
        }
        (_, Step::Fixed(h)) => {
            format!(
                "the step was {h} s: lower --step, or leave it out for steps by the error{before}; nothing was written"
            )
        }
        (StepError::StepTooSmall { error, .. }, Step::Adaptive(_)) if !error.is_finite() => {
            format!("the state is singular there, or too large for doubles: look at --q and --v, and at masses and inertias near zero{before}; nothing was written")
        }
        (StepError::NotFinite { .. }, Step::Adaptive(_)) => {
            format!("the state is singular there, or too large for doubles: look at --q and --v{before}; nothing was written")
        }
        (_, Step::Adaptive(_)) => {
            format!("raise --tolerance, or look at the mechanism near that time{before}; nothing was written")
        }
    };
    Failure::new(what, help)
}

/// A progress line on a terminal for long runs.
pub struct Progress {
    time: f64,
    next: Instant,
    shown: bool,
    start: Instant,
}

impl Progress {
    /// A run of this length, s.
    pub fn new(time: f64) -> Self {
        let start = Instant::now();
        Progress { time, next: start + Duration::from_secs(2), shown: false, start }
    }

    /// The time that is reached, s.
    pub fn show(&mut self, t: f64) {
        if Instant::now() < self.next || !std::io::stderr().is_terminal() {
            return;
        }
        self.next = Instant::now() + Duration::from_millis(250);
        self.shown = true;
        let left = self.start.elapsed().as_secs_f64() * (self.time / t - 1.0);
        let _ = write!(std::io::stderr(), "\r\x1b[Kt = {t:.3} of {} s, about {left:.0} s left", self.time);
    }

    /// Takes the line away.
    pub fn clear(&mut self) {
        if std::mem::take(&mut self.shown) {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}
