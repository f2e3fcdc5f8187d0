//! The depth to which the mass matrix carries screws outward.

use super::evaluation;
use crate::options::Options;
use crate::output::Output;
use crate::plan::Plan;
use crate::symbolic::passes;
use crate::trace::{rewrite, trace};

/// Largest number of nodes of a tree that is searched.
const LARGEST: usize = 60;

/// Sets [`Plan::matrix_depth`] to the depth with the fewest operations. The search ends when the number of operations
/// has grown twice.
pub fn choose(plan: &mut Plan) {
    if plan.nodes.len() > LARGEST {
        return;
    }
    let cost = |plan: &Plan| {
        let traced = trace(plan, Output::MassMatrix, &evaluation::options(Output::MassMatrix));
        let written = traced.map(|traced| passes::operations(traced.program, rewrite(&Options::default())));
        written.map_or(usize::MAX, |program| program.counts().total())
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
