//! Pieces out of symbolic runs: which piece computes what, and where it keeps it.

use std::collections::{BTreeMap, BTreeSet};

use mbd_runtime::contact::Mode;

use super::tracing::{entry_of, reach, Crossing, Symbol, Traced, Tracing};
use super::{FactoredProgram, Goal, Group, LimbMode, Piece, Source, Trunk};
use crate::options::Options;
use crate::output::{Output, OutputProgram};
use crate::plan::Plan;
use crate::rolled::{assemble, nodes, output as result_of};
use crate::symbolic::{passes, Expr, Graph, Op, Program, ProgramResult};
use crate::trace::rewrite;

/// Largest number of sequences of limbs that touch.
pub const MOST_TRUNKS: usize = 729;

/// The code of an output for all sets of modes of its contacts; `None` where it cannot be taken apart, or where there are
/// too many pieces. `full` is the plan with the rows of all contacts.
pub fn factored(full: &Plan, output: Output, options: &Options) -> Option<OutputProgram<FactoredProgram>> {
    let graph = Graph::default();
    let tracing = Tracing::new(&graph, full, output, options)?;
    let mut cutting = Cutting::new(tracing)?;
    cutting.classes()?;
    cutting.trunks()?;
    cutting.program(output, options)
}

/// Which piece writes a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Writer {
    /// The same in all modes.
    Always,
    /// A limb after the trunk.
    Limb(usize),
    /// The trunk at the end.
    Trunk,
}

/// Pieces of which one runs in each set of modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Slot {
    Limb(usize),
    Trunk,
    Always,
}

/// What a piece is to compute. Numbers of parts and kept numbers are symbols until all are known.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wanted {
    Result(usize),
    Symbol(Symbol),
    /// Number `entry` of the multipliers of the `place`-th limb that touches.
    Multiplier {
        place: usize,
        entry: usize,
    },
}

/// A piece to be made.
struct Plot {
    slot: Slot,
    /// Which of the pieces of the slot.
    choice: usize,
    /// Whether it runs after the trunk.
    late: bool,
    wanted: Vec<(ProgramResult, Wanted)>,
    /// Operations that it needs.
    needs: BTreeSet<u32>,
}

/// What a piece computes, and what is wanted of it.
type Made = (BTreeSet<u32>, Vec<(ProgramResult, Wanted)>);

/// What a trunk computes: before the limbs, and at the end.
type TrunkWanted = [Vec<(ProgramResult, Wanted)>; 2];

struct Cutting<'g, 'a> {
    tracing: Tracing<'g, 'a>,
    /// Flight, and each limb alone in each of its modes.
    alone: BTreeMap<(usize, usize), Traced<'g>>,
    writers: Vec<Writer>,
    /// Numbers that the trunk has to give.
    live: BTreeSet<Symbol>,
    /// For each limb, the class of each of its modes: those of one class are the same to the trunk.
    classes: Vec<Vec<usize>>,
    /// A mode of each class.
    members: Vec<Vec<usize>>,
    trunks: Vec<TrunkWanted>,
    /// Classes of the limbs, and the trunk.
    sequences: Vec<(Vec<usize>, usize)>,
    /// Multipliers that a limb reads, in the order of their numbers in its part.
    multipliers: BTreeMap<(usize, usize), Vec<(usize, usize)>>,
}

/// Where an operation is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Home {
    Always,
    Touching,
    Outward,
    /// In each piece that needs it.
    Each,
}

impl<'g, 'a> Cutting<'g, 'a> {
    fn new(mut tracing: Tracing<'g, 'a>) -> Option<Self> {
        let limbs: Vec<usize> = tracing.limbs.iter().map(|limb| limb.modes.len()).collect();
        let mut alone = BTreeMap::new();
        for (g, modes) in limbs.iter().enumerate() {
            for m in 0..*modes {
                let set = only(limbs.len(), g, m);
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
        reach(cutting.tracing.graph, &all, &mut live);
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
                let mut trunks = vec![self.trunk(&only(limbs, g, m), &alone)?];
                let contacts = self.tracing.reaching_contacts(g, m);
                let others = [before, after].into_iter().flatten().filter(|_| !contacts.is_empty());
                for other in others {
                    let mut set = only(limbs, g, m);
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
            let set: Vec<usize> = sequence.iter().zip(&self.members).map(|(class, members)| members[*class]).collect();
            let traced = self.tracing.trace(&set, true)?;
            let trunk = self.trunk(&set, &traced)?;
            let number = entry_of(&mut self.trunks, trunk);
            self.sequences.push((sequence, number));
        }
        Some(())
    }

    /// What a node is a symbol for.
    fn symbol(&self, id: u32) -> Option<Symbol> {
        match self.tracing.graph.get(id).0 {
            Op::Input(k) => self.tracing.symbol(k),
            _ => None,
        }
    }

    /// All pieces with what is wanted of them.
    fn plots(&mut self) -> Option<Vec<Plot>> {
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
            let all = self.alone[&(g, m)].from_limbs[late].iter();
            let own = all.filter(|(key, _)| self.tracing.limb_of_crossing(**key) == Some(g));
            own.map(|(key, e)| (result_of(*e), Wanted::Symbol(symbol(*key)))).collect::<Vec<_>>()
        };
        add(Slot::Always, 0, true, results((0, 0), Writer::Always));
        for (g, limb) in self.tracing.limbs.iter().enumerate() {
            for m in 0..limb.modes.len() {
                let handed = self.tracing.handed.get(&(g, m)).into_iter().flatten().enumerate();
                let mut handed: Vec<(ProgramResult, Wanted)> = handed
                    .map(|(entry, handed)| {
                        (ProgramResult::Node(handed.id, handed.neg), Wanted::Symbol(Symbol::Handed { place: 0, entry }))
                    })
                    .collect();
                handed.retain(|(_, wanted)| match wanted {
                    Wanted::Symbol(Symbol::Handed { entry, .. }) => used.contains(&(g, m, *entry)),
                    _ => true,
                });
                handed.extend(crossing((g, m), 0, Symbol::FromLimb));
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
            let values = plot.wanted.iter().map(|(value, _)| match *value {
                ProgramResult::Const(x) => Expr::Const(x),
                ProgramResult::Node(id, neg) => Expr::Node { graph, id, neg },
            });
            reach(graph, &values.collect::<Vec<_>>(), &mut plot.needs);
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
                let graph = self.tracing.graph;
                let values = wanted.iter().flatten().filter_map(|(value, _)| match *value {
                    ProgramResult::Const(_) => None,
                    ProgramResult::Node(id, neg) => Some(Expr::Node { graph, id, neg }),
                });
                let mut all = BTreeSet::new();
                reach(graph, &values.collect::<Vec<_>>(), &mut all);
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
            let set: Vec<usize> = sequence.iter().zip(&self.members).map(|(class, members)| members[*class]).collect();
            let places = self.tracing.places(&set);
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

    /// Where operations are computed.
    fn homes(&mut self, plots: &[Plot]) -> BTreeMap<u32, Home> {
        let mut users: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (k, plot) in plots.iter().enumerate() {
            plot.needs.iter().for_each(|id| users.entry(*id).or_default().push(k));
        }
        let choices = |slot: Slot| match slot {
            Slot::Always => 1,
            Slot::Limb(g) => self.tracing.limbs[g].modes.len(),
            Slot::Trunk => self.trunks.len(),
        };
        let flight = self.sequences[0].1;
        let mut placed = Vec::new();
        for (id, users) in users {
            let mut of_slot: BTreeMap<Slot, BTreeSet<usize>> = BTreeMap::new();
            for plot in users.into_iter().map(|k| &plots[k]) {
                of_slot.entry(plot.slot).or_default().insert(plot.choice);
            }
            let all = of_slot.iter().any(|(slot, used)| used.len() == choices(*slot));
            let in_flight = of_slot.iter().any(|(slot, used)| match slot {
                Slot::Always => true,
                Slot::Limb(_) => used.contains(&0),
                Slot::Trunk => used.contains(&flight),
            });
            placed.push((id, all || (in_flight && of_slot.len() > 1), of_slot.len() > 1));
        }
        let home = |(id, always, several): (u32, bool, bool)| {
            let class = self.tracing.class(id);
            let home = match (class.is_early(), class.late && !class.handed && !class.returned && class.groups == 0) {
                (true, _) if always => Home::Always,
                (true, _) if several => Home::Touching,
                (_, true) if always => Home::Outward,
                _ => Home::Each,
            };
            (id, home)
        };
        placed.into_iter().map(home).collect()
    }

    /// The program.
    fn program(mut self, output: Output, options: &Options) -> Option<OutputProgram<FactoredProgram>> {
        let plots = self.plots()?;
        let homes = self.homes(&plots);
        let graph = self.tracing.graph;
        let own =
            |home: Home| -> BTreeSet<u32> { homes.iter().filter(|(_, h)| **h == home).map(|(id, _)| *id).collect() };
        // What each piece computes.
        let mut owned: Vec<BTreeSet<u32>> = Vec::new();
        for plot in &plots {
            let mut each: BTreeSet<u32> = plot.needs.iter().copied().filter(|id| homes[id] == Home::Each).collect();
            // What the piece before the trunk has computed is kept.
            if plot.late && plot.slot != Slot::Always {
                let before = plots
                    .iter()
                    .zip(&owned)
                    .find(|(p, _)| (p.slot, p.choice, p.late) == (plot.slot, plot.choice, false));
                let before = before.expect("pieces before the trunk come first").1;
                each.retain(|id| !before.contains(id));
            }
            owned.push(each);
        }
        // The pieces of all modes: those of the plots, and three more.
        let (always, touching, mut outward) = (own(Home::Always), own(Home::Touching), own(Home::Outward));
        outward.extend(&owned[0]);
        owned[0] = outward;
        let reads = |own: &BTreeSet<u32>, wanted: &[(ProgramResult, Wanted)]| -> BTreeSet<u32> {
            let operands = own.iter().flat_map(|id| nodes(&graph.get(*id).0).collect::<Vec<_>>());
            let results = wanted.iter().filter_map(|(value, _)| match value {
                ProgramResult::Node(id, _) => Some(*id),
                ProgramResult::Const(_) => None,
            });
            operands.chain(results).filter(|id| !own.contains(id)).collect()
        };
        let mut pieces: Vec<Made> = vec![(always, Vec::new()), (touching, Vec::new())];
        pieces.extend(owned.into_iter().zip(&plots).map(|(own, plot)| (own, plot.wanted.clone())));
        let of_plot = |k: usize| k + 2;
        let read: Vec<BTreeSet<u32>> = pieces.iter().map(|(own, wanted)| reads(own, wanted)).collect();
        // Numbers kept for all, then those of the trunk, then those that the two pieces of a limb or a trunk keep.
        let mut kept: BTreeMap<u32, usize> = BTreeMap::new();
        for id in read.iter().flatten() {
            if homes.get(id).is_some_and(|home| *home != Home::Each) && !kept.contains_key(id) {
                kept.insert(*id, kept.len());
            }
        }
        let crossing: BTreeSet<Symbol> = read
            .iter()
            .flatten()
            .filter_map(|id| self.symbol(*id))
            .filter(|s| matches!(s, Symbol::Trunk(_) | Symbol::FromLimb(_) | Symbol::BackFromLimb(_)))
            .collect();
        let first = kept.len();
        let crossing: BTreeMap<Symbol, usize> = crossing.into_iter().zip(first..).collect();
        let mut next = first + crossing.len();
        let mut of_pair: BTreeMap<(Slot, usize), BTreeMap<u32, usize>> = BTreeMap::new();
        let slots: BTreeSet<Slot> = plots.iter().map(|plot| plot.slot).filter(|slot| *slot != Slot::Always).collect();
        for slot in slots {
            let mut most = 0;
            for (k, plot) in plots.iter().enumerate().filter(|(_, p)| p.slot == slot && p.late) {
                let each = read[of_plot(k)].iter().filter(|id| homes.get(id) == Some(&Home::Each));
                let numbers: BTreeMap<u32, usize> = each.copied().zip(next..).collect();
                most = most.max(numbers.len());
                of_pair.insert((slot, plot.choice), numbers);
            }
            next += most;
        }
        // Parts: what is handed over, multipliers, what is given back.
        let entries = |of: fn(&Symbol) -> Option<usize>| -> BTreeMap<usize, usize> {
            let all: BTreeSet<usize> =
                read.iter().flatten().filter_map(|id| self.symbol(*id)).filter_map(|s| of(&s)).collect();
            all.into_iter().enumerate().map(|(k, entry)| (entry, k)).collect()
        };
        let handed = entries(|s| if let Symbol::Handed { entry, .. } = s { Some(*entry) } else { None });
        let returned = entries(|s| if let Symbol::Returned { entry, .. } = s { Some(*entry) } else { None });
        let most = self.multipliers.values().map(Vec::len).max().unwrap_or(0);
        let (at_multipliers, at_returned) = (handed.len(), handed.len() + most);
        let make = |k: usize| -> Piece {
            let (own, wanted) = &pieces[k];
            let plot = k.checked_sub(2).map(|k| &plots[k]);
            let in_limb =
                plot.and_then(|plot| if let Slot::Limb(g) = plot.slot { Some((g, plot.choice)) } else { None });
            let pair = plot.and_then(|plot| of_pair.get(&(plot.slot, plot.choice)));
            let source = |id: u32| -> Source {
                if let Op::Input(input) = graph.get(id).0 {
                    return match self.tracing.symbol(input) {
                        None => Source::Given(input as usize),
                        Some(symbol @ (Symbol::Trunk(_) | Symbol::FromLimb(_) | Symbol::BackFromLimb(_))) => {
                            Source::Kept(crossing[&symbol])
                        }
                        Some(Symbol::Handed { place, entry }) => Source::Part { place, entry: handed[&entry] },
                        Some(Symbol::Returned { place, entry }) => {
                            Source::Part { place, entry: at_returned + returned[&entry] }
                        }
                        Some(Symbol::Multiplier { level, unknown }) => {
                            let of_limb = in_limb.and_then(|limb| self.multipliers.get(&limb)).into_iter().flatten();
                            let entry = of_limb.into_iter().position(|x| *x == (level, unknown));
                            Source::Own(at_multipliers + entry.expect("a limb reads its own multipliers"))
                        }
                    };
                }
                match kept.get(&id).or_else(|| pair.and_then(|pair| pair.get(&id))) {
                    Some(number) => Source::Kept(*number),
                    None => unreachable!("what a piece does not compute is kept for it"),
                }
            };
            let goal = |wanted: Wanted| -> Option<Goal> {
                Some(match wanted {
                    Wanted::Result(result) => Goal::Result(result),
                    Wanted::Symbol(symbol @ (Symbol::Trunk(_) | Symbol::FromLimb(_) | Symbol::BackFromLimb(_))) => {
                        Goal::Kept(*crossing.get(&symbol)?)
                    }
                    Wanted::Symbol(Symbol::Handed { entry, .. }) => Goal::Own(*handed.get(&entry)?),
                    Wanted::Symbol(Symbol::Returned { entry, .. }) => Goal::Own(at_returned + *returned.get(&entry)?),
                    Wanted::Symbol(Symbol::Multiplier { .. }) => return None,
                    Wanted::Multiplier { place, entry } => Goal::Part { place, entry: at_multipliers + entry },
                })
            };
            let mut results: Vec<(ProgramResult, Goal)> =
                wanted.iter().filter_map(|(value, wanted)| Some((*value, goal(*wanted)?))).collect();
            let keeps = own.iter().filter_map(|id| {
                let early = plot.is_some_and(|plot| !plot.late);
                let number = kept.get(id).or_else(|| pair.filter(|_| early).and_then(|pair| pair.get(id)))?;
                Some((ProgramResult::Node(*id, false), Goal::Kept(*number)))
            });
            results.extend(keeps);
            let (program, inputs, outputs) = assemble(graph, own, source, &results);
            Piece { program: compact(passes::run(program, rewrite(options))), inputs, outputs }
        };
        let number = |slot: Slot, choice: usize, late: bool| -> usize {
            let plot = plots.iter().position(|p| (p.slot, p.choice, p.late) == (slot, choice, late));
            of_plot(plot.expect("all pieces are there"))
        };
        let pair = |slot: Slot, choice: usize| [false, true].map(|late| make(number(slot, choice, late)));
        let groups = self.tracing.limbs.iter().enumerate().map(|(g, limb)| Group {
            contacts: limb.contacts.clone(),
            modes: limb
                .modes
                .iter()
                .enumerate()
                .map(|(m, modes): (usize, &Vec<Mode>)| {
                    let [inward, outward] = pair(Slot::Limb(g), m);
                    let reaches = !self.tracing.reaching_contacts(g, m).is_empty();
                    LimbMode { modes: modes.clone(), reaches, class: self.classes[g][m], inward, outward }
                })
                .collect(),
        });
        let trunks = (0..self.trunks.len()).map(|t| {
            let [solve, finish] = pair(Slot::Trunk, t);
            Trunk { solve, finish }
        });
        let program = FactoredProgram {
            results: self.writers.len(),
            acts: self.tracing.given.first_of("acts"),
            kept: next,
            part: at_returned + returned.len(),
            always: make(0),
            touching: make(1),
            groups: groups.collect(),
            outward: make(number(Slot::Always, 0, true)),
            trunks: trunks.collect(),
            sequences: self.sequences.iter().map(|(_, trunk)| *trunk).collect(),
        };
        Some(OutputProgram { spec: output.spec(), inputs: self.tracing.given.arrays.clone(), program })
    }
}

/// All limbs in flight but one.
fn only(limbs: usize, g: usize, m: usize) -> Vec<usize> {
    (0..limbs).map(|k| if k == g { m } else { 0 }).collect()
}

/// The program with its nodes numbered from zero.
fn compact(program: Program) -> Program {
    let numbers: BTreeMap<u32, u32> = program.steps.iter().enumerate().map(|(k, (id, ..))| (*id, k as u32)).collect();
    let steps = program.steps.iter().map(|(id, op, label)| (numbers[id], op.renumbered(|id| numbers[&id]), *label));
    let outputs = program.outputs.iter().map(|result| match *result {
        ProgramResult::Node(id, neg) => ProgramResult::Node(numbers[&id], neg),
        constant => constant,
    });
    let mut names: Vec<_> = program.names.iter().filter_map(|(id, name)| Some((*numbers.get(id)?, *name))).collect();
    names.sort_by_key(|(id, _)| *id);
    Program { steps: steps.collect(), outputs: outputs.collect(), names, created: program.created }
}
