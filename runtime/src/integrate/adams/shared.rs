//! The parts that Adams methods have in common: the past rates, and the two parts of a step.

use super::history::History;
use crate::integrate::integrator::Attempt;
use crate::system::{Real, System};

impl<Y, const N: usize> History<Y, N>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Evaluates the rate at the start of the step as the newest, unless it is known.
    pub fn start_rate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar) {
        if !step.start_known {
            let rate = self.push(None);
            step.start_rate(system, t, rate);
        }
    }

    /// The explicit method: a displacement from past rates, with one weight for each.
    pub fn predict(&self, step: &mut Attempt<Y>, h: Y::Scalar, weights: &[Y::Scalar]) {
        self.sums([weights], [&mut step.delta]);
        step.delta.scale(h);
    }

    /// The implicit one, with the rate at the prediction.
    pub fn correct(&self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar, weights: &[Y::Scalar]) {
        step.field.rates(system, t + h, &step.delta, &mut step.end);
        self.combine(weights, &step.end, &mut step.delta);
        step.delta.scale(h);
    }

    /// The state has moved to the end of the step. The rate there is evaluated when the next one begins, if it is not
    /// known.
    pub fn accepted(&mut self, step: &Attempt<Y>, system: &Y, h: Y::Scalar) -> bool {
        if step.end_known {
            self.push(Some((&step.delta, h))).copy_from(&step.end);
        }
        self.follow(system, &step.delta, h);
        step.end_known
    }
}
