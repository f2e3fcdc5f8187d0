//! Motions of many rows: arguments, results, and one row.

use std::sync::{Mutex, PoisonError};

use multibody::codegen::jit::Compiled;
use multibody::codegen::output::Output;
use multibody::runtime::contact::{ImpactOrder, RegimeChoice};
use multibody::runtime::integrate::StepError;
use multibody::runtime::layout::Layout;
use multibody::runtime::{Conjugate, Constrained, System};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::{result, writable, Given, Rows};
use crate::contacts::Touching;
use crate::driver::{rates_tell_velocities, Driver};
use crate::drives::{self, Moving};
use crate::errors::{compile_error, Failed};
use crate::lanes::{self, AnyLanes};
use crate::machines::{Inputs, Machines};
use crate::model::Model;
use crate::rows::{on_threads, Beat};
use crate::settings::Settings;
use crate::told::{self, Asked, Told, Watcher};

/// Residual up to which the loops of a start count as closed, m or rad.
const OPEN: f64 = 1e-6;

/// Coordinates, velocities or momenta, failures, events, forces of contacts.
pub type Results<'py> = (
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyList>,
    Bound<'py, PyList>,
    Option<Bound<'py, PyAny>>,
);

/// What is given beside starts and settings.
pub struct Beside<'a, 'py> {
    pub u: Option<Bound<'py, PyAny>>,
    pub inputs: Option<&'a Bound<'py, PyDict>>,
    /// Positions and rates of the prescribed joints.
    pub drives: Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>,
}

/// Motions of all rows.
pub fn rollout<'py>(
    py: Python<'py>,
    model: &Model,
    start: (Bound<'py, PyAny>, Bound<'py, PyAny>),
    beside: Beside<'_, 'py>,
    settings: Settings,
    asked: Asked,
    out: Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>,
) -> PyResult<Results<'py>> {
    settings.check()?;
    let touches = !model.description.contacts.is_empty();
    asked.check(touches)?;
    let (layout, machines) = (settings.layout(model)?, model.machines(py)?);
    for output in [Output::Rates, Output::Velocities, Output::Momenta] {
        machines.prepare(py, output).map_err(|e| compile_error(py, &e))?;
    }
    let (regime, impacts) = (settings.regime(touches)?, settings.impacts(touches)?);
    if touches {
        py.detach(|| machines.touching().map(|made| machines.keep(made))).map_err(|e| compile_error(py, &e))?;
    }
    let dims = model.plan.dims;
    let (nq, nv) = layout.as_ref().map_or((dims.nq, dims.nv), Layout::sizes);
    let second = if settings.momenta { "p0" } else { "v0" };
    let q0 = Given::read(&start.0, "q0", &[nq])?;
    let v0 = Given::read(&start.1, second, &[nv])?;
    let u = beside.u.map(|u| Given::read(&u, "u", &[settings.steps, nv])).transpose()?;
    let inputs = Inputs::read(beside.inputs, &machines.sizes())?;
    let moving = beside.drives.as_ref();
    let moving = moving.map(|d| Moving::read(d, &model.plan, &machines.sizes(), settings.steps)).transpose()?;
    let (drive_q, drive_v) = (moving.as_ref().map(|m| &m.q), moving.as_ref().map(|m| &m.v));
    let batch = inputs.batch([Some(&q0), Some(&v0), u.as_ref(), drive_q, drive_v].into_iter().flatten())?;
    let count = (settings.steps / settings.every).saturating_add(1);
    let shape = |n: usize| -> Vec<usize> { batch.into_iter().chain([count, n]).collect() };
    let (q_out, v_out) = (out.as_ref().map(|out| &out.0), out.as_ref().map(|out| &out.1));
    let (q, v) = (result(py, q_out, "q", &shape(nq))?, result(py, v_out, "v", &shape(nv))?);
    let (told, rows) = (Told::default(), batch.unwrap_or(1));
    let failures = {
        let (mut q_lock, mut v_lock) = (writable(&q, "q")?, writable(&v, "v")?);
        let (q_all, v_all) = (q_lock.as_slice_mut()?, v_lock.as_slice_mut()?);
        let fields = inputs.0.iter().map(|(field, given)| Ok((*field, given.rows()?))).collect::<PyResult<Vec<_>>>()?;
        let motion = Motion {
            settings: &settings,
            layout: layout.as_ref(),
            sizes: (nq, nv),
            start: (q0.rows()?, v0.rows()?),
            u: u.as_ref().map(Given::rows).transpose()?,
            fields,
            moving: moving.as_ref().map(|m| Ok::<_, PyErr>((m.q.rows()?, m.v.rows()?))).transpose()?,
            touches,
            regime,
            impacts,
            asked: &asked,
            told: &told,
        };
        motion.all(py, machines, rows, (q_all, v_all))?
    };
    let list = PyList::empty(py);
    for (row, failed) in failures {
        list.append(failed.object(py, row)?)?;
    }
    let forces = asked.forces.then(|| {
        let shape = batch.into_iter().chain([count, model.description.contacts.len(), 3]);
        told::forces_array(py, &told, shape.collect(), rows)
    });
    Ok((q, v, list, told.list(py, &model.plan)?, forces.transpose()?))
}

/// What all rows have in common.
pub struct Motion<'a> {
    pub settings: &'a Settings,
    pub layout: Option<&'a Layout>,
    /// Numbers of coordinates and velocities there.
    pub sizes: (usize, usize),
    start: (Rows<'a>, Rows<'a>),
    pub u: Option<Rows<'a>>,
    pub fields: Vec<(usize, Rows<'a>)>,
    /// Positions and rates of prescribed joints that move.
    moving: Option<(Rows<'a>, Rows<'a>)>,
    /// Whether the model has contacts, and how they are followed.
    touches: bool,
    pub regime: RegimeChoice,
    /// How contacts act that collide at the same instant.
    pub impacts: ImpactOrder,
    pub asked: &'a Asked,
    pub told: &'a Told,
}

/// The state of a row, and memory.
pub struct State {
    pub q: Vec<f64>,
    pub p: Vec<f64>,
    pub v: Vec<f64>,
}

/// What a thread works with.
struct Memory {
    machine: Compiled,
    lanes: Option<AnyLanes>,
    touching: Option<Touching>,
}

/// A row and the memory of its results.
pub type Item<'a> = (usize, &'a mut [f64], &'a mut [f64]);

impl Motion<'_> {
    /// Computes all rows; returns the failures, in the order of the rows.
    fn all(
        &self,
        py: Python<'_>,
        machines: &Machines,
        rows: usize,
        (q, v): (&mut [f64], &mut [f64]),
    ) -> PyResult<Vec<(usize, Failed)>> {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let threads = self.settings.threads.unwrap_or_else(cores).clamp(1, rows.max(1));
        let lanes = match self.at_once(machines, rows) {
            true => py.detach(|| machines.lanes(rows.div_ceil(threads))),
            false => None,
        };
        let width = lanes.as_ref().map_or(1, AnyLanes::width);
        let threads = threads.min(rows.div_ceil(width)).max(1);
        let failures = Mutex::new(Vec::new());
        py.detach(|| {
            let mut items = cut(q, rows).zip(cut(v, rows)).enumerate().map(|(k, (q, v))| (k, q, v));
            let blocks = std::iter::from_fn(|| {
                let block: Vec<Item> = items.by_ref().take(width).collect();
                (!block.is_empty()).then_some(block)
            });
            let begin = || {
                let touching = if self.touches { machines.touching().ok() } else { None };
                Memory { machine: machines.take(), lanes: lanes.clone(), touching }
            };
            let fields = || self.fields.iter().map(|(field, _)| *field);
            let end = |memory: Memory| {
                machines.give_back(memory.machine, fields());
                if let Some(mut touching) = memory.touching {
                    touching.reset(fields(), machines.defaults());
                    machines.keep(touching);
                }
            };
            on_threads(blocks, threads, begin, end, |memory, block: Vec<Item>, beat| {
                for (k, failed) in self.block(memory, block, beat) {
                    failures.lock().unwrap_or_else(PoisonError::into_inner).push((k, failed));
                }
            })
        })?;
        let mut failures = failures.into_inner().unwrap_or_else(PoisonError::into_inner);
        failures.sort_by_key(|(k, _)| *k);
        Ok(failures)
    }

    /// Whether rows can be computed several at once.
    fn at_once(&self, machines: &Machines, rows: usize) -> bool {
        let Settings { method, tolerance, .. } = self.settings;
        let alone = self.touches || self.moving.is_some() || !self.asked.functions.is_empty();
        rows > 1 && !alone && machines.sizes().rows == 0 && lanes::possible(method, *tolerance)
    }

    /// Computes some rows, at once if possible; returns those that fail.
    fn block(&self, memory: &mut Memory, block: Vec<Item>, beat: &mut Beat) -> Vec<(usize, Failed)> {
        let mut block = block;
        if let (Some(lanes), 2..) = (&mut memory.lanes, block.len()) {
            if self.rows_at_once(&mut memory.machine, lanes, &mut block, beat).is_some() {
                return Vec::new();
            }
        }
        let one = |item: Item| (item.0, self.row(memory, item, beat));
        block.into_iter().map(one).filter_map(|(k, done)| Some((k, done.err()?))).collect()
    }

    /// Refuses quaternions that are not of unit length.
    pub fn check_units(&self, machine: &Compiled, q: &[f64]) -> Result<(), StepError> {
        for index in machine.quaternions() {
            let norm = q[index..index + 4].iter().map(|x| x * x).sum::<f64>();
            // Those near the limit are judged by the method itself.
            if !(0.999..1.001).contains(&norm) {
                return Err(StepError::Quaternion { time: 0.0, index, norm: norm.sqrt() });
            }
        }
        Ok(())
    }

    /// Computes one row. After a failure the rest of it is not a number.
    fn row(&self, memory: &mut Memory, mut item: Item, beat: &mut Beat) -> Result<(), Failed> {
        let Memory { machine, touching, .. } = memory;
        machine.restore_row_order();
        self.fields.iter().for_each(|(field, rows)| machine.set_field(*field, rows.row(item.0)));
        machine.efforts().fill(0.0);
        if let Some(moving) = self.moving {
            drives::follow(machine, self.settings.dt, moving, item.0);
        }
        let mut written = 0;
        let done = match touching {
            Some(touching) => self.row_with_contacts(machine, touching, &mut item, &mut written, beat),
            None => self.motion(machine, &mut item, &mut written, beat),
        };
        let (_, q, v) = item;
        let (nq, nv) = self.sizes;
        if written * nq < q.len() {
            q[written * nq..].fill(f64::NAN);
            v[written * nv..].fill(f64::NAN);
        }
        done
    }

    fn motion(
        &self,
        machine: &mut Compiled,
        (k, q, v): &mut Item,
        written: &mut usize,
        beat: &mut Beat,
    ) -> Result<(), Failed> {
        let mut state = self.begin(machine, *k)?;
        let mut watcher = (!self.asked.functions.is_empty()).then(|| Watcher::new(self, &state));
        let driver = Driver::new(self.settings, machine, &state, watcher.is_some());
        let mut driver = driver.map_err(|e| failed(machine, &e))?;
        let u = self.u.map(|u| u.row(*k));
        let (nq, nv) = self.sizes;
        let told = watcher.is_none() && self.moving.is_none() && machine.rows().is_empty();
        let told = told && rates_tell_velocities(self.settings, machine);
        for step in 0..=self.settings.steps {
            let (t, ends) = (step as f64 * self.settings.dt, step == self.settings.steps);
            if let (Some(u), false) = (u, ends) {
                let u = &u[step * nv..(step + 1) * nv];
                let tau = machine.efforts();
                match self.layout {
                    None => tau.copy_from_slice(u),
                    Some(layout) => layout.v_from(&state.q, u, tau),
                }
            }
            let recorded = step.is_multiple_of(self.settings.every);
            if recorded {
                let at = *written;
                let (q, v) = (&mut q[at * nq..(at + 1) * nq], &mut v[at * nv..(at + 1) * nv]);
                match told {
                    true => driver.begin(machine, t, &mut state).map_err(|e| failed(machine, &e))?,
                    false => self.find_velocities(machine, t, &mut state),
                }
                self.write(&state, q, v);
                *written += 1;
            }
            if ends {
                break;
            }
            let (settings, input) = (self.settings, (u.is_some(), told && recorded));
            let go_on = match &mut watcher {
                None => driver.step(settings, machine, step, input, &mut state, beat),
                Some(watcher) => driver.step_to_event(settings, machine, step, input.0, &mut state, watcher),
            };
            let raised = watcher.as_mut().and_then(|watcher| {
                self.told.events(*k, watcher.events.drain(..));
                watcher.error.take()
            });
            if let Some(error) = raised {
                beat.stop_with(error);
                break;
            }
            if !go_on.map_err(|e| failed(machine, &e))? || !beat.goes_on() {
                break;
            }
        }
        Ok(())
    }

    /// The state at the start of a row.
    pub fn begin(&self, machine: &mut Compiled, k: usize) -> Result<State, Failed> {
        let (q_there, v_there) = (self.start.0.row(k), self.start.1.row(k));
        let (mut q, mut second) = (machine.neutral(), machine.zero_momenta());
        match self.layout {
            None => {
                q.copy_from_slice(q_there);
                second.copy_from_slice(v_there);
            }
            Some(layout) => {
                layout.q_from(q_there, &mut q);
                layout.v_from(&q, v_there, &mut second);
            }
        }
        if let Some(index) = q.iter().chain(&second).position(|x| !x.is_finite()) {
            let words = format!("number {index} of the start is not finite");
            return Err(Failed::start("not_finite", words, vec![("index", index as f64)]));
        }
        let mut p = second.clone();
        machine.drive_to(0.0);
        if !self.settings.momenta {
            machine.conjugate_momenta(&q, &second, &mut p);
        }
        if !machine.rows().is_empty() {
            closed(machine, &q)?;
            let mut sigma = machine.zero_rows();
            machine.project_momenta(0.0, &q, &mut p, &mut second, &mut sigma);
        }
        Ok(State { q, p, v: second })
    }

    /// Writes the state at time `t` as a row of the result.
    pub fn store(&self, machine: &mut Compiled, t: f64, state: &mut State, q: &mut [f64], v: &mut [f64]) {
        self.find_velocities(machine, t, state);
        self.write(state, q, v);
    }

    fn find_velocities(&self, machine: &mut Compiled, t: f64, state: &mut State) {
        if !self.settings.momenta {
            machine.drive_to(t);
            machine.velocities(&state.q, &state.p, &mut state.v);
        }
    }

    /// Writes a state whose velocities are known as a row of the result.
    fn write(&self, state: &State, q: &mut [f64], v: &mut [f64]) {
        let second = if self.settings.momenta { &state.p } else { &state.v };
        match self.layout {
            None => {
                q.copy_from_slice(&state.q);
                v.copy_from_slice(second);
            }
            Some(layout) => {
                layout.q_to(&state.q, q);
                layout.v_to(&state.q, second, v);
            }
        }
    }
}

/// Memory in as many equal parts.
fn cut(mut all: &mut [f64], parts: usize) -> impl Iterator<Item = &mut [f64]> + Send {
    let len = all.len() / parts.max(1);
    (0..parts).map(move |_| {
        let (part, rest) = std::mem::take(&mut all).split_at_mut(len);
        all = rest;
        part
    })
}

/// Refuses a start whose loops are open.
fn closed(machine: &mut Compiled, q: &Vec<f64>) -> Result<(), Failed> {
    let (mut residual, mut entries) = (machine.zero_rows(), machine.zero_entries());
    machine.constraint_residuals(q, &mut residual, &mut entries);
    let rows = machine.rows().iter().zip(&residual).filter(|(row, _)| row.holonomic);
    let worst = rows.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let Some((row, worst)) = worst.filter(|(_, worst)| worst.abs() > OPEN) else { return Ok(()) };
    let words = format!("the start leaves the loops open by {:.1e} (m or rad): take model.close(q0)", worst.abs());
    Err(Failed::start("open", words, vec![("constraint", row.constraint as f64), ("residual", worst.abs())]))
}

fn failed(machine: &Compiled, error: &StepError) -> Failed {
    Failed::step(error, error.named(machine).to_string())
}
