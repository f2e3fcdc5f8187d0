//! `extern "C"` doors to the generated code of every robot: `NAME_rates(q, p, tau, out)` with `out = [q̇, ṗ]`,
//! `NAME_accelerations(q, v, tau, out)` with `out = q̈`, the same for eight lanes with `_lanes`, `NAME_rates_batch` for all
//! states at once, and `NAME_about(...)` for the order of coordinates and the counts.
#![allow(missing_docs)]

include!(concat!(env!("OUT_DIR"), "/robots.rs"));

/// States of a batch.
const STATES: usize = 256;

/// # Safety
/// A pointer to `N` times [`STATES`] numbers.
unsafe fn columns<'a, const N: usize>(x: *const f64) -> [&'a [f64]; N] {
    std::array::from_fn(|k| std::slice::from_raw_parts(x.add(k * STATES), STATES))
}

/// # Safety
/// As [`columns`], and nobody else uses them.
unsafe fn columns_mut<'a, const N: usize>(x: *mut f64) -> [&'a mut [f64]; N] {
    std::array::from_fn(|k| std::slice::from_raw_parts_mut(x.add(k * STATES), STATES))
}
