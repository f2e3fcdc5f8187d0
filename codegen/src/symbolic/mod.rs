//! Symbolic scalars over a hash-consed graph, and straight-line programs made of them.
//!
//! When an operation is made, only rewritings are applied that are exact in IEEE arithmetic for finite values: `0 + x`,
//! `1 · x`, `0 · x`, signs, `x − x`, folding of constants, order of commutative operands, sharing of equal operations.
//! A program therefore gives the same bits as the sweep on numbers, up to the sign of zero.

pub mod angles;
mod cost;
mod evaluate;
mod expr;
pub(crate) mod hash;
mod index;
#[cfg(feature = "height_fields")]
mod look_up;
pub mod machine;
pub mod passes;
mod program;

pub use cost::{cost, Cost, BYTES};
pub use expr::{Entry, Expr, FlooredReciprocal, Fma, Graph, Label, Name, Op, Operand};
#[cfg(feature = "height_fields")]
pub use look_up::{LookUp, Table};
pub use passes::Rewrite;
pub use program::{Counts, Program, ProgramResult};
