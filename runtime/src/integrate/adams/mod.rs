//! Adams methods: the next step from the rates of the last ones (thesis C.4).

mod fixed;
mod history;
mod shared;
mod start;
mod variable;
mod weights;

pub use fixed::{Ab4, Ab6, Abm4, Abm6, Abm8, Adams, AdamsBashforth, AdamsMoulton};
pub use variable::{AdamsOfVariableOrder, VariableAdams};
