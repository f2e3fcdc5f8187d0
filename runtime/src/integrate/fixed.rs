//! Implicit methods at constant cost.

use super::chart::Point;
use super::collocation::Collocation;
use super::field::Field;
use super::formulas::Formula;
use super::newton::Iteration;
use super::stepper::{Statistics, Stepper};
use super::StepError;
use crate::system::{Real, System};

/// A collocation method with the same number of iterations in every step: for real time.
///
/// A step starts from the solution of the linearised equations, which costs no evaluation, and makes `n` iterations. With
/// derivatives this is one evaluation of them, one factorisation and `n` evaluations of the rates for each stage, whatever
/// happens. It cannot fail to converge; what is not converged counts as an error of the method. It is in single precision
/// throughout if the system is, which matters to small processors.
#[derive(Clone, Debug)]
pub struct FixedIterations<C> {
    method: C,
    n: u32,
}

impl<C> FixedIterations<C> {
    pub(super) fn new(method: C, n: u32) -> Self {
        FixedIterations { method, n }
    }
}

impl<Y, T, I, const S: usize> Stepper<Y> for FixedIterations<Collocation<Y, T, I, S>>
where
    Y: System,
    Y::Scalar: Real,
    T: Formula<S>,
    I: Iteration<Y, S>,
{
    fn order(&self) -> u32 {
        self.method.order()
    }

    fn error_order(&self) -> Option<u32> {
        self.method.error_order()
    }

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        self.method.begin(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.method.solve_by(system, t, h, self.n)?;
        Ok(self.method.conclude(system, t, h, scale))
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        self.method.parts()
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        self.method.start_rate(system, t)
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        self.method.end_rate(system, t, h)
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        self.method.accept(system, t, h)
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.method.interpolate(system, t, h, theta, out);
    }

    fn corrected(&mut self) {
        self.method.corrected();
    }

    fn statistics(&self) -> Statistics {
        self.method.statistics()
    }
}
