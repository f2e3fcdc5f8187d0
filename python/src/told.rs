//! What a rollout tells beside states: events of contacts, events of a caller's functions, forces of contacts.

use std::sync::{Mutex, PoisonError};

use multibody::codegen::jit::Compiled;
use multibody::codegen::plan::Plan;
use multibody::runtime::contact::{ContactEvent, ContactObserver, Mode, ModeTable, WithContacts};
use multibody::runtime::integrate::{Direction, Events, Watch};
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::errors::TYPES;
use crate::rollout::{Motion, State};

/// Most functions of a caller.
pub const MOST: usize = 16;

/// What is to be told; a dictionary of Python.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Asked {
    /// Whether the events of contacts are told.
    pub contacts: bool,
    /// Whether the forces of contacts are.
    pub forces: bool,
    /// Functions, directions (−1, 0, 1) and whether the motion ends.
    pub functions: Vec<(Py<PyAny>, i8, bool)>,
}

impl Asked {
    /// Refuses what cannot be told of a model.
    pub fn check(&self, touches: bool) -> PyResult<()> {
        if self.functions.len() > MOST {
            let words = format!("`events` has {} functions: give {MOST} at most", self.functions.len());
            return Err(PyValueError::new_err(words));
        }
        if touches && !self.functions.is_empty() {
            let words =
                "`events` cannot be looked for in a motion with contacts: take those of the contacts, events=True";
            return Err(PyValueError::new_err(words));
        }
        if !touches && (self.contacts || self.forces) {
            let what = if self.forces { "forces" } else { "events" };
            return Err(PyValueError::new_err(format!("the model has no contacts whose {what} could be told")));
        }
        Ok(())
    }

    /// How the functions are watched.
    fn watches(&self) -> [Watch; MOST] {
        let mut watches = [Watch { direction: Direction::Both, terminal: false }; MOST];
        for (watch, (_, direction, terminal)) in watches.iter_mut().zip(&self.functions) {
            let direction = match direction {
                1.. => Direction::Rising,
                0 => Direction::Both,
                _ => Direction::Falling,
            };
            *watch = Watch { direction, terminal: *terminal };
        }
        watches
    }
}

/// An event of a row.
pub enum Event {
    Contact(ContactEvent<f64>),
    /// Index of the function, time, state.
    Function(usize, f64, Vec<f64>, Vec<f64>),
}

/// What all rows have told so far.
#[derive(Default)]
pub struct Told {
    events: Mutex<Vec<(usize, Event)>>,
    forces: Mutex<Vec<(usize, Vec<[f64; 3]>)>>,
}

impl Told {
    /// Takes the events of a row.
    pub fn events(&self, row: usize, events: impl IntoIterator<Item = Event>) {
        let mut all = self.events.lock().unwrap_or_else(PoisonError::into_inner);
        all.extend(events.into_iter().map(|event| (row, event)));
    }

    /// Takes the forces of the contacts of a row, contact by contact in every kept state.
    pub fn forces(&self, row: usize, forces: Vec<[f64; 3]>) {
        self.forces.lock().unwrap_or_else(PoisonError::into_inner).push((row, forces));
    }

    /// All events as objects of Python, row by row and in the order of time.
    pub fn list<'py>(self, py: Python<'py>, plan: &Plan) -> PyResult<Bound<'py, PyList>> {
        let mut events = self.events.into_inner().unwrap_or_else(PoisonError::into_inner);
        events.sort_by_key(|(row, _)| *row);
        let types = py.import(TYPES)?;
        let (contact, function) = (types.getattr("ContactEvent")?, types.getattr("Crossing")?);
        let list = PyList::empty(py);
        for (row, event) in events {
            list.append(match event {
                Event::Function(index, time, q, v) => {
                    function.call1((row, time, index, PyArray1::from_vec(py, q), PyArray1::from_vec(py, v)))?
                }
                Event::Contact(event) => {
                    let of = &plan.model.contacts[event.contact];
                    let energy = event.impact.map_or(0.0, |impact| impact.energy);
                    let mode = mode(event.modes[1], of.friction > 0.0);
                    contact.call1((row, event.time, &of.name, event.cause.verb(), mode, event.approach, energy))?
                }
            })?;
        }
        Ok(list)
    }

    /// Writes the forces of all rows; what no row has told is not a number.
    pub fn write_forces(&self, per_row: usize, to: &mut [f64]) {
        to.fill(f64::NAN);
        for (row, forces) in self.forces.lock().unwrap_or_else(PoisonError::into_inner).iter() {
            to[row * per_row..][..3 * forces.len()].copy_from_slice(forces.as_flattened());
        }
    }
}

/// What a contact does, an adjective.
fn mode(mode: Mode, rubs: bool) -> &'static str {
    match mode {
        Mode::Open => "open",
        Mode::Slide if !rubs => "closed",
        Mode::Slide => "sliding",
        Mode::Stick => "sticking",
    }
}

/// What is kept of the contacts of a row, where it is asked for.
pub struct Kept {
    pub events: Option<Vec<Event>>,
    /// Of every contact in every state that is kept: along its normal and its two tangents, N (N m for stops of rotations).
    pub forces: Option<Vec<[f64; 3]>>,
}

impl Kept {
    /// Keeps the forces of a state.
    pub fn forces(&mut self, forces: impl FnOnce() -> Vec<[f64; 3]>) {
        if let Some(kept) = &mut self.forces {
            kept.extend(forces());
        }
    }
}

impl ContactObserver<ModeTable<Compiled>> for Kept {
    fn event(&mut self, _: &mut WithContacts<ModeTable<Compiled>>, event: &ContactEvent<f64>) {
        if let Some(events) = &mut self.events {
            events.push(Event::Contact(*event));
        }
    }
}

/// Looks for the zeros of a caller's functions in a row.
pub struct Watcher<'a> {
    motion: &'a Motion<'a>,
    state: State,
    shown: (Vec<f64>, Vec<f64>),
    pub events: Vec<Event>,
    /// What a function has raised.
    pub error: Option<PyErr>,
}

impl<'a> Watcher<'a> {
    pub fn new(motion: &'a Motion<'a>, state: &State) -> Self {
        let (nq, nv) = motion.sizes;
        let state = State { q: state.q.clone(), p: state.p.clone(), v: state.v.clone() };
        Watcher { motion, state, shown: (vec![0.0; nq], vec![0.0; nv]), events: Vec::new(), error: None }
    }

    /// The state as the caller knows it.
    fn show(&mut self, machine: &mut Compiled, t: f64, q: &[f64], p: &[f64]) {
        self.state.q.copy_from_slice(q);
        self.state.p.copy_from_slice(p);
        self.motion.store(machine, t, &mut self.state, &mut self.shown.0, &mut self.shown.1);
    }

    fn call(&self, t: f64) -> PyResult<[f64; MOST]> {
        let mut values = [f64::NAN; MOST];
        Python::attach(|py| {
            let (q, v) = (PyArray1::from_slice(py, &self.shown.0), PyArray1::from_slice(py, &self.shown.1));
            for (value, (function, ..)) in values.iter_mut().zip(&self.motion.asked.functions) {
                *value = function.call1(py, (t, &q, &v))?.extract(py)?;
            }
            Ok(values)
        })
    }
}

impl Events<Compiled, MOST> for Watcher<'_> {
    fn watches(&self) -> [Watch; MOST] {
        self.motion.asked.watches()
    }

    fn values(&mut self, machine: &mut Compiled, t: f64, q: &Vec<f64>, p: &Vec<f64>) -> [f64; MOST] {
        // Values that are no numbers are ignored, so that nothing happens after an exception.
        if self.error.is_some() {
            return [f64::NAN; MOST];
        }
        self.show(machine, t, q, p);
        self.call(t).unwrap_or_else(|error| {
            self.error = Some(error);
            [f64::NAN; MOST]
        })
    }

    fn happened(&mut self, machine: &mut Compiled, event: usize, t: f64, q: &Vec<f64>, p: &Vec<f64>) {
        self.show(machine, t, q, p);
        self.events.push(Event::Function(event, t, self.shown.0.clone(), self.shown.1.clone()));
    }
}

/// An array for forces and its shape: `(B, T + 1, C, 3)`.
pub fn forces_array<'py>(py: Python<'py>, told: &Told, shape: Vec<usize>, rows: usize) -> PyResult<Bound<'py, PyAny>> {
    let array = crate::arrays::result(py, None, "forces", &shape)?;
    {
        let mut lock = crate::arrays::writable(&array, "forces")?;
        let all = lock.as_slice_mut()?;
        told.write_forces(all.len() / rows.max(1), all);
    }
    Ok(array.into_any())
}
