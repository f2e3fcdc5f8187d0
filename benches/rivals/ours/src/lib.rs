//! `extern "C"` doors to the generated code of every robot: `NAME_rates(q, p, tau, out)` with `out = [q̇, ṗ]`,
//! `NAME_accelerations(q, v, tau, out)` with `out = q̈`, and `NAME_about(...)` for the order of coordinates and the counts.
#![allow(missing_docs)]

include!(concat!(env!("OUT_DIR"), "/robots.rs"));
