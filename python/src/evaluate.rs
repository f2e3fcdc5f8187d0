//! Any output of the generator's table, on one state or on many.

use multibody::codegen::jit::{CompileError, Compiled};
use multibody::codegen::output::Output;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{result, writable, Given, Rows};
use crate::errors::compile_error;
use crate::lanes::AnyLanes;
use crate::machines::{Inputs, Machines};

/// Number of states from which on other threads of Python may run meanwhile.
const MANY: usize = 64;

/// Computes an output. `out` are arrays for its results: one, or a tuple of them.
pub fn evaluate<'py>(
    py: Python<'py>,
    machines: &Machines,
    output: Output,
    arguments: &Bound<'py, PyTuple>,
    inputs: &Inputs<'py>,
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let (spec, sizes) = (output.spec(), machines.sizes());
    if arguments.len() != spec.inputs.len() {
        let (expected, found) = (spec.inputs.len(), arguments.len());
        let message = format!("`{}` takes {expected} arrays, {}; {found} were given", spec.name, spec.arrow());
        return Err(PyTypeError::new_err(message));
    }
    machines.prepare(py, output).map_err(|e| compile_error(py, &e))?;
    let given = spec.inputs.iter().zip(arguments);
    let given = given.map(|(array, object)| Given::read(&object, array.name, &array.lengths(&sizes)));
    let given = given.collect::<PyResult<Vec<_>>>()?;
    let batch = inputs.batch(&given)?;
    let given_out = match out {
        None => vec![None; spec.results.len()],
        Some(one) if spec.results.len() == 1 => vec![Some(one.clone())],
        Some(several) => {
            let several = several.cast::<PyTuple>().ok().filter(|tuple| tuple.len() == spec.results.len());
            let Some(several) = several else {
                let message = format!("`out` has to be a tuple of {} arrays", spec.results.len());
                return Err(PyTypeError::new_err(message));
            };
            several.iter().map(Some).collect()
        }
    };
    let shape = |array: &multibody::codegen::output::Array| -> Vec<usize> {
        batch.into_iter().chain(array.lengths(&sizes)).collect()
    };
    let results = spec.results.iter().zip(&given_out);
    let results = results.map(|(array, out)| result(py, out.as_ref(), array.name, &shape(array)));
    let results = results.collect::<PyResult<Vec<_>>>()?;
    let locks = results.iter().zip(spec.results).map(|(array, spec)| writable(array, spec.name));
    let mut locks = locks.collect::<PyResult<Vec<_>>>()?;
    {
        let slices = locks.iter_mut().map(|lock| Ok(lock.as_slice_mut()?));
        let slices = slices.collect::<PyResult<Vec<&mut [f64]>>>()?;
        let arguments = given.iter().map(Given::rows).collect::<PyResult<Vec<Rows>>>()?;
        let fields = inputs.0.iter().map(|(field, given)| Ok((*field, given.rows()?)));
        let fields = fields.collect::<PyResult<Vec<(usize, Rows)>>>()?;
        let count = batch.unwrap_or(1);
        let mut machine = machines.take();
        let work = Work { output, arguments: &arguments, fields: &fields, count };
        let done =
            if count < MANY { work.run(&mut machine, slices) } else { py.detach(|| work.run(&mut machine, slices)) };
        machines.give_back(machine, inputs.0.iter().map(|(field, _)| *field));
        done.map_err(|e| compile_error(py, &e))?;
    }
    drop(locks);
    PyTuple::new(py, results)
}

/// What is computed, without the interpreter.
struct Work<'a> {
    output: Output,
    arguments: &'a [Rows<'a>],
    fields: &'a [(usize, Rows<'a>)],
    count: usize,
}

impl Work<'_> {
    fn run(&self, machine: &mut Compiled, mut rest: Vec<&mut [f64]>) -> Result<(), CompileError> {
        if self.count >= MANY {
            if let Some(mut lanes) = AnyLanes::new(machine, usize::MAX) {
                if lanes.prepare(self.output).is_ok() {
                    return lanes.evaluate(self.output, (self.arguments, self.fields), self.count, &mut rest);
                }
            }
        }
        let lengths: Vec<usize> = rest.iter().map(|all| all.len() / self.count.max(1)).collect();
        for k in 0..self.count {
            self.fields.iter().for_each(|(field, rows)| machine.set_field(*field, rows.row(k)));
            let arguments: Vec<&[f64]> = self.arguments.iter().map(|rows| rows.row(k)).collect();
            let mut results: Vec<_> = rest.iter_mut().zip(&lengths).map(|(all, len)| first(all, *len)).collect();
            machine.evaluate_or_interpret(self.output, &arguments, &mut results)?;
        }
        Ok(())
    }
}

/// Takes the first numbers away from the rest.
fn first<'a>(rest: &mut &'a mut [f64], n: usize) -> &'a mut [f64] {
    rest.split_off_mut(..n).unwrap_or_default()
}

/// The output of a name.
pub fn output(name: &str) -> PyResult<Output> {
    Output::from_name(name).ok_or_else(|| {
        let names: Vec<&str> = Output::ALL.iter().map(|output| output.name()).collect();
        let names = names.iter().copied();
        let help = multibody::codegen::words::did_you_mean(name, names.clone(), || {
            format!("outputs are {}", multibody::codegen::words::list(names))
        });
        PyValueError::new_err(format!("no output is called `{name}`: {help}"))
    })
}
