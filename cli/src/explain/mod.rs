//! `mbd explain`: intermediate results of the generator.

mod frames;
mod program;

use std::io::Write;

use multibody::codegen::generate::trace;
use multibody::codegen::Options;

use super::args::{ExplainArgs, Stage};
use super::generate;
use super::{source, Outcome};

/// Prints one stage.
pub fn run(args: &ExplainArgs, out: &mut dyn Write) -> Outcome {
    let plan = source::plan(&args.model, args.code.plan_options())?;
    let options: Options = args.code.options(&plan.model.name).of_model(!plan.constraints.is_empty());
    if args.after == Stage::Frames {
        return frames::print(&plan, out);
    }
    for &group in &options.outputs {
        let program = trace(&plan, group, &options).map_err(generate::failure)?;
        match args.after {
            Stage::Frames => {}
            Stage::Trace => program::created(&program, out)?,
            Stage::Simplify => program::statements(&plan, &program, out)?,
            Stage::Schedule => program::schedule(&program, options.chunk, out)?,
        }
    }
    Ok(())
}
