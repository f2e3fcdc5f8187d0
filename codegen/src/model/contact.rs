//! Contacts of the model: pairs of places that can touch, and stops of joints; the one table of the kinds of shapes.

use mbd_runtime::contact::RestitutionLaw;
#[cfg(feature = "height_fields")]
use mbd_runtime::field::Field;

use super::{ConstraintKind, Mount, Origin, Words};

/// A contact: a constraint that acts only while its bodies are pressed together.
///
/// A pair of shapes that can touch at several places (the corners of a box on a plane) is as many contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// Name, unique among constraints and contacts. Those of a pair that can touch at several places are numbered,
    /// `box/1`, `box/2`.
    pub name: String,
    /// Its geometry: a loop of a kind that rolls, whose first row is the normal one, or the coupling of one joint with
    /// its limit, with ratio 1 for a lower limit and −1 for an upper one. The residual of the first row is the gap.
    pub kind: ConstraintKind,
    /// Coefficient of friction; zero for stops.
    pub friction: f64,
    /// Coefficient of restitution, from 0 to 1.
    pub restitution: f64,
    /// Law of restitution.
    pub law: RestitutionLaw,
    /// The two shapes, indices into [`Model::shapes`](super::Model::shapes), the one on the first frame in front; `None`
    /// for stops.
    pub shapes: Option<[usize; 2]>,
    /// Place of its description.
    pub origin: Origin,
}

impl Contact {
    /// Index of the joint that this stop stops, whether it does so from below, and the coordinate there, rad or m; `None` for
    /// what is no stop.
    pub fn stop(&self) -> Option<(usize, bool, f64)> {
        match &self.kind {
            ConstraintKind::Coupling { terms, offset } if self.shapes.is_none() => {
                let [(joint, ratio)] = terms[..] else { return None };
                let (ratio, offset) = (ratio.constant()?, offset.constant()?);
                Some((joint, ratio > 0.0, ratio * offset))
            }
            _ => None,
        }
    }
}

/// Kinds of shapes, in the shape's own axes, with its origin in their middle.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeKind {
    /// The origin alone.
    Point,
    /// A ball.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A cylinder about z that ends in half balls.
    Capsule {
        /// Radius, m.
        radius: f64,
        /// Length of the straight part, m.
        length: f64,
    },
    /// A cuboid.
    Box {
        /// Its lengths along x, y and z, m.
        size: [f64; 3],
        /// Radius of its edges and corners, m; 0 where they are sharp.
        rounding: f64,
    },
    /// A cylinder about z; a thin disc where its length is zero.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Length, m.
        length: f64,
        /// Sides of the prism that it is for capsules, boxes, hulls and other cylinders; `None` where it is none.
        sides: Option<usize>,
        /// Radius of the edges and corners of that prism, within the cylinder, m; 0 where these are sharp.
        rounding: f64,
    },
    /// An ellipsoid with its axes along x, y and z.
    Ellipsoid {
        /// Semi-axes, m.
        semi_axes: [f64; 3],
    },
    /// The half space behind a plane through the origin.
    Plane {
        /// Direction out of it, of any length but zero.
        normal: [f64; 3],
    },
    /// The convex hull of points, or of balls about them.
    Hull {
        /// Its corners, m.
        points: Vec<[f64; 3]>,
        /// Radius of the balls, and so of its edges and corners, m; 0 where these are sharp.
        rounding: f64,
    },
    /// Ground below a smooth surface `z = h(x, y)`.
    #[cfg(feature = "height_fields")]
    HeightField {
        /// The surface.
        field: &'static Field,
        /// The heights through which it goes, in rows along x, the first one at the least y, m.
        heights: Vec<Vec<f64>>,
    },
}

/// The properties of a kind of shape.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ShapeSpec {
    /// Its words.
    pub words: Words,
    /// Keys of its dimensions: `radius`, `length`, `size`, `sides`, `rounding`, `semi_axes`, `normal`, `points`,
    /// `file`, `scale`, `most`, `spacing` or `heights`.
    pub keys: &'static [&'static str],
}

/// Fewest and most sides of a cylinder.
pub const SIDES: (usize, usize) = (3, 64);

/// Every kind of shape, in the order of the variants of [`ShapeKind`].
pub static SHAPES: &[ShapeSpec] = &[
    ShapeSpec { words: Words::new("point", &[], &["vertex", "corner"]), keys: &[] },
    ShapeSpec { words: Words::new("sphere", &[], &["ball"]), keys: &["radius"] },
    ShapeSpec { words: Words::new("capsule", &[], &["pill"]), keys: &["radius", "length"] },
    ShapeSpec { words: Words::new("box", &[], &["cube", "cuboid", "block"]), keys: &["size", "rounding"] },
    ShapeSpec {
        words: Words::new("cylinder", &[], &["disc", "disk", "wheel"]),
        keys: &["radius", "length", "sides", "rounding"],
    },
    ShapeSpec { words: Words::new("ellipsoid", &[], &["egg", "spheroid"]), keys: &["semi_axes"] },
    ShapeSpec { words: Words::new("plane", &[], &["floor", "wall", "half_space", "halfspace"]), keys: &["normal"] },
    ShapeSpec {
        words: Words::new("hull", &[], &["mesh", "convex", "convex_hull", "polyhedron"]),
        keys: &["points", "file", "scale", "most", "rounding"],
    },
    #[cfg(feature = "height_fields")]
    ShapeSpec {
        words: Words::new("height_field", &[], &["hfield", "heightfield", "heightmap", "terrain", "ground"]),
        keys: &["spacing", "heights", "file", "scale"],
    },
];

impl ShapeSpec {
    /// Its word in models and messages.
    pub fn word(&self) -> &'static str {
        self.words.word
    }
}

impl ShapeKind {
    /// Properties of its kind.
    pub fn spec(&self) -> &'static ShapeSpec {
        let index = match self {
            ShapeKind::Point => 0,
            ShapeKind::Sphere { .. } => 1,
            ShapeKind::Capsule { .. } => 2,
            ShapeKind::Box { .. } => 3,
            ShapeKind::Cylinder { .. } => 4,
            ShapeKind::Ellipsoid { .. } => 5,
            ShapeKind::Plane { .. } => 6,
            ShapeKind::Hull { .. } => 7,
            #[cfg(feature = "height_fields")]
            ShapeKind::HeightField { .. } => 8,
        };
        &SHAPES[index]
    }

    /// Its word in models and messages.
    pub fn word(&self) -> &'static str {
        self.spec().word()
    }
}

/// A shape that is fixed to a body or to the ground. It acts only in contacts that name it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Name, unique among the shapes.
    pub name: String,
    /// Its body, and its pose in the body frame.
    pub mount: Mount,
    /// Kind and dimensions.
    pub kind: ShapeKind,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "height_fields")]
    #[test]
    fn every_shape_is_listed_once_and_the_documents_have_the_same_table() {
        let (radius, length, normal) = (1.0, 2.0, [0.0, 0.0, 1.0]);
        let all = [
            ShapeKind::Point,
            ShapeKind::Sphere { radius },
            ShapeKind::Capsule { radius, length },
            ShapeKind::Box { size: [1.0, 2.0, 3.0], rounding: 0.0 },
            ShapeKind::Cylinder { radius, length, sides: None, rounding: 0.0 },
            ShapeKind::Ellipsoid { semi_axes: [1.0, 2.0, 3.0] },
            ShapeKind::Plane { normal },
            ShapeKind::Hull { points: vec![[0.0; 3]], rounding: 0.0 },
            ShapeKind::HeightField {
                field: crate::field::field([1.0; 2], &[[0.0; 4]; 4].map(Vec::from)),
                heights: [[0.0; 4]; 4].map(Vec::from).into(),
            },
        ];
        assert_eq!(all.map(|kind| *kind.spec()), SHAPES);
        Words::assert_distinct(SHAPES.iter().map(|spec| &spec.words));
        let document = include_str!("../../../book/src/model-format.md");
        for spec in SHAPES {
            let keys: Vec<String> = spec.keys.iter().map(|key| format!("`{key}`")).collect();
            let row = format!("| `{}` | {} |", spec.word(), keys.join(", ")).replace("|  |", "| |");
            assert!(document.lines().any(|line| line.starts_with(&row)), "book/src/model-format.md has no row\n{row}");
        }
    }
}
