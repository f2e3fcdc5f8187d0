//! The semi-implicit Euler method.

use super::chart::Point;
use super::field::Field;
use super::stepper::{hermite, Statistics, Stepper};
use super::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// The semi-implicit Euler method, order 1: momenta first, then coordinates with the new momenta,
///
/// `p₁ = p₀ + h ṗ(q₀, p₀)`, `q₁ = q₀ + h q̇(q₀, p₁)`: two evaluations a step;
///
/// in acceleration form ([`SemiImplicitEuler::of_velocities`]) `v₁ = v₀ + h v̇(q₀, v₀)`, `q₁ = q₀ + h N(q₀) v₁`: one, which is
/// what game engines do.
///
/// The symplectic Euler method takes `ṗ(q₀, p₁)` instead. Where the Hamiltonian is separable, `H = T(p) + V(q)`, `ṗ` does
/// not depend on `p`, both are the same, and the method is symplectic: the error of the energy stays of the size of `h` over
/// very long times. Kinetic energies of mechanisms `pᵀ M(q)⁻¹ p / 2` are not separable unless the mass matrix is constant. Then
/// this method is explicit, of order 1, and not symplectic: the energy drifts with time, in proportion to `h`. What it has
/// over Euler's method is that it remains stable, for small steps, on oscillations that springs and gravity make. Of joints with
/// quaternions the momenta are those of [`chart`](super::chart), and the rotation takes the new ones.
///
/// E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical Integration*, 2006, I.1.2 and VI.3, theorem 3.3.
#[derive(Clone, Debug)]
pub struct SemiImplicitEuler<Y: System> {
    field: Field<Y>,
    statistics: Statistics,
    /// What stands at the place of momenta are velocities.
    velocities: bool,
    start: Point<Y>,
    start_known: bool,
    end: Point<Y>,
    end_known: bool,
    stage: Point<Y>,
    delta: Point<Y>,
}

impl<Y> SemiImplicitEuler<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Room for one system; two evaluations a step.
    pub fn new(system: &Y) -> Self {
        Self::with(system, false, false)
    }

    /// With compensated sums, see [`Explicit::compensated`](super::Explicit::compensated).
    pub fn compensated(system: &Y) -> Self {
        Self::with(system, false, true)
    }

    fn with(system: &Y, velocities: bool, compensated: bool) -> Self {
        let point = || Point::zero(system);
        SemiImplicitEuler {
            field: Field::new(system, compensated),
            statistics: Statistics::default(),
            velocities,
            start: point(),
            start_known: false,
            end: point(),
            end_known: false,
            stage: point(),
            delta: point(),
        }
    }
}

#[cfg(feature = "alloc")]
impl<Y> SemiImplicitEuler<crate::AccelerationForm<Y>>
where
    Y: crate::Accelerated,
    Y::Scalar: Real,
{
    /// The same in acceleration form, where the coordinates' rates need no evaluation: one evaluation a step.
    pub fn of_velocities(system: &crate::AccelerationForm<Y>) -> Self {
        Self::with(system, true, false)
    }
}

impl<Y> Stepper<Y> for SemiImplicitEuler<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    fn order(&self) -> u32 {
        1
    }

    fn error_order(&self) -> Option<u32> {
        None
    }

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        (self.start_known, self.end_known) = (false, false);
        self.field.load(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        _scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.start_rate(system, t);
        self.stage.clear();
        self.stage.add(h, &self.start);
        self.stage.x.as_mut().fill(Y::Scalar::zero());
        if self.velocities {
            self.field.velocities(system, &self.stage, &mut self.delta);
        } else {
            self.field.rates(system, t, &self.stage, &mut self.delta);
        }
        self.delta.scale(h);
        self.delta.p.as_mut().copy_from_slice(self.stage.p.as_ref());
        self.end_known = false;
        Ok(0.0)
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        (&mut self.field, &mut self.delta)
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        if !self.start_known {
            self.stage.clear();
            self.field.rates(system, t, &self.stage, &mut self.start);
            self.start_known = true;
        }
        &self.start
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        if !self.end_known {
            self.field.rates(system, t + h, &self.delta, &mut self.end);
            self.end_known = true;
        }
        &self.end
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, _h: Y::Scalar) -> Result<(), StepError> {
        self.field.advance(system, t, &self.delta)?;
        (self.start_known, self.end_known) = (false, false);
        self.statistics.steps += 1;
        Ok(())
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.end_rate(system, t, h);
        hermite(h, theta, &self.delta, [&self.start, &self.end], out);
    }

    fn statistics(&self) -> Statistics {
        Statistics { evaluations: self.field.evaluations(), ..self.statistics }
    }
}
