//! The example `mpc`: the same files.

use mbd_runtime::{Differentiable, Real, Scalar, StateDerivatives};

#[path = "../../../mpc/acrobot.rs"]
pub mod acrobot;
#[path = "../../../mpc/ilqr.rs"]
pub mod ilqr;
#[path = "../../../mpc/steps.rs"]
pub mod steps;
