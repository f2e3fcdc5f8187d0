//! Newton's and Euler's laws, body by body, computed from the motion of frames alone. They are a reference for the
//! sweeps.

use mbd_codegen::model::{JointKind, JointMotion, Model};
use mbd_codegen::plan::{Plan, Rigid};
use mbd_runtime::spatial::{add3, cross, Mat3, Vec3};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::tree::Source;
use mbd_runtime::Scalar;

use crate::random::rotation_matrix;
use crate::value;

fn apply<S: Scalar>(r: &Mat3<S>, x: Vec3<S>) -> Vec3<S> {
    r.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// Index of the frame of every body.
pub fn body_frames(plan: &Plan) -> Vec<usize> {
    let find = |name: &str| plan.frames.iter().position(|f| f.name == name).expect("every body is a frame");
    plan.model.bodies.iter().map(|b| find(&b.name)).collect()
}

/// Mass of a body, kg, and its centre of mass in ground axes, m.
pub fn mass_centre<S: Scalar>(model: &Model, params: &[f64], body: usize, at: &FrameState<S>) -> (S, Vec3<S>) {
    let b = &model.bodies[body];
    let com = b.com.map(|x| S::constant(value(x, params)));
    (S::constant(value(b.mass, params)), add3(at.position, apply(&at.rotation, com)))
}

/// Inertia about the centre of mass in body axes, kg m².
fn inertia(model: &Model, params: &[f64], body: usize) -> Mat3<f64> {
    let b = &model.bodies[body];
    let [xx, yy, zz, xy, xz, yz] = b.inertia.map(|x| value(x, params));
    let (i, r) = ([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], rotation_matrix(&b.inertia_axes, params));
    let entry = |a: usize, b: usize| {
        (0..3).flat_map(|k| (0..3).map(move |l| (k, l))).map(|(k, l)| r[a][k] * i[k][l] * r[b][l]).sum::<f64>()
    };
    std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b)))
}

/// Linear momentum of a body, and its angular momentum about the origin of the ground, in ground axes.
pub fn momentum<S: Scalar>(model: &Model, params: &[f64], body: usize, at: &FrameState<S>) -> [Vec3<S>; 2] {
    let (m, c) = mass_centre(model, params, body, at);
    let com = model.bodies[body].com.map(|x| S::constant(value(x, params)));
    let v = add3(at.velocity.lin, cross(at.velocity.ang, com));
    let p = apply(&at.rotation, v).map(|x| m * x);
    let i = inertia(model, params, body).map(|row| row.map(S::constant));
    let spin = apply(&at.rotation, apply(&i, at.velocity.ang));
    [p, add3(spin, cross(c, p))]
}

/// Twice the kinetic energy of a body (with `other = at`); bilinear in the velocities of `at` and `other`, two motions
/// of the same frame.
pub fn twice_kinetic(model: &Model, params: &[f64], body: usize, at: &FrameState<f64>, other: &FrameState<f64>) -> f64 {
    let [p, l] = momentum(model, params, body, at);
    let w = apply(&other.rotation, other.velocity.ang);
    let origin = apply(&other.rotation, other.velocity.lin);
    // The velocity of the point of the body that coincides with the origin of the ground.
    let v = add3(origin, cross(other.position, w));
    (0..3).map(|k| p[k] * v[k] + l[k] * w[k]).sum()
}

/// The joint at the end of a chain of mimic joints, with the total factor and offset.
pub fn leader(model: &Model, params: &[f64], joint: usize) -> (usize, f64, f64) {
    match model.joints[joint].motion {
        JointMotion::Mimic { leader: next, ratio, offset } => {
            let (end, r, o) = leader(model, params, next);
            let ratio = value(ratio, params);
            (end, ratio * r, ratio * o + value(offset, params))
        }
        _ => (joint, 1.0, 0.0),
    }
}

/// Source of the coordinates of a joint, through all mimic joints.
pub fn source(plan: &Plan, joint: usize) -> Option<Source> {
    let (end, _, _) = leader(&plan.model, &plan.default_params(), joint);
    plan.slots.iter().find(|s| s.joint == end).and_then(|s| s.at)
}

/// Rates (or accelerations) of every joint of the model, from those of the state and of the drives.
pub fn joint_rates(plan: &Plan, params: &[f64], state: &[f64], drives: &[f64]) -> Vec<Vec<f64>> {
    let rates = |j: usize| {
        let (_, ratio, _) = leader(&plan.model, params, j);
        let n = plan.model.joints[j].kind.nv();
        let list = match source(plan, j) {
            Some(Source::State { v, .. }) => &state[v..v + n],
            Some(Source::Drive { v, .. }) => &drives[v..v + n],
            None => &[],
        };
        list.iter().map(|x| ratio * x).collect()
    };
    (0..plan.model.joints.len()).map(rates).collect()
}

/// Coordinates of every joint of the model.
pub fn joint_coordinates(plan: &Plan, params: &[f64], state: &[f64], drives: &[f64]) -> Vec<Vec<f64>> {
    let coordinates = |j: usize| {
        let (_, ratio, offset) = leader(&plan.model, params, j);
        let n = plan.model.joints[j].kind.nq();
        let list = match source(plan, j) {
            Some(Source::State { q, .. }) => &state[q..q + n],
            Some(Source::Drive { q, .. }) => &drives[q..q + n],
            None => &[],
        };
        list.iter().map(|x| ratio * x + offset).collect()
    };
    (0..plan.model.joints.len()).map(coordinates).collect()
}

/// Motion `[linear; angular]` of the child frame for a unit velocity of each degree of freedom, in its own axes, at
/// joint coordinates `q`.
pub fn freedoms(kind: &JointKind, params: &[f64], q: &[f64]) -> Vec<[f64; 6]> {
    let unit = |a: Vec3<f64>| {
        let n = a.iter().map(|x| x * x).sum::<f64>().sqrt();
        a.map(|x| x / n)
    };
    let both = |l: Vec3<f64>, a: Vec3<f64>| [l[0], l[1], l[2], a[0], a[1], a[2]];
    let o = [0.0; 3];
    match *kind {
        JointKind::Revolute { axis } => vec![both(o, unit(axis))],
        JointKind::Prismatic { axis } => vec![both(unit(axis), o)],
        JointKind::Cylindrical { axis } => vec![both(unit(axis), o), both(o, unit(axis))],
        JointKind::Helical { axis, pitch } => {
            vec![both(unit(axis).map(|x| x * value(pitch, params)), unit(axis))]
        }
        JointKind::Universal { axes: [a, b] } => {
            let (a, b) = (unit(a), unit(b));
            // The first axis, in the axes that result from the second rotation (Rodrigues' formula).
            let (s, c) = (-q[1]).sin_cos();
            let along = (1.0 - c) * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
            let across = cross(b, a);
            let first = std::array::from_fn(|k| c * a[k] + s * across[k] + along * b[k]);
            vec![both(o, first), both(o, b)]
        }
        JointKind::Planar { normal } => {
            let n = unit(normal);
            let r = Rigid::align_z(n).rot;
            let column = |k: usize| [r[0][k], r[1][k], r[2][k]];
            vec![both(column(0), o), both(column(1), o), both(o, n)]
        }
        JointKind::Spherical => (3..6).map(|k| std::array::from_fn(|i| f64::from(u8::from(i == k)))).collect(),
        JointKind::Floating => (0..6).map(|k| std::array::from_fn(|i| f64::from(u8::from(i == k)))).collect(),
        JointKind::Fixed => Vec::new(),
    }
}

/// Bodies of the subtree of a joint.
pub fn subtree(model: &Model, joint: usize) -> Vec<usize> {
    let mut bodies = vec![model.joints[joint].child];
    // Joints are depth first: parents come before children.
    for j in &model.joints[joint + 1..] {
        if j.parent.is_some_and(|p| bodies.contains(&p)) {
            bodies.push(j.child);
        }
    }
    bodies
}
