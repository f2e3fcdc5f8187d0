//! `extern "C"` doors to the derivatives of every robot: `NAME_derivatives(q, p, tau, out)` with the blocks `∂v/∂q`,
//! `∂v/∂p`, `∂ṗ/∂q`, `∂ṗ/∂p`, then `v` and `ṗ`, one behind the other, and `NAME_about(...)` for the order of coordinates and the count.
#![allow(missing_docs)]

include!(concat!(env!("OUT_DIR"), "/robots.rs"));
