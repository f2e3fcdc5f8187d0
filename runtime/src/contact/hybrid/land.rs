//! From the end of a step back to an event within it.

use super::watch::Found;
use super::{Cause, Hybrid, HybridError};
use crate::contact::{Touching, WithContacts};
use crate::integrate::{Chart, Stepper};
use crate::system::{Real, System};
use crate::Scalar;

/// Corrections of a landing.
const CORRECTIONS: u32 = 4;

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
        let mut time = t + found.theta * h;
        if found.cause != Cause::Landed {
            if found.theta < Y::Scalar::one() {
                self.solver.cut(system, found.theta)?;
            }
            self.solver.state(system, &mut self.q, &mut self.p);
            return Ok(self.solver.time());
        }
        self.step_to(system, time)?;
        // What is left of the gap is an error of the dense output: the state is moved by its rates, forwards or back.
        for _ in 0..CORRECTIONS {
            system.look(time, &self.q, &self.p);
            let (gap, rate) = (system.gap(found.contact), system.gap_rate(found.contact));
            let dt = -(gap / rate);
            if time + dt == time || !(dt.abs() < h) {
                break;
            }
            self.shift(system, time, dt);
            time = time + dt;
        }
        Ok(time)
    }

    /// Takes a true step from the start of the last one to the time of an event.
    fn step_to(&mut self, system: &mut WithContacts<Y>, time: Y::Scalar) -> Result<(), HybridError> {
        let Hybrid { solver, start, q, p, .. } = self;
        solver.restart(system, start.0, &start.1, &start.2)?;
        let first = core::mem::replace(&mut solver.limits.first_step, (time - start.0).to_f64());
        let done = solver.run(system, time);
        solver.limits.first_step = first;
        done?;
        solver.state(system, q, p);
        Ok(())
    }

    /// Moves the state by its rates over a very short time.
    fn shift(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, dt: Y::Scalar) {
        let Hybrid { q, p, displacement, rates: (qd, pd), .. } = self;
        system.rates_at(t, q, p, qd, pd);
        system.look(t, q, p);
        for (x, v) in displacement.as_mut().iter_mut().zip(system.at.v.as_ref()) {
            *x = dt * *v;
        }
        Chart::displace(system, displacement, q);
        for (p, rate) in p.as_mut().iter_mut().zip(pd.as_ref()) {
            *p = *p + dt * *rate;
        }
    }
}
