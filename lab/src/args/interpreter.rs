//! Arguments of `mbd-lab interpreter`.

use clap::Args;

/// `mbd-lab interpreter`.
#[derive(Args)]
pub struct InterpreterArgs {
    /// Mechanisms, separated by commas [default: all]
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    pub mechanisms: Vec<String>,
    /// Call the rates this many times and print nothing, for a profiler
    #[arg(long, value_name = "N")]
    pub calls: Option<u64>,
    /// Time the elimination that the search chose, in place of one joint at a time
    #[arg(long)]
    pub searched: bool,
}
