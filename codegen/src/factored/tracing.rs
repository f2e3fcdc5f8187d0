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
use mbd_runtime::Scalar;

use super::limbs::{limbs, of_contacts, reaches, reaches_of, trunk, Limb, MOST_LIMB_MODES};
use super::symbols::{Class, Crossing, Symbol};
use crate::options::{Arithmetic, Options};
use crate::output::{InputArray, Output};
use crate::plan::Plan;
use crate::rolled::{nodes, OutputSweeps};
use crate::symbolic::{Expr, Graph, Op, ProgramResult};
use crate::trace::SymbolicInputs;

/// A number that a limb hands to the trunk: a node of the graph or its negative, because legs of the two sides have
/// columns of other signs, which the trunk is not to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handed {
    pub id: u32,
    pub neg: bool,
    /// What it is: numbers of two kinds that are equal in some modes are not so in others.
    pub kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Diagonal entries of the rows before any elimination.
    Whole,
    /// Everything else.
    Other,
}

/// A symbolic run in one set of modes.
#[derive(Clone, Debug, Default)]
pub struct Traced<'g> {
    pub results: Vec<Expr<'g>>,
    /// Values of the symbols of the trunk.
    pub trunk: BTreeMap<Crossing, Expr<'g>>,
    /// Values of the symbols that limbs hand over in all modes, before the trunk and after it.
    pub from_limbs: [BTreeMap<Crossing, Expr<'g>>; 2],
    /// Values of the multipliers of contacts: level, unknown, value.
    pub multipliers: Vec<(usize, usize, Expr<'g>)>,
    /// 1 where all early rows act, 0 where one does not.
    pub early_rows_act: Option<Expr<'g>>,
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
    /// What crosses in flight, and differs from it in some mode: it crosses as a symbol in all modes.
    pub(super) in_flight: BTreeMap<Crossing, ProgramResult>,
    pub(super) always: BTreeSet<Crossing>,
    /// What has been found to be so since.
    pub(super) found: BTreeSet<Crossing>,
    /// Whether the rows of each contact come to the trunk.
    pub(super) reaching: Vec<bool>,
    pub(super) full: &'a Plan,
    /// The plan whose elimination the output uses.
    plan: &'a Plan,
    pub(super) output: Output,
    pub(super) options: &'a Options,
    pub(super) contacts: Vec<Contact<f64>>,
    /// Whether a node belongs to the trunk; the outermost one of it.
    pub(super) trunk: Vec<bool>,
    pub(super) root: Option<usize>,
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
        let first = given.arrays.iter().map(InputArray::len).sum();
        let plan = match output {
            Output::Multipliers => full.accelerations.as_deref().unwrap_or(full),
            _ => full,
        };
        let (trunk, root) = trunk(plan);
        let (mut limbs, branches) = limbs(full, plan, &trunk)?;
        let contacts = full.contacts();
        if limbs.len() > 64 || limbs.iter().map(|limb| limb.modes.len()).sum::<usize>() > MOST_LIMB_MODES {
            return None;
        }
        limbs.iter_mut().for_each(|limb| take_early(limb, (full, options.arithmetic), &contacts, &trunk));
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
            in_flight: BTreeMap::new(),
            always: BTreeSet::new(),
            found: BTreeSet::new(),
            reaching: of_contacts(plan).map(|index| reaches(plan, index, &trunk)).collect(),
            full,
            plan,
            output,
            options,
            contacts,
            trunk,
            root,
            branches,
        };
        let count = tracing.limbs.len();
        let flight = vec![0; count];
        tracing.trace(&flight, false)?;
        tracing.flight = graph.len();
        let modes = |(g, limb): (usize, &Limb)| (1..limb.modes.len()).map(move |m| (g, m));
        let alone: Vec<(usize, usize)> = tracing.limbs.iter().enumerate().flat_map(modes).collect();
        for &one in &alone {
            let traced = tracing.trace(&only(count, one), false)?;
            let mut all = BTreeSet::new();
            reach(graph, traced.results.iter().filter_map(|e| e.node().map(|(id, _)| id)), &mut all);
            all.retain(|id| *id as usize >= tracing.flight && !matches!(graph.get(*id).0, Op::Input(_)));
            tracing.members.insert(one, all);
        }
        tracing.classes.clear();
        // What crosses is found by runs until no more is: what crosses before the trunk decides what does after it.
        loop {
            tracing.trace(&flight, true)?;
            for &one in &alone {
                tracing.trace(&only(count, one), true)?;
            }
            if tracing.found.is_subset(&tracing.always) {
                break;
            }
            tracing.always.extend(tracing.found.iter().copied());
        }
        tracing.handed.clear();
        tracing.returned.clear();
        Some(tracing)
    }

    /// The plan in a set of modes.
    pub fn plan(&self, set: &[usize]) -> Plan {
        let plan = self.full.acting(&rows_that_act(self.full.dims.rows, &self.contacts, &self.modes(set)));
        let limbs = self.limbs.iter().zip(set).filter(|(limb, m)| limb.late[**m].is_some());
        plan.with_early_contacts(&limbs.flat_map(|(limb, _)| &limb.contacts).copied().collect::<Vec<_>>())
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

    pub(super) fn symbol_for(&mut self, symbol: Symbol) -> Expr<'g> {
        let next = self.symbols.len();
        let number = *self.numbers.entry(symbol).or_insert(next);
        if number == next {
            self.symbols.push(symbol);
        }
        self.graph.input(self.first + number)
    }

    /// Which contact an unknown belongs to.
    pub(super) fn contact_of(&self, unknown: usize) -> Option<usize> {
        let Unknown::Row(row) = self.plan.unknowns[unknown] else { return None };
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
    pub(super) fn of_limbs(&mut self, id: u32) -> bool {
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
        if limb.late[m].is_some() {
            return Vec::new();
        }
        let closed = limb.contacts.iter().zip(&limb.modes[m]).filter(|(_, mode)| **mode != Mode::Open);
        closed.map(|(contact, _)| *contact).filter(|contact| self.reaching[*contact]).collect()
    }

    /// The symbol for a number, or its negative, that the first limb of a set hands over that computes it.
    pub(super) fn hand_over(&mut self, set: &[usize], Handed { id, neg, kind }: Handed) -> Option<Expr<'g>> {
        let places = self.places(set).into_iter().enumerate();
        let (place, g) =
            places.into_iter().find(|(_, g)| self.members.get(&(*g, set[*g])).is_some_and(|all| all.contains(&id)))?;
        let list = self.handed.entry((g, set[g])).or_default();
        let entry = entry_of(list, Handed { id, neg, kind });
        Some(self.symbol_for(Symbol::Handed { place, entry }))
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
            let class = self.class(at);
            // A multiplier of a limb is the only input that is given back.
            if matches!(op, Op::Input(_)) && class.groups == 0 {
                memo.insert(at, plain);
                continue;
            }
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

/// Has rows be eliminated in a limb in those of its modes in which it can follow all that would come to the trunk.
fn take_early(limb: &mut Limb, (full, arithmetic): (&Plan, Arithmetic), contacts: &[Contact<f64>], trunk: &[bool]) {
    let own = limb.contacts.clone();
    limb.take_early(|of_limb| {
        let mut modes = vec![Mode::Open; contacts.len()];
        own.iter().zip(of_limb).for_each(|(contact, mode)| modes[*contact] = *mode);
        let plan = full.acting(&rows_that_act(full.dims.rows, contacts, &modes));
        let early = plan.early_contacts(arithmetic);
        if early.is_empty() {
            return false;
        }
        let plan = plan.with_early_contacts(&early);
        // Another elimination for accelerations has numbers of its own for the unknowns.
        let plans = [(Some(&plan), Some(full)), (plan.accelerations.as_deref(), full.accelerations.as_deref())];
        let mut plans = plans.into_iter().filter_map(|(plan, full)| plan.zip(full));
        plans
            .all(|(plan, full)| of_contacts(full).all(|index| !reaches_of(plan, &full.constraints[index].slots, trunk)))
    });
}

/// Place of a node in a list, to which it is added if it is new.
pub fn entry_of<T: PartialEq>(list: &mut Vec<T>, id: T) -> usize {
    list.iter().position(|x| *x == id).unwrap_or_else(|| {
        list.push(id);
        list.len() - 1
    })
}

/// Adds all nodes to a set that some nodes need, themselves included.
pub fn reach(graph: &Graph, ends: impl IntoIterator<Item = u32>, all: &mut BTreeSet<u32>) {
    let mut stack: Vec<u32> = ends.into_iter().collect();
    while let Some(id) = stack.pop() {
        if all.insert(id) {
            stack.extend(nodes(&graph.get(id).0));
        }
    }
}

/// The set of modes of `limbs` limbs in which one of them is in its mode `m`, and all others are in flight.
pub fn only(limbs: usize, (g, m): (usize, usize)) -> Vec<usize> {
    (0..limbs).map(|k| if k == g { m } else { 0 }).collect()
}
