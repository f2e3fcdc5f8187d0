//! Collocation methods: Gauss-Legendre and Radau IIA.
//!
//! The unknowns are displacements `z_i` of the stages, `z_i = h Σ_j a_ij f(t + c_j h, z_j)`. They are solved for as E.
//! Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.8 describe: simplified Newton iteration,
//! or fixed-point iteration ([`Iteration`]), from the last step's polynomial, which is rewritten about the new state;
//! or, without a last step, from the solution of the linearised equations. The iteration ends when its rate of
//! contraction says that what is left is below a hundredth of the allowed error, or, in fixed steps, below round-off.
//!
//! Newton iteration pays where an evaluation is dear, as with the interpreter, or the mechanism stiff; fixed-point
//! iteration is faster for generated code of mechanisms that are not.
//!
//! Gauss methods are symmetric: their rotations are displaced in the chart about the middle of the step
//! ([`super::middle`]), so that a step back returns and the energy of reversible motion does not drift. Where
//! displacements are plain sums they are symplectic as well.

use super::chart::{Chart, Point};
use super::integrator::{Attempt, FromSystem, Scheme};
use super::middle::{turns, Middle};
use super::newton::Iteration;
use super::stepper::{hermite, norm};
use super::tableau::{self, Mode};
use super::StepError;
use crate::constant::Constant;
use crate::system::{Real, System};
use crate::Scalar;

/// As [`Stepper::share`](super::Stepper::share), of methods that estimate their error.
const SHARE: f64 = 1.0 / 16.0;
/// Fraction of the allowed error that may remain after the iteration.
const PART: f64 = 0.01;
/// Round-off, in epsilons of the state, down to which a fixed step is iterated, and at which a single change that is
/// not smaller than the one before ends it.
const FLOOR: f64 = 0.25;
const STUCK: f64 = 16.0;
/// Derivatives are used for another step if the iteration contracted as well as this with them: the default of Hairer's
/// program RADAU5.
const KEEP: f64 = 1e-3;
/// Fewest iterations in a step under error control with derivatives of an earlier step. The first change is mostly the
/// error of the extrapolated stages, so that its ratio to the second says little about the ones that follow; and what
/// old derivatives leave can have the same sign in all steps.
const FEWEST: u32 = 3;

/// The state at which the derivatives in use were evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Derivatives {
    None,
    /// The start of an earlier step.
    Old,
    /// The start of this step.
    New,
}

/// A method with `S` stages, by name.
pub trait Formula<const S: usize> {
    /// Its coefficients.
    const TABLEAU: &'static tableau::Collocation<S>;
    /// Its modes, real ones first; [`Newton`](super::Newton)'s iteration needs them.
    const MODES: &'static [Mode<S>] = &[];
    /// Weights `e` of the error estimate `μ (1 − h μ J)⁻¹ (h f(y) + Σ e_i z_i)`, of third order.
    const ERROR: Option<[Constant; S]> = None;
}

/// Any collocation method; take one by its name, [`Radau5`](super::Radau5) for example.
#[derive(Clone, Debug)]
pub struct Collocation<Y: System, T, I, const S: usize> {
    iteration: I,
    a: [[Y::Scalar; S]; S],
    b: [Y::Scalar; S],
    c: [Y::Scalar; S],
    /// Weights of the new point over the stages' displacements.
    last: [Y::Scalar; S],
    /// Displacements of stages, their rates, residuals and changes.
    z: [Point<Y>; S],
    f: [Point<Y>; S],
    r: [Point<Y>; S],
    first: Point<Y>,
    /// Changes below which the equations count as solved.
    weight: Point<Y>,
    derivatives: Derivatives,
    /// Step that the matrix is factored for; zero: none.
    factored: Y::Scalar,
    /// Whether the last iteration contracted well enough to use its derivatives again, and what it leaves of its last
    /// change.
    keep: bool,
    eta: f64,
    /// Stages and start of the last step, from the present state; the size of that step, zero if there is none.
    past: [Point<Y>; S],
    origin: Point<Y>,
    past_h: Y::Scalar,
    /// For symmetric methods of systems with rotations: the chart in which the equations of the stages hold.
    middle: Option<Middle<Y>>,
    formula: core::marker::PhantomData<T>,
}

impl<Y, T, I, const S: usize> FromSystem<Y> for Collocation<Y, T, I, S>
where
    Y: System,
    Y::Scalar: Real,
    T: Formula<S>,
    I: Iteration<Y, S>,
{
    // Large: a call writes it in its place, where inlined code would copy it there.
    #[inline(never)]
    fn new(system: &Y) -> Self {
        let tableau = T::TABLEAU;
        let point = || Point::zero(system);
        let points = || core::array::from_fn(|_| point());
        let c = tableau.c.map(|x| x.get());
        // A collocation method is symmetric if its nodes lie so.
        let symmetric = (0..S).all(|i| (tableau.c[i].hi() + tableau.c[S - 1 - i].hi() - 1.0).abs() < 1e-15);
        Collocation {
            iteration: I::new(system, T::MODES),
            a: tableau.a.map(|row| row.map(|x| x.get())),
            b: tableau.b.map(|x| x.get()),
            last: polynomial(&c, Y::Scalar::one()).0,
            c,
            z: points(),
            f: points(),
            r: points(),
            first: point(),
            weight: point(),
            derivatives: Derivatives::None,
            factored: Y::Scalar::zero(),
            keep: false,
            eta: 1.0,
            past: points(),
            origin: point(),
            past_h: Y::Scalar::zero(),
            middle: (symmetric && turns(system)).then(|| Middle::new(system)),
            formula: core::marker::PhantomData,
        }
    }
}

impl<Y, T, I, const S: usize> Collocation<Y, T, I, S>
where
    Y: System,
    Y::Scalar: Real,
    T: Formula<S>,
    I: Iteration<Y, S>,
{
    /// Derivatives, and the rate at the start with them, if they are due.
    fn linearise(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar) {
        let due = match self.derivatives {
            Derivatives::None => true,
            Derivatives::Old => !self.keep,
            Derivatives::New => false,
        };
        if I::DERIVATIVES && due {
            self.iteration.linearise(&mut step.field, system, t, &mut self.first);
            (self.derivatives, self.factored) = (Derivatives::New, Y::Scalar::zero());
            step.statistics.jacobians += 1;
            step.start_known = true;
        }
    }

    #[inline]
    fn factor(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        if I::DERIVATIVES && self.factored != h {
            self.factored = Y::Scalar::zero();
            step.statistics.factorisations += 1;
            if let Err(column) = self.iteration.factor(h) {
                step.start_rate(system, t, &mut self.first);
                return Err(Attempt::singular(&self.first, t, h, column));
            }
            self.factored = h;
        }
        Ok(())
    }

    /// Stages of the linearised equations, after [`Collocation::linearise`].
    fn linear(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar) {
        step.start_rate(system, t, &mut self.first);
        for (z, c) in self.z.iter_mut().zip(&self.c) {
            z.copy_from(&self.first);
            z.scale(h * *c);
        }
        self.iteration.correct(&mut self.z);
        if let Some(middle) = &mut self.middle {
            middle.begin(system, &self.last, &self.z);
        }
    }

    /// Stages on the last step's polynomial.
    fn extrapolate(&mut self, system: &Y, h: Y::Scalar) {
        for (z, c) in self.z.iter_mut().zip(&self.c) {
            let (weights, origin) = polynomial(&self.c, Y::Scalar::one() + *c * (h / self.past_h));
            z.clear();
            for (past, w) in self.past.iter().zip(&weights) {
                z.add(*w, past);
            }
            z.add(origin, &self.origin);
        }
        if let Some(middle) = &mut self.middle {
            middle.begin(system, &self.last, &self.z);
        }
    }

    /// One iteration: rates of all stages, residuals, changes.
    fn iterate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar) {
        for ((z, f), c) in self.z.iter_mut().zip(&mut self.f).zip(&self.c) {
            step.field.rates(system, t + *c * h, z, f);
            if let Some(middle) = &mut self.middle {
                middle.enter(system, &mut z.x, &mut f.x);
            }
        }
        for ((r, row), z) in self.r.iter_mut().zip(&self.a).zip(&self.z) {
            r.clear();
            for (f, a) in self.f.iter().zip(row) {
                r.add(*a, f);
            }
            r.scale(h);
            r.add(-Y::Scalar::one(), z);
        }
        self.iteration.correct(&mut self.r);
        for (z, r) in self.z.iter_mut().zip(&self.r) {
            z.add(Y::Scalar::one(), r);
        }
        if let Some(middle) = &mut self.middle {
            if I::DERIVATIVES {
                middle.end(Y::Scalar::one(), &self.last, &self.z);
            } else {
                middle.end(h, &self.b, &self.f);
            }
            middle.leave(system, &mut self.z);
        }
        step.statistics.iterations += 1;
    }

    /// What counts as solved: part of the allowed errors, but not less than round-off.
    fn weigh(&mut self, step: &Attempt<Y>, system: &Y, scale: Option<&Point<Y>>) {
        step.field.chart().size(system, &mut self.weight);
        if let Some(z) = self.z.last() {
            for (w, z) in self.weight.parts_mut().into_iter().flatten().zip(z.parts().into_iter().flatten()) {
                *w = *w + z.abs();
            }
        }
        for part in self.weight.parts_mut() {
            let largest = part.iter().fold(Y::Scalar::zero(), |m, x| if *x > m { *x } else { m });
            // At rest in the origin, nothing tells the size but the unit.
            let largest = if largest > Y::Scalar::zero() { largest } else { Y::Scalar::one() };
            let least = Y::Scalar::constant(1e-3) * largest;
            for x in part {
                *x = if *x > least { *x } else { least };
            }
        }
        for group in system.lie_joints() {
            let x = self.weight.x.as_mut();
            x[group.rotations()].fill(Y::Scalar::one());
        }
        let (floor, part) = match scale {
            None => (FLOOR * Y::Scalar::epsilon(), None),
            Some(scale) => (STUCK * Y::Scalar::epsilon(), Some(scale)),
        };
        self.weight.scale(Y::Scalar::constant(floor));
        if let Some(scale) = part {
            let part = Y::Scalar::constant(PART);
            for (w, scale) in self.weight.parts_mut().into_iter().flatten().zip(scale.parts().into_iter().flatten()) {
                let allowed = part * *scale;
                // A component without error control need not be solved accurately either.
                *w = if allowed > *w || allowed == Y::Scalar::zero() { allowed } else { *w };
            }
        }
    }

    /// Iterates until the equations are solved.
    fn converge(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<(), StepError> {
        self.weigh(step, system, scale);
        // One good contraction says little about the next step's, and with fixed-point iteration about the next
        // iteration's.
        let least = if I::DERIVATIVES { 1e-2 } else { 0.1 };
        self.eta = libm::pow(self.eta, 0.8).max(least);
        let (mut last, mut grown, mut change) = (f64::INFINITY, 0, f64::NAN);
        let mut mean = 0.0;
        self.keep = true;
        let limit = I::LIMITS[usize::from(scale.is_some())];
        let old = I::DERIVATIVES && self.derivatives == Derivatives::Old && scale.is_some();
        let fewest = if old { FEWEST } else { 1 };
        for k in 1..=limit {
            self.iterate(step, system, t, h);
            let sum = self.r.iter().map(|r| norm(r, &self.weight)).fold(0.0, |sum, x| sum + x * x);
            change = libm::sqrt(sum / S as f64);
            if k > 1 {
                let theta = change / last;
                // Two at a time: what fixed-point iteration changes in coordinates it changes in momenta one iteration
                // later.
                mean = if k == 2 { theta } else { libm::sqrt(theta * mean) };
                self.keep = mean <= KEEP;
                let slowest = theta.max(mean);
                if slowest < 1.0 {
                    self.eta = (slowest / (1.0 - slowest)).max(if I::DERIVATIVES { 0.0 } else { least });
                }
                grown = if theta < 1.0 { 0 } else { grown + 1 };
            }
            if (k >= fewest && self.eta * change <= 1.0) || change == 0.0 {
                return Ok(());
            }
            // No further: at round-off that is the solution, and how large it is only the iteration itself can tell. On
            // an ill-conditioned mechanism it is far above that of the numbers.
            let noise = libm::pow(Y::Scalar::epsilon(), 0.3);
            if scale.is_none() && grown > 0 && noise * FLOOR * change <= 1.0 {
                return Ok(());
            }
            if !change.is_finite() || grown > 2 {
                return Err(self.failure(t, h, k, change));
            }
            last = change;
        }
        // Slow, but within round-off already.
        if scale.is_none() && change <= STUCK / FLOOR {
            return Ok(());
        }
        Err(self.failure(t, h, limit, change))
    }

    fn failure(&mut self, t: Y::Scalar, h: Y::Scalar, iterations: u32, change: f64) -> StepError {
        (self.eta, self.keep) = (1.0, false);
        StepError::NoConvergence { time: t.to_f64(), step: h.to_f64(), iterations, change }
    }

    /// Solves for the stages.
    fn solve(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<(), StepError> {
        self.linearise(step, system, t);
        self.factor(step, system, t, h)?;
        if self.past_h != Y::Scalar::zero() {
            self.extrapolate(system, h);
            let result = self.converge(step, system, t, h, scale);
            if result.is_ok() {
                return result;
            }
            // Once more from nothing: a long step away from the last one's polynomial, or derivatives that are too old.
            if self.derivatives == Derivatives::Old {
                self.derivatives = Derivatives::None;
            }
            self.linearise(step, system, t);
            self.factor(step, system, t, h)?;
        }
        self.linear(step, system, t, h);
        self.converge(step, system, t, h, scale)
    }

    /// Stages of the linearised equations, then `n` iterations.
    #[inline]
    pub(super) fn solve_by(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        n: u32,
    ) -> Result<(), StepError> {
        if self.derivatives == Derivatives::Old {
            self.derivatives = Derivatives::None;
        }
        self.linearise(step, system, t);
        self.factor(step, system, t, h)?;
        self.linear(step, system, t, h);
        for _ in 0..n {
            self.iterate(step, system, t, h);
        }
        Ok(())
    }

    /// Displacement and error of a step whose stages are known.
    #[inline]
    pub(super) fn conclude(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> f64 {
        let error = match (T::ERROR, scale) {
            (Some(e), Some(scale)) => {
                self.start_rate(step, system, t);
                self.error(step, system, t, h, scale, e)
            }
            _ => 0.0,
        };
        self.displace(step, system, h);
        error
    }

    /// Displacement of the step from those of the stages.
    fn displace(&mut self, step: &mut Attempt<Y>, system: &Y, h: Y::Scalar) {
        if I::DERIVATIVES {
            end(&self.z, &self.last, &mut step.delta);
        } else {
            end(&self.f, &self.b, &mut step.delta);
            step.delta.scale(h);
        }
        if let Some(middle) = &mut self.middle {
            middle.give_end(system, &mut step.delta.x);
        }
    }

    fn error(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: &Point<Y>,
        e: [Constant; S],
    ) -> f64 {
        let [sum, estimate, ..] = &mut self.r[..] else { return 0.0 };
        sum.clear();
        for (z, e) in self.z.iter().zip(e) {
            sum.add(e.get(), z);
        }
        estimate.copy_from(sum);
        estimate.add(h, &self.first);
        self.iteration.filter(estimate);
        let error = norm(estimate, scale);
        // The estimate is too large where the step is much longer than the fast motions; filtered once more it is not.
        if error > 1.0 {
            step.field.rates(system, t, estimate, &mut step.end);
            estimate.copy_from(sum);
            estimate.add(h, &step.end);
            self.iteration.filter(estimate);
            return norm(estimate, scale);
        }
        error
    }
}

/// `out = Σ wᵢ pᵢ` over the stages.
fn end<Y: System, const S: usize>(points: &[Point<Y>; S], weights: &[Y::Scalar; S], out: &mut Point<Y>)
where
    Y::Scalar: Real,
{
    out.clear();
    for (point, w) in points.iter().zip(weights) {
        if *w != Y::Scalar::zero() {
            out.add(*w, point);
        }
    }
}

/// Weights at `θ` of the values at the nodes `c`, and of that at 0, in the polynomial through all of them.
fn polynomial<N: Real, const S: usize>(c: &[N; S], theta: N) -> ([N; S], N) {
    let mut weights = [N::one(); S];
    let mut origin = N::one();
    for (j, (weight, cj)) in weights.iter_mut().zip(c).enumerate() {
        *weight = theta / *cj;
        for (k, ck) in c.iter().enumerate() {
            if k != j {
                *weight = *weight * ((theta - *ck) / (*cj - *ck));
            }
        }
        origin = origin * ((*cj - theta) / *cj);
    }
    (weights, origin)
}

impl<Y, T, I, const S: usize> Scheme<Y> for Collocation<Y, T, I, S>
where
    Y: System,
    Y::Scalar: Real,
    T: Formula<S>,
    I: Iteration<Y, S>,
{
    fn order(&self) -> u32 {
        T::TABLEAU.order
    }

    fn error_order(&self) -> Option<u32> {
        T::ERROR.map(|_| 3)
    }

    fn share(&self) -> f64 {
        if T::ERROR.is_some() {
            SHARE
        } else {
            1.0
        }
    }

    fn begin(&mut self) {
        (self.derivatives, self.factored) = (Derivatives::None, Y::Scalar::zero());
        self.past_h = Y::Scalar::zero();
        (self.keep, self.eta) = (false, 1.0);
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.solve(step, system, t, h, scale)?;
        Ok(self.conclude(step, system, t, h, scale))
    }

    fn start(&mut self) -> &mut Point<Y> {
        &mut self.first
    }

    fn start_rate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar) {
        self.linearise(step, system, t);
        step.start_rate(system, t, &mut self.first);
    }

    fn accepted(&mut self, step: &mut Attempt<Y>, system: &Y, h: Y::Scalar) -> bool {
        for (past, z) in self.past.iter_mut().zip(&self.z) {
            past.copy_from(z);
            Chart::relative(system, &step.delta, past);
        }
        self.origin.clear();
        Chart::relative(system, &step.delta, &mut self.origin);
        self.past_h = h;
        if self.derivatives == Derivatives::New {
            self.derivatives = Derivatives::Old;
        }
        step.hand_on(system, &mut self.first)
    }

    /// The collocation polynomial; of methods with less than three stages the cubic through both ends and their rates.
    fn interpolate(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        theta: Y::Scalar,
        out: &mut Point<Y>,
    ) {
        out.clear();
        if S < 3 {
            // Not with the derivatives: those of the next step may be old ones.
            if !step.start_known {
                step.field.rates(system, t, out, &mut self.first);
                step.start_known = true;
            }
            step.end_rate(system, t, h);
            return hermite(h, theta, &step.delta, [&self.first, &step.end], out);
        }
        for (z, w) in self.z.iter().zip(polynomial(&self.c, theta).0) {
            match &mut self.middle {
                None => out.add(w, z),
                Some(middle) => out.add(w, middle.seen_from(system, z)),
            }
        }
        if let Some(middle) = &self.middle {
            middle.to_start(system, &mut out.x);
        }
    }
}
