//! The search over a whole tree, branch by branch: each chain that ends at a tip is searched together with its
//! ancestors only, and the result is used for every branch that is alike.

use super::chain::{Candidate, ChainSearch};
use super::objective::Objective;
use super::{cycles, frames, LARGEST};
use crate::options::{EliminationStrategy, PlanOptions, RolledCode};
use crate::output::Output;
use crate::plan::{parallel_runs, tip_chains, touches_rolled, ChainElimination, Plan};

/// Number of eliminations of a chain that are tried for the accelerations, in addition to their neighbours.
const TRIED_FOR_ACCELERATIONS: usize = 6;

/// Chooses an elimination for every chain that ends at a tip, and records the candidates.
pub fn choose(plan: &mut Plan, options: PlanOptions) -> Vec<Candidate> {
    let mut candidates = Vec::new();
    if plan.nodes.len() > LARGEST {
        return candidates;
    }
    let strategy = options.elimination;
    let (mut runs, mut chains) = (parallel_runs(plan), tip_chains(plan));
    if strategy == EliminationStrategy::Fastest {
        chains.retain(|chain| !chain.iter().any(|&i| plan.nodes[i].rolled));
        runs.retain(|run| !touches_rolled(plan, run));
    }
    if chains.is_empty() && runs.is_empty() && plan.constraints.is_empty() {
        return candidates;
    }
    let objectives = [Output::Rates, Output::Accelerations].map(|output| Objective { strategy, output });
    let single = plan.clone();
    frames::toggle(plan, &single, &runs, objectives[0]);
    let mut other = options.accelerations.then(|| plan.clone());
    let mut cache: Vec<Cached> = Vec::new();
    for chain in chains {
        let branch = Branch::new(plan, &chain, objectives);
        let like = cache.iter().position(|c| c.letters == branch.letters && c.is_accurate(&branch));
        let like = like.unwrap_or_else(|| {
            cache.push(branch.search(options));
            cache.len() - 1
        });
        let Cached { eliminations: [first, second], tried, .. } = &cache[like];
        let ends = [chain[0], chain[chain.len() - 1]];
        candidates.extend(tried.iter().map(|c| Candidate { branch: ends, ..c.clone() }));
        first.iter().for_each(|elimination| elimination.apply(plan, &chain));
        if let (Some(plan), Some(elimination)) = (&mut other, second) {
            elimination.apply(plan, &chain);
        }
    }
    frames::toggle(plan, &single, &runs, objectives[0]);
    cycles::choose(plan, &single, objectives[0]);
    if let Some(mut other) = other {
        let objective = objectives[1];
        frames::toggle(&mut other, &single, &runs, objective);
        cycles::choose(&mut other, &single, objective);
        if objective.score(&other) < objective.score(plan) || !objective.accepts(plan, &single) {
            plan.accelerations = Some(Box::new(other));
        }
    }
    candidates
}

/// A chain with its ancestors, and the objectives of its search.
struct Branch {
    letters: String,
    plan: Plan,
    /// Nodes of the chain in the branch's plan.
    chain: Vec<usize>,
    /// One for the rates and one for the accelerations.
    objectives: [Objective; 2],
}

/// The result of the search for a branch, which is used for every branch that is alike, such as the other leg.
struct Cached {
    letters: String,
    /// One for the rates and one for the accelerations.
    eliminations: [Option<ChainElimination>; 2],
    tried: Vec<Candidate>,
}

impl Cached {
    /// Whether the eliminations are accurate with the numbers of another branch.
    fn is_accurate(&self, branch: &Branch) -> bool {
        self.eliminations.iter().zip(branch.objectives).all(|(elimination, objective)| {
            elimination.as_ref().is_none_or(|elimination| {
                let mut plan = branch.plan.clone();
                elimination.apply(&mut plan, &branch.chain);
                objective.accepts(&plan, &branch.plan)
            })
        })
    }
}

impl Branch {
    fn new(plan: &Plan, chain: &[usize], objectives: [Objective; 2]) -> Branch {
        let (branch, numbers) = plan.branch(chain[0]);
        let inside = chain.iter().filter_map(|&i| numbers[i]).collect();
        Branch { letters: branch.letters(), plan: branch, chain: inside, objectives }
    }

    fn search(self, options: PlanOptions) -> Cached {
        let as_rolled = (options.elimination, options.rolled) == (EliminationStrategy::Fastest, RolledCode::Auto);
        let mut search = ChainSearch::new(&self.plan, &self.chain, self.objectives[0]);
        search.run(None, as_rolled);
        let ChainSearch { chosen, tried, mut seen, .. } = search;
        let mut second = None;
        if options.accelerations {
            // Eliminations whose velocities need the fewest operations come first. The other operations of the rates
            // differ between eliminations, those of the accelerations hardly do.
            seen.sort_by_key(|(operations, _)| *operations);
            let first = seen.into_iter().take(TRIED_FOR_ACCELERATIONS).map(|(_, elimination)| elimination);
            let mut search = ChainSearch::new(&self.plan, &self.chain, self.objectives[1]);
            search.run(Some(first.collect()), as_rolled);
            second = search.chosen;
        }
        Cached { eliminations: [chosen, second], tried, letters: self.letters }
    }
}
