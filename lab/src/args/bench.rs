//! Arguments of `mbd-lab bench`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// `mbd-lab bench`.
#[derive(Args)]
#[command(after_help = "The scenes run generated code that ordinary builds leave out; at the root of the repository:
  cargo run --release -p mbd-lab --features generated -- bench work-precision")]
pub struct BenchArgs {
    #[command(subcommand)]
    pub bench: Bench,
}

/// The bench to run.
#[derive(Subcommand)]
pub enum Bench {
    /// Time and evaluations against the error at the end: scenes × methods × tolerances
    WorkPrecision(WorkArgs),
    /// Energy and trajectory over a million steps, each method with as many evaluations as the classical one
    Longrun(LongArgs),
    /// Every method on every scene: it runs, or stops with a reason
    Stress(StressArgs),
    /// All benches, written to reports/accuracy.md and reports/figures
    Report(ReportArgs),
}

/// Selection of scenes and methods.
#[derive(Args, Clone)]
pub struct Choice {
    /// Scenes, separated by commas [default: all]
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    pub scenes: Vec<String>,
    /// Methods, separated by commas [default: all]
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    pub methods: Vec<String>,
}

/// `mbd-lab bench work-precision`.
#[derive(Args)]
pub struct WorkArgs {
    #[command(flatten)]
    pub choice: Choice,
    /// Directory for one figure of each scene
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// File for all samples, one JSON object per line
    #[arg(long, value_name = "FILE")]
    pub samples: Option<PathBuf>,
    /// Samples of rivals, as benches/integrators/run.sh writes them
    #[arg(long, value_name = "FILE")]
    pub rivals: Option<PathBuf>,
}

/// `mbd-lab bench longrun`.
#[derive(Args)]
pub struct LongArgs {
    #[command(flatten)]
    pub choice: Choice,
    /// Length of the runs in steps of the classical method
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    pub steps: u64,
}

/// `mbd-lab bench stress`.
#[derive(Args)]
pub struct StressArgs {
    #[command(flatten)]
    pub choice: Choice,
}

/// `mbd-lab bench report`.
#[derive(Args)]
pub struct ReportArgs {
    /// Directory of the report
    #[arg(long, value_name = "DIR", default_value = "reports")]
    pub directory: PathBuf,
    /// Samples of rivals, as benches/integrators/run.sh writes them
    #[arg(long, value_name = "FILE")]
    pub rivals: Option<PathBuf>,
    /// Length of the long runs in steps of the classical method
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    pub steps: u64,
}
