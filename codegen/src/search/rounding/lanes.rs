//! Evaluation of programs in several states at once.

use std::ops::{Add, Div, Mul, Neg, Sub};

use mbd_runtime::Scalar;

use crate::symbolic::Program;

/// Number of states that are evaluated at once.
pub const LANES: usize = 8;

/// One number in every state.
#[derive(Clone, Copy)]
struct Lanes([f64; LANES]);

/// Written out, because generators that run in macros are not optimised: with a closure for each lane, evaluations took nearly three
/// times as long there.
macro_rules! operator {
    ($trait:ident, $name:ident, $operator:tt) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline]
            fn $name(self, other: Self) -> Self {
                let [a0, a1, a2, a3, a4, a5, a6, a7] = self.0;
                let [b0, b1, b2, b3, b4, b5, b6, b7] = other.0;
                Lanes([
                    a0 $operator b0,
                    a1 $operator b1,
                    a2 $operator b2,
                    a3 $operator b3,
                    a4 $operator b4,
                    a5 $operator b5,
                    a6 $operator b6,
                    a7 $operator b7,
                ])
            }
        }
    };
}
operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl Neg for Lanes {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Lanes(self.0.map(|x| -x))
    }
}

impl Scalar for Lanes {
    fn constant(x: f64) -> Self {
        Lanes([x; LANES])
    }
    fn sin_cos(self) -> (Self, Self) {
        let both = self.0.map(Scalar::sin_cos);
        (Lanes(both.map(|(s, _)| s)), Lanes(both.map(|(_, c)| c)))
    }
    fn sqrt(self) -> Self {
        Lanes(self.0.map(Scalar::sqrt))
    }
    fn reciprocal_above(self, floor: Self) -> Self {
        Lanes(std::array::from_fn(|k| self.0[k].reciprocal_above(floor.0[k])))
    }
    fn look_up(self, table: &'static [f64], offset: usize) -> Self {
        Lanes(self.0.map(|x| x.look_up(table, offset)))
    }
}

/// Results of a program.
pub fn run(program: &Program, inputs: &[[f64; LANES]]) -> Vec<[f64; LANES]> {
    let inputs: Vec<Lanes> = inputs.iter().map(|x| Lanes(*x)).collect();
    program.evaluate(&inputs, |a, b, c| a * b + c).into_iter().map(|x| x.0).collect()
}
