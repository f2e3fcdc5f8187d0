//! The page of `mbd view`: readers, generator, integrators and contacts, behind functions that JavaScript calls.
//!
//! One instance holds one [`Scene`](scene::Scene). A program for the same scene without a browser is `main.rs`, whose
//! states the page's are compared with.

#![deny(unsafe_code)]

/// Sources that the command shares with the page name this crate's parts as those of `multibody`.
extern crate self as multibody;
pub use mbd_codegen as codegen;
pub use mbd_runtime as runtime;

// A function that JavaScript finds by its name counts as unsafe code; there is no other in this module.
#[allow(unsafe_code)]
mod abi;
mod describe;
#[allow(unsafe_code)]
mod engine;
mod evaluator;
mod json;
mod load;
mod motion;
mod picture;
pub mod scene;
#[path = "../../cli/src/start.rs"]
mod start;

/// Colours: limbs ask for their number.
#[allow(dead_code)]
#[path = "../../cli/src/ink.rs"]
mod ink;
