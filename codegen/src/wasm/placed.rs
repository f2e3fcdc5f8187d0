//! Functions in the memory of their host: modules that a program which is WebAssembly itself assembles at run time.

use super::layout::{Area, Layout};
use super::module;
use super::number::Number;
use crate::code::{compile, Programs};
use crate::emit::Input;
use crate::error::GenerateError;
use crate::options::Options;
use crate::output::Output;
use crate::plan::Plan;
use crate::trace::{chosen_frames, sizes};

/// A function in the memory of its host.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Placed {
    /// The binary module. It imports the memory [`MEMORY`](super::MEMORY) of [`HOST`](super::HOST), fills its part of it,
    /// and exports the function under the name of the output, without parameters and results.
    pub module: Vec<u8>,
    /// Inputs: arguments and fields that the model has, whether or not they are read.
    pub inputs: Vec<PlacedArray>,
    /// Results, in the order of the output.
    pub results: Vec<PlacedArray>,
}

/// An array of numbers in the memory of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PlacedArray {
    /// Name.
    pub name: &'static str,
    /// Address, bytes.
    pub address: usize,
    /// Number of entries.
    pub len: usize,
}

impl PlacedArray {
    fn new(area: &Area) -> PlacedArray {
        PlacedArray { name: area.name, address: area.offset, len: area.len() }
    }
}

/// A module for one output, for one state, with the eliminations of a plan; [`Options::plan`] only says where code is
/// rolled. `reserve` gives the address, a multiple of 16, of so many bytes of the host's memory that nobody else uses and that are
/// zero.
///
/// # Errors
/// Those of [`crate::generate()`]. Nothing is reserved for a program with more than `most` operations: `None`.
pub fn place(
    plan: &Plan,
    output: Output,
    options: &Options,
    most: usize,
    reserve: impl FnOnce(usize) -> usize,
) -> Result<Option<Placed>, GenerateError> {
    let program = compile(plan, output, options)?;
    if program.program.operations().count() > most {
        return Ok(None);
    }
    let frames = chosen_frames(plan, options)?;
    let programs = Programs {
        outputs: vec![program],
        coordinate_rates: None,
        sizes: sizes(plan, options, frames.len()),
        frames,
        sets: Vec::new(),
        factored: Vec::new(),
        together: Vec::new(),
    };
    let programs = programs.without_tables()?;
    let (input, functions) = (Input { plan, options, programs: &programs }, programs.functions());
    let number = Number::scalar(options.precision);
    let base = reserve(Layout::new(&input, &functions, number, 0).len);
    let layout = Layout::new(&input, &functions, number, base);
    Ok(Some(Placed {
        module: module::module(&layout, &functions, true),
        inputs: layout.inputs.iter().map(PlacedArray::new).collect(),
        results: layout.functions.iter().flat_map(|of| &of.results).map(PlacedArray::new).collect(),
    }))
}
