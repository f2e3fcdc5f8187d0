//! Coefficients of one-step methods.

mod dop853;
mod implicit;
mod low;
mod modes;
mod rosenbrock;
mod tsit5;
mod verner9;

#[cfg(test)]
mod tests;

pub use dop853::DOP853;
pub use implicit::{Collocation, BACKWARD_EULER, GAUSS12, GAUSS4, GAUSS6, IMPLICIT_MIDPOINT, RADAU5};
pub use low::{CASH_KARP, DORMAND_PRINCE, EULER, MIDPOINT, RK4, RKF45};
pub use modes::{Mode, BACKWARD_EULER_MODES, GAUSS4_MODES, GAUSS6_MODES, IMPLICIT_MIDPOINT_MODES, RADAU5_MODES};
pub use rosenbrock::{Rosenbrock, RODAS5P};
pub use tsit5::TSIT5;
pub use verner9::VERNER9;

use crate::constant::Constant;
use crate::Scalar;

/// An explicit Runge-Kutta method with `S` stages.
///
/// Rates `k_i = f(t + c_i h, y + h Σ_j a_ij k_j)`, the new point `y + h Σ_i b_i k_i`.
#[derive(Clone, Copy, Debug)]
pub struct Tableau<const S: usize> {
    /// What it is called.
    pub name: &'static str,
    /// Order of the new point.
    pub order: u32,
    /// Nodes.
    pub c: [Constant; S],
    /// Weights of the stages, strictly lower triangular.
    pub a: [[Constant; S]; S],
    /// Weights of the new point.
    pub b: [Constant; S],
    /// Weights of error estimates `h Σ_i e_i k_i`: none, one, or two rows (of [`DOP853`], which says what becomes of
    /// them).
    pub error: &'static [[Constant; S]],
    /// The estimate behaves as h to this plus one: the order of the lower method. Zero without an estimate.
    pub error_order: u32,
    /// The part of the tolerance that the estimated error of a step may use up, see
    /// [`Stepper::share`](super::Stepper::share).
    pub share: f64,
    /// The last stage is the rate at the new point: the first one of the next step.
    pub fsal: bool,
    /// What gives the points within a step.
    pub dense: Option<&'static Dense>,
}

/// A continuous extension of a method, with a continuous slope from step to step:
///
/// `y(t + θ h) = cubic(θ) + h θ² (1 - θ)² Σ_i r_i(θ - 1/2) k_i`,
///
/// where the cubic is that with the values and rates at both ends of the step. The sum runs over the stages, then the
/// rate at the end (of a method that has it as its last stage this is not repeated), then the extra stages. In powers
/// of θ the same polynomials have coefficients of up to 13,000 that cancel; so they lose nothing, and their ends are
/// exact.
#[derive(Clone, Copy, Debug)]
pub struct Dense {
    /// Order of the points within the step.
    pub order: u32,
    /// Nodes of the extra stages.
    pub c: &'static [Constant],
    /// Their rows: over stages, the rate at the end, earlier extra stages.
    pub a: &'static [&'static [Constant]],
    /// Row `i`: the coefficients of 1, x, x², … of `r_i(x)`; empty where it is zero.
    pub bend: &'static [&'static [Constant]],
}

impl Dense {
    /// `θ² (1 - θ)² r_i(θ - 1/2)`: what is added, times h, of each rate to the cubic.
    pub fn weight<S: Scalar>(&self, i: usize, theta: S) -> S {
        let (x, bump) = (theta - S::constant(0.5), theta * (S::one() - theta));
        bump * bump * self.bend[i].iter().rev().fold(S::zero(), |sum, c| sum * x + c.get())
    }
}
