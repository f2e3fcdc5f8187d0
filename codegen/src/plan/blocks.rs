//! Tip blocks: the last joints of a branch solved together at the first of them.
//!
//! One joint at a time, every `M'` is full. Carried inward unreduced, the inertia of the outer bodies stays that of a
//! rigid body (three zeros in four after regrouping) and each joint adds a column; the block is then eliminated at its
//! innermost joint. Short blocks are cheaper, long ones are not: the generator counts, branch by branch.

use mbd_runtime::sweep::Quantity;
use mbd_runtime::tree::Source;

use super::{NodeKind, Plan, PoseStep};
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
    gather: usize,
}

/// Chooses a form for every chain that ends at a tip, one after the other.
pub fn choose(plan: &mut Plan) {
    if plan.nodes.len() > LARGEST {
        return;
    }
    let runs = parallel_runs(plan);
    toggle_unturned(plan, &runs, rates);
    let mut other = plan.clone();
    for chain in tip_chains(plan) {
        let mut search = Search::new(plan, &chain, rates);
        for form in first_forms(chain.len(), plan.nodes[chain[0]].parent.is_none()) {
            search.consider(form);
        }
        while search.neighbours(plan.nodes[chain[0]].parent.is_none()) {}
        let (seen, chosen) = (search.seen, search.chosen);
        choose_for_accelerations(&mut other, &chain, seen);
        if let Some((_, chosen)) = chosen {
            *plan = chosen;
        }
    }
    toggle_unturned(plan, &runs, rates);
    toggle_unturned(&mut other, &runs, accelerations);
    if accelerations(&other).0 < accelerations(plan).0 {
        plan.accelerations = Some(Box::new(other));
    }
}

/// Runs of pins about parallel axes: the nodes whose frames need not turn, because all that they carry next turns about
/// the same axis.
fn parallel_runs(plan: &Plan) -> Vec<Vec<usize>> {
    let swings = |i: usize| {
        let node = &plan.nodes[i];
        node.kind == NodeKind::Pin && node.place.iter().all(|step| matches!(step, PoseStep::Shift { .. }))
    };
    let mut runs: Vec<Vec<usize>> = Vec::new();
    for (i, node) in plan.nodes.iter().enumerate() {
        let mut children = plan.nodes.iter().enumerate().filter(|(_, n)| n.parent == Some(i)).peekable();
        if node.kind != NodeKind::Pin || children.peek().is_none() || !children.all(|(k, _)| swings(k)) {
            continue;
        }
        match runs.iter_mut().find(|run| node.parent.is_some_and(|p| run.contains(&p)) && swings(i)) {
            Some(run) => run.push(i),
            None => runs.push(vec![i]),
        }
    }
    runs
}

/// Turns or does not turn the frames of every run, whichever is cheaper.
fn toggle_unturned(plan: &mut Plan, runs: &[Vec<usize>], cost: Cost) {
    let mut best = cost(plan).0;
    for run in runs {
        let flip = |plan: &mut Plan| run.iter().for_each(|&i| plan.nodes[i].unturned ^= true);
        flip(plan);
        match cost(plan).0 {
            operations if operations < best => best = operations,
            _ => flip(plan),
        }
    }
}

/// Forms of a chain that are tried for the accelerations, beside their neighbours.
const TRIED: usize = 6;

/// Searches for the accelerations from those forms of a chain that lead to velocities with the fewest operations: what
/// the rates need beside them differs from form to form, what the accelerations need does hardly.
fn choose_for_accelerations(plan: &mut Plan, chain: &[usize], mut seen: Vec<(usize, Form)>) {
    seen.sort_by_key(|(operations, _)| *operations);
    let mut search = Search::new(plan, chain, accelerations);
    for (_, form) in seen.into_iter().take(TRIED) {
        search.consider(form);
    }
    while search.neighbours(plan.nodes[chain[0]].parent.is_none()) {}
    if let Some((_, chosen)) = search.chosen {
        *plan = chosen;
    }
}

/// Operations of an output, and those of them that lead to velocities.
type Cost = fn(&Plan) -> (usize, usize);

struct Search<'a> {
    cost: Cost,
    plan: &'a Plan,
    chain: &'a [usize],
    best: usize,
    chosen: Option<(Form, Plan)>,
    /// All forms so far, with the operations that lead to velocities.
    seen: Vec<(usize, Form)>,
}

impl<'a> Search<'a> {
    fn new(plan: &'a Plan, chain: &'a [usize], cost: Cost) -> Search<'a> {
        Search { cost, plan, chain, best: cost(plan).0, chosen: None, seen: Vec::new() }
    }

    /// Takes a form if it is better than all before.
    fn consider(&mut self, form: Form) -> bool {
        let mut candidate = self.plan.clone();
        apply(&mut candidate, self.chain, &form);
        let (operations, velocities) = (self.cost)(&candidate);
        // Momenta are the rates' alone.
        let seen = (velocities, Form { gather: 0, ..form.clone() });
        if !self.seen.contains(&seen) {
            self.seen.push(seen);
        }
        let better = operations < self.best;
        if better {
            self.best = operations;
            self.chosen = Some((form, candidate));
        }
        better
    }

    /// Tries forms that differ a little from the best; says whether one of them is better.
    fn neighbours(&mut self, from_ground: bool) -> bool {
        let Some((form, _)) = self.chosen.clone() else { return false };
        let len = self.chain.len();
        let mut near = Vec::new();
        if form.gather < len {
            near.push(Form { gather: form.gather + 1, ..form.clone() });
        }
        if from_ground && form.split < form.base {
            near.push(Form { split: form.split + 1, gather: form.gather.max(form.split + 1), ..form.clone() });
        }
        for k in 0..len.min(LONGEST) {
            let mut turned = form.turned.clone();
            turned[len - 1 - k] ^= true;
            near.push(Form { turned, ..form.clone() });
        }
        near.into_iter().fold(false, |better, form| self.consider(form) || better)
    }
}

/// The forms to begin with.
fn first_forms(len: usize, from_ground: bool) -> Vec<Form> {
    let mut forms = Vec::new();
    let mut add = |split: usize, base: usize, from: usize, gather: usize| {
        let form = Form { split, base, turned: (0..len).map(|k| k >= from).collect(), gather };
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

fn rates(plan: &Plan) -> (usize, usize) {
    cost(plan, Group::Rates, false)
}

fn accelerations(plan: &Plan) -> (usize, usize) {
    cost(plan, Group::Accelerations, true)
}

/// Operations of an output, and those of them that lead to velocities.
fn cost(plan: &Plan, group: Group, efforts: bool) -> (usize, usize) {
    use Quantity::{Inertia, Pivot, Remainder, Velocity};
    let options = Options { efforts, ..Options::default() };
    trace(plan, group, &options).map_or((usize::MAX, usize::MAX), |g| {
        let velocities = g.program.counts_where(|(_, what)| matches!(what, Inertia | Pivot | Remainder | Velocity));
        (g.program.counts().total(), velocities.total())
    })
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

fn apply(plan: &mut Plan, chain: &[usize], form: &Form) {
    for (&i, &turned) in chain.iter().zip(&form.turned) {
        plan.nodes[i].parent_side = turned;
    }
    for &i in &chain[..form.gather] {
        plan.nodes[i].gather = true;
    }
    let met = form.split == form.base && form.split > 0;
    let first = if met { form.base } else { form.base + 1 };
    for k in (first..chain.len()).rev() {
        let Some(g) = defer(plan, chain[k]) else { continue };
        for &j in &chain[first.max(form.base + 1)..=k] {
            plan.nodes[j].open.push(g);
        }
        if met {
            plan.nodes[chain[form.base]].ends.push(g);
            plan.solve_at_ground.push(g);
        } else {
            plan.nodes[chain[form.base]].solve_before.push(g);
        }
    }
    for k in (0..form.split).rev() {
        let Some(g) = defer(plan, chain[k]) else { continue };
        plan.nodes[chain[k]].ends.push(g);
        plan.solve_at_ground.push(g);
        let last = if met { form.split } else { form.split - 1 };
        for &j in &chain[k + 1..=last] {
            plan.nodes[j].screws.push(g);
        }
    }
}

/// Makes a freedom one that is solved further inboard; gives its number among the shared coordinates.
fn defer(plan: &mut Plan, i: usize) -> Option<usize> {
    let Source::State { v, .. } = plan.nodes[i].source else { return None };
    let g = plan.shared.len();
    plan.shared.push(v);
    plan.nodes[i].shared = Some(g);
    plan.nodes[i].deferred = true;
    Some(g)
}
