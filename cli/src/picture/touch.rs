//! Contacts in pictures: shapes, floors and walls, and the forces between them.

use std::fmt::Write as _;

use multibody::codegen::model::{ConstraintKind, Frame, Mount, ShapeKind, Value};
use multibody::codegen::plan::Plan;
use multibody::runtime::field::Field;
use multibody::runtime::spatial::Mat3;
use multibody::runtime::sweep::FrameState;
use multibody::runtime::tree::Closure;
use multibody::runtime::Interpreter;

use super::limbs;
use super::shapes::Line;
use super::terrain::{field_of, lines};
use super::view::{Page, View};

/// Part of the page's size below which corners of outlines are left out: round ones stay round.
const ROUND: f64 = 1e-6;
/// Steps around a ball, on which its outline is drawn.
const AROUND: usize = 48;
/// Length of the longest arrow, as a part of the page.
const LONGEST: f64 = 0.16;
/// Forces below this part of the largest one are not drawn.
const SMALL: f64 = 0.02;

/// A plane: the frame that carries it and its normal there.
struct Plane {
    frame: usize,
    normal: [f64; 3],
    /// Length of the patch that is drawn of a plane on a body, m; `None` for one on the ground, which has no end.
    patch: Option<f64>,
}

/// A solid: the frame that carries it, points on its surface, and the index of the body's colour, `None` for the ground.
struct Solid {
    frame: usize,
    points: Vec<[f64; 3]>,
    colour: Option<usize>,
}

/// A height field on the ground, and the frame in whose axes it is.
struct Terrain {
    frame: usize,
    field: &'static Field,
}

/// A place where two bodies can touch: geometry, frames, and directions of their z.
struct Place {
    closure: Closure<f64>,
    frames: [usize; 2],
    axes: [[f64; 3]; 2],
}

/// What a model touches, drawn at the poses of frames that are added to it.
pub struct Touch {
    interpreter: Interpreter<f64>,
    frames: usize,
    planes: Vec<Plane>,
    solids: Vec<Solid>,
    terrains: Vec<Terrain>,
    /// One for each contact; `None` for stops.
    places: Vec<Option<Place>>,
}

/// A force on a body, in ground axes: where it acts, m, and its components, N.
pub type Arrow = ([f64; 3], [f64; 3]);

pub fn rotated(m: &Mat3<f64>, x: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

pub fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}

fn times(s: f64, a: [f64; 3]) -> [f64; 3] {
    a.map(|x| s * x)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn norm(a: [f64; 3]) -> f64 {
    a.iter().fold(0.0_f64, |n, x| n.hypot(*x))
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    times(1.0 / norm(a), a)
}

/// Two directions that form a right-handed triple with a unit vector behind them.
pub fn across(n: [f64; 3]) -> [[f64; 3]; 2] {
    let k = (0..3).min_by(|a, b| n[*a].abs().total_cmp(&n[*b].abs())).unwrap_or_default();
    let mut x = times(-n[k], n);
    x[k] += 1.0;
    let x = unit(x);
    [x, [n[1] * x[2] - n[2] * x[1], n[2] * x[0] - n[0] * x[2], n[0] * x[1] - n[1] * x[0]]]
}

/// The smallest rotation that takes z to a direction; half a turn about x for −z.
pub fn towards(axis: [f64; 3]) -> Mat3<f64> {
    let [x, y, z] = unit(axis);
    if z < -1.0 + 1e-15 {
        return [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    }
    let f = 1.0 / (1.0 + z);
    [[1.0 - f * x * x, -f * x * y, x], [-f * x * y, 1.0 - f * y * y, y], [-x, -y, z]]
}

fn product(a: &Mat3<f64>, b: &Mat3<f64>) -> Mat3<f64> {
    std::array::from_fn(|i| std::array::from_fn(|k| (0..3).map(|j| a[i][j] * b[j][k]).sum()))
}

/// Points on an ellipsoid about a place.
pub fn ellipsoid(middle: [f64; 3], semi_axes: [f64; 3]) -> Vec<[f64; 3]> {
    let angle = |k: usize| std::f64::consts::TAU * k as f64 / AROUND as f64;
    let ring = |i: usize| {
        let (s, c) = angle(i).sin_cos();
        (0..AROUND).map(move |k| {
            let (sk, ck) = angle(k).sin_cos();
            plus(middle, [semi_axes[0] * s * ck, semi_axes[1] * s * sk, semi_axes[2] * c])
        })
    };
    (0..=AROUND / 2).flat_map(ring).collect()
}

/// Points whose hull is a solid; none for points and planes.
fn surface(kind: &ShapeKind) -> Vec<[f64; 3]> {
    match *kind {
        ShapeKind::Sphere { radius } => ellipsoid([0.0; 3], [radius; 3]),
        ShapeKind::Ellipsoid { semi_axes } => ellipsoid([0.0; 3], semi_axes),
        ShapeKind::Capsule { radius, length } => {
            [-0.5, 0.5].into_iter().flat_map(|end| ellipsoid([0.0, 0.0, end * length], [radius; 3])).collect()
        }
        ShapeKind::Cylinder { radius, length, .. } => {
            let rim = |z: f64| ellipsoid([0.0, 0.0, z], [radius, radius, 0.0]);
            [-0.5, 0.5].into_iter().flat_map(|end| rim(end * length)).collect()
        }
        ShapeKind::Box { size, .. } => {
            let side = |corner: usize, k: usize| if corner >> k & 1 == 0 { -0.5 * size[k] } else { 0.5 * size[k] };
            (0..8).map(|corner| [0, 1, 2].map(|k| side(corner, k))).collect()
        }
        ShapeKind::Hull { ref points, rounding } if rounding > 0.0 => {
            points.iter().flat_map(|p| ellipsoid(*p, [rounding; 3])).collect()
        }
        ShapeKind::Hull { ref points, .. } => points.clone(),
        // Points, planes and height fields.
        _ => Vec::new(),
    }
}

impl Touch {
    /// What a plan's model touches; `None` where it has no shapes.
    pub fn new(plan: &Plan) -> Option<Touch> {
        let mut model = plan.model.clone();
        if model.shapes.is_empty() {
            return None;
        }
        let params = plan.default_params();
        let colours = limbs::colours(&plan.model, &|v| match v {
            Value::Const(x) => x,
            Value::Param(k) => params[k],
        });
        let mut names = Vec::new();
        let mut add = |mount: &Mount| {
            // A control character is in no name of the model.
            let name = format!("\u{1}{}", names.len());
            names.push(name.clone());
            model.frames.push(Frame { name, body: mount.body, placement: mount.placement });
            names.len() - 1
        };
        let (mut planes, mut solids, mut terrains) = (Vec::new(), Vec::new(), Vec::new());
        for (k, shape) in plan.model.shapes.iter().enumerate() {
            let frame = add(&shape.mount);
            match shape.kind {
                ShapeKind::Plane { normal } => {
                    // As wide as what touches it.
                    let partners = plan.model.contacts.iter().filter_map(|c| c.shapes).filter(|pair| pair.contains(&k));
                    let sizes = partners
                        .flat_map(|pair| pair.into_iter().filter(|other| *other != k))
                        .map(|other| surface(&plan.model.shapes[other].kind).into_iter().map(norm).fold(0.0, f64::max));
                    let size = sizes.fold(0.0, f64::max);
                    planes.push(Plane { frame, normal: unit(normal), patch: shape.mount.body.map(|_| size) });
                }
                ref kind => {
                    if let (Some(field), None) = (field_of(kind), shape.mount.body) {
                        terrains.push(Terrain { frame, field });
                    }
                    let points = surface(kind);
                    if !points.is_empty() {
                        solids.push(Solid { frame, points, colour: shape.mount.body.map(|b| colours[b]) });
                    }
                }
            }
        }
        let mut places = Vec::new();
        for contact in &plan.model.contacts {
            places.push(match &contact.kind {
                ConstraintKind::Loop { kind, first, second } => {
                    let mut axes = [[0.0, 0.0, 1.0]; 2];
                    match kind.directions()[..] {
                        [a] => axes[0] = a,
                        [a, b] => axes = [a, b],
                        _ => {}
                    }
                    let closure = kind.closure().map(|x| match x {
                        Value::Const(x) => x,
                        Value::Param(k) => params[k],
                    });
                    Some(Place { closure, frames: [add(first), add(second)], axes })
                }
                ConstraintKind::Coupling { .. } => None,
            });
        }
        let shown = Plan::new(&model, 1e-9);
        let at = |index: usize| shown.frames.iter().position(|f| f.name == names[index]).unwrap_or_default();
        planes.iter_mut().for_each(|p| p.frame = at(p.frame));
        solids.iter_mut().for_each(|s| s.frame = at(s.frame));
        terrains.iter_mut().for_each(|t| t.frame = at(t.frame));
        places.iter_mut().flatten().for_each(|p: &mut Place| p.frames = p.frames.map(at));
        let (frames, interpreter) = (shown.frames.len(), shown.default_interpreter());
        Some(Touch { frames, interpreter, planes, solids, terrains, places })
    }

    /// Poses of the frames at coordinates and velocities.
    pub fn poses(&mut self, q: &[f64], v: &[f64]) -> Vec<FrameState<f64>> {
        let mut out = vec![FrameState::ground(); self.frames];
        self.interpreter.frames(q, v, &mut out);
        out
    }

    /// Solids on bodies (`ground` false) or on the ground.
    pub fn solids(&self, poses: &[FrameState<f64>], ground: bool) -> Vec<Line> {
        let solids = self.solids.iter().filter(|s| s.colour.is_none() == ground).map(|solid| {
            let at = &poses[solid.frame];
            let points = solid.points.iter().map(|p| plus(at.position, rotated(&at.rotation, *p))).collect();
            Line { points, closed: false, flat: ROUND, marks: Vec::new(), colour: solid.colour, radius: 0.0 }
        });
        let faces = self.planes.iter().filter(|_| !ground).filter_map(|plane| {
            let (at, half) = (&poses[plane.frame], 0.5 * plane.patch?);
            let corner = |[i, k]: [f64; 2]| {
                let [x, y] = across(plane.normal);
                plus(at.position, rotated(&at.rotation, plus(times(i * half, x), times(k * half, y))))
            };
            let points = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner).to_vec();
            Some(Line { points, closed: false, flat: ROUND, marks: Vec::new(), colour: Some(0), radius: 0.0 })
        });
        solids.chain(faces).collect()
    }

    /// The part of every plane on the ground that lies below what is seen: corners in order, and its normal.
    pub fn grounds(&self, poses: &[FrameState<f64>], seen: &[[f64; 3]]) -> Vec<([[f64; 3]; 4], [f64; 3])> {
        let planes = self.planes.iter().filter(|p| p.patch.is_none()).map(|plane| {
            let at = &poses[plane.frame];
            let n = rotated(&at.rotation, plane.normal);
            let axes = across(n);
            let along = |p: [f64; 3], axis: [f64; 3]| dot(plus(p, times(-1.0, at.position)), axis);
            let bounds = axes.map(|axis| {
                let all = seen.iter().map(|p| along(*p, axis));
                all.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)))
            });
            let pad = 0.05 * bounds.iter().fold(1e-3, |m: f64, (a, b)| m.max(b - a));
            let corner = |i: bool, k: bool| {
                let [x, y] = [(i, 0), (k, 1)].map(|(end, axis): (bool, usize)| {
                    let (low, high) = bounds[axis];
                    times(if end { high + pad } else { low - pad }, axes[axis])
                });
                plus(at.position, plus(x, y))
            };
            ([corner(false, false), corner(true, false), corner(true, true), corner(false, true)], n)
        });
        planes.collect()
    }

    /// Lines on the height fields on the ground, as far as what is seen goes.
    pub fn terrains(&self, poses: &[FrameState<f64>], seen: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
        self.terrains.iter().flat_map(|terrain| lines(terrain.field, &poses[terrain.frame], seen)).collect()
    }

    /// Forces on the second bodies from their components along the rows of each contact.
    pub fn arrows(&self, poses: &[FrameState<f64>], forces: &[[f64; 3]]) -> Vec<Arrow> {
        forces.iter().enumerate().filter_map(|(k, force)| self.arrow(poses, k, force)).collect()
    }

    /// The force on the second body of contact `k`; `None` where it is zero, and for stops of joints.
    pub fn arrow(&self, poses: &[FrameState<f64>], k: usize, force: &[f64; 3]) -> Option<Arrow> {
        let place = self.places.get(k)?.as_ref()?;
        if force.iter().all(|f| *f == 0.0) {
            return None;
        }
        let [a, b] = [0, 1].map(|k| {
            let at = &poses[place.frames[k]];
            (product(&at.rotation, &towards(place.axes[k])), at.position)
        });
        let (point, rows) = place.closure.touching((&a.0, a.1), (&b.0, b.1))?;
        Some((point, rows.iter().zip(force).fold([0.0; 3], |sum, (row, f)| plus(sum, times(*f, *row)))))
    }
}

/// A plane: a patch with a border, or a line with hatches behind it where it is seen from its edge.
pub fn ground(text: &mut String, page: &Page, view: &View, (corners, normal): &([[f64; 3]; 4], [f64; 3])) {
    let at = corners.map(|p| page.place(view.project(p)));
    if view.depth(*normal).abs() > 0.03 {
        let list: Vec<String> = at.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let list = list.join(" ");
        let _ = writeln!(text, "<polygon class=\"floor\" points=\"{list}\"/>");
        return;
    }
    // The two corners that are farthest apart on the page.
    let pairs = (0..4).flat_map(|i| (0..i).map(move |k| (i, k)));
    let far = |(i, k): &(usize, usize)| (at[*i][0] - at[*k][0]).hypot(at[*i][1] - at[*k][1]);
    let Some((i, k)) = pairs.max_by(|a, b| far(a).total_cmp(&far(b))) else { return };
    let ([x1, y1], [x2, y2], length) = (at[i], at[k], far(&(i, k)));
    let along = [(x2 - x1) / length, (y2 - y1) / length];
    let [u, w] = view.project(*normal);
    // Down the page is positive.
    hatched(text, [x1, y1], along, length, [-u, w]);
}

/// A line on the page with hatches behind it.
pub fn hatched(text: &mut String, [x, y]: [f64; 2], along: [f64; 2], length: f64, behind: [f64; 2]) {
    let (u, v) = (x + length * along[0], y + length * along[1]);
    let _ = writeln!(text, "<path class=\"axis\" stroke-width=\"1.4\" d=\"M{x:.1} {y:.1}L{u:.1} {v:.1}\"/>");
    let step = 9.0_f64.max(length / 200.0);
    let count = (length / step).floor().max(1.0) as usize;
    let [dx, dy] = [0, 1].map(|k| 6.0 * (behind[k] - 0.7 * along[k]));
    let mut d = String::new();
    for k in 0..count {
        let s = (k as f64 + 0.6) * length / count as f64;
        let _ = write!(d, "M{:.1} {:.1}l{dx:.1} {dy:.1}", x + s * along[0], y + s * along[1]);
    }
    let _ = writeln!(text, "<path class=\"axis\" stroke-opacity=\".6\" d=\"{d}\"/>");
}

/// Lengths of arrows.
pub struct Scale {
    /// m on the page per N.
    pub metres: f64,
    /// Largest force, N.
    pub largest: f64,
}

impl Scale {
    /// The scale with which the largest of some forces has a good length; `None` where all are at most `least`, N.
    pub fn new<'a>(arrows: impl Iterator<Item = &'a Arrow>, page: &Page, least: f64) -> Option<Scale> {
        let largest = arrows.map(|(_, f)| norm(*f)).filter(|f| f.is_finite()).fold(0.0, f64::max);
        (largest > least).then(|| Scale { metres: LONGEST * page.size() / largest, largest })
    }

    /// Both ends on the page of an arrow that starts where the force acts; the same place twice for a small force.
    pub fn ends(&self, page: &Page, view: &View, (point, force): &Arrow) -> [[f64; 2]; 2] {
        let metres = if norm(*force) < SMALL * self.largest { 0.0 } else { self.metres };
        [0.0, metres].map(|m| page.place(view.project(plus(*point, times(m, *force)))))
    }

    /// An arrow that starts where the force acts.
    pub fn draw(&self, text: &mut String, page: &Page, view: &View, force: &Arrow) {
        let [from, to] = self.ends(page, view, force);
        arrow(text, from, to, "force");
    }
}

/// An arrow in places of the page, with an edge of paper that sets it off from what is behind it.
pub fn arrow(text: &mut String, from: [f64; 2], to: [f64; 2], class: &str) {
    let Some([shaft, tip]) = arrow_paths(from, to) else { return };
    for (class, width, edge) in [("halo", 4.6, 2.6), (class, 2.0, 0.0)] {
        let _ = writeln!(text, "<path class=\"{class}\" stroke-width=\"{width}\" d=\"{shaft}\"/>");
        let _ = writeln!(text, "<path class=\"{class}\" stroke-width=\"{edge}\" d=\"{tip}\"/>");
    }
}

/// Shaft and tip of an arrow; `None` for one that is too short to see.
pub fn arrow_paths([x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) -> Option<[String; 2]> {
    let length = (x2 - x1).hypot(y2 - y1);
    if length.is_nan() || length < 2.0 {
        return None;
    }
    let (u, v) = ((x2 - x1) / length, (y2 - y1) / length);
    let head = length.min(9.0);
    let (bx, by) = (x2 - head * u, y2 - head * v);
    let (wx, wy) = (0.42 * head * -v, 0.42 * head * u);
    let tip = format!("M{x2:.1} {y2:.1}L{:.1} {:.1}L{:.1} {:.1}Z", bx + wx, by + wy, bx - wx, by - wy);
    Some([format!("M{x1:.1} {y1:.1}L{bx:.1} {by:.1}"), tip])
}
