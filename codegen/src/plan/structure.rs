//! The structure of a mechanism: nodes, frames, wrenches, constraints. Numbers stay [`Value`]s.

use mbd_runtime::spatial::{Axis, Mat3};
use mbd_runtime::tree::{Dims, Elimination, Kind, Source, Unknown, WrenchAxes, INERTIAL_PARAMETERS};

use crate::model::{JointSpec, LoopKind, Model, Param, Value};
use crate::rounded_once::norm;

/// One elementary transform of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PoseStep {
    /// A constant rotation about an axis.
    Turn {
        /// Axis.
        axis: Axis,
        /// Cosine.
        c: f64,
        /// Sine.
        s: f64,
    },
    /// A rotation by a number of the model.
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

/// A joint of the tree and the bodies that move with it.
#[derive(Clone, Debug)]
pub struct PlanNode {
    /// Name for messages: that of the child body, or that of the joint for the massless body inside a universal or
    /// cylindrical joint.
    pub name: String,
    /// Parent node.
    pub parent: Option<usize>,
    /// Constant part of the placement in the parent's frame.
    pub place: Vec<PoseStep>,
    /// Joint.
    pub kind: Kind<Value>,
    /// Model joint and index of the node's first freedom in it.
    pub joint: (usize, usize),
    /// Coordinates.
    pub source: Source,
    /// Ratios and offsets of a mimic, leader first.
    pub follow: Vec<(Value, Value)>,
    /// Constant rotation added to the angle, rad.
    pub phase: f64,
    /// Number of right angles added to the angle.
    pub quarter: u8,
    /// Constant displacement along z, m.
    pub slide: f64,
    /// Constant inertia `[m, mcx, mcy, mcz, xx, xy, xz, yy, yz, zz]` at the node frame.
    pub inertia: [f64; 10],
    /// Bodies with parameters in their inertia or pose: body index and pose in the node frame.
    pub variable: Vec<(usize, Vec<PoseStep>)>,
    /// Elimination of its degrees of freedom.
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

impl Slot {
    /// The slot of a joint among slots in the order of the joints.
    pub(crate) fn of_joint(slots: &[Slot], joint: usize) -> Option<&Slot> {
        slots.binary_search_by_key(&joint, |slot| slot.joint).ok().map(|k| &slots[k])
    }
}

/// The structure of a mechanism.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The model it was made from.
    pub model: Model,
    /// Angles closer than this to right angles were made exact, rad.
    pub snap: f64,
    /// Nodes, parents first.
    pub nodes: Vec<PlanNode>,
    /// Dimensions.
    pub dims: Dims,
    /// Unknowns that are not solved at a node of their own: shared coordinates, freedoms that are eliminated later, and rows of
    /// constraints.
    pub unknowns: Vec<Unknown>,
    /// Those of them that are solved at the ground.
    pub solve_at_ground: Vec<usize>,
    /// Frames of the moving joints' child bodies, in joint order, then those of all other bodies and frames.
    pub frames: Vec<PlanFrame>,
    /// Last node of every moving joint.
    pub joint_nodes: Vec<usize>,
    /// Moving joints in state order.
    pub slots: Vec<Slot>,
    /// Frame index and axes of each wrench.
    pub wrenches: Vec<(usize, WrenchAxes)>,
    /// Loops and couplings, then contacts, once [`Plan::with_contacts`] has made constraints of them.
    pub constraints: Vec<PlanConstraint>,
    /// The two frames of every contact between bodies, until contacts are among the constraints.
    pub contact_frames: Vec<Option<[PlanFrame; 2]>>,
    /// Which of its rows act.
    pub acts: RowsThatAct,
    /// See [`mbd_runtime::tree::Tree`]: of a plan of [`Plan::with_early_contacts`].
    pub early_tolerance: Option<f64>,
    /// Notices about changes, such as angles that became right angles.
    pub notices: Vec<String>,
    /// See [`mbd_runtime::tree::Tree`].
    pub matrix_depth: usize,
    /// The same plan with another elimination for accelerations, if that is cheaper.
    pub accelerations: Option<Box<Plan>>,
    /// The parameter that is the length of a step, s, where the inertia includes what such a step adds for springs and
    /// dampers of the joints: [`Plan::with_implicit_springs`].
    pub step: Option<usize>,
}

/// Which rows of the constraints of a plan act.
#[derive(Clone, Debug)]
pub enum RowsThatAct {
    /// All of them.
    All,
    /// Some rows of a plan with more rows, one entry for each of its rows. Rows keep their numbers; what the others bind
    /// is not in this plan.
    Some(Box<(Plan, Vec<bool>)>),
    /// Those for which the generated type's field `acts` is 1; where it is 0, the row does not act.
    Input,
}

/// The nodes that a constraint connects.
#[derive(Clone, Debug)]
pub enum PlanBond {
    /// Two frames.
    Cut {
        /// What it binds.
        kind: LoopKind,
        /// First and second frame, axes along z, or along x and y for a universal joint. The ground, if it is one of
        /// them and the kind is that of a joint, is the first: rows are constants of the body then. Of a rod it is the
        /// second.
        frames: Box<[PlanFrame; 2]>,
        /// Nodes from the innermost common one, which is left out, to those of the frames.
        paths: [Vec<usize>; 2],
    },
    /// Freedoms of nodes, with ratios.
    Coupling {
        /// Node and ratio.
        terms: Vec<(usize, Value)>,
        /// Offset.
        offset: Value,
    },
}

/// A constraint.
#[derive(Clone, Debug)]
pub struct PlanConstraint {
    /// Name.
    pub name: String,
    /// What it binds.
    pub bond: PlanBond,
    /// Its place among [`Plan::unknowns`], one for each row.
    pub slots: Vec<usize>,
    /// Further places of its rows, see [`mbd_runtime::tree::Constraint::passes`].
    pub passes: Vec<Vec<usize>>,
    /// Its first row.
    pub first: usize,
    /// The first entry of its rows among all entries of `Φ`.
    pub entry: usize,
    /// Velocities that it binds, in ascending order.
    pub velocities: Vec<usize>,
    /// See [`mbd_runtime::tree::Constraint`].
    pub decay: Value,
}

/// A freedom of a joint that a motor could drive: its coordinate is a number with the velocity as its rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointAxis {
    /// Index into the joints of the model.
    pub joint: usize,
    /// Index into the coordinates.
    pub q: usize,
    /// Index into the velocities, momenta and joint forces.
    pub v: usize,
}

impl Plan {
    /// Run-time parameters.
    pub fn params(&self) -> &[Param] {
        &self.model.params
    }

    /// Default values of the run-time parameters.
    pub fn default_params(&self) -> Vec<f64> {
        self.model.params.iter().map(|p| p.default).collect()
    }

    /// Names of the coordinates, in state order.
    pub fn coordinate_names(&self) -> Vec<String> {
        self.state_names(|spec| spec.coordinates.iter().map(|c| c.name).collect())
    }

    /// Names of the loops and couplings in the order of the description, then of the contacts if they are among them.
    pub fn constraint_names(&self) -> Vec<String> {
        self.constraints.iter().map(|c| c.name.clone()).collect()
    }

    /// Names of the velocities (momenta, joint forces), in state order.
    pub fn velocity_names(&self) -> Vec<String> {
        self.state_names(|spec| spec.freedoms.iter().map(|f| f.name).collect())
    }

    /// The axes, in state order: freedoms of the joints that have some ([`Joint::has_axes`](crate::model::Joint::has_axes)).
    pub fn axes(&self) -> impl Iterator<Item = JointAxis> + '_ {
        self.slots.iter().flat_map(|slot| {
            let joint = &self.model.joints[slot.joint];
            let first = match slot.at {
                Some(Source::State { q, v }) if joint.has_axes() => Some((q, v)),
                _ => None,
            };
            let axis = move |(q, v), k| JointAxis { joint: slot.joint, q: q + k, v: v + k };
            first.into_iter().flat_map(move |first| (0..joint.kind.nv()).map(move |k| axis(first, k)))
        })
    }

    /// Largest effort of every velocity that the description allows, N m or N; infinite where it states none.
    pub fn effort_limits(&self) -> Vec<f64> {
        let mut limits = vec![f64::INFINITY; self.dims.nv];
        for slot in &self.slots {
            if let (Some(Source::State { v, .. }), joint) = (slot.at, &self.model.joints[slot.joint]) {
                limits[v..v + joint.kind.nv()].fill(joint.bounds.effort.unwrap_or(f64::INFINITY));
            }
        }
        limits
    }

    /// Names of the dynamic parameters, the columns of the regressor: `forearm.m`, `forearm.mx` (first moment),
    /// `forearm.ixx` (inertia at the frame of the body) and so on, `elbow.damping`, `elbow.friction`.
    pub fn parameter_names(&self) -> Vec<String> {
        const INERTIAL: [&str; INERTIAL_PARAMETERS] = ["m", "mx", "my", "mz", "ixx", "ixy", "iyy", "ixz", "iyz", "izz"];
        let bodies = self.frames.iter().take(self.joint_nodes.len());
        let inertial = bodies.flat_map(|body| INERTIAL.map(|part| format!("{}.{part}", body.name)));
        let velocities = self.velocity_names();
        let friction = ["damping", "friction"];
        inertial.chain(friction.iter().flat_map(|part| velocities.iter().map(move |v| format!("{v}.{part}")))).collect()
    }

    fn state_names(&self, parts: fn(&JointSpec) -> Vec<&'static str>) -> Vec<String> {
        let free = self.slots.iter().filter(|s| matches!(s.at, Some(Source::State { .. })));
        free.flat_map(|slot| {
            let joint = &self.model.joints[slot.joint];
            let name = |part: &str| match part {
                "" => joint.name.clone(),
                _ => format!("{}.{part}", joint.name),
            };
            parts(joint.kind.spec()).into_iter().map(name).collect::<Vec<_>>()
        })
        .collect()
    }

    /// Initial coordinates: those of the model's `start`s, neutral where it states none.
    pub fn start(&self) -> Vec<f64> {
        let mut q = vec![0.0; self.dims.nq];
        let mut stated = vec![None; self.model.joints.len()];
        // Of several, the first one counts.
        self.model.starts.iter().rev().for_each(|s| stated[s.joint] = Some(s));
        for slot in &self.slots {
            let Some(Source::State { q: at, .. }) = slot.at else { continue };
            let kind = self.model.joints[slot.joint].kind;
            if let Some(stated) = stated[slot.joint] {
                q[at..].iter_mut().zip(&stated.q).for_each(|(q, stated)| *q = *stated);
            }
            if let Some(first) = kind.spec().quaternion() {
                let turn = &mut q[at + first..at + first + 4];
                match norm([turn[0], turn[1], turn[2], turn[3]]) {
                    0.0 => turn[3] = 1.0,
                    norm => turn.iter_mut().for_each(|x| *x /= norm),
                }
            }
        }
        q
    }

    /// Initial velocities: those of the model's `start_velocity`s, zero where it states none. `None` where it states no
    /// velocity of any joint that is not zero.
    pub fn start_velocity(&self) -> Option<Vec<f64>> {
        let mut v = vec![0.0; self.dims.nv];
        for slot in &self.slots {
            let Some(Source::State { v: at, .. }) = slot.at else { continue };
            // Of several, the first one counts.
            if let Some(stated) = self.model.starts.iter().find(|s| s.joint == slot.joint) {
                v[at..].iter_mut().zip(&stated.v).for_each(|(v, stated)| *v = *stated);
            }
        }
        v.iter().any(|x| *x != 0.0).then_some(v)
    }

    /// Which velocities belong to joints that keep their start when loops are closed.
    pub fn held(&self) -> Vec<bool> {
        let mut held = vec![false; self.dims.nv];
        for start in self.model.starts.iter().filter(|s| s.held) {
            if let Some(Source::State { v, .. }) = Slot::of_joint(&self.slots, start.joint).and_then(|s| s.at) {
                held[v..v + self.model.joints[start.joint].kind.nv()].fill(true);
            }
        }
        held
    }

    /// Ancestors of node `i`: itself first, then inward.
    pub(crate) fn ancestors(&self, i: usize) -> Vec<usize> {
        std::iter::successors(Some(i), |&i| self.nodes[i].parent).collect()
    }

    /// Removes the columns of some unknowns, which are then not solved for.
    pub(crate) fn close_columns(&mut self, unknowns: &[usize]) {
        for node in &mut self.nodes {
            node.elimination.retain_columns(|g| !unknowns.contains(&g));
        }
        self.solve_at_ground.retain(|g| !unknowns.contains(g));
    }
}

impl PlanBond {
    /// Nodes whose freedoms it binds.
    pub(crate) fn cycle(&self) -> Vec<usize> {
        match self {
            PlanBond::Cut { paths, .. } => paths.concat(),
            PlanBond::Coupling { terms, .. } => terms.iter().map(|(i, _)| *i).collect(),
        }
    }
}

impl PlanConstraint {
    /// Nodes that it acts on.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = usize> + '_ {
        let (frames, terms) = match &self.bond {
            PlanBond::Cut { frames, .. } => (Some(frames.iter().filter_map(|f| f.node)), None),
            PlanBond::Coupling { terms, .. } => (None, Some(terms.iter().map(|(i, _)| *i))),
        };
        frames.into_iter().flatten().chain(terms.into_iter().flatten())
    }

    /// Nodes whose freedoms it binds.
    pub fn cycle(&self) -> Vec<usize> {
        self.bond.cycle()
    }

    /// The same with new numbers for the nodes, all of which have one.
    pub(crate) fn renumbered(&self, numbers: &[Option<usize>]) -> PlanConstraint {
        let mut out = self.clone();
        let renumber = |i: &mut usize| *i = numbers[*i].unwrap_or_default();
        match &mut out.bond {
            PlanBond::Cut { frames, paths, .. } => {
                frames.iter_mut().filter_map(|f| f.node.as_mut()).for_each(renumber);
                paths.iter_mut().flatten().for_each(renumber);
            }
            PlanBond::Coupling { terms, .. } => terms.iter_mut().map(|(i, _)| i).for_each(renumber),
        }
        out
    }

    /// The part of it that decides which elimination is best.
    pub(crate) fn letters(&self) -> String {
        let decays = self.decay != Value::ZERO;
        match &self.bond {
            PlanBond::Cut { kind, frames, paths } => {
                format!("c{:?}{:?}{paths:?}{decays}", std::mem::discriminant(kind), frames.each_ref().map(|f| f.node))
            }
            PlanBond::Coupling { terms, .. } => {
                format!("g{:?}{decays}", terms.iter().map(|(node, _)| *node).collect::<Vec<usize>>())
            }
        }
    }
}
