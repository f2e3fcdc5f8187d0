//! What a body may look like of which only mass, inertia and joints are known.

use multibody::codegen::model::{Body, Rotation, Value};

use super::touch::ellipsoid;

type Vec3 = [f64; 3];
type Mat3 = [[f64; 3]; 3];

/// Density with which limbs get their thickness, kg/m³: that of links with motors in them, which are partly hollow.
const LIMB: f64 = 1500.0;
/// Density of the smallest ball that a body is drawn as, kg/m³: steel.
const BALL: f64 = 7800.0;
/// Square of the thickness of a rod, as a part of that of its length, below which it is drawn as a limb.
const SLENDER: f64 = 0.09;
/// Largest radius of a limb, as a part of its length.
const STOUT: f64 = 0.045;

/// Radius of a limb from its mass, kg, and its length, m.
pub fn radius(mass: f64, length: f64) -> f64 {
    let radius = (mass.max(0.0) / (LIMB * std::f64::consts::PI * length.max(1e-9))).sqrt();
    if radius.is_finite() {
        radius.min(STOUT * length)
    } else {
        0.0
    }
}

/// The matrix of an orientation.
pub fn rotation(r: &Rotation, number: &dyn Fn(Value) -> f64) -> Mat3 {
    let about = |axis: Vec3, angle: f64| -> Mat3 {
        let norm = axis.iter().fold(0.0_f64, |n, x| n.hypot(*x)).max(f64::MIN_POSITIVE);
        let [x, y, z] = axis.map(|a| a / norm);
        let (s, c) = angle.sin_cos();
        let k = 1.0 - c;
        [
            [c + k * x * x, k * x * y - s * z, k * x * z + s * y],
            [k * x * y + s * z, c + k * y * y, k * y * z - s * x],
            [k * x * z - s * y, k * y * z + s * x, c + k * z * z],
        ]
    };
    match *r {
        Rotation::AxisAngle { axis, angle } => about(axis, number(angle)),
        Rotation::Rpy(angles) => {
            let [roll, pitch, yaw] = angles.map(number);
            let turned = product(&about([0.0, 0.0, 1.0], yaw), &about([0.0, 1.0, 0.0], pitch));
            product(&turned, &about([1.0, 0.0, 0.0], roll))
        }
    }
}

fn product(a: &Mat3, b: &Mat3) -> Mat3 {
    std::array::from_fn(|i| std::array::from_fn(|k| (0..3).map(|j| a[i][j] * b[j][k]).sum()))
}

fn applied(a: &Mat3, x: Vec3) -> Vec3 {
    a.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// Half of the only long axis, if the others are much shorter: the body is a rod.
fn rod(a: &Mat3) -> Option<Vec3> {
    // The power method; axes of similar length, for which it is slow, are no rod.
    let mut axis = [0.61, 0.53, 0.59];
    let mut size = 0.0;
    for _ in 0..40 {
        let moved = applied(a, axis);
        size = moved.iter().fold(0.0_f64, |n, x| n.hypot(*x));
        if size <= 0.0 || !size.is_finite() {
            return None;
        }
        axis = moved.map(|x| x / size);
    }
    let rest = (a[0][0] + a[1][1] + a[2][2] - size).max(0.0);
    (rest < SLENDER * size).then(|| axis.map(|x| x * size.sqrt()))
}

/// Points on an ellipsoid with the second moments of the body: its semi-axes are half of the edges of the cuboid with that
/// mass and inertia; or the two ends of a thin rod. No semi-axis exceeds `most`, and a point mass is a small ball.
pub fn points(body: &Body, number: &dyn Fn(Value) -> f64, most: f64) -> Vec<Vec3> {
    let (mass, com) = (number(body.mass), body.com.map(number));
    if mass.is_nan() || mass <= 0.0 {
        return Vec::new();
    }
    let [xx, yy, zz, xy, xz, yz] = body.inertia.map(number);
    let half = 0.5 * (xx + yy + zz);
    // `∫ x xᵀ dm` by the cuboid's factor: directions give the points `A d / √(dᵀ A d)` of the surface.
    let second = [[half - xx, -xy, -xz], [-xy, half - yy, -yz], [-xz, -yz, half - zz]];
    let mut a = second.map(|row| row.map(|x| 3.0 * x / mass));
    let trace = a[0][0] + a[1][1] + a[2][2];
    let ball = (0.75 * mass / (BALL * std::f64::consts::PI)).cbrt().min(most);
    if !trace.is_finite() {
        return Vec::new();
    }
    // The trace bounds the largest semi-axis; a quarter of its square is left to the ball.
    let shrink = (most * most / trace.max(f64::MIN_POSITIVE)).min(1.0);
    for (k, row) in a.iter_mut().enumerate() {
        row.iter_mut().for_each(|x| *x *= shrink);
        row[k] += ball * ball * if trace > ball * ball { 0.04 } else { 1.0 };
    }
    let turn = rotation(&body.inertia_axes, number);
    if let Some(half) = rod(&a) {
        let half = applied(&turn, half);
        return [-1.0, 1.0].map(|end| std::array::from_fn(|k| com[k] + end * half[k])).to_vec();
    }
    let surface = ellipsoid([0.0; 3], [1.0; 3]).into_iter().filter_map(|d| {
        let moved = applied(&a, d);
        let size = (0..3).map(|k| d[k] * moved[k]).sum::<f64>();
        (size > 0.0).then(|| applied(&turn, moved.map(|x| x / size.sqrt())))
    });
    surface.map(|p| std::array::from_fn(|k| com[k] + p[k])).collect()
}
