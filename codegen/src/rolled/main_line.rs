//! The tree without the turns of its runs, taken through the passes: what is left is straight-line code between loops.

use mbd_runtime::tree::Constraint;

use super::link::Link;
use super::pass_state::{read, PassState};
use super::runs::Run;
use super::twins::{signed, value};
use super::SweepDirection;
use crate::output::InputArray;
use crate::symbolic::{Expr, Graph, Op};
use crate::trace::SymbolicInputs;

/// A pass over a run, as the rest of the tree sees it.
pub struct Event<'m> {
    /// Length of the graph before it.
    pub at: usize,
    /// Run.
    pub run: usize,
    /// Number of the pass among those of the link that carry something.
    pub pass: usize,
    /// Its direction.
    pub direction: SweepDirection,
    /// What is carried into the first turn.
    pub start: Vec<Expr<'m>>,
    /// What the last turn carries out: symbols or constants.
    pub end: Vec<Expr<'m>>,
    /// What every branch hands to the parent, where turns are branches; then `end` is empty.
    pub handed: Vec<Vec<Expr<'m>>>,
}

/// Walks the tree and takes the links of the runs along.
pub struct MainLine<'m, 'a> {
    /// Graph of everything outside runs.
    pub graph: &'m Graph,
    /// Its tree.
    pub stage: PassState<'m, 'a>,
    /// Its inputs.
    pub given: SymbolicInputs<'m>,
    /// Runs, inner first.
    pub runs: &'a [Run],
    /// Passes over runs, in order.
    pub events: Vec<Event<'m>>,
    /// Number of the next symbol.
    pub next_input: usize,
    /// Whether branches cannot be computed in loops: one takes in what another one hands over unchanged, which has no place
    /// between loops, or hands over what its parent does not take.
    pub unfit: bool,
    /// Number of the last pass.
    pub last: usize,
}

impl<'m> MainLine<'m, '_> {
    /// One pass over the whole tree.
    pub fn pass(&mut self, pass: usize, direction: SweepDirection, links: &mut [Link<'_, '_>]) {
        self.stage.begin(pass, &self.given);
        let n = self.stage.tree.nodes.len();
        match direction {
            SweepDirection::TipToBase => {
                for run in self.runs.iter().filter(|run| run.branches.is_none()) {
                    // The first turn adds the body itself.
                    self.stage.carried(pass, run.last(), &self.given, |e| *e = Expr::Const(0.0));
                }
                let chains = |(_, run): &(usize, &Run)| run.branches.is_none();
                let mut runs = self.runs.iter().enumerate().rev().filter(chains).peekable();
                let mut i = n;
                while i > 0 {
                    if self.in_branch(i - 1, pass, direction, links) {
                        i -= 1;
                        continue;
                    }
                    match runs.next_if(|(_, run)| run.nodes.end == i) {
                        Some((k, run)) => {
                            self.run(k, pass, direction, links);
                            i = run.nodes.start;
                        }
                        None => {
                            i -= 1;
                            self.stage.node(pass, i, &self.given);
                        }
                    }
                }
            }
            SweepDirection::BaseToTip => {
                let chains = |(_, run): &(usize, &Run)| run.branches.is_none();
                let mut runs = self.runs.iter().enumerate().filter(chains).peekable();
                let mut i = 0;
                while i < n {
                    if self.in_branch(i, pass, direction, links) {
                        i += 1;
                        continue;
                    }
                    match runs.next_if(|(_, run)| run.nodes.start == i) {
                        Some((k, run)) => {
                            self.run(k, pass, direction, links);
                            i = run.nodes.end;
                        }
                        None => {
                            self.stage.node(pass, i, &self.given);
                            i += 1;
                        }
                    }
                }
            }
        }
        self.stage.end(pass, &self.given);
    }

    fn run(&mut self, k: usize, pass: usize, direction: SweepDirection, links: &mut [Link<'_, '_>]) {
        let run = &self.runs[k];
        let Some(parent) = self.stage.tree.nodes[run.nodes.start].parent else { return };
        let (from, to) = match direction {
            SweepDirection::TipToBase => (run.last(), parent),
            SweepDirection::BaseToTip => (parent, run.last()),
        };
        let (stage, given) = (&mut self.stage, &self.given);
        let mut start = read(|visit| stage.carried(pass, from, given, visit));
        start.extend(read(|visit| stage.running(pass, given, visit)));
        let at = self.graph.len();
        links[k].pass(pass, direction, &start);
        if start.is_empty() {
            return;
        }
        let number = links[k].passes.len() - 1;
        let (negative, twins) = (&links[k].passes[number].negative, &links[k].passes[number].twins);
        start.iter_mut().zip(negative).filter(|(_, negative)| **negative).for_each(|(e, _)| *e = -*e);
        let next = &mut self.next_input;
        let graph = self.graph;
        let end: Vec<Expr<'m>> = links[k].passes[number]
            .outgoing
            .iter()
            .zip(twins)
            .map(|(out, twin)| match *out {
                Expr::Const(x) => Expr::Const(x),
                // What another place carries has none of its own.
                Expr::Node { .. } if twin.is_some() => Expr::Const(0.0),
                Expr::Node { .. } => {
                    *next += 1;
                    graph.input(*next - 1)
                }
            })
            .collect();
        let own = |k: usize| signed(end[k], negative[k]);
        let mut out = twins.iter().enumerate().map(|(k, twin)| value(*twin, k, own));
        let mut next = || out.next().expect("a pass hands on as much as it takes in");
        match direction {
            SweepDirection::TipToBase => stage.carried(pass, to, given, |e| *e = *e + next()),
            SweepDirection::BaseToTip => stage.carried(pass, to, given, |e| *e = next()),
        }
        stage.running(pass, given, |e| *e = next());
        self.events.push(Event { at, run: k, pass: number, direction, start, end, handed: Vec::new() });
    }

    /// Whether node `i` is in a branch that has others like it. The first of their roots to be met takes all of them
    /// through the pass, and from tip to base each root hands its share to the parent in its turn.
    fn in_branch(&mut self, i: usize, pass: usize, direction: SweepDirection, links: &mut [Link<'_, '_>]) -> bool {
        let set = self.runs.iter().enumerate().find_map(|(k, run)| {
            let branches = run.branches.as_ref()?;
            let turn = branches.roots.iter().position(|root| (*root..root + run.period).contains(&i))?;
            Some((k, branches, turn))
        });
        let Some((k, branches, turn)) = set else { return false };
        if i != branches.roots[turn] {
            return true;
        }
        let met_first = match direction {
            SweepDirection::TipToBase => branches.roots.len() - 1,
            SweepDirection::BaseToTip => 0,
        };
        if turn == met_first {
            let event = match branches.parent {
                Some(parent) => self.branches((k, parent), pass, direction, &mut links[k]),
                None => self.on_ground(k, pass, direction, &mut links[k]),
            };
            self.events.extend(event);
        }
        let Some(parent) = branches.parent else { return true };
        let of_run = self.events.iter().rev().find(|event| event.run == k);
        if let (SweepDirection::TipToBase, Some(event)) = (direction, of_run) {
            let mut handed = event.handed[turn].iter();
            // Less is at hand only where the branches are unfit.
            self.stage.carried(pass, parent, &self.given, |e| {
                if let Some(share) = handed.next() {
                    *e = *e + *share;
                }
            });
        }
        true
    }

    /// A pass through like mechanisms on the ground: an event when all passes are done.
    fn on_ground(
        &self,
        k: usize,
        pass: usize,
        direction: SweepDirection,
        link: &mut Link<'_, '_>,
    ) -> Option<Event<'m>> {
        let start = self.given.gravity.to_vec();
        link.pass_on_ground((pass, self.last), direction, &start);
        let (at, handed) = (self.graph.len(), Vec::new());
        (pass == self.last).then_some(Event { at, run: k, pass: 0, direction, start, end: Vec::new(), handed })
    }

    /// Whether all early rows act, as [`PassState::early_rows_act`] tells of the rest of the tree and of each branch, which hands it to
    /// its parent in the last pass from tip to base. `None` where that is the ground.
    pub fn early_rows_act(&self) -> Option<Expr<'m>> {
        let mut all = self.stage.early_rows_act();
        for k in 0..self.runs.len() {
            let inward = |event: &&Event| event.run == k && event.direction == SweepDirection::TipToBase;
            for handed in &self.events.iter().rev().find(inward)?.handed {
                all = all * *handed.last()?;
            }
        }
        Some(all)
    }

    /// What the branches of a run take in besides what their parent hands to them: if constraints bind them to the ground, the poses
    /// on the paths from there, and gravity.
    fn taken_from_ground(&mut self, k: usize) -> Vec<Expr<'m>> {
        let Some(branches) = &self.runs[k].branches else { return Vec::new() };
        let rows = branches.first.rows..branches.first.rows + branches.size.rows;
        let stub = |c: &Constraint<Expr>| c.slots.is_empty() && rows.contains(&c.first);
        let mut all: Vec<Expr<'m>> = self.stage.poses_on_paths(stub).into_iter().map(|e| *e).collect();
        if !all.is_empty() {
            all.extend(self.given.gravity);
        }
        all
    }

    fn branches(
        &mut self,
        (k, parent): (usize, usize),
        pass: usize,
        direction: SweepDirection,
        link: &mut Link<'_, '_>,
    ) -> Option<Event<'m>> {
        let (mut keys, mut start) = (Vec::new(), Vec::new());
        self.stage.carried_by_sweeps(pass, parent, &self.given, |key, e| {
            keys.push(key);
            start.push(*e);
        });
        match direction {
            SweepDirection::TipToBase => start.clear(),
            SweepDirection::BaseToTip => start.extend(self.taken_from_ground(k)),
        }
        let given: usize = self.given.arrays.iter().map(InputArray::len).sum();
        self.unfit |= start.iter().any(|e| match *e {
            Expr::Node { id, .. } => matches!(self.graph.get(id).0, Op::Input(k) if k as usize >= given),
            Expr::Const(_) => false,
        });
        let at = self.graph.len();
        if link.pass_of_branch(pass, direction, (&keys, &start)).is_none() {
            self.unfit = true;
            return None;
        }
        let number = link.passes.len() - 1;
        let negative = &link.passes[number].negative;
        let mut handed = Vec::new();
        for row in &self.runs[k].table {
            // What depends on constants alone is a constant here too.
            let shares = link.constants(number, row).into_iter().zip(negative).map(|(constant, negative)| {
                let end = constant.map(Expr::Const).unwrap_or_else(|| {
                    self.next_input += 1;
                    self.graph.input(self.next_input - 1)
                });
                signed(end, *negative)
            });
            handed.push(shares.collect());
        }
        Some(Event { at, run: k, pass: number, direction, start, end: Vec::new(), handed })
    }
}
