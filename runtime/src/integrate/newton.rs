//! How the equations of an implicit method's stages are solved: by simplified Newton iteration, or by fixed-point
//! iteration.

use super::chart::Point;
use super::field::Field;
use super::linear::{Jacobian, Lu};
use super::tableau::Mode;
use crate::system::{Differentiable, Real, System};

/// An iteration for the displacements `z_i` of a collocation method's stages, `z_i = h Σ_j a_ij f(z_j)`.
pub trait Iteration<Y: System, const S: usize> {
    /// Largest numbers of iterations: in a fixed step, and in a step that error control may make smaller.
    const LIMITS: [u32; 2];
    /// Whether derivatives are used.
    const DERIVATIVES: bool;

    /// Makes it for one system and a method with these modes.
    fn new(system: &Y, modes: &'static [Mode<S>]) -> Self;

    /// Evaluates the rate at the start of the step and the derivatives there. Not called if no derivatives are used.
    fn linearise(&mut self, field: &mut Field<Y>, system: &mut Y, t: Y::Scalar, rate: &mut Point<Y>);

    /// Factors the matrices of a step of `h` s.
    ///
    /// # Errors
    /// The index of the first column without a pivot.
    fn factor(&mut self, h: Y::Scalar) -> Result<(), usize>;

    /// Replaces the residuals `h Σ_j a_ij f(z_j) − z_i` by the changes of the `z_i`.
    fn correct(&mut self, residuals: &mut [Point<Y>; S]);

    /// `y ← μ (1 − h μ J)⁻¹ y` with the real eigenvalue `μ` of the method, where it has one.
    fn filter(&mut self, y: &mut Point<Y>);
}

/// Fixed-point iteration: the changes are the residuals. It needs no derivatives, and converges where `h ‖∂f/∂y‖` is
/// well below one.
#[derive(Clone, Copy, Debug)]
pub struct FixedPoint;

impl<Y: System, const S: usize> Iteration<Y, S> for FixedPoint {
    const LIMITS: [u32; 2] = [60, 20];
    const DERIVATIVES: bool = false;

    fn new(_: &Y, _: &'static [Mode<S>]) -> Self {
        FixedPoint
    }

    fn linearise(&mut self, _: &mut Field<Y>, _: &mut Y, _: Y::Scalar, _: &mut Point<Y>) {}

    fn factor(&mut self, _: Y::Scalar) -> Result<(), usize> {
        Ok(())
    }

    fn correct(&mut self, _: &mut [Point<Y>; S]) {}

    fn filter(&mut self, _: &mut Point<Y>) {}
}

/// Simplified Newton iteration with the derivatives at the start of a step: `R` real modes and `C` pairs of complex
/// ones, one matrix of the size of the state for each. E. Hairer, G. Wanner, Solving Ordinary Differential Equations
/// II, IV.8.
#[derive(Clone, Debug)]
pub struct Newton<Y: Differentiable, const S: usize, const R: usize, const C: usize> {
    jacobian: Jacobian<Y>,
    real: [Split<Y, S, 1>; R],
    pairs: [Split<Y, S, 2>; C],
    changes: [Point<Y>; S],
}

/// The part of one mode.
#[derive(Clone, Debug)]
struct Split<Y: Differentiable, const S: usize, const C: usize> {
    lu: Lu<Y, C>,
    value: [Y::Scalar; C],
    right: [[Y::Scalar; S]; C],
    left: [[Y::Scalar; S]; C],
    y: [Point<Y>; C],
}

impl<Y, const S: usize, const C: usize> Split<Y, S, C>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    fn new(system: &Y, mode: &Mode<S>) -> Self {
        Split {
            lu: Lu::new(system),
            value: core::array::from_fn(|c| mode.value[c].get()),
            right: core::array::from_fn(|c| mode.right[c].map(|x| x.get())),
            left: core::array::from_fn(|c| mode.left[c].map(|x| x.get())),
            y: core::array::from_fn(|_| Point::zero(system)),
        }
    }

    fn factor(&mut self, h: Y::Scalar, jacobian: &Jacobian<Y>) -> Result<(), usize> {
        self.lu.factor(self.value.map(|value| h * value), jacobian)
    }

    /// Adds this mode's part of the changes.
    fn add(&mut self, residuals: &[Point<Y>; S], changes: &mut [Point<Y>; S]) {
        for (y, left) in self.y.iter_mut().zip(&self.left) {
            y.clear();
            for (residual, left) in residuals.iter().zip(left) {
                y.add(*left, residual);
            }
        }
        self.lu.solve(&mut self.y);
        for (c, (y, right)) in self.y.iter().zip(&self.right).enumerate() {
            for (change, right) in changes.iter_mut().zip(right) {
                change.add(if c == 0 { *right } else { -*right }, y);
            }
        }
    }
}

impl<Y, const S: usize, const R: usize, const C: usize> Iteration<Y, S> for Newton<Y, S, R, C>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    const LIMITS: [u32; 2] = [30, 10];
    const DERIVATIVES: bool = true;

    fn new(system: &Y, modes: &'static [Mode<S>]) -> Self {
        assert!(modes.len() == R + C, "a method has as many modes as its iteration");
        Newton {
            jacobian: system.zero_derivatives(),
            real: core::array::from_fn(|k| Split::new(system, &modes[k])),
            pairs: core::array::from_fn(|k| Split::new(system, &modes[R + k])),
            changes: core::array::from_fn(|_| Point::zero(system)),
        }
    }

    fn linearise(&mut self, field: &mut Field<Y>, system: &mut Y, t: Y::Scalar, rate: &mut Point<Y>) {
        let Some(change) = self.changes.first_mut() else { return };
        change.clear();
        field.linearise(system, t, change, rate, &mut self.jacobian);
    }

    fn factor(&mut self, h: Y::Scalar) -> Result<(), usize> {
        for mode in &mut self.real {
            mode.factor(h, &self.jacobian)?;
        }
        for mode in &mut self.pairs {
            mode.factor(h, &self.jacobian)?;
        }
        Ok(())
    }

    fn correct(&mut self, residuals: &mut [Point<Y>; S]) {
        for change in &mut self.changes {
            change.clear();
        }
        for mode in &mut self.real {
            mode.add(residuals, &mut self.changes);
        }
        for mode in &mut self.pairs {
            mode.add(residuals, &mut self.changes);
        }
        for (residual, change) in residuals.iter_mut().zip(&self.changes) {
            residual.copy_from(change);
        }
    }

    fn filter(&mut self, y: &mut Point<Y>) {
        if let Some(mode) = self.real.first_mut() {
            let [work] = &mut mode.y;
            work.copy_from(y);
            work.scale(mode.value[0]);
            mode.lu.solve(&mut mode.y);
            y.copy_from(&mode.y[0]);
        }
    }
}
