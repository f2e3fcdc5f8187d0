//! The graph of one turn cut into loop bodies: what depends on constants alone goes into the table, sines and cosines
//! into a loop of their own, everything else into the first pass that can compute it.

use std::collections::{BTreeMap, BTreeSet};

use super::link::{Link, LinkInput};
use super::runs::Run;
use super::turn_constants::value;
use super::{Place, Target};
use crate::symbolic::{Expr, Graph, Op, Operand, Program, ProgramResult};

/// Body of one loop.
pub struct Body {
    /// `None`: sines and cosines.
    pub pass: Option<usize>,
    /// Program.
    pub program: Program,
    /// Its inputs.
    pub inputs: Vec<Place>,
    /// Its outputs.
    pub outputs: Vec<Target>,
}

/// Loops of one run.
pub struct Code {
    /// Bodies in order.
    pub bodies: Vec<Body>,
    /// Constants, one row for each turn.
    pub table: Vec<Vec<f64>>,
    /// Numbers kept for each turn.
    pub row: usize,
    /// The nodes that they are the values of.
    pub rows: BTreeMap<u32, usize>,
}

/// What is wanted of a run.
pub struct Requests<'a, 'g> {
    /// Results of a turn and where they go.
    pub results: Vec<(Expr<'g>, Target)>,
    /// Live places of what every pass carries.
    pub carried: &'a [Vec<bool>],
    /// First coordinate and velocity as inputs of the function: of `q`, of `p` or `v`, of `a`, of `tau`.
    pub first: [usize; 4],
}

/// When a node can be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// From constants.
    Constant,
    /// From the state.
    State,
    /// In a pass.
    Pass(usize),
}

/// Result as an output of a program.
pub fn output(e: Expr) -> ProgramResult {
    match e {
        Expr::Const(x) => ProgramResult::Const(x),
        Expr::Node { id, neg, .. } => ProgramResult::Node(id, neg),
    }
}

/// Nodes among the operands.
pub fn nodes(op: &Op) -> impl Iterator<Item = u32> {
    op.operands().filter_map(|o| if let Operand::Node(id) = o { Some(id) } else { None })
}

/// A program that computes the nodes `own`; other nodes it needs come from `place`.
pub fn assemble<P, T: Copy>(
    graph: &Graph,
    own: &BTreeSet<u32>,
    place: impl Fn(u32) -> P,
    results: &[(ProgramResult, T)],
) -> (Program, Vec<P>, Vec<T>) {
    let (mut inputs, mut steps, mut known) = (Vec::new(), Vec::new(), BTreeSet::new());
    let mut fetch = |id: u32, steps: &mut Vec<_>| {
        if !own.contains(&id) && known.insert(id) {
            steps.push((id, Op::Input(inputs.len() as u32), graph.get(id).1));
            inputs.push(place(id));
        }
    };
    for &id in own {
        let (op, label) = graph.get(id);
        nodes(&op).for_each(|id| fetch(id, &mut steps));
        steps.push((id, op, label));
    }
    for (output, _) in results {
        if let ProgramResult::Node(id, _) = output {
            fetch(*id, &mut steps);
        }
    }
    let names = own.iter().filter_map(|&id| graph.name_of(id).map(|name| (id, name))).collect();
    let outputs = results.iter().map(|(o, _)| *o).collect();
    let mut program = Program { steps, outputs, names, created: BTreeMap::default() };
    program.turn_negated_differences();
    (program, inputs, results.iter().map(|(_, t)| *t).collect())
}

/// Cuts the graph of a turn.
pub fn partition(graph: &Graph, link: &Link<'_, '_>, run: &Run, live: &[bool], wanted: &Requests<'_, '_>) -> Code {
    let by_itself = run.branches.is_some() || run.has_side_branches();
    let ranks = if by_itself { ranks_in_branch(graph, link) } else { ranks(graph, link) };
    let passes = link.passes.len();
    let (columns, table) = columns(graph, link, run, (live, &wanted.results), &ranks);
    // Outputs of every pass that leave the turn.
    let mut outputs: Vec<Vec<(ProgramResult, Target)>> = vec![Vec::new(); passes];
    let mut places = BTreeMap::new();
    // What branches hand to their parent stays in their rows.
    let (mut handed, mut handed_by) = (BTreeSet::new(), BTreeMap::new());
    for (pass, carried) in link.passes.iter().enumerate() {
        let mut number = 0;
        let outgoing = carried.outgoing.iter().zip(&wanted.carried[pass]);
        for (e, _) in outgoing.filter(|(_, wanted)| run.branches.is_some() && **wanted) {
            if let Expr::Node { id, .. } = *e {
                handed.insert(id);
                handed_by.entry(id).or_insert(pass);
            }
        }
        for (k, incoming) in carried.incoming.iter().enumerate() {
            let Expr::Node { id, .. } = *incoming else { continue };
            if wanted.carried[pass][k] {
                if run.branches.is_none() {
                    outputs[pass].push((output(carried.outgoing[k]), Target::Carried(number)));
                }
                places.insert(id, Place::Carried(number));
                number += 1;
            }
        }
    }
    for (e, target) in &wanted.results {
        let pass = match *e {
            Expr::Node { id, .. } => match ranks[id as usize] {
                Rank::Pass(pass) => pass,
                _ => passes - 1,
            },
            Expr::Const(_) => passes - 1,
        };
        outputs[pass].push((output(*e), *target));
    }
    handed.retain(|id| ranks[*id as usize] != Rank::Constant);
    let mut cut = Cut { graph, ranks: &ranks, live, passes, outputs: &outputs, handed, sunk: BTreeSet::new() };
    let crossing = cut.settle();
    let rows: BTreeMap<u32, usize> = crossing.iter().enumerate().map(|(row, id)| (*id, row)).collect();
    // Inputs are at hand in every pass; a branch may hand one of them to its parent.
    let given = |id: u32| ranks[id as usize] == Rank::State && matches!(graph.get(id).0, Op::Input(_));
    let place = |pass: Option<usize>, id: u32| match (
        graph.get(id).0,
        places.get(&id),
        columns.get(&id),
        rows.get(&id).filter(|_| !given(id)),
    ) {
        (_, Some(place), _, _) if pass.map(Rank::Pass) == Some(ranks[id as usize]) => *place,
        (_, _, Some(column), _) => Place::Column(*column),
        (_, _, _, Some(row)) => Place::Row(*row),
        (Op::Input(k), ..) => {
            let (first, stride) = match link.inputs[k as usize] {
                LinkInput::Q(k) => (wanted.first[0] + k, link.stride.q),
                LinkInput::Second(k) => (wanted.first[1] + k, link.stride.v),
                LinkInput::Third(k) => (wanted.first[2] + k, link.stride.v),
                LinkInput::Tau(k) => (wanted.first[3] + k, link.stride.v),
                LinkInput::Column(_) | LinkInput::Carried(..) => {
                    unreachable!("constants and what is carried have places")
                }
            };
            Place::GivenOfTurn { first, stride }
        }
        _ => unreachable!("what one pass takes from another is kept in the row"),
    };
    let mut bodies = Vec::new();
    let sines = cut.turn_functions();
    if !sines.is_empty() {
        let own = cut.closure(sines.iter().copied(), |rank| rank == Rank::State);
        let results: Vec<(ProgramResult, Target)> =
            sines.iter().map(|id| (ProgramResult::Node(*id, false), Target::Row(rows[id]))).collect();
        let (program, inputs, outputs) = assemble(graph, &own, |id| place(None, id), &results);
        bodies.push(Body { pass: None, program, inputs, outputs });
    }
    for (pass, outputs) in outputs.iter().enumerate() {
        let own = cut.own(pass);
        let mut results = outputs.clone();
        let taken_in = |id: u32| ranks[id as usize] == Rank::Pass(pass) && matches!(graph.get(id).0, Op::Input(_));
        for (id, row) in
            rows.iter().filter(|(id, _)| own.contains(id) || taken_in(**id) || (given(**id) && handed_by[*id] == pass))
        {
            results.push((ProgramResult::Node(*id, false), Target::Row(*row)));
        }
        let (program, inputs, outputs) = assemble(graph, &own, |id| place(Some(pass), id), &results);
        bodies.push(Body { pass: Some(pass), program, inputs, outputs });
    }
    Code { bodies, table, row: rows.len(), rows }
}

fn ranks(graph: &Graph, link: &Link<'_, '_>) -> Vec<Rank> {
    let mut ranks: Vec<Rank> = Vec::with_capacity(graph.len());
    for id in 0..graph.len() as u32 {
        let op = graph.get(id).0;
        ranks.push(match op {
            Op::Input(k) => match link.inputs[k as usize] {
                LinkInput::Column(_) => Rank::Constant,
                LinkInput::Carried(pass, _) => Rank::Pass(pass),
                LinkInput::Q(_) | LinkInput::Second(_) | LinkInput::Third(_) | LinkInput::Tau(_) => Rank::State,
            },
            op => nodes(&op).map(|k| ranks[k as usize]).max().unwrap_or(Rank::Constant),
        });
    }
    ranks
}

/// The same in a branch, and in links that have branches, where much depends on nothing that other turns hand over:
/// everything but angles, sines and cosines is computed in the pass that needs it first.
fn ranks_in_branch(graph: &Graph, link: &Link<'_, '_>) -> Vec<Rank> {
    let mut ranks = ranks(graph, link);
    let mut angles = BTreeSet::new();
    for id in (0..graph.len() as u32).rev() {
        let op = graph.get(id).0;
        if matches!(op, Op::Sin(_) | Op::Cos(_)) || angles.contains(&id) {
            angles.insert(id);
            angles.extend(nodes(&op));
        }
    }
    for id in 0..graph.len() as u32 {
        // What completes the results comes after all passes.
        let last = link.passes.len() - 1;
        let at = link.passes.iter().position(|pass| (id as usize) < pass.end).unwrap_or(last);
        let rank = ranks[id as usize];
        let given = matches!(graph.get(id).0, Op::Input(_)) || (rank == Rank::State && angles.contains(&id));
        if rank != Rank::Constant && !given {
            ranks[id as usize] = Rank::Pass(at);
        }
    }
    ranks
}

/// Columns of the table that the loops read, by node, and the table: what follows from constants is computed here, with
/// the operations the code would have used.
fn columns(
    graph: &Graph,
    link: &Link<'_, '_>,
    run: &Run,
    (live, results): (&[bool], &[(Expr<'_>, Target)]),
    ranks: &[Rank],
) -> (BTreeMap<u32, usize>, Vec<Vec<f64>>) {
    let constant = |id: u32| ranks[id as usize] == Rank::Constant;
    let mut read = BTreeSet::new();
    for id in (0..graph.len() as u32).filter(|&id| live[id as usize] && !constant(id)) {
        read.extend(nodes(&graph.get(id).0).filter(|&id| constant(id)));
    }
    let roots = link.passes.iter().flat_map(|p| &p.outgoing).chain(results.iter().map(|(e, _)| e));
    for e in roots {
        if let Expr::Node { id, .. } = *e {
            if constant(id) {
                read.insert(id);
            }
        }
    }
    let mut found: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
    let mut columns = BTreeMap::new();
    let mut table = vec![Vec::new(); run.count()];
    let values: Vec<BTreeMap<u32, f64>> = run
        .table
        .iter()
        .map(|row| {
            let mut values = BTreeMap::new();
            for id in (0..graph.len() as u32).filter(|&id| constant(id)) {
                values.insert(id, value(graph.get(id).0, link, row, &values));
            }
            values
        })
        .collect();
    for id in read {
        let bits = values.iter().map(|v| v[&id].to_bits()).collect();
        let next = found.len();
        let column = *found.entry(bits).or_insert(next);
        if column == next {
            table.iter_mut().zip(&values).for_each(|(row, values)| row.push(values[&id]));
        }
        columns.insert(id, column);
    }
    (columns, table)
}

/// Which pass computes what.
struct Cut<'a> {
    graph: &'a Graph,
    ranks: &'a [Rank],
    live: &'a [bool],
    passes: usize,
    outputs: &'a [Vec<(ProgramResult, Target)>],
    /// Nodes that others than the passes read.
    handed: BTreeSet<u32>,
    /// Nodes computed in the pass that uses them although an earlier one could.
    sunk: BTreeSet<u32>,
}

impl Cut<'_> {
    fn is_turn_function(&self, id: u32) -> bool {
        self.ranks[id as usize] == Rank::State && matches!(self.graph.get(id).0, Op::Sin(_) | Op::Cos(_))
    }

    /// Sines and cosines of the state.
    fn turn_functions(&self) -> BTreeSet<u32> {
        (0..self.graph.len() as u32).filter(|&id| self.live[id as usize] && self.is_turn_function(id)).collect()
    }

    /// Nodes to be computed for some others, themselves included, as far as `here` says that they are computed there.
    fn closure(&self, of: impl Iterator<Item = u32>, here: impl Fn(Rank) -> bool) -> BTreeSet<u32> {
        let mut own = BTreeSet::new();
        let mut open: Vec<u32> = of.collect();
        while let Some(id) = open.pop() {
            let op = self.graph.get(id).0;
            if !matches!(op, Op::Input(_)) && here(self.ranks[id as usize]) && own.insert(id) {
                open.extend(nodes(&op));
            }
        }
        own
    }

    /// Nodes that a pass computes: its own live ones, and what it needs of the state, sines and cosines apart.
    fn own(&self, pass: usize) -> BTreeSet<u32> {
        let at_home = |id: u32| self.ranks[id as usize] == Rank::Pass(pass) && !self.sunk.contains(&id);
        let mut own = BTreeSet::new();
        let is_op = |id: u32| !matches!(self.graph.get(id).0, Op::Input(_));
        let home = (0..self.ranks.len() as u32).filter(|&id| self.live[id as usize] && at_home(id) && is_op(id));
        let results = self.outputs[pass].iter().filter_map(|(o, _)| match o {
            ProgramResult::Node(id, _) => Some(*id),
            ProgramResult::Const(_) => None,
        });
        let mut open: Vec<u32> = home.chain(results).collect();
        while let Some(id) = open.pop() {
            let state = self.ranks[id as usize] == Rank::State && !self.is_turn_function(id);
            let sunk = self.sunk.contains(&id);
            if is_op(id) && (at_home(id) || state || sunk) && own.insert(id) {
                open.extend(nodes(&self.graph.get(id).0));
            }
        }
        own
    }

    /// Nodes one pass takes from another, sines and cosines included.
    fn crossing(&self) -> BTreeSet<u32> {
        let mut crossing = self.turn_functions();
        crossing.extend(&self.handed);
        for pass in 0..self.passes {
            let own = self.own(pass);
            let needed = own.iter().flat_map(|&id| nodes(&self.graph.get(id).0));
            let foreign = needed.filter(|id| matches!(self.ranks[*id as usize], Rank::Pass(_)) && !own.contains(id));
            // What this pass itself carries in has a place.
            crossing.extend(foreign.filter(|&id| {
                !(matches!(self.graph.get(id).0, Op::Input(_)) && self.ranks[id as usize] == Rank::Pass(pass))
            }));
        }
        crossing
    }

    /// Moves nodes whose operands are kept anyway into the only pass that uses them, and says what is kept.
    fn settle(&mut self) -> BTreeSet<u32> {
        loop {
            let crossing = self.crossing();
            let used: Vec<BTreeSet<u32>> = (0..self.passes)
                .map(|pass| {
                    let own = self.own(pass);
                    let results = self.outputs[pass].iter().filter_map(|(o, _)| match o {
                        ProgramResult::Node(id, _) => Some(*id),
                        ProgramResult::Const(_) => None,
                    });
                    own.iter().flat_map(|&id| nodes(&self.graph.get(id).0)).chain(results).collect()
                })
                .collect();
            let at_hand = |id: u32| crossing.contains(&id) || !matches!(self.ranks[id as usize], Rank::Pass(_));
            let sinks = crossing.iter().copied().find(|&id| {
                let Rank::Pass(home) = self.ranks[id as usize] else { return false };
                let op = self.graph.get(id).0;
                !matches!(op, Op::Input(_))
                    && !self.handed.contains(&id)
                    && !used[home].contains(&id)
                    && nodes(&op).all(at_hand)
            });
            match sinks {
                Some(id) => self.sunk.insert(id),
                None => return crossing,
            };
        }
    }
}
