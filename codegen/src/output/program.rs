//! A program and what it is called with.

use super::{Array, Sizes, Spec};

/// One array of numbers that generated code is called with; its numbers are inputs of the program, numbered through all
/// arrays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputArray {
    /// Its name: of an argument, `q`, or of a field of the generated type, `tau`.
    pub name: &'static str,
    /// Whether it is a field.
    pub field: bool,
    /// Lengths, the outermost first.
    pub dims: Vec<usize>,
}

impl InputArray {
    /// An array of the table.
    pub fn new(array: &Array, field: bool, sizes: &Sizes) -> InputArray {
        InputArray { name: array.name, field, dims: array.lengths(sizes) }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// Whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The program of one output, straight-line or rolled, and what it is called with.
#[derive(Clone, Debug)]
pub struct OutputProgram<P> {
    /// What it computes.
    pub spec: &'static Spec,
    /// Input arrays, numbered through.
    pub inputs: Vec<InputArray>,
    /// What computes it.
    pub program: P,
}

impl<P> OutputProgram<P> {
    /// The same with another kind of program.
    pub fn map<R>(self, kind: impl FnOnce(P) -> R) -> OutputProgram<R> {
        OutputProgram { spec: self.spec, inputs: self.inputs, program: kind(self.program) }
    }
}
