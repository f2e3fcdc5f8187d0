//! Arguments of `mbd-lab stability`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// `mbd-lab stability`.
#[derive(Args)]
pub struct StabilityArgs {
    #[command(subcommand)]
    pub sweep: Sweep,
}

/// The sweep to run.
#[derive(Subcommand)]
pub enum Sweep {
    /// Energy of mechanisms that pass singular positions: speeds × tolerances × stabilisations × methods
    ChangePoints(ChangePointArgs),
}

/// `mbd-lab stability change-points`.
#[derive(Args)]
pub struct ChangePointArgs {
    /// Number of speeds of the crank, spread over 2 to 20 rad/s
    #[arg(long, value_name = "N", default_value_t = 400)]
    pub speeds: usize,
    /// Number of speeds for the methods other than the default one, and for the other mechanisms
    #[arg(long, value_name = "N", default_value_t = 40)]
    pub few: usize,
    /// Mechanisms, separated by commas [default: all]
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    pub mechanisms: Vec<String>,
    /// Methods, separated by commas [default: all that choose their steps]
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    pub methods: Vec<String>,
    /// Stabilisations, separated by commas [default: all]
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    pub holds: Vec<String>,
    /// Tolerances, separated by commas
    #[arg(long, value_delimiter = ',', value_name = "LIST", default_values_t = [1e-6, 1e-9, 1e-11])]
    pub tolerances: Vec<f64>,
    /// File for the report; without it the tables are only printed
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
}
