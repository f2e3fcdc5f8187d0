//! The Adams method with variable steps and orders.

use super::history::History;
use super::weights::{Weights, NODES};
use crate::integrate::chart::Point;
use crate::integrate::integrator::{Attempt, FromSystem, Integrator, Scheme};
use crate::integrate::stepper::norm;
use crate::integrate::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// Highest order of the predictor.
const HIGHEST: usize = 12;
/// As [`Stepper::share`](crate::integrate::Stepper::share): for the same error a Runge-Kutta method takes an eighth as
/// many steps, and the errors of all add up.
const SHARE: f64 = 0.005;
/// Share of that which the next step aims at.
const AIM: f64 = 0.1;
/// The order is looked at every so many steps.
const REST: u32 = 3;
/// Smallest and largest factor by which a step changes.
const SHRINK: f64 = 0.5;
const GROW: f64 = 2.0;

/// Adams-Bashforth-Moulton with variable steps and orders: predictor of order 1 to 12, corrector of one more, two
/// evaluations of the rates a step.
///
/// It needs the fewest evaluations of all explicit methods here where the motion is smooth, some half of those of
/// Verner's pair of order 9 for the same tolerance, and a restart at every jump. Its own work at order 12 is some 700
/// multiplications, most of them in vector instructions, and 77 for every coordinate a step, so it saves time where the
/// rates cost more than that. With tolerances looser than 1e-3 its energy may grow without bound in violent motion; use
/// a Runge-Kutta method there. It is made for error control. With fixed steps the order rises from one, and the error of
/// the first steps remains; use [`Adams`](super::Adams) for fixed steps.
///
/// Orders and errors after Shampine and Gordon, *Computer Solution of Ordinary Differential Equations*, 1975, chapters
/// 5 to 7: the error is estimated at the predictor's order, the corrector's result is kept. Weights are found for every
/// step from the places of the past rates, instead of their modified divided differences: the rates are rewritten by
/// rotations ([`Chart::follow`](crate::integrate::Chart::follow)), which differences would not survive.
pub type VariableAdams<Y> = Integrator<Y, AdamsOfVariableOrder<Y>>;

/// The scheme of [`VariableAdams`].
#[derive(Clone, Debug)]
pub struct AdamsOfVariableOrder<Y: System> {
    history: History<Y, HIGHEST>,
    /// Order of the predictor in the next attempt.
    order: usize,
    /// In the last one.
    used: usize,
    /// Every step since the start has raised the order.
    starting: bool,
    /// Errors of the last attempt at orders `used − 1` to `used + 1`; infinite where not known.
    errors: [f64; 3],
    /// Steps until another order is looked for again.
    rest: u32,
    sum: Point<Y>,
    work: Point<Y>,
}

impl<Y> FromSystem<Y> for AdamsOfVariableOrder<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    fn new(system: &Y) -> Self {
        AdamsOfVariableOrder {
            history: History::new(system),
            order: 1,
            used: 1,
            starting: true,
            errors: [f64::INFINITY; 3],
            rest: 0,
            sum: Point::zero(system),
            work: Point::zero(system),
        }
    }
}

impl<Y> AdamsOfVariableOrder<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Weights at the order of the last attempt, up to `theta` of a step of `h`.
    fn weights(&self, h: Y::Scalar, theta: Y::Scalar) -> Weights<Y::Scalar> {
        let mut places = [Y::Scalar::one(); NODES];
        let (count, scale) = ((self.used + 1).min(self.history.len()), -Y::Scalar::one() / h);
        for (j, place) in places[1..=count].iter_mut().enumerate() {
            *place = self.history.age(j) * scale;
        }
        Weights::new(&places, self.used, theta)
    }

    /// Integral up to `theta` of the polynomial through the past rates and that at the end; to `work`.
    fn polynomial(&mut self, step: &Attempt<Y>, h: Y::Scalar, theta: Y::Scalar) {
        let weights = self.weights(h, theta).corrector;
        self.history.combine(&weights[..=self.used], &step.end, &mut self.work);
        self.work.scale(h);
    }

    /// Predictor and corrector, and to `work` how much the last rate changes the integral. All of these are made of the
    /// same two sums over the past rates.
    fn predict_and_correct(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        (t, h): (Y::Scalar, Y::Scalar),
        weights: &Weights<Y::Scalar>,
    ) {
        let k = self.used;
        let Weights { corrector, divided, past, .. } = weights;
        self.history.sums([&corrector[1..=k], &divided[1..=k]], [&mut self.sum, &mut self.work]);
        for (delta, (sum, work)) in
            step.delta.parts_mut().into_iter().zip(self.sum.parts().into_iter().zip(self.work.parts()))
        {
            for (delta, (sum, work)) in delta.iter_mut().zip(sum.iter().zip(work)) {
                *delta = h * (*sum - *past * *work);
            }
        }
        step.field.rates(system, t + h, &step.delta, &mut step.end);
        let (of_sum, of_end, of_divided) = (h, h * corrector[0], divided[0]);
        let change = weights.change();
        let known = self.sum.parts().into_iter().zip(step.end.parts());
        for ((delta, work), (sum, end)) in step.delta.parts_mut().into_iter().zip(self.work.parts_mut()).zip(known) {
            for ((delta, work), (sum, end)) in delta.iter_mut().zip(work).zip(sum.iter().zip(end)) {
                *delta = of_sum * *sum + of_end * *end;
                *work = change * (*work + of_divided * *end);
            }
        }
    }

    /// Error of the last attempt by the sum of the rates with `weights`: how much one rate more changes the integral.
    fn error(&mut self, weights: &[Y::Scalar], step: &Attempt<Y>, h: Y::Scalar, scale: &Point<Y>) -> f64 {
        self.history.combine(weights, &step.end, &mut self.work);
        h.abs().to_f64() * norm(&self.work, scale)
    }

    /// Errors of the last attempt at the orders around its own, which has the error in `work`.
    fn estimate(&mut self, step: &Attempt<Y>, weights: &Weights<Y::Scalar>, h: Y::Scalar, scale: &Point<Y>) {
        let k = self.used;
        let error = h.abs().to_f64() * norm(&self.work, scale);
        self.errors = [f64::INFINITY, error, f64::INFINITY];
        // Another order pays over many steps, so it is not looked for in each; but after an error that is too large.
        self.rest = self.rest.saturating_sub(1);
        if self.starting || self.rest == 0 || error.is_nan() || error > 1.0 {
            if k > 1 {
                self.errors[0] = self.error(&weights.change_below()[..k], step, h, scale);
            }
            if k < self.history.len() && !self.starting {
                self.errors[2] = self.error(&weights.change_above()[..k + 2], step, h, scale);
            }
            self.rest = REST;
        }
    }
}

impl<Y> Scheme<Y> for AdamsOfVariableOrder<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    const MULTISTEP: bool = true;

    /// The highest.
    fn order(&self) -> u32 {
        HIGHEST as u32 + 1
    }

    /// Of the next attempt.
    fn error_order(&self) -> Option<u32> {
        Some(self.order as u32)
    }

    fn share(&self) -> f64 {
        SHARE
    }

    fn begin(&mut self) {
        (self.order, self.starting) = (1, true);
        self.history.keep(0);
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.start_rate(step, system, t);
        self.used = self.order.min(self.history.len());
        let k = self.used;
        let weights = self.weights(h, Y::Scalar::one());
        let Some(scale) = scale else {
            self.history.predict(step, h, &weights.predictor()[1..=k]);
            self.history.correct(step, system, t, h, &weights.corrector[..=k]);
            self.order = (k + 1).min(HIGHEST);
            return Ok(0.0);
        };
        self.predict_and_correct(step, system, (t, h), &weights);
        self.estimate(step, &weights, h, scale);
        let [lower, error, _] = self.errors;
        // An error that is not a number counts as too large.
        if error > 1.0 || error.is_nan() {
            self.starting = false;
            self.order = if k > 1 && lower <= error { k - 1 } else { k };
        }
        Ok(error)
    }

    fn advise(&mut self) -> Option<f64> {
        let k = self.used;
        let [lower, error, higher] = self.errors;
        // Logarithm of the factor that the step may change by.
        let growth = |error: f64, k: usize| libm::log(AIM / error.max(1e-12)) / (k as f64 + 1.0);
        let mut best = growth(error, k);
        self.starting &= k < HIGHEST && (k == 1 || lower > error);
        self.order = if self.starting { k + 1 } else { k };
        if !self.starting {
            for (order, error) in [(k - 1, lower), (k + 1, higher)] {
                let growth = growth(error, order);
                if growth > best {
                    (self.order, best) = (order, growth);
                }
            }
        }
        Some(libm::exp(best).clamp(SHRINK, GROW))
    }

    fn start(&mut self) -> &mut Point<Y> {
        self.history.newest()
    }

    fn start_rate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar) {
        self.history.start_rate(step, system, t);
    }

    fn accepted(&mut self, step: &mut Attempt<Y>, system: &Y, h: Y::Scalar) -> bool {
        self.history.accepted(step, system, h)
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
        step.end_rate(system, t, h);
        self.polynomial(step, h, Y::Scalar::one());
        out.copy_from(&step.delta);
        // The step was made with the rate at the prediction: what that differs by is spread over the step.
        out.add(-Y::Scalar::one(), &self.work);
        out.scale(theta);
        self.polynomial(step, h, theta);
        out.add(Y::Scalar::one(), &self.work);
    }
}
