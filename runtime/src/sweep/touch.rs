//! Where two rounded or edged bodies are nearest: distance, normal and contact point.
//!
//! Sweeps cannot branch on a value. Which face, edge or end is nearest is therefore chosen by factors that are exactly
//! 0 or 1 and have derivatives of zero. Distances and contact points are continuous; derivatives are those of the part
//! that is nearest.

#[cfg(feature = "height_fields")]
use crate::field::{Ball, Field, Foot, Ground};
#[cfg(feature = "hulls")]
use crate::hull::{Plane, Polyhedron};
#[cfg(any(feature = "hulls", feature = "height_fields"))]
use crate::lists::array;
use crate::spatial::{add3, dot3, scale3, Vec3};
use crate::workspace::Relative;
use crate::Scalar;

/// Contact of two bodies, on the frames `A` and `B`, with components of `B`.
pub(super) struct Touch<S> {
    /// Distance of the surfaces, m; negative where they overlap.
    pub gap: S,
    /// Normal of both surfaces, towards the second body.
    pub normal: Vec3<S>,
    /// The contact point on the second body, from the origin of `B`, m.
    pub at: Vec3<S>,
}

/// 1 where `x` is above zero by more than the rounding of 1, 0 elsewhere.
fn above<S: Scalar>(x: S) -> S {
    S::one().reciprocal_above(S::one() - x)
}

/// 1 or −1, as the sign of `x`.
fn sign<S: Scalar>(x: S) -> S {
    S::constant(2.0) * above(x) - S::one()
}

/// `x` where it is between `-half` and `half`, the nearest of these two elsewhere. Where `half` is zero, so are the result
/// and its derivative.
fn clamp<S: Scalar>(x: S, half: S) -> S {
    let inside = above(half - x) * above(half + x);
    inside * x + (S::one() - inside) * (sign(x) * half)
}

impl<S: Scalar> Touch<S> {
    /// A ball about `middle`, from the origin of `B`, with another ball that is `apart` before it.
    fn new(middle: Vec3<S>, apart: Vec3<S>, radii: &[S; 2]) -> Touch<S> {
        // Points that coincide have no direction: the addend, far below the rounding of any other distance, gives zero.
        let distance = (dot3(apart, apart) + S::constant(1e-36)).sqrt();
        let normal = scale3(S::one() / distance, apart);
        Touch { gap: distance - (radii[0] + radii[1]), normal, at: add3(middle, scale3(-radii[1], normal)) }
    }

    /// Balls about both origins.
    pub fn balls(at: &Relative<S>, radii: &[S; 2]) -> Touch<S> {
        Touch::new([S::zero(); 3], at.d, radii)
    }

    /// Balls that pass along segments of these lengths about both origins, along z of either frame: capsules, or balls
    /// where a length is zero.
    pub fn capsules(at: &Relative<S>, lengths: &[S; 2], radii: &[S; 2]) -> Touch<S> {
        let [first, second] = lengths.map(|length| S::constant(0.5) * length);
        let (z, d) = (at.axis(2), at.d);
        // The lines are nearest where they cross as seen along z of `B`. Where the square of the sine of the angle
        // between them has no digits left, they are parallel and nearest along all their common part, of which the
        // middle is taken.
        let inverse = (z[0] * z[0] + z[1] * z[1]).reciprocal_above(S::constant(1e-24));
        let along = dot3(z, d);
        let common = S::constant(0.5) * (clamp(along - second, first) + clamp(along + second, first));
        let crossing = (z[0] * d[0] + z[1] * d[1]) * inverse + (S::one() - above(inverse)) * common;
        // What is nearest to the nearest point of a segment is nearest of all after one return.
        let there = clamp(crossing, first);
        let here = clamp(there * z[2] - d[2], second);
        let there = clamp(along + here * z[2], first);
        let middle = [S::zero(), S::zero(), here];
        Touch::new(middle, add3(add3(d, middle), scale3(-there, z)), radii)
    }

    /// A ball about the origin of `B` on a box about that of `A`, with edges of these lengths along its axes; `radii` by
    /// which the box is larger on all sides, with rounded edges and corners, and of the ball.
    pub fn ball_on_box(at: &Relative<S>, size: &[S; 3], radii: &[S; 2]) -> Touch<S> {
        let mut faces = [(S::zero(), [S::zero(); 3]); 3];
        for (k, face) in faces.iter_mut().enumerate() {
            *face = ends(at.axis(k), at.d, size[k]);
        }
        Touch::ball_on_faces(&faces, radii)
    }

    /// A ball about the origin of `B` on a polyhedron in the axes of `A`; `radii` by which this is larger on all sides, with
    /// rounded edges and corners, and of the ball. As on a box, the distance inside is that of the nearest face.
    #[cfg(feature = "hulls")]
    pub fn ball_on_hull(at: &Relative<S>, hull: &Polyhedron, radii: &[S; 2]) -> Touch<S> {
        let place = array(|k| dot3(at.axis(k), at.d));
        let (mut way, mut square) = ([S::zero(); 3], S::zero());
        // The nearest place of all edges, to whose ends corners belong.
        for (k, edge) in hull.edges.iter().enumerate() {
            let (from, axis) = (add3(place, edge.middle.map(|x| S::constant(-x))), edge.axis.map(S::constant));
            let on = clamp(dot3(axis, from), S::constant(0.5 * edge.length));
            let other = add3(from, scale3(-on, axis));
            let size = dot3(other, other);
            let nearer = if k == 0 { S::one() } else { above(square - size) };
            way = either(nearer, other, way);
            square = nearer * size + (S::one() - nearer) * square;
        }
        let (mut inside, mut nearest, mut largest) = (S::one(), [S::zero(); 3], S::zero());
        for (k, face) in hull.faces.iter().enumerate() {
            let (before, normal) = (before(&face.plane, place), face.plane.normal.map(S::constant));
            inside = inside * (S::one() - above(before));
            let nearer = if k == 0 { S::one() } else { above(before - largest) };
            nearest = either(nearer, normal, nearest);
            largest = nearer * before + (S::one() - nearer) * largest;
            // A place before a face and not beyond one of its sides is nearest to the face.
            let beyond = |at: S, side: &Plane| at * (S::one() - above(self::before(side, place)));
            let on = face.sides.iter().fold(above(before), beyond);
            way = either(on, scale3(before, normal), way);
        }
        let way = either(inside, nearest, way);
        let length = (dot3(way, way) + S::constant(1e-36)).sqrt();
        let normal = at.turned(scale3(S::one() / length, way));
        let distance = (S::one() - inside) * length + inside * largest;
        Touch { gap: distance - (radii[0] + radii[1]), normal, at: scale3(-radii[1], normal) }
    }

    /// A ball about the origin of `B` on a cylinder about that of `A` and its z; `radii` of the cylinder and the ball.
    pub fn ball_on_cylinder(at: &Relative<S>, length: S, radii: &[S; 2]) -> Touch<S> {
        Touch::ball_on_cylinder_at([S::zero(); 3], at, length, radii)
    }

    /// The same about a `middle`, from the origin of `B`.
    fn ball_on_cylinder_at(middle: Vec3<S>, at: &Relative<S>, length: S, radii: &[S; 2]) -> Touch<S> {
        let (z, d) = (at.axis(2), add3(at.d, middle));
        let across = add3(d, scale3(-dot3(z, d), z));
        // On the axis itself there is no direction across it: the addend gives zero.
        let distance = (dot3(across, across) + S::constant(1e-36)).sqrt();
        let mantle = (distance - radii[0], scale3(S::one() / distance, across));
        let touch = Touch::ball_on_faces(&[mantle, ends(z, d, length)], &[S::zero(), radii[1]]);
        Touch { at: add3(middle, touch.at), ..touch }
    }

    /// A ball that passes along a segment about the origin of `B` and its z, on a cylinder about that of `A` and its z;
    /// lengths and radii of the cylinder and the segment.
    ///
    /// Where the line of the segment is nearest to the axis of the cylinder beside its mantle, it is nearest to the cylinder there,
    /// too. Where it is nearest to the axis beyond an end, by `H`, it is nearest to the cylinder on the way back, at most as far as
    /// the plane of that end: with the cosine `c` and the sine `b` of the angle between both axes, and the distance `a` of the
    /// lines, it has the distances `√(a² + b²u²)` from the axis and `H − c u` from that plane after `u`. It is nearest to the rim
    /// where `u = c H + R b² u / √(a² + b²u²)`. The difference of both sides is convex, so that Newton's method comes to the
    /// solution without fail from any place beyond.
    #[cfg(feature = "hulls")]
    pub fn capsule_on_cylinder(at: &Relative<S>, lengths: &[S; 2], radii: &[S; 2]) -> Touch<S> {
        let [height, reach] = lengths.map(|length| S::constant(0.5) * length);
        let (z, d) = (at.axis(2), at.d);
        let along = dot3(z, d);
        // As of capsules, the middle of the common part where the lines are parallel.
        let square = z[0] * z[0] + z[1] * z[1];
        let inverse = square.reciprocal_above(S::constant(1e-24));
        let common = S::constant(0.5) * (clamp(along - reach, height) + clamp(along + reach, height));
        let crossing = above(inverse);
        let foot = crossing * (z[2] * (z[0] * d[0] + z[1] * d[1]) * inverse - d[2])
            + (S::one() - crossing) * ((common - along) * z[2]);
        let level = along + foot * z[2];
        let side = sign(level);
        let beyond = above(side * level - height);
        let excess = beyond * (side * level - height);
        let apart = add3(add3(d, [S::zero(), S::zero(), foot]), scale3(-level, z));
        let cosine = sign(z[2]) * z[2];
        let rim = Rim { lift: cosine * excess, radius: radii[0], square, apart: dot3(apart, apart) };
        let back = beyond * rim.back();
        // Not beyond the plane of the end.
        let far = above(cosine * back - excess);
        let back = far * (excess * cosine.reciprocal_above(S::constant(1e-24))) + (S::one() - far) * back;
        let here = clamp(foot - side * sign(z[2]) * back, reach);
        Touch::ball_on_cylinder_at([S::zero(), S::zero(), here], at, lengths[0], radii)
    }

    /// A ball about the origin of `B`, or this origin itself, on a height field in the axes of `A`. The gap is the way down along
    /// z to where it touches, times the cosine of the slope there: of first order the distance, and defined however far away
    /// the ball is.
    #[cfg(feature = "height_fields")]
    pub fn ball_on_field(at: &Relative<S>, field: &Field, ball: Option<Ball<S>>) -> Touch<S> {
        let [x, y, z] = array(|k| dot3(at.axis(k), at.d));
        let Foot { ground: Ground { height, slope: [p, q], .. }, cosine, off, .. } = field.under([x, y], ball);
        let normal = at.turned([-(cosine * p), -(cosine * q), cosine]);
        let Some(Ball { radius, .. }) = ball else {
            return Touch { gap: cosine * (z - height), normal, at: [S::zero(); 3] };
        };
        // What is left of the way to the foot goes along the slope.
        let beside = p * off[0] + q * off[1];
        let gap = cosine * (z - height - radius * cosine + beside);
        Touch { gap, normal, at: scale3(-radius, normal) }
    }

    /// A ball about the origin of `B` on a body that is behind all of some faces, which are at right angles to each other:
    /// for each face how far before it the middle is, m, and its normal. Outside, the distance of the middle is that of
    /// the face, edge or corner that is nearest; inside, it is that of the nearest face, negative. `radii` by which the body
    /// is larger, and of the ball.
    fn ball_on_faces<const N: usize>(faces: &[(S, Vec3<S>); N], radii: &[S; 2]) -> Touch<S> {
        let (mut inside, mut largest) = (S::one(), faces[0].0);
        // 1 for the face that is the nearest from inside.
        let mut nearest = [S::zero(); N];
        nearest[0] = S::one();
        for (k, (before, _)) in faces.iter().enumerate() {
            inside = inside * (S::one() - above(*before));
            if k > 0 {
                let nearer = above(*before - largest);
                let stays = S::one() - nearer;
                nearest[..k].iter_mut().for_each(|x| *x = stays * *x);
                nearest[k] = nearer;
                largest = stays * largest + nearer * *before;
            }
        }
        let (mut normal, mut square) = ([S::zero(); 3], S::zero());
        for ((before, outward), nearest) in faces.iter().zip(nearest) {
            let part = above(*before) * *before + inside * nearest;
            normal = add3(normal, scale3(part, *outward));
            square = square + part * part;
        }
        let length = square.sqrt();
        let normal = scale3(S::one() / length, normal);
        let distance = (S::one() - inside) * length + inside * largest;
        Touch { gap: distance - (radii[0] + radii[1]), normal, at: scale3(-radii[1], normal) }
    }
}

/// What decides where a line is nearest to the rim of a cylinder.
#[cfg(feature = "hulls")]
struct Rim<S> {
    /// `c H`, m.
    lift: S,
    /// `R`, m.
    radius: S,
    /// `b²`.
    square: S,
    /// `a²`, m².
    apart: S,
}

#[cfg(feature = "hulls")]
impl<S: Scalar> Rim<S> {
    /// Steps of Newton's method, of which the last two give the result its derivatives. They square the error, except where the
    /// rim is seen from the middle of its curvature: there each step leaves two thirds of it, and the distance does not change
    /// up to its fourth power.
    const STEPS: usize = 10;

    /// How far the place lies behind that which is nearest to the axis, m.
    fn back(&self) -> S {
        let still = Rim {
            lift: self.lift.still(),
            radius: self.radius.still(),
            square: self.square.still(),
            apart: self.apart.still(),
        };
        let mut u = still.lift + still.radius * still.square.sqrt();
        for _ in 2..Self::STEPS {
            u = still.next(u);
        }
        self.next(self.next(u))
    }

    /// The next step.
    fn next(&self, u: S) -> S {
        let inverse = S::one() / (self.apart + self.square * (u * u) + S::constant(1e-36)).sqrt();
        let (part, pull) = (u * inverse, self.radius * self.square);
        let slope = S::one() - pull * self.apart * (inverse * inverse * inverse);
        (self.lift + pull * self.square * (part * part * part)) / slope
    }
}

/// How far a place is before a plane.
#[cfg(feature = "hulls")]
fn before<S: Scalar>(plane: &Plane, place: Vec3<S>) -> S {
    dot3(plane.normal.map(S::constant), place) - S::constant(plane.height)
}

/// The first of two vectors where `first` is 1, the second where it is 0.
#[cfg(feature = "hulls")]
fn either<S: Scalar>(first: S, a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    add3(scale3(first, a), scale3(S::one() - first, b))
}

/// The nearer of two faces that are `length` apart, across `axis` and on either side of the first origin: how far before
/// it the second origin, at `d`, is, and its normal.
fn ends<S: Scalar>(axis: Vec3<S>, d: Vec3<S>, length: S) -> (S, Vec3<S>) {
    let along = dot3(axis, d);
    let side = sign(along);
    (side * along - S::constant(0.5) * length, scale3(side, axis))
}
