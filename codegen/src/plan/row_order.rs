//! The order in which the rows of the constraints are eliminated ([`mbd_runtime::tree::row_order`]): it is chosen at the
//! start and near it when the plan is made.

use mbd_runtime::integrate::Chart;
use mbd_runtime::tree::row_order::{order_rows, reorder_rows, row_of, RowLists, RowProducts, FEWEST};
use mbd_runtime::tree::Elimination;
use mbd_runtime::Interpreter;

use super::structure::{Plan, RowsThatAct};

/// A row is taken in the order of the description if its relative pivot is at least this part of the largest one.
const LARGE: f64 = 0.1;
/// Displacements of the positions beside the start at which pivots are computed, rad and m.
const DISPLACEMENTS: [f64; 2] = [0.3, 0.05];

impl RowLists for Plan {
    fn nodes(&self) -> usize {
        self.nodes.len()
    }
    fn parent(&self, node: usize) -> Option<usize> {
        self.nodes[node].parent
    }
    fn elimination(&mut self, node: usize) -> &mut Elimination {
        &mut self.nodes[node].elimination
    }
    fn ground(&mut self) -> &mut Vec<usize> {
        &mut self.solve_at_ground
    }
    fn row(&self, unknown: usize) -> Option<usize> {
        row_of(self.unknowns[unknown])
    }
    fn may_wait(&self) -> bool {
        !self.nodes.iter().any(|node| node.rolled)
    }
}

/// Orders the rows of a plan that is being made.
pub(super) fn order(plan: &mut Plan) {
    // Most models have no rows at all.
    if plan.dims.rows >= FEWEST {
        order_rows(plan, products(plan), LARGE);
    }
}

impl Plan {
    /// [`mbd_runtime::tree::Tree::reorder_rows`]; a plan of whose rows some act keeps its order.
    pub fn reorder_rows(&mut self, at: &RowProducts) -> bool {
        if !matches!(self.acts, RowsThatAct::All) {
            return false;
        }
        let own = reorder_rows(self, at);
        let other = self.accelerations.as_deref_mut().is_some_and(|other| other.reorder_rows(at));
        own || other
    }
}

/// At the start and at positions beside it, which need not be closed.
fn products(plan: &Plan) -> Vec<RowProducts> {
    let params = plan.default_params();
    let mut interpreter = Interpreter::new(plan.tree(&params), [0.0; 3]);
    let start = plan.start();
    let moved = DISPLACEMENTS.iter().map(|size| {
        let mut q = start.clone();
        // Irrational steps, so that no symmetry is met.
        let mut dx = (0..plan.dims.nv).map(|k| size * libm::sin(1.0 + 2.0_f64.sqrt() * k as f64)).collect();
        Chart::displace(&interpreter, &mut dx, &mut q);
        q
    });
    let positions: Vec<Vec<f64>> = moved.chain([start.clone()]).collect();
    positions.iter().map(|q| RowProducts::new(&mut interpreter, q)).collect()
}
