//! Against `astro-float-num`, which shares neither constants nor method with the code under test.

extern crate std;

use astro_float_num::{BigFloat, Consts, RoundingMode, WORD_BIT_SIZE};

use super::*;

/// Bits of the reference.
const BITS: usize = 256;
const ROUND: RoundingMode = RoundingMode::ToEven;

fn big(x: TwoFloat) -> BigFloat {
    BigFloat::from_f64(x.hi(), BITS).add(&BigFloat::from_f64(x.lo(), BITS), BITS, ROUND)
}

/// As a double, from the leading word.
fn double(x: &BigFloat) -> f64 {
    if x.is_zero() {
        return 0.0;
    }
    let (words, _, sign, exponent, _) = x.as_raw_parts().unwrap();
    let leading = *words.last().unwrap() as f64 * 0.5_f64.powi(WORD_BIT_SIZE as i32);
    let size = leading * 2.0_f64.powi(exponent);
    if sign.is_negative() {
        -size
    } else {
        size
    }
}

/// `got − exact`, over `exact` if that is asked.
fn error(got: TwoFloat, exact: &BigFloat, relative: bool) -> f64 {
    let off = double(&big(got).sub(exact, BITS, ROUND)).abs();
    off / if relative { double(exact).abs() } else { 1.0 }
}

/// Numbers of 106 random bits, of either sign, sizes spread evenly from 2⁻ᵇ to 2ᵇ.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 * 0.5_f64.powi(53)
    }

    fn number(&mut self, b: f64) -> TwoFloat {
        let hi = (0.5 + self.unit()) * ((2.0 * self.unit() - 1.0) * b).exp2();
        let hi = if self.unit() < 0.5 { -hi } else { hi };
        TwoFloat::new_add(hi, hi * (self.unit() - 0.5) * f64::EPSILON)
    }
}

#[test]
fn arithmetic() {
    let mut random = Random(17);
    for _ in 0..2000 {
        let (a, b) = (random.number(40.0), random.number(40.0));
        let (x, y): (Wide, Wide) = (Wide(a), Wide(b));
        let (a, b) = (big(a), big(b));
        // A handful of units of 2⁻¹⁰⁶ each, by the bounds of Joldes, Muller, Popescu (2017).
        assert!(error((x + y).0, &a.add(&b, BITS, ROUND), true) < 5e-32);
        assert!(error((x - y).0, &a.sub(&b, BITS, ROUND), true) < 5e-32);
        assert!(error((x * y).0, &a.mul(&b, BITS, ROUND), true) < 8e-32);
        assert!(error((x / y).0, &a.div(&b, BITS, ROUND), true) < 2e-31);
        let (x, a) = if x < Wide::zero() { (-x, a.neg()) } else { (x, a) };
        assert!(error(x.sqrt().0, &a.sqrt(BITS, ROUND), true) < 2e-31);
    }
}

#[test]
fn angles() {
    let (mut random, mut consts) = (Random(18), Consts::new().unwrap());
    let mut worst = [0.0_f64; 2];
    let quarters = (-8..=8).map(|k| TwoFloat::from(f64::from(k)) * TwoFloat::new_add(QUARTER[0], QUARTER[1]));
    let eighths = (-8..=8).map(|k| TwoFloat::from(f64::from(k)) * (QUARTER[0] / 2.0));
    let drawn: std::vec::Vec<TwoFloat> = (0..1500).map(|_| random.number(10.0)).collect();
    for angle in quarters.chain(eighths).chain(drawn).chain([TwoFloat::from(1e-20)]) {
        let (s, c) = Wide::<false>(angle).sin_cos();
        let exact = big(angle);
        let (sine, cosine) = (exact.sin(BITS, ROUND, &mut consts), exact.cos(BITS, ROUND, &mut consts));
        worst[0] = worst[0].max(error(s.0, &sine, false)).max(error(c.0, &cosine, false));
        let one = s * s + c * c - Wide::one();
        worst[1] = worst[1].max(one.to_f64().abs());
    }
    std::eprintln!("sines, cosines {:e}; sum of squares {:e}", worst[0], worst[1]);
    assert!(worst[0] < 1e-31 && worst[1] < 1e-31, "{worst:?}");
    let (s, _) = Wide::<false>(TwoFloat::from(1e-20)).sin_cos();
    assert_eq!(s.0.hi(), 1e-20);
    // Beyond, NaN; large angles as good as their own last bits.
    assert!(!Wide::<false>::constant(2.0_f64.powi(51)).sin_cos().0.is_finite());
    let angle = TwoFloat::from(1e15);
    let off = error(Wide::<false>(angle).sin_cos().0 .0, &big(angle).sin(BITS, ROUND, &mut consts), false);
    assert!(off < 1e15 * 1e-31, "{off:e}");
}

#[test]
fn coarse_angles_are_those_of_doubles() {
    let angle = Wide::<true>(TwoFloat::new_add(0.7, 1e-18));
    let (s, c) = angle.sin_cos();
    assert_eq!((s.to_f64(), c.to_f64()), Scalar::sin_cos(0.7));
    assert_eq!((s.0.lo(), c.0.lo()), (0.0, 0.0));
}
