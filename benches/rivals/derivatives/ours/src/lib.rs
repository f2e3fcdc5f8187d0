//! `extern "C"` functions for every robot. `NAME_derivatives(q, p, tau, out)` writes `v` and `ṗ`, then the blocks `∂v/∂q`,
//! `∂v/∂p`, `∂ṗ/∂q`, `∂ṗ/∂p`, one after the other. `NAME_about(...)` gives the order of coordinates and the
//! number of operations.
#![allow(missing_docs)]

include!(concat!(env!("OUT_DIR"), "/robots.rs"));
