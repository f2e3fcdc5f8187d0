//! The numbers a sweep may be run with.

use crate::integrate::Constant;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// A field with sine, cosine and square root, and nothing else: no comparison and no way out to `f64`, so a sweep
/// written over it cannot branch on a value and every instance performs the same operations in the same order.
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
}
