//! The search for the fastest elimination. It uses tracing and rolled code: it builds candidate plans, makes their
//! programs, and keeps the plan with the smallest estimated cost.
//!
//! With one joint at a time, every reduced inertia `M'` is full. Where several freedoms are eliminated together, the
//! inertia of the outer bodies stays that of a rigid body as it is carried inward (three zeros in four after
//! regrouping) and each joint adds a column; such a block is solved at its innermost joint. On a chain from the ground,
//! the inner joints can also send their screws outward to meet those columns half-way. A joint can be eliminated before
//! its own motion, so that the division does not wait for its rotation. Momentum rates come from quadratic forms or
//! from accumulated momenta. Frames between parallel joints need not rotate. The best choice depends on the zeros of
//! the model. Candidates are therefore generated and counted, chain by chain from the tips to the root, and a candidate is
//! refused if its rounding errors are much larger than those of one joint at a time.

mod branches;
mod chain;
mod cycles;
mod evaluation;
mod frames;
mod idle_rows;
mod mass_matrix;
mod objective;
mod rolled_runs;
mod rounding;
mod wide;

use crate::model::Model;
use crate::options::{EliminationStrategy, PlanOptions, RowElimination};
use crate::plan::Plan;

pub use chain::Candidate;
pub use wide::Wide;

/// Largest number of nodes of a tree that is searched, because counting a candidate means generating it.
const LARGEST: usize = 150;

/// A plan and the candidates of its search.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The plan with its eliminations chosen.
    pub plan: Plan,
    /// Eliminations that were tried, branch by branch.
    pub candidates: Vec<Candidate>,
}

/// Chooses the eliminations of a plan that eliminates one joint at a time, and the runs of links for rolled code.
/// [`PlanOptions::snap`] is not used.
pub fn best(mut plan: Plan, options: PlanOptions) -> Chosen {
    idle_rows::close(&mut plan);
    rolled_runs::lay_out(&mut plan, options);
    let mut candidates = Vec::new();
    if options.elimination != EliminationStrategy::Single {
        candidates = branches::choose(&mut plan, options);
        if options.mass_matrix {
            mass_matrix::choose(&mut plan);
        }
    }
    if options.rows == RowElimination::Passes {
        plan.eliminate_rows_in_passes();
    }
    Chosen { plan, candidates }
}

/// The plan of a model, with its eliminations chosen.
pub fn plan(model: &Model, options: PlanOptions) -> Plan {
    best(Plan::new(model, options.snap), options).plan
}
