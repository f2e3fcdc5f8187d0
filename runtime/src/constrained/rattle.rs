//! RATTLE for Hamiltonians that are not separable.

use super::open_and_closed::Unconstrained;
use super::rows::{add_forces, worst};
use super::ConstraintError;
use crate::integrate::{turns, Attempt, Chart, FromSystem, Integrator, Middle, Point, Scheme, StepError};
use crate::system::Real;
use crate::Scalar;

/// Largest number of iterations in a step.
const ITERATIONS: u32 = 100;
/// Size of the coordinates, rad or m, that changes are compared with at least.
const LEAST_SIZE: f64 = 0.01;

/// RATTLE (H. C. Andersen, 1983) for Hamiltonians that are not separable (E. Hairer, C. Lubich, G. Wanner, *Geometric
/// Numerical Integration*, VII.1.4, (1.26)), order 2: positions and velocities satisfy the constraints at the end of
/// each step. The method is symmetric, so that the energy of reversible motion does not drift, and without joints with
/// quaternions symplectic.
///
/// `p½ = p₀ + h/2 (ṗ(q₀, p½) − Φ₀ᵀλ)`, `q₁ = q₀ + h/2 (q̇(q₀, p½) + q̇(q₁, p½))` with `φ(q₁) = 0`;
/// `p₁ = p½ + h/2 (ṗ(q₁, p½) − Φ₁ᵀμ)` with `Φ₁ v₁ = 0`.
///
/// `q̇`, `ṗ` are those of the open system, and all of it is solved by fixed-point iteration: 3 evaluations, a
/// correction of positions and two sweeps for its multipliers each time. Momenta are `M v` at both ends. The
/// constraints and the open system must not depend on time, and the energy is kept only if all constraints are
/// holonomic.
pub type Rattle<Y> = Integrator<Y, RattleScheme<Y>>;

/// The scheme of [`Rattle`].
#[derive(Clone, Debug)]
pub struct RattleScheme<Y: Unconstrained>
where
    Y::Scalar: Real,
{
    fixed: Option<u32>,
    /// Rate of the closed system at the start.
    rate: Point<Y>,
    /// Half a step: momenta alone.
    half: Point<Y>,
    /// Rates at both ends with these.
    first: Point<Y>,
    second: Point<Y>,
    /// `Φ₀`, `λ`, and what belongs to them.
    entries: Y::Entries,
    lambda: Y::Rows,
    rows: [Y::Rows; 2],
    start: (Y::Coordinates, Y::Momenta),
    state: (Y::Coordinates, Y::Momenta),
    other: Y::Momenta,
    work: [Y::Momenta; 2],
    qd: Y::Coordinates,
    /// For rotations: the chart in which the rates at both ends are added.
    middle: Option<Middle<Y>>,
}

impl<Y> FromSystem<Y> for RattleScheme<Y>
where
    Y: Unconstrained,
    Y::Scalar: Real,
{
    fn new(system: &Y) -> Self {
        let (point, state) = (|| Point::zero(system), || (system.neutral(), system.zero_momenta()));
        RattleScheme {
            fixed: None,
            rate: point(),
            half: point(),
            first: point(),
            second: point(),
            entries: system.zero_entries(),
            lambda: system.zero_rows(),
            rows: [system.zero_rows(), system.zero_rows()],
            start: state(),
            state: state(),
            other: system.zero_momenta(),
            work: [system.zero_momenta(), system.zero_momenta()],
            qd: system.neutral(),
            middle: turns(system).then(|| Middle::new(system)),
        }
    }
}

impl<Y> Rattle<Y>
where
    Y: Unconstrained,
    Y::Scalar: Real,
{
    /// This method with exactly `n` iterations per step, for real time. The remaining error of the iteration adds to
    /// that of the method.
    #[must_use]
    pub fn with_iterations(self, n: u32) -> Self {
        self.map(|scheme| RattleScheme { fixed: Some(n), ..scheme })
    }

    /// Multipliers of the first half of the last step: forces and moments of the constraints, N and N m.
    pub fn lambda(&self) -> &Y::Rows {
        &self.scheme().lambda
    }
}

impl<Y> RattleScheme<Y>
where
    Y: Unconstrained,
    Y::Scalar: Real,
{
    /// Rates of the open system: at the start with the momenta of half a step, or at the end.
    fn open(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, end: bool) {
        let (q, p) = (&mut self.state.0, &mut self.state.1);
        let (point, out) = if end { (&step.delta, &mut self.second) } else { (&self.half, &mut self.first) };
        let chart = step.field.chart();
        chart.state(system, point, q, p);
        system.open_rates(t, q, p, &mut self.qd, &mut out.p);
        chart.rates(system, point, (q, p), &self.qd, out);
        step.statistics.evaluations += 1;
    }

    /// Makes one iteration. Returns the larger of the change and the residual of the end's positions, relative to the
    /// largest position.
    fn iterate(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
    ) -> Result<f64, ConstraintError> {
        let half = Y::Scalar::constant(0.5) * h;
        // The force at the start, in the chart's axes.
        let [force, _] = &mut self.work;
        force.as_mut().fill(Y::Scalar::zero());
        add_forces(system, &self.entries, &self.lambda, force);
        Chart::forces(system, &self.start.0, &self.half, force);
        self.open(step, system, t, false);
        let forces = self.work[0].as_ref();
        for ((p, rate), force) in self.half.p.as_mut().iter_mut().zip(self.first.p.as_ref()).zip(forces) {
            *p = half * (*rate - *force);
        }
        // The second evaluation uses the new momenta; with multipliers for the old ones the iteration would oscillate.
        self.open(step, system, t, false);
        step.delta.p.as_mut().copy_from_slice(self.half.p.as_ref());
        self.open(step, system, t + h, true);
        self.other.as_mut().copy_from_slice(step.delta.x.as_ref());
        if let Some(middle) = &mut self.middle {
            middle.rates_of_ends(system, &step.delta.x, [&mut self.first.x, &mut self.second.x]);
        }
        let rates = self.first.x.as_ref().iter().zip(self.second.x.as_ref());
        for (x, (first, second)) in step.delta.x.as_mut().iter_mut().zip(rates) {
            *x = half * (*first + *second);
        }
        if let Some(middle) = &mut self.middle {
            middle.place_half(&step.delta.x);
            middle.to_start(system, &mut step.delta.x);
        }
        let size = worst(self.start.0.as_ref()).1.to_f64().max(worst(step.delta.x.as_ref()).1.to_f64());
        // Where all coordinates are about zero, rounding errors of the residuals are those of lengths.
        let size = size.max(LEAST_SIZE);
        for (old, new) in self.other.as_mut().iter_mut().zip(step.delta.x.as_ref()) {
            *old = *old - *new;
        }
        let change = worst(self.other.as_ref()).1.to_f64().abs();
        let open = self.correct(step, system, t, h)?;
        step.statistics.iterations += 1;
        // A change that is not a number must not count as small.
        let change = if change.is_finite() { change.max(open) } else { f64::INFINITY };
        Ok(if change == 0.0 { 0.0 } else { change / size })
    }

    /// Improves the multipliers so that the residual of the end decreases. Returns the residual.
    fn correct(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
    ) -> Result<f64, ConstraintError> {
        let [dq, momenta] = &mut self.work;
        let [residual, sigma] = &mut self.rows;
        step.field.chart().state(system, &step.delta, &mut self.state.0, &mut self.state.1);
        system.position_correction(&self.state.0, residual, dq, sigma);
        let (index, size) = worst(dq.as_ref());
        if !size.is_finite() {
            return Err(ConstraintError::NotFinite { index });
        }
        // δq = h M⁻¹ δp½, and δp½ = −h/2 Φ₀ᵀ δλ.
        system.momenta(&self.start.0, dq, momenta);
        system.project_momenta(t, &self.start.0, momenta, dq, sigma);
        let factor = Y::Scalar::constant(2.0) / (h * h);
        for (lambda, sigma) in self.lambda.as_mut().iter_mut().zip(sigma.as_ref()) {
            *lambda = *lambda - factor * *sigma;
        }
        Ok(size.to_f64())
    }

    fn solve(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
    ) -> Result<(), ConstraintError> {
        let mut last = f64::INFINITY;
        let epsilon = Y::Scalar::epsilon();
        for iteration in 1..=self.fixed.unwrap_or(ITERATIONS) {
            let change = self.iterate(step, system, t, h)?;
            if self.fixed.is_some() {
                continue;
            }
            if !change.is_finite() || (iteration > 4 && change > 1e3) {
                return Err(ConstraintError::NoConvergence { iterations: iteration, change });
            }
            // The change is at the level of round-off or no longer decreases.
            if change <= 2.0 * epsilon || (iteration > 3 && change >= last && change <= 256.0 * epsilon) {
                // The momenta are one iteration behind.
                return self.iterate(step, system, t, h).map(|_| ());
            }
            last = change;
        }
        if self.fixed.is_some() || last <= 1e3 * epsilon {
            return Ok(());
        }
        Err(ConstraintError::NoConvergence { iterations: ITERATIONS, change: last })
    }
}

impl<Y> Scheme<Y> for RattleScheme<Y>
where
    Y: Unconstrained,
    Y::Scalar: Real,
{
    const KEEPS_GUESS: bool = true;

    fn order(&self) -> u32 {
        2
    }

    fn begin(&mut self) {
        self.lambda.as_mut().fill(Y::Scalar::zero());
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        _scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        let wrong = |error| StepError::Constraint { time: t.to_f64(), error };
        step.field.chart().base(system, &mut self.start.0, &mut self.start.1);
        system.constraint_residuals(&self.start.0, &mut self.rows[0], &mut self.entries);
        if !worst(self.lambda.as_ref()).1.is_finite() {
            self.lambda.as_mut().fill(Y::Scalar::zero());
        }
        // The iteration starts from the multipliers of the last step, which change little, or from zero.
        self.half.clear();
        step.delta.clear();
        if let Some(middle) = &mut self.middle {
            middle.place_half(&step.delta.x);
        }
        self.solve(step, system, t, h).map_err(wrong)?;
        self.open(step, system, t + h, true);
        let half = Y::Scalar::constant(0.5) * h;
        for (p, rate) in step.delta.p.as_mut().iter_mut().zip(self.second.p.as_ref()) {
            *p = *p + half * *rate;
        }
        // The second multipliers: the projection of momenta at the end.
        let ((q, p), new) = ((&mut self.state.0, &mut self.state.1), &mut self.other);
        step.field.chart().state(system, &step.delta, q, p);
        new.as_mut().copy_from_slice(p.as_ref());
        let ([v, _], [sigma, _]) = (&mut self.work, &mut self.rows);
        system.project_momenta(t + h, q, new, v, sigma);
        Chart::correct(system, (q, p), (q, new), &mut step.delta);
        Ok(0.0)
    }

    fn start(&mut self) -> &mut Point<Y> {
        &mut self.rate
    }
}
