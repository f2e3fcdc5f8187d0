//! Description of a mechanism for Pinocchio as plain numbers, which `race.cpp` reads.

use std::fmt::Write as _;

use mbd_codegen::model::{
    Body, ConstraintKind, Gravity, JointKind, LoopKind, Model, Mount, Placement, Rotation, Value,
};

fn number(x: Value) -> f64 {
    x.constant().expect("a constant")
}

fn product(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Rotation matrix, by rows.
fn rotation(r: &Rotation) -> [[f64; 3]; 3] {
    let Rotation::Rpy(angles) = r else { panic!("a rotation about an axis") };
    let [(sr, cr), (sp, cp), (sy, cy)] = angles.map(|a| number(a).sin_cos());
    let z = [[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]];
    let y = [[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]];
    let x = [[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]];
    product(z, product(y, x))
}

fn numbers(out: &mut String, x: impl IntoIterator<Item = f64>) {
    x.into_iter().for_each(|x| {
        let _ = write!(out, " {x:?}");
    });
}

/// Writes the rotation matrix by rows, then the position.
fn placement(out: &mut String, p: &Placement) {
    numbers(out, rotation(&p.rotation).into_iter().flatten());
    numbers(out, p.xyz.map(number));
}

/// Pinocchio's index of the joint of a body; 0 for the ground.
fn joint_of(model: &Model, body: Option<usize>) -> usize {
    body.map_or(0, |b| 1 + model.joints.iter().position(|j| j.child == b).expect("a joint"))
}

/// Name and axes of Pinocchio's cheapest joint of a kind.
fn joint(kind: &JointKind) -> (String, [f64; 6]) {
    let one = |letter: char, axis: [f64; 3]| {
        let [x, y, z] = axis;
        let aligned = (0..3).find(|&k| axis[k] == 1.0);
        (format!("{letter}{}", aligned.map_or('U', |k| ['X', 'Y', 'Z'][k])), [x, y, z, 0.0, 0.0, 0.0])
    };
    match *kind {
        JointKind::Revolute { axis } => one('R', axis),
        JointKind::Prismatic { axis } => one('P', axis),
        JointKind::Universal { axes: [[a, b, c], [d, e, f]] } => ("UN".to_string(), [a, b, c, d, e, f]),
        JointKind::Floating => ("FF".to_string(), [0.0; 6]),
        _ => panic!("a joint that no mechanism here has"),
    }
}

fn inertia(out: &mut String, body: &Body) {
    assert_eq!(body.inertia_axes, Rotation::NONE, "{}", body.name);
    let [xx, yy, zz, xy, xz, yz] = body.inertia.map(number);
    numbers(out, [number(body.mass)]);
    numbers(out, body.com.map(number));
    numbers(out, [xx, xy, xz, xy, yy, yz, xz, yz, zz]);
}

/// The description. The first line has name, numbers of joints and of loops, and gravity. Then there is a line for each
/// joint (kind, parent, placement, axes, mass, centre of mass, inertia, armature) and one for each loop (joint and
/// placement of both ends). All loops are spherical joints, which in planar mechanisms replace revolute ones.
pub fn text(name: &str, model: &Model) -> String {
    let Gravity::Constant(gravity) = model.gravity else { panic!("{name}: gravity is constant") };
    let mut out = format!("{name} {} {}", model.joints.len(), model.constraints.len());
    numbers(&mut out, gravity.map(number));
    for j in &model.joints {
        let (kind, axes) = joint(&j.kind);
        let _ = write!(out, "\n{kind} {}", joint_of(model, j.parent));
        placement(&mut out, &j.placement);
        numbers(&mut out, axes);
        inertia(&mut out, &model.bodies[j.child]);
        numbers(&mut out, [j.armature.first().map_or(0.0, |a| number(*a))]);
    }
    for constraint in &model.constraints {
        let ConstraintKind::Loop { kind, first, second } = &constraint.kind else { panic!("{name}: loops only") };
        assert!(matches!(kind, LoopKind::Revolute { .. } | LoopKind::Spherical), "{name}: {}", kind.word());
        // Pinocchio's constraint must begin with the end on a body.
        let mut ends: Vec<&Mount> = vec![first, second];
        ends.sort_by_key(|m| m.body.is_none());
        out.push('\n');
        for mount in ends {
            let _ = write!(out, " {}", joint_of(model, mount.body));
            placement(&mut out, &mount.placement);
        }
    }
    out.push('\n');
    out
}
