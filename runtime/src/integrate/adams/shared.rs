//! What Adams methods share: the state, the past rates, the two parts of a step.

use super::history::History;
use crate::integrate::chart::Point;
use crate::integrate::field::Field;
use crate::integrate::stepper::Statistics;
use crate::integrate::StepError;
use crate::system::{Real, System};

/// A method's state with the last `N` rates.
#[derive(Clone, Debug)]
pub(super) struct Core<Y: System, const N: usize> {
    pub field: Field<Y>,
    pub history: History<Y, N>,
    /// The newest rate of the history is that at the start.
    start_known: bool,
    pub delta: Point<Y>,
    /// Rate at the prediction, or at the end if that is known.
    pub end: Point<Y>,
    end_known: bool,
    steps: u64,
}

impl<Y, const N: usize> Core<Y, N>
where
    Y: System,
    Y::Scalar: Real,
{
    pub fn new(system: &Y, compensated: bool) -> Self {
        Core {
            field: Field::new(system, compensated),
            history: History::new(system),
            start_known: false,
            delta: Point::zero(system),
            end: Point::zero(system),
            end_known: false,
            steps: 0,
        }
    }

    pub fn begin(&mut self, system: &Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        self.history.keep(0);
        (self.start_known, self.end_known) = (false, false);
        self.field.load(system, t, q, p)
    }

    pub fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        if !self.start_known {
            self.end.clear();
            let rate = self.history.push(None);
            self.field.rates(system, t, &self.end, rate);
            (self.start_known, self.end_known) = (true, false);
        }
        self.history.rate(0)
    }

    /// The start of an attempt.
    pub fn attempt(&mut self, system: &mut Y, t: Y::Scalar) {
        self.start_rate(system, t);
        self.end_known = false;
    }

    /// The explicit method: a displacement from past rates.
    pub fn predict(&mut self, h: Y::Scalar, weights: &[Y::Scalar]) {
        self.history.combine(weights, &self.end, &mut self.delta);
        self.delta.scale(h);
    }

    /// The implicit one, with the rate at the prediction.
    pub fn correct(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, weights: &[Y::Scalar]) {
        self.field.rates(system, t + h, &self.delta, &mut self.end);
        self.predict(h, weights);
    }

    pub fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        if !self.end_known {
            self.field.rates(system, t + h, &self.delta, &mut self.end);
            self.end_known = true;
        }
        &self.end
    }

    /// Moves to the end of the attempt. The rate there is evaluated when the next one begins, if it is not known.
    pub fn accept(&mut self, system: &Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        self.field.advance(system, t, &self.delta)?;
        if self.end_known {
            self.history.push(Some((&self.delta, h))).copy_from(&self.end);
        }
        (self.start_known, self.end_known) = (self.end_known, false);
        self.history.follow(system, &self.delta, h);
        self.steps += 1;
        Ok(())
    }

    pub fn corrected(&mut self) {
        self.end_known = false;
    }

    pub fn statistics(&self) -> Statistics {
        Statistics { steps: self.steps, evaluations: self.field.evaluations(), ..Statistics::default() }
    }
}

/// The methods of a [`Stepper`](crate::integrate::Stepper) that a [`Core`] in the field `core` has.
macro_rules! of_core {
    () => {
        fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
            (&mut self.core.field, &mut self.core.delta)
        }

        fn resume(
            &mut self,
            system: &mut Y,
            t: Y::Scalar,
            q: &Y::Coordinates,
            p: &Y::Momenta,
        ) -> Result<(), StepError> {
            match self.core.field.holds(q, p) {
                true => self.core.field.load(system, t, q, p),
                false => self.begin(system, t, q, p),
            }
        }

        fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
            self.core.start_rate(system, t)
        }

        fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
            self.core.end_rate(system, t, h)
        }

        fn corrected(&mut self) {
            self.core.corrected();
        }

        fn remembers(&self) -> bool {
            true
        }

        fn statistics(&self) -> Statistics {
            self.core.statistics()
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
            self.core.field.store(system, q, p);
            Ok(())
        }
    };
}
pub(super) use of_core;
