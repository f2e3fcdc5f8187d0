//! Double-double numbers as a scalar: what rounding errors are measured against.

use std::ops::{Add, Div, Mul, Neg, Sub};

use mbd_runtime::Scalar;
use twofloat::TwoFloat;

/// A double-double number, 106 bits. Sines and cosines are rounded to 53 bits, those that programs on doubles compute: they
/// are inputs of the algebra, the same in every form, and what is compared are the roundings after them.
#[derive(Clone, Copy, Debug)]
pub struct Wide(pub TwoFloat);

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl $trait for Wide {
            type Output = Wide;
            #[inline]
            fn $name(self, other: Wide) -> Wide {
                Wide($trait::$name(self.0, other.0))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl Neg for Wide {
    type Output = Wide;
    fn neg(self) -> Wide {
        Wide(-self.0)
    }
}

impl Scalar for Wide {
    fn constant(x: f64) -> Self {
        Wide(x.into())
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Scalar::sin_cos(self.0.hi());
        (Self::constant(s), Self::constant(c))
    }
    fn sqrt(self) -> Self {
        Wide(self.0.sqrt())
    }
}
