//! Constant poses and their factoring into elementary transforms.

use mbd_runtime::spatial::{Axis, Mat3, Vec3};

use super::structure::PoseStep;
use crate::model::Value;
use crate::rounded_once::hypot;

/// Below this, relative to one, a sine, cosine or ratio of lengths is round-off.
pub const ROUND_OFF: f64 = 1e-14;

/// Pose of a frame in another: child components to parent components, origin in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid {
    /// Rotation.
    pub rot: Mat3<f64>,
    /// Origin.
    pub pos: Vec3<f64>,
}

impl Rigid {
    /// The identity.
    pub const IDENTITY: Rigid = Rigid { rot: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], pos: [0.0; 3] };

    /// `self ∘ other`.
    pub fn then(&self, other: &Rigid) -> Rigid {
        let mut out = *self;
        for (i, row) in self.rot.iter().enumerate() {
            out.pos[i] = self.pos[i] + row[0] * other.pos[0] + row[1] * other.pos[1] + row[2] * other.pos[2];
            for k in 0..3 {
                out.rot[i][k] = row[0] * other.rot[0][k] + row[1] * other.rot[1][k] + row[2] * other.rot[2][k];
            }
        }
        out
    }

    /// The inverse pose.
    pub fn inverse(&self) -> Rigid {
        let rot: Mat3<f64> = std::array::from_fn(|i| std::array::from_fn(|k| self.rot[k][i]));
        let p = self.pos;
        Rigid { rot, pos: std::array::from_fn(|i| -(rot[i][0] * p[0] + rot[i][1] * p[1] + rot[i][2] * p[2])) }
    }

    /// A vector of the child in parent components.
    pub fn turn(&self, x: Vec3<f64>) -> Vec3<f64> {
        self.rot.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
    }

    /// About z by the angle with the given cosine and sine, and along z.
    pub fn screw_z(c: f64, s: f64, r: f64) -> Rigid {
        Rigid { rot: [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], pos: [0.0, 0.0, r] }
    }

    /// The smallest rotation that takes z to the unit vector `a`; half a turn about x if that is −z.
    pub fn align_z(a: Vec3<f64>) -> Rigid {
        let [x, y, z] = a;
        let across = x * x + y * y;
        if across == 0.0 && z < 0.0 {
            return Rigid { rot: [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]], pos: [0.0; 3] };
        }
        // 1 / (1 + z), without its cancellation towards −z.
        let k = if z < 0.0 { (1.0 - z) / across } else { 1.0 / (1.0 + z) };
        let rot = [[1.0 - k * x * x, -k * x * y, x], [-k * x * y, 1.0 - k * y * y, y], [-x, -y, z]];
        Rigid { rot, pos: [0.0; 3] }
    }
}

/// `Z(γ, b) X(α, a) Z(θ, d)`: a pose as three screws, the last of which belongs to the next joint.
#[derive(Clone, Debug)]
pub struct Screws {
    /// Steps up to the last screw.
    pub steps: Vec<PoseStep>,
    /// `θ` as cosine and sine.
    pub turn: (f64, f64),
    /// `d`.
    pub slide: f64,
}

/// Round-off to exact zeros and right angles; the pair stays on the unit circle.
fn clean_turn(c: f64, s: f64) -> (f64, f64) {
    let n = hypot(c, s);
    let (c, s) = (c / n, s / n);
    if s.abs() < ROUND_OFF {
        (c.signum(), 0.0)
    } else if c.abs() < ROUND_OFF {
        (0.0, s.signum())
    } else {
        (c, s)
    }
}

fn clean(x: f64, scale: f64) -> f64 {
    if x.abs() <= ROUND_OFF * scale {
        0.0
    } else {
        x
    }
}

fn turn_step(steps: &mut Vec<PoseStep>, axis: Axis, (c, s): (f64, f64)) {
    if (c, s) != (1.0, 0.0) {
        steps.push(PoseStep::Turn { axis, c, s });
    }
}

fn shift_step(steps: &mut Vec<PoseStep>, axis: Axis, r: f64) {
    if r != 0.0 {
        steps.push(PoseStep::Shift { axis, r: Value::Const(r) });
    }
}

/// Factors a pose into screws. The common normal of nearly parallel axes is far away; the displacement is then applied
/// first, and the screws only rotate. `lengths` is the size of the lengths from which the displacement was computed,
/// which determines its round-off.
pub fn screws(t: &Rigid, lengths: f64) -> Screws {
    let (rot, pos) = (&t.rot, t.pos);
    let size = pos.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let scale = lengths.max(size);
    let sin_alpha = hypot(rot[0][2], rot[1][2]);
    let mut steps = Vec::new();
    if sin_alpha < ROUND_OFF {
        // For parallel axes, the first screw only points x at the other axis.
        let (x, y) = (clean(pos[0], scale), clean(pos[1], scale));
        let gamma = if y == 0.0 { (1.0, 0.0) } else { clean_turn(x, y) };
        let a = gamma.0 * x + gamma.1 * y;
        let up = rot[2][2].signum();
        turn_step(&mut steps, Axis::Z, gamma);
        shift_step(&mut steps, Axis::X, a);
        turn_step(&mut steps, Axis::X, (up, 0.0));
        // R = Rz(γ) Rx(0 or π) Rz(θ)
        let (c, s) = (rot[0][0], rot[1][0]);
        let turn = clean_turn(gamma.0 * c + gamma.1 * s, up * (gamma.0 * s - gamma.1 * c));
        return Screws { steps, turn, slide: up * clean(pos[2], scale) };
    }
    let sign = if rot[1][2] > 0.0 { -1.0 } else { 1.0 };
    let mut gamma = clean_turn(-rot[1][2] * sign, rot[0][2] * sign);
    if gamma.1.abs() < ROUND_OFF / sin_alpha {
        // The closer the axes are to parallel, the less accurate is the direction of their normal. The part that is
        // dropped here is contained in the last rotation, which is the rest of the rotation.
        gamma = (gamma.0.signum(), 0.0);
    }
    let alpha = clean_turn(rot[2][2], sign * sin_alpha);
    let row = |k: usize| gamma.0 * rot[0][k] + gamma.1 * rot[1][k];
    let turn = clean_turn(row(0), -row(1));
    let across = [gamma.0 * pos[0] + gamma.1 * pos[1], gamma.0 * pos[1] - gamma.1 * pos[0]];
    let mut d = -across[1] / alpha.1;
    let mut b = pos[2] - alpha.0 * d;
    if b.abs() <= ROUND_OFF * scale / sin_alpha {
        // This is as inaccurate as the normal; all of it except `b sin α` is contained in the last displacement.
        (b, d) = (0.0, d + alpha.0 * b);
    }
    if sin_alpha < 1e-6 || b.abs().max(d.abs()) > 20.0 * size {
        for (axis, r) in [Axis::X, Axis::Y, Axis::Z].into_iter().zip(pos) {
            shift_step(&mut steps, axis, clean(r, scale));
        }
        turn_step(&mut steps, Axis::Z, gamma);
        turn_step(&mut steps, Axis::X, alpha);
        return Screws { steps, turn, slide: 0.0 };
    }
    shift_step(&mut steps, Axis::Z, b);
    turn_step(&mut steps, Axis::Z, gamma);
    shift_step(&mut steps, Axis::X, clean(across[0], scale));
    turn_step(&mut steps, Axis::X, alpha);
    Screws { steps, turn, slide: clean(d, scale) }
}

/// A constant pose as elementary transforms, without a rest.
pub fn all_steps(t: &Rigid) -> Vec<PoseStep> {
    let Screws { mut steps, turn, slide } = screws(t, 0.0);
    shift_step(&mut steps, Axis::Z, slide);
    turn_step(&mut steps, Axis::Z, turn);
    steps
}

#[cfg(test)]
mod tests {
    use mbd_runtime::Scalar;

    use super::*;

    #[test]
    fn alignment_is_a_rotation_to_the_last_digits() {
        for off in [0.0_f64, 1e-12, 1e-8, 1e-5, 1e-3, 0.1, 1.0, 2.0, 3.0] {
            for (s, c) in [(0.0, 1.0), (1.0, 0.0), (0.6, -0.8)] {
                let angle = std::f64::consts::PI - off;
                let (x, z) = if off == 0.0 { (0.0, -1.0) } else { Scalar::sin_cos(angle) };
                let a = [c * x, s * x, z];
                let r = Rigid::align_z(a);
                let product = r.inverse().then(&r).rot;
                for (i, row) in product.iter().enumerate() {
                    for (k, entry) in row.iter().enumerate() {
                        let one = if i == k { 1.0 } else { 0.0 };
                        assert!((entry - one).abs() < 4.0 * f64::EPSILON, "{a:?}: {product:?}");
                    }
                }
                let axis = r.turn([0.0, 0.0, 1.0]);
                assert!(axis.iter().zip(a).all(|(x, y)| (x - y).abs() < f64::EPSILON), "{axis:?} {a:?}");
                // The smallest rotation is about an axis across z.
                if off > 0.0 {
                    assert_eq!(r.rot[0][1], r.rot[1][0], "{a:?}");
                }
            }
        }
    }
}
