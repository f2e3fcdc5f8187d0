//! Parts of lists whose lengths the compiler does not know, without a path to a panic: a microcontroller's image has none.
//!
//! Callers check lengths once, where an error can be told; here, what is out of range is left out.

use crate::system::Real;
use crate::Scalar;

/// What `f` gives for each index. Compilers take far less time for it than for `core::array::from_fn`, of which sweeps have
/// hundreds for each kind of number.
#[cfg(not(target_family = "wasm"))]
#[inline(always)]
pub(crate) fn array<T: Copy, const N: usize>(mut f: impl FnMut(usize) -> T) -> [T; N] {
    const { assert!(N > 0) };
    let mut all = [f(0); N];
    let mut k = 1;
    while k < N {
        all[k] = f(k);
        k += 1;
    }
    all
}

/// The same for WebAssembly, where size counts: the code of loops would be a fiftieth longer.
#[cfg(target_family = "wasm")]
#[inline(always)]
pub(crate) fn array<T: Copy, const N: usize>(f: impl FnMut(usize) -> T) -> [T; N] {
    core::array::from_fn(f)
}

/// The size of the largest entry, not finite where one is not; zero of none.
#[inline(always)]
pub(crate) fn largest<S: Real>(list: &[S]) -> S {
    list.iter().fold(S::zero(), |most, x| if x.abs() > most || !x.is_finite() { x.abs() } else { most })
}

/// The first `n` entries.
#[inline(always)]
pub(crate) fn first<T>(list: &[T], n: usize) -> &[T] {
    list.get(..n).unwrap_or(list)
}

/// The first `n` entries.
#[inline(always)]
pub(crate) fn first_mut<T>(list: &mut [T], n: usize) -> &mut [T] {
    split(list, n).0
}

/// The first `n` entries, and the others.
#[inline(always)]
pub(crate) fn split<T>(list: &mut [T], n: usize) -> (&mut [T], &mut [T]) {
    list.split_at_mut(n.min(list.len()))
}

/// The `n` entries from `at` on; none where there are fewer.
#[inline(always)]
pub(crate) fn part<T>(list: &[T], at: usize, n: usize) -> &[T] {
    list.get(at..).and_then(|rest| rest.get(..n)).unwrap_or_default()
}

/// The `n` entries from `at` on; none where there are fewer.
#[inline(always)]
pub(crate) fn part_mut<T>(list: &mut [T], at: usize, n: usize) -> &mut [T] {
    list.get_mut(at..).and_then(|rest| rest.get_mut(..n)).unwrap_or_default()
}

/// An entry; zero in its place.
#[inline(always)]
pub(crate) fn get<S: Scalar>(list: &[S], at: usize) -> S {
    list.get(at).map_or(S::zero(), |x| *x)
}

/// An entry of a list of anything; `none` in its place.
#[inline(always)]
pub(crate) fn get_or<T: Copy>(list: &[T], at: usize, none: T) -> T {
    list.get(at).map_or(none, |x| *x)
}

/// Sets an entry.
#[inline(always)]
pub(crate) fn set<T>(list: &mut [T], at: usize, x: T) {
    if let Some(entry) = list.get_mut(at) {
        *entry = x;
    }
}

/// Swaps as much as both lists have.
#[inline(always)]
pub(crate) fn swap<T>(one: &mut [T], other: &mut [T]) {
    for (one, other) in one.iter_mut().zip(other) {
        core::mem::swap(one, other);
    }
}

/// Copies as much as both lists have.
#[inline(always)]
pub(crate) fn copy<T: Copy>(to: &mut [T], from: &[T]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}
