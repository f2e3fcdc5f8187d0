//! Which contacts take part in a time step: by their gaps and how these change.

use super::{larger, StepImpulses, TimeStepping};
use crate::constrained::PostStep;
use crate::contact::{Touching, WithContacts};
use crate::lists::{get, set};
use crate::Scalar;

/// What a contact does in a step without impulses.
struct Approach<S> {
    /// Gap in the middle, m or rad.
    gap: S,
    /// Rate at which the gap may close, m/s or rad/s.
    ahead: S,
    /// Whether it collides with restitution, as soon as its gap is closed.
    bounces: bool,
    /// Whether it has no impulse in this step, because it bounces later.
    waits: bool,
    /// Whether it closes further than it may.
    closes: bool,
}

impl<Y, B, I> TimeStepping<Y, B, I>
where
    Y: Touching,
    B: PostStep<WithContacts<Y>>,
    I: StepImpulses,
{
    fn approach(&self, system: &WithContacts<Y>, k: usize, h: Y::Scalar) -> Approach<Y::Scalar> {
        let (zero, rate, c) = (Y::Scalar::zero(), system.gap_rate(k), system.contact(k));
        let gap = middle_gap(system, k, Y::Scalar::constant(0.5) * h);
        let start = get(self.before.as_ref(), c.row);
        // Forces alone change the rate of the gap by `rate − start` in a step.
        let bounces = self.bounces && c.restitution > zero && start < (rate - start) + (rate - start);
        let ahead = if bounces || !(gap > zero) { zero } else { gap / h };
        let waits = bounces && gap > zero;
        Approach { gap, ahead, bounces, waits, closes: !waits && rate + ahead < zero }
    }

    /// Looks at the contacts at the end of the step without contacts, in `self.q` and `self.p`: all of them, because leaving out
    /// those that are far is not worth its code with few.
    #[cfg(not(feature = "hulls"))]
    pub(super) fn look_near(
        &mut self,
        system: &mut WithContacts<Y>,
        times: [Y::Scalar; 2],
        _: (&Y::Coordinates, &Y::Momenta),
    ) -> bool {
        self.look_at_end(system, times);
        true
    }

    /// Looks at the contacts that are minded at the end of the step of `h` s from time `t` (s) without contacts.
    pub(super) fn look_at_end(&mut self, system: &mut WithContacts<Y>, [t, h]: [Y::Scalar; 2]) {
        system.look(t + h, &self.q, &self.p);
        let (zero, all) = (Y::Scalar::zero(), (0..system.modes().len()).filter(|k| system.minds(*k)));
        let closing = all.filter(|k| self.approach(system, *k, h).closes);
        self.near = h * closing.fold(zero, |most, k| larger(most, -system.gap_rate(k)));
    }

    /// Takes the contacts into the problem that would overlap at the end of the step, and those that impulses on others
    /// might close, with their velocities.
    pub(super) fn take(&mut self, system: &WithContacts<Y>, h: Y::Scalar) {
        let zero = Y::Scalar::zero();
        let mut at = 0;
        for k in (0..system.modes().len()).filter(|k| system.minds(*k)) {
            let (c, Approach { gap, ahead, bounces, waits, closes }) = (system.contact(k), self.approach(system, k, h));
            self.statistics.overlap = larger(self.statistics.overlap, -gap);
            if waits || !(closes || gap < self.near) {
                continue;
            }
            self.touching.take(system, k);
            if let Some(touch) = self.touching.problem.as_mut().get_mut(self.touching.count - 1) {
                touch.contact.restitution = if bounces { c.restitution } else { zero };
            }
            for row in c.row..c.row + c.rows() {
                let shift = if row == c.row { ahead } else { zero };
                set(self.touching.b.as_mut(), at, get(system.at.velocities.as_ref(), row) + shift);
                at += 1;
            }
        }
    }
}

/// Gap of contact `k` in the middle of the step, m or rad, from gap and rate at its end without contacts.
pub(super) fn middle_gap<Y: Touching>(system: &WithContacts<Y>, k: usize, half: Y::Scalar) -> Y::Scalar {
    system.gap(k) - half * system.gap_rate(k)
}
