//! Non-rotating frames for runs of parallel revolute joints.

use super::objective::Objective;
use crate::options::EliminationStrategy;
use crate::plan::{touches_rolled, Plan};

/// Chooses rotating or non-rotating frames for every run of parallel joints, whichever costs less, if that is accurate.
/// `single` is the plan with one joint at a time.
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
