//! The collocation methods by name.

use super::collocation::{Collocation, Formula};
use super::integrator::Integrator;
use super::newton::{FixedPoint, Newton};
use super::tableau::{self, Mode};
use crate::constant::{self, Constant};

macro_rules! formulas {
    ($($name:ident $stages:literal $real:literal $pairs:literal $tableau:ident $modes:ident $error:expr, $doc:literal;)*) => {
        /// Names of collocation methods.
        pub mod formula {
            use super::*;
            $(#[doc = $doc]
            #[derive(Clone, Copy, Debug)]
            pub struct $name;
            impl Formula<$stages> for $name {
                const TABLEAU: &'static tableau::Collocation<$stages> = &tableau::$tableau;
                const MODES: &'static [Mode<$stages>] = &tableau::$modes;
                const ERROR: Option<[Constant; $stages]> = $error;
            })*

            /// Gauss-Legendre of order 12: A-stable, symmetric, without quaternions symplectic.
            #[derive(Clone, Copy, Debug)]
            pub struct Gauss12;
            impl Formula<6> for Gauss12 {
                const TABLEAU: &'static tableau::Collocation<6> = &tableau::GAUSS12;
            }
        }
        $(#[doc = $doc]
        pub type $name<Y> =
            Integrator<Y, Collocation<Y, formula::$name, Newton<Y, $stages, $real, $pairs>, $stages>>;)*
    };
}

formulas! {
    BackwardEuler 1 1 0 BACKWARD_EULER BACKWARD_EULER_MODES None,
        "Backward Euler, order 1: L-stable, takes energy out.";
    ImplicitMidpoint 1 1 0 IMPLICIT_MIDPOINT IMPLICIT_MIDPOINT_MODES None,
        "The implicit midpoint rule, order 2: A-stable, symmetric, without quaternions symplectic.";
    Gauss4 2 0 1 GAUSS4 GAUSS4_MODES None,
        "Gauss-Legendre of order 4: A-stable, symmetric, without quaternions symplectic.";
    Gauss6 3 1 1 GAUSS6 GAUSS6_MODES None,
        "Gauss-Legendre of order 6: A-stable, symmetric, without quaternions symplectic.";
    Radau5 3 1 1 RADAU5 RADAU5_MODES Some(RADAU5_ERROR),
        "Radau IIA of order 5 with the error estimate of `RADAU5`: L-stable, for stiff mechanisms.";
}

/// Gauss-Legendre of order 12 by fixed-point iteration, which needs no derivatives: symmetric, without quaternions
/// symplectic; for long regular motion, with compensated sums.
pub type Gauss12FixedPoint<Y> = Integrator<Y, Collocation<Y, formula::Gauss12, FixedPoint, 6>>;
/// [`Gauss6`] by fixed-point iteration, which needs no derivatives.
pub type Gauss6FixedPoint<Y> = Integrator<Y, Collocation<Y, formula::Gauss6, FixedPoint, 3>>;

/// `(−13 ∓ 7 √6) / 3, −1/3`: Hairer and Wanner, IV.8, eq. 8.19.
const RADAU5_ERROR: [Constant; 3] = constant::list(
    "-10.0488093998274155624603295076470799 1.38214273316074889579366284098041325 \
     -0.333333333333333333333333333333333333",
);
