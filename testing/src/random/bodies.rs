//! Masses and inertias, and the choice of massless bodies.

use mbd_codegen::model::{Body, Joint, JointKind, Rotation, Value};
use mbd_runtime::spatial::Mat3;

use super::builder::{Builder, Skeleton};
use super::joints::sine;

/// The inertia of a body: complete, without moments of inertia, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Mass and a positive definite inertia.
    Full,
    /// A mass without extension.
    Point,
    /// No mass.
    None,
}

/// Weights that keep the mass matrix regular, and the joints that need a rotor for it.
///
/// The mass matrix is regular if the kinetic energy is zero only at rest. It is zero only if every body of full weight
/// is at rest. A body of less weight has a parent of full weight (or the ground); if the parent is at rest, the body
/// moves by its own joint only. This joint cannot move either if it has a rotor on every degree of freedom, or if a
/// child of full weight is connected by a joint whose motion can never cancel its own.
pub fn weights(b: &mut Builder, s: &Skeleton, joints: &[Joint], params: &[f64]) -> (Vec<Weight>, Vec<bool>) {
    let n = joints.len();
    let mut weight = vec![Weight::Full; n];
    let mut rotor = vec![false; n];
    let mut keep = vec![false; n];
    for i in 0..n {
        let children: Vec<usize> = (0..n).filter(|&c| s.parent[c] == Some(i)).collect();
        let parent_is_full = s.parent[i].is_none_or(|p| weight[p] == Weight::Full);
        if children.is_empty() || keep[i] || !parent_is_full || !b.rng.chance(b.distribution.massless) {
            continue;
        }
        weight[i] = if b.rng.chance(0.7) { Weight::None } else { Weight::Point };
        if joints[i].kind == JointKind::Fixed {
            continue;
        }
        match children.iter().find(|&&c| independent(&joints[i].kind, &joints[c], params)) {
            Some(&c) if b.rng.chance(0.8) => keep[c] = true,
            _ => rotor[i] = true,
        }
    }
    (weight, rotor)
}

/// Whether the motion of a child's joint can never cancel that of a joint of `kind`.
fn independent(kind: &JointKind, child: &Joint, params: &[f64]) -> bool {
    let single = |k: &JointKind| match *k {
        JointKind::Revolute { axis } | JointKind::Helical { axis, .. } => Some((true, axis)),
        JointKind::Prismatic { axis } => Some((false, axis)),
        _ => None,
    };
    if child.kind == JointKind::Fixed {
        return true;
    }
    let (Some((turns, a)), Some((child_turns, b))) = (single(kind), single(&child.kind)) else { return false };
    // The comparison is made in the axes of the body between both joints, where both joint axes are constant.
    let r = matrix(&child.placement.rotation, params);
    let b: [f64; 3] = std::array::from_fn(|i| r[i][0] * b[0] + r[i][1] * b[1] + r[i][2] * b[2]);
    turns != child_turns || sine(a, b) > 0.5
}

/// Rotation matrix of an orientation, child components to parent components.
pub fn matrix(rotation: &Rotation, params: &[f64]) -> Mat3<f64> {
    let of = |v: Value| crate::value(v, params);
    let about = |axis: [f64; 3], angle: f64| -> Mat3<f64> {
        let n = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        let a = axis.map(|x| x / n);
        let (s, c) = angle.sin_cos();
        let skew = [[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]];
        std::array::from_fn(|i| {
            std::array::from_fn(|k| if i == k { c } else { 0.0 } + s * skew[i][k] + (1.0 - c) * a[i] * a[k])
        })
    };
    let times = |a: Mat3<f64>, b: Mat3<f64>| -> Mat3<f64> {
        std::array::from_fn(|i| std::array::from_fn(|k| (0..3).map(|j| a[i][j] * b[j][k]).sum()))
    };
    match *rotation {
        Rotation::Rpy([roll, pitch, yaw]) => {
            let zy = times(about([0.0, 0.0, 1.0], of(yaw)), about([0.0, 1.0, 0.0], of(pitch)));
            times(zy, about([1.0, 0.0, 0.0], of(roll)))
        }
        Rotation::AxisAngle { axis, angle } => about(axis, of(angle)),
    }
}

impl Builder<'_> {
    /// A body of about the given mass and length.
    pub fn body(&mut self, name: String, weight: Weight, mass: f64, length: f64) -> Body {
        let (zero, none) = ([Value::ZERO; 3], Rotation::NONE);
        if weight == Weight::None {
            return Body { name, mass: Value::ZERO, com: zero, inertia: [Value::ZERO; 6], inertia_axes: none };
        }
        let mass = mass * self.rng.range(0.5, 1.5);
        let com = self.vector(0.6 * length).map(|x| self.value_or_zero(x));
        if weight == Weight::Point {
            return Body { name, mass: self.value(mass), com, inertia: [Value::ZERO; 6], inertia_axes: none };
        }
        // The edges of this box differ by less than a factor of two, so that its inertia stays valid when parameters
        // vary.
        let mut edges: [f64; 3] = std::array::from_fn(|_| length * self.rng.range(0.6, 1.0));
        if self.rng.chance(0.3) {
            edges[1] = edges[0]; // symmetric about z
        }
        let [a, b, c] = edges.map(|x| x * x * mass / 12.0);
        let mut inertia = [b + c, a + c, a + b, 0.0, 0.0, 0.0];
        let general = self.rng.chance(self.distribution.products);
        if general && self.rng.chance(0.6) {
            let small = 0.12 * (a + b + c);
            for x in &mut inertia[3..] {
                *x = self.rng.around(small);
            }
        }
        let inertia_axes = if general && self.rng.chance(0.5) {
            Rotation::Rpy(std::array::from_fn(|_| {
                let x = self.rng.around(3.0);
                self.value(x)
            }))
        } else {
            none
        };
        Body { name, mass: self.value(mass), com, inertia: inertia.map(|x| self.value_or_zero(x)), inertia_axes }
    }
}
