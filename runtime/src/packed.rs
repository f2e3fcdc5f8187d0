//! Numbers of several states, side by side.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::lists::array;
use crate::system::Real;
use crate::Scalar;

/// `L` doubles that belong to as many states of one system, `L` at least one: methods of integration that run on them
/// integrate all of these states at once.
///
/// Every operation is that of the lanes, so that each lane has the bits it would have alone. Where a method asks a number
/// itself (compares it, or converts it to a double) it is told of the first lane; only whether a number is finite concerns
/// all lanes. Explicit methods with a fixed step do not ask, but for the lengths of the quaternions that they start from.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
#[repr(transparent)]
pub struct Packed<const L: usize>(pub [f64; L]);

impl<const L: usize> Packed<L> {
    #[inline(always)]
    fn with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Packed(array(|l| f(self.0[l], other.0[l])))
    }
}

macro_rules! operator {
    ($($trait:ident $function:ident;)*) => {
        $(impl<const L: usize> $trait for Packed<L> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                self.with(other, $trait::$function)
            }
        })*
    };
}

operator! {
    Add add;
    Sub sub;
    Mul mul;
    Div div;
}

impl<const L: usize> Neg for Packed<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Packed(self.0.map(Neg::neg))
    }
}

impl<const L: usize> Scalar for Packed<L> {
    const LANES: usize = L;
    #[inline]
    fn constant(x: f64) -> Self {
        Packed([x; L])
    }
    #[inline]
    fn rounded(x: crate::constant::Constant) -> Self {
        Packed([f64::rounded(x); L])
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let pairs = self.0.map(Scalar::sin_cos);
        (Packed(pairs.map(|pair| pair.0)), Packed(pairs.map(|pair| pair.1)))
    }
    #[inline]
    fn sqrt(self) -> Self {
        Packed(self.0.map(Scalar::sqrt))
    }
    #[inline]
    fn reciprocal_above(self, floor: Self) -> Self {
        self.with(floor, Scalar::reciprocal_above)
    }
    #[inline]
    fn look_up(self, table: &'static [f64], offset: usize) -> Self {
        Packed(self.0.map(|x| x.look_up(table, offset)))
    }
}

impl<const L: usize> Real for Packed<L> {
    fn is_finite(self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }
    fn to_f64(self) -> f64 {
        self.0.first().copied().unwrap_or(f64::NAN)
    }
    fn epsilon() -> f64 {
        f64::EPSILON
    }
    fn abs(self) -> Self {
        Packed(self.0.map(Real::abs))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_are_numbers_by_themselves() {
        let (a, b) = (Packed([1.5, -2.0]), Packed([0.25, 3.0]));
        assert_eq!(((a + b) * a / b - a).0, [(1.5 + 0.25) * 1.5 / 0.25 - 1.5, (-2.0 + 3.0) * -2.0 / 3.0 + 2.0]);
        assert_eq!((-a).abs().0, [1.5, 2.0]);
        let (sin, cos) = a.sin_cos();
        for l in 0..2 {
            assert_eq!((sin.0[l], cos.0[l]), a.0[l].sin_cos());
        }
        assert!(Real::is_finite(a) && !Real::is_finite(Packed([1.0, f64::NAN])));
        assert_eq!(b.reciprocal_above(Packed([1.0, 1.0])).0, [0.0, 1.0 / 3.0]);
    }
}
