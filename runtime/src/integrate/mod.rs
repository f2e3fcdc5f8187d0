//! Integrators of [`System`](crate::System)s. No allocation in a step.
//!
//! A method is a [`Stepper`]: `step` takes one step of a given size, for control loops; a [`Solver`] drives it over a time
//! with error control, dense output, events and statistics. Methods work on displacements from the state at the start of a
//! step ([`chart`]), so joints with quaternions stay on their group in all of them.

mod adams;
#[cfg(feature = "alloc")]
pub mod catalogue;
pub mod chart;
mod collocation;
mod composition;
pub(crate) mod constant;
mod control;
mod doubled;
mod doubling;
mod error;
mod events;
mod explicit;
mod field;
mod fixed;
mod group;
#[cfg(test)]
mod implicit_tests;
mod jacobian;
mod linear;
mod newton;
mod projection;
mod rosenbrock;
#[cfg(test)]
mod scenes;
mod semi_implicit;
mod solver;
mod stepper;
pub mod tableau;

pub use adams::{Ab4, Ab6, Abm12, Abm4, Abm6, Abm8, Adams, AdamsBashforth, AdamsMoulton, VariableAdams};
pub use chart::{Chart, Point};
pub use collocation::{
    formula, BackwardEuler, Collocation, Formula, Gauss12, Gauss12Inserted, Gauss4, Gauss6, Gauss6Inserted,
    ImplicitMidpoint, Radau5,
};
pub use composition::{Composition, Symmetric};
pub use constant::{decimal, ratio, Constant};
pub use control::{Control, Limits, Step, Tolerance, Tolerances};
pub use doubled::Doubled;
pub use doubling::StepDoubling;
pub use error::StepError;
pub use events::{Direction, Events, Outcome, Watch};
pub use explicit::{method, CashKarp, Dop853, Euler, Explicit, Method, Midpoint, Rk4, Rkf45, Tsit5, Verner9};
pub use field::Field;
pub use fixed::FixedIterations;
pub use newton::{FixedPoint, Iteration, Newton};
pub use projection::Projection;
pub use rosenbrock::{Rodas5P, Rosenbrock};
pub use semi_implicit::SemiImplicitEuler;
pub use solver::Solver;
pub use stepper::{norm, Statistics, Stepper};
