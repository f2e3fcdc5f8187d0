//! What is to be generated, and how.

use crate::model::Model;
use crate::output::{Output, Search};
use crate::plan::PlanOptions;

/// Number type of the generated code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// `f64`.
    F64,
    /// `f32`.
    F32,
}

impl Precision {
    /// Its name in Rust.
    pub fn name(self) -> &'static str {
        match self {
            Precision::F64 => "f64",
            Precision::F32 => "f32",
        }
    }
}

/// How faithfully the emitted operations follow those of the sweeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arithmetic {
    /// The operations as the sweeps make them: the bits of the interpreter.
    Exact,
    /// Rewritten, regrouped, fused and scheduled for speed: other rounding, no larger errors.
    #[default]
    Fast,
}

impl Arithmetic {
    /// Its name in options.
    pub fn name(self) -> &'static str {
        match self {
            Arithmetic::Exact => "exact",
            Arithmetic::Fast => "fast",
        }
    }
}

/// Where generated code takes loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RolledCode {
    /// Over runs of like links that are long enough to gain by it, branch by branch.
    #[default]
    Auto,
    /// Wherever links repeat.
    Always,
    /// Nowhere: straight-line code.
    Never,
}

impl RolledCode {
    /// All of them.
    pub const ALL: [RolledCode; 3] = [RolledCode::Auto, RolledCode::Always, RolledCode::Never];

    /// Its name in options.
    pub fn name(self) -> &'static str {
        match self {
            RolledCode::Auto => "auto",
            RolledCode::Always => "always",
            RolledCode::Never => "never",
        }
    }
}

/// How code is generated.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Name of the generated type.
    pub type_name: String,
    /// What it computes.
    pub outputs: Vec<Output>,
    /// Its numbers.
    pub precision: Precision,
    /// Whether joint forces `τ` are inputs. Without them they are zero and cost nothing.
    pub efforts: bool,
    /// Names of the frames for outputs that have a result for each frame; empty means all.
    pub frames: Vec<String>,
    /// How the structure is chosen.
    pub plan: PlanOptions,
    /// Path of the runtime crate in the generated code.
    pub runtime: String,
    /// Where the model came from, for the header.
    pub source: String,
    /// Longer bodies are written in blocks of this many statements.
    pub chunk: usize,
    /// Whether operations may be rewritten.
    pub arithmetic: Arithmetic,
}

impl Options {
    /// The options for a model: where the outputs are [`Output::DEFAULT`], or all of a model without constraints, a model with
    /// constraints also gets the outputs that only such models have, and not those that they lack.
    pub fn of_model(&self, model: &Model) -> Options {
        let mut options = self.clone();
        let mut asked: Vec<Output> = self.outputs.clone();
        asked.sort_unstable();
        let unchosen = asked == Output::DEFAULT || Output::available(false).eq(asked);
        if !model.constraints.is_empty() && unchosen {
            options.outputs.retain(|output| output.spec().available(true));
            options.outputs.extend(Output::available(true).filter(|output| !output.spec().available(false)));
        }
        options
    }

    /// [`Options::plan`] without the searches that no output profits from.
    pub fn searches(&self) -> PlanOptions {
        let asked = |search| self.outputs.iter().any(|output| output.spec().search == search);
        PlanOptions {
            accelerations: self.plan.accelerations && asked(Search::Accelerations),
            mass_matrix: self.plan.mass_matrix && asked(Search::MassMatrix),
            ..self.plan
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Options {
            type_name: "Model".to_string(),
            outputs: Output::DEFAULT.to_vec(),
            precision: Precision::F64,
            efforts: true,
            frames: Vec::new(),
            plan: PlanOptions::default(),
            runtime: "::mbd_runtime".to_string(),
            source: String::new(),
            chunk: 1000,
            arithmetic: Arithmetic::default(),
        }
    }
}
