//! Real constants to about 100 bits, evaluated by the compiler.

/// A real constant as a sum of two doubles: the nearest double and the remainder, with a relative error of 2⁻¹⁰⁰.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    hi: f64,
    lo: f64,
    /// `hi` in single precision, stored because small processors convert in software only.
    single: f32,
}

impl Constant {
    /// Zero.
    pub const ZERO: Constant = Constant::pair(0.0, 0.0);

    const fn pair(hi: f64, lo: f64) -> Constant {
        Constant { hi, lo, single: hi as f32 }
    }

    /// The constant with these parts, which were those of one.
    #[inline]
    pub(crate) const fn of_parts(hi: f64, lo: f64, single: f32) -> Constant {
        Constant { hi, lo, single }
    }

    /// Whether it is zero, so that a term with it need not be added.
    #[inline]
    pub const fn is_zero(self) -> bool {
        self.hi == 0.0
    }

    /// The nearest number of single precision.
    #[inline]
    pub const fn single(self) -> f32 {
        self.single
    }

    /// The remainder after the nearest double.
    #[inline]
    pub const fn lo(self) -> f64 {
        self.lo
    }

    /// The nearest double.
    #[inline]
    pub const fn hi(self) -> f64 {
        self.hi
    }

    /// `a + b`, normalized; exact for any two doubles (Knuth).
    const fn sum(a: f64, b: f64) -> Constant {
        let hi = a + b;
        let part = hi - a;
        Constant::pair(hi, (a - (hi - part)) + (b - part))
    }

    /// `a b`, exact (Dekker; constants are far from overflow).
    const fn product(a: f64, b: f64) -> Constant {
        let hi = a * b;
        let ((ah, al), (bh, bl)) = (halves(a), halves(b));
        Constant::pair(hi, ((ah * bh - hi) + ah * bl + al * bh) + al * bl)
    }

    pub(crate) const fn times(self, b: f64) -> Constant {
        let p = Constant::product(self.hi, b);
        Constant::sum(p.hi, p.lo + self.lo * b)
    }

    pub(crate) const fn minus(self, other: Constant) -> Constant {
        let (h, l) = (Constant::sum(self.hi, -other.hi), Constant::sum(self.lo, -other.lo));
        let s = Constant::sum(h.hi, h.lo + l.hi);
        Constant::sum(s.hi, s.lo + l.lo)
    }

    /// Long division: three digits of 53 bits each, the last one for rounding.
    pub(crate) const fn over(self, other: Constant) -> Constant {
        let first = self.hi / other.hi;
        let rest = self.minus(other.times(first));
        let second = rest.hi / other.hi;
        let rest = rest.minus(other.times(second));
        let q = Constant::sum(first, second);
        Constant::sum(q.hi, q.lo + rest.hi / other.hi)
    }

    /// An integer below 2¹²⁷: to 106 bits.
    pub(crate) const fn integer(n: u128) -> Constant {
        let hi = n as f64;
        Constant::sum(hi, (n as i128 - hi as i128) as f64)
    }

    const fn negated_if(self, negative: bool) -> Constant {
        match negative {
            true => Constant::pair(-self.hi, -self.lo),
            false => self,
        }
    }
}

/// The upper 26 bits of a double and the rest (Veltkamp).
const fn halves(a: f64) -> (f64, f64) {
    let t = 134_217_729.0 * a;
    let high = t - (t - a);
    (high, a - high)
}

/// `n / d`.
///
/// # Panics
/// If `d` is zero; in a constant, the compiler reports it.
pub const fn ratio(n: i64, d: i64) -> Constant {
    assert!(d != 0, "a ratio has a denominator other than zero");
    let magnitude = Constant::integer(n.unsigned_abs() as u128).over(Constant::integer(d.unsigned_abs() as u128));
    magnitude.negated_if((n < 0) != (d < 0))
}

/// A decimal number of at most 38 digits: `-0.5`, `1.25e-3`, `7`.
///
/// # Panics
/// If the text is anything else; in a constant, the compiler reports it.
pub const fn decimal(text: &str) -> Constant {
    let text = text.as_bytes();
    let (value, end) = number(text, 0);
    assert!(end == text.len(), "a decimal number is a sign, digits, a point, an exponent");
    value
}

/// Exactly `N` numbers of a text, separated by spaces: decimals or ratios, `2/55`.
///
/// # Panics
/// If they are not `N` numbers; in a constant, the compiler reports it.
pub const fn list<const N: usize>(text: &str) -> [Constant; N] {
    let (list, len) = row(text);
    assert!(len == N, "the text has fewer numbers than the list");
    list
}

/// A strictly lower triangular matrix of a text a row: row `i` has `i` numbers.
///
/// # Panics
/// If it does not; in a constant, the compiler reports it.
pub const fn lower<const N: usize>(rows: [&str; N]) -> [[Constant; N]; N] {
    let mut matrix = [[Constant::ZERO; N]; N];
    let mut i = 0;
    while i < N {
        let (numbers, len) = row(rows[i]);
        assert!(len == i, "row i of a strictly lower triangular matrix has i numbers");
        matrix[i] = numbers;
        i += 1;
    }
    matrix
}

/// At most `N` numbers, how many they are, and zeros after them.
const fn row<const N: usize>(text: &str) -> ([Constant; N], usize) {
    let text = text.as_bytes();
    let mut list = [Constant::ZERO; N];
    let (mut at, mut len) = (0, 0);
    while at < text.len() {
        if text[at] == b' ' {
            at += 1;
            continue;
        }
        assert!(len < N, "the text has more numbers than the list");
        (list[len], at) = number(text, at);
        if at < text.len() && text[at] == b'/' {
            let (below, end) = number(text, at + 1);
            assert!(below.hi != 0.0, "a ratio has a denominator other than zero");
            (list[len], at) = (list[len].over(below), end);
        }
        assert!(at == text.len() || text[at] == b' ', "numbers are separated by spaces");
        len += 1;
    }
    (list, len)
}

/// The decimal number that starts at a place in a text, and where it ends.
const fn number(text: &[u8], start: usize) -> (Constant, usize) {
    let mut at = start;
    let negative = at < text.len() && text[at] == b'-';
    at += negative as usize;
    let (mut mantissa, mut exponent, mut digits, mut point) = (0_u128, 0_i32, 0, false);
    while at < text.len() && (text[at].is_ascii_digit() || (text[at] == b'.' && !point)) {
        match text[at] {
            b'.' => point = true,
            digit => {
                assert!(mantissa < 10_u128.pow(37), "a constant has at most 38 digits");
                mantissa = 10 * mantissa + (digit - b'0') as u128;
                exponent -= point as i32;
                digits += 1;
            }
        }
        at += 1;
    }
    assert!(digits > 0, "a number has digits");
    if at < text.len() && text[at] == b'e' {
        let (power, end) = exponent_at(text, at + 1);
        (exponent, at) = (exponent + power, end);
    }
    (scaled(mantissa, exponent).negated_if(negative), at)
}

/// The exponent that starts at a place in a text, and where it ends.
const fn exponent_at(text: &[u8], start: usize) -> (i32, usize) {
    let mut at = start;
    let negative = at < text.len() && text[at] == b'-';
    at += negative as usize;
    let (first, mut power) = (at, 0_i32);
    while at < text.len() && text[at].is_ascii_digit() {
        power = 10 * power + (text[at] - b'0') as i32;
        assert!(power <= 100, "exponents of constants are at most 100");
        at += 1;
    }
    assert!(at > first, "an exponent has digits");
    (if negative { -power } else { power }, at)
}

/// `m 10ᵉ`.
const fn scaled(m: u128, e: i32) -> Constant {
    let m = Constant::integer(m);
    match e < 0 {
        true => m.over(ten_to(-e)),
        false => {
            let t = ten_to(e);
            let p = Constant::product(m.hi, t.hi);
            Constant::sum(p.hi, p.lo + (m.hi * t.lo + m.lo * t.hi))
        }
    }
}

/// Powers of ten. Up to 10²² they are doubles, up to 10⁴⁴ exact in two.
const fn ten_to(e: i32) -> Constant {
    let (mut power, mut left) = (Constant::pair(1.0, 0.0), e);
    while left > 0 {
        let step = if left > 22 { 22 } else { left };
        power = power.times(10_u128.pow(step as u32) as f64);
        left -= step;
    }
    power
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    /// Nearest doubles and remainders, from 60 digits of arithmetic.
    #[test]
    fn values() {
        let known = [
            (decimal("0.1"), 0.1, -5.551_115_123_125_783e-18),
            (ratio(1, 3), 1.0 / 3.0, 1.850_371_707_708_594e-17),
            (ratio(-7, 9), -7.0 / 9.0, 1.233_581_138_472_396_2e-17),
            (decimal("3.1415926535897932384626433832795028842"), core::f64::consts::PI, 1.224_646_799_147_353_2e-16),
            (decimal("-2.5e3"), -2500.0, 0.0),
            (decimal("1e-30"), 1e-30, -8.333_642_060_758_598e-47),
            (decimal("0"), 0.0, 0.0),
        ];
        for (k, (c, hi, lo)) in known.into_iter().enumerate() {
            assert_eq!(c.hi, hi, "{k}");
            assert!((c.lo - lo).abs() <= 1e-31 * hi.abs(), "{k}: {:e} {lo:e}", c.lo);
            assert_eq!(c.get::<f64>(), hi);
            assert_eq!(c.get::<f32>(), hi as f32);
        }
    }

    #[test]
    fn division_and_text_agree() {
        assert_eq!(list::<3>(" 1/3  -7/9 0.25 "), [ratio(1, 3), ratio(-7, 9), decimal("0.25")]);
        let thirds = decimal("0.33333333333333333333333333333333333333");
        assert!((thirds.lo - ratio(1, 3).lo).abs() < 1e-31);
        let m = lower(["", "0.5", "-1 2"]);
        assert_eq!(m[2], [ratio(-1, 1), ratio(2, 1), Constant::ZERO]);
        assert!(m[1][2].is_zero() && !m[1][0].is_zero());
        // Nearest doubles are those that the compiler reads.
        assert_eq!(decimal("0.4179e-3").hi(), 0.4179e-3);
    }

    #[test]
    fn bad_text_panics() {
        let bad = ["", "-", "1.2.3", "1e", "x", "1 2", "1/2", "123456789012345678901234567890123456789", "1e101"];
        for text in bad {
            assert!(std::panic::catch_unwind(|| decimal(text)).is_err(), "{text}");
        }
        for text in ["1 2", "1 2 3 4", "1 2 3/0", "1,2,3"] {
            assert!(std::panic::catch_unwind(|| list::<3>(text)).is_err(), "{text}");
        }
    }
}
