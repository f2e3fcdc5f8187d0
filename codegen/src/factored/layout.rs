//! Where each operation is computed, and where pieces keep numbers for one another.

use std::collections::{BTreeMap, BTreeSet};

use mbd_runtime::contact::Mode;

use super::pieces::{node, Cutting, Plot, Slot, Wanted};
use super::symbols::Symbol;
use super::{FactoredProgram, Goal, Group, LimbMode, Piece, Source, Trunk};
use crate::options::Options;
use crate::output::{Output, OutputProgram};
use crate::rolled::{assemble, nodes};
use crate::symbolic::{passes, Op, Program, ProgramResult};
use crate::trace::rewrite;

/// Where an operation is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Home {
    Always,
    Touching,
    Outward,
    /// In each piece that needs it.
    Each,
}

/// The operations of a piece, what is wanted of it, and which of the plots it is.
struct Made<'p> {
    own: BTreeSet<u32>,
    wanted: &'p [(ProgramResult, Wanted)],
    plot: Option<&'p Plot>,
}

/// The numbers of all places.
struct Layout {
    /// Values that several pieces read.
    kept: BTreeMap<u32, usize>,
    /// What crosses between limbs and trunk in all modes.
    crossing: BTreeMap<Symbol, usize>,
    /// Values that the two pieces of a limb or a trunk keep.
    of_pair: BTreeMap<(Slot, usize), BTreeMap<u32, usize>>,
    /// Numbers kept in all.
    count: usize,
    /// Entries of a part: what is handed over, and what is given back.
    handed: BTreeMap<usize, usize>,
    returned: BTreeMap<usize, usize>,
    /// Most multipliers of a limb, which stand between these.
    multipliers: usize,
}

impl Layout {
    fn new(cutting: &Cutting, homes: &BTreeMap<u32, Home>, pieces: &[Made]) -> Layout {
        let read: Vec<BTreeSet<u32>> = pieces.iter().map(|piece| piece.read(cutting)).collect();
        let shared = read.iter().flatten().filter(|id| homes.get(id).is_some_and(|home| *home != Home::Each));
        let shared: BTreeSet<u32> = shared.copied().collect();
        let symbols: BTreeSet<Symbol> = read.iter().flatten().filter_map(|id| cutting.symbol(*id)).collect();
        let kept: BTreeMap<u32, usize> = shared.into_iter().zip(0..).collect();
        let crosses = |s: &&Symbol| matches!(s, Symbol::Trunk(_) | Symbol::FromLimb(_) | Symbol::BackFromLimb(_));
        let crossing: BTreeMap<Symbol, usize> = symbols.iter().filter(crosses).copied().zip(kept.len()..).collect();
        let (mut count, mut of_pair) = (kept.len() + crossing.len(), BTreeMap::new());
        let slots: BTreeSet<Slot> = pieces.iter().filter_map(|piece| piece.plot).map(|plot| plot.slot).collect();
        for slot in slots.into_iter().filter(|slot| *slot != Slot::Always) {
            let mut most = 0;
            for (piece, read) in pieces.iter().zip(&read) {
                let Some(plot) = piece.plot.filter(|plot| plot.slot == slot && plot.late) else { continue };
                let each = read.iter().filter(|id| homes.get(id) == Some(&Home::Each));
                let numbers: BTreeMap<u32, usize> = each.copied().zip(count..).collect();
                most = most.max(numbers.len());
                of_pair.insert((slot, plot.choice), numbers);
            }
            count += most;
        }
        let entries = |of: fn(&Symbol) -> Option<usize>| -> BTreeMap<usize, usize> {
            let all: BTreeSet<usize> = symbols.iter().filter_map(of).collect();
            all.into_iter().zip(0..).collect()
        };
        let handed = entries(|s| if let Symbol::Handed { entry, .. } = s { Some(*entry) } else { None });
        let returned = entries(|s| if let Symbol::Returned { entry, .. } = s { Some(*entry) } else { None });
        let multipliers = cutting.multipliers.values().map(Vec::len).max().unwrap_or(0);
        Layout { kept, crossing, of_pair, count, handed, returned, multipliers }
    }

    /// Numbers of a part.
    fn part(&self) -> usize {
        self.returned_at(self.returned.len())
    }

    fn multiplier_at(&self, entry: usize) -> usize {
        self.handed.len() + entry
    }

    fn returned_at(&self, entry: usize) -> usize {
        self.handed.len() + self.multipliers + entry
    }

    /// Where a piece reads a node that it does not compute.
    fn source(&self, cutting: &Cutting, plot: Option<&Plot>, id: u32) -> Source {
        let Op::Input(input) = cutting.tracing.graph.get(id).0 else {
            let of_pair = || self.of_pair.get(&plot.map(|plot| (plot.slot, plot.choice))?)?.get(&id);
            let number = self.kept.get(&id).or_else(of_pair);
            return Source::Kept(*number.expect("what a piece does not compute is kept for it"));
        };
        match cutting.tracing.symbol(input) {
            None => Source::Given(input as usize),
            Some(symbol @ (Symbol::Trunk(_) | Symbol::FromLimb(_) | Symbol::BackFromLimb(_))) => {
                Source::Kept(self.crossing[&symbol])
            }
            Some(Symbol::Handed { place, entry }) => Source::Part { place, entry: self.handed[&entry] },
            Some(Symbol::Returned { place, entry }) => {
                Source::Part { place, entry: self.returned_at(self.returned[&entry]) }
            }
            Some(Symbol::Multiplier { level, unknown }) => {
                let limb =
                    plot.and_then(|plot| if let Slot::Limb(g) = plot.slot { Some((g, plot.choice)) } else { None });
                let own = limb.and_then(|limb| cutting.multipliers.get(&limb)).into_iter().flatten();
                let entry = own.into_iter().position(|x| *x == (level, unknown));
                Source::Own(self.multiplier_at(entry.expect("a limb reads its own multipliers")))
            }
        }
    }

    /// Where a piece puts what is wanted of it; `None` where nothing reads it.
    fn goal(&self, wanted: Wanted) -> Option<Goal> {
        Some(match wanted {
            Wanted::Result(result) => Goal::Result(result),
            Wanted::Symbol(Symbol::Handed { entry, .. }) => Goal::Own(*self.handed.get(&entry)?),
            Wanted::Symbol(Symbol::Returned { entry, .. }) => Goal::Own(self.returned_at(*self.returned.get(&entry)?)),
            Wanted::Symbol(symbol) => Goal::Kept(*self.crossing.get(&symbol)?),
            Wanted::EarlyRowsAct(g) => Goal::Kept(self.count + g),
            Wanted::Multiplier { place, entry } => Goal::Part { place, entry: self.multiplier_at(entry) },
        })
    }

    fn piece(&self, cutting: &Cutting, made: &Made, options: &Options) -> Piece {
        let wanted = made.wanted.iter().filter_map(|(value, wanted)| Some((*value, self.goal(*wanted)?)));
        let mut results: Vec<(ProgramResult, Goal)> = wanted.collect();
        let early = made.plot.filter(|plot| !plot.late);
        let of_pair = early.and_then(|plot| self.of_pair.get(&(plot.slot, plot.choice)));
        results.extend(made.own.iter().filter_map(|id| {
            let number = self.kept.get(id).or_else(|| of_pair.and_then(|pair| pair.get(id)))?;
            Some((ProgramResult::Node(*id, false), Goal::Kept(*number)))
        }));
        let source = |id: u32| self.source(cutting, made.plot, id);
        let (program, inputs, outputs) = assemble(cutting.tracing.graph, &made.own, source, &results);
        Piece { program: compact(passes::run(program, rewrite(options))), inputs, outputs }
    }
}

impl Made<'_> {
    /// What the piece needs and does not compute.
    fn read(&self, cutting: &Cutting) -> BTreeSet<u32> {
        let operands = self.own.iter().flat_map(|id| nodes(&cutting.tracing.graph.get(*id).0).collect::<Vec<_>>());
        let results = self.wanted.iter().filter_map(|(value, _)| node(value));
        operands.chain(results).filter(|id| !self.own.contains(id)).collect()
    }
}

impl Cutting<'_, '_> {
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

    /// What each piece computes: those that exist once, and then those of the plots.
    fn made<'p>(plots: &'p [Plot], homes: &BTreeMap<u32, Home>) -> Vec<Made<'p>> {
        let home = |home: Home| homes.iter().filter(move |(_, h)| **h == home).map(|(id, _)| *id);
        let once = |of: Home| Made { own: home(of).collect(), wanted: &[], plot: None };
        let mut all: Vec<Made> = vec![once(Home::Always), once(Home::Touching)];
        for plot in plots {
            let mut own: BTreeSet<u32> = plot.needs.iter().copied().filter(|id| homes[id] == Home::Each).collect();
            if plot.slot == Slot::Always {
                own.extend(home(Home::Outward));
            }
            // What the piece before the trunk has computed is kept.
            let same = |other: &&Made| other.plot.is_some_and(|p| (p.slot, p.choice) == (plot.slot, plot.choice));
            if let Some(before) = all.iter().find(same).filter(|_| plot.late) {
                own.retain(|id| !before.own.contains(id));
            }
            all.push(Made { own, wanted: &plot.wanted, plot: Some(plot) });
        }
        all
    }

    /// The program.
    pub(super) fn program(mut self, output: Output, options: &Options) -> Option<OutputProgram<FactoredProgram>> {
        let plots = self.plots()?;
        let homes = self.homes(&plots);
        let pieces = Self::made(&plots, &homes);
        let layout = Layout::new(&self, &homes, &pieces);
        let mut made = pieces.iter().map(|made| layout.piece(&self, made, options));
        // In the order in which the plots were made.
        let mut next = || made.next().unwrap_or_default();
        let (always, touching, outward) = (next(), next(), next());
        let mut limb = |g: usize, m: usize, modes: &Vec<Mode>| {
            let reaches = !self.tracing.reaching_contacts(g, m).is_empty();
            let (modes, class) = (modes.clone(), self.classes[g][m]);
            let late = self.tracing.limbs[g].late[m];
            LimbMode { modes, reaches, late, class, inward: next(), outward: next() }
        };
        let groups = self.tracing.limbs.iter().enumerate().map(|(g, group)| Group {
            contacts: group.contacts.clone(),
            modes: group.modes.iter().enumerate().map(|(m, modes)| limb(g, m, modes)).collect(),
        });
        let groups = groups.collect();
        let trunks = self.trunks.iter().map(|_| Trunk { solve: next(), finish: next() }).collect();
        let program = FactoredProgram {
            results: self.writers.len(),
            acts: self.tracing.given.first_of("acts"),
            kept: layout.count + self.tracing.limbs.len(),
            early_rows_act: layout.count,
            part: layout.part(),
            always,
            touching,
            groups,
            outward,
            trunks,
            sequences: self.sequences.iter().map(|(_, trunk)| *trunk).collect(),
        };
        Some(OutputProgram { spec: output.spec(), inputs: self.tracing.given.arrays.clone(), program })
    }
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
