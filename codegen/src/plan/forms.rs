//! Elimination forms: which freedoms are solved one by one and which together, and where.
//!
//! One joint at a time, every `M'` is full. Carried inward unreduced, the inertia of the outer bodies stays that of a
//! rigid body (three zeros in four after regrouping) and each joint adds a column; such a block is eliminated at its
//! innermost joint. On a chain from the ground the inner joints can also send their screws outward to meet those columns
//! half-way. A joint can be eliminated on its parent's side, where nothing divided waits for its turn. Momentum rates come
//! from quadratic forms or from accumulated momenta. Frames between parallel joints need not turn. What is best depends
//! on zeros, so the generator makes the candidates and takes the one that the cost model likes best, branch by branch, if
//! its rounding errors are not much larger than those of one joint at a time.

use mbd_runtime::sweep::Quantity;
use mbd_runtime::tree::{Source, Unknown};

use super::accuracy::{ErrorEstimator, LIMIT};
use super::{NodeKind, Plan, PlanNode, PlanOptions, PoseStep};
use crate::options::{Arithmetic, Options, RolledCode};
use crate::output::Output;
use crate::rolled;
use crate::symbolic::{self, Cost, Label, Program};
use crate::trace::trace;

/// The longest block that is tried; beyond, the columns cost more than they save and conditioning suffers.
const LONGEST: usize = 10;

/// The shortest chain that is tried as a loop.
const TRIED_AS_LOOP: usize = 8;

/// Chains from this length on are loops without a search if their straight-line code is long: then it is far behind.
const LOOP: usize = 24;

/// Bytes of such code: more than a first-level cache has.
const LONG: f64 = 49152.0;

/// The same where chains are not laid out for loops.
const LOOP_OTHERWISE: usize = 16;

/// Trees beyond this are not searched: counting a candidate means to generate it.
const LARGEST: usize = 150;

/// How the joints are eliminated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EliminationStrategy {
    /// Branch by branch the form for which the rates take the least time for one state, by the cost model, of those whose
    /// rounding errors are not much larger than one joint at a time makes them.
    #[default]
    Fastest,
    /// Branch by branch the form for which the rates have the fewest operations, whatever its rounding errors.
    Fewest,
    /// Every joint by itself.
    Single,
}

impl EliminationStrategy {
    /// All of them.
    pub const ALL: [EliminationStrategy; 3] =
        [EliminationStrategy::Fastest, EliminationStrategy::Fewest, EliminationStrategy::Single];

    /// Its name in options.
    pub fn name(self) -> &'static str {
        match self {
            EliminationStrategy::Fastest => "fastest",
            EliminationStrategy::Fewest => "fewest",
            EliminationStrategy::Single => "single",
        }
    }

    /// What the search makes small.
    fn score(self, cost: &Cost) -> f64 {
        match self {
            EliminationStrategy::Fastest => cost.cycles(),
            EliminationStrategy::Fewest | EliminationStrategy::Single => cost.operations as f64,
        }
    }

    /// What a form may lose, see [`ErrorEstimator::loss`].
    fn limit(self) -> f64 {
        match self {
            EliminationStrategy::Fastest => LIMIT,
            EliminationStrategy::Fewest | EliminationStrategy::Single => f64::INFINITY,
        }
    }
}

/// How the freedoms of a chain are eliminated.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Form {
    /// Joints before this one (of a chain that starts at the ground) keep their screws, which are carried outward; they
    /// are solved together at the ground.
    split: usize,
    /// Joints from this one on are solved together: at `base`, or with those before `split` where the two meet. The last
    /// joint stands for no block.
    base: usize,
    /// Joints eliminated on the parent's side of their own motion.
    turned: Vec<bool>,
    /// Joints before this one get their momentum rates from accumulated momenta.
    accumulates_momentum: usize,
    /// Whether the joints are the turns of a loop.
    rolled: bool,
}

/// Chooses a form for every chain that ends at a tip. Each is searched with what carries it alone.
pub fn choose(plan: &mut Plan, options: PlanOptions) {
    if plan.nodes.len() > LARGEST {
        return;
    }
    let mut runs = parallel_runs(plan);
    let mut chains = tip_chains(plan);
    if options.forms == EliminationStrategy::Fastest {
        chains.retain(|chain| !chain.iter().any(|&i| plan.nodes[i].rolled));
        runs.retain(|run| !touches_loop(plan, run));
    }
    if chains.is_empty() && runs.is_empty() && plan.constraints.is_empty() {
        return;
    }
    let goals = [Output::Rates, Output::Accelerations].map(|group| Objective { forms: options.forms, group });
    let single = plan.clone();
    toggle_unturned(plan, &single, &runs, goals[0]);
    let mut other = options.accelerations.then(|| plan.clone());
    let mut known: Vec<Cached> = Vec::new();
    for chain in chains {
        let (branch, numbers) = plan.branch(chain[0]);
        let inside: Vec<usize> = chain.iter().filter_map(|&i| numbers[i]).collect();
        let here = Branch { letters: branch.letters(), plan: branch, chain: inside, goals };
        let like = known.iter().position(|k| k.letters == here.letters && k.is_accurate(&here));
        let like = like.unwrap_or_else(|| {
            known.push(here.search(options));
            known.len() - 1
        });
        let Cached { forms: [first, second], tried, .. } = &known[like];
        let ends = [chain[0], chain[chain.len() - 1]];
        plan.candidates.extend(tried.iter().map(|c| Candidate { branch: ends, ..c.clone() }));
        first.iter().for_each(|form| apply(plan, &chain, form));
        if let (Some(plan), Some(form)) = (&mut other, second) {
            apply(plan, &chain, form);
        }
    }
    toggle_unturned(plan, &single, &runs, goals[0]);
    super::cycles::choose(plan, &single, goals[0]);
    if let Some(mut other) = other {
        toggle_unturned(&mut other, &single, &runs, goals[1]);
        super::cycles::choose(&mut other, &single, goals[1]);
        if goals[1].score(&other) < goals[1].score(plan) || !goals[1].accepts(plan, &single) {
            plan.accelerations = Some(Box::new(other));
        }
    }
}

/// A branch with what carries it, and what it is searched for.
struct Branch {
    letters: String,
    plan: Plan,
    chain: Vec<usize>,
    goals: [Objective; 2],
}

/// What was found for a branch, and is right for every one like it: the other leg.
struct Cached {
    letters: String,
    /// For rates and for accelerations.
    forms: [Option<Form>; 2],
    tried: Vec<Candidate>,
}

impl Cached {
    /// Whether the forms are accurate with the numbers of another branch.
    fn is_accurate(&self, here: &Branch) -> bool {
        self.forms.iter().zip(here.goals).all(|(form, goal)| {
            form.as_ref().is_none_or(|form| {
                let mut plan = here.plan.clone();
                apply(&mut plan, &here.chain, form);
                goal.accepts(&plan, &here.plan)
            })
        })
    }
}

impl Branch {
    fn search(self, options: PlanOptions) -> Cached {
        let (plan, chain) = (&self.plan, &self.chain[..]);
        let as_loop = (options.forms, options.loops) == (EliminationStrategy::Fastest, RolledCode::Auto);
        let rolled = Form::rolled(chain.len()).filter(|_| as_loop);
        let from_ground = plan.nodes[chain[0]].parent.is_none();
        let mut search = Search::new(plan, chain, self.goals[0]);
        for form in first_forms(chain.len(), from_ground) {
            search.consider(form);
        }
        while search.neighbours(from_ground) {}
        if let Some(form) = &rolled {
            search.consider(form.clone());
        }
        let Search { chosen, tried, mut seen, .. } = search;
        let mut second = None;
        if options.accelerations {
            // From those forms that lead to velocities with the fewest operations: what the rates need beside them
            // differs from form to form, what the accelerations need does hardly.
            seen.sort_by_key(|(operations, _)| *operations);
            let mut search = Search::new(plan, chain, self.goals[1]);
            for (_, form) in seen.into_iter().take(TRIED) {
                search.consider(form);
            }
            while search.neighbours(from_ground) {}
            if let Some(form) = &rolled {
                search.consider(form.clone());
            }
            second = search.chosen;
        }
        Cached { forms: [chosen, second], tried, letters: self.letters }
    }
}

/// EliminationStrategy of a chain that are tried for the accelerations, beside their neighbours.
const TRIED: usize = 6;

/// Runs of pins about parallel axes: the nodes whose frames need not turn, because all that they carry next turns about
/// the same axis.
pub(super) fn parallel_runs(plan: &Plan) -> Vec<Vec<usize>> {
    let swings = |i: usize| {
        let node = &plan.nodes[i];
        node.kind == NodeKind::Revolute && node.place.iter().all(|step| matches!(step, PoseStep::Shift { .. }))
    };
    let mut runs: Vec<Vec<usize>> = Vec::new();
    for (i, node) in plan.nodes.iter().enumerate() {
        let mut children = plan.nodes.iter().enumerate().filter(|(_, n)| n.parent == Some(i)).peekable();
        if node.kind != NodeKind::Revolute || children.peek().is_none() || !children.all(|(k, _)| swings(k)) {
            continue;
        }
        match runs.iter_mut().find(|run| node.parent.is_some_and(|p| run.contains(&p)) && swings(i)) {
            Some(run) => run.push(i),
            None => runs.push(vec![i]),
        }
    }
    runs
}

/// Turns or does not turn the frames of every run, whichever is cheaper, if that is accurate; `single` has joints one by
/// one.
fn toggle_unturned(plan: &mut Plan, single: &Plan, runs: &[Vec<usize>], goal: Objective) {
    for run in runs {
        if goal.forms == EliminationStrategy::Fastest && touches_loop(plan, run) {
            continue;
        }
        let (mut branch, numbers) = plan.branch(run[0]);
        let score = goal.score(&branch);
        run.iter().filter_map(|&i| numbers[i]).for_each(|i| branch.nodes[i].elimination.non_rotating ^= true);
        if goal.score(&branch) < score && goal.accepts(&branch, &single.branch(run[0]).0) {
            run.iter().for_each(|&i| plan.nodes[i].elimination.non_rotating ^= true);
        }
    }
}

/// What is to be made small.
#[derive(Clone, Copy)]
pub(super) struct Objective {
    forms: EliminationStrategy,
    group: Output,
}

/// What forms are compared by. Joint forces cost the rates an addition each, whatever the form.
pub(super) fn options(group: Output) -> Options {
    Options { efforts: group != Output::Rates, arithmetic: Arithmetic::Exact, ..Options::default() }
}

/// The output of a plan, and its cost.
struct Evaluation {
    program: Program,
    cost: Cost,
}

impl Evaluation {
    /// Operations that lead to velocities.
    fn velocities(&self) -> usize {
        use Quantity::{BiasMomentum, Inertia, Pivot, Velocity};
        let velocities = |(_, what): &Label| matches!(what, Inertia | Pivot | BiasMomentum | Velocity);
        self.program.counts_where(velocities).total()
    }
}

impl Objective {
    /// Makes the output of a plan as the sweeps do.
    fn look(self, plan: &Plan) -> Option<Evaluation> {
        let program = trace(plan, self.group, &options(self.group)).ok()?.program;
        Some(Evaluation { cost: symbolic::cost(&program), program })
    }

    pub(super) fn score(self, plan: &Plan) -> f64 {
        self.look(plan).map_or(f64::INFINITY, |look| self.forms.score(&look.cost))
    }

    /// Whether a plan is accurate; `single` is the same with joints one by one.
    pub(super) fn accepts(self, plan: &Plan, single: &Plan) -> bool {
        let limit = self.forms.limit();
        let loss = || self.look(plan).map(|look| ErrorEstimator::new(single, self.group).loss(&look.program));
        limit == f64::INFINITY || loss().is_some_and(|loss| loss <= limit)
    }
}

struct Search<'a> {
    plan: &'a Plan,
    chain: &'a [usize],
    goal: Objective,
    judge: ErrorEstimator,
    best: f64,
    chosen: Option<Form>,
    tried: Vec<Candidate>,
    /// All forms so far, with the operations that lead to velocities.
    seen: Vec<(usize, Form)>,
}

impl Form {
    /// A chain as the turns of a loop, whose time is that of the shortest way through a link: one joint at a time, on the
    /// parent's side.
    fn rolled(len: usize) -> Option<Form> {
        let form = Form { split: 0, base: len - 1, turned: vec![true; len], accumulates_momentum: 0, rolled: true };
        (len >= TRIED_AS_LOOP).then_some(form)
    }

    /// In words.
    fn words(&self, len: usize) -> String {
        if self.rolled {
            return "a loop".to_string();
        }
        let mut words = Vec::new();
        let met = self.split == self.base && self.split > 0;
        match (met, len - self.base) {
            (true, k) => words.push(format!("all at the ground: {} screws out, {k} columns in", self.split)),
            (false, 1) if self.split == 0 => words.push("one by one".to_string()),
            (false, 1) => {}
            (false, k) => words.push(format!("last {k} together")),
        }
        if !met && self.split > 0 {
            words.push(format!("first {} at the ground", self.split));
        }
        let turned = self.turned.iter().filter(|t| **t).count();
        if turned > 0 {
            words.push(format!("{turned} on the parent's side"));
        }
        if self.accumulates_momentum > 0 {
            words.push(format!("momenta of {}", self.accumulates_momentum));
        }
        words.join("; ")
    }
}

/// A form that was tried for a branch.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// First and last node of the branch.
    pub branch: [usize; 2],
    /// Nodes of the branch and of what carries it.
    pub nodes: usize,
    /// The form in words.
    pub form: String,
    /// Cost of the rates of the branch and of what carries it, without joint forces.
    pub cost: Cost,
    /// Rounding error in multiples of that of one joint at a time, measured where the form costs less than those before:
    /// of the array that loses most, in the mean, the median or the worst states.
    pub loss: Option<f64>,
    /// Whether the form was left for its rounding errors.
    pub refused: bool,
    /// Whether it was taken.
    pub taken: bool,
}

impl<'a> Search<'a> {
    fn new(plan: &'a Plan, chain: &'a [usize], goal: Objective) -> Search<'a> {
        let judge = ErrorEstimator::new(plan, goal.group);
        Search { plan, chain, goal, judge, best: f64::INFINITY, chosen: None, tried: Vec::new(), seen: Vec::new() }
    }

    /// Takes a form if it is better than all before, and accurate.
    fn consider(&mut self, form: Form) -> bool {
        let mut candidate = self.plan.clone();
        apply(&mut candidate, self.chain, &form);
        let Some(mut look) = self.goal.look(&candidate) else { return false };
        if form.rolled {
            let options = Options { arithmetic: Arithmetic::Fast, ..options(self.goal.group) };
            let Some(cost) = rolled::cost(&candidate, self.goal.group, &options) else { return false };
            look.cost = cost;
        }
        // Momenta are the rates' alone.
        let seen = (look.velocities(), Form { accumulates_momentum: 0, ..form.clone() });
        if !form.rolled && !self.seen.contains(&seen) {
            self.seen.push(seen);
        }
        let score = self.goal.forms.score(&look.cost);
        let loss = (score < self.best).then(|| self.judge.loss(&look.program));
        let refused = loss.is_some_and(|loss| loss > self.goal.forms.limit());
        let better = loss.is_some() && !refused;
        let branch = [self.chain[0], self.chain[self.chain.len() - 1]];
        if better {
            self.best = score;
            self.tried.iter_mut().for_each(|c| c.taken = false);
        }
        self.tried.push(Candidate {
            branch,
            nodes: self.plan.nodes.len(),
            form: form.words(self.chain.len()),
            cost: look.cost,
            loss,
            refused,
            taken: better,
        });
        if better {
            self.chosen = Some(form);
        }
        better
    }

    /// Tries forms that differ a little from the best; says whether one of them is better.
    fn neighbours(&mut self, from_ground: bool) -> bool {
        let Some(form) = self.chosen.clone() else { return false };
        let len = self.chain.len();
        let mut near = Vec::new();
        if form.accumulates_momentum < len {
            near.push(Form { accumulates_momentum: form.accumulates_momentum + 1, ..form.clone() });
        }
        if from_ground && form.split < form.base {
            near.push(Form {
                split: form.split + 1,
                accumulates_momentum: form.accumulates_momentum.max(form.split + 1),
                ..form.clone()
            });
        }
        for k in 0..len.min(LONGEST) {
            let mut turned = form.turned.clone();
            turned[len - 1 - k] ^= true;
            near.push(Form { turned, ..form.clone() });
        }
        // All of them, not only up to the first that is better.
        near.into_iter().filter(|form| self.consider(form.clone())).count() > 0
    }
}

/// The forms to begin with.
fn first_forms(len: usize, from_ground: bool) -> Vec<Form> {
    let mut forms = Vec::new();
    let mut add = |split: usize, base: usize, from: usize, accumulates_momentum: usize| {
        let form =
            Form { split, base, turned: (0..len).map(|k| k >= from).collect(), accumulates_momentum, rolled: false };
        if !forms.contains(&form) {
            forms.push(form);
        }
    };
    for base in (0..len).filter(|base| len - base <= LONGEST) {
        for from in [0, base, len] {
            add(0, base, from, 0);
            if from_ground && base > 0 && base <= LONGEST {
                add(base, base, from, base);
            }
        }
    }
    for split in (1..len.min(LONGEST)).filter(|_| from_ground) {
        for gather in [split, len] {
            add(split, len - 1, 0, gather);
        }
    }
    forms
}

/// A joint of one freedom that is solved by itself.
fn eligible(node: &PlanNode) -> bool {
    let single = matches!(node.kind, NodeKind::Revolute | NodeKind::Prismatic | NodeKind::Helical(_));
    let plain = node.elimination.unknown.is_none()
        && node.elimination.solve_before.is_empty()
        && node.elimination.open.is_empty();
    single && plain && matches!(node.source, Source::State { .. })
}

/// The same, though columns of constraints go by.
fn eligible_in_loop(plan: &Plan, i: usize) -> bool {
    let row = |g: &usize| matches!(plan.unknowns[*g], Unknown::Row(_));
    let mut node = plan.nodes[i].clone();
    node.elimination.open.retain(|g| !row(g));
    eligible(&node)
}

/// Number of children of every node.
fn children(plan: &Plan) -> Vec<usize> {
    let mut children = vec![0; plan.nodes.len()];
    for parent in plan.nodes.iter().filter_map(|n| n.parent) {
        children[parent] += 1;
    }
    children
}

/// Whether a loop has one of these nodes, or starts behind one: a frame that does not turn leaves its children to it, too.
fn touches_loop(plan: &Plan, nodes: &[usize]) -> bool {
    let touches = |k: usize, i: usize| k == i || plan.nodes[k].parent == Some(i);
    (0..plan.nodes.len()).any(|k| plan.nodes[k].rolled && nodes.iter().any(|&i| touches(k, i)))
}

/// Marks what may become loops: all that repeats, or what is long enough to gain by it for sure. The search adds to it.
pub fn lay_out(plan: &mut Plan, options: PlanOptions) {
    let fastest = options.forms == EliminationStrategy::Fastest;
    let least = match (options.loops, fastest) {
        (RolledCode::Never, _) => return,
        (RolledCode::Always, true) => 3,
        (RolledCode::Always, false) => 1,
        (RolledCode::Auto, true) => LOOP,
        (RolledCode::Auto, false) => LOOP_OTHERWISE,
    };
    let mut long = paths(plan, least);
    if (options.loops, fastest) == (RolledCode::Auto, true) && plan.nodes.len() <= LARGEST {
        let goal = Objective { forms: options.forms, group: Output::Rates };
        long.retain(|path| goal.look(&plan.branch(path[0]).0).is_none_or(|look| look.cost.bytes > LONG));
    }
    for i in long.concat() {
        plan.nodes[i].rolled = true;
        plan.nodes[i].elimination.before_joint = fastest && eligible_in_loop(plan, i);
    }
}

/// Joints one behind the other, without branches, at least so many.
fn paths(plan: &Plan, least: usize) -> Vec<Vec<usize>> {
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

/// Runs of single-freedom joints that end at a tip, inner joint first.
fn tip_chains(plan: &Plan) -> Vec<Vec<usize>> {
    let children = children(plan);
    let eligible = |i: usize| eligible(&plan.nodes[i]);
    let tips = (0..plan.nodes.len()).filter(|&i| children[i] == 0 && eligible(i));
    tips.map(|tip| {
        let up =
            std::iter::successors(Some(tip), |&i| plan.nodes[i].parent.filter(|&p| children[p] == 1 && eligible(p)));
        let mut chain: Vec<usize> = up.collect();
        chain.reverse();
        chain
    })
    .collect()
}

fn apply(plan: &mut Plan, chain: &[usize], form: &Form) {
    for (&i, &turned) in chain.iter().zip(&form.turned) {
        plan.nodes[i].elimination.before_joint = turned;
        plan.nodes[i].rolled |= form.rolled;
        plan.nodes[i].elimination.non_rotating &= !form.rolled;
    }
    for &i in &chain[..form.accumulates_momentum] {
        plan.nodes[i].elimination.accumulates_momentum = true;
    }
    let met = form.split == form.base && form.split > 0;
    let first = if met { form.base } else { form.base + 1 };
    for k in (first..chain.len()).rev() {
        let Some(g) = defer(plan, chain[k]) else { continue };
        for &j in &chain[first.max(form.base + 1)..=k] {
            plan.nodes[j].elimination.open.push(g);
        }
        if met {
            plan.nodes[chain[form.base]].elimination.ends.push(g);
            plan.solve_at_ground.push(g);
        } else {
            plan.nodes[chain[form.base]].elimination.solve_before.push(g);
        }
    }
    for k in (0..form.split).rev() {
        let Some(g) = defer(plan, chain[k]) else { continue };
        plan.nodes[chain[k]].elimination.ends.push(g);
        plan.solve_at_ground.push(g);
        let last = if met { form.split } else { form.split - 1 };
        for &j in &chain[k + 1..=last] {
            plan.nodes[j].elimination.screws.push(g);
        }
    }
}

/// Makes a freedom one that is solved further inboard; gives its number among the shared coordinates.
fn defer(plan: &mut Plan, i: usize) -> Option<usize> {
    let Source::State { v, .. } = plan.nodes[i].source else { return None };
    let g = plan.unknowns.len();
    plan.unknowns.push(Unknown::Velocity(v));
    plan.nodes[i].elimination.unknown = Some(g);
    plan.nodes[i].elimination.deferred = true;
    Some(g)
}
