//! Arguments about generated code.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use multibody::codegen::options::{AngleRange, EliminationStrategy, PlanOptions, RowElimination, DEFAULT_SNAP};
use multibody::codegen::output;
use multibody::codegen::{camel_case, Arithmetic, LikeBranches, Options, Output, Precision, RolledCode};

use super::values::{choice, outputs, rust_path, snap, type_name};
use super::ModelArgs;

/// Options of the generated code.
#[derive(Args)]
pub struct CodeArgs {
    /// Outputs to compute, separated by commas, or `all`
    #[arg(long, long_help = output::help(), value_delimiter = ',', value_parser = outputs, value_name = "LIST", default_value = "rates,momenta,energy")]
    pub outputs: Vec<OutputList>,
    /// Number type
    #[arg(long, value_parser = choice!(Precision), default_value = Precision::default().name())]
    pub scalar: Precision,
    /// Arithmetic: the interpreter's bits, or operations that are rewritten for speed
    #[arg(long, value_parser = choice!(Arithmetic), default_value = Arithmetic::default().name())]
    pub arithmetic: Arithmetic,
    /// Angles that Rust and C code are for; WebAssembly is for every angle
    #[arg(long, value_parser = choice!(AngleRange), default_value = AngleRange::default().name())]
    pub angles: AngleRange,
    /// Strategy of elimination; `mbd count` shows the candidates
    #[arg(long, value_parser = choice!(EliminationStrategy), default_value = EliminationStrategy::default().name())]
    pub elimination: EliminationStrategy,
    /// Where code is rolled: a loop over like links in place of straight-line code
    #[arg(long, value_parser = choice!(RolledCode), default_value = RolledCode::default().name())]
    pub rolled: RolledCode,
    /// Where like branches (legs, arms) are computed at the same time for one state
    #[arg(long, value_parser = choice!(LikeBranches), default_value = LikeBranches::default().name())]
    pub branches: LikeBranches,
    /// Rows of loops and couplings: eliminated once in the order that is best at the start, or in passes, so that
    /// their order does not matter wherever they become nearly dependent
    #[arg(long, value_parser = choice!(RowElimination), default_value = RowElimination::default().name())]
    pub rows: RowElimination,
    /// Without joint forces, which are then zero and cost nothing
    #[arg(long)]
    pub no_efforts: bool,
    /// Name of the generated type [default: from the name of the model]
    #[arg(long, value_name = "TYPE", value_parser = type_name)]
    pub name: Option<String>,
    /// Angles this close to right angles are taken as exact, rad; 0 keeps every number. Changes are reported
    #[arg(long, value_name = "RAD", default_value_t = DEFAULT_SNAP, allow_negative_numbers = true, value_parser = snap)]
    pub snap: f64,
    /// Frames and bodies of outputs that have a result for each frame, separated by commas; asks for the output `frames`
    /// where none of these outputs is named [default: all]
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    pub frames: Vec<String>,
    /// Largest number of statements in one block of the generated code
    #[arg(long, value_name = "N", default_value_t = 1000, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub chunk: u32,
}

/// One item of `--outputs`: an output, or all of them.
#[derive(Clone)]
pub struct OutputList(pub Vec<Output>);

impl CodeArgs {
    /// The outputs, each once.
    pub fn groups(&self) -> Vec<Output> {
        let mut groups = Vec::new();
        for group in self.outputs.iter().flat_map(|o| &o.0) {
            if !groups.contains(group) {
                groups.push(*group);
            }
        }
        groups
    }

    /// How the structure is chosen.
    pub fn plan_options(&self) -> PlanOptions {
        self.options("").searches()
    }

    /// Options for the generator; `model` is the name of the model.
    pub fn options(&self, model: &str) -> Options {
        Options {
            type_name: self.name.clone().unwrap_or_else(|| camel_case(model)),
            outputs: self.groups(),
            precision: self.scalar,
            efforts: !self.no_efforts,
            frames: self.frames.clone(),
            plan: PlanOptions {
                snap: self.snap,
                elimination: self.elimination,
                rolled: self.rolled,
                branches: self.branches,
                rows: self.rows,
                ..PlanOptions::default()
            },
            chunk: self.chunk as usize,
            arithmetic: self.arithmetic,
            angles: self.angles,
            ..Options::default()
        }
    }
}
/// Language of generated code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Language {
    /// Rust, in one file
    Rust,
    /// C99: a source, and a header of the same name beside it
    C,
    /// The same as a unit for model exchange (FMI 2.0), an `.fmu`
    #[cfg(feature = "fmu")]
    Fmu,
    /// WebAssembly, a module; beside it a JavaScript wrapper and its types
    Wasm,
    /// The same for several states at once: two in double precision, four in single precision
    WasmLanes,
}

/// `mbd generate`.
#[derive(Args)]
#[command(
    after_help = "Rust depends on the runtime alone: no allocation, no std. C depends on nothing: `-o robot.c` writes robot.c and robot.h.
A unit for model exchange has rates, velocities and energies in doubles, its sources, and a shared library where a C compiler is found
(in the book: C99). The comment at the top lists the order of the state and the operations of each function. The same model and
options give the same bytes everywhere.

WebAssembly is written to three files: `-o robot.wasm` also writes robot.js, a wrapper, and robot.d.ts, its types.
The book's page on WebAssembly shows how to use them.

In a crate that depends on `multibody`, write `include!(\"robot.rs\");` in a module of its own, or `mod robot;` where the
file lies beside the sources. In a crate that depends on `mbd-runtime` alone (firmware), add --runtime ::mbd_runtime."
)]
pub struct GenerateArgs {
    #[command(flatten)]
    pub model: ModelArgs,
    #[command(flatten)]
    pub code: CodeArgs,
    /// Make code for the modes of the contacts: `masked` for functions in which numbers say which contacts act, `all` for
    /// functions for every set of modes beside these, `factored` for pieces that serve every set, or a FILE with the sets
    /// to take, as `mbd simulate --record-modes` writes it. Without it, contacts are no part of the code
    #[arg(long, value_name = "masked|all|factored|FILE")]
    pub modes: Option<String>,
    /// Language of the code
    #[arg(long, value_enum, default_value_t = Language::Rust)]
    pub lang: Language,
    /// Path of the runtime in generated Rust
    #[arg(long, value_name = "PATH", default_value = DEFAULT_RUNTIME, value_parser = rust_path)]
    pub runtime: String,
    /// File to write in place of standard output; needed for every language but Rust
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// Path of the runtime for users of the crate `multibody`.
pub const DEFAULT_RUNTIME: &str = "::multibody::runtime";
