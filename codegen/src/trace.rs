//! The sweeps run on symbols: from a plan to the program of each output group.

mod directional;

use mbd_runtime::spatial::Motion;
use mbd_runtime::sweep::{Derivatives, FrameState, Inputs, MomentumDerivatives, ParameterDerivatives, Sweeps};
use mbd_runtime::tree::Tree;
use mbd_runtime::workspace::Workspace;
use mbd_runtime::{Dual, Scalar};

use crate::model::Gravity;
use crate::options::{Arithmetic, EliminationStrategy, Options, Output, Precision};
use crate::plan::Plan;
use crate::rolled::RolledProgram;
use crate::symbolic::{passes, Counts, Expr, Graph, Program, Rewrite};

/// One array of numbers that generated code is called with; its inputs are numbered through all arrays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputArray {
    /// Expression in the generated code: `q`, `p`, `self.tau`.
    pub name: String,
    /// Length; for wrenches, six times their number.
    pub len: usize,
    /// Whether it is an array of arrays of six.
    pub sixes: bool,
}

/// Program of one output group.
#[derive(Clone, Debug)]
pub struct OutputProgram {
    /// Which.
    pub group: Output,
    /// Input arrays, numbered through.
    pub inputs: Vec<InputArray>,
    /// The program; empty where the group is in loop form.
    pub program: Program,
    /// The group in loop form.
    pub loops: Option<RolledProgram>,
}

impl OutputProgram {
    /// A group in loop form.
    pub fn rolled(loops: RolledProgram) -> OutputProgram {
        OutputProgram {
            group: loops.group,
            inputs: loops.inputs.clone(),
            program: Program::default(),
            loops: Some(loops),
        }
    }

    /// Operations that are executed.
    pub fn counts(&self) -> Counts {
        self.loops.as_ref().map_or_else(|| self.program.counts(), RolledProgram::counts)
    }
}

/// Symbolic inputs of one function.
pub(crate) struct Symbols<'g> {
    graph: &'g Graph,
    arrays: Vec<InputArray>,
    next: usize,
}

/// What a group is given, as symbols.
pub(crate) struct SymbolicInputs<'g> {
    /// Input arrays, numbered through.
    pub arrays: Vec<InputArray>,
    /// Coordinates.
    pub q: Vec<Expr<'g>>,
    /// Momenta or velocities, whichever the group takes.
    pub second: Vec<Expr<'g>>,
    /// Accelerations, where the group takes them.
    pub third: Vec<Expr<'g>>,
    /// Joint forces.
    pub tau: Vec<Expr<'g>>,
    /// Prescribed positions, rates, accelerations.
    pub drive: [Vec<Expr<'g>>; 3],
    /// External wrenches.
    pub wrenches: Vec<[Expr<'g>; 6]>,
    /// Run-time parameters.
    pub params: Vec<Expr<'g>>,
    /// Gravity in ground axes.
    pub gravity: [Expr<'g>; 3],
}

impl<'g> SymbolicInputs<'g> {
    /// Symbols for the inputs of a group.
    pub fn new(graph: &'g Graph, plan: &Plan, group: Output, options: &Options) -> SymbolicInputs<'g> {
        let mut symbols = Symbols { graph, arrays: Vec::new(), next: 0 };
        let dims = plan.dims;
        let q = symbols.array("q", dims.nq);
        let second = match group {
            Output::Rates
            | Output::Velocities
            | Output::Energy
            | Output::Derivatives
            | Output::ParameterDerivatives
            | Output::ProjectMomenta => symbols.array("p", dims.nv),
            Output::MassMatrix | Output::Jacobians | Output::ConstraintResiduals | Output::PositionCorrection => {
                Vec::new()
            }
            _ => symbols.array("v", dims.nv),
        };
        let third = if group == Output::InverseDynamics { symbols.array("a", dims.nv) } else { Vec::new() };
        let tau = if options.efforts { symbols.array("self.tau", dims.nv) } else { Vec::new() };
        let drive_q = symbols.array("self.drive_q", dims.drive_q);
        let drive_v = symbols.array("self.drive_v", dims.drive_v);
        let drive_a = symbols.array("self.drive_a", dims.drive_v);
        let flat = symbols.array("self.wrenches", 6 * dims.wrenches);
        let wrenches = flat.chunks(6).map(|c| std::array::from_fn(|k| c[k])).collect();
        let params = symbols.array("self.params", plan.model.params.len());
        let gravity = match plan.model.gravity {
            Gravity::Constant(g) => g.map(|v| match v {
                crate::model::Value::Const(x) => Expr::Const(x),
                crate::model::Value::Param(k) => params[k],
            }),
            Gravity::Input => {
                let g = symbols.array("self.gravity", 3);
                std::array::from_fn(|k| g[k])
            }
        };
        let drive = [drive_q, drive_v, drive_a];
        SymbolicInputs { arrays: symbols.arrays, q, second, third, tau, drive, wrenches, params, gravity }
    }

    /// As the sweeps take it.
    pub fn inputs(&self) -> Inputs<'_, Expr<'g>> {
        let [drive_q, drive_v, drive_a] = &self.drive;
        Inputs { tau: &self.tau, drive_q, drive_v, drive_a, wrenches: &self.wrenches, gravity: self.gravity }
    }
}

impl<'g> Symbols<'g> {
    fn array(&mut self, name: &str, len: usize) -> Vec<Expr<'g>> {
        self.arrays.push(InputArray { name: name.to_string(), len, sixes: name == "self.wrenches" });
        self.next += len;
        (self.next - len..self.next).map(|k| self.graph.input(k)).collect()
    }
}

/// Frames of the options, as indices into the plan's.
pub fn chosen_frames(plan: &Plan, options: &Options) -> Result<Vec<usize>, String> {
    if options.frames.is_empty() {
        return Ok((0..plan.frames.len()).collect());
    }
    let find = |name: &String| {
        plan.frames.iter().position(|f| f.name == *name).ok_or_else(|| format!("no frame or body is named `{name}`"))
    };
    options.frames.iter().map(find).collect()
}

/// Whether a model has an output.
fn has(plan: &Plan, group: Output) -> Result<(), String> {
    let (name, constrained) = (group.name(), !plan.constraints.is_empty());
    let model = &plan.model.name;
    if Output::CONSTRAINED.contains(&group) && !constrained {
        return Err(format!("`{name}` is an output of mechanisms with loops or couplings, and `{model}` has none"));
    }
    if group.of_trees() && constrained {
        return Err(format!("`{name}` does not know the loops and couplings of `{model}`: use `derivatives`"));
    }
    Ok(())
}

/// Part of a row's diagonal below which it counts as redundant.
pub(crate) fn tolerance(precision: Precision) -> f64 {
    match precision {
        Precision::F64 => f64::rank_tolerance(),
        Precision::F32 => f32::rank_tolerance().into(),
    }
}

/// How the programs of some options are rewritten. Whoever wants the fewest operations gets none twice to save time.
pub(crate) fn rewrite(options: &Options) -> Rewrite {
    match (options.arithmetic, options.plan.elimination) {
        (Arithmetic::Exact, _) => Rewrite::None,
        (Arithmetic::Fast, EliminationStrategy::Fewest) => Rewrite::Fewest,
        (Arithmetic::Fast, EliminationStrategy::Fastest | EliminationStrategy::Single) => Rewrite::Shortest,
    }
}

/// Runs the sweeps of one group on symbols.
///
/// # Errors
/// An unknown frame name in the options, or an output that the model does not have, as a message.
pub fn trace(plan: &Plan, group: Output, options: &Options) -> Result<OutputProgram, String> {
    has(plan, group)?;
    let graph = Graph::default();
    let given = SymbolicInputs::new(&graph, plan, group, options);
    let mut physical: Tree<Expr> = plan.tree(&given.params);
    physical.tolerance = Expr::Const(tolerance(options.precision));
    let tree = physical.regrouped();
    let frames = chosen_frames(plan, options)?;
    let state = [given.q.as_slice(), &given.second, &given.third];
    let outputs = match group {
        Output::Derivatives | Output::ParameterDerivatives if !plan.constraints.is_empty() => {
            directional::derivatives(&graph, plan, group, &given, tree.tolerance)
        }
        Output::ParameterDerivatives => {
            parameter_derivatives(&graph, plan, &tree, &given.q, &given.second, &given.params, &given.inputs())
        }
        _ => run(&graph, [&tree, &physical], group, state, &given.inputs(), &frames),
    };
    let program = passes::run(Program::new(&graph, &outputs), rewrite(options));
    Ok(OutputProgram { group, inputs: given.arrays, program, loops: None })
}

fn run<'g>(
    graph: &'g Graph,
    [tree, physical]: [&Tree<Expr<'g>>; 2],
    group: Output,
    [q, second, third]: [&[Expr<'g>]; 3],
    inputs: &Inputs<Expr<'g>>,
    frames: &[usize],
) -> Vec<Expr<'g>> {
    let sweeps = Sweeps { tree, trace: graph };
    let mut w = Workspace::new(tree);
    let dims = tree.dims;
    let zeros = |n: usize| vec![Expr::zero(); n];
    let mut v = zeros(dims.nv);
    match group {
        Output::Rates => {
            let (mut qd, mut pd) = (zeros(dims.nq), zeros(dims.nv));
            sweeps.rates(q, second, inputs, &mut w, &mut v, &mut qd, &mut pd);
            qd.extend(pd);
            qd
        }
        Output::Velocities => {
            sweeps.velocities(q, second, inputs, &mut w, &mut v);
            v
        }
        Output::Momenta => {
            sweeps.momenta(q, second, inputs, &mut w, &mut v);
            v
        }
        Output::Energy => {
            let (kinetic, potential) = sweeps.energy(q, second, inputs, &mut w, &mut v);
            vec![kinetic, potential]
        }
        Output::Accelerations => {
            let sweeps = Sweeps { tree: tree.for_accelerations(), trace: graph };
            sweeps.accelerations(q, second, inputs, &mut w, &mut v);
            v
        }
        Output::Reactions => {
            let sweeps = Sweeps { tree: tree.for_accelerations(), trace: graph };
            sweeps.accelerations(q, second, inputs, &mut w, &mut v);
            let mut out = vec![[Expr::zero(); 6]; tree.joint_nodes.len()];
            Sweeps { tree: physical, trace: graph }.reactions(q, second, &v, inputs, &mut w, &mut out);
            out.concat()
        }
        Output::InverseDynamics => {
            sweeps.inverse_dynamics(q, second, third, inputs, &mut w, &mut v);
            v
        }
        Output::Bias => {
            sweeps.bias(q, second, inputs, &mut w, &mut v);
            v
        }
        Output::Jacobians => {
            let mut out = zeros(6 * dims.nv * frames.len());
            sweeps.jacobians(q, inputs, &mut w, frames.iter().map(|&k| &tree.frames[k]), &mut out);
            out
        }
        Output::BiasAccelerations => {
            let mut out = vec![[Expr::zero(); 6]; frames.len()];
            let pairs = frames.iter().map(|&k| &tree.frames[k]).zip(&mut out);
            sweeps.bias_accelerations(q, second, inputs, &mut w, pairs);
            out.concat()
        }
        Output::MassMatrix => {
            let mut m = zeros(dims.nv * dims.nv);
            sweeps.mass_matrix(q, inputs, &mut w, &mut m);
            m
        }
        Output::Frames => {
            let mut states = vec![FrameState::ground(); frames.len()];
            let pairs = frames.iter().map(|&k| &tree.frames[k]).zip(&mut states);
            sweeps.frame_states(q, second, inputs, &mut w, pairs);
            let motion = |m: Motion<Expr<'g>>| [m.lin, m.ang].concat();
            let rotations = states.iter().flat_map(|s| s.rotation.concat()).collect::<Vec<_>>();
            let positions = states.iter().flat_map(|s| s.position);
            let velocities = states.iter().flat_map(|s| motion(s.velocity));
            rotations.into_iter().chain(positions).chain(velocities).collect()
        }
        Output::Derivatives => {
            let mut d = Derivatives::new(tree);
            sweeps.derivatives(q, second, inputs, &mut w, &mut d);
            [d.v, d.pd, d.dv_dq, d.dv_dp, d.dpd_dq, d.dpd_dp].concat()
        }
        Output::MomentumDerivatives => {
            let (mut d, mut out) = (Derivatives::new(tree), MomentumDerivatives::new(tree));
            sweeps.momentum_derivatives(q, second, inputs, &mut w, &mut d, &mut out);
            [out.p, out.pd, out.dp_dq, out.dp_dv, out.dpd_dq, out.dpd_dv].concat()
        }
        Output::ConstraintResiduals => {
            let (mut phi, mut entries) = (zeros(dims.rows), zeros(tree.entry_columns().len()));
            sweeps.constraint_residuals(q, inputs, &mut w, &mut phi, &mut entries);
            [phi, entries].concat()
        }
        Output::ProjectMomenta => {
            let (mut freed, mut sigma) = (zeros(dims.nv), zeros(dims.rows));
            sweeps.project_momenta(q, second, inputs, &mut w, &mut v, &mut freed, &mut sigma);
            [v, freed, sigma].concat()
        }
        Output::PositionCorrection => {
            let (mut phi, mut pivots) = (zeros(dims.rows), zeros(dims.rows));
            sweeps.position_correction(q, inputs, &mut w, &mut phi, &mut v, &mut pivots);
            [phi, v, pivots].concat()
        }
        Output::Multipliers => {
            let mut lambda = zeros(dims.rows);
            let sweeps = Sweeps { tree: tree.for_accelerations(), trace: graph };
            sweeps.multipliers(q, second, inputs, &mut w, &mut v, &mut lambda);
            lambda
        }
        // Needs the plan: see `parameter_derivatives`.
        Output::ParameterDerivatives => Vec::new(),
    }
}

/// `∂v/∂params` and `∂ṗ/∂params`, row by row: one dual sweep for each parameter.
fn parameter_derivatives<'g>(
    graph: &'g Graph,
    plan: &Plan,
    tree: &Tree<Expr<'g>>,
    q: &[Expr<'g>],
    p: &[Expr<'g>],
    params: &[Expr<'g>],
    inputs: &Inputs<Expr<'g>>,
) -> Vec<Expr<'g>> {
    let mut d = Derivatives::new(tree);
    Sweeps { tree, trace: graph }.derivatives(q, p, inputs, &mut Workspace::new(tree), &mut d);
    let columns: Vec<[Vec<Expr>; 2]> = (0..params.len())
        .map(|k| {
            let one = |j: usize| if j == k { Expr::one() } else { Expr::zero() };
            let varied: Vec<Dual<Expr>> = params.iter().enumerate().map(|(j, x)| Dual::new(*x, one(j))).collect();
            let gravity = match plan.model.gravity {
                Gravity::Constant(g) => g.map(|v| match v {
                    crate::model::Value::Const(x) => Dual::constant(x),
                    crate::model::Value::Param(k) => varied[k],
                }),
                Gravity::Input => inputs.gravity.map(|x| Dual::new(x, Expr::zero())),
            };
            let tree = plan.tree(&varied).regrouped();
            let mut column = ParameterDerivatives::new(&tree);
            column.compute(&Sweeps { tree: &tree, trace: graph }, gravity, q, inputs, &d);
            [column.dv, column.dpd]
        })
        .collect();
    let rows = (0..2).flat_map(|half| (0..p.len()).map(move |a| (half, a)));
    rows.flat_map(|(half, a)| columns.iter().map(move |c| c[half][a])).collect()
}

/// Program of `q̇ = N(q) v`.
pub(crate) fn coordinate_map(plan: &Plan) -> OutputProgram {
    let graph = Graph::default();
    let mut symbols = Symbols { graph: &graph, arrays: Vec::new(), next: 0 };
    let q = symbols.array("q", plan.dims.nq);
    let v = symbols.array("v", plan.dims.nv);
    let params = symbols.array("self.params", plan.model.params.len());
    let tree: Tree<Expr> = plan.tree(&params);
    let mut qd = vec![Expr::zero(); plan.dims.nq];
    Sweeps { tree: &tree, trace: &graph }.coordinate_rates(&q, &v, &mut qd);
    OutputProgram { group: Output::Rates, inputs: symbols.arrays, program: Program::new(&graph, &qd), loops: None }
}
