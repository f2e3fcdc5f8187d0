//! Changes of the state at the ends of steps, around any method.

use super::ConstraintError;
use crate::integrate::{Chart, Field, Point, Statistics, StepError, Stepper};
use crate::system::{Real, System};

/// A change of the state at the end of every step, such as a [`Projection`](super::Projection).
pub trait PostStep<Y: System> {
    /// Whether [`PostStep::restart`] does anything.
    const RESTARTS: bool = false;

    /// Changes the state `(q, p)` at time `t` (s), at the end of a step that is about to be accepted or within it:
    /// slightly, or along gauge directions, which change nothing in the motion. With `remembers` the method uses rates
    /// of past steps, and momenta must not jump.
    ///
    /// # Errors
    /// [`ConstraintError`]; the step fails then.
    fn close(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        remembers: bool,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError>;

    /// Whether [`PostStep::close`] at the end of a step at time `t` (s) would change nothing, so that it need not be called.
    fn idle(&mut self, _system: &Y, _t: Y::Scalar) -> bool {
        false
    }

    /// Whether [`PostStep::restart`] may do anything after the last end of a step.
    fn may_restart(&self) -> bool {
        Self::RESTARTS
    }

    /// May change the system and the state from which the next step starts. Returns whether it did: the method then
    /// forgets past steps.
    ///
    /// # Errors
    /// [`ConstraintError`].
    fn restart(
        &mut self,
        _system: &mut Y,
        _t: Y::Scalar,
        _q: &mut Y::Coordinates,
        _p: &mut Y::Momenta,
    ) -> Result<bool, ConstraintError> {
        Ok(false)
    }
}

/// No change: for mechanisms without loops.
impl<Y: System> PostStep<Y> for () {
    #[inline]
    fn close(
        &mut self,
        _system: &mut Y,
        _t: Y::Scalar,
        _remembers: bool,
        _q: &mut Y::Coordinates,
        _p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        Ok(())
    }

    #[inline]
    fn idle(&mut self, _system: &Y, _t: Y::Scalar) -> bool {
        true
    }
}

/// A method `M` with a [`PostStep`] `B` at the end of every step.
///
/// The end of a step is changed before the step is accepted. A [`Solver`](crate::integrate::Solver) and its dense
/// output therefore only show the changed state. A rate at the end that the method has evaluated for its error estimate
/// is no longer valid: pairs whose last stage is the first stage of the next step make one evaluation more.
#[derive(Clone, Debug)]
pub struct WithPostStep<Y: System, M, B> {
    /// The method.
    method: M,
    /// The change at the ends of steps.
    pub post_step: B,
    /// The displacement of the last attempt after the work, where there was any; otherwise it is the method's own.
    delta: Point<Y>,
    worked: bool,
    end: Point<Y>,
    end_known: bool,
    old: (Y::Coordinates, Y::Momenta),
    new: (Y::Coordinates, Y::Momenta),
}

impl<Y, M, B> WithPostStep<Y, M, B>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
    B: PostStep<Y>,
{
    /// Puts a post-step around a method.
    #[inline(always)]
    pub fn new(system: &Y, method: M, post_step: B) -> Self {
        let state = || (system.neutral(), system.zero_momenta());
        WithPostStep {
            method,
            post_step,
            delta: Point::zero(system),
            worked: false,
            end: Point::zero(system),
            end_known: false,
            old: state(),
            new: state(),
        }
    }

    /// The method.
    pub fn method(&self) -> &M {
        &self.method
    }

    /// Changes a displacement that ends at time `t` by the work at the end of the step, which is not idle: `other`, or that of
    /// the last attempt.
    fn close(&mut self, system: &mut Y, t: Y::Scalar, other: Option<&mut Point<Y>>) -> Result<(), ConstraintError> {
        let WithPostStep { method, post_step, delta, old, new: (q, p), .. } = self;
        let (remembers, point) = (method.remembers(), other.unwrap_or(delta));
        method.parts().0.chart().state(system, point, &mut old.0, &mut old.1);
        q.as_mut().copy_from_slice(old.0.as_ref());
        p.as_mut().copy_from_slice(old.1.as_ref());
        post_step.close(system, t, remembers, q, p)?;
        if old.0.as_ref() == q.as_ref() && old.1.as_ref() == p.as_ref() {
            return Ok(());
        }
        Chart::correct(system, (&old.0, &old.1), (q, p), point);
        Ok(())
    }

    /// The method takes the displacement as the work at the end of the step left it.
    fn hand_over(&mut self) {
        let delta = self.method.parts().1;
        if core::mem::take(&mut self.worked) && delta.parts() != self.delta.parts() {
            delta.copy_from(&self.delta);
            self.method.corrected();
            if self.end_known {
                self.method.know_end_rate(&self.end);
            }
        }
        self.end_known = false;
    }

    /// Work before the next step.
    fn restart(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        if B::RESTARTS && self.post_step.may_restart() {
            let (q, p) = (&mut self.new.0, &mut self.new.1);
            self.method.parts().0.store(system, q, p);
            let restarted = self.post_step.restart(system, t + h, q, p);
            if restarted.map_err(|error| StepError::Constraint { time: t.to_f64(), error })? {
                self.method.begin(system, t + h, q, p)?;
            }
        }
        Ok(())
    }
}

impl<Y, M, B> Stepper<Y> for WithPostStep<Y, M, B>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
    B: PostStep<Y>,
{
    fn order(&self) -> u32 {
        self.method.order()
    }

    fn error_order(&self) -> Option<u32> {
        self.method.error_order()
    }

    fn share(&self) -> f64 {
        self.method.share()
    }

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        self.end_known = false;
        self.method.begin(system, t, q, p)
    }

    fn resume(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        self.end_known = false;
        self.method.resume(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        (self.worked, self.end_known) = (false, false);
        let error = self.method.attempt(system, t, h, scale)?;
        // A step that will be rejected is not changed.
        if error <= 1.0 && !self.post_step.idle(system, t + h) {
            let delta = self.method.parts().1;
            if delta.not_finite().is_some() {
                return Ok(error);
            }
            self.delta.copy_from(delta);
            self.worked = true;
            let result = self.close(system, t + h, None);
            result.map_err(|error| StepError::Constraint { time: t.to_f64(), error })?;
        }
        Ok(error)
    }

    fn advise(&mut self) -> Option<f64> {
        self.method.advise()
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        let (field, own) = self.method.parts();
        (field, if self.worked { &mut self.delta } else { own })
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        self.method.start_rate(system, t)
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        if self.end_known {
            return &self.end;
        }
        // Where the end was not changed, the rate there is the method's own.
        if !self.worked || self.method.parts().1.parts() == self.delta.parts() {
            return self.method.end_rate(system, t, h);
        }
        self.method.parts().0.rates(system, t + h, &self.delta, &mut self.end);
        self.end_known = true;
        &self.end
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        self.hand_over();
        self.method.accept(system, t, h)?;
        self.restart(system, t, h)
    }

    fn finish(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        self.hand_over();
        self.method.finish(system, t, h)?;
        self.restart(system, t, h)
    }

    /// The method's interpolation, changed by the work; where this fails, the method's interpolation.
    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.method.interpolate(system, t, h, theta, out);
        if !self.post_step.idle(system, t + theta * h) {
            // The displacement is changed last, when nothing can fail any more.
            let _ = self.close(system, t + theta * h, Some(out));
        }
    }

    fn corrected(&mut self) {
        self.end_known = false;
        if !self.worked {
            self.method.corrected();
        }
    }

    fn know_end_rate(&mut self, rate: &Point<Y>) {
        if !self.worked {
            return self.method.know_end_rate(rate);
        }
        self.end.copy_from(rate);
        self.end_known = true;
    }

    fn remembers(&self) -> bool {
        self.method.remembers()
    }

    fn statistics(&self) -> Statistics {
        self.method.statistics()
    }

    fn step(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), StepError> {
        self.resume(system, t, q, p)?;
        self.attempt(system, t, h, None)?;
        self.finish(system, t, h)?;
        self.method.parts().0.store(system, q, p);
        Ok(())
    }
}
