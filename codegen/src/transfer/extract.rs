//! Coordinates of a joint out of the pose of its child in its parent.

use std::f64::consts::TAU;

use mbd_runtime::spatial::Mat3;
use mbd_runtime::transfer::quaternion;
use mbd_runtime::tree::Kind;

use crate::plan::Rigid;
use crate::rounded_once::atan2;

/// One elementary joint: its kind, and the pose of its node in the node before it at zero coordinates.
#[derive(Clone, Debug)]
pub(super) struct Half {
    pub kind: Kind<f64>,
    pub zero: Rigid,
}

/// Writes the coordinates at which the halves of a joint, one after the other, come nearest to the pose `t` of the last
/// node in the node ahead of the first. Angles are principal values, except that the displacement of a screw tells its
/// turns. Where `t` is not a pose of the joint, the result is near one that is; the caller compares.
pub(super) fn coordinates(halves: &[Half], t: &Rigid, out: &mut [f64]) {
    // The motion of a node's joint is about and along its own z: it is what follows the pose at zero.
    match halves {
        [Half { kind, zero }] => single(kind, &zero.inverse().then(t), out),
        [first, second] => {
            let ahead = first.zero.inverse().then(t);
            let both = ahead.then(&second.zero.inverse());
            match first.kind {
                // Both axes are one: the rotation moves nothing along it.
                Kind::Prismatic => out[0] = both.pos[2],
                // The second rotation leaves its own axis where it is.
                _ => {
                    let axis = second.zero.turn([0.0, 0.0, 1.0]);
                    let turned = both.turn(axis);
                    let bend = heading(turned[1], turned[0]) - heading(axis[1], axis[0]);
                    out[0] = bend - TAU * (bend / TAU).round();
                }
            }
            let moved = match first.kind {
                Kind::Prismatic => Rigid::screw_z(1.0, 0.0, out[0]),
                _ => {
                    let (s, c) = libm::sincos(out[0]);
                    Rigid::screw_z(c, s, 0.0)
                }
            };
            let rest = second.zero.inverse().then(&moved.inverse().then(&ahead));
            single(&second.kind, &rest, &mut out[1..]);
        }
        _ => {}
    }
}

/// Coordinates of one elementary joint whose motion is `d`.
fn single(kind: &Kind<f64>, d: &Rigid, out: &mut [f64]) {
    match *kind {
        Kind::Revolute => out[0] = turn(&d.rot),
        Kind::Prismatic => out[0] = d.pos[2],
        Kind::Helical { pitch } => {
            let angle = turn(&d.rot);
            let turns = ((d.pos[2] / pitch - angle) / TAU).round();
            out[0] = if turns.is_finite() { angle + TAU * turns } else { angle };
        }
        Kind::Planar => out.copy_from_slice(&[d.pos[0], d.pos[1], turn(&d.rot)]),
        Kind::Spherical => out.copy_from_slice(&quaternion(&d.rot)),
        Kind::Floating => {
            out[..3].copy_from_slice(&d.pos);
            out[3..].copy_from_slice(&quaternion(&d.rot));
        }
    }
}

/// Angle of a vector, zero for the zero vector.
fn heading(y: f64, x: f64) -> f64 {
    if x == 0.0 && y == 0.0 {
        return 0.0;
    }
    atan2(y, x)
}

/// The angle of the rotation about z that is nearest to `r`.
fn turn(r: &Mat3<f64>) -> f64 {
    heading(r[1][0] - r[0][1], r[0][0] + r[1][1])
}
