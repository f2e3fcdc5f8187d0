//! Reading, checking and converting descriptions.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use multibody::codegen::diag::Diagnostics;
use multibody::codegen::model::{Joint, Model, Wrench, WrenchAxes};
use multibody::codegen::read::{self, Base, Floor, ImportOptions};
use multibody::codegen::words;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::errors::{about_model, findings, model_error, unreadable};

/// A text and the name of its file.
pub struct Source {
    pub file: String,
    pub text: String,
}

/// The text of a file, or one that is given with its format.
pub fn source(path: Option<PathBuf>, text: Option<String>, format: &str) -> PyResult<Source> {
    match (path, text) {
        (Some(path), None) => {
            let bytes = read::read_bytes(&path).map_err(|error| unreadable(&path, &error))?;
            let wrong = |_| std::io::Error::new(std::io::ErrorKind::InvalidData, "it is not UTF-8 text");
            let text = String::from_utf8(bytes).map_err(wrong).map_err(|error| unreadable(&path, &error))?;
            Ok(Source { file: path.display().to_string(), text })
        }
        (None, Some(text)) => Ok(Source { file: format!("text.{format}"), text }),
        _ => Err(PyValueError::new_err("give either a path or `text=`")),
    }
}

/// Import options from their words.
pub fn options(
    base: &str,
    gravity: Option<[f64; 3]>,
    limits: bool,
    floor: Option<(f64, f64)>,
    self_contact: Option<f64>,
) -> PyResult<ImportOptions> {
    let Some(base) = Base::from_name(base) else {
        let names = Base::ALL.map(Base::name);
        return Err(PyValueError::new_err(format!("no base is called `{base}`: take one of {}", names.join(", "))));
    };
    let floor = floor.map(|(height, friction)| Floor { height, friction });
    Ok(ImportOptions { base, gravity, limits, floor, self_contact })
}

/// Files that a description reads, by their paths.
pub type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Reads a model, with the wrenches that are asked for by the names of bodies. What it reads beside the text is taken from
/// `files`, or kept there.
pub fn model(
    py: Python<'_>,
    source: &Source,
    options: &ImportOptions,
    variant: Option<&str>,
    wrenches: &[String],
    files: &mut Files,
) -> PyResult<(Model, Diagnostics)> {
    let known = Mutex::new(files);
    let file = |path: &Path| {
        let mut files = known.lock().unwrap_or_else(PoisonError::into_inner);
        match files.get(path) {
            Some(bytes) => Ok(bytes.clone()),
            None => read::read_bytes(path).inspect(|bytes| {
                files.insert(path.into(), bytes.clone());
            }),
        }
    };
    let read = || read::load_variant(&source.file, &source.text, options, &file, variant);
    let (model, found) = py.detach(read);
    let Some(mut model) = model else { return Err(model_error(py, &found)) };
    for name in wrenches {
        let names = model.bodies.iter().map(|b| b.name.as_str());
        let Some(body) = model.bodies.iter().position(|b| b.name == *name) else {
            let help = words::did_you_mean(name, names.clone(), || format!("bodies are {}", words::list(names)));
            return Err(about_model(py, &format!("wrenches: no body is named {}: {help}", words::quote(name))));
        };
        if model.wrenches.iter().any(|w| w.name == *name) {
            return Err(about_model(py, &format!("wrenches: there is one named {} already", words::quote(name))));
        }
        model.wrenches.push(Wrench { name: name.clone(), body, axes: WrenchAxes::Body });
    }
    Ok((model, found))
}

/// Gains of position control by the names of joints, and those of all other joints with axes; N m/rad or N/m, and N m s/rad or
/// N s/m.
pub type Gains = (BTreeMap<String, (f64, f64)>, Option<(f64, f64)>);

/// Gives joints springs and dampers with these gains. Returns the gains of every joint.
pub fn add_gains(py: Python<'_>, model: &mut Model, (named, all): &Gains) -> PyResult<Vec<(f64, f64)>> {
    let takes = |joint: &&Joint| joint.has_axes() && joint.kind.nv() > 0;
    for name in named.keys() {
        let names = model.joints.iter().filter(takes).map(|joint| joint.name.as_str());
        if !names.clone().any(|known| known == name) {
            let help =
                words::did_you_mean(name, names.clone(), || format!("position control moves {}", words::list(names)));
            let words = format!("gains: no joint that position control can move is named {}", words::quote(name));
            return Err(about_model(py, &format!("{words}: {help}")));
        }
    }
    let of = |joint: &Joint| takes(&joint).then(|| named.get(&joint.name).copied().or(*all)).flatten();
    let gains: Vec<(f64, f64)> = model.joints.iter().map(|joint| of(joint).unwrap_or_default()).collect();
    for (joint, (kp, kd)) in model.joints.iter_mut().zip(&gains) {
        let sound = |gain: f64| gain >= 0.0 && gain.is_finite();
        if !(sound(*kp) && sound(*kd)) {
            let words = format!("`gains` of {} are {kp} and {kd}: give numbers from 0 on", words::quote(&joint.name));
            return Err(PyValueError::new_err(words));
        }
        if (*kp, *kd) != (0.0, 0.0) && joint.add_gains(*kp, *kd).is_none() {
            let of = "has a spring or a damper that is a parameter, to which none can be added";
            return Err(about_model(py, &format!("gains: {} {of}", words::quote(&joint.name))));
        }
    }
    Ok(gains)
}

/// All findings about a description.
pub fn check<'py>(py: Python<'py>, source: &Source, options: &ImportOptions) -> PyResult<Bound<'py, PyList>> {
    let (_, found) = py.detach(|| read::load_with(&source.file, &source.text, options, &read::read_bytes));
    findings(py, &found.0)
}

/// A description as one of the TOML format.
pub fn convert(py: Python<'_>, source: &Source, options: &ImportOptions) -> PyResult<String> {
    let converted = py.detach(|| read::to_toml(&source.file, &source.text, options, &read::read_bytes));
    converted.map(|(text, _)| text).map_err(|found| model_error(py, &found))
}
