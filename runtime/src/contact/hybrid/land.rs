//! From the end of a step back to an event within it.

use super::watch::Found;
use super::{Cause, Hybrid, HybridError};
use crate::contact::{Touching, WithContacts};
use crate::integrate::Stepper;
use crate::system::Real;
use crate::Scalar;

/// Corrections of a landing.
const CORRECTIONS: u32 = 8;

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// Goes to an event within the last step; gives its time. The state is in `self.q` and `self.p`.
    pub(super) fn go_to(
        &mut self,
        system: &mut WithContacts<Y>,
        found: &Found<Y::Scalar>,
    ) -> Result<Y::Scalar, HybridError> {
        let (t, h) = self.solver.last_step();
        let (start, mut time) = (t, t + found.theta * h);
        if found.cause != Cause::Landed {
            if found.theta < Y::Scalar::one() {
                self.solver.cut(system, found.theta)?;
            }
            self.solver.state(system, &mut self.q, &mut self.p);
            return Ok(self.solver.time());
        }
        self.step_to(system, time)?;
        // What is left of the gap is an error of the dense output, or an overlap: the step ends a little sooner or later.
        system.glance(time, &self.q, &self.p);
        let mut gap = system.gap(found.contact);
        for _ in 0..CORRECTIONS {
            let dt = -(gap / system.gap_rate(found.contact));
            if time + dt == time || !(dt.abs() < h) || time + dt <= start {
                break;
            }
            time = time + dt;
            self.step_to(system, time)?;
            system.glance(time, &self.q, &self.p);
            let left = system.gap(found.contact);
            if !(left.abs() < gap.abs()) {
                break;
            }
            gap = left;
        }
        Ok(time)
    }

    /// Takes a true step from the start of the last one to the time of an event.
    fn step_to(&mut self, system: &mut WithContacts<Y>, time: Y::Scalar) -> Result<(), HybridError> {
        let Hybrid { solver, start, q, p, .. } = self;
        solver.resume(system, start.0, &start.1, &start.2)?;
        let first = core::mem::replace(&mut solver.limits.first_step, (time - start.0).to_f64());
        let done = solver.run(system, time);
        solver.limits.first_step = first;
        done?;
        solver.state(system, q, p);
        Ok(())
    }
}
