//! Rosenbrock methods: linearly implicit, with one matrix per step and no iteration.

use super::chart::Point;
use super::integrator::{Attempt, FromSystem, Integrator, Scheme};
use super::linear::{Jacobian, Lu};
use super::stepper::norm;
use super::{tableau, StepError};
use crate::system::{Differentiable, Real};
use crate::Scalar;

/// Rodas5P: order 5, eight stages, L-stable, error estimate, dense output of order 4. A step is one evaluation of the
/// derivatives, one factorisation and seven evaluations of the rates, nine where [`Differentiable::depends_on_time`].
pub type Rodas5P<Y> = Integrator<Y, Rosenbrock<Y, 8>>;

/// Any Rosenbrock method with `S` stages; take [`Rodas5P`].
///
/// With exact derivatives in the chart it has its full order, joints with quaternions included.
#[derive(Clone, Debug)]
pub struct Rosenbrock<Y: Differentiable, const S: usize> {
    tableau: &'static tableau::Rosenbrock<S>,
    a: [[Y::Scalar; S]; S],
    coupling: [[Y::Scalar; S]; S],
    jacobian: Jacobian<Y>,
    lu: Lu<Y, 1>,
    /// Step that the matrix is factored for; zero: none.
    factored: Y::Scalar,
    first: Point<Y>,
    /// Derivative of the rates with respect to time.
    by_time: Point<Y>,
    u: [Point<Y>; S],
    stage: Point<Y>,
    work: [Point<Y>; 1],
    /// Part of a step by which the time is moved to find the derivative.
    shift: Y::Scalar,
}

impl<Y> FromSystem<Y> for Rosenbrock<Y, 8>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    fn new(system: &Y) -> Self {
        Self::with(system, &tableau::RODAS5P)
    }
}

impl<Y, const S: usize> Rosenbrock<Y, S>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    fn with(system: &Y, tableau: &'static tableau::Rosenbrock<S>) -> Self {
        let point = || Point::zero(system);
        Rosenbrock {
            tableau,
            a: tableau.a.map(|row| row.map(|x| x.get())),
            coupling: tableau.coupling.map(|row| row.map(|x| x.get())),
            jacobian: system.zero_derivatives(),
            lu: Lu::new(system),
            factored: Y::Scalar::zero(),
            first: point(),
            by_time: point(),
            u: core::array::from_fn(|_| point()),
            stage: point(),
            work: [point()],
            shift: Y::Scalar::constant(libm::cbrt(Y::Scalar::epsilon())),
        }
    }

    fn factor(&mut self, step: &mut Attempt<Y>, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        if self.factored != h {
            self.factored = Y::Scalar::zero();
            step.statistics.factorisations += 1;
            let gamma: Y::Scalar = self.tableau.gamma.get();
            let factors = self.lu.factor([gamma * h], &self.jacobian);
            factors.map_err(|column| Attempt::singular(&self.first, t, h, column))?;
            self.factored = h;
        }
        Ok(())
    }

    /// Central difference; its error is about 1e-10 of the rates' change in a step.
    fn differentiate_by_time(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar) {
        // Where the step is short against the time, both times have to differ from it all the same.
        let (shift, least) = (h * self.shift, Y::Scalar::constant(64.0 * Y::Scalar::epsilon()) * t.abs());
        let shift = if shift.abs() < least { least } else { shift };
        let (after, before) = (t + shift, t - shift);
        self.stage.clear();
        step.field.rates(system, after, &self.stage, &mut self.by_time);
        step.field.rates(system, before, &self.stage, &mut step.end);
        self.by_time.add(-Y::Scalar::one(), &step.end);
        self.by_time.scale(Y::Scalar::one() / (after - before));
    }
}

impl<Y, const S: usize> Scheme<Y> for Rosenbrock<Y, S>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    fn order(&self) -> u32 {
        self.tableau.order
    }

    fn error_order(&self) -> Option<u32> {
        Some(self.tableau.error_order)
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.start_rate(step, system, t);
        self.factor(step, t, h)?;
        let timed = system.depends_on_time();
        if timed {
            self.differentiate_by_time(step, system, t, h);
        }
        let gamma: Y::Scalar = self.tableau.gamma.get();
        for i in 0..S {
            let (known, rest) = self.u.split_at_mut(i);
            let [work] = &mut self.work;
            self.stage.clear();
            if i == 0 {
                work.copy_from(&self.first);
            } else {
                for (u, a) in known.iter().zip(&self.a[i]) {
                    self.stage.add(*a, u);
                }
                let c: Y::Scalar = self.tableau.c[i].get();
                step.field.rates(system, t + c * h, &self.stage, work);
            }
            if timed {
                let d: Y::Scalar = self.tableau.d[i].get();
                work.add(h * d, &self.by_time);
            }
            work.scale(h);
            for (u, c) in known.iter().zip(&self.coupling[i]) {
                work.add(*c, u);
            }
            work.scale(gamma);
            self.lu.solve(&mut self.work);
            if let Some(u) = rest.first_mut() {
                u.copy_from(&self.work[0]);
            }
        }
        // The last stage's point is the embedded result, and its `u` leads from there to the new point.
        step.delta.copy_from(&self.stage);
        let Some(last) = self.u.last() else { return Ok(0.0) };
        step.delta.add(Y::Scalar::one(), last);
        Ok(scale.map_or(0.0, |scale| norm(last, scale)))
    }

    fn start(&mut self) -> &mut Point<Y> {
        &mut self.first
    }

    /// With the derivatives, of which every step needs new ones.
    fn start_rate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar) {
        if !step.start_known {
            self.stage.clear();
            step.field.linearise(system, t, &self.stage, &mut self.first, &mut self.jacobian);
            step.statistics.jacobians += 1;
            (step.start_known, self.factored) = (true, Y::Scalar::zero());
        }
    }

    fn interpolate(
        &mut self,
        step: &mut Attempt<Y>,
        _: &mut Y,
        _: Y::Scalar,
        _: Y::Scalar,
        theta: Y::Scalar,
        out: &mut Point<Y>,
    ) {
        // θ (y₁ + (1 − θ) (D₁ + θ (D₂ + θ D₃))), evaluated from the innermost bracket.
        out.clear();
        for row in self.tableau.dense.iter().rev() {
            out.scale(theta);
            for (u, w) in self.u.iter().zip(row) {
                out.add(w.get(), u);
            }
        }
        out.scale(Y::Scalar::one() - theta);
        out.add(Y::Scalar::one(), &step.delta);
        out.scale(theta);
    }
}
