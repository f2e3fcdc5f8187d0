//! Adams methods with fixed steps.

use super::history::History;
use super::start::Extrapolation;
use super::weights::{equal_steps, NODES};
use crate::constant::Constant;
use crate::integrate::chart::Point;
use crate::integrate::integrator::{Attempt, FromSystem, Integrator, Scheme};
use crate::integrate::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// The explicit Adams method of order `K`: one evaluation of the rates per step (C.19).
pub type AdamsBashforth<Y, const K: usize> = Integrator<Y, Adams<Y, K, false>>;
/// The explicit method of order `K` predicts, the implicit one of the same order corrects once: two evaluations of the
/// rates a step, at the prediction and at the corrected point (C.20).
pub type AdamsMoulton<Y, const K: usize> = Integrator<Y, Adams<Y, K, true>>;

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

/// Steps whose relative difference is smaller than this count as equal; the last step before an end differs by rounding
/// of the time.
const SAME: f64 = 1e-6;

/// An Adams method of order `K`, 1 to 12, with fixed steps; with `CORRECT` a predictor and a corrector.
///
/// The first `K − 1` steps extrapolate the midpoint rule to order `K` or one more, with `⌈K/2⌉²` evaluations and the
/// one at the start; so do those after a change of the step, and [`Stepper::step`](crate::integrate::Stepper::step)
/// after a state that is not the one it gave. A jump of the joint forces reduces the order for `K` steps; call
/// [`Stepper::begin`](crate::integrate::Stepper::begin) where this matters.
#[derive(Clone, Debug)]
pub struct Adams<Y: System, const K: usize, const CORRECT: bool> {
    history: History<Y, K>,
    /// Weights of the past rates, one unused before them.
    predictor: [Y::Scalar; NODES],
    /// Weight of the new rate, then of the past ones.
    corrector: [Y::Scalar; NODES],
    /// Between the rates of the history, s.
    spacing: Y::Scalar,
    start: Extrapolation<Y>,
}

impl<Y: System, const K: usize, const CORRECT: bool> Adams<Y, K, CORRECT> {
    const ORDER: u32 = {
        assert!(K >= 1 && K <= 12, "Adams methods have orders 1 to 12 here");
        K as u32
    };
    const PREDICTOR: [Constant; NODES] = equal_steps(K, true);
    const CORRECTOR: [Constant; NODES] = equal_steps(K, false);
}

impl<Y, const K: usize, const CORRECT: bool> FromSystem<Y> for Adams<Y, K, CORRECT>
where
    Y: System,
    Y::Scalar: Real,
{
    // Large: a call writes it in its place, where inlined code would copy it there.
    #[inline(never)]
    fn new(system: &Y) -> Self {
        Adams {
            history: History::new(system),
            predictor: Self::PREDICTOR.map(Constant::get),
            corrector: Self::CORRECTOR.map(Constant::get),
            spacing: Y::Scalar::zero(),
            start: Extrapolation::new(system),
        }
    }
}

impl<Y, const K: usize, const CORRECT: bool> Scheme<Y> for Adams<Y, K, CORRECT>
where
    Y: System,
    Y::Scalar: Real,
{
    const MULTISTEP: bool = true;

    fn order(&self) -> u32 {
        Self::ORDER
    }

    fn begin(&mut self) {
        self.history.keep(0);
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        _scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.start_rate(step, system, t);
        let history = &mut self.history;
        if history.len() > 1 && (h - self.spacing).abs() > self.spacing.abs() * Y::Scalar::constant(SAME) {
            history.keep(1);
        }
        if history.len() < K {
            self.start.step((&mut step.field, system), (t, h), K, history.rate(0), &mut step.delta);
            return Ok(0.0);
        }
        history.predict(step, h, &self.predictor[1..=K]);
        if CORRECT {
            history.correct(step, system, t, h, &self.corrector[..K]);
        }
        Ok(0.0)
    }

    fn start(&mut self) -> &mut Point<Y> {
        self.history.newest()
    }

    fn start_rate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar) {
        self.history.start_rate(step, system, t);
    }

    fn accepted(&mut self, step: &mut Attempt<Y>, system: &Y, h: Y::Scalar) -> bool {
        self.spacing = h;
        self.history.accepted(step, system, h)
    }
}
