//! Joints inside closed loops: columns of multipliers pass through all of them. Non-rotating frames, which make columns
//! cheaper, and accumulated momenta, which need no columns, therefore save more there.

use super::objective::Objective;
use crate::plan::{parallel_runs, Plan};

/// Chooses, cycle by cycle, whether frames rotate and whether momenta are accumulated; `single` has one joint at a
/// time.
pub fn choose(plan: &mut Plan, single: &Plan, objective: Objective) {
    let runs = parallel_runs(plan);
    for cycle in cycles(plan) {
        let (part, numbers) = part(plan, &cycle);
        let at = |nodes: &[usize]| nodes.iter().filter_map(|&i| numbers[i]).collect::<Vec<_>>();
        let joints = at(&cycle);
        let inside: Vec<usize> =
            runs.iter().filter(|run| run.iter().any(|i| cycle.contains(i))).flatten().copied().collect();
        let frames = at(&inside);
        let mut best = (objective.score(&part), None);
        for (accumulates, non_rotating) in [(true, false), (false, true), (true, true), (false, false)] {
            let mut trial = part.clone();
            set(&mut trial, [&joints, &frames], (accumulates, non_rotating));
            let score = objective.score(&trial);
            if score < best.0 && objective.accepts(&trial, &self::part(single, &cycle).0) {
                best = (score, Some((accumulates, non_rotating)));
            }
        }
        if let Some(choice) = best.1 {
            set(plan, [&cycle, &inside], choice);
        }
    }
}

/// Sets a choice for the joints of a cycle and for the frames inside it.
fn set(plan: &mut Plan, [joints, frames]: [&[usize]; 2], (accumulates, non_rotating): (bool, bool)) {
    joints.iter().for_each(|&i| plan.nodes[i].elimination.accumulates_momentum = accumulates);
    frames.iter().for_each(|&i| plan.nodes[i].elimination.non_rotating = non_rotating);
}

/// Single-freedom nodes of the closed loops; loops that share nodes form one list.
fn cycles(plan: &Plan) -> Vec<Vec<usize>> {
    let mut all: Vec<Vec<usize>> = Vec::new();
    for constraint in &plan.constraints {
        let mut nodes = constraint.cycle();
        nodes.retain(|&i| plan.nodes[i].kind.nv() == 1 && !plan.nodes[i].rolled);
        let (joined, rest): (Vec<_>, Vec<_>) = all.into_iter().partition(|c| c.iter().any(|i| nodes.contains(i)));
        all = rest;
        nodes.extend(joined.into_iter().flatten());
        nodes.sort_unstable();
        nodes.dedup();
        all.push(nodes);
    }
    all.retain(|nodes| !nodes.is_empty());
    all
}

/// The smallest part of the mechanism that contains some nodes, and the new number of every node.
fn part(plan: &Plan, nodes: &[usize]) -> (Plan, Vec<Option<usize>>) {
    let ways: Vec<Vec<usize>> = nodes.iter().map(|&i| plan.ancestors(i)).collect();
    let common = ways.first().and_then(|way| way.iter().copied().find(|i| ways.iter().all(|other| other.contains(i))));
    match common {
        Some(i) => plan.branch(i),
        None => (plan.clone(), (0..plan.nodes.len()).map(Some).collect()),
    }
}
