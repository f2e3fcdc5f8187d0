//! Paths of the tree that are eliminated or rolled together: chains, unbranched paths, runs of parallel joints.

use mbd_runtime::tree::{Elimination, Kind, Source, Unknown};

use super::structure::{Plan, PlanNode, PoseStep};

/// Number of children of every node.
pub(super) fn children(plan: &Plan) -> Vec<usize> {
    let mut children = vec![0; plan.nodes.len()];
    for parent in plan.nodes.iter().filter_map(|n| n.parent) {
        children[parent] += 1;
    }
    children
}

/// Whether a node has one freedom of the state, which is solved by itself.
fn is_single(node: &PlanNode) -> bool {
    let elimination = &node.elimination;
    let single = node.kind.nv() == 1;
    let plain = elimination.unknown.is_none() && elimination.solve_before.is_empty() && elimination.open.is_empty();
    single && plain && matches!(node.source, Source::State { .. })
}

/// Whether node `i` has one freedom of the state, which is solved by itself, though columns of constraints may pass
/// through.
pub fn is_single_but_for_rows(plan: &Plan, i: usize) -> bool {
    let mut node = plan.nodes[i].clone();
    node.elimination.open.retain(|g| !matches!(plan.unknowns[*g], Unknown::Row(_)));
    is_single(&node)
}

/// Whether a row of a constraint passes through node `i` or is solved there.
pub fn has_rows(plan: &Plan, i: usize) -> bool {
    let Elimination { open, solve_before, solve_after, ends, .. } = &plan.nodes[i].elimination;
    let mut columns = [open, solve_before, solve_after, ends].into_iter().flatten();
    columns.any(|&g| matches!(plan.unknowns[g], Unknown::Row(_)))
}

/// Unbranched paths of single-freedom joints, inner joint first, that are eliminated as chains. No row of a constraint
/// passes through them. They are as long as possible, and each joint has a coordinate of its own. Those at the tips come
/// first, in the order of the nodes; every other chain comes after those beyond it.
pub fn chains(plan: &Plan) -> Vec<Vec<usize>> {
    let children = children(plan);
    // A coordinate that several joints share, or a drive, would be missed where screws meet columns.
    let own = |node: &PlanNode| node.elimination.unknown.is_none() && matches!(node.source, Source::State { .. });
    let single = |i: usize| plan.nodes[i].kind.nv() == 1 && own(&plan.nodes[i]) && !has_rows(plan, i);
    let inside: Vec<bool> = (0..plan.nodes.len()).map(single).collect();
    let mut all: Vec<Vec<usize>> = Vec::new();
    for i in (0..plan.nodes.len()).filter(|&i| inside[i]) {
        let inner = plan.nodes[i].parent.filter(|&p| inside[p] && children[p] == 1);
        match all.iter_mut().find(|chain| inner.is_some() && chain.last().copied() == inner) {
            Some(chain) => chain.push(i),
            None => all.push(vec![i]),
        }
    }
    // Number of chains beyond each, on the longest way to a tip.
    let mut beyond = vec![0; all.len()];
    for k in (0..all.len()).rev() {
        let way = plan.ancestors(all[k][0]);
        for (j, chain) in all[..k].iter().enumerate() {
            if way.contains(&chain[chain.len() - 1]) {
                beyond[j] = beyond[j].max(beyond[k] + 1);
            }
        }
    }
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by_key(|&k| beyond[k]);
    order.into_iter().map(|k| all[k].clone()).collect()
}

/// Paths of at least `least` nodes without branches, each node with coordinates of its own, inner node first.
pub fn unbranched_paths(plan: &Plan, least: usize) -> Vec<Vec<usize>> {
    let children = children(plan);
    let own = |node: &PlanNode| node.elimination.unknown.is_none() && matches!(node.source, Source::State { .. });
    let mut paths: Vec<Vec<usize>> = Vec::new();
    for (i, node) in plan.nodes.iter().enumerate().filter(|(_, n)| own(n)) {
        match paths.last_mut() {
            Some(path) if path.last().copied() == node.parent && node.parent.is_some_and(|p| children[p] == 1) => {
                path.push(i)
            }
            _ => paths.push(vec![i]),
        }
    }
    paths.retain(|path| path.len() >= least);
    paths
}

/// Runs of revolute joints about parallel axes: the nodes whose frames need not rotate, because all that they carry
/// next rotates about the same axis.
pub fn parallel_runs(plan: &Plan) -> Vec<Vec<usize>> {
    let swings = |i: usize| {
        let node = &plan.nodes[i];
        node.kind == Kind::Revolute && node.place.iter().all(|step| matches!(step, PoseStep::Shift { .. }))
    };
    let mut runs: Vec<Vec<usize>> = Vec::new();
    for (i, node) in plan.nodes.iter().enumerate() {
        let mut children = plan.nodes.iter().enumerate().filter(|(_, n)| n.parent == Some(i)).peekable();
        if node.kind != Kind::Revolute || children.peek().is_none() || !children.all(|(k, _)| swings(k)) {
            continue;
        }
        match runs.iter_mut().find(|run| node.parent.is_some_and(|p| run.contains(&p)) && swings(i)) {
            Some(run) => run.push(i),
            None => runs.push(vec![i]),
        }
    }
    runs
}

/// Whether one of these nodes, or of their children, is laid out for rolled code: a non-rotating frame leaves its
/// rotation to its children.
pub fn touches_rolled(plan: &Plan, nodes: &[usize]) -> bool {
    let touches = |k: usize, i: usize| k == i || plan.nodes[k].parent == Some(i);
    (0..plan.nodes.len()).any(|k| plan.nodes[k].rolled && nodes.iter().any(|&i| touches(k, i)))
}
