//! Reads, checks and compiles descriptions of mechanisms into straight-line Rust.

pub mod check;
pub mod diag;
pub mod import;
pub mod model;
