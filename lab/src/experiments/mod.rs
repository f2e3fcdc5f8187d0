//! `mbd-lab experiments`: repeats chapter 7 of the thesis and prints its numbers for comparison. `book/src/experiments.md`
//! states the decisions on points that the thesis leaves open.

mod biped;
mod breaking;
mod clock;
mod drops;
mod forms;
mod mechanism;
mod pairs;
mod plain;
mod scaling;
mod study;
mod tables;
mod thesis;

use std::io::Write;
use std::path::Path;

use crate::args::experiments::{Experiment, ExperimentsArgs};
use mbd_cli::plot::{self, Panel};
use mbd_cli::write_file;
use mbd_cli::{Failure, Outcome};

/// Runs the experiment.
pub fn run(args: &ExperimentsArgs, out: &mut dyn Write) -> Outcome {
    match &args.experiment {
        Experiment::Biped(args) => biped::run(args, out),
        Experiment::Breaking(args) => breaking::run(args, out),
        Experiment::Drops(args) => drops::run(args, out),
        Experiment::Pairs(args) => pairs::run(args, out),
        Experiment::Scaling(args) => scaling::run(args, out),
    }
}

/// Makes the directory of the figures before the measurements start, so that a failure is reported at once.
fn directory(path: Option<&Path>) -> Outcome {
    let Some(path) = path else { return Ok(()) };
    std::fs::create_dir_all(path)
        .map_err(|e| Failure::new(format!("cannot make `{}`: {e}", path.display()), "name another directory"))
}

/// Draws a figure and prints its path.
fn figure(out: &mut dyn Write, directory: &Path, name: &str, title: &str, x: &str, panels: &[Panel]) -> Outcome {
    let picture = plot::svg_over(title, x, panels);
    let path = directory.join(format!("{name}.svg"));
    write_file(&path, &picture)?;
    writeln!(out, "figure: {}", path.display())?;
    Ok(())
}
