//! `mbd-lab experiments drops`: boxes and legs that are thrown on the floor, each in its own way.

use std::collections::BTreeMap;
use std::io::Write;
use std::time::{Duration, Instant};

use multibody::codegen::jit::Compiled;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, ImportOptions};
use multibody::codegen::{Arithmetic, Options};
use multibody::runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::contact::{
    ContactError, ContactMotion, ContactObserver, HybridError, ModeTable, Regime, RegimeChoice, RegimeRules, Stretch,
    Touching, WithContacts,
};
use multibody::runtime::integrate::{AutoSwitch, Radau5, Step, Tolerances, Verner9};
use multibody::runtime::{Conjugate, Constrained, Energetic, System as _};

use super::tables::{head, row};
use crate::args::experiments::DropsArgs;
use mbd_cli::{note, Failure, Outcome};

type Mechanism = ModeTable<Compiled>;
type System = WithContacts<Mechanism>;

/// The mechanisms.
const MECHANISMS: [(&str, &str); 2] = [("box", include_str!("box.toml")), ("leg", include_str!("leg.toml"))];
/// Tolerance of the motion.
const TOLERANCE: f64 = 1e-8;
/// Steps of a motion by events, at most; with time steps in between, ten times as many.
const STEPS: u64 = 10_000;
/// Time steps where events are not followed, s.
const STEP: f64 = 1e-3;
/// Time of a throw, s.
const TIME: f64 = 2.0;
/// Height from which the origin of the first body falls, m: no shape reaches the floor.
const HEIGHT: f64 = 0.7;

/// Numbers between −1 and 1 (a linear congruential generator).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    }
}

/// A throw.
struct Throw {
    q: Vec<f64>,
    v: Vec<f64>,
    friction: f64,
    restitution: f64,
}

impl Throw {
    /// Any orientation; angles up to 1 rad, bent knees; velocities up to 2 m/s and 2 rad/s.
    fn new(random: &mut Random, (nq, nv): (usize, usize)) -> Throw {
        let (friction, restitution) = (0.5 + 0.5 * random.next(), 0.25 + 0.25 * random.next());
        let mut q = vec![0.0, 0.0, HEIGHT];
        let axis: [f64; 4] = std::array::from_fn(|_| random.next());
        let size = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        q.extend(axis.map(|x| x / size));
        q.extend((7..nq).map(|k| if k + 1 == nq { -0.6 + 0.5 * random.next() } else { random.next() }));
        Throw { q, v: (0..nv).map(|_| 2.0 * random.next()).collect(), friction, restitution }
    }
}

/// What is seen along a motion.
struct Watch {
    q: Vec<f64>,
    p: Vec<f64>,
    rest: Vec<f64>,
    rows: [Vec<f64>; 2],
    entries: Vec<f64>,
    /// Least gap, m (rad for stops).
    least: f64,
    /// Whether all numbers were finite.
    finite: bool,
}

impl Watch {
    fn new(system: &System) -> Watch {
        let inner = system.system();
        Watch {
            q: inner.neutral(),
            p: inner.zero_momenta(),
            rest: inner.zero_momenta(),
            rows: [inner.zero_rows(), inner.zero_rows()],
            entries: inner.zero_entries(),
            least: f64::INFINITY,
            finite: true,
        }
    }
}

impl ContactObserver<Mechanism> for Watch {
    fn stretch(&mut self, system: &mut System, stretch: &mut dyn Stretch<Mechanism>) {
        let [begin, end] = stretch.span();
        for t in [0.5 * (begin + end), end] {
            stretch.state(system, t, &mut self.q, &mut self.p);
            self.finite &= self.q.iter().chain(&self.p).all(|x| x.is_finite());
            let [gaps, velocities] = &mut self.rows;
            system.system_mut().gaps(t, &self.q, &self.rest, gaps, velocities, &mut self.entries);
            let normal = system.system().contacts().iter().map(|c| gaps[c.row]);
            self.least = normal.fold(self.least, f64::min);
        }
    }
}

/// What came of the throws of a mechanism.
#[derive(Default)]
struct Tally {
    throws: u64,
    /// Motions that failed by events, by their reason; those of them that went to the end with time steps in between.
    failures: BTreeMap<&'static str, (u64, u64)>,
    /// Failures that are no typed errors: a number that is not finite, a body below the floor, energy gained.
    silent: Vec<String>,
    events: u64,
    evaluations: u64,
    /// Least gap, m (rad for stops), of motions by events; largest relative residual of an impact; energy gained beside
    /// what impacts have taken, as a part of the energy above the floor.
    least: f64,
    residual: f64,
    gained: f64,
    seconds: f64,
}

/// Gaps below this, m (rad), and gains of energy beyond this part are failures that nothing has told.
const BELOW: f64 = -1e-6;
const GAINED: f64 = 1e-6;

/// Throws every mechanism and prints what comes of it.
pub fn run(args: &DropsArgs, out: &mut dyn Write) -> Outcome {
    let columns = [
        "thrown",
        "throws",
        "to the end by events",
        "typed errors",
        "of these to the end with time steps",
        "silent failures",
        "events a throw",
        "evaluations",
        "time, ms",
        "least gap, m",
        "largest residual",
        "energy gained",
    ];
    let mut text = head(&format!("{} throws of each, {TIME} s, tolerance {TOLERANCE:.0e}", args.count), &columns);
    let mut reasons = String::new();
    let chosen = |name: &str| args.only.as_deref().is_none_or(|only| only == name);
    if let Some(only) = args.only.as_deref().filter(|only| MECHANISMS.iter().all(|(name, _)| name != only)) {
        return Err(Failure::new(format!("--only {only}: no such mechanism"), "take box or leg"));
    }
    for (name, model) in MECHANISMS.into_iter().filter(|(name, _)| chosen(name)) {
        let tally = throws(name, model, args)?;
        let (failed, stepped) = tally.failures.values().fold((0, 0), |(a, b), (x, y)| (a + x, b + y));
        let each = |total: f64| format!("{:.1}", total / tally.throws as f64);
        let cells = [
            name.into(),
            tally.throws.to_string(),
            (tally.throws - failed).to_string(),
            failed.to_string(),
            stepped.to_string(),
            tally.silent.len().to_string(),
            each(tally.events as f64),
            each(tally.evaluations as f64),
            each(1e3 * tally.seconds),
            format!("{:.1e}", tally.least),
            format!("{:.1e}", tally.residual),
            format!("{:.1e}", tally.gained),
        ];
        row(&mut text, &cells);
        for (reason, (count, _)) in &tally.failures {
            reasons += &format!("- {name}: {count} × {reason}\n");
        }
        tally.silent.iter().for_each(|what| reasons += &format!("- {name}: {what}\n"));
    }
    writeln!(out, "{text}\n{reasons}")?;
    Ok(())
}

/// The throws of a mechanism.
fn throws(name: &str, text: &str, args: &DropsArgs) -> Outcome<Tally> {
    let failed = |error: &dyn std::fmt::Display| Failure::new(error.to_string(), "report this: the model is built in");
    let model = read::model(&format!("{name}.toml"), text, &ImportOptions::default()).map_err(|e| failed(&e))?.model;
    let plan = Plan::new(&model, 1e-9);
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let mechanism = plan.compiled_with_contacts(&options, Compiled::<f64>::WORTHWHILE).map_err(|e| failed(&e))?;
    let mut system = WithContacts::new(mechanism);
    let mut random = Random(args.seed);
    let mut tally = Tally { least: f64::INFINITY, ..Tally::default() };
    let (clock, mut told) = (Instant::now(), Instant::now());
    let mut next = || Throw::new(&mut random, (plan.dims.nq, plan.dims.nv));
    (1..args.first).for_each(|_| drop(next()));
    for k in 0..args.count {
        throw(&mut system, &next(), &mut tally);
        if told.elapsed() > Duration::from_secs(10) {
            told = Instant::now();
            note(format_args!("{name}: {} of {} throws", k + 1, args.count));
        }
    }
    tally.seconds = clock.elapsed().as_secs_f64();
    Ok(tally)
}

/// One throw: by events, and if these fail, with time steps where they do.
fn throw(system: &mut System, throw: &Throw, tally: &mut Tally) {
    let mechanism = system.system_mut();
    mechanism.set_friction(throw.friction);
    mechanism.set_restitution(throw.restitution);
    let mut p = throw.v.clone();
    mechanism.conjugate_momenta(&throw.q, &throw.v, &mut p);
    tally.throws += 1;
    if let Err(error) = follow(system, (&throw.q, &p), RegimeChoice::Events, tally) {
        let stepped = follow(system, (&throw.q, &p), RegimeChoice::Automatic, tally);
        let (count, ended) = tally.failures.entry(reason(&error)).or_default();
        *count += 1;
        *ended += u64::from(stepped.is_ok());
    }
}

/// A motion, whose events and failures are counted.
fn follow(
    system: &mut System,
    (q, p): (&Vec<f64>, &Vec<f64>),
    choice: RegimeChoice,
    tally: &mut Tally,
) -> Result<(), HybridError> {
    let effort = Effort { energy: f64::INFINITY, ..Effort::default() };
    let projection = |system: &System| Projection::new(system, Stabilisation::Mass, effort);
    let method = AutoSwitch::new(system, Verner9::new(system), Radau5::new(system));
    let method = WithPostStep::new(system, method, projection(system));
    let step = Step::Adaptive(Tolerances::new(TOLERANCE));
    let close = projection(system);
    let rules = RegimeRules::new(choice, STEP);
    let mut motion = ContactMotion::new(system, (method, step), close, rules, 0.0, (q, p))?;
    // It flies: the contacts of the throw before no longer act.
    let (kinetic, potential) = system.energies(q, p);
    let above = kinetic + potential;
    motion.events.limits_mut().steps = if choice == RegimeChoice::Events { STEPS } else { 10 * STEPS };
    let mut watch = Watch::new(system);
    let result = motion.run(system, TIME, &mut watch);
    let (mut q, mut p) = (q.clone(), p.clone());
    motion.state(system, &mut q, &mut p);
    let (kinetic, potential) = system.energies(&q, &p);
    let happened = motion.contact_statistics();
    let by_events = motion.statistics().time[Regime::TimeSteps as usize] == 0.0;
    // What time steps overlap, or lose, depends on their size.
    if by_events {
        let gained = (kinetic + potential + happened.lost - above) / above;
        tally.events += happened.events;
        tally.evaluations += motion.integration_statistics().evaluations;
        tally.least = tally.least.min(watch.least);
        tally.residual = tally.residual.max(happened.residual);
        tally.gained = tally.gained.max(gained);
        if !(watch.finite && watch.least > BELOW && gained < GAINED) {
            let (k, ended) = (tally.throws, result.map_or_else(|e| e.to_string(), |()| "it runs to the end".into()));
            let numbers = if watch.finite { "" } else { ", numbers that are not finite" };
            let silent =
                format!("throw {k}: least gap {:.1e} m, energy gained {gained:.1e}{numbers}; {ended}", watch.least);
            tally.silent.push(silent);
        }
    } else if !(watch.finite && kinetic + potential < above) {
        tally.silent.push(format!(
            "throw {} with time steps: energy {:.1e}",
            tally.throws,
            kinetic + potential - above
        ));
    }
    result
}

/// The reason of an error, for the table.
fn reason(error: &HybridError) -> &'static str {
    match error {
        HybridError::Step(_) => "a step fails, or too many are needed",
        HybridError::Contact { error: ContactError::NoConvergence { .. }, .. } => {
            "impulses are not found to the tolerance"
        }
        HybridError::Contact { error: ContactError::Wedged { .. }, .. } => "friction wedges",
        HybridError::Contact { .. } => "another error of the impulses",
        HybridError::TooManyEvents { .. } => "too many events",
        HybridError::TurnsTooFar { .. } => "bodies turn too far in a step",
        _ => "another error",
    }
}
