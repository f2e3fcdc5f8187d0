//! Arguments of `mbd-lab experiments`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// `mbd-lab experiments`.
#[derive(Args)]
#[command(
    after_help = "The book (`book/src/experiments.md`) says what is measured and how. The interpreter runs everything; with the generated code that
ordinary builds leave out, `scaling` times that too. At the root of the repository:
  cargo run --release -p mbd-lab --features generated -- experiments scaling --out figures"
)]
pub struct ExperimentsArgs {
    #[command(subcommand)]
    pub experiment: Experiment,
}

/// The experiment to run.
#[derive(Subcommand)]
pub enum Experiment {
    /// Momenta against accelerations on a closed loop: tables 7.1 to 7.4, figures 7.9 to 7.15
    Biped(BipedArgs),
    /// A chain of 100 links of which a joint breaks: table 7.5, figure 7.16, conservation, accuracy
    Breaking(BreakingArgs),
    /// Boxes and legs that are thrown on the floor: events, errors, gaps, energy
    Drops(DropsArgs),
    /// What contacts cost by the number of pairs and of corners of hulls, and how well their times are found
    Pairs(PairsArgs),
    /// Time of an evaluation over the number of links of open, branched and closed chains: figures 7.4 to 7.6
    Scaling(ScalingArgs),
}

/// `mbd-lab experiments biped`.
#[derive(Args)]
pub struct BipedArgs {
    /// Directory for the figures; without it there are only tables
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Leave out the runs that take longest
    #[arg(long)]
    pub quick: bool,
    /// Steps of 1 ms of the run with projection; a million takes minutes
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub steps: u64,
}

/// `mbd-lab experiments breaking`.
#[derive(Args)]
pub struct BreakingArgs {
    /// Directory for the figures; without it there are only tables
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Short rounds of the measurements of time
    #[arg(long)]
    pub quick: bool,
    /// Time to which the motion is compared with double-double numbers, s; 10 s take minutes, 0 leaves it out
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    pub end: f64,
}

/// `mbd-lab experiments drops`.
#[derive(Args)]
pub struct DropsArgs {
    /// Throws of each mechanism; a hundred thousand take hours
    #[arg(long, value_name = "N", default_value_t = 1_000)]
    pub count: u64,
    /// Number of the first throw
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub first: u64,
    /// Only this mechanism: box or leg
    #[arg(long, value_name = "NAME")]
    pub only: Option<String>,
    /// Start of the random numbers
    #[arg(long, value_name = "N", default_value_t = 7)]
    pub seed: u64,
}

/// `mbd-lab experiments pairs`.
#[derive(Args)]
pub struct PairsArgs {
    /// Numbers of balls
    #[arg(long, value_name = "N", value_delimiter = ',', default_values_t = [1, 2, 4, 8, 16, 32, 60])]
    pub balls: Vec<usize>,
    /// Numbers of corners of a hull
    #[arg(long, value_name = "N", value_delimiter = ',', default_values_t = [8, 16, 32, 64, 128])]
    pub corners: Vec<usize>,
    /// One run of each motion, in place of the fastest within a second
    #[arg(long)]
    pub quick: bool,
}

/// `mbd-lab experiments scaling`.
#[derive(Args)]
pub struct ScalingArgs {
    /// Directory for the figures; without it there are only tables
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Few and small mechanisms, short rounds
    #[arg(long)]
    pub quick: bool,
}
