//! `mbd identifiable`.

use std::io::Write;

use multibody::codegen::identifiable::identifiable;
use multibody::codegen::options::{EliminationStrategy, PlanOptions};

use super::args::IdentifiableArgs;
use super::output::note;
use super::{source, Outcome};

/// Prints the base parameters of a model, one to a line.
pub fn run(args: &IdentifiableArgs, out: &mut dyn Write) -> Outcome {
    // The elimination does not enter the regressor.
    let options = PlanOptions { elimination: EliminationStrategy::Single, ..PlanOptions::default() };
    let plan = source::plan(&args.model, options)?;
    if !plan.constraints.is_empty() {
        note(format_args!("notice: loops and couplings are left open: their forces count among the joint forces"));
    }
    let found = identifiable(&plan);
    writeln!(
        out,
        "{}: {} dynamic parameters of {} bodies and {} velocities; {} base parameters, {} without effect",
        plan.model.name,
        found.names.len(),
        plan.joint_nodes.len(),
        plan.dims.nv,
        found.base.len(),
        found.without_effect.len()
    )?;
    writeln!(
        out,
        "m: mass; mx, my, mz: first moment; ixx ... izz: inertia, at the frame of the body, with what is fixed to it\n"
    )?;
    writeln!(out, "{found}")?;
    let without: Vec<&str> = found.without_effect.iter().map(|&k| found.names[k].as_str()).collect();
    if !without.is_empty() {
        writeln!(out, "without effect: {}", without.join(", "))?;
    }
    Ok(())
}
