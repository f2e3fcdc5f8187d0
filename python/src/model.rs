//! The class `Model`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::OnceLock;

use multibody::codegen::jit::CompileError;
use multibody::codegen::model::{Contact, Model as Description};
use multibody::codegen::options::{Arithmetic, PlanOptions};
use multibody::codegen::plan::Plan;
use multibody::codegen::{Options, Output};
use multibody::runtime::constrained::{close, Closing};
use multibody::runtime::tree::Source;
use multibody::runtime::{Constrained, System};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::arrays::{batch, Given};
use crate::errors::{compile_error, constraint_numbers, findings, Failed};
use crate::machines::{Inputs, Machines};
use crate::{evaluate, generate, read, rollout, settings, told};

/// A mechanism that was read and checked. Its functions are machine code, made when they are first called.
///
/// A model does not change, and may be used by several threads at once.
#[pyclass(frozen, module = "multibody")]
pub struct Model {
    pub(crate) description: Description,
    findings: Py<PyList>,
    /// Gains of position control of every joint.
    gains: Vec<(f64, f64)>,
    /// Names and places in the state; without a search.
    pub(crate) plan: Plan,
    options: Options,
    recipe: Recipe,
    machines: OnceLock<Result<Machines, CompileError>>,
}

impl Model {
    /// The machine code.
    pub fn machines(&self, py: Python<'_>) -> PyResult<&Machines> {
        let make = || Machines::new(&self.description, &self.options);
        let made = py.detach(|| self.machines.get_or_init(make));
        made.as_ref().map_err(|error| compile_error(py, error))
    }

    /// Numbers of the joints' bounds, one for each velocity.
    fn bounds(&self, of: impl Fn(&multibody::codegen::model::Joint) -> Option<f64>, none: f64) -> Vec<f64> {
        let mut out = vec![none; self.plan.dims.nv];
        for slot in &self.plan.slots {
            if let (Some(Source::State { v, .. }), joint) = (slot.at, &self.description.joints[slot.joint]) {
                out[v..v + joint.kind.nv()].fill(of(joint).unwrap_or(none));
            }
        }
        out
    }

    /// Numbers of the axes, one for each velocity; zero for those that are of no axis.
    fn of_axes(&self, of: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut out = vec![0.0; self.plan.dims.nv];
        self.plan.axes().for_each(|axis| out[axis.v] = of(axis.joint));
        out
    }
}

#[pymethods]
impl Model {
    /// Name of the model.
    #[getter]
    fn name(&self) -> &str {
        &self.description.name
    }

    /// Warnings and notices about the description, a list of `Finding`.
    #[getter]
    fn findings<'py>(&self, py: Python<'py>) -> Bound<'py, PyList> {
        self.findings.bind(py).clone()
    }

    /// Number of coordinates.
    #[getter]
    fn nq(&self) -> usize {
        self.plan.dims.nq
    }

    /// Number of velocities, momenta and joint forces.
    #[getter]
    fn nv(&self) -> usize {
        self.plan.dims.nv
    }

    /// Names of the coordinates, in the order of `q`.
    #[getter]
    fn coordinate_names(&self) -> Vec<String> {
        self.plan.coordinate_names()
    }

    /// Names of the velocities, in the order of `v`, `p` and `tau`.
    #[getter]
    fn velocity_names(&self) -> Vec<String> {
        self.plan.velocity_names()
    }

    /// Names of the bodies, in the order of the description.
    #[getter]
    fn body_names(&self) -> Vec<&str> {
        self.description.bodies.iter().map(|body| body.name.as_str()).collect()
    }

    /// Names of the joints, depth first from the ground.
    #[getter]
    fn joint_names(&self) -> Vec<&str> {
        self.description.joints.iter().map(|joint| joint.name.as_str()).collect()
    }

    /// Names of the frames of `frames` and `jacobians`: bodies, then frames of the description.
    #[getter]
    fn frame_names(&self) -> Vec<&str> {
        self.plan.frames.iter().map(|frame| frame.name.as_str()).collect()
    }

    /// Names of the parameters, in the order of `params`.
    #[getter]
    fn parameter_names(&self) -> Vec<&str> {
        self.plan.params().iter().map(|param| param.name.as_str()).collect()
    }

    /// Values of the parameters where none are given, `(k,)`.
    #[getter]
    fn parameter_defaults<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.plan.default_params())
    }

    /// Names of the external wrenches, in the order of `wrenches`.
    #[getter]
    fn wrench_names(&self) -> Vec<&str> {
        self.description.wrenches.iter().map(|wrench| wrench.name.as_str()).collect()
    }

    /// Names of the loops and couplings.
    #[getter]
    fn constraint_names(&self) -> Vec<&str> {
        self.description.constraints.iter().map(|constraint| constraint.name.as_str()).collect()
    }

    /// Names of the contacts, stops of joints included.
    #[getter]
    fn contact_names(&self) -> Vec<&str> {
        self.description.contacts.iter().map(|contact| contact.name.as_str()).collect()
    }

    /// Ranges of the joints, `(nv, 2)`, rad or m: infinite where there are none.
    #[getter]
    fn joint_ranges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut low = self.bounds(|joint| joint.bounds.range.map(|range| range[0]), f64::NEG_INFINITY);
        let mut high = self.bounds(|joint| joint.bounds.range.map(|range| range[1]), f64::INFINITY);
        let stops = self.description.contacts.iter().filter_map(Contact::stop);
        for (joint, below, at) in stops {
            for axis in self.plan.axes().filter(|axis| axis.joint == joint) {
                let end = if below { &mut low[axis.v] } else { &mut high[axis.v] };
                *end = if below { end.max(at) } else { end.min(at) };
            }
        }
        let both: Vec<f64> = low.into_iter().zip(high).flat_map(|(low, high)| [low, high]).collect();
        PyArray1::from_vec(py, both).reshape([self.plan.dims.nv, 2])
    }

    /// Largest speeds of the joints, `(nv,)`, rad/s or m/s: infinite where there are none.
    #[getter]
    fn max_velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.bounds(|joint| joint.bounds.velocity, f64::INFINITY))
    }

    /// Largest efforts of the joints, `(nv,)`, N m or N: infinite where there are none.
    #[getter]
    fn max_effort<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.plan.effort_limits())
    }

    /// Indices of the velocities that motors could drive, `(n,)`: all but those of planar, spherical and floating joints.
    #[getter]
    fn axes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<usize>> {
        PyArray1::from_iter(py, self.plan.axes().map(|axis| axis.v))
    }

    /// Stiffness of position control, `(nv,)`, N m/rad or N/m: `u = model.kp * targets` holds joints at targets.
    #[getter]
    fn kp<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.of_axes(|joint| self.gains[joint].0))
    }

    /// Damping of position control, `(nv,)`, N m s/rad or N s/m: `u = model.kd * rates` adds the rates of targets.
    #[getter]
    fn kd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.of_axes(|joint| self.gains[joint].1))
    }

    /// The neutral configuration, `(nq,)`: zeros and unit quaternions.
    fn neutral<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.plan.default_interpreter::<f64>().neutral())
    }

    /// The start that the description states: coordinates `(nq,)` and velocities `(nv,)`; loops may be open there.
    fn start<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        let v = self.plan.start_velocity().unwrap_or_else(|| vec![0.0; self.plan.dims.nv]);
        (PyArray1::from_vec(py, self.plan.start()), PyArray1::from_vec(py, v))
    }

    /// Names of the outputs that the model has.
    #[getter]
    fn outputs(&self) -> Vec<&'static str> {
        Output::available(!self.description.constraints.is_empty()).map(Output::name).collect()
    }

    /// Shapes of the arguments and results of an output, by name.
    fn shapes<'py>(&self, py: Python<'py>, output: &str) -> PyResult<Bound<'py, PyDict>> {
        let (spec, sizes) = (evaluate::output(output)?.spec(), self.machines(py)?.sizes());
        let shapes = PyDict::new(py);
        for array in spec.inputs.iter().chain(spec.results) {
            shapes.set_item(array.name, PyTuple::new(py, array.lengths(&sizes))?)?;
        }
        Ok(shapes)
    }

    #[pyo3(signature = (output, arguments, inputs = None, out = None))]
    fn _evaluate<'py>(
        &self,
        py: Python<'py>,
        output: &str,
        arguments: &Bound<'py, PyTuple>,
        inputs: Option<&Bound<'py, PyDict>>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let (output, machines) = (evaluate::output(output)?, self.machines(py)?);
        let inputs = Inputs::read(inputs, &machines.sizes())?;
        evaluate::evaluate(py, machines, output, arguments, &inputs, out)
    }

    #[pyo3(signature = (start, u, settings, asked, inputs = None, drives = None, out = None))]
    fn _rollout<'py>(
        &self,
        py: Python<'py>,
        start: (Bound<'py, PyAny>, Bound<'py, PyAny>),
        u: Option<Bound<'py, PyAny>>,
        settings: settings::Settings,
        asked: told::Asked,
        inputs: Option<&Bound<'py, PyDict>>,
        drives: Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>,
        out: Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>,
    ) -> PyResult<rollout::Results<'py>> {
        rollout::rollout(py, self, start, rollout::Beside { u, inputs, drives }, settings, asked, out)
    }

    /// Moves coordinates to the nearest ones that close the loops and meet the couplings.
    ///
    /// `q` is `(nq,)` or `(B, nq)`; the start decides between branches. Joints that are `held` in the description stay
    /// where they are. Raises `SimulationError` where the loops cannot be closed.
    fn close<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let nq = self.plan.dims.nq;
        let given = Given::read(q, "q", &[nq])?;
        let rows = batch([&given])?;
        let shape: Vec<usize> = rows.into_iter().chain([nq]).collect();
        let (mut interpreter, held) = (self.plan.default_interpreter::<f64>(), self.plan.held());
        let mut all = Vec::new();
        for k in 0..rows.unwrap_or(1) {
            let mut q = given.rows()?.row(k).to_vec();
            if !interpreter.rows().is_empty() {
                close(&mut interpreter, &mut q, &Closing::holding(&held)).map_err(|error| {
                    let failed = Failed::start("open", error.to_string(), constraint_numbers(&error));
                    failed.object(py, k).map_or_else(|e| e, PyErr::from_value)
                })?;
            }
            all.extend(q);
        }
        PyArray1::from_vec(py, all).reshape(shape)
    }

    /// Code for the model as a dictionary from names of files to their contents.
    ///
    /// `lang` is `"rust"`, `"c"`, `"wasm"` or `"wasm-lanes"`; `outputs` are names of outputs, `scalar` is `"f64"` or `"f32"`,
    /// `name` that of the generated type. Texts are `str`, the module of WebAssembly is `bytes`.
    #[pyo3(signature = (lang = "rust", outputs = None, *, name = None, scalar = "f64", frames = None))]
    fn generate<'py>(
        &self,
        py: Python<'py>,
        lang: &str,
        outputs: Option<Vec<String>>,
        name: Option<String>,
        scalar: &str,
        frames: Option<Vec<String>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let frames = frames.unwrap_or_default();
        let asked = generate::Asked { lang, outputs, name, scalar, frames };
        generate::generate(py, &self.description, &self.options, asked)
    }

    /// Models are pickled as their texts and read again.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Recipe,))> {
        Ok((py.import("multibody._native")?.getattr("_restore")?, (self.recipe.clone(),)))
    }

    fn __repr__(&self) -> String {
        let d = self.plan.dims;
        format!("<multibody.Model {} (nq={}, nv={})>", self.description.name, d.nq, d.nv)
    }
}

/// Reads a model.
#[pyfunction]
#[pyo3(signature = (path = None, *, text = None, format = "toml", base = "fixed", gravity = None, limits = false, floor = None,
    self_contact = None, variant = None, wrenches = Vec::new(), gains = None, arithmetic = "fast", search = true))]
pub fn load(
    py: Python<'_>,
    path: Option<PathBuf>,
    text: Option<String>,
    format: &str,
    base: &str,
    gravity: Option<[f64; 3]>,
    limits: bool,
    floor: Option<(f64, f64)>,
    self_contact: Option<f64>,
    variant: Option<String>,
    wrenches: Vec<String>,
    gains: Option<GivenGains>,
    arithmetic: &str,
    search: bool,
) -> PyResult<Model> {
    let read::Source { file, text } = read::source(path, text, format)?;
    let gains = match gains {
        None => Default::default(),
        Some(GivenGains::All(gains)) => (Default::default(), Some(gains)),
        Some(GivenGains::Named(gains)) => (gains, None),
    };
    let reading = (base.to_string(), gravity, limits, (floor, self_contact), variant, wrenches, gains);
    restore(py, (file, text, reading, (arithmetic.to_string(), search), Default::default()))
}

/// Gains of position control as a caller gives them.
#[derive(FromPyObject)]
pub enum GivenGains {
    /// Of all joints.
    All((f64, f64)),
    /// By the names of joints.
    Named(BTreeMap<String, (f64, f64)>),
}

/// Height and friction of a floor, and friction between bodies, where there are contacts.
type Touching = (Option<(f64, f64)>, Option<f64>);

/// Settings of [`load`] about the description.
type Reading = (String, Option<[f64; 3]>, bool, Touching, Option<String>, Vec<String>, read::Gains);

/// All that a model is made of: the name of its file, its text, settings of reading and of computing, other files.
pub type Recipe = (String, String, Reading, (String, bool), read::Files);

/// Makes a model of its recipe, on another machine as well.
#[pyfunction(name = "_restore")]
pub fn restore(py: Python<'_>, mut recipe: Recipe) -> PyResult<Model> {
    let (
        file,
        text,
        (base, gravity, limits, (floor, self_contact), variant, wrenches, gains),
        (arithmetic, search),
        files,
    ) = &mut recipe;
    let source = read::Source { file: file.clone(), text: text.clone() };
    let import = read::options(base, *gravity, *limits, *floor, *self_contact)?;
    let Some(arithmetic) = Arithmetic::from_name(arithmetic) else {
        let names = Arithmetic::ALL.map(Arithmetic::name).join(", ");
        return Err(PyValueError::new_err(format!("no arithmetic is called `{arithmetic}`: take one of {names}")));
    };
    let (mut description, found) = read::model(py, &source, &import, variant.as_deref(), wrenches, files)?;
    let gains = read::add_gains(py, &mut description, gains)?;
    let plan = if *search { PlanOptions::default() } else { PlanOptions::quick() };
    let options = Options { arithmetic, plan, ..Options::default() };
    Ok(Model {
        plan: py.detach(|| Plan::new(&description, plan.snap)),
        findings: findings(py, &found.0)?.unbind(),
        gains,
        description,
        options,
        recipe,
        machines: OnceLock::new(),
    })
}
