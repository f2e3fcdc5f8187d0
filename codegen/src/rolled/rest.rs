//! The rest of a tree whose branches are computed in loops.

use mbd_runtime::tree::{Bond, Constraint, Cut, Tree, Unknown};
use mbd_runtime::Scalar;

use super::runs::Run;
use super::turn_tree::only_paths;
use crate::symbolic::Expr;

/// The tree without the constraints inside of branches, and without columns of their unknowns, which nothing else asks for.
pub fn without_inner<'g>(mut tree: Tree<Expr<'g>>, runs: &[Run]) -> Tree<Expr<'g>> {
    for run in runs {
        let Some(branches) = &run.branches else { continue };
        for turn in 0..run.count() {
            let within = |at: usize, first: usize, stride: usize, size: usize| {
                (first + turn * stride..first + turn * stride + size).contains(&at)
            };
            let (first, stride, size) = (branches.first, branches.stride, branches.size);
            let rows = |row: usize| within(row, first.rows, stride.rows, size.rows);
            // All branches hang on the same path from the ground.
            let without = |c: Constraint<Expr<'g>>| match rows(c.first) {
                true => to_ground(c).filter(|_| turn == 0 && branches.parent.is_some()),
                false => Some(c),
            };
            tree.constraints = std::mem::take(&mut tree.constraints).into_iter().filter_map(without).collect();
            // What is solved at the ground in the branches meets nothing else there.
            let outer = |g: usize| match tree.unknowns[g] {
                Unknown::Row(row) => !rows(row),
                Unknown::Velocity(v) => !within(v, first.v, stride.v, size.v),
            };
            tree.solve_at_ground.retain(|&g| outer(g));
            tree.nodes.iter_mut().for_each(|node| node.elimination.retain_columns(outer));
        }
    }
    tree
}

/// What the rest of the tree needs of a constraint that binds a branch to the ground: the way from there to the branch, of which
/// the branch takes in the pose, and along which it hands wrenches on. `None` for other constraints.
fn to_ground(constraint: Constraint<Expr>) -> Option<Constraint<Expr>> {
    let Bond::Cut(Cut { path_a, path_b, grounded: true, .. }) = constraint.bond else { return None };
    let bond = only_paths([path_a, path_b], true);
    // Nothing is known of its rows, as if they were to decay.
    let decay = Some(Expr::zero());
    Some(Constraint { bond, slots: Vec::new(), passes: Vec::new(), decay, ..constraint })
}
