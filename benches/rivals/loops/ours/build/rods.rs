//! Replaces constraints of distance by rods as bodies, because Pinocchio's rigid constraints have no distances.

use mbd_codegen::model::{
    Body, Constraint, ConstraintKind, Joint, JointKind, LoopKind, Model, Mount, Placement, Rotation, Value,
};

/// Mass of a rod of the Delta robot, kg. Each end has half of it.
const ROD: f64 = 0.1;

fn number(x: Value) -> f64 {
    x.constant().expect("a constant")
}

/// The same mechanism with the same masses at the same positions. Every distance becomes a rod on a universal joint,
/// with a spherical loop at its other end. The halves of the rod's mass are subtracted from the bodies that had them.
pub fn with_rods(model: &Model) -> Model {
    let mut out = model.clone();
    out.constraints.clear();
    for constraint in &model.constraints {
        let ConstraintKind::Loop { kind: LoopKind::Distance { length }, first, second } = &constraint.kind else {
            out.constraints.push(constraint.clone());
            continue;
        };
        let (length, arm, rod) = (number(*length), first.body.expect("a body"), out.bodies.len());
        for mount in [first, second] {
            lighten(&mut out.bodies[mount.body.expect("a body")], mount.placement.xyz.map(number), 0.5 * ROD);
        }
        let across = Value::Const(ROD * length * length / 4.0);
        out.bodies.push(Body {
            name: constraint.name.clone(),
            mass: Value::Const(ROD),
            com: [Value::ZERO, Value::ZERO, Value::Const(-0.5 * length)],
            inertia: [across, across, Value::ZERO, Value::ZERO, Value::ZERO, Value::ZERO],
            inertia_axes: Rotation::NONE,
        });
        let at = out.joints.iter().position(|j| j.child == arm).expect("a joint") + 1;
        out.joints.insert(
            at,
            Joint::new(
                format!("{}_joint", constraint.name),
                JointKind::Universal { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] },
                Some(arm),
                rod,
                first.placement,
            ),
        );
        out.starts.iter_mut().filter(|s| s.joint >= at).for_each(|s| s.joint += 1);
        let end = Placement { xyz: [Value::ZERO, Value::ZERO, Value::Const(-length)], ..Placement::IDENTITY };
        let kind = ConstraintKind::Loop {
            kind: LoopKind::Spherical,
            first: Mount { body: Some(rod), placement: end },
            second: second.clone(),
        };
        out.constraints.push(Constraint { kind, ..constraint.clone() });
    }
    out
}

/// Moments and products `[xx, yy, zz, xy, xz, yz]` of a point about the origin.
fn point(m: f64, [x, y, z]: [f64; 3]) -> [f64; 6] {
    [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z].map(|e| m * e)
}

/// Subtracts a point mass from a body.
fn lighten(body: &mut Body, place: [f64; 3], m: f64) {
    assert_eq!(body.inertia_axes, Rotation::NONE, "{}", body.name);
    let (mass, com) = (number(body.mass), body.com.map(number));
    let left = mass - m;
    let new: [f64; 3] = std::array::from_fn(|k| (mass * com[k] - m * place[k]) / left);
    let (own, gone, rest) = (point(mass, com), point(m, place), point(left, new));
    body.inertia = std::array::from_fn(|k| Value::Const(number(body.inertia[k]) + own[k] - gone[k] - rest[k]));
    (body.mass, body.com) = (Value::Const(left), new.map(Value::Const));
}
