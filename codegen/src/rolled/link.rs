//! One turn of a run by itself: a dummy node in the place of the rest of the tree, and the links of one period behind
//! it, taken through the passes with symbols for what they carry in.

use std::collections::BTreeMap;

use mbd_runtime::sweep::pass::Pass;
use mbd_runtime::tree::{Source, Tree};
use mbd_runtime::Scalar;

use super::pass_state::{read, PassState};
use super::runs::{Extent, Run, Slot};
use super::turn_constants::constant;
use super::turn_tree::{size_of, turn_tree};
use super::twins::{signed, value, Twin, Twins};
use super::SweepDirection;
use crate::output::Output;
use crate::symbolic::{Expr, Graph};
use crate::trace::SymbolicInputs;

/// What an input of a link's graph is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkInput {
    /// Column of the table of constants.
    Column(usize),
    /// Coordinate of the turn.
    Q(usize),
    /// Momentum or velocity of the turn.
    Second(usize),
    /// Acceleration of the turn.
    Third(usize),
    /// Joint force of the turn.
    Tau(usize),
    /// What a pass carries in: pass and place.
    Carried(usize, usize),
}

/// A pass through one turn.
pub struct LinkPass<'g> {
    /// Symbols carried in; constants where every turn takes in the same, and where [`LinkPass::twins`] has the value.
    pub incoming: Vec<Expr<'g>>,
    /// Where the value is that of an earlier place in all turns: that place.
    pub twins: Vec<Option<Twin>>,
    /// What is carried out.
    pub outgoing: Vec<Expr<'g>>,
    /// Where the negative is carried, because that is what a turn computes.
    pub negative: Vec<bool>,
    /// Length of the graph after it.
    pub end: usize,
}

/// One turn of a run on its way through the passes.
pub struct Link<'g, 'a> {
    graph: &'g Graph,
    stage: PassState<'g, 'a>,
    given: SymbolicInputs<'g>,
    /// Nodes beside the one that stands for the rest of the tree, if there is one.
    nodes: usize,
    /// That of them on which the next turn of a chain hangs.
    exit: usize,
    /// What the graph's inputs are.
    pub inputs: Vec<LinkInput>,
    /// Passes done that carry something.
    pub passes: Vec<LinkPass<'g>>,
    /// Coordinates, velocities and rows of one turn.
    pub size: Extent,
    /// By how much the first coordinate, velocity and row move on from turn to turn.
    pub stride: Extent,
}

impl<'g, 'a> Link<'g, 'a> {
    /// Nothing done yet; `None` for outputs that are never rolled. The passes are those of the whole tree.
    pub fn new(
        graph: &'g Graph,
        group: Output,
        run: &Run,
        tree: &Tree<Expr<'_>>,
        efforts: bool,
        passes: &'a [Pass],
    ) -> Option<Self> {
        let mut inputs = Vec::new();
        let mut symbols = |of: &dyn Fn(usize) -> LinkInput, n: usize| -> Vec<Expr<'g>> {
            let first = inputs.len();
            inputs.extend((0..n).map(of));
            (first..first + n).map(|k| graph.input(k)).collect()
        };
        let columns = symbols(&LinkInput::Column, run.table[0].len());
        let mut slot = |slot| match slot {
            Slot::Const(x) => Expr::Const(x),
            Slot::Column(c) => columns[c],
        };
        let size = size_of(run);
        let stride = run.branches.as_ref().map_or(size, |b| b.stride);
        let zero = Expr::zero();
        let given = SymbolicInputs {
            arrays: Vec::new(),
            q: symbols(&LinkInput::Q, size.q),
            second: symbols(&LinkInput::Second, size.v),
            third: symbols(&LinkInput::Third, if group.spec().inputs.len() > 2 { size.v } else { 0 }),
            tau: symbols(&LinkInput::Tau, if efforts { size.v } else { 0 }),
            // The node at which rows are solved stands still by these; nothing reads them for the dummy.
            drive: [vec![zero; 3], vec![zero; 3], vec![zero; 3]],
            wrenches: Vec::new(),
            params: Vec::new(),
            gravity: [zero; 3],
            acts: Vec::new(),
        };
        let tree = turn_tree(run, size, tree, &mut slot);
        let stand_in = tree.nodes.first().is_some_and(|node| matches!(node.source, Source::Drive { .. }));
        let nodes = tree.nodes.len() - usize::from(stand_in);
        let stage = PassState::new(group, graph, tree, passes)?;
        let exit = run.exit + 1;
        Some(Link { graph, stage, given, nodes, exit, inputs, passes: Vec::new(), size, stride })
    }

    /// A pass, carrying in `first` at its first turn. What is constant there and stays so from turn to turn is a
    /// constant of the loop, and what equals another value there and stays so is carried once; the rest become symbols.
    pub fn pass(&mut self, pass: usize, direction: SweepDirection, first: &[Expr<'_>]) {
        let number = self.passes.len();
        let mut known: Vec<Option<f64>> =
            first.iter().map(|e| if let Expr::Const(x) = e { Some(*x) } else { None }).collect();
        let symbols: Vec<Expr<'g>> = (0..first.len()).map(|k| self.symbol(number, k)).collect();
        let mut twins = Twins::before(first);
        let mut negative = vec![false; first.len()];
        // Signs are chosen once: choosing them again could go on for ever.
        let mut choose = true;
        loop {
            let own = |k: usize| signed(symbols[k], negative[k]);
            let symbol = |k: usize| value(twins.of(k), k, own);
            let incoming: Vec<Expr<'g>> =
                known.iter().enumerate().map(|(k, known)| known.map_or(symbol(k), Expr::Const)).collect();
            let mut stage = self.stage.clone();
            let outgoing = self.turn(&mut stage, pass, direction, &incoming);
            let mut settled = true;
            for (known, out) in known.iter_mut().zip(&outgoing) {
                if known.is_some_and(|x| !matches!(out, Expr::Const(y) if *y == x)) {
                    *known = None;
                    settled = false;
                }
            }
            settled &= twins.part(&outgoing);
            if settled && std::mem::take(&mut choose) {
                for (k, (negative, out)) in negative.iter_mut().zip(&outgoing).enumerate() {
                    let own = known[k].is_none() && twins.of(k).is_none();
                    *negative = own && matches!(out, Expr::Node { neg: true, .. });
                }
                settled = !negative.contains(&true);
            }
            if settled {
                self.stage = stage;
                if first.is_empty() {
                    return;
                }
                let outgoing = outgoing.into_iter().zip(&negative).map(|(e, negative)| signed(e, *negative)).collect();
                let end = self.graph.len();
                // What is a constant has no twin, and what has one no symbol.
                let variable = |(twin, known): (Option<Twin>, &Option<f64>)| twin.filter(|_| known.is_none());
                let twins: Vec<_> = twins.places().into_iter().zip(&known).map(variable).collect();
                let own = |(symbol, twin): (_, &Option<Twin>)| if twin.is_some() { Expr::zero() } else { symbol };
                let incoming = symbols_of(&incoming).into_iter().zip(&twins).map(own).collect();
                self.passes.push(LinkPass { incoming, twins, outgoing, negative, end });
                return;
            }
        }
    }

    /// A symbol for what is carried into pass number `number` at place `k`.
    fn symbol(&mut self, number: usize, k: usize) -> Expr<'g> {
        self.inputs.push(LinkInput::Carried(number, k));
        self.graph.input(self.inputs.len() - 1)
    }

    fn turn(
        &self,
        stage: &mut PassState<'g, 'a>,
        pass: usize,
        direction: SweepDirection,
        incoming: &[Expr<'g>],
    ) -> Vec<Expr<'g>> {
        let given = &self.given;
        stage.begin(pass, given);
        let (inner, exit, outer) = (0, self.exit, self.nodes);
        let mut incoming = incoming.iter();
        let mut next = || *incoming.next().expect("a pass takes in as much as it hands on");
        match direction {
            SweepDirection::TipToBase => stage.carried(pass, exit, given, |e| *e = *e + next()),
            SweepDirection::BaseToTip => stage.carried(pass, inner, given, |e| *e = next()),
        }
        stage.running(pass, given, |e| *e = next());
        let last = match direction {
            SweepDirection::TipToBase => {
                (1..=outer).rev().for_each(|i| stage.node(pass, i, given));
                inner
            }
            SweepDirection::BaseToTip => {
                (1..=outer).for_each(|i| stage.node(pass, i, given));
                exit
            }
        };
        let mut out = read(|visit| stage.carried(pass, last, given, visit));
        out.extend(read(|visit| stage.running(pass, given, visit)));
        out
    }

    /// A pass through a branch: outward with what the parent hands to all branches, inward with what each hands to the
    /// parent. `keys` tell which numbers these are, as [`PassState::carried_by_sweeps`] gives them; further numbers from the
    /// parent are those of [`PassState::poses_on_paths`], and gravity. Inward, where contacts have early rows, one more
    /// tells whether all of them act. `None`: a branch hands on others.
    pub fn pass_of_branch(
        &mut self,
        pass: usize,
        direction: SweepDirection,
        (keys, from_parent): (&[[usize; 2]], &[Expr<'_>]),
    ) -> Option<()> {
        let number = self.passes.len();
        self.stage.begin(pass, &self.given);
        let incoming = self.taken_in(number, from_parent);
        if let Some((poses, gravity)) = incoming.get(keys.len()..).and_then(<[_]>::split_last_chunk) {
            self.stage.poses_on_paths(|_| true).into_iter().zip(poses).for_each(|(e, pose)| *e = *pose);
            self.given.gravity = *gravity;
        }
        let mut all = BTreeMap::new();
        let (given, outer) = (&self.given, self.nodes);
        match direction {
            SweepDirection::BaseToTip => {
                let next: BTreeMap<[usize; 2], Expr<'g>> = keys.iter().copied().zip(incoming.iter().copied()).collect();
                self.stage.carried_by_sweeps(pass, 0, given, |key, e| {
                    if let Some(next) = next.get(&key) {
                        *e = *next;
                    }
                });
                (1..=outer).for_each(|i| self.stage.node(pass, i, given));
                self.stage.end(pass, given);
            }
            SweepDirection::TipToBase => {
                (1..=outer).rev().for_each(|i| self.stage.node(pass, i, given));
                self.stage.end(pass, given);
                self.stage.carried_by_sweeps(pass, 0, given, |key, e| {
                    all.insert(key, *e);
                });
            }
        }
        let inward = if direction == SweepDirection::TipToBase { keys } else { &[] };
        // What a branch lacks is of constraints of others.
        let mut outgoing: Vec<Expr<'g>> = inward.iter().map(|key| all.remove(key).unwrap_or(Expr::zero())).collect();
        // Columns of rows that are solved in the branch stay in it.
        let is_zero = |e: &Expr| matches!(e, Expr::Const(x) if *x == 0.0);
        if !all.values().chain(&self.stage.columns_at(0)).all(is_zero) {
            return None;
        }
        if direction == SweepDirection::TipToBase && self.stage.tree.early_tolerance.is_some() {
            outgoing.push(self.stage.early_rows_act());
        }
        let negative: Vec<bool> = outgoing.iter().map(|e| matches!(e, Expr::Node { neg: true, .. })).collect();
        let outgoing = symbols_of(&outgoing);
        let twins = vec![None; outgoing.len()];
        self.passes.push(LinkPass { incoming, twins, outgoing, negative, end: self.graph.len() });
        Some(())
    }

    /// A pass through a mechanism on the ground, which takes in nothing but gravity. All of them are one pass of the link, which is
    /// done when the `last` one is.
    pub fn pass_on_ground(&mut self, (pass, last): (usize, usize), direction: SweepDirection, gravity: &[Expr<'_>]) {
        if pass == 0 {
            let gravity = self.taken_in(0, gravity);
            self.given.gravity.copy_from_slice(&gravity);
        }
        let given = &self.given;
        self.stage.begin(pass, given);
        match direction {
            SweepDirection::BaseToTip => (0..self.nodes).for_each(|i| self.stage.node(pass, i, given)),
            SweepDirection::TipToBase => (0..self.nodes).rev().for_each(|i| self.stage.node(pass, i, given)),
        }
        self.stage.end(pass, given);
        if pass == last {
            let incoming = self.given.gravity.to_vec();
            let (twins, outgoing, negative) = (vec![None; incoming.len()], Vec::new(), Vec::new());
            self.passes.push(LinkPass { incoming, twins, outgoing, negative, end: self.graph.len() });
        }
    }

    /// Symbols for what all branches take in in pass number `number`; constants stay what they are.
    fn taken_in(&mut self, number: usize, first: &[Expr<'_>]) -> Vec<Expr<'g>> {
        let symbols = first.iter().enumerate().map(|(k, first)| match (*first, self.symbol(number, k)) {
            (Expr::Const(x), _) => Expr::Const(x),
            (Expr::Node { .. }, symbol) => symbol,
        });
        symbols.collect()
    }

    /// What a pass hands on, as far as it depends on constants alone, in the turn with a given row of the table.
    pub fn constants(&self, pass: usize, row: &[f64]) -> Vec<Option<f64>> {
        let value = |e: &Expr<'g>| match *e {
            Expr::Const(x) => Some(x),
            Expr::Node { id, .. } => constant(self.graph, self, row, id),
        };
        self.passes[pass].outgoing.iter().map(value).collect()
    }

    /// Results of one turn, after the last pass.
    pub fn finish(&mut self) -> Vec<Expr<'g>> {
        self.stage.finish(&self.given)
    }
}

/// The symbols without their signs.
fn symbols_of<'g>(incoming: &[Expr<'g>]) -> Vec<Expr<'g>> {
    let plain = incoming.iter().map(|e| match *e {
        Expr::Node { graph, id, .. } => Expr::Node { graph, id, neg: false },
        Expr::Const(x) => Expr::Const(x),
    });
    plain.collect()
}
