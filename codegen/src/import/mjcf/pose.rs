//! Poses and orientations in MuJoCo's ways of writing them.

use super::element::{choice_error, numbers, vec3, Element};
use super::settings::Compiler;
use crate::import::raw::{RawNumber, RawPlacement, RawRotation};
use crate::import::source::{Span, Spanned};
use crate::import::words::quote;
use crate::import::xml::{place, Reader};
use crate::inertia::{cross, dot};
use crate::rounded_once::{atan2, norm, sin_cos};

/// A unit quaternion, real part first, as MuJoCo writes it.
pub(super) type Quat = [f64; 4];

/// No rotation.
pub(super) const NONE: Quat = [1.0, 0.0, 0.0, 0.0];

/// Rotations by less than this angle are what composition leaves of none, rad.
const NOTHING: f64 = 1e-15;

/// Lengths below this one have no direction in MuJoCo.
const SHORT: f64 = 1e-14;

/// Pose of a frame in another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    /// Origin, m.
    pub xyz: [f64; 3],
    /// Orientation.
    pub quat: Quat,
}

impl Pose {
    /// The identity.
    pub const IDENTITY: Pose = Pose { xyz: [0.0; 3], quat: NONE };

    /// A displacement.
    pub fn translation(xyz: [f64; 3]) -> Pose {
        Pose { xyz, quat: NONE }
    }

    /// The pose `inner`, given in this frame, in the frame that this pose is given in.
    pub fn then(&self, inner: &Pose) -> Pose {
        Pose { xyz: self.point(inner.xyz), quat: multiply(self.quat, inner.quat) }
    }

    /// A point of this frame in the outer one, m.
    pub fn point(&self, at: [f64; 3]) -> [f64; 3] {
        let turned = rotate(self.quat, at);
        [0, 1, 2].map(|k| self.xyz[k] + turned[k])
    }

    /// The outer frame in this one.
    pub fn inverse(&self) -> Pose {
        let quat = conjugate(self.quat);
        Pose { xyz: rotate(quat, self.xyz.map(|x| -x)), quat }
    }

    /// As a raw model states it, with parts that are zero left out.
    pub fn raw(&self, span: Span) -> RawPlacement {
        let xyz = (self.xyz != [0.0; 3]).then(|| raw_vec(self.xyz, span));
        RawPlacement { xyz, rotation: rotation(self.quat, span) }
    }
}

/// Three constants of one place.
pub(super) fn raw_vec(x: [f64; 3], span: Span) -> Spanned<[RawNumber; 3]> {
    Spanned::new(x.map(|x| RawNumber::constant(x, span)), span)
}

/// A rotation by axis and angle; `None` where there is none.
pub(super) fn rotation(quat: Quat, span: Span) -> Option<RawRotation> {
    // Of the two quaternions of a rotation, that of the smaller angle.
    let [w, x, y, z] = if quat[0] < 0.0 { quat.map(|x| -x) } else { quat };
    let sine = norm([x, y, z]);
    if sine < NOTHING {
        return None;
    }
    let axis = Some(Spanned::new([x, y, z].map(|a| a / sine), span));
    Some(RawRotation::AxisAngle { axis, angle: RawNumber::constant(2.0 * atan2(sine, w), span) })
}

/// A rotation by roll, pitch and yaw, for axes that the TOML format states so; `None` where there is none.
pub(super) fn roll_pitch_yaw(quat: Quat, span: Span) -> Option<RawRotation> {
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| rotate(quat, e));
    let across = norm([y[2], z[2]]);
    // Where x stands upright, roll and yaw turn about the same axis, and one of them is enough.
    let roll = if across < NOTHING { 0.0 } else { atan2(y[2], z[2]) };
    let (s, c) = sin_cos(roll);
    // Yaw as it follows from that roll, whatever its error.
    let yaw = atan2(s * z[0] - c * y[0], c * y[1] - s * z[1]);
    let rpy = [roll, atan2(-x[2], across), yaw];
    rpy.iter().any(|angle| angle.abs() > NOTHING).then(|| RawRotation::Rpy(raw_vec(rpy, span)))
}

/// The quaternion of a rotation about an axis of unit length by an angle in rad.
pub(super) fn about(axis: [f64; 3], angle: f64) -> Quat {
    let (s, c) = sin_cos(angle / 2.0);
    [c, s * axis[0], s * axis[1], s * axis[2]]
}

/// The product of two rotations: `b`, then `a`.
pub(super) fn multiply(a: Quat, b: Quat) -> Quat {
    if a == NONE {
        return b;
    }
    if b == NONE {
        return a;
    }
    let (u, v) = ([a[1], a[2], a[3]], [b[1], b[2], b[3]]);
    let w = cross(u, v);
    let part = |k: usize| a[0] * v[k] + b[0] * u[k] + w[k];
    normalised([a[0] * b[0] - dot(u, v), part(0), part(1), part(2)]).unwrap_or(NONE)
}

fn conjugate([w, x, y, z]: Quat) -> Quat {
    [w, -x, -y, -z]
}

/// A vector turned.
pub(super) fn rotate(quat: Quat, v: [f64; 3]) -> [f64; 3] {
    if quat == NONE {
        return v;
    }
    let u = [quat[1], quat[2], quat[3]];
    let t = cross(u, v).map(|x| 2.0 * x);
    let s = cross(u, t);
    [0, 1, 2].map(|k| v[k] + quat[0] * t[k] + s[k])
}

/// With unit length; `None` where it has none.
pub(super) fn normalised<const N: usize>(v: [f64; N]) -> Option<[f64; N]> {
    let n = norm(v);
    (n.is_finite() && n > SHORT).then(|| if n == 1.0 { v } else { v.map(|x| x / n) })
}

/// The smallest rotation that takes z to a direction of unit length.
fn to_direction(z: [f64; 3]) -> Quat {
    let axis = cross([0.0, 0.0, 1.0], z);
    let sine = norm(axis);
    let axis = if sine < 1e-10 { [1.0, 0.0, 0.0] } else { axis.map(|x| x / sine) };
    about(axis, atan2(sine, z[2]))
}

/// The rotation whose matrix has these columns, of unit length and at right angles.
fn of_columns([x, y, z]: [[f64; 3]; 3]) -> Quat {
    let (a, b, c) = (x[0], y[1], z[2]);
    // Four times the squares of the components: the largest one is divided by.
    let squares = [1.0 + a + b + c, 1.0 + a - b - c, 1.0 - a + b - c, 1.0 - a - b + c];
    let largest = (0..4).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
    let quat = match largest {
        0 => [squares[0], y[2] - z[1], z[0] - x[2], x[1] - y[0]],
        1 => [y[2] - z[1], squares[1], x[1] + y[0], x[2] + z[0]],
        2 => [z[0] - x[2], x[1] + y[0], squares[2], y[2] + z[1]],
        _ => [x[1] - y[0], x[2] + z[0], y[2] + z[1], squares[3]],
    };
    normalised(quat).unwrap_or(NONE)
}

/// Ways of writing an orientation beside `quat`. They go before it, wherever they stand.
const ALTERNATIVES: [&str; 4] = ["axisangle", "xyaxes", "zaxis", "euler"];

/// The orientation of an element.
pub(super) fn orientation(reader: &mut Reader, element: &Element, compiler: &Compiler, whose: &str) -> Quat {
    if let Some(two) = element.own(&["quat", "axisangle", "xyaxes", "zaxis", "euler"]).get(1) {
        let message = format!("{whose}a second orientation, by {}", quote(two.value));
        reader.findings.error(two.span, message, "keep one of them");
        return NONE;
    }
    let (key, quat) = match element.nearest(&ALTERNATIVES) {
        Some("axisangle") => ("axisangle", axis_angle(reader, element, compiler, whose)),
        Some("xyaxes") => ("xyaxes", xy_axes(reader, element, whose)),
        Some("zaxis") => {
            ("zaxis", vec3(reader, element, "zaxis", whose).map(|z| normalised(z.value).map(to_direction)))
        }
        Some("euler") => return euler(reader, element, compiler, whose),
        _ => (
            "quat",
            numbers(reader, element, "quat", 4..=4, whose).map(|q| <Quat>::try_from(q.value).ok().and_then(normalised)),
        ),
    };
    match quat {
        Some(Some(quat)) => quat,
        None => NONE,
        Some(None) => {
            let at = element.attribute(key).map_or(place(element.node), |a| a.span);
            let message = format!("{whose}`{key}` is too short to be a direction");
            reader.findings.error(at, message, "write numbers that can be scaled to unit length");
            NONE
        }
    }
}

fn axis_angle(reader: &mut Reader, element: &Element, compiler: &Compiler, whose: &str) -> Option<Option<Quat>> {
    let given = numbers(reader, element, "axisangle", 4..=4, whose)?.value;
    let &[x, y, z, angle] = given.as_slice() else { return None };
    Some(normalised([x, y, z]).map(|axis| about(axis, compiler.angle(angle))))
}

fn xy_axes(reader: &mut Reader, element: &Element, whose: &str) -> Option<Option<Quat>> {
    let given = numbers(reader, element, "xyaxes", 6..=6, whose)?.value;
    let &[a, b, c, d, e, f] = given.as_slice() else { return None };
    let axes = || {
        let x = normalised([a, b, c])?;
        let along = dot(x, [d, e, f]);
        let y = normalised([d - along * x[0], e - along * x[1], f - along * x[2]])?;
        Some(of_columns([x, y, cross(x, y)]))
    };
    Some(axes())
}

fn euler(reader: &mut Reader, element: &Element, compiler: &Compiler, whose: &str) -> Quat {
    let Some(angles) = vec3(reader, element, "euler", whose) else { return NONE };
    let mut quat = NONE;
    for (letter, angle) in compiler.eulerseq.iter().zip(angles.value) {
        let axis = match letter.to_ascii_lowercase() {
            b'x' => [1.0, 0.0, 0.0],
            b'y' => [0.0, 1.0, 0.0],
            _ => [0.0, 0.0, 1.0],
        };
        let turn = about(axis, compiler.angle(angle));
        // Small letters are axes that turn along, capitals are fixed ones.
        quat = if letter.is_ascii_lowercase() { multiply(quat, turn) } else { multiply(turn, quat) };
    }
    quat
}

/// Position and orientation of an element. `fromto`, where it may stand, gives both, and half the distance of its ends.
pub(super) fn pose(reader: &mut Reader, element: &Element, compiler: &Compiler, whose: &str) -> Pose {
    let xyz = vec3(reader, element, "pos", whose).map_or([0.0; 3], |p| p.value);
    Pose { xyz, quat: orientation(reader, element, compiler, whose) }
}

/// The pose between two ends, z along the line from the second to the first, and half their distance, m; `None` without
/// `fromto`.
pub(super) fn between(reader: &mut Reader, element: &Element, whose: &str) -> Option<(Pose, f64)> {
    let given = numbers(reader, element, "fromto", 6..=6, whose)?;
    let &[a, b, c, d, e, f] = given.value.as_slice() else { return None };
    let difference = [a - d, b - e, c - f];
    let Some(z) = normalised(difference) else {
        let message = format!("{whose}the ends in `fromto` are the same point");
        reader.findings.error(given.span, message, "write two points: `x1 y1 z1 x2 y2 z2`");
        return None;
    };
    let xyz = [(a + d) / 2.0, (b + e) / 2.0, (c + f) / 2.0];
    Some((Pose { xyz, quat: to_direction(z) }, norm(difference) / 2.0))
}

/// The letters of `eulerseq`.
pub(super) fn sequence(reader: &mut Reader, element: &Element) -> Option<[u8; 3]> {
    let text = element.attribute("eulerseq")?;
    match <[u8; 3]>::try_from(text.value.as_bytes()) {
        Ok(letters) if letters.iter().all(|l| b"xyzXYZ".contains(l)) => Some(letters),
        _ => {
            choice_error(reader, "`eulerseq` of `compiler`", &text, "write three letters out of x, y, z, X, Y and Z");
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::raw::RawValue;

    const Z: [f64; 3] = [0.0, 0.0, 1.0];

    #[test]
    fn columns_and_directions_agree_with_turns() {
        let near = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].iter().all(|&k| (a[k] - b[k]).abs() < 1e-15);
        for k in 0..100 {
            let seed = f64::from(k);
            let axis = normalised([seed - 50.0, 3.0 - seed * 0.1, 7.5 - seed * 0.3]).expect("an axis");
            let quat = about(axis, 0.07 * seed);
            let again = of_columns([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], Z].map(|e| rotate(quat, e)));
            assert!(near(rotate(quat, [1.0, 2.0, 3.0].map(|x| x / 4.0)), rotate(again, [0.25, 0.5, 0.75])), "{k}");
            assert!(near(rotate(to_direction(axis), Z), axis), "{k}");
            let pose = Pose { xyz: axis, quat };
            assert!(near(pose.then(&pose.inverse()).xyz, [0.0; 3]), "{k}");
        }
        assert!(near(rotate(to_direction([0.0, 0.0, -1.0]), Z), [0.0, 0.0, -1.0]));
        assert_eq!(rotation(NONE, Span::FILE), None);
    }

    #[test]
    fn roll_pitch_and_yaw_give_the_rotation_back() {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], Z];
        let right = std::f64::consts::FRAC_PI_2;
        let of = |quat| match roll_pitch_yaw(quat, Span::FILE) {
            Some(RawRotation::Rpy(rpy)) => rpy.value.map(|angle| match angle.value {
                RawValue::Const(angle) => angle,
                _ => f64::NAN,
            }),
            _ => [0.0; 3],
        };
        // Upright, and next to it.
        let pitches = [0.0, 0.3, right - 1e-9, right - 1e-15, right, -right, 2.0];
        for (k, pitch) in pitches.into_iter().enumerate() {
            let quat = multiply(multiply(about(z, 0.4 + k as f64), about(y, pitch)), about(x, -0.7));
            let [roll, pitch, yaw] = of(quat);
            let again = multiply(multiply(about(z, yaw), about(y, pitch)), about(x, roll));
            for e in [x, y, z] {
                let (a, b) = (rotate(quat, e), rotate(again, e));
                assert!((0..3).all(|k| (a[k] - b[k]).abs() < 4e-15), "{k}: {a:?} {b:?}");
            }
        }
        assert_eq!(of(about(y, right))[0], 0.0);
        assert_eq!(of(NONE), [0.0; 3]);
    }
}
