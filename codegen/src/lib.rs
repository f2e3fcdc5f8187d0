//! Reads, checks and compiles descriptions of mechanisms into straight-line Rust.

pub mod check;
mod choice;
pub mod code;
pub mod diag;
pub mod emit;
pub mod error;
pub mod generate;
pub mod identifiable;
pub mod import;
pub mod model;
mod names;
pub mod options;
pub mod output;
pub mod plan;
pub mod read;
pub mod rolled;
mod sample;
pub mod search;
pub mod symbolic;
pub mod trace;

pub use generate::{generate, Arithmetic, GenerateError, Generated, Options, Output, Precision, RolledCode};
