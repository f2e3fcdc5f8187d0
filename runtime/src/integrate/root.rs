//! The zero of a function between two points.

use crate::system::Real;

/// Where a function has reached zero between `a`, where it has not, and `b`, where it has: not before the root, and at
/// most twice `half_width` behind it. `a` and `b` come with the values there; `value` gives the function at a point and
/// whether it has reached zero. By the ITP method of Oliveira and Takahashi (ACM TOMS 47, 2020): as fast as a secant,
/// never slower than halving by more than one evaluation.
pub(crate) fn root<S: Real>(
    (mut a, mut at_a): (S, S),
    (mut b, mut at_b): (S, S),
    half_width: f64,
    mut value: impl FnMut(S) -> (S, bool),
) -> S {
    let c = S::constant;
    let first = (b - a).to_f64();
    let mut room = half_width * libm::exp2(libm::ceil(libm::log2(first / (2.0 * half_width))).max(0.0) + 1.0);
    while (b - a).to_f64() > 2.0 * half_width {
        let middle = c(0.5) * (a + b);
        let width = (b - a).to_f64();
        let secant = (at_b * a - at_a * b) / (at_b - at_a);
        let off = (middle - secant).to_f64();
        let (sign, shift) = (1.0_f64.copysign(off), 0.2 / first * width * width);
        let x = if shift <= off.abs() { secant + c(sign * shift) } else { middle };
        let reach = room - 0.5 * width;
        let x = if (x - middle).to_f64().abs() <= reach { x } else { middle - c(sign * reach) };
        let x = if x > a && x < b { x } else { middle };
        if !(x > a && x < b) {
            break;
        }
        let (at_x, reached) = value(x);
        if reached {
            (b, at_b) = (x, at_x);
        } else {
            (a, at_a) = (x, at_x);
        }
        room *= 0.5;
    }
    b
}

/// Half the width to which the place of an event within a step of `h` s from `t` (s) can be found, as a part of the step.
pub(crate) fn resolution<S: Real>(t: S, h: S) -> f64 {
    let size = t.to_f64().abs().max((t + h).to_f64().abs());
    (2.0 * S::epsilon() * size / h.to_f64()).max(S::epsilon())
}
