//! Memory of large results, used again: the system takes longer to hand out fresh pages than a rollout takes to fill them.

use std::sync::{Mutex, PoisonError};

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::ALIGNMENT;

/// Length from which on memory comes from the system and goes back to it each time, doubles.
pub const LARGE: usize = 1 << 14;
/// How many pieces of memory are kept that no array uses.
const PIECES: usize = 16;
/// How many doubles all of these have at most.
pub const KEPT: usize = 1 << 23;

/// Memory that no array uses.
static FREE: Mutex<Vec<Vec<f64>>> = Mutex::new(Vec::new());

/// The numbers of a result. NumPy keeps it as long as an array shows them.
#[pyclass(frozen, module = "multibody._native")]
struct Memory {
    numbers: Vec<f64>,
    /// Where the array begins. It comes from a pointer that may write, as NumPy will.
    address: usize,
    shape: Vec<usize>,
}

#[pymethods]
impl Memory {
    /// NumPy's protocol, version 3.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let told = PyDict::new(py);
        told.set_item("shape", PyTuple::new(py, &self.shape)?)?;
        told.set_item("typestr", if cfg!(target_endian = "little") { "<f8" } else { ">f8" })?;
        let read_only = false;
        told.set_item("data", (self.address, read_only))?;
        told.set_item("version", 3)?;
        Ok(told)
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        let mut free = FREE.lock().unwrap_or_else(PoisonError::into_inner);
        free.push(std::mem::take(&mut self.numbers));
        // The oldest go first.
        while free.len() > PIECES || free.iter().map(Vec::capacity).sum::<usize>() > KEPT {
            free.remove(0);
        }
    }
}

/// An array of zeros with `total` entries that begins at a multiple of [`ALIGNMENT`] bytes.
pub fn zeros<'py>(py: Python<'py>, shape: &[usize], total: usize) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let room = total + ALIGNMENT / size_of::<f64>();
    let mut numbers = found(room).unwrap_or_else(|| vec![0.0; room]);
    let first = numbers.as_mut_ptr() as usize;
    let address = first.next_multiple_of(ALIGNMENT);
    let memory = Bound::new(py, Memory { numbers, address, shape: shape.to_vec() })?;
    Ok(py.import("numpy")?.call_method1("asarray", (memory,))?.cast_into()?)
}

/// Free memory of a length, or of up to twice that, as zeros.
fn found(length: usize) -> Option<Vec<f64>> {
    let mut free = FREE.lock().unwrap_or_else(PoisonError::into_inner);
    let fits = |(_, piece): &(usize, &Vec<f64>)| (length..=2 * length).contains(&piece.capacity());
    let (at, _) = free.iter().enumerate().filter(fits).min_by_key(|(_, piece)| piece.capacity())?;
    let mut numbers = free.remove(at);
    drop(free);
    numbers.clear();
    numbers.resize(length, 0.0);
    Some(numbers)
}
