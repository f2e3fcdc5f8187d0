//! Placements of the model as elementary transforms, with exact right angles.

use mbd_runtime::spatial::{Axis, ElementaryTransform, Mat3, Vec3};

use super::rigid::Rigid;
use super::structure::PoseStep;
use crate::model::{Placement, Rotation, Value};
use crate::rounded_once::{norm, sin_cos};

/// Cosine and sine of an angle, exact at multiples of 90° that are closer than `snap`.
fn turn(angle: f64, snap: f64, notice: &mut dyn FnMut(f64)) -> (f64, f64) {
    let quarters = (angle / std::f64::consts::FRAC_PI_2).round();
    let off = (angle - quarters * std::f64::consts::FRAC_PI_2).abs();
    // A double next to π/2 is π/2: its cosine of 6e-17 is round-off whatever the caller wants.
    let round_off = 4.0 * f64::EPSILON * angle.abs();
    if off > snap.max(round_off) {
        let (s, c) = sin_cos(angle);
        return (c, s);
    }
    if off > round_off {
        notice(off);
    }
    [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][(quarters as i64).rem_euclid(4) as usize]
}

/// A unit vector; components below `snap` become zero.
pub fn direction(axis: [f64; 3], snap: f64, notice: &mut dyn FnMut(f64)) -> Vec3<f64> {
    let n = norm(axis);
    let unit = axis.map(|x| {
        let x = x / n;
        if x.abs() > snap.max(1e-15) {
            return x;
        }
        if x.abs() > 1e-15 {
            notice(x.abs());
        }
        0.0
    });
    let n = norm(unit);
    unit.map(|x| x / n)
}

/// Elementary transforms of an orientation.
pub fn rotation(r: &Rotation, snap: f64, notice: &mut dyn FnMut(f64)) -> Vec<PoseStep> {
    let mut about = |axis: Axis, angle: Value| match angle {
        Value::Const(x) => {
            let (c, s) = turn(x, snap, notice);
            PoseStep::Turn { axis, c, s }
        }
        angle => PoseStep::TurnBy { axis, angle },
    };
    match *r {
        Rotation::Rpy([roll, pitch, yaw]) => {
            let steps = [about(Axis::Z, yaw), about(Axis::Y, pitch), about(Axis::X, roll)];
            steps.into_iter().filter(|s| !matches!(s, PoseStep::Turn { c, s, .. } if [*c, *s] == [1.0, 0.0])).collect()
        }
        Rotation::AxisAngle { axis, angle } => {
            let spin = about(Axis::Z, angle);
            let align = Rigid::align_z(direction(axis, snap, notice));
            vec![PoseStep::Rotate(align.rot), spin, PoseStep::Rotate(align.inverse().rot)]
        }
    }
}

/// Elementary transforms of a placement: displacement, then orientation.
pub fn placement(p: &Placement, snap: f64, notice: &mut dyn FnMut(f64)) -> Vec<PoseStep> {
    let shifts = [Axis::X, Axis::Y, Axis::Z].into_iter().zip(p.xyz);
    let mut steps: Vec<PoseStep> =
        shifts.filter(|(_, r)| *r != Value::ZERO).map(|(axis, r)| PoseStep::Shift { axis, r }).collect();
    steps.extend(rotation(&p.rotation, snap, notice));
    steps
}

/// The pose of constant transforms; `None` if one contains a parameter.
pub fn constant(steps: &[PoseStep]) -> Option<Rigid> {
    let mut rot: Mat3<f64> = Rigid::IDENTITY.rot;
    let mut pos = [0.0; 3];
    for step in steps {
        let step = match *step {
            PoseStep::Turn { axis, c, s } => ElementaryTransform::Turn { axis, c, s },
            PoseStep::Shift { axis, r } => ElementaryTransform::Shift { axis, r: r.constant()? },
            PoseStep::Rotate(m) => ElementaryTransform::Rotate(m),
            PoseStep::TurnBy { .. } => return None,
        };
        step.pose(&mut rot, &mut pos);
    }
    Some(Rigid { rot, pos })
}
