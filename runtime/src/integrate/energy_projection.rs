//! Projection of states onto the surface of constant energy.

use super::chart::Point;
use super::stepper::Stepper;
use super::StepError;
use crate::system::{Energetic, Real};
use crate::Scalar;

/// Corrects steps so that the energy stays what it was: for motion that loses and gains none.
///
/// The new point is moved along the gradient of the energy, which needs no derivatives: rates at the new point are the
/// gradient turned by a right angle (Hairer, Lubich, Wanner, *Geometric Numerical Integration*, IV.4; Hamilton's
/// equations). The rates there are those that the next step begins with, so nothing but the energy is evaluated, once
/// an iteration and once at the end. Momenta of groups are not moved, so the momentum of what floats freely stays as
/// the method has it.
///
/// It keeps the energy and little else: the error of the trajectory hardly changes.
#[derive(Clone, Debug)]
pub struct EnergyProjection<Y: Energetic> {
    target: Y::Scalar,
    iterations: u32,
    q: Y::Coordinates,
    p: Y::Momenta,
    gradient: Point<Y>,
}

impl<Y> EnergyProjection<Y>
where
    Y: Energetic,
    Y::Scalar: Real,
{
    /// Projection onto the energy of the state `(q, p)`, in at most `iterations` iterations a step; one is enough where
    /// steps are small.
    pub fn new(system: &mut Y, q: &Y::Coordinates, p: &Y::Momenta, iterations: u32) -> Self {
        let (kinetic, potential) = system.energies(q, p);
        EnergyProjection {
            target: kinetic + potential,
            iterations,
            q: q.clone(),
            p: p.clone(),
            gradient: Point::zero(system),
        }
    }

    /// The energy that is kept, J.
    pub fn target(&self) -> Y::Scalar {
        self.target
    }

    /// Corrects the displacement of the last attempt of a method, before it is accepted. Returns by how much the energy
    /// was off before, J. The rate at the end stays as it was found at the uncorrected point.
    pub fn correct<M: Stepper<Y>>(&mut self, method: &mut M, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Y::Scalar {
        let rate = method.end_rate(system, t, h);
        self.gradient.copy_from(rate);
        let (field, delta) = method.parts();
        field.chart().gradient(system, delta, &mut self.gradient);
        let mut square = Y::Scalar::zero();
        for x in self.gradient.parts().into_iter().flatten() {
            square = square + *x * *x;
        }
        let mut first = Y::Scalar::zero();
        for iteration in 0..self.iterations {
            field.chart().state(system, delta, &mut self.q, &mut self.p);
            let (kinetic, potential) = system.energies(&self.q, &self.p);
            let off = (potential - self.target) + kinetic;
            if iteration == 0 {
                first = off;
            }
            let factor = off / square;
            // What rounding errors of the energies leave says nothing. At rest in an equilibrium the gradient is zero: there is no
            // direction to move in.
            let noise = Y::Scalar::constant(2.0 * Y::Scalar::epsilon()) * (kinetic.abs() + potential.abs());
            if !(off.abs() > noise && factor.is_finite()) {
                break;
            }
            delta.add(-factor, &self.gradient);
        }
        first
    }

    /// One corrected step; see [`Stepper::step`]. A method's own evaluations and one at the end, which the next step
    /// begins with: with Adams-Bashforth methods one in all.
    ///
    /// # Errors
    /// [`StepError`]; `q` and `p` are then as they were.
    pub fn step<M: Stepper<Y>>(
        &mut self,
        method: &mut M,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), StepError> {
        method.resume(system, t, q, p)?;
        method.attempt(system, t, h, None)?;
        self.correct(method, system, t, h);
        method.accept(system, t, h)?;
        method.parts().0.store(system, q, p);
        Ok(())
    }
}
