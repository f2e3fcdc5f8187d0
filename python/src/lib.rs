//! The native part of the Python package `multibody`: classes and functions over `mbd-codegen` and `mbd-runtime`. Nothing
//! of mechanics is computed here.

mod arrays;
mod contacts;
mod driver;
mod drives;
mod errors;
mod evaluate;
mod generate;
mod lanes;
mod machines;
mod memory;
mod model;
mod read;
mod rollout;
mod rows;
mod settings;
mod told;

use std::path::PathBuf;

use multibody::codegen::output::{Dim, Output};
use multibody::runtime::catalogue;
use pyo3::prelude::*;
use pyo3::types::PyList;

/// Findings about a description.
#[pyfunction]
#[pyo3(signature = (path = None, *, text = None, format = "toml", base = "fixed", gravity = None, limits = false, floor = None,
    self_contact = None))]
fn check<'py>(
    py: Python<'py>,
    path: Option<PathBuf>,
    text: Option<String>,
    format: &str,
    base: &str,
    gravity: Option<[f64; 3]>,
    limits: bool,
    floor: Option<(f64, f64)>,
    self_contact: Option<f64>,
) -> PyResult<Bound<'py, PyList>> {
    read::check(py, &read::source(path, text, format)?, &read::options(base, gravity, limits, floor, self_contact)?)
}

/// A description as one of the TOML format.
#[pyfunction]
#[pyo3(signature = (path = None, *, text = None, format = "toml", base = "fixed", gravity = None, limits = false))]
fn convert(
    py: Python<'_>,
    path: Option<PathBuf>,
    text: Option<String>,
    format: &str,
    base: &str,
    gravity: Option<[f64; 3]>,
    limits: bool,
) -> PyResult<String> {
    read::convert(py, &read::source(path, text, format)?, &read::options(base, gravity, limits, None, None)?)
}

/// Name, arguments, results and documentation of an output.
type Row = (&'static str, Vec<(&'static str, String)>, Vec<(&'static str, String)>, String);

/// The table of outputs.
#[pyfunction]
fn outputs() -> Vec<Row> {
    let arrays = |arrays: &[multibody::codegen::output::Array]| {
        let text = |dims: &[Dim]| dims.iter().map(|dim| dim.text()).collect::<Vec<_>>().join(", ");
        arrays.iter().map(|array| (array.name, text(array.dims))).collect()
    };
    let row = |output: &Output| {
        let spec = output.spec();
        (spec.name, arrays(spec.inputs), arrays(spec.results), spec.doc().collect::<Vec<_>>().join("\n"))
    };
    Output::ALL.iter().map(row).collect()
}

/// The methods of integration: name, title, whether they can choose their steps.
#[pyfunction]
fn methods() -> Vec<(&'static str, &'static str, bool)> {
    catalogue::entries().map(|entry| (entry.name, entry.title, entry.adaptive)).collect()
}

/// Tells what it means that a panic ends the program, which it does in wheels that are distributed.
#[cfg(panic = "abort")]
fn explain_panics() {
    let told = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        told(panic);
        eprintln!("multibody: this is a defect of the package; report it with the lines above. The program ends.");
    }));
}

/// The native part of the package.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    #[cfg(panic = "abort")]
    explain_panics();
    module.add_class::<model::Model>()?;
    module.add_function(wrap_pyfunction!(model::load, module)?)?;
    module.add_function(wrap_pyfunction!(model::restore, module)?)?;
    module.add_function(wrap_pyfunction!(check, module)?)?;
    module.add_function(wrap_pyfunction!(convert, module)?)?;
    module.add_function(wrap_pyfunction!(outputs, module)?)?;
    module.add_function(wrap_pyfunction!(methods, module)?)
}
