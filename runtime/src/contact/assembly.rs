//! The inverse inertia of contacts, `A = Φ M⁻¹Φᵀ`, at a state.

use super::touching::{add_row, along_row};
use super::{Mode, Touching, WithContacts};
use crate::Scalar;

impl<Y: Touching> WithContacts<Y> {
    /// Inverse inertia of the rows of some contacts, with all contacts open and loops closed: `a` is square, row by row,
    /// for the rows of `contacts` one contact after the other. One solve for each row. After [`WithContacts::look`];
    /// `open` has [`Mode::Open`] for each contact.
    pub(super) fn inverse_inertia(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        contacts: &[usize],
        open: &[Mode],
        a: &mut [Y::Scalar],
    ) {
        self.borrow_modes(open);
        let zero = Y::Scalar::zero();
        // Velocities of prescribed motions, which momenta add to.
        self.response.as_mut().fill(zero);
        self.answer(t, q);
        self.unit.as_mut().copy_from_slice(self.response_v.as_ref());
        let count: usize = contacts.iter().map(|&k| self.contact(k).rows()).sum();
        let mut i = 0;
        for &k in contacts {
            let c = self.contact(k);
            for row in c.row..c.row + c.rows() {
                self.response.as_mut().fill(zero);
                let (system, entries) = (&self.system, &self.at.entries);
                add_row(system, entries, row, Y::Scalar::one(), &mut self.response);
                self.answer(t, q);
                for (v, rest) in self.response_v.as_mut().iter_mut().zip(self.unit.as_ref()) {
                    *v = *v - *rest;
                }
                let mut j = 0;
                for &other in contacts {
                    let c = self.contact(other);
                    for row in c.row..c.row + c.rows() {
                        a[j * count + i] = along_row(self.system(), &self.at.entries, row, &self.response_v);
                        j += 1;
                    }
                }
                i += 1;
            }
        }
        symmetrize(a, count);
        self.restore();
    }

    /// Adds the impulses of some contacts, one number for each of their rows, to the momenta of the state, which are freed
    /// of multipliers.
    pub(super) fn kick(&mut self, contacts: &[usize], impulses: &[Y::Scalar]) {
        let mut i = 0;
        for &k in contacts {
            let c = self.contact(k);
            for row in c.row..c.row + c.rows() {
                let (system, entries) = (&self.system, &self.at.entries);
                add_row(system, entries, row, impulses[i], &mut self.p);
                i += 1;
            }
        }
    }
}

/// The mean of a matrix and its transpose: they differ by rounding.
fn symmetrize<S: crate::system::Real>(a: &mut [S], n: usize) {
    for i in 0..n {
        for j in 0..i {
            let mean = S::constant(0.5) * (a[i * n + j] + a[j * n + i]);
            (a[i * n + j], a[j * n + i]) = (mean, mean);
        }
    }
}
