//! Chains of revolute joints: general, planar, ill-conditioned.

use mbd_codegen::model::{JointKind, Model, Rotation, Value};

use crate::random::{random_model, Distribution, Rng};
use crate::value;

/// A chain of `n` revolute joints without special values: all numbers are random.
pub fn general(seed: u64, n: usize) -> Model {
    general_tapered(seed, n, 0.9)
}

/// The same chain with masses and lengths `taper` times those of the link before.
pub fn general_tapered(seed: u64, n: usize, taper: f64) -> Model {
    let distribution = Distribution { bodies: (n, n), taper, gravity: [0.0, 1.0, 0.0], ..Distribution::default() };
    let mut model = random_model(seed, &distribution);
    // The generator makes one placement in six an identity; a general chain must not have any.
    for (k, joint) in model.joints.iter_mut().enumerate() {
        if joint.placement.rotation == Rotation::NONE {
            joint.placement.rotation = Rotation::Rpy([0.3, 0.7, 1.1 + k as f64].map(Value::Const));
        }
    }
    model
}

/// The same chain in a plane: all axes are vertical, and placements are rotations about them.
pub fn planar(seed: u64, n: usize) -> Model {
    let mut model = general(seed, n);
    for joint in &mut model.joints {
        joint.kind = JointKind::Revolute { axis: [0.0, 0.0, 1.0] };
        joint.placement.rotation = Rotation::Rpy([Value::ZERO, Value::ZERO, Value::Const(0.4)]);
        joint.placement.xyz[2] = Value::ZERO;
    }
    model
}

/// Multiplies the mass and the inertia of body `k` of `n` by `factor(k / (n − 1))`.
pub fn weigh(mut model: Model, factor: impl Fn(f64) -> f64) -> Model {
    let last = (model.joints.len() - 1).max(1) as f64;
    for (k, joint) in model.joints.iter().enumerate() {
        let (body, factor) = (&mut model.bodies[joint.child], factor(k as f64 / last));
        for x in std::iter::once(&mut body.mass).chain(&mut body.inertia) {
            *x = Value::Const(factor * value(*x, &[]));
        }
    }
    model
}

/// A chain of thin rods of 1 m, connected end to end. The moment of inertia about a rod is `thin` times that across it,
/// and every second joint rotates about its rod.
pub fn rods(seed: u64, n: usize, thin: f64) -> Model {
    let mut model = general(seed, n);
    for k in 0..n {
        let joint = &mut model.joints[k];
        joint.kind = JointKind::Revolute { axis: if k % 2 == 0 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] } };
        joint.placement.xyz = [0.0, 0.0, if k == 0 { 0.0 } else { 1.0 }].map(Value::Const);
        let body = &mut model.bodies[joint.child];
        body.mass = Value::ONE;
        body.com = [0.0, 0.0, 0.5].map(Value::Const);
        body.inertia = [1.0 / 12.0, 1.0 / 12.0, thin / 12.0, 0.0, 0.0, 0.0].map(Value::Const);
        body.inertia_axes = Rotation::NONE;
    }
    model
}

/// Chains with ill-conditioned mass matrices, each with its name.
pub fn ill_conditioned() -> Vec<(String, Model)> {
    let mut all = Vec::new();
    for n in [6, 10] {
        let seed = n as u64;
        let tip = |factor: f64| move |k: f64| if k == 1.0 { factor } else { 1.0 };
        let power = |base: f64| move |k: f64| base.powf(k);
        let (chain, flat) = (|| general(seed, n), || planar(seed, n));
        let mut add = |name: &str, model: Model| all.push((format!("{n} revolute joints, {name}"), model));
        add("tip 10³ times as heavy", weigh(chain(), tip(1e3)));
        add("tip 10⁶ times as heavy", weigh(chain(), tip(1e6)));
        add("tip 10⁶ times as light", weigh(chain(), tip(1e-6)));
        add("1 to 10⁶ times as heavy outward", weigh(chain(), power(1e6)));
        add("1 to 10⁶ times as light outward", weigh(chain(), power(1e-6)));
        add("each link half as long and heavy", general_tapered(seed, n, 0.5));
        add("axes parallel to 10⁻³", nearly_parallel(seed, n, 1e-3));
        add("thin rods, 10⁻⁴", rods(seed, n, 1e-4));
        add("planar, tip 10⁶ times as heavy", weigh(flat(), tip(1e6)));
        add("planar, 1 to 10⁶ times as light outward", weigh(flat(), power(1e-6)));
    }
    all.push(("20 revolute joints, thin rods, 10⁻⁴".to_string(), rods(20, 20, 1e-4)));
    let heavy_tip = weigh(general(20, 20), |k| 1e3_f64.powf(k.floor()));
    all.push(("20 revolute joints, tip 10³ times as heavy".to_string(), heavy_tip));
    all
}

/// A chain whose axes are parallel except for angles of about `angle`, rad. Links extend along and across the axes.
pub fn nearly_parallel(seed: u64, n: usize, angle: f64) -> Model {
    let (mut model, mut rng) = (general(seed, n), Rng::new(seed, 7));
    for joint in &mut model.joints {
        joint.kind = JointKind::Revolute { axis: [rng.around(angle), rng.around(angle), 1.0] };
        joint.placement.rotation = Rotation::Rpy([rng.around(angle), rng.around(angle), 0.4].map(Value::Const));
    }
    model
}
