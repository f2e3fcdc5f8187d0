//! Velocities for forces of contacts: their inverse inertia `A = Φ M⁻¹Φᵀ` at a state, and its like.

use super::touching::{add_row, along_row};
use super::{Mode, Touch, Touching, WithContacts};
use crate::lists::{copy, get, set};
use crate::system::Real;
use crate::Scalar;

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

/// The lines of some forces.
pub(super) fn lines<'a, Y: Touching>(
    system: &'a Y,
    of: Forces<'a, Y::Scalar>,
) -> impl Iterator<Item = Line<Y::Scalar>> + 'a {
    let contacts = of.contacts.iter().enumerate().filter_map(|(i, &k)| Some((i, system.contacts().get(k)?)));
    contacts.flat_map(move |(i, c)| {
        let slip = of.touches.and_then(|touches| touches.get(i)?.slip).filter(|_| c.tangents);
        let friction = slip.map(|t| t.map(|t| -(c.friction * t)));
        let rows = if friction.is_some() { 1 } else { c.rows() };
        (c.row..c.row + rows).map(move |row| Line { row, friction })
    })
}

impl<Y: Touching> WithContacts<Y> {
    /// Opens all contacts until [`WithContacts::restore`], and computes the velocities of prescribed motions, to which
    /// forces add theirs. `open` has [`Mode::Open`] for each contact.
    pub(super) fn rest(&mut self, t: Y::Scalar, q: &Y::Coordinates, open: &[Mode]) {
        self.borrow_modes(open);
        self.response.as_mut().fill(Y::Scalar::zero());
        self.answer(t, q);
        copy(self.unit.as_mut(), self.response_v.as_ref());
    }

    /// Velocities of the rows of [`lines`], in columns of the square `a`, for a unit force of each line: the inverse
    /// inertia of the contacts, if these are all their rows. One solve for each line. The velocities along the lines
    /// themselves, friction included, go to `own`, which may be empty. After [`WithContacts::look`] and
    /// [`WithContacts::rest`].
    pub(super) fn responses(
        &mut self,
        (t, q): (Y::Scalar, &Y::Coordinates),
        of: Forces<Y::Scalar>,
        a: &mut [Y::Scalar],
        own: &mut [Y::Scalar],
    ) {
        let (zero, one) = (Y::Scalar::zero(), Y::Scalar::one());
        let count = lines(&self.system, of).count();
        for i in 0..count {
            let Some(line) = lines(&self.system, of).nth(i) else { return };
            self.response.as_mut().fill(zero);
            for (row, force) in line.forces(one) {
                add_row(&self.system, &self.at.entries, row, force, &mut self.response);
            }
            self.answer_from_rest(t, q);
            for (other, a) in lines(&self.system, of).zip(a.iter_mut().skip(i).step_by(count)) {
                *a = self.velocity_of(other.row);
            }
            if let Some(own) = own.get_mut(i) {
                *own = line.forces(one).fold(zero, |sum, (row, force)| sum + force * self.velocity_of(row));
            }
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
        for line in lines(&self.system, of) {
            let lambda = get(self.at.lambda.as_ref(), line.row);
            add_row(&self.system, &self.at.entries, line.row, lambda, &mut self.response);
        }
        self.answer_from_rest(t, q);
        for (line, b) in lines(&self.system, of).zip(b) {
            *b = self.velocity_of(line.row);
        }
    }

    /// Velocities of the momenta `self.response` beyond those of [`WithContacts::rest`].
    fn answer_from_rest(&mut self, t: Y::Scalar, q: &Y::Coordinates) {
        self.answer(t, q);
        for (v, rest) in self.response_v.as_mut().iter_mut().zip(self.unit.as_ref()) {
            *v = *v - *rest;
        }
    }

    /// Velocity of a row at the velocities `self.response_v`.
    fn velocity_of(&self, row: usize) -> Y::Scalar {
        along_row(&self.system, &self.at.entries, row, &self.response_v)
    }

    /// Adds the impulses of some contacts, one number for each of their rows, to the momenta of the state, which are freed
    /// of multipliers.
    pub(super) fn kick(&mut self, contacts: &[usize], impulses: &[Y::Scalar]) {
        let mut i = 0;
        for &k in contacts {
            let c = self.contact(k);
            for row in c.row..c.row + c.rows() {
                let (system, entries) = (&self.system, &self.at.entries);
                add_row(system, entries, row, get(impulses, i), &mut self.p);
                i += 1;
            }
        }
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
