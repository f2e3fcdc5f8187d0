//! Motion with contacts: steps of any method between events, and what happens at the events.

mod apart;
mod creep;
mod jam;
mod land;
mod redundant;
mod report;
mod resolve;
mod saltation;
mod saltation_error;
mod select;
mod watch;

pub use report::{Cause, ContactEvent, ContactRules, ContactStatistics, HybridError};
pub use saltation::Tangent;
pub use saltation_error::SaltationError;

use super::instant::Touches;
#[cfg(doc)]
use super::Way;
use super::{Mode, RegimeChange, Touching, WithContacts};
use crate::error::is_before;
use crate::integrate::{Limits, Solver, Statistics, Step, Stepper};
use crate::lists::{copy, get_or};
use crate::system::{Constrained, Real};
use crate::Scalar;
use jam::Crowd;
use watch::Watched;

/// A stretch of a motion without events: one step of the integration, or what comes before the event within it.
pub trait Stretch<Y: Touching> {
    /// Times of its ends, s.
    fn span(&self) -> [Y::Scalar; 2];
    /// The state at a time within it.
    fn state(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, q: &mut Y::Coordinates, p: &mut Y::Momenta);
}

/// The last step of a solver, up to a part of it.
struct LastStep<'a, Y: Touching, M> {
    solver: &'a mut Solver<WithContacts<Y>, M>,
    end: Y::Scalar,
}

impl<Y, M> Stretch<Y> for LastStep<'_, Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    fn span(&self) -> [Y::Scalar; 2] {
        let (t, h) = self.solver.last_step();
        [t, t + self.end * h]
    }

    fn state(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        let (start, h) = self.solver.last_step();
        self.solver.dense(system, (t - start) / h, q, p);
    }
}

/// Follows a motion with contacts.
pub trait ContactObserver<Y: Touching> {
    /// Called for every stretch of the motion between events. Where the event at its end cannot be resolved, and a
    /// [`ContactMotion`](super::ContactMotion) goes on by time steps, these begin where the stretch began.
    fn stretch(&mut self, _system: &mut WithContacts<Y>, _stretch: &mut dyn Stretch<Y>) {}

    /// Called for every event, after it was resolved.
    fn event(&mut self, _system: &mut WithContacts<Y>, _event: &ContactEvent<Y::Scalar>) {}

    /// Called where a [`ContactMotion`](super::ContactMotion) changes between events and time steps.
    fn regime(&mut self, _system: &mut WithContacts<Y>, _change: &RegimeChange) {}
}

impl<Y: Touching> ContactObserver<Y> for () {}

/// What is remembered of a contact's last departure.
#[derive(Clone, Copy, Debug)]
struct Departure<S> {
    time: S,
    /// Speed of departure, m/s; zero where there was none.
    speed: S,
}

/// A motion with contacts by a method `M`. It owns the state; [`Hybrid::state`] copies it.
///
/// Between events, the mechanism moves with the contacts that are closed as constraints. Within each step, gaps, normal
/// forces, friction cones and speeds of slip are watched on the dense output; where one of them reaches zero, the step is
/// cut there, impulses and modes are computed, and the motion starts again. A gap counts as zero where it touches zero
/// within a step too, which its rate tells. While all contacts are open, gaps are not looked at before the joints have
/// moved so far that one of them may have closed ([`Touching::reaches`]). Of many contacts, those that are far by the same
/// measure are not asked for ([`Touching::gaps_of`]), whether others are closed or not.
///
/// While contacts are closed, momenta collect their multipliers. Events free them of these, so that a contact that opens does not
/// make velocities of them; between events, a state's momenta and energy contain them unless the method projects
/// momenta at the ends of steps: [`WithPostStep`](crate::constrained::WithPostStep) with a
/// [`Projection`](crate::constrained::Projection), which also keeps closed contacts from drifting.
#[derive(Clone, Debug)]
pub struct Hybrid<Y: Touching, M> {
    solver: Solver<WithContacts<Y>, M>,
    /// Rules.
    pub rules: ContactRules,
    start: (Y::Scalar, Y::Coordinates, Y::Momenta),
    q: Y::Coordinates,
    p: Y::Momenta,
    /// Watched functions at the ends of a stretch of a step.
    left: Y::PerContact<Watched<Y::Scalar>>,
    right: Y::PerContact<Watched<Y::Scalar>>,
    /// Those at the end of the step.
    end: Y::PerContact<Watched<Y::Scalar>>,
    /// Whether the left end is where the next step starts.
    known: bool,
    /// Lower bound of each gap: what it was when it was looked at last, less the most by which it can have closed since, m (rad). The
    /// moves in `gone` are not taken off yet. By how much each can have closed in the last step.
    reserve: Y::PerContact<Y::Scalar>,
    travel: Y::PerContact<Y::Scalar>,
    /// How far the joints have moved beyond what was taken off the reserves, and how far they may before these are compared
    /// again, m or rad.
    gone: Y::Momenta,
    allowed: Y::Momenta,
    /// Whether coordinates add to the arms of rotations.
    slides: bool,
    /// The contacts that are minded while a step is searched, and those that are besides.
    near: Y::PerContact<bool>,
    departures: Y::PerContact<Departure<Y::Scalar>>,
    touching: Touches<Y>,
    /// Contacts that are left open whatever their gaps are.
    ignored: Y::PerContact<bool>,
    /// Modes before those that follow an event.
    before: Y::PerContact<Mode>,
    /// Modes of the motion that came to the last event, and whether that event could not be resolved: these modes have been
    /// taken back then, and what follows has to be found.
    arrived: Y::PerContact<Mode>,
    unresolved: bool,
    /// Acceleration with which a contact falls back whose bounces have become too small, m/s² (rad/s²); zero without one.
    settling: Y::Scalar,
    /// Largest acceleration with which a contact begins to slide, m/s²; zero where none does.
    slipping: Y::Scalar,
    /// Whether nothing can move, and whether nothing moved at the end of the last step.
    immobile: bool,
    rests: bool,
    /// The contact, cause and force of an event that is being resolved, where they decide on the mode that follows.
    forced: Option<(usize, Cause, [Y::Scalar; 3])>,
    /// Whether the last event was one of redundant forces that changed nothing, so that the next step goes on.
    unchanged: bool,
    /// Events at the last instant.
    crowd: Crowd<Y::Scalar>,
    statistics: ContactStatistics,
}

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// At time `t` (s) and a state. Contacts that touch there are closed, or impacts if their bodies approach.
    ///
    /// # Errors
    /// [`HybridError`].
    pub fn new(
        system: &mut WithContacts<Y>,
        method: M,
        step: Step,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
    ) -> Result<Self, HybridError> {
        let mut hybrid = Hybrid::unsettled(system, method, step, t, (q, p), 0.0)?;
        hybrid.settle_modes(system, t, None)?;
        Ok(hybrid)
    }

    /// [`Hybrid::new`], but with all contacts open, and with overlaps as large as `overlap`, m (rad for stops of rotations), if
    /// that is more than motion by events begins with.
    ///
    /// # Errors
    /// [`HybridError::Step`], [`HybridError::Overlap`].
    pub(in crate::contact) fn unsettled(
        system: &mut WithContacts<Y>,
        method: M,
        step: Step,
        t: Y::Scalar,
        (q, p): (&Y::Coordinates, &Y::Momenta),
        overlap: f64,
    ) -> Result<Self, HybridError> {
        let zero = Y::Scalar::zero();
        let solver = Solver::new(system, method, step, t, q, p)?;
        let inner = system.system();
        let departure = Departure { time: t, speed: zero };
        let mut hybrid = Hybrid {
            solver,
            rules: ContactRules::default(),
            start: (t, q.clone(), p.clone()),
            q: q.clone(),
            p: p.clone(),
            left: inner.per_contact(Watched::zero()),
            right: inner.per_contact(Watched::zero()),
            end: inner.per_contact(Watched::zero()),
            known: false,
            reserve: inner.per_contact(zero),
            travel: inner.per_contact(zero),
            gone: inner.zero_momenta(),
            allowed: inner.zero_momenta(),
            slides: inner.reaches().iter().any(|reach| reach.slide != zero),
            near: inner.per_contact(false),
            departures: inner.per_contact(departure),
            touching: Touches::new(inner),
            ignored: inner.per_contact(false),
            before: inner.per_contact(Mode::Open),
            arrived: inner.per_contact(Mode::Open),
            unresolved: false,
            settling: zero,
            slipping: zero,
            immobile: false,
            rests: false,
            forced: None,
            unchanged: false,
            crowd: Crowd::at(t),
            statistics: ContactStatistics::default(),
        };
        hybrid.place(system, t, (q, p), overlap)?;
        Ok(hybrid)
    }

    /// Overlap with which motion by events begins, m (rad for stops of rotations).
    fn overlap(&self) -> f64 {
        100.0 * self.rules.touching
    }

    /// Whether bodies overlap by more than motion by events begins with, where the system was looked at last.
    pub(in crate::contact) fn overlaps(&self, system: &WithContacts<Y>) -> bool {
        (0..self.count(system)).any(|k| system.gap(k).to_f64() < -self.overlap())
    }

    /// Starts again from another state, with all contacts that do not touch there open.
    ///
    /// # Errors
    /// [`HybridError`].
    pub fn restart(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
    ) -> Result<(), HybridError> {
        self.solver.restart(system, t, q, p)?;
        self.move_to(system, t, (q, p))
    }

    /// Goes on with the same motion from another state, with all contacts that do not touch there open.
    ///
    /// # Errors
    /// [`HybridError`].
    pub(in crate::contact) fn move_to(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        state: (&Y::Coordinates, &Y::Momenta),
    ) -> Result<(), HybridError> {
        self.place(system, t, state, 0.0)?;
        self.settle_modes(system, t, None)
    }

    /// Goes on from the state here after a change of inputs, such as joint forces that jump: which contacts stay closed and
    /// stick is found again.
    ///
    /// # Errors
    /// [`HybridError`].
    pub fn resume(&mut self, system: &mut WithContacts<Y>) -> Result<(), HybridError> {
        let t = self.solver.time();
        self.solver.state(system, &mut self.q, &mut self.p);
        system.look_at_all(t, &self.q, &self.p);
        self.settle(system, |hybrid, system| hybrid.settle_modes(system, t, None))
    }

    /// Finds by `find` what follows an event. Where it finds nothing, the modes are those before, and [`Hybrid::advance`] begins
    /// with [`Hybrid::resume`].
    fn settle<T>(
        &mut self,
        system: &mut WithContacts<Y>,
        find: impl FnOnce(&mut Self, &mut WithContacts<Y>) -> Result<T, HybridError>,
    ) -> Result<T, HybridError> {
        copy(self.arrived.as_mut(), system.modes());
        let found = find(self, system);
        self.unresolved = found.is_err();
        if self.unresolved {
            system.take_back(self.arrived.as_ref());
        }
        found
    }

    /// Takes a state, with all contacts open; bodies may overlap by `overlap`, or by as much as motion by events begins with.
    ///
    /// # Errors
    /// [`HybridError::Overlap`].
    fn place(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        (q, p): (&Y::Coordinates, &Y::Momenta),
        overlap: f64,
    ) -> Result<(), HybridError> {
        system.open_all();
        self.q.as_mut().copy_from_slice(q.as_ref());
        self.p.as_mut().copy_from_slice(p.as_ref());
        system.look(t, &self.q, &self.p);
        for k in 0..self.count(system) {
            let gap = system.gap(k).to_f64();
            if gap < -overlap.max(self.overlap()) {
                return Err(HybridError::Overlap { contact: k, gap });
            }
        }
        let zero = Y::Scalar::zero();
        self.departures.as_mut().fill(Departure { time: t, speed: zero });
        // Nothing is left of events that came before.
        (self.crowd, self.forced, self.settling) = (Crowd::at(t), None, zero);
        (self.unchanged, self.unresolved, self.immobile, self.rests) = (false, false, false, false);
        Ok(())
    }

    /// Time of the state, s.
    pub fn time(&self) -> Y::Scalar {
        self.solver.time()
    }

    /// The state.
    pub fn state(&mut self, system: &WithContacts<Y>, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        self.solver.state(system, q, p);
    }

    /// The state where the last step began, or the event before it.
    pub(super) fn before_step(&self) -> &(Y::Scalar, Y::Coordinates, Y::Momenta) {
        &self.start
    }

    /// Work of the integration so far.
    pub fn statistics(&self) -> Statistics {
        self.solver.statistics()
    }

    /// What happened at the contacts so far.
    pub fn contact_statistics(&self) -> &ContactStatistics {
        &self.statistics
    }

    /// Leaves an open contact open from now on, whatever its gap is, or no longer: a foot that would have to be lifted may
    /// pass the floor. A contact whose gap is negative when it is minded again is not noticed before it has opened.
    pub fn ignore(&mut self, contact: usize, ignored: bool) {
        if let Some(entry) = self.ignored.as_mut().get_mut(contact) {
            *entry = ignored;
        }
        self.allowed.as_mut().fill(Y::Scalar::zero());
    }

    /// Limits of the work.
    pub fn limits_mut(&mut self) -> &mut Limits {
        &mut self.solver.limits
    }

    /// The method.
    pub fn method(&self) -> &M {
        self.solver.method()
    }

    /// Takes steps until `t_end` (s) is reached exactly.
    ///
    /// # Errors
    /// [`HybridError`]; the state is then that of the last step or event.
    pub fn run(
        &mut self,
        system: &mut WithContacts<Y>,
        t_end: Y::Scalar,
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<(), HybridError> {
        let mut left = self.solver.limits.steps;
        while is_before(self.time(), t_end)? {
            self.solver.limits.spend(&mut left, self.time().to_f64())?;
            self.advance(system, t_end, observer)?;
        }
        Ok(())
    }

    /// Takes one step, not beyond `t_end` (s), or goes to the first event of that step and resolves it.
    ///
    /// # Errors
    /// As [`Hybrid::run`].
    pub fn advance(
        &mut self,
        system: &mut WithContacts<Y>,
        t_end: Y::Scalar,
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<Option<ContactEvent<Y::Scalar>>, HybridError> {
        if !is_before(self.time(), t_end)? {
            return Ok(None);
        }
        if self.unresolved {
            self.resume(system)?;
        }
        let Hybrid { solver, start, .. } = self;
        start.0 = solver.time();
        let held = system.rows_act();
        if held {
            solver.state(system, &mut start.1, &mut start.2);
            system.note_slip(start.0, &start.1, &start.2);
        }
        if let Err(error) = solver.advance(system, t_end) {
            solver.state(system, &mut start.1, &mut start.2);
            return self.settle(system, |hybrid, system| hybrid.jam_at_start(system, error, observer)).map(Some);
        }
        if let Some(steps) = self.statistics.steps.get_mut(system.system().way() as usize) {
            *steps += 1;
        }
        let found = self.first_event(system)?;
        let end = found.map_or(Y::Scalar::one(), |found| found.theta);
        observer.stretch(system, &mut LastStep { solver: &mut self.solver, end });
        let Some(found) = found else {
            self.stand_still(system)?;
            return Ok(None);
        };
        let t = self.go_to(system, &found)?;
        let switches = self.statistics.switches;
        let event = self.settle(system, |hybrid, system| hybrid.resolve(system, t, &found))?;
        if let Some(event) = &event {
            observer.event(system, event);
        }
        let changes = event.is_some_and(|event| event.impact.is_some()) || self.statistics.switches > switches;
        let jam = self.settle(system, |hybrid, system| hybrid.jam_if_stuck(system, changes, observer))?;
        Ok(jam.or(event))
    }

    /// Notes the state where the last step began, if [`Hybrid::advance`] has not: a step that is not searched needs none.
    fn note_start(&mut self, system: &WithContacts<Y>) {
        if !system.rows_act() {
            let Hybrid { solver, start, .. } = self;
            solver.start(system, &mut start.1, &mut start.2);
        }
    }

    /// Takes back what rounding moves where nothing can move: a step without events then ends where it started.
    fn stand_still(&mut self, system: &mut WithContacts<Y>) -> Result<(), HybridError> {
        if !self.immobile {
            return Ok(());
        }
        let (t, h) = (self.solver.time(), self.solver.last_step().1);
        self.immobile = self.rests;
        if self.immobile {
            let Hybrid { solver, start, .. } = self;
            solver.resume(system, t, &start.1, &start.2)?;
            solver.limits.first_step = 2.0 * h.to_f64();
        }
        Ok(())
    }

    /// Whether contact `k` is left open whatever its gap is.
    fn ignores(&self, k: usize) -> bool {
        get_or(self.ignored.as_ref(), k, false)
    }

    fn count(&self, system: &WithContacts<Y>) -> usize {
        system.modes().len()
    }
}
