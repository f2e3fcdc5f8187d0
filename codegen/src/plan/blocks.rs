//! Tip blocks: the last joints of a branch solved together at the first of them.
//!
//! One joint at a time, every `M'` is full. Carried inward unreduced, the inertia of the outer bodies stays that of a
//! rigid body (three zeros in four after regrouping) and each joint adds a column; the block is then eliminated at its
//! innermost joint. Short blocks are cheaper, long ones are not: the generator counts, branch by branch.

use mbd_runtime::tree::Source;

use super::{NodeKind, Plan};
use crate::options::{Group, Options};
use crate::trace::trace;

/// The longest block that is tried; beyond, the columns cost more than they save and conditioning suffers.
const LONGEST: usize = 10;

/// Trees beyond this are not searched: counting a candidate means to generate it.
const LARGEST: usize = 150;

/// Which joints are solved as blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blocks {
    /// Those for which the rates have the fewest operations.
    #[default]
    Fewest,
    /// None: every joint by itself.
    None,
}

/// Chooses a block for every branch, outermost branches by themselves.
pub fn choose(plan: &mut Plan) {
    if plan.nodes.len() > LARGEST {
        return;
    }
    let chains = tip_chains(plan);
    let mut best = cost(plan);
    for chain in chains {
        let mut chosen = None;
        for base in 0..chain.len().saturating_sub(1) {
            if chain.len() - base > LONGEST {
                continue;
            }
            let mut candidate = plan.clone();
            solve_together(&mut candidate, &chain[base..]);
            let operations = cost(&candidate);
            if operations < best {
                best = operations;
                chosen = Some(candidate);
            }
        }
        if let Some(chosen) = chosen {
            *plan = chosen;
        }
    }
}

/// Operations of the rates.
fn cost(plan: &Plan) -> usize {
    let options = Options { efforts: false, ..Options::default() };
    trace(plan, Group::Rates, &options).map_or(usize::MAX, |g| g.program.counts().total())
}

/// Runs of single-freedom joints that end at a tip, inner joint first.
fn tip_chains(plan: &Plan) -> Vec<Vec<usize>> {
    let children = |i: usize| plan.nodes.iter().filter(|n| n.parent == Some(i)).count();
    let eligible = |i: usize| {
        let node = &plan.nodes[i];
        let single = matches!(node.kind, NodeKind::Pin | NodeKind::Slider | NodeKind::Helical(_));
        let plain = node.shared.is_none() && node.solve_before.is_empty() && node.open.is_empty();
        single && plain && matches!(node.source, Source::State { .. })
    };
    let tips = (0..plan.nodes.len()).filter(|&i| children(i) == 0 && eligible(i));
    tips.map(|tip| {
        let up =
            std::iter::successors(Some(tip), |&i| plan.nodes[i].parent.filter(|&p| children(p) == 1 && eligible(p)));
        let mut chain: Vec<usize> = up.collect();
        chain.reverse();
        chain
    })
    .collect()
}

/// Marks all joints of a chain but the first to be solved at the first.
fn solve_together(plan: &mut Plan, chain: &[usize]) {
    let base = chain[0];
    for (k, &i) in chain.iter().enumerate().skip(1).rev() {
        let g = plan.shared.len();
        let Source::State { v, .. } = plan.nodes[i].source else { continue };
        plan.shared.push(v);
        plan.nodes[i].shared = Some(g);
        plan.nodes[i].deferred = true;
        for &j in &chain[1..=k] {
            plan.nodes[j].open.push(g);
        }
        plan.nodes[base].solve_before.push(g);
    }
}
