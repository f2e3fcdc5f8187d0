//! Symbolic code generator for multibody dynamics in Hamilton's canonical form.

pub use mbd_codegen as codegen;
pub use mbd_macros::*;
pub use mbd_runtime as runtime;
