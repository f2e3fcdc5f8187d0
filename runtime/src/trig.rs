//! Sine and cosine together, in plain additions and multiplications: the same bits on every target.
//!
//! `core` has no trigonometric functions, and `libm` computes its single-precision versions in double precision, which
//! a Cortex-M4F has to emulate. The functions of this module compute `f32` in `f32`. Their main path has no table and
//! no branch, so that a loop over lanes vectorises; one branch sends large, infinite and NaN arguments to an exact
//! integer reduction.
//!
//! The functions are generic over an [`Arithmetic`]. Single calls use plain arithmetic and give the same bits
//! everywhere; kernels use fused multiply-adds where the processor has them. Generated code has all its angles at the
//! start of a function and computes their sines and cosines together in vector registers ([`pairs_f64`],
//! [`pairs_f32`]).
//!
//! Main path (|x| <= 10^6 for `f64`, <= 1600 for `f32`):
//! 1. `n = round(x · 2/π)` by adding and subtracting 1.5 · 2^(mantissa bits); the low bits of the sum are the quadrant.
//! 2. `y0 + y1 = x − n·π/2` with π/2 in four parts (Cody and Waite). The first three have so few bits that their
//!    products with `n` are exact. The rounding errors of the two subtractions are recovered exactly; together with the
//!    last part they are `y1`. The error of the reduced argument is therefore well below an ulp even next to a multiple
//!    of π/2. With fused multiply-adds, the first part is a whole float and three parts suffice: `x − n·p1` is below 1
//!    and a multiple of the last place of `p1` or `x`, so that it is exact.
//! 3. Polynomials for both functions on |y| <= π/4; for `f64` those of fdlibm, in both cases with fdlibm's use of `y1`.
//! 4. Quadrant: exchange by a select, signs by their bit.
//!
//! Larger arguments use the reduction of Payne and Hanek: only the bits of 2/π that contribute to `x · 2/π mod 4` are
//! multiplied, as integers.
//!
//! Code for bounded angles ([`bounded_pairs_f64`]) has the main path alone and gives NaN beyond it: a small processor then keeps
//! no reduction that it never needs.
//!
//! The largest errors that the tests of this module find over random and difficult arguments, plain and fused, are 0.80
//! units in the last place for `f64` and 0.82 for `f32`.
// fdlibm's digits are kept as printed there, and 2/π is one rounded constant among several.
#![allow(clippy::excessive_precision, clippy::approx_constant)]

mod bits;
mod number;

use crate::kernel::{call_lanes, Arithmetic, Kernel, Plain};
use bits::{chunk32, chunk64, exact_f32, exact_f64};
pub use bits::{QUARTER_PI, TWO_OVER_PI};
use number::In;
pub use number::Number;

/// Largest angle of the main path in double precision, rad.
pub const LIMIT_F64: f64 = 1.0e6;

/// Largest angle of the main path in single precision, rad.
pub const LIMIT_F32: f32 = 1600.0;

/// Whether angles are computed in blocks. Without vector instructions, the unused lanes of a block would cost as much
/// as the others.
const VECTORS: bool = cfg!(any(target_arch = "x86_64", target_arch = "aarch64"));

/// The functions for one float type. Constants, polynomials and the integer types are arguments.
macro_rules! sincos {
    (
        float $float:ident, bits $uint:ident, wide $wide:ident, chunk $chunk:ident, mantissa $mant:literal;
        limit $limit:expr;
        two_over_pi $inv:literal, magic $magic:literal;
        pi_half $p1:literal, $p2:literal, $p3:literal, $p4:literal;
        fused $f1:literal, $f2:literal, $f3:literal;
        fma $fma:ident, width $width:literal;
        sin($zs:ident, $fs:ident, $cs:ident) $s1:literal, $sin_tail:expr;
        cos($zc:ident, $fc:ident, $cc:ident) $cos_tail:expr;
        $(#[$doc:meta])* scalar $name:ident;
        $(#[$lanes_doc:meta])* lanes $lanes:ident;
        $(#[$slice_doc:meta])* slice $slice:ident, $kernel_type:ident;
        $(#[$pair_doc:meta])* pair $pair:ident;
        $(#[$pairs_doc:meta])* pairs $pairs:ident;
        $(#[$bounded_pair_doc:meta])* bounded pair $bounded_pair:ident;
        $(#[$bounded_pairs_doc:meta])* bounded pairs $bounded_pairs:ident;
        $(#[$path_doc:meta])* path $path:ident;
        $(#[$reduced_doc:meta])* reduced $reduced:ident;
        $(#[$kernel_doc:meta])* kernel $kernel:ident;
        parts $fast:ident, $slow:ident, $far:ident, $exact:ident, $large:ident, $repair:ident, $block:ident, $flat:ident,
            $one:ident, $several:ident
    ) => {
        $(#[$doc])*
        #[inline]
        pub fn $name(x: $float) -> ($float, $float) {
            $pair::<Plain>(x)
        }

        $(#[$lanes_doc])*
        #[inline]
        pub fn $lanes<const N: usize>(x: [$float; N]) -> ([$float; N], [$float; N]) {
            let (mut sin, mut cos) = ([0.0; N], [0.0; N]);
            if $flat::<Plain, false>(&x, &mut sin, &mut cos) {
                $repair::<false>(&x, &mut sin, &mut cos);
            }
            (sin, cos)
        }

        $(#[$slice_doc])*
        pub fn $slice(x: &[$float], sin: &mut [$float], cos: &mut [$float]) {
            call_lanes::<$kernel_type, 0, $width, $float, _>((x, sin, cos));
        }

        struct $kernel_type;
        impl Kernel<0, $width, (&[$float], &mut [$float], &mut [$float])> for $kernel_type {
            #[inline(always)]
            fn run<A: Arithmetic>((x, sin, cos): (&[$float], &mut [$float], &mut [$float])) {
                if $flat::<A, false>(x, sin, cos) {
                    $repair::<false>(x, sin, cos);
                }
            }
        }

        $(#[$pair_doc])*
        #[inline(always)]
        pub fn $pair<A: Arithmetic>(x: $float) -> ($float, $float) {
            $one::<A, false>(x)
        }

        $(#[$bounded_pair_doc])*
        #[inline(always)]
        pub fn $bounded_pair<A: Arithmetic>(x: $float) -> ($float, $float) {
            $one::<A, true>(x)
        }

        /// One angle; if it is beyond the main path and angles are `BOUNDED`, NaN.
        #[inline(always)]
        fn $one<A: Arithmetic, const BOUNDED: bool>(x: $float) -> ($float, $float) {
            if BOUNDED {
                return match $large(x) {
                    true => (<$float>::NAN, <$float>::NAN),
                    false => $fast::<A>(x),
                };
            }
            // One kernel for both ways: small processors have little memory. In double precision this would take seven more
            // instructions on the main path.
            if size_of::<$float>() == 4 && !VECTORS && !A::FUSED {
                let number = In::<Plain, $float>::new;
                let (mut y0, mut y1, mut quadrant) = $reduced(number(x));
                if $large(x) {
                    let far = $far(x);
                    (y0, y1, quadrant) = (number(far.0), number(far.1), far.2);
                }
                let (sin, cos) = $kernel(y0, y1, quadrant);
                return (sin.number, cos.number);
            }
            match $large(x) {
                true => $slow(x),
                false => $fast::<A>(x),
            }
        }

        $(#[$pairs_doc])*
        #[inline(always)]
        pub fn $pairs<A: Arithmetic, const L: usize, const N: usize>(
            x: &[[$float; L]; N],
        ) -> ([[$float; L]; N], [[$float; L]; N]) {
            $several::<A, false, L, N>(x)
        }

        $(#[$bounded_pairs_doc])*
        #[inline(always)]
        pub fn $bounded_pairs<A: Arithmetic, const L: usize, const N: usize>(
            x: &[[$float; L]; N],
        ) -> ([[$float; L]; N], [[$float; L]; N]) {
            $several::<A, true, L, N>(x)
        }

        /// Several angles, as [`$one`] is for one.
        #[inline(always)]
        fn $several<A: Arithmetic, const BOUNDED: bool, const L: usize, const N: usize>(
            x: &[[$float; L]; N],
        ) -> ([[$float; L]; N], [[$float; L]; N]) {
            if !VECTORS {
                // Sines take the places of the angles, and cosines start as any numbers that are at hand: a small processor has
                // little memory, and would call a function to write zeros.
                let (mut sin, mut cos) = (*x, *x);
                for (s, c) in sin.as_flattened_mut().iter_mut().zip(cos.as_flattened_mut()) {
                    // The compiler does not copy a loop that has this in it, nor one that calls for the reduction of large angles.
                    #[cfg(target_arch = "arm")]
                    if BOUNDED {
                        core::hint::black_box(());
                    }
                    (*s, *c) = $one::<A, BOUNDED>(*s);
                }
                return (sin, cos);
            }
            let (mut sin, mut cos) = ([[0.0; L]; N], [[0.0; L]; N]);
            if $flat::<A, BOUNDED>(x.as_flattened(), sin.as_flattened_mut(), cos.as_flattened_mut()) {
                // Copies are lent, so that the arrays of the main path can stay in registers.
                let (x, mut s, mut c) = (*x, sin, cos);
                $repair::<BOUNDED>(x.as_flattened(), s.as_flattened_mut(), c.as_flattened_mut());
                (sin, cos) = (s, c);
            }
            (sin, cos)
        }

        /// The main path: blocks as wide as the widest vectors, then the rest in narrower blocks. Returns whether an
        /// angle is beyond the main path.
        #[inline(always)]
        fn $flat<A: Arithmetic, const BOUNDED: bool>(x: &[$float], sin: &mut [$float], cos: &mut [$float]) -> bool {
            if !VECTORS {
                for ((x, s), c) in x.iter().zip(sin).zip(cos) {
                    (*s, *c) = $one::<A, BOUNDED>(*x);
                }
                return false;
            }
            let mut large = false;
            let (mut xs, mut ss, mut cs) =
                (x.chunks_exact($width), sin.chunks_exact_mut($width), cos.chunks_exact_mut($width));
            for ((x, s), c) in (&mut xs).zip(&mut ss).zip(&mut cs) {
                large |= $block::<A, $width>(x, s, c);
            }
            let (x_rest, s, c) = (xs.remainder(), ss.into_remainder(), cs.into_remainder());
            let rest = match x_rest.len() {
                0 => false,
                1 => $block::<A, 1>(x_rest, s, c),
                2..=4 => $block::<A, 4>(x_rest, s, c),
                5..=8 => $block::<A, 8>(x_rest, s, c),
                _ => $block::<A, $width>(x_rest, s, c),
            };
            large | rest
        }

        /// Up to `W` angles on the main path. Returns whether one of them is beyond it.
        #[inline(always)]
        fn $block<A: Arithmetic, const W: usize>(x: &[$float], sin: &mut [$float], cos: &mut [$float]) -> bool {
            let (mut angles, mut s, mut c, mut beyond) = ([0.0; W], [0.0; W], [0.0; W], [false; W]);
            for (angle, x) in angles.iter_mut().zip(x) {
                *angle = *x;
            }
            for w in 0..W {
                (s[w], c[w]) = $fast::<A>(angles[w]);
            }
            for w in 0..W {
                beyond[w] = $large(angles[w]);
            }
            for ((sin, cos), (s, c)) in sin.iter_mut().zip(cos).zip(s.iter().zip(&c)) {
                (*sin, *cos) = (*s, *c);
            }
            beyond.iter().fold(false, |any, x| any | x)
        }

        /// Computes the angles beyond the main path again: NaN where angles are `BOUNDED`.
        #[cold]
        #[inline(never)]
        fn $repair<const BOUNDED: bool>(x: &[$float], sin: &mut [$float], cos: &mut [$float]) {
            for ((x, s), c) in x.iter().zip(sin).zip(cos) {
                if $large(*x) {
                    (*s, *c) = if BOUNDED { (<$float>::NAN, <$float>::NAN) } else { $slow(*x) };
                }
            }
        }

        /// Whether `x` is beyond the main path: large, infinite or NaN.
        #[inline]
        fn $large(x: $float) -> bool {
            // The comparison is on the bits, so that NaN counts as large.
            (x.to_bits() & ($uint::MAX >> 1)) > <$float>::to_bits($limit)
        }

        impl<A: Arithmetic> Number<$float> for In<A, $float> {
            type Quadrant = $uint;

            const FUSED: bool = A::FUSED;

            #[inline(always)]
            fn constant(self, x: $float) -> Self {
                In::new(x)
            }

            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                In::new(A::$fma(self.number, b.number, c.number))
            }

            #[inline(always)]
            fn quadrant(shifted: Self, _: Self) -> $uint {
                shifted.number.to_bits()
            }

            #[inline(always)]
            fn turned(quadrant: $uint, sin: Self, cos: Self) -> (Self, Self) {
                let odd = quadrant & 1 != 0;
                let (s, c) = (if odd { cos } else { sin }, if odd { sin } else { cos });
                // Bit 1 of the quadrant is the sign of the sine; the sign of the cosine is the same bit of the next
                // quadrant.
                let to_sign = |bits: $uint| (bits & 2) << ($uint::BITS - 2);
                (
                    In::new(<$float>::from_bits(s.number.to_bits() ^ to_sign(quadrant))),
                    In::new(<$float>::from_bits(c.number.to_bits() ^ to_sign(quadrant.wrapping_add(1)))),
                )
            }
        }

        /// The main path. Beyond its range the result is meaningless, but there is no panic.
        #[inline(always)]
        fn $fast<A: Arithmetic>(x: $float) -> ($float, $float) {
            let (sin, cos) = $path(In::<A, $float>::new(x));
            (sin.number, cos.number)
        }

        $(#[$path_doc])*
        #[inline(always)]
        pub fn $path<N: Number<$float>>(x: N) -> (N, N) {
            let (y0, y1, quadrant) = $reduced(x);
            $kernel(y0, y1, quadrant)
        }

        $(#[$reduced_doc])*
        #[inline(always)]
        pub fn $reduced<N: Number<$float>>(x: N) -> (N, N, N::Quadrant) {
            let constant = |c: $float| x.constant(c);
            let magic = constant($magic);
            let shifted = x.fma(constant($inv), magic);
            let n = shifted - magic;
            let quadrant = N::quadrant(shifted, n);
            if N::FUSED {
                // This is exact; see the module's documentation.
                let a = (-n).fma(constant($f1), x);
                // The product is exact, and so is the remainder, for the reason given below.
                let w = n * constant($f2);
                let b = a - w;
                let lost = (a - b) - w;
                return (b, (-n).fma(constant($f3), lost), quadrant);
            }
            // The product is exact; so is the difference, by Sterbenz's lemma.
            let a = x - n * constant($p1);
            // The products are exact. `a` and `b` are multiples of the last place of `w` and `v`, so that both
            // remainders are exact.
            let w = n * constant($p2);
            let b = a - w;
            let lost_b = (a - b) - w;
            let v = n * constant($p3);
            let c = b - v;
            let lost_c = (b - c) - v;
            (c, (lost_b + lost_c) - n * constant($p4), quadrant)
        }

        $(#[$kernel_doc])*
        #[inline(always)]
        pub fn $kernel<N: Number<$float>>(y0: N, y1: N, quadrant: N::Quadrant) -> (N, N) {
            let constant = |c: $float| y0.constant(c);
            let z = y0 * y0;
            let half = constant(0.5) * z;
            let sin = {
                let ($zs, $fs, $cs) = (z, N::fma, constant);
                // The correction is subtracted, so that the sine of -0 is -0.
                let bend = half.fma(y1, -y1);
                y0 - (-(z * y0)).fma(z.fma($sin_tail, $cs($s1)), bend)
            };
            let cos = {
                let ($zc, $fc, $cc) = (z, N::fma, constant);
                let one = $cc(1.0);
                let w = one - half;
                w + (((one - w) - half) + z.fma($cos_tail, -(y0 * y1)))
            };
            N::turned(quadrant, sin, cos)
        }

        /// Sine and cosine of `x` beyond the main path; NaN for infinities and NaN.
        #[cold]
        #[inline(never)]
        fn $slow(x: $float) -> ($float, $float) {
            let (y0, y1, quadrant) = $far(x);
            let (sin, cos) = $kernel(In::<Plain, $float>::new(y0), In::new(y1), quadrant);
            (sin.number, cos.number)
        }

        /// Payne–Hanek reduction for `x` beyond the main path: `y0`, `y1` and the quadrant as those of the main path; NaN for
        /// infinities and NaN.
        #[cold]
        #[inline(never)]
        fn $far(x: $float) -> ($float, $float, $uint) {
            const BITS: u32 = $uint::BITS;
            const MANT: u32 = $mant; // stored bits
            const BIAS: u32 = (1 << (BITS - 2 - MANT)) - 1;
            let magnitude = x.to_bits() & ($uint::MAX >> 1);
            let biased = (magnitude >> MANT) as u32;
            if biased > 2 * BIAS {
                return (<$float>::NAN, <$float>::NAN, 0);
            }
            let m = (magnitude & ((1 << MANT) - 1)) | (1 << MANT);
            // x = m · 2^e. Bits of 2/π with a value of 4·2^-e or more only add full turns. The window starts after them
            // and is three words long: x · 2/π mod 4 = (m · window mod 2^(3 BITS)) · 2^(2 − 3 BITS), with an error
            // below 2^(MANT + 3 − 3 BITS). Here e >= −MANT + 10, and the 64 zero bits at the start of the table keep
            // `at` positive.
            let at = biased.wrapping_add(62).wrapping_sub(BIAS + MANT);
            let word = |k: u32| $wide::from($chunk(at.wrapping_add(k * BITS)));
            let low = $wide::from(m).wrapping_mul(word(2));
            let mid = $wide::from(m).wrapping_mul(word(1)).wrapping_add(low >> BITS);
            let high = $wide::from(m).wrapping_mul(word(0)).wrapping_add(mid >> BITS) as $uint;
            // The first two bits are the quadrant; the rest is the fraction of a quadrant, as a signed number around
            // the nearest, of two words.
            let quadrant = high >> (BITS - 2);
            let (mid, low) = (mid as $uint, low as $uint);
            let (fraction, rest) = ((high << 2) | (mid >> (BITS - 2)), (mid << 2) | (low >> (BITS - 2)));
            let negative = fraction >> (BITS - 1) != 0;
            let flip = if negative { $uint::MAX } else { 0 };
            let (rest, carry) = (rest ^ flip).overflowing_add($uint::from(negative));
            let fraction = (fraction ^ flip).wrapping_add($uint::from(carry));
            // No float is so close to a multiple of π/2 that the first word is zero.
            let zeros = (fraction | 1).leading_zeros();
            let leading = (fraction << zeros) | (rest >> 1 >> (BITS - 1 - zeros));
            let angle = (($wide::from(leading) * $wide::from((QUARTER_PI >> (64 - BITS)) as $uint)) >> BITS) as $uint;
            // angle · 2^(1 − BITS − zeros) radians, split into two floats exactly.
            let scale = <$float>::from_bits($uint::from((BIAS + 1).wrapping_sub(BITS).wrapping_sub(zeros) as u16) << MANT);
            let rest: $uint = angle & ((1 << (BITS - MANT - 1)) - 1);
            let (big, small) = ($exact(angle - rest) * scale, $exact(rest) * scale);
            let y0 = big + small;
            let y1 = (big - y0) + small;
            let quadrant = quadrant.wrapping_add($uint::from(negative));
            // The sine is odd, the cosine even: an angle of the other sign has another one of the quadrant, too.
            match (negative, x < 0.0) {
                (false, false) => (y0, y1, quadrant),
                (true, false) => (-y0, -y1, quadrant),
                (false, true) => (-y0, -y1, quadrant.wrapping_neg()),
                (true, true) => (y0, y1, quadrant.wrapping_neg()),
            }
        }
    };
}

sincos! {
    float f64, bits u64, wide u128, chunk chunk64, mantissa 52;
    limit LIMIT_F64;
    two_over_pi 0.6366197723675814, magic 6755399441055744.0;
    pi_half 1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32;
    fused 1.5707963267948966, 6.12323399538461e-17, 3.5215598651832e-27;
    fma fma_f64, width 8;
    sin(z, fma, c) -1.66666666666666324348e-01,
        fma(z * (z * z), fma(z, c(1.58969099521155010221e-10), c(-2.50507602534068634195e-08)),
            fma(z, fma(z, c(2.75573137070700676789e-06), c(-1.98412698298579493134e-04)), c(8.33333333332248946124e-03)));
    cos(z, fma, c) fma((z * z) * (z * z),
            fma(z, fma(z, c(-1.13596475577881948265e-11), c(2.08757232129817482790e-09)), c(-2.75573143513906633035e-07)),
            z * fma(z, fma(z, c(2.48015872894767294178e-05), c(-1.38888888888741095749e-03)), c(4.16666666666666019037e-02)));
    /// `(sin x, cos x)`, `x` in radians, each within one unit in the last place for every finite `x`; NaN otherwise.
    scalar sincos_f64;
    /// [`sincos_f64`] of each lane, with the same bits.
    lanes sincos_lanes_f64;
    /// Sines and cosines of as many angles, rad, as the shortest of the slices has, each within one unit in the last
    /// place. It uses the instructions of the processor, so that the last bits depend on the machine.
    slice sincos_slice_f64, SliceF64;
    /// [`sincos_f64`] for kernels.
    pair pair_f64;
    /// Sines and cosines of `N` angles, radians, in each of `L` lanes; for kernels.
    pairs pairs_f64;
    /// [`pair_f64`] for code without the reduction of larger angles: NaN beyond [`LIMIT_F64`].
    bounded pair bounded_pair_f64;
    /// [`pairs_f64`] for code without the reduction of larger angles: NaN beyond [`LIMIT_F64`].
    bounded pairs bounded_pairs_f64;
    /// The main path on numbers of any kind, for |x| up to [`LIMIT_F64`]: the sine and cosine of `x`, rad.
    path path_f64;
    /// The first part of [`path_f64`]: `y0`, `y1` and the quadrant, with `x = y0 + y1 + quadrant · π/2`.
    reduced reduced_f64;
    /// The second part of [`path_f64`]: sine and cosine of `y0 + y1 + quadrant · π/2`, for |y0| up to slightly above π/4.
    /// `y1` is at most some units in the last place of `y0`, except where both are tiny.
    kernel kernel_f64;
    parts fast_f64, slow_f64, far_f64, exact_f64, large_f64, repair_f64, block_f64, flat_f64,
        one_f64, several_f64
}

sincos! {
    float f32, bits u32, wide u64, chunk chunk32, mantissa 23;
    limit LIMIT_F32;
    two_over_pi 0.63661975, magic 12582912.0;
    pi_half 1.5706787, 0.000117614865, 9.91804e-10, 2.8960740e-13;
    fused 1.57079637, -4.37139533e-8, 2.56334407e-12;
    fma fma_f32, width 16;
    sin(z, fma, c) -0.16666655, fma(z, c(-0.00019521112), c(0.008332202));
    cos(z, fma, c) z * fma(z, fma(z, c(2.4432287e-05), c(-0.0013887309)), c(0.041666646));
    /// `(sin x, cos x)`, `x` in radians, each within one unit in the last place for every finite `x`; NaN otherwise.
    /// No double-precision operation is used.
    scalar sincos_f32;
    /// [`sincos_f32`] of each lane, with the same bits.
    lanes sincos_lanes_f32;
    /// Sines and cosines of as many angles, rad, as the shortest of the slices has, each within one unit in the last
    /// place. It uses the instructions of the processor, so that the last bits depend on the machine.
    slice sincos_slice_f32, SliceF32;
    /// [`sincos_f32`] for kernels.
    pair pair_f32;
    /// Sines and cosines of `N` angles, radians, in each of `L` lanes; for kernels.
    pairs pairs_f32;
    /// [`pair_f32`] for code without the reduction of larger angles: NaN beyond [`LIMIT_F32`].
    bounded pair bounded_pair_f32;
    /// [`pairs_f32`] for code without the reduction of larger angles: NaN beyond [`LIMIT_F32`].
    bounded pairs bounded_pairs_f32;
    /// The main path on numbers of any kind, for |x| up to [`LIMIT_F32`]: the sine and cosine of `x`, rad.
    path path_f32;
    /// The first part of [`path_f32`]: `y0`, `y1` and the quadrant, with `x = y0 + y1 + quadrant · π/2`.
    reduced reduced_f32;
    /// The second part of [`path_f32`]: sine and cosine of `y0 + y1 + quadrant · π/2`, for |y0| up to slightly above π/4.
    /// `y1` is at most some units in the last place of `y0`, except where both are tiny.
    kernel kernel_f32;
    parts fast_f32, slow_f32, far_f32, exact_f32, large_f32, repair_f32, block_f32, flat_f32,
        one_f32, several_f32
}

#[cfg(test)]
mod tests;
