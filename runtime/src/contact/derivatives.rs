//! Derivatives of the rates of a mechanism with contacts, for implicit methods.

use super::{Touching, WithContacts};
use crate::integrate::Chart;
use crate::lists::{copy, get, largest, set};
use crate::system::{Differentiable, Real, StateDerivatives, System};
use crate::Scalar;

/// Part of the largest momentum by which momenta are moved that are smaller.
const SMALLEST: f64 = 1e-3;

/// By differences over the rates: the friction of contacts that slide depends on the state through the forces of all that
/// touch. Implicit methods correct what derivatives err by.
impl<Y: Touching + Differentiable> Differentiable for WithContacts<Y> {
    type Square = Y::Square;

    fn square(&self) -> Y::Square {
        self.system.square()
    }

    fn depends_on_time(&self) -> bool {
        self.system.depends_on_time()
    }

    fn rate_derivatives(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
        out: &mut StateDerivatives<Y::Momenta, Y::Square>,
    ) {
        let zero = Y::Scalar::zero();
        let part = Y::Scalar::constant(libm::sqrt(Y::Scalar::epsilon()));
        let (mut qd, mut moved_q, mut moved_p) = (q.clone(), q.clone(), p.clone());
        let (mut v, mut pd) = (p.clone(), p.clone());
        self.velocities_and_forces(t, (q, p), &mut qd, &mut out.v, &mut out.pd);
        let largest = largest(p.as_ref());
        let count = p.as_ref().len();
        for k in 0..2 * count {
            copy(moved_q.as_mut(), q.as_ref());
            copy(moved_p.as_mut(), p.as_ref());
            let (column, by) = if k < count {
                v.as_mut().fill(zero);
                set(v.as_mut(), k, part);
                Chart::displace(&self.system, &mut v, &mut moved_q);
                (k, part)
            } else {
                let column = k - count;
                let at = get(p.as_ref(), column);
                let least = Y::Scalar::constant(SMALLEST) * largest;
                let size = if at.abs() > least { at.abs() } else { least };
                let step = part * if size > zero { size } else { Y::Scalar::one() };
                // What the sum really changes by.
                set(moved_p.as_mut(), column, at + step);
                (column, get(moved_p.as_ref(), column) - at)
            };
            self.velocities_and_forces(t, (&moved_q, &moved_p), &mut qd, &mut v, &mut pd);
            let by = Y::Scalar::one() / by;
            let StateDerivatives { v: v0, pd: pd0, dv_dq, dv_dp, dpd_dq, dpd_dp } = out;
            let blocks = if k < count { [dv_dq, dpd_dq] } else { [dv_dp, dpd_dp] };
            for (block, (after, before)) in blocks.into_iter().zip([(&v, &*v0), (&pd, &*pd0)]) {
                for (row, (a, b)) in block.as_mut().iter_mut().zip(after.as_ref().iter().zip(before.as_ref())) {
                    set(row.as_mut(), column, by * (*a - *b));
                }
            }
        }
    }
}

impl<Y: Touching> WithContacts<Y> {
    /// Velocities and momentum rates. `qd` is overwritten.
    fn velocities_and_forces(
        &mut self,
        t: Y::Scalar,
        (q, p): (&Y::Coordinates, &Y::Momenta),
        qd: &mut Y::Coordinates,
        v: &mut Y::Momenta,
        pd: &mut Y::Momenta,
    ) {
        self.rates_at(t, q, p, qd, pd);
        // Friction has asked for them already.
        if !self.rubs {
            self.free(t, q, p);
        }
        copy(v.as_mut(), self.at.v.as_ref());
    }
}
