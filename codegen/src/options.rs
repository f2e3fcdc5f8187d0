//! What is to be generated, and how.

use crate::model::Model;
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
pub enum Loops {
    /// Over runs of like links that are long enough to gain by it, branch by branch.
    #[default]
    Auto,
    /// Wherever links repeat.
    Always,
    /// Nowhere: straight-line code.
    Never,
}

impl Loops {
    /// All of them.
    pub const ALL: [Loops; 3] = [Loops::Auto, Loops::Always, Loops::Never];

    /// Its name in options.
    pub fn name(self) -> &'static str {
        match self {
            Loops::Auto => "auto",
            Loops::Always => "always",
            Loops::Never => "never",
        }
    }
}

/// What generated code can compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// `(q, p) → (q̇, ṗ)`; makes the type a `System`.
    Rates,
    /// `(q, p) → v`.
    Velocities,
    /// `(q, v) → p`.
    Momenta,
    /// `(q, p) →` kinetic and potential energy.
    Energy,
    /// `(q, v) → v̇`.
    Accelerations,
    /// `(q, v) →` the wrench that each joint transmits.
    Reactions,
    /// `q → M`.
    MassMatrix,
    /// `(q, v) →` placements and velocities of frames.
    Frames,
    /// `(q, v, v̇) → τ`.
    InverseDynamics,
    /// `(q, v) → h` with `M v̇ + h = τ`.
    Bias,
    /// `q →` Jacobians of frames.
    Jacobians,
    /// `(q, v) →` accelerations of frames at `v̇ = 0`.
    Drifts,
    /// `(q, p) →` velocities, momentum rates, and their derivatives with respect to coordinates and momenta; with the
    /// rates, makes the type `Differentiable`.
    Derivatives,
    /// `(q, v) →` momenta, their rates, and derivatives of both at given velocities.
    MomentumDerivatives,
    /// `(q, p) →` derivatives of velocities and momentum rates with respect to the parameters.
    ParameterDerivatives,
    /// `q →` residuals of the constraints and the entries of `Φ`.
    Closure,
    /// `(q, p) →` velocities, momenta freed of multipliers, multipliers `σ`.
    Settle,
    /// `q →` residuals of the constraints, Newton's step onto the closed positions, and its pivots.
    Correction,
    /// `(q, v) → λ`; with the rates and the three before it, makes the type `Constrained`.
    Multipliers,
}

impl Group {
    /// Those of every mechanism.
    pub const ALL: [Group; 15] = [
        Group::Rates,
        Group::Velocities,
        Group::Momenta,
        Group::Energy,
        Group::Accelerations,
        Group::Reactions,
        Group::MassMatrix,
        Group::Frames,
        Group::InverseDynamics,
        Group::Bias,
        Group::Jacobians,
        Group::Drifts,
        Group::Derivatives,
        Group::MomentumDerivatives,
        Group::ParameterDerivatives,
    ];

    /// Those that mechanisms with constraints have besides.
    pub const CONSTRAINED: [Group; 4] = [Group::Closure, Group::Settle, Group::Correction, Group::Multipliers];

    /// Both.
    pub fn every() -> impl Iterator<Item = Group> + Clone {
        Group::ALL.into_iter().chain(Group::CONSTRAINED)
    }

    /// Name of the generated function, and of the output in options.
    pub fn name(self) -> &'static str {
        match self {
            Group::Rates => "rates",
            Group::Velocities => "velocities",
            Group::Momenta => "momenta",
            Group::Energy => "energy",
            Group::Accelerations => "accelerations",
            Group::Reactions => "reactions",
            Group::MassMatrix => "mass_matrix",
            Group::Frames => "frames",
            Group::InverseDynamics => "inverse_dynamics",
            Group::Bias => "bias",
            Group::Jacobians => "jacobians",
            Group::Drifts => "drifts",
            Group::Derivatives => "derivatives",
            Group::MomentumDerivatives => "momentum_derivatives",
            Group::ParameterDerivatives => "parameter_derivatives",
            Group::Closure => "closure",
            Group::Settle => "settle",
            Group::Correction => "correction",
            Group::Multipliers => "multipliers",
        }
    }

    /// Whether it has one result for each chosen frame.
    pub fn of_frames(self) -> bool {
        matches!(self, Group::Frames | Group::Jacobians | Group::Drifts)
    }

    /// Whether mechanisms with constraints lack it.
    pub fn of_trees(self) -> bool {
        self == Group::MomentumDerivatives
    }

    /// The group of a name.
    pub fn from_name(name: &str) -> Option<Group> {
        Group::every().find(|g| g.name() == name)
    }
}

/// How code is generated.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Name of the generated type.
    pub type_name: String,
    /// What it computes.
    pub outputs: Vec<Group>,
    /// Its numbers.
    pub precision: Precision,
    /// Whether joint forces `τ` are inputs. Without them they are zero and cost nothing.
    pub efforts: bool,
    /// Names of the frames of [`Group::Frames`], [`Group::Jacobians`] and [`Group::Drifts`]; empty means all.
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
    /// What is computed unless something else is asked for; and, where there are constraints, [`Group::CONSTRAINED`].
    pub const OUTPUTS: [Group; 3] = [Group::Rates, Group::Momenta, Group::Energy];

    /// The options for a model: where the outputs are [`Options::OUTPUTS`] or all of them, one with constraints also gets
    /// [`Group::CONSTRAINED`], and not what such models lack.
    pub fn of_model(&self, model: &Model) -> Options {
        let mut options = self.clone();
        let asked =
            |groups: &[Group]| groups.len() == self.outputs.len() && groups.iter().all(|g| self.outputs.contains(g));
        if !model.constraints.is_empty() && (asked(&Options::OUTPUTS) || asked(&Group::ALL)) {
            options.outputs.retain(|g| !g.of_trees());
            options.outputs.extend(Group::CONSTRAINED);
        }
        options
    }

    /// [`Options::plan`] without the searches that no output asks for.
    pub fn searches(&self) -> PlanOptions {
        let asked = |groups: &[Group]| self.outputs.iter().any(|g| groups.contains(g));
        PlanOptions {
            accelerations: self.plan.accelerations && asked(&[Group::Accelerations, Group::Reactions]),
            mass_matrix: self.plan.mass_matrix && asked(&[Group::MassMatrix]),
            ..self.plan
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Options {
            type_name: "Model".to_string(),
            outputs: Options::OUTPUTS.to_vec(),
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
