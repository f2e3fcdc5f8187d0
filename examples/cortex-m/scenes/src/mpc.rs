//! The example `mpc`: the same files.

use mbd_runtime::{Differentiable, Real, Scalar};

#[path = "../../../mpc/acrobot.rs"]
pub mod acrobot;
#[path = "../../../mpc/box_minimum.rs"]
pub mod box_minimum;
#[path = "../../../mpc/ilqr.rs"]
pub mod ilqr;
#[path = "../../../mpc/steps.rs"]
pub mod steps;
