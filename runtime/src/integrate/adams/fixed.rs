//! Adams methods with steps of one size.

use super::shared::{of_core, Core};
use super::start::Extrapolation;
use super::weights::{equal_steps, NODES};
use crate::integrate::chart::Point;
use crate::integrate::constant::Constant;
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
/// Adams-Bashforth-Moulton of order 12: two evaluations a step. Only for slow motion: it is stable for small steps alone.
pub type Abm12<Y> = AdamsMoulton<Y, 12>;

/// Steps whose sizes differ by a smaller part count as equal: the last one before an end differs by rounding of the time.
const SAME: f64 = 1e-6;

/// An Adams method of order `K`, 1 to 12, with steps of one size; with `CORRECT` a predictor and a corrector.
///
/// The first `K − 1` steps extrapolate the midpoint rule to order `K` or one more, with `⌈K/2⌉²` evaluations and the one at
/// the start; so do those after a change of the step, and [`Stepper::step`] after a state that is not the one it gave. A jump
/// of the joint forces spoils the order for `K` steps: call [`Stepper::begin`] where it matters.
#[derive(Clone, Debug)]
pub struct Adams<Y: System, const K: usize, const CORRECT: bool> {
    core: Core<Y, K>,
    /// Weights of the past rates, one unused before them.
    predictor: [Y::Scalar; NODES],
    /// Weight of the new rate, then of the past ones.
    corrector: [Y::Scalar; NODES],
    /// Between the rates of the history, s.
    spacing: Y::Scalar,
    start: Extrapolation<Y>,
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
    const PREDICTOR: [Constant; NODES] = equal_steps(K, true);
    const CORRECTOR: [Constant; NODES] = equal_steps(K, false);

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
        Adams {
            core: Core::new(system, compensated),
            predictor: Self::PREDICTOR.map(Constant::get),
            corrector: Self::CORRECTOR.map(Constant::get),
            spacing: Y::Scalar::zero(),
            start: Extrapolation::new(system),
        }
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

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        self.core.begin(system, t, q, p)
    }

    fn attempt(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, _: Option<&Point<Y>>) -> Result<f64, StepError> {
        self.core.attempt(system, t);
        let Core { field, history, delta, .. } = &mut self.core;
        if history.len() > 1 && (h - self.spacing).abs() > self.spacing.abs() * Y::Scalar::constant(SAME) {
            history.keep(1);
        }
        if history.len() < K {
            self.start.step((field, system), (t, h), K, history.rate(0), delta);
            return Ok(0.0);
        }
        self.core.predict(h, &self.predictor[..=K]);
        if CORRECT {
            self.core.correct(system, t, h, &self.corrector[..K]);
        }
        Ok(0.0)
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        self.spacing = h;
        self.core.accept(system, t, h)
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.core.end_rate(system, t, h);
        let Core { history, delta, end, .. } = &self.core;
        hermite(h, theta, delta, [history.rate(0), end], out);
    }

    of_core!();
}
