//! Generation of Rust code from a model and options. The macro, the command and build scripts all use it.

use mbd_runtime::contact::Mode;

use crate::code::Programs;
use crate::emit;
#[doc(hidden)]
pub use crate::emit::quantity;
pub use crate::error::GenerateError;
use crate::model::Model;
use crate::modes::OF_EACH_SET;
pub use crate::options::{Arithmetic, LikeBranches, Options, Precision, RolledCode};
pub use crate::output::{InputArray, Output, OutputProgram};
use crate::plan::Plan;
use crate::search;
use crate::symbolic::Counts;
pub use crate::trace::{chosen_frames, sizes, trace};
use crate::transfer::moves::moves;
use crate::transfer::NoCode;

/// Generated code and information about it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Generated {
    /// Rust source: one type with its functions.
    pub source: String,
    /// Operations of each function.
    pub counts: Vec<(Output, Counts)>,
    /// Sets of modes of contacts that have functions of their own, with operations of each of these.
    pub sets: Vec<CountsOfModes>,
    /// Operations of the outputs that are put together from pieces.
    pub pieces: Vec<CountsOfPieces>,
    /// Notices about changes, such as angles that became right angles.
    pub notices: Vec<String>,
}

/// The operations of an output that is put together from pieces.
#[derive(Clone, Copy, Debug)]
pub struct CountsOfPieces {
    /// Which output.
    pub output: Output,
    /// Number of pieces.
    pub count: usize,
    /// Operations of all pieces.
    pub operations: usize,
    /// Operations that are executed where all contacts are open.
    pub flight: usize,
    /// The same where every contact sticks, or is closed if it has no friction.
    pub stick: usize,
}

/// Modes of the contacts, and the operations of the functions that were generated for them.
pub type CountsOfModes = (Vec<Mode>, Vec<(Output, Counts)>);

/// Generates code for a checked model.
///
/// # Errors
/// An unknown frame name in the options, an output that the model does not have, or a number that is not finite in the
/// code (a freedom without inertia, which the checks cannot see where parameters are involved).
pub fn generate(model: &Model, options: &Options) -> Result<Generated, GenerateError> {
    let options = &options.of_model(!model.constraints.is_empty());
    generate_from(&search::plan(model, options.searches()), options)
}

/// Generates code with the eliminations of a plan; [`Options::plan`] has no part in it.
///
/// # Errors
/// The same as of [`generate`].
pub fn generate_from(plan: &Plan, options: &Options) -> Result<Generated, GenerateError> {
    let (plan, programs) = match &options.modes {
        None => (plan.clone(), Programs::new(plan, options)?.with_like_branches(plan, options)),
        Some(choice) => {
            let full = plan.with_contacts();
            (full.masked(), Programs::of_modes(&full, choice, options)?)
        }
    };
    let source = emit::source(&emit::Input { plan: &plan, options, programs: &programs });
    let sets = programs.sets.iter().map(|set| {
        let outputs = OF_EACH_SET.into_iter().filter(|output| options.outputs.contains(output));
        (set.modes.clone(), outputs.zip(set.outputs.iter().map(|p| p.program.counts())).collect())
    });
    let pieces = options.outputs.iter().filter_map(|output| {
        let program = &programs.factored.iter().find(|program| program.spec.name == output.name())?.program;
        Some(CountsOfPieces {
            output: *output,
            count: program.count(),
            operations: program.counts().total(),
            flight: program.in_flight(),
            stick: program.sticking(),
        })
    });
    let (pieces, notices) = (pieces.collect(), plan.notices.clone());
    Ok(Generated { source, counts: programs.counts(options), sets: sets.collect(), pieces, notices })
}

/// Rust that carries states over from one generated type to another: the implementation of the runtime's `TransferFrom`
/// for the type of `to`, for which `options` are, from the type `old` of the model `from` in the same module. The new type
/// needs the outputs `rates` and `momenta`, the old one `rates` and, where a floating joint is new, `frames` of all bodies.
///
/// # Errors
/// [`NoCode`]: the new joints are other than floating, or more than the tree has changed.
pub fn transfer_code(from: &Model, old: &str, to: &Model, options: &Options) -> Result<String, NoCode> {
    let [from, to] = [from, to].map(|model| Plan::new(model, options.plan.snap));
    let moves = moves(&from, &to)?;
    Ok(emit::transfer::implementation(&from, old, &to, options, &moves))
}
