//! Sweeps, interpreter and integrators of the multibody project.
//!
//! The crate is `no_std` by default and does not allocate on the hot path. Generated code needs [`System`],
//! [`integrate`], [`kernel`], [`batch`] and [`trig`] only. The tree, its workspace and the interpreter (feature
//! `alloc`) allocate their vectors once, when they are made. With feature `std`, generated code uses the vector
//! instructions that it detects at run time.
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(feature = "std")]
extern crate std;

#[cfg(feature = "alloc")]
mod acceleration_form;
pub mod batch;
#[cfg(feature = "alloc")]
pub mod catalogue;
mod constant;
pub mod constrained;
pub mod contact;
mod dual;
mod error;
pub mod field;
#[cfg(feature = "hulls")]
pub mod hull;
pub mod integrate;
#[cfg(feature = "alloc")]
pub mod interp;
pub mod interval;
pub mod kernel;
#[cfg(feature = "alloc")]
pub mod layout;
mod lists;
pub mod notation;
mod packed;
mod scalar;
pub mod spatial;
#[cfg(feature = "alloc")]
pub mod sweep;
pub mod system;
pub mod transfer;
#[cfg(feature = "alloc")]
pub mod tree;
pub mod trig;
#[cfg(any(test, feature = "wide"))]
pub mod wide;
#[cfg(feature = "alloc")]
pub mod workspace;

#[cfg(feature = "alloc")]
pub use acceleration_form::AccelerationForm;
pub use dual::Dual;
pub use error::{ConstraintError, Named, StepError};
#[cfg(feature = "alloc")]
pub use interp::{Interpreter, MassMatrixError};
pub use packed::Packed;
pub use scalar::Scalar;
pub use system::{
    Accelerated, Conjugate, Constrained, Differentiable, Energetic, MomentumDerivatives, Real, StateDerivatives, System,
};
pub use transfer::TransferFrom;
