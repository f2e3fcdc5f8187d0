//! NumPy arrays as rows of numbers: contiguous double-precision arrays without copies, everything else converted.

use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyReadwriteArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PySlice, PyTuple};

use crate::memory;

/// Number of entries from which on arrays for results begin where JAX takes them without a copy: at a multiple of so many
/// bytes. Copies of shorter ones take less time than the care for that.
const MANY: usize = 512;
pub const ALIGNMENT: usize = 64;

/// An array of one or of many rows that a caller gave.
pub struct Given<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
    name: &'static str,
    /// Number of rows; `None` for one that holds for all.
    rows: Option<usize>,
    len: usize,
}

/// The same without the interpreter.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    data: &'a [f64],
    len: usize,
    many: bool,
}

impl<'a> Rows<'a> {
    /// Row `k`.
    pub fn row(&self, k: usize) -> &'a [f64] {
        let at = if self.many { k * self.len } else { 0 };
        &self.data[at..at + self.len]
    }
}

/// A shape as Python writes it.
pub fn shape_text(shape: &[usize], batch: Option<&str>) -> String {
    let parts: Vec<String> = batch.map(str::to_string).into_iter().chain(shape.iter().map(usize::to_string)).collect();
    match &parts[..] {
        [one] => format!("({one},)"),
        _ => format!("({})", parts.join(", ")),
    }
}

/// The object as a contiguous array of doubles; a copy only where it is none.
fn doubles<'py>(object: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    if let Ok(array) = object.cast::<PyArrayDyn<f64>>() {
        // Arrays that came by a network may lie at any byte.
        if array.is_c_contiguous() && array.try_readonly().is_ok_and(|array| array.as_slice().is_ok()) {
            return Ok(array.clone());
        }
    }
    let numpy = object.py().import("numpy")?;
    let refused =
        |what: &str| PyTypeError::new_err(format!("`{name}` {what}: give numbers, as a NumPy array of float64"));
    let array = numpy.call_method1("asarray", (object,)).map_err(|_| refused("is no array"))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["b", "i", "u", "f"].contains(&kind.as_str()) {
        let dtype = array.getattr("dtype")?.str()?.to_string();
        return Err(refused(&format!("has the dtype {dtype}")));
    }
    let array = numpy.call_method1("require", (array, "float64", "CA"))?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?)
}

impl<'py> Given<'py> {
    /// Reads an array of one row of shape `shape` or, with an axis before these, of many.
    pub fn read(object: &Bound<'py, PyAny>, name: &'static str, shape: &[usize]) -> PyResult<Given<'py>> {
        let array = doubles(object, name)?;
        let found = array.shape();
        let rows = match found.len() == shape.len() + 1 {
            true => Some(found[0]),
            false => None,
        };
        if found[found.len().saturating_sub(shape.len())..] != *shape || found.len() > shape.len() + 1 {
            let (one, many) = (shape_text(shape, None), shape_text(shape, Some("B")));
            let found = shape_text(found, None);
            return Err(PyValueError::new_err(format!("`{name}` has the shape {found}; {one} or {many} is expected")));
        }
        let array = array.try_readonly().map_err(|_| in_use(name))?;
        Ok(Given { array, name, rows, len: shape.iter().product() })
    }

    /// Its numbers, row by row.
    pub fn rows(&self) -> PyResult<Rows<'_>> {
        Ok(Rows { data: self.array.as_slice()?, len: self.len, many: self.rows.is_some() })
    }
}

fn in_use(name: &str) -> PyErr {
    PyValueError::new_err(format!("`{name}` shares memory with another argument that is written: give a copy"))
}

/// The common number of rows of arrays; `None` where all are single.
pub fn batch<'a, 'py: 'a>(arrays: impl IntoIterator<Item = &'a Given<'py>>) -> PyResult<Option<usize>> {
    let mut first: Option<(&'static str, usize)> = None;
    for array in arrays {
        match (array.rows, first) {
            (Some(rows), None) => first = Some((array.name, rows)),
            (Some(rows), Some((name, expected))) if rows != expected => {
                return Err(PyValueError::new_err(format!(
                    "`{}` has {rows} rows, `{name}` has {expected}",
                    array.name
                )));
            }
            _ => {}
        }
    }
    Ok(first.map(|(_, rows)| rows))
}

/// An array for results: the caller's, if one was given, or a new one.
pub fn result<'py>(
    py: Python<'py>,
    given: Option<&Bound<'py, PyAny>>,
    name: &str,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let Some(given) = given.filter(|given| !given.is_none()) else {
        let total = shape.iter().try_fold(1_usize, |all, n| all.checked_mul(*n));
        return match total {
            Some(total) if total < MANY => Ok(PyArrayDyn::zeros(py, shape.to_vec(), false)),
            Some(total) if (memory::LARGE..=memory::KEPT).contains(&total) => memory::zeros(py, shape, total),
            _ => aligned(py, shape, total),
        };
    };
    let array = given
        .cast::<PyArrayDyn<f64>>()
        .map_err(|_| PyTypeError::new_err(format!("`out` for `{name}` is no NumPy array of float64")))?;
    if array.shape() != shape || !array.is_c_contiguous() {
        let (found, expected) = (shape_text(array.shape(), None), shape_text(shape, None));
        return Err(PyValueError::new_err(format!(
            "`out` for `{name}` has the shape {found}; a C-contiguous array of shape {expected} is expected"
        )));
    }
    Ok(array.clone())
}

/// Zeros that begin at a multiple of [`ALIGNMENT`] bytes.
fn aligned<'py>(py: Python<'py>, shape: &[usize], total: Option<usize>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    // NumPy itself says that it has no memory for so much.
    let zeros = |of: Bound<'py, PyTuple>| py.import("numpy")?.call_method1("zeros", (of,));
    let Some((total, room)) = total.and_then(|total| Some((total, total.checked_add(ALIGNMENT / size_of::<f64>())?)))
    else {
        return Ok(zeros(PyTuple::new(py, shape)?)?.cast_into()?);
    };
    let room = zeros(PyTuple::new(py, [room])?)?.cast_into::<PyArrayDyn<f64>>()?;
    let skip = (room.data() as usize).wrapping_neg() % ALIGNMENT / size_of::<f64>();
    let part = room.get_item(PySlice::new(py, skip as isize, (skip + total) as isize, 1))?;
    Ok(part.call_method1("reshape", (PyTuple::new(py, shape)?,))?.cast_into()?)
}

/// The memory of an array for results.
pub fn writable<'py>(array: &Bound<'py, PyArrayDyn<f64>>, name: &str) -> PyResult<PyReadwriteArrayDyn<'py, f64>> {
    array.try_readwrite().map_err(|e| match e {
        numpy::BorrowError::NotWriteable => PyValueError::new_err(format!("`out` for `{name}` is read-only")),
        _ => in_use("out"),
    })
}
