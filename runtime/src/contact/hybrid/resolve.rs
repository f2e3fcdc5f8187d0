//! What happens at an event: impulses, then the modes of the motion that follows.

use super::watch::Found;
use super::{Cause, ContactEvent, Departure, Hybrid, HybridError};
use crate::contact::with_contacts::CREEP;
use crate::contact::{impact, Impact, ImpactOptions, Mode, Touch, Touching, WithContacts};
use crate::integrate::Stepper;
use crate::lists::{copy, first, get, get_or, set};
use crate::system::Real;
use crate::Scalar;

/// Speeds of approach below this part of the fastest of an event count as zero.
const SLOW: f64 = 1e-9;

/// First step, s, above which the one that the method chooses is taken.
const LONGEST: f64 = 1e-4;

/// Part of the momenta above which what they are off is taken for multipliers, not for rounding.
const COLLECTED: f64 = 1e-6;

/// How often modes are selected again at an event because holding the contacts has turned the slip of one round.
const ROUNDS: u32 = 3;

/// Speed of approach, m/s (rad/s), below which there is no impact.
pub(super) const APPROACH: f64 = 1e-10;

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// Resolves an event at time `t`, whose state is in `self.q` and `self.p`; `None` if nothing changes there.
    pub(super) fn resolve(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        found: &Found<Y::Scalar>,
    ) -> Result<Option<ContactEvent<Y::Scalar>>, HybridError> {
        self.crowd(t)?;
        let switches = self.statistics.switches;
        let before = system.mode(found.contact);
        let mut event = ContactEvent {
            time: t,
            contact: found.contact,
            cause: found.cause,
            modes: [before; 2],
            approach: Y::Scalar::zero(),
            impact: None,
            rest: None,
        };
        system.look_at_all(t, &self.q, &self.p);
        self.free_momenta(system);
        if found.cause == Cause::Slipped {
            system.loads(t, &self.q, true);
        }
        let own = !system.is_one_of_many(found.contact) || found.cause == Cause::Stopped;
        self.forced = own.then(|| (found.contact, found.cause, system.force(found.contact)));
        let settled = match found.cause {
            Cause::Jammed => self.jam_pulling(system, t, &mut event),
            _ => self.settle_modes(system, t, Some(&mut event)),
        };
        self.forced = None;
        settled?;
        event.modes = [before, system.mode(found.contact)];
        // Forces of redundant contacts may have been redistributed, and nothing else.
        let happened = event.impact.is_some() || event.cause == Cause::Stopped || self.statistics.switches > switches;
        self.statistics.events += u64::from(happened);
        self.unchanged = !happened;
        Ok(happened.then_some(event))
    }

    /// Frees momenta of the multipliers that they have collected under a method that does not project them: a contact that
    /// opens would make velocities of these. What is projected differs by rounding, and is left as it is.
    pub(super) fn free_momenta(&mut self, system: &WithContacts<Y>) {
        let zero = Y::Scalar::zero();
        let largest = |most: Y::Scalar, x: Y::Scalar| if x.abs() > most { x.abs() } else { most };
        let free = system.p.as_ref();
        // Where everything stops, momenta are rounding: the step began with those that count.
        let most = free.iter().chain(self.start.2.as_ref()).fold(zero, |most, p| largest(most, *p));
        let off = self.p.as_ref().iter().zip(free).fold(zero, |most, (p, free)| largest(most, *p - *free));
        if off.to_f64() > COLLECTED * most.to_f64() {
            copy(self.p.as_mut(), free);
        }
    }

    /// Impulses and modes of the contacts that touch at the state at which all were looked at last, which is in `self.q` and
    /// `self.p`; the motion starts again from there.
    pub(in crate::contact) fn settle_modes(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        mut event: Option<&mut ContactEvent<Y::Scalar>>,
    ) -> Result<(), HybridError> {
        self.take_touching(system);
        self.fill_all(system);
        self.mind_near(system);
        let impact = self.collide(system, t, event.as_deref_mut())?;
        self.stay(system, t, impact.as_ref().map(|impact| impact.energy));
        self.select_or_jam(system, t, event)?;
        self.begin_modes(system, t)
    }

    /// Takes the modes that were selected; the motion starts again with them.
    pub(super) fn begin_modes(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar) -> Result<(), HybridError> {
        copy(self.before.as_mut(), system.modes());
        self.take_modes(system, t);
        // Each round takes energy; the directions of the last one are noticed by the next step, if they are still wrong.
        for _ in 0..ROUNDS {
            // At the state and in the modes that `take_modes` has looked at last.
            if !(0..self.count(system)).any(|k| system.is_turned(k)) {
                break;
            }
            self.select_or_jam(system, t, None)?;
            self.take_modes(system, t);
        }
        let changed = self.before.as_ref().iter().zip(system.modes()).filter(|(old, new)| old != new);
        self.statistics.switches += changed.count() as u64;
        if !self.p.as_ref().iter().chain(self.q.as_ref()).all(|x| x.is_finite()) {
            return Err(HybridError::NotFinite { time: t.to_f64() });
        }
        self.evaluate(system, t, false);
        self.refill(system);
        // Slip that begins has the direction of its acceleration while it is slow: the first step ends before it is not.
        let creeps = CREEP / self.slipping.to_f64();
        self.solver.limits.first_step = if creeps < LONGEST { creeps } else { 0.0 };
        self.solver.resume(system, t, &self.q, &self.p)?;
        Ok(())
    }

    /// Takes into the problem what is closed or touches without departing.
    pub(super) fn take_touching(&mut self, system: &WithContacts<Y>) {
        self.touching.count = 0;
        for k in 0..self.count(system) {
            if system.mode(k) != Mode::Open || self.touches(system, k) {
                self.touching.take(system, k);
            }
        }
    }

    /// Whether the gap of contact `k` is zero, and it is minded.
    pub(super) fn touches(&self, system: &WithContacts<Y>, k: usize) -> bool {
        system.gap(k).to_f64() <= self.rules.touching && !self.ignores(k)
    }

    /// Impulses, where bodies that touch approach each other.
    fn collide(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        event: Option<&mut ContactEvent<Y::Scalar>>,
    ) -> Result<Option<Impact<Y::Scalar>>, HybridError> {
        let zero = Y::Scalar::zero();
        self.touching.settles.as_mut().fill(false);
        self.settling = zero;
        let fastest = self.touching.order().iter().fold(zero, |most, &k| {
            let rate = -system.gap_rate(k);
            if rate > most {
                rate
            } else {
                most
            }
        });
        if !(fastest.to_f64() > APPROACH) {
            return Ok(None);
        }
        // What was stopped while it crept has the friction that is described for it.
        system.reset_grips();
        self.take_touching(system);
        let rest = self.mark_settling(system, t);
        let touching = &mut self.touching;
        touching.assemble(system, t, &self.q, false);
        let mut i = 0;
        for &k in first(touching.order.as_ref(), touching.count) {
            let c = system.contact(k);
            for row in c.row..c.row + c.rows() {
                set(touching.b.as_mut(), i, get(system.at.velocities.as_ref(), row));
                i += 1;
            }
        }
        let (problem, impulses, work) = touching.parts();
        impulses.fill(zero);
        let options = ImpactOptions { effort: self.rules.effort, order: self.rules.order, ..ImpactOptions::default() };
        let result = impact(&problem, &options, impulses, work).map_err(|error| self.touching.error(t, error))?;
        if let Some(event) = event {
            let approach = -system.gap_rate(event.contact);
            event.approach = if approach > zero { approach } else { zero };
            event.rest = rest;
            event.impact = Some(result);
        }
        self.statistics.impacts += 1;
        self.strike(system, t, &result);
        Ok(Some(result))
    }

    /// Gives the mechanism the impulses of an impact. Velocities after it are those with no contact held.
    pub(super) fn strike(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, result: &Impact<Y::Scalar>) {
        system.kick(self.touching.order(), self.touching.impulses.as_ref());
        copy(self.p.as_mut(), system.p.as_ref());
        self.note(result);
        system.release();
        system.look(t, &self.q, &self.p);
    }

    fn note(&mut self, result: &Impact<Y::Scalar>) {
        self.statistics.lost -= result.energy.to_f64();
        self.statistics.limited += u64::from(result.limited.is_some());
        self.statistics.residual = self.statistics.residual.max(result.certificate.residual.to_f64());
    }

    /// Marks contacts whose bounces have become smaller than the rules follow, and makes their impact plastic. Gives the
    /// time at which the bounces of the last one would have ended.
    fn mark_settling(&mut self, system: &WithContacts<Y>, t: Y::Scalar) -> Option<Y::Scalar> {
        let (zero, one, two) = (Y::Scalar::zero(), Y::Scalar::one(), Y::Scalar::constant(2.0));
        let mut rest = None;
        for i in 0..self.touching.count {
            let k = self.touching.contact(i);
            let Departure { time, speed } = get_or(self.departures.as_ref(), k, Departure { time: t, speed: zero });
            let approach = -system.gap_rate(k);
            let lands = system.mode(k) == Mode::Open && approach.to_f64() > APPROACH;
            if !(lands && speed > zero && t > time) {
                continue;
            }
            // The bodies have come back with about the speed with which they departed.
            let acceleration = (speed + approach) / (t - time);
            let Some(Touch { contact, .. }) = self.touching.problem.as_mut().get_mut(i) else { continue };
            let e = contact.restitution;
            // The bounce that would follow.
            let height = e * approach * (e * approach) / (two * acceleration);
            if !(height.to_f64() < self.rules.bounce) {
                continue;
            }
            contact.restitution = zero;
            set(self.touching.settles.as_mut(), k, true);
            self.settling = acceleration;
            self.statistics.settled += 1;
            rest = Some(if e < one { t + two * e * approach / (acceleration * (one - e)) } else { t });
        }
        rest
    }

    /// Keeps in the problem the contacts whose bodies do not depart, and notes the departures of the others.
    pub(super) fn stay(&mut self, system: &WithContacts<Y>, t: Y::Scalar, impact: Option<Y::Scalar>) {
        let zero = Y::Scalar::zero();
        let taken = self.touching.count;
        let fastest = (0..taken).fold(zero, |most, i| {
            let rate = system.gap_rate(self.touching.contact(i)).abs();
            if rate > most {
                rate
            } else {
                most
            }
        });
        let slow = APPROACH.max(SLOW * fastest.to_f64());
        self.touching.count = 0;
        // What is kept takes the place of what was before it.
        for i in 0..taken {
            let k = get_or(self.touching.order.as_ref(), i, usize::MAX);
            let rate = system.gap_rate(k);
            // Where bounces of one contact are followed no longer, those of others that it throws up are not either.
            let height = rate * rate / (self.settling + self.settling);
            let settles = get_or(self.touching.settles.as_ref(), k, false) || height.to_f64() < self.rules.bounce;
            let departs = rate.to_f64() > slow && !settles;
            if departs && impact.is_some() {
                set(self.departures.as_mut(), k, Departure { time: t, speed: rate });
            }
            if !departs {
                self.touching.take(system, k);
            }
        }
    }
}
