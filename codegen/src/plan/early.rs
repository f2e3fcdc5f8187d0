//! Platforms that stand on legs of their own: the rows of a leg are solved at the platform, before its freedoms.
//!
//! A leg that starts at the ground and binds one node of another branch has been eliminated when that branch is. Its rows
//! `Φ_l v_l + Φ_p v_p = 0` then depend on the motion of that node alone, and what they do to it is an inertia `Φ_pᵀ A⁻¹ Φ_p`
//! with the leg's own `A = Φ_l M⁻¹ Φ_lᵀ`: as where a loop ends, but one leg after the other. Solved at the ground, the rows
//! of all legs depend on one another by way of the platform: 18 by 18 of them in a Stewart platform in place of six times 3
//! by 3. Rows that the leg cannot follow by itself do wait for the ground
//! ([`mbd_runtime::tree::row_order::order_rows`]).

use std::collections::{BTreeMap, BTreeSet};

use mbd_runtime::tree::row_order::early_rows;
use mbd_runtime::tree::Unknown;

use super::structure::{Plan, PlanBond, PlanConstraint};

/// A plan with the rows of legs solved at the platforms that they bind, where a platform has two legs or more; `None` where
/// no rows are. Contacts, whose rows come and go, leave all rows at the ground.
pub(super) fn with_early_rows(plan: &Plan) -> Option<Plan> {
    if !plan.contact_frames.is_empty() || plan.nodes.iter().any(|node| node.rolled) {
        return None;
    }
    let root = |i: usize| plan.ancestors(i).last().copied().unwrap_or(i);
    let mut bound: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for (a, b) in plan.constraints.iter().filter_map(|c| ends(plan, c)).map(|[a, b]| (root(a), root(b))) {
        bound.entry(a).or_default().insert(b);
        bound.entry(b).or_default().insert(a);
    }
    let legs = |i: usize| bound.get(&i).map_or(0, BTreeSet::len);
    let mut early = Vec::new();
    for leg in bound.keys().copied().filter(|&leg| legs(leg) == 1) {
        let opens = |g: &usize| plan.nodes[leg].elimination.open.contains(g);
        let own: Vec<&PlanConstraint> = plan.constraints.iter().filter(|c| c.slots.iter().any(opens)).collect();
        let platforms: BTreeSet<Option<usize>> = own
            .iter()
            .map(|c| ends(plan, c)?.into_iter().find(|&i| root(i) != leg))
            .map(|platform| platform.filter(|&i| i < leg && legs(root(i)) > 1))
            .collect();
        let shared = plan.nodes[leg].elimination.open.iter().any(|&g| matches!(plan.unknowns[g], Unknown::Velocity(_)));
        if let (false, 1, Some(Some(platform))) = (shared, platforms.len(), platforms.first()) {
            early.extend(own.iter().flat_map(|c| &c.slots).map(|&g| (*platform, g)));
        }
    }
    if early.is_empty() {
        return None;
    }
    let mut plan = plan.clone();
    for (platform, g) in early {
        plan.solve_at_ground.retain(|&h| h != g);
        for i in plan.ancestors(platform) {
            plan.nodes[i].elimination.open.retain(|&h| h != g);
        }
        plan.nodes[platform].elimination.solve_before.push(g);
    }
    Some(plan)
}

/// Whether the early rows of a plan save operations: estimates of what rows cost at a platform whose freedoms are eliminated
/// before them and after them, by the sizes of the matrices.
pub(super) fn saves_operations(plan: &Plan) -> bool {
    let mut early: BTreeMap<usize, usize> = BTreeMap::new();
    for (platform, _) in early_rows(plan) {
        *early.entry(platform).or_default() += 1;
    }
    let (mut with, mut without) = (0, 0);
    for (&platform, &early) in &early {
        let inward = plan.ancestors(platform);
        let freedoms: usize = inward.iter().map(|&i| plan.nodes[i].kind.nv()).sum();
        let open = &plan.nodes[platform].elimination.open;
        let later = open.iter().filter(|g| matches!(plan.unknowns[**g], Unknown::Row(_))).count();
        // Entries of the columns, products of each pair of rows for each freedom, and a factorization.
        let behind = |rows: usize| freedoms * (6 * rows + rows * rows) + rows.pow(3) / 3;
        without += behind(early + later);
        // Each early row changes a matrix of 6 by 6, which is no longer that of a rigid body.
        with += behind(later) + 72 * early + 20 * freedoms;
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
