//! Numbers of the main path: floats, and whatever a code generator makes of them.

use core::marker::PhantomData;
use core::ops::{Add, Mul, Neg, Sub};

/// A number that the main path computes with: a float `F` in one of the arithmetics, or what a code generator makes of
/// it.
pub trait Number<F>: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> {
    /// Number of quarter turns, of which the last two bits count.
    type Quadrant: Copy;

    /// Whether [`Number::fma`] rounds once.
    const FUSED: bool;

    /// A constant.
    fn constant(self, x: F) -> Self;

    /// `self · b + c`.
    fn fma(self, b: Self, c: Self) -> Self;

    /// The quadrant of a whole number `n`. The last two bits of `shifted`, the number before 1.5 · 2^(mantissa bits)
    /// was subtracted, are those of `n`.
    fn quadrant(shifted: Self, n: Self) -> Self::Quadrant;

    /// Sine and cosine of an angle that is so many quarter turns larger.
    fn turned(quadrant: Self::Quadrant, sin: Self, cos: Self) -> (Self, Self);
}

/// A float in an arithmetic.
#[derive(Clone, Copy)]
pub(super) struct In<A, F> {
    pub number: F,
    arithmetic: PhantomData<A>,
}

impl<A, F> In<A, F> {
    #[inline(always)]
    pub fn new(number: F) -> Self {
        In { number, arithmetic: PhantomData }
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident;)+) => {
        $(impl<A, F: $operator<Output = F>> $operator for In<A, F> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                In::new(self.number.$method(b.number))
            }
        })+
    };
}

operators! {
    Add add;
    Sub sub;
    Mul mul;
}

impl<A, F: Neg<Output = F>> Neg for In<A, F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        In::new(-self.number)
    }
}
