//! The search over a whole tree by dynamic programming from the tips to the root. A chain sees what is beyond it by
//! the columns that arrive: it is searched with the best elimination of every chain beyond that solves its columns
//! there, and then with the best that passes them on. A chain is searched together with its ancestors and what is
//! beyond it only, and the result is used for every chain that is alike. The number of candidates grows with the
//! number of joints; where two cost the same, the first in the order of the nodes is kept.

use super::chain::{Candidate, ChainInPart, ChainSearch};
use super::objective::Objective;
use super::{cycles, frames, LARGEST};
use crate::options::{EliminationStrategy, PlanOptions, RolledCode};
use crate::output::Output;
use crate::plan::{chains, parallel_runs, touches_rolled, ChainElimination, Plan};

/// Number of eliminations of a chain that are tried for the accelerations, in addition to their neighbours.
const TRIED_FOR_ACCELERATIONS: usize = 6;

/// Chooses an elimination for every chain, and records the candidates.
pub fn choose(plan: &mut Plan, options: PlanOptions) -> Vec<Candidate> {
    if plan.nodes.len() > LARGEST {
        return Vec::new();
    }
    let strategy = options.elimination;
    let (mut runs, mut chains) = (parallel_runs(plan), chains(plan));
    if strategy == EliminationStrategy::Fastest {
        chains.retain(|chain| !chain.iter().any(|&i| plan.nodes[i].rolled));
        runs.retain(|run| !touches_rolled(plan, run));
    }
    if chains.is_empty() && runs.is_empty() && plan.constraints.is_empty() {
        return Vec::new();
    }
    let objectives = [Output::Rates, Output::Accelerations].map(|output| Objective { strategy, output });
    let single = plan.clone();
    frames::toggle(plan, &single, &runs, objectives[0]);
    let turned = plan.clone();
    let mut search = TreeSearch {
        single: turned,
        options,
        objectives,
        chosen: Default::default(),
        cache: Vec::new(),
        tried: Vec::new(),
    };
    chains.iter().for_each(|chain| search.chain(chain));
    *plan = search.chosen[0].applied(&search.single);
    frames::toggle(plan, &single, &runs, objectives[0]);
    cycles::choose(plan, &single, objectives[0]);
    if options.accelerations {
        let mut other = search.chosen[1].applied(&search.single);
        let objective = objectives[1];
        frames::toggle(&mut other, &single, &runs, objective);
        cycles::choose(&mut other, &single, objective);
        if objective.score(&other) < objective.score(plan) || !objective.accepts(plan, &single) {
            plan.accelerations = Some(Box::new(other));
        }
    }
    search.tried
}

/// Eliminations of chains, those beyond others first.
#[derive(Clone, Default)]
struct Choices(Vec<Choice>);

#[derive(Clone)]
struct Choice {
    chain: Vec<usize>,
    /// The best elimination, if there is one.
    best: Option<ChainElimination>,
    /// The best elimination that passes its columns on.
    passing: Option<ChainElimination>,
}

impl Choices {
    /// The plan with these eliminations.
    fn applied(&self, single: &Plan) -> Plan {
        let mut plan = single.clone();
        for Choice { chain, best, .. } in &self.0 {
            best.iter().for_each(|elimination| elimination.apply(&mut plan, chain));
        }
        plan
    }

    /// Those of the chains in a part of the mechanism, with its numbers of the nodes.
    fn inside(&self, numbers: &[Option<usize>]) -> Choices {
        let renumbered = |choice: &Choice| {
            let chain = choice.chain.iter().map(|&i| numbers[i]).collect::<Option<Vec<usize>>>()?;
            Some(Choice { chain, ..choice.clone() })
        };
        Choices(self.0.iter().filter_map(renumbered).collect())
    }
}

/// The search over a tree.
struct TreeSearch {
    /// The plan with one joint at a time.
    single: Plan,
    options: PlanOptions,
    /// One for the rates and one for the accelerations.
    objectives: [Objective; 2],
    /// The eliminations of the chains so far, for each objective.
    chosen: [Choices; 2],
    cache: Vec<Cached>,
    tried: Vec<Candidate>,
}

/// The result of the search for a chain, which is used for every chain that is alike, such as that of the other leg.
struct Cached {
    /// The structure of the part, and which of its nodes are the chain.
    letters: String,
    chain: Vec<usize>,
    /// The eliminations of the chain and of those beyond it, in the numbers of its part, for each objective.
    choices: [Choices; 2],
    tried: Vec<Candidate>,
}

impl TreeSearch {
    /// Chooses the elimination of the next chain.
    fn chain(&mut self, chain: &[usize]) {
        let (single, numbers) = self.single.branch(chain[0]);
        let letters = single.letters();
        let inside: Vec<usize> = chain.iter().filter_map(|&i| numbers[i]).collect();
        let beyond = self.chosen.each_ref().map(|choices| choices.inside(&numbers));
        let last = inside[inside.len() - 1];
        let inner = single.nodes.iter().any(|node| node.parent == Some(last));
        let part = ChainInPart { single, chain: inside, inner };
        let alike = |c: &Cached| c.letters == letters && c.chain == part.chain && self.is_accurate(&c.choices, &part);
        let like = self.cache.iter().position(alike);
        let like = like.unwrap_or_else(|| {
            let cached = self.search(&part, beyond, letters);
            self.cache.push(cached);
            self.cache.len() - 1
        });
        let Cached { choices, tried, .. } = &self.cache[like];
        let ends = [chain[0], chain[chain.len() - 1]];
        self.tried.extend(tried.iter().map(|c| Candidate { branch: ends, ..c.clone() }));
        // Numbers of the nodes in the whole, of those in the part.
        let whole: Vec<usize> = (0..numbers.len()).filter(|&i| numbers[i].is_some()).collect();
        for (chosen, found) in self.chosen.iter_mut().zip(choices) {
            for choice in &found.0 {
                let chain: Vec<usize> = choice.chain.iter().map(|&i| whole[i]).collect();
                let choice = Choice { chain, ..choice.clone() };
                match chosen.0.iter_mut().find(|c| c.chain == choice.chain) {
                    Some(old) => *old = choice,
                    None => chosen.0.push(choice),
                }
            }
        }
    }

    /// Whether eliminations are accurate with the numbers of another part.
    fn is_accurate(&self, choices: &[Choices; 2], part: &ChainInPart) -> bool {
        let used =
            choices.iter().zip(self.objectives).filter(|(choices, _)| choices.0.iter().any(|c| c.best.is_some()));
        used.into_iter().all(|(choices, objective)| objective.accepts(&choices.applied(&part.single), &part.single))
    }

    fn search(&self, part: &ChainInPart, beyond: [Choices; 2], letters: String) -> Cached {
        let fastest = (EliminationStrategy::Fastest, RolledCode::Auto);
        let as_rolled = (self.options.elimination, self.options.rolled) == fastest;
        let [mut first, mut second] = beyond;
        let mut search = ChainSearch::new(part, first.applied(&part.single), self.objectives[0]);
        search.run(None, as_rolled);
        open_beyond(&mut search, part, &mut first);
        let ChainSearch { chosen, passing, tried, mut seen, .. } = search;
        first.0.push(Choice { chain: part.chain.clone(), best: chosen, passing: passing.map(|(_, passing)| passing) });
        if self.options.accelerations {
            // Eliminations whose velocities need the fewest operations come first. The other operations of the rates
            // differ between eliminations, those of the accelerations hardly do.
            seen.sort_by_key(|(operations, _)| *operations);
            let tried = seen.into_iter().take(TRIED_FOR_ACCELERATIONS).map(|(_, elimination)| elimination);
            let mut search = ChainSearch::new(part, second.applied(&part.single), self.objectives[1]);
            search.run(Some(tried.collect()), as_rolled);
            open_beyond(&mut search, part, &mut second);
            let ChainSearch { chosen, passing, .. } = search;
            second.0.push(Choice {
                chain: part.chain.clone(),
                best: chosen,
                passing: passing.map(|(_, passing)| passing),
            });
        }
        Cached { letters, chain: part.chain.clone(), choices: [first, second], tried }
    }
}

/// Lets chains next beyond the one that was searched pass their columns on to it, like chains together and those with
/// the fewest columns first, and keeps what is better.
fn open_beyond(search: &mut ChainSearch, part: &ChainInPart, beyond: &mut Choices) {
    let last = part.chain[part.chain.len() - 1];
    let next = |choice: &Choice| part.single.nodes[choice.chain[0]].parent == Some(last);
    let mut kinds: Vec<Vec<usize>> = Vec::new();
    for k in (0..beyond.0.len()).filter(|&k| next(&beyond.0[k])) {
        let choice = &beyond.0[k];
        if choice.passing.is_none() || choice.best.as_ref().is_some_and(|best| best.passes || best.rolled) {
            continue;
        }
        let like = |kind: &Vec<usize>| {
            let other = &beyond.0[kind[0]];
            (other.chain.len(), &other.best, &other.passing) == (choice.chain.len(), &choice.best, &choice.passing)
        };
        match kinds.iter().position(like) {
            Some(kind) => kinds[kind].push(k),
            None => kinds.push(vec![k]),
        }
    }
    kinds.sort_by_key(|kind| kind.len() * beyond.0[kind[0]].chain.len());
    for kind in kinds {
        let mut trial = beyond.clone();
        kind.iter().for_each(|&k| trial.0[k].best = trial.0[k].passing.clone());
        if search.with_beyond(trial.applied(&part.single), search.with_more_columns()) {
            *beyond = trial;
        }
    }
}
