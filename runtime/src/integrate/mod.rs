//! Integrators of [`System`](crate::System)s. No allocation in a step.
//!
//! A method is a [`Stepper`]: `step` takes one step of a size that the caller gives, for control loops; a [`Solver`]
//! drives it over a time with error control, dense output, events and statistics. All methods share the shell
//! [`Integrator`]; a method of your own is a [`Scheme`] in it. Methods work on displacements from the state at the
//! start of a step ([`chart`]), so joints with quaternions stay on their group in all of them.
//!
//! # Worst case of implicit methods
//!
//! The table states the work of one step on a mechanism with `nv` velocities. A factorisation is that of a matrix of `2
//! nv` rows (a complex one counts as four real ones).
//!
//! | method, `n` iterations a step | derivatives | factorisations | evaluations of the rates |
//! | --- | --- | --- | --- |
//! | [`BackwardEuler`], [`ImplicitMidpoint`] | 1 | 1 real | `n` |
//! | [`Gauss4`] | 1 | 1 complex | `2 n` |
//! | [`Gauss6`], [`Radau5`] | 1 | 1 real, 1 complex | `3 n` |
//! | [`Gauss6FixedPoint`] | 0 | 0 | `1 + 3 n` |
//! | [`Gauss12FixedPoint`] | 0 | 0 | `1 + 6 n` |
//! | [`Gauss16`] | 0 | 0 | `1 + 8 n`, and at most 16 for the mobility |
//! | [`Rodas5P`], always | 1 | 1 real | 7; 9 if the system depends on time |
//!
//! These are the numbers of methods made by `with_iterations`. Otherwise `n` is at most 30 (60 by fixed-point
//! iteration) in a fixed step and 10 (20; [`Gauss16`] 14) in a step under error control. All of it is done twice if the
//! first try fails, and two evaluations are added where an error is estimated; a step that has used them up ends with
//! [`StepError::NoConvergence`]. [`Statistics::factorisations`] counts those of one step as one.

mod adams;
mod auto_switch;
pub mod chart;
mod collocation;
mod combine;
mod control;
mod doubling;
mod energy_projection;
mod events;
mod explicit;
mod field;
mod fixed;
mod formulas;
#[cfg(feature = "alloc")]
mod gauss16;
#[cfg(test)]
mod implicit_tests;
#[cfg(feature = "alloc")]
mod in_lanes;
mod integrator;
mod jacobian;
mod lie_joint;
mod linear;
mod middle;
mod newton;
pub(crate) mod root;
mod rosenbrock;
#[cfg(test)]
mod scenes;
mod semi_implicit;
mod solver;
mod stepper;
pub mod tableau;
mod weights;

pub use crate::constant::{decimal, ratio, Constant};
pub use crate::error::StepError;
pub use adams::{Ab4, Ab6, Abm4, Abm6, Abm8, Adams, AdamsBashforth, AdamsMoulton, AdamsOfVariableOrder, VariableAdams};
pub use auto_switch::AutoSwitch;
pub use chart::{Chart, Point};
pub use collocation::{Collocation, Formula};
pub use control::{Control, Limits, Step, Tolerance, Tolerances};
pub use doubling::{Doubling, StepDoubling};
pub use energy_projection::EnergyProjection;
pub use events::{Direction, Events, Outcome, Watch};
pub use explicit::{method, CashKarp, Dop853, Euler, Explicit, Method, Midpoint, Rk4, Rkf45, Tsit5, Verner9};
pub use field::Field;
pub use fixed::FixedIterations;
pub use formulas::{
    formula, BackwardEuler, Gauss12FixedPoint, Gauss4, Gauss6, Gauss6FixedPoint, ImplicitMidpoint, Radau5,
};
#[cfg(feature = "alloc")]
pub use gauss16::{Gauss16, ParallelGauss};
pub use integrator::{Attempt, FromSystem, Integrator, Scheme};
pub(crate) use middle::{turns, Middle};
pub use newton::{FixedPoint, Iteration, Newton};
pub use rosenbrock::{Rodas5P, Rosenbrock};
pub use semi_implicit::{SemiImplicit, SemiImplicitEuler};
pub use solver::Solver;
pub use stepper::{norm, Statistics, Stepper};
