//! The shape of a mechanism: lines between the points at which its bodies are connected.

use multibody::codegen::model::{ConstraintKind, LoopKind, Mount, ShapeKind, Unit, Value};
use multibody::codegen::plan::Plan;
use multibody::runtime::sweep::FrameState;

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
    /// Index of the colour.
    pub colour: usize,
    /// Width, pixels.
    pub width: f64,
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
    colour: usize,
}

/// A rod between two bodies.
struct Rod {
    ends: [(Option<usize>, [f64; 3]); 2],
    colour: usize,
}

/// The shape of a whole mechanism.
pub struct Shapes {
    ground: Part,
    parts: Vec<Part>,
    rods: Vec<Rod>,
}

/// A point given in a frame, in ground axes.
fn placed(frames: &[FrameState<f64>], frame: Option<usize>, p: [f64; 3]) -> [f64; 3] {
    let Some(f) = frame.map(|f| &frames[f]) else { return p };
    std::array::from_fn(|i| f.position[i] + (0..3).map(|k| f.rotation[i][k] * p[k]).sum::<f64>())
}

impl Shapes {
    /// The shape of a plan's model, at default parameters.
    pub fn new(plan: &Plan) -> Shapes {
        let params = plan.default_params();
        let number = |v: Value| match v {
            Value::Const(x) => x,
            Value::Param(k) => params[k],
        };
        let point = |xyz: &[Value; 3]| xyz.map(number);
        let model = &plan.model;
        let part = |body: Option<usize>| Part {
            frame: body.and_then(|b| plan.frames.iter().position(|f| f.name == model.bodies[b].name)),
            points: Vec::new(),
            marks: Vec::new(),
            closed: false,
            colour: body.unwrap_or_default(),
        };
        let mut parts: Vec<Part> = (0..model.bodies.len()).map(|b| part(Some(b))).collect();
        let mut ground = part(None);
        for joint in &model.joints {
            let spec = joint.kind.spec();
            let slides = spec.freedoms.first().is_some_and(|freedom| freedom.unit == Unit::Metre);
            // A body that moves in a plane or in space is tied to no point.
            if slides && spec.group.is_some() {
                continue;
            }
            let at = point(&joint.placement.xyz);
            match joint.parent {
                // Where a slide is zero, nothing need be.
                Some(_) if slides => {}
                Some(b) => parts[b].points.push(at),
                None => ground.points.push(at),
            }
            let child = &mut parts[joint.child];
            child.points.push([0.0; 3]);
            if spec.nv() > 0 && (joint.parent.is_none() || !slides) {
                child.marks.push(([0.0; 3], slides && joint.parent.is_none()));
            }
        }
        for frame in &model.frames {
            let xyz = point(&frame.placement.xyz);
            frame.body.map_or(&mut ground, |b| &mut parts[b]).points.push(xyz);
        }
        let (mut rods, mut discs) = (Vec::new(), Vec::new());
        for constraint in &model.constraints {
            let ConstraintKind::Loop { kind, first, second } = &constraint.kind else { continue };
            let ends = [first, second].map(|m: &Mount| (m.body, point(&m.placement.xyz)));
            match *kind {
                LoopKind::RollingDisc { axis, radius, .. } => discs.push((second, axis, number(radius))),
                LoopKind::RollingBall { radius, .. } => discs.push((second, [0.0, 1.0, 0.0], number(radius))),
                LoopKind::RollingEllipsoid { semi_axes, .. } => {
                    // Loops are drawn by circles: one that contains the ellipsoid.
                    let widest = semi_axes.map(number).into_iter().fold(0.0, f64::max);
                    discs.push((second, [0.0, 1.0, 0.0], widest));
                }
                LoopKind::RollingBalls { radii } | LoopKind::RollingCapsules { radii, .. } => {
                    discs.extend([first, second].into_iter().zip(radii).map(|(m, r)| (m, [0.0, 1.0, 0.0], number(r))));
                }
                LoopKind::RollingBallOnBox { radius, .. }
                | LoopKind::RollingBallOnCylinder { radii: [_, radius], .. } => {
                    discs.push((second, [0.0, 1.0, 0.0], number(radius)));
                }
                LoopKind::KnifeEdge { .. } | LoopKind::Pfaffian { .. } => {}
                LoopKind::Distance { .. } => {
                    let colour = model.bodies.len();
                    rods.push(Rod { ends: ends.map(|(b, p)| (b.and_then(|b| parts[b].frame), p)), colour });
                    for (body, p) in ends {
                        body.map_or(&mut ground, |b| &mut parts[b]).points.push(p);
                    }
                }
                _ => {
                    for (body, p) in ends {
                        body.map_or(&mut ground, |b| &mut parts[b]).points.push(p);
                    }
                    let (body, p) = ends[1];
                    body.map_or(&mut ground, |b| &mut parts[b]).marks.push((p, false));
                }
            }
        }
        // Feet and tips belong to the outline of their bodies, with the centre of mass where no joint holds one.
        let tips = model.shapes.iter().filter(|s| matches!(s.kind, ShapeKind::Point | ShapeKind::Sphere { .. }));
        for (b, tip) in tips.filter_map(|s| Some((s.mount.body?, point(&s.mount.placement.xyz)))) {
            if parts[b].points.is_empty() {
                parts[b].points.push(point(&model.bodies[b].com));
            }
            parts[b].points.push(tip);
        }
        for (body, part) in model.bodies.iter().zip(&mut parts) {
            let first = part.points.first().copied();
            // A body that is connected at one point only is drawn as a bar with its centre of mass in the middle.
            if part.points.iter().all(|p| Some(*p) == first) {
                let (end, com) = (first.unwrap_or_default(), point(&body.com));
                part.points.push(std::array::from_fn(|k| 2.0 * com[k] - end[k]));
            }
        }
        for (mount, axis, radius) in discs {
            let Some(b) = mount.body else { continue };
            let (frame, centre) = (parts[b].frame, point(&mount.placement.xyz));
            parts.push(Part { frame, points: disc(centre, axis, radius), marks: Vec::new(), closed: true, colour: b });
            // Spokes show the rotation.
            let rim = parts.last().map_or(Vec::new(), |d| vec![d.points[0], d.points[CORNERS / 2]]);
            parts.push(Part { frame, points: rim, marks: Vec::new(), closed: false, colour: b });
        }
        Shapes { ground, parts, rods }
    }

    /// The mechanism at given poses of its frames.
    pub fn lines(&self, frames: &[FrameState<f64>]) -> Vec<Line> {
        let rods = self.rods.iter().map(|rod| {
            let points: Vec<[f64; 3]> = rod.ends.iter().map(|(f, p)| placed(frames, *f, *p)).collect();
            let marks = points.iter().map(|p| (*p, false)).collect();
            Line { points, closed: false, flat: BARS, marks, colour: rod.colour, width: 1.6 }
        });
        self.parts.iter().map(|part| line(part, frames)).chain(rods).collect()
    }

    /// The parts that are fixed to the ground.
    pub fn ground(&self, frames: &[FrameState<f64>]) -> Line {
        Line { width: 1.5, ..line(&self.ground, frames) }
    }

    /// All points, from which the extent is computed.
    pub fn points(&self, frames: &[FrameState<f64>]) -> Vec<[f64; 3]> {
        let mut points = self.ground.points.clone();
        points.extend(self.lines(frames).into_iter().flat_map(|l| l.points));
        points
    }
}

fn line(part: &Part, frames: &[FrameState<f64>]) -> Line {
    let at = |p: &[f64; 3]| placed(frames, part.frame, *p);
    Line {
        points: part.points.iter().map(at).collect(),
        closed: part.closed,
        flat: BARS,
        marks: part.marks.iter().map(|(p, slides)| (at(p), *slides)).collect(),
        colour: part.colour,
        width: 3.0,
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
