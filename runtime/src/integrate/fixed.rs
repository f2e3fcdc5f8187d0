//! Implicit methods at constant cost.

use super::chart::Point;
use super::collocation::{Collocation, Formula};
use super::integrator::{Attempt, Integrator, Scheme};
use super::newton::Iteration;
use super::StepError;
use crate::system::{Real, System};

/// A collocation method with the same number of iterations in every step: for real time.
///
/// A step starts from the solution of the linearised equations, which costs no evaluation, and makes `n` iterations.
/// With derivatives this is one evaluation of them, one factorisation and `n` evaluations of the rates for each stage,
/// whatever happens. It cannot fail to converge; what is not converged counts as an error of the method. It is in
/// single precision throughout if the system is, which matters to small processors.
#[derive(Clone, Debug)]
pub struct FixedIterations<C> {
    method: C,
    n: u32,
}

impl<Y, T, I, const S: usize> Integrator<Y, Collocation<Y, T, I, S>>
where
    Y: System,
    Y::Scalar: Real,
{
    /// This method with exactly `n` iterations a step, for real time; fixed-point methods make one at least.
    #[inline(always)]
    pub fn with_iterations(self, n: u32) -> Integrator<Y, FixedIterations<Collocation<Y, T, I, S>>> {
        self.map(|method| FixedIterations { method, n })
    }
}

impl<Y, T, I, const S: usize> Scheme<Y> for FixedIterations<Collocation<Y, T, I, S>>
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

    fn share(&self) -> f64 {
        self.method.share()
    }

    fn begin(&mut self) {
        self.method.begin();
    }

    #[inline]
    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.method.solve_by(step, system, t, h, self.n.max(u32::from(!I::DERIVATIVES)))?;
        Ok(self.method.conclude(step, system, t, h, scale))
    }

    fn start(&mut self) -> &mut Point<Y> {
        self.method.start()
    }

    fn start_rate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar) {
        self.method.start_rate(step, system, t);
    }

    fn accepted(&mut self, step: &mut Attempt<Y>, system: &Y, h: Y::Scalar) -> bool {
        self.method.accepted(step, system, h)
    }

    fn interpolate(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        theta: Y::Scalar,
        out: &mut Point<Y>,
    ) {
        self.method.interpolate(step, system, t, h, theta, out);
    }
}
