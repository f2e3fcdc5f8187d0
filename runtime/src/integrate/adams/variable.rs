//! The Adams method with steps and orders of any size.

use super::history::History;
use super::weights::{integrals, inverse, product, NODES};
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
    /// Errors of the last attempt at orders `used − 2` to `used + 1`; infinite where not known.
    errors: [f64; 4],
    delta: Point<Y>,
    end: Point<Y>,
    end_known: bool,
    work: Point<Y>,
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
            errors: [f64::INFINITY; 4],
            delta: point(),
            end: point(),
            end_known: false,
            work: point(),
        }
    }

    /// Places of the new rate and of the past ones, in steps of `h` from the start.
    fn nodes(&self, h: Y::Scalar) -> [Y::Scalar; NODES] {
        let mut nodes = [Y::Scalar::one(); NODES];
        for j in 0..self.history.len() {
            nodes[j + 1] = -(self.history.age(j) / h);
        }
        nodes
    }

    /// Error at order `m`: what one node more changes.
    fn error(&mut self, m: usize, nodes: &[Y::Scalar], h: Y::Scalar, scale: &Point<Y>) -> f64 {
        let mut weights = [Y::Scalar::zero(); NODES];
        for j in 0..=m {
            weights[j] = inverse(&nodes[..=m], j);
        }
        self.history.combine(&weights[1..=m], &mut self.work);
        self.work.add(weights[0], &self.end);
        self.work.scale(h * product(&nodes[..m]));
        norm(&self.work, scale)
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
        let nodes = self.nodes(h);
        let mut weights = [Y::Scalar::zero(); NODES];
        integrals(&nodes[1..=k], Y::Scalar::one(), &mut weights[..k]);
        self.history.combine(&weights[..k], &mut self.delta);
        self.delta.scale(h);
        self.field.rates(system, t + h, &self.delta, &mut self.end);
        integrals(&nodes[..=k], Y::Scalar::one(), &mut weights[..=k]);
        self.history.combine(&weights[1..=k], &mut self.delta);
        self.delta.add(weights[0], &self.end);
        self.delta.scale(h);
        let Some(scale) = scale else { return Ok(0.0) };
        self.errors = [f64::INFINITY; 4];
        for (i, m) in (k as isize - 2..=k as isize + 1).enumerate() {
            if m >= 1 && m as usize <= self.history.len() && m as usize <= HIGHEST {
                self.errors[i] = self.error(m as usize, &nodes, h, scale);
            }
        }
        let error = self.errors[2];
        if !(error <= 1.0) {
            self.starting = false;
            if self.errors[1] <= error {
                self.order = (k - 1).max(1);
            }
        }
        Ok(error)
    }

    fn advise(&mut self) -> Option<f64> {
        let k = self.used;
        let factor = |m: usize, error: f64| libm::pow(0.5 / error.max(1e-12), 1.0 / (m as f64 + 1.0));
        let [_, lower, error, higher] = self.errors;
        if self.starting {
            self.starting = k < HIGHEST && !(k > 1 && lower <= error);
            if self.starting {
                self.order = k + 1;
                return Some(factor(k, error).clamp(0.5, GROW));
            }
        }
        let mut best = (k, factor(k, error));
        if k > 1 {
            let f = factor(k - 1, lower.max(self.errors[0].min(lower)));
            if f > best.1 {
                best = (k - 1, f);
            }
        }
        if k < HIGHEST {
            let f = factor(k + 1, higher);
            if f > best.1 {
                best = (k + 1, f);
            }
        }
        self.order = best.0;
        Some(best.1.clamp(0.5, GROW))
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
        let nodes = self.nodes(h);
        let mut weights = [Y::Scalar::zero(); NODES];
        integrals(&nodes[..=k], theta, &mut weights[..=k]);
        self.history.combine(&weights[1..=k], out);
        out.add(weights[0], &self.end);
        out.scale(h);
    }

    fn statistics(&self) -> Statistics {
        Statistics { steps: self.steps, evaluations: self.field.evaluations(), ..Statistics::default() }
    }
}
