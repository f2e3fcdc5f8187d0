//! The order in which the rows of the constraints are eliminated ([`mbd_runtime::tree::row_order`]): it is chosen at the
//! start and near it when the plan is made.

use std::collections::BTreeMap;

use mbd_runtime::integrate::Chart;
use mbd_runtime::tree::row_order::{order_rows, reorder_rows, row_of, solve_late, RowLists, RowProducts, FEWEST};
use mbd_runtime::tree::{Elimination, Unknown, PASSES};
use mbd_runtime::Interpreter;

use super::early;
use super::structure::{Plan, PlanBond, RowsThatAct};

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
    fn elimination(&self, node: usize) -> &Elimination {
        &self.nodes[node].elimination
    }
    fn elimination_mut(&mut self, node: usize) -> &mut Elimination {
        &mut self.nodes[node].elimination
    }
    fn ground(&self) -> &[usize] {
        &self.solve_at_ground
    }
    fn ground_mut(&mut self) -> &mut Vec<usize> {
        &mut self.solve_at_ground
    }
    fn row(&self, unknown: usize) -> Option<usize> {
        row_of(self.unknowns[unknown])
    }
    fn binds(&self, unknown: usize, node: usize) -> bool {
        self.constraints.iter().filter(|c| c.slots.contains(&unknown)).any(|c| match &c.bond {
            PlanBond::Cut { paths, .. } => paths.iter().any(|path| path.contains(&node)),
            PlanBond::Coupling { .. } => false,
        })
    }
    fn may_wait(&self) -> bool {
        !self.nodes.iter().any(|node| node.rolled)
    }
}

/// Orders the rows of a plan that is being made.
pub(super) fn order(plan: &mut Plan) {
    // Most models have no rows at all.
    if plan.dims.rows >= FEWEST {
        if let Some(mut early) = early::with_early_rows(plan) {
            let products = products(&early);
            order_rows(&mut early, products, LARGE);
            if early::saves_operations(&early) {
                *plan = early;
                return;
            }
        }
        let products = products(plan);
        order_rows(plan, products, LARGE);
    }
}

impl Plan {
    /// [`mbd_runtime::tree::Tree::reorder_rows`]; a plan of whose rows some act keeps its order.
    pub fn reorder_rows(&mut self, at: &RowProducts) -> bool {
        let passes = self.constraints.iter().any(|c| !c.passes.is_empty());
        if passes || !matches!(self.acts, RowsThatAct::All) {
            return false;
        }
        let own = reorder_rows(self, at);
        let other = self.accelerations.as_deref_mut().is_some_and(|other| other.reorder_rows(at));
        own || other
    }
}

impl Plan {
    /// Gives the rows that are solved at the same node, where they are [`FEWEST`] or more, a place among the unknowns for
    /// each of the [passes](PASSES): those of one pass after those of the pass before it. Such an elimination does not
    /// depend on the order of the rows; rows of legs, of which a leg may be unable to follow some, are solved at the ground.
    /// Plans with rolled code stay as they are.
    pub(crate) fn eliminate_rows_in_passes(&mut self) {
        if let Some(other) = &mut self.accelerations {
            other.eliminate_rows_in_passes();
        }
        if self.nodes.iter().any(|node| node.rolled) {
            return;
        }
        solve_late(self);
        let (mut alone, mut together) = (Vec::new(), Vec::new());
        let nodes = self.nodes.iter().map(|node| &node.elimination);
        let lists = nodes.flat_map(|e| [&e.solve_before, &e.solve_after]).chain([&self.solve_at_ground]);
        for list in lists {
            let rows = list.iter().copied().filter(|&g| row_of(self.unknowns[g]).is_some());
            let enough = rows.clone().count() >= FEWEST;
            if enough { &mut together } else { &mut alone }.extend(rows);
        }
        let mut earlier = vec![BTreeMap::new(); PASSES.len()];
        for constraint in &mut self.constraints {
            let slots = &constraint.slots;
            if slots.iter().any(|g| together.contains(g)) && !slots.iter().any(|g| alone.contains(g)) {
                for places in &mut earlier {
                    let own: Vec<usize> = (0..slots.len()).map(|k| self.unknowns.len() + k).collect();
                    places.extend(slots.iter().copied().zip(own.iter().copied()));
                    constraint.passes.push(own);
                    self.unknowns.extend((constraint.first..constraint.first + slots.len()).map(Unknown::Row));
                }
            }
        }
        // Rows take their last places after those of the passes before.
        let extend = |list: &mut Vec<usize>| {
            let passes = earlier.iter().flat_map(|places| list.iter().filter_map(|g| places.get(g)));
            *list = passes.copied().chain(list.iter().copied()).collect();
        };
        for node in &mut self.nodes {
            let Elimination { open, ends, solve_before, solve_after, .. } = &mut node.elimination;
            [open, ends, solve_before, solve_after].into_iter().for_each(extend);
        }
        extend(&mut self.solve_at_ground);
    }
}

/// At the start and at positions beside it, which need not be closed.
pub(super) fn products(plan: &Plan) -> Vec<RowProducts> {
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
