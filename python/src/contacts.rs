//! Motions with contacts.

use multibody::codegen::jit::{CompileError, Compiled};
use multibody::codegen::options::Arithmetic;
use multibody::codegen::output::FIELDS;
use multibody::codegen::plan::Plan;
use multibody::codegen::Options;
use multibody::runtime::catalogue::{self, BoxedMethod};
use multibody::runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::contact::{
    Contact, ContactMotion, HybridError, ModeTable, Regime, RegimeChoice, RegimeRules, WithContacts,
};
use multibody::runtime::integrate::{AutoSwitch, Radau5, Step, StepError, Tolerances};

use crate::errors::Failed;
use crate::rollout::{Item, Motion};
use crate::rows::Beat;
use crate::settings::Settings;
use crate::told::Kept;

type System = WithContacts<ModeTable<Compiled>>;
type Method = WithPostStep<System, BoxedMethod<'static, System>, Projection<System>>;

/// Longest time step where events crowd, s.
const LONGEST: f64 = 1e-3;
/// Steps of the method between two rows of the result.
const MOST_STEPS: u64 = 1_000_000;

/// A mechanism with contacts. Its arithmetic is exact, so that machine code and the interpreter give the same bits, however
/// often modes were visited before.
#[derive(Clone)]
pub struct Touching {
    full: Compiled,
    contacts: Vec<Contact<f64>>,
    /// With the parameters at their defaults, and the sets of modes that were visited so far; it is away while a row is
    /// computed.
    table: Option<ModeTable<Compiled>>,
}

impl Touching {
    /// Of a plan without contacts.
    pub fn new(plan: &Plan, options: &Options, gravity: [f64; 3]) -> Result<Touching, CompileError> {
        let options = Options { arithmetic: Arithmetic::Exact, ..options.clone() }.of_model(true);
        let full = Compiled::from_plan(plan.with_contacts(), options)?;
        let mut full = full.compiled_after(Compiled::<f64>::WORTHWHILE);
        full.inputs().gravity = gravity;
        let contacts = plan.contacts();
        Ok(Touching { full, contacts, table: None })
    }

    /// The sets of modes that are visited; each begins with the rows in the order of the plan.
    fn take(&mut self) -> ModeTable<Compiled> {
        let new = || ModeTable::new(self.full.clone(), self.contacts.clone());
        let mut table = self.table.take().unwrap_or_else(new);
        table.evaluators_mut().for_each(Compiled::restore_row_order);
        table
    }

    /// Gives these of the fields their defaults again, after a call that has set them.
    pub fn reset(&mut self, fields: impl Iterator<Item = usize>, defaults: &[Vec<f64>]) {
        let Some(table) = &mut self.table else { return };
        fields.for_each(|field| table.set_field(field, &defaults[field]));
        table.efforts().fill(0.0);
    }
}

/// The method of the settings, with what closes loops and contacts.
fn method(settings: &Settings, system: &System) -> Result<(Method, Projection<System>, Step), StepError> {
    let method = catalogue::any(&settings.method, system, false).ok_or(StepError::NoEstimate { time: 0.0 })?;
    let explicit = catalogue::EXPLICIT.iter().any(|entry| entry.name == settings.method);
    let effort = Effort { energy: f64::INFINITY, ..Effort::default() };
    let hold = || Projection::new(system, Stabilisation::default(), effort);
    let (method, step) = match settings.tolerance {
        None => (method, Step::Fixed(settings.dt)),
        Some(tolerance) => {
            let method = match explicit {
                // What slides slowly is stiff.
                true => Box::new(AutoSwitch::new(system, method, Radau5::new(system))),
                false => method,
            };
            (method, Step::Adaptive(Tolerances::new(tolerance)))
        }
    };
    Ok((WithPostStep::new(system, method, hold()), hold(), step))
}

/// Index of the parameters among the fields.
fn params() -> Option<usize> {
    FIELDS.iter().position(|field| field.array.name == "params")
}

impl Motion<'_> {
    pub fn has_params(&self) -> bool {
        self.fields.iter().any(|(field, _)| Some(*field) == params())
    }

    /// The mechanism with the inputs of row `k`.
    fn table(&self, touching: &mut Touching, k: usize) -> ModeTable<Compiled> {
        let (own, others): (Vec<_>, Vec<_>) = self.fields.iter().partition(|(field, _)| Some(*field) == params());
        let mut table = match own.first() {
            None => touching.take(),
            Some((field, rows)) => {
                let mut full = touching.full.clone();
                full.set_field(*field, rows.row(k));
                ModeTable::new(full, touching.contacts.clone())
            }
        };
        others.iter().for_each(|(field, rows)| table.set_field(*field, rows.row(k)));
        table.efforts().fill(0.0);
        table
    }

    /// Sets the joint forces of a step of row `k`.
    fn drive(&self, k: usize, step: usize, q: &[f64], system: &mut System) {
        let Some(u) = self.u else { return };
        let u = &u.row(k)[step * self.sizes.1..(step + 1) * self.sizes.1];
        let tau = system.system_mut().efforts();
        match self.layout {
            None => tau.copy_from_slice(u),
            Some(layout) => layout.v_from(q, u, tau),
        }
    }

    /// Computes a row of a model with contacts, as [`Motion::row`](crate::rollout) does without.
    pub fn row_with_contacts(
        &self,
        machine: &mut Compiled,
        touching: &mut Touching,
        item: &mut Item,
        written: &mut usize,
        beat: &mut Beat,
    ) -> Result<(), Failed> {
        let mut kept = Kept { events: self.asked.contacts.then(Vec::new), forces: self.asked.forces.then(Vec::new) };
        let row = item.0;
        let mut system = WithContacts::new(self.table(touching, row));
        let done = self.follow(machine, &mut system, item, written, &mut kept, beat);
        if !self.has_params() {
            touching.table = Some(system.into_system());
        }
        self.told.events(row, kept.events.unwrap_or_default());
        if let Some(forces) = kept.forces {
            self.told.forces(row, forces);
        }
        done
    }

    fn follow(
        &self,
        machine: &mut Compiled,
        system: &mut System,
        (k, q, v): &mut Item,
        written: &mut usize,
        kept: &mut Kept,
        beat: &mut Beat,
    ) -> Result<(), Failed> {
        let mut state = self.begin(machine, *k)?;
        let (method, close, step) = method(self.settings, system).map_err(|error| failed(&error.into()))?;
        let length = if self.regime == RegimeChoice::TimeSteps { f64::INFINITY } else { LONGEST };
        let rules = RegimeRules::new(self.regime, self.settings.dt.min(length));
        if self.settings.steps > 0 {
            self.drive(*k, 0, &state.q, system);
        }
        let motion = ContactMotion::new(system, (method, step), close, rules, 0.0, (&state.q, &state.p));
        let mut motion = motion.map_err(|error| failed(&error))?;
        motion.events.rules.order = self.impacts;
        let (nq, nv) = self.sizes;
        for step in 0..=self.settings.steps {
            let t = step as f64 * self.settings.dt;
            if step.is_multiple_of(self.settings.every) {
                let at = *written;
                let (q, v) = (&mut q[at * nq..(at + 1) * nq], &mut v[at * nv..(at + 1) * nv]);
                kept.forces(|| match motion.regime() {
                    // Of a copy: nothing of the motion depends on whether forces are asked for.
                    Regime::Events => system.clone().forces(t, &state.q, &state.p).to_vec(),
                    // Zero before the first step.
                    Regime::TimeSteps => motion.steps.mean_forces(),
                });
                self.store(system.system_mut(), t, &mut state, q, v);
                *written += 1;
            }
            if step == self.settings.steps {
                break;
            }
            if step > 0 && self.u.is_some() {
                self.drive(*k, step, &state.q, system);
                motion.resume(system).map_err(|error| failed(&error))?;
            }
            let (end, mut left) = ((step + 1) as f64 * self.settings.dt, MOST_STEPS);
            while motion.time() < end {
                if left == 0 {
                    let error = StepError::TooManySteps { time: motion.time(), steps: MOST_STEPS };
                    return Err(failed(&error.into()));
                }
                left -= 1;
                motion.advance(system, end, kept).map_err(|error| failed(&error))?;
                if !beat.goes_on() {
                    return Ok(());
                }
            }
            motion.state(system, &mut state.q, &mut state.p);
        }
        Ok(())
    }
}

fn failed(error: &HybridError) -> Failed {
    let words = error.to_string();
    let (kind, time, numbers) = match *error {
        HybridError::Step(error) => return Failed::step(&error, words),
        HybridError::Overlap { contact, gap } => ("overlap", 0.0, vec![("contact", contact as f64), ("gap", gap)]),
        HybridError::Contact { time, .. } => ("contact", time, vec![]),
        HybridError::TooManyEvents { time, events } => ("too_many_events", time, vec![("events", events.into())]),
        HybridError::TurnsTooFar { time, angle } => ("turns_too_far", time, vec![("angle", angle)]),
        HybridError::NotFinite { time } => ("not_finite", time, vec![]),
        _ => ("failed", 0.0, vec![]),
    };
    Failed { kind, message: words, time, numbers }
}
