//! The objective of the search, and the losses of accuracy that it accepts.

use super::evaluation::Evaluation;
use super::rounding::{ErrorEstimator, LIMIT};
use crate::options::EliminationStrategy;
use crate::output::Output;
use crate::plan::Plan;
use crate::symbolic::Cost;

/// The cost of one output under one strategy.
#[derive(Clone, Copy)]
pub struct Objective {
    /// The measure of cost.
    pub strategy: EliminationStrategy,
    /// The output whose cost it is.
    pub output: Output,
}

impl Objective {
    /// The number that the search minimises.
    pub fn of_cost(self, cost: &Cost) -> f64 {
        match self.strategy {
            EliminationStrategy::Fastest => cost.cycles(),
            EliminationStrategy::Fewest | EliminationStrategy::Single => cost.operations as f64,
        }
    }

    /// The same for a plan; infinite if the model does not have the output.
    pub fn score(self, plan: &Plan) -> f64 {
        Evaluation::new(plan, self.output).map_or(f64::INFINITY, |evaluation| self.of_cost(&evaluation.cost))
    }

    /// The largest [`ErrorEstimator::loss`] that is accepted.
    pub fn limit(self) -> f64 {
        match self.strategy {
            EliminationStrategy::Fastest => LIMIT,
            EliminationStrategy::Fewest | EliminationStrategy::Single => f64::INFINITY,
        }
    }

    /// Whether a plan is accurate; `single` is the same plan with one joint at a time.
    pub fn accepts(self, plan: &Plan, single: &Plan) -> bool {
        let limit = self.limit();
        let loss = || {
            let evaluation = Evaluation::new(plan, self.output)?;
            Some(ErrorEstimator::new(single, self.output).loss(&evaluation.program))
        };
        limit == f64::INFINITY || loss().is_some_and(|loss| loss <= limit)
    }
}
