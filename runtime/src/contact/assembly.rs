//! Velocities for forces of contacts: their inverse inertia `A = Φ M⁻¹Φᵀ` at a state, and its like.

use super::touching::{add_row, along_row};
use super::{Contact, Mode, Touch, Touching, WithContacts};
use crate::constrained::rows::row;
use crate::lists::{copy, get, part, set, split};
use crate::system::{Real, Row};
use crate::Scalar;
#[cfg(feature = "alloc")]
use alloc::vec::Vec;

/// A force at a contact: of a row, or of the normal row of a contact that slides, together with its friction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<S> {
    /// Row of the mechanism.
    pub row: usize,
    /// Forces of the two rows that follow, for a unit force of the row.
    pub friction: Option<[S; 2]>,
}

impl<S: Real> Line<S> {
    /// Rows and their forces, for a force of the line.
    pub fn forces(self, force: S) -> impl Iterator<Item = (usize, S)> {
        let tangents = self.friction.into_iter().flatten().map(move |along| along * force);
        (self.row..).zip(core::iter::once(force).chain(tangents))
    }
}

/// Forces of some contacts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forces<'a, S> {
    /// The contacts.
    pub contacts: &'a [usize],
    /// The contacts as those of a problem: of those that slide only the normal force, together with its friction. Otherwise
    /// the forces of all rows.
    pub touches: Option<&'a [Touch<S>]>,
}

/// The lines of some forces, of a mechanism with the contacts `all`.
pub(super) fn lines<'a, S: Real>(all: &'a [Contact<S>], of: Forces<'a, S>) -> impl Iterator<Item = Line<S>> + 'a {
    let contacts = of.contacts.iter().enumerate().filter_map(|(i, &k)| Some((i, all.get(k)?)));
    contacts.flat_map(move |(i, c)| {
        let slip = of.touches.and_then(|touches| touches.get(i)?.slip).filter(|_| c.tangents);
        let friction = slip.map(|t| t.map(|t| -(c.friction * t)));
        let rows = if friction.is_some() { 1 } else { c.rows() };
        (c.row..c.row + rows).map(move |row| Line { row, friction })
    })
}

/// Momenta `p` at one state whose velocities are wanted, `M v = p`: columns are `Φᵀ` times a unit force at each line of the
/// contacts, after one of `p = 0` where bodies move without momenta ([`Touching::moves_at_rest`]). The velocities become
/// the inverse inertia of the contacts. [`Touching::project_columns`] takes them.
#[derive(Debug)]
pub struct Columns<'a, S> {
    of: Forces<'a, S>,
    /// Entries of `Φ`, of all rows.
    entries: &'a [S],
    a: &'a mut [S],
    own: &'a mut [S],
    /// Velocities without momenta.
    rest: &'a mut [S],
    /// Number of columns before those of the lines: one whose velocities are those without momenta, or none.
    ahead: usize,
}

/// [`Columns`] of a mechanism.
#[derive(Debug)]
pub struct ColumnsOf<'a, 'b, S> {
    columns: &'a mut Columns<'b, S>,
    contacts: &'a [Contact<S>],
    rows: &'a [Row],
    /// Columns of the entries.
    places: &'a [usize],
    shared: Shared<'a>,
    /// Number of lines.
    lines: usize,
}

/// Which lines are solved for together: forces on trees that stand on the ground beside each other do not feel one another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shared<'a> {
    /// Of each line its column and the trees on which its force acts; empty where each has its own column.
    pub lines: &'a [Solved],
    /// The tree of each velocity.
    pub trees: &'a [usize],
}

impl Shared<'_> {
    /// Whether there are such lines.
    pub fn any(self) -> bool {
        cfg!(feature = "hulls") && !self.lines.is_empty()
    }
}

/// The column of a line among those of unit forces, and the trees on which its force acts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solved {
    pub column: usize,
    pub trees: [usize; 2],
}

/// Only tables of modes, which need `alloc`, call this.
#[cfg(feature = "alloc")]
impl<'b, S: Real> Columns<'b, S> {
    /// Of a mechanism with such contacts and rows.
    pub(super) fn of<'a>(
        &'a mut self,
        contacts: &'a [Contact<S>],
        rows: &'a [Row],
        places: &'a [usize],
        shared: Shared<'a>,
    ) -> ColumnsOf<'a, 'b, S> {
        let lines = lines(contacts, self.of).count();
        ColumnsOf { columns: self, contacts, rows, places, shared, lines }
    }

    /// Gives each line the first column that no line before it has whose force acts on the same trees; contacts act on those in
    /// `trees`. `solved` stays empty where each line has its own column.
    pub(super) fn merge(&self, contacts: &[Contact<S>], trees: &[[usize; 2]], solved: &mut Vec<Solved>) {
        solved.clear();
        if !cfg!(feature = "hulls") {
            // Where bodies are few, it is not worth its code.
            return;
        }
        let (mut columns, mut count) = (0, 0);
        for (i, &k) in self.of.contacts.iter().enumerate() {
            let one = Forces { contacts: &[k], touches: self.of.touches.and_then(|touches| touches.get(i..)) };
            let Some(own) = trees.get(k) else { return solved.clear() };
            let meets = |other: &&Solved| own.iter().any(|tree| other.trees.contains(tree));
            let first = solved.iter().filter(meets).map(|other| other.column + 1).max().unwrap_or(0);
            let lines = lines(contacts, one).count();
            solved.extend((first..first + lines).map(|column| Solved { column, trees: *own }));
            (columns, count) = (columns.max(first + lines), count + lines);
        }
        if columns == count {
            solved.clear();
        }
    }
}

impl<S: Real> ColumnsOf<'_, '_, S> {
    /// Their number.
    pub fn count(&self) -> usize {
        self.columns.ahead + self.shared.lines.iter().map(|line| line.column + 1).max().unwrap_or(self.lines)
    }

    /// Writes the momenta of `L` columns from column `i` on, side by side: `L` numbers for each velocity, zeros after the last.
    pub fn momenta<const L: usize>(&self, i: usize, p: &mut [S]) {
        p.fill(S::zero());
        let places = Places { rows: self.rows, columns: self.places, entries: self.columns.entries };
        let ahead = self.columns.ahead;
        if self.shared.any() {
            for (line, solved) in lines(self.contacts, self.columns.of).zip(self.shared.lines) {
                if let Some(lane) = (solved.column + ahead).checked_sub(i).filter(|lane| *lane < L) {
                    places.unit_force::<L>(line, lane, p);
                }
            }
            return;
        }
        // What is ahead of the lines stays zero.
        for (line, lane) in lines(self.contacts, self.columns.of).skip(i.max(ahead) - ahead).zip(ahead.max(i) - i..L) {
            places.unit_force::<L>(line, lane, p);
        }
    }

    /// Takes the velocities of `L` columns from column `i` on, which come side by side, after those of the columns before;
    /// they are changed.
    pub fn take<const L: usize>(&mut self, i: usize, v: &mut [S]) {
        let ColumnsOf { rows, places, contacts, shared, columns, lines: count } = self;
        let Columns { of, entries, a, own, rest, ahead } = columns;
        let ahead = *ahead;
        let places = Places { rows, columns: places, entries };
        if i < ahead {
            for (rest, v) in rest.iter_mut().zip(v.chunks_exact(L)) {
                *rest = get(v, 0);
            }
        }
        if shared.any() {
            return places.take_shared::<L>((i, ahead), *shared, lines(contacts, *of), (rest, v), (a, own));
        }
        places.take_answers::<L>((i, ahead, *count), lines(contacts, *of), (rest, v), (a, own));
    }
}

/// The entries of `Φ`.
#[derive(Clone, Copy)]
struct Places<'a, S> {
    rows: &'a [Row],
    columns: &'a [usize],
    entries: &'a [S],
}

impl<'a, S: Real> Places<'a, S> {
    /// Adds the momenta of a unit force of a line to those of one of `L` columns.
    #[inline(always)]
    fn unit_force<const L: usize>(self, line: Line<S>, lane: usize, p: &mut [S]) {
        for (r, force) in line.forces(S::one()) {
            for (column, entry) in self.row(r) {
                if let Some(p) = p.get_mut(*column * L + lane) {
                    *p = *p + *entry * force;
                }
            }
        }
    }

    /// Takes the velocities that `L` columns from column `i` on answer with, beyond those at rest, into `a` and `own`: those of
    /// `count` lines follow on those `ahead`.
    #[inline(always)]
    fn take_answers<const L: usize>(
        self,
        (i, ahead, count): (usize, usize, usize),
        all: impl Iterator<Item = Line<S>>,
        (rest, v): (&[S], &mut [S]),
        (a, own): (&mut [S], &mut [S]),
    ) {
        if i + L <= ahead {
            return;
        }
        if ahead > 0 {
            for (v, rest) in v.chunks_exact_mut(L).zip(rest) {
                v.iter_mut().for_each(|v| *v = *v - *rest);
            }
        }
        let along = |r: usize| {
            let mut sums = [S::zero(); L];
            for (column, entry) in self.row(r) {
                for (sum, v) in sums.iter_mut().zip(part(v, *column * L, L)) {
                    *sum = *sum + *entry * *v;
                }
            }
            sums
        };
        let from = ahead.max(i) - i;
        for (k, (line, a)) in all.zip(a.chunks_exact_mut(count.max(1))).enumerate() {
            let answers = along(line.row);
            let (_, to) = split(a, i + from - ahead);
            match to.first_chunk_mut::<L>() {
                // A length that the compiler knows is copied without a call.
                Some(to) if from == 0 => *to = answers,
                _ => copy(to, answers.get(from..).unwrap_or_default()),
            }
            let lane = (k + ahead).wrapping_sub(i);
            if let (true, Some(own)) = (lane < L, own.get_mut(k)) {
                *own = line.forces(S::one()).fold(S::zero(), |sum, (r, force)| sum + force * get(&along(r), lane));
            }
        }
    }

    /// [`Places::take_answers`] where lines share columns. A row feels of a line what goes through the trees on which it acts.
    fn take_shared<const L: usize>(
        self,
        (i, ahead): (usize, usize),
        shared: Shared,
        all: impl Iterator<Item = Line<S>>,
        (rest, v): (&[S], &[S]),
        (a, own): (&mut [S], &mut [S]),
    ) {
        let along = |r: usize, solved: &Solved, lane: usize| {
            let felt =
                self.row(r).filter(|(column, _)| shared.trees.get(**column).is_some_and(|t| solved.trees.contains(t)));
            felt.fold(S::zero(), |sum, (column, entry)| {
                sum + *entry * (get(v, *column * L + lane) - get(rest, *column))
            })
        };
        let lane = |solved: &Solved| (solved.column + ahead).checked_sub(i).filter(|lane| *lane < L);
        let count = shared.lines.len();
        for (k, ((line, to), a)) in all.zip(shared.lines).zip(a.chunks_exact_mut(count.max(1))).enumerate() {
            for (a, solved) in a.iter_mut().zip(shared.lines) {
                if let Some(lane) = lane(solved) {
                    let meets = to.trees.iter().any(|tree| solved.trees.contains(tree));
                    *a = if meets { along(line.row, solved, lane) } else { S::zero() };
                }
            }
            if let (Some(lane), Some(own)) = (lane(to), own.get_mut(k)) {
                *own = line.forces(S::one()).fold(S::zero(), |sum, (r, force)| sum + force * along(r, to, lane));
            }
        }
    }

    /// Columns and entries of a row.
    fn row(self, r: usize) -> impl Iterator<Item = (&'a usize, &'a S)> {
        let none = Row { constraint: 0, holonomic: false, first: 0, len: 0 };
        row(self.rows.get(r).unwrap_or(&none), self.columns, self.entries)
    }
}

impl<Y: Touching> WithContacts<Y> {
    /// Opens all contacts until [`WithContacts::restore`]; computes the velocities of the rows of [`lines`], in columns of
    /// the square `a`, for a unit force of each line: the inverse inertia of the contacts, if these are all their rows.
    /// One solve for each line, and one for the velocities without momenta, to which forces add theirs; several at
    /// once where the mechanism can. The velocities along the lines themselves, friction included, go to `own`, which may
    /// be empty. `open` has [`Mode::Open`] for each contact. With `implicit`, springs and dampers of the joints follow:
    /// [`Touching::project_columns_implicitly`]. After [`WithContacts::look`].
    pub(super) fn responses(
        &mut self,
        (t, q): (Y::Scalar, &Y::Coordinates),
        of: Forces<Y::Scalar>,
        (open, implicit): (&[Mode], bool),
        a: &mut [Y::Scalar],
        own: &mut [Y::Scalar],
    ) {
        self.borrow_modes(open);
        let WithContacts { system, at, unit: rest, response, response_v, sigma, .. } = self;
        let moves = system.moves_at_rest();
        if !moves {
            rest.as_mut().fill(Y::Scalar::zero());
        }
        let ahead = usize::from(moves);
        let mut columns = Columns { of, entries: at.entries.as_ref(), a, own, rest: rest.as_mut(), ahead };
        if implicit {
            return system.project_columns_implicitly(t, q, &mut columns);
        }
        if system.project_columns(t, q, &mut columns) {
            return;
        }
        // One after the other, without what the mechanism would have to be asked for: firmware knows its rows.
        let Columns { a, own, rest, .. } = columns;
        if moves {
            response.as_mut().fill(Y::Scalar::zero());
            system.project_momenta(t, q, response, response_v, sigma);
            copy(rest, response_v.as_ref());
        }
        let count = lines(system.contacts(), of).count();
        for i in 0..count {
            let Some(line) = lines(system.contacts(), of).nth(i) else { return };
            response.as_mut().fill(Y::Scalar::zero());
            let places = Places { rows: system.rows(), columns: system.entry_columns(), entries: at.entries.as_ref() };
            places.unit_force::<1>(line, 0, response.as_mut());
            system.project_momenta(t, q, response, response_v, sigma);
            let places = Places { rows: system.rows(), columns: system.entry_columns(), entries: at.entries.as_ref() };
            places.take_answers::<1>(
                (i, 0, count),
                lines(system.contacts(), of),
                (rest, response_v.as_mut()),
                (a, own),
            );
        }
    }

    /// Velocities of the rows of [`lines`], in `b`, for the multipliers `self.at.lambda` of these rows as forces, otherwise
    /// as [`WithContacts::responses`].
    pub(super) fn response_to_multipliers(
        &mut self,
        (t, q): (Y::Scalar, &Y::Coordinates),
        of: Forces<Y::Scalar>,
        b: &mut [Y::Scalar],
    ) {
        self.response.as_mut().fill(Y::Scalar::zero());
        for line in lines(self.system.contacts(), of) {
            let lambda = get(self.at.lambda.as_ref(), line.row);
            add_row(&self.system, &self.at.entries, line.row, lambda, &mut self.response);
        }
        self.answer_from_rest(t, q);
        for (line, b) in lines(self.system.contacts(), of).zip(b) {
            *b = along_row(&self.system, &self.at.entries, line.row, &self.response_v);
        }
    }

    /// Velocities of the momenta `self.response` beyond those without momenta, after [`WithContacts::responses`].
    fn answer_from_rest(&mut self, t: Y::Scalar, q: &Y::Coordinates) {
        self.answer(t, q);
        for (v, rest) in self.response_v.as_mut().iter_mut().zip(self.unit.as_ref()) {
            *v = *v - *rest;
        }
    }

    /// Adds the impulses of some contacts, one number for each of their rows, to the momenta of the state, which are freed
    /// of multipliers.
    pub(super) fn kick(&mut self, contacts: &[usize], impulses: &[Y::Scalar]) {
        let WithContacts { system, at, p, .. } = self;
        add_impulses(system, &at.entries, contacts, impulses, p);
    }

    /// What the impulses of some contacts change velocities by, in `self.response_v`, after [`WithContacts::responses`] at
    /// the state; with `implicit`, where springs and dampers of the joints follow ([`Touching::project_implicitly`]), with
    /// the change of the momenta in `self.response`.
    pub(super) fn respond_to_impulses(
        &mut self,
        (t, q): (Y::Scalar, &Y::Coordinates),
        contacts: &[usize],
        impulses: &[Y::Scalar],
        implicit: bool,
    ) {
        let WithContacts { system, at, response, response_v, .. } = self;
        response.as_mut().fill(Y::Scalar::zero());
        add_impulses(system, &at.entries, contacts, impulses, response);
        if implicit {
            system.project_implicitly(t, q, response, response_v);
        } else {
            self.answer_from_rest(t, q);
        }
    }
}

/// Adds the impulses of some contacts, one number for each of their rows, to momenta.
fn add_impulses<Y: Touching>(
    system: &Y,
    entries: &Y::Entries,
    contacts: &[usize],
    impulses: &[Y::Scalar],
    p: &mut Y::Momenta,
) {
    let rows = contacts.iter().filter_map(|k| system.contacts().get(*k)).flat_map(|c| c.row..c.row + c.rows());
    for (row, impulse) in rows.zip(impulses) {
        add_row(system, entries, row, *impulse, p);
    }
}

/// The mean of a matrix and its transpose: they differ by rounding.
pub(super) fn symmetrize<S: Real>(a: &mut [S], n: usize) {
    for i in 0..n {
        for j in 0..i {
            let mean = S::constant(0.5) * (get(a, i * n + j) + get(a, j * n + i));
            set(a, i * n + j, mean);
            set(a, j * n + i, mean);
        }
    }
}
