//! The search for the fastest elimination. It stands above tracing and rolled code: it builds candidate plans, makes their
//! programs, and keeps the plan whose programs the cost model likes best.
//!
//! With one joint at a time, every reduced inertia `M'` is full. Where several freedoms are eliminated together, the inertia of
//! the outer bodies stays that of a rigid body as it is carried inward (three zeros in four after regrouping) and each joint adds
//! a column; such a block is solved at its innermost joint. On a chain from the ground, the inner joints can also send their
//! screws outward to meet those columns half-way. A joint can be eliminated before its own motion, where nothing divided waits
//! for its turn. Momentum rates come from quadratic forms or from accumulated momenta. Frames between parallel joints need not
//! rotate. What is best depends on the zeros of the model, so the candidates are generated and counted, branch by branch, and one
//! is refused if its rounding errors are much larger than those of one joint at a time.

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
use crate::options::{EliminationStrategy, PlanOptions};
use crate::plan::Plan;

pub use chain::Candidate;
pub use wide::Wide;

/// Trees with more nodes than this are not searched: counting a candidate means to generate it.
const LARGEST: usize = 150;

/// A plan and what was tried on the way to it.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The plan with its eliminations chosen.
    pub plan: Plan,
    /// Eliminations that were tried, branch by branch.
    pub candidates: Vec<Candidate>,
}

/// Chooses what is eliminated where in a plan that eliminates one joint at a time, and which runs of links are laid out for
/// rolled code. [`PlanOptions::snap`] has no part in it.
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
    Chosen { plan, candidates }
}

/// The plan of a model, with its eliminations chosen.
pub fn plan(model: &Model, options: PlanOptions) -> Plan {
    best(Plan::new(model, options.snap), options).plan
}
