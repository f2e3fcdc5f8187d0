//! Numbers as a processor with fused multiply-adds computes them in fast arithmetic.

use core::ops::{Add, Div, Mul, Neg, Sub};

use mbd_runtime::kernel::{Arithmetic, Fused as Once};
use mbd_runtime::trig::{pair_f32, pair_f64};
use mbd_runtime::Scalar;

/// A number type on which programs are run operation by operation.
pub trait Number: Scalar {
    /// `a · b + c`.
    fn fma(a: Self, b: Self, c: Self) -> Self {
        a * b + c
    }
    /// The number, which may be widened.
    fn widened(self) -> f64;
}

impl Number for f64 {
    fn widened(self) -> f64 {
        self
    }
}

impl Number for f32 {
    fn widened(self) -> f64 {
        f64::from(self)
    }
}

/// A number whose products and sums in fast arithmetic are rounded once, those in its sine and cosine included.
#[derive(Clone, Copy, Debug)]
pub struct Fused<F>(F);

macro_rules! operators {
    ($($operator:ident $method:ident;)+) => {
        $(impl<F: $operator<Output = F>> $operator for Fused<F> {
            type Output = Self;
            fn $method(self, b: Self) -> Self {
                Fused(self.0.$method(b.0))
            }
        })+
    };
}

operators! {
    Add add;
    Sub sub;
    Mul mul;
    Div div;
}

impl<F: Neg<Output = F>> Neg for Fused<F> {
    type Output = Self;
    fn neg(self) -> Self {
        Fused(-self.0)
    }
}

macro_rules! fused {
    ($float:ident, $pair:ident, $fma:ident) => {
        impl Scalar for Fused<$float> {
            fn constant(x: f64) -> Self {
                Fused($float::constant(x))
            }
            fn sin_cos(self) -> (Self, Self) {
                let (sin, cos) = $pair::<Once>(self.0);
                (Fused(sin), Fused(cos))
            }
            fn sqrt(self) -> Self {
                Fused(Scalar::sqrt(self.0))
            }
            fn reciprocal_above(self, floor: Self) -> Self {
                Fused(self.0.reciprocal_above(floor.0))
            }
            fn look_up(self, table: &'static [f64], offset: usize) -> Self {
                Fused(self.0.look_up(table, offset))
            }
        }

        impl Number for Fused<$float> {
            fn fma(a: Self, b: Self, c: Self) -> Self {
                Fused(Once::$fma(a.0, b.0, c.0))
            }
            fn widened(self) -> f64 {
                self.0.widened()
            }
        }
    };
}

fused!(f64, pair_f64, fma_f64);
fused!(f32, pair_f32, fma_f32);
