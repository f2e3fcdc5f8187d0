//! Sines, lengths and angles, each computed with double-double numbers and rounded once: the same on every machine, and
//! rotations as nearly orthogonal as doubles can be. The last digits decide more than they say, because the search
//! refuses eliminations for their rounding errors, to which rounded constants contribute.

use mbd_runtime::wide::Wide;
use mbd_runtime::{Real, Scalar};

type Double = Wide<false>;

/// Sine and cosine of an angle in rad. Above 2⁵⁰ rad, where neighbouring doubles are an eighth of a radian apart or
/// more, they are the sines of generated code.
pub fn sin_cos(angle: f64) -> (f64, f64) {
    let (s, c) = Double::constant(angle).sin_cos();
    match s.is_finite() {
        true => (s.to_f64(), c.to_f64()),
        false => Scalar::sin_cos(angle),
    }
}

/// Length of a vector of two components.
pub fn hypot(x: f64, y: f64) -> f64 {
    if !(1e-100..1e100).contains(&x.abs().max(y.abs())) {
        // Squares could overflow or lose digits.
        return libm::hypot(x, y);
    }
    length(Double::constant(x), Double::constant(y)).to_f64()
}

/// Length of a vector, without overflow on the way.
pub fn norm<const N: usize>(v: [f64; N]) -> f64 {
    v.into_iter().fold(0.0, hypot)
}

/// Angle in rad of a vector of about unit length, from −π to π.
pub fn atan2(y: f64, x: f64) -> f64 {
    let near = Double::constant(libm::atan2(y, x));
    let ((s, c), x, y) = (near.sin_cos(), Double::constant(x), Double::constant(y));
    // The sine of the error of `near`, which is too small to differ from the error itself.
    let error = (y * c - x * s) / length(x, y);
    (near + error).to_f64()
}

fn length(x: Double, y: Double) -> Double {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert_eq!(hypot(3.0, -4.0), 5.0);
        assert_eq!(hypot(0.0, 0.0), 0.0);
        assert!((hypot(3e200, 4e200) / 5e200 - 1.0).abs() <= f64::EPSILON);
        assert_eq!(hypot(-7e-3, 0.0), 7e-3);
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
        assert_eq!(sin_cos(1e300), Scalar::sin_cos(1e300));
        assert_eq!(atan2(0.0, -1.0), std::f64::consts::PI);
        assert_eq!(atan2(0.0, 1.0), 0.0);
        assert_eq!(atan2(-1.0, 0.0), -std::f64::consts::FRAC_PI_2);
        assert_eq!(atan2(1.0, 1.0), std::f64::consts::FRAC_PI_4);
        assert_eq!(sin_cos(0.5), (0.479425538604203, 0.8775825618903728));
    }

    /// An error of a last place in one of the functions is an error of as much in the other's inverse.
    #[test]
    fn angles_are_those_of_their_sines() {
        for k in -314..=314 {
            let angle = f64::from(k) / 100.0;
            let (s, c) = sin_cos(angle);
            assert!((hypot(s, c) - 1.0).abs() <= f64::EPSILON, "{angle}");
            // The rounded components turn the vector by a rounding of each at most.
            assert!((atan2(s, c) - angle).abs() <= 1.5 * f64::EPSILON * angle.abs().max(0.5), "{angle}");
        }
    }
}
