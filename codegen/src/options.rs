//! What is to be generated, and how.

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

/// How the joints are eliminated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EliminationStrategy {
    /// Branch by branch the elimination for which the rates take the least time for one state, by the cost model, of those whose
    /// rounding errors are not much larger than those of one joint at a time.
    #[default]
    Fastest,
    /// Branch by branch the elimination for which the rates have the fewest operations, whatever its rounding errors.
    Fewest,
    /// Every joint by itself.
    Single,
}

impl EliminationStrategy {
    /// All of them.
    pub const ALL: [EliminationStrategy; 3] =
        [EliminationStrategy::Fastest, EliminationStrategy::Fewest, EliminationStrategy::Single];

    /// Its name in options.
    pub fn name(self) -> &'static str {
        match self {
            EliminationStrategy::Fastest => "fastest",
            EliminationStrategy::Fewest => "fewest",
            EliminationStrategy::Single => "single",
        }
    }
}

/// Angles this close to a multiple of 90° are taken as one, rad (see [`PlanOptions::snap`]).
pub const DEFAULT_SNAP: f64 = 1e-6;

/// How the structure is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanOptions {
    /// Angles of placements and directions of axes closer than this to right angles become exact, rad. 0 keeps every
    /// number of the description. A decimal π/2 costs a term wherever an exact zero would have stood.
    pub snap: f64,
    /// Joints that are solved together.
    pub elimination: EliminationStrategy,
    /// Whether accelerations get a search of their own. Without it they are right, and cost what the elimination chosen for the
    /// rates makes them cost.
    pub accelerations: bool,
    /// Whether the mass matrix gets one.
    pub mass_matrix: bool,
    /// Rolled code for runs of like links: long chains are laid out for it.
    pub rolled: RolledCode,
}

impl Default for PlanOptions {
    fn default() -> Self {
        PlanOptions {
            snap: DEFAULT_SNAP,
            elimination: EliminationStrategy::default(),
            accelerations: true,
            mass_matrix: true,
            rolled: RolledCode::default(),
        }
    }
}

/// What generated code can compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Output {
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
    BiasAccelerations,
    /// `(q, p) →` velocities, momentum rates, and their derivatives with respect to coordinates and momenta; with the
    /// rates, makes the type `Differentiable`.
    Derivatives,
    /// `(q, v) →` momenta, their rates, and derivatives of both at given velocities.
    MomentumDerivatives,
    /// `(q, p) →` derivatives of velocities and momentum rates with respect to the parameters.
    ParameterDerivatives,
    /// `q →` residuals of the constraints and the entries of `Φ`.
    ConstraintResiduals,
    /// `(q, p) →` velocities, momenta freed of multipliers, multipliers `σ`.
    ProjectMomenta,
    /// `q →` residuals of the constraints, Newton's step onto the closed positions, and its pivots.
    PositionCorrection,
    /// `(q, v) → λ`; with the rates and the three before it, makes the type `Constrained`.
    Multipliers,
}

impl Output {
    /// Those of every mechanism.
    pub const ALL: [Output; 15] = [
        Output::Rates,
        Output::Velocities,
        Output::Momenta,
        Output::Energy,
        Output::Accelerations,
        Output::Reactions,
        Output::MassMatrix,
        Output::Frames,
        Output::InverseDynamics,
        Output::Bias,
        Output::Jacobians,
        Output::BiasAccelerations,
        Output::Derivatives,
        Output::MomentumDerivatives,
        Output::ParameterDerivatives,
    ];

    /// Those that mechanisms with constraints have besides.
    pub const CONSTRAINED: [Output; 4] =
        [Output::ConstraintResiduals, Output::ProjectMomenta, Output::PositionCorrection, Output::Multipliers];

    /// Both.
    pub fn every() -> impl Iterator<Item = Output> + Clone {
        Output::ALL.into_iter().chain(Output::CONSTRAINED)
    }

    /// Name of the generated function, and of the output in options.
    pub fn name(self) -> &'static str {
        match self {
            Output::Rates => "rates",
            Output::Velocities => "velocities",
            Output::Momenta => "momenta",
            Output::Energy => "energy",
            Output::Accelerations => "accelerations",
            Output::Reactions => "reactions",
            Output::MassMatrix => "mass_matrix",
            Output::Frames => "frames",
            Output::InverseDynamics => "inverse_dynamics",
            Output::Bias => "bias",
            Output::Jacobians => "jacobians",
            Output::BiasAccelerations => "bias_accelerations",
            Output::Derivatives => "derivatives",
            Output::MomentumDerivatives => "momentum_derivatives",
            Output::ParameterDerivatives => "parameter_derivatives",
            Output::ConstraintResiduals => "constraint_residuals",
            Output::ProjectMomenta => "project_momenta",
            Output::PositionCorrection => "position_correction",
            Output::Multipliers => "multipliers",
        }
    }

    /// Whether it has one result for each chosen frame.
    pub fn of_frames(self) -> bool {
        matches!(self, Output::Frames | Output::Jacobians | Output::BiasAccelerations)
    }

    /// Whether mechanisms with constraints lack it.
    pub fn of_trees(self) -> bool {
        self == Output::MomentumDerivatives
    }

    /// The group of a name.
    pub fn from_name(name: &str) -> Option<Output> {
        Output::every().find(|g| g.name() == name)
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
    /// Names of the frames of [`Output::Frames`], [`Output::Jacobians`] and [`Output::BiasAccelerations`]; empty means all.
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
    /// What is computed unless something else is asked for; and, where there are constraints, [`Output::CONSTRAINED`].
    pub const OUTPUTS: [Output; 3] = [Output::Rates, Output::Momenta, Output::Energy];

    /// The options for a model with or without constraints: where the outputs are [`Options::OUTPUTS`] or all of them, one with
    /// constraints also gets [`Output::CONSTRAINED`], and not what such models lack.
    pub fn of_model(&self, constrained: bool) -> Options {
        let mut options = self.clone();
        let asked =
            |groups: &[Output]| groups.len() == self.outputs.len() && groups.iter().all(|g| self.outputs.contains(g));
        if constrained && (asked(&Options::OUTPUTS) || asked(&Output::ALL)) {
            options.outputs.retain(|g| !g.of_trees());
            options.outputs.extend(Output::CONSTRAINED);
        }
        options
    }

    /// [`Options::plan`] without the searches that no output asks for.
    pub fn searches(&self) -> PlanOptions {
        let asked = |groups: &[Output]| self.outputs.iter().any(|g| groups.contains(g));
        PlanOptions {
            accelerations: self.plan.accelerations && asked(&[Output::Accelerations, Output::Reactions]),
            mass_matrix: self.plan.mass_matrix && asked(&[Output::MassMatrix]),
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
