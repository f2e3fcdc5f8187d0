//! Sine and cosine of intervals.
//!
//! A single angle `x` is reduced to `y = x − n π/2`, with `|y|` below 0.79, in interval arithmetic: π/2 is the sum of
//! three numbers whose products with `n` are exact, and an interval with the rest in it. Taylor series of both
//! functions in interval arithmetic, with the bounds of their remainders, enclose sine and cosine of `y`. Over an
//! interval, both are monotonic between the multiples of π/2: the bounds are those at the ends, and ±1 where such a
//! multiple may lie inside.

use super::{next_down, next_up, Interval};
use crate::Scalar;

/// The first 99 bits of π/2 in three parts of 33 bits, those of fdlibm.
const PARTS: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_711_166_5e-21];
/// The rest of π/2, rounded.
const REST: f64 = 8.478_427_660_368_9e-32;
/// Largest angle, rad. Beyond it, products of `n` and the parts of π/2 are not exact, and nothing is known.
const LARGEST: f64 = 1.0e6;
/// 2/π, rounded.
const INVERSE: f64 = core::f64::consts::FRAC_2_PI;
/// Larger than the error of `x · 2/π` as it is computed, for every `|x|` up to [`LARGEST`], in quarter turns.
const DOUBT: f64 = 1e-9;

/// `1/k!`, between its neighbours where it is no double; `k!` is one up to 22.
const fn reciprocal(k: u32) -> Interval {
    let (mut factorial, mut i) = (1.0, 1);
    while i <= k {
        factorial *= i as f64;
        i += 1;
    }
    let nearest = 1.0 / factorial;
    if k <= 2 {
        return Interval { low: nearest, high: nearest };
    }
    Interval { low: next_down(nearest), high: next_up(nearest) }
}

/// Coefficients of the Taylor series in `y²`, last first: of `(sin y)/y` from `k` = 21 on, of `cos y` from 22 on.
const fn series(last: u32) -> [Interval; 11] {
    let mut list = [reciprocal(last); 11];
    let mut i = 0;
    while i < 11 {
        let k = last - 2 * i as u32;
        let term = reciprocal(k);
        list[i] = if (k / 2) % 2 == 0 { term } else { Interval { low: -term.high, high: -term.low } };
        i += 1;
    }
    list
}
const SINE: [Interval; 11] = series(21);
const COSINE: [Interval; 11] = series(22);
/// `0.79²²/23!` and `0.79²⁴/24!`, rounded up: the remainders.
const SINE_REMAINDER: Interval = Interval { low: -2.2e-25, high: 2.2e-25 };
const COSINE_REMAINDER: Interval = Interval { low: -5.7e-27, high: 5.7e-27 };

const UNIT: Interval = Interval { low: -1.0, high: 1.0 };

/// Sine and cosine of every angle of an interval, rad.
pub fn sin_cos(x: Interval) -> (Interval, Interval) {
    if !x.is_bounded() {
        return (Interval::ENTIRE, Interval::ENTIRE);
    }
    if x.magnitude() > LARGEST {
        return (UNIT, UNIT);
    }
    let (s, c) = of_point(x.low);
    if x.low == x.high {
        return (s, c);
    }
    let (s2, c2) = of_point(x.high);
    let (mut s, mut c) = (s.hull(s2), c.hull(c2));
    // Multiples of π/2 in the interval, and those that may be. Five in a row have all four extrema among them.
    let first = libm::ceil(x.low * INVERSE - DOUBT) as i64;
    let last = libm::floor(x.high * INVERSE + DOUBT) as i64;
    for k in first..=last.min(first + 4) {
        let (function, extremum) = match k.rem_euclid(4) {
            0 => (&mut c, 1.0),
            1 => (&mut s, 1.0),
            2 => (&mut c, -1.0),
            _ => (&mut s, -1.0),
        };
        *function = function.hull(Interval { low: extremum, high: extremum });
    }
    (s, c)
}

/// Sine and cosine of one angle, rad.
fn of_point(x: f64) -> (Interval, Interval) {
    if x == 0.0 {
        return (Interval::zero(), Interval::one());
    }
    let turns = libm::rint(x * INVERSE);
    let n = Interval::point(turns);
    let y = PARTS.iter().fold(Interval::point(x), |y, part| y - n * Interval::point(*part));
    let y = y - n * Interval { low: next_down(REST), high: next_up(REST) };
    let square = y * y;
    let sum = |terms: &[Interval]| {
        let (first, rest) = terms.split_first().unwrap_or((&UNIT, &[]));
        rest.iter().fold(*first, |sum, term| sum * square + *term)
    };
    let s = y * (sum(&SINE) + SINE_REMAINDER);
    // Its last coefficient, 1, stands after the terms.
    let c = sum(&COSINE) * square + Interval::one() + COSINE_REMAINDER;
    let (s, c) = (within(s), within(c));
    match (turns as i64).rem_euclid(4) {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Bounds beyond ±1 are none of sines.
fn within(x: Interval) -> Interval {
    Interval { low: x.low.max(-1.0), high: x.high.min(1.0) }
}
