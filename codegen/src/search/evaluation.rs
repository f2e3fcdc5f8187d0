//! One output of a candidate plan, as the sweeps compute it, and its cost.

use mbd_runtime::sweep::Quantity;

use crate::options::{Arithmetic, EliminationStrategy, Options, PlanOptions};
use crate::output::Output;
use crate::plan::Plan;
use crate::symbolic::{self, passes, Cost, Label, Program};
use crate::trace::{rewrite, trace};

/// The options with which candidates are compared. They have no joint forces, which cost one addition each with every
/// elimination.
pub fn options(output: Output) -> Options {
    Options { efforts: output != Output::Rates, arithmetic: Arithmetic::Exact, ..Options::default() }
}

/// The program of one output and its cost.
pub struct Evaluation {
    /// The operations of the sweeps, not rewritten.
    pub program: Program,
    /// Their cost.
    pub cost: Cost,
}

impl Evaluation {
    /// Traces one output of a plan; `None` if the model does not have it.
    pub fn new(plan: &Plan, output: Output) -> Option<Evaluation> {
        let program = trace(plan, output, &options(output)).ok()?.program;
        Some(Evaluation { cost: symbolic::cost(&program), program })
    }

    /// Number of operations of the velocities.
    pub fn velocity_operations(&self) -> usize {
        velocity_operations(&self.program)
    }

    /// The operations of the program as it is rewritten under a strategy.
    pub fn written(&self, elimination: EliminationStrategy) -> Written {
        let plan = PlanOptions { elimination, ..PlanOptions::default() };
        let program = passes::operations(self.program.clone(), rewrite(&Options { plan, ..Options::default() }));
        Written { all: program.counts().total(), velocities: velocity_operations(&program) }
    }
}

/// Numbers of operations of a rewritten program.
pub struct Written {
    all: usize,
    velocities: usize,
}

impl Written {
    /// Whether none of the numbers is larger than the other.
    pub fn within(&self, other: &Written) -> bool {
        self.all <= other.all && self.velocities <= other.velocities
    }
}

fn velocity_operations(program: &Program) -> usize {
    use Quantity::{BiasMomentum, Inertia, Pivot, Velocity};
    let velocities = |(_, what): &Label| matches!(what, Inertia | Pivot | BiasMomentum | Velocity);
    program.counts_where(velocities).total()
}
