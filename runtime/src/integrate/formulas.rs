//! The collocation methods there are.

use super::collocation::Collocation;
use super::newton::{FixedPoint, Newton};
use super::tableau::{self, Mode};
use super::Constant;

/// A method with `S` stages, by name.
pub trait Formula<const S: usize> {
    /// Its coefficients.
    const TABLEAU: &'static tableau::Collocation<S>;
    /// Its modes, real ones first.
    const MODES: &'static [Mode<S>];
    /// Weights `e` of the error estimate `μ (1 − h μ J)⁻¹ (h f(y) + Σ e_i z_i)`, of third order.
    const ERROR: Option<[Constant; S]> = None;
}

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
        }
        $(#[doc = $doc]
        pub type $name<Y> = Collocation<Y, formula::$name, Newton<Y, $stages, $real, $pairs>, $stages>;)*
    };
}

formulas! {
    BackwardEuler 1 1 0 BACKWARD_EULER BACKWARD_EULER_MODES None,
        "Backward Euler, order 1: L-stable, takes energy out.";
    ImplicitMidpoint 1 1 0 IMPLICIT_MIDPOINT IMPLICIT_MIDPOINT_MODES None,
        "The implicit midpoint rule, order 2: A-stable, symplectic, symmetric.";
    Gauss4 2 0 1 GAUSS4 GAUSS4_MODES None,
        "Gauss-Legendre of order 4: A-stable, symplectic, symmetric.";
    Gauss6 3 1 1 GAUSS6 GAUSS6_MODES None,
        "Gauss-Legendre of order 6: A-stable, symplectic, symmetric.";
    Gauss12 6 0 3 GAUSS12 GAUSS12_MODES None,
        "Gauss-Legendre of order 12: A-stable, symplectic, symmetric; for long regular motion, with compensated sums.";
    Radau5 3 1 1 RADAU5 RADAU5_MODES Some(RADAU5_ERROR),
        "Radau IIA of order 5 with the error estimate of `RADAU5`: L-stable, for stiff mechanisms.";
}

/// [`Gauss12`] by insertion: no derivatives are needed.
pub type Gauss12FixedPoint<Y> = Collocation<Y, formula::Gauss12, FixedPoint, 6>;
/// [`Gauss6`] by insertion: no derivatives are needed.
pub type Gauss6FixedPoint<Y> = Collocation<Y, formula::Gauss6, FixedPoint, 3>;

/// `(−13 ∓ 7 √6) / 3, −1/3`: Hairer and Wanner, IV.8, eq. 8.19.
const RADAU5_ERROR: [Constant; 3] = super::constant::list(
    "-10.0488093998274155624603295076470799 1.38214273316074889579366284098041325 \
     -0.333333333333333333333333333333333333",
);
