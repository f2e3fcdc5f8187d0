//! The classical fourth-order method.

use super::{settle, StepError};
use crate::system::{Real, System};
use crate::Scalar;

/// Kutta's method of order 4 with a fixed step: four evaluations, no allocation. Quaternions are integrated by components
/// and scaled back to unit length after each step.
///
/// W. Kutta, *Beitrag zur näherungsweisen Integration totaler Differentialgleichungen*, 1901.
#[derive(Clone, Debug)]
pub struct Rk4<Y: System> {
    q: Y::Coordinates,
    p: Y::Momenta,
    kq: Y::Coordinates,
    kp: Y::Momenta,
    sum_q: Y::Coordinates,
    sum_p: Y::Momenta,
}

/// `out = base + h k`.
fn advance<S: Scalar>(out: &mut [S], base: &[S], h: S, k: &[S]) {
    for ((out, base), k) in out.iter_mut().zip(base).zip(k) {
        *out = *base + h * *k;
    }
}

/// `sum += w k`.
fn accumulate<S: Scalar>(sum: &mut [S], w: S, k: &[S]) {
    for (sum, k) in sum.iter_mut().zip(k) {
        *sum = *sum + w * *k;
    }
}

impl<Y> Rk4<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Room for the stages of one system.
    pub fn new(system: &Y) -> Self {
        let (q, p) = (system.neutral(), system.rest());
        Rk4 { kq: q.clone(), sum_q: q.clone(), q, kp: p.clone(), sum_p: p.clone(), p }
    }

    /// One step of `h` s from time `t`.
    ///
    /// # Errors
    /// [`StepError`] where the result is not usable; `q` and `p` are then the unusable values.
    pub fn step(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), StepError> {
        let c = Y::Scalar::constant;
        let half = h * c(0.5);
        system.state_rates(t, q, p, &mut self.kq, &mut self.kp);
        self.sum_q.as_mut().copy_from_slice(self.kq.as_ref());
        self.sum_p.as_mut().copy_from_slice(self.kp.as_ref());
        for (fraction, weight) in [(half, c(2.0)), (half, c(2.0)), (h, c(1.0))] {
            advance(self.q.as_mut(), q.as_ref(), fraction, self.kq.as_ref());
            advance(self.p.as_mut(), p.as_ref(), fraction, self.kp.as_ref());
            system.state_rates(t + fraction, &self.q, &self.p, &mut self.kq, &mut self.kp);
            accumulate(self.sum_q.as_mut(), weight, self.kq.as_ref());
            accumulate(self.sum_p.as_mut(), weight, self.kp.as_ref());
        }
        let sixth = h * c(1.0 / 6.0);
        accumulate(q.as_mut(), sixth, self.sum_q.as_ref());
        accumulate(p.as_mut(), sixth, self.sum_p.as_ref());
        settle(system, t, q, p)
    }
}
