//! Motions of mechanisms with contacts: the run, its record, and the table of its events.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use multibody::codegen::jit::Compiled;
use multibody::codegen::model::{ConstraintKind, ShapeKind};
use multibody::codegen::plan::Plan;
use multibody::codegen::words::quote;
use multibody::codegen::{Arithmetic, Options};
use multibody::runtime::catalogue::BoxedMethod;
use multibody::runtime::constrained::{Effort, Projection, WithPostStep};
use multibody::runtime::contact::{
    Cause, ContactError, ContactEvent, ContactMotion, ContactObserver, ContactStatistics, HybridError, Mode, ModeTable,
    Regime, RegimeChange, RegimeChoice, RegimeReason, RegimeStatistics, SteppingStatistics, Stretch, WithContacts,
};
use multibody::runtime::integrate::{AutoSwitch, Radau5, Statistics, Step};
use multibody::runtime::tree::Source;
use multibody::runtime::Conjugate;

use super::control::{Driven, Loads};
use super::interrupt;
use super::motion::{set_gravity, Progress, Record, Settings};
use super::{Failure, Outcome};

/// A mechanism with contacts: machine code for the modes that a motion stays in, the interpreter for the others.
type Mechanism = ModeTable<Driven>;
type System = WithContacts<Mechanism>;

/// Number of events that are printed.
const SHOWN: usize = 12;

/// A motion with contacts.
pub struct Touched {
    /// Its rows.
    pub record: Record,
    /// Its events, in the order of time.
    pub events: Vec<ContactEvent<f64>>,
    /// What time steps have in their place.
    pub presses: Vec<Press>,
    /// What happened at the contacts, followed by events.
    pub contacts: ContactStatistics,
    /// What happened at the contacts in time steps.
    pub stepping: SteppingStatistics,
    /// Times in events and in time steps, and the changes between them.
    pub regimes: RegimeStatistics,
    /// These changes, in the order of time.
    pub changes: Vec<RegimeChange>,
    /// The contacts that are closed at the end, by events.
    pub closed: Vec<(usize, Mode)>,
    /// The contacts that press at the end, by time steps, which do not tell whether these slide.
    pub pressed: Vec<usize>,
    /// The sets of modes that were visited, and the time that was spent in each, s.
    pub visits: Vec<(Vec<Mode>, f64)>,
    /// Forces of the contacts along their rows, N, for every row of the record; empty where nobody asked for them.
    pub forces: Vec<Vec<[f64; 3]>>,
    /// Computing time, s.
    pub seconds: f64,
}

/// In time steps, a contact begins to press, or no longer does.
pub struct Press {
    /// The end of the step, s.
    time: f64,
    contact: usize,
    begins: bool,
}

/// Which contacts press, and where that changes in time steps.
struct Presses {
    pressed: Vec<bool>,
    changes: Vec<Press>,
}

impl Presses {
    /// By events: contacts that are closed press.
    fn closed(&mut self, modes: &[Mode]) {
        self.pressed.iter_mut().zip(modes).for_each(|(pressed, mode)| *pressed = *mode != Mode::Open);
    }

    /// A time step has ended in which these contacts press.
    fn step(&mut self, time: f64, now: &[bool]) {
        for (contact, (pressed, begins)) in self.pressed.iter_mut().zip(now).enumerate() {
            if begins != pressed {
                self.changes.push(Press { time, contact, begins: *begins });
            }
            *pressed = *begins;
        }
    }
}

/// Keeps rows and events.
struct Observer {
    record: Record,
    events: Vec<ContactEvent<f64>>,
    changes: Vec<RegimeChange>,
    visits: Vec<(Vec<Mode>, f64)>,
    /// Forces of the contacts at the rows, where they are kept.
    forces: Option<Vec<Vec<[f64; 3]>>>,
    /// A copy in which they are computed, once there is one.
    aside: Option<System>,
    /// Whether rows are missing because of an interrupt.
    cut: bool,
    every: f64,
    time: f64,
    q: Vec<f64>,
    p: Vec<f64>,
}

impl Observer {
    /// Time of the next row, s.
    fn next(&self) -> f64 {
        let row = self.record.t.len() as f64 * self.every;
        // A row that differs from the end by rounding only is at the end.
        if row > self.time * (1.0 - 1e-12) {
            self.time
        } else {
            row
        }
    }

    fn row(&mut self, system: &mut System, t: f64) {
        if let Some(kept) = &mut self.forces {
            // In a copy: nothing of the motion depends on whether it is drawn. There is one for all rows, because making it
            // takes far longer than the forces where there are many contacts.
            let aside = self.aside.get_or_insert_with(|| system.clone());
            aside.take_modes_of(system);
            kept.push(aside.forces(t, &self.q, &self.p).to_vec());
        }
        let (mechanism, record) = (system.system_mut(), &mut self.record);
        let mut v = vec![0.0; self.p.len()];
        mechanism.velocities(&self.q, &self.p, &mut v);
        let energy = mechanism.energy(&self.q, &self.p);
        record.t.push(t);
        record.q.push(self.q.clone());
        record.v.push(v);
        record.p.push(self.p.clone());
        record.energy.push(energy);
        record.loads.motion(t, &self.q, record.v.last().map_or(&[][..], |v| v));
        if let Some(control) = mechanism.control() {
            let efforts = control.behind(t, || mechanism.efforts(t, &self.q, &self.p));
            record.loads.efforts(self.every, &efforts, |k| control.limited(k));
            record.efforts.push(efforts);
        }
        let change = energy.0 + energy.1 - (record.energy[0].0 + record.energy[0].1);
        record.ends.t.push(t);
        record.ends.change.push(change);
        record.ends.scale = record.ends.scale.max(energy.0);
    }
}

impl ContactObserver<Mechanism> for Observer {
    fn stretch(&mut self, system: &mut System, stretch: &mut dyn Stretch<Mechanism>) {
        let [begin, end] = stretch.span();
        match self.visits.iter_mut().find(|(modes, _)| modes == system.modes()) {
            Some((_, time)) => *time += end - begin,
            None => self.visits.push((system.modes().to_vec(), end - begin)),
        }
        // A row that differs from the end by rounding only is at the end.
        let near = end + 1e-9 * (end - begin);
        while self.next() <= near && self.record.t.last().is_some_and(|last| *last < self.time) {
            if interrupt::asked() {
                self.cut = true;
                break;
            }
            let t = self.next();
            let (mut q, mut p) = (std::mem::take(&mut self.q), std::mem::take(&mut self.p));
            stretch.state(system, t.min(end), &mut q, &mut p);
            (self.q, self.p) = (q, p);
            self.row(system, t);
        }
    }

    fn event(&mut self, _system: &mut System, event: &ContactEvent<f64>) {
        self.events.push(*event);
    }

    fn regime(&mut self, _system: &mut System, change: &RegimeChange) {
        self.changes.push(*change);
    }
}

/// The method of the settings around which contacts are followed.
fn method(settings: &Settings, system: &System) -> Outcome<BoxedMethod<'static, System>> {
    let mut method = settings.method(system)?;
    if settings.is_explicit() && matches!(settings.step, Step::Adaptive(_)) {
        // What slides slowly is stiff.
        method = Box::new(AutoSwitch::new(system, method, Radau5::new(system)));
    }
    Ok(Box::new(WithPostStep::new(system, method, projection(settings, system))))
}

/// What closes loops and contacts.
fn projection(settings: &Settings, system: &System) -> Projection<System> {
    Projection::new(system, settings.hold, Effort { energy: f64::INFINITY, ..Effort::default() })
}

/// A mechanism with contacts, in exact arithmetic, so that machine code gives the bits of the interpreter.
fn mechanism(plan: &Plan, settings: &Settings) -> Outcome<Mechanism> {
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let calls = if settings.interpreted { u32::MAX } else { Compiled::<f64>::WORTHWHILE };
    let full = Compiled::from_plan(plan.with_contacts(), options.of_model(true))
        .map_err(|e| Failure::new(e.to_string(), "simulate with --interpreted"))?;
    let mut mechanism = ModeTable::new(settings.driven(full.compiled_after(calls)), plan.contacts());
    set_gravity(plan, mechanism.inputs());
    Ok(mechanism)
}

/// Simulates from given coordinates and velocities. `with_forces` keeps the forces of the contacts at all rows.
pub fn simulate(plan: &Plan, (q, v): (Vec<f64>, Vec<f64>), settings: &Settings, with_forces: bool) -> Outcome<Touched> {
    let mut mechanism = mechanism(plan, settings)?;
    mechanism.inputs().check_rank(&q).map_err(|e| super::source::rank_failure(&e))?;
    let mut p = v.clone();
    mechanism.conjugate_momenta(&q, &v, &mut p);
    let mut system = WithContacts::new(mechanism);
    let method = method(settings, &system)?;
    let failed = |e: HybridError| failure(plan, &e);
    let mut observer = Observer {
        record: Record { loads: Loads::new(plan, settings.control.is_some()), ..Record::default() },
        events: Vec::new(),
        changes: Vec::new(),
        visits: Vec::new(),
        forces: with_forces.then(Vec::new),
        aside: None,
        cut: false,
        every: settings.every,
        time: settings.time,
        q,
        p,
    };
    let clock = Instant::now();
    observer.row(&mut system, 0.0);
    let (q, p) = (observer.q.clone(), observer.p.clone());
    let (close, rules, start) = (projection(settings, &system), settings.regimes, (&q, &p));
    let motion = ContactMotion::new(&mut system, (method, settings.step), close, rules, 0.0, start);
    let mut motion = motion.map_err(|e| beyond_stops(plan, (&q, rules.choice), &e).unwrap_or_else(|| failed(e)))?;
    motion.events.rules.order = settings.impacts;
    let mut progress = Progress::new(settings.time);
    let mut presses = Presses { pressed: vec![false; system.modes().len()], changes: Vec::new() };
    for until in settings.instants() {
        while motion.time() < until && !interrupt::asked() {
            motion.advance(&mut system, until, &mut observer).inspect_err(|_| progress.clear()).map_err(failed)?;
            match motion.regime() {
                Regime::Events => presses.closed(system.modes()),
                Regime::TimeSteps => presses.step(motion.time(), motion.steps.pressed()),
            }
            progress.show(motion.time());
        }
        if let Some(control) = settings.control.as_ref().filter(|_| until < settings.time) {
            control.enter(until);
            if control.jumps() {
                motion.resume(&mut system).map_err(failed)?;
            }
        }
    }
    progress.clear();
    let end = motion.time();
    let interrupted = observer.cut || end < settings.time;
    if interrupted && observer.record.t.last() != Some(&end) {
        // Events and forces are known to here; of the rows in between, some may be missing.
        let (mut q, mut p) = (observer.q.clone(), observer.p.clone());
        motion.state(&system, &mut q, &mut p);
        (observer.q, observer.p) = (q, p);
        observer.row(&mut system, end);
    }
    observer.record.interrupted = interrupted.then_some(end);
    let statistics: Statistics = motion.integration_statistics();
    let (modes, count) = (system.modes().iter().copied().enumerate(), system.modes().len());
    Ok(Touched {
        record: Record { statistics, ..observer.record },
        events: observer.events,
        presses: presses.changes,
        forces: observer.forces.unwrap_or_default(),
        visits: observer.visits,
        contacts: *motion.contact_statistics(),
        stepping: *motion.stepping_statistics(),
        regimes: *motion.statistics(),
        changes: observer.changes,
        closed: modes.filter(|(_, mode)| *mode != Mode::Open).collect(),
        pressed: match motion.regime() {
            Regime::Events => Vec::new(),
            Regime::TimeSteps => (0..count).filter(|k| motion.steps.pressed()[*k]).collect(),
        },
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// What computed the steps.
pub fn ways(touched: &Touched, choice: RegimeChoice) -> String {
    let [_, _, compiled, interpreted, _] = touched.contacts.steps;
    let (sets, steps) = (touched.visits.len(), touched.stepping.steps);
    let events = format!("{compiled} steps by machine code, {interpreted} by the interpreter, {sets} sets of modes");
    match choice {
        RegimeChoice::Events => events,
        RegimeChoice::TimeSteps => format!("{steps} time steps"),
        RegimeChoice::Automatic => format!("{events}; {steps} time steps"),
    }
}

/// The failure of a run: the contact by its name.
fn failure(plan: &Plan, error: &HybridError) -> Failure {
    match error {
        HybridError::Overlap { contact, gap } => Failure::new(
            format!("the bodies of contact `{}` overlap by {:.3e} at the start", name(plan, *contact), -gap),
            "give --q with a position where they are apart or touch",
        ),
        other => {
            let help = "a smaller --tolerance, or a shorter --time, shows what came before; nothing was written";
            let help = match cylinder_on_plane(plan) {
                Some(name) => format!(
                    "if cylinder {} stands upright on a plane there, it has no lowest point: give it corners, as a box or hull, or points; \
                     otherwise {help}",
                    quote(name)
                ),
                None => help.to_string(),
            };
            Failure::new(format!("the simulation failed: {other}{}", named(plan, other)), help)
        }
    }
}

/// The first cylinder that can stand on a plane.
fn cylinder_on_plane(plan: &Plan) -> Option<&str> {
    let shapes = &plan.model.shapes;
    let pairs = plan.model.contacts.iter().filter_map(|contact| contact.shapes);
    let ordered = pairs.flat_map(|[a, b]| [[a, b], [b, a]]).map(|pair| pair.map(|k| &shapes[k]));
    let mut cylinders = ordered.filter_map(|[ground, shape]| match (&ground.kind, &shape.kind) {
        (ShapeKind::Plane { .. }, ShapeKind::Cylinder { length, .. }) if *length > 0.0 => Some(shape.name.as_str()),
        _ => None,
    });
    cylinders.next()
}

/// The failure of a start where a joint stands beyond its stop, with all joints that do.
fn beyond_stops(plan: &Plan, (q, choice): (&[f64], RegimeChoice), error: &HybridError) -> Option<Failure> {
    let HybridError::Overlap { contact: first, .. } = error else { return None };
    // With less, motions begin, by time steps with far more.
    let most = if choice == RegimeChoice::Events { 1e-9 } else { 1e-3 };
    let contacts = &plan.model.contacts;
    contacts.get(*first)?.stop()?;
    let beyond = contacts.iter().enumerate().filter_map(|(k, contact)| {
        let (joint, from_below, limit) = contact.stop()?;
        let Some(Source::State { q: at, .. }) = plan.slots.iter().find(|slot| slot.joint == joint)?.at else {
            return None;
        };
        let by = if from_below { limit - q[at] } else { q[at] - limit };
        let amount = if by < 1e-3 { format!("{by:.1e}") } else { format!("{by:.3}") };
        let (name, end) = (quote(&plan.model.joints[joint].name), if from_below { "lower" } else { "upper" });
        let text = format!("joint {name} stands {amount} {} beyond its {end} limit", unit(plan, k));
        (k == *first || by > most).then_some(text)
    });
    Some(Failure::new(
        format!("at the start, {}", beyond.collect::<Vec<_>>().join(", ")),
        "give --q with positions within these limits, or change the limits; those of a URDF or an MJCF model act with --limits only",
    ))
}

/// The name of the contact that an error states by its number, in brackets.
fn named(plan: &Plan, error: &HybridError) -> String {
    match error {
        HybridError::Contact {
            error: ContactError::NoConvergence { touch, .. } | ContactError::Wedged { touch, .. },
            ..
        } => format!(" (contact {touch} is `{}`)", name(plan, *touch)),
        _ => String::new(),
    }
}

/// Name of a contact.
fn name(plan: &Plan, k: usize) -> &str {
    plan.model.contacts.get(k).map_or("?", |c| c.name.as_str())
}

/// What contact `k` does in a mode: where there is no friction, bodies that touch are just closed.
fn mode(plan: &Plan, k: usize, mode: Mode) -> &'static str {
    let rubs = plan.model.contacts.get(k).is_some_and(|c| c.friction > 0.0);
    match mode {
        Mode::Open => "open",
        Mode::Slide if !rubs => "closed",
        Mode::Slide => "slides",
        Mode::Stick => "sticks",
    }
}

/// Unit of the gap of contact `k`: that of its joint for a stop.
fn unit(plan: &Plan, k: usize) -> &'static str {
    match plan.model.contacts.get(k).map(|c| &c.kind) {
        Some(ConstraintKind::Coupling { terms, .. }) => {
            let joint = terms.first().and_then(|(joint, _)| plan.model.joints.get(*joint));
            joint.and_then(|j| j.kind.spec().freedoms.first()).map_or("m", |f| f.unit.symbol())
        }
        _ => "m",
    }
}

/// Why a motion changed between events and time steps.
fn reason(reason: &RegimeReason) -> String {
    match reason {
        RegimeReason::ManyEvents(count) => format!("{count} events followed one another"),
        RegimeReason::ManySteps(count) => format!("events needed {count} steps"),
        RegimeReason::Failed(error) => error.to_string(),
        RegimeReason::Quiet => "the contacts that press stay the same".to_string(),
        _ => "another reason".to_string(),
    }
}

/// Where the motion was followed by events and where by time steps.
fn report_regimes(touched: &Touched, out: &mut dyn Write) -> Outcome {
    let Touched { regimes, changes, stepping, .. } = touched;
    let [events, steps] = regimes.time;
    writeln!(out, "regimes: {events:.6} s by events, {steps:.6} s by time steps, {} changes", regimes.changes)?;
    for change in changes.iter().take(SHOWN) {
        let name = if change.regime == Regime::Events { "events" } else { "time steps" };
        writeln!(out, "  {:>12.9} s  {name}: {}", change.time, reason(&change.reason))?;
    }
    if changes.len() > SHOWN {
        writeln!(out, "  and {} more", changes.len() - SHOWN)?;
    }
    let SteppingStatistics { steps, divided, touched, most, residual, overlap, .. } = stepping;
    if *steps == 0 {
        return Ok(());
    }
    writeln!(
        out,
        "time steps: {steps}, {touched} of them with impulses, of at most {most} contacts; residual at most {residual:.1e} of \
         the impulses, overlap at most {overlap:.1e} m or rad"
    )?;
    if *divided > 0 {
        writeln!(out, "divided: {divided} time steps, whose impulses did not converge at once")?;
    }
    if regimes.closed > 0.0 {
        writeln!(
            out,
            "closed: gaps and overlaps up to {:.1e} m or rad, where events followed time steps",
            regimes.closed
        )?;
    }
    Ok(())
}

/// The first events, the contacts at the end, and what impacts took.
pub fn report(plan: &Plan, touched: &Touched, choice: RegimeChoice, out: &mut dyn Write) -> Outcome {
    let Touched { events, contacts, closed, .. } = touched;
    let (count, impacts) = (contacts.events, contacts.impacts);
    if choice != RegimeChoice::Events {
        report_regimes(touched, out)?;
    }
    if choice != RegimeChoice::TimeSteps {
        writeln!(
            out,
            "events: {count}, {impacts} of them with an impact, {} changes of contact modes",
            contacts.switches
        )?;
    }
    for event in events.iter().take(SHOWN) {
        let mut line = format!("  {:>12.9} s  {} {}", event.time, name(plan, event.contact), event.cause.verb());
        if event.impact.is_some() && event.cause != Cause::Jammed {
            let _ = write!(line, " at {:.6} {}/s", event.approach, unit(plan, event.contact));
        }
        if let Some(rest) = event.rest {
            let _ = write!(line, ", bounces end at {rest:.9} s");
        }
        writeln!(out, "{line}, then {}", mode(plan, event.contact, event.modes[1]))?;
    }
    if events.len() > SHOWN {
        writeln!(out, "  and {} more", events.len() - SHOWN)?;
    }
    if !touched.pressed.is_empty() {
        let list: Vec<&str> = touched.pressed.iter().map(|k| name(plan, *k)).collect();
        writeln!(out, "contacts that press at the end: {}", list.join(", "))?;
    } else if closed.is_empty() {
        writeln!(out, "contacts at the end: all open")?;
    } else {
        let list: Vec<String> =
            closed.iter().map(|(k, m)| format!("{} {}", name(plan, *k), mode(plan, *k, *m))).collect();
        writeln!(out, "contacts at the end: {}", list.join(", "))?;
    }
    let record = &touched.record;
    let energy = |k: usize| record.energy[k].0 + record.energy[k].1;
    let last = record.energy.len() - 1;
    writeln!(
        out,
        "energy: {:.9} J at the start, {:.9} J at the end; impacts took {:.9} J{}",
        energy(0),
        energy(last),
        contacts.lost,
        match choice {
            RegimeChoice::Events => String::new(),
            _ => format!(", impulses of time steps {:.9} J", touched.stepping.lost),
        }
    )?;
    if contacts.impacts > 0 {
        writeln!(
            out,
            "impacts: residual at most {:.1e} of the impulses, {} limited so that none gains energy",
            contacts.residual, contacts.limited
        )?;
        if contacts.jams > 0 {
            writeln!(
                out,
                "jams: {}, where friction stopped or turned a contact that slides by an impulse",
                contacts.jams
            )?;
        }
    }
    Ok(())
}

/// The events as a table, and in time steps where a contact begins to press or no longer does: at the ends of steps, whose
/// impulses have no speed of approach and no energy of one contact. Returns the number of rows, too.
pub fn table(plan: &Plan, touched: &Touched) -> (String, usize) {
    let contact = |k: usize| super::columns::quoted(name(plan, k));
    let events = touched.events.iter().map(|event| {
        let energy = event.impact.map_or(0.0, |impact| impact.energy);
        let (what, then) = (event.cause.verb(), mode(plan, event.contact, event.modes[1]));
        (event.time, format!("{},{what},{then},{},{energy}", contact(event.contact), event.approach))
    });
    let presses = touched.presses.iter().map(|press| {
        let what = if press.begins { "presses,closed" } else { "parts,open" };
        (press.time, format!("{},{what},,", contact(press.contact)))
    });
    let mut rows: Vec<(f64, String)> = events.chain(presses).collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let text = rows.iter().fold(String::from("t,contact,event,mode,approach,energy\n"), |mut text, (time, rest)| {
        let _ = writeln!(text, "{time},{rest}");
        text
    });
    (text, rows.len())
}

/// Name of the file with the events beside the table of the motion.
pub fn beside(csv: &Path) -> std::path::PathBuf {
    let stem = csv.file_stem().map_or_else(Default::default, |s| s.to_string_lossy().into_owned());
    csv.with_file_name(format!("{stem}_events.csv"))
}
