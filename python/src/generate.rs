//! Generated code as texts.

use multibody::codegen::model::Model;
use multibody::codegen::options::Precision;
use multibody::codegen::{self, c, camel_case, wasm, Options};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::about_model;
use crate::evaluate;

/// What is to be generated.
pub struct Asked<'a> {
    pub lang: &'a str,
    pub outputs: Option<Vec<String>>,
    pub name: Option<String>,
    pub scalar: &'a str,
    pub frames: Vec<String>,
}

/// Whether generated code can call a type so.
fn is_type_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_uppercase())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && name != "Self"
}

/// Options of the generator.
fn options(model: &Model, of: &Options, asked: &Asked) -> PyResult<Options> {
    let Some(precision) = Precision::from_name(asked.scalar) else {
        return Err(PyValueError::new_err(format!("no scalar is called `{}`: take f64 or f32", asked.scalar)));
    };
    let type_name = asked.name.clone().unwrap_or_else(|| camel_case(&model.name));
    if !is_type_name(&type_name) {
        let words = "a type is named with letters, digits and `_`, an upper-case letter first";
        return Err(PyValueError::new_err(format!("`{type_name}`: {words}")));
    }
    let mut options = Options { precision, type_name, frames: asked.frames.clone(), ..of.clone() };
    if let Some(outputs) = &asked.outputs {
        options.outputs.clear();
        for name in outputs {
            let output = evaluate::output(name)?;
            if !options.outputs.contains(&output) {
                options.outputs.push(output);
            }
        }
    }
    Ok(options)
}

/// Code by name of file.
pub fn generate<'py>(py: Python<'py>, model: &Model, of: &Options, asked: Asked) -> PyResult<Bound<'py, PyDict>> {
    let options = options(model, of, &asked)?;
    let (files, name) = (PyDict::new(py), &model.name);
    let failed = |error: codegen::GenerateError| about_model(py, &error.to_string());
    match asked.lang {
        "rust" => {
            let made = py.detach(|| codegen::generate(model, &options)).map_err(failed)?;
            files.set_item(format!("{name}.rs"), made.source)?;
        }
        "c" => {
            let made = py.detach(|| c::generate(model, &options, name)).map_err(failed)?;
            files.set_item(format!("{name}.h"), made.header)?;
            files.set_item(format!("{name}.c"), made.source)?;
        }
        "wasm" | "wasm-lanes" => {
            let lanes = asked.lang == "wasm-lanes";
            let make = || if lanes { wasm::generate_lanes(model, &options) } else { wasm::generate(model, &options) };
            let made = py.detach(make).map_err(failed)?;
            files.set_item(format!("{name}.wasm"), PyBytes::new(py, &made.module))?;
            files.set_item(format!("{name}.js"), made.wrapper)?;
            files.set_item(format!("{name}.d.ts"), made.types)?;
        }
        other => {
            let words = format!("no language is called `{other}`: take rust, c, wasm or wasm-lanes");
            return Err(PyValueError::new_err(words));
        }
    }
    Ok(files)
}
