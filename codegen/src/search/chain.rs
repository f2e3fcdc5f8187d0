//! The search for the elimination of one chain: it starts from a few candidates and moves to better neighbours.

use super::evaluation::{self, Evaluation};
use super::objective::Objective;
use super::rounding::ErrorEstimator;
use crate::options::{Arithmetic, Options};
use crate::plan::{ChainElimination, Plan};
use crate::rolled;
use crate::symbolic::Cost;

/// The longest block that is tried. With longer blocks, the columns cost more than they save, and the rounding errors
/// grow.
const LONGEST: usize = 10;

/// The shortest chain that is tried as rolled code.
const TRIED_AS_ROLLED: usize = 8;

/// An elimination that was tried for a branch.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// First and last node of the branch.
    pub branch: [usize; 2],
    /// Number of nodes of the branch and its ancestors.
    pub nodes: usize,
    /// Description of the elimination.
    pub form: String,
    /// Cost of the rates of the branch and its ancestors, without joint forces.
    pub cost: Cost,
    /// Rounding error relative to that of one joint at a time, for the array and the statistic (mean, median, worst
    /// states) in which it is largest. It is measured if the elimination costs less than those before.
    pub loss: Option<f64>,
    /// Whether the elimination was refused for its rounding errors.
    pub refused: bool,
    /// Whether it was chosen.
    pub taken: bool,
}

/// The search for the elimination of one chain.
pub struct ChainSearch<'a> {
    plan: &'a Plan,
    chain: &'a [usize],
    objective: Objective,
    estimator: ErrorEstimator,
    best: f64,
    /// The best elimination so far.
    pub chosen: Option<ChainElimination>,
    /// All candidates, in order.
    pub tried: Vec<Candidate>,
    /// All straight-line eliminations so far, with the operations that lead to velocities.
    pub seen: Vec<(usize, ChainElimination)>,
}

impl<'a> ChainSearch<'a> {
    /// A search without candidates. `plan` eliminates the chain one joint at a time.
    pub fn new(plan: &'a Plan, chain: &'a [usize], objective: Objective) -> ChainSearch<'a> {
        let estimator = ErrorEstimator::new(plan, objective.output);
        let (best, tried, seen) = (f64::INFINITY, Vec::new(), Vec::new());
        ChainSearch { plan, chain, objective, estimator, best, chosen: None, tried, seen }
    }

    /// Tries the eliminations `first` (by default those that span the space), then neighbours of the best until none is
    /// better, and last rolled code if `as_rolled`.
    pub fn run(&mut self, first: Option<Vec<ChainElimination>>, as_rolled: bool) {
        let len = self.chain.len();
        let from_ground = self.plan.nodes[self.chain[0]].parent.is_none();
        for elimination in first.unwrap_or_else(|| first_eliminations(len, from_ground)) {
            self.consider(elimination);
        }
        while self.neighbours(from_ground) {}
        if as_rolled && len >= TRIED_AS_ROLLED {
            self.consider(ChainElimination::rolled(len));
        }
    }

    /// Tries an elimination, and keeps it if it costs less than all before and is accurate.
    fn consider(&mut self, elimination: ChainElimination) -> bool {
        let mut candidate = self.plan.clone();
        elimination.apply(&mut candidate, self.chain);
        let output = self.objective.output;
        let Some(mut evaluation) = Evaluation::new(&candidate, output) else { return false };
        if elimination.rolled {
            let options = Options { arithmetic: Arithmetic::Fast, ..evaluation::options(output) };
            let Some(cost) = rolled::cost(&candidate, output, &options) else { return false };
            evaluation.cost = cost;
        }
        // Accumulated momenta affect the rates only.
        let seen = (evaluation.velocity_operations(), ChainElimination { accumulating: 0, ..elimination.clone() });
        if !elimination.rolled && !self.seen.contains(&seen) {
            self.seen.push(seen);
        }
        let score = self.objective.of_cost(&evaluation.cost);
        let loss = (score < self.best).then(|| self.estimator.loss(&evaluation.program));
        let refused = loss.is_some_and(|loss| loss > self.objective.limit());
        let taken = loss.is_some() && !refused;
        if taken {
            self.best = score;
            self.tried.iter_mut().for_each(|c| c.taken = false);
        }
        self.tried.push(Candidate {
            branch: [self.chain[0], self.chain[self.chain.len() - 1]],
            nodes: self.plan.nodes.len(),
            form: elimination.words(self.chain.len()),
            cost: evaluation.cost,
            loss,
            refused,
            taken,
        });
        if taken {
            self.chosen = Some(elimination);
        }
        taken
    }

    /// Tries eliminations that differ slightly from the best. Returns whether one of them is better.
    fn neighbours(&mut self, from_ground: bool) -> bool {
        let Some(best) = self.chosen.clone() else { return false };
        let len = self.chain.len();
        let mut near = Vec::new();
        if best.accumulating < len {
            near.push(ChainElimination { accumulating: best.accumulating + 1, ..best.clone() });
        }
        if from_ground && best.split < best.base {
            let split = best.split + 1;
            near.push(ChainElimination { split, accumulating: best.accumulating.max(split), ..best.clone() });
        }
        for k in 0..len.min(LONGEST) {
            let mut before_joint = best.before_joint.clone();
            before_joint[len - 1 - k] ^= true;
            near.push(ChainElimination { before_joint, ..best.clone() });
        }
        // All neighbours are tried, even after one that is better.
        near.into_iter().filter(|elimination| self.consider(elimination.clone())).count() > 0
    }
}

/// The eliminations with which the search starts.
fn first_eliminations(len: usize, from_ground: bool) -> Vec<ChainElimination> {
    let mut all = Vec::new();
    let mut add = |split: usize, base: usize, from: usize, accumulating: usize| {
        let before_joint = (0..len).map(|k| k >= from).collect();
        let elimination = ChainElimination { split, base, before_joint, accumulating, rolled: false };
        if !all.contains(&elimination) {
            all.push(elimination);
        }
    };
    for base in (0..len).filter(|base| len - base <= LONGEST) {
        for from in [0, base, len] {
            add(0, base, from, 0);
            if from_ground && base > 0 && base <= LONGEST {
                add(base, base, from, base);
            }
        }
    }
    for split in (1..len.min(LONGEST)).filter(|_| from_ground) {
        for accumulating in [split, len] {
            add(split, len - 1, 0, accumulating);
        }
    }
    all
}
