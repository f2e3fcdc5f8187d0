//! The only door: a model and options in, straight-line Rust out. The macro, the command line and build scripts all come
//! through here.

use crate::emit;
use crate::model::Model;
pub use crate::options::{Arithmetic, Options, Output, Precision, RolledCode};
use crate::plan::Plan;
use crate::rolled::rolled;
use crate::search;
use crate::symbolic::{Counts, Operand, ProgramResult};
use crate::trace::coordinate_map;
pub use crate::trace::{chosen_frames, trace, InputArray, OutputProgram};

/// Generated code and what is known about it.
#[derive(Clone, Debug)]
pub struct Generated {
    /// Rust source: one type with its functions.
    pub source: String,
    /// Operations of each function.
    pub counts: Vec<(Output, Counts)>,
    /// What was changed on the way.
    pub notices: Vec<String>,
}

/// Generates code for a checked model.
///
/// # Errors
/// An unknown frame name in the options, an output that the model does not have, or a number that is not finite in the code (a freedom without inertia, which the
/// checks cannot see where parameters are involved), as a message.
pub fn generate(model: &Model, options: &Options) -> Result<Generated, String> {
    let options = &options.of_model(!model.constraints.is_empty());
    let plan = search::plan(model, options.searches());
    let groups = options.outputs.iter().map(|&g| match rolled(&plan, g, options) {
        Some(program) => Ok(OutputProgram::rolled(program)),
        None => trace(&plan, g, options),
    });
    let groups = groups.collect::<Result<Vec<_>, String>>()?;
    groups.iter().try_for_each(|g| finite(&plan, g, options.precision))?;
    let counts = groups.iter().map(|g| (g.group, g.counts())).collect();
    let map = coordinate_map(&plan);
    let source = emit::source(&plan, options, &groups, &map);
    Ok(Generated { source, counts, notices: plan.notices.clone() })
}

/// Refuses infinities, which no literal can state, and with them models that divide by zero whatever the state is.
fn finite(plan: &Plan, group: &OutputProgram, precision: Precision) -> Result<(), String> {
    let fits = |x: f64| match precision {
        Precision::F64 => x.is_finite(),
        Precision::F32 => (x as f32).is_finite(),
    };
    let name = group.group.name();
    if group.loops.as_ref().is_some_and(|l| !l.all_constants(fits)) {
        return Err(format!("`{name}` contains an infinite number: is there a freedom without inertia?"));
    }
    for (_, op, (node, _)) in &group.program.steps {
        if op.operands().any(|o| matches!(o, Operand::Const(bits) if !fits(f64::from_bits(bits)))) {
            let body = node.map_or("ground", |i| plan.nodes[i].name.as_str());
            return Err(format!(
                "`{name}` contains an infinite number at body `{body}`: is there a freedom without inertia?"
            ));
        }
    }
    match group.program.outputs.iter().any(|o| matches!(o, ProgramResult::Const(x) if !fits(*x))) {
        true => Err(format!("`{name}` has a result that is always infinite: is there a freedom without inertia?")),
        false => Ok(()),
    }
}
