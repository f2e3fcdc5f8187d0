//! The only door: a model and options in, straight-line Rust out. The macro, the command line and build scripts all come
//! through here.

use mbd_runtime::spatial::Motion;
use mbd_runtime::sweep::{FrameState, Inputs, Sweeps};
use mbd_runtime::tree::Tree;
use mbd_runtime::workspace::Workspace;
use mbd_runtime::Scalar;

use crate::emit;
use crate::model::{Gravity, Model};
use crate::plan::{Plan, PlanOptions};
use crate::symbolic::{Counts, Expr, Graph, Operand, Output, Program};

/// Number type of the generated code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// `f64`.
    F64,
    /// `f32`.
    F32,
}

impl Precision {
    /// Its name in Rust.
    pub fn name(self) -> &'static str {
        match self {
            Precision::F64 => "f64",
            Precision::F32 => "f32",
        }
    }
}

/// What generated code can compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// `(q, p) → (q̇, ṗ)`; makes the type a `System`.
    Rates,
    /// `(q, p) → v`.
    Velocities,
    /// `(q, v) → p`.
    Momenta,
    /// `(q, p) →` kinetic and potential energy.
    Energy,
    /// `(q, v) → v̇`.
    Accelerations,
    /// `(q, v) →` the wrench that each joint transmits.
    Reactions,
    /// `q → M`.
    MassMatrix,
    /// `(q, v) →` placements and velocities of frames.
    Frames,
}

impl Group {
    /// All of them.
    pub const ALL: [Group; 8] = [
        Group::Rates,
        Group::Velocities,
        Group::Momenta,
        Group::Energy,
        Group::Accelerations,
        Group::Reactions,
        Group::MassMatrix,
        Group::Frames,
    ];

    /// Name of the generated function, and of the output in options.
    pub fn name(self) -> &'static str {
        match self {
            Group::Rates => "rates",
            Group::Velocities => "velocities",
            Group::Momenta => "momenta",
            Group::Energy => "energy",
            Group::Accelerations => "accelerations",
            Group::Reactions => "reactions",
            Group::MassMatrix => "mass_matrix",
            Group::Frames => "frames",
        }
    }

    /// The group of a name.
    pub fn from_name(name: &str) -> Option<Group> {
        Group::ALL.into_iter().find(|g| g.name() == name)
    }
}

/// How code is generated.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Name of the generated type.
    pub type_name: String,
    /// What it computes.
    pub outputs: Vec<Group>,
    /// Its numbers.
    pub precision: Precision,
    /// Whether joint forces `τ` are inputs. Without them they are zero and cost nothing.
    pub efforts: bool,
    /// Names of the frames of [`Group::Frames`]; empty means all.
    pub frames: Vec<String>,
    /// How the structure is chosen.
    pub plan: PlanOptions,
    /// Path of the runtime crate in the generated code.
    pub runtime: String,
    /// Where the model came from, for the header.
    pub source: String,
    /// Statements in one function at the most; longer programs are split.
    pub chunk: usize,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            type_name: "Model".to_string(),
            outputs: vec![Group::Rates, Group::Momenta, Group::Energy],
            precision: Precision::F64,
            efforts: true,
            frames: Vec::new(),
            plan: PlanOptions::default(),
            runtime: "::mbd_runtime".to_string(),
            source: String::new(),
            chunk: 1000,
        }
    }
}

/// One array of numbers that generated code is called with; the order of [`Signature::arrays`] numbers its inputs.
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
pub struct GroupProgram {
    /// Which.
    pub group: Group,
    /// Input arrays, numbered through.
    pub inputs: Vec<InputArray>,
    /// The program.
    pub program: Program,
}

/// Generated code and what is known about it.
#[derive(Clone, Debug)]
pub struct Generated {
    /// Rust source: one type with its functions.
    pub source: String,
    /// Operations of each function.
    pub counts: Vec<(Group, Counts)>,
    /// What was changed on the way.
    pub notices: Vec<String>,
}

/// Generates code for a checked model.
///
/// # Errors
/// An unknown frame name in the options, or a number that is not finite in the code (a freedom without inertia, which the
/// checks cannot see where parameters are involved), as a message.
pub fn generate(model: &Model, options: &Options) -> Result<Generated, String> {
    let plan = Plan::new(model, options.plan);
    let groups = options.outputs.iter().map(|&g| trace(&plan, g, options));
    let groups = groups.collect::<Result<Vec<_>, String>>()?;
    groups.iter().try_for_each(|g| finite(&plan, g, options.precision))?;
    let counts = groups.iter().map(|g| (g.group, g.program.counts())).collect();
    let map = coordinate_map(&plan);
    let source = emit::source(&plan, options, &groups, &map);
    Ok(Generated { source, counts, notices: plan.notices.clone() })
}

/// Refuses infinities, which no literal can state, and with them models that divide by zero whatever the state is.
fn finite(plan: &Plan, group: &GroupProgram, precision: Precision) -> Result<(), String> {
    let fits = |x: f64| match precision {
        Precision::F64 => x.is_finite(),
        Precision::F32 => (x as f32).is_finite(),
    };
    let name = group.group.name();
    for (_, op, (node, _)) in &group.program.steps {
        if op.operands().any(|o| matches!(o, Operand::Const(bits) if !fits(f64::from_bits(bits)))) {
            let body = node.map_or("ground", |i| plan.nodes[i].name.as_str());
            return Err(format!(
                "`{name}` contains an infinite number at body `{body}`: is there a freedom without inertia?"
            ));
        }
    }
    match group.program.outputs.iter().any(|o| matches!(o, Output::Const(x) if !fits(*x))) {
        true => Err(format!("`{name}` has a result that is always infinite: is there a freedom without inertia?")),
        false => Ok(()),
    }
}

/// Symbolic inputs of one function.
struct Symbols<'g> {
    graph: &'g Graph,
    arrays: Vec<InputArray>,
    next: usize,
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

/// Runs the sweeps of one group on symbols.
///
/// # Errors
/// An unknown frame name in the options, as a message.
pub fn trace(plan: &Plan, group: Group, options: &Options) -> Result<GroupProgram, String> {
    let graph = Graph::default();
    let mut symbols = Symbols { graph: &graph, arrays: Vec::new(), next: 0 };
    let dims = plan.dims;
    let q = symbols.array("q", dims.nq);
    let second = match group {
        Group::Rates | Group::Velocities | Group::Energy => symbols.array("p", dims.nv),
        Group::Momenta | Group::Accelerations | Group::Reactions | Group::Frames => symbols.array("v", dims.nv),
        Group::MassMatrix => Vec::new(),
    };
    let tau = if options.efforts { symbols.array("self.tau", dims.nv) } else { Vec::new() };
    let drive_q = symbols.array("self.drive_q", dims.drive_q);
    let drive_v = symbols.array("self.drive_v", dims.drive_v);
    let drive_a = symbols.array("self.drive_a", dims.drive_v);
    let flat = symbols.array("self.wrenches", 6 * dims.wrenches);
    let wrenches: Vec<[Expr; 6]> = flat.chunks(6).map(|c| std::array::from_fn(|k| c[k])).collect();
    let params = symbols.array("self.params", plan.model.params.len());
    let gravity: [Expr; 3] = match plan.model.gravity {
        Gravity::Constant(g) => g.map(|v| match v {
            crate::model::Value::Const(x) => Expr::Const(x),
            crate::model::Value::Param(k) => params[k],
        }),
        Gravity::Input => {
            let g = symbols.array("self.gravity", 3);
            std::array::from_fn(|k| g[k])
        }
    };
    let inputs =
        Inputs { tau: &tau, drive_q: &drive_q, drive_v: &drive_v, drive_a: &drive_a, wrenches: &wrenches, gravity };
    let physical: Tree<Expr> = plan.tree(&params);
    let tree = if group == Group::Reactions { physical } else { physical.regrouped() };
    let frames = chosen_frames(plan, options)?;
    let outputs = run(&graph, &tree, group, &q, &second, &inputs, &frames);
    let program = Program::new(&graph, &outputs);
    Ok(GroupProgram { group, inputs: symbols.arrays, program })
}

fn run<'g>(
    graph: &'g Graph,
    tree: &Tree<Expr<'g>>,
    group: Group,
    q: &[Expr<'g>],
    second: &[Expr<'g>],
    inputs: &Inputs<Expr<'g>>,
    frames: &[usize],
) -> Vec<Expr<'g>> {
    let sweeps = Sweeps { tree, trace: graph };
    let mut w = Workspace::new(tree);
    let dims = tree.dims;
    let zeros = |n: usize| vec![Expr::zero(); n];
    let mut v = zeros(dims.nv);
    match group {
        Group::Rates => {
            let (mut qd, mut pd) = (zeros(dims.nq), zeros(dims.nv));
            sweeps.rates(q, second, inputs, &mut w, &mut v, &mut qd, &mut pd);
            qd.extend(pd);
            qd
        }
        Group::Velocities => {
            sweeps.velocities(q, second, inputs, &mut w, &mut v);
            v
        }
        Group::Momenta => {
            sweeps.momenta(q, second, inputs, &mut w, &mut v);
            v
        }
        Group::Energy => {
            let (kinetic, potential) = sweeps.energy(q, second, inputs, &mut w, &mut v);
            vec![kinetic, potential]
        }
        Group::Accelerations => {
            sweeps.accelerations(q, second, inputs, &mut w, &mut v);
            v
        }
        Group::Reactions => {
            sweeps.accelerations(q, second, inputs, &mut w, &mut v);
            let mut out = vec![[Expr::zero(); 6]; tree.joint_nodes.len()];
            sweeps.reactions(&w, &mut out);
            out.concat()
        }
        Group::MassMatrix => {
            let mut m = zeros(dims.nv * dims.nv);
            sweeps.mass_matrix(q, inputs, &mut w, &mut m);
            m
        }
        Group::Frames => {
            let mut states = vec![FrameState::ground(); frames.len()];
            let pairs = frames.iter().map(|&k| &tree.frames[k]).zip(&mut states);
            sweeps.frame_states(q, second, inputs, &mut w, pairs);
            let motion = |m: Motion<Expr<'g>>| [m.lin, m.ang].concat();
            let rotations = states.iter().flat_map(|s| s.rotation.concat()).collect::<Vec<_>>();
            let positions = states.iter().flat_map(|s| s.position);
            let velocities = states.iter().flat_map(|s| motion(s.velocity));
            rotations.into_iter().chain(positions).chain(velocities).collect()
        }
    }
}

/// Program of `q̇ = N(q) v`.
fn coordinate_map(plan: &Plan) -> GroupProgram {
    let graph = Graph::default();
    let mut symbols = Symbols { graph: &graph, arrays: Vec::new(), next: 0 };
    let q = symbols.array("q", plan.dims.nq);
    let v = symbols.array("v", plan.dims.nv);
    let params = symbols.array("self.params", plan.model.params.len());
    let tree: Tree<Expr> = plan.tree(&params);
    let mut qd = vec![Expr::zero(); plan.dims.nq];
    Sweeps { tree: &tree, trace: &graph }.coordinate_rates(&q, &v, &mut qd);
    GroupProgram { group: Group::Rates, inputs: symbols.arrays, program: Program::new(&graph, &qd) }
}
