//! Closed contacts whose rows depend on one another: which forces that leaves open.

use super::Hybrid;
use crate::contact::instant::Touches;
use crate::contact::{Touching, WithContacts};
use crate::integrate::Stepper;
use crate::lists::{copy, first, get, part, set, split};
use crate::system::Real;
use crate::Scalar;

/// Part of a row's inverse inertia that counts as none.
const NONE: f64 = 1e-12;
/// What is left of a row beside the others where it depends on them, at most, as a part of its inverse inertia.
const DEPENDS: f64 = 1e-10;
/// Part of a force that another one may be replaced by, below which it does not depend on that.
const APART: f64 = 1e-6;

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// Finds whether rows of the closed contacts depend on one another, and whether contacts that slide with friction are among
    /// them, with the inverse inertia of the problem; notes whether anything can move.
    pub(super) fn find_redundant_rows(&mut self, system: &mut WithContacts<Y>) {
        let zero = Y::Scalar::zero();
        let rows = self.touching.rows();
        let least = Y::Scalar::constant(NONE) * self.most_inverse_inertia(rows);
        let own = |i: usize| self.touching.inverse_inertia(i);
        system.find_pivots(&self.q);
        let independent = system.sigma.as_ref().iter().filter(|pivot| **pivot != zero).count();
        self.immobile = independent == self.p.as_ref().len() && system.at_rest();
        let mut i = 0;
        let mut redundant = false;
        for &k in self.touching.order() {
            let (c, mode) = (system.contact(k), system.mode(k));
            for j in 0..c.rows() {
                let left_out = get(system.sigma.as_ref(), c.row + j) == zero;
                redundant |= mode.acts(j) && left_out && own(i) > least;
                i += 1;
            }
        }
        system.redundant = redundant;
        system.shares = redundant && system.rubs && self.slides_share(system, least);
    }

    /// Largest inverse inertia of a row of the problem.
    fn most_inverse_inertia(&self, rows: usize) -> Y::Scalar {
        let own = (0..rows).map(|i| self.touching.inverse_inertia(i));
        own.fold(Y::Scalar::zero(), |most, own| if own > most { own } else { most })
    }

    /// Whether forces that change no velocity, of rows that act and have more than the `least` inverse inertia, have a part in
    /// the normal force of a contact that slides with friction: the null space of the inverse inertia, by Gauss-Jordan
    /// elimination with pivots on the diagonal.
    fn slides_share(&mut self, system: &WithContacts<Y>, least: Y::Scalar) -> bool {
        let one = Y::Scalar::one();
        let rows = self.touching.rows();
        let [free, pivot, no_force] = [Y::Scalar::zero(), one, -one];
        let Touches { count, order, a, work, .. } = &mut self.touching;
        let own = |i: usize| get(a.as_ref(), i * rows + i);
        let (matrix, rest) = split(work.as_mut(), rows * rows);
        let (state, rest) = split(rest, rows);
        let (line, _) = split(rest, rows);
        copy(matrix, a.as_ref());
        let mut i = 0;
        for &k in first(order.as_ref(), *count) {
            for j in 0..system.contact(k).rows() {
                let acts = system.mode(k).acts(j) && own(i) > least;
                set(state, i, if acts { free } else { no_force });
                i += 1;
            }
        }
        loop {
            let left = |i: usize| get(matrix, i * rows + i) / own(i);
            let mut best: Option<usize> = None;
            for i in (0..rows).filter(|i| get(state, *i) == free) {
                if left(i).to_f64() > DEPENDS && best.is_none_or(|best| left(i) > left(best)) {
                    best = Some(i);
                }
            }
            let Some(best) = best else { break };
            set(state, best, pivot);
            copy(line, part(matrix, best * rows, rows));
            let by = get(line, best);
            for (i, other) in matrix.chunks_exact_mut(rows.max(1)).enumerate() {
                let factor = if i == best { (get(other, best) - one) / by } else { get(other, best) / by };
                for (x, line) in other.iter_mut().zip(&*line) {
                    *x = *x - factor * *line;
                }
            }
        }
        // The forces that change no velocity: one of a row that is no pivot, and those of the pivots that replace it.
        let replaces = |i: usize, r: usize| {
            let part = get(matrix, i * rows + r);
            part * part * own(i) > Y::Scalar::constant(APART * APART) * own(r)
        };
        let mut i = 0;
        for &k in first(order.as_ref(), *count) {
            let mut others = (0..rows).filter(|r| get(state, *r) == free);
            let open = get(state, i) == free || get(state, i) == pivot && others.any(|r| replaces(i, r));
            if open && system.rubs(k) {
                return true;
            }
            i += system.contact(k).rows();
        }
        false
    }
}
