//! Costs of velocities: a cost weighs `(q, v)`, while the steps are those of `(q, p)`.

use super::steps::{Dynamics, Steps};
use super::{Differentiable, Real};

/// A mechanism in steps, `x = (q, p)`, of which a cost weighs `y = (q, v)`. The second derivatives of `v` are left out of the
/// cost's, as everywhere in the method: in exact arithmetic the iterations are then those in the state `(q, v)`.
pub struct Velocities<Y, S, const NX: usize, const NU: usize> {
    /// The mechanism.
    pub steps: Steps<Y, S, NU>,
    /// The rates at the state of the last linearisation, and their derivatives; of both the upper half, `v`, counts.
    rates: [S; NX],
    jacobian: [[S; NX]; NX],
}

impl<Y, S: Real, const NX: usize, const NU: usize> Velocities<Y, S, NX, NU> {
    /// Of a mechanism.
    pub fn new(steps: Steps<Y, S, NU>) -> Self {
        Velocities { steps, rates: [S::zero(); NX], jacobian: [[S::zero(); NX]; NX] }
    }
}

impl<Y, S, const NV: usize, const NX: usize, const NU: usize> Dynamics<S, NX, NU> for Velocities<Y, S, NX, NU>
where
    S: Real,
    Y: Differentiable<Scalar = S, Coordinates = [S; NV], Momenta = [S; NV], Square = [[S; NV]; NV]>,
{
    fn step(&mut self, x: &[S; NX], u: &[S; NU]) -> [S; NX] {
        self.steps.step(x, u)
    }

    fn linearise(&mut self, x: &[S; NX], u: &[S; NU], a: &mut [[S; NX]; NX], b: &mut [[S; NU]; NX]) {
        let (rates, jacobian) = (&mut self.rates, &mut self.jacobian);
        self.steps.linearise_and(x, u, a, b, |first, derivatives| {
            *rates = *first;
            jacobian[..NV].copy_from_slice(&derivatives[..NV]);
        });
    }

    fn weighed(&mut self, x: &[S; NX]) -> [S; NX] {
        let rates = self.steps.rates(x);
        in_velocities::<S, NX, NV>(x, &rates)
    }

    fn step_weighed(&mut self, x: &[S; NX], u: &[S; NU]) -> ([S; NX], [S; NX]) {
        let (end, rates) = self.steps.step_and_rates(x, u);
        (end, in_velocities::<S, NX, NV>(x, &rates))
    }

    fn weighed_again(&mut self, x: &[S; NX], last: bool) -> [S; NX] {
        if last {
            self.rates = self.steps.derivatives(x, &mut self.jacobian);
        }
        in_velocities::<S, NX, NV>(x, &self.rates)
    }

    fn add_weighed(&self, d: &[S; NX], weights: &[S; NX], gradient: &mut [S; NX], hessian: &mut [[S; NX]; NX]) {
        for i in 0..NV {
            hessian[i][i] = hessian[i][i] + weights[i];
            gradient[i] = gradient[i] + d[i];
        }
        for k in 0..NV {
            let row = &self.jacobian[k];
            for i in 0..NX {
                gradient[i] = gradient[i] + row[i] * d[NV + k];
                let scaled = row[i] * weights[NV + k];
                hessian[i].iter_mut().zip(row).for_each(|(h, r)| *h = *h + scaled * *r);
            }
        }
    }
}

/// `(q, v)` of a state `(q, p)` with these rates.
fn in_velocities<S: Real, const NX: usize, const NV: usize>(x: &[S; NX], rates: &[S; NX]) -> [S; NX] {
    core::array::from_fn(|i| if i < NV { x[i] } else { rates[i - NV] })
}
