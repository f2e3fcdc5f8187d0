//! Dual numbers: values with a derivative.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::{Real, Scalar};

/// `re + ε du` with `ε² = 0`: a value and its derivative along one direction, exact to rounding.
///
/// A sweep that runs on dual numbers computes its own derivative: from `q + ε q̇` and `v + ε v̇` it computes the
/// momenta `p + ε ṗ`. Dual numbers can be nested: `Dual<Dual<f64>>` carries second derivatives.
///
/// Their order is that of numbers with a positive infinitesimal `ε`: values first, derivatives where values are equal.
/// An integrator that runs on dual numbers therefore makes the steps that it makes on the values alone, and carries the
/// derivative of its own result along: the tangent flow.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Dual<S> {
    /// Value.
    pub re: S,
    /// Derivative.
    pub du: S,
}

impl<S> Dual<S> {
    /// A value and its derivative.
    pub const fn new(re: S, du: S) -> Self {
        Dual { re, du }
    }
}

impl<S: Scalar> Add for Dual<S> {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Dual::new(self.re + o.re, self.du + o.du)
    }
}

impl<S: Scalar> Sub for Dual<S> {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Dual::new(self.re - o.re, self.du - o.du)
    }
}

impl<S: Scalar> Mul for Dual<S> {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Dual::new(self.re * o.re, self.re * o.du + self.du * o.re)
    }
}

impl<S: Scalar> Div for Dual<S> {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let re = self.re / o.re;
        Dual::new(re, (self.du - re * o.du) / o.re)
    }
}

impl<S: Scalar> Neg for Dual<S> {
    type Output = Self;
    fn neg(self) -> Self {
        Dual::new(-self.re, -self.du)
    }
}

impl<S: Scalar> Scalar for Dual<S> {
    fn constant(x: f64) -> Self {
        Dual::new(S::constant(x), S::zero())
    }

    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.re.sin_cos();
        (Dual::new(s, c * self.du), Dual::new(c, -(s * self.du)))
    }

    fn sqrt(self) -> Self {
        let re = self.re.sqrt();
        Dual::new(re, self.du / (re + re))
    }

    fn reciprocal_above(self, floor: Self) -> Self {
        let re = self.re.reciprocal_above(floor.re);
        Dual::new(re, -(re * re * self.du))
    }

    fn look_up(self, table: &'static [f64], offset: usize) -> Self {
        Dual::new(self.re.look_up(table, offset), S::zero())
    }

    fn still(self) -> Self {
        Dual::new(self.re.still(), S::zero())
    }

    fn node(self) -> Option<(u32, bool)> {
        self.re.node()
    }

    fn rank_tolerance() -> Self {
        Dual::new(S::rank_tolerance(), S::zero())
    }
}

impl<S: Real> Real for Dual<S> {
    fn is_finite(self) -> bool {
        self.re.is_finite() && self.du.is_finite()
    }
    fn to_f64(self) -> f64 {
        self.re.to_f64()
    }
    fn epsilon() -> f64 {
        S::epsilon()
    }
    fn derivative(self) -> Option<f64> {
        Some(self.du.to_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivative of `f` at `x`.
    fn slope(f: impl Fn(Dual<f64>) -> Dual<f64>, x: f64) -> f64 {
        f(Dual::new(x, 1.0)).du
    }

    #[test]
    fn derivatives() {
        let c = Dual::<f64>::constant;
        let near = |a: f64, b: f64| assert!((a - b).abs() <= 4.0 * f64::EPSILON * b.abs(), "{a} {b}");
        near(slope(|x| x * x - x, 3.0), 5.0);
        near(slope(|x| c(2.0) / (x + c(1.0)), 3.0), -0.125);
        near(slope(|x| -(x.sqrt()), 4.0), -0.25);
        near(slope(|x| x.reciprocal_above(c(1.0)), 2.0), -0.25);
        assert_eq!(slope(|x| x.reciprocal_above(c(1.0)), 0.5), 0.0);
        near(slope(|x| x.sin_cos().0, 0.5), crate::trig::sincos_f64(0.5).1);
        near(slope(|x| x.sin_cos().1, 0.5), -crate::trig::sincos_f64(0.5).0);
    }

    #[test]
    fn order_is_that_of_infinitesimals() {
        let (x, more) = (Dual::new(1.0, 0.0), Dual::new(1.0, 1e-9));
        assert!(x < more && more < Dual::new(1.5, -1e9) && Real::abs(-more) == more);
        assert!(Real::is_finite(more) && !Real::is_finite(Dual::new(1.0, f64::NAN)));
    }

    #[test]
    fn second_derivative() {
        let x = Dual::new(Dual::new(2.0, 1.0), Dual::new(1.0, 0.0));
        assert_eq!((x * x * x).du.du, 12.0);
    }
}
