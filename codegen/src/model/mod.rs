//! The checked description of a mechanism: what the readers make and everything after them uses.
//!
//! SI units, radians. No file format and no symbolic expression is known here.

mod constraint;
mod contact;
mod joint;

use std::fmt;
use std::sync::Arc;

pub use constraint::{
    Constraint, ConstraintKind, Direction, LoopKind, LoopNumbers, LoopSpec, Mount, NumberKey, Stands, LOOPS,
};
pub use contact::{Contact, Shape, ShapeKind, ShapeSpec, SHAPES, SIDES};
pub use joint::{Coordinate, Freedom, Joint, JointBounds, JointKind, JointMotion, JointSpec, JOINTS};
pub(crate) use joint::{FIXED, FLOATING, PLANAR, PRISMATIC, REVOLUTE, SPHERICAL};

/// Place of a part of the description in its file. It is ignored in comparisons: two models are equal if they describe
/// the same mechanism.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    /// File, as the caller named it; empty for what was not read from a text.
    pub file: Arc<str>,
    /// Line, from 1; 0 where it is unknown.
    pub line: usize,
    /// Column in characters, from 1; 0 where it is unknown.
    pub column: usize,
}

impl PartialEq for Origin {
    fn eq(&self, _: &Origin) -> bool {
        true
    }
}

/// `file:line:column`, or the file alone.
impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => f.write_str(&self.file),
            _ => write!(f, "{}:{}:{}", self.file, self.line, self.column),
        }
    }
}

/// Words for a kind of joint or loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Words {
    /// Word in models, messages and generated code.
    pub word: &'static str,
    /// Older words that models may still use.
    pub aliases: &'static [&'static str],
    /// Words of other programs; a finding about them names the word to use instead.
    pub foreign: &'static [&'static str],
}

impl Words {
    const fn new(word: &'static str, aliases: &'static [&'static str], foreign: &'static [&'static str]) -> Words {
        Words { word, aliases, foreign }
    }

    /// Whether models may write it so.
    pub fn are_read(&self, text: &str) -> bool {
        self.word == text || self.aliases.contains(&text)
    }

    /// Whether a word in lower case means this kind, even if models may not use the word.
    pub fn mean(&self, lower: &str) -> bool {
        self.are_read(lower) || self.foreign.contains(&lower)
    }

    #[cfg(test)]
    fn assert_distinct<'a>(all: impl Iterator<Item = &'a Words>) {
        let mut words: Vec<&str> =
            all.flat_map(|w| w.aliases.iter().chain(w.foreign).chain([&w.word])).copied().collect();
        let count = words.len();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), count, "a word stands for two kinds: {words:?}");
    }
}

/// Unit of a coordinate or of the residual of a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A length, m.
    Metre,
    /// An angle, rad.
    Radian,
    /// A component of a unit quaternion.
    One,
}

impl Unit {
    /// Its symbol; empty for a pure number.
    pub fn symbol(self) -> &'static str {
        match self {
            Unit::Metre => "m",
            Unit::Radian => "rad",
            Unit::One => "",
        }
    }
}

/// A number of the description: a constant, or a run-time parameter of the code.
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
    /// The identity.
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

/// Start of one joint: its coordinates, with which the closing of loops begins, and its velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Joint index, free.
    pub joint: usize,
    /// Its coordinates.
    pub q: Vec<f64>,
    /// Its velocities, m/s and rad/s.
    pub v: Vec<f64>,
    /// Whether they do not change when loops are closed.
    pub held: bool,
    /// Whether the description states the coordinates: by themselves, or by holding the joint where it is neutral.
    pub stated: bool,
}

/// A checked tree: `joints` is depth first, every body is the child of exactly one joint, parents come first, mimic
/// chains end.
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
    /// Shapes that contacts are between, in file order.
    pub shapes: Vec<Shape>,
    /// Contacts: of pairs of shapes in file order, then stops of joints in the order of the joints.
    pub contacts: Vec<Contact>,
    /// Initial coordinates and velocities, where they are not neutral.
    pub starts: Vec<Start>,
}
