//! Evaluation of programs in several states at once.

use std::ops::{Add, Div, Mul, Neg, Sub};

use mbd_runtime::Scalar;

use crate::symbolic::Program;

/// Number of states that are evaluated at once.
pub const LANES: usize = 8;

/// One number in every state.
#[derive(Clone, Copy)]
struct Lanes([f64; LANES]);

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline]
            fn $name(self, other: Self) -> Self {
                Lanes(std::array::from_fn(|k| $trait::$name(self.0[k], other.0[k])))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

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
