//! The checked description of a mechanism: what importers make and everything after them reads.
//!
//! SI units, radians. No file format and no symbolic expression is known here.

/// A number of the description: folded into the code, or an argument of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Known when the code is generated.
    Const(f64),
    /// Index into [`Model::params`].
    Param(usize),
}

impl Value {
    /// Zero.
    pub const ZERO: Value = Value::Const(0.0);
    /// One.
    pub const ONE: Value = Value::Const(1.0);

    /// The constant, if it is one.
    pub fn constant(self) -> Option<f64> {
        match self {
            Value::Const(x) => Some(x),
            Value::Param(_) => None,
        }
    }
}

/// Orientation of a frame in another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rotation {
    /// `Rz(yaw) Ry(pitch) Rx(roll)` from `[roll, pitch, yaw]`, radians.
    Rpy([Value; 3]),
    /// About an axis (any length but zero) by an angle, radians.
    AxisAngle {
        /// Direction of the axis.
        axis: [f64; 3],
        /// Angle.
        angle: Value,
    },
}

impl Rotation {
    /// No rotation.
    pub const NONE: Rotation = Rotation::Rpy([Value::ZERO; 3]);
}

/// Pose of a frame in another: origin (m) and orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Origin in the axes of the frame it is placed in, m.
    pub xyz: [Value; 3],
    /// Orientation.
    pub rotation: Rotation,
}

impl Placement {
    /// The frame itself.
    pub const IDENTITY: Placement = Placement { xyz: [Value::ZERO; 3], rotation: Rotation::NONE };
}

/// A run-time parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// Name, unique among the parameters.
    pub name: String,
    /// Value used where none is given.
    pub default: f64,
}

/// A rigid body.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name, unique among bodies and frames.
    pub name: String,
    /// Mass, kg.
    pub mass: Value,
    /// Centre of mass in the body frame, m.
    pub com: [Value; 3],
    /// Inertia about the centre of mass `[xx, yy, zz, xy, xz, yz]`, kg m², in the axes `inertia_axes`.
    pub inertia: [Value; 6],
    /// Axes of `inertia`, relative to those of the body.
    pub inertia_axes: Rotation,
}

/// What a joint lets its child do. Axes are in the child frame, any length but zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// One turn.
    Revolute {
        /// Axis of rotation.
        axis: [f64; 3],
    },
    /// One slide.
    Prismatic {
        /// Direction of sliding.
        axis: [f64; 3],
    },
    /// A slide along and a turn about the same axis, independent; coordinates in that order.
    Cylindrical {
        /// The axis.
        axis: [f64; 3],
    },
    /// A turn with a proportional slide.
    Helical {
        /// The axis.
        axis: [f64; 3],
        /// Metres per radian.
        pitch: Value,
    },
    /// A turn about `axes[0]`, then about `axes[1]`, which the first turn carries.
    Universal {
        /// Both axes at zero coordinates.
        axes: [[f64; 3]; 2],
    },
    /// Two slides across and a turn about the normal.
    Planar {
        /// Normal of the plane.
        normal: [f64; 3],
    },
    /// Any rotation.
    Spherical,
    /// Any motion.
    Floating,
    /// None.
    Fixed,
}

impl JointKind {
    /// Number of coordinates.
    pub fn nq(&self) -> usize {
        match self {
            JointKind::Fixed => 0,
            JointKind::Revolute { .. } | JointKind::Prismatic { .. } | JointKind::Helical { .. } => 1,
            JointKind::Cylindrical { .. } | JointKind::Universal { .. } => 2,
            JointKind::Planar { .. } => 3,
            JointKind::Spherical => 4,
            JointKind::Floating => 7,
        }
    }

    /// Number of velocities.
    pub fn nv(&self) -> usize {
        match self {
            JointKind::Spherical => 3,
            JointKind::Floating => 6,
            other => other.nq(),
        }
    }
}

/// Where a joint's coordinates come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointMotion {
    /// From the state.
    Free,
    /// From inputs: position, rate and acceleration (a rheonomic drive).
    Prescribed,
    /// `q = ratio q_leader + offset`, both joints of one freedom; `leader` is a joint index and may itself mimic.
    Mimic {
        /// Index of the leading joint.
        leader: usize,
        /// Factor.
        ratio: Value,
        /// Offset, rad or m.
        offset: Value,
    },
}

/// A joint and its passive elements; vectors hold one entry per freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name, unique among the joints.
    pub name: String,
    /// Kind and axes.
    pub kind: JointKind,
    /// Body index of the parent, `None` for the ground.
    pub parent: Option<usize>,
    /// Body index of the child.
    pub child: usize,
    /// Child frame in the parent frame at zero coordinates.
    pub placement: Placement,
    /// A pin without limits that other programs may store as cosine and sine; changes nothing here.
    pub unbounded: bool,
    /// Source of the coordinates.
    pub motion: JointMotion,
    /// Viscous damping per freedom, N m s/rad or N s/m.
    pub damping: Vec<Value>,
    /// Spring stiffness per freedom.
    pub stiffness: Vec<Value>,
    /// Rest position per freedom of the springs.
    pub rest: Vec<Value>,
    /// Reflected rotor inertia per freedom.
    pub armature: Vec<Value>,
}

/// A named frame on a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Name, unique among bodies and frames.
    pub name: String,
    /// Body index, `None` for the ground.
    pub body: Option<usize>,
    /// Pose in the body frame.
    pub placement: Placement,
}

/// Axes in which an external wrench is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrenchAxes {
    /// Those of the body.
    Body,
    /// Those of the ground.
    World,
}

/// An external wrench `[force; moment]` at the origin of a body frame, given with every call.
#[derive(Clone, Debug, PartialEq)]
pub struct Wrench {
    /// Name, unique among the wrenches.
    pub name: String,
    /// Body index.
    pub body: usize,
    /// Axes.
    pub axes: WrenchAxes,
}

/// Gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gravity {
    /// Part of the model, m/s² in ground axes.
    Constant([Value; 3]),
    /// Given with every call.
    Input,
}

/// A frame that a constraint acts at.
#[derive(Clone, Debug, PartialEq)]
pub struct Mount {
    /// Body index, `None` for the ground.
    pub body: Option<usize>,
    /// Pose in the body frame.
    pub placement: Placement,
}

/// What a loop holds together, first frame and second frame. Axes stand in the axes of both frames, any length but zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoopKind {
    /// As a pin would: leaves one turn.
    Revolute {
        /// Axis of rotation.
        axis: [f64; 3],
    },
    /// Leaves one slide.
    Prismatic {
        /// Direction of sliding.
        axis: [f64; 3],
    },
    /// Leaves a slide and a turn about one axis.
    Cylindrical {
        /// The axis.
        axis: [f64; 3],
    },
    /// Leaves a screw.
    Helical {
        /// The axis.
        axis: [f64; 3],
        /// Metres per radian.
        pitch: Value,
    },
    /// Leaves turns about `axes[0]`, fixed in the first frame, and `axes[1]`, fixed in the second; at right angles.
    Universal {
        /// Both axes.
        axes: [[f64; 3]; 2],
    },
    /// Leaves two slides and a turn about the normal.
    Planar {
        /// Normal of the plane.
        normal: [f64; 3],
    },
    /// Leaves all rotations: the origins coincide.
    Spherical,
    /// Leaves nothing.
    Fixed,
    /// The origins stay at a distance: a massless rod with spherical ends.
    Distance {
        /// Length, m.
        length: Value,
    },
    /// The second origin stays on the line through the first along the axis of the first frame.
    PointOnLine {
        /// Direction in the first frame.
        axis: [f64; 3],
    },
    /// The second origin stays in the plane through the first, normal to a direction of the first frame.
    PointOnPlane {
        /// Direction in the first frame.
        normal: [f64; 3],
    },
    /// The second origin stays on a cylinder about an axis of the first frame.
    PointOnCylinder {
        /// Direction in the first frame.
        axis: [f64; 3],
        /// Radius, m.
        radius: Value,
    },
    /// A thin disc about the second frame's origin rolls on a plane of the first frame without slip.
    RollingDisc {
        /// Normal of the plane in the first frame, towards the disc.
        normal: [f64; 3],
        /// Axis of the disc in the second frame.
        axis: [f64; 3],
        /// Radius, m.
        radius: Value,
    },
    /// A ball about the second frame's origin rolls on a plane of the first frame without slip.
    RollingBall {
        /// Normal of the plane in the first frame, towards the ball.
        normal: [f64; 3],
        /// Radius, m.
        radius: Value,
    },
    /// The second origin does not move along a direction fixed in the second frame.
    KnifeEdge {
        /// Direction across the edge.
        axis: [f64; 3],
    },
    /// `row · [velocity; angular velocity] = 0` for the motion of the second frame relative to the first, in the axes and
    /// at the origin of the second.
    Pfaffian {
        /// Coefficients.
        row: [Value; 6],
    },
}

impl LoopKind {
    /// Its name in descriptions.
    pub fn word(&self) -> &'static str {
        match self {
            LoopKind::Revolute { .. } => "pin",
            LoopKind::Prismatic { .. } => "slider",
            LoopKind::Cylindrical { .. } => "cylindrical",
            LoopKind::Helical { .. } => "helical",
            LoopKind::Universal { .. } => "universal",
            LoopKind::Planar { .. } => "planar",
            LoopKind::Spherical => "spherical",
            LoopKind::Fixed => "fixed",
            LoopKind::Distance { .. } => "distance",
            LoopKind::PointOnLine { .. } => "point_on_line",
            LoopKind::PointOnPlane { .. } => "point_on_plane",
            LoopKind::PointOnCylinder { .. } => "point_on_cylinder",
            LoopKind::RollingDisc { .. } => "rolling_disc",
            LoopKind::RollingBall { .. } => "rolling_ball",
            LoopKind::KnifeEdge { .. } => "knife_edge",
            LoopKind::Pfaffian { .. } => "pfaffian",
        }
    }
}

/// What a constraint binds.
// A model has few of them, and they are read as they stand.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
pub enum ConstraintKind {
    /// Two bodies.
    Loop {
        /// How.
        kind: LoopKind,
        /// First frame.
        first: Mount,
        /// Second frame.
        second: Mount,
    },
    /// Joints of one freedom: `Σ ratio · q = offset`.
    Coupling {
        /// Joint index and ratio; every joint once, free, not a mimic.
        terms: Vec<(usize, Value)>,
        /// Offset.
        offset: Value,
    },
}

/// A constraint beside the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraint {
    /// Name, unique among the constraints.
    pub name: String,
    /// What it binds.
    pub kind: ConstraintKind,
    /// Rate at which errors of the positions are made to decay (Baumgarte), 1/s; zero: not at all.
    pub decay: Value,
}

/// Where the closing of loops begins: coordinates of one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Joint index, free.
    pub joint: usize,
    /// Its coordinates.
    pub q: Vec<f64>,
    /// Whether they stay as they are when loops are closed.
    pub held: bool,
}

/// A checked tree: `joints` is depth first, every body is the child of exactly one joint, parents come first, mimic chains end.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Name, an identifier.
    pub name: String,
    /// Run-time parameters.
    pub params: Vec<Param>,
    /// Gravity.
    pub gravity: Gravity,
    /// Bodies, in file order.
    pub bodies: Vec<Body>,
    /// Joints, depth first from the ground.
    pub joints: Vec<Joint>,
    /// Named frames beside those of the bodies.
    pub frames: Vec<Frame>,
    /// External wrenches.
    pub wrenches: Vec<Wrench>,
    /// Loops and couplings, in file order.
    pub constraints: Vec<Constraint>,
    /// Coordinates to begin with, where they are not neutral.
    pub starts: Vec<Start>,
}
