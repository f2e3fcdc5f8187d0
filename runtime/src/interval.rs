//! Intervals as a scalar: guaranteed enclosures of what the sweeps compute.
//!
//! Every operation returns an interval that contains the results for all numbers of its operands, in exact arithmetic.
//! A sweep over intervals therefore encloses its exact result: over single numbers, with a width that bounds the
//! rounding errors, and over wider intervals for all states in them. Bounds are rounded outward without changing the
//! rounding mode of the processor: the error of a rounded operation is computed exactly (Knuth's sum, Dekker's
//! product), and its sign says which of the two neighbours the bound is. Exact operations widen nothing.
//!
//! An interval is bounded, or it is [`Interval::ENTIRE`]. That stands for no knowledge at all, the operation may not
//! even be defined (a quotient by an interval with zero in it, the root of one with negative numbers, an overflow), and
//! every operation on it gives it again. No bound is ever NaN.
//!
//! Enclosures of ranges are wider than the ranges: an operand that occurs twice counts as two that vary independently.
//! `Dual<Interval>` encloses derivatives, with which [`mean_value`] gives bounds whose excess falls with the square of
//! the width. R. E. Moore, R. B. Kearfott, M. J. Cloud, *Introduction to Interval Analysis*, 2009.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::constant::Constant;
use crate::{Dual, Scalar};

mod angle;
mod rounded;

use rounded::{
    next_down, next_up, product_down, product_up, quotient_down, quotient_up, root_down, root_up, sum_down, sum_up,
};

/// A closed interval of real numbers, see the module's text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    /// All numbers, and the possibility that there is none.
    pub const ENTIRE: Interval = Interval { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// The interval from `low` to `high`; `None` where these are not finite numbers in this order.
    pub fn new(low: f64, high: f64) -> Option<Interval> {
        (low.is_finite() && high.is_finite() && low <= high).then_some(Interval { low, high })
    }

    /// A single number; [`Interval::ENTIRE`] where that is not finite.
    pub fn point(x: f64) -> Interval {
        Interval::between(x, x)
    }

    /// From bounds that operations gave: what is not finite has no bound.
    fn between(low: f64, high: f64) -> Interval {
        Interval::new(low, high).unwrap_or(Interval::ENTIRE)
    }

    /// Lower bound, −∞ where there is none.
    pub fn low(self) -> f64 {
        self.low
    }

    /// Upper bound, ∞ where there is none.
    pub fn high(self) -> f64 {
        self.high
    }

    /// Whether there are bounds.
    pub fn is_bounded(self) -> bool {
        self.low.is_finite()
    }

    /// A number in the middle, rounded; zero without bounds.
    pub fn middle(self) -> f64 {
        if !self.is_bounded() {
            return 0.0;
        }
        // Halves before the sum, which could overflow; the bounds limit what rounding does to tiny numbers.
        (0.5 * self.low + 0.5 * self.high).clamp(self.low, self.high)
    }

    /// Distance of the bounds, rounded up.
    pub fn width(self) -> f64 {
        sum_up(self.high, -self.low)
    }

    /// Largest absolute value.
    pub fn magnitude(self) -> f64 {
        self.high.max(-self.low)
    }

    /// Whether a number lies in it.
    pub fn contains(self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    /// Largest distance of `x` from a number of the interval, rounded up: if the interval encloses an exact result, a
    /// bound on the error of the result `x`.
    pub fn distance(self, x: f64) -> f64 {
        sum_up(self.high, -x).max(sum_up(x, -self.low))
    }

    /// The smallest interval with both in it.
    pub fn hull(self, other: Interval) -> Interval {
        Interval::between(self.low.min(other.low), self.high.max(other.high))
    }

    /// What both contain. For enclosures of the same number: where rounding or an error leaves nothing, `None`.
    pub fn intersection(self, other: Interval) -> Option<Interval> {
        match (self.is_bounded(), other.is_bounded()) {
            (false, _) => Some(other),
            (_, false) => Some(self),
            _ => Interval::new(self.low.max(other.low), self.high.min(other.high)),
        }
    }

    /// Both halves; the whole twice where it is not bounded.
    pub fn halves(self) -> [Interval; 2] {
        if !self.is_bounded() {
            return [self; 2];
        }
        let middle = self.middle();
        [Interval { high: middle, ..self }, Interval { low: middle, ..self }]
    }
}

/// Mean value form: encloses `f` over a box from `f(c)` at a point of the box, and `∂f/∂xᵢ` over the box times `xᵢ −
/// cᵢ` for every side of the box. `f` must be differentiable in the box: no guarded reciprocal may be undecided.
pub fn mean_value(at_point: Interval, terms: impl Iterator<Item = (Interval, Interval)>) -> Interval {
    terms.fold(at_point, |sum, (slope, offset)| sum + slope * offset)
}

impl Add for Interval {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        if !(self.is_bounded() && o.is_bounded()) {
            return Interval::ENTIRE;
        }
        Interval::between(sum_down(self.low, o.low), sum_up(self.high, o.high))
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Interval { low: -self.high, high: -self.low }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        if !(self.is_bounded() && o.is_bounded()) {
            return Interval::ENTIRE;
        }
        let (Interval { low: a, high: b }, Interval { low: c, high: d }) = (self, o);
        // Which products are the bounds follows from the signs.
        let ((l1, l2), (h1, h2)) = match (a >= 0.0, b <= 0.0, c >= 0.0, d <= 0.0) {
            (true, _, true, _) => ((a, c), (b, d)),
            (true, _, _, true) => ((b, c), (a, d)),
            (true, ..) => ((b, c), (b, d)),
            (_, true, true, _) => ((a, d), (b, c)),
            (_, true, _, true) => ((b, d), (a, c)),
            (_, true, ..) => ((a, d), (a, c)),
            (_, _, true, _) => ((a, d), (b, d)),
            (_, _, _, true) => ((b, c), (a, c)),
            _ => {
                let low = product_down(a, d).min(product_down(b, c));
                return Interval::between(low, product_up(a, c).max(product_up(b, d)));
            }
        };
        Interval::between(product_down(l1, l2), product_up(h1, h2))
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        if !(self.is_bounded() && o.is_bounded()) || o.contains(0.0) {
            return Interval::ENTIRE;
        }
        let (above, below) = if o.low > 0.0 { (self, o) } else { (-self, -o) };
        let low = quotient_down(above.low, if above.low >= 0.0 { below.high } else { below.low });
        let high = quotient_up(above.high, if above.high >= 0.0 { below.low } else { below.high });
        Interval::between(low, high)
    }
}

impl Scalar for Interval {
    fn constant(x: f64) -> Self {
        Interval::point(x)
    }

    /// Such a constant has a relative error of 2⁻¹⁰⁰, unless it is a double.
    fn rounded(x: Constant) -> Self {
        if x.lo() == 0.0 {
            return Interval::point(x.hi());
        }
        let error = Interval::point(x.hi()) * Interval::point(1.0 / (1_u128 << 100) as f64);
        Interval::point(x.hi()) + (Interval::point(x.lo()) + error.hull(-error))
    }

    fn sin_cos(self) -> (Self, Self) {
        angle::sin_cos(self)
    }

    fn sqrt(self) -> Self {
        if !(self.is_bounded() && self.low >= 0.0) {
            return Interval::ENTIRE;
        }
        Interval::between(root_down(self.low), root_up(self.high))
    }

    /// Where it is not decided whether the number is above the floor, both results are enclosed.
    fn reciprocal_above(self, floor: Self) -> Self {
        if !(self.is_bounded() && floor.is_bounded()) {
            return Interval::ENTIRE;
        }
        if self.high <= floor.low {
            return Interval::zero();
        }
        if self.low > floor.high {
            return Interval::one() / self;
        }
        // The part above the floor, and zero.
        let above = Interval { low: self.low.max(floor.low), high: self.high };
        (Interval::one() / above).hull(Interval::zero())
    }

    /// Encloses all entries from that of one end to that of the other.
    fn look_up(self, table: &'static [f64], offset: usize) -> Self {
        let last = table.len().saturating_sub(1);
        let number = |x: f64| (x as usize).saturating_add(offset).min(last);
        let range = match self.is_bounded() {
            true => number(self.low)..=number(self.high),
            false => offset.min(last)..=last,
        };
        let entries = table.get(range).unwrap_or(&[]).iter().map(|x| Interval::point(*x));
        entries.reduce(Interval::hull).unwrap_or(Interval::zero())
    }
}

impl Dual<Interval> {
    /// Whether value and derivative have bounds.
    pub fn is_bounded(self) -> bool {
        self.re.is_bounded() && self.du.is_bounded()
    }
}

#[cfg(test)]
mod tests;
