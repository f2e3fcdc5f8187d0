//! Inertias of bodies, moved and added, in numbers.

use mbd_runtime::Scalar;

use crate::model::{Body, Param, Placement, Rotation, Value};
use crate::rounded_once::norm;
use crate::symmetric::full;

pub(crate) type Mat3 = [[f64; 3]; 3];

/// Mass, first moment and inertia about the origin, in the axes of one frame.
#[derive(Clone, Copy, Default)]
pub(crate) struct Inertia {
    /// kg.
    pub mass: f64,
    /// Mass times centre of mass, kg m.
    pub first: [f64; 3],
    /// kg m².
    pub about_origin: Mat3,
}

/// A number at the defaults of the parameters.
pub(crate) fn at_default(value: Value, params: &[Param]) -> f64 {
    match value {
        Value::Const(x) => x,
        Value::Param(k) => params[k].default,
    }
}

/// Inertia of a body in its own frame.
pub(crate) fn own(body: &Body, params: &[Param]) -> Inertia {
    let at = |x: Value| at_default(x, params);
    let (mass, com) = (at(body.mass), body.com.map(at));
    let r = matrix(&body.inertia_axes, &at);
    let about_com = multiply(&multiply(&r, &full(body.inertia.map(at))), &transpose(&r));
    Inertia { mass, first: com.map(|x| mass * x), about_origin: add(about_com, steiner(mass, com, com)) }
}

/// The inertia seen from the parent frame, at zero coordinates (used for fixed joints only).
pub(crate) fn moved(i: Inertia, placement: &Placement, params: &[Param]) -> Inertia {
    let r = matrix(&placement.rotation, &|x| at_default(x, params));
    let d = placement.xyz.map(|x| at_default(x, params));
    let first = apply(&r, i.first);
    let turned = multiply(&multiply(&r, &i.about_origin), &transpose(&r));
    // About d + x: I + (d, h) + (h, d) + m (d, d).
    let mixed = add(steiner(1.0, d, first), steiner(1.0, first, d));
    let about_origin = add(add(turned, mixed), steiner(i.mass, d, d));
    Inertia { mass: i.mass, first: [0, 1, 2].map(|k| first[k] + i.mass * d[k]), about_origin }
}

/// The inertia of two together.
pub(crate) fn sum(a: Inertia, b: Inertia) -> Inertia {
    Inertia {
        mass: a.mass + b.mass,
        first: [0, 1, 2].map(|k| a.first[k] + b.first[k]),
        about_origin: add(a.about_origin, b.about_origin),
    }
}

/// Mass, centre of mass (m) and inertia about it, `[xx, yy, zz, xy, xz, yz]`, kg m².
pub(crate) fn about_com(i: Inertia) -> (f64, [f64; 3], [f64; 6]) {
    let com = i.first.map(|x| x / i.mass);
    let shift = steiner(i.mass, com, com);
    let entry = |a: usize, b: usize| i.about_origin[a][b] - shift[a][b];
    (i.mass, com, [entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)])
}

/// The matrix of a rotation whose numbers have the values that `at` gives.
pub(crate) fn matrix(rotation: &Rotation, at: &dyn Fn(Value) -> f64) -> Mat3 {
    let about = |axis: [f64; 3], angle: f64| {
        let (s, c) = Scalar::sin_cos(angle);
        let [x, y, z] = axis;
        let skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        let one = |i: usize, j: usize| f64::from(u8::from(i == j));
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| c * one(i, j) + s * skew[i][j] + (1.0 - c) * axis[i] * axis[j]))
    };
    match rotation {
        Rotation::AxisAngle { axis, angle } => about(unit(*axis), at(*angle)),
        Rotation::Rpy(rpy) => {
            let [roll, pitch, yaw] = rpy.map(at);
            let zy = multiply(&about([0.0, 0.0, 1.0], yaw), &about([0.0, 1.0, 0.0], pitch));
            multiply(&zy, &about([1.0, 0.0, 0.0], roll))
        }
    }
}

/// `m (a·b 1 - b aᵀ)`, symmetric in sum with its counterpart.
fn steiner(m: f64, a: [f64; 3], b: [f64; 3]) -> Mat3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m * (if i == j { dot(a, b) } else { 0.0 } - b[i] * a[j])))
}

pub(crate) fn unit(v: [f64; 3]) -> [f64; 3] {
    let n = norm(v);
    v.map(|x| x / n)
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn apply(m: &Mat3, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| dot(row, v))
}

pub(crate) fn transpose(m: &Mat3) -> Mat3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[j][i]))
}

fn multiply(a: &Mat3, b: &Mat3) -> Mat3 {
    let t = transpose(b);
    a.map(|row| t.map(|column| dot(row, column)))
}

fn add(a: Mat3, b: Mat3) -> Mat3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[i][j] + b[i][j]))
}

pub(crate) fn trace(m: &Mat3) -> f64 {
    m[0][0] + m[1][1] + m[2][2]
}
