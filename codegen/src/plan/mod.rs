//! From the model to the structure the sweeps run on: elementary joints, merged bodies, chosen body frames, shared
//! coordinates. Numbers stay [`Value`]s; [`Plan::tree`] turns them into any scalar.

mod accuracy;
mod branch;
mod constraints;
mod cycles;
mod elements;
mod forms;
mod frames;
mod instantiate;
mod matrix;
mod placement;
mod rigid;
mod shared;

use mbd_runtime::spatial::{Axis, Mat3};
use mbd_runtime::tree::{Dims, Elimination, Source, Unknown, WrenchAxes};

use crate::model::{Gravity, JointKind, JointMotion, Model, Param, Value};
use crate::options::RolledCode;

pub use constraints::{PlanBond, PlanConstraint};
pub use forms::{Candidate, EliminationStrategy};
pub use rigid::Rigid;

/// Angles this close to a multiple of 90° are taken as one, rad (see [`PlanOptions::snap`]).
pub const DEFAULT_SNAP: f64 = 1e-6;

/// How a plan is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanOptions {
    /// Angles of placements and directions of axes closer than this to right angles become exact, rad. 0 keeps every
    /// number of the description. A decimal π/2 costs a term wherever an exact zero would have stood.
    pub snap: f64,
    /// Joints that are solved together.
    pub forms: EliminationStrategy,
    /// Whether accelerations get a search of their own. Without it they are right, and cost what the form of the rates
    /// makes them cost.
    pub accelerations: bool,
    /// Whether the mass matrix gets one.
    pub mass_matrix: bool,
    /// Loops over runs of like links: long chains are laid out for them.
    pub loops: RolledCode,
}

impl Default for PlanOptions {
    fn default() -> Self {
        let (forms, loops) = (EliminationStrategy::default(), RolledCode::default());
        PlanOptions { snap: DEFAULT_SNAP, forms, accelerations: true, mass_matrix: true, loops }
    }
}

/// One elementary step of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PoseStep {
    /// A constant turn.
    Turn {
        /// Axis.
        axis: Axis,
        /// Cosine.
        c: f64,
        /// Sine.
        s: f64,
    },
    /// A turn by a number of the model.
    TurnBy {
        /// Axis.
        axis: Axis,
        /// Angle, rad.
        angle: Value,
    },
    /// A displacement, m.
    Shift {
        /// Axis.
        axis: Axis,
        /// Displacement.
        r: Value,
    },
    /// A constant rotation, child components to parent components.
    Rotate(Mat3<f64>),
}

/// Kind of a node's joint; the turn or slide is about z of the node frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NodeKind {
    /// Turn.
    Revolute,
    /// Slide.
    Prismatic,
    /// Turn with a slide.
    Helical(Value),
    /// Two slides and a turn.
    Planar,
    /// Rotation.
    Spherical,
    /// Any motion.
    Floating,
}

impl NodeKind {
    /// Number of velocities.
    pub fn nv(self) -> usize {
        match self {
            NodeKind::Revolute | NodeKind::Prismatic | NodeKind::Helical(_) => 1,
            NodeKind::Planar | NodeKind::Spherical => 3,
            NodeKind::Floating => 6,
        }
    }
}

/// A joint of the tree and the bodies that move with it.
#[derive(Clone, Debug)]
pub struct PlanNode {
    /// Name for people: the child body; the joint for the massless body inside a universal or cylindrical joint.
    pub name: String,
    /// Parent node.
    pub parent: Option<usize>,
    /// Constant part of the placement in the parent's frame.
    pub place: Vec<PoseStep>,
    /// Joint.
    pub kind: NodeKind,
    /// Model joint and index of the node's first freedom in it.
    pub joint: (usize, usize),
    /// Coordinates.
    pub source: Source,
    /// Ratios and offsets of a mimic, leader first.
    pub follow: Vec<(Value, Value)>,
    /// Constant turn added to the angle, rad.
    pub phase: f64,
    /// Further right angles.
    pub quarter: u8,
    /// Constant slide along z, m.
    pub slide: f64,
    /// Constant inertia `[m, mcx, mcy, mcz, xx, xy, xz, yy, yz, zz]` at the node frame.
    pub inertia: [f64; 10],
    /// Bodies with parameters in their inertia or pose: body index and pose in the node frame.
    pub variable: Vec<(usize, Vec<PoseStep>)>,
    /// How its freedoms are eliminated.
    pub elimination: Elimination,
    /// Whether the generator may make it part of rolled code.
    pub rolled: bool,
}

/// A named frame.
#[derive(Clone, Debug)]
pub struct PlanFrame {
    /// Name.
    pub name: String,
    /// Node, `None` for the ground.
    pub node: Option<usize>,
    /// Pose in the node frame.
    pub pose: Vec<PoseStep>,
}

/// A joint's place in the state.
#[derive(Clone, Debug, PartialEq)]
pub struct Slot {
    /// Model joint.
    pub joint: usize,
    /// First coordinate and first velocity, of the state or of the drives; `None` for mimics.
    pub at: Option<Source>,
}

/// The structure of a mechanism.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The model it was made from.
    pub model: Model,
    /// Nodes, parents first.
    pub nodes: Vec<PlanNode>,
    /// Dimensions.
    pub dims: Dims,
    /// Shared coordinates, and rows of constraints.
    pub unknowns: Vec<Unknown>,
    /// Shared coordinates solved at the ground.
    pub solve_at_ground: Vec<usize>,
    /// Frames of the moving joints' child bodies, in joint order, then those of all other bodies and frames.
    pub frames: Vec<PlanFrame>,
    /// Last node of every moving joint.
    pub joint_nodes: Vec<usize>,
    /// Moving joints in state order.
    pub slots: Vec<Slot>,
    /// Frame index and axes of each wrench.
    pub wrenches: Vec<(usize, WrenchAxes)>,
    /// Loops and couplings.
    pub constraints: Vec<PlanConstraint>,
    /// Elimination forms that were tried, branch by branch.
    pub candidates: Vec<Candidate>,
    /// What was changed on the way.
    pub notices: Vec<String>,
    /// See [`mbd_runtime::tree::Tree`].
    pub matrix_depth: usize,
    /// The same with another choice of what is solved where, for accelerations, if that is cheaper.
    pub accelerations: Option<Box<Plan>>,
}

impl Plan {
    /// Makes the plan of a model.
    pub fn new(model: &Model, options: PlanOptions) -> Plan {
        let mut notices = Vec::new();
        let elements = elements::elements(model, options, &mut notices);
        let (dims, slots) = slots(model);
        let mounts = constraints::mounts(model, &elements, options.snap);
        let framed = frames::choose(model, &elements, &slots, &mounts);
        let mut plan = Plan {
            model: model.clone(),
            nodes: framed.nodes,
            dims: Dims { wrenches: model.wrenches.len(), ..dims },
            unknowns: Vec::new(),
            solve_at_ground: Vec::new(),
            frames: framed.frames,
            joint_nodes: framed.joint_nodes,
            slots,
            wrenches: Vec::new(),
            constraints: Vec::new(),
            candidates: Vec::new(),
            notices,
            matrix_depth: 0,
            accelerations: None,
        };
        plan.wrenches = model
            .wrenches
            .iter()
            .map(|w| {
                let frame = plan.frames.iter().position(|f| f.name == model.bodies[w.body].name);
                let axes = match w.axes {
                    crate::model::WrenchAxes::Body => WrenchAxes::Frame,
                    crate::model::WrenchAxes::World => WrenchAxes::Ground,
                };
                (frame.unwrap_or_default(), axes)
            })
            .collect();
        shared::share(&mut plan);
        constraints::constrain(&mut plan, framed.mounts);
        constraints::rest_idle(&mut plan);
        forms::lay_out(&mut plan, options);
        if options.forms != EliminationStrategy::Single {
            forms::choose(&mut plan, options);
        }
        if options.forms != EliminationStrategy::Single && options.mass_matrix {
            matrix::choose(&mut plan);
        }
        plan
    }

    /// Run-time parameters.
    pub fn params(&self) -> &[Param] {
        &self.model.params
    }

    /// Default values of the run-time parameters.
    pub fn default_params(&self) -> Vec<f64> {
        self.model.params.iter().map(|p| p.default).collect()
    }

    /// Gravity of the model at given parameters; zero where it is an input, to be set with every call.
    pub fn gravity(&self, params: &[f64]) -> [f64; 3] {
        match self.model.gravity {
            Gravity::Constant(g) => g.map(|v| instantiate::value(v, params)),
            Gravity::Input => [0.0; 3],
        }
    }

    /// Names of the coordinates, in state order.
    pub fn coordinate_names(&self) -> Vec<String> {
        self.state_names(|kind| match kind {
            JointKind::Planar { .. } => &["x", "y", "angle"],
            JointKind::Cylindrical { .. } => &["slide", "angle"],
            JointKind::Universal { .. } => &["angle1", "angle2"],
            JointKind::Spherical => &["qx", "qy", "qz", "qw"],
            JointKind::Floating => &["x", "y", "z", "qx", "qy", "qz", "qw"],
            _ => &[],
        })
    }

    /// Names of the velocities (momenta, joint forces), in state order.
    pub fn velocity_names(&self) -> Vec<String> {
        self.state_names(|kind| match kind {
            JointKind::Planar { .. } => &["vx", "vy", "wz"],
            JointKind::Cylindrical { .. } => &["slide", "angle"],
            JointKind::Universal { .. } => &["angle1", "angle2"],
            JointKind::Spherical => &["wx", "wy", "wz"],
            JointKind::Floating => &["vx", "vy", "vz", "wx", "wy", "wz"],
            _ => &[],
        })
    }

    /// Names of the loops and couplings, in the order of the description.
    pub fn constraint_names(&self) -> Vec<String> {
        self.model.constraints.iter().map(|c| c.name.clone()).collect()
    }

    fn state_names(&self, parts: impl Fn(&JointKind) -> &'static [&'static str]) -> Vec<String> {
        let free = self.slots.iter().filter(|s| matches!(s.at, Some(Source::State { .. })));
        free.flat_map(|slot| {
            let joint = &self.model.joints[slot.joint];
            let parts = parts(&joint.kind);
            match parts.is_empty() {
                true => vec![joint.name.clone()],
                false => parts.iter().map(|p| format!("{}.{p}", joint.name)).collect(),
            }
        })
        .collect()
    }
}

/// State and drive indices of the moving joints, depth first.
fn slots(model: &Model) -> (Dims, Vec<Slot>) {
    let mut dims = Dims::default();
    let mut slots = Vec::new();
    for (k, joint) in model.joints.iter().enumerate() {
        let (nq, nv) = (joint.kind.nq(), joint.kind.nv());
        if joint.kind == JointKind::Fixed {
            continue;
        }
        let at = match joint.motion {
            JointMotion::Free => {
                let at = Source::State { q: dims.nq, v: dims.nv };
                dims.nq += nq;
                dims.nv += nv;
                Some(at)
            }
            JointMotion::Prescribed => {
                let at = Source::Drive { q: dims.drive_q, v: dims.drive_v };
                dims.drive_q += nq;
                dims.drive_v += nv;
                Some(at)
            }
            JointMotion::Mimic { .. } => None,
        };
        slots.push(Slot { joint: k, at });
    }
    (dims, slots)
}
