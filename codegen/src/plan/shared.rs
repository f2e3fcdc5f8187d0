//! Coordinates shared by several joints: where their columns are open, and where they are solved.

use std::collections::BTreeSet;

use mbd_runtime::tree::{Source, Unknown};

use super::structure::Plan;
use crate::model::JointMotion;

/// Marks the nodes of every coordinate that more than one node follows.
pub fn share(plan: &mut Plan) {
    let mut followers = vec![Vec::new(); plan.dims.nv];
    for (i, node) in plan.nodes.iter().enumerate() {
        if let Source::State { v, .. } = node.source {
            followers[v].push(i);
        }
    }
    for (v, members) in followers.into_iter().enumerate() {
        let mimics = members.iter().any(|&i| {
            let joint = plan.nodes[i].joint.0;
            matches!(plan.model.joints[joint].motion, JointMotion::Mimic { .. })
        });
        if !mimics {
            continue;
        }
        let g = plan.unknowns.len();
        plan.unknowns.push(Unknown::Velocity(v));
        for &i in &members {
            plan.nodes[i].elimination.unknown = Some(g);
        }
        open(plan, g, &members);
    }
}

/// Keeps the column of an unknown open from its members inward to where they meet.
fn open(plan: &mut Plan, g: usize, members: &[usize]) {
    // Children have larger numbers than their parents, so the last of the heads is no ancestor of another. The ground
    // comes before all nodes.
    let mut heads: BTreeSet<Option<usize>> = members.iter().copied().map(Some).collect();
    let meeting = loop {
        match heads.pop_last().flatten() {
            Some(i) if !heads.is_empty() => {
                plan.nodes[i].elimination.open.push(g);
                heads.insert(plan.nodes[i].parent);
            }
            last => break last,
        }
    };
    match meeting {
        Some(i) if members.contains(&i) => plan.nodes[i].elimination.solve_after.push(g),
        Some(i) => plan.nodes[i].elimination.solve_before.push(g),
        None => plan.solve_at_ground.push(g),
    }
}
