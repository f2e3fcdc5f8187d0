//! Random placements in which two bodies touch, away from where their nearest features change.

use mbd_runtime::spatial::{add3, cross, dot3, scale3, Vec3};

use crate::kkt::{across, unit};
use crate::random::Rng;

/// How far a direction leans beyond the end that it leaves from.
const LEAN: f64 = 0.1;

/// A place on a segment that is not at an end.
fn inside(rng: &mut Rng, half: f64) -> f64 {
    rng.around(0.9) * half
}

/// The middle of a capsule about `axes[1]`, from the middle of one about `axes[0]` that it touches, both unit vectors in
/// axes of the first; `normal` is a random direction. `None` where the draw does not fit.
pub fn capsules(
    rng: &mut Rng,
    axes: [Vec3<f64>; 2],
    half: [f64; 2],
    radii: [f64; 2],
    normal: Vec3<f64>,
    flat: bool,
) -> Option<Vec3<f64>> {
    let [a, b] = axes;
    let normal = unit(normal);
    // An end on a mantle: the normal is across the axis of the mantle.
    let level = |axis: Vec3<f64>| {
        let n = add3(normal, scale3(-dot3(normal, axis), axis));
        (dot3(n, n) > LEAN).then(|| unit(n))
    };
    let lean = |n: Vec3<f64>, axis: Vec3<f64>| {
        let x = dot3(n, axis);
        (x.abs() > LEAN).then(|| x.signum())
    };
    let (n, s, t) = match rng.below(if flat { 3 } else { 4 }) {
        0 => {
            let n = level(b)?;
            (n, lean(n, a)? * half[0], inside(rng, half[1]))
        }
        1 => {
            let n = level(a)?;
            (n, inside(rng, half[0]), -lean(n, b)? * half[1])
        }
        2 => (normal, lean(normal, a)? * half[0], -lean(normal, b)? * half[1]),
        _ => {
            let n = cross(a, b);
            if dot3(n, n) < LEAN {
                return None;
            }
            (scale3(rng.pick(&[1.0, -1.0]), unit(n)), inside(rng, half[0]), inside(rng, half[1]))
        }
    };
    Some(add3(add3(scale3(s, a), scale3(radii[0] + radii[1], n)), scale3(-t, b)))
}

/// The middle of a ball from the middle of a box that it touches, in the axes of the box; `flat`: not before a face or
/// edge across z alone.
pub fn on_box(rng: &mut Rng, size: [f64; 3], radius: f64, flat: bool) -> Vec3<f64> {
    loop {
        let side = [0, 1, 2].map(|k| if flat && k == 2 { 0.0 } else { rng.pick(&[0.0, -1.0, 1.0]) });
        let n: Vec3<f64> = side.map(|side| side * rng.range(0.3, 1.0));
        if dot3(n, n) > 0.0 {
            let on = [0, 1, 2].map(|k| {
                let half = 0.5 * size[k];
                if side[k] == 0.0 {
                    inside(rng, half)
                } else {
                    side[k] * half
                }
            });
            return add3(on, scale3(radius, unit(n)));
        }
    }
}

/// The middle of a ball from the middle of a cylinder about `axis` that it touches; `flat`: it touches the mantle.
pub fn on_cylinder(rng: &mut Rng, axis: Vec3<f64>, length: f64, radii: [f64; 2], flat: bool) -> Vec3<f64> {
    let (z, [x, y]) = (unit(axis), across(axis));
    let (sin, cos) = rng.around(3.0).sin_cos();
    let out = add3(scale3(cos, x), scale3(sin, y));
    let end = scale3(rng.pick(&[1.0, -1.0]), z);
    let at = |along: f64, r: f64| add3(scale3(along, end), scale3(r, out));
    let half = 0.5 * length;
    let (on, n) = match rng.below(if flat { 1 } else { 3 }) {
        0 => (at(inside(rng, half), radii[0]), out),
        1 => (at(half, rng.range(0.1, 0.9) * radii[0]), end),
        _ => (at(half, radii[0]), unit(add3(scale3(rng.range(0.3, 1.0), end), scale3(rng.range(0.3, 1.0), out)))),
    };
    add3(on, scale3(radii[1], n))
}
