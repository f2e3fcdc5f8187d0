//! Pieces out of symbolic runs: what is wanted of each. `layout.rs` says which operation stands in which.

use std::collections::{BTreeMap, BTreeSet};

use super::symbols::{Crossing, Symbol};
use super::tracing::{entry_of, only, reach, Traced, Tracing};
use super::FactoredProgram;
use crate::options::Options;
use crate::output::{Output, OutputProgram};
use crate::plan::Plan;
use crate::rolled::output as result_of;
use crate::symbolic::{Expr, Graph, Op, ProgramResult};

/// Largest number of sequences of limbs that touch.
pub const MOST_TRUNKS: usize = 729;

/// The code of an output for all sets of modes of its contacts. `full` is the plan with the rows of all contacts
/// ([`Plan::with_contacts`]). `None` where it cannot be taken apart, where there are too many pieces, and for a plan without
/// contacts or without their rows.
pub fn factored(full: &Plan, output: Output, options: &Options) -> Option<OutputProgram<FactoredProgram>> {
    if full.model.contacts.is_empty() || !full.contact_frames.is_empty() {
        return None;
    }
    let graph = Graph::default();
    let tracing = Tracing::new(&graph, full, output, options)?;
    let mut cutting = Cutting::new(tracing)?;
    cutting.classes()?;
    cutting.trunks()?;
    cutting.program(output, options)
}

/// Which piece writes a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Writer {
    /// The same in all modes.
    Always,
    /// A limb after the trunk.
    Limb(usize),
    /// The trunk at the end.
    Trunk,
}

/// Pieces of which one runs in each set of modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Slot {
    Limb(usize),
    Trunk,
    Always,
}

/// What a piece is to compute. Numbers of parts and kept numbers are symbols until all are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wanted {
    Result(usize),
    Symbol(Symbol),
    /// Whether all early rows of a limb act.
    EarlyRowsAct(usize),
    /// Number `entry` of the multipliers of the `place`-th limb that touches.
    Multiplier {
        place: usize,
        entry: usize,
    },
}

/// A piece to be made.
pub(super) struct Plot {
    pub(super) slot: Slot,
    /// Which of the pieces of the slot.
    pub(super) choice: usize,
    /// Whether it runs after the trunk.
    pub(super) late: bool,
    pub(super) wanted: Vec<(ProgramResult, Wanted)>,
    /// Operations that it needs.
    pub(super) needs: BTreeSet<u32>,
}

/// What a trunk computes: before the limbs, and at the end.
pub(super) type TrunkWanted = [Vec<(ProgramResult, Wanted)>; 2];

pub(super) struct Cutting<'g, 'a> {
    pub(super) tracing: Tracing<'g, 'a>,
    /// Flight, and each limb alone in each of its modes.
    alone: BTreeMap<(usize, usize), Traced<'g>>,
    pub(super) writers: Vec<Writer>,
    /// Numbers that the trunk has to give.
    live: BTreeSet<Symbol>,
    /// For each limb, the class of each of its modes: those of one class are the same to the trunk.
    pub(super) classes: Vec<Vec<usize>>,
    /// A mode of each class.
    members: Vec<Vec<usize>>,
    pub(super) trunks: Vec<TrunkWanted>,
    /// Classes of the limbs, and the trunk.
    pub(super) sequences: Vec<(Vec<usize>, usize)>,
    /// Multipliers that a limb reads, in the order of their numbers in its part.
    pub(super) multipliers: BTreeMap<(usize, usize), Vec<(usize, usize)>>,
}

impl<'g, 'a> Cutting<'g, 'a> {
    fn new(mut tracing: Tracing<'g, 'a>) -> Option<Self> {
        let limbs: Vec<usize> = tracing.limbs.iter().map(|limb| limb.modes.len()).collect();
        let mut alone = BTreeMap::new();
        for (g, modes) in limbs.iter().enumerate() {
            for m in 0..*modes {
                let set = only(limbs.len(), (g, m));
                alone.insert((g, m), tracing.trace(&set, true)?);
            }
        }
        let mut cutting = Cutting {
            tracing,
            alone,
            writers: Vec::new(),
            live: BTreeSet::new(),
            classes: Vec::new(),
            members: Vec::new(),
            trunks: Vec::new(),
            sequences: Vec::new(),
            multipliers: BTreeMap::new(),
        };
        let count = cutting.flight().results.len();
        cutting.writers = (0..count).map(|k| cutting.writer(k)).collect();
        let back = |t: &Traced<'g>| t.from_limbs[1].values().copied().collect::<Vec<_>>();
        let all: Vec<Expr> = cutting.alone.values().flat_map(|t| [t.results.clone(), back(t)].concat()).collect();
        let mut live = BTreeSet::new();
        reach(cutting.tracing.graph, all.iter().filter_map(|e| node(&result_of(*e))), &mut live);
        cutting.live = live.into_iter().filter_map(|id| cutting.symbol(id)).collect();
        Some(cutting)
    }

    fn flight(&self) -> &Traced<'g> {
        &self.alone[&(0, 0)]
    }

    fn writer(&mut self, result: usize) -> Writer {
        let value = |t: &Traced<'g>| t.results[result];
        let flight = result_of(value(self.flight()));
        let mut limbs = BTreeSet::new();
        let all: Vec<(usize, Expr<'g>)> = self.alone.iter().map(|((g, _), t)| (*g, value(t))).collect();
        for (g, e) in all {
            if let Expr::Node { id, .. } = e {
                let class = self.tracing.class(id);
                if class.handed || class.returned {
                    return Writer::Trunk;
                }
            }
            if result_of(e) != flight {
                limbs.insert(g);
            }
        }
        match limbs.len() {
            0 => Writer::Always,
            1 => Writer::Limb(limbs.into_iter().next().unwrap_or(0)),
            _ => Writer::Trunk,
        }
    }

    /// What the trunk computes in one set of modes.
    fn trunk(&mut self, set: &[usize], traced: &Traced<'g>) -> Option<TrunkWanted> {
        let memo = &mut BTreeMap::new();
        let (mut solve, mut finish) = (Vec::new(), Vec::new());
        for (key, e) in &traced.trunk {
            if self.live.contains(&Symbol::Trunk(*key)) {
                let e = self.tracing.substituted(set, *e, memo)?;
                solve.push((result_of(e), Wanted::Symbol(Symbol::Trunk(*key))));
            }
        }
        let places = self.tracing.places(set);
        for (level, unknown, e) in &traced.multipliers {
            if self.live.contains(&Symbol::Multiplier { level: *level, unknown: *unknown }) {
                let e = self.tracing.substituted(set, *e, memo)?;
                let g = self.tracing.limb_of(*unknown)?;
                let entry = entry_of(self.multipliers.entry((g, set[g])).or_default(), (*level, *unknown));
                let place = places.iter().position(|k| *k == g)?;
                solve.push((result_of(e), Wanted::Multiplier { place, entry }));
            }
        }
        for (result, e) in traced.results.iter().enumerate() {
            if self.writers[result] == Writer::Trunk {
                let e = self.tracing.substituted(set, *e, memo)?;
                finish.push((result_of(e), Wanted::Result(result)));
            }
        }
        Some([solve, finish])
    }

    /// Finds the modes of each limb that are the same to the trunk: those for which it does the same where the limb
    /// touches alone, and beside one before it and one after it. Their rows must stand alike among those of other limbs.
    fn classes(&mut self) -> Option<()> {
        let limbs = self.tracing.limbs.len();
        let reaching: Vec<Vec<(usize, Vec<usize>)>> = (0..limbs)
            .map(|g| {
                let modes = 0..self.tracing.limbs[g].modes.len();
                let contacts = modes.map(|m| (m, self.tracing.reaching_contacts(g, m)));
                contacts.filter(|(_, contacts)| !contacts.is_empty()).collect()
            })
            .collect();
        let range = |g: usize| {
            let all = || reaching[g].iter().flat_map(|(_, contacts)| contacts.iter().copied());
            Some((all().min()?, all().max()?))
        };
        for g in 0..limbs {
            let overlaps = |h: usize| match (range(g), range(h)) {
                (Some(a), Some(b)) => h != g && a.0 < b.1 && b.0 < a.1,
                _ => false,
            };
            let mixed = (0..limbs).any(overlaps);
            let before = (0..g).rev().find(|h| !reaching[*h].is_empty());
            let after = (g + 1..limbs).find(|h| !reaching[*h].is_empty());
            let (mut found, mut of_modes, mut members): (Vec<(Vec<TrunkWanted>, Vec<usize>)>, _, _) =
                (Vec::new(), Vec::new(), Vec::new());
            for m in 0..self.tracing.limbs[g].modes.len() {
                let alone = self.alone[&(g, m)].clone();
                let mut trunks = vec![self.trunk(&only(limbs, (g, m)), &alone)?];
                let contacts = self.tracing.reaching_contacts(g, m);
                let others = [before, after].into_iter().flatten().filter(|_| !contacts.is_empty());
                for other in others {
                    let mut set = only(limbs, (g, m));
                    set[other] = reaching[other][0].0;
                    let traced = self.tracing.trace(&set, true)?;
                    trunks.push(self.trunk(&set, &traced)?);
                }
                let key = (trunks, if mixed { contacts } else { Vec::new() });
                let class = found.iter().position(|other| *other == key).unwrap_or_else(|| {
                    found.push(key);
                    members.push(m);
                    found.len() - 1
                });
                of_modes.push(class);
            }
            self.classes.push(of_modes);
            self.members.push(members);
        }
        let count = self.members.iter().try_fold(1_usize, |n, members| n.checked_mul(members.len()))?;
        (count <= MOST_TRUNKS).then_some(())
    }

    /// What the trunk computes for each sequence of classes of limbs; sequences for which that is the same share it.
    fn trunks(&mut self) -> Option<()> {
        let mut sequences: Vec<Vec<usize>> = vec![Vec::new()];
        for members in &self.members {
            let longer = |sequence: &Vec<usize>| {
                (0..members.len()).map(|class| [&sequence[..], &[class]].concat()).collect::<Vec<_>>()
            };
            sequences = sequences.iter().flat_map(longer).collect();
        }
        for sequence in sequences {
            let set = self.set_of(&sequence);
            let traced = self.tracing.trace(&set, true)?;
            self.as_alone(&set, &traced).then_some(())?;
            let trunk = self.trunk(&set, &traced)?;
            let number = entry_of(&mut self.trunks, trunk);
            self.sequences.push((sequence, number));
        }
        Some(())
    }

    /// A set of modes with the given class of each limb.
    fn set_of(&self, sequence: &[usize]) -> Vec<usize> {
        sequence.iter().zip(&self.members).map(|(class, members)| members[*class]).collect()
    }

    /// Whether limbs compute and hand over beside others what they do alone.
    fn as_alone(&self, set: &[usize], traced: &Traced<'g>) -> bool {
        let results = self.writers.iter().zip(&traced.results).enumerate().all(|(r, (writer, e))| {
            let of = |limb: (usize, usize)| result_of(self.alone[&limb].results[r]) == result_of(*e);
            match *writer {
                Writer::Always => of((0, 0)),
                Writer::Limb(g) => of((g, set[g])),
                Writer::Trunk => true,
            }
        });
        let handed = |late: usize| {
            traced.from_limbs[late].iter().all(|(crossing, e)| {
                let limb = self.tracing.limb_of_crossing(*crossing);
                limb.is_none_or(|g| self.handed_by((g, set[g]), late, crossing) == result_of(*e))
            })
        };
        results && handed(0) && handed(1)
    }

    /// What a limb hands over in one of its modes, alone: nothing where a sweep is not needed.
    fn handed_by(&self, limb: (usize, usize), late: usize, crossing: &Crossing) -> ProgramResult {
        self.alone[&limb].from_limbs[late].get(crossing).map_or(ProgramResult::Const(0.0), |e| result_of(*e))
    }

    /// What a node is a symbol for.
    pub(super) fn symbol(&self, id: u32) -> Option<Symbol> {
        match self.tracing.graph.get(id).0 {
            Op::Input(k) => self.tracing.symbol(k),
            _ => None,
        }
    }

    /// All pieces with what is wanted of them.
    pub(super) fn plots(&self) -> Option<Vec<Plot>> {
        let mut plots = Vec::new();
        let mut add = |slot, choice, late, wanted: Vec<(ProgramResult, Wanted)>| {
            plots.push(Plot { slot, choice, late, wanted, needs: BTreeSet::new() });
        };
        let results = |limb: (usize, usize), writer: Writer| -> Vec<(ProgramResult, Wanted)> {
            let all = self.alone[&limb].results.iter().enumerate().filter(|(r, _)| self.writers[*r] == writer);
            all.map(|(r, e)| (result_of(*e), Wanted::Result(r))).collect()
        };
        let used = self.handed_entries()?;
        // What crosses from a limb in all modes, in one of them.
        let crossing = |(g, m): (usize, usize), late: usize, symbol: fn(Crossing) -> Symbol| {
            let modes = (0..self.tracing.limbs[g].modes.len()).map(|m| &self.alone[&(g, m)].from_limbs[late]);
            let all: BTreeSet<Crossing> = modes.flat_map(|of| of.keys().copied()).collect();
            let own = all.into_iter().filter(|key| self.tracing.limb_of_crossing(*key) == Some(g));
            own.map(|key| (self.handed_by((g, m), late, &key), Wanted::Symbol(symbol(key)))).collect::<Vec<_>>()
        };
        add(Slot::Always, 0, true, results((0, 0), Writer::Always));
        for (g, limb) in self.tracing.limbs.iter().enumerate() {
            for m in 0..limb.modes.len() {
                let handed = self.tracing.handed.get(&(g, m)).into_iter().flatten().enumerate();
                let handed = handed.filter(|(entry, _)| used.contains(&(g, m, *entry)));
                let mut handed: Vec<(ProgramResult, Wanted)> = handed
                    .map(|(entry, handed)| {
                        (ProgramResult::Node(handed.id, handed.neg), Wanted::Symbol(Symbol::Handed { place: 0, entry }))
                    })
                    .collect();
                handed.extend(crossing((g, m), 0, Symbol::FromLimb));
                let act = self.alone[&(g, m)].early_rows_act;
                handed.extend(act.map(|e| (result_of(e), Wanted::EarlyRowsAct(g))));
                let returned = self.tracing.returned.get(&(g, m)).into_iter().flatten().enumerate();
                let mut after: Vec<(ProgramResult, Wanted)> = returned
                    .map(|(entry, id)| {
                        (ProgramResult::Node(*id, false), Wanted::Symbol(Symbol::Returned { place: 0, entry }))
                    })
                    .collect();
                after.extend(crossing((g, m), 1, Symbol::BackFromLimb));
                after.extend(results((g, m), Writer::Limb(g)));
                add(Slot::Limb(g), m, false, handed);
                add(Slot::Limb(g), m, true, after);
            }
        }
        for (t, [solve, finish]) in self.trunks.iter().enumerate() {
            add(Slot::Trunk, t, false, solve.clone());
            add(Slot::Trunk, t, true, finish.clone());
        }
        for plot in &mut plots {
            let graph = self.tracing.graph;
            reach(graph, plot.wanted.iter().filter_map(|(value, _)| node(value)), &mut plot.needs);
            plot.needs.retain(|id| !matches!(graph.get(*id).0, Op::Input(_)));
        }
        Some(plots)
    }

    /// Numbers that limbs hand over and some trunk reads: limb, its mode, number. `None` where a mode does not have a
    /// number that others of its class have.
    fn handed_entries(&self) -> Option<BTreeSet<(usize, usize, usize)>> {
        let of_trunk: Vec<BTreeSet<(bool, usize, usize)>> = self
            .trunks
            .iter()
            .map(|wanted| {
                let mut all = BTreeSet::new();
                let values = wanted.iter().flatten().filter_map(|(value, _)| node(value));
                reach(self.tracing.graph, values, &mut all);
                let symbols = all.into_iter().filter_map(|id| self.symbol(id));
                symbols
                    .filter_map(|symbol| match symbol {
                        Symbol::Handed { place, entry } => Some((false, place, entry)),
                        Symbol::Returned { place, entry } => Some((true, place, entry)),
                        _ => None,
                    })
                    .collect()
            })
            .collect();
        let mut used = BTreeSet::new();
        for (sequence, trunk) in &self.sequences {
            let places = self.tracing.places(&self.set_of(sequence));
            for (late, place, entry) in &of_trunk[*trunk] {
                let g = *places.get(*place)?;
                let alike = (0..self.classes[g].len()).filter(|m| self.classes[g][*m] == sequence[g]);
                for m in alike {
                    let count = match late {
                        false => self.tracing.handed.get(&(g, m)).map_or(0, Vec::len),
                        true => self.tracing.returned.get(&(g, m)).map_or(0, Vec::len),
                    };
                    let here = (*entry < count).then_some((g, m, *entry))?;
                    if !late {
                        used.insert(here);
                    }
                }
            }
        }
        Some(used)
    }
}

/// The node of a result, if it is one.
pub(super) fn node(result: &ProgramResult) -> Option<u32> {
    match result {
        ProgramResult::Node(id, _) => Some(*id),
        ProgramResult::Const(_) => None,
    }
}
