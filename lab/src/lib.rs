//! Measurements of this project: the experiments of the thesis, and the benches of the integrators.

mod args;
#[cfg(feature = "generated")]
mod bench;
mod experiments;
#[cfg(feature = "generated")]
pub mod generated;
mod interpreter;
pub mod scenes;
pub mod stability;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use mbd_cli::Outcome;

use args::{Arguments, Command};

/// The command `mbd-lab`: reads the arguments and runs the experiment or the bench. The exit status is that of `mbd`.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    mbd_cli::reported(|out| run(arguments.command, out))
}

fn run(command: Command, out: &mut dyn Write) -> Outcome {
    match command {
        Command::Experiments(a) => experiments::run(&a, out),
        Command::Stability(a) => stability::run(&a, out),
        Command::Interpreter(a) => interpreter::run(&a, out),
        #[cfg(feature = "generated")]
        Command::Bench(a) => bench::run(&a, out),
        #[cfg(not(feature = "generated"))]
        Command::Bench(_) => Err(mbd_cli::Failure::new(
            "this build leaves out the generated code that the benches run",
            "cargo run --release -p mbd-lab --features generated -- bench ...",
        )),
    }
}
