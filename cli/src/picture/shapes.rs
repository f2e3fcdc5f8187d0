//! The shape of a mechanism: lines between the points at which its bodies are connected.

use multibody::codegen::model::{ConstraintKind, LoopKind, Model, Mount, Rotation, ShapeKind, Unit, Value};
use multibody::codegen::plan::Plan;
use multibody::runtime::sweep::FrameState;

use super::{flesh, limbs};

/// Number of corners of a disc.
const CORNERS: usize = 40;

/// What [`Line::flat`] is for bars between joints.
const BARS: f64 = 1e-3;

/// Points that are drawn together, in ground axes, m.
pub struct Line {
    /// Points.
    pub points: Vec<[f64; 3]>,
    /// Whether they are an outline already.
    pub closed: bool,
    /// Part of the page's size below which corners of the outline are left out.
    pub flat: f64,
    /// Joints, and whether each is prismatic.
    pub marks: Vec<([f64; 3], bool)>,
    /// Index of the colour; `None` for what is fixed to the ground.
    pub colour: Option<usize>,
    /// Radius of what is drawn about the points, m.
    pub radius: f64,
}

impl Line {
    /// Mean of the points.
    pub fn middle(&self) -> [f64; 3] {
        let n = self.points.len().max(1) as f64;
        std::array::from_fn(|k| self.points.iter().map(|p| p[k]).sum::<f64>() / n)
    }
}

/// A part: points in the frame of a body.
struct Part {
    frame: Option<usize>,
    points: Vec<[f64; 3]>,
    marks: Vec<([f64; 3], bool)>,
    closed: bool,
    colour: Option<usize>,
    radius: f64,
}

/// An end of a rod: the frame of its body, `None` of the ground, and its place there.
pub type End = (Option<usize>, [f64; 3]);

/// A rod between two bodies.
struct Rod {
    ends: [End; 2],
    colour: usize,
    /// Whether its ends are joints.
    pins: bool,
}

/// The shape of a whole mechanism.
pub struct Shapes {
    /// Points of the ground that hold joints and loops, m.
    pub supports: Vec<[f64; 3]>,
    parts: Vec<Part>,
    rods: Vec<Rod>,
    /// Places of the ground on which something rolls, m: horizontal floors.
    pub floors: Vec<[f64; 3]>,
    /// Frame and name of the bodies that a picture may name, and the colour.
    pub named: Vec<(usize, String, usize)>,
}

/// A point given in a frame, in ground axes.
pub fn placed(frames: &[FrameState<f64>], frame: Option<usize>, p: [f64; 3]) -> [f64; 3] {
    let Some(f) = frame.map(|f| &frames[f]) else { return p };
    std::array::from_fn(|i| f.position[i] + (0..3).map(|k| f.rotation[i][k] * p[k]).sum::<f64>())
}

/// Points of a body that tell its shape, in its frame, m.
#[derive(Clone, Default)]
struct Known {
    /// Joints and loops.
    joints: Vec<[f64; 3]>,
    /// Named frames.
    frames: Vec<[f64; 3]>,
    /// Origins of bodies that are welded to it.
    welds: Vec<[f64; 3]>,
    /// Feet and tips.
    tips: Vec<[f64; 3]>,
    /// Whether a weld holds it, whose place says nothing of its shape.
    welded: bool,
    /// Whether contacts or loops know its shape.
    solid: bool,
    /// Whether no joint holds it.
    free: bool,
}

/// Greatest distance between two points.
fn extent(points: &[[f64; 3]]) -> f64 {
    let far = |a: &[f64; 3], b: &[f64; 3]| (0..3).fold(0.0_f64, |n, k| n.hypot(a[k] - b[k]));
    points.iter().flat_map(|a| points.iter().map(move |b| far(a, b))).fold(0.0, f64::max)
}

impl Shapes {
    /// The shape of a plan's model, at default parameters.
    pub fn new(plan: &Plan) -> Shapes {
        let params = plan.default_params();
        let number = |v: Value| match v {
            Value::Const(x) => x,
            Value::Param(k) => params[k],
        };
        let model = &plan.model;
        let frame = |b: usize| plan.frames.iter().position(|f| f.name == model.bodies[b].name);
        let colours = limbs::colours(model, &number);
        let grounded = limbs::grounded(model);
        let part = |b: usize| Part {
            frame: frame(b),
            points: Vec::new(),
            marks: Vec::new(),
            closed: false,
            colour: (!grounded[b]).then_some(colours[b]),
            radius: 0.0,
        };
        let mut parts: Vec<Part> = (0..model.bodies.len()).map(part).collect();
        let mut known = vec![Known::default(); parts.len()];
        let (mut supports, mut rods) = (Vec::new(), Vec::new());
        joints(model, &number, &mut known, &mut parts, &mut supports);
        let discs = loops(model, &number, &mut known, &mut parts, (&mut supports, &mut rods));
        for joint in model.joints.iter().filter(|j| slides(j) && j.kind.spec().group.is_none()) {
            // The two parts of a telescope meet at any length: a rod joins their middles.
            let ends = [joint.parent, Some(joint.child)].map(|b| b.filter(|b| number(model.bodies[*b].mass) > 0.0));
            if let [Some(a), Some(b)] = ends {
                let ends = [a, b].map(|b| (parts[b].frame, model.bodies[b].com.map(number)));
                rods.push(Rod { ends, colour: colours[b], pins: false });
            }
        }
        tips(model, &number, &mut known);
        discs.iter().for_each(|disc| known[disc.0].solid = true);
        fleshed(model, &number, &known, &mut parts);
        for (b, centre, axis, radius) in discs {
            let rim = disc(centre, axis, radius);
            // Spokes show the rotation.
            let spoke = vec![rim[0], rim[CORNERS / 2]];
            let (frame, colour) = (parts[b].frame, parts[b].colour);
            for (points, closed) in [(rim, true), (spoke, false)] {
                parts.push(Part { frame, points, marks: Vec::new(), closed, colour, radius: 0.0 });
            }
        }
        let named = limbs::named(model, &number).into_iter();
        let named = named.filter_map(|b| Some((frame(b)?, model.bodies[b].name.clone(), colours[b]))).collect();
        let floors = floors(model, &number);
        Shapes { supports, parts, rods, floors, named }
    }

    /// The mechanism at given poses of its frames.
    pub fn lines(&self, frames: &[FrameState<f64>]) -> Vec<Line> {
        let rods = self.rods.iter().map(|rod| {
            let points: Vec<[f64; 3]> = rod.ends.iter().map(|(f, p)| placed(frames, *f, *p)).collect();
            let marks = points.iter().filter(|_| rod.pins).map(|p| (*p, false)).collect();
            Line { points, closed: false, flat: BARS, marks, colour: Some(rod.colour), radius: 0.0 }
        });
        // Rods are behind the parts that they join, where both are equally far away.
        rods.chain(self.parts.iter().map(|part| line(part, frames))).collect()
    }

    /// Bodies in the axes of their frames, which `None` is the ground's: the frame, and what is drawn there.
    pub fn bodies(&self) -> Vec<(Option<usize>, Line)> {
        let line = |part: &Part| Line {
            points: part.points.clone(),
            closed: part.closed,
            flat: BARS,
            marks: part.marks.clone(),
            colour: part.colour,
            radius: part.radius,
        };
        self.parts.iter().map(|part| (part.frame, line(part))).collect()
    }

    /// Rods between two bodies: frame and place of both ends, index of the colour.
    pub fn rods(&self) -> Vec<([End; 2], usize)> {
        self.rods.iter().map(|rod| (rod.ends, rod.colour)).collect()
    }

    /// The middle of what is drawn of a body, by its frame.
    pub fn middle(&self, frame: usize, frames: &[FrameState<f64>]) -> Option<[f64; 3]> {
        let part = self.parts.iter().find(|part| part.frame == Some(frame) && !part.points.is_empty())?;
        Some(line(part, frames).middle())
    }

    /// All points, from which the extent is computed.
    pub fn points(&self, frames: &[FrameState<f64>]) -> Vec<[f64; 3]> {
        let mut points = self.supports.clone();
        points.extend(self.lines(frames).into_iter().flat_map(|l| l.points));
        points
    }
}

/// Adds frames, feet and solids to what is known of the bodies.
fn tips(model: &Model, number: &dyn Fn(Value) -> f64, known: &mut [Known]) {
    for frame in &model.frames {
        if let Some(b) = frame.body {
            known[b].frames.push(frame.placement.xyz.map(number));
        }
    }
    for shape in &model.shapes {
        let Some(b) = shape.mount.body else { continue };
        match shape.kind {
            ShapeKind::Point | ShapeKind::Sphere { .. } => known[b].tips.push(shape.mount.placement.xyz.map(number)),
            ShapeKind::Plane { .. } => {}
            _ => known[b].solid = true,
        }
        known[b].solid |= matches!(shape.kind, ShapeKind::Sphere { .. }) && known[b].joints.is_empty();
    }
}

/// Places of the ground on which something rolls.
fn floors(model: &Model, number: &dyn Fn(Value) -> f64) -> Vec<[f64; 3]> {
    let floors = model.constraints.iter().filter_map(|constraint| match &constraint.kind {
        ConstraintKind::Loop {
            kind: LoopKind::RollingDisc { .. } | LoopKind::RollingBall { .. } | LoopKind::RollingEllipsoid { .. },
            first,
            ..
        } if first.body.is_none() && first.placement.rotation == Rotation::NONE => {
            Some(first.placement.xyz.map(number))
        }
        _ => None,
    });
    floors.collect()
}

/// Whether the first freedom of a joint is a translation.
fn slides(joint: &multibody::codegen::model::Joint) -> bool {
    joint.kind.spec().freedoms.first().is_some_and(|freedom| freedom.unit == Unit::Metre)
}

/// Adds the places of the joints to what is known of the bodies.
fn joints(
    model: &Model,
    number: &dyn Fn(Value) -> f64,
    known: &mut [Known],
    parts: &mut [Part],
    supports: &mut Vec<[f64; 3]>,
) {
    for joint in &model.joints {
        let (spec, slides) = (joint.kind.spec(), slides(joint));
        // A body that moves in a plane or in space is tied to no point.
        if slides && spec.group.is_some() {
            known[joint.child].free = true;
            continue;
        }
        let at = joint.placement.xyz.map(number);
        let weld = spec.nv() == 0;
        match joint.parent {
            // Where a slide is zero, nothing need be.
            Some(_) if slides => {}
            Some(b) if weld => known[b].welds.push(at),
            Some(b) => known[b].joints.push(at),
            None => supports.push(at),
        }
        known[joint.child].joints.push([0.0; 3]);
        known[joint.child].welded = weld;
        if !weld && (joint.parent.is_none() || !slides) {
            parts[joint.child].marks.push(([0.0; 3], slides && joint.parent.is_none()));
        }
    }
}

/// A disc on a body: its index, centre, axis, radius.
type Disc = (usize, [f64; 3], [f64; 3], f64);

/// Adds the places of the loops to what is known of the bodies; returns the discs that roll.
fn loops(
    model: &Model,
    number: &dyn Fn(Value) -> f64,
    known: &mut [Known],
    parts: &mut [Part],
    (supports, rods): (&mut Vec<[f64; 3]>, &mut Vec<Rod>),
) -> Vec<Disc> {
    let mut discs: Vec<(&Mount, [f64; 3], f64)> = Vec::new();
    for constraint in &model.constraints {
        let ConstraintKind::Loop { kind, first, second } = &constraint.kind else { continue };
        let ends = [first, second].map(|m: &Mount| (m.body, m.placement.xyz.map(number)));
        match *kind {
            LoopKind::RollingDisc { axis, radius, .. } => discs.push((second, axis, number(radius))),
            LoopKind::RollingBall { radius, .. }
            | LoopKind::RollingBallOnBox { radius, .. }
            | LoopKind::RollingBallOnCylinder { radii: [_, radius], .. } => {
                discs.push((second, [0.0, 1.0, 0.0], number(radius)));
            }
            LoopKind::RollingEllipsoid { semi_axes, .. } => {
                // Loops are drawn by circles: one that contains the ellipsoid.
                let widest = semi_axes.map(number).into_iter().fold(0.0, f64::max);
                discs.push((second, [0.0, 1.0, 0.0], widest));
            }
            LoopKind::RollingBalls { radii } | LoopKind::RollingCapsules { radii, .. } => {
                discs.extend([first, second].into_iter().zip(radii).map(|(m, r)| (m, [0.0, 1.0, 0.0], number(r))));
            }
            LoopKind::KnifeEdge { .. } | LoopKind::Pfaffian { .. } => {}
            _ => {
                for (body, p) in ends {
                    body.map_or(&mut *supports, |b| &mut known[b].joints).push(p);
                }
                if let LoopKind::Distance { .. } = kind {
                    let ends = ends.map(|(b, p)| (b.and_then(|b| parts[b].frame), p));
                    rods.push(Rod { ends, colour: model.bodies.len(), pins: true });
                } else if let Some((b, p)) = ends[1].0.map(|b| (b, ends[1].1)) {
                    parts[b].marks.push((p, false));
                }
            }
        }
    }
    discs.into_iter().filter_map(|(m, axis, r)| Some((m.body?, m.placement.xyz.map(number), axis, r))).collect()
}

/// Gives every body an outline: the hull of its joints, as thick as its mass makes it, or an ellipsoid of its inertia where
/// joints hold it at one point only.
fn fleshed(model: &Model, number: &dyn Fn(Value) -> f64, known: &[Known], parts: &mut [Part]) {
    let own: Vec<Vec<[f64; 3]>> = known.iter().map(skeleton).collect();
    let sizes: Vec<f64> = own.iter().map(|points| extent(points)).collect();
    let whole = sizes.iter().copied().fold(0.0, f64::max);
    let parent = |b: usize| model.joints.iter().find(|j| j.child == b).and_then(|j| j.parent);
    for (b, body) in model.bodies.iter().enumerate() {
        let (mass, com) = (number(body.mass), body.com.map(number));
        let part = &mut parts[b];
        part.points.clone_from(&own[b]);
        if sizes[b] > 1e-6 * whole && sizes[b] > 0.0 {
            // What mass is in feet and solids is not in the limb; plates are thinner than bars.
            let slim = match (known[b].solid || !known[b].tips.is_empty(), own[b].len() > 2) {
                (false, false) => 1.0,
                _ => 0.4,
            };
            part.radius = slim * flesh::radius(mass, sizes[b]);
            // A free body with few joints is more than the line between them.
            if own[b].len() < 3 && known[b].free && !known[b].solid {
                part.points.extend(flesh::points(body, number, 0.75 * sizes[b]));
            }
            // Neither is the trunk of a tree. In loops, plates are what is between their joints.
            if own[b].len() > 2 && model.constraints.is_empty() && !known[b].solid {
                part.points.extend(flesh::points(body, number, 0.5 * sizes[b]));
            }
            continue;
        }
        if known[b].solid {
            continue;
        }
        // No larger than its neighbours let it be: about twice the way to its centre of mass, or a part of the body that holds it.
        let away = own[b].first().map_or(0.0, |p| extent(&[*p, com]));
        let beside = parent(b).map_or(0.0, |p| sizes[p]);
        let most = match own[b].is_empty() && !known[b].welded {
            true => f64::MAX.sqrt(),
            false => (1.05 * away).max(0.35 * beside).max(1e-3 * whole),
        };
        part.points.extend(flesh::points(body, number, most));
        let rod = part.points.len() < own[b].len() + 3;
        part.radius = if rod { flesh::radius(mass, extent(&part.points)) } else { 0.2 * flesh::radius(mass, away) };
    }
}

/// The points whose hull is a body.
fn skeleton(known: &Known) -> Vec<[f64; 3]> {
    let mut points: Vec<[f64; 3]> = Vec::new();
    let mut add = |list: &[[f64; 3]], most: usize| {
        for p in list {
            let new = points.iter().all(|q| extent(&[*p, *q]) > 1e-9);
            if new && points.len() < most {
                points.push(*p);
            }
        }
    };
    if !known.welded || known.joints.len() > 1 {
        add(&known.joints, usize::MAX);
    }
    add(&known.tips, usize::MAX);
    // Frames and what is welded to a body tell of shapes that have no corners of their own.
    if known.joints.len() < 3 {
        add(&known.frames, usize::MAX);
    }
    if !known.welded {
        add(&known.welds, 2);
    }
    points
}

fn line(part: &Part, frames: &[FrameState<f64>]) -> Line {
    let at = |p: &[f64; 3]| placed(frames, part.frame, *p);
    Line {
        points: part.points.iter().map(at).collect(),
        closed: part.closed,
        flat: BARS,
        marks: part.marks.iter().map(|(p, slides)| (at(p), *slides)).collect(),
        colour: part.colour,
        radius: part.radius,
    }
}

/// Outline of a disc about a point.
fn disc(centre: [f64; 3], axis: [f64; 3], radius: f64) -> Vec<[f64; 3]> {
    let norm = axis.iter().fold(0.0_f64, |n, x| n.hypot(*x));
    let n = axis.map(|x| x / norm);
    // The ground axis with the largest angle to the disc's axis.
    let k = (0..3).min_by(|a, b| n[*a].abs().total_cmp(&n[*b].abs())).unwrap_or_default();
    let mut a = n.map(|x| -x * n[k]);
    a[k] += 1.0;
    let norm = a.iter().fold(0.0_f64, |n, x| n.hypot(*x));
    let a = a.map(|x| x / norm);
    let b = [n[1] * a[2] - n[2] * a[1], n[2] * a[0] - n[0] * a[2], n[0] * a[1] - n[1] * a[0]];
    let corner = |i: usize| {
        let (s, c) = (std::f64::consts::TAU * i as f64 / CORNERS as f64).sin_cos();
        std::array::from_fn(|k| centre[k] + radius * (c * a[k] + s * b[k]))
    };
    (0..CORNERS).map(corner).collect()
}
