//! What most programs use: `use multibody::prelude::*;`.
//!
//! The macro, the traits of mechanisms, the interpreter, the way of going through a time with a method for each need.
//! Everything else is named by its module.

#[cfg(feature = "macros")]
pub use crate::mbd_model;

#[cfg(feature = "codegen")]
pub use crate::codegen::read::{self, load, Base, ImportOptions};
#[cfg(feature = "codegen")]
pub use crate::codegen::{options::PlanOptions, plan::Plan, search};

pub use crate::runtime::constrained::{close, Closing, Effort, Projection, Stabilisation, WithPostStep};
pub use crate::runtime::integrate::{
    ImplicitMidpoint, Radau5, Rk4, Solver, Step, StepError, Stepper, Tolerances, Verner9,
};
pub use crate::runtime::{
    Accelerated, Conjugate, Constrained, Differentiable, Energetic, Interpreter, MomentumDerivatives, Scalar,
    StateDerivatives, System, TransferFrom,
};
