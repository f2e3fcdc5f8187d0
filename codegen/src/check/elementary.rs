//! The one table of the pairs of shapes that can touch.

#[cfg(feature = "height_fields")]
use mbd_runtime::field::{Ball, Field};
#[cfg(feature = "hulls")]
use mbd_runtime::hull::Polyhedron;

#[cfg(feature = "height_fields")]
use crate::field::fit;
#[cfg(feature = "hulls")]
use crate::hull::polyhedron;
use crate::inertia::{apply, matrix};
use crate::model::{LoopKind, Mount, Placement, ShapeKind, Value};

/// What [`elementary`] has, for messages.
pub(super) const SUPPORTED: &str =
    "a `plane` can touch all other kinds but a `height_field`; a `height_field` a `point`, `sphere`, `capsule`, `box` or \
     `hull`; a `sphere` or `point` all others but an `ellipsoid`, and a `sphere` another one; a `capsule`, `box`, \
     `hull` or `cylinder` each other, of two that are no capsules a `cylinder` with `sides`, and one with a `rounding`";

/// One place where two shapes can touch: a loop between two frames, which stand at these origins in the axes of the
/// shapes, not turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Elementary {
    /// Geometry.
    pub(super) kind: LoopKind,
    /// Origin of the first frame in the first shape, m.
    pub(super) first: [f64; 3],
    /// Origin of the second frame in the second shape, m.
    pub(super) second: [f64; 3],
    /// Whether the first frame is on the second shape of the pair, which is then the first one here.
    pub(super) exchanged: bool,
}

/// Most contacts of a pair.
pub(super) const MOST: usize = 2000;

/// What a capsule, a box, a hull or a cylinder with sides is: all that lies within a radius of its core, which is a line, a box
/// or a polyhedron.
pub(super) struct Rounded {
    radius: f64,
    pub(super) core: Core,
    corners: Vec<[f64; 3]>,
    edges: Vec<Edge>,
}

/// What has faces on which corners can touch.
#[derive(Clone, Copy)]
pub(super) enum Core {
    Line,
    /// Lengths of the edges, m.
    Box([f64; 3]),
    #[cfg(feature = "hulls")]
    Hull(&'static Polyhedron),
}

/// A straight edge.
#[derive(Clone, Copy)]
struct Edge {
    middle: [f64; 3],
    axis: [f64; 3],
    length: f64,
}

impl Rounded {
    /// `None` for shapes of other kinds, and for hulls whose faces are not known. A cylinder with sides is a prism.
    pub(super) fn new(shape: &ShapeKind) -> Option<Rounded> {
        match *shape {
            ShapeKind::Capsule { radius, length } => {
                let edges = vec![Edge { middle: MIDDLE, axis: Z, length }];
                Some(Rounded { radius, core: Core::Line, corners: ends(length), edges })
            }
            ShapeKind::Box { size, rounding } => {
                let core = size.map(|x| x - 2.0 * rounding);
                Some(Rounded { radius: rounding, core: Core::Box(core), corners: corners(core), edges: edges(core) })
            }
            #[cfg(feature = "hulls")]
            ShapeKind::Hull { ref points, rounding } => {
                let hull = polyhedron(points)?;
                let edge =
                    |edge: &mbd_runtime::hull::Edge| Edge { middle: edge.middle, axis: edge.axis, length: edge.length };
                let edges = hull.edges.iter().map(edge).collect();
                Some(Rounded { radius: rounding, core: Core::Hull(hull), corners: points.clone(), edges })
            }
            #[cfg(feature = "hulls")]
            ShapeKind::Cylinder { radius, length, sides: Some(sides), rounding } => {
                let points = rims(radius - rounding, length - 2.0 * rounding, sides);
                Rounded::new(&ShapeKind::Hull { points, rounding })
            }
            _ => None,
        }
    }

    /// A ball about the middle of another shape on this one.
    fn ball(&self, radius: f64) -> Elementary {
        let rounding = self.radius;
        match self.core {
            Core::Line => {
                let length = self.edges.first().map_or(0.0, |edge| edge.length);
                middles(rods([Z; 2], [length, 0.0], [rounding, radius]))
            }
            Core::Box(size) => {
                let (size, radius) = (size.map(Value::Const), Value::Const(radius));
                middles(LoopKind::RollingBallOnBox { size, rounding, radius })
            }
            #[cfg(feature = "hulls")]
            Core::Hull(hull) => middles(LoopKind::RollingBallOnHull { hull, rounding, radius: Value::Const(radius) }),
        }
    }

    /// The corners as balls on another body with faces.
    fn on_faces_of(&self, other: &Rounded) -> Vec<Elementary> {
        match other.core {
            Core::Line => Vec::new(),
            _ => self.corners.iter().map(|at| Elementary { second: *at, ..other.ball(self.radius) }).collect(),
        }
    }

    /// Number of the contacts with another one.
    pub(super) fn contacts(&self, other: &Rounded) -> usize {
        let on = |a: &Rounded, b: &Rounded| if let Core::Line = b.core { 0 } else { a.corners.len() };
        on(self, other) + on(other, self) + self.edges.len() * other.edges.len()
    }

    /// Corners on faces and edges on edges: two convex bodies with flat faces that do not overlap are as far apart as the
    /// nearest two of these. `None` where both are sharp, because the distance of two lines is never negative, so that nothing
    /// tells when they have passed through each other, and where there are too many contacts.
    fn meets(&self, other: &Rounded) -> Option<Vec<Elementary>> {
        if self.radius + other.radius == 0.0 || self.contacts(other) > MOST {
            return None;
        }
        let mut places = other.on_faces_of(self);
        places.extend(self.on_faces_of(other).into_iter().map(|place| Elementary { exchanged: true, ..place }));
        for a in &self.edges {
            for b in &other.edges {
                let kind = rods([a.axis, b.axis], [a.length, b.length], [self.radius, other.radius]);
                places.push(Elementary { first: a.middle, second: b.middle, ..middles(kind) });
            }
        }
        Some(places)
    }
}

/// Points of the rims of a cylinder, at equal distances from the x axis on: those of the lower one, then those of the upper one.
#[cfg(feature = "hulls")]
fn rims(radius: f64, length: f64, sides: usize) -> Vec<[f64; 3]> {
    let rim = |[_, _, z]: [f64; 3]| {
        let point = move |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / sides as f64;
            [radius * libm::cos(angle), radius * libm::sin(angle), z]
        };
        (0..sides).map(point)
    };
    ends(length).into_iter().flat_map(rim).collect()
}

const MIDDLE: [f64; 3] = [0.0; 3];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// The places where the first shape can touch the second; `None` for pairs that are not supported in this order.
pub(super) fn elementary(first: &ShapeKind, second: &ShapeKind) -> Option<Vec<Elementary>> {
    let places = match (first, second) {
        (ShapeKind::Plane { normal }, ShapeKind::Point) => vec![ball(*normal, 0.0, MIDDLE)],
        (ShapeKind::Plane { normal }, ShapeKind::Sphere { radius }) => vec![ball(*normal, *radius, MIDDLE)],
        (ShapeKind::Plane { normal }, ShapeKind::Capsule { radius, length }) => {
            ends(*length).into_iter().map(|at| ball(*normal, *radius, at)).collect()
        }
        (ShapeKind::Plane { normal }, ShapeKind::Box { .. }) => {
            let Rounded { radius, corners, .. } = Rounded::new(second)?;
            corners.into_iter().map(|at| ball(*normal, radius, at)).collect()
        }
        (ShapeKind::Plane { normal }, ShapeKind::Hull { points, rounding }) => {
            points.iter().map(|at| ball(*normal, *rounding, *at)).collect()
        }
        (ShapeKind::Plane { normal }, ShapeKind::Cylinder { radius, length, .. }) => {
            let kind = LoopKind::RollingDisc { normal: *normal, axis: Z, radius: Value::Const(*radius) };
            ends(*length).into_iter().map(|at| Elementary { second: at, ..middles(kind) }).collect()
        }
        (ShapeKind::Plane { normal }, ShapeKind::Ellipsoid { semi_axes }) => {
            vec![middles(LoopKind::RollingEllipsoid { normal: *normal, semi_axes: semi_axes.map(Value::Const) })]
        }
        #[cfg(feature = "height_fields")]
        (ShapeKind::HeightField { field, .. }, ShapeKind::Capsule { radius, length }) => {
            ends(*length).into_iter().map(|at| on_field(field, Some(*radius), at)).collect()
        }
        #[cfg(feature = "height_fields")]
        (ShapeKind::HeightField { field, .. }, ShapeKind::Box { .. }) => {
            let Rounded { radius, corners, .. } = Rounded::new(second)?;
            corners.into_iter().map(|at| on_field(field, Some(radius), at)).collect()
        }
        #[cfg(feature = "height_fields")]
        (ShapeKind::HeightField { field, .. }, ShapeKind::Hull { points, rounding }) => {
            points.iter().map(|at| on_field(field, Some(*rounding), *at)).collect()
        }
        #[cfg(feature = "height_fields")]
        (ShapeKind::HeightField { field, .. }, ShapeKind::Sphere { radius }) => {
            vec![on_field(field, Some(*radius), MIDDLE)]
        }
        #[cfg(feature = "height_fields")]
        (ShapeKind::HeightField { field, .. }, ShapeKind::Point) => vec![on_field(field, None, MIDDLE)],
        (ShapeKind::Sphere { radius: first }, second) => vec![balls(*first, ball_of(second)?)],
        (ShapeKind::Hull { .. }, ShapeKind::Hull { .. } | ShapeKind::Box { .. } | ShapeKind::Capsule { .. })
        | (ShapeKind::Box { .. }, ShapeKind::Box { .. } | ShapeKind::Capsule { .. })
        | (ShapeKind::Capsule { .. }, ShapeKind::Capsule { .. }) => {
            Rounded::new(first)?.meets(&Rounded::new(second)?)?
        }
        #[cfg(feature = "hulls")]
        (
            ShapeKind::Cylinder { radius, length, sides: None, .. },
            ShapeKind::Capsule { radius: other, length: line },
        ) => {
            let ([lengths, radii], axes) = ([[*length, *line], [*radius, *other]].map(|x| x.map(Value::Const)), [Z; 2]);
            let ball = LoopKind::RollingBallOnCylinder { axis: Z, length: lengths[0], radii };
            let ends = ends(*line).into_iter().map(|at| Elementary { second: at, ..middles(ball) });
            ends.chain([middles(LoopKind::RollingCapsuleOnCylinder { axes, lengths, radii })]).collect()
        }
        #[cfg(feature = "hulls")]
        (
            ShapeKind::Hull { .. } | ShapeKind::Box { .. } | ShapeKind::Capsule { .. } | ShapeKind::Cylinder { .. },
            ShapeKind::Cylinder { sides: Some(_), .. },
        ) => Rounded::new(first)?.meets(&Rounded::new(second)?)?,
        (ShapeKind::Hull { .. } | ShapeKind::Box { .. } | ShapeKind::Capsule { .. }, second) => {
            vec![Rounded::new(first)?.ball(ball_of(second)?)]
        }
        (ShapeKind::Cylinder { radius: first, length, .. }, second) => {
            let (length, radii) = (Value::Const(*length), [*first, ball_of(second)?].map(Value::Const));
            vec![middles(LoopKind::RollingBallOnCylinder { axis: Z, length, radii })]
        }
        _ => return None,
    };
    Some(places)
}

/// Radius of a shape that is a ball about its origin, 0 for a point; `None` for others.
fn ball_of(shape: &ShapeKind) -> Option<f64> {
    match shape {
        ShapeKind::Point => Some(0.0),
        ShapeKind::Sphere { radius } => Some(*radius),
        _ => None,
    }
}

/// A ball about a place of the second shape on the plane of the first.
fn ball(normal: [f64; 3], radius: f64, second: [f64; 3]) -> Elementary {
    let kind = LoopKind::RollingBall { normal, radius: Value::Const(radius) };
    Elementary { second, ..middles(kind) }
}

/// A ball about a place of the second shape, or that place, on the height field of the first.
#[cfg(feature = "height_fields")]
fn on_field(field: &'static Field, radius: Option<f64>, second: [f64; 3]) -> Elementary {
    let ball = |radius: f64| Ball { radius: Value::Const(radius), steps: fit(field, radius).steps };
    let ball = radius.filter(|radius| *radius > 0.0).map(ball);
    Elementary { second, ..middles(LoopKind::RollingBallOnField { field, ball }) }
}

/// A ball about the middle of the second shape on one about the middle of the first.
fn balls(first: f64, second: f64) -> Elementary {
    middles(LoopKind::RollingBalls { radii: [first, second].map(Value::Const) })
}

/// A capsule of the second shape on one of the first; balls where a length is zero.
fn rods(axes: [[f64; 3]; 2], lengths: [f64; 2], radii: [f64; 2]) -> LoopKind {
    let [lengths, radii] = [lengths, radii].map(|x| x.map(Value::Const));
    LoopKind::RollingCapsules { axes, lengths, radii }
}

/// A loop between the middles of both shapes.
fn middles(kind: LoopKind) -> Elementary {
    Elementary { kind, first: MIDDLE, second: MIDDLE, exchanged: false }
}

/// The ends of a line of this length along z; one where it has none.
fn ends(length: f64) -> Vec<[f64; 3]> {
    match length == 0.0 {
        true => vec![MIDDLE],
        false => vec![[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]],
    }
}

/// The corners of a box, x changing fastest.
pub(super) fn corners(size: [f64; 3]) -> Vec<[f64; 3]> {
    let side = |corner: usize, k: usize| if corner >> k & 1 == 0 { -0.5 * size[k] } else { 0.5 * size[k] };
    (0..8).map(|corner| [0, 1, 2].map(|k| side(corner, k))).collect()
}

/// The edges of a box: four along x, then along y and z; of the two other coordinates, the first one changes fastest.
fn edges(size: [f64; 3]) -> Vec<Edge> {
    let mut edges = Vec::new();
    for k in 0..3 {
        let along = |corner: &[f64; 3]| corner[k] < 0.0;
        let axis = [0, 1, 2].map(|i| if i == k { 1.0 } else { 0.0 });
        edges.extend(corners(size).into_iter().filter(along).map(|mut middle| {
            middle[k] = 0.0;
            Edge { middle, axis, length: size[k] }
        }));
    }
    edges
}

/// The frame of a shape moved to a place in its own axes. The place of a shape that has others than its origin is
/// constant.
pub(super) fn moved(mount: &Mount, to: [f64; 3]) -> Mount {
    let Placement { xyz, rotation } = mount.placement;
    if to == MIDDLE {
        return mount.clone();
    }
    let at = |x: Value| x.constant().unwrap_or(f64::NAN);
    let to = apply(&matrix(&rotation, &at), to);
    let xyz = [0, 1, 2].map(|k| Value::Const(at(xyz[k]) + to[k]));
    Mount { body: mount.body, placement: Placement { xyz, rotation } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Rotation;

    /// A box has corners at the same distance from its middle; turned about z by a right angle, its x is the body's y.
    #[test]
    fn corners_stand_at_the_ends_of_the_edges() {
        let all = corners([2.0, 4.0, 6.0]);
        assert_eq!((all[0], all[1], all[7]), ([-1.0, -2.0, -3.0], [1.0, -2.0, -3.0], [1.0, 2.0, 3.0]));
        let rotation = Rotation::Rpy([Value::ZERO, Value::ZERO, Value::Const(std::f64::consts::FRAC_PI_2)]);
        let xyz = [Value::Const(10.0), Value::ZERO, Value::ZERO];
        let mount = Mount { body: Some(0), placement: Placement { xyz, rotation } };
        let got = moved(&mount, all[7]).placement.xyz.map(|x| x.constant().unwrap_or(f64::NAN));
        // Rounding of one product of each component.
        assert!(got.iter().zip([8.0, 1.0, 3.0]).all(|(a, b)| (a - b).abs() < 1e-14), "{got:?}");
    }

    #[test]
    fn as_many_places_as_shapes_have_ends() {
        let plane = ShapeKind::Plane { normal: [0.0, 1.0, 0.0] };
        let (radius, length) = (0.1, 0.4);
        let count = |shape| elementary(&plane, &shape).map(|places| places.len());
        assert_eq!(count(ShapeKind::Point), Some(1));
        assert_eq!(count(ShapeKind::Sphere { radius }), Some(1));
        assert_eq!(count(ShapeKind::Capsule { radius, length }), Some(2));
        assert_eq!(count(ShapeKind::Box { size: [1.0; 3], rounding: 0.0 }), Some(8));
        assert_eq!(count(ShapeKind::Cylinder { radius, length, sides: None, rounding: 0.0 }), Some(2));
        assert_eq!(count(ShapeKind::Cylinder { radius, length: 0.0, sides: None, rounding: 0.0 }), Some(1));
        assert_eq!(count(ShapeKind::Ellipsoid { semi_axes: [0.1, 0.2, 0.3] }), Some(1));
        assert_eq!(count(ShapeKind::Hull { points: vec![[0.0; 3]; 5], rounding: 0.0 }), Some(5));
        assert_eq!(count(plane.clone()), None);
        let sphere = ShapeKind::Sphere { radius };
        let wide = ShapeKind::Sphere { radius: 0.3 };
        assert_eq!(elementary(&sphere, &wide), Some(vec![balls(0.1, 0.3)]));
        assert_eq!(elementary(&sphere, &ShapeKind::Point), Some(vec![balls(0.1, 0.0)]));
        assert_eq!(elementary(&ShapeKind::Point, &ShapeKind::Point), None);
    }

    const TETRAHEDRON: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    /// Corners and edges of a tetrahedron, a box and a capsule meet each other's, unless both shapes are sharp.
    #[cfg(feature = "hulls")]
    #[test]
    fn corners_meet_faces_and_edges_meet_edges() {
        let block = |rounding| ShapeKind::Box { size: [1.0; 3], rounding };
        let hull = |rounding| ShapeKind::Hull { points: TETRAHEDRON.to_vec(), rounding };
        let capsule = ShapeKind::Capsule { radius: 0.1, length: 0.4 };
        let count = |a: &ShapeKind, b: &ShapeKind| elementary(a, b).map(|places| places.len());
        assert_eq!(count(&block(0.0), &capsule), Some(2 + 12));
        assert_eq!(count(&hull(0.0), &capsule), Some(2 + 6));
        assert_eq!(count(&block(0.0), &block(0.1)), Some(8 + 8 + 144));
        assert_eq!(count(&hull(0.0), &block(0.1)), Some(4 + 8 + 72));
        assert_eq!(count(&hull(0.1), &hull(0.0)), Some(4 + 4 + 36));
        assert_eq!(count(&hull(0.0), &hull(0.0)).or(count(&block(0.0), &block(0.0))), None);
        let cylinder = |sides, rounding| ShapeKind::Cylinder { radius: 0.1, length: 0.4, sides, rounding };
        assert_eq!(count(&cylinder(None, 0.0), &capsule), Some(2 + 1));
        assert_eq!(count(&capsule, &cylinder(Some(12), 0.0)), Some(2 + 36));
        assert_eq!(count(&block(0.1), &cylinder(Some(12), 0.0)), Some(24 + 8 + 36 * 12));
        assert_eq!(count(&hull(0.0), &cylinder(Some(6), 0.01)), Some(12 + 4 + 18 * 6));
        assert_eq!(count(&cylinder(Some(6), 0.0), &cylinder(Some(5), 0.01)), Some(12 + 10 + 18 * 15));
        for other in [cylinder(None, 0.0), block(0.1), hull(0.1), cylinder(Some(6), 0.01)] {
            assert_eq!(count(&cylinder(None, 0.0), &other).or(count(&other, &cylinder(None, 0.0))), None);
        }
        assert_eq!(count(&cylinder(Some(6), 0.0), &block(0.0)).or(count(&block(0.1), &cylinder(Some(64), 0.0))), None);
        // The size of a box is that with its rounding, so that its lowest ball is as low.
        let plane = ShapeKind::Plane { normal: Z };
        let lowest = |kind| elementary(&plane, &kind).map(|places| (places[0].kind, places[0].second));
        let radius = Value::Const(0.125);
        assert_eq!(lowest(block(0.125)), Some((LoopKind::RollingBall { normal: Z, radius }, [-0.375; 3])));
    }

    /// What the messages say about pairs is what there is.
    #[cfg(all(feature = "height_fields", feature = "hulls"))]
    #[test]
    fn pairs_are_those_that_messages_name() {
        let (radius, length) = (0.1, 0.4);
        let shapes = [
            ShapeKind::Plane { normal: Z },
            ShapeKind::Sphere { radius },
            ShapeKind::Point,
            ShapeKind::Capsule { radius, length },
            ShapeKind::Box { size: [1.0; 3], rounding: 0.0 },
            ShapeKind::Cylinder { radius, length, sides: None, rounding: 0.0 },
            ShapeKind::Ellipsoid { semi_axes: [0.1, 0.2, 0.3] },
            ShapeKind::Hull { points: TETRAHEDRON.to_vec(), rounding: 0.0 },
            ShapeKind::HeightField {
                field: crate::field::field([1.0; 2], &[[0.0; 4]; 4].map(Vec::from)),
                heights: [[0.0; 4]; 4].map(Vec::from).into(),
            },
        ];
        for (i, a) in shapes.iter().enumerate() {
            for (j, b) in shapes.iter().enumerate() {
                let found = elementary(a, b).or_else(|| elementary(b, a)).is_some();
                let least = i.min(j);
                let wanted = match i.max(j) {
                    8 => matches!(least, 1..=4 | 7),
                    _ if i == j => i == 1 || i == 3,
                    4 | 7 => least <= 3,
                    5 if least == 3 => true,
                    most => least == 0 || (least <= 2 && most < 6),
                };
                assert_eq!(found, wanted, "{} and {}", a.word(), b.word());
            }
        }
        let kind = |a: &ShapeKind, b: &ShapeKind| elementary(a, b).map(|places| places[0].kind);
        let [lengths, radii] = [[length, 0.0], [radius, 0.3]].map(|x| x.map(Value::Const));
        let ball = ShapeKind::Sphere { radius: 0.3 };
        assert_eq!(kind(&shapes[3], &ball), Some(LoopKind::RollingCapsules { axes: [Z; 2], lengths, radii }));
        let size = [Value::ONE; 3];
        assert_eq!(
            kind(&shapes[4], &ShapeKind::Point),
            Some(LoopKind::RollingBallOnBox { size, rounding: 0.0, radius: Value::ZERO })
        );
    }
}
