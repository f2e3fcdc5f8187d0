//! The search for the elimination of one chain: it starts from a few candidates and moves to better neighbours.

use super::evaluation::{self, Evaluation, Written};
use super::objective::Objective;
use super::rounding::ErrorEstimator;
use crate::options::{Arithmetic, Options};
use crate::plan::{has_rows, ChainElimination, Plan};
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

/// A chain in the part of a mechanism that consists of it, its ancestors and what is beyond it.
#[derive(Clone)]
pub struct ChainInPart {
    /// The part, with one joint at a time.
    pub single: Plan,
    /// Nodes of the chain in the part, inner joint first.
    pub chain: Vec<usize>,
    /// Whether there is anything beyond the chain.
    pub inner: bool,
}

impl ChainInPart {
    fn parent(&self) -> Option<usize> {
        self.single.nodes[self.chain[0]].parent
    }
}

/// The search for the elimination of one chain.
pub struct ChainSearch<'a> {
    part: &'a ChainInPart,
    /// The part with the chains beyond eliminated, but not this one.
    plan: Plan,
    objective: Objective,
    estimator: ErrorEstimator,
    best: f64,
    /// The best program of the chain by itself, and its [`Written`] operations where they have been needed. Those of
    /// other eliminations must not be more: what a shorter path of one branch saves in time, other branches hide.
    alone: Option<(Evaluation, Option<Written>)>,
    /// The best elimination so far.
    pub chosen: Option<ChainElimination>,
    /// The best elimination whose columns pass to the parent, and its score.
    pub passing: Option<(f64, ChainElimination)>,
    /// All candidates, in order.
    pub tried: Vec<Candidate>,
    /// All straight-line eliminations so far, with the operations that lead to velocities.
    pub seen: Vec<(usize, ChainElimination)>,
}

impl<'a> ChainSearch<'a> {
    /// A search without candidates. `plan` is the part with the chains beyond eliminated, but not this one.
    pub fn new(part: &'a ChainInPart, plan: Plan, objective: Objective) -> ChainSearch<'a> {
        let estimator = ErrorEstimator::new(&part.single, objective.output);
        let (best, alone, tried, seen) = (f64::INFINITY, None, Vec::new(), Vec::new());
        ChainSearch { part, plan, objective, estimator, best, alone, chosen: None, passing: None, tried, seen }
    }

    /// Goes on with other eliminations of the chains beyond. Returns whether one of the eliminations `tried` is better
    /// than the best so far; if not, the plan is as before.
    pub fn with_beyond(&mut self, plan: Plan, tried: Vec<ChainElimination>) -> bool {
        let before = std::mem::replace(&mut self.plan, plan);
        // All are tried, even after one that is better.
        let better = tried.into_iter().filter(|elimination| self.consider(elimination.clone())).count() > 0;
        if !better {
            self.plan = before;
        }
        better
    }

    /// Tries the eliminations `first` (by default those that span the space), then neighbours of the best until none is
    /// better, and last rolled code if `as_rolled`.
    pub fn run(&mut self, first: Option<Vec<ChainElimination>>, as_rolled: bool) {
        let len = self.part.chain.len();
        let mut first = first.unwrap_or_else(|| self.first());
        // What the others are compared with comes first.
        first.sort_by_key(|elimination| elimination.passes);
        if self.part.inner || first.first().is_none_or(|elimination| elimination.passes) {
            self.consider(ChainElimination::single(len));
        }
        for elimination in first {
            self.consider(elimination);
        }
        while self.neighbours() {}
        if as_rolled && !self.part.inner && len >= TRIED_AS_ROLLED {
            self.consider(ChainElimination::rolled(len));
        }
    }

    /// The eliminations with which the search starts.
    fn first(&self) -> Vec<ChainElimination> {
        let len = self.part.chain.len();
        let mut all = first_eliminations(len, self.part.parent().is_none());
        if self.part.parent().is_some_and(|p| !has_rows(&self.part.single, p)) {
            all.extend([true, false].map(|before| ChainElimination::passing(len, before)));
        }
        all
    }

    /// The best elimination and those that solve all columns at one node further inward, for columns that arrive.
    pub fn with_more_columns(&self) -> Vec<ChainElimination> {
        let len = self.part.chain.len();
        let best = self.chosen.clone().unwrap_or_else(|| ChainElimination::single(len));
        let mut all = vec![best.clone()];
        if best.split == 0 && !best.passes && !best.rolled {
            all.extend(best.base.checked_sub(1).map(|base| ChainElimination { base, ..best.clone() }));
            all.extend(self.passing.iter().map(|(_, passing)| passing.clone()));
        }
        all
    }

    /// Tries an elimination, and keeps it if it costs less than all before and is accurate.
    fn consider(&mut self, elimination: ChainElimination) -> bool {
        let mut candidate = self.plan.clone();
        elimination.apply(&mut candidate, &self.part.chain);
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
        if elimination.passes && self.passing.as_ref().is_none_or(|(best, _)| score < *best) {
            self.passing = Some((score, elimination.clone()));
        }
        let alone = !(elimination.passes || self.part.inner) || self.alone.is_none();
        let loss =
            (score < self.best && (alone || self.saves(&evaluation))).then(|| self.estimator.loss(&evaluation.program));
        let refused = loss.is_some_and(|loss| loss > self.objective.limit());
        let taken = loss.is_some() && !refused;
        if taken {
            self.best = score;
            self.tried.iter_mut().for_each(|c| c.taken = false);
        }
        let chain = &self.part.chain;
        self.tried.push(Candidate {
            branch: [chain[0], chain[chain.len() - 1]],
            nodes: self.plan.nodes.len(),
            form: elimination.words(chain.len()),
            cost: evaluation.cost,
            loss,
            refused,
            taken,
        });
        if taken {
            self.chosen = Some(elimination);
            if alone {
                self.alone = Some((evaluation, None));
            }
        }
        taken
    }

    /// Whether a program has no more operations than the best of the chain by itself, as they are and as they are
    /// rewritten.
    fn saves(&mut self, evaluation: &Evaluation) -> bool {
        let Some((alone, written)) = &mut self.alone else { return true };
        let as_they_are = evaluation.cost.operations <= alone.cost.operations
            && evaluation.velocity_operations() <= alone.velocity_operations();
        let strategy = self.objective.strategy;
        as_they_are && evaluation.written(strategy).within(written.get_or_insert_with(|| alone.written(strategy)))
    }

    /// Tries eliminations that differ slightly from the best. Returns whether one of them is better.
    fn neighbours(&mut self) -> bool {
        let Some(best) = self.chosen.clone() else { return false };
        let (len, from_ground) = (self.part.chain.len(), self.part.parent().is_none());
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
        let elimination = ChainElimination { split, base, passes: false, before_joint, accumulating, rolled: false };
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
