//! Against `astro-float-num`: enclosures must contain results of 256 bits, and be tight.

extern crate std;

use astro_float_num::{BigFloat, Consts, RoundingMode};
use std::vec::Vec;

use super::*;

const BITS: usize = 256;
const ROUND: RoundingMode = RoundingMode::ToEven;

fn big(x: f64) -> BigFloat {
    // Scaled, because the library reads subnormal doubles wrongly.
    let (up, down) = (2.0_f64.powi(500), 2.0_f64.powi(-500));
    match x.abs() < 1e-290 {
        true => BigFloat::from_f64(x * up, BITS).mul(&BigFloat::from_f64(down, BITS), BITS, ROUND),
        false => BigFloat::from_f64(x, BITS),
    }
}

/// Asserts that an interval contains an exact number.
#[track_caller]
fn encloses(x: Interval, exact: &BigFloat) {
    assert!(x.is_bounded(), "{x:?}");
    let below = big(x.low()).cmp(exact).expect("numbers") <= 0;
    let above = big(x.high()).cmp(exact).expect("numbers") >= 0;
    assert!(below && above, "{exact:?} is not in {x:?}");
}

/// Width in units of the last place of the larger bound.
fn ulps(x: Interval) -> f64 {
    x.width() / (next_up(x.magnitude()) - x.magnitude())
}

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 * 0.5_f64.powi(53)
    }

    /// A number of either sign, of sizes from 2⁻ᵇ to 2ᵇ.
    fn number(&mut self, b: f64) -> f64 {
        let size = (0.5 + self.unit()) * ((2.0 * self.unit() - 1.0) * b).exp2();
        size * if self.unit() < 0.5 { -1.0 } else { 1.0 }
    }

    /// A number of few bits, whose sums and products are often exact.
    fn short(&mut self) -> f64 {
        (self.unit() * 64.0).floor() - 32.0
    }
}

#[test]
fn single_numbers() {
    let mut random = Random(3);
    for k in 0..20_000 {
        // Also where errors of products are no doubles, and where results overflow or vanish.
        let (a, b) = match k % 4 {
            0 => (random.number(20.0), random.number(20.0)),
            1 => (random.number(500.0), random.number(500.0)),
            2 => (random.number(1000.0), random.number(1000.0)),
            _ => (random.short(), random.short()),
        };
        let widest = if matches!(k % 4, 0 | 3) { 1.0 } else { 2.0 };
        let (x, y) = (Interval::point(a), Interval::point(b));
        let exact = [
            (x + y, big(a).add(&big(b), BITS * 9, ROUND)),
            (x - y, big(a).sub(&big(b), BITS * 9, ROUND)),
            (x * y, big(a).mul(&big(b), BITS, ROUND)),
        ];
        for (found, exact) in exact {
            if found.is_bounded() {
                encloses(found, &exact);
                assert!(ulps(found) <= widest, "{found:?}");
            }
        }
        if b != 0.0 && (x / y).is_bounded() {
            encloses(x / y, &big(a).div(&big(b), BITS, ROUND));
            assert!(ulps(x / y) <= widest, "{:?}", x / y);
        }
        let root = Interval::point(a.abs()).sqrt();
        encloses(root, &big(a.abs()).sqrt(BITS, ROUND));
        assert!(ulps(root) <= 2.0);
        // Exact operations widen nothing.
        if k % 4 == 3 {
            assert!(x * y == Interval::point(a * b) && x + y == Interval::point(a + b));
            assert_eq!((x * x).sqrt(), Interval::point(a.abs()));
        }
    }
}

#[test]
fn numbers_of_intervals() {
    let mut random = Random(5);
    for _ in 0..20_000 {
        let draw = |random: &mut Random| {
            let (a, b) = (random.number(3.0), random.number(3.0));
            Interval::new(a.min(b), a.max(b)).expect("an interval")
        };
        let (x, y) = (draw(&mut random), draw(&mut random));
        let inside = |random: &mut Random, x: Interval| {
            let t = random.unit();
            (x.low() + t * (x.high() - x.low())).clamp(x.low(), x.high())
        };
        let (a, b) = (inside(&mut random, x), inside(&mut random, y));
        encloses(x + y, &big(a).add(&big(b), BITS, ROUND));
        encloses(x - y, &big(a).sub(&big(b), BITS, ROUND));
        encloses(x * y, &big(a).mul(&big(b), BITS, ROUND));
        match y.contains(0.0) {
            true => assert_eq!(x / y, Interval::ENTIRE),
            false => encloses(x / y, &big(a).div(&big(b), BITS, ROUND)),
        }
        // The bounds of a product are products of bounds: no wider than necessary.
        let corners = [x.low() * y.low(), x.low() * y.high(), x.high() * y.low(), x.high() * y.high()];
        let (least, most) =
            (corners.iter().fold(f64::MAX, |m, c| m.min(*c)), corners.iter().fold(f64::MIN, |m, c| m.max(*c)));
        assert!((x * y).low() >= next_down(least) && (x * y).high() <= next_up(most));
        // Both sides of an undecided floor.
        let floor = Interval::point(0.5);
        let guarded = x.reciprocal_above(floor);
        let value = if a <= 0.5 { 0.0 } else { 1.0 / a };
        assert!(guarded.low() <= value && value <= guarded.high(), "{x:?} {a}");
        assert!(guarded.is_bounded());
    }
    assert_eq!(Interval::point(0.0).reciprocal_above(Interval::zero()), Interval::zero());
    assert_eq!(Interval::new(-1.0, 1.0).expect("one").reciprocal_above(Interval::zero()), Interval::ENTIRE);
    assert_eq!(Interval::point(4.0).reciprocal_above(Interval::zero()), Interval::point(0.25));
}

#[test]
fn sines_and_cosines() {
    let (mut random, mut consts) = (Random(7), Consts::new().expect("constants"));
    let mut widest = 0.0_f64;
    let quarters = (-700..=700).map(|k| f64::from(k) * core::f64::consts::FRAC_PI_2);
    let quarters = quarters.flat_map(|x| [x, next_up(x), next_down(x)]);
    let drawn: Vec<f64> = (0..3000).map(|_| random.number(19.0)).collect();
    for angle in quarters.chain(drawn).chain([1e-300, -1e-20, 5e-324, 999_999.5]) {
        let (s, c) = Interval::point(angle).sin_cos();
        let sine = if angle == 0.0 { big(0.0) } else { big(angle).sin(BITS, ROUND, &mut consts) };
        encloses(s, &sine);
        encloses(c, &big(angle).cos(BITS, ROUND, &mut consts));
        widest = widest.max(s.width()).max(c.width());
        // The reduced argument is as good relatively as absolutely, also next to multiples of π/2.
        assert!(angle.abs() < 1e-290 || ulps(s) < 40.0 && ulps(c) < 40.0, "{angle}: {s:?} {c:?}");
        // What programs on doubles compute has an error of less than a unit of the last place.
        let (double_s, double_c) = Scalar::sin_cos(angle);
        assert!(s.distance(double_s) < s.width() + 2.3e-16 && c.distance(double_c) < c.width() + 2.3e-16);
    }
    std::eprintln!("widest enclosure of a sine or cosine: {widest:e}");
    assert!(widest < 2e-15, "{widest:e}");
    let (s, c) = Interval::point(1e9).sin_cos();
    assert!(s == c && s == Interval::new(-1.0, 1.0).expect("one"));
    // Intervals: extrema inside, and samples.
    for _ in 0..3000 {
        let (from, width) = (random.number(4.0), random.unit() * 7.0);
        let x = Interval::new(from, from + width).expect("an interval");
        let (s, c) = x.sin_cos();
        for k in 0..20 {
            let angle = (from + width * f64::from(k) / 19.0).min(x.high());
            let (sine, cosine) = Scalar::sin_cos(angle);
            let near = |x: Interval, y: f64| x.low() - 2e-16 <= y && y <= x.high() + 2e-16;
            assert!(near(s, sine) && near(c, cosine), "{x:?} {angle}");
        }
        let [low, high] = (0..=2000)
            .map(|k| (from + width * f64::from(k) / 2000.0).sin())
            .fold([2.0_f64, -2.0], |[l, h], s| [l.min(s), h.max(s)]);
        // Tight up to the distance of the samples.
        assert!(s.low() > low - 1e-5 && s.high() < high + 1e-5, "{x:?} {s:?} {low} {high}");
    }
}

#[test]
fn nothing_known_stays_nothing() {
    let (entire, two) = (Interval::ENTIRE, Interval::point(2.0));
    let all = [
        entire + two,
        two - entire,
        entire * Interval::zero(),
        Interval::zero() / entire,
        entire / two,
        entire.sqrt(),
        entire.sin_cos().0,
        entire.sin_cos().1,
        entire.reciprocal_above(two),
        two.reciprocal_above(entire),
        -entire,
        two / Interval::new(-1.0, 1.0).expect("one"),
        (-two).sqrt(),
        Interval::point(1e300) * Interval::point(1e300),
        Interval::point(f64::MAX) + Interval::point(f64::MAX),
        Interval::point(f64::NAN),
        Interval::point(f64::INFINITY),
        Interval::point(1e-300) / Interval::point(f64::MIN_POSITIVE).hull(Interval::point(0.0)),
    ];
    for (k, x) in all.into_iter().enumerate() {
        assert_eq!(x, entire, "{k}");
    }
    assert_eq!(Interval::new(2.0, 1.0), None);
    assert_eq!(Interval::new(f64::NAN, 1.0), None);
}

#[test]
fn intersections() {
    let of = |low: f64, high: f64| Interval::new(low, high).expect("bounds");
    let (a, entire) = (of(-1.0, 2.0), Interval::ENTIRE);
    for (b, both) in [
        (of(1.0, 3.0), Some(of(1.0, 2.0))),
        (of(-3.0, 0.5), Some(of(-1.0, 0.5))),
        (of(0.0, 1.0), Some(of(0.0, 1.0))),
        (of(-7.0, 7.0), Some(a)),
        (a, Some(a)),
        // They have a bound in common.
        (of(2.0, 3.0), Some(Interval::point(2.0))),
        (Interval::point(-1.0), Some(Interval::point(-1.0))),
        // Nothing known takes nothing away.
        (entire, Some(a)),
        // Disjoint, also by one unit of the last place.
        (of(2.5, 3.0), None),
        (of(-9.0, -1.5), None),
        (of(next_up(2.0), 3.0), None),
        (Interval::point(next_down(-1.0)), None),
    ] {
        assert_eq!(a.intersection(b), both, "{b:?}");
        assert_eq!(b.intersection(a), both, "{b:?}");
    }
    assert_eq!(entire.intersection(entire), Some(entire));
    // Numbers of both, and only these.
    let mut random = Random(11);
    let mut counts = [0; 2];
    for _ in 0..2000 {
        let mut draw = || {
            let (x, y) = (random.short(), random.short());
            of(x.min(y), x.max(y))
        };
        let (a, b) = (draw(), draw());
        let both = a.intersection(b);
        counts[usize::from(both.is_some())] += 1;
        for k in -33..=33 {
            let x = f64::from(k);
            assert_eq!(both.is_some_and(|both| both.contains(x)), a.contains(x) && b.contains(x), "{a:?} {b:?} {x}");
        }
    }
    assert!(counts.iter().all(|count| *count > 300), "{counts:?}");
}

#[test]
fn constants_of_a_hundred_bits() {
    let third = crate::integrate::ratio(1, 3);
    let x: Interval = third.get();
    encloses(x, &big(1.0).div(&big(3.0), BITS, ROUND));
    assert!(ulps(x) <= 1.0);
    assert_eq!(crate::integrate::ratio(3, 4).get::<Interval>(), Interval::point(0.75));
}

/// `x³ − x` about 2: the excess of the mean value form falls with the square of the width, that of intervals with the
/// width.
#[test]
fn mean_value_forms() {
    let f = |x: Dual<Interval>| x * x * x - x;
    let mut excess = [[0.0_f64; 2]; 2];
    for (k, radius) in [0.5_f64.powi(6), 0.5_f64.powi(8)].into_iter().enumerate() {
        let x = Interval::new(2.0 - radius, 2.0 + radius).expect("an interval");
        let over = f(Dual::new(x, Interval::one()));
        let center = f(Dual::constant(2.0)).re;
        let mean = mean_value(center, [(over.du, x - Interval::point(2.0))].into_iter());
        // It is monotonic there.
        let exact = |x: f64| x * x * x - x;
        let (low, high) = (exact(2.0 - radius), exact(2.0 + radius));
        for (j, found) in [over.re, mean].into_iter().enumerate() {
            assert!(found.low() <= low && found.high() >= high);
            excess[k][j] = found.width() - (high - low);
        }
    }
    let fall = [excess[0][0] / excess[1][0], excess[0][1] / excess[1][1]];
    assert!((3.5..4.5).contains(&fall[0]) && (14.0..18.0).contains(&fall[1]), "{fall:?}");
}

#[test]
fn tables_give_the_entries_of_all_numbers() {
    static TABLE: [f64; 4] = [1.0, -2.0, 5.0, 3.0];
    let at = |low: f64, high: f64, offset| Interval::new(low, high).expect("bounds").look_up(&TABLE, offset);
    assert_eq!(at(0.2, 0.8, 0), Interval::point(1.0));
    assert_eq!(at(0.2, 1.0, 0), Interval::new(-2.0, 1.0).expect("bounds"));
    assert_eq!(at(-3.0, 1.5, 1), Interval::new(-2.0, 5.0).expect("bounds"));
    assert_eq!(at(2.5, 1e30, 3), Interval::point(3.0));
    assert_eq!(Interval::ENTIRE.look_up(&TABLE, 2), Interval::new(3.0, 5.0).expect("bounds"));
}
