//! Rows that are solved before freedoms of their loops, because the legs that they belong to can follow them.
//!
//! A leg that starts at the ground and binds one node of another branch, a platform, has been eliminated when that branch is.
//! Its rows `Φ_l v_l + Φ_p v_p = 0` then depend on the motion of that node alone, and what they do to it is an inertia
//! `Φ_pᵀ A⁻¹ Φ_p` with the leg's own `A = Φ_l M⁻¹ Φ_lᵀ`: as where a loop ends, but one leg after the other. It is the same
//! with a leg of a trunk whose foot is bound to the ground, for the node at which the leg begins. Solved at the ground, the
//! rows of all legs depend on one another by way of the platform or trunk: 18 by 18 of them in a Stewart platform in place of
//! six times 3 by 3. The rows at the end of a long chain are solved after its outer third, so that the inner links do not
//! carry their columns. Rows that the leg cannot follow by itself do wait for the ground
//! ([`mbd_runtime::tree::row_order::order_rows`]).
//!
//! The feet of a robot that touch the ground are legs of its trunk in those modes in which they are closed. Which rows are early
//! then depends on the modes ([`Plan::early_contacts`]): a leg with a joint at its stop cannot follow its foot, and a leg
//! that becomes straight no longer can.
//!
//! Rows of a chain are eliminated early by Sathya and Carpentier (Constrained
//! Articulated Body Dynamics Algorithms, IEEE Transactions on Robotics 41, 2025), too.

use std::collections::BTreeSet;

use mbd_runtime::tree::row_order::{early_rows, not_followed};
use mbd_runtime::tree::{Elimination, Unknown};

use super::paths::children;
use super::row_order::products;
use super::structure::{Plan, PlanBond, PlanConstraint, RowsThatAct};
use crate::options::Arithmetic;

/// A plan with the rows of legs solved where the legs end; `None` where no rows are. Models with contacts, whose rows come and
/// go, have them at the ground, but for [`Plan::early_contacts`] in some sets of modes.
pub(super) fn with_early_rows(plan: &Plan) -> Option<Plan> {
    if !plan.contact_frames.is_empty() || plan.nodes.iter().any(|node| node.rolled) {
        return None;
    }
    let (at_platforms, at_trunks) = (rows_of_platforms(plan), rows_of_trunks(plan));
    if at_platforms.is_empty() && at_trunks.is_empty() {
        return None;
    }
    let all = at_platforms.into_iter().map(|row| (false, row)).chain(at_trunks.into_iter().map(|row| (true, row)));
    Some(with_rows_at_nodes(plan, all))
}

/// A plan with rows that are solved at the ground solved at nodes: whether after its freedoms, the node, the unknown.
fn with_rows_at_nodes(plan: &Plan, rows: impl Iterator<Item = (bool, (usize, usize))>) -> Plan {
    let mut plan = plan.clone();
    for (after, (node, g)) in rows {
        plan.solve_at_ground.retain(|&h| h != g);
        for i in plan.ancestors(node) {
            plan.nodes[i].elimination.open.retain(|&h| h != g);
        }
        let Elimination { solve_before, solve_after, .. } = &mut plan.nodes[node].elimination;
        if after { solve_after } else { solve_before }.push(g);
    }
    plan
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
/// Freedoms of the first joint from the ground whose body is the trunk of its only leg. With fewer, it is a link of that leg.
const FREEDOMS_OF_TRUNK: usize = 3;

/// Rows of loops between the ground and a leg of a trunk, and the node after whose freedoms they are solved.
fn rows_of_trunks(plan: &Plan) -> Vec<(usize, usize)> {
    let at_ground = |c: &&PlanConstraint| c.slots.iter().all(|g| plan.solve_at_ground.contains(g));
    let legs = plan.constraints.iter().filter(at_ground).filter_map(|c| Some((leg_of(plan, c, false)?, c)));
    legs.flat_map(|(first, c)| c.slots.iter().map(move |&g| (first, g))).collect()
}

/// The node at which the leg of a trunk begins that a constraint binds to the ground; for a long chain without branches, the
/// node before its outer third. With `only`, the body of a first joint of three freedoms or more is the trunk of its only
/// leg, too. That is for contacts alone: where the leg is nearly singular, their rows can be eliminated at the ground instead, those of
/// loops cannot.
fn leg_of(plan: &Plan, constraint: &PlanConstraint, only: bool) -> Option<usize> {
    let PlanBond::Cut { frames, .. } = &constraint.bond else { return None };
    let ([None, Some(foot)] | [Some(foot), None]) = [frames[0].node, frames[1].node] else { return None };
    let children = children(plan);
    let way = plan.ancestors(foot);
    let begins = |i: &usize| plan.nodes[*i].parent.is_some_and(|trunk| children[trunk] > 1);
    let third = (way.len() >= LONG_CHAIN).then(|| way[way.len() / 3 - 1]);
    let only = match way[..] {
        [.., first, trunk] if only && plan.nodes[trunk].kind.nv() >= FREEDOMS_OF_TRUNK => Some(first),
        _ => None,
    };
    let first = way.iter().copied().find(begins).or(third).or(only)?;
    // Freedoms that are solved at inner nodes must have been solved there, too.
    let leg = way.iter().position(|&i| i == first).map_or(&[][..], |k| &way[..=k]);
    let solved = |i: &usize| {
        let Elimination { solve_before, solve_after, .. } = &plan.nodes[*i].elimination;
        solve_before.iter().chain(solve_after)
    };
    let solved: Vec<usize> = leg.iter().flat_map(solved).copied().collect();
    way.iter().filter_map(|&i| plan.nodes[i].elimination.unknown).all(|g| solved.contains(&g)).then_some(first)
}

/// A row of a contact between a leg and the ground.
struct RowOfFoot {
    /// The contact.
    contact: usize,
    /// The node at which the leg begins.
    first: usize,
    /// The unknown.
    g: usize,
}

/// What an early row of a contact must leave of the diagonals of its constraint: less costs more than three digits.
const CONTACT_TOLERANCE: f64 = 1e-3;

impl Plan {
    /// The contacts of this plan, in which some rows act, whose rows should be solved where the legs begin that they bind to the
    /// ground; none where nothing is saved. A leg takes all rows that act on it early, or none: those that its joints can
    /// follow, at the start and beside it. None in exact arithmetic, in which code has the bits of the interpreter, whose rows are
    /// not early.
    pub fn early_contacts(&self, arithmetic: Arithmetic) -> Vec<usize> {
        let RowsThatAct::Some(of) = &self.acts else { return Vec::new() };
        if arithmetic == Arithmetic::Exact || self.nodes.iter().any(|node| node.rolled) {
            return Vec::new();
        }
        let full = &of.0;
        let mut rows = rows_of_feet(self, full);
        while !rows.is_empty() {
            let early = |plan: &Plan| with_rows_of_feet(plan, &rows);
            let plan = early(self);
            if !saves_operations(&plan) {
                return Vec::new();
            }
            let bad = not_followed(&plan, &products(&early(full)));
            if bad.is_empty() {
                break;
            }
            let legs: Vec<usize> = rows.iter().filter(|row| bad.contains(&row.g)).map(|row| row.first).collect();
            rows.retain(|row| !legs.contains(&row.first));
        }
        let contacts: BTreeSet<usize> = rows.iter().map(|row| row.contact).collect();
        contacts.into_iter().collect()
    }

    /// The plan, in which some rows act, with those of [early contacts](Plan::early_contacts) solved where their legs begin. Where
    /// a leg cannot follow them during a motion, as where it is straight, [`mbd_runtime::sweep::Sweeps::early_rows_act`]
    /// tells, and the plan itself must serve.
    #[must_use]
    pub fn with_early_contacts(&self, contacts: &[usize]) -> Plan {
        let RowsThatAct::Some(of) = &self.acts else { return self.clone() };
        let early = |plan: &Plan, full: &Plan| {
            let mut rows = rows_of_feet(plan, full);
            rows.retain(|row| contacts.contains(&row.contact));
            let early_tolerance = (!rows.is_empty()).then_some(CONTACT_TOLERANCE);
            Plan { early_tolerance, ..with_rows_of_feet(plan, &rows) }
        };
        let mut plan = early(self, &of.0);
        // Another elimination for accelerations has numbers of its own for the unknowns.
        if let (Some(other), Some(full)) = (&mut plan.accelerations, &of.0.accelerations) {
            **other = early(other, full);
            // Functions tell whether early rows act for all outputs or for none.
            other.early_tolerance = plan.early_tolerance;
        }
        plan
    }
}

/// A plan with the rows of contacts solved where the legs begin, those that act in it.
fn with_rows_of_feet(plan: &Plan, rows: &[RowOfFoot]) -> Plan {
    let rows = rows.iter().filter(|row| plan.solve_at_ground.contains(&row.g));
    with_rows_at_nodes(plan, rows.map(|row| (true, (row.first, row.g))))
}

/// Rows of the contacts that act between legs and the ground in a plan, and those of the same contacts that do not act.
fn rows_of_feet(plan: &Plan, full: &Plan) -> Vec<RowOfFoot> {
    let first = full.constraints.len() - full.model.contacts.len();
    let mut rows = Vec::new();
    for (contact, constraint) in full.constraints[first..].iter().enumerate() {
        if constraint.slots.iter().any(|g| plan.solve_at_ground.contains(g)) {
            if let Some(first) = leg_of(plan, constraint, true) {
                rows.extend(constraint.slots.iter().map(|&g| RowOfFoot { contact, first, g }));
            }
        }
    }
    rows
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
