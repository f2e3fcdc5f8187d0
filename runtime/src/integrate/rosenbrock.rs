//! Rosenbrock methods: linearly implicit, one matrix a step, no iteration.

use super::chart::Point;
use super::field::Field;
use super::linear::{Lu, Matrix};
use super::stepper::{norm, Statistics, Stepper};
use super::{tableau, StepError};
use crate::system::{Differentiable, Real};
use crate::Scalar;

/// Rodas5P: order 5, eight stages, L-stable, error estimate, dense output of order 4. A step is one evaluation of the
/// derivatives, one factorisation and seven evaluations of the rates, nine where [`Differentiable::depends_on_time`].
pub type Rodas5P<Y> = Rosenbrock<Y, 8>;

/// Any Rosenbrock method with `S` stages; take [`Rodas5P`].
///
/// With exact derivatives in the chart it has its full order, joints with quaternions included.
#[derive(Clone, Debug)]
pub struct Rosenbrock<Y: Differentiable, const S: usize> {
    field: Field<Y>,
    statistics: Statistics,
    tableau: &'static tableau::Rosenbrock<S>,
    a: [[Y::Scalar; S]; S],
    coupling: [[Y::Scalar; S]; S],
    jacobian: Matrix<Y>,
    lu: Lu<Y, 1>,
    /// Whether the rate at the start and the derivatives are known, and for which step the matrix is factored; zero: none.
    known: bool,
    factored: Y::Scalar,
    first: Point<Y>,
    /// Derivative of the rates with respect to time.
    by_time: Point<Y>,
    u: [Point<Y>; S],
    delta: Point<Y>,
    stage: Point<Y>,
    work: [Point<Y>; 1],
    end: Point<Y>,
    end_known: bool,
    /// Part of a step by which the time is moved to find the derivative.
    shift: Y::Scalar,
}

impl<Y> Rosenbrock<Y, 8>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    /// [`Rodas5P`]: room for one system.
    pub fn new(system: &Y) -> Self {
        Self::with(system, &tableau::RODAS5P, false)
    }

    /// With compensated sums of steps.
    pub fn compensated(system: &Y) -> Self {
        Self::with(system, &tableau::RODAS5P, true)
    }
}

impl<Y, const S: usize> Rosenbrock<Y, S>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    fn with(system: &Y, tableau: &'static tableau::Rosenbrock<S>, compensated: bool) -> Self {
        let point = || Point::zero(system);
        Rosenbrock {
            field: Field::new(system, compensated),
            statistics: Statistics::default(),
            tableau,
            a: tableau.a.map(|row| row.map(|x| x.get())),
            coupling: tableau.coupling.map(|row| row.map(|x| x.get())),
            jacobian: Matrix::zero(system),
            lu: Lu::new(system),
            known: false,
            factored: Y::Scalar::zero(),
            first: point(),
            by_time: point(),
            u: core::array::from_fn(|_| point()),
            delta: point(),
            stage: point(),
            work: [point()],
            end: point(),
            end_known: false,
            shift: Y::Scalar::constant(libm::cbrt(Y::Scalar::epsilon())),
        }
    }

    fn start(&mut self, system: &mut Y, t: Y::Scalar) {
        if !self.known {
            self.stage.clear();
            self.field.linearise(system, t, &self.stage, &mut self.first, &mut self.jacobian);
            self.statistics.jacobians += 1;
            (self.known, self.factored) = (true, Y::Scalar::zero());
        }
    }

    fn factor(&mut self, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        if self.factored == h {
            return Ok(());
        }
        self.factored = Y::Scalar::zero();
        self.statistics.factorisations += 1;
        let gamma: Y::Scalar = self.tableau.gamma.get();
        if let Err(column) = self.lu.factor([gamma * h], &self.jacobian) {
            return Err(match self.first.not_finite() {
                Some(index) => StepError::NotFinite { time: t.to_f64(), index },
                None => StepError::Singular { time: t.to_f64(), step: h.to_f64(), column },
            });
        }
        self.factored = h;
        Ok(())
    }

    /// Central difference; its error is about 1e-10 of the rates' change in a step.
    fn differentiate_by_time(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) {
        let (after, before) = (t + h * self.shift, t - h * self.shift);
        self.stage.clear();
        self.field.rates(system, after, &self.stage, &mut self.by_time);
        self.field.rates(system, before, &self.stage, &mut self.end);
        self.by_time.add(-Y::Scalar::one(), &self.end);
        self.by_time.scale(Y::Scalar::one() / (after - before));
    }
}

impl<Y, const S: usize> Stepper<Y> for Rosenbrock<Y, S>
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

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        (self.known, self.end_known) = (false, false);
        self.field.load(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.start(system, t);
        self.end_known = false;
        self.factor(t, h)?;
        let timed = system.depends_on_time();
        if timed {
            self.differentiate_by_time(system, t, h);
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
                self.field.rates(system, t + c * h, &self.stage, work);
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
        self.delta.copy_from(&self.stage);
        let Some(last) = self.u.last() else { return Ok(0.0) };
        self.delta.add(Y::Scalar::one(), last);
        Ok(scale.map_or(0.0, |scale| norm(last, scale)))
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        (&mut self.field, &mut self.delta)
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        self.start(system, t);
        &self.first
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        if !self.end_known {
            self.field.rates(system, t + h, &self.delta, &mut self.end);
            self.end_known = true;
        }
        &self.end
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, _: Y::Scalar) -> Result<(), StepError> {
        self.field.advance(system, t, &self.delta)?;
        (self.known, self.end_known) = (false, false);
        self.statistics.steps += 1;
        Ok(())
    }

    fn interpolate(&mut self, _: &mut Y, _: Y::Scalar, _: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        // θ (y₁ + (1 − θ) (D₁ + θ (D₂ + θ D₃))), inside out.
        out.clear();
        for row in self.tableau.dense.iter().rev() {
            out.scale(theta);
            for (u, w) in self.u.iter().zip(row) {
                out.add(w.get(), u);
            }
        }
        out.scale(Y::Scalar::one() - theta);
        out.add(Y::Scalar::one(), &self.delta);
        out.scale(theta);
    }

    fn statistics(&self) -> Statistics {
        Statistics { evaluations: self.field.evaluations(), ..self.statistics }
    }
}
