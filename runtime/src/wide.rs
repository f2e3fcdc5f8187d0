//! Double-double numbers as a scalar, for reference solutions and as the reference of rounding errors.

use core::ops::{Add, Div, Mul, Neg, Sub};

use twofloat::TwoFloat;

use crate::constant::list;
use crate::constant::Constant;
use crate::{Real, Scalar};

/// A double-double number of about 106 bits.
///
/// Sums, products, quotients and roots have a relative error of at most 1e-31. Sines and cosines of angles below 1000
/// rad have an absolute error of at most 1e-31; of larger angles, an error of the size of the angle's last bit. They
/// are NaN above 2⁵⁰ rad.
///
/// With `COARSE`, sines and cosines are those that a program on doubles computes for the angle rounded to a double.
/// They are then the same inputs of the following operations in both programs, and a comparison shows the roundings of
/// these operations only.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Wide<const COARSE: bool = false>(pub TwoFloat);

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl<const COARSE: bool> $trait for Wide<COARSE> {
            type Output = Self;
            #[inline]
            fn $name(self, other: Self) -> Self {
                Wide($trait::$name(self.0, other.0))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);

impl<const COARSE: bool> Div for Wide<COARSE> {
    type Output = Self;
    /// Long division, one double after the other. (The crate's own division computes the residual of a reciprocal
    /// without a fused multiply-add, which leaves an error of 1e-16.)
    fn div(self, other: Self) -> Self {
        let (above, below) = (self.0, other.0);
        let first = above.hi() / below.hi();
        let rest = above - below * first;
        let second = rest.hi() / below.hi();
        let rest = rest - below * second;
        Wide(TwoFloat::new_add(first, second) + rest.hi() / below.hi())
    }
}

impl<const COARSE: bool> Neg for Wide<COARSE> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Wide(-self.0)
    }
}

impl<const COARSE: bool> Scalar for Wide<COARSE> {
    #[inline]
    fn constant(x: f64) -> Self {
        Wide(x.into())
    }
    fn sin_cos(self) -> (Self, Self) {
        if COARSE {
            let (s, c) = Scalar::sin_cos(self.0.hi());
            return (Self::constant(s), Self::constant(c));
        }
        let (s, c) = sin_cos(self.0);
        (Wide(s), Wide(c))
    }
    #[inline]
    fn sqrt(self) -> Self {
        Wide(self.0.sqrt())
    }
    fn reciprocal_above(self, floor: Self) -> Self {
        if self <= floor {
            Self::zero()
        } else {
            Self::one() / self
        }
    }
    // A number that is a whole one but for digits of its second part may count as that one.
    fn look_up(self, table: &'static [f64], offset: usize) -> Self {
        Self::constant(self.0.hi().look_up(table, offset))
    }
}

impl<const COARSE: bool> Real for Wide<COARSE> {
    fn is_finite(self) -> bool {
        self.0.hi().is_finite() && self.0.lo().is_finite()
    }
    fn to_f64(self) -> f64 {
        self.0.hi()
    }
    fn epsilon() -> f64 {
        // 2⁻¹⁰⁴
        4.930380657631324e-32
    }
}

/// π/2 in three doubles.
const QUARTER: [f64; 3] = [core::f64::consts::FRAC_PI_2, 6.123233995736766e-17, -1.4973849048591698e-33];

/// Largest angle, rad, whose number of quarter turns is exact.
const LARGEST: f64 = (1_u64 << 50) as f64;

/// Taylor series of (sin x)/x in x², last term first; for x below π/4 the first omitted term is below 1e-34.
const SINE: [Constant; 14] = list(
    "-1/10888869450418352160768000000 1/15511210043330985984000000 -1/25852016738884976640000 1/51090942171709440000 \
     -1/121645100408832000 1/355687428096000 -1/1307674368000 1/6227020800 -1/39916800 1/362880 -1/5040 1/120 -1/6 1",
);

/// Taylor series of cos x in x², last term first.
const COSINE: [Constant; 15] = list(
    "1/304888344611713860501504000000 -1/403291461126605635584000000 1/620448401733239439360000 \
     -1/1124000727777607680000 1/2432902008176640000 -1/6402373705728000 1/20922789888000 -1/87178291200 1/479001600 \
     -1/3628800 1/40320 -1/720 1/24 -1/2 1",
);

fn series<const N: usize>(terms: &[Constant; N], square: TwoFloat) -> TwoFloat {
    terms.iter().fold(TwoFloat::from(0.0), |sum, c| sum * square + c.get::<Wide>().0)
}

/// Sine and cosine: quarter turns are subtracted, and the rest is the argument of a Taylor series.
fn sin_cos(angle: TwoFloat) -> (TwoFloat, TwoFloat) {
    if !(-LARGEST..=LARGEST).contains(&angle.hi()) {
        return (TwoFloat::NAN, TwoFloat::NAN);
    }
    let turns = libm::rint(angle.hi() / QUARTER[0]);
    let rest = QUARTER.iter().fold(angle, |rest, part| rest - TwoFloat::new_mul(turns, *part));
    let square = rest * rest;
    let (s, c) = (series(&SINE, square) * rest, series(&COSINE, square));
    match (turns as i64).rem_euclid(4) {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

#[cfg(test)]
mod tests;
