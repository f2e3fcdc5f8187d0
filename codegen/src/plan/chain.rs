//! Elimination of a chain of joints with one degree of freedom each: which are eliminated one by one, which together,
//! and where. Columns that arrive from beyond the chain, of shared coordinates and of other chains, go the way of the
//! last joint's own.

use mbd_runtime::tree::{Source, Unknown};

use super::structure::Plan;

/// Elimination of the degrees of freedom of a chain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChainElimination {
    /// Joints before this one (of a chain that starts at the ground) keep their screws, which are carried outward; they
    /// are solved together at the ground.
    pub split: usize,
    /// Joints from this one on are solved together: at `base`, or with those before `split` where the two meet. The
    /// number of the last joint means that there is no block.
    pub base: usize,
    /// All joints are solved further inward: at the parent of the first, or where its columns go; `base` is 0 then.
    pub passes: bool,
    /// For every joint, whether it is eliminated before its own motion.
    pub before_joint: Vec<bool>,
    /// Joints before this one get their momentum rates from accumulated momenta.
    pub accumulating: usize,
    /// Whether the joints are laid out for rolled code.
    pub rolled: bool,
}

impl ChainElimination {
    /// The elimination of a chain of `len` joints one by one.
    pub fn single(len: usize) -> ChainElimination {
        let before_joint = vec![false; len];
        ChainElimination { split: 0, base: len - 1, passes: false, before_joint, accumulating: 0, rolled: false }
    }

    /// The elimination of a chain of `len` joints at the parent of the first, or where its columns go; each column is
    /// begun before the joint's motion if `before`.
    pub fn passing(len: usize, before: bool) -> ChainElimination {
        ChainElimination { base: 0, passes: true, before_joint: vec![before; len], ..ChainElimination::single(len) }
    }

    /// The elimination of a chain of `len` joints in rolled code: one joint at a time, before its motion, which has the
    /// shortest critical path through a link.
    pub fn rolled(len: usize) -> ChainElimination {
        ChainElimination { before_joint: vec![true; len], rolled: true, ..ChainElimination::single(len) }
    }

    /// Description for a chain of `len` joints.
    pub fn words(&self, len: usize) -> String {
        if self.rolled {
            return "a loop".to_string();
        }
        let mut words = Vec::new();
        let met = self.split == self.base && self.split > 0;
        match (met, len - self.base) {
            (true, k) => words.push(format!("all at the ground: {} screws out, {k} columns in", self.split)),
            _ if self.passes => words.push("all at the parent".to_string()),
            (false, 1) if self.split == 0 => words.push("one by one".to_string()),
            (false, 1) => {}
            (false, k) => words.push(format!("last {k} together")),
        }
        if !met && self.split > 0 {
            words.push(format!("first {} at the ground", self.split));
        }
        let before = self.before_joint.iter().filter(|before| **before).count();
        if before > 0 {
            words.push(format!("{before} on the parent's side"));
        }
        if self.accumulating > 0 {
            words.push(format!("momenta of {}", self.accumulating));
        }
        words.join("; ")
    }

    /// Eliminates the freedoms of a chain in this way. `chain` has the nodes of `plan`, inner joint first; each
    /// eliminates its freedom by itself so far. Chains beyond it have been eliminated.
    pub fn apply(&self, plan: &mut Plan, chain: &[usize]) {
        for (&i, &before_joint) in chain.iter().zip(&self.before_joint) {
            let node = &mut plan.nodes[i];
            node.elimination.before_joint = before_joint;
            node.rolled |= self.rolled;
            node.elimination.non_rotating &= !self.rolled;
        }
        for &i in &chain[..self.accumulating] {
            plan.nodes[i].elimination.accumulates_momentum = true;
        }
        let met = self.split == self.base && self.split > 0;
        let first = if met || self.passes { self.base } else { self.base + 1 };
        for k in (first..chain.len()).rev() {
            let i = chain[k];
            let mut columns = std::mem::take(&mut plan.nodes[i].elimination.solve_before);
            columns.append(&mut plan.nodes[i].elimination.solve_after);
            columns.extend(defer(plan, i));
            if met && k == self.base {
                plan.solve_at_ground.extend(&columns);
                plan.nodes[i].elimination.ends.append(&mut columns);
                continue;
            }
            match plan.nodes[i].parent {
                Some(parent) => plan.nodes[parent].elimination.solve_before.extend(&columns),
                None => plan.solve_at_ground.extend(&columns),
            }
            plan.nodes[i].elimination.open.append(&mut columns);
        }
        for k in (0..self.split).rev() {
            let Some(g) = defer(plan, chain[k]) else { continue };
            plan.nodes[chain[k]].elimination.ends.push(g);
            plan.solve_at_ground.push(g);
            let last = if met { self.split } else { self.split - 1 };
            for &j in &chain[k + 1..=last] {
                plan.nodes[j].elimination.screws.push(g);
            }
        }
    }
}

/// Defers the degree of freedom of node `i`, which is then solved closer to the ground. Returns its number among the
/// unknowns; nothing if the node has no coordinate of its own.
fn defer(plan: &mut Plan, i: usize) -> Option<usize> {
    if plan.nodes[i].elimination.unknown.is_some() {
        return None;
    }
    let Source::State { v, .. } = plan.nodes[i].source else { return None };
    let g = plan.unknowns.len();
    plan.unknowns.push(Unknown::Velocity(v));
    plan.nodes[i].elimination.unknown = Some(g);
    plan.nodes[i].elimination.deferred = true;
    Some(g)
}
