//! The Adams method with steps and orders of any size.

use super::history::History;
use super::weights::{Weights, NODES};
use crate::integrate::chart::Point;
use crate::integrate::field::Field;
use crate::integrate::stepper::{norm, Statistics, Stepper};
use crate::integrate::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// Highest order of the predictor.
const HIGHEST: usize = 12;
/// Rates that are kept: one more tells whether a higher order would do better.
const KEPT: usize = HIGHEST + 1;
/// A step grows by at most this factor.
const GROW: f64 = 2.0;

/// Variable-step, variable-order Adams-Bashforth-Moulton method.
#[derive(Clone, Debug)]
pub struct VariableAdams<Y: System> {
    field: Field<Y>,
    steps: u64,
    history: History<Y, KEPT>,
    start_known: bool,
    /// Order of the predictor in the next attempt.
    order: usize,
    /// Order of the last attempt.
    used: usize,
    /// Since the start every step has raised the order.
    starting: bool,
    /// Errors of the last attempt at orders `used − 1` to `used + 1`; infinite where not known.
    errors: [f64; 3],
    delta: Point<Y>,
    end: Point<Y>,
    end_known: bool,
    work: Point<Y>,
    pub tune: [f64; 6],
}

impl<Y> VariableAdams<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Room for the history of one system.
    pub fn new(system: &Y) -> Self {
        Self::with_sums(system, false)
    }

    /// With compensated sums.
    pub fn compensated(system: &Y) -> Self {
        Self::with_sums(system, true)
    }

    fn with_sums(system: &Y, compensated: bool) -> Self {
        let point = || Point::zero(system);
        VariableAdams {
            field: Field::new(system, compensated),
            steps: 0,
            history: History::new(system),
            start_known: false,
            order: 1,
            used: 1,
            starting: true,
            errors: [f64::INFINITY; 3],
            delta: point(),
            end: point(),
            end_known: false,
            work: point(),
            tune: [0.5, 2.0, 1.0, 1.0, 1.0, 12.0],
        }
    }

    /// Weights at order `k` up to `theta` of a step of `h`.
    fn weights(&self, k: usize, h: Y::Scalar, theta: Y::Scalar) -> Weights<Y::Scalar> {
        let mut places = [Y::Scalar::one(); NODES];
        let count = (k + 1).min(self.history.len()).min(HIGHEST);
        for (j, place) in places[1..=count].iter_mut().enumerate() {
            *place = -(self.history.age(j) / h);
        }
        Weights::new(&places[..=count], k, theta)
    }
}

impl<Y> Stepper<Y> for VariableAdams<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    fn order(&self) -> u32 {
        HIGHEST as u32 + 1
    }

    fn error_order(&self) -> Option<u32> {
        Some(self.order as u32)
    }

    fn begin(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
    ) -> Result<(), StepError> {
        self.history.keep(0);
        (self.start_known, self.end_known, self.starting, self.order) = (false, false, true, 1);
        self.field.load(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.start_rate(system, t);
        self.end_known = false;
        let k = self.order.min(self.history.len());
        self.used = k;
        let weights = self.weights(k, h, Y::Scalar::one());
        self.history.combine(&weights.predictor[..=k], &self.end, &mut self.delta);
        self.delta.scale(h);
        self.field.rates(system, t + h, &self.delta, &mut self.end);
        self.history.combine(&weights.corrector[..=k], &self.end, &mut self.delta);
        self.delta.scale(h);
        let Some(scale) = scale else { return Ok(0.0) };
        let known = [k > 1, true, k < HIGHEST && k < self.history.len()];
        for (i, (weights, known)) in weights.changes.iter().zip(known).enumerate() {
            self.errors[i] = f64::INFINITY;
            if known {
                self.history.combine(&weights[..k + i], &self.end, &mut self.work);
                self.errors[i] = h.abs().to_f64() * norm(&self.work, scale);
            }
        }
        let [lower, error, _] = self.errors;
        if !(error <= 1.0) {
            self.starting = false;
            if lower <= error {
                self.order = (k - 1).max(1);
            }
        }
        Ok(error)
    }

    fn advise(&mut self) -> Option<f64> {
        let k = self.used;
        let [lower, error, higher] = self.errors;
        // Logarithm of the factor by which the step could grow.
        let growth = |error: f64, k: usize| libm::log(self.tune[0] / error.max(1e-12)) / (k as f64 + 1.0);
        let mut best = growth(error, k);
        self.starting &= k < HIGHEST && (k == 1 || lower > error);
        if self.starting {
            self.order = k + 1;
        } else {
            self.order = k;
            for (order, error) in [(k - 1, lower), (k + 1, higher)] {
                let growth = growth(error, order);
                if growth > best {
                    (self.order, best) = (order, growth);
                }
            }
        }
        Some(libm::exp(best).clamp(0.5, GROW))
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        (&mut self.field, &mut self.delta)
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        if !self.start_known {
            self.end.clear();
            let rate = self.history.push(None);
            self.field.rates(system, t, &self.end, rate);
            self.start_known = true;
        }
        self.history.rate(0)
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        if !self.end_known {
            self.field.rates(system, t + h, &self.delta, &mut self.end);
            self.end_known = true;
        }
        &self.end
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        self.field.advance(system, t, &self.delta)?;
        if self.end_known {
            self.history.push(Some((&self.delta, h))).copy_from(&self.end);
        }
        (self.start_known, self.end_known) = (self.end_known, false);
        self.history.follow(system, &self.delta, h);
        self.steps += 1;
        Ok(())
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.end_rate(system, t, h);
        let k = self.used;
        let weights = self.weights(k, h, theta).corrector;
        self.history.combine(&weights[..=k], &self.end, out);
        out.scale(h);
    }

    fn statistics(&self) -> Statistics {
        Statistics { steps: self.steps, evaluations: self.field.evaluations(), ..Statistics::default() }
    }
}
