//! Frames of parallel revolute joints, which need not rotate.

use super::objective::Objective;
use crate::options::EliminationStrategy;
use crate::plan::{touches_rolled, Plan};

/// Lets the frames of every run of parallel joints rotate or not, whichever costs less, if that is accurate; `single` has one
/// joint at a time.
pub fn toggle(plan: &mut Plan, single: &Plan, runs: &[Vec<usize>], objective: Objective) {
    for run in runs {
        if objective.strategy == EliminationStrategy::Fastest && touches_rolled(plan, run) {
            continue;
        }
        let (mut branch, numbers) = plan.branch(run[0]);
        let score = objective.score(&branch);
        run.iter().filter_map(|&i| numbers[i]).for_each(|i| branch.nodes[i].elimination.non_rotating ^= true);
        if objective.score(&branch) < score && objective.accepts(&branch, &single.branch(run[0]).0) {
            run.iter().for_each(|&i| plan.nodes[i].elimination.non_rotating ^= true);
        }
    }
}
