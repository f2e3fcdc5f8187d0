//! The modes of contacts that touch, by the accelerations and forces of the instant.

use super::{Cause, Hybrid, HybridError};
use crate::contact::with_contacts::CREEP;
use crate::contact::{Mode, Touch, Touching, WithContacts};
use crate::integrate::Stepper;
use crate::lists::{copy, first, get, largest, set};
use crate::system::Real;
use crate::Scalar;

/// Part of the largest acceleration, or force, that counts as zero.
const SMALL: f64 = 1e-9;
/// Force that counts as zero where it has just gone to zero, as a part of the largest momentum, 1/s.
const NOTHING: f64 = 1e-6;
/// Contacts stop together whose speeds of slip are below this many times the speed at which one stops.
pub(super) const TOGETHER: f64 = 10.0;

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// Computes the modes of the contacts in the problem, into `self.touching`; all others are open. Their bodies stay
    /// together at the state that was looked at last: forces and accelerations are complementary on the friction cones,
    /// and contacts that slide already have their friction against the motion.
    pub(super) fn select(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar) -> Result<(), HybridError> {
        let zero = Y::Scalar::zero();
        self.touching.modes.as_mut().fill(Mode::Open);
        self.touching.slip.as_mut().fill([zero; 2]);
        self.touching.begins.as_mut().fill(false);
        self.slipping = zero;
        if self.touching.count == 0 {
            return Ok(());
        }
        self.set_slips(system);
        let Hybrid { touching, q, rules, .. } = self;
        touching.find_forces(system, t, q, rules.effort, false).map_err(|error| touching.error(t, error))?;
        self.read_modes();
        Ok(())
    }

    /// Directions of contacts that slide.
    fn set_slips(&mut self, system: &WithContacts<Y>) {
        // Where one contact stops, others that are about as slow do as well: the bodies come to rest.
        let stops = |k: &usize| system.contact(*k).tangents && system.speed(*k).to_f64() < self.rules.slip;
        let stops = self.touching.order().iter().any(stops);
        let least = if stops { TOGETHER * self.rules.slip } else { self.rules.slip };
        for i in 0..self.touching.count {
            let k = self.touching.contact(i);
            let [x, y] = system.tangential(k);
            let speed = (x * x + y * y).sqrt();
            let slides = speed.to_f64() > least;
            let begins = self.begins_to_slip(system, k);
            set(self.touching.begins.as_mut(), k, begins.is_some());
            let slip = match self.forced {
                _ if begins.is_some() => begins,
                // It may slide on, in the direction in which it is accelerated.
                Some((contact, Cause::Stopped, _)) if contact == k && speed.to_f64() < CREEP => None,
                _ => slides.then(|| [x / speed, y / speed]),
            };
            self.touching.set_slip(i, slip);
        }
    }

    /// The direction in which a contact begins to slide at an event of slip: against its force, which has reached the friction
    /// cone. Where several do at once, as feet of a symmetric mechanism, none of them may wait for the others: one that slides alone
    /// takes load off the rest, which then stick, and the other way round.
    fn begins_to_slip(&self, system: &WithContacts<Y>, k: usize) -> Option<[Y::Scalar; 2]> {
        let (contact, _, own) = self.forced.filter(|(_, cause, _)| *cause == Cause::Slipped)?;
        let [normal, x, y] = if contact == k { own } else { system.force(k) };
        let size = (x * x + y * y).sqrt();
        let limit = system.contact(k).friction * normal;
        let reached = || system.mode(k) == Mode::Stick && size >= limit - Y::Scalar::constant(SMALL) * limit;
        (size > Y::Scalar::zero() && (contact == k || reached())).then(|| [-(x / size), -(y / size)])
    }

    /// Modes from the forces and accelerations of the problem.
    fn read_modes(&mut self) {
        let zero = Y::Scalar::zero();
        let touching = &mut self.touching;
        let rows = touching.rows();
        let size = |list: &[Y::Scalar]| largest(first(list, rows));
        let small = Y::Scalar::constant(SMALL);
        let (still, unloaded) = (small * size(touching.b.as_ref()), small * size(touching.impulses.as_ref()));
        let nothing = Y::Scalar::constant(NOTHING) * largest(self.p.as_ref());
        for i in 0..touching.count {
            let k = touching.contact(i);
            let Touch { contact: c, slip } = touching.touch(i);
            let cause = self.forced.filter(|(contact, ..)| *contact == k).map(|(_, cause, _)| cause);
            let force = get(touching.impulses.as_ref(), c.row);
            let opens = match cause {
                // The force has just gone to zero, and the acceleration starts from zero too. There may be no other force to
                // compare it with.
                Some(Cause::Unloaded) => force <= unloaded || force <= nothing,
                _ => force <= unloaded && touching.with_impulses(c.row) > still,
            };
            if opens {
                set(touching.begins.as_mut(), k, false);
                continue;
            }
            set(touching.modes.as_mut(), k, Mode::Slide);
            if !c.tangents || !(c.friction > zero) {
                continue;
            }
            if let Some(direction) = slip {
                set(touching.slip.as_mut(), k, direction);
                continue;
            }
            let [x, y] = [touching.with_impulses(c.row + 1), touching.with_impulses(c.row + 2)];
            let along = (x * x + y * y).sqrt();
            if along > still {
                set(touching.slip.as_mut(), k, [x / along, y / along]);
                set(touching.begins.as_mut(), k, true);
                if along > self.slipping {
                    self.slipping = along;
                }
            } else {
                set(touching.modes.as_mut(), k, Mode::Stick);
            }
        }
    }
}

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// Sets the modes that were selected. Where contacts that slide share a load, those that would have to pull are opened:
    /// the others hold them apart.
    pub(super) fn take_modes(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar) {
        let zero = Y::Scalar::zero();
        loop {
            system.set_modes(&self.touching);
            system.look(t, &self.q, &self.p);
            copy(self.p.as_mut(), system.p.as_ref());
            self.find_redundant_rows(system);
            if !system.shares() {
                return;
            }
            system.look(t, &self.q, &self.p);
            system.loads(t, &self.q, true);
            let forces = system.at.forces.as_ref();
            let largest = forces.iter().fold(zero, |most, [n, ..]| if *n > most { *n } else { most });
            let closed = forces.iter().zip(system.modes()).enumerate().filter(|(_, (_, mode))| **mode != Mode::Open);
            let least = closed.fold(None, |least: Option<(usize, Y::Scalar)>, (k, ([n, ..], _))| match least {
                Some(other) if !(*n < other.1) => Some(other),
                _ => Some((k, *n)),
            });
            let Some((k, _)) = least.filter(|(_, n)| *n <= Y::Scalar::constant(SMALL) * largest) else { return };
            set(self.touching.modes.as_mut(), k, Mode::Open);
            set(self.touching.begins.as_mut(), k, false);
        }
    }
}
