//! WebAssembly of the same programs as generated Rust, with a JavaScript wrapper and its types.
//!
//! A module imports nothing: sines and cosines of all angles are part of it. Arguments and results are in its memory, at
//! the places that the wrapper lists in its comment at the top. In exact arithmetic and double precision it gives the bits of
//! the interpreter.
//!
//! ```
//! use mbd_codegen::read::{self, ImportOptions};
//! use mbd_codegen::{wasm, Options};
//!
//! let text = include_str!("../../../models/double_pendulum.toml");
//! let model = read::model("double_pendulum.toml", text, &ImportOptions::default())?.model;
//! let options = Options { type_name: "DoublePendulum".into(), ..Options::default() };
//! let code = wasm::generate(&model, &options)?;
//! assert!(code.module.starts_with(b"\0asm"));
//! assert!(code.wrapper.contains("export class DoublePendulum"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod body;
mod instructions;
mod layout;
mod module;
mod number;
mod placed;
mod sines;
mod wrapper;

use crate::code::Programs;
use crate::emit::Input;
use crate::error::GenerateError;
use crate::model::Model;
use crate::options::Options;
use crate::output::Output;
use crate::plan::Plan;
use crate::search;
use crate::symbolic::Counts;
use layout::Layout;
use number::Number;
use wrapper::Wrapper;

pub use module::{HOST, MEMORY};
pub use placed::{place, Placed, PlacedArray};

/// A generated module and information about it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct GeneratedWasm {
    /// The binary module. It imports nothing.
    pub module: Vec<u8>,
    /// The wrapper, an ES module of JavaScript.
    pub wrapper: String,
    /// Declarations of the wrapper for TypeScript, `.d.ts`.
    pub types: String,
    /// Operations of each function.
    pub counts: Vec<(Output, Counts)>,
    /// Notices about changes, such as angles that became right angles.
    pub notices: Vec<String>,
}

/// Generates WebAssembly for a checked model. [`Options::type_name`] is the name of the wrapper's class;
/// [`Options::runtime`] and [`Options::chunk`] have no part in it.
///
/// # Errors
/// Those of [`crate::generate()`].
pub fn generate(model: &Model, options: &Options) -> Result<GeneratedWasm, GenerateError> {
    let options = &options.of_model(!model.constraints.is_empty());
    generate_from(&search::plan(model, options.searches()), options)
}

/// Generates WebAssembly that computes several states at once: as many as a vector of 16 bytes has numbers, two of
/// double precision or four of single precision. The last index of every array is the state.
///
/// # Errors
/// The same as of [`generate`].
pub fn generate_lanes(model: &Model, options: &Options) -> Result<GeneratedWasm, GenerateError> {
    let options = &options.of_model(!model.constraints.is_empty());
    generate_lanes_from(&search::plan(model, options.searches()), options)
}

/// Generates WebAssembly with the eliminations of a plan; [`Options::plan`] has no part in it.
///
/// # Errors
/// The same as of [`generate`].
pub fn generate_from(plan: &Plan, options: &Options) -> Result<GeneratedWasm, GenerateError> {
    files(plan, options, Number::scalar(options.precision))
}

/// Generates WebAssembly for several states with the eliminations of a plan; [`Options::plan`] has no part in it.
///
/// # Errors
/// The same as of [`generate`].
pub fn generate_lanes_from(plan: &Plan, options: &Options) -> Result<GeneratedWasm, GenerateError> {
    files(plan, options, Number::vector(options.precision))
}

fn files(plan: &Plan, options: &Options, number: Number) -> Result<GeneratedWasm, GenerateError> {
    if options.modes.is_some() {
        return Err(GenerateError::ModesNeedRust);
    }
    let programs = Programs::new(plan, options)?.without_tables()?;
    let (input, functions) = (Input { plan, options, programs: &programs }, programs.functions());
    let layout = Layout::new(&input, &functions, number, 0);
    let wrapper = Wrapper::new(&input, &layout, &functions);
    Ok(GeneratedWasm {
        module: module::module(&layout, &functions, false),
        wrapper: wrapper.javascript(),
        types: wrapper.types(),
        counts: programs.counts(options),
        notices: plan.notices.clone(),
    })
}
