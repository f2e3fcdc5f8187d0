//! Motion with contacts in two regimes: from event to event while events are few, by time steps while they crowd.

use super::hybrid::{ContactObserver, ContactStatistics, Hybrid, HybridError};
use super::stepping::{SteppingStatistics, TimeStepping};
use super::{Mode, Touching, WithContacts};
use crate::constrained::PostStep;
use crate::error::{is_before, StepError};
use crate::integrate::{Statistics, Step, Stepper};
use crate::system::Real;
use crate::Scalar;

/// Overlap with which a motion begins that may take time steps, m (rad for stops of rotations): another motion by time steps may
/// have left it, where bodies were fast.
const OVERLAP: f64 = 1e-3;

/// How a motion with contacts is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regime {
    /// From event to event, by a method of integration ([`Hybrid`]).
    Events,
    /// By steps of a fixed length with the impulses of all contacts at once ([`TimeStepping`]).
    TimeSteps,
}

/// Which regimes a motion may use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RegimeChoice {
    /// Events only.
    #[default]
    Events,
    /// Time steps only.
    TimeSteps,
    /// Events, and time steps where there are too many of them, or where they cannot be resolved.
    Automatic,
}

/// Rules by which regimes are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RegimeRules {
    /// Which regimes may be used.
    pub choice: RegimeChoice,
    /// Length of a time step, s.
    pub step: f64,
    /// Time over which events and steps are counted, and for which the contacts that press must stay the same before
    /// events are followed again, s.
    pub window: f64,
    /// Number of events in a window after which time steps follow.
    pub events: u32,
    /// Number of the method's steps in a window after which time steps follow.
    pub steps: u32,
}

impl Default for RegimeRules {
    /// Events only.
    fn default() -> Self {
        RegimeRules::new(RegimeChoice::Events, 1e-3)
    }
}

impl RegimeRules {
    /// With time steps of `step` s: a window has a hundred of them, and time steps take over where events are as many as
    /// time steps would be, or the method's steps ten times as many.
    pub fn new(choice: RegimeChoice, step: f64) -> Self {
        RegimeRules { choice, step, window: 100.0 * step, events: 100, steps: 1000 }
    }
}

/// Reason why a motion changes its regime.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RegimeReason {
    /// This many events followed one another within a window.
    ManyEvents(u32),
    /// This many steps of the method were needed within a window.
    ManySteps(u32),
    /// A step or an event failed.
    Failed(HybridError),
    /// The contacts that press have not changed for a window.
    Quiet,
}

/// A change of the regime.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RegimeChange {
    /// Time, s.
    pub time: f64,
    /// The regime that follows.
    pub regime: Regime,
    /// Its reason.
    pub reason: RegimeReason,
}

/// What a motion spent in its regimes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RegimeStatistics {
    /// Changes of the regime.
    pub changes: u64,
    /// Time of the motion in each regime, s: events, time steps.
    pub time: [f64; 2],
    /// Largest gap or overlap, m (rad for stops of rotations), that was closed where events were followed again.
    pub closed: f64,
}

/// A motion with contacts by events with a method `M`, and by time steps, with `B` to close loops. It owns the state;
/// [`ContactMotion::state`] copies it.
///
/// A motion by events has the accuracy of its method; one by time steps errs by about what happens in a step. Where time
/// steps take over, the motion goes on from the last event that was resolved. Where events follow again, gaps and
/// overlaps of the contacts that pressed last are closed, which the statistics tell.
#[derive(Clone, Debug)]
pub struct ContactMotion<Y: Touching, M, B> {
    /// Motion by events, with its rules.
    pub events: Hybrid<Y, M>,
    /// Motion by time steps, with its rules.
    pub steps: TimeStepping<Y, B>,
    /// Rules of the choice between them.
    pub rules: RegimeRules,
    regime: Regime,
    t: Y::Scalar,
    q: Y::Coordinates,
    p: Y::Momenta,
    /// Momenta before positions are closed.
    kept: Y::Momenta,
    modes: Y::PerContact<Mode>,
    /// Start of the window, s, and events and steps since then; in time steps, changes of the contacts that press.
    window: (Y::Scalar, u32, u32),
    changes: u64,
    statistics: RegimeStatistics,
}

impl<Y, M, B> ContactMotion<Y, M, B>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
    B: PostStep<WithContacts<Y>>,
{
    /// At time `t` (s) and a state, with steps `step` of the method between events.
    ///
    /// What touches at the start is resolved as in a motion by events. [`RegimeChoice::Automatic`] begins with time steps where that
    /// fails, and where bodies overlap by more than a hundred times [`ContactRules::touching`](super::ContactRules::touching). An
    /// overlap of more than 1 mm (or mrad) is an error.
    ///
    /// # Errors
    /// [`HybridError`].
    pub fn new(
        system: &mut WithContacts<Y>,
        (method, step): (M, Step),
        post_step: B,
        rules: RegimeRules,
        t: Y::Scalar,
        (q, p): (&Y::Coordinates, &Y::Momenta),
    ) -> Result<Self, HybridError> {
        if !(rules.step > 0.0 && rules.step.is_finite()) {
            return Err(StepError::InvalidStep { time: t.to_f64(), step: rules.step }.into());
        }
        let steps = TimeStepping::new(system, post_step);
        let overlap = if rules.choice == RegimeChoice::Events { 0.0 } else { OVERLAP };
        let mut events = Hybrid::unsettled(system, method, step, t, (q, p), overlap)?;
        let settled = match rules.choice {
            RegimeChoice::TimeSteps => false,
            RegimeChoice::Events => events.settle_modes(system, t, None).map(|()| true)?,
            RegimeChoice::Automatic => !events.overlaps(system) && events.settle_modes(system, t, None).is_ok(),
        };
        let inner = system.system();
        let (kept, modes) = (inner.zero_momenta(), inner.per_contact(Mode::Open));
        let mut motion = ContactMotion {
            events,
            steps,
            rules,
            regime: Regime::Events,
            t,
            q: q.clone(),
            p: p.clone(),
            kept,
            modes,
            window: (t, 0, 0),
            changes: 0,
            statistics: RegimeStatistics::default(),
        };
        if !settled {
            motion.begin_steps(system);
        }
        Ok(motion)
    }

    /// The regime.
    pub fn regime(&self) -> Regime {
        self.regime
    }

    /// Time of the state, s.
    pub fn time(&self) -> Y::Scalar {
        match self.regime {
            Regime::Events => self.events.time(),
            Regime::TimeSteps => self.t,
        }
    }

    /// The state.
    pub fn state(&mut self, system: &WithContacts<Y>, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        match self.regime {
            Regime::Events => self.events.state(system, q, p),
            Regime::TimeSteps => {
                q.as_mut().copy_from_slice(self.q.as_ref());
                p.as_mut().copy_from_slice(self.p.as_ref());
            }
        }
    }

    /// What was spent in the regimes.
    pub fn statistics(&self) -> &RegimeStatistics {
        &self.statistics
    }

    /// Work of the method between events.
    pub fn integration_statistics(&self) -> Statistics {
        self.events.statistics()
    }

    /// What happened at the contacts, in motion by events.
    pub fn contact_statistics(&self) -> &ContactStatistics {
        self.events.contact_statistics()
    }

    /// What happened at the contacts, in time steps.
    pub fn stepping_statistics(&self) -> &SteppingStatistics<Y::Scalar> {
        self.steps.statistics()
    }

    /// Goes on until `t_end` (s) is reached exactly, by at most as many steps and events as the limits of
    /// [`ContactMotion::events`] say.
    ///
    /// # Errors
    /// [`HybridError`]; the state is then that of the last step or event.
    pub fn run(
        &mut self,
        system: &mut WithContacts<Y>,
        t_end: Y::Scalar,
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<(), HybridError> {
        let limits = *self.events.limits_mut();
        let mut left = limits.steps;
        while is_before(self.time(), t_end)? {
            limits.spend(&mut left, self.time().to_f64())?;
            self.advance(system, t_end, observer)?;
        }
        Ok(())
    }

    /// Goes on from the state here after a change of inputs, such as joint forces that jump.
    ///
    /// # Errors
    /// As [`ContactMotion::run`]. A motion that may choose goes on by time steps where contacts cannot be resolved.
    pub fn resume(&mut self, system: &mut WithContacts<Y>) -> Result<(), HybridError> {
        if self.regime == Regime::TimeSteps {
            return Ok(());
        }
        match self.events.resume(system) {
            Err(_) if self.rules.choice == RegimeChoice::Automatic => {
                self.t = self.events.time();
                self.events.state(system, &mut self.q, &mut self.p);
                self.begin_steps(system);
                Ok(())
            }
            other => other,
        }
    }

    /// Takes one step of the regime, not beyond `t_end` (s), and changes the regime if it is time.
    ///
    /// # Errors
    /// As [`ContactMotion::run`].
    pub fn advance(
        &mut self,
        system: &mut WithContacts<Y>,
        t_end: Y::Scalar,
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<(), HybridError> {
        let (begin, regime) = (self.time(), self.regime);
        if !is_before(begin, t_end)? {
            return Ok(());
        }
        let change = match regime {
            Regime::Events => self.follow(system, t_end, observer)?,
            Regime::TimeSteps => self.step(system, t_end, observer)?,
        };
        self.statistics.time[regime as usize] += (self.time() - begin).to_f64();
        if let Some(reason) = change {
            self.statistics.changes += 1;
            let change = RegimeChange { time: self.time().to_f64(), regime: self.regime, reason };
            observer.regime(system, &change);
        }
        Ok(())
    }

    /// One step by events; the reason, if time steps follow.
    fn follow(
        &mut self,
        system: &mut WithContacts<Y>,
        t_end: Y::Scalar,
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<Option<RegimeReason>, HybridError> {
        let may = self.rules.choice == RegimeChoice::Automatic;
        let reason = match self.events.advance(system, t_end, observer) {
            Ok(event) => {
                let t = self.events.time();
                if (t - self.window.0).to_f64() > self.rules.window {
                    self.window = (t, 0, 0);
                }
                self.window.1 += u32::from(event.is_some());
                self.window.2 += 1;
                let (_, events, steps) = self.window;
                if !may {
                    return Ok(None);
                } else if events >= self.rules.events {
                    RegimeReason::ManyEvents(events)
                } else if steps >= self.rules.steps {
                    RegimeReason::ManySteps(steps)
                } else {
                    return Ok(None);
                }
            }
            Err(error) if may => RegimeReason::Failed(error),
            Err(error) => return Err(error),
        };
        match reason {
            RegimeReason::Failed(_) => {
                let (t, q, p) = self.events.before_step();
                self.t = *t;
                self.q.as_mut().copy_from_slice(q.as_ref());
                self.p.as_mut().copy_from_slice(p.as_ref());
            }
            _ => {
                self.t = self.events.time();
                self.events.state(system, &mut self.q, &mut self.p);
            }
        }
        self.begin_steps(system);
        Ok(Some(reason))
    }

    /// Time steps follow, from the state here.
    fn begin_steps(&mut self, system: &mut WithContacts<Y>) {
        system.open_all();
        self.regime = Regime::TimeSteps;
        self.window = (self.t, 0, 0);
        self.changes = self.steps.statistics().changes;
    }

    /// One time step; the reason, if events are followed again.
    fn step(
        &mut self,
        system: &mut WithContacts<Y>,
        t_end: Y::Scalar,
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<Option<RegimeReason>, HybridError> {
        let (left, step) = (t_end - self.t, Y::Scalar::constant(self.rules.step));
        // A remainder that is rounding only belongs to the last step, and steps that differ by rounding only are the same.
        let parts = (left / step).to_f64();
        let last = !(parts > 1.0 + 1e-9);
        let h = if last && !(parts > 1.0 - 1e-9) { left } else { step };
        self.steps.step(system, self.t, h, &mut self.q, &mut self.p)?;
        observer.stretch(system, &mut self.steps.last_step(&self.q, &self.p));
        self.t = if last { t_end } else { self.t + h };
        let changes = self.steps.statistics().changes;
        if changes != self.changes {
            (self.changes, self.window.0) = (changes, self.t);
        }
        let quiet = (self.t - self.window.0).to_f64() > self.rules.window;
        if self.rules.choice != RegimeChoice::Automatic || !quiet || last {
            return Ok(None);
        }
        self.window = (self.t, 0, 0);
        if self.land(system).is_err() {
            // What cannot be closed yet is tried again after another window.
            system.open_all();
            return Ok(None);
        }
        self.regime = Regime::Events;
        Ok(Some(RegimeReason::Quiet))
    }

    /// Closes the gaps of the contacts that pressed in the last step, and overlaps, and starts the motion by events there.
    /// Where that fails, the state is as it was.
    fn land(&mut self, system: &mut WithContacts<Y>) -> Result<(), HybridError> {
        let Self { events, steps, t, q, p, kept, modes, statistics, .. } = self;
        let (mut closed, mut any) = (0.0_f64, false);
        system.look_at_all(*t, q, p);
        for (k, (mode, pressed)) in modes.as_mut().iter_mut().zip(steps.pressed()).enumerate() {
            let gap = system.gap(k);
            let closes = *pressed || gap < Y::Scalar::zero();
            *mode = if closes { Mode::Slide } else { Mode::Open };
            any |= closes;
            if closes {
                closed = closed.max(gap.abs().to_f64());
            }
        }
        let mut at = q.clone();
        if any {
            kept.as_mut().copy_from_slice(p.as_ref());
            system.borrow_modes(modes.as_ref());
            let result = steps.post_step.close(system, *t, false, &mut at, kept);
            system.restore();
            result.map_err(|error| StepError::Constraint { time: t.to_f64(), error })?;
        }
        events.move_to(system, *t, (&at, p))?;
        statistics.closed = statistics.closed.max(closed);
        Ok(())
    }
}
