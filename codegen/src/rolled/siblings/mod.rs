//! Like branches of one node: legs, arms, fingers; and like mechanisms side by side on the ground.
//!
//! Branches are alike if their nodes have the same kinds of joints and the same elimination, and the loops inside of them are
//! of the same kinds. Constants may differ in everything, their zeros and signs included: what is not the same in all branches
//! becomes a column of the table. Steps that only some of the placements have are let in elsewhere as identities.

mod branch;
mod steps;

use std::ops::Range;

use mbd_runtime::tree::Tree;

use self::branch::{nodes_of, Branch};
use self::steps::{union, Steps};
use super::mapped::map_constraint;
use super::runs::{columns_of, slots_of, Branches, Run, Slot};
use crate::symbolic::Expr;

/// Largest number of branches in a set: the lanes of a vector register.
pub const WIDTH: usize = 4;

/// Sets of like branches, each of nodes that are in no other set, inner nodes first. In `fast` arithmetic, what rounds in other
/// places than the sweeps is allowed: turns about no angle that make placements alike; and rows that are solved at the parent
/// of a branch, which then are solved before the branches are added up.
pub fn find(tree: &Tree<Expr>, fast: bool) -> Vec<Run> {
    if !tree.wrenches.is_empty() || tree.row_factors.is_some() {
        return Vec::new();
    }
    let n = tree.nodes.len();
    let mut taken = vec![false; n];
    let mut sets = Vec::new();
    let mut branches = vec![Vec::new(); n + 1];
    // Those of the ground come first.
    let place = |parent: Option<usize>| parent.map_or(0, |p| p + 1);
    (0..n).for_each(|root| branches[place(tree.nodes[root].parent)].push(root..end_of(tree, root)));
    for (parent, mut nodes) in std::iter::once(None).chain((0..n).map(Some)).zip(branches) {
        if parent.is_none() || fast {
            join(tree, parent, &mut nodes);
        }
        let unfit = |p: usize| taken[p] || tree.nodes[p].elimination.non_rotating;
        if nodes.len() < 2 || parent.is_some_and(unfit) {
            continue;
        }
        let mut rest: Vec<Branch> =
            nodes.into_iter().filter_map(|nodes| Branch::new(tree, parent, nodes, fast)).collect();
        while !rest.is_empty() {
            let first = rest.remove(0);
            let (mut like, mut other) = (vec![first], Vec::new());
            for branch in rest {
                match like[0].is_like(&branch) && union_of(like.iter().chain([&branch]), fast).is_some() {
                    true => like.push(branch),
                    false => other.push(branch),
                }
            }
            rest = other;
            for like in like.chunks(WIDTH) {
                let Some(run) = run(tree, parent, like, fast) else { continue };
                for branch in like {
                    taken[branch.root..branch.root + branch.nodes.len()].fill(true);
                }
                sets.push(run);
            }
        }
    }
    sets
}

/// The node after the last of those that follow `root` and descend from it.
fn end_of(tree: &Tree<Expr>, root: usize) -> usize {
    let inside = |i: usize| tree.nodes[i].parent.is_some_and(|p| p >= root);
    (root + 1..tree.nodes.len()).find(|&i| !inside(i)).unwrap_or(tree.nodes.len())
}

/// Joins branches of a node or of the ground that constraints bind to one another, with those between them.
fn join(tree: &Tree<Expr>, parent: Option<usize>, branches: &mut Vec<Range<usize>>) {
    for constraint in &tree.constraints {
        let of = |i: usize| branches.iter().position(|nodes| nodes.contains(&i));
        let ends = nodes_of(&constraint.bond).into_iter().filter(|end| *end != parent);
        // What leads elsewhere makes no branch.
        let Some(all) = ends.map(|end| of(end?)).collect::<Option<Vec<usize>>>() else { continue };
        let (Some(&first), Some(&last)) = (all.iter().min(), all.iter().max()) else { continue };
        let joined = branches[first].start..branches[last].end;
        branches.splice(first..=last, [joined]);
    }
}

/// The steps of all branches, placement by placement: the shortest lists that contain those of every branch in order.
fn union_of<'a>(mut branches: impl Iterator<Item = &'a Branch>, turns: bool) -> Option<Vec<Steps>> {
    let first = branches.next()?.places().cloned().collect();
    branches.try_fold(first, |all: Vec<Steps>, branch| {
        all.iter().zip(branch.places()).map(|(steps, place)| union(steps, place, turns)).collect()
    })
}

/// The set of some like branches; `None` where there is only one, or their coordinates do not move on steadily.
fn run(tree: &Tree<Expr>, parent: Option<usize>, like: &[Branch], turns: bool) -> Option<Run> {
    let (first, second) = (like.first()?, like.get(1)?);
    let stride = second.first.checked_sub(first.first)?;
    if !like.windows(2).all(|pair| pair[1].first.checked_sub(pair[0].first) == Some(stride)) {
        return None;
    }
    let steps = union_of(like.iter(), turns)?;
    let all: Vec<Branch> = like.iter().map(|branch| branch.with_steps(&steps, turns)).collect::<Option<_>>()?;
    let mut table = vec![Vec::new(); like.len()];
    let node = |k: usize| all.iter().map(|branch| branch.nodes[k].clone()).collect::<Vec<_>>();
    let template = (0..first.nodes.len()).map(|k| columns_of(&node(k), &mut table)).collect();
    let mut constraints = Vec::new();
    for (k, constraint) in all[0].constraints.iter().enumerate() {
        let numbers = |branch: &Branch| {
            let mut numbers = Vec::new();
            map_constraint(&branch.constraints[k], &mut |x| numbers.push(x));
            numbers
        };
        let mut slots = slots_of(&all.iter().map(numbers).collect::<Vec<_>>(), &mut table).into_iter();
        constraints.push(map_constraint(constraint, &mut |_| slots.next().unwrap_or(Slot::Const(0.0))));
    }
    let branches = Branches {
        parent,
        roots: like.iter().map(|branch| branch.root).collect(),
        stride,
        first: first.first,
        size: first.size,
        unknowns: first.unknowns.clone(),
        solve_last: first.solve_last.clone(),
        accumulates: parent.is_some_and(|p| tree.nodes[p].elimination.accumulates_momentum),
    };
    let nodes = first.root..first.root + first.nodes.len();
    let period = nodes.len();
    Some(Run { period, exit: period - 1, nodes, template, constraints, table, branches: Some(branches) })
}
