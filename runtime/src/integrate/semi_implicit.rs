//! The semi-implicit Euler method.

use super::chart::Point;
use super::integrator::{Attempt, FromSystem, Integrator, Scheme};
use super::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// The semi-implicit Euler method, order 1: momenta first, then coordinates with the new momenta,
///
/// `p₁ = p₀ + h ṗ(q₀, p₀)`, `q₁ = q₀ + h q̇(q₀, p₁)`: two evaluations a step;
///
/// in acceleration form ([`SemiImplicitEuler::of_velocities`]) `v₁ = v₀ + h v̇(q₀, v₀)`, `q₁ = q₀ + h N(q₀) v₁`: one,
/// which is what game engines do.
///
/// The symplectic Euler method takes `ṗ(q₀, p₁)` instead. Where the Hamiltonian is separable, `H = T(p) + V(q)`, `ṗ`
/// does not depend on `p`, both are the same, and the method is symplectic: the error of the energy stays of the size
/// of `h` over very long times. Kinetic energies of mechanisms `pᵀ M(q)⁻¹ p / 2` are not separable unless the mass
/// matrix is constant. Then this method is explicit, of order 1, and not symplectic: the energy drifts with time, in
/// proportion to `h`. What it has over Euler's method is that it remains stable, for small steps, on oscillations that
/// springs and gravity make. Of joints with quaternions the momenta are those of [`chart`](super::chart), and the
/// rotation takes the new ones.
///
/// E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical Integration*, 2006, I.1.2 and VI.3, theorem 3.3.
pub type SemiImplicitEuler<Y> = Integrator<Y, SemiImplicit<Y>>;

/// The scheme of [`SemiImplicitEuler`].
#[derive(Clone, Debug)]
pub struct SemiImplicit<Y: System> {
    /// Whether the state holds velocities in place of momenta.
    velocities: bool,
    start: Point<Y>,
    stage: Point<Y>,
}

impl<Y: System> FromSystem<Y> for SemiImplicit<Y> {
    fn new(system: &Y) -> Self {
        SemiImplicit { velocities: false, start: Point::zero(system), stage: Point::zero(system) }
    }
}

#[cfg(feature = "alloc")]
impl<Y> SemiImplicitEuler<crate::AccelerationForm<Y>>
where
    Y: crate::Accelerated,
    Y::Scalar: Real,
{
    /// The method in acceleration form, where the coordinates' rates need no evaluation: one evaluation a step.
    pub fn of_velocities(system: &crate::AccelerationForm<Y>) -> Self {
        let scheme = SemiImplicit { velocities: true, ..SemiImplicit::new(system) };
        Self::from_scheme(system, scheme, false)
    }
}

impl<Y> Scheme<Y> for SemiImplicit<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    fn order(&self) -> u32 {
        1
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        _scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.start_rate(step, system, t);
        self.stage.clear();
        self.stage.add(h, &self.start);
        self.stage.x.as_mut().fill(Y::Scalar::zero());
        if self.velocities {
            step.field.velocities(system, &self.stage, &mut step.delta);
        } else {
            step.field.rates(system, t, &self.stage, &mut step.delta);
        }
        step.delta.scale(h);
        step.delta.p.as_mut().copy_from_slice(self.stage.p.as_ref());
        Ok(0.0)
    }

    fn start(&mut self) -> &mut Point<Y> {
        &mut self.start
    }
}
