//! Coordinates shared by several joints: where their columns are open, and where they are solved.

use mbd_runtime::tree::{Source, Unknown};

use super::structure::Plan;
use crate::model::JointMotion;

/// Marks the nodes of every coordinate that more than one node follows.
pub fn share(plan: &mut Plan) {
    for v in 0..plan.dims.nv {
        let members: Vec<usize> = (0..plan.nodes.len())
            .filter(|&i| matches!(plan.nodes[i].source, Source::State { v: at, .. } if at == v))
            .collect();
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

fn open(plan: &mut Plan, g: usize, members: &[usize]) {
    let paths: Vec<Vec<usize>> = members.iter().map(|&i| plan.ancestors(i)).collect();
    let meeting = paths[0].iter().copied().find(|a| paths.iter().all(|path| path.contains(a)));
    for path in &paths {
        for &i in path.iter().take_while(|&&i| Some(i) != meeting) {
            if !plan.nodes[i].elimination.open.contains(&g) {
                plan.nodes[i].elimination.open.push(g);
            }
        }
    }
    match meeting {
        Some(i) if members.contains(&i) => plan.nodes[i].elimination.solve_after.push(g),
        Some(i) => plan.nodes[i].elimination.solve_before.push(g),
        None => plan.solve_at_ground.push(g),
    }
}
