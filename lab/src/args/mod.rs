//! Arguments of `mbd-lab`.

#[cfg_attr(not(feature = "generated"), allow(dead_code))]
pub mod bench;
pub mod experiments;
pub mod interpreter;
pub mod stability;

use clap::{Parser, Subcommand};

/// The command line.
#[derive(Parser)]
#[command(name = "mbd-lab", version, about = "Experiments of the thesis, and benches of the integrators")]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

/// The command to run.
#[derive(Subcommand)]
pub enum Command {
    /// Repeat the experiments of chapter 7 of the thesis
    Experiments(experiments::ExperimentsArgs),
    /// Measure integrators: work against error, long runs, stress
    Bench(bench::BenchArgs),
    /// Time the rates of the interpreter
    Interpreter(interpreter::InterpreterArgs),
    /// Stress numerical stability: sweeps whose tables stand in reports/
    Stability(stability::StabilityArgs),
}
