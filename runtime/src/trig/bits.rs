//! Bits of π for the reduction of large angles.

/// π/4 as a binary fraction of 64 bits.
pub const QUARTER_PI: u64 = 0xc90f_daa2_2168_c235;

/// 2/π as a binary fraction after 64 zero bits, with enough bits for the largest `f64`.
pub const TWO_OVER_PI: [u32; 40] = [
    0x00000000, 0x00000000, 0xa2f9836e, 0x4e441529, 0xfc2757d1, 0xf534ddc0, 0xdb629599, 0x3c439041, 0xfe5163ab,
    0xdebbc561, 0xb7246e3a, 0x424dd2e0, 0x06492eea, 0x09d1921c, 0xfe1deb1c, 0xb129a73e, 0xe88235f5, 0x2ebb4484,
    0xe99c7026, 0xb45f7e41, 0x3991d639, 0x835339f4, 0x9c845f8b, 0xbdf9283b, 0x1ff897ff, 0xde05980f, 0xef2f118b,
    0x5a0a6d1f, 0x6d367ecf, 0x27cb09b7, 0x4f463f66, 0x9e5fea2d, 0x7527bac7, 0xebe5f17b, 0x3d0739f7, 0x8a5292ea,
    0x6bfb5fb1, 0x1f8d5d08, 0x56033046, 0xfc7b6bab,
];

/// The 32 bits of [`TWO_OVER_PI`] from bit `at` on.
#[inline]
pub(super) fn chunk32(at: u32) -> u32 {
    let word = |i: u32| u64::from(TWO_OVER_PI.get(i as usize).copied().unwrap_or(0));
    let (i, shift) = (at / 32, at % 32);
    ((((word(i) << 32) | word(i + 1)) << shift) >> 32) as u32
}

/// The 64 bits of [`TWO_OVER_PI`] from bit `at` on.
#[cfg_attr(feature = "std", inline)]
// Three copies would be most of the code for large angles on a small processor.
#[cfg_attr(not(feature = "std"), inline(never))]
pub(super) fn chunk64(at: u32) -> u64 {
    (u64::from(chunk32(at)) << 32) | u64::from(chunk32(at.wrapping_add(32)))
}

/// An integer with at most 53 bits between its first and its last one. (A conversion of 64 bits is a function on processors of 32.)
#[inline]
pub(super) fn exact_f64(x: u64) -> f64 {
    f64::from((x >> 32) as u32) * 4_294_967_296.0 + f64::from(x as u32)
}

/// An integer with at most 24 bits between its first and its last one.
#[inline]
pub(super) fn exact_f32(x: u32) -> f32 {
    x as f32
}
