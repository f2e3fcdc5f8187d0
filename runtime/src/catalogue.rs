//! All methods by name, for programs that choose one at run time.

use alloc::boxed::Box;

use crate::integrate::{Ab4, Ab6, Abm4, Abm6, Abm8, VariableAdams};
use crate::integrate::{BackwardEuler, Gauss12FixedPoint, Gauss16, Gauss4, Gauss6, ImplicitMidpoint, Radau5, Rodas5P};
use crate::integrate::{CashKarp, Dop853, Euler, Midpoint, Rk4, Rkf45, SemiImplicitEuler, Tsit5, Verner9};
use crate::integrate::{StepDoubling, Stepper};
use crate::system::{Differentiable, Real, System};

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

/// A method that is chosen at run time. It runs in a [`Solver`](crate::integrate::Solver) and takes post-steps
/// ([`WithPostStep`](crate::constrained::WithPostStep)) like any other.
pub type BoxedMethod<'a, Y> = Box<dyn Stepper<Y> + 'a>;

/// A table of methods, and the function that makes one of them.
macro_rules! catalogue {
    ($(#[$doc:meta])* $list:ident, $make:ident, $bound:ident, $implicit:literal, |$system:ident, $compensated:ident|
     { $($name:literal $title:literal $adaptive:literal $method:expr;)* }) => {
        $(#[$doc])*
        pub static $list: &[Entry] = &[
            $(Entry { name: $name, title: $title, adaptive: $adaptive, implicit: $implicit },)*
        ];

        /// Makes a method of this table by its name, with compensated sums where it supports them and they are asked
        /// for. `None` if no method has that name.
        pub fn $make<'a, Y>(name: &str, $system: &Y, $compensated: bool) -> Option<BoxedMethod<'a, Y>>
        where
            Y: $bound + 'a,
            Y::Scalar: Real,
        {
            Some(match name {
                $($name => Box::new($method),)*
                _ => return None,
            })
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
    EXPLICIT, explicit, System, false, |system, c| {
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
        "gauss16" "Gauss-Legendre, order 16, all stages at once" true sums!(Gauss16, system, c);
    }
}

catalogue! {
    /// Methods that need derivatives of the rates.
    IMPLICIT, implicit, Differentiable, true, |system, c| {
        "backward-euler" "backward Euler" false sums!(BackwardEuler, system, c);
        "implicit-midpoint" "implicit midpoint, order 2" false sums!(ImplicitMidpoint, system, c);
        "gauss4" "Gauss-Legendre, order 4" false sums!(Gauss4, system, c);
        "gauss6" "Gauss-Legendre, order 6" false sums!(Gauss6, system, c);
        "radau5" "Radau IIA, order 5" true sums!(Radau5, system, c);
        "rodas5p" "Rosenbrock Rodas5P, order 5" true sums!(Rodas5P, system, c);
    }
}

/// Makes a method of either table by its name, as [`explicit`] and [`implicit`] do.
pub fn any<'a, Y>(name: &str, system: &Y, compensated: bool) -> Option<BoxedMethod<'a, Y>>
where
    Y: Differentiable + 'a,
    Y::Scalar: Real,
{
    implicit(name, system, compensated).or_else(|| explicit(name, system, compensated))
}

/// All methods.
pub fn entries() -> impl Iterator<Item = &'static Entry> {
    EXPLICIT.iter().chain(IMPLICIT)
}

/// The entry of a method by its name.
pub fn entry(name: &str) -> Option<&'static Entry> {
    entries().find(|e| e.name == name)
}
