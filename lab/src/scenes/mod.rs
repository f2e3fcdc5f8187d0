//! Scenes of the benchmarks and of the integrators' tests: a model, a start, the length of the run, and the required
//! result.
//!
//! `list.rs` is the list of scenes; a new scene is a new entry there.

pub mod breaking;
mod dynamics;
pub mod experiments;
mod list;
pub(crate) mod text;

pub use dynamics::Dynamics;

use std::borrow::Cow;

use multibody::codegen::diag::Diagnostics;
use multibody::codegen::model::{Model, Value};
use multibody::codegen::read::{self, Base, ImportOptions};

/// Required result of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expect {
    /// The run reaches the end, with at most the error stated for the method and its step or tolerances.
    Runs,
    /// The mass matrix is singular at the start, which the checks of the file cannot find: a typed error and no
    /// numbers.
    Stops,
}

/// A model and its motion.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name, valid as a file name.
    pub name: &'static str,
    /// One line for tables and figures.
    pub title: &'static str,
    /// Name of the model file in `models/`, or of a file that is not stored; its extension states the format.
    pub file: String,
    /// Text of the model file. That of a URDF contains its damping, even where `model` has none.
    pub text: Cow<'static, str>,
    /// The model. Joint forces are zero and parameters have their defaults.
    pub model: Model,
    /// Coordinates at the start, quaternions of exactly unit length.
    pub q: Vec<f64>,
    /// Velocities at the start.
    pub v: Vec<f64>,
    /// End of the run, s; it starts at 0.
    pub t_end: f64,
    /// Step, s, at which the classical method of order 4 has an error well above round-off.
    pub rk4_step: f64,
    /// Whether the energy is a constant of the motion.
    pub conservative: bool,
    /// Required result of a run.
    pub expect: Expect,
}

/// A model that must be rejected.
#[derive(Clone, Copy, Debug)]
pub struct Refused {
    /// Short name, valid as a file name.
    pub name: &'static str,
    /// One line for tables.
    pub title: &'static str,
    /// Name of the model file in `models/`.
    pub file: &'static str,
    /// Text of the model file.
    pub text: &'static str,
    /// Part of the error message.
    pub finding: &'static str,
}

/// An entry of the list, from which a scene is made.
struct Entry {
    name: &'static str,
    title: &'static str,
    model: Source,
    /// Coordinates and velocities at the start.
    start: fn(&Model) -> (Vec<f64>, Vec<f64>),
    t_end: f64,
    rk4_step: f64,
    conservative: bool,
    expect: Expect,
}

/// Source of a model.
enum Source {
    /// A file of `models/`: name and text.
    File(&'static str, &'static str),
    /// A URDF of `models/` with the given base, without its damping.
    Undamped(&'static str, &'static str, Base),
    /// Text that is generated for the name of the scene.
    Made(fn(&str) -> String),
}

/// Names of all scenes.
pub fn names() -> impl Iterator<Item = &'static str> {
    list::SCENES.iter().map(|e| e.name)
}

/// The scene with a name.
pub fn by_name(name: &str) -> Option<Scene> {
    list::SCENES.iter().find(|e| e.name == name).map(Entry::scene)
}

/// All scenes, in the order of reports.
pub fn all() -> Vec<Scene> {
    list::SCENES.iter().map(Entry::scene).collect()
}

/// Models that must be rejected before anything runs.
pub fn refused() -> &'static [Refused] {
    &list::REFUSED
}

impl Refused {
    /// The message of the reader and the checks.
    pub fn read(&self) -> (Option<Model>, Diagnostics) {
        read::load(self.file, self.text, &ImportOptions::default())
    }
}

impl Entry {
    /// Reads the model; a test does so for every entry.
    fn scene(&self) -> Scene {
        let (file, text, base) = match self.model {
            Source::File(file, text) => (file.to_string(), Cow::Borrowed(text), Base::Fixed),
            Source::Undamped(file, text, base) => (file.to_string(), Cow::Borrowed(text), base),
            Source::Made(make) => (format!("{}.toml", self.name), Cow::Owned(make(self.name)), Base::Fixed),
        };
        let mut model = read::model(&file, &text, &ImportOptions { base, ..ImportOptions::default() })
            .unwrap_or_else(|findings| panic!("scene `{}`: {findings}", self.name))
            .model;
        if matches!(self.model, Source::Undamped(..)) {
            model.joints.iter_mut().for_each(|j| j.damping.fill(Value::ZERO));
        }
        let (q, v) = (self.start)(&model);
        let Entry { name, title, t_end, rk4_step, conservative, expect, .. } = *self;
        Scene { name, title, file, text, model, q, v, t_end, rk4_step, conservative, expect }
    }
}
