//! A mechanism in steps of the explicit midpoint rule, with exact derivatives.

use super::{Differentiable, Real, StateDerivatives};

/// A system in steps, `x → f(x, u)`.
pub trait Dynamics<S, const NX: usize, const NU: usize> {
    /// The state after a step.
    fn step(&mut self, x: &[S; NX], u: &[S; NU]) -> [S; NX];
    /// `A = ∂f/∂x` and `B = ∂f/∂u`.
    fn linearise(&mut self, x: &[S; NX], u: &[S; NU], a: &mut [[S; NX]; NX], b: &mut [[S; NU]; NX]);
}

/// A mechanism whose coordinates are angles and displacements: `x = (q, p)`, `u` the efforts of some joints.
pub struct Steps<Y, S, const NU: usize> {
    /// The mechanism.
    pub system: Y,
    /// Sets its joint forces.
    pub drive: fn(&mut Y, &[S; NU]),
    /// Velocities on which the inputs act.
    pub joints: [usize; NU],
    /// Length of a step, s.
    pub length: S,
}

impl<Y, S, const NV: usize, const NX: usize, const NU: usize> Dynamics<S, NX, NU> for Steps<Y, S, NU>
where
    S: Real,
    Y: Differentiable<Scalar = S, Coordinates = [S; NV], Momenta = [S; NV], Square = [[S; NV]; NV]>,
{
    fn step(&mut self, x: &[S; NX], u: &[S; NU]) -> [S; NX] {
        (self.drive)(&mut self.system, u);
        let first = self.rates(x);
        let middle = self.rates(&along(x, self.length * S::constant(0.5), &first));
        along(x, self.length, &middle)
    }

    fn linearise(&mut self, x: &[S; NX], u: &[S; NU], a: &mut [[S; NX]; NX], b: &mut [[S; NU]; NX]) {
        (self.drive)(&mut self.system, u);
        let (h, half) = (self.length, self.length * S::constant(0.5));
        let mut rates = self.system.zero_derivatives();
        let first = self.derivatives(x, &mut rates, a);
        let mut middle = [[S::zero(); NX]; NX];
        self.derivatives(&along(x, half, &first), &mut rates, &mut middle);
        // A = 1 + h F_m (1 + h/2 F_0), B = h (F_m h/2 + 1) B_c.
        for (j, joint) in self.joints.iter().enumerate() {
            for i in 0..NX {
                let one = if i == NV + joint { S::one() } else { S::zero() };
                let entry = middle[i].get(NV + joint).copied().unwrap_or_else(S::zero);
                b[i][j] = h * (half * entry + one);
            }
        }
        for i in 0..NX {
            for j in 0..NX {
                a[i][j] = half * a[i][j] + if i == j { S::one() } else { S::zero() };
            }
        }
        let inner = *a;
        for i in 0..NX {
            let mut row = [S::zero(); NX];
            for k in 0..NX {
                row.iter_mut().zip(&inner[k]).for_each(|(x, inner)| *x = *x + h * middle[i][k] * *inner);
            }
            row[i] = row[i] + S::one();
            a[i] = row;
        }
    }
}

/// `x + h d`.
fn along<S: Real, const NX: usize>(x: &[S; NX], h: S, d: &[S; NX]) -> [S; NX] {
    core::array::from_fn(|i| x[i] + h * d[i])
}

impl<Y, S, const NV: usize, const NU: usize> Steps<Y, S, NU>
where
    S: Real,
    Y: Differentiable<Scalar = S, Coordinates = [S; NV], Momenta = [S; NV], Square = [[S; NV]; NV]>,
{
    fn rates<const NX: usize>(&mut self, x: &[S; NX]) -> [S; NX] {
        let (q, p) = core::array::from_fn::<_, 2, _>(|part| core::array::from_fn(|i| x[part * NV + i])).into();
        let (mut qd, mut pd) = ([S::zero(); NV], [S::zero(); NV]);
        self.system.rates_at(S::zero(), &q, &p, &mut qd, &mut pd);
        core::array::from_fn(|i| if i < NV { qd[i] } else { pd[i - NV] })
    }

    /// The rates and their derivatives.
    fn derivatives<const NX: usize>(
        &mut self,
        x: &[S; NX],
        rates: &mut StateDerivatives<[S; NV], [[S; NV]; NV]>,
        out: &mut [[S; NX]; NX],
    ) -> [S; NX] {
        let (q, p) = core::array::from_fn::<_, 2, _>(|part| core::array::from_fn(|i| x[part * NV + i])).into();
        self.system.rate_derivatives(S::zero(), &q, &p, rates);
        for (rows, blocks) in rates.blocks().into_iter().enumerate() {
            for (columns, block) in blocks.into_iter().enumerate() {
                for i in 0..NV {
                    out[rows * NV + i][columns * NV..(columns + 1) * NV].copy_from_slice(&block[i]);
                }
            }
        }
        core::array::from_fn(|i| if i < NV { rates.v[i] } else { rates.pd[i - NV] })
    }
}
