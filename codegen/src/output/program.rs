//! A program with its input arrays.

use super::{Array, Sizes, Spec};

/// One array of inputs of generated code. Its entries are inputs of the program, numbered consecutively over all
/// arrays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputArray {
    /// Name of the argument (`q`) or of the field of the generated type (`tau`).
    pub name: &'static str,
    /// Whether it is a field.
    pub field: bool,
    /// Lengths, the outermost first.
    pub dims: Vec<usize>,
}

/// Documentation of entry (i, j, ...) of a flat array, the last index fastest: its indices, and its index in the array.
/// `lengths` are those of the array, the outermost first.
pub fn flat_entry(lengths: &[String]) -> (String, String) {
    let indices: Vec<&str> = ["i", "j", "k", "l"].into_iter().take(lengths.len()).collect();
    let flat = indices.iter().zip(lengths).skip(1).fold("i".to_string(), |before, (index, length)| {
        let before = if before.contains(' ') { format!("({before})") } else { before };
        format!("{before} * {length} + {index}")
    });
    (indices.join(", "), flat)
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

/// The program of one output, straight-line or rolled, and its input arrays.
#[derive(Clone, Debug)]
pub struct OutputProgram<P> {
    /// What it computes.
    pub spec: &'static Spec,
    /// Input arrays, with consecutively numbered entries.
    pub inputs: Vec<InputArray>,
    /// The program.
    pub program: P,
}

impl<P> OutputProgram<P> {
    /// The same with another kind of program.
    pub fn map<R>(self, kind: impl FnOnce(P) -> R) -> OutputProgram<R> {
        OutputProgram { spec: self.spec, inputs: self.inputs, program: kind(self.program) }
    }
}

/// The array of an input of a program, and its index there.
pub(crate) fn locate(inputs: &[InputArray], mut k: usize) -> (&InputArray, usize) {
    for array in inputs {
        if k < array.len() {
            return (array, k);
        }
        k -= array.len();
    }
    unreachable!("inputs are numbered through their arrays")
}
