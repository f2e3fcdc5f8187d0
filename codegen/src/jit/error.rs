//! Reasons why there is no machine code.

use std::fmt;

use crate::error::GenerateError;
use crate::output::Output;

/// Reason why there is no machine code for an output.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CompileError {
    /// The output has no program.
    Generate(GenerateError),
    /// The program is too large to compile in a reasonable time. The interpreter computes the output.
    TooLarge {
        /// The output.
        output: Output,
        /// Number of operations, if it is known.
        operations: Option<usize>,
        /// The most that are compiled.
        most: usize,
    },
    /// The arguments or results that were given are not those of the output.
    Arrays {
        /// The output.
        output: Output,
        /// What was given, and what was expected.
        words: String,
    },
    /// There is no machine code for this processor, or the system gives no memory for it.
    Machine {
        /// Cranelift's words.
        words: String,
    },
}

impl CompileError {
    pub(super) fn machine(error: impl fmt::Display) -> CompileError {
        CompileError::Machine { words: error.to_string() }
    }
}

impl From<GenerateError> for CompileError {
    fn from(error: GenerateError) -> CompileError {
        CompileError::Generate(error)
    }
}

impl fmt::Display for CompileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CompileError::Generate(error) => error.fmt(f),
            CompileError::TooLarge { output, operations: Some(operations), most } => {
                write!(f, "`{}` has {operations} operations; programs of up to {most} are compiled", output.name())
            }
            CompileError::TooLarge { output, operations: None, most } => {
                write!(
                    f,
                    "`{}` of so large a mechanism has more than the {most} operations that are compiled",
                    output.name()
                )
            }
            CompileError::Arrays { output, words } => write!(f, "`{}`: {words}", output.name()),
            CompileError::Machine { words } => write!(f, "no machine code could be made: {words}"),
        }
    }
}

impl std::error::Error for CompileError {}
