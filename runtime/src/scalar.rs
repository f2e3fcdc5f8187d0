//! The numbers a sweep may be run with.

use crate::constant::Constant;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// A field with sine, cosine, square root and a guarded reciprocal, and nothing else: no comparison and no way out to
/// `f64`, so a sweep written over it cannot branch on a value and every instance performs the same operations in the same
/// order.
pub trait Scalar:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant, rounded to the precision of the type.
    fn constant(x: f64) -> Self;
    /// A constant of more digits than a double has, rounded to the precision of the type.
    #[inline]
    fn rounded(x: Constant) -> Self {
        Self::constant(x.hi()) + Self::constant(x.lo())
    }
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// Square root.
    fn sqrt(self) -> Self;
    /// `1 / self` where `self` is above `floor`, and zero elsewhere: the pivot of a row that may be redundant, and is left
    /// out where too little remains of its diagonal. The floor is not negative. Where `self` is NaN, so is the result.
    fn reciprocal_above(self, floor: Self) -> Self;
    /// Part of a row's diagonal below which what is left of it by the rows before it is taken for round-off.
    fn rank_tolerance() -> Self {
        Self::constant(1e-10)
    }

    /// Zero.
    fn zero() -> Self {
        Self::constant(0.0)
    }
    /// One.
    fn one() -> Self {
        Self::constant(1.0)
    }
}

impl Scalar for f64 {
    #[inline]
    fn constant(x: f64) -> Self {
        x
    }
    #[inline]
    fn rounded(x: Constant) -> Self {
        x.hi()
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        crate::trig::sincos_f64(self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        // Both are rounded correctly: the same bits.
        #[cfg(feature = "std")]
        return f64::sqrt(self);
        #[cfg(not(feature = "std"))]
        libm::sqrt(self)
    }
    #[inline]
    fn reciprocal_above(self, floor: Self) -> Self {
        // A mask on the quotient, no branch: lanes stay together. NaN is not below the floor.
        let reciprocal = 1.0 / self;
        if self <= floor {
            0.0
        } else {
            reciprocal
        }
    }
}

impl Scalar for f32 {
    #[inline]
    fn constant(x: f64) -> Self {
        x as f32
    }
    #[inline]
    fn rounded(x: Constant) -> Self {
        x.single()
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        crate::trig::sincos_f32(self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        // Both are rounded correctly: the same bits.
        #[cfg(feature = "std")]
        return f32::sqrt(self);
        #[cfg(not(feature = "std"))]
        libm::sqrtf(self)
    }
    #[inline]
    fn reciprocal_above(self, floor: Self) -> Self {
        // A mask on the quotient, no branch: lanes stay together. NaN is not below the floor.
        let reciprocal = 1.0 / self;
        if self <= floor {
            0.0
        } else {
            reciprocal
        }
    }
    #[inline]
    fn rank_tolerance() -> Self {
        1e-5
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reciprocal_above_floor() {
        assert_eq!(4.0_f64.reciprocal_above(1.0), 0.25);
        assert_eq!(4.0_f32.reciprocal_above(1.0), 0.25);
        assert_eq!(1.0_f64.reciprocal_above(1.0), 0.0);
        assert_eq!(0.0_f64.reciprocal_above(0.0).to_bits(), 0);
        assert_eq!((-1e-20_f64).reciprocal_above(0.0), 0.0);
        assert_eq!(f64::INFINITY.reciprocal_above(1.0), 0.0);
        assert!(f64::NAN.reciprocal_above(1.0).is_nan());
        assert!(f32::NAN.reciprocal_above(1.0).is_nan());
    }
}
