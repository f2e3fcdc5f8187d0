//! Contacts that friction jams: Painlevé's situations.
//!
//! Where pressing a sliding contact together makes its bodies approach faster, no finite force is consistent with rigid
//! bodies (Painlevé, C. R. Acad. Sci. Paris 121, 1895). Compression then grows although nothing approaches, and takes the
//! slip away, or turns it, in no time: an *impact without collision* (Lecornu, 1905; Génot and Brogliato, Eur. J. Mech. A 18,
//! 1999). Its impulses are those of a plastic impact in which the bodies approach by as little as can be told from rounding.
//! A motion comes to such a place by an event, or while it slides: the normal force then grows without bound, and steps
//! shrink without end.

use super::{Cause, ContactEvent, ContactObserver, Hybrid, HybridError};
use crate::contact::solver::energy;
use crate::contact::{solve, ContactError, Impact, Touching, WithContacts};
use crate::error::StepError;
use crate::integrate::Stepper;
use crate::lists::{copy, first, get, get_or, largest, set};
use crate::system::Real;
use crate::Scalar;

/// What is tried one after the other until a contact jams: a part by which coefficients of friction are raised, because where a
/// force has only begun to grow without bound, friction would jam it a little later; and the part of the largest speed that
/// the short time of the jam leads to by itself, the time being longer where the force only takes slip away in some time.
const TRIES: [[f64; 2]; 9] = [
    [0.0, 1e-9],
    [1e-6, 1e-9],
    [1e-5, 1e-9],
    [1e-4, 1e-9],
    [1e-3, 1e-9],
    [0.0, 1e-6],
    [0.0, 1e-5],
    [0.0, 1e-4],
    [0.0, 1e-3],
];
/// Number of those that are as short as rounding errors let them be.
const SHORT: usize = 5;
/// What counts as the largest speed is at least so many times the one below which bodies stop at an event: the longest time then
/// stops all that are slower than that.
const SLOW: f64 = 1e4;
/// Least speed that the short time of a jam leads to, m/s.
const LEAST: f64 = 1e-12;
/// So many events that change nothing at one instant are taken for a jam.
const STUCK: u32 = 10;
/// Part of the largest force that is left after a jam, at most, where steps have shrunk before it.
const LEFT: f64 = 0.1;

/// Events are at one instant that are no more than so many times the rounding error of the time later than the one before.
const INSTANT: f64 = 1e3;

/// Events at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crowd<S> {
    /// Time of the last, s.
    time: S,
    /// How many follow the first.
    events: u32,
    /// How many of them since the last jam.
    stuck: u32,
    /// Jams for which too many events followed one another.
    jams: usize,
}

impl<S> Crowd<S> {
    /// The first, at time `time` (s).
    pub(super) fn at(time: S) -> Self {
        Crowd { time, events: 0, stuck: 0, jams: 0 }
    }
}

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// [`Hybrid::select`], after a jam where friction leaves no forces.
    pub(super) fn select_or_jam(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        event: Option<&mut ContactEvent<Y::Scalar>>,
    ) -> Result<(), HybridError> {
        match self.select(system, t) {
            Ok(()) => Ok(()),
            Err(error) => self.jam(system, t, &TRIES, event, None, error),
        }
    }

    /// Jams a contact that pulls, because its normal force has gone through infinity.
    pub(super) fn jam_pulling(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        event: &mut ContactEvent<Y::Scalar>,
    ) -> Result<(), HybridError> {
        self.take_touching(system);
        self.fill_all(system);
        self.mind_near(system);
        let error = ContactError::Wedged { touch: event.contact, pivot: 0.0 };
        let error = HybridError::Contact { time: t.to_f64(), error };
        let [_, tries @ ..] = &TRIES;
        self.jam(system, t, tries, Some(event), None, error)?;
        self.begin_modes(system, t)
    }

    /// Jams where the steps of the integration have shrunk to the state in `self.start`, if a contact slides there.
    pub(super) fn jam_at_start(
        &mut self,
        system: &mut WithContacts<Y>,
        error: StepError,
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<ContactEvent<Y::Scalar>, HybridError> {
        // Implicit methods find no state beyond, explicit ones none without an error.
        let ends = matches!(
            error,
            StepError::StepTooSmall { .. } | StepError::NoConvergence { .. } | StepError::NotFinite { .. }
        );
        if !(system.rubs && ends) {
            return Err(error.into());
        }
        self.crowd(self.start.0)?;
        copy(self.q.as_mut(), self.start.1.as_ref());
        copy(self.p.as_mut(), self.start.2.as_ref());
        let left = Some(Y::Scalar::constant(LEFT));
        self.jam_sliding(system, self.start.0, &TRIES, left, error.into(), observer)
    }

    /// Counts the events at one instant.
    pub(super) fn crowd(&mut self, t: Y::Scalar) -> Result<(), HybridError> {
        let Crowd { time, events, stuck, jams } = self.crowd;
        let same = !((t - time).to_f64() > INSTANT * Y::Scalar::epsilon() * t.to_f64().abs());
        self.crowd = match same {
            true => Crowd { time: t, events: events + 1, stuck: stuck + 1, jams },
            false => Crowd::at(t),
        };
        match self.crowd.events > self.rules.events {
            true => Err(HybridError::TooManyEvents { time: t.to_f64(), events: self.crowd.events }),
            false => Ok(()),
        }
    }

    /// Jams after an event where many of them follow one another at one instant, if a contact slides there: a normal force that
    /// goes through infinity has other signs on both sides, and no modes go on from there, or each event leads to the one before.
    /// A longer time each time. Of events that change modes, each contact may have some.
    pub(super) fn jam_if_stuck(
        &mut self,
        system: &mut WithContacts<Y>,
        changes: bool,
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<Option<ContactEvent<Y::Scalar>>, HybridError> {
        let Crowd { events, stuck, jams, .. } = self.crowd;
        let most = if changes { STUCK * (1 + self.touching.count as u32) } else { STUCK };
        if !(stuck >= most && system.rubs) {
            return Ok(None);
        }
        let tries = TRIES.get(SHORT + jams..).unwrap_or_default();
        if tries.is_empty() {
            return Ok(None);
        }
        (self.crowd.stuck, self.crowd.jams) = (0, jams + 1);
        let t = self.solver.time();
        let error = HybridError::TooManyEvents { time: t.to_f64(), events };
        self.jam_sliding(system, t, tries, None, error, observer).map(Some)
    }

    /// Jams at the state in `self.q` and `self.p`, where a contact slides. That with the largest force is told; a part of this force
    /// may be `left`, if one is given.
    fn jam_sliding(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        tries: &[[f64; 2]],
        left: Option<Y::Scalar>,
        error: HybridError,
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<ContactEvent<Y::Scalar>, HybridError> {
        let zero = Y::Scalar::zero();
        system.look_at_all(t, &self.q, &self.p);
        self.free_momenta(system);
        system.loads(t, &self.q, true);
        let (mut contact, mut most) = (0, zero);
        for k in 0..self.count(system) {
            let force = system.force(k)[0].abs();
            if system.slides_on(k) && force > most {
                (contact, most) = (k, force);
            }
        }
        if left.is_some() && !(most > zero) {
            return Err(error);
        }
        let before = system.mode(contact);
        self.touching.take_closed(system);
        self.fill_all(system);
        self.mind_near(system);
        let mut event = ContactEvent {
            time: t,
            contact,
            cause: Cause::Jammed,
            modes: [before; 2],
            approach: zero,
            impact: None,
            rest: None,
        };
        let bound = left.map(|left| left * most);
        self.jam(system, t, tries, Some(&mut event), bound, error)?;
        self.begin_modes(system, t)?;
        event.modes = [before, system.mode(contact)];
        self.statistics.events += 1;
        observer.event(system, &event);
        Ok(event)
    }

    /// Jams, by the first of some tries that leads to forces below a `bound`, N, if there is one. `error` is the reason, which is
    /// given back where there are no such.
    fn jam(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        tries: &[[f64; 2]],
        mut event: Option<&mut ContactEvent<Y::Scalar>>,
        bound: Option<Y::Scalar>,
        error: HybridError,
    ) -> Result<(), HybridError> {
        let zero = Y::Scalar::zero();
        self.statistics.impacts += 1;
        self.statistics.jams += 1;
        for how in tries {
            // A problem without a solution changes nothing.
            let Ok(impact) = self.press(system, t, *how) else { continue };
            if let Some(event) = event.as_deref_mut() {
                let before = event.impact.map_or(zero, |impact| impact.energy);
                event.impact = Some(Impact { energy: before + impact.energy, ..impact });
            }
            self.forced = None;
            let found = self.select(system, t).is_ok();
            let forces = first(self.touching.impulses.as_ref(), self.touching.rows());
            if found && bound.is_none_or(|bound| largest(forces) < bound) {
                return Ok(());
            }
        }
        Err(error)
    }

    /// The impulses of a jam at the state that was looked at last, by one of the tries.
    fn press(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        how: [f64; 2],
    ) -> Result<Impact<Y::Scalar>, HybridError> {
        self.pose_jam(system, t, how);
        let effort = self.rules.effort;
        let (problem, impulses, work) = self.touching.parts();
        impulses.fill(Y::Scalar::zero());
        let solved = solve(&problem, effort, impulses, work);
        let energy = energy(&problem, impulses);
        let certificate = solved.map_err(|error| self.touching.error(t, error))?;
        let result = Impact { certificate, energy, limited: None, rounds: 1 };
        self.touching.settles.as_mut().fill(false);
        for i in 0..self.touching.count {
            let (k, row) = (self.touching.contact(i), self.touching.touch(i).contact.row);
            let pressed = get(self.touching.impulses.as_ref(), row) > Y::Scalar::zero();
            // What the short time leaves does not open it.
            set(self.touching.settles.as_mut(), k, pressed);
        }
        self.strike(system, t, &result);
        self.stay(system, t, Some(result.energy));
        Ok(result)
    }

    /// Poses the problem of a jam, of the contacts in the problem and of those whose gaps are zero: an implicit time step, as
    /// short as rounding errors let it be at first.
    fn pose_jam(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, [raised, part]: [f64; 2]) {
        let (zero, one) = (Y::Scalar::zero(), Y::Scalar::one());
        self.touching.begins.as_mut().fill(false);
        for i in 0..self.touching.count {
            let k = self.touching.contact(i);
            set(self.touching.begins.as_mut(), k, true);
        }
        self.touching.count = 0;
        for k in 0..self.count(system) {
            if self.touches(system, k) || get_or(self.touching.begins.as_ref(), k, false) {
                self.touching.take(system, k);
            }
        }
        self.touching.assemble(system, t, &self.q, false);
        self.touching.free_accelerations(system, t, &self.q);
        let most = largest(first(self.touching.b.as_ref(), self.touching.rows()));
        let slow = Y::Scalar::constant(SLOW * self.rules.slip);
        let fastest = self
            .touching
            .order()
            .iter()
            .fold(slow, |fastest, &k| largest(&[fastest, system.speed(k), system.gap_rate(k)]));
        let seed = Y::Scalar::constant(part) * fastest + Y::Scalar::constant(LEAST);
        let time = if most > zero { seed / most } else { zero };
        for i in 0..self.touching.count {
            let k = self.touching.contact(i);
            let c = system.contact(k);
            let Some(touch) = self.touching.problem.as_mut().get_mut(i) else { continue };
            touch.contact.restitution = zero;
            if system.speed(k).to_f64() > self.rules.slip {
                touch.contact.friction = c.friction * (one + Y::Scalar::constant(raised));
            }
            for j in 0..c.rows() {
                let row = touch.contact.row + j;
                // The gaps of what stays closed do not change.
                let stays = j == 0 && get_or(self.touching.begins.as_ref(), k, false);
                let v = if stays { zero } else { get(system.at.velocities.as_ref(), c.row + j) };
                let begun = v + time * get(self.touching.b.as_ref(), row);
                set(self.touching.b.as_mut(), row, begun);
            }
        }
    }
}
