//! Rows of constraints along which nothing can move, whatever the coordinates are: three of the five rows of a revolute
//! joint that closes a loop of parallel revolute joints. They are found by symbolic zeros.

use mbd_runtime::sweep::Sweeps;
use mbd_runtime::tree::Tree;
use mbd_runtime::workspace::Workspace;

use crate::options::Options;
use crate::output::Output;
use crate::plan::Plan;
use crate::symbolic::{Expr, Graph};
use crate::trace::SymbolicInputs;

/// Closes the columns of idle rows.
pub fn close(plan: &mut Plan) {
    if plan.constraints.is_empty() {
        return;
    }
    let graph = Graph::default();
    let given = SymbolicInputs::new(&graph, plan, Output::PositionCorrection.spec(), &Options::default());
    let tree: Tree<Expr> = plan.tree(&given.params);
    let mut w = Workspace::new(&tree);
    let [mut phi, mut pivots] = [plan.dims.rows, plan.dims.rows].map(|n| vec![Expr::Const(0.0); n]);
    let mut dq = vec![Expr::Const(0.0); plan.dims.nv];
    let sweeps = Sweeps { tree: &tree, trace: &graph };
    sweeps.position_correction(&given.q, &given.inputs(), &mut w, &mut phi, &mut dq, &mut pivots);
    let rows = plan.constraints.iter().flat_map(|c| c.slots.iter().zip(c.first..));
    let idle: Vec<usize> =
        rows.filter(|(_, r)| matches!(pivots[*r], Expr::Const(x) if x == 0.0)).map(|(g, _)| *g).collect();
    plan.close_columns(&idle);
}
