//! Symbolic runs of the sweeps in which what passes between limbs and trunk is replaced by symbols.
//!
//! On the way inward, what a branch hands to the trunk is cut where it depends on the modes of contacts: columns of the
//! rows, inertias of limbs whose stops act, the rows' blocks of `Φ M⁻¹Φᵀ` and their right-hand sides. On the way outward
//! the motion of the trunk and the multipliers are cut. What the limbs then compute depends on their own modes alone, and
//! what the trunk computes on nothing but what was handed to it.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use mbd_runtime::contact::{rows_that_act, Contact, Mode};
use mbd_runtime::tree::Unknown;

use crate::modes::modes_of;
use crate::options::Options;
use crate::output::Output;
use crate::plan::{Plan, PlanBond};
use crate::rolled::{nodes, output, read, OutputSweeps, PassState, SweepDirection};
use crate::symbolic::{Expr, Graph, Op, Operand, ProgramResult};
use crate::trace::{tolerance, SymbolicInputs};

/// A number that passes between the trunk and limbs in all modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Crossing {
    /// What a sweep hands on at node `node`, by the sweep and a number: outward from the trunk, inward from a limb.
    Carried { node: usize, value: [usize; 2] },
    /// Multiplier of a loop or rate of a shared coordinate.
    Unknown { level: usize, unknown: usize },
}

/// What a symbol stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symbol {
    /// Number `entry` of what the `place`-th of the limbs that touch hands to the trunk.
    Handed { place: usize, entry: usize },
    /// A number that a limb hands to the trunk in all of its modes.
    FromLimb(Crossing),
    /// A number of the trunk.
    Trunk(Crossing),
    /// The multiplier of a row of a contact, in a limb.
    Multiplier { level: usize, unknown: usize },
    /// Number `entry` of what the `place`-th of the limbs that touch gives back to the trunk for the end.
    Returned { place: usize, entry: usize },
    /// A number that a limb gives back in all of its modes.
    BackFromLimb(Crossing),
}

/// What a value depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Class {
    /// On what limbs have handed to the trunk.
    pub handed: bool,
    /// On the solution of the trunk.
    pub late: bool,
    /// On what limbs have given back.
    pub returned: bool,
    /// On the modes of these groups, one bit each, by what is theirs alone.
    pub groups: u64,
}

impl Class {
    /// Whether it is known before the trunk.
    pub fn is_early(self) -> bool {
        !self.handed && !self.late && !self.returned
    }
}

/// Largest number of modes of all limbs together.
pub const MOST_LIMB_MODES: usize = 512;

/// The contacts that act together on one limb, and their modes; the first mode is that in which all are open.
#[derive(Clone, Debug)]
pub struct Limb {
    pub contacts: Vec<usize>,
    pub modes: Vec<Vec<Mode>>,
}

/// A number that a limb hands to the trunk: a node of the graph or its negative, because legs of the two sides have
/// columns of other signs, which the trunk is not to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handed {
    pub id: u32,
    pub neg: bool,
    /// What it is: numbers of two kinds that are equal in some modes are not so in others.
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Diagonal entries of the rows before any elimination.
    Whole,
    /// Everything else.
    Other,
}

/// A symbolic run in one set of modes.
#[derive(Clone, Debug)]
pub struct Traced<'g> {
    pub results: Vec<Expr<'g>>,
    /// Values of the symbols of the trunk.
    pub trunk: BTreeMap<Crossing, Expr<'g>>,
    /// Values of the symbols that limbs hand over in all modes, before the trunk and after it.
    pub from_limbs: [BTreeMap<Crossing, Expr<'g>>; 2],
    /// Values of the multipliers of contacts: level, unknown, value.
    pub multipliers: Vec<(usize, usize, Expr<'g>)>,
}

/// Runs the sweeps of one output in many sets of modes, in one graph.
pub struct Tracing<'g, 'a> {
    pub graph: &'g Graph,
    pub given: Rc<SymbolicInputs<'g>>,
    pub limbs: Vec<Limb>,
    /// What each limb hands to the trunk in each of its modes.
    pub handed: BTreeMap<(usize, usize), Vec<Handed>>,
    /// What each limb gives back at the end.
    pub returned: BTreeMap<(usize, usize), Vec<u32>>,
    /// Number of the inputs of the function.
    first: usize,
    symbols: Vec<Symbol>,
    numbers: BTreeMap<Symbol, usize>,
    classes: Vec<Class>,
    /// Nodes of the graph that flight has made.
    flight: usize,
    /// What each limb in each of its modes computes that flight does not.
    members: BTreeMap<(usize, usize), BTreeSet<u32>>,
    /// What crosses from the trunk in some set of modes, and so in all.
    always: BTreeSet<Crossing>,
    /// What crosses to the trunk in some mode of a limb, and exists in flight.
    of_limb: BTreeSet<Crossing>,
    /// What has been found to be so.
    found: BTreeSet<Crossing>,
    /// What crosses to the trunk in flight.
    in_flight: BTreeMap<Crossing, ProgramResult>,
    /// What crosses from the trunk in flight, and what has been found to differ from it.
    trunk_in_flight: BTreeMap<Crossing, ProgramResult>,
    found_of_trunk: BTreeSet<Crossing>,
    /// Whether the rows of each contact come to the trunk.
    reaching: Vec<bool>,
    full: &'a Plan,
    output: Output,
    options: &'a Options,
    contacts: Vec<Contact<f64>>,
    /// Whether a node belongs to the trunk; the outermost one of it.
    trunk: Vec<bool>,
    root: Option<usize>,
    /// First nodes of the branches of each limb.
    branches: Vec<BTreeSet<usize>>,
}

impl<'g, 'a> Tracing<'g, 'a> {
    /// Nothing traced yet but flight and each limb alone. `full` is the plan with the rows of all contacts. `None`: the
    /// output has no passes, or there are more than 64 limbs.
    pub fn new(graph: &'g Graph, full: &'a Plan, output: Output, options: &'a Options) -> Option<Self> {
        OutputSweeps::of(output)?;
        // Which rows act is an input of the function, by which it chooses its pieces; no operation reads it.
        let given = Rc::new(SymbolicInputs::new(graph, &full.masked(), output.spec(), options));
        let first = given.arrays.iter().map(crate::output::InputArray::len).sum();
        // The tree whose elimination the output uses.
        let plan = match output {
            Output::Multipliers => full.accelerations.as_deref().unwrap_or(full),
            _ => full,
        };
        let (trunk, root) = trunk(plan);
        let (limbs, branches) = limbs(full, plan, &trunk)?;
        if limbs.len() > 64 || limbs.iter().map(|limb| limb.modes.len()).sum::<usize>() > MOST_LIMB_MODES {
            return None;
        }
        let mut tracing = Tracing {
            graph,
            given,
            limbs,
            handed: BTreeMap::new(),
            returned: BTreeMap::new(),
            first,
            symbols: Vec::new(),
            numbers: BTreeMap::new(),
            classes: Vec::new(),
            flight: 0,
            members: BTreeMap::new(),
            always: BTreeSet::new(),
            of_limb: BTreeSet::new(),
            found: BTreeSet::new(),
            in_flight: BTreeMap::new(),
            trunk_in_flight: BTreeMap::new(),
            found_of_trunk: BTreeSet::new(),
            reaching: of_contacts(plan).map(|index| reaches(plan, index, &trunk)).collect(),
            full,
            output,
            options,
            contacts: full.contacts(),
            trunk: trunk.clone(),
            root,
            branches,
        };
        let flight = vec![0; tracing.limbs.len()];
        tracing.trace(&flight, false)?;
        tracing.flight = graph.len();
        let alone: Vec<(usize, usize)> =
            tracing.limbs.iter().enumerate().flat_map(|(g, limb)| (1..limb.modes.len()).map(move |m| (g, m))).collect();
        let set = |(g, m): (usize, usize)| {
            let mut set = flight.clone();
            set[g] = m;
            set
        };
        for &one in &alone {
            let traced = tracing.trace(&set(one), false)?;
            let mut all = BTreeSet::new();
            reach(graph, &traced.results, &mut all);
            all.retain(|id| *id as usize >= tracing.flight && !matches!(graph.get(*id).0, Op::Input(_)));
            tracing.members.insert(one, all);
        }
        tracing.classes.clear();
        // What crosses is found by runs until no more is: what crosses before the trunk decides what does after it.
        loop {
            tracing.trace(&flight, true)?;
            for &one in &alone {
                tracing.trace(&set(one), true)?;
            }
            if tracing.found.is_subset(&tracing.of_limb) && tracing.found_of_trunk.is_subset(&tracing.always) {
                break;
            }
            tracing.of_limb.extend(tracing.found.iter().copied());
            tracing.always.extend(tracing.found_of_trunk.iter().copied());
        }
        tracing.handed.clear();
        tracing.returned.clear();
        Some(tracing)
    }

    /// The modes of all contacts in a set: a number of a mode for each limb.
    pub fn modes(&self, set: &[usize]) -> Vec<Mode> {
        let mut modes = vec![Mode::Open; self.contacts.len()];
        for (limb, m) in self.limbs.iter().zip(set) {
            for (contact, mode) in limb.contacts.iter().zip(&limb.modes[*m]) {
                modes[*contact] = *mode;
            }
        }
        modes
    }

    /// What an input of the graph stands for; `None`: an input of the function.
    pub fn symbol(&self, input: u32) -> Option<Symbol> {
        (input as usize).checked_sub(self.first).map(|k| self.symbols[k])
    }

    fn symbol_for(&mut self, symbol: Symbol) -> Expr<'g> {
        let next = self.symbols.len();
        let number = *self.numbers.entry(symbol).or_insert(next);
        if number == next {
            self.symbols.push(symbol);
        }
        self.graph.input(self.first + number)
    }

    /// Which contact an unknown belongs to.
    fn contact_of(&self, unknown: usize) -> Option<usize> {
        let Unknown::Row(row) = self.full.unknowns[unknown] else { return None };
        self.contacts.iter().position(|c| (c.row..c.row + c.rows()).contains(&row))
    }

    /// Which limb an unknown belongs to.
    pub fn limb_of(&self, unknown: usize) -> Option<usize> {
        let contact = self.contact_of(unknown)?;
        self.limbs.iter().position(|limb| limb.contacts.contains(&contact))
    }

    /// The limb that hands over what crosses to the trunk.
    pub fn limb_of_crossing(&self, crossing: Crossing) -> Option<usize> {
        let Crossing::Carried { node, .. } = crossing else { return None };
        self.branches.iter().position(|branches| branches.contains(&node))
    }

    /// What a node depends on.
    pub fn class(&mut self, id: u32) -> Class {
        while self.classes.len() <= id as usize {
            let at = self.classes.len() as u32;
            let (op, _) = self.graph.get(at);
            let class = match op {
                Op::Input(k) => match self.symbol(k) {
                    None => Class::default(),
                    Some(Symbol::Handed { .. } | Symbol::FromLimb(_)) => Class { handed: true, ..Class::default() },
                    Some(Symbol::Trunk(_)) => Class { late: true, ..Class::default() },
                    Some(Symbol::Returned { .. } | Symbol::BackFromLimb(_)) => {
                        Class { returned: true, ..Class::default() }
                    }
                    Some(Symbol::Multiplier { unknown, .. }) => {
                        Class { late: true, groups: self.limb_of(unknown).map_or(0, |g| 1 << g), ..Class::default() }
                    }
                },
                op => {
                    let own = self.owners(at);
                    let own = if own.count_ones() == 1 { own } else { 0 };
                    nodes(&op).map(|id| self.classes[id as usize]).fold(
                        Class { groups: own, ..Class::default() },
                        |a, b| Class {
                            handed: a.handed | b.handed,
                            late: a.late | b.late,
                            returned: a.returned | b.returned,
                            groups: a.groups | b.groups,
                        },
                    )
                }
            };
            self.classes.push(class);
        }
        self.classes[id as usize]
    }

    /// The groups that compute a node when they alone touch, one bit each.
    fn owners(&self, id: u32) -> u64 {
        self.members.iter().filter(|(_, all)| all.contains(&id)).fold(0, |bits, ((g, _), _)| bits | 1 << g)
    }

    /// Whether a node is computed before the trunk, and not in flight.
    fn of_limbs(&mut self, id: u32) -> bool {
        let input = matches!(self.graph.get(id).0, Op::Input(_));
        id as usize >= self.flight && !input && self.class(id).is_early()
    }

    /// The limbs of a set whose rows come to the trunk, in the order of their places.
    pub fn places(&self, set: &[usize]) -> Vec<usize> {
        (0..set.len()).filter(|g| !self.reaching_contacts(*g, set[*g]).is_empty()).collect()
    }

    /// The closed contacts of a limb in one of its modes whose rows come to the trunk.
    pub fn reaching_contacts(&self, g: usize, m: usize) -> Vec<usize> {
        let limb = &self.limbs[g];
        let closed = limb.contacts.iter().zip(&limb.modes[m]).filter(|(_, mode)| **mode != Mode::Open);
        closed.map(|(contact, _)| *contact).filter(|contact| self.reaching[*contact]).collect()
    }

    /// The symbol for a number, or its negative, that the first limb of a set hands over that computes it.
    fn hand_over(&mut self, set: &[usize], Handed { id, neg, kind }: Handed) -> Option<Expr<'g>> {
        let places = self.places(set).into_iter().enumerate();
        let (place, g) =
            places.into_iter().find(|(_, g)| self.members.get(&(*g, set[*g])).is_some_and(|all| all.contains(&id)))?;
        let list = self.handed.entry((g, set[g])).or_default();
        let entry = entry_of(list, Handed { id, neg, kind });
        Some(self.symbol_for(Symbol::Handed { place, entry }))
    }

    /// Replaces a value that depends on the modes of one limb.
    fn cut(&mut self, set: &[usize], kind: Kind, e: &mut Expr<'g>) {
        let Expr::Node { id, neg, .. } = *e else { return };
        if self.of_limbs(id) {
            if let Some(symbol) = self.hand_over(set, Handed { id, neg, kind }) {
                *e = symbol;
            }
        }
    }

    /// Runs the sweeps in a set of modes, with or without cuts.
    pub fn trace(&mut self, set: &[usize], cuts: bool) -> Option<Traced<'g>> {
        let modes = self.modes(set);
        let plan = self.full.acting(&rows_that_act(self.full.dims.rows, &self.contacts, &modes));
        let mut physical = plan.tree(&self.given.params);
        physical.tolerance = Expr::Const(tolerance(self.options.precision));
        let tree = physical.regrouped();
        let tree = match self.output {
            Output::Multipliers => tree.for_accelerations().clone(),
            _ => tree,
        };
        let passes = OutputSweeps::of(self.output)?.all_passes(&tree);
        let mut state = PassState::new(self.output, self.graph, tree, &passes)?;
        let given = Rc::clone(&self.given);
        let (mut trunk, mut multipliers) = (BTreeMap::new(), Vec::new());
        let mut from_limbs = [BTreeMap::new(), BTreeMap::new()];
        for (k, pass) in passes.iter().enumerate() {
            let before: Vec<ProgramResult> = state.unknowns().map(|(_, _, e)| output(*e)).collect();
            state.begin(k, &given);
            let n = state.tree.nodes.len();
            let solved = !trunk.is_empty() || !multipliers.is_empty();
            match pass.direction {
                SweepDirection::TipToBase => {
                    let inward = cuts && !solved;
                    for i in (0..n).rev() {
                        if inward && self.root == Some(i) {
                            state.carried(k, i, &given, |e| self.cut(set, Kind::Other, e));
                            self.cut_running(set, k, &mut state, &given);
                        }
                        let parent = state.tree.nodes[i].parent.filter(|p| self.trunk[*p] && !self.trunk[i]);
                        let Some(parent) = parent.filter(|_| cuts) else {
                            state.node(k, i, &given);
                            continue;
                        };
                        let before = read(|visit| state.carried(k, parent, &given, visit));
                        state.carried(k, parent, &given, |e| *e = Expr::Const(0.0));
                        state.node(k, i, &given);
                        let mut before = before.into_iter();
                        state.carried_by_sweeps(k, parent, &given, |value, e| {
                            let crossing = Crossing::Carried { node: i, value };
                            self.cut_limb(set, crossing, solved, e, &mut from_limbs[usize::from(solved)]);
                            *e = before.next().unwrap_or(Expr::Const(0.0)) + *e;
                        });
                    }
                    if inward && self.root.is_none() {
                        self.cut_running(set, k, &mut state, &given);
                    }
                }
                SweepDirection::BaseToTip => {
                    if cuts && self.root.is_none() {
                        self.cut_outward(set, k, &before, &mut state, &given, &mut trunk, &mut multipliers);
                    }
                    for i in 0..n {
                        state.node(k, i, &given);
                        if cuts && self.root == Some(i) {
                            self.cut_outward(set, k, &before, &mut state, &given, &mut trunk, &mut multipliers);
                        }
                    }
                }
            }
            state.end(k, &given);
        }
        let results = state.finish(&given);
        Some(Traced { results, trunk, from_limbs, multipliers })
    }

    /// Replaces what a pass updates at every node: of all rows first their whole diagonals.
    fn cut_running(&mut self, set: &[usize], pass: usize, state: &mut PassState<'g, '_>, given: &SymbolicInputs<'g>) {
        let slots: Vec<usize> = (0..state.tree.unknowns.len()).filter(|g| state.tree.is_slot(*g)).collect();
        // Rows that limbs have eliminated do not cross: they would only shift the numbers of those that do.
        let crosses: Vec<bool> = slots.iter().map(|unknown| self.crosses(*unknown)).collect();
        let n = slots.len();
        let mut number = 0;
        state.running(pass, given, |e| {
            let (crossing, kind) = match number {
                k if k < n => (crosses[k], Kind::Whole),
                k if k < n + n * n => (crosses[(k - n) / n] && crosses[(k - n) % n], Kind::Other),
                k => (crosses[(k - n) % n], Kind::Other),
            };
            if crossing {
                self.cut(set, kind, e);
            }
            number += 1;
        });
    }

    /// Whether an unknown is solved in the trunk, as far as it belongs to a contact.
    fn crosses(&self, unknown: usize) -> bool {
        self.contact_of(unknown).is_none_or(|contact| self.reaching[contact])
    }

    /// Replaces what a limb hands to the trunk where that depends on the modes of the limb.
    fn cut_limb(
        &mut self,
        set: &[usize],
        crossing: Crossing,
        solved: bool,
        e: &mut Expr<'g>,
        from_limbs: &mut BTreeMap<Crossing, Expr<'g>>,
    ) {
        let value = output(*e);
        if set.iter().all(|m| *m == 0) {
            self.in_flight.insert(crossing, value);
        }
        if self.in_flight.get(&crossing).is_some_and(|other| *other != value) {
            self.found.insert(crossing);
        }
        if self.of_limb.contains(&crossing) {
            from_limbs.insert(crossing, *e);
            *e = self.symbol_for(if solved { Symbol::BackFromLimb(crossing) } else { Symbol::FromLimb(crossing) });
        } else if !solved {
            self.cut(set, Kind::Other, e);
        }
    }

    /// After the trunk: its motion, and the multipliers that differ from what they were `before` the pass.
    fn cut_outward(
        &mut self,
        set: &[usize],
        pass: usize,
        before: &[ProgramResult],
        state: &mut PassState<'g, '_>,
        given: &SymbolicInputs<'g>,
        trunk: &mut BTreeMap<Crossing, Expr<'g>>,
        multipliers: &mut Vec<(usize, usize, Expr<'g>)>,
    ) {
        for node in (0..self.trunk.len()).filter(|i| self.trunk[*i]).collect::<Vec<_>>() {
            state.carried_by_sweeps(pass, node, given, |value, e| {
                self.cut_trunk(set, Crossing::Carried { node, value }, e, trunk);
            });
        }
        let all: Vec<(usize, usize, Expr<'g>)> = state.unknowns().map(|(level, g, e)| (level, g, *e)).collect();
        let mut new = Vec::new();
        for ((level, unknown, mut e), before) in all.into_iter().zip(before) {
            if output(e) != *before {
                match self.limb_of(unknown) {
                    None => self.cut_trunk(set, Crossing::Unknown { level, unknown }, &mut e, trunk),
                    Some(_) => {
                        multipliers.push((level, unknown, e));
                        e = self.symbol_for(Symbol::Multiplier { level, unknown });
                    }
                }
            }
            new.push(e);
        }
        state.unknowns().zip(new).for_each(|((_, _, e), new)| *e = new);
    }

    fn cut_trunk(
        &mut self,
        set: &[usize],
        crossing: Crossing,
        e: &mut Expr<'g>,
        trunk: &mut BTreeMap<Crossing, Expr<'g>>,
    ) {
        let value = output(*e);
        if set.iter().all(|m| *m == 0) {
            self.trunk_in_flight.insert(crossing, value);
        }
        // Sweeps that flight does not need hand on what is the same in all modes, before the trunk is solved.
        let differs = match self.trunk_in_flight.get(&crossing) {
            Some(other) => *other != value,
            None => matches!(*e, Expr::Node { id, .. } if !self.class(id).is_early()),
        };
        if differs {
            self.found_of_trunk.insert(crossing);
        }
        if self.always.contains(&crossing) {
            trunk.insert(crossing, *e);
            *e = self.symbol_for(Symbol::Trunk(crossing));
        }
    }

    /// A value of the trunk in terms of what was handed to it and given back; `None`: it cannot be cut.
    pub fn substituted(&mut self, set: &[usize], e: Expr<'g>, memo: &mut BTreeMap<u32, Expr<'g>>) -> Option<Expr<'g>> {
        let Expr::Node { id, neg, .. } = e else { return Some(e) };
        // Operands first, without recursion: chains are long.
        let mut stack = vec![id];
        while let Some(&at) = stack.last() {
            if memo.contains_key(&at) {
                stack.pop();
                continue;
            }
            let (op, _) = self.graph.get(at);
            let plain = Expr::Node { graph: self.graph, id: at, neg: false };
            if matches!(op, Op::Input(_)) {
                memo.insert(at, plain);
                continue;
            }
            let class = self.class(at);
            if class.is_early() {
                let handed = if self.of_limbs(at) {
                    self.hand_over(set, Handed { id: at, neg: false, kind: Kind::Other })
                } else {
                    None
                };
                let e = handed.unwrap_or(plain);
                memo.insert(at, e);
                continue;
            }
            if class.late && !class.handed && !class.returned && class.groups.count_ones() <= 1 {
                let e = match class.groups {
                    0 => plain,
                    bits => self.give_back(set, bits.trailing_zeros() as usize, at)?,
                };
                memo.insert(at, e);
                continue;
            }
            let missing: Vec<u32> = nodes(&op).filter(|id| !memo.contains_key(id)).collect();
            if !missing.is_empty() {
                stack.extend(missing);
                continue;
            }
            let operand = |id: u32| match memo[&id] {
                Expr::Node { id, .. } => id,
                Expr::Const(_) => unreachable!("symbols and operations are no constants"),
            };
            let new = op.renumbered(operand);
            let made = if new == op { plain } else { self.graph.like(at, new) };
            memo.insert(at, made);
        }
        Some(if neg { -memo[&id] } else { memo[&id] })
    }

    /// The symbol for a number that limb `g` gives back.
    fn give_back(&mut self, set: &[usize], g: usize, id: u32) -> Option<Expr<'g>> {
        let place = self.places(set).iter().position(|k| *k == g)?;
        let entry = entry_of(self.returned.entry((g, set[g])).or_default(), id);
        Some(self.symbol_for(Symbol::Returned { place, entry }))
    }
}

/// Place of a node in a list, to which it is added if it is new.
pub fn entry_of<T: PartialEq>(list: &mut Vec<T>, id: T) -> usize {
    list.iter().position(|x| *x == id).unwrap_or_else(|| {
        list.push(id);
        list.len() - 1
    })
}

/// Adds all nodes to a set that some values need.
pub fn reach(graph: &Graph, values: &[Expr], all: &mut BTreeSet<u32>) {
    let mut stack: Vec<u32> =
        values.iter().filter_map(|e| if let Expr::Node { id, .. } = e { Some(*id) } else { None }).collect();
    while let Some(id) = stack.pop() {
        if all.insert(id) {
            stack.extend(
                graph.get(id).0.operands().filter_map(|o| if let Operand::Node(k) = o { Some(k) } else { None }),
            );
        }
    }
}

/// The nodes that constraint `index` of a plan binds.
fn members(plan: &Plan, index: usize) -> Vec<usize> {
    match &plan.constraints[index].bond {
        PlanBond::Cut { frames, .. } => frames.iter().filter_map(|frame| frame.node).collect(),
        PlanBond::Coupling { terms, .. } => terms.iter().map(|(node, _)| *node).collect(),
    }
}

/// Whether rows of a constraint are eliminated in the trunk or at the ground.
fn reaches(plan: &Plan, index: usize, trunk: &[bool]) -> bool {
    let inboard = plan.nodes.iter().zip(trunk).filter(|(_, trunk)| **trunk);
    let solved =
        inboard.flat_map(|(node, _)| node.elimination.solve_before.iter().chain(&node.elimination.solve_after));
    let slots = &plan.constraints[index].slots;
    solved.chain(&plan.solve_at_ground).any(|unknown| slots.contains(unknown))
}

/// Numbers of the constraints that are contacts, in the order of the contacts.
fn of_contacts(plan: &Plan) -> std::ops::Range<usize> {
    plan.constraints.len() - plan.model.contacts.len()..plan.constraints.len()
}

/// The nodes inboard of everything that contacts bind, and the outermost of them.
fn trunk(plan: &Plan) -> (Vec<bool>, Option<usize>) {
    let mut common: Option<Vec<usize>> = None;
    for node in of_contacts(plan).flat_map(|index| members(plan, index)) {
        let way = plan.ancestors(node);
        common = Some(match common {
            None => way,
            Some(common) => common.into_iter().filter(|i| way.contains(i)).collect(),
        });
    }
    let common = common.unwrap_or_default();
    // Where there is one contact only, its own body is the outermost node of the trunk.
    let trunk = (0..plan.nodes.len()).map(|i| common.contains(&i)).collect();
    (trunk, common.first().copied())
}

/// Contacts by the branches of the trunk that they bind.
fn limbs(full: &Plan, plan: &Plan, trunk: &[bool]) -> Option<(Vec<Limb>, Vec<BTreeSet<usize>>)> {
    let mut groups: Vec<(Vec<usize>, BTreeSet<usize>)> = Vec::new();
    for (contact, index) in of_contacts(plan).enumerate() {
        let branch = |node: usize| plan.ancestors(node).into_iter().take_while(|i| !trunk[*i]).last();
        let mut branches: BTreeSet<usize> = members(plan, index).into_iter().filter_map(branch).collect();
        let mut contacts = vec![contact];
        groups.retain(|(others, of_others)| {
            let apart = of_others.is_disjoint(&branches);
            if !apart {
                contacts.extend(others);
                branches.extend(of_others);
            }
            apart
        });
        groups.push((contacts, branches));
    }
    for (contacts, _) in &mut groups {
        contacts.sort_unstable();
    }
    groups.sort();
    let limb = |(contacts, branches): (Vec<usize>, BTreeSet<usize>)| {
        let mut modes = vec![Vec::new()];
        for &contact in &contacts {
            let contact = &full.model.contacts[contact];
            let each = modes_of(&contact.kind, contact.friction);
            modes = modes.iter().flat_map(|set: &Vec<Mode>| each.iter().map(|m| [&set[..], &[*m]].concat())).collect();
            if modes.len() > MOST_LIMB_MODES {
                return None;
            }
        }
        Some((Limb { contacts, modes }, branches))
    };
    let limbs = groups.into_iter().map(limb).collect::<Option<Vec<_>>>()?;
    Some(limbs.into_iter().unzip())
}
