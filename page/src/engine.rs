//! Functions that the engine of the page assembles from WebAssembly, and calls of them. All `unsafe` code of the page is in
//! this file.
//!
//! A [`Function`] owns the memory of its arrays: it is reserved when the function is made, is known to nobody else, and is
//! never given back. Lengths are compared before anything is copied.

use multibody::codegen::options::{Arithmetic, Options};
use multibody::codegen::plan::Plan;
use multibody::codegen::wasm::{place, PlacedArray};
use multibody::codegen::Output;
use multibody::runtime::Interpreter;

/// Largest number of operations of a function that is assembled.
const MOST_OPERATIONS: usize = 30_000;
/// Mechanisms with more nodes than this are left to the interpreter.
const MOST_NODES: usize = 600;

/// A function that an engine has assembled.
#[derive(Debug)]
pub struct Function {
    call: extern "C" fn(),
    inputs: Vec<PlacedArray>,
    results: Vec<PlacedArray>,
}

#[cfg(target_arch = "wasm32")]
mod host {
    #[link(wasm_import_module = "host")]
    extern "C" {
        /// Assembles a module and gives the place of its function, whose name follows, in the table of functions; 0
        /// where that fails.
        fn assemble(module: *const u8, length: usize, name: *const u8, name_length: usize) -> usize;
    }

    /// The function of a module.
    pub fn function(module: &[u8], name: &str) -> Option<extern "C" fn()> {
        // SAFETY: the engine reads both texts only.
        let at = unsafe { assemble(module.as_ptr(), module.len(), name.as_ptr(), name.len()) };
        // SAFETY: on this machine, a function is its place in the table; modules have functions without parameters.
        (at != 0).then(|| unsafe { std::mem::transmute::<usize, extern "C" fn()>(at) })
    }
}

#[cfg(not(target_arch = "wasm32"))]
mod host {
    /// There is no engine.
    pub fn function(_module: &[u8], _name: &str) -> Option<extern "C" fn()> {
        None
    }
}

impl Function {
    /// Assembles an output of a plan.
    pub fn new(plan: &Plan, output: Output) -> Option<Function> {
        if plan.nodes.len() > MOST_NODES || cfg!(not(target_arch = "wasm32")) {
            return None;
        }
        let options = Options { arithmetic: Arithmetic::Exact, efforts: true, ..Options::default() };
        let reserve = |bytes: usize| vec![0_u128; bytes.div_ceil(16)].leak().as_ptr() as usize;
        let placed = place(plan, output, &options, MOST_OPERATIONS, reserve).ok()??;
        let call = host::function(&placed.module, output.name())?;
        Some(Function { call, inputs: placed.inputs, results: placed.results })
    }

    /// Computes results from arguments, with the inputs of an interpreter and parameters.
    pub fn run(&self, arguments: &[(&str, &[f64])], (inputs, params): (&Interpreter<f64>, &[f64]), to: &mut [&mut [f64]]) {
        let Interpreter { tau, drive_q, drive_v, drive_a, wrenches, gravity, .. } = inputs;
        for array in &self.inputs {
            let given = arguments.iter().find(|(name, _)| *name == array.name).map(|(_, values)| *values);
            let values: &[f64] = match (given, array.name) {
                (Some(values), _) => values,
                (None, "tau") => tau,
                (None, "drive_q") => drive_q,
                (None, "drive_v") => drive_v,
                (None, "drive_a") => drive_a,
                (None, "wrenches") => wrenches.as_flattened(),
                (None, "params") => params,
                (None, "gravity") => gravity,
                _ => continue,
            };
            assert_eq!(values.len(), array.len, "{}", array.name);
            // SAFETY: the array is part of memory that was reserved for this function and never given back.
            unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), array.address as *mut f64, array.len) };
        }
        (self.call)();
        assert_eq!(to.len(), self.results.len(), "number of results");
        for (to, array) in to.iter_mut().zip(&self.results) {
            assert_eq!(to.len(), array.len, "{}", array.name);
            // SAFETY: as above.
            unsafe { std::ptr::copy_nonoverlapping(array.address as *const f64, to.as_mut_ptr(), array.len) };
        }
    }
}
