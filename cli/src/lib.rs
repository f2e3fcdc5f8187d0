//! The command `mbd`: every subcommand takes its arguments and a writer, and returns an error if it fails.
//!
//! This library serves the executable and the project's own experiments. Its interface may change in any release;
//! programs should use `multibody`.

mod args;
mod certify;
mod check;
mod columns;
mod completions;
mod condition;
mod contacts;
mod control;
mod convert;
mod count;
mod displacement;
mod energy;
mod eval;
mod explain;
#[cfg(feature = "fmu")]
mod fmu;
mod generate;
mod identifiable;
pub mod ink;
mod interrupt;
mod json;
mod loops;
mod modes;
mod motion;
mod output;
mod picture;
pub mod plot;
mod probe;
mod rivals;
mod simulate;
mod source;
mod stale;
mod start;
mod tables;
mod timed;
mod tour;
mod trust;
mod verdict;
mod view;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

use args::{Arguments, Command};

pub use args::HOLD;
pub use output::{note, write_file};

/// Reason why a command stopped.
#[derive(Debug)]
pub enum Failure {
    /// What is wrong, where, and what to do about it.
    Message(String, String),
    /// The findings have already been written to standard error.
    Shown,
    /// The reader of standard output has closed it.
    Pipe,
    /// The user has interrupted the command, which has written what it had.
    Interrupted,
}

impl Failure {
    /// A message with help.
    pub fn new(what: impl Into<String>, help: impl Into<String>) -> Failure {
        Failure::Message(what.into(), help.into())
    }
}

impl From<std::io::Error> for Failure {
    fn from(e: std::io::Error) -> Self {
        match e.kind() {
            std::io::ErrorKind::BrokenPipe => Failure::Pipe,
            _ => Failure::new(format!("cannot write to standard output: {e}"), "is the disk full?"),
        }
    }
}

/// Result of a command.
pub type Outcome<T = ()> = Result<T, Failure>;

/// The command `mbd`: reads the arguments and runs the subcommand.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    reported(|out| run(arguments.command, out))
}

/// Runs a command on standard output and reports its failure on standard error. Exit status 0: done; 1: findings or a
/// failure.
pub fn reported(command: impl FnOnce(&mut dyn Write) -> Outcome) -> ExitCode {
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    let result = command(&mut out).and_then(|()| Ok(out.flush()?));
    match result {
        Ok(()) | Err(Failure::Pipe) => ExitCode::SUCCESS,
        Err(failure) => {
            // Results that were written before the failure are flushed before its message.
            let _ = out.flush();
            if let Failure::Interrupted = failure {
                return ExitCode::from(interrupt::STATUS);
            }
            if let Failure::Message(what, help) = failure {
                note(format_args!("error: {what}\n  help: {help}"));
            }
            ExitCode::FAILURE
        }
    }
}

fn run(command: Option<Command>, out: &mut dyn Write) -> Outcome {
    match command {
        None => tour::run(out),
        Some(Command::Check(a)) => check::run(&a, out),
        Some(Command::Convert(a)) => convert::run(&a, out),
        Some(Command::Count(a)) => count::run(&a, out),
        Some(Command::Generate(a)) => generate::run(&a, out),
        Some(Command::Eval(a)) => eval::run(&a, out),
        Some(Command::Certify(a)) => certify::run(&a, out),
        Some(Command::Simulate(a)) => simulate::run(&a, out),
        Some(Command::Modes(a)) => modes::run(&a, out),
        Some(Command::Explain(a)) => explain::run(&a, out),
        Some(Command::Identifiable(a)) => identifiable::run(&a, out),
        Some(Command::View(a)) => view::run(&a, out),
        Some(Command::Completions(a)) => completions::run(&a, out),
    }
}
