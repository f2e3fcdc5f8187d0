//! Rewriting of whole programs, for [`Arithmetic::Fast`]: other rounding, the same value.

pub mod factor;
mod rebuild;
pub mod schedule;
pub mod sums;
mod terms;

use super::Program;
use crate::options::Arithmetic;
pub(super) use rebuild::width;
use schedule::Limits;

/// The program as it is to be emitted.
pub fn run(program: Program, arithmetic: Arithmetic) -> Program {
    match arithmetic {
        Arithmetic::Exact => program,
        Arithmetic::Fast => {
            let program = sums::regroup(&program);
            schedule::schedule(&program, Limits { registers: 28, search: 64 })
        }
    }
}
