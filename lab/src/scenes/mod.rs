//! Scenes of the benchmarks and of the integrators' tests: a model, a start, how long to run, and what must come of it.
//!
//! `list.rs` is the list; a further scene is a further entry there. Not part of the library's interface: it may change in
//! any release.

mod dynamics;
pub mod experiments;
mod list;
mod text;

pub use dynamics::Dynamics;

use std::borrow::Cow;

use multibody::codegen::diag::Diagnostics;
use multibody::codegen::import::{load, Base, ImportOptions};
use multibody::codegen::model::{Model, Value};

/// What must come of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expect {
    /// It comes to the end, within the error stated for the method and its step or tolerances.
    Runs,
    /// The mass matrix is singular at the start, which no check of the file can see: a typed failure, no numbers.
    Stops,
}

/// A model and its motion.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name, as of a file.
    pub name: &'static str,
    /// One line for tables and figures.
    pub title: &'static str,
    /// Name of the model file, in `models/`, or of one that is not stored: the ending tells the format.
    pub file: String,
    /// Its text. A URDF has its damping in it even where `model` has none.
    pub text: Cow<'static, str>,
    /// The model. Joint forces are zero and parameters have their defaults.
    pub model: Model,
    /// Coordinates at the start, quaternions of exactly unit length.
    pub q: Vec<f64>,
    /// Velocities at the start.
    pub v: Vec<f64>,
    /// End, s; the start is at 0.
    pub t_end: f64,
    /// Step at which the classical method of order 4 runs it with an error that can still be seen, s.
    pub rk4_step: f64,
    /// Whether the energy is a constant of the motion.
    pub conservative: bool,
    /// What must come of a run.
    pub expect: Expect,
}

/// A model that must not be accepted.
#[derive(Clone, Copy, Debug)]
pub struct Refused {
    /// Short name, as of a file.
    pub name: &'static str,
    /// One line for tables.
    pub title: &'static str,
    /// Name of the model file in `models/`.
    pub file: &'static str,
    /// Its text.
    pub text: &'static str,
    /// Part of the finding that refuses it.
    pub finding: &'static str,
}

/// An entry of the list: how a scene is made.
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

/// Where a model comes from.
enum Source {
    /// A file of `models/`: name and text.
    File(&'static str, &'static str),
    /// A URDF there, base as given, its damping left out.
    Undamped(&'static str, &'static str, Base),
    /// Text that is written for the name of the scene.
    Made(fn(&str) -> String),
}

/// Names of all scenes.
pub fn names() -> impl Iterator<Item = &'static str> {
    list::SCENES.iter().map(|e| e.name)
}

/// The scene of a name.
pub fn by_name(name: &str) -> Option<Scene> {
    list::SCENES.iter().find(|e| e.name == name).map(Entry::scene)
}

/// All scenes, in the order of reports.
pub fn all() -> Vec<Scene> {
    list::SCENES.iter().map(Entry::scene).collect()
}

/// Models that are to be refused before anything runs.
pub fn refused() -> &'static [Refused] {
    &list::REFUSED
}

impl Refused {
    /// What the reader and the checks say.
    pub fn read(&self) -> (Option<Model>, Diagnostics) {
        load(self.file, self.text, &ImportOptions::default())
    }
}

impl Entry {
    /// Reads the model, which a test does for every entry.
    fn scene(&self) -> Scene {
        let (file, text, base) = match self.model {
            Source::File(file, text) => (file.to_string(), Cow::Borrowed(text), Base::Fixed),
            Source::Undamped(file, text, base) => (file.to_string(), Cow::Borrowed(text), base),
            Source::Made(make) => (format!("{}.toml", self.name), Cow::Owned(make(self.name)), Base::Fixed),
        };
        let (model, findings) = load(&file, &text, &ImportOptions { base, gravity: None });
        let mut model = model.unwrap_or_else(|| panic!("scene `{}`: {findings}", self.name));
        if matches!(self.model, Source::Undamped(..)) {
            model.joints.iter_mut().for_each(|j| j.damping.fill(Value::ZERO));
        }
        let (q, v) = (self.start)(&model);
        let Entry { name, title, t_end, rk4_step, conservative, expect, .. } = *self;
        Scene { name, title, file, text, model, q, v, t_end, rk4_step, conservative, expect }
    }
}
