//! Exceptions: classes of the package's Python part, made with their data.

use std::path::Path;

use multibody::codegen::diag::{Diagnostic, Diagnostics, Severity};
use multibody::codegen::jit::CompileError;
use multibody::runtime::constrained::ConstraintError;
use multibody::runtime::integrate::StepError;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// The module with the classes.
pub const TYPES: &str = "multibody._types";

/// Findings as objects of Python.
pub fn findings<'py>(py: Python<'py>, findings: &[Diagnostic]) -> PyResult<Bound<'py, PyList>> {
    let class = py.import(TYPES)?.getattr("Finding")?;
    let list = PyList::empty(py);
    for f in findings {
        let severity = match f.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            _ => "notice",
        };
        list.append(class.call1((severity, &f.file, f.line, f.column, &f.message, &f.help))?)?;
    }
    Ok(list)
}

/// `ModelError` with findings.
pub fn model_error(py: Python<'_>, found: &Diagnostics) -> PyErr {
    let make = || -> PyResult<PyErr> {
        let class = py.import(TYPES)?.getattr("ModelError")?;
        Ok(PyErr::from_value(class.call1((found.to_string(), findings(py, &found.0)?))?))
    };
    make().unwrap_or_else(|e| e)
}

/// `ModelError` about a model as a whole.
pub fn about_model(py: Python<'_>, message: &str) -> PyErr {
    let make = || -> PyResult<PyErr> {
        let class = py.import(TYPES)?.getattr("ModelError")?;
        Ok(PyErr::from_value(class.call1((message, PyList::empty(py)))?))
    };
    make().unwrap_or_else(|e| e)
}

/// A file that cannot be read: `FileNotFoundError` and its kind.
pub fn unreadable(path: &Path, error: &std::io::Error) -> PyErr {
    let file = path.display().to_string();
    match error.raw_os_error() {
        Some(code) => {
            let words = error.to_string();
            let words = words.split(" (os error").next().unwrap_or(&words).to_string();
            PyOSError::new_err((code, words, file))
        }
        None => PyOSError::new_err(format!("cannot read `{file}`: {error}")),
    }
}

/// Why there is no machine code.
pub fn compile_error(py: Python<'_>, error: &CompileError) -> PyErr {
    match error {
        CompileError::Generate(error) => about_model(py, &error.to_string()),
        CompileError::Arrays { .. } => PyValueError::new_err(error.to_string()),
        _ => PyRuntimeError::new_err(error.to_string()),
    }
}

/// Why a motion did not go on, with its numbers.
#[derive(Clone, Debug)]
pub struct Failed {
    /// What happened, a word.
    pub kind: &'static str,
    /// What happened and what to do.
    pub message: String,
    /// Time at the start of the step that failed, s.
    pub time: f64,
    /// Numbers that belong to the kind.
    pub numbers: Vec<(&'static str, f64)>,
}

impl Failed {
    /// A step that failed.
    pub fn step(error: &StepError, message: String) -> Failed {
        let (kind, numbers) = match *error {
            StepError::NotFinite { index, .. } => ("not_finite", vec![("index", index as f64)]),
            StepError::Quaternion { index, norm, .. } => ("quaternion", vec![("index", index as f64), ("norm", norm)]),
            StepError::StepTooSmall { step, error, .. } => ("step_too_small", vec![("step", step), ("error", error)]),
            StepError::InvalidStep { step, .. } => ("invalid_step", vec![("step", step)]),
            StepError::InvalidEnd { .. } => ("invalid_end", vec![]),
            StepError::InvalidTolerances { .. } => ("invalid_tolerances", vec![]),
            StepError::NoEstimate { .. } => ("no_estimate", vec![]),
            StepError::TooManySteps { steps, .. } => ("too_many_steps", vec![("steps", steps as f64)]),
            StepError::NoConvergence { step, iterations, change, .. } => {
                ("no_convergence", vec![("step", step), ("iterations", iterations.into()), ("change", change)])
            }
            StepError::Singular { step, column, .. } => ("singular", vec![("step", step), ("column", column as f64)]),
            StepError::Constraint { error, .. } => ("constraint", constraint_numbers(&error)),
            _ => ("failed", vec![]),
        };
        Failed { kind, message, time: error.time(), numbers }
    }

    /// The start does not satisfy something.
    pub fn start(kind: &'static str, message: String, numbers: Vec<(&'static str, f64)>) -> Failed {
        Failed { kind, message, time: 0.0, numbers }
    }

    /// As an instance of `SimulationError`; `row` where there are several.
    pub fn object<'py>(&self, py: Python<'py>, row: usize) -> PyResult<Bound<'py, PyAny>> {
        let numbers = PyDict::new(py);
        for (name, number) in &self.numbers {
            numbers.set_item(name, number)?;
        }
        py.import(TYPES)?.getattr("SimulationError")?.call1((&self.message, self.kind, self.time, row, numbers))
    }
}

/// The numbers of an error about loops and couplings.
pub fn constraint_numbers(error: &ConstraintError) -> Vec<(&'static str, f64)> {
    match *error {
        ConstraintError::NotClosed { constraint, residual, rank, rows, iterations } => vec![
            ("constraint", constraint as f64),
            ("residual", residual),
            ("rank", rank as f64),
            ("rows", rows as f64),
            ("iterations", iterations.into()),
        ],
        ConstraintError::Incompatible { constraint, residual, rank, rows } => vec![
            ("constraint", constraint as f64),
            ("residual", residual),
            ("rank", rank as f64),
            ("rows", rows as f64),
        ],
        ConstraintError::RankLoss { constraint, rank, before } => {
            vec![("constraint", constraint as f64), ("rank", rank as f64), ("before", before as f64)]
        }
        ConstraintError::NotFinite { index } => vec![("index", index as f64)],
        _ => vec![],
    }
}
