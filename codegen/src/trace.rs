//! Tracing: runs the sweeps on symbols, from a plan to the straight-line program of each output.

#[cfg(feature = "derivatives")]
mod derivatives;
mod inputs;

use std::collections::BTreeSet;

use mbd_runtime::spatial::Motion;
use mbd_runtime::sweep::{FrameState, Sweeps};
use mbd_runtime::tree::row_order::early_rows;
use mbd_runtime::tree::{Bond, Closure, Tree};
use mbd_runtime::workspace::Workspace;
use mbd_runtime::Scalar;

use crate::error::GenerateError;
use crate::options::{Arithmetic, EliminationStrategy, Options, Precision};
use crate::output::{Availability, Output, OutputProgram, Sizes, Spec, COORDINATE_RATES};
use crate::plan::Plan;
use crate::symbolic::{passes, Entry, Expr, Graph, Name, Program, Rewrite};
pub use inputs::sizes;
pub(crate) use inputs::SymbolicInputs;

/// Frames of the options, as indices into the plan's, each once.
///
/// # Errors
/// A name that is none of a frame or body.
pub fn chosen_frames(plan: &Plan, options: &Options) -> Result<Vec<usize>, GenerateError> {
    if options.frames.is_empty() {
        return Ok((0..plan.frames.len()).collect());
    }
    let find = |name: &String| {
        let found = plan.frames.iter().position(|f| f.name == *name);
        found.ok_or_else(|| GenerateError::UnknownFrame { name: name.clone() })
    };
    let mut chosen = options.frames.iter().map(find).collect::<Result<Vec<usize>, _>>()?;
    let mut seen = BTreeSet::new();
    chosen.retain(|frame| seen.insert(*frame));
    Ok(chosen)
}

/// Rejects an output that the model does not have.
fn check_availability(plan: &Plan, output: Output) -> Result<(), GenerateError> {
    let model = || plan.model.name.clone();
    if cfg!(not(feature = "derivatives")) && output.differentiates() {
        return Err(GenerateError::BuiltWithoutDerivatives { output });
    }
    match output.spec().availability {
        // Where some rows act, or none, there are the outputs of plans with rows.
        _ if output.spec().available(plan.dims.rows > 0) => Ok(()),
        Availability::WithContacts if plan.has_contacts() => Ok(()),
        Availability::WithContacts => Err(GenerateError::OutputNeedsContacts { output, model: model() }),
        Availability::WithoutConstraints => Err(GenerateError::OutputLacksConstraints { output, model: model() }),
        _ => Err(GenerateError::OutputNeedsConstraints { output, model: model() }),
    }
}

/// Fraction of a row's diagonal entry below which the row counts as redundant.
pub(crate) fn tolerance(precision: Precision) -> f64 {
    match precision {
        Precision::F64 => f64::rank_tolerance(),
        Precision::F32 => f32::rank_tolerance().into(),
    }
}

/// The rewriting of programs for given options. Where the fewest operations are asked for, nothing is computed twice to
/// save time.
pub(crate) fn rewrite(options: &Options) -> Rewrite {
    match (options.arithmetic, options.plan.elimination) {
        (Arithmetic::Exact, _) => Rewrite::None,
        (Arithmetic::Fast, EliminationStrategy::Fewest) => Rewrite::Fewest,
        (Arithmetic::Fast, EliminationStrategy::Fastest | EliminationStrategy::Single) => Rewrite::Shortest,
    }
}

/// What an output takes and gives in a plan: with early rows of contacts also whether all of them act.
pub(crate) fn spec_of(plan: &Plan, output: Output) -> &'static Spec {
    match plan.early_tolerance {
        Some(_) => output.with_early_rows(),
        None => output.spec(),
    }
}

/// The tree of a plan for one output, not regrouped.
pub(crate) fn symbolic_tree<'g>(
    plan: &Plan,
    output: Output,
    given: &SymbolicInputs<'g>,
    options: &Options,
) -> Tree<Expr<'g>> {
    let mut tree = plan.tree(&given.params);
    tree.tolerance = Expr::Const(tolerance(options.precision));
    // Rates do not tell multipliers. Early rows are independent, so that their axes do not decide which are left out.
    if output == Output::Rates && plan.early_tolerance.is_some() {
        let early: Vec<usize> = early_rows(&tree).into_iter().map(|(_, g)| g).collect();
        for constraint in &mut tree.constraints {
            let Bond::Cut(cut) = &mut constraint.bond else { continue };
            let Closure::RollingBall { radius } = cut.closure else { continue };
            if !constraint.slots.iter().all(|g| early.contains(g)) {
                continue;
            }
            match radius {
                // A point that has no slip is held by a ball joint.
                Expr::Const(0.0) => cut.closure = Closure::Spherical,
                _ => constraint.own_axes = true,
            }
        }
    }
    tree
}

/// Runs the sweeps of one output on symbols.
///
/// # Errors
/// An unknown frame name in the options, or an output that the model does not have.
pub fn trace(plan: &Plan, output: Output, options: &Options) -> Result<OutputProgram<Program>, GenerateError> {
    check_availability(plan, output)?;
    let frames = chosen_frames(plan, options)?;
    let spec = spec_of(plan, output);
    let (graph, sizes) = (Graph::default(), sizes(plan, options, frames.len()));
    let given = SymbolicInputs::new(&graph, plan, spec, options);
    let mut physical = symbolic_tree(plan, output, &given, options);
    if !given.acts.is_empty() {
        physical = physical.with_row_factors(given.acts.clone());
    }
    let tree = physical.regrouped();
    let run = Run { graph: &graph, plan, tree: &tree, physical: &physical, given: &given, frames: &frames };
    let mut results: Vec<Vec<Expr>> = spec.results.iter().map(|a| vec![Expr::zero(); a.len(&sizes)]).collect();
    let (own, further) = results.split_at_mut(output.spec().results.len());
    let early_rows_act = run.sweep(output, own);
    further.iter_mut().for_each(|flag| flag[0] = early_rows_act);
    name_results(&graph, spec, &sizes, &results);
    let program = passes::run(Program::new(&graph, &results.concat()), rewrite(options));
    Ok(OutputProgram { spec, inputs: given.arrays, program })
}

/// Names results that the sweeps have not named after their array and their index.
fn name_results(graph: &Graph, spec: &Spec, sizes: &Sizes, results: &[Vec<Expr>]) {
    for (array, values) in spec.results.iter().zip(results) {
        let lengths = array.lengths(sizes);
        for (k, value) in values.iter().enumerate() {
            let Expr::Node { id, neg: minus, .. } = *value else { continue };
            let entry = match lengths[..] {
                [_] => Entry::Number(k),
                [.., n] => Entry::Pair(k / n, k % n),
                [] => Entry::Axes(""),
            };
            let (_, (node, _)) = graph.get(id);
            graph.set_name(id, Name { node, minus, letter: array.name, entry });
        }
    }
}

/// A run of the sweeps on symbols.
struct Run<'a, 'g> {
    graph: &'g Graph,
    #[cfg_attr(not(feature = "derivatives"), allow(dead_code, reason = "derivatives read it"))]
    plan: &'a Plan,
    /// The mechanism with the chosen elimination.
    tree: &'a Tree<Expr<'g>>,
    /// The same with the bodies' own inertias, not regrouped.
    physical: &'a Tree<Expr<'g>>,
    given: &'a SymbolicInputs<'g>,
    frames: &'a [usize],
}

impl<'g> Run<'_, 'g> {
    /// Calls the sweep of an output, which writes the arrays of [`Spec::results`]. Gives [`Sweeps::early_rows_act`].
    fn sweep(&self, output: Output, results: &mut [Vec<Expr<'g>>]) -> Expr<'g> {
        let (tree, trace, given) = (self.tree, self.graph, self.given);
        let (q, second, third, u) = (&given.q, &given.second, &given.third, &given.inputs());
        let sweeps = Sweeps { tree, trace };
        // The tree for accelerations, where another elimination is better for them.
        let other = Sweeps { tree: tree.for_accelerations(), trace };
        let (used, mut w) = match output {
            Output::Accelerations | Output::Reactions | Output::Multipliers => {
                (&other, Workspace::for_accelerations(tree))
            }
            _ => (&sweeps, Workspace::new(tree)),
        };
        let w = &mut w;
        let v = &mut vec![Expr::zero(); tree.dims.nv];
        match (output, results) {
            (Output::Rates, [qd, pd]) => sweeps.rates(q, second, u, w, v, qd, pd),
            (Output::Velocities, [v]) => sweeps.velocities(q, second, u, w, v),
            (Output::Momenta, [p]) => sweeps.momenta(q, second, u, w, p),
            (Output::Energy, [energy]) => (energy[0], energy[1]) = sweeps.energy(q, second, u, w, v),
            (Output::Accelerations, [a]) => other.accelerations(q, second, u, w, a),
            (Output::Reactions, [wrenches]) => {
                other.accelerations(q, second, u, w, v);
                let mut out = vec![[Expr::zero(); 6]; tree.joint_nodes.len()];
                Sweeps { tree: self.physical, trace }.reactions(q, second, v, u, w, &mut out);
                *wrenches = out.concat();
            }
            (Output::MassMatrix, [m]) => sweeps.mass_matrix(q, u, w, m),
            (Output::Frames, [rotation, position, velocity]) => {
                let mut states = vec![FrameState::ground(); self.frames.len()];
                sweeps.frame_states(q, second, u, w, self.frames().zip(&mut states));
                let motion = |m: Motion<Expr<'g>>| [m.lin, m.ang].concat();
                *rotation = states.iter().flat_map(|s| s.rotation.concat()).collect();
                *position = states.iter().flat_map(|s| s.position).collect();
                *velocity = states.iter().flat_map(|s| motion(s.velocity)).collect();
            }
            (Output::InverseDynamics, [tau]) => sweeps.inverse_dynamics(q, second, third, u, w, tau),
            (Output::Bias, [h]) => sweeps.bias(q, second, u, w, h),
            (Output::Regressor, [y]) => {
                Sweeps { tree: self.physical, trace }.regressor(q, second, third, u, w, y);
            }
            (Output::Jacobians, [jacobian]) => sweeps.jacobians(q, u, w, self.frames(), jacobian),
            (Output::BiasAccelerations, [bias]) => {
                let mut out = vec![[Expr::zero(); 6]; self.frames.len()];
                sweeps.bias_accelerations(q, second, u, w, self.frames().zip(&mut out));
                *bias = out.concat();
            }
            (Output::Centroidal, [center, matrix, bias]) => {
                Sweeps { tree: self.physical, trace }.centroidal(q, second, u, w, center, matrix, bias);
            }
            #[cfg(feature = "derivatives")]
            (Output::Derivatives | Output::MomentumDerivatives | Output::ParameterDerivatives, results) => {
                self.derivatives(output, results);
            }
            (Output::ConstraintResiduals, [phi, entries]) => sweeps.constraint_residuals(q, u, w, phi, entries),
            (Output::ProjectMomenta, [v, freed, sigma]) => sweeps.project_momenta(q, second, u, w, v, freed, sigma),
            (Output::PositionCorrection, [phi, dq, pivots]) => sweeps.position_correction(q, u, w, phi, dq, pivots),
            (Output::Gaps, [gaps, velocities, entries]) => sweeps.gaps(q, second, u, w, [gaps, velocities, entries]),
            (Output::Multipliers, [lambda]) => other.multipliers(q, second, u, w, v, lambda),
            _ => unreachable!("results are those of the table"),
        }
        used.early_rows_act(&w.factor)
    }

    /// The chosen frames.
    fn frames(&self) -> impl Iterator<Item = &mbd_runtime::tree::TreeFrame<Expr<'g>>> + Clone {
        self.frames.iter().map(|&k| &self.tree.frames[k])
    }
}

/// Program of `q̇ = N(q) v`.
pub(crate) fn coordinate_rates(plan: &Plan, options: &Options) -> OutputProgram<Program> {
    let (graph, spec) = (Graph::default(), COORDINATE_RATES);
    let given = SymbolicInputs::new(&graph, plan, spec, options);
    let tree: Tree<Expr> = plan.tree(&given.params);
    let mut qd = vec![Expr::zero(); plan.dims.nq];
    Sweeps { tree: &tree, trace: &graph }.coordinate_rates(&given.q, &given.second, &mut qd);
    OutputProgram { spec, inputs: given.arrays, program: Program::new(&graph, &qd) }
}
