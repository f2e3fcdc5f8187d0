//! Rewriting of whole programs, for [`Arithmetic::Fast`]: other rounding, the same value.

use super::Program;
use crate::options::Arithmetic;

/// The program as it is to be emitted.
pub fn run(program: Program, arithmetic: Arithmetic) -> Program {
    match arithmetic {
        Arithmetic::Exact | Arithmetic::Fast => program,
    }
}
