//! Two half steps against one.

use super::chart::{Chart, Point};
use super::field::Field;
use super::stepper::{hermite, norm, Statistics, Stepper};
use super::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// Error control for a one-step method that estimates no error: every step is made again as two halves. Of order `p`, the two
/// results differ by `2ᵖ − 1` times the error of the better one, that of the halves, which is kept.
///
/// The second half starts in its own chart; both results are compared in the chart of the start. A method of `s` evaluations
/// needs `3 s − 1` a step, since one step and the first half share their first evaluation. E. Hairer, S. P. Nørsett,
/// G. Wanner, *Solving Ordinary Differential Equations I*, 1993, II.4, eq. 4.4 to 4.6. Not for multistep methods.
#[derive(Clone, Debug)]
pub struct StepDoubling<Y: System, M> {
    method: M,
    extrapolate: bool,
    field: Field<Y>,
    statistics: Statistics,
    /// The method stands at the start of the step, not amid it.
    ready: bool,
    start: Point<Y>,
    start_known: bool,
    end: Point<Y>,
    end_known: bool,
    delta: Point<Y>,
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
    /// Over a method of the same system. The result is that of two half steps.
    pub fn new(system: &Y, method: M) -> Self {
        Self::with(system, method, false)
    }

    /// The result is that of two half steps plus its estimated error: one order more (local extrapolation).
    pub fn extrapolated(system: &Y, method: M) -> Self {
        Self::with(system, method, true)
    }

    fn with(system: &Y, method: M, extrapolate: bool) -> Self {
        let point = || Point::zero(system);
        StepDoubling {
            method,
            extrapolate,
            field: Field::new(system, false),
            statistics: Statistics::default(),
            ready: false,
            start: point(),
            start_known: false,
            end: point(),
            end_known: false,
            delta: point(),
            whole: point(),
            q: system.neutral(),
            p: system.zero_momenta(),
        }
    }

    /// Sets the method to the start of the step.
    fn prepare(&mut self, system: &mut Y, t: Y::Scalar) -> Result<(), StepError> {
        if !self.ready {
            self.field.chart().base(system, &mut self.q, &mut self.p);
            self.method.begin(system, t, &self.q, &self.p)?;
            self.ready = true;
        }
        Ok(())
    }

    /// Result of two half steps, from the start.
    fn halves(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        let half = Y::Scalar::constant(0.5) * h;
        self.method.attempt(system, t, half, None)?;
        self.delta.copy_from(self.method.parts().1);
        self.ready = false;
        self.method.accept(system, t, half)?;
        self.method.attempt(system, t + half, half, None)?;
        Chart::compose(system, self.method.parts().1, &mut self.delta);
        Ok(())
    }
}

impl<Y, M> Stepper<Y> for StepDoubling<Y, M>
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

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        (self.ready, self.start_known, self.end_known) = (false, false, false);
        self.field.load(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.prepare(system, t)?;
        self.end_known = false;
        if scale.is_none() && !self.extrapolate {
            self.halves(system, t, h)?;
            return Ok(0.0);
        }
        self.method.attempt(system, t, h, None)?;
        self.whole.copy_from(self.method.parts().1);
        self.halves(system, t, h)?;
        // `whole` becomes the error of `delta`.
        self.whole.scale(-Y::Scalar::one());
        self.whole.add(Y::Scalar::one(), &self.delta);
        let more = (1_u64 << self.method.order()) - 1;
        self.whole.scale(Y::Scalar::one() / Y::Scalar::constant(more as f64));
        if self.extrapolate {
            self.delta.add(Y::Scalar::one(), &self.whole);
        }
        Ok(scale.map_or(0.0, |scale| norm(&self.whole, scale)))
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        (&mut self.field, &mut self.delta)
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        if !self.start_known {
            // The method has evaluated it, or will use it. A base that was taken is one the method takes too.
            match self.prepare(system, t) {
                Ok(()) => self.start.copy_from(self.method.start_rate(system, t)),
                Err(_) => {
                    self.whole.clear();
                    self.field.rates(system, t, &self.whole, &mut self.start);
                }
            }
            self.start_known = true;
        }
        &self.start
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        if !self.end_known {
            self.field.rates(system, t + h, &self.delta, &mut self.end);
            self.end_known = true;
        }
        &self.end
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, _h: Y::Scalar) -> Result<(), StepError> {
        self.field.advance(system, t, &self.delta)?;
        (self.ready, self.start_known, self.end_known) = (false, false, false);
        self.statistics.steps += 1;
        Ok(())
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.start_rate(system, t);
        self.end_rate(system, t, h);
        hermite(h, theta, &self.delta, [&self.start, &self.end], out);
    }

    fn statistics(&self) -> Statistics {
        let inner = self.method.statistics();
        Statistics { evaluations: inner.evaluations + self.field.evaluations(), steps: self.statistics.steps, ..inner }
    }
}
