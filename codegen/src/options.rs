//! Options of the generator.

use std::collections::BTreeSet;

use crate::choice::choice;
use crate::modes::ModeChoice;
use crate::output::{Output, Search};

choice! {
    /// Number type of the generated code.
    pub enum Precision {
        /// Double precision.
        F64 = "f64",
        /// Single precision.
        F32 = "f32",
    }
}

impl Precision {
    /// Size of a number, bytes.
    pub fn bytes(self) -> usize {
        match self {
            Precision::F64 => 8,
            Precision::F32 => 4,
        }
    }
}

choice! {
    /// Arithmetic of the generated code.
    pub enum Arithmetic {
        /// Operations that are rewritten, regrouped, fused and scheduled for speed: other rounding, but no larger
        /// errors.
        Fast = "fast",
        /// The operations of the sweeps unchanged, which give the bits of the interpreter in double precision. (In
        /// single precision, code has constants that were computed in double precision.)
        Exact = "exact",
    }
}

choice! {
    /// Angles that the generated code is for.
    pub enum AngleRange {
        /// Every finite angle.
        Any = "any",
        /// Angles of at most 10⁶ rad in double precision, 1600 rad in single precision: less code, and results that are not
        /// numbers beyond, which steps of integration report.
        Bounded = "bounded",
    }
}

choice! {
    /// Where the generator writes rolled code (loops over like links).
    pub enum RolledCode {
        /// For runs of like links that are long enough to be faster, branch by branch.
        Auto = "auto",
        /// Wherever links repeat.
        Always = "always",
        /// Nowhere: straight-line code throughout.
        Never = "never",
    }
}

choice! {
    /// Where like branches of one body (legs, arms) are computed at the same time, for one state.
    pub enum LikeBranches {
        /// Where that is faster, output by output.
        Auto = "auto",
        /// Wherever there are like branches.
        Together = "together",
        /// Nowhere: branch by branch.
        Apart = "apart",
    }
}

choice! {
    /// How rows of the constraints are eliminated, which may become nearly dependent on one another during a motion.
    pub enum RowElimination {
        /// One after the other, in the order that is best at the start and near it.
        Once = "once",
        /// In five passes where three rows or more are solved at one node: each takes the rows of which enough is left,
        /// and less in every pass. So the order of the rows does not matter wherever the mechanism goes, and every
        /// evaluation has more operations. Rows of contacts are eliminated once.
        Passes = "passes",
    }
}

choice! {
    /// Strategy by which the elimination of the joints is chosen.
    pub enum EliminationStrategy {
        /// Branch by branch the elimination for which the rates take the least time for one state, by the cost model,
        /// of those whose rounding errors are not much larger than those of one joint at a time.
        Fastest = "fastest",
        /// Branch by branch the elimination for which the rates have the fewest operations, whatever its rounding
        /// errors.
        Fewest = "fewest",
        /// One joint at a time.
        Single = "single",
    }
}

/// Angles this close to a multiple of 90° are taken as one, rad (see [`PlanOptions::snap`]).
pub const DEFAULT_SNAP: f64 = 1e-6;

/// Choice of the structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanOptions {
    /// Angles of placements and directions of axes closer than this to right angles become exact, rad. 0 keeps every
    /// number of the description. A decimal approximation of π/2 would cost a term in place of an exact zero.
    pub snap: f64,
    /// Strategy of elimination.
    pub elimination: EliminationStrategy,
    /// Whether a separate elimination is searched for accelerations. Without it they use the elimination that was
    /// chosen for the rates.
    pub accelerations: bool,
    /// Whether the depth of the mass matrix is searched.
    pub mass_matrix: bool,
    /// Where rolled code is used for runs of like links.
    pub rolled: RolledCode,
    /// Where like branches are computed together.
    pub branches: LikeBranches,
    /// Elimination of the rows of constraints.
    pub rows: RowElimination,
}

impl Default for PlanOptions {
    fn default() -> Self {
        PlanOptions {
            snap: DEFAULT_SNAP,
            elimination: EliminationStrategy::default(),
            accelerations: true,
            mass_matrix: true,
            rolled: RolledCode::default(),
            branches: LikeBranches::default(),
            rows: RowElimination::default(),
        }
    }
}

impl PlanOptions {
    /// No search at all: the joints are eliminated one at a time. The code is ready in a fraction of the time, and takes
    /// more operations where several joints could be eliminated together.
    pub fn quick() -> PlanOptions {
        let elimination = EliminationStrategy::Single;
        PlanOptions { elimination, accelerations: false, mass_matrix: false, ..PlanOptions::default() }
    }
}

/// Options of the generated code.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Name of the generated type.
    pub type_name: String,
    /// Outputs that it computes, each once.
    pub outputs: Vec<Output>,
    /// Number type.
    pub precision: Precision,
    /// Whether joint forces `τ` are inputs. Without them they are zero and cost nothing.
    pub efforts: bool,
    /// Names of the frames for outputs that have a result for each frame; empty means all. Where none of these is asked for,
    /// names of frames ask for [`Output::Frames`].
    pub frames: Vec<String>,
    /// Choice of the structure.
    pub plan: PlanOptions,
    /// Path of the runtime crate in the generated code.
    pub runtime: String,
    /// Source of the model, for the header.
    pub source: String,
    /// Longer bodies are written in blocks of this many statements.
    pub chunk: usize,
    /// Whether operations may be rewritten.
    pub arithmetic: Arithmetic,
    /// Angles that the code is for, in Rust and C.
    pub angles: AngleRange,
    /// The modes of contacts for which code is made; without them, contacts are no part of the code.
    pub modes: Option<ModeChoice>,
}

impl Options {
    /// The options for a model with or without constraints: where the outputs are [`Output::DEFAULT`], or all of a
    /// model without constraints, a model with constraints also gets the outputs that only such models have, and not
    /// those that they lack. Outputs that are listed more than once are there once. Names of frames ask for
    /// [`Output::Frames`] where no output has a result for each frame.
    pub fn of_model(&self, constrained: bool) -> Options {
        let mut options = self.clone();
        let mut seen = BTreeSet::new();
        options.outputs.retain(|output| seen.insert(*output));
        // Contacts are constraints.
        let constrained = constrained || self.modes.is_some();
        let mut asked: Vec<Output> = options.outputs.clone();
        asked.sort_unstable();
        let unchosen = asked == Output::DEFAULT || Output::available(false).eq(asked);
        if constrained && unchosen {
            options.outputs.retain(|output| output.spec().available(true));
            options.outputs.extend(Output::available(true).filter(|output| !output.spec().available(false)));
        }
        if self.modes.is_some() && !options.outputs.contains(&Output::Gaps) {
            options.outputs.push(Output::Gaps);
        }
        // After the choice above, for which outputs must be those that were asked for.
        if !self.frames.is_empty() && !options.outputs.iter().any(|output| output.spec().of_frames()) {
            options.outputs.push(Output::Frames);
        }
        options
    }

    /// [`Options::plan`] without the searches that no requested output needs.
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
            angles: AngleRange::default(),
            modes: None,
        }
    }
}
