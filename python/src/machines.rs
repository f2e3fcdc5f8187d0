//! Machine code of a model, with working memory for as many callers as there are at once.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use multibody::codegen::jit::{CompileError, Compiled};
use multibody::codegen::model::{Gravity, Model};
use multibody::codegen::output::{Output, Sizes, FIELDS};
use multibody::codegen::Options;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{batch, Given};
use crate::contacts::Touching;
use crate::lanes::AnyLanes;

/// Gravity where it is an input and nobody gives it, m/s²: the default of generated code.
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

/// The machine code.
pub struct Machines {
    template: Compiled,
    /// Of each of [`FIELDS`], what is given where a call gives nothing.
    defaults: Vec<Vec<f64>>,
    pool: Mutex<Vec<Compiled>>,
    options: Options,
    /// With its contacts, made when they are first followed, and those that calls have given back.
    touching: OnceLock<Result<Touching, CompileError>>,
    kept: Mutex<Vec<Touching>>,
    /// A bit for each output whose code is there.
    prepared: AtomicU64,
}

impl Machines {
    /// The machine code of a model; functions are compiled when they are first needed.
    pub fn new(model: &Model, options: &Options) -> Result<Machines, CompileError> {
        let mut template = Compiled::new(model, options)?;
        if model.gravity == Gravity::Input {
            template.inputs().gravity = GRAVITY;
        }
        let params = template.parameters().to_vec();
        let inputs = template.inputs();
        let default = |name: &str| match name {
            "tau" => inputs.tau.clone(),
            "drive_q" => inputs.drive_q.clone(),
            "drive_v" => inputs.drive_v.clone(),
            "drive_a" => inputs.drive_a.clone(),
            "wrenches" => inputs.wrenches.as_flattened().to_vec(),
            "params" => params.clone(),
            "gravity" => inputs.gravity.to_vec(),
            _ => Vec::new(),
        };
        let defaults = FIELDS.iter().map(|field| default(field.array.name)).collect();
        Ok(Machines {
            defaults,
            template,
            pool: Mutex::default(),
            options: options.clone(),
            touching: OnceLock::new(),
            kept: Mutex::default(),
            prepared: AtomicU64::new(0),
        })
    }

    /// Lengths of all arrays.
    pub fn sizes(&self) -> Sizes {
        *self.template.sizes()
    }

    /// One with all inputs at their defaults.
    pub fn take(&self) -> Compiled {
        let kept = self.pool.lock().unwrap_or_else(PoisonError::into_inner).pop();
        kept.unwrap_or_else(|| self.template.clone())
    }

    /// Keeps one for later, after a call that has set these of [`FIELDS`].
    pub fn give_back(&self, mut machine: Compiled, fields: impl Iterator<Item = usize>) {
        machine.set_drives(None);
        machine.restore_row_order();
        let drives = FIELDS.iter().enumerate().filter(|(_, field)| ["drive_q", "drive_v"].contains(&field.array.name));
        fields.chain(drives.map(|(at, _)| at)).for_each(|field| machine.set_field(field, &self.defaults[field]));
        machine.efforts().fill(0.0);
        self.pool.lock().unwrap_or_else(PoisonError::into_inner).push(machine);
    }

    /// Up to so many states at once, if the model is not too large for that.
    pub fn lanes(&self, most: usize) -> Option<AnyLanes> {
        AnyLanes::new(&self.template, most)
    }

    /// What is given where a call gives nothing, of each of [`FIELDS`].
    pub fn defaults(&self) -> &[Vec<f64>] {
        &self.defaults
    }

    /// Keeps a mechanism with contacts for later: with the sets of modes that it has visited.
    pub fn keep(&self, touching: Touching) {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).push(touching);
    }

    /// The mechanism with its contacts, for rollouts.
    pub fn touching(&self) -> Result<Touching, CompileError> {
        if let Some(kept) = self.kept.lock().unwrap_or_else(PoisonError::into_inner).pop() {
            return Ok(kept);
        }
        let gravity = self.template.clone().inputs().gravity;
        let make = || Touching::new(self.template.plan(), &self.options, gravity);
        self.touching.get_or_init(make).clone()
    }

    /// Compiles an output, if it is not yet.
    pub fn prepare(&self, py: Python<'_>, output: Output) -> Result<(), CompileError> {
        let bit = 1_u64 << (output as u64 & 63);
        if self.prepared.load(Ordering::Relaxed) & bit == 0 {
            match py.detach(|| self.template.prepare(output)) {
                Ok(()) | Err(CompileError::TooLarge { .. }) => {}
                Err(error) => return Err(error),
            }
            self.prepared.fetch_or(bit, Ordering::Relaxed);
        }
        Ok(())
    }
}

/// What is given beside the state, by index into [`FIELDS`].
pub struct Inputs<'py>(pub Vec<(usize, Given<'py>)>);

impl<'py> Inputs<'py> {
    /// Reads a dictionary of inputs; an entry `None` is not given.
    pub fn read(given: Option<&Bound<'py, PyDict>>, sizes: &Sizes) -> PyResult<Inputs<'py>> {
        let mut inputs = Vec::new();
        for (name, value) in given.into_iter().flatten() {
            if value.is_none() {
                continue;
            }
            let name: String = name.extract()?;
            let known = FIELDS.iter().position(|field| field.array.name == name && name != "acts");
            let Some(at) = known else {
                return Err(PyTypeError::new_err(format!("`{name}` is no input of a model")));
            };
            let array = &FIELDS[at].array;
            if array.len(sizes) == 0 {
                return Err(PyValueError::new_err(format!("the model has no input `{name}`")));
            }
            inputs.push((at, Given::read(&value, array.name, &array.lengths(sizes))?));
        }
        Ok(Inputs(inputs))
    }

    /// The common number of rows of these and other arrays.
    pub fn batch<'a>(&'a self, others: impl IntoIterator<Item = &'a Given<'py>>) -> PyResult<Option<usize>>
    where
        'py: 'a,
    {
        batch(others.into_iter().chain(self.0.iter().map(|(_, given)| given)))
    }
}
