//! Contacts whose slip comes to an end ever more slowly, or turns ever faster while it does.

use super::select::TOGETHER;
use super::watch::Watched;
use super::Hybrid;
use crate::contact::{Contact, Mode, Touching, WithContacts};
use crate::integrate::Stepper;
use crate::lists::get_or;
use crate::system::Real;
use crate::Scalar;

/// Speed of slip, m/s, below which bodies that slide ever more slowly may come to rest.
const STANDSTILL: f64 = 1e-10;
/// Part by which friction may be larger to hold a contact that creeps, and part of the deceleration by friction below which a
/// contact creeps.
const CREEPING: f64 = 1e-5;
const SLOWLY: f64 = 0.01;

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// The first contact that slides so slowly at the end of the step that friction may stop it there. Where bodies slide
    /// and spin, the direction of slip turns ever faster as they come to rest, and steps shrink without end. After
    /// [`Hybrid::first_event`] has evaluated the last stretch.
    pub(super) fn ends_turning(&self, system: &WithContacts<Y>) -> Option<usize> {
        (0..self.count(system)).find(|&k| {
            let [before, now] = [&self.right, &self.left].map(|at| get_or(at.as_ref(), k, Watched::zero()));
            let slow = now.speed.to_f64() < STANDSTILL && now.speed < before.speed;
            slow && system.slides_on(k)
        })
    }

    /// The first contact that creeps at the end of the step, whose last stretch takes `time`, s: it slides more slowly than the
    /// rules follow, friction holds it if it is larger by a little, and slip does not end at the rate at which friction can end
    /// it. A damped leg spreads until friction carries it: slip then ends ever more slowly, and its direction asks for ever
    /// shorter steps. What creeps has the larger friction until it no longer sticks, which makes up for the damping that ends with
    /// the motion, too.
    pub(super) fn creeps(&mut self, system: &mut WithContacts<Y>, time: Y::Scalar) -> Option<usize> {
        let slip = self.rules.slip;
        let slides = |hybrid: &Self, system: &WithContacts<Y>, k: usize, most: f64| {
            let now = get_or(hybrid.left.as_ref(), k, Watched::zero());
            (system.slides_on(k) && now.speed.to_f64() < most).then_some(now)
        };
        let (contact, now, lost) = (0..self.count(system)).find_map(|k| {
            let now = slides(self, system, k, slip)?;
            let lost = get_or(self.right.as_ref(), k, Watched::zero()).speed - now.speed;
            (lost >= Y::Scalar::zero()).then_some((k, now, lost))
        })?;
        let (t, h) = self.solver.last_step();
        self.solver.dense(system, Y::Scalar::one(), &mut self.q, &mut self.p);
        system.look(t + h, &self.q, &self.p);
        let grip = |hybrid: &Self, system: &mut WithContacts<Y>, more: f64| {
            for k in 0..hybrid.count(system) {
                if slides(hybrid, system, k, TOGETHER * slip).is_some() {
                    system.set_grip(k, Y::Scalar::constant(1.0 + more));
                }
            }
        };
        grip(self, system, CREEPING);
        self.touching.take_closed(system);
        let found = self.select(system, t + h).is_ok();
        let touch = self.touching.order().iter().position(|k| *k == contact);
        let c = touch.map_or(Contact::nowhere(), |i| self.touching.touch(i).contact);
        let rate = Y::Scalar::constant(SLOWLY) * c.friction * now.first * self.touching.inverse_inertia(c.row + 1);
        let sticks = |k: usize| get_or(self.touching.modes.as_ref(), k, Mode::Open) == Mode::Stick;
        let creeps = found
            && lost < rate * time
            && (0..self.count(system)).all(|k| sticks(k) || slides(self, system, k, TOGETHER * slip).is_none());
        if !creeps {
            grip(self, system, 0.0);
            return None;
        }
        self.statistics.crept += 1;
        Some(contact)
    }
}
