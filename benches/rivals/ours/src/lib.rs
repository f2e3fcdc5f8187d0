//! `extern "C"` functions for the generated code of every robot: `NAME_rates(q, p, tau, out)` with `out = [q̇, ṗ]`,
//! `NAME_accelerations(q, v, tau, out)` with `out = q̈`, both for eight lanes with the suffix `_lanes`,
//! `NAME_rates_batch` for all states at once, and `NAME_about(...)` for the order of coordinates and the numbers of
//! operations.
#![allow(missing_docs)]

include!(concat!(env!("OUT_DIR"), "/robots.rs"));

/// Number of states of a batch.
const STATES: usize = 256;

/// # Safety
/// A pointer to `N` times [`STATES`] numbers.
unsafe fn columns<'a, const N: usize>(x: *const f64) -> [&'a [f64]; N] {
    std::array::from_fn(|k| std::slice::from_raw_parts(x.add(k * STATES), STATES))
}

/// # Safety
/// As for [`columns`]; in addition, there is no other reference to these numbers.
unsafe fn columns_mut<'a, const N: usize>(x: *mut f64) -> [&'a mut [f64]; N] {
    std::array::from_fn(|k| std::slice::from_raw_parts_mut(x.add(k * STATES), STATES))
}
