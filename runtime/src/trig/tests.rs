//! Errors in units in the last place (ulp) against 128-bit sines and cosines by `astro-float-num`, which shares neither
//! constants nor method with the code under test.
//!
//! The claim is one ulp. The bound here is tighter: half an ulp for the final rounding; about 0.3 for the operations
//! before it (at |y| near π/4 the correction y³/6 is a tenth of y, and five of its roundings count), and in `f32` up to
//! 0.1 of that for a polynomial of relative error 2^-27.3.
extern crate std;

use super::*;
use astro_float_num::{BigFloat, Consts, RoundingMode};
use std::{eprintln, vec, vec::Vec};

/// Largest error allowed anywhere, in ulp.
const BOUND: f64 = 0.85;

/// As kernels compute where products are added without being rounded. (The crate's own type needs feature `std`.)
#[derive(Clone, Copy)]
struct Fused;

impl Arithmetic for Fused {
    const FUSED: bool = true;
    fn fma_f64(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
    fn fma_f32(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }
}

/// High-precision sine and cosine, as a fraction of 128 bits and a binary exponent.
struct Reference {
    consts: Consts,
}

impl Reference {
    fn new() -> Self {
        Reference { consts: Consts::new().unwrap() }
    }

    fn sincos(&mut self, x: f64) -> (BigFloat, BigFloat) {
        let x = BigFloat::from_f64(x, 64);
        (x.sin(128, RoundingMode::ToEven, &mut self.consts), x.cos(128, RoundingMode::ToEven, &mut self.consts))
    }
}

/// `got − exact` in units of the last of `mantissa` bits of `exact`.
fn error_in_ulp(got: f64, exact: &BigFloat, mantissa: i32) -> f64 {
    let (words, _, sign, exponent, _) = exact.as_raw_parts().unwrap();
    if exact.is_zero() {
        return if got == 0.0 { 0.0 } else { f64::INFINITY };
    }
    // exact = ± words · 2^exponent, words in [1/2, 1).
    let mut bits = 0u128;
    for &w in words.iter().rev().take(128 / astro_float_num::WORD_BIT_SIZE) {
        bits = (bits << astro_float_num::WORD_BIT_SIZE) | w as u128;
    }
    let shift = 128 - mantissa as u32;
    let (whole, part) = ((bits >> shift) as f64, (bits & ((1 << shift) - 1)) as f64 * 0.5f64.powi(shift as i32));
    let got = if sign.is_negative() { -got } else { got };
    // In two steps: the power alone may overflow.
    let steps = mantissa - exponent;
    let got = got * 2f64.powi(steps / 2) * 2f64.powi(steps - steps / 2);
    got - whole - part
}

/// The two ways of adding a product.
const WAYS: [&str; 2] = ["plain", "fused"];

fn check_f64(points: impl IntoIterator<Item = f64>, what: &str) {
    let (mut reference, mut worst) = (Reference::new(), [(0.0, 0.0); 2]);
    for x in points {
        let (es, ec) = reference.sincos(x);
        for (k, (s, c)) in [pair_f64::<Plain>(x), pair_f64::<Fused>(x)].into_iter().enumerate() {
            for error in [error_in_ulp(s, &es, 53).abs(), error_in_ulp(c, &ec, 53).abs()] {
                assert!(error <= BOUND, "{}, x = {x:e}: {error} ulp, sin {s:e} cos {c:e}", WAYS[k]);
                worst[k] = if error > worst[k].0 { (error, x) } else { worst[k] };
            }
        }
    }
    for (way, (error, x)) in WAYS.iter().zip(worst) {
        eprintln!("f64 {way}, {what}: at most {error:.4} ulp, at {x:e}");
    }
}

fn check_f32(points: impl IntoIterator<Item = f32>, what: &str) {
    let (mut reference, mut worst) = (Reference::new(), [(0.0, 0.0); 2]);
    for x in points {
        let (es, ec) = reference.sincos(x.into());
        for (k, (s, c)) in [pair_f32::<Plain>(x), pair_f32::<Fused>(x)].into_iter().enumerate() {
            for error in [error_in_ulp(s.into(), &es, 24).abs(), error_in_ulp(c.into(), &ec, 24).abs()] {
                assert!(error <= BOUND, "{}, x = {x:e}: {error} ulp, sin {s:e} cos {c:e}", WAYS[k]);
                worst[k] = if error > worst[k].0 { (error, x) } else { worst[k] };
            }
        }
    }
    for (way, (error, x)) in WAYS.iter().zip(worst) {
        eprintln!("f32 {way}, {what}: at most {error:.4} ulp, at {x:e}");
    }
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e3779b97f4a7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58476d1ce4e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d049bb133111eb);
        z ^ (z >> 31)
    }

    /// Uniform in [-size, size].
    fn within(&mut self, size: f64) -> f64 {
        (self.bits() as i64 as f64) * 0.5f64.powi(63) * size
    }

    /// Any normal bit pattern (subnormal ones, which the reference misreads, have a test of their own).
    fn finite(&mut self) -> f64 {
        Some(f64::from_bits(self.bits())).filter(|x| x.is_normal()).unwrap_or(1.0)
    }
}

/// The floats on either side of `x` and `x` itself.
fn around(x: f64) -> [f64; 3] {
    [f64::from_bits(x.to_bits().wrapping_sub(1)), x, f64::from_bits(x.to_bits() + 1)]
}

fn around_f32(x: f32) -> [f32; 3] {
    [f32::from_bits(x.to_bits().wrapping_sub(1)), x, f32::from_bits(x.to_bits() + 1)]
}

/// Arguments around multiples of π/4: where the quadrant changes and where one of the two functions vanishes.
fn multiples(largest: u32, step: u32) -> impl Iterator<Item = f64> {
    (1..largest).step_by(step as usize).flat_map(|k| around(f64::from(k) * core::f64::consts::FRAC_PI_4))
}

const RANGES: [(f64, &str); 5] =
    [(0.8, "|x| <= 0.8"), (7.0, "|x| <= 7"), (1600.0, "|x| <= 1600"), (1.0e5, "|x| <= 1e5"), (2.0e6, "|x| <= 2e6")];

fn random_f64(count: usize, seed: u64) {
    let mut random = Random(seed);
    for (size, what) in RANGES {
        check_f64((0..count).map(|_| random.within(size)), what);
    }
    check_f64((0..count).map(|_| random.finite()), "any bits");
}

fn random_f32(count: usize, seed: u64) {
    let mut random = Random(seed);
    for (size, what) in RANGES {
        check_f32((0..count).map(|_| random.within(size) as f32), what);
    }
    check_f32((0..count).map(|_| f32::from_bits(random.bits() as u32)).filter(|x| x.is_normal()), "any bits");
}

#[test]
fn random_points() {
    random_f64(3_000, 1);
    random_f32(3_000, 2);
}

#[test]
#[ignore = "minutes: 10^7 points of each kind"]
fn random_points_long() {
    std::thread::scope(|scope| {
        scope.spawn(|| random_f64(1_700_000, 3));
        scope.spawn(|| random_f32(1_700_000, 4));
    });
}

#[test]
fn next_to_multiples_of_a_quarter_turn() {
    check_f64(multiples(1_500, 1), "multiples of π/4");
    check_f64(multiples(1_300_000, 1031), "multiples of π/4, up to the limit of the main path");
    let singles = |largest, step| multiples(largest, step).flat_map(|x| around_f32(x as f32));
    check_f32(singles(1_000, 1), "multiples of π/4");
    check_f32(singles(300_000, 401), "multiples of π/4, slow path");
}

/// Floats closest to a multiple of π/2 by continued fractions (the first two are the worst of all of `f64`, J.-M.
/// Muller, Elementary Functions, 2nd ed., section 9.4; the others the worst of their binade), the ends of the main
/// path, and large values.
#[test]
fn hard_arguments() {
    let power = |m: f64, e: i32| m * 2f64.powi(e);
    let mut points = vec![
        power(6381956970095103.0, 797),
        power(5261692873635770.0, 499),
        power(6411027962775774.0, -48),
        f64::MAX,
        1.0e22,
        1.0e300,
        2f64.powi(1023),
    ];
    points.extend(around(1.0e6).into_iter().chain(around(1.0e5)));
    points.extend((20..1023).map(|e| 2f64.powi(e)));
    points.extend(nearest_to_multiples(53, 20));
    check_f64(points.iter().flat_map(|x| [*x, -x]), "hard arguments");

    let mut points: Vec<f32> = vec![f32::MAX, 1.0e22, 16367173.0 * 2f32.powi(72)];
    points.extend(around_f32(1600.0));
    points.extend((10..128).map(|e| 2f32.powi(e)));
    points.extend(nearest_to_multiples(24, 17).map(|x| x as f32));
    check_f32(points.iter().flat_map(|x| [*x, -x]), "hard arguments");
}

/// In each binade [2^k, 2^(k+1)), 0 <= k < `binades`, the few floats of `mantissa` bits nearest to a multiple of π/2.
///
/// m · 2^e is near n · π/2 when m/n is near (π/2)/2^e: the convergents m/n of that number and their multiples.
fn nearest_to_multiples(mantissa: u32, binades: i32) -> impl Iterator<Item = f64> {
    // π/2 · 2^126 (the digits of π, in hexadecimal).
    const HALF_PI: u128 = 0x6487ed51_10b4611a_62633145_c06e0e68;
    (0..binades).flat_map(move |k| {
        let e = k - mantissa as i32 + 1;
        // (π/2)/2^e as a continued fraction, of numerator / denominator.
        let (mut a, mut b) = (HALF_PI, 1u128 << (126 + e).min(126));
        let (mut m, mut n) = ((1u128, 0u128), (0u128, 1u128));
        let mut found = Vec::new();
        for _ in 0..60 {
            if b == 0 {
                break;
            }
            let digit = a / b;
            (a, b) = (b, a % b);
            m = (digit.saturating_mul(m.0).saturating_add(m.1), m.0);
            n = (digit.saturating_mul(n.0).saturating_add(n.1), n.0);
            if m.0 >> mantissa != 0 {
                break;
            }
            // Every multiple with the full number of bits.
            let first = (1u128 << (mantissa - 1)).div_ceil(m.0);
            for times in (first..).take(3).take_while(|t| (t * m.0) >> mantissa == 0) {
                found.push((times * m.0) as f64 * 2f64.powi(e));
            }
        }
        found
    })
}

#[test]
fn zeros_tiny_infinite_and_nan() {
    for x in [0.0, f64::from_bits(1), f64::MIN_POSITIVE, 1.0e-300, 1.0e-20, 1.0e-9] {
        let (s, c) = sincos_f64(x);
        assert_eq!((s.to_bits(), c), (x.to_bits(), 1.0), "sin x = x, cos x = 1 at {x:e}");
        let (s, c) = sincos_f64(-x);
        assert_eq!((s.to_bits(), c), ((-x).to_bits(), 1.0), "at {:e}", -x);
    }
    for x in [0.0, f32::from_bits(1), f32::MIN_POSITIVE, 1.0e-30, 1.0e-4] {
        let (s, c) = sincos_f32(x);
        assert_eq!((s.to_bits(), c), (x.to_bits(), 1.0), "at {x:e}");
        let (s, c) = sincos_f32(-x);
        assert_eq!((s.to_bits(), c), ((-x).to_bits(), 1.0), "at {:e}", -x);
    }
    for x in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        let (s, c) = sincos_f64(x);
        assert!(s.is_nan() && c.is_nan(), "{x}");
        let (s, c) = sincos_f32(x as f32);
        assert!(s.is_nan() && c.is_nan(), "{x}");
    }
}

/// sin(−x) = −sin x and cos(−x) = cos x to the bit, on both paths.
#[test]
fn odd_and_even() {
    let mut random = Random(5);
    for _ in 0..100_000 {
        for x in [random.within(2.0e6), random.finite()] {
            let ((s, c), (sm, cm)) = (sincos_f64(x), sincos_f64(-x));
            assert_eq!((s.to_bits(), c.to_bits()), ((-sm).to_bits(), cm.to_bits()), "at {x:e}");
        }
        for x in [random.within(3200.0) as f32, random.within(1e38) as f32] {
            let ((s, c), (sm, cm)) = (sincos_f32(x), sincos_f32(-x));
            assert_eq!((s.to_bits(), c.to_bits()), ((-sm).to_bits(), cm.to_bits()), "at {x:e}");
        }
    }
}

/// Both paths agree within their errors where both apply, and lanes have the bits of scalars.
#[test]
fn paths_and_lanes_agree() {
    let mut random = Random(6);
    for _ in 0..50_000 {
        let x = random.within(1.0e6);
        if x.abs() >= 1024.0 {
            let ((a, b), (c, d)) = (fast_f64::<Plain>(x), slow_f64(x));
            assert!((a - c).abs() <= 2e-16 && (b - d).abs() <= 2e-16, "at {x:e}");
        }
        let x: [f64; 4] = core::array::from_fn(|i| random.within([1.0, 1.0e3, 9.0e5, 1.0e6 + 10.0][i]));
        let (s, c) = sincos_lanes_f64(x);
        for i in 0..4 {
            assert_eq!((s[i], c[i]), sincos_f64(x[i]));
        }
        let (mut s, mut c) = ([0.0; 4], [0.0; 4]);
        sincos_slice_f64(&x, &mut s, &mut c);
        for i in 0..4 {
            let fused = (s[i], c[i]) == pair_f64::<Fused>(x[i]);
            assert!(fused || (s[i], c[i]) == sincos_f64(x[i]), "{:e}", x[i]);
        }
        let x = x.map(|x| x as f32);
        let (s, c) = sincos_lanes_f32(x);
        for i in 0..4 {
            assert_eq!((s[i], c[i]), sincos_f32(x[i]));
        }
    }
}

/// Code for bounded angles has the bits of the other on the main path, and NaN beyond it.
#[test]
fn bounded_angles_are_those_of_the_main_path() {
    macro_rules! check {
        ($float:ident, $limit:ident, $pairs:ident, $bounded:ident, $bounded_pair:ident) => {{
            let mut random = Random(9);
            let next = $float::from_bits($limit.to_bits() + 1);
            let ends =
                [0.0, -0.0, $limit, -$limit, next, -next, 3.0 * $limit, $float::MAX, $float::INFINITY, $float::NAN];
            let inner = core::array::from_fn::<$float, 31, _>(|_| random.within(1.2 * f64::from($limit)) as $float);
            let mut x = [[0.0; 8]; 7];
            x.as_flattened_mut().iter_mut().zip(ends.into_iter().chain(inner)).for_each(|(x, y)| *x = y);
            fn compare<A: Arithmetic>(x: &[[$float; 8]; 7]) {
                let (all, bounded) = ($pairs::<A, 8, 7>(x), $bounded::<A, 8, 7>(x));
                for (k, x) in x.as_flattened().iter().enumerate() {
                    let of = |pair: &([[$float; 8]; 7], [[$float; 8]; 7])| {
                        (pair.0.as_flattened()[k], pair.1.as_flattened()[k])
                    };
                    for found in [of(&bounded), $bounded_pair::<A>(*x)] {
                        match x.abs() <= $limit {
                            true => assert_eq!(found, of(&all), "{x:e}"),
                            false => assert!(found.0.is_nan() && found.1.is_nan(), "{x:e}: {found:?}"),
                        }
                    }
                }
            }
            compare::<Plain>(&x);
            compare::<Fused>(&x);
        }};
    }
    check!(f64, LIMIT_F64, pairs_f64, bounded_pairs_f64, bounded_pair_f64);
    check!(f32, LIMIT_F32, pairs_f32, bounded_pairs_f32, bounded_pair_f32);
}

/// Every finite `f32`, against the C library in double precision (whose error is 2^-29 of an `f32` ulp).
#[test]
#[ignore = "minutes: 2^31 points (the negative ones follow from symmetry)"]
fn every_single() {
    let end = f32::INFINITY.to_bits();
    let worst = |from: u32| {
        let mut worst = (0.0, 0.0);
        for x in (from..end).step_by(2).map(f32::from_bits) {
            let ((s, c), (sf, cf), (es, ec)) = (sincos_f32(x), pair_f32::<Fused>(x), f64::from(x).sin_cos());
            for (got, exact) in [(s, es), (c, ec), (sf, es), (cf, ec)] {
                // Ulp of the binade of `exact`, not less than the smallest subnormal.
                let binade = f64::from_bits(exact.to_bits() & (0x7ff << 52)).max(f64::from(f32::MIN_POSITIVE));
                let error = (f64::from(got) - exact).abs() / (binade * 0.5f64.powi(23));
                // Also where it is no number.
                assert!(error <= BOUND, "x = {x:e}: {error} ulp");
                worst = if error > worst.0 { (error, x) } else { worst };
            }
        }
        worst
    };
    let (a, b) = std::thread::scope(|scope| {
        let other = scope.spawn(|| worst(1));
        (worst(0), other.join().unwrap())
    });
    let worst = if a.0 > b.0 { a } else { b };
    eprintln!("f32, every argument: at most {:.4} ulp, at {:e}", worst.0, worst.1);
}

/// Time a call beside the C library's. A report, not a gate: `cargo test --release -- --ignored --nocapture
/// throughput`.
#[test]
#[ignore = "a timing"]
fn throughput() {
    let mut random = Random(7);
    let doubles: Vec<f64> = (0..4096).map(|_| random.within(100.0)).collect();
    let singles: Vec<f32> = doubles.iter().map(|x| *x as f32).collect();
    let time = |what: &str, run: &dyn Fn() -> f64| {
        let best = (0..30).map(|_| {
            let start = std::time::Instant::now();
            for _ in 0..10 {
                std::hint::black_box(run());
            }
            start.elapsed().as_secs_f64() / 40_960.0
        });
        eprintln!("{what:28} {:6.2} ns a pair", best.fold(f64::INFINITY, f64::min) * 1e9);
    };
    time("f64 here", &|| doubles.iter().map(|x| sincos_f64(*x)).map(|(s, c)| s + c).sum());
    time("f64 here, lanes of 8", &|| {
        let sums = doubles.chunks_exact(8).map(|x| sincos_lanes_f64::<8>(x.try_into().unwrap()));
        sums.map(|(s, c)| s.iter().zip(c).map(|(s, c)| s + c).sum::<f64>()).sum()
    });
    time("f64 here, slices", &|| {
        let (mut s, mut c) = ([0.0; 4096], [0.0; 4096]);
        sincos_slice_f64(&doubles, &mut s, &mut c);
        s[1] + c[2]
    });
    time("f64 C library", &|| doubles.iter().map(|x| x.sin_cos()).map(|(s, c)| s + c).sum());
    time("f32 here", &|| singles.iter().map(|x| sincos_f32(*x)).map(|(s, c)| s + c).sum::<f32>().into());
    time("f32 here, lanes of 8", &|| {
        let sums = singles.chunks_exact(8).map(|x| sincos_lanes_f32::<8>(x.try_into().unwrap()));
        sums.map(|(s, c)| s.iter().zip(c).map(|(s, c)| s + c).sum::<f32>()).sum::<f32>().into()
    });
    time("f32 here, slices", &|| {
        let (mut s, mut c) = ([0.0; 4096], [0.0; 4096]);
        sincos_slice_f32(&singles, &mut s, &mut c);
        (s[1] + c[2]).into()
    });
    time("f32 C library", &|| singles.iter().map(|x| x.sin_cos()).map(|(s, c)| s + c).sum::<f32>().into());
}
