//! Choice of the runs of links for rolled code.

use super::evaluation::Evaluation;
use super::LARGEST;
use crate::options::{EliminationStrategy, LikeBranches, PlanOptions, RolledCode};
use crate::output::Output;
use crate::plan::{is_single_but_for_rows, unbranched_paths, Plan};
use crate::rolled::{has_like_branches, runs_with_side_branches};

/// Chains from this length on are rolled without a search if their straight-line code is long, because it is then much
/// slower.
const ALWAYS: usize = 24;

/// Size of long code, bytes: more than a first-level cache has.
const LONG: f64 = 49152.0;

/// The length from which chains are rolled whose elimination is not searched for speed.
const ALWAYS_OTHERWISE: usize = 16;

/// Marks the runs that may become rolled code: all runs, or those that are long enough to be faster in any case. The
/// search of a chain marks more.
pub fn lay_out(plan: &mut Plan, options: PlanOptions) {
    let fastest = options.elimination == EliminationStrategy::Fastest;
    let least = match (options.rolled, fastest) {
        (RolledCode::Never, _) => return,
        (RolledCode::Always, true) => 3,
        (RolledCode::Always, false) => 1,
        (RolledCode::Auto, true) => ALWAYS,
        (RolledCode::Auto, false) => ALWAYS_OTHERWISE,
    };
    let by_size = (options.rolled, fastest) == (RolledCode::Auto, true) && plan.nodes.len() <= LARGEST;
    let mut long = unbranched_paths(plan, least);
    let with_branches = runs_with_side_branches(plan, least);
    // In trees that are not too large for it, computing like branches together is faster.
    let together = |plan: &Plan| by_size && options.branches != LikeBranches::Apart && has_like_branches(plan);
    if !with_branches.is_empty() && !together(plan) {
        long.extend(with_branches.into_iter().map(Vec::from_iter));
    }
    if by_size {
        let bytes = |path: &[usize]| Evaluation::new(&plan.branch(path[0]).0, Output::Rates).map(|e| e.cost.bytes);
        long.retain(|path| bytes(path).is_none_or(|bytes| bytes > LONG));
    }
    for i in long.concat() {
        plan.nodes[i].rolled = true;
        plan.nodes[i].elimination.before_joint = fastest && is_single_but_for_rows(plan, i);
    }
}
