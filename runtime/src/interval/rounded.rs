//! Operations on doubles, rounded up or down.
//!
//! A rounded result is one of the two neighbours of the exact one. The sign of its error, which is computed exactly,
//! says which. Where products come near the ends of the range of exponents, the error may not be a double; the neighbour
//! is taken then, which is always a bound. Overflow gives an infinite bound or NaN.

use crate::Scalar;

/// Products and quotients are exact in two doubles where all numbers lie in this range.
const LEAST: f64 = f64::from_bits((1023 - 900) << 52);
const MOST: f64 = f64::from_bits((1023 + 900) << 52);

/// The next larger double.
pub const fn next_up(x: f64) -> f64 {
    let bits = x.to_bits();
    if x == 0.0 {
        f64::from_bits(1)
    } else if x > 0.0 && x < f64::INFINITY {
        f64::from_bits(bits + 1)
    } else if x < 0.0 {
        f64::from_bits(bits - 1)
    } else {
        x
    }
}

/// The next smaller double.
pub const fn next_down(x: f64) -> f64 {
    -next_up(-x)
}

/// A bound above a result from its rounded value and the sign of exact − rounded.
fn raise(rounded: f64, error: f64) -> f64 {
    // An error that is NaN says nothing.
    if error <= 0.0 {
        rounded
    } else {
        next_up(rounded)
    }
}

/// Knuth: what rounding takes from `a + b`.
fn sum_error(a: f64, b: f64, sum: f64) -> f64 {
    let part = sum - a;
    (a - (sum - part)) + (b - part)
}

/// Dekker: what rounding takes from `a b`. Numbers are in range.
fn product_error(a: f64, b: f64, product: f64) -> f64 {
    let halves = |x: f64| {
        let t = 134_217_729.0 * x;
        let high = t - (t - x);
        (high, x - high)
    };
    let ((ah, al), (bh, bl)) = (halves(a), halves(b));
    ((ah * bh - product) + ah * bl + al * bh) + al * bl
}

fn in_range(x: f64) -> bool {
    (LEAST..=MOST).contains(&x.abs())
}

/// `a + b`, rounded up.
pub fn sum_up(a: f64, b: f64) -> f64 {
    let sum = a + b;
    raise(sum, sum_error(a, b, sum))
}

/// `a + b`, rounded down.
pub fn sum_down(a: f64, b: f64) -> f64 {
    -sum_up(-a, -b)
}

/// `a b`, rounded up.
pub fn product_up(a: f64, b: f64) -> f64 {
    let product = a * b;
    if a == 0.0 || b == 0.0 {
        return product;
    }
    match in_range(a) && in_range(b) && in_range(product) {
        true => raise(product, product_error(a, b, product)),
        false => next_up(product),
    }
}

/// `a b`, rounded down.
pub fn product_down(a: f64, b: f64) -> f64 {
    -product_up(-a, b)
}

/// `a / b`, rounded up; `b` is not zero.
pub fn quotient_up(a: f64, b: f64) -> f64 {
    let quotient = a / b;
    if a == 0.0 {
        return quotient;
    }
    if !(in_range(a) && in_range(b) && in_range(quotient)) {
        return next_up(quotient);
    }
    // The remainder of a correctly rounded quotient is a double.
    let back = quotient * b;
    let rest = (a - back) - product_error(quotient, b, back);
    raise(quotient, if b > 0.0 { rest } else { -rest })
}

/// `a / b`, rounded down; `b` is not zero.
pub fn quotient_down(a: f64, b: f64) -> f64 {
    -quotient_up(-a, b)
}

/// What the square of a rounded root lacks to `x`: its sign; NaN where that is not known.
fn root_error(x: f64, root: f64) -> f64 {
    if !(in_range(x) && in_range(root)) {
        return if x == 0.0 { 0.0 } else { f64::NAN };
    }
    let square = root * root;
    (x - square) - product_error(root, root, square)
}

/// `√x`, rounded up; `x` is not negative.
pub fn root_up(x: f64) -> f64 {
    let root = Scalar::sqrt(x);
    raise(root, root_error(x, root))
}

/// `√x`, rounded down and not below zero; `x` is not negative.
pub fn root_down(x: f64) -> f64 {
    let root = Scalar::sqrt(x);
    let error = root_error(x, root);
    if error >= 0.0 {
        root
    } else {
        next_down(root).max(0.0)
    }
}
