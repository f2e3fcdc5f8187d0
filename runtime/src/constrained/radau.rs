//! Radau IIA on the equations of index 2.

use super::open_and_closed::Unconstrained;
use super::rows::{add_forces, worst};
use super::ConstraintError;
use crate::integrate::tableau::RADAU5;
use crate::integrate::{Attempt, Chart, FromSystem, Integrator, Point, Scheme, StepError};
use crate::system::Real;
use crate::Scalar;

/// Largest number of iterations in a step.
const ITERATIONS: u32 = 100;

/// The three-stage Radau IIA method on the equations of index 2, with fixed steps: `q̇`, `ṗ − Φᵀλ` of the open system
/// with `Φ v = b` at every stage, and so at the end of the step, which is the last one. Order 5 in the state, 3 in the
/// multipliers (E. Hairer, C. Lubich, M. Roche, *The Numerical Solution of Differential-Algebraic Systems by
/// Runge-Kutta Methods*, 1989, table 2.3). Positions drift with the method's error; [`Projection`](super::Projection)
/// brings them back.
///
/// Stages are solved for by fixed-point iteration, multipliers by the projection of each stage's momenta: 3
/// evaluations, 3 of `Φ` and 3 projections an iteration. It is not for stiff systems. Momenta are `M v` at both ends.
pub type RadauIndex2<Y> = Integrator<Y, RadauIndex2Scheme<Y>>;

/// The scheme of [`RadauIndex2`].
#[derive(Clone, Debug)]
pub struct RadauIndex2Scheme<Y: Unconstrained>
where
    Y::Scalar: Real,
{
    fixed: Option<u32>,
    /// Rate of the closed system at the start.
    rate: Point<Y>,
    /// Weights of the method, and their inverse.
    a: [[Y::Scalar; 3]; 3],
    inverse: [[Y::Scalar; 3]; 3],
    c: [Y::Scalar; 3],
    z: [Point<Y>; 3],
    f: [Point<Y>; 3],
    new: Point<Y>,
    lambda: [Y::Rows; 3],
    sigma: [Y::Rows; 3],
    entries: Y::Entries,
    residual: Y::Rows,
    q: Y::Coordinates,
    p: Y::Momenta,
    qd: Y::Coordinates,
    work: Y::Momenta,
    /// Sizes of coordinates and momenta at the start of the step.
    size: (f64, f64),
}

/// The inverse by cofactors; the matrix of the method is far from singular.
fn inverse<S: Scalar>(a: &[[S; 3]; 3]) -> [[S; 3]; 3] {
    let minor = |i: usize, j: usize| {
        let (r, s, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        a[r][c] * a[s][d] - a[r][d] * a[s][c]
    };
    let det = a[0][0] * minor(0, 0) + a[0][1] * minor(0, 1) + a[0][2] * minor(0, 2);
    core::array::from_fn(|i| core::array::from_fn(|j| minor(j, i) / det))
}

impl<Y> FromSystem<Y> for RadauIndex2Scheme<Y>
where
    Y: Unconstrained,
    Y::Scalar: Real,
{
    fn new(system: &Y) -> Self {
        let point = || Point::zero(system);
        let a = RADAU5.a.map(|row| row.map(|x| x.get()));
        RadauIndex2Scheme {
            fixed: None,
            rate: point(),
            inverse: inverse(&a),
            a,
            c: RADAU5.c.map(|x| x.get()),
            z: core::array::from_fn(|_| point()),
            f: core::array::from_fn(|_| point()),
            new: point(),
            lambda: core::array::from_fn(|_| system.zero_rows()),
            sigma: core::array::from_fn(|_| system.zero_rows()),
            entries: system.zero_entries(),
            residual: system.zero_rows(),
            q: system.neutral(),
            p: system.zero_momenta(),
            qd: system.neutral(),
            work: system.zero_momenta(),
            size: (0.0, 0.0),
        }
    }
}

impl<Y> RadauIndex2<Y>
where
    Y: Unconstrained,
    Y::Scalar: Real,
{
    /// This method with exactly `n` iterations per step, for real time. The remaining error of the iteration adds to
    /// that of the method.
    #[must_use]
    pub fn with_iterations(self, n: u32) -> Self {
        self.map(|scheme| RadauIndex2Scheme { fixed: Some(n), ..scheme })
    }

    /// Multipliers at the end of the last step: forces and moments of the constraints, N and N m.
    pub fn lambda(&self) -> &Y::Rows {
        &self.scheme().lambda[2]
    }
}

impl<Y> RadauIndex2Scheme<Y>
where
    Y: Unconstrained,
    Y::Scalar: Real,
{
    /// Rates of a stage, with the forces of its multipliers, and `σ` by which its momenta miss the constraints.
    fn stage(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar, i: usize) {
        let at = t + self.c[i] * h;
        let (z, f) = (&self.z[i], &mut self.f[i]);
        let chart = step.field.chart();
        chart.state(system, z, &mut self.q, &mut self.p);
        system.constraint_residuals(&self.q, &mut self.residual, &mut self.entries);
        let force = &mut self.work;
        force.as_mut().fill(Y::Scalar::zero());
        add_forces(system, &self.entries, &self.lambda[i], force);
        Chart::forces(system, &self.q, z, force);
        system.open_rates(at, &self.q, &self.p, &mut self.qd, &mut f.p);
        chart.rates(system, z, (&self.q, &self.p), &self.qd, f);
        for (f, force) in f.p.as_mut().iter_mut().zip(force.as_ref()) {
            *f = *f - *force;
        }
        step.statistics.evaluations += 1;
    }

    /// Computes the stages from the rates. Returns the largest change relative to the state.
    fn insert(&mut self, h: Y::Scalar) -> f64 {
        // That of earlier iterates does not count.
        let (mut change, mut size) = ((0.0_f64, 0.0_f64), self.size);
        for (z, row) in self.z.iter_mut().zip(&self.a) {
            self.new.clear();
            for (f, a) in self.f.iter().zip(row) {
                self.new.add(h * *a, f);
            }
            z.scale(-Y::Scalar::one());
            z.add(Y::Scalar::one(), &self.new);
            change = (largest(change.0, z.x.as_ref()), largest(change.1, z.p.as_ref()));
            z.copy_from(&self.new);
            size = (largest(size.0, z.x.as_ref()), largest(size.1, z.p.as_ref()));
        }
        let part = |change: f64, size: f64| if change == 0.0 { 0.0 } else { change / size };
        part(change.0, size.0).max(part(change.1, size.1))
    }

    /// Makes one iteration. Returns the size of its change.
    fn iterate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> f64 {
        for i in 0..3 {
            self.stage(step, system, t, h, i);
        }
        let change = self.insert(h);
        for i in 0..3 {
            let at = t + self.c[i] * h;
            step.field.chart().state(system, &self.z[i], &mut self.q, &mut self.p);
            system.project_momenta(at, &self.q, &mut self.p, &mut self.work, &mut self.sigma[i]);
        }
        // h Σ a_ij Φ_jᵀ δλ_j = Φ_iᵀ σ_i, with Φ_j for Φ_i.
        for (lambda, row) in self.lambda.iter_mut().zip(&self.inverse) {
            for (sigma, w) in self.sigma.iter().zip(row) {
                for (lambda, sigma) in lambda.as_mut().iter_mut().zip(sigma.as_ref()) {
                    *lambda = *lambda + *w / h * *sigma;
                }
            }
        }
        step.statistics.iterations += 1;
        change
    }

    fn solve(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
    ) -> Result<(), ConstraintError> {
        let epsilon = Y::Scalar::epsilon();
        let (mut last, mut best) = (f64::INFINITY, f64::INFINITY);
        for iteration in 1..=self.fixed.unwrap_or(ITERATIONS) {
            let change = self.iterate(step, system, t, h);
            if self.fixed.is_some() {
                continue;
            }
            if !change.is_finite() || change > 1e8 {
                return Err(ConstraintError::NoConvergence { iterations: iteration, change });
            }
            // The change is at the level of round-off or no longer decreases.
            if change <= 4.0 * epsilon || (iteration > 3 && change >= last && change <= 1e3 * epsilon) {
                return Ok(());
            }
            (last, best) = (change, best.min(change));
        }
        if self.fixed.is_some() || best <= 1e4 * epsilon {
            return Ok(());
        }
        Err(ConstraintError::NoConvergence { iterations: ITERATIONS, change: last })
    }
}

/// The larger of a number and the sizes of others; infinite where one is not a number.
fn largest<S: Real>(least: f64, x: &[S]) -> f64 {
    let size = worst(x).1.to_f64();
    if size.is_nan() {
        f64::INFINITY
    } else {
        least.max(size.abs())
    }
}

impl<Y> Scheme<Y> for RadauIndex2Scheme<Y>
where
    Y: Unconstrained,
    Y::Scalar: Real,
{
    const KEEPS_GUESS: bool = true;

    fn order(&self) -> u32 {
        RADAU5.order
    }

    fn begin(&mut self) {
        self.lambda.iter_mut().for_each(|lambda| lambda.as_mut().fill(Y::Scalar::zero()));
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        _scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        let [_, _, end] = &self.lambda;
        // The iteration starts from the multipliers at the end of the last step.
        let usable = worst(end.as_ref()).1.is_finite();
        let [first, second, end] = &mut self.lambda;
        if !usable {
            end.as_mut().fill(Y::Scalar::zero());
        }
        first.as_mut().copy_from_slice(end.as_ref());
        second.as_mut().copy_from_slice(end.as_ref());
        self.z.iter_mut().for_each(Point::clear);
        step.field.chart().base(system, &mut self.q, &mut self.p);
        self.size = (largest(0.0, self.q.as_ref()), largest(0.0, self.p.as_ref()));
        let result = self.solve(step, system, t, h);
        result.map_err(|error| StepError::Constraint { time: t.to_f64(), error })?;
        step.delta.copy_from(&self.z[2]);
        Ok(0.0)
    }

    fn start(&mut self) -> &mut Point<Y> {
        &mut self.rate
    }
}
