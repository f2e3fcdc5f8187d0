//! The number types with which a sweep can be run.

use crate::constant::Constant;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// A number type with the four operations, sine, cosine, square root and a guarded reciprocal. There is no comparison
/// and no conversion to `f64`. A sweep over a `Scalar` therefore cannot branch on a value: with every type it performs
/// the same operations in the same order.
pub trait Scalar:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Whether the processor itself computes with these numbers. Then the interpreter has a second copy of the rates, for
    /// [plain](crate::tree::Tree::is_plain) trees; others would gain little by what takes long to compile.
    const IS_NATIVE: bool = false;
    /// How many numbers one of these stands for: as many as the lanes of [`Packed`](crate::Packed), otherwise one.
    const LANES: usize = 1;
    /// A constant, rounded to the precision of the type.
    fn constant(x: f64) -> Self;
    /// A constant with more digits than a double, rounded to the precision of the type.
    #[inline]
    fn rounded(x: Constant) -> Self {
        Self::constant(x.hi()) + Self::constant(x.lo())
    }
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// Square root.
    fn sqrt(self) -> Self;
    /// `1 / self` where `self` is above `floor`, and zero elsewhere: the inverse of the pivot of a row that may be
    /// redundant. Zero leaves the row out, where too little of its diagonal entry remains. `floor` must not be
    /// negative. If `self` is NaN, so is the result.
    fn reciprocal_above(self, floor: Self) -> Self;
    /// The entry of a table: that with the number of the largest whole number up to `self`, plus `offset`. Below the first
    /// entry it is the first one plus `offset`, behind the last one it is the last one, and for NaN the first one. It is
    /// constant between whole numbers, so that its derivative is zero.
    fn look_up(self, table: &'static [f64], offset: usize) -> Self;
    /// The same number without its derivatives, where it has any: for the steps of an iteration whose last steps give the
    /// result its derivatives.
    #[inline]
    fn still(self) -> Self {
        self
    }
    /// Fraction of the diagonal entries of the rows of a constraint: where less than this fraction remains of one row
    /// after the rows before it have been eliminated, the row is left out. At a distance `s` from a position where a
    /// row becomes dependent, `s²` remains of it; an error `φ` of the positions rotates the direction of motion there
    /// by `φ/s²`. The row is therefore left out before round-off of the positions can do that, and not much earlier,
    /// because the bodies are free along it while it is left out.
    fn rank_tolerance() -> Self {
        Self::constant(4e-9)
    }

    /// The node of a graph of operations that a symbolic scalar stands for, and whether it stands for the negative.
    /// Numbers have none. Only for [`Trace::name`](crate::sweep::Trace::name): a sweep that asked would not be the same
    /// on numbers.
    #[inline]
    fn node(self) -> Option<(u32, bool)> {
        None
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

/// [`Scalar::look_up`] for a double; 0 where the table is empty.
#[inline]
fn entry(x: f64, table: &[f64], offset: usize) -> f64 {
    // The conversion is to zero where `x` is negative or NaN.
    let k = (x as usize).saturating_add(offset).min(table.len().saturating_sub(1));
    table.get(k).copied().unwrap_or(0.0)
}

impl Scalar for f64 {
    const IS_NATIVE: bool = true;
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
        // Both square roots are correctly rounded and give the same bits.
        #[cfg(feature = "std")]
        return f64::sqrt(self);
        #[cfg(not(feature = "std"))]
        libm::sqrt(self)
    }
    #[inline]
    fn reciprocal_above(self, floor: Self) -> Self {
        // This compiles to a mask on the quotient, without a branch, so that lanes vectorise. NaN is not below the
        // floor.
        let reciprocal = 1.0 / self;
        if self <= floor {
            0.0
        } else {
            reciprocal
        }
    }
    #[inline]
    fn look_up(self, table: &'static [f64], offset: usize) -> Self {
        entry(self, table, offset)
    }
}

impl Scalar for f32 {
    const IS_NATIVE: bool = true;
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
        // Both square roots are correctly rounded and give the same bits.
        #[cfg(feature = "std")]
        return f32::sqrt(self);
        #[cfg(not(feature = "std"))]
        libm::sqrtf(self)
    }
    #[inline]
    fn reciprocal_above(self, floor: Self) -> Self {
        // This compiles to a mask on the quotient, without a branch, so that lanes vectorise. NaN is not below the
        // floor.
        let reciprocal = 1.0 / self;
        if self <= floor {
            0.0
        } else {
            reciprocal
        }
    }
    #[inline]
    fn look_up(self, table: &'static [f64], offset: usize) -> Self {
        entry(f64::from(self), table, offset) as f32
    }
    #[inline]
    fn rank_tolerance() -> Self {
        1e-5
    }
}

impl Constant {
    /// The constant in a number type, rounded once; for `f64` it is the nearest double.
    #[inline]
    pub fn get<S: Scalar>(self) -> S {
        S::rounded(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_of_tables() {
        static TABLE: [f64; 4] = [10.0, 11.0, 12.0, 13.5];
        let at = |x: f64, offset| x.look_up(&TABLE, offset);
        assert_eq!(
            [-1e300, -0.5, 0.0, 0.99, 1.0, 3.7, 4.0, 1e300].map(|x| at(x, 0)),
            [10.0, 10.0, 10.0, 10.0, 11.0, 13.5, 13.5, 13.5]
        );
        assert_eq!([-3.0, 1.5, 2.0, f64::INFINITY].map(|x| at(x, 1)), [11.0, 12.0, 13.5, 13.5]);
        assert_eq!((at(f64::NAN, 0), 1.5_f32.look_up(&TABLE, 9), 2.0.look_up(&[], 0)), (10.0, 13.5, 0.0));
    }

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
