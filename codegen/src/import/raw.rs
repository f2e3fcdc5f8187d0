//! What a reader hands to the checks: the model with names instead of indices and the place of everything.
//!
//! A reader fills this in and reports what its format forbids (unknown keys, wrong types, numbers that are not finite);
//! everything about the mechanism itself (names, tree, physics) is judged by `check`, the same for all formats. What a
//! reader has reported already stands here as [`RawValue::Invalid`] or `None`, so that nothing is reported twice.

use super::source::{Span, Spanned};
use crate::model::{JointSpec, LoopSpec, ShapeSpec, WrenchAxes};
use mbd_runtime::contact::RestitutionLaw;

/// A number of the description.
#[derive(Clone, Debug, PartialEq)]
pub enum RawValue {
    /// A finite constant, SI units, radians.
    Const(f64),
    /// A parameter, by name.
    Param(String),
    /// Not a number; already reported.
    Invalid,
}

/// A number and its place.
pub type RawNumber = Spanned<RawValue>;

impl RawNumber {
    /// A finite constant.
    pub fn constant(x: f64, span: Span) -> RawNumber {
        Spanned::new(RawValue::Const(x), span)
    }
}

/// Three numbers and the place of the whole.
pub type RawVec3 = Spanned<[RawNumber; 3]>;

/// An orientation.
#[derive(Clone, Debug, PartialEq)]
pub enum RawRotation {
    /// `[roll, pitch, yaw]`, radians.
    Rpy(RawVec3),
    /// About an axis by an angle, radians; the axis is `None` where it was reported already.
    AxisAngle {
        /// Direction.
        axis: Option<Spanned<[f64; 3]>>,
        /// Angle, rad.
        angle: RawNumber,
    },
}

impl RawRotation {
    /// Axis and angle, where the rotation is given by them and they are constants.
    pub fn constant(&self) -> Option<([f64; 3], f64)> {
        match self {
            RawRotation::AxisAngle { axis: Some(axis), angle: Spanned { value: RawValue::Const(angle), .. } } => {
                Some((axis.value, *angle))
            }
            _ => None,
        }
    }
}

/// A pose; `None` stands for zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawPlacement {
    /// Origin, m.
    pub xyz: Option<RawVec3>,
    /// Orientation.
    pub rotation: Option<RawRotation>,
}

/// A run-time parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct RawParam {
    /// Name.
    pub name: Spanned<String>,
    /// Default; a constant.
    pub default: RawNumber,
}

/// A rigid body.
#[derive(Clone, Debug, PartialEq)]
pub struct RawBody {
    /// Name.
    pub name: Spanned<String>,
    /// Mass, kg; 0 where `None`.
    pub mass: Option<RawNumber>,
    /// Centre of mass in the body frame, m.
    pub com: Option<RawVec3>,
    /// About the centre of mass, `[xx, yy, zz, xy, xz, yz]`, kg m².
    pub inertia: Option<Spanned<[RawNumber; 6]>>,
    /// Axes of `inertia` relative to those of the body.
    pub inertia_axes: Option<RawRotation>,
}

/// One number for all degrees of freedom, or one for each.
#[derive(Clone, Debug, PartialEq)]
pub enum RawFreedoms {
    /// The same number for all.
    All(RawNumber),
    /// One per freedom, in the order of the velocities.
    Each(Spanned<Vec<RawNumber>>),
}

/// Where the coordinates come from.
#[derive(Clone, Debug, PartialEq)]
pub enum RawMotion {
    /// From the state.
    Free,
    /// From inputs.
    Prescribed(Span),
}

/// `q = ratio q_leader + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct RawMimic {
    /// The whole entry.
    pub span: Span,
    /// Name of the leading joint.
    pub leader: Spanned<String>,
    /// Factor; 1 where `None`.
    pub ratio: Option<RawNumber>,
    /// Offset, rad or m; 0 where `None`.
    pub offset: Option<RawNumber>,
}

/// A joint. The checks report entries that its type does not use; a reader whose format always has them leaves them
/// out.
#[derive(Clone, Debug, PartialEq)]
pub struct RawJoint {
    /// Name.
    pub name: Spanned<String>,
    /// Kind; `None` where it was reported already.
    pub kind: Option<Spanned<&'static JointSpec>>,
    /// Parent body; `None` for the ground. The name `ground` means the ground too.
    pub parent: Option<Spanned<String>>,
    /// Child body; `None` where it was reported already.
    pub child: Option<Spanned<String>>,
    /// Child frame in the parent frame at zero coordinates.
    pub placement: RawPlacement,
    /// Axis in the child frame; z, or x for a universal joint, where `None`.
    pub axis: Option<Spanned<[f64; 3]>>,
    /// Second axis of a universal joint; y where `None`.
    pub axis2: Option<Spanned<[f64; 3]>>,
    /// Pitch of a helical joint, m/rad.
    pub pitch: Option<RawNumber>,
    /// Viscous damping.
    pub damping: Option<RawFreedoms>,
    /// Spring stiffness.
    pub stiffness: Option<RawFreedoms>,
    /// Rest position of the springs.
    pub rest: Option<RawFreedoms>,
    /// Reflected rotor inertia.
    pub armature: Option<RawFreedoms>,
    /// A revolute joint without limits, which other programs may store as cosine and sine.
    pub unbounded: bool,
    /// Source of the coordinates.
    pub motion: RawMotion,
    /// Coupling to another joint.
    pub mimic: Option<RawMimic>,
    /// Coordinates from which loops are closed.
    pub start: Option<RawFreedoms>,
    /// Velocities at the start.
    pub start_velocity: Option<RawFreedoms>,
    /// Whether they do not change when loops are closed.
    pub held: Option<Spanned<bool>>,
    /// Stops.
    pub limits: Option<RawLimits>,
    /// Coefficient of restitution of the stops; 0 where `None`.
    pub limit_restitution: Option<RawNumber>,
    /// Coordinates that the joint is made for, without stops.
    pub range: Option<RawLimits>,
    /// Largest speed, rad/s or m/s.
    pub max_velocity: Option<RawNumber>,
    /// Largest effort, N m or N.
    pub max_effort: Option<RawNumber>,
}

/// Stops of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct RawLimits {
    /// The whole entry.
    pub span: Span,
    /// Least coordinate, rad or m; no stop where `None`.
    pub lower: Option<RawNumber>,
    /// Greatest coordinate, rad or m; no stop where `None`.
    pub upper: Option<RawNumber>,
}

impl RawJoint {
    /// A free joint with nothing but a name, a kind and a child, on the ground.
    pub fn new(
        name: Spanned<String>,
        kind: Option<Spanned<&'static JointSpec>>,
        child: Option<Spanned<String>>,
    ) -> Self {
        RawJoint {
            name,
            kind,
            parent: None,
            child,
            placement: RawPlacement::default(),
            axis: None,
            axis2: None,
            pitch: None,
            damping: None,
            stiffness: None,
            rest: None,
            armature: None,
            unbounded: false,
            motion: RawMotion::Free,
            mimic: None,
            start: None,
            start_velocity: None,
            held: None,
            limits: None,
            limit_restitution: None,
            range: None,
            max_velocity: None,
            max_effort: None,
        }
    }
}

/// A named frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RawFrame {
    /// Name.
    pub name: Spanned<String>,
    /// Body, or `ground`; `None` where it was reported already.
    pub body: Option<Spanned<String>>,
    /// Pose in the body frame.
    pub placement: RawPlacement,
}

/// A loop. Entries the type has no use for, and missing ones, are reported by the checks.
#[derive(Clone, Debug, PartialEq)]
pub struct RawLoop {
    /// Name.
    pub name: Spanned<String>,
    /// Type; `None` where it was reported already.
    pub kind: Option<Spanned<&'static LoopSpec>>,
    /// Bodies, frames or `ground`; `None` where it was reported already.
    pub between: Option<[Spanned<String>; 2]>,
    /// Directions by their keys; those that are missing have the defaults of the type.
    pub directions: Vec<(&'static str, Spanned<[f64; 3]>)>,
    /// Numbers by their keys: a pitch (m/rad), a length or radius (m); the rate at which errors of the positions decay
    /// (1/s), 0 where there is none.
    pub numbers: Vec<(&'static str, RawNumber)>,
    /// Lists by their keys, each with as many numbers as belong there: radii (m), coefficients of velocity and angular
    /// velocity.
    pub lists: Vec<(&'static str, Spanned<Vec<RawNumber>>)>,
}

impl RawLoop {
    /// The number under a key.
    pub fn number(&self, key: &str) -> Option<&RawNumber> {
        self.numbers.iter().find(|(k, _)| *k == key).map(|(_, number)| number)
    }

    /// The list under a key.
    pub fn list(&self, key: &str) -> Option<&Spanned<Vec<RawNumber>>> {
        self.lists.iter().find(|(k, _)| *k == key).map(|(_, list)| list)
    }

    /// The direction under a key.
    pub fn direction(&self, key: &str) -> Option<&Spanned<[f64; 3]>> {
        self.directions.iter().find(|(k, _)| *k == key).map(|(_, direction)| direction)
    }
}

/// A linear equation between the coordinates of joints.
#[derive(Clone, Debug, PartialEq)]
pub struct RawCoupling {
    /// Name.
    pub name: Spanned<String>,
    /// Names of the joints; `None` where it was reported already.
    pub joints: Option<Spanned<Vec<Spanned<String>>>>,
    /// Factor of each; `None` where it was reported already.
    pub ratios: Option<Spanned<Vec<RawNumber>>>,
    /// Value of the sum; 0 where `None`.
    pub offset: Option<RawNumber>,
    /// Rate at which errors of the positions decay, 1/s; 0 where `None`.
    pub decay: Option<RawNumber>,
}

/// A constraint beside the tree.
#[derive(Clone, Debug, PartialEq)]
pub enum RawConstraint {
    /// Between two frames.
    Loop(Box<RawLoop>),
    /// Between joints.
    Coupling(RawCoupling),
}

impl RawConstraint {
    /// Its name in messages.
    pub fn kind(&self) -> &'static str {
        match self {
            RawConstraint::Loop(_) => "loop",
            RawConstraint::Coupling(_) => "coupling",
        }
    }

    /// Name.
    pub fn name(&self) -> &Spanned<String> {
        match self {
            RawConstraint::Loop(l) => &l.name,
            RawConstraint::Coupling(c) => &c.name,
        }
    }
}

/// A shape. Dimensions the type has no use for, and missing ones, are reported by the checks.
#[derive(Clone, Debug, PartialEq)]
pub struct RawShape {
    /// Name.
    pub name: Spanned<String>,
    /// Body, or `ground`; the ground where `None`.
    pub body: Option<Spanned<String>>,
    /// MuJoCo's `contype` and `conaffinity`; `None` where the format has none. They matter to contacts that options ask for.
    pub bits: Option<[u32; 2]>,
    /// Type; `None` where it was reported already.
    pub kind: Option<Spanned<&'static ShapeSpec>>,
    /// Pose in the body frame.
    pub placement: RawPlacement,
    /// Radius, m.
    pub radius: Option<RawNumber>,
    /// Length, m.
    pub length: Option<RawNumber>,
    /// Lengths of edges, m.
    pub size: Option<RawVec3>,
    /// Sides of the prism that a cylinder is.
    pub sides: Option<RawNumber>,
    /// Radius of edges and corners, m.
    pub rounding: Option<RawNumber>,
    /// Semi-axes of an ellipsoid, m.
    pub semi_axes: Option<RawVec3>,
    /// Direction across a plane; z where `None`.
    pub normal: Option<Spanned<[f64; 3]>>,
    /// What a hull is made of.
    pub hull: Option<RawHull>,
    /// What a height field is made of.
    #[cfg(feature = "height_fields")]
    pub field: Option<RawField>,
}

/// The corners of a hull, with the entries that they were read from.
#[derive(Clone, Debug, PartialEq)]
pub struct RawHull {
    /// The keys that stand there, with their places.
    pub keys: Vec<(&'static str, Span)>,
    /// Corners, m; `None` where something was reported, or there are no points.
    pub corners: Option<Vec<[f64; 3]>>,
}

/// The heights of a field, with the entries that they were read from.
#[cfg(feature = "height_fields")]
#[derive(Clone, Debug, PartialEq)]
pub struct RawField {
    /// The keys that stand there, with their places.
    pub keys: Vec<(&'static str, Span)>,
    /// Distances of neighbours along x and y, m; `None` where something was reported, or there are none.
    pub spacing: Option<[f64; 2]>,
    /// Rows of heights, m; `None` where something was reported, or there are none.
    pub heights: Option<Vec<Vec<f64>>>,
}

impl RawShape {
    /// A shape without dimensions, on the ground, about its origin.
    pub fn new(name: Spanned<String>, kind: Option<Spanned<&'static ShapeSpec>>) -> RawShape {
        RawShape {
            name,
            body: None,
            bits: None,
            kind,
            placement: RawPlacement::default(),
            radius: None,
            length: None,
            size: None,
            sides: None,
            rounding: None,
            semi_axes: None,
            normal: None,
            hull: None,
            #[cfg(feature = "height_fields")]
            field: None,
        }
    }
}

/// What surfaces do to each other when they touch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawSurface {
    /// Coefficient of friction.
    pub friction: Option<RawNumber>,
    /// Coefficient of restitution.
    pub restitution: Option<RawNumber>,
    /// Law of restitution.
    pub law: Option<Spanned<RestitutionLaw>>,
}

/// A contact between two shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct RawContact {
    /// Name.
    pub name: Spanned<String>,
    /// Names of the shapes; `None` where it was reported already.
    pub between: Option<[Spanned<String>; 2]>,
    /// Its surfaces; that of all contacts, [`RawModel::surface`], where an entry is `None`.
    pub surface: RawSurface,
}

/// Contacts between the bodies of a robot, which options ask for.
#[derive(Clone, Debug, PartialEq)]
pub struct RawPairs {
    /// Coefficient of friction, where a pair states none.
    pub friction: RawNumber,
    /// Pairs of bodies, or `ground`, whose shapes do not touch each other.
    pub excluded: Vec<[String; 2]>,
    /// Pairs of shapes that the file lists, with surfaces of their own.
    pub listed: Vec<RawContact>,
}

impl RawPairs {
    /// Those of a file that lists none.
    pub fn new(friction: f64) -> RawPairs {
        let friction = RawNumber::constant(friction, Span::FILE);
        RawPairs { friction, excluded: Vec::new(), listed: Vec::new() }
    }
}

/// An external wrench.
#[derive(Clone, Debug, PartialEq)]
pub struct RawWrench {
    /// Name; that of the body where `None`.
    pub name: Option<Spanned<String>>,
    /// Body.
    pub body: Spanned<String>,
    /// Axes.
    pub axes: WrenchAxes,
}

/// Gravity.
#[derive(Clone, Debug, PartialEq)]
pub enum RawGravity {
    /// Part of the model, m/s² in ground axes.
    Constant(RawVec3),
    /// Given with every call.
    Input,
}

impl RawGravity {
    /// Gravity of the import options, m/s² in ground axes.
    pub fn of_options(g: [f64; 3]) -> RawGravity {
        RawGravity::Constant(Spanned::new(g.map(|x| RawNumber::constant(x, Span::FILE)), Span::FILE))
    }
}

/// A model as changes of another one.
#[derive(Clone, Debug, PartialEq)]
pub struct RawVariant {
    /// Name.
    pub name: Spanned<String>,
    /// Bodies that are left out.
    pub remove: Vec<Spanned<String>>,
    /// Joints whose bodies float afterwards; loops, couplings and contacts that are left out.
    pub cut: Vec<Spanned<String>>,
    /// Joints that are held where they stand.
    pub lock: Vec<Spanned<String>>,
    /// What is added. A joint replaces the one that carries its child.
    pub added: RawModel,
}

/// A model as read.
#[derive(Clone, Debug, PartialEq)]
pub struct RawModel {
    /// Name as written; `None`: made from the file name.
    pub name: Option<Spanned<String>>,
    /// Parameters, in file order.
    pub params: Vec<RawParam>,
    /// Gravity; `[0, 0, -9.81]` where `None`.
    pub gravity: Option<RawGravity>,
    /// Bodies, in file order.
    pub bodies: Vec<RawBody>,
    /// Joints, in file order.
    pub joints: Vec<RawJoint>,
    /// Frames, in file order.
    pub frames: Vec<RawFrame>,
    /// Wrenches, in file order.
    pub wrenches: Vec<RawWrench>,
    /// Loops and couplings, in file order.
    pub constraints: Vec<RawConstraint>,
    /// Shapes, in file order.
    pub shapes: Vec<RawShape>,
    /// Contacts that are described one by one, in file order.
    pub contacts: Vec<RawContact>,
    /// What holds for contacts that do not state it: no friction, no restitution, Poisson's law where `None`.
    pub surface: RawSurface,
    /// Where contacts between all pairs of shapes are asked for.
    pub all_pairs: Option<Span>,
    /// Contacts between bodies that options ask for.
    pub pairs: Option<RawPairs>,
    /// Descriptions of the same mechanism after changes of its tree, in file order.
    pub variants: Vec<RawVariant>,
    /// Shapes, by their indices, that all other shapes can touch, whatever pairs are asked for.
    pub floors: Vec<usize>,
    /// Whether a body or joint was left out after a finding. Unknown names and bodies without a joint are then not
    /// reported again.
    pub incomplete: bool,
    /// Whether the file was written for other programs. Values that are physically impossible but do not break the
    /// equations are then warnings, and the model's name is made valid.
    pub lenient: bool,
}

impl RawModel {
    /// An empty model.
    pub fn empty() -> Self {
        RawModel {
            name: None,
            params: Vec::new(),
            gravity: None,
            bodies: Vec::new(),
            joints: Vec::new(),
            frames: Vec::new(),
            wrenches: Vec::new(),
            constraints: Vec::new(),
            shapes: Vec::new(),
            contacts: Vec::new(),
            surface: RawSurface::default(),
            all_pairs: None,
            pairs: None,
            variants: Vec::new(),
            floors: Vec::new(),
            incomplete: false,
            lenient: false,
        }
    }
}
