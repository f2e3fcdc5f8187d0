//! Step doubling: two half steps compared with a full step.

use super::chart::{Chart, Point};
use super::integrator::{Attempt, Integrator, Scheme};
use super::stepper::{norm, Statistics, Stepper};
use super::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// Error control for a one-step method that estimates no error: every step is made a second time as two half steps. Of
/// order `p`, the two results differ by `2ᵖ − 1` times the error of the better one, that of the halves, which is kept.
///
/// The second half starts in its own chart; both results are compared in the chart of the start. A method of `s`
/// evaluations needs `3 s − 1` a step, since one step and the first half share their first evaluation. E. Hairer, S. P.
/// Nørsett, G. Wanner, *Solving Ordinary Differential Equations I*, 1993, II.4, eq. 4.4 to 4.6. Not for multistep
/// methods.
pub type StepDoubling<Y, M> = Integrator<Y, Doubling<Y, M>>;

/// The scheme of [`StepDoubling`] over a method `M`.
#[derive(Clone, Debug)]
pub struct Doubling<Y: System, M> {
    method: M,
    extrapolate: bool,
    /// Whether the method is at the start of the step, and not in its middle.
    ready: bool,
    start: Point<Y>,
    whole: Point<Y>,
    q: Y::Coordinates,
    p: Y::Momenta,
}

impl<Y, M> StepDoubling<Y, M>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    /// Step doubling with a method of the same system. The result is that of the two half steps.
    pub fn over(system: &Y, method: M) -> Self {
        Self::from_scheme(system, Doubling::new(system, method, false), false)
    }

    /// Step doubling with local extrapolation: the result is that of two half steps plus its estimated error, of one
    /// order more.
    pub fn extrapolated(system: &Y, method: M) -> Self {
        Self::from_scheme(system, Doubling::new(system, method, true), false)
    }
}

impl<Y, M> Doubling<Y, M>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    fn new(system: &Y, method: M, extrapolate: bool) -> Self {
        Doubling {
            method,
            extrapolate,
            ready: false,
            start: Point::zero(system),
            whole: Point::zero(system),
            q: system.neutral(),
            p: system.zero_momenta(),
        }
    }

    /// Sets the method to the start of the step.
    fn prepare(&mut self, step: &Attempt<Y>, system: &mut Y, t: Y::Scalar) -> Result<(), StepError> {
        if !self.ready {
            step.field.chart().base(system, &mut self.q, &mut self.p);
            self.method.begin(system, t, &self.q, &self.p)?;
            self.ready = true;
        }
        Ok(())
    }

    /// Result of the two half steps, as a displacement from the start.
    fn halves(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        let half = Y::Scalar::constant(0.5) * h;
        self.method.attempt(system, t, half, None)?;
        step.delta.copy_from(self.method.parts().1);
        self.ready = false;
        self.method.accept(system, t, half)?;
        self.method.attempt(system, t + half, half, None)?;
        Chart::compose(system, self.method.parts().1, &mut step.delta);
        Ok(())
    }
}

impl<Y, M> Scheme<Y> for Doubling<Y, M>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    fn order(&self) -> u32 {
        self.method.order() + u32::from(self.extrapolate)
    }

    fn error_order(&self) -> Option<u32> {
        Some(self.method.order())
    }

    fn begin(&mut self) {
        self.ready = false;
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.prepare(step, system, t)?;
        if scale.is_none() && !self.extrapolate {
            self.halves(step, system, t, h)?;
            return Ok(0.0);
        }
        self.method.attempt(system, t, h, None)?;
        self.whole.copy_from(self.method.parts().1);
        self.halves(step, system, t, h)?;
        // `whole` becomes the error of `delta`.
        self.whole.scale(-Y::Scalar::one());
        self.whole.add(Y::Scalar::one(), &step.delta);
        let more = (1_u64 << self.method.order()) - 1;
        self.whole.scale(Y::Scalar::one() / Y::Scalar::constant(more as f64));
        if self.extrapolate {
            step.delta.add(Y::Scalar::one(), &self.whole);
        }
        Ok(scale.map_or(0.0, |scale| norm(&self.whole, scale)))
    }

    fn start(&mut self) -> &mut Point<Y> {
        &mut self.start
    }

    fn start_rate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar) {
        if step.start_known {
            return;
        }
        // The method has evaluated it, or will use it. A base that was taken is one the method takes too.
        match self.prepare(step, system, t) {
            Ok(()) => {
                self.start.copy_from(self.method.start_rate(system, t));
                step.start_known = true;
            }
            Err(_) => step.start_rate(system, t, &mut self.start),
        }
    }

    fn accepted(&mut self, _step: &mut Attempt<Y>, _system: &Y, _h: Y::Scalar) -> bool {
        self.ready = false;
        false
    }

    fn statistics(&self, own: Statistics) -> Statistics {
        let inner = self.method.statistics();
        Statistics { evaluations: inner.evaluations + own.evaluations, steps: own.steps, ..inner }
    }
}
