//! `mbd-lab stability`: sweeps over states at which methods fail first. Every sweep is run by one command, which writes
//! its tables into `reports/`; tests run reduced versions of them.

pub mod change_points;
pub mod mechanisms;
pub mod tables;

use std::io::Write;

use crate::args::stability::{StabilityArgs, Sweep};
use mbd_cli::Outcome;

/// Runs the sweep.
pub(crate) fn run(args: &StabilityArgs, out: &mut dyn Write) -> Outcome {
    match &args.sweep {
        Sweep::ChangePoints(args) => tables::change_points(args, out),
    }
}
