//! Constraints beside the tree, and the one table of the kinds of loops.
//!
//! A new kind of loop is a variant of [`LoopKind`] with its [`LoopSpec`] in this file, and its rows in the sweeps
//! ([`mbd_runtime::tree::Closure`]).

#[cfg(feature = "height_fields")]
use mbd_runtime::field::{Ball, Field};
#[cfg(feature = "hulls")]
use mbd_runtime::hull::Polyhedron;
use mbd_runtime::spatial::Axis;
use mbd_runtime::tree::Closure;

use super::joint::{JointSpec, CYLINDRICAL, FIXED, HELICAL, PLANAR, PRISMATIC, REVOLUTE, SPHERICAL, UNIVERSAL};
use super::{Origin, Placement, Unit, Value, Words};

/// A frame that a constraint acts at.
#[derive(Clone, Debug, PartialEq)]
pub struct Mount {
    /// Body index, `None` for the ground.
    pub body: Option<usize>,
    /// Pose in the body frame.
    pub placement: Placement,
}

/// Kinds of loops between a first and a second frame. Axes are given in both frames, with any length but zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoopKind {
    /// Allows one rotation, as a revolute joint would.
    Revolute {
        /// Axis of rotation.
        axis: [f64; 3],
    },
    /// Allows one translation.
    Prismatic {
        /// Direction of the translation.
        axis: [f64; 3],
    },
    /// Allows a translation along and a rotation about one axis.
    Cylindrical {
        /// The axis.
        axis: [f64; 3],
    },
    /// Allows a screw motion.
    Helical {
        /// The axis.
        axis: [f64; 3],
        /// Metres per radian.
        pitch: Value,
    },
    /// Allows rotations about `axes[0]`, fixed in the first frame, and `axes[1]`, fixed in the second; at right angles.
    Universal {
        /// Both axes.
        axes: [[f64; 3]; 2],
    },
    /// Allows two translations across a normal and a rotation about it.
    Planar {
        /// Normal of the plane.
        normal: [f64; 3],
    },
    /// Allows all rotations: the origins coincide.
    Spherical,
    /// Allows no motion.
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
    /// An ellipsoid about the second frame's origin, with its axes along those of that frame, rolls on a plane of the first
    /// frame without slip.
    RollingEllipsoid {
        /// Normal of the plane in the first frame, towards the ellipsoid.
        normal: [f64; 3],
        /// Semi-axes along x, y and z, m.
        semi_axes: [Value; 3],
    },
    /// A ball about the second frame's origin rolls on a ball about the first frame's without slip.
    RollingBalls {
        /// Radii of the first and the second ball, m.
        radii: [Value; 2],
    },
    /// A capsule about the second frame's origin rolls on one about the first frame's without slip: cylinders that end in
    /// half balls, or balls.
    RollingCapsules {
        /// Axes of the first and the second capsule, in their own frames.
        axes: [[f64; 3]; 2],
        /// Lengths of the straight parts of the first and the second, m; zero for a ball.
        lengths: [Value; 2],
        /// Radii of the first and the second, m.
        radii: [Value; 2],
    },
    /// A ball about the second frame's origin rolls without slip on a box about the first frame's, with its edges along
    /// the axes of that frame.
    RollingBallOnBox {
        /// Lengths of the edges along x, y and z, m.
        size: [Value; 3],
        /// By how much the box is larger on all sides, with rounded edges and corners of this radius, m. Contacts have such
        /// boxes; loops in models do not.
        rounding: f64,
        /// Radius of the ball, m.
        radius: Value,
    },
    /// A capsule about the second frame's origin rolls without slip on a cylinder about the first frame's. Contacts are of this
    /// kind; loops in models are not.
    #[cfg(feature = "hulls")]
    RollingCapsuleOnCylinder {
        /// Axes of the cylinder and the capsule, in their own frames.
        axes: [[f64; 3]; 2],
        /// Lengths of the cylinder and of the straight part of the capsule, m.
        lengths: [Value; 2],
        /// Radii of the cylinder and the capsule, m.
        radii: [Value; 2],
    },
    /// A ball about the second frame's origin rolls without slip on a cylinder about the first frame's.
    RollingBallOnCylinder {
        /// Axis of the cylinder in the first frame.
        axis: [f64; 3],
        /// Length of the cylinder, m.
        length: Value,
        /// Radii of the cylinder and the ball, m.
        radii: [Value; 2],
    },
    /// A ball about the second frame's origin, or this point, rolls without slip on a height field in the axes of the first.
    /// Contacts are of this kind; loops in models are not.
    #[cfg(feature = "height_fields")]
    RollingBallOnField {
        /// The field.
        field: &'static Field,
        /// The ball; none for a point.
        ball: Option<Ball<Value>>,
    },
    /// A ball about the second frame's origin rolls without slip on a convex polyhedron in the axes of the first. Contacts are
    /// of this kind; loops in models are not.
    #[cfg(feature = "hulls")]
    RollingBallOnHull {
        /// The polyhedron.
        hull: &'static Polyhedron,
        /// By how much it is larger on all sides, with rounded edges and corners of this radius, m.
        rounding: f64,
        /// Radius of the ball, m.
        radius: Value,
    },
    /// The second origin does not move along a direction fixed in the second frame.
    KnifeEdge {
        /// Direction across the edge.
        axis: [f64; 3],
    },
    /// `row · [velocity; angular velocity] = 0` for the motion of the second frame relative to the first, in the axes
    /// and at the origin of the second.
    Pfaffian {
        /// Coefficients.
        row: [Value; 6],
    },
}

/// The frames of a loop in which a direction is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stands {
    /// In the first.
    InFirst,
    /// In the second.
    InSecond,
    /// In both.
    InBoth,
}

/// A direction that a kind of loop takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Key in models.
    pub key: &'static str,
    /// Value where a model states none.
    pub default: [f64; 3],
    /// Frames that it stands in.
    pub stands: Stands,
    /// Axis of those frames along which the rows want it.
    pub along: Axis,
}

/// Numbers of a loop, of which each kind takes those it has.
#[derive(Clone, Copy, Debug)]
pub struct LoopNumbers {
    /// Directions, as many as [`LoopSpec::directions`].
    pub directions: [[f64; 3]; 2],
    /// Pitch (m/rad), lengths and radii (m), or coefficients of velocity and angular velocity, as many as
    /// [`LoopSpec::numbers`] has and in their order.
    pub numbers: [Value; 6],
}

/// A key of a loop for numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberKey {
    /// Key in models.
    pub key: &'static str,
    /// How many numbers stand there: a list, if more than one.
    pub count: usize,
}

/// The properties of a kind of loop.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct LoopSpec {
    /// Its words.
    pub words: Words,
    /// Directions it takes.
    pub directions: &'static [Direction],
    /// Keys of the numbers it takes.
    pub numbers: &'static [NumberKey],
    /// Units of the residuals of its rows.
    pub rows: &'static [Unit],
    /// Whether it constrains positions, whose errors can decay.
    pub positions: bool,
    /// The kind with these numbers.
    pub make: fn(LoopNumbers) -> LoopKind,
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const M: Unit = Unit::Metre;
const RAD: Unit = Unit::Radian;

const fn direction(key: &'static str, stands: Stands) -> Direction {
    Direction { key, default: Z, stands, along: Axis::Z }
}

const fn axis(stands: Stands) -> Direction {
    direction("axis", stands)
}

const fn normal(stands: Stands) -> Direction {
    direction("normal", stands)
}

const fn number(key: &'static str) -> NumberKey {
    NumberKey { key, count: 1 }
}

const fn both(key: &'static str) -> NumberKey {
    NumberKey { key, count: 2 }
}

/// Properties that a loop has in common with the joint of the same kind.
const fn like(joint: &JointSpec) -> LoopSpec {
    LoopSpec { words: joint.words, ..PLAIN }
}

const PLAIN: LoopSpec = LoopSpec {
    words: FIXED.words,
    directions: &[],
    numbers: &[],
    rows: &[M],
    positions: true,
    make: |_| LoopKind::Fixed,
};

use Stands::{InBoth, InFirst, InSecond};

/// What rolls on height fields, which is no kind of loop in models.
#[cfg(feature = "height_fields")]
static ON_FIELD: LoopSpec =
    LoopSpec { words: Words::new("rolling_ball_on_field", &[], &[]), rows: &[M, M, M], ..PLAIN };

/// What rolls on hulls, which is no kind of loop in models either.
#[cfg(feature = "hulls")]
static ON_HULL: LoopSpec = LoopSpec { words: Words::new("rolling_ball_on_hull", &[], &[]), rows: &[M, M, M], ..PLAIN };

/// Capsules that roll on cylinders, which is no kind of loop in models either.
#[cfg(feature = "hulls")]
static ON_CYLINDER: LoopSpec = LoopSpec {
    words: Words::new("rolling_capsule_on_cylinder", &[], &[]),
    directions: &[axis(InFirst), direction("axis2", InSecond)],
    rows: &[M, M, M],
    ..PLAIN
};

/// Every kind of loop that models can have, in the order of the variants of [`LoopKind`].
pub static LOOPS: [LoopSpec; 21] = [
    LoopSpec {
        directions: &[axis(InBoth)],
        rows: &[M, M, M, RAD, RAD],
        make: |n| LoopKind::Revolute { axis: n.directions[0] },
        ..like(&REVOLUTE)
    },
    LoopSpec {
        directions: &[axis(InBoth)],
        rows: &[M, M, RAD, RAD, RAD],
        make: |n| LoopKind::Prismatic { axis: n.directions[0] },
        ..like(&PRISMATIC)
    },
    LoopSpec {
        directions: &[axis(InBoth)],
        rows: &[M, M, RAD, RAD],
        make: |n| LoopKind::Cylindrical { axis: n.directions[0] },
        ..like(&CYLINDRICAL)
    },
    LoopSpec {
        directions: &[axis(InBoth)],
        numbers: &[number("pitch")],
        rows: &[M, M, RAD, RAD, M],
        make: |n| LoopKind::Helical { axis: n.directions[0], pitch: n.numbers[0] },
        ..like(&HELICAL)
    },
    LoopSpec {
        directions: &[
            Direction { key: "axis", default: X, stands: InFirst, along: Axis::X },
            Direction { key: "axis2", default: Y, stands: InSecond, along: Axis::Y },
        ],
        rows: &[M, M, M, RAD],
        make: |n| LoopKind::Universal { axes: n.directions },
        ..like(&UNIVERSAL)
    },
    LoopSpec {
        directions: &[normal(InBoth)],
        rows: &[M, RAD, RAD],
        make: |n| LoopKind::Planar { normal: n.directions[0] },
        ..like(&PLANAR)
    },
    LoopSpec { rows: &[M, M, M], make: |_| LoopKind::Spherical, ..like(&SPHERICAL) },
    LoopSpec { rows: &[M, M, M, RAD, RAD, RAD], make: |_| LoopKind::Fixed, ..like(&FIXED) },
    LoopSpec {
        words: Words::new("distance", &[], &["rod", "bar", "link"]),
        numbers: &[number("length")],
        make: |n| LoopKind::Distance { length: n.numbers[0] },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("point_on_line", &[], &["inline"]),
        directions: &[axis(InFirst)],
        rows: &[M, M],
        make: |n| LoopKind::PointOnLine { axis: n.directions[0] },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("point_on_plane", &[], &["inplane", "point_on_surface"]),
        directions: &[normal(InFirst)],
        make: |n| LoopKind::PointOnPlane { normal: n.directions[0] },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("point_on_cylinder", &[], &[]),
        directions: &[axis(InFirst)],
        numbers: &[number("radius")],
        make: |n| LoopKind::PointOnCylinder { axis: n.directions[0], radius: n.numbers[0] },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("rolling_disc", &[], &["disc", "disk", "rolling_disk", "wheel"]),
        directions: &[normal(InFirst), axis(InSecond)],
        numbers: &[number("radius")],
        rows: &[M, M, M],
        make: |n| LoopKind::RollingDisc { normal: n.directions[0], axis: n.directions[1], radius: n.numbers[0] },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("rolling_ball", &[], &[]),
        directions: &[normal(InFirst)],
        numbers: &[number("radius")],
        rows: &[M, M, M],
        make: |n| LoopKind::RollingBall { normal: n.directions[0], radius: n.numbers[0] },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("rolling_ellipsoid", &[], &[]),
        directions: &[normal(InFirst)],
        numbers: &[NumberKey { key: "semi_axes", count: 3 }],
        rows: &[M, M, M],
        make: |n| {
            let [x, y, z, ..] = n.numbers;
            LoopKind::RollingEllipsoid { normal: n.directions[0], semi_axes: [x, y, z] }
        },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("rolling_balls", &[], &[]),
        numbers: &[both("radii")],
        rows: &[M, M, M],
        make: |n| LoopKind::RollingBalls { radii: [n.numbers[0], n.numbers[1]] },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("rolling_capsules", &[], &[]),
        directions: &[axis(InFirst), direction("axis2", InSecond)],
        numbers: &[both("lengths"), both("radii")],
        rows: &[M, M, M],
        make: |n| {
            let [a, b, c, d, ..] = n.numbers;
            LoopKind::RollingCapsules { axes: n.directions, lengths: [a, b], radii: [c, d] }
        },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("rolling_ball_on_box", &[], &[]),
        numbers: &[NumberKey { key: "size", count: 3 }, number("radius")],
        rows: &[M, M, M],
        make: |n| {
            let [x, y, z, radius, ..] = n.numbers;
            LoopKind::RollingBallOnBox { size: [x, y, z], rounding: 0.0, radius }
        },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("rolling_ball_on_cylinder", &[], &[]),
        directions: &[axis(InFirst)],
        numbers: &[number("length"), both("radii")],
        rows: &[M, M, M],
        make: |n| {
            let [length, a, b, ..] = n.numbers;
            LoopKind::RollingBallOnCylinder { axis: n.directions[0], length, radii: [a, b] }
        },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("knife_edge", &[], &["skate"]),
        directions: &[axis(InSecond)],
        positions: false,
        make: |n| LoopKind::KnifeEdge { axis: n.directions[0] },
        ..PLAIN
    },
    LoopSpec {
        words: Words::new("pfaffian", &[], &["nonholonomic"]),
        numbers: &[NumberKey { key: "row", count: 6 }],
        positions: false,
        make: |n| LoopKind::Pfaffian { row: n.numbers },
        ..PLAIN
    },
];

/// Kinds of loops are equal if their words are.
impl PartialEq for LoopSpec {
    fn eq(&self, other: &LoopSpec) -> bool {
        self.words == other.words
    }
}

impl LoopSpec {
    /// Its word in models, messages and generated code.
    pub fn word(&self) -> &'static str {
        self.words.word
    }

    /// Keys it has in models beside `name`, `type` and `between`.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> {
        let decay = self.positions.then_some("decay");
        self.directions.iter().map(|d| d.key).chain(self.numbers.iter().map(|n| n.key)).chain(decay)
    }
}

impl LoopKind {
    /// Properties of its kind.
    pub fn spec(&self) -> &'static LoopSpec {
        let index = match self {
            LoopKind::Revolute { .. } => 0,
            LoopKind::Prismatic { .. } => 1,
            LoopKind::Cylindrical { .. } => 2,
            LoopKind::Helical { .. } => 3,
            LoopKind::Universal { .. } => 4,
            LoopKind::Planar { .. } => 5,
            LoopKind::Spherical => 6,
            LoopKind::Fixed => 7,
            LoopKind::Distance { .. } => 8,
            LoopKind::PointOnLine { .. } => 9,
            LoopKind::PointOnPlane { .. } => 10,
            LoopKind::PointOnCylinder { .. } => 11,
            LoopKind::RollingDisc { .. } => 12,
            LoopKind::RollingBall { .. } => 13,
            LoopKind::RollingEllipsoid { .. } => 14,
            LoopKind::RollingBalls { .. } => 15,
            LoopKind::RollingCapsules { .. } => 16,
            LoopKind::RollingBallOnBox { .. } => 17,
            LoopKind::RollingBallOnCylinder { .. } => 18,
            #[cfg(feature = "height_fields")]
            LoopKind::RollingBallOnField { .. } => return &ON_FIELD,
            #[cfg(feature = "hulls")]
            LoopKind::RollingBallOnHull { .. } => return &ON_HULL,
            #[cfg(feature = "hulls")]
            LoopKind::RollingCapsuleOnCylinder { .. } => return &ON_CYLINDER,
            LoopKind::KnifeEdge { .. } => 19,
            LoopKind::Pfaffian { .. } => 20,
        };
        &LOOPS[index]
    }

    /// Its word in models and messages.
    pub fn word(&self) -> &'static str {
        self.spec().word()
    }

    /// Its directions, as many as [`LoopSpec::directions`].
    pub fn directions(&self) -> Vec<[f64; 3]> {
        match *self {
            LoopKind::Revolute { axis: a }
            | LoopKind::Prismatic { axis: a }
            | LoopKind::Cylindrical { axis: a }
            | LoopKind::Helical { axis: a, .. }
            | LoopKind::Planar { normal: a }
            | LoopKind::PointOnLine { axis: a }
            | LoopKind::PointOnPlane { normal: a }
            | LoopKind::PointOnCylinder { axis: a, .. }
            | LoopKind::RollingBall { normal: a, .. }
            | LoopKind::RollingEllipsoid { normal: a, .. }
            | LoopKind::RollingBallOnCylinder { axis: a, .. }
            | LoopKind::KnifeEdge { axis: a } => vec![a],
            LoopKind::Universal { axes: [a, b] }
            | LoopKind::RollingDisc { normal: a, axis: b, .. }
            | LoopKind::RollingCapsules { axes: [a, b], .. } => vec![a, b],
            LoopKind::Spherical
            | LoopKind::Fixed
            | LoopKind::Distance { .. }
            | LoopKind::RollingBalls { .. }
            | LoopKind::RollingBallOnBox { .. }
            | LoopKind::Pfaffian { .. } => Vec::new(),
            #[cfg(feature = "height_fields")]
            LoopKind::RollingBallOnField { .. } => Vec::new(),
            #[cfg(feature = "hulls")]
            LoopKind::RollingBallOnHull { .. } => Vec::new(),
            #[cfg(feature = "hulls")]
            LoopKind::RollingCapsuleOnCylinder { axes: [a, b], .. } => vec![a, b],
        }
    }

    /// Its numbers, in the order of [`LoopSpec::numbers`].
    pub fn numbers_mut(&mut self) -> Vec<&mut Value> {
        match self {
            LoopKind::Helical { pitch: x, .. }
            | LoopKind::Distance { length: x }
            | LoopKind::PointOnCylinder { radius: x, .. }
            | LoopKind::RollingDisc { radius: x, .. }
            | LoopKind::RollingBall { radius: x, .. } => vec![x],
            LoopKind::RollingEllipsoid { semi_axes, .. } => semi_axes.iter_mut().collect(),
            LoopKind::RollingBalls { radii } => radii.iter_mut().collect(),
            LoopKind::RollingCapsules { lengths, radii, .. } => lengths.iter_mut().chain(radii).collect(),
            LoopKind::RollingBallOnBox { size, radius, .. } => size.iter_mut().chain([radius]).collect(),
            LoopKind::RollingBallOnCylinder { length, radii, .. } => [length].into_iter().chain(radii).collect(),
            #[cfg(feature = "height_fields")]
            LoopKind::RollingBallOnField { ball, .. } => ball.iter_mut().map(|ball| &mut ball.radius).collect(),
            #[cfg(feature = "hulls")]
            LoopKind::RollingBallOnHull { radius, .. } => vec![radius],
            #[cfg(feature = "hulls")]
            LoopKind::RollingCapsuleOnCylinder { lengths, radii, .. } => lengths.iter_mut().chain(radii).collect(),
            LoopKind::Pfaffian { row } => row.iter_mut().collect(),
            _ => Vec::new(),
        }
    }

    /// The constraint in the form that the sweeps use, between frames that are rotated according to its directions.
    pub fn closure(&self) -> Closure<Value> {
        match *self {
            LoopKind::Revolute { .. } => Closure::Revolute,
            LoopKind::Prismatic { .. } => Closure::Prismatic,
            LoopKind::Cylindrical { .. } => Closure::Cylindrical,
            LoopKind::Helical { pitch, .. } => Closure::Helical { pitch },
            LoopKind::Universal { .. } => Closure::Universal,
            LoopKind::Planar { .. } => Closure::Planar,
            LoopKind::Spherical => Closure::Spherical,
            LoopKind::Fixed => Closure::Fixed,
            LoopKind::Distance { length } => Closure::Distance { length },
            LoopKind::PointOnLine { .. } => Closure::PointOnLine,
            LoopKind::PointOnPlane { .. } => Closure::PointOnPlane,
            LoopKind::PointOnCylinder { radius, .. } => Closure::PointOnCylinder { radius },
            LoopKind::RollingDisc { radius, .. } => Closure::RollingDisc { radius },
            LoopKind::RollingBall { radius, .. } => Closure::RollingBall { radius },
            LoopKind::RollingEllipsoid { semi_axes, .. } => Closure::RollingEllipsoid { semi_axes },
            LoopKind::RollingBalls { radii } => Closure::RollingBalls { radii },
            LoopKind::RollingCapsules { lengths, radii, .. } => Closure::RollingCapsules { lengths, radii },
            LoopKind::RollingBallOnBox { size, rounding, radius } => {
                Closure::RollingBallOnBox { size, rounding: Value::Const(rounding), radius }
            }
            LoopKind::RollingBallOnCylinder { length, radii, .. } => Closure::RollingBallOnCylinder { length, radii },
            #[cfg(feature = "height_fields")]
            LoopKind::RollingBallOnField { field, ball } => Closure::RollingBallOnField { field, ball },
            #[cfg(feature = "hulls")]
            LoopKind::RollingBallOnHull { hull, rounding, radius } => {
                Closure::RollingBallOnHull { hull, rounding: Value::Const(rounding), radius }
            }
            #[cfg(feature = "hulls")]
            LoopKind::RollingCapsuleOnCylinder { lengths, radii, .. } => {
                Closure::RollingCapsuleOnCylinder { lengths, radii }
            }
            LoopKind::KnifeEdge { .. } => Closure::KnifeEdge,
            LoopKind::Pfaffian { row } => Closure::Pfaffian { row },
        }
    }
}

/// The bodies or joints that a constraint connects.
// A model has few of them, so that their size does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
pub enum ConstraintKind {
    /// Two bodies.
    Loop {
        /// Kind of the loop.
        kind: LoopKind,
        /// First frame.
        first: Mount,
        /// Second frame.
        second: Mount,
    },
    /// Joints with one degree of freedom each: `Σ ratio · q = offset`.
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
    /// The bodies or joints that it connects.
    pub kind: ConstraintKind,
    /// Rate at which position errors decay (Baumgarte), 1/s; with zero they do not decay.
    pub decay: Value,
    /// Place of its description.
    pub origin: Origin,
}

impl Constraint {
    /// A constraint that was not read from a text.
    pub fn new(name: impl Into<String>, kind: ConstraintKind, decay: Value) -> Constraint {
        Constraint { name: name.into(), kind, decay, origin: Origin::default() }
    }

    /// What it is called in models and messages: `loop` or `coupling`.
    pub fn word(&self) -> &'static str {
        match self.kind {
            ConstraintKind::Loop { .. } => "loop",
            ConstraintKind::Coupling { .. } => "coupling",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_listed_once_and_agrees_with_the_sweeps() {
        let numbers = LoopNumbers { directions: [X, Y], numbers: [Value::ONE; 6] };
        for spec in &LOOPS {
            let mut kind = (spec.make)(numbers);
            assert_eq!(kind.spec(), spec);
            assert_eq!(kind.directions(), [X, Y][..spec.directions.len()], "{}", spec.word());
            let count = spec.numbers.iter().map(|n| n.count).sum();
            assert_eq!(kind.numbers_mut().len(), count, "{}", spec.word());
            let closure = kind.closure();
            assert_eq!(closure.rows(), spec.rows.len(), "{}", spec.word());
            assert_eq!((0..closure.rows()).any(|k| closure.holonomic(k)), spec.positions, "{}", spec.word());
        }
        Words::assert_distinct(LOOPS.iter().map(|spec| &spec.words));
    }

    #[test]
    fn the_documents_have_the_same_table() {
        let document = include_str!("../../../book/src/model-format.md");
        for spec in &LOOPS {
            let keys: Vec<String> = spec.keys().filter(|key| *key != "decay").map(|key| format!("`{key}`")).collect();
            let row =
                format!("| `{}` | {} | {} |", spec.word(), keys.join(", "), spec.rows.len()).replace("|  |", "| |");
            assert!(document.lines().any(|line| line.starts_with(&row)), "book/src/model-format.md has no row\n{row}");
        }
    }
}
