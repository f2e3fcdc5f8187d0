//! Adams methods with steps of one size.

use super::history::History;
use super::start::Extrapolation;
use super::weights::{Weights, NODES};
use crate::integrate::chart::Point;
use crate::integrate::field::Field;
use crate::integrate::stepper::{hermite, Statistics, Stepper};
use crate::integrate::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// The explicit Adams method of order `K`: one evaluation of the rates a step (C.19).
pub type AdamsBashforth<Y, const K: usize> = Adams<Y, K, false>;
/// The explicit method of order `K` predicts, the implicit one of the same order corrects once: two evaluations of the
/// rates a step, at the prediction and at the corrected point (C.20).
pub type AdamsMoulton<Y, const K: usize> = Adams<Y, K, true>;

/// Adams-Bashforth of order 4: one evaluation a step.
pub type Ab4<Y> = AdamsBashforth<Y, 4>;
/// Adams-Bashforth of order 6: one evaluation a step.
pub type Ab6<Y> = AdamsBashforth<Y, 6>;
/// Adams-Bashforth-Moulton of order 4: two evaluations a step.
pub type Abm4<Y> = AdamsMoulton<Y, 4>;
/// Adams-Bashforth-Moulton of order 6: two evaluations a step.
pub type Abm6<Y> = AdamsMoulton<Y, 6>;
/// Adams-Bashforth-Moulton of order 8: two evaluations a step.
pub type Abm8<Y> = AdamsMoulton<Y, 8>;
/// Adams-Bashforth-Moulton of order 12: two evaluations a step.
pub type Abm12<Y> = AdamsMoulton<Y, 12>;

/// Steps whose sizes differ by less count as equal: the last one before an end differs by rounding of the time.
const SAME: f64 = 1e-6;

/// An Adams method of order `K`, 1 to 12, with steps of one size; with `CORRECT` a predictor and a corrector.
///
/// The first `K − 1` steps extrapolate the midpoint rule to order `K` or one more, with `⌈K/2⌉²` evaluations each instead of
/// one or two; so do those after a change of the step, and [`Stepper::step`] after a state that is not the one it gave.
/// A jump of the joint forces spoils the order for `K` steps: call [`Stepper::begin`] where it matters.
#[derive(Clone, Debug)]
pub struct Adams<Y: System, const K: usize, const CORRECT: bool> {
    field: Field<Y>,
    steps: u64,
    /// Weights of the past rates, one unused before them.
    predictor: [Y::Scalar; NODES],
    /// Weight of the new rate, then of the past ones.
    corrector: [Y::Scalar; NODES],
    history: History<Y, K>,
    /// The newest rate of the history is that at the start.
    start_known: bool,
    /// Between the rates of the history, s.
    spacing: Y::Scalar,
    start: Extrapolation<Y>,
    delta: Point<Y>,
    /// Rate at the prediction, or at the end if that is known.
    end: Point<Y>,
    end_known: bool,
}

impl<Y, const K: usize, const CORRECT: bool> Adams<Y, K, CORRECT>
where
    Y: System,
    Y::Scalar: Real,
{
    const ORDER: u32 = {
        assert!(K >= 1 && K <= 12, "Adams methods have orders 1 to 12 here");
        K as u32
    };

    /// Room for the history of one system.
    pub fn new(system: &Y) -> Self {
        Self::with_sums(system, false)
    }

    /// With compensated sums: what rounding takes from a step is added to the next, but for quaternions. Of use where steps
    /// are small against the precision, above all in `f32`.
    pub fn compensated(system: &Y) -> Self {
        Self::with_sums(system, true)
    }

    fn with_sums(system: &Y, compensated: bool) -> Self {
        let places: [Y::Scalar; NODES] = core::array::from_fn(|j| Y::Scalar::constant(1.0 - j as f64));
        let weights = |past: usize| Weights::new(&places[..=past], past, Y::Scalar::one());
        // Of order 1 the corrector is the implicit Euler method, with no past rate.
        let corrector = if K > 1 { weights(K - 1).corrector } else { core::array::from_fn(|j| places[(2 * j).min(1)]) };
        Adams {
            field: Field::new(system, compensated),
            steps: 0,
            predictor: weights(K).predictor,
            corrector,
            history: History::new(system),
            start_known: false,
            spacing: Y::Scalar::zero(),
            start: Extrapolation::new(system),
            delta: Point::zero(system),
            end: Point::zero(system),
            end_known: false,
        }
    }

    /// The chart has moved by the last attempt.
    fn moved(&mut self, system: &Y, h: Y::Scalar) {
        if self.end_known {
            self.history.push(Some((&self.delta, h))).copy_from(&self.end);
        }
        (self.start_known, self.end_known) = (self.end_known, false);
        self.history.follow(system, &self.delta, h);
        self.spacing = h;
        self.steps += 1;
    }
}

impl<Y, const K: usize, const CORRECT: bool> Stepper<Y> for Adams<Y, K, CORRECT>
where
    Y: System,
    Y::Scalar: Real,
{
    fn order(&self) -> u32 {
        Self::ORDER
    }

    fn error_order(&self) -> Option<u32> {
        None
    }

    fn begin(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
    ) -> Result<(), StepError> {
        self.history.keep(0);
        (self.start_known, self.end_known) = (false, false);
        self.field.load(system, t, q, p)
    }

    fn resume(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
    ) -> Result<(), StepError> {
        if !self.field.gave(q, p) {
            return self.begin(system, t, q, p);
        }
        self.end_known = false;
        self.field.load(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        _: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.start_rate(system, t);
        self.end_known = false;
        if self.history.len() > 1 && (h - self.spacing).abs() > self.spacing.abs() * Y::Scalar::constant(SAME) {
            self.history.keep(1);
        }
        if self.history.len() < K {
            let (equation, start) = ((&mut self.field, system), self.history.rate(0));
            self.start.step(equation, (t, h), K, start, &mut self.delta);
            return Ok(0.0);
        }
        self.history.combine(&self.predictor[..=K], &self.end, &mut self.delta);
        self.delta.scale(h);
        if CORRECT {
            self.field.rates(system, t + h, &self.delta, &mut self.end);
            self.history.combine(&self.corrector[..K], &self.end, &mut self.delta);
            self.delta.scale(h);
        }
        Ok(0.0)
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
        self.moved(system, h);
        Ok(())
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.end_rate(system, t, h);
        hermite(h, theta, &self.delta, [self.history.rate(0), &self.end], out);
    }

    fn statistics(&self) -> Statistics {
        Statistics { steps: self.steps, evaluations: self.field.evaluations(), ..Statistics::default() }
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
        self.accept(system, t, h)?;
        self.field.store(system, q, p);
        Ok(())
    }
}
