//! All methods by name, for programs that choose one at run time.

use alloc::boxed::Box;

use crate::constrained::{PostStep, WithPostStep};
use crate::integrate::StepDoubling;
use crate::integrate::{Ab4, Ab6, Abm4, Abm6, Abm8, VariableAdams};
use crate::integrate::{BackwardEuler, Gauss12FixedPoint, Gauss4, Gauss6, ImplicitMidpoint, Radau5, Rodas5P};
use crate::integrate::{CashKarp, Dop853, Euler, Midpoint, Rk4, Rkf45, SemiImplicitEuler, Tsit5, Verner9};
use crate::integrate::{EnergyProjection, Limits, Solver, Statistics, Step, StepError, Stepper};
use crate::system::{Differentiable, Energetic, Real, System};

/// What is known of a method before it is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Entry {
    /// Name.
    pub name: &'static str,
    /// Description in one line.
    pub title: &'static str,
    /// Whether it estimates its error, so that it can choose its steps.
    pub adaptive: bool,
    /// Whether it needs derivatives of the rates.
    pub implicit: bool,
}

/// The functions of a [`Solver`] whose method is chosen at run time.
pub trait Drive<Y: System> {
    /// [`Solver::limits`].
    fn limits(&mut self) -> &mut Limits;
    /// [`Solver::run`].
    ///
    /// # Errors
    /// [`StepError`].
    fn run(&mut self, system: &mut Y, t_end: Y::Scalar) -> Result<(), StepError>;
    /// [`Solver::advance`].
    ///
    /// # Errors
    /// [`StepError`].
    fn advance(&mut self, system: &mut Y, t_end: Y::Scalar) -> Result<(), StepError>;
    /// [`Solver::time`].
    fn time(&self) -> Y::Scalar;
    /// [`Solver::last_step`].
    fn last_step(&self) -> (Y::Scalar, Y::Scalar);
    /// [`Solver::state`].
    fn state(&mut self, system: &Y, q: &mut Y::Coordinates, p: &mut Y::Momenta);
    /// [`Solver::dense`].
    fn dense(&mut self, system: &mut Y, theta: Y::Scalar, q: &mut Y::Coordinates, p: &mut Y::Momenta);
    /// [`Solver::statistics`].
    fn statistics(&self) -> Statistics;
    /// [`Solver::project`].
    fn project(&mut self, system: &mut Y, projection: &mut EnergyProjection<Y>)
    where
        Y: Energetic;
}

impl<Y, M> Drive<Y> for Solver<Y, M>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    fn limits(&mut self) -> &mut Limits {
        &mut self.limits
    }
    fn run(&mut self, system: &mut Y, t_end: Y::Scalar) -> Result<(), StepError> {
        Solver::run(self, system, t_end)
    }
    fn advance(&mut self, system: &mut Y, t_end: Y::Scalar) -> Result<(), StepError> {
        Solver::advance(self, system, t_end)
    }
    fn time(&self) -> Y::Scalar {
        Solver::time(self)
    }
    fn last_step(&self) -> (Y::Scalar, Y::Scalar) {
        Solver::last_step(self)
    }
    fn state(&mut self, system: &Y, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        Solver::state(self, system, q, p);
    }
    fn dense(&mut self, system: &mut Y, theta: Y::Scalar, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        Solver::dense(self, system, theta, q, p);
    }
    fn statistics(&self) -> Statistics {
        Solver::statistics(self)
    }
    fn project(&mut self, system: &mut Y, projection: &mut EnergyProjection<Y>)
    where
        Y: Energetic,
    {
        Solver::project(self, system, projection);
    }
}

/// Where a run starts, and how its steps are chosen.
#[derive(Debug)]
pub struct Start<'a, Y: System> {
    /// Coordinates.
    pub q: &'a Y::Coordinates,
    /// Momenta.
    pub p: &'a Y::Momenta,
    /// Fixed step, or tolerances.
    pub step: Step,
    /// Whether sums are compensated, where the method supports it.
    pub compensated: bool,
}

/// The result of asking for a method: `None` if no method has that name.
pub type Made<'a, Y> = Option<Result<Box<dyn Drive<Y> + 'a>, StepError>>;

fn boxed<'a, Y, M>(system: &mut Y, method: M, start: &Start<'_, Y>) -> Made<'a, Y>
where
    Y: System + 'a,
    Y::Scalar: Real,
    M: Stepper<Y> + 'a,
{
    let t = <Y::Scalar as crate::Scalar>::zero();
    let solver = Solver::new(system, method, start.step, t, start.q, start.p);
    Some(solver.map(|s| Box::new(s) as Box<dyn Drive<Y> + 'a>))
}

/// A table of methods, and the function that makes one of them at time zero.
macro_rules! catalogue {
    ($(#[$doc:meta])* $list:ident, $make:ident, $with_post_step:ident, $bound:ident, $implicit:literal, |$system:ident, $compensated:ident|
     { $($name:literal $title:literal $adaptive:literal $method:expr;)* }) => {
        $(#[$doc])*
        pub static $list: &[Entry] = &[
            $(Entry { name: $name, title: $title, adaptive: $adaptive, implicit: $implicit },)*
        ];

        /// Makes a method by name, at time zero. A method without an error estimate accepts [`Step::Fixed`] only.
        pub fn $make<'a, Y>(name: &str, $system: &mut Y, start: &Start<'_, Y>) -> Made<'a, Y>
        where
            Y: $bound + 'a,
            Y::Scalar: Real,
        {
            let $compensated = start.compensated;
            match name {
                $($name => {
                    let method = $method;
                    boxed($system, method, start)
                })*
                _ => None,
            }
        }

        /// The method of that name with a post-step at the end of every step, see [`constrained`](crate::constrained).
        pub fn $with_post_step<'a, Y, B>(name: &str, $system: &mut Y, start: &Start<'_, Y>, post_step: B) -> Made<'a, Y>
        where
            Y: $bound + 'a,
            Y::Scalar: Real,
            B: PostStep<Y> + 'a,
        {
            let $compensated = start.compensated;
            match name {
                $($name => {
                    let method = $method;
                    let method = WithPostStep::new($system, method, post_step);
                    boxed($system, method, start)
                })*
                _ => None,
            }
        }
    };
}

/// A method with or without compensated sums.
macro_rules! sums {
    ($type:ident, $system:ident, $compensated:ident) => {
        if $compensated {
            $type::compensated($system)
        } else {
            $type::new($system)
        }
    };
}

catalogue! {
    /// Methods that need the rates only.
    EXPLICIT, explicit, explicit_with_post_step, System, false, |system, c| {
        "euler" "Euler" false sums!(Euler, system, c);
        "semi-implicit-euler" "semi-implicit Euler" false sums!(SemiImplicitEuler, system, c);
        "midpoint" "explicit midpoint, order 2" false sums!(Midpoint, system, c);
        "rk4" "classical Runge-Kutta, order 4" false sums!(Rk4, system, c);
        "rk4-doubling" "classical Runge-Kutta, step doubling" true StepDoubling::extrapolated(system, sums!(Rk4, system, c));
        "rkf45" "Runge-Kutta-Fehlberg 5(4)" true sums!(Rkf45, system, c);
        "cash-karp" "Cash-Karp 5(4)" true sums!(CashKarp, system, c);
        "tsit5" "Tsitouras 5(4)" true sums!(Tsit5, system, c);
        "dop853" "Dormand-Prince 8(5,3)" true sums!(Dop853, system, c);
        "verner9" "Verner 9(8)" true sums!(Verner9, system, c);
        "ab4" "Adams-Bashforth, order 4, one evaluation a step" false sums!(Ab4, system, c);
        "ab6" "Adams-Bashforth, order 6, one evaluation a step" false sums!(Ab6, system, c);
        "abm4" "Adams-Bashforth-Moulton, order 4" false sums!(Abm4, system, c);
        "abm6" "Adams-Bashforth-Moulton, order 6" false sums!(Abm6, system, c);
        "abm8" "Adams-Bashforth-Moulton, order 8" false sums!(Abm8, system, c);
        "adams" "Adams-Bashforth-Moulton, variable steps and orders" true sums!(VariableAdams, system, c);
        "gauss12" "Gauss-Legendre, order 12, by fixed-point iteration" false sums!(Gauss12FixedPoint, system, c);
    }
}

catalogue! {
    /// Methods that need derivatives of the rates.
    IMPLICIT, implicit, implicit_with_post_step, Differentiable, true, |system, c| {
        "backward-euler" "backward Euler" false sums!(BackwardEuler, system, c);
        "implicit-midpoint" "implicit midpoint, order 2" false sums!(ImplicitMidpoint, system, c);
        "gauss4" "Gauss-Legendre, order 4" false sums!(Gauss4, system, c);
        "gauss6" "Gauss-Legendre, order 6" false sums!(Gauss6, system, c);
        "radau5" "Radau IIA, order 5" true sums!(Radau5, system, c);
        "rodas5p" "Rosenbrock Rodas5P, order 5" true sums!(Rodas5P, system, c);
    }
}

/// Makes any method by name, at time zero.
pub fn any<'a, Y>(name: &str, system: &mut Y, start: &Start<'_, Y>) -> Made<'a, Y>
where
    Y: Differentiable + 'a,
    Y::Scalar: Real,
{
    implicit(name, system, start).or_else(|| explicit(name, system, start))
}

/// All methods.
pub fn entries() -> impl Iterator<Item = &'static Entry> {
    EXPLICIT.iter().chain(IMPLICIT)
}

/// The entry of a method by its name.
pub fn entry(name: &str) -> Option<&'static Entry> {
    entries().find(|e| e.name == name)
}
