//! What a method can do for its callers.

use super::chart::Point;
use super::field::Field;
use super::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// Work done since a method was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Statistics {
    /// Steps that were accepted. One-step methods count single steps ([`Stepper::step`]) only with a post-step or an
    /// [`EnergyProjection`](super::EnergyProjection).
    pub steps: u64,
    /// Steps that were rejected, and tried again with a smaller size.
    pub rejections: u64,
    /// Evaluations of the rates.
    pub evaluations: u64,
    /// Evaluations of the derivatives of the rates.
    pub jacobians: u64,
    /// Factorisations of the matrices of a step; those of one step count as one.
    pub factorisations: u64,
    /// Iterations for implicit equations.
    pub iterations: u64,
}

/// A method that goes from one state to the next.
///
/// A step has three parts, so that a [`Solver`](super::Solver) can examine it before it is accepted: [`Stepper::begin`]
/// takes a state, [`Stepper::attempt`] computes a displacement from it, and [`Stepper::accept`] moves to the new state
/// and prepares the next attempt. [`Stepper::step`] does all three, for loops that keep the state themselves.
pub trait Stepper<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Order of convergence.
    fn order(&self) -> u32;

    /// Order of the result whose error is estimated, if an error is estimated: the estimate is of one order more in
    /// `h`.
    fn error_order(&self) -> Option<u32>;

    /// The part of the tolerance that the estimated error of a step may use up: the errors of all steps add up, and
    /// the motion makes them grow. By the reports' motions with exact solutions it is chosen so that methods of high
    /// order err by less than a hundred times the tolerance after some hundred radians; one where the caller has to
    /// choose the tolerance accordingly.
    fn share(&self) -> f64 {
        1.0
    }

    /// Starts from the state `(q, p)` at time `t` (s); past steps are forgotten.
    ///
    /// # Errors
    /// [`StepError::Quaternion`] where a quaternion is not of unit length.
    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError>;

    /// As [`Stepper::begin`], but a method with a history keeps it if the state is the one that the method gave last.
    ///
    /// # Errors
    /// As [`Stepper::begin`].
    fn resume(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        self.begin(system, t, q, p)
    }

    /// Tries a step of `h` s from time `t`. With `scale`, returns the error relative to it, root mean square over all
    /// components whose scale is not zero; 0 where no error is estimated. NaN means that the step is too large for an
    /// estimate.
    ///
    /// # Errors
    /// Of implicit methods: [`StepError::NoConvergence`], [`StepError::Singular`].
    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError>;

    /// For methods that choose their order: chooses the order of the next attempt by the errors of the last one, which
    /// met the tolerances, and returns the factor by which the step may change. Other methods return `None`, and the
    /// solver chooses.
    fn advise(&mut self) -> Option<f64> {
        None
    }

    /// The equation, whose chart is about the start of the step, and the displacement of the last attempt.
    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>);

    /// Rate at the start of the step, known after [`Stepper::begin`] and [`Stepper::accept`].
    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y>;

    /// Rate at the end of the last attempt, in the coordinates of its start. Evaluated when first asked for, used again
    /// by the next attempt.
    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y>;

    /// Moves the state by the displacement of the last attempt, which may have been corrected slightly, and prepares
    /// the next attempt.
    ///
    /// # Errors
    /// [`StepError::NotFinite`]: the state has not moved then. Any other error: it has, and the next attempt could not be prepared.
    fn accept(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError>;

    /// As [`Stepper::accept`], for callers who call [`Stepper::begin`] before the next attempt: nothing is prepared for
    /// it.
    ///
    /// # Errors
    /// As [`Stepper::accept`].
    fn finish(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        self.accept(system, t, h)
    }

    /// Tells the method that the caller has changed the displacement of the last attempt: a rate at its end that was
    /// evaluated before is no longer valid.
    fn corrected(&mut self) {}

    /// Tells the method the rate at the end of the last attempt, in the coordinates of its start, where the caller has
    /// changed the displacement and has evaluated the rate there.
    fn know_end_rate(&mut self, _rate: &Point<Y>) {}

    /// Whether rates of past steps are used. Momenta must not jump then, not even along a gauge direction, which
    /// changes nothing in the motion.
    fn remembers(&self) -> bool {
        false
    }

    /// Displacement at `t + θ h` within the last attempt, before it is accepted.
    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>);

    /// Work done since the method was made.
    fn statistics(&self) -> Statistics;

    /// One step of `h` s from time `t` (s). A call does not depend on earlier ones, except
    /// for multistep methods, whose history starts again when `q` and `p` are not those of the last step, and for methods that
    /// solve their equations from what the last step found, in the same way.
    ///
    /// # Errors
    /// [`StepError`]; `q` and `p` are then as they were.
    fn step(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), StepError> {
        self.begin(system, t, q, p)?;
        self.attempt(system, t, h, None)?;
        let (field, delta) = self.parts();
        field.advance(system, t, delta)?;
        field.store(system, q, p);
        Ok(())
    }
}

/// A method on the heap: what the [`catalogue`](crate::catalogue) makes. A call goes through a table of functions once
/// a part of a step, and the rates are called directly.
#[cfg(feature = "alloc")]
impl<Y, M> Stepper<Y> for alloc::boxed::Box<M>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y> + ?Sized,
{
    fn order(&self) -> u32 {
        (**self).order()
    }

    fn error_order(&self) -> Option<u32> {
        (**self).error_order()
    }

    fn share(&self) -> f64 {
        (**self).share()
    }

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        (**self).begin(system, t, q, p)
    }

    fn resume(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        (**self).resume(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        (**self).attempt(system, t, h, scale)
    }

    fn advise(&mut self) -> Option<f64> {
        (**self).advise()
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        (**self).parts()
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        (**self).start_rate(system, t)
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        (**self).end_rate(system, t, h)
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        (**self).accept(system, t, h)
    }

    fn finish(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        (**self).finish(system, t, h)
    }

    fn corrected(&mut self) {
        (**self).corrected()
    }

    fn know_end_rate(&mut self, rate: &Point<Y>) {
        (**self).know_end_rate(rate)
    }

    fn remembers(&self) -> bool {
        (**self).remembers()
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        (**self).interpolate(system, t, h, theta, out)
    }

    fn statistics(&self) -> Statistics {
        (**self).statistics()
    }

    fn step(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), StepError> {
        (**self).step(system, t, h, q, p)
    }
}

/// Cubic through both ends and their rates, for [`Stepper::interpolate`].
pub(crate) fn hermite<Y: System>(
    h: Y::Scalar,
    theta: Y::Scalar,
    delta: &Point<Y>,
    ends: [&Point<Y>; 2],
    out: &mut Point<Y>,
) where
    Y::Scalar: Real,
{
    let c = Y::Scalar::constant;
    let rest = c(1.0) - theta;
    out.copy_from(delta);
    out.scale(theta * theta * (c(3.0) - theta - theta));
    out.add(h * theta * rest * rest, ends[0]);
    out.add(-(h * theta * theta * rest), ends[1]);
}

/// Root mean square of `error / scale` over the components whose scale is not zero.
pub fn norm<Y: System>(error: &Point<Y>, scale: &Point<Y>) -> f64
where
    Y::Scalar: Real,
{
    // Four sums, and no branch: so the loop becomes vector instructions.
    let mut sums = [(0.0_f64, 0.0_f64); 4];
    for (error, scale) in error.parts().into_iter().zip(scale.parts()) {
        for (error, scale) in error.chunks(4).zip(scale.chunks(4)) {
            for ((sum, n), (error, scale)) in sums.iter_mut().zip(error.iter().zip(scale)) {
                let (error, scale) = (error.to_f64(), scale.to_f64());
                let (ratio, one) = if scale > 0.0 { (error / scale, 1.0) } else { (0.0, 0.0) };
                (*sum, *n) = (*sum + ratio * ratio, *n + one);
            }
        }
    }
    let (sum, n) = sums.into_iter().fold((0.0, 0.0_f64), |all, part| (all.0 + part.0, all.1 + part.1));
    libm::sqrt(sum / n.max(1.0))
}
