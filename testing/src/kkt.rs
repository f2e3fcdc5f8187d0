//! Constraints in ground axes, computed from their definitions: residuals of the positions, and rates of every row as
//! functions of the poses and velocities of both frames. The only sweep in use is the one for the motion of frames of
//! the open tree.

use mbd_codegen::model::{ConstraintKind, LoopKind, Model, Mount};
use mbd_codegen::plan::Plan;
use mbd_runtime::spatial::{add3, cross, dot3, scale3, Mat3, Vec3};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::tree::Source;
use mbd_runtime::{Dual, Interpreter, Real, Scalar, System};

use crate::nearest::{on_box, on_cylinder, segments, Nearest};
use crate::newton::body_frames;
use crate::random::rotation_matrix;
use crate::state::State;
use crate::value;

/// Pose and velocity of a frame, in ground axes; the columns of `axes` are the directions of its axes.
#[derive(Clone, Copy, Debug)]
pub struct Pose<S> {
    /// Rotation matrix from the frame's components to ground components.
    pub axes: Mat3<S>,
    /// Origin, m.
    pub origin: Vec3<S>,
    /// Velocity of the origin, m/s.
    pub lin: Vec3<S>,
    /// Angular velocity, rad/s.
    pub ang: Vec3<S>,
}

fn less<S: Scalar>(a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A vector of unit length along `a`.
pub fn unit(a: Vec3<f64>) -> Vec3<f64> {
    let n = a.iter().map(|x| x * x).sum::<f64>().sqrt();
    a.map(|x| x / n)
}

/// Two directions that make a right-handed triple with `a`; the length of `a` does not matter.
pub fn across(a: Vec3<f64>) -> [Vec3<f64>; 2] {
    let a = unit(a);
    let least = (0..3).min_by(|&i, &k| a[i].abs().total_cmp(&a[k].abs())).unwrap_or(0);
    let mut other = [0.0; 3];
    other[least] = 1.0;
    let n = unit(cross(a, other));
    [n, cross(a, n)]
}

impl<S: Scalar> Pose<S> {
    /// The pose of the ground.
    pub fn ground() -> Pose<S> {
        Pose::of(&FrameState::ground())
    }

    /// The pose of a frame of the tree.
    pub fn of(at: &FrameState<S>) -> Pose<S> {
        let mut pose = Pose { axes: at.rotation, origin: at.position, lin: [S::zero(); 3], ang: [S::zero(); 3] };
        (pose.lin, pose.ang) = (pose.turn(at.velocity.lin), pose.turn(at.velocity.ang));
        pose
    }

    /// A vector given in the frame's axes, in ground axes.
    pub fn turn(&self, x: Vec3<S>) -> Vec3<S> {
        self.axes.map(|row| dot3(row, x))
    }

    /// A constant direction given in the frame's axes, in ground axes.
    pub fn direction(&self, x: Vec3<f64>) -> Vec3<S> {
        self.turn(x.map(S::constant))
    }

    /// The pose of a frame that is fixed to this one.
    pub fn carried(&self, rotation: &Mat3<f64>, xyz: Vec3<f64>) -> Pose<S> {
        let arm = self.direction(xyz);
        let column = |k: usize| self.direction([rotation[0][k], rotation[1][k], rotation[2][k]]);
        let columns = [column(0), column(1), column(2)];
        Pose {
            axes: std::array::from_fn(|i| std::array::from_fn(|k| columns[k][i])),
            origin: add3(self.origin, arm),
            lin: add3(self.lin, cross(self.ang, arm)),
            ang: self.ang,
        }
    }
}

/// The pose of the frame on which a constraint acts; `frames` are those of the plan.
pub fn mounted<S: Scalar>(plan: &Plan, params: &[f64], frames: &[FrameState<S>], mount: &Mount) -> Pose<S> {
    let body = mount.body.map_or(Pose::ground(), |b| Pose::of(&frames[body_frames(plan)[b]]));
    let rotation = rotation_matrix(&mount.placement.rotation, params);
    body.carried(&rotation, mount.placement.xyz.map(|x| value(x, params)))
}

/// Residuals, which are zero at closed positions. Their number depends on the kind of loop only and may differ from the
/// number of rows in [`rates`].
pub fn residuals<S: Real>(kind: &LoopKind, params: &[f64], a: &Pose<S>, b: &Pose<S>) -> Vec<S> {
    let d = less(b.origin, a.origin);
    let num = |x: mbd_codegen::model::Value| S::constant(value(x, params));
    let along = |n: Vec3<f64>| dot3(a.direction(n), d);
    let across_offset = |n: Vec3<f64>| across(n).map(along).to_vec();
    let parallel = |n: Vec3<f64>| across(n).map(|m| dot3(a.direction(m), b.direction(unit(n)))).to_vec();
    let length = |x: Vec3<S>| dot3(x, x).sqrt();
    match *kind {
        LoopKind::Revolute { axis } => [d.to_vec(), parallel(axis)].concat(),
        LoopKind::Prismatic { axis } => [across_offset(axis), turned(a, b)].concat(),
        LoopKind::Cylindrical { axis } => [across_offset(axis), parallel(axis)].concat(),
        LoopKind::Helical { axis, pitch } => {
            // The residual is the sine of the difference of two angles: the angle of rotation, from two directions
            // across the axis, and the angle that belongs to the displacement.
            let (slide, pitch) = (along(unit(axis)), num(pitch));
            let [n, m] = across(axis);
            let (c, s) = (dot3(a.direction(n), b.direction(n)), dot3(a.direction(m), b.direction(n)));
            let (sin, cos) = (slide / pitch).sin_cos();
            let screw = vec![pitch * (c * sin - s * cos)];
            [across_offset(axis), parallel(axis), screw].concat()
        }
        LoopKind::Universal { axes: [p, q] } => {
            [d.to_vec(), vec![dot3(a.direction(unit(p)), b.direction(unit(q)))]].concat()
        }
        LoopKind::Planar { normal } => [vec![along(unit(normal))], parallel(normal)].concat(),
        LoopKind::Spherical => d.to_vec(),
        LoopKind::Fixed => [d.to_vec(), turned(a, b)].concat(),
        LoopKind::Distance { length: l } => vec![length(d) - num(l)],
        LoopKind::PointOnLine { axis } => across_offset(axis),
        LoopKind::PointOnPlane { normal } => vec![along(unit(normal))],
        LoopKind::PointOnCylinder { axis, radius } => {
            let off = less(d, scale3(along(unit(axis)), a.direction(unit(axis))));
            vec![length(off) - num(radius)]
        }
        LoopKind::RollingDisc { normal, axis, radius } => {
            let tilt = dot3(a.direction(unit(normal)), b.direction(unit(axis)));
            vec![along(unit(normal)) - num(radius) * (S::one() - tilt * tilt).sqrt()]
        }
        LoopKind::RollingBall { normal, radius } => vec![along(unit(normal)) - num(radius)],
        LoopKind::RollingEllipsoid { normal, semi_axes } => {
            let height = length(lowest(b, a.direction(unit(normal)), semi_axes.map(num)).1);
            vec![along(unit(normal)) - height]
        }
        LoopKind::RollingBalls { radii: [p, q] } => vec![length(d) - num(p) - num(q)],
        LoopKind::RollingCapsules { .. }
        | LoopKind::RollingBallOnBox { .. }
        | LoopKind::RollingBallOnCylinder { .. } => touching(kind, params, a, b)
            .map(|(nearest, [p, q])| length(nearest.apart) - S::constant(p) - S::constant(q))
            .into_iter()
            .collect(),
        LoopKind::RollingBallOnField { .. }
        | LoopKind::RollingBallOnHull { .. }
        | LoopKind::RollingCapsuleOnCylinder { .. } => {
            unreachable!("tests of height fields and hulls have references of their own")
        }
        LoopKind::KnifeEdge { .. } | LoopKind::Pfaffian { .. } => Vec::new(),
    }
}

/// Three numbers that are zero where both frames have the same axes.
fn turned<S: Scalar>(a: &Pose<S>, b: &Pose<S>) -> Vec<S> {
    let e = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k)));
    (0..3).map(|k| dot3(a.direction(e((k + 1) % 3)), b.direction(e(k)))).collect()
}

/// Rates of all rows at closed positions: first the rates of [`residuals`], in their order, then the rows that
/// constrain velocities only.
pub fn rates<S: Real>(kind: &LoopKind, params: &[f64], a: &Pose<S>, b: &Pose<S>) -> Vec<S> {
    let d = less(b.origin, a.origin);
    let num = |x: mbd_codegen::model::Value| S::constant(value(x, params));
    // Velocity of the second origin and angular velocity of the second frame relative to the first, in ground axes.
    let v = less(less(b.lin, a.lin), cross(a.ang, d));
    let w = less(b.ang, a.ang);
    let along = |n: Vec3<f64>| dot3(a.direction(n), v);
    let across_rate = |n: Vec3<f64>| across(n).map(along).to_vec();
    // The rate d/dt (m · c), where m is fixed to the first frame and c to the second.
    let between = |m: Vec3<S>, c: Vec3<S>| dot3(w, cross(c, m));
    let parallel = |n: Vec3<f64>| across(n).map(|m| between(a.direction(m), b.direction(unit(n)))).to_vec();
    let e = |k: usize| std::array::from_fn::<f64, 3, _>(|i| f64::from(u8::from(i == k)));
    let turning = || (0..3).map(|k| between(a.direction(e((k + 1) % 3)), b.direction(e(k)))).collect::<Vec<S>>();
    match *kind {
        LoopKind::Revolute { axis } => [v.to_vec(), parallel(axis)].concat(),
        LoopKind::Prismatic { axis } => [across_rate(axis), turning()].concat(),
        LoopKind::Cylindrical { axis } => [across_rate(axis), parallel(axis)].concat(),
        LoopKind::Helical { axis, pitch } => {
            let screw = along(unit(axis)) - num(pitch) * dot3(a.direction(unit(axis)), w);
            [across_rate(axis), parallel(axis), vec![screw]].concat()
        }
        LoopKind::Universal { axes: [p, q] } => {
            [v.to_vec(), vec![between(a.direction(unit(p)), b.direction(unit(q)))]].concat()
        }
        LoopKind::Planar { normal } => [vec![along(unit(normal))], parallel(normal)].concat(),
        LoopKind::Spherical => v.to_vec(),
        LoopKind::Fixed => [v.to_vec(), turning()].concat(),
        LoopKind::Distance { .. } => vec![dot3(d, v) / dot3(d, d).sqrt()],
        LoopKind::PointOnLine { axis } => across_rate(axis),
        LoopKind::PointOnPlane { normal } => vec![along(unit(normal))],
        LoopKind::PointOnCylinder { axis, .. } => {
            let axis = a.direction(unit(axis));
            let off = less(d, scale3(dot3(axis, d), axis));
            vec![dot3(off, v) / dot3(off, off).sqrt()]
        }
        LoopKind::RollingDisc { normal, axis, radius } => {
            let (n, c) = (a.direction(unit(normal)), b.direction(unit(axis)));
            let lean = less(n, scale3(dot3(n, c), c));
            let arm = scale3(-num(radius) / dot3(lean, lean).sqrt(), lean);
            contact(a, normal, add3(v, cross(w, arm)))
        }
        LoopKind::RollingBall { normal, radius } => {
            let arm = scale3(-num(radius), a.direction(unit(normal)));
            contact(a, normal, add3(v, cross(w, arm)))
        }
        LoopKind::RollingEllipsoid { normal, semi_axes } => {
            let (arm, _) = lowest(b, a.direction(unit(normal)), semi_axes.map(num));
            contact(a, normal, add3(v, cross(w, arm)))
        }
        LoopKind::RollingBalls { radii: [p, q] } => {
            // The contact point divides the line between the middles as the radii do.
            let share = num(q) / (num(p) + num(q));
            meeting(d, add3(v, cross(w, scale3(-share, d))))
        }
        LoopKind::RollingCapsules { .. }
        | LoopKind::RollingBallOnBox { .. }
        | LoopKind::RollingBallOnCylinder { .. } => touching(kind, params, a, b)
            .map(|(Nearest { apart, arm }, [_, radius])| {
                let back = scale3(-S::constant(radius) / dot3(apart, apart).sqrt(), apart);
                meeting(apart, add3(v, cross(w, add3(arm, back))))
            })
            .unwrap_or_default(),
        LoopKind::RollingBallOnField { .. }
        | LoopKind::RollingBallOnHull { .. }
        | LoopKind::RollingCapsuleOnCylinder { .. } => {
            unreachable!("tests of height fields and hulls have references of their own")
        }
        LoopKind::KnifeEdge { axis } => vec![dot3(b.direction(unit(axis)), v)],
        LoopKind::Pfaffian { row } => {
            let [x, y, z, p, q, r] = row.map(num);
            vec![dot3(b.turn([x, y, z]), v) + dot3(b.turn([p, q, r]), w)]
        }
    }
}

/// The point of an ellipsoid about the origin of `b` that is lowest along `n`, from that origin, and a vector as long as the
/// ellipsoid reaches along `n`. The ellipsoid is the unit ball, stretched along its axes; that vector, scaled to unit
/// length, is the point of the ball, in the axes of the ellipsoid, that becomes the highest one.
fn lowest<S: Real>(b: &Pose<S>, n: Vec3<S>, semi_axes: [S; 3]) -> (Vec3<S>, Vec3<S>) {
    let axis = |k: usize| b.direction(std::array::from_fn(|i| f64::from(u8::from(i == k))));
    let on_ball: Vec3<S> = std::array::from_fn(|k| semi_axes[k] * dot3(n, axis(k)));
    let extent = dot3(on_ball, on_ball).sqrt();
    let stretched = (0..3).map(|k| scale3(-(semi_axes[k] * on_ball[k]) / extent, axis(k)));
    (stretched.fold([S::zero(); 3], add3), on_ball)
}

/// The nearest points of the parts of two bodies that balls of some radii pass along, m; `None` for other kinds.
fn touching<S: Real>(kind: &LoopKind, params: &[f64], a: &Pose<S>, b: &Pose<S>) -> Option<(Nearest<S>, [f64; 2])> {
    let d = less(b.origin, a.origin);
    let num = |x: mbd_codegen::model::Value| value(x, params);
    let half = |x: mbd_codegen::model::Value| S::constant(0.5 * num(x));
    match *kind {
        LoopKind::RollingCapsules { axes: [p, q], lengths, radii } => {
            let axes = [a.direction(unit(p)), b.direction(unit(q))];
            Some((segments(axes, lengths.map(half), d), radii.map(num)))
        }
        LoopKind::RollingBallOnBox { size, rounding, radius } => {
            let e = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k)));
            let axes = [0, 1, 2].map(|k| a.direction(e(k)));
            Some((on_box(axes, size.map(half), d), [rounding, num(radius)]))
        }
        LoopKind::RollingBallOnCylinder { axis, length, radii: [p, q] } => {
            let nearest = on_cylinder(a.direction(unit(axis)), half(length), S::constant(num(p)), d);
            Some((nearest, [0.0, num(q)]))
        }
        _ => None,
    }
}

/// Velocity of a contact point along a normal of any length, and that across it as three dependent rows.
fn meeting<S: Scalar>(normal: Vec3<S>, v: Vec3<S>) -> Vec<S> {
    let n = scale3(S::one() / dot3(normal, normal).sqrt(), normal);
    let [x, y, z] = cross(n, v);
    vec![dot3(n, v), x, y, z]
}

/// Velocity of a contact point along the normal and in two directions across it.
fn contact<S: Scalar>(a: &Pose<S>, normal: Vec3<f64>, v: Vec3<S>) -> Vec<S> {
    let [n, m] = across(normal);
    [unit(normal), n, m].map(|n| dot3(a.direction(n), v)).to_vec()
}

/// Constraints of a model at a state, computed from the motion of the open tree.
#[derive(Clone, Debug)]
pub struct Rows<'a> {
    /// Plan of the tree without constraints.
    pub plan: &'a Plan,
    /// The constraints.
    pub model: &'a Model,
    /// State and inputs.
    pub state: &'a State,
}

impl Rows<'_> {
    /// Both frames of every loop at given velocities.
    fn poses<S: Scalar>(&self, i: &mut Interpreter<S>, q: &[S], v: &[S]) -> Vec<Option<[Pose<S>; 2]>> {
        let mut frames = vec![FrameState::ground(); self.plan.frames.len()];
        i.frames(q, v, &mut frames);
        let one = |mount: &Mount| mounted(self.plan, &self.state.params, &frames, mount);
        let both = |kind: &ConstraintKind| match kind {
            ConstraintKind::Loop { first, second, .. } => Some([one(first), one(second)]),
            ConstraintKind::Coupling { .. } => None,
        };
        self.model.constraints.iter().map(|c| both(&c.kind)).collect()
    }

    /// Sum of a coupling over the coordinates (`of_velocity` false) or the velocities of its joints.
    fn coupled<S: Scalar>(&self, terms: &[(usize, mbd_codegen::model::Value)], list: &[S], of_velocity: bool) -> S {
        let at = |joint: usize| match self.plan.slots.iter().find(|s| s.joint == joint).and_then(|s| s.at) {
            Some(Source::State { q, v }) => list[if of_velocity { v } else { q }],
            other => panic!("joint {joint} of a coupling is not free: {other:?}"),
        };
        let parts = terms.iter().map(|(j, ratio)| S::constant(value(*ratio, &self.state.params)) * at(*j));
        parts.fold(S::zero(), |sum, x| sum + x)
    }

    /// Residuals of all constraints, one list for each.
    pub fn residuals<S: Real>(&self, i: &mut Interpreter<S>, q: &[S]) -> Vec<Vec<S>> {
        let still = vec![S::zero(); self.plan.dims.nv];
        let poses = self.poses(i, q, &still);
        let params = &self.state.params;
        let one = |(c, poses): (&mbd_codegen::model::Constraint, Option<[Pose<S>; 2]>)| match (&c.kind, poses) {
            (ConstraintKind::Loop { kind, .. }, Some([a, b])) => residuals(kind, params, &a, &b),
            (ConstraintKind::Coupling { terms, offset }, _) => {
                vec![self.coupled(terms, q, false) - S::constant(value(*offset, params))]
            }
            _ => Vec::new(),
        };
        self.model.constraints.iter().zip(poses).map(one).collect()
    }

    /// Rates of all rows at the velocities `v` of the state and at the velocities of the drives, which `i` contains.
    pub fn rates<S: Real>(&self, i: &mut Interpreter<S>, q: &[S], v: &[S]) -> Vec<Vec<S>> {
        let poses = self.poses(i, q, v);
        let params = &self.state.params;
        let one = |(c, poses): (&mbd_codegen::model::Constraint, Option<[Pose<S>; 2]>)| match (&c.kind, poses) {
            (ConstraintKind::Loop { kind, .. }, Some([a, b])) => rates(kind, params, &a, &b),
            (ConstraintKind::Coupling { terms, .. }, _) => vec![self.coupled(terms, v, true)],
            _ => Vec::new(),
        };
        self.model.constraints.iter().zip(poses).map(one).collect()
    }

    /// `Φ`, row by row, and `b` of `Φ v = b`.
    pub fn jacobian(&self) -> (Vec<Vec<f64>>, Vec<f64>) {
        let mut i = self.state.interpreter(self.plan);
        let q = &self.state.q;
        let nv = self.plan.dims.nv;
        let driven: Vec<f64> = self.rates(&mut i, q, &vec![0.0; nv]).concat().iter().map(|x| -x).collect();
        i.drive_v.fill(0.0);
        let mut phi = vec![vec![0.0; nv]; driven.len()];
        for k in 0..nv {
            for (row, x) in phi.iter_mut().zip(self.rates(&mut i, q, &unit_of(nv, k)).concat()) {
                row[k] = x;
            }
        }
        (phi, driven)
    }

    /// `Φ̇` along the motion with velocities `v`, row by row, and `γ` of `Φ v̇ + γ = 0`.
    pub fn jacobian_rates(&self, v: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let nv = self.plan.dims.nv;
        let (mut i, q) = self.moving(v);
        let constant = |v: &[f64]| v.iter().map(|x| Dual::new(*x, 0.0)).collect::<Vec<_>>();
        let gamma: Vec<f64> = self.rates(&mut i, &q, &constant(v)).concat().iter().map(|x| x.du).collect();
        i.drive_v.fill(Dual::new(0.0, 0.0));
        let mut rows = vec![vec![0.0; nv]; gamma.len()];
        for k in 0..nv {
            let column = self.rates(&mut i, &q, &constant(&unit_of(nv, k))).concat();
            rows.iter_mut().zip(column).for_each(|(row, x)| row[k] = x.du);
        }
        (rows, gamma)
    }

    /// The open tree moving with velocities `v`, as dual numbers: inputs and coordinates, each with its rate.
    pub fn moving(&self, v: &[f64]) -> (Interpreter<Dual<f64>>, Vec<Dual<f64>>) {
        let q = &self.state.q;
        let mut qd = vec![0.0; q.len()];
        self.state.interpreter(self.plan).coordinate_rates(q, &v.to_vec(), &mut qd);
        let moving = q.iter().zip(&qd).map(|(x, dx)| Dual::new(*x, *dx)).collect();
        (self.state.interpreter_of(self.plan, Dual::new), moving)
    }
}

/// A unit vector of length `n`: one at `k`, zero elsewhere.
pub fn unit_of(n: usize, k: usize) -> Vec<f64> {
    (0..n).map(|j| f64::from(u8::from(j == k))).collect()
}

/// Rank of a matrix by elimination, with the largest remaining row as pivot. Rows are scaled to unit length first, so
/// that a remainder of the size of round-off counts as zero.
pub fn rank(rows: &[Vec<f64>], tolerance: f64) -> usize {
    let norm = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>().sqrt();
    let scaled = |r: &Vec<f64>| {
        let n = norm(r);
        r.iter().map(|x| if n > 1e-12 { x / n } else { 0.0 }).collect::<Vec<f64>>()
    };
    let mut rest: Vec<Vec<f64>> = rows.iter().map(scaled).collect();
    let mut rank = 0;
    while let Some(k) = (0..rest.len()).max_by(|&i, &k| norm(&rest[i]).total_cmp(&norm(&rest[k]))) {
        let size = norm(&rest[k]);
        if size < tolerance {
            break;
        }
        let pivot: Vec<f64> = rest.swap_remove(k).iter().map(|x| x / size).collect();
        for row in &mut rest {
            let along: f64 = row.iter().zip(&pivot).map(|(x, y)| x * y).sum();
            row.iter_mut().zip(&pivot).for_each(|(x, y)| *x -= along * y);
        }
        rank += 1;
    }
    rank
}
