//! How far out the mass matrix carries screws.

use super::Plan;
use crate::options::Options;
use crate::output::Output;
use crate::trace::trace;

/// Trees beyond this are not searched.
const LARGEST: usize = 60;

/// Sets [`Plan::matrix_depth`] to the depth with the fewest operations; the search ends where they grow twice.
pub fn choose(plan: &mut Plan) {
    if plan.nodes.len() > LARGEST {
        return;
    }
    let cost = |plan: &Plan| {
        let program = trace(plan, Output::MassMatrix, &Options::default());
        program.map_or(usize::MAX, |g| g.program.counts().total())
    };
    let mut candidate = plan.clone();
    let (mut best, mut worse) = (cost(plan), 0);
    while worse < 2 && candidate.matrix_depth < plan.nodes.len() {
        candidate.matrix_depth += 1;
        let operations = cost(&candidate);
        if operations < best {
            best = operations;
            plan.matrix_depth = candidate.matrix_depth;
            worse = 0;
        } else {
            worse += 1;
        }
    }
}
