//! All methods by name, for programs that choose one at run time.

use alloc::boxed::Box;

use super::{Ab4, Ab6, Abm12, Abm4, Abm6, Abm8, VariableAdams};
use super::{CashKarp, Dop853, Euler, Midpoint, Rk4, Rkf45, Tsit5, Verner9};
use super::{Limits, Solver, Statistics, Step, StepError, Stepper};
use crate::system::{Differentiable, Real, System};

/// What there is to know of a method before it is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Name.
    pub name: &'static str,
    /// One line.
    pub title: &'static str,
    /// Whether it estimates its error, so that it can choose its steps.
    pub adaptive: bool,
    /// Whether it asks for derivatives of the rates.
    pub implicit: bool,
}

/// A [`Solver`] whose method is not known at compile time; its functions.
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
}

/// Where a run starts and how its steps are chosen.
#[derive(Debug)]
pub struct Start<'a, Y: System> {
    /// Coordinates.
    pub q: &'a Y::Coordinates,
    /// Momenta.
    pub p: &'a Y::Momenta,
    /// Steps.
    pub step: Step,
    /// With compensated sums where the method has them.
    pub compensated: bool,
}

/// What comes of asking for a method: none if there is none of that name.
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
    ($(#[$doc:meta])* $list:ident, $make:ident, $bound:ident, $implicit:literal,
     { $($name:literal $title:literal $adaptive:literal $type:ident $new:ident $compensated:ident;)* }) => {
        $(#[$doc])*
        pub static $list: &[Entry] = &[
            $(Entry { name: $name, title: $title, adaptive: $adaptive, implicit: $implicit },)*
        ];

        /// One of them by name, at time zero. A method that estimates no error takes [`Step::Fixed`] only.
        pub fn $make<'a, Y>(name: &str, system: &mut Y, start: &Start<'_, Y>) -> Made<'a, Y>
        where
            Y: $bound + 'a,
            Y::Scalar: Real,
        {
            match name {
                $($name => {
                    let method = if start.compensated { $type::$compensated(system) } else { $type::$new(system) };
                    boxed(system, method, start)
                })*
                _ => None,
            }
        }
    };
}

catalogue! {
    /// Methods that need the rates only.
    EXPLICIT, explicit, System, false, {
        "euler" "Euler" false Euler new compensated;
        "midpoint" "explicit midpoint, order 2" false Midpoint new compensated;
        "rk4" "classical Runge-Kutta, order 4" false Rk4 new compensated;
        "rkf45" "Runge-Kutta-Fehlberg 5(4)" true Rkf45 new compensated;
        "cash-karp" "Cash-Karp 5(4)" true CashKarp new compensated;
        "tsit5" "Tsitouras 5(4)" true Tsit5 new compensated;
        "dop853" "Dormand-Prince 8(5,3)" true Dop853 new compensated;
        "verner9" "Verner 9(8)" true Verner9 new compensated;
        "ab4" "Adams-Bashforth, order 4, one evaluation a step" false Ab4 new compensated;
        "ab6" "Adams-Bashforth, order 6, one evaluation a step" false Ab6 new compensated;
        "abm4" "Adams-Bashforth-Moulton, order 4" false Abm4 new compensated;
        "abm6" "Adams-Bashforth-Moulton, order 6" false Abm6 new compensated;
        "abm8" "Adams-Bashforth-Moulton, order 8" false Abm8 new compensated;
        "abm12" "Adams-Bashforth-Moulton, order 12" false Abm12 new compensated;
        "adams" "Adams-Bashforth-Moulton, variable steps and orders" true VariableAdams new compensated;
    }
}

/// Any method by name, at time zero.
pub fn any<'a, Y>(name: &str, system: &mut Y, start: &Start<'_, Y>) -> Made<'a, Y>
where
    Y: Differentiable + 'a,
    Y::Scalar: Real,
{
    explicit(name, system, start)
}

/// All methods.
pub fn entries() -> impl Iterator<Item = &'static Entry> {
    EXPLICIT.iter()
}

/// What is known of a method.
pub fn entry(name: &str) -> Option<&'static Entry> {
    entries().find(|e| e.name == name)
}
