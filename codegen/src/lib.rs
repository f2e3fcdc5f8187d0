//! Reads, checks and compiles descriptions of mechanisms into straight-line Rust.

pub mod c;
mod check;
mod choice;
pub mod code;
mod contacts;
pub mod diag;
mod emit;
mod error;
pub mod factored;
#[cfg(feature = "height_fields")]
mod field;
pub mod generate;
#[cfg(feature = "hulls")]
mod hull;
pub mod identifiable;
mod import;
mod inertia;
#[cfg(feature = "jit")]
// What it depends on needs no older one.
#[clippy::msrv = "1.92"]
pub mod jit;
#[cfg(any(feature = "height_fields", feature = "hulls"))]
mod known;
mod lower;
pub mod model;
pub mod modes;
mod names;
pub mod options;
pub mod output;
pub mod plan;
pub mod read;
pub mod rolled;
mod rounded_once;
mod sample;
pub mod search;
pub mod singular;
pub mod symbolic;
mod symmetric;
mod trace;
pub mod transfer;
#[cfg(feature = "wasm")]
pub mod wasm;

/// Texts of messages, for the command and the macro.
#[doc(hidden)]
pub use import::words;

pub use generate::{
    generate, transfer_code, Arithmetic, CountsOfModes, CountsOfPieces, GenerateError, Generated, LikeBranches,
    Options, Output, Precision, RolledCode,
};
pub use names::camel_case;
