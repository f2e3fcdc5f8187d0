//! The part of a time step between impulses: motion without contacts.

use super::TimeStepping;
use crate::constrained::PostStep;
use crate::contact::{HybridError, Touching, WithContacts};
use crate::error::StepError;
use crate::integrate::Chart;
use crate::lists::copy;
use crate::system::Real;
use crate::Scalar;

impl<Y, B, I> TimeStepping<Y, B, I>
where
    Y: Touching,
    B: PostStep<WithContacts<Y>>,
{
    /// Goes on from `self.q` and `self.p` for a time with the velocities `self.v`. Momenta of groups are those of the same
    /// motion there.
    pub(super) fn drift(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        time: Y::Scalar,
    ) -> Result<(), HybridError> {
        self.chart.load(system, t.to_f64(), &self.q, &self.p)?;
        self.displacement(system);
        let Self { chart, point, q, p, .. } = self;
        point.scale(time);
        if let Some(index) = point.not_finite() {
            return Err(StepError::NotFinite { time: t.to_f64(), index }.into());
        }
        chart.state(system, point, q, p);
        Ok(())
    }

    /// The end of the step if no contact acts, in `self.q` and `self.p`; where contacts have restitution, velocities of the
    /// rows at the start, in `self.before`.
    pub(super) fn fall(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        h: Y::Scalar,
        (q, p): (&Y::Coordinates, &Y::Momenta),
    ) -> Result<(), HybridError> {
        let half = Y::Scalar::constant(0.5) * h;
        copy(self.q.as_mut(), q.as_ref());
        self.implicit = system.system.steps_implicitly(h);
        self.bounces = system.system().contacts().iter().any(|c| c.restitution > Y::Scalar::zero());
        if system.has_loops() || self.bounces && system.minds_any() {
            system.look(t, q, p);
            copy(self.before.as_mut(), system.at.velocities.as_ref());
            copy(self.p.as_mut(), system.p.as_ref());
        } else {
            // Nothing holds the mechanism between steps.
            copy(self.p.as_mut(), p.as_ref());
        }
        self.chart.load(system, t.to_f64(), &self.q, &self.p)?;
        self.start.clear();
        if self.implicit {
            self.implicit_rate(system, t, half)?;
        } else {
            self.rate_at(system, t);
            let Self { chart, start, point, q, p, .. } = self;
            point.scale(half);
            start.copy_from(point);
            chart.state(system, start, q, p);
            self.rate_at(system, t + half);
        }
        let Self { chart, point, q, p, .. } = self;
        point.scale(h);
        if let Some(index) = point.not_finite() {
            return Err(StepError::NotFinite { time: t.to_f64(), index }.into());
        }
        chart.state(system, point, q, p);
        Ok(())
    }

    /// The rate in the middle of the step, in `self.point`, by the implicit midpoint rule for springs and dampers of the joints
    /// and the explicit one for the rest. The middle is where the velocities at the start lead; momenta and springs change on
    /// from there with the inertia of that place, so that dampers act on the velocities that the momenta have there.
    fn implicit_rate(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        half: Y::Scalar,
    ) -> Result<(), HybridError> {
        system.free(t, &self.q, &self.p);
        copy(self.v.as_mut(), system.at.v.as_ref());
        self.displacement(system);
        let Self { chart, start, point, q, p, .. } = self;
        start.copy_from(point);
        start.scale(half);
        if let Some(index) = start.not_finite() {
            return Err(StepError::NotFinite { time: t.to_f64(), index }.into());
        }
        chart.state(system, start, q, p);
        self.rate_at(system, t);
        let Self { start, point, q, p, pd, v, .. } = self;
        point.scale(half);
        copy(pd.as_mut(), point.p.as_ref());
        Chart::joint_forces(system, q, start, pd);
        system.system.project_implicitly(t, q, pd, v);
        for (p, change) in p.as_mut().iter_mut().zip(pd.as_ref()) {
            *p = *p + *change;
        }
        self.rate_at(system, t + half);
        let Self { start, point, q, pd, v, .. } = self;
        pd.as_mut().fill(Y::Scalar::zero());
        system.system.pull(half, v, pd);
        Chart::forces(system, q, start, pd);
        for (rate, force) in point.p.as_mut().iter_mut().zip(pd.as_ref()) {
            *rate = *rate + *force;
        }
        Ok(())
    }

    /// The rate of the displacement at `self.start`, which leads to `self.q` and `self.p`, in `self.point`.
    fn rate_at(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar) {
        let Self { chart, start, point, q, p, qd, pd, .. } = self;
        system.system.rates_at(t, q, p, qd, pd);
        copy(point.p.as_mut(), pd.as_ref());
        chart.rates(system, start, (q, p), qd, point);
    }

    /// The rate of the coordinates' displacement by the velocities `self.v`, in `self.point`.
    fn displacement(&mut self, system: &mut WithContacts<Y>) {
        let Self { chart, start, point, q, p, qd, v, .. } = self;
        system.system.coordinate_rates(q, v, qd);
        start.clear();
        point.clear();
        chart.rates(system, start, (q, p), qd, point);
        // The momenta of the motion are those of the place where it goes on.
        point.p.as_mut().fill(Y::Scalar::zero());
    }
}
