//! Builds from a model the structure on which the sweeps run: elementary joints, merged bodies, chosen body frames,
//! unknowns of several joints. A plan is built without tracing or counting anything; [`Plan::tree`] turns its numbers
//! into any scalar.

mod branch;
mod build;
mod chain;
mod constraints;
mod early;
mod elements;
mod frames;
mod instantiate;
mod paths;
mod placement;
mod ranges;
mod rigid;
mod row_order;
mod shared;
pub mod state_layout;
mod structure;

pub use chain::ChainElimination;
pub use paths::{chains, has_rows, parallel_runs};
pub(crate) use paths::{is_single_but_for_rows, touches_rolled, unbranched_paths};
pub use rigid::Rigid;
pub use structure::{JointAxis, Plan, PlanBond, PlanConstraint, PlanFrame, PlanNode, PoseStep, RowsThatAct, Slot};
