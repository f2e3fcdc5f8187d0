//! A mechanism in steps of the explicit midpoint rule, with exact derivatives.

use super::{Differentiable, Real};

/// A system in steps, `x → f(x, u)`, and the quantities `y(x)` that a cost weighs: the state itself unless stated otherwise.
pub trait Dynamics<S: Real, const NX: usize, const NU: usize> {
    /// The state after a step.
    fn step(&mut self, x: &[S; NX], u: &[S; NU]) -> [S; NX];

    /// `A = ∂f/∂x` and `B = ∂f/∂u`.
    fn linearise(&mut self, x: &[S; NX], u: &[S; NU], a: &mut [[S; NX]; NX], b: &mut [[S; NU]; NX]);

    /// `y(x)`.
    #[inline(always)]
    fn weighed(&mut self, x: &[S; NX]) -> [S; NX] {
        *x
    }

    /// The state after a step, and `y` at the state before it.
    #[inline(always)]
    fn step_weighed(&mut self, x: &[S; NX], u: &[S; NU]) -> ([S; NX], [S; NX]) {
        (self.step(x, u), *x)
    }

    /// `y` at the state of the last linearisation or, for the last node, at this state.
    #[inline(always)]
    fn weighed_again(&mut self, x: &[S; NX], _last: bool) -> [S; NX] {
        *x
    }

    /// Adds `Jᵀ d` to a gradient and `Jᵀ W J` to a Hessian, where `J = ∂y/∂x` at the state of
    /// [`Dynamics::weighed_again`] and `W` is diagonal.
    #[inline(always)]
    fn add_weighed(&self, d: &[S; NX], weights: &[S; NX], gradient: &mut [S; NX], hessian: &mut [[S; NX]; NX]) {
        for i in 0..NX {
            hessian[i][i] = hessian[i][i] + weights[i];
            gradient[i] = gradient[i] + d[i];
        }
    }
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
        self.step_and_rates(x, u).0
    }

    fn linearise(&mut self, x: &[S; NX], u: &[S; NU], a: &mut [[S; NX]; NX], b: &mut [[S; NU]; NX]) {
        self.linearise_and(x, u, a, b, |_, _| {});
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
    /// The state after a step, and the rates at the state before it.
    pub fn step_and_rates<const NX: usize>(&mut self, x: &[S; NX], u: &[S; NU]) -> ([S; NX], [S; NX]) {
        (self.drive)(&mut self.system, u);
        let first = self.rates(x);
        let middle = self.rates(&along(x, self.length * S::constant(0.5), &first));
        (along(x, self.length, &middle), first)
    }

    /// `A` and `B`; `see` is shown the rates at the state, and their derivatives.
    pub fn linearise_and<const NX: usize>(
        &mut self,
        x: &[S; NX],
        u: &[S; NU],
        a: &mut [[S; NX]; NX],
        b: &mut [[S; NU]; NX],
        see: impl FnOnce(&[S; NX], &[[S; NX]; NX]),
    ) {
        (self.drive)(&mut self.system, u);
        let (h, half) = (self.length, self.length * S::constant(0.5));
        let first = self.derivatives(x, a);
        see(&first, a);
        let mut middle = [[S::zero(); NX]; NX];
        self.derivatives(&along(x, half, &first), &mut middle);
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

    /// `(q̇, ṗ)`.
    pub fn rates<const NX: usize>(&mut self, x: &[S; NX]) -> [S; NX] {
        let (q, p) = core::array::from_fn::<_, 2, _>(|part| core::array::from_fn(|i| x[part * NV + i])).into();
        let (mut qd, mut pd) = ([S::zero(); NV], [S::zero(); NV]);
        self.system.rates_at(S::zero(), &q, &p, &mut qd, &mut pd);
        core::array::from_fn(|i| if i < NV { qd[i] } else { pd[i - NV] })
    }

    /// The rates and their derivatives.
    pub fn derivatives<const NX: usize>(&mut self, x: &[S; NX], out: &mut [[S; NX]; NX]) -> [S; NX] {
        let mut rates = self.system.zero_derivatives();
        let (q, p) = core::array::from_fn::<_, 2, _>(|part| core::array::from_fn(|i| x[part * NV + i])).into();
        self.system.rate_derivatives(S::zero(), &q, &p, &mut rates);
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
