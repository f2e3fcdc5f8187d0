//! Random mechanisms for the tests of the project: generator, states, and a writer of the TOML format.

pub mod batch;
pub mod branches;
pub mod chains;
pub mod closed;
pub mod conformance;
pub mod eliminations;
mod errors;
pub mod fused;
pub mod instances;
pub mod kkt;
pub mod motions;
pub mod nearest;
pub mod newton;
pub mod random;
pub mod state;
pub mod toml;
mod touching;

pub use errors::{largest, largest_difference, relative_error};

use mbd_codegen::model::{ConstraintKind, Gravity, JointMotion, Model, Placement, Rotation, Value};

/// Value of a number of the model at given parameters.
pub fn value(v: Value, params: &[f64]) -> f64 {
    match v {
        Value::Const(x) => x,
        Value::Param(k) => params[k],
    }
}

/// Asserts that results of a model are finite and the same bit for bit, except for the signs of zeros.
///
/// # Panics
/// They are not; the message contains the model as TOML.
pub fn assert_same_bits(whose: &str, what: &str, model: &Model, emitted: &[f64], interpreted: &[f64]) {
    assert_eq!(emitted.len(), interpreted.len(), "{whose}: {what}");
    for (k, (a, b)) in emitted.iter().zip(interpreted).enumerate() {
        let same = (a + 0.0).to_bits() == (b + 0.0).to_bits() && a.is_finite();
        let text = || toml::to_toml(model);
        assert!(same, "{whose}: {what}[{k}]: emitted {a:e}, interpreted {b:e}\n{}", text());
    }
}

/// The model with its parameters replaced by constants.
pub fn substituted(model: &Model, params: &[f64]) -> Model {
    let of = |v: &mut Value| *v = Value::Const(value(*v, params));
    let rotation = |r: &mut Rotation| match r {
        Rotation::Rpy(rpy) => rpy.iter_mut().for_each(of),
        Rotation::AxisAngle { angle, .. } => of(angle),
    };
    let placement = |p: &mut Placement| {
        p.xyz.iter_mut().for_each(of);
        rotation(&mut p.rotation);
    };
    let mut model = model.clone();
    model.params.clear();
    if let Gravity::Constant(g) = &mut model.gravity {
        g.iter_mut().for_each(of);
    }
    for body in &mut model.bodies {
        of(&mut body.mass);
        body.com.iter_mut().chain(&mut body.inertia).for_each(of);
        rotation(&mut body.inertia_axes);
    }
    for joint in &mut model.joints {
        placement(&mut joint.placement);
        for list in [&mut joint.damping, &mut joint.stiffness, &mut joint.rest, &mut joint.armature] {
            list.iter_mut().for_each(of);
        }
        joint.kind.pitch_mut().into_iter().for_each(of);
        if let JointMotion::Mimic { ratio, offset, .. } = &mut joint.motion {
            of(ratio);
            of(offset);
        }
    }
    for frame in &mut model.frames {
        placement(&mut frame.placement);
    }
    for constraint in &mut model.constraints {
        of(&mut constraint.decay);
        match &mut constraint.kind {
            ConstraintKind::Coupling { terms, offset } => {
                terms.iter_mut().for_each(|(_, ratio)| of(ratio));
                of(offset);
            }
            ConstraintKind::Loop { kind, first, second } => {
                placement(&mut first.placement);
                placement(&mut second.placement);
                kind.numbers_mut().into_iter().for_each(of);
            }
        }
    }
    model
}
