//! Factored modes: code for all modes of many contacts out of pieces.
//!
//! A quadruped whose feet may be open, slide or stick has 81 sets of modes, and a function for each would be 81 copies
//! of nearly the same. But the columns of a foot's rows touch its leg only, until they come to the trunk, which all legs
//! share. So contacts fall into *groups*, one for each limb, and the sweeps into pieces: of each limb in each of its
//! modes, on the way inward and on the way outward; and of the trunk, for each sequence of limbs that touch. The trunk
//! does not ask which limbs these are: it reads what they hand to it in the order in which they come. So the trunk of
//! a quadruped on its left feet is that of a quadruped on its right ones.
//!
//! In fast arithmetic, the rows of a limb that its joints can follow are eliminated in the limb ([`Plan::early_contacts`]), and
//! the trunk takes no more of it than in flight. A limb then has one more mode for the same modes of its contacts, with
//! rows that come to the trunk: it runs where the limb finds that it cannot follow its rows, as where it is straight.
//!
//! [`Plan::early_contacts`]: crate::plan::Plan::early_contacts
//!
//! The pieces are cut out of the symbolic runs of the sweeps that functions for single sets of modes are made from
//! (`cuts.rs` says where), so the operations and the bits are theirs.

#[cfg(feature = "factored")]
mod cuts;
#[cfg(feature = "factored")]
mod layout;
#[cfg(feature = "factored")]
mod limbs;
#[cfg(feature = "factored")]
mod pieces;
#[cfg(feature = "factored")]
mod symbols;
#[cfg(feature = "factored")]
mod tracing;

use std::collections::BTreeSet;

use mbd_runtime::contact::Mode;
use mbd_runtime::{Real, Scalar};

use crate::symbolic::{Counts, Program};

#[cfg(feature = "factored")]
pub use pieces::factored;

/// Where a number that a piece reads comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Input of the function, numbered through its arrays.
    Given(usize),
    /// Kept by an earlier piece.
    Kept(usize),
    /// A number of the group's own part, in a piece of a limb.
    Own(usize),
    /// A number of the part of the group that is the `place`-th to touch, in a piece of the trunk.
    Part {
        /// Which of the groups that touch, in their order.
        place: usize,
        /// Which number.
        entry: usize,
    },
}

/// Where a result of a piece goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// Result of the function.
    Result(usize),
    /// Kept for later pieces.
    Kept(usize),
    /// As [`Source::Own`].
    Own(usize),
    /// As [`Source::Part`].
    Part {
        /// Which of the groups that touch, in their order.
        place: usize,
        /// Which number.
        entry: usize,
    },
}

/// A piece of straight-line code.
#[derive(Clone, Debug, Default)]
pub struct Piece {
    /// Its program, whose inputs are numbered through `inputs`.
    pub program: Program,
    /// Where the inputs come from.
    pub inputs: Vec<Source>,
    /// Where the outputs go.
    pub outputs: Vec<Goal>,
}

impl Piece {
    /// Whether it does nothing.
    pub fn is_empty(&self) -> bool {
        self.outputs.is_empty()
    }
}

/// A limb in one of its modes.
#[derive(Clone, Debug)]
pub struct LimbMode {
    /// The mode of each contact of the group.
    pub modes: Vec<Mode>,
    /// Whether rows of its contacts come to the trunk, so that it has a part.
    pub reaches: bool,
    /// Where rows of contacts are eliminated in the limb as far as it can follow them: the number of the mode with the same modes
    /// of the contacts that runs where it cannot.
    pub late: Option<usize>,
    /// Number of the class of modes of this limb that are the same to the trunk.
    pub class: usize,
    /// Before the trunk.
    pub inward: Piece,
    /// After the trunk.
    pub outward: Piece,
}

impl LimbMode {
    /// Whether a contact is closed.
    pub fn touches(&self) -> bool {
        self.modes.iter().any(|mode| *mode != Mode::Open)
    }
}

/// Contacts whose columns pass through the same branches of the trunk.
#[derive(Clone, Debug)]
pub struct Group {
    /// Its contacts, in ascending order.
    pub contacts: Vec<usize>,
    /// Its modes; the first is the one in which all are open. Those that run in place of others come last.
    pub modes: Vec<LimbMode>,
}

/// The trunk for one sequence of limbs that touch.
#[derive(Clone, Debug)]
pub struct Trunk {
    /// Solves for its own motion and for what the limbs need of it.
    pub solve: Piece,
    /// After the limbs: sums over all of them.
    pub finish: Piece,
}

/// The pieces that make up the code of one set of modes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Number of the mode of each group.
    pub limbs: Vec<usize>,
    /// Number of the trunk.
    pub trunk: usize,
}

/// The code of one output for all sets of modes.
#[derive(Clone, Debug)]
pub struct FactoredProgram {
    /// Number of results.
    pub results: usize,
    /// Number of the first input that says which rows act. The pieces are chosen by these inputs.
    pub acts: usize,
    /// Numbers kept between pieces.
    pub kept: usize,
    /// The first of those that say for each limb whether all of its early rows act: 0 where one does not.
    pub early_rows_act: usize,
    /// Numbers of the part of a group that touches.
    pub part: usize,
    /// What is computed in all modes, before everything else.
    pub always: Piece,
    /// What several pieces need where anything touches.
    pub touching: Piece,
    /// Limbs.
    pub groups: Vec<Group>,
    /// What is computed in all modes after the trunk.
    pub outward: Piece,
    /// Trunks.
    pub trunks: Vec<Trunk>,
    /// The trunk of each sequence of classes, the class of the last limb changing first.
    pub sequences: Vec<usize>,
}

impl FactoredProgram {
    /// All pieces.
    pub fn pieces(&self) -> impl Iterator<Item = &Piece> {
        let limbs = self.groups.iter().flat_map(|group| group.modes.iter().flat_map(|m| [&m.inward, &m.outward]));
        let trunks = self.trunks.iter().flat_map(|trunk| [&trunk.solve, &trunk.finish]);
        [&self.always, &self.touching, &self.outward].into_iter().chain(limbs).chain(trunks)
    }

    /// Number of classes of each limb.
    pub fn classes(&self) -> Vec<usize> {
        let most = |group: &Group| group.modes.iter().map(|m| m.class + 1).max().unwrap_or(1);
        self.groups.iter().map(most).collect()
    }

    /// The pieces for the modes of all contacts; `None` where a contact has no such mode.
    pub fn choose(&self, modes: &[Mode]) -> Option<Choice> {
        let limb = |group: &Group| {
            let own: Vec<Mode> = group.contacts.iter().map(|c| modes.get(*c).copied()).collect::<Option<_>>()?;
            group.modes.iter().position(|mode| mode.modes == own)
        };
        let limbs: Vec<usize> = self.groups.iter().map(limb).collect::<Option<_>>()?;
        Some(self.choice(limbs))
    }

    /// The pieces for a mode of each limb.
    pub fn choice(&self, limbs: Vec<usize>) -> Choice {
        let each = self.groups.iter().zip(&limbs).zip(self.classes());
        let sequence = each.fold(0, |sequence, ((group, m), classes)| sequence * classes + group.modes[*m].class);
        Choice { trunk: self.sequences[sequence], limbs }
    }

    /// The pieces of a set of modes in the order in which they run, each with the number of the part that is its own.
    pub fn run<'a>(&'a self, choice: &Choice) -> Vec<(&'a Piece, usize)> {
        let limbs: Vec<&LimbMode> = self.groups.iter().zip(&choice.limbs).map(|(group, m)| &group.modes[*m]).collect();
        let mut place = 0;
        let places: Vec<usize> = limbs
            .iter()
            .map(|limb| {
                place += usize::from(limb.reaches);
                place.saturating_sub(1)
            })
            .collect();
        let trunk = &self.trunks[choice.trunk];
        let mut all = vec![(&self.always, 0)];
        all.extend(limbs.iter().any(|limb| limb.touches()).then_some((&self.touching, 0)));
        all.extend(limbs.iter().zip(&places).map(|(limb, place)| (&limb.inward, *place)));
        all.extend([(&trunk.solve, 0), (&self.outward, 0)]);
        all.extend(limbs.iter().zip(&places).map(|(limb, place)| (&limb.outward, *place)));
        all.push((&trunk.finish, 0));
        all
    }

    /// Counts of the operations that a set of modes executes.
    pub fn counts_of(&self, choice: &Choice) -> Counts {
        let each = self.run(choice).into_iter().map(|(piece, _)| piece.program.counts());
        each.fold(Counts::default(), Counts::plus)
    }

    /// Counts of the operations of all pieces together: the length of the code.
    pub fn counts(&self) -> Counts {
        self.pieces().map(|piece| piece.program.counts()).fold(Counts::default(), Counts::plus)
    }

    /// Number of pieces that do something.
    pub fn count(&self) -> usize {
        self.pieces().filter(|piece| !piece.is_empty()).count()
    }

    /// Operations that are executed where all contacts are open.
    pub fn in_flight(&self) -> usize {
        self.counts_of(&self.choice(vec![0; self.groups.len()])).total()
    }

    /// The same where every contact sticks, or is closed if it has no friction.
    pub fn sticking(&self) -> usize {
        let late = |group: &Group| group.modes.iter().filter(|mode| mode.late.is_some()).count();
        let last = self.groups.iter().map(|group| group.modes.len() - late(group) - 1).collect();
        self.counts_of(&self.choice(last)).total()
    }

    /// Numbers of the inputs that are read, those by which the pieces are chosen among them.
    pub fn used_inputs(&self) -> BTreeSet<usize> {
        let inputs = self.pieces().flat_map(|piece| &piece.inputs);
        let read = inputs.filter_map(|source| if let Source::Given(k) = source { Some(*k) } else { None });
        read.chain([self.acts]).collect()
    }

    /// A choice of pieces with those limbs in their late modes that cannot follow their early rows at given inputs;
    /// `fused(a, b, c)` is `a · b + c`.
    ///
    /// # Panics
    /// If an input is missing.
    #[must_use]
    pub fn with_late<S: Real>(&self, choice: &Choice, inputs: &[S], fused: impl Fn(S, S, S) -> S + Copy) -> Choice {
        let mut limbs = choice.limbs.clone();
        for (g, group) in self.groups.iter().enumerate() {
            let mode = &group.modes[limbs[g]];
            if let Some(late) = mode.late {
                let pieces = [&self.always, &self.touching, &mode.inward];
                let numbers = self.evaluate_pieces(pieces.map(|piece| (piece, 0)), inputs, fused);
                if numbers.kept[self.early_rows_act + g].to_f64() == 0.0 {
                    limbs[g] = late;
                }
            }
        }
        self.choice(limbs)
    }

    /// Results for given inputs in one set of modes; `fused(a, b, c)` is `a · b + c`.
    ///
    /// # Panics
    /// If an input is missing.
    pub fn evaluate<S: Scalar>(&self, choice: &Choice, inputs: &[S], fused: impl Fn(S, S, S) -> S + Copy) -> Vec<S> {
        self.evaluate_pieces(self.run(choice), inputs, fused).results
    }

    /// What pieces compute, each with the number of the part that is its own.
    fn evaluate_pieces<'a, S: Scalar>(
        &self,
        pieces: impl IntoIterator<Item = (&'a Piece, usize)>,
        inputs: &[S],
        fused: impl Fn(S, S, S) -> S + Copy,
    ) -> Numbers<S> {
        let zero = S::zero();
        let (mut results, mut kept) = (vec![zero; self.results], vec![zero; self.kept]);
        let mut parts = vec![vec![zero; self.part]; self.groups.len()];
        for (piece, own) in pieces {
            let given = piece.inputs.iter().map(|source| match *source {
                Source::Given(k) => inputs[k],
                Source::Kept(k) => kept[k],
                Source::Own(entry) => parts[own][entry],
                Source::Part { place, entry } => parts[place][entry],
            });
            let outputs = piece.program.evaluate(&given.collect::<Vec<S>>(), fused);
            for (goal, value) in piece.outputs.iter().zip(outputs) {
                match *goal {
                    Goal::Result(k) => results[k] = value,
                    Goal::Kept(k) => kept[k] = value,
                    Goal::Own(entry) => parts[own][entry] = value,
                    Goal::Part { place, entry } => parts[place][entry] = value,
                }
            }
        }
        Numbers { results, kept }
    }
}

/// Numbers that pieces have computed.
struct Numbers<S> {
    results: Vec<S>,
    kept: Vec<S>,
}
