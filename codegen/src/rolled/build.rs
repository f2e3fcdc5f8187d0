//! From a plan to blocks: finds the runs, walks the passes, keeps what is needed, and cuts it into straight-line pieces
//! and loops.

use std::collections::{BTreeMap, BTreeSet};

use mbd_runtime::tree::{Source, Tree};

use super::link::Link;
use super::main_line::{Event, MainLine};
use super::partition::{assemble, output, partition, Body, Requests};
use super::pass_state::{OutputSweeps, PassState};
use super::rest::without_inner;
use super::runs::{Extent, Run};
use super::{Block, Loop, Place, Repeat, RolledProgram, Start, Target};
use crate::options::Options;
use crate::output::{Dim, InputArray, Output, OutputProgram};
use crate::plan::Plan;
use crate::symbolic::{passes, Expr, Graph, Op, Operand, ProgramResult};
use crate::trace::{rewrite, sizes, spec_of, symbolic_tree, SymbolicInputs};

/// Builds the loop form with the runs that `find` finds among the nodes that are allowed; `None` where there are none.
pub fn build(
    plan: &Plan,
    group: Output,
    options: &Options,
    find: impl Fn(&Tree<Expr>, &[bool]) -> Vec<Run>,
) -> Option<OutputProgram<RolledProgram>> {
    let sweeps = OutputSweeps::of(group)?;
    let graph = Graph::default();
    let spec = spec_of(plan, group);
    let given = SymbolicInputs::new(&graph, plan, spec, options);
    let tree = symbolic_tree(plan, group, &given, options).regrouped();
    let (plan_of_tree, tree) = match (group, &plan.accelerations) {
        (Output::Accelerations, Some(other)) => (&**other, tree.for_accelerations().clone()),
        _ => (plan, tree),
    };
    let allowed: Vec<bool> = plan_of_tree.nodes.iter().map(|n| n.rolled).collect();
    let runs: Vec<Run> = find(&tree, &allowed).into_iter().filter(|run| steady(&tree, run)).collect();
    if runs.is_empty() {
        return None;
    }
    let passes = sweeps.all_passes(&tree);
    let tree = without_inner(tree, &runs);
    if runs.iter().any(|run| run.branches.is_none()) && !sweeps.rolls(&tree) {
        return None;
    }
    let starts: Vec<Extent> = runs.iter().map(|run| start_of(&tree, run)).collect();
    let graphs: Vec<Graph> = runs.iter().map(|_| Graph::default()).collect();
    let link = |(graph, run)| Link::new(graph, group, run, &tree, options.efforts, &passes);
    let mut links: Vec<Link> = graphs.iter().zip(&runs).map(link).collect::<Option<_>>()?;
    let next_input = given.arrays.iter().map(InputArray::len).sum();
    let stage = PassState::new(group, &graph, tree, &passes)?;
    let last = passes.len().saturating_sub(1);
    let mut line =
        MainLine { graph: &graph, stage, given, runs: &runs, events: Vec::new(), next_input, unfit: false, last };
    for (number, pass) in passes.iter().enumerate() {
        line.pass(number, pass.direction, &mut links);
    }
    // What adds up over all nodes has an order, in which branches do not wait for each other.
    if (group == Output::Energy || line.unfit) && runs.iter().any(|run| run.branches.is_some()) {
        return None;
    }
    let mut results = line.stage.finish(&line.given);
    if plan.early_tolerance.is_some() {
        results.push(line.early_rows_act()?);
    }
    let own: Vec<Vec<(Expr, Target)>> = links
        .iter_mut()
        .zip(starts.iter().zip(&runs))
        .map(|(link, (start, run))| results_of_turn(plan, group, options, link, (*start, run.branches.is_some())))
        .collect();
    let mut build = Build { line: &line, graphs: &graphs, links: &links, starts: &starts, own, results };
    let program = build.program(options);
    Some(OutputProgram { spec, inputs: line.given.arrays, program })
}

/// First coordinate, velocity and row of a run.
fn start_of(tree: &Tree<Expr>, run: &Run) -> Extent {
    let (q, v) = state_of(tree, run.nodes.start);
    run.branches.as_ref().map_or(Extent { q, v, rows: 0 }, |branches| branches.first)
}

/// First coordinate and velocity of a node.
fn state_of(tree: &Tree<Expr>, i: usize) -> (usize, usize) {
    match tree.nodes[i].source {
        Source::State { q, v } | Source::Drive { q, v } => (q, v),
    }
}

/// Whether coordinates move on by the same number from turn to turn.
fn steady(tree: &Tree<Expr>, run: &Run) -> bool {
    if run.branches.is_some() {
        return true;
    }
    let sizes = |i: usize| (tree.nodes[i].kind.nq(), tree.nodes[i].kind.nv());
    let mut at = state_of(tree, run.nodes.start);
    run.nodes.clone().all(|i| {
        let same = state_of(tree, i) == at;
        at = (at.0 + sizes(i).0, at.1 + sizes(i).1);
        same
    })
}

/// Results of one turn and where they go: entries of the arrays that have one for each coordinate or velocity.
fn results_of_turn<'g>(
    plan: &Plan,
    group: Output,
    options: &Options,
    link: &mut Link<'g, '_>,
    (start, branches): (Extent, bool),
) -> Vec<(Expr<'g>, Target)> {
    let sizes = sizes(plan, options, 0);
    let mut offset = 0;
    let mut targets = Vec::new();
    let mut results = link.finish().into_iter();
    for array in group.spec().results {
        let turn = match array.dims {
            [Dim::Nq] => Some((start.q, link.size.q, link.stride.q)),
            [Dim::Nv] => Some((start.v, link.size.v, link.stride.v)),
            [Dim::Rows] if branches => Some((start.rows, link.size.rows, link.stride.rows)),
            _ => None,
        };
        let len = array.len(&sizes);
        match turn {
            Some((first, n, stride)) => {
                let target = |k| Target::ResultOfTurn { first: offset + first + k, stride };
                targets.extend(results.by_ref().take(n).zip((0..n).map(target)));
            }
            // What belongs to no turn.
            None => results.by_ref().take(len).for_each(drop),
        }
        offset += len;
    }
    targets
}

pub(super) struct Build<'b, 'm, 'g> {
    pub(super) line: &'b MainLine<'m, 'b>,
    pub(super) graphs: &'g [Graph],
    pub(super) links: &'b [Link<'g, 'b>],
    starts: &'b [Extent],
    own: Vec<Vec<(Expr<'g>, Target)>>,
    results: Vec<Expr<'m>>,
}

/// What is needed.
pub(super) struct Live {
    pub(super) main: Vec<bool>,
    pub(super) links: Vec<Vec<bool>>,
    /// Places of what run and pass carry.
    pub(super) carried: Vec<Vec<Vec<bool>>>,
}

pub(super) fn mark(graph: &Graph, live: &mut [bool], e: Expr) {
    let Expr::Node { id, .. } = e else { return };
    let mut open = vec![id];
    while let Some(id) = open.pop() {
        if !std::mem::replace(&mut live[id as usize], true) {
            let operands = graph.get(id).0.operands();
            open.extend(operands.filter_map(|o| if let Operand::Node(id) = o { Some(id) } else { None }));
        }
    }
}

impl<'m> Build<'_, 'm, '_> {
    /// Results outside runs.
    fn results(&self) -> impl Iterator<Item = (usize, Expr<'m>)> + '_ {
        let mut owned = BTreeSet::new();
        for (own, run) in self.own.iter().zip(self.line.runs) {
            for (_, target) in own {
                if let Target::ResultOfTurn { first, stride } = target {
                    owned.extend((0..run.count()).map(|turn| first + turn * stride));
                }
            }
        }
        let results = self.results.iter().copied().enumerate();
        results.filter(move |(k, _)| !owned.contains(k))
    }

    fn live(&self) -> Live {
        let passes =
            |link: &Link| link.passes.iter().map(|p| vec![false; p.incoming.len().max(p.outgoing.len())]).collect();
        let mut live = Live {
            main: vec![false; self.line.graph.len()],
            links: self.graphs.iter().map(|g| vec![false; g.len()]).collect(),
            carried: self.links.iter().map(passes).collect(),
        };
        self.results().for_each(|(_, e)| mark(self.line.graph, &mut live.main, e));
        for (k, own) in self.own.iter().enumerate() {
            own.iter().for_each(|(e, _)| mark(&self.graphs[k], &mut live.links[k], *e));
        }
        loop {
            let mut settled = true;
            for event in self.line.events.iter().rev() {
                let (link, graph) = (&self.links[event.run], &self.graphs[event.run]);
                let pass = &link.passes[event.pass];
                settled &= !self.live_in_branches(event, &mut live);
                for (k, (start, end)) in event.start.iter().zip(&event.end).enumerate() {
                    let read = |e: Expr, live: &[bool]| matches!(e, Expr::Node { id, .. } if live[id as usize]);
                    let wanted = read(*end, &live.main) || read(pass.incoming[k], &live.links[event.run]);
                    if wanted && !std::mem::replace(&mut live.carried[event.run][event.pass][k], true) {
                        mark(graph, &mut live.links[event.run], pass.outgoing[k]);
                        mark(self.line.graph, &mut live.main, *start);
                        settled = false;
                    }
                }
            }
            if settled {
                return live;
            }
        }
    }

    fn program(&mut self, options: &Options) -> RolledProgram {
        let live = self.live();
        let mut loops = Vec::new();
        let mut bodies: Vec<BTreeMap<Option<usize>, Body>> = Vec::new();
        let mut rows = Vec::new();
        for (k, run) in self.line.runs.iter().enumerate() {
            let given = &self.line.given;
            let Extent { q, v, .. } = self.starts[k];
            let wanted = Requests {
                results: self.own[k].clone(),
                carried: &live.carried[k],
                first: [q, given.q.len() + v, given.first_of("a") + v, given.first_of("tau") + v],
            };
            let code = partition(&self.graphs[k], &self.links[k], run, &live.links[k], &wanted);
            let branches = run.branches.as_ref().map_or(Vec::new(), |branches| branches.roots.clone());
            loops.push(Loop {
                nodes: run.nodes.clone(),
                period: run.period,
                table: code.table,
                row: code.row,
                branches,
            });
            rows.push(code.rows);
            bodies.push(code.bodies.into_iter().map(|b| (b.pass, b)).collect());
        }
        let units = self.units(&live);
        let (kept, slots) = self.slots(&units, &live);
        let handed = self.handed(&rows);
        let mut blocks = Vec::new();
        for (k, bodies) in bodies.iter_mut().enumerate() {
            if let Some(b) = bodies.remove(&None) {
                let repeat = Some(Repeat { run: k, way: None, carried: Vec::new() });
                blocks.push(Block { program: b.program, inputs: b.inputs, outputs: b.outputs, repeat });
            }
        }
        for (unit, results) in units.iter().zip(self.results_of(&units)) {
            match unit {
                Unit::Straight(own) => blocks.extend(self.straight(own, &slots, &handed, results)),
                Unit::Loop(event) => {
                    let event = &self.line.events[*event];
                    let Some(b) = bodies[event.run].remove(&Some(event.pass)) else { continue };
                    if b.outputs.is_empty() {
                        continue;
                    }
                    let carried = self.carried(event, &live, &slots);
                    let repeat = Some(Repeat { run: event.run, way: Some(event.direction), carried });
                    blocks.push(Block { program: b.program, inputs: b.inputs, outputs: b.outputs, repeat });
                }
            }
        }
        for block in &mut blocks {
            let program = std::mem::take(&mut block.program);
            block.program = passes::run(program, rewrite(options));
        }
        RolledProgram { results: self.results.len(), loops, blocks, kept }
    }

    /// Live nodes of the main line between loops.
    fn units(&self, live: &Live) -> Vec<Unit> {
        let mut units = Vec::new();
        let mut at = 0;
        let ends = self.line.events.iter().map(|e| e.at).chain(Some(self.line.graph.len()));
        for (k, end) in ends.enumerate() {
            let is_op = |id: &u32| !matches!(self.line.graph.get(*id).0, Op::Input(_));
            let own: BTreeSet<u32> =
                (at as u32..end as u32).filter(|id| live.main[*id as usize]).filter(is_op).collect();
            if !own.is_empty() {
                units.push(Unit::Straight(own));
            }
            at = end;
            if k < self.line.events.len() {
                units.push(Unit::Loop(k));
            }
        }
        // Constants and results of loops are handed over at the end.
        if !matches!(units.last(), Some(Unit::Straight(_))) {
            units.push(Unit::Straight(BTreeSet::new()));
        }
        units
    }

    /// Places for values that one unit computes and another needs, used again when they are free.
    fn slots(&self, units: &[Unit], live: &Live) -> (usize, BTreeMap<u32, usize>) {
        let mut born: BTreeMap<u32, usize> = BTreeMap::new();
        let mut last: BTreeMap<u32, usize> = BTreeMap::new();
        for (k, unit) in units.iter().enumerate() {
            let mut read = |id: u32| {
                last.insert(id, k);
            };
            match unit {
                Unit::Straight(own) => {
                    for id in own {
                        let operands = self.line.graph.get(*id).0.operands();
                        operands.for_each(|o| {
                            if let Operand::Node(id) = o {
                                read(id)
                            }
                        });
                        born.insert(*id, k);
                    }
                }
                Unit::Loop(event) => {
                    let event = &self.line.events[*event];
                    let needed = &live.carried[event.run][event.pass];
                    if self.line.runs[event.run].branches.is_some() {
                        for (start, _) in event.start.iter().zip(needed).filter(|(_, needed)| **needed) {
                            if let Expr::Node { id, .. } = *start {
                                read(id);
                            }
                        }
                    }
                    for ((start, end), _) in event.start.iter().zip(&event.end).zip(needed).filter(|(_, n)| **n) {
                        if let Expr::Node { id, .. } = *start {
                            read(id);
                        }
                        if let Expr::Node { id, .. } = *end {
                            born.insert(id, k);
                        }
                    }
                }
            }
        }
        // Results of loops are handed over by the last piece.
        for (_, e) in self.results() {
            if let Expr::Node { id, .. } = e {
                if matches!(self.line.graph.get(id).0, Op::Input(_)) && born.contains_key(&id) {
                    last.insert(id, units.len() - 1);
                }
            }
        }
        let (mut begin, mut end) = (vec![Vec::new(); units.len()], vec![Vec::new(); units.len()]);
        for (id, at) in born {
            if let Some(l) = last.get(&id).filter(|l| **l > at) {
                begin[at].push(id);
                end[*l].push(id);
            }
        }
        let mut slots = BTreeMap::new();
        let (mut free, mut count) = (Vec::new(), 0);
        for (begin, end) in begin.iter().zip(&end) {
            for id in begin {
                let slot = free.pop().unwrap_or_else(|| {
                    count += 1;
                    count - 1
                });
                slots.insert(*id, slot);
            }
            free.extend(end.iter().map(|id| slots[id]));
        }
        (count, slots)
    }

    /// Results outside runs that each unit gives; the last one also gives constants and results of loops.
    fn results_of(&self, units: &[Unit]) -> Vec<Vec<(ProgramResult, Target)>> {
        let mut owners = BTreeMap::new();
        for (k, unit) in units.iter().enumerate() {
            if let Unit::Straight(own) = unit {
                owners.extend(own.iter().map(|id| (*id, k)));
            }
        }
        let mut all = vec![Vec::new(); units.len()];
        for (k, e) in self.results() {
            let owner = match e {
                Expr::Const(_) => None,
                Expr::Node { id, .. } => owners.get(&id).copied(),
            };
            all[owner.unwrap_or(units.len() - 1)].push((output(e), Target::Result(k)));
        }
        all
    }

    fn straight(
        &self,
        own: &BTreeSet<u32>,
        slots: &BTreeMap<u32, usize>,
        handed: &BTreeMap<u32, Place>,
        mut outputs: Vec<(ProgramResult, Target)>,
    ) -> Option<Block> {
        for id in own {
            if let Some(slot) = slots.get(id) {
                outputs.push((ProgramResult::Node(*id, false), Target::Kept(*slot)));
            }
        }
        let given: usize = self.line.given.arrays.iter().map(InputArray::len).sum();
        let place = |id: u32| match self.line.graph.get(id).0 {
            Op::Input(k) if (k as usize) < given => Place::Given(k as usize),
            _ => handed.get(&id).copied().unwrap_or_else(|| Place::Kept(slots[&id])),
        };
        if outputs.is_empty() {
            return None;
        }
        let (program, inputs, outputs) = assemble(self.line.graph, own, place, &outputs);
        Some(Block { program, inputs, outputs, repeat: None })
    }

    fn carried(&self, event: &Event<'_>, live: &Live, slots: &BTreeMap<u32, usize>) -> Vec<(Start, Option<usize>)> {
        let incoming = &self.links[event.run].passes[event.pass].incoming;
        let needed = &live.carried[event.run][event.pass];
        // Branches hand nothing on to each other.
        let ends = event.end.iter().map(Some).chain(std::iter::repeat(None));
        let places = event.start.iter().zip(ends).zip(incoming.iter().zip(needed));
        places
            .filter(|(_, (incoming, needed))| **needed && matches!(incoming, Expr::Node { .. }))
            .map(|((start, end), _)| {
                let start = match *start {
                    Expr::Const(x) => Start::Const(x),
                    Expr::Node { id, neg, .. } => match self.line.graph.get(id).0 {
                        Op::Input(k) if !slots.contains_key(&id) => Start::Given(k as usize, neg),
                        _ => Start::Kept(slots[&id], neg),
                    },
                };
                let end = match end {
                    Some(Expr::Node { id, .. }) => slots.get(id).copied(),
                    _ => None,
                };
                (start, end)
            })
            .collect()
    }
}

enum Unit {
    Straight(BTreeSet<u32>),
    Loop(usize),
}
