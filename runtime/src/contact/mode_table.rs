//! Mechanisms with contacts: one evaluator for each set of modes that a motion visits.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::{Deref, DerefMut};

use super::assembly::{Columns, ColumnsOf, Shared, Solved};
use super::beside::one_by_one;
use super::{beside, rows_that_act, Contact, Mode, Reach, Touching, Way};
use crate::interp::{ImplicitSprings, Interpreter};
use crate::system::{
    system_within, Conjugate, Constrained, Differentiable, Energetic, LieJoint, Real, Row, StateDerivatives, System,
};
use crate::Scalar;

/// A mechanism whose rows can be taken out of its equations.
pub trait Reducible: Constrained<Scalar: Real> + Energetic + Conjugate + Sized {
    /// The mechanism in which only some rows act, one entry of `acts` for each row. Its rows have the numbers that they
    /// have here; those that do not act have no residuals, entries and multipliers.
    fn acting(&self, acts: &[bool]) -> Self;

    /// Exchanges its inputs with those of another evaluator of the same mechanism.
    fn swap_inputs(&mut self, other: &mut Self);

    /// What computes its rates.
    fn way(&self) -> Way;

    /// [`Touching::reaches`].
    fn reaches(&self, contacts: &[Contact<Self::Scalar>]) -> Vec<Reach<Self::Scalar>>;

    /// Residuals of all rows, their velocities and the entries of `Φ`: [`Touching::gaps`].
    fn gaps(
        &mut self,
        q: &Self::Coordinates,
        v: &Self::Momenta,
        gaps: &mut Self::Rows,
        velocities: &mut Self::Rows,
        entries: &mut Self::Entries,
    );

    /// The tree of each velocity, of those that stand on the ground beside each other.
    /// Loops and couplings may join them. Empty where this is not known.
    fn trees(&self) -> Vec<usize> {
        Vec::new()
    }

    /// [`Touching::moves_at_rest`].
    fn moves_at_rest(&self) -> bool {
        true
    }

    /// Whether [`Reducible::gaps_of`] takes less than [`Reducible::gaps`] where few rows are asked for.
    fn sees_parts(&self) -> bool {
        false
    }

    /// [`Reducible::gaps`] of the rows that are `wanted`, one entry for each row, at `(q, v)`. Numbers of the others mean
    /// nothing.
    fn gaps_of(
        &mut self,
        _wanted: &[bool],
        (q, v): (&Self::Coordinates, &Self::Momenta),
        gaps: &mut Self::Rows,
        velocities: &mut Self::Rows,
        entries: &mut Self::Entries,
    ) {
        self.gaps(q, v, gaps, velocities, entries);
    }

    /// The mechanism for steps of `step` s that are implicit in springs and dampers of the joints, with inputs that are zero:
    /// [`Touching::project_implicitly`]. `None` where no joint has a spring or a damper, or there is no such evaluator.
    fn with_implicit_springs(&self, _step: Self::Scalar) -> Option<ImplicitSprings<Self, Self::Momenta>> {
        None
    }

    /// [`Constrained::project_momenta`] of several momenta at one state, each with the bits that it has alone. Returns whether
    /// that was done: [`Touching::project_columns`].
    fn project_several(&mut self, _t: Self::Scalar, _q: &Self::Coordinates, _of: &mut ColumnsOf<Self::Scalar>) -> bool {
        false
    }
}

impl<S: Real> Reducible for Interpreter<S> {
    fn acting(&self, acts: &[bool]) -> Self {
        Interpreter::acting(self, acts)
    }

    fn swap_inputs(&mut self, other: &mut Self) {
        Interpreter::swap_inputs(self, other);
    }

    fn way(&self) -> Way {
        Way::Interpreted
    }

    fn reaches(&self, contacts: &[Contact<S>]) -> Vec<Reach<S>> {
        self.tree().reaches(contacts)
    }

    fn trees(&self) -> Vec<usize> {
        self.tree().trees()
    }

    fn with_implicit_springs(&self, step: S) -> Option<ImplicitSprings<Self, Vec<S>>> {
        Interpreter::with_implicit_springs(self, step)
    }

    fn gaps(&mut self, q: &Vec<S>, v: &Vec<S>, gaps: &mut Vec<S>, velocities: &mut Vec<S>, entries: &mut Vec<S>) {
        Interpreter::gaps(self, q, v, gaps, velocities, entries);
    }

    fn moves_at_rest(&self) -> bool {
        Interpreter::moves_at_rest(self)
    }

    fn sees_parts(&self) -> bool {
        true
    }

    fn gaps_of(
        &mut self,
        wanted: &[bool],
        (q, v): (&Vec<S>, &Vec<S>),
        gaps: &mut Vec<S>,
        velocities: &mut Vec<S>,
        entries: &mut Vec<S>,
    ) {
        Interpreter::gaps_of(self, wanted, (q, v), gaps, velocities, entries);
    }
}

/// What the evaluators that are kept take together at most, bytes; and their least and largest number.
const MEMORY: usize = 256 << 20;
const NUMBER: [usize; 2] = [32, 4096];

/// A mechanism with contacts. An evaluator of the rows that act is made when a set of modes is met, and kept, as long as there is
/// room: of many with many rows, the one goes that has not been used for longest.
///
/// It dereferences to the evaluator that is in use, whose inputs are handed over when modes change.
#[derive(Clone, Debug)]
pub struct ModeTable<Y: Constrained> {
    /// All rows act: for gaps.
    full: Y,
    kept: Vec<Kept<Y>>,
    current: usize,
    /// Largest number of evaluators that are kept, and how often one was put to use.
    most: usize,
    uses: u64,
    contacts: Vec<Contact<Y::Scalar>>,
    reaches: Vec<Reach<Y::Scalar>>,
    /// The rows of [`Touching::gaps_of`].
    wanted: Vec<bool>,
    /// The tree of each velocity, those of each contact, and which rows of contacts are solved for together.
    trees: Vec<usize>,
    trees_of: Vec<[usize; 2]>,
    solved: Vec<Solved>,
    /// Memory for these.
    spare: ([Y::Momenta; 2], Y::Rows),
    implicit: Option<Implicit<Y>>,
}

/// The evaluator of a set of modes.
#[derive(Clone, Debug)]
struct Kept<Y> {
    modes: Vec<Mode>,
    evaluator: Y,
    /// Number of its last use.
    used: u64,
}

/// A mechanism for time steps that are implicit in springs and dampers, with all contacts open.
#[derive(Clone, Debug)]
struct Implicit<Y: Constrained> {
    /// Length of a step, s.
    step: Y::Scalar,
    /// Nothing, where the mechanism has no springs and dampers.
    springs: Option<ImplicitSprings<Y, Y::Momenta>>,
    /// Momenta and velocities that prescribed motions give.
    rest: [Y::Momenta; 2],
    sigma: Y::Rows,
}

/// A mechanism with contacts in the interpreter.
pub type ContactInterpreter<S> = ModeTable<Interpreter<S>>;

impl<Y: Reducible> ModeTable<Y> {
    /// From an evaluator whose constraints include the contacts' rows. All contacts are open at first.
    pub fn new(full: Y, contacts: Vec<Contact<Y::Scalar>>) -> Self {
        let open = vec![Mode::Open; contacts.len()];
        let first = full.acting(&rows_that_act(full.rows().len(), &contacts, &open));
        let (reaches, wanted) = (full.reaches(&contacts), vec![true; full.rows().len()]);
        let (trees, trees_of) = beside::trees(&full, &contacts);
        // The columns and screws of all rows at all bodies with the products of each two rows, and those of the mass matrix.
        let (rows, nv) = (full.rows().len(), full.zero_momenta().as_ref().len());
        let each = core::mem::size_of::<Y::Scalar>() * (rows * (rows + 13 * nv) + 6 * nv * nv);
        ModeTable {
            kept: vec![Kept { modes: open, evaluator: first, used: 0 }],
            current: 0,
            most: MEMORY.checked_div(each).unwrap_or(NUMBER[1]).clamp(NUMBER[0], NUMBER[1]),
            uses: 0,
            reaches,
            wanted,
            trees,
            trees_of,
            solved: Vec::new(),
            spare: ([full.zero_momenta(), full.zero_momenta()], full.zero_rows()),
            contacts,
            full,
            implicit: None,
        }
    }

    /// The sets of modes whose evaluators are kept, in no order.
    pub fn sets_of_modes(&self) -> impl ExactSizeIterator<Item = &[Mode]> {
        self.kept.iter().map(|kept| kept.modes.as_slice())
    }

    /// The evaluators that are kept.
    pub fn evaluators_mut(&mut self) -> impl Iterator<Item = &mut Y> {
        self.kept.iter_mut().map(|kept| &mut kept.evaluator)
    }

    /// The place of the evaluator for these modes, which is made if it is not kept.
    fn place_of(&mut self, modes: &[Mode]) -> usize {
        if let Some(place) = self.kept.iter().position(|kept| kept.modes == modes) {
            return place;
        }
        let evaluator = self.full.acting(&rows_that_act(self.full.rows().len(), &self.contacts, modes));
        let made = Kept { modes: modes.to_vec(), evaluator, used: 0 };
        if self.kept.len() < self.most {
            self.kept.push(made);
            return self.kept.len() - 1;
        }
        // That in use was used last.
        let oldest = self.kept.iter().enumerate().min_by_key(|(_, kept)| kept.used).map_or(0, |(place, _)| place);
        self.kept[oldest] = made;
        oldest
    }

    /// Sets the contacts' coefficient of friction, where they have tangential rows.
    pub fn set_friction(&mut self, friction: Y::Scalar) {
        self.contacts.iter_mut().filter(|c| c.tangents).for_each(|c| c.friction = friction);
    }

    /// Sets the contacts' coefficient of restitution.
    pub fn set_restitution(&mut self, restitution: Y::Scalar) {
        self.contacts.iter_mut().for_each(|c| c.restitution = restitution);
    }
}

impl<Y: Constrained> Deref for ModeTable<Y> {
    type Target = Y;
    fn deref(&self) -> &Y {
        &self.kept[self.current].evaluator
    }
}

impl<Y: Constrained> DerefMut for ModeTable<Y> {
    fn deref_mut(&mut self) -> &mut Y {
        &mut self.kept[self.current].evaluator
    }
}

impl<Y: Reducible> System for ModeTable<Y> {
    system_within!(full: Y);

    fn lie_joints(&self) -> &[LieJoint] {
        self.full.lie_joints()
    }

    fn rates_at(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
        qd: &mut Y::Coordinates,
        pd: &mut Y::Momenta,
    ) {
        (**self).rates_at(t, q, p, qd, pd);
    }
}

impl<Y: Reducible + Differentiable> Differentiable for ModeTable<Y> {
    type Square = Y::Square;

    fn square(&self) -> Y::Square {
        self.full.square()
    }

    fn depends_on_time(&self) -> bool {
        (**self).depends_on_time()
    }

    fn rate_derivatives(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
        out: &mut StateDerivatives<Y::Momenta, Y::Square>,
    ) {
        (**self).rate_derivatives(t, q, p, out);
    }
}

impl<Y: Reducible> Energetic for ModeTable<Y> {
    fn energies(&mut self, q: &Y::Coordinates, p: &Y::Momenta) -> (Y::Scalar, Y::Scalar) {
        (**self).energies(q, p)
    }
}

impl<Y: Reducible> Conjugate for ModeTable<Y> {
    fn conjugate_momenta(&mut self, q: &Y::Coordinates, v: &Y::Momenta, p: &mut Y::Momenta) {
        (**self).conjugate_momenta(q, v, p);
    }
}

impl<Y: Reducible> Constrained for ModeTable<Y> {
    type Rows = Y::Rows;
    type Entries = Y::Entries;

    fn zero_rows(&self) -> Y::Rows {
        self.full.zero_rows()
    }

    fn zero_entries(&self) -> Y::Entries {
        self.full.zero_entries()
    }

    fn rows(&self) -> &[Row] {
        self.full.rows()
    }

    fn entry_columns(&self) -> &[usize] {
        self.full.entry_columns()
    }

    fn constraint_residuals(&mut self, q: &Y::Coordinates, residual: &mut Y::Rows, jacobian: &mut Y::Entries) {
        (**self).constraint_residuals(q, residual, jacobian);
    }

    fn project_momenta(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &mut Y::Momenta,
        v: &mut Y::Momenta,
        sigma: &mut Y::Rows,
    ) {
        (**self).project_momenta(t, q, p, v, sigma);
    }

    fn position_correction(
        &mut self,
        q: &Y::Coordinates,
        residual: &mut Y::Rows,
        dq: &mut Y::Momenta,
        pivots: &mut Y::Rows,
    ) {
        (**self).position_correction(q, residual, dq, pivots);
    }

    fn multipliers(&mut self, t: Y::Scalar, q: &Y::Coordinates, v: &Y::Momenta, lambda: &mut Y::Rows) {
        (**self).multipliers(t, q, v, lambda);
    }
}

impl<Y: Reducible> Touching for ModeTable<Y> {
    type PerContact<T: Copy + core::fmt::Debug> = Vec<T>;
    type Delassus = Vec<Y::Scalar>;

    fn contacts(&self) -> &[Contact<Y::Scalar>] {
        &self.contacts
    }

    fn per_contact<T: Copy + core::fmt::Debug>(&self, value: T) -> Vec<T> {
        vec![value; self.contacts.len()]
    }

    fn zero_delassus(&self, len: usize) -> Vec<Y::Scalar> {
        vec![Scalar::zero(); len]
    }

    fn way(&self) -> Way {
        Reducible::way(&**self)
    }

    fn reaches(&self) -> &[Reach<Y::Scalar>] {
        &self.reaches
    }

    fn act(&mut self, modes: &[Mode]) {
        let before = self.current;
        if self.kept[before].modes == modes {
            return;
        }
        let next = self.place_of(modes);
        self.uses += 1;
        self.kept[next].used = self.uses;
        self.current = next;
        let (low, high) = (before.min(next), before.max(next));
        let (first, rest) = self.kept.split_at_mut(high);
        first[low].evaluator.swap_inputs(&mut rest[0].evaluator);
    }

    fn gaps(
        &mut self,
        _t: Y::Scalar,
        q: &Y::Coordinates,
        v: &Y::Momenta,
        gaps: &mut Y::Rows,
        velocities: &mut Y::Rows,
        entries: &mut Y::Entries,
    ) {
        let current = &mut self.kept[self.current].evaluator;
        self.full.swap_inputs(current);
        self.full.gaps(q, v, gaps, velocities, entries);
        self.full.swap_inputs(current);
    }

    fn moves_at_rest(&self) -> bool {
        Reducible::moves_at_rest(&**self)
    }

    fn sees_parts(&self) -> bool {
        self.full.sees_parts()
    }

    fn gaps_of(
        &mut self,
        [of, whole]: [&[bool]; 2],
        t: Y::Scalar,
        (q, v): (&Y::Coordinates, &Y::Momenta),
        gaps: &mut Y::Rows,
        velocities: &mut Y::Rows,
        entries: &mut Y::Entries,
    ) {
        if !of.contains(&false) && !whole.contains(&false) {
            return self.gaps(t, q, v, gaps, velocities, entries);
        }
        let ModeTable { full, kept, current, contacts, wanted, .. } = self;
        for (contact, (of, whole)) in contacts.iter().zip(of.iter().zip(whole)) {
            wanted[contact.row..][..contact.rows()].fill(*of && *whole);
            wanted[contact.row] = *of;
        }
        let current = &mut kept[*current].evaluator;
        full.swap_inputs(current);
        full.gaps_of(wanted, (q, v), gaps, velocities, entries);
        full.swap_inputs(current);
    }

    fn project_columns(&mut self, t: Y::Scalar, q: &Y::Coordinates, columns: &mut Columns<Y::Scalar>) -> bool {
        let ModeTable { full, kept, current, contacts, trees, trees_of, solved, spare, .. } = self;
        let (rows, entries) = (full.rows(), full.entry_columns());
        columns.merge(contacts, trees_of, solved);
        let shared = Shared { lines: solved, trees };
        let mut of = columns.of(contacts, rows, entries, shared);
        let current = &mut kept[*current].evaluator;
        if current.project_several(t, q, &mut of) {
            return true;
        }
        if !shared.any() {
            return false;
        }
        let ([p, v], sigma) = spare;
        one_by_one(&mut of, [p, v], |p, v| current.project_momenta(t, q, p, v, sigma));
        true
    }

    fn steps_implicitly(&mut self, step: Y::Scalar) -> bool {
        let ModeTable { full, contacts, implicit, .. } = self;
        if implicit.as_ref().is_none_or(|implicit| implicit.step != step) {
            // What closes loops goes on to act.
            let open = full.acting(&rows_that_act(full.rows().len(), contacts, &vec![Mode::Open; contacts.len()]));
            let springs = open.with_implicit_springs(step);
            let rest = [full.zero_momenta(), full.zero_momenta()];
            *implicit = Some(Implicit { step, springs, rest, sigma: full.zero_rows() });
        }
        implicit.as_ref().is_some_and(|implicit| implicit.springs.is_some())
    }

    fn project_implicitly(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &mut Y::Momenta, v: &mut Y::Momenta) {
        let Some(Implicit { springs: Some(springs), rest: [rest_p, rest_v], sigma, .. }) = &mut self.implicit else {
            return;
        };
        let ImplicitSprings { evaluator, added, driven, .. } = springs;
        let current = &mut self.kept[self.current].evaluator;
        evaluator.swap_inputs(current);
        evaluator.project_momenta(t, q, p, v, sigma);
        if *driven {
            rest_p.as_mut().fill(Scalar::zero());
            evaluator.project_momenta(t, q, rest_p, rest_v, sigma);
            for (both, rest) in [(&mut *p, rest_p), (&mut *v, rest_v)] {
                both.as_mut().iter_mut().zip(rest.as_ref()).for_each(|(both, rest)| *both = *both - *rest);
            }
        }
        evaluator.swap_inputs(current);
        for (p, (v, added)) in p.as_mut().iter_mut().zip(v.as_ref().iter().zip(added.as_ref())) {
            *p = *p - *added * *v;
        }
    }

    fn pull(&self, time: Y::Scalar, v: &Y::Momenta, forces: &mut Y::Momenta) {
        let Some(Implicit { springs: Some(springs), .. }) = &self.implicit else { return };
        for (force, (v, stiffness)) in forces.as_mut().iter_mut().zip(v.as_ref().iter().zip(springs.stiffness.as_ref()))
        {
            *force = *force - *stiffness * (time * *v);
        }
    }

    fn project_columns_implicitly(&mut self, t: Y::Scalar, q: &Y::Coordinates, columns: &mut Columns<Y::Scalar>) {
        let ModeTable { full, kept, current, contacts, implicit, trees, trees_of, solved, .. } = self;
        let Some(Implicit { springs: Some(springs), rest: [p, v], sigma, .. }) = implicit else { return };
        let ImplicitSprings { evaluator, .. } = springs;
        let current = &mut kept[*current].evaluator;
        evaluator.swap_inputs(current);
        columns.merge(contacts, trees_of, solved);
        let mut of = columns.of(contacts, full.rows(), full.entry_columns(), Shared { lines: solved, trees });
        if !evaluator.project_several(t, q, &mut of) {
            one_by_one(&mut of, [p, v], |p, v| evaluator.project_momenta(t, q, p, v, sigma));
        }
        evaluator.swap_inputs(current);
    }
}
