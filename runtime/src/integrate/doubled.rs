//! An explicit symmetric method by phase-space doubling: an experiment.

use super::chart::{Chart, Point};
use super::field::Field;
use super::stepper::{hermite, Statistics, Stepper};
use super::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// Tao's explicit method for Hamiltonians that are not separable, order 2, three evaluations a step: an experiment, kept to
/// be measured against the others, not recommended.
///
/// Of the state `(q, p)` there are two copies, `(x₁, p₁)` and `(x₂, p₂)`. Under `H(x₁, p₂) + H(x₂, p₁)` either term moves only
/// what the other one reads, so both are solved exactly, and a third term `ω/2 (|x₁ − x₂|² + |p₁ − p₂|²)` binds the copies:
/// `A(h/2) B(h/2) C(h) B(h/2) A(h/2)`. M. Tao, *Explicit symplectic approximation of nonseparable Hamiltonians: Algorithm and
/// long time performance*, Physical Review E 94, 043303, 2016 (arXiv:1609.02212), eq. 1 to 5.
///
/// It is symplectic in the doubled phase space where displacements are canonical coordinates, that is without quaternions and
/// planar joints; on those it is a method of order 2 all the same. The state shown is the mean of the copies. They
/// are equal when a state is taken, and go on apart as long as steps go on from the states given: so two runs are
/// the same only if both started at the same state. Damping and other forces that depend on time or velocity are allowed.
#[derive(Clone, Debug)]
pub struct Doubled<Y: System> {
    omega: Y::Scalar,
    field: Field<Y>,
    steps: u64,
    /// The copies at the start, as displacements from the chart's state.
    copies: [Point<Y>; 2],
    /// At the end of the last attempt.
    moved: [Point<Y>; 2],
    /// Where a term is evaluated, and the rate there.
    at: Point<Y>,
    rate: Point<Y>,
    /// The rate is that of the first term at the start.
    rate_known: bool,
    start: Point<Y>,
    start_known: bool,
    end: Point<Y>,
    end_known: bool,
    delta: Point<Y>,
}

impl<Y> Doubled<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// With the binding `omega`, 1/s if coordinates and momenta are counted in units in which both are of like size. Zero
    /// leaves the copies free, which then part; the larger it is, the smaller are the steps that are needed. Tao takes 1 to
    /// 100 times the motion's own frequencies.
    pub fn new(system: &Y, omega: f64) -> Self {
        Self::with(system, omega, false)
    }

    /// With compensated sums, see [`Explicit::compensated`](super::Explicit::compensated).
    pub fn compensated(system: &Y, omega: f64) -> Self {
        Self::with(system, omega, true)
    }

    fn with(system: &Y, omega: f64, compensated: bool) -> Self {
        let point = || Point::zero(system);
        Doubled {
            omega: Y::Scalar::constant(omega),
            field: Field::new(system, compensated),
            steps: 0,
            copies: [point(), point()],
            moved: [point(), point()],
            at: point(),
            rate: point(),
            rate_known: false,
            start: point(),
            start_known: false,
            end: point(),
            end_known: false,
            delta: point(),
        }
    }

    /// Half of what the copies differ by: a measure of how far the method is from the motion.
    pub fn gap(&self, out: &mut Point<Y>) {
        out.copy_from(&self.copies[0]);
        out.add(-Y::Scalar::one(), &self.copies[1]);
        out.scale(Y::Scalar::constant(0.5));
    }

    /// Rate of the term that reads the coordinates of copy `k` and the momenta of the other.
    fn term(&mut self, system: &mut Y, t: Y::Scalar, k: usize) {
        self.at.x.as_mut().copy_from_slice(self.moved[k].x.as_ref());
        self.at.p.as_mut().copy_from_slice(self.moved[1 - k].p.as_ref());
        self.field.rates(system, t, &self.at, &mut self.rate);
    }

    /// It moves the other coordinates and these momenta, for `h` s.
    fn flow(&mut self, h: Y::Scalar, k: usize) {
        let [x, p] = self.rate.parts();
        add(self.moved[1 - k].x.as_mut(), h, x);
        add(self.moved[k].p.as_mut(), h, p);
    }

    /// The copies turn about their mean, for `h` s.
    fn bind(&mut self, h: Y::Scalar) {
        let c = Y::Scalar::constant;
        let (sin, cos) = (c(2.0) * self.omega * h).sin_cos();
        let [a, b] = &mut self.moved;
        for (((x, y), p), r) in a.x.as_mut().iter_mut().zip(b.x.as_mut()).zip(a.p.as_mut()).zip(b.p.as_mut().iter_mut())
        {
            let half = c(0.5);
            let (mean, gap) = ((half * (*x + *y), half * (*p + *r)), (half * (*x - *y), half * (*p - *r)));
            let turned = (cos * gap.0 + sin * gap.1, cos * gap.1 - sin * gap.0);
            (*x, *y) = (mean.0 + turned.0, mean.0 - turned.0);
            (*p, *r) = (mean.1 + turned.1, mean.1 - turned.1);
        }
    }
}

/// `to += w x`.
fn add<S: Scalar>(to: &mut [S], w: S, x: &[S]) {
    for (to, x) in to.iter_mut().zip(x) {
        *to = *to + w * *x;
    }
}

/// The mean of two displacements.
fn mean<Y: System>(copies: &[Point<Y>; 2], out: &mut Point<Y>) {
    out.copy_from(&copies[0]);
    out.add(Y::Scalar::one(), &copies[1]);
    out.scale(Y::Scalar::constant(0.5));
}

impl<Y> Stepper<Y> for Doubled<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    fn order(&self) -> u32 {
        2
    }

    fn error_order(&self) -> Option<u32> {
        None
    }

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        (self.start_known, self.end_known) = (false, false);
        if self.field.holds(q, p) {
            return Ok(());
        }
        self.rate_known = false;
        self.copies.iter_mut().for_each(Point::clear);
        self.field.load(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        _scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        let half = Y::Scalar::constant(0.5) * h;
        for (moved, copy) in self.moved.iter_mut().zip(&self.copies) {
            moved.copy_from(copy);
        }
        if !self.rate_known {
            self.term(system, t, 0);
        }
        (self.rate_known, self.end_known) = (false, false);
        self.flow(half, 0);
        self.term(system, t + half, 1);
        self.flow(half, 1);
        self.bind(h);
        self.term(system, t + half, 1);
        self.flow(half, 1);
        self.term(system, t + h, 0);
        self.flow(half, 0);
        mean(&self.moved, &mut self.delta);
        Ok(0.0)
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        (&mut self.field, &mut self.delta)
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        if !self.start_known {
            self.end.clear();
            self.field.rates(system, t, &self.end, &mut self.start);
            (self.start_known, self.end_known) = (true, false);
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
        mean(&self.moved, &mut self.end);
        let corrected = self.end.parts() != self.delta.parts();
        self.field.advance(system, t, &self.delta)?;
        for (copy, moved) in self.copies.iter_mut().zip(&self.moved) {
            copy.copy_from(moved);
            Chart::relative(system, &self.delta, copy);
        }
        if corrected {
            self.copies.iter_mut().for_each(Point::clear);
        } else {
            // The last term is the next step's first.
            Chart::follow(system, &self.delta, &mut self.at, &mut self.rate);
        }
        (self.rate_known, self.start_known, self.end_known) = (!corrected, false, false);
        self.steps += 1;
        Ok(())
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.start_rate(system, t);
        self.end_rate(system, t, h);
        hermite(h, theta, &self.delta, [&self.start, &self.end], out);
    }

    fn statistics(&self) -> Statistics {
        Statistics { evaluations: self.field.evaluations(), steps: self.steps, ..Statistics::default() }
    }

    fn step(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), StepError> {
        self.begin(system, t, q, p)?;
        self.attempt(system, t, h, None)?;
        self.accept(system, t, h)?;
        self.field.store(system, q, p);
        Ok(())
    }
}
