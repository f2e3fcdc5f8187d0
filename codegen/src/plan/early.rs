//! Rows that are solved before freedoms of their loops, because the legs that they belong to can follow them.
//!
//! A leg that starts at the ground and binds one node of another branch, a platform, has been eliminated when that branch is.
//! Its rows `Φ_l v_l + Φ_p v_p = 0` then depend on the motion of that node alone, and what they do to it is an inertia
//! `Φ_pᵀ A⁻¹ Φ_p` with the leg's own `A = Φ_l M⁻¹ Φ_lᵀ`: as where a loop ends, but one leg after the other. It is the same
//! with a leg of a trunk whose foot is bound to the ground, for the node at which the leg begins. Solved at the ground, the
//! rows of all legs depend on one another by way of the platform or trunk: 18 by 18 of them in a Stewart platform in place of
//! six times 3 by 3. The rows at the end of a long chain are solved after its outer third, so that the inner links do not
//! carry their columns. Rows that the leg cannot follow by itself do wait for the ground
//! ([`mbd_runtime::tree::row_order::order_rows`]). Rows of a chain are eliminated early by Sathya and Carpentier (Constrained
//! Articulated Body Dynamics Algorithms, IEEE Transactions on Robotics 41, 2025), too.

use std::collections::BTreeSet;

use mbd_runtime::tree::row_order::early_rows;
use mbd_runtime::tree::{Elimination, Unknown};

use super::structure::{Plan, PlanBond, PlanConstraint};

/// A plan with the rows of legs solved where the legs end; `None` where no rows are. Contacts, whose rows come and go, leave
/// all rows at the ground.
pub(super) fn with_early_rows(plan: &Plan) -> Option<Plan> {
    if !plan.contact_frames.is_empty() || plan.nodes.iter().any(|node| node.rolled) {
        return None;
    }
    let (at_platforms, at_trunks) = (rows_of_platforms(plan), rows_of_trunks(plan));
    if at_platforms.is_empty() && at_trunks.is_empty() {
        return None;
    }
    let mut plan = plan.clone();
    let all = at_platforms.into_iter().map(|row| (false, row)).chain(at_trunks.into_iter().map(|row| (true, row)));
    for (after, (node, g)) in all {
        plan.solve_at_ground.retain(|&h| h != g);
        for i in plan.ancestors(node) {
            plan.nodes[i].elimination.open.retain(|&h| h != g);
        }
        let Elimination { solve_before, solve_after, .. } = &mut plan.nodes[node].elimination;
        if after { solve_after } else { solve_before }.push(g);
    }
    Some(plan)
}

/// Rows of legs that start at the ground, where a platform has two of them or more: the node that the leg binds, at which they
/// are solved before its freedoms.
fn rows_of_platforms(plan: &Plan) -> Vec<(usize, usize)> {
    let root = |i: usize| plan.ancestors(i).last().copied().unwrap_or(i);
    let pairs = plan.constraints.iter().filter_map(|c| ends(plan, c)).map(|ends| ends.map(root));
    let bound = partners(plan.nodes.len(), pairs);
    let mut early = Vec::new();
    for leg in (0..bound.len()).filter(|&leg| bound[leg].len() == 1) {
        let opens = |g: &usize| plan.nodes[leg].elimination.open.contains(g);
        let own: Vec<&PlanConstraint> = plan.constraints.iter().filter(|c| c.slots.iter().any(opens)).collect();
        let platform = |c: &&PlanConstraint| ends(plan, c)?.into_iter().find(|&i| root(i) != leg);
        let platforms: Vec<Option<usize>> = own.iter().map(platform).collect();
        let shared = plan.nodes[leg].elimination.open.iter().any(|&g| matches!(plan.unknowns[g], Unknown::Velocity(_)));
        let Some(Some(platform)) = platforms.first().copied().filter(|first| platforms.iter().all(|i| i == first))
        else {
            continue;
        };
        if !shared && platform < leg && bound[root(platform)].len() > 1 {
            early.extend(own.iter().flat_map(|c| &c.slots).map(|&g| (platform, g)));
        }
    }
    early
}

/// For each of `n` branches, those that pairs bind it to.
pub(super) fn partners(n: usize, pairs: impl Iterator<Item = [usize; 2]>) -> Vec<BTreeSet<usize>> {
    let mut bound = vec![BTreeSet::new(); n];
    for [a, b] in pairs.filter(|[a, b]| a != b) {
        bound[a].insert(b);
        bound[b].insert(a);
    }
    bound
}

/// A chain of fewer nodes carries the rows at its end to the ground.
const LONG_CHAIN: usize = 30;

/// Rows between the ground and a leg of a trunk: the node at which the leg begins, at which they are solved after its freedoms;
/// for a long chain without branches, the node before its outer third.
fn rows_of_trunks(plan: &Plan) -> Vec<(usize, usize)> {
    let mut children = vec![0; plan.nodes.len()];
    plan.nodes.iter().filter_map(|node| node.parent).for_each(|parent| children[parent] += 1);
    let mut early = Vec::new();
    for constraint in &plan.constraints {
        let PlanBond::Cut { frames, .. } = &constraint.bond else { continue };
        let ([None, Some(foot)] | [Some(foot), None]) = [frames[0].node, frames[1].node] else { continue };
        let way = plan.ancestors(foot);
        let begins = |i: &usize| plan.nodes[*i].parent.is_some_and(|trunk| children[trunk] > 1);
        let shared = way.iter().any(|&i| plan.nodes[i].elimination.unknown.is_some());
        let at_ground = constraint.slots.iter().all(|g| plan.solve_at_ground.contains(g));
        let third = (way.len() >= LONG_CHAIN).then(|| way[way.len() / 3 - 1]);
        let first = way.iter().copied().find(begins).or(third);
        if let (false, true, Some(first)) = (shared, at_ground, first) {
            early.extend(constraint.slots.iter().map(|&g| (first, g)));
        }
    }
    early
}

/// Whether the early rows of a plan save operations: estimates of what rows cost at a platform or trunk whose freedoms are
/// eliminated before them and after them, by the sizes of the matrices.
pub(super) fn saves_operations(plan: &Plan) -> bool {
    // At every node as a trunk, and as a platform.
    let mut early = vec![[0; 2]; plan.nodes.len()];
    for (node, g) in early_rows(plan) {
        match plan.nodes[node].parent.filter(|_| plan.nodes[node].elimination.solve_after.contains(&g)) {
            Some(trunk) => early[trunk][0] += 1,
            None => early[node][1] += 1,
        }
    }
    let (mut with, mut without) = (0, 0);
    for (node, early) in early.into_iter().enumerate() {
        let freedoms: usize = plan.ancestors(node).iter().map(|&i| plan.nodes[i].kind.nv()).sum();
        let open = &plan.nodes[node].elimination.open;
        let later = open.iter().filter(|g| matches!(plan.unknowns[**g], Unknown::Row(_))).count();
        // Entries of the columns, products of each pair of rows for each freedom, and a factorization.
        let behind = |rows: usize| freedoms * (6 * rows + rows * rows) + rows.pow(3) / 3;
        // Each early row changes a matrix of 6 by 6, which at a platform is no longer that of a rigid body.
        for (early, of_row, of_freedom) in [(early[0], 48, 0), (early[1], 72, 20)].into_iter().filter(|e| e.0 > 0) {
            without += behind(early + later);
            with += behind(later) + of_row * early + of_freedom * freedoms;
        }
    }
    with < without
}

/// The nodes of a loop between two branches that start at the ground.
fn ends(plan: &Plan, constraint: &PlanConstraint) -> Option<[usize; 2]> {
    let PlanBond::Cut { frames, .. } = &constraint.bond else { return None };
    let at_ground = constraint.slots.iter().all(|g| plan.solve_at_ground.contains(g));
    let ends = [frames[0].node?, frames[1].node?];
    let [a, b] = ends.map(|i| plan.ancestors(i).last().copied());
    (at_ground && a != b).then_some(ends)
}
