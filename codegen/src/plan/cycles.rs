//! EliminationStrategy of the joints inside of closed loops: columns of multipliers ride through all of them, so that what makes columns
//! cheap (frames that do not turn) and what does without them (momenta gathered from the tips) pays more there.

use super::forms::{parallel_runs, Objective};
use super::shared::ancestors;
use super::Plan;

/// Chooses, cycle by cycle, whether frames turn and whether momenta are gathered; `single` has joints one by one.
pub(super) fn choose(plan: &mut Plan, single: &Plan, goal: Objective) {
    let runs = parallel_runs(plan);
    for cycle in cycles(plan) {
        let (part, numbers) = part(plan, &cycle);
        let at = |nodes: &[usize]| nodes.iter().filter_map(|&i| numbers[i]).collect::<Vec<_>>();
        let gathered = at(&cycle);
        let inside: Vec<usize> =
            runs.iter().filter(|run| run.iter().any(|i| cycle.contains(i))).flatten().copied().collect();
        let frames = at(&inside);
        let mut best = (goal.score(&part), None);
        for (accumulates_momentum, non_rotating) in [(true, false), (false, true), (true, true), (false, false)] {
            let mut trial = part.clone();
            gathered.iter().for_each(|&i| trial.nodes[i].elimination.accumulates_momentum = accumulates_momentum);
            frames.iter().for_each(|&i| trial.nodes[i].elimination.non_rotating = non_rotating);
            let score = goal.score(&trial);
            if score < best.0 && goal.accepts(&trial, &self::part(single, &cycle).0) {
                best = (score, Some((accumulates_momentum, non_rotating)));
            }
        }
        if let Some((accumulates_momentum, non_rotating)) = best.1 {
            cycle.iter().for_each(|&i| plan.nodes[i].elimination.accumulates_momentum = accumulates_momentum);
            inside.iter().for_each(|&i| plan.nodes[i].elimination.non_rotating = non_rotating);
        }
    }
}

/// Single-freedom nodes of the loops, those together that share some.
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

/// The smallest part of the mechanism that holds some nodes, and the number in it of every node.
fn part(plan: &Plan, nodes: &[usize]) -> (Plan, Vec<Option<usize>>) {
    let ways: Vec<Vec<usize>> = nodes.iter().map(|&i| ancestors(plan, i)).collect();
    let common = ways.first().and_then(|way| way.iter().copied().find(|i| ways.iter().all(|other| other.contains(i))));
    match common {
        Some(i) => plan.branch(i),
        None => (plan.clone(), (0..plan.nodes.len()).map(Some).collect()),
    }
}
