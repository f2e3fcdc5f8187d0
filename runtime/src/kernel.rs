//! Generated code for the instructions of the processor: one source text, compiled for several levels.
//!
//! The body of a generated function is a [`Kernel`], generic over an [`Arithmetic`]. [`call`], [`call_long`],
//! [`call_exact`] and [`call_lanes`] run it in the version for the best level that the processor supports. With feature
//! `std` the level is detected at run time, once, so that a plain `cargo build --release` is fast everywhere. Without it,
//! kernels are plain code of the target.
//!
//! | arithmetic | `a · b + c` | where |
//! | --- | --- | --- |
//! | [`Plain`] | two roundings | everywhere; the only one without `std` |
//! | `Fused` | one rounding | x86-64 with AVX2 and FMA, and aarch64; with `std` |
//!
//! The compiler makes the vector instructions: a kernel is a loop over lanes whose body is straight-line code, and the
//! compiler vectorises this loop. If the processor has AVX-512 and the compiler is 1.89 or later, lanes that fill its
//! registers use it, and so do long kernels for one state, because it has twice as many registers.
//!
//! The only `unsafe` code of the runtime is in this file. Its end calls functions that are compiled for more than the
//! baseline of the target. This is sound because every call first asks [`level`] which instructions the processor has.
//! [`PushedRows`] reads memory that it has written before, as it counts.

use core::mem::MaybeUninit;

/// The arithmetic of a kernel: how `a · b + c` is rounded. The numbers are `f64` or `f32` in every case.
pub trait Arithmetic: Copy {
    /// Whether `a · b + c` is rounded once.
    const FUSED: bool;
    /// `a · b + c` in double precision.
    fn fma_f64(a: f64, b: f64, c: f64) -> f64;
    /// `a · b + c` in single precision.
    fn fma_f32(a: f32, b: f32, c: f32) -> f32;
}

/// Products are rounded before they are added: the same bits on every machine.
#[derive(Clone, Copy, Debug)]
pub struct Plain;

impl Arithmetic for Plain {
    const FUSED: bool = false;
    #[inline(always)]
    fn fma_f64(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
    #[inline(always)]
    fn fma_f32(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }
}

/// `a · b + c` is rounded once. This is correct on every processor, and fast where the processor has the instruction.
#[cfg(feature = "std")]
#[derive(Clone, Copy, Debug)]
pub struct Fused;

#[cfg(feature = "std")]
impl Arithmetic for Fused {
    const FUSED: bool = true;
    #[inline(always)]
    fn fma_f64(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
    #[inline(always)]
    fn fma_f32(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }
}

/// Whether the target has vector instructions that kernels for one state use, where they compute like branches of a
/// mechanism at the same time. Without `std`, code is small instead.
pub const VECTORS: bool = cfg!(feature = "std");

/// Whether vectors are of 32 bytes where the arithmetic is fused.
pub const WIDE_VECTORS: bool = cfg!(all(feature = "std", target_arch = "x86_64"));

/// Body number `ID` of a generated type, for `L` lanes.
///
/// `run` must be `#[inline(always)]`: it is then compiled as part of its caller, for the instructions that the caller
/// enables.
pub trait Kernel<const ID: usize, const L: usize, Arguments> {
    /// Runs it.
    fn run<A: Arithmetic>(arguments: Arguments);
}

/// An array of numbers that a kernel reads.
///
/// An array of numbers is the same in every lane; an array of arrays has one number for each lane.
pub trait Read<T> {
    /// Number `k` of lane `l`.
    fn get(&self, k: usize, l: usize) -> T;
}

/// An array of numbers that a kernel writes.
pub trait Write<T> {
    /// Sets number `k` of lane `l`.
    fn set(&mut self, k: usize, l: usize, x: T);
    /// Sets number `k` of all lanes.
    #[inline(always)]
    fn give<const L: usize>(&mut self, k: usize, x: &[T; L])
    where
        T: Copy,
    {
        for l in 0..L {
            self.set(k, l, x[l]);
        }
    }
    /// Sets numbers `k` and `k + 1` of all lanes, those of one state at once where the processor can: who reads them
    /// next reads several at once, and has to wait for the memory if they were written one by one.
    #[inline(always)]
    fn give_pair<const L: usize>(&mut self, k: usize, x: [&[T; L]; 2])
    where
        T: Copy,
    {
        self.give(k, x[0]);
        self.give(k + 1, x[1]);
    }
}

/// Writes two numbers at once.
#[inline(always)]
#[allow(unsafe_code)]
fn store_pair(to: &mut [f64; 2], x: [f64; 2]) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: `to` are two doubles, which need not be aligned; every x86-64 has SSE2.
    unsafe {
        use core::arch::x86_64::{_mm_set_pd, _mm_storeu_pd};
        _mm_storeu_pd(to.as_mut_ptr(), _mm_set_pd(x[1], x[0]));
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        *to = x;
    }
}

macro_rules! places {
    ($float:tt) => {
        places!(@one $float, [const N: usize], [$float; N]);
        places!(@one $float, [], [$float]);
        places!(@lanes $float, [const L: usize, const N: usize], [[$float; L]; N]);
        places!(@lanes $float, [const L: usize], [[$float; L]]);
        // Blocks of a batch, which lie where the caller's columns are.
        places!(@read $float, [const L: usize, const N: usize], [&[$float; L]; N]);
        impl<const L: usize, const N: usize> Write<$float> for [&mut [$float; L]; N] {
            #[inline(always)]
            fn set(&mut self, k: usize, l: usize, x: $float) {
                self[k][l] = x;
            }
        }
    };
    (@one $float:tt, [$($parameters:tt)*], $array:ty) => {
        impl<$($parameters)*> Read<$float> for $array {
            #[inline(always)]
            fn get(&self, k: usize, _: usize) -> $float {
                self[k]
            }
        }
        impl<$($parameters)*> Write<$float> for $array {
            #[inline(always)]
            fn set(&mut self, k: usize, _: usize, x: $float) {
                self[k] = x;
            }
            places!(@pair $float);
        }
    };
    (@pair f64) => {
        #[inline(always)]
        fn give_pair<const L: usize>(&mut self, k: usize, [a, b]: [&[f64; L]; 2]) {
            if let (1, Some(to)) = (L, self.get_mut(k..).and_then(|rest| rest.first_chunk_mut())) {
                return store_pair(to, [a[0], b[0]]);
            }
            self.give(k, a);
            self.give(k + 1, b);
        }
    };
    (@pair f32) => {};
    (@lanes $float:tt, [$($parameters:tt)*], $array:ty) => {
        places!(@read $float, [$($parameters)*], $array);
        impl<$($parameters)*> Write<$float> for $array {
            #[inline(always)]
            fn set(&mut self, k: usize, l: usize, x: $float) {
                self[k][l] = x;
            }
        }
    };
    (@read $float:tt, [$($parameters:tt)*], $array:ty) => {
        impl<$($parameters)*> Read<$float> for $array {
            #[inline(always)]
            fn get(&self, k: usize, l: usize) -> $float {
                self[k][l]
            }
        }
    };
}

places!(f64);
places!(f32);

/// A local array of a kernel: `N` rows of `L` lanes, aligned so that no vector crosses a cache line. (Without `std`
/// there are no wide vectors, and stack memory is scarce; the array is then not aligned.)
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "std", repr(align(64)))]
pub struct Rows<T, const L: usize, const N: usize>(pub [[T; L]; N]);

impl<T, const L: usize, const N: usize> core::ops::Deref for Rows<T, L, N> {
    type Target = [[T; L]; N];
    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<T, const L: usize, const N: usize> core::ops::DerefMut for Rows<T, L, N> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// Rows of a loop that a kernel keeps for later loops: up to `N` rows of `R` numbers for each of `L` lanes. They are
/// written in order and cost nothing before. (Zeros at the start take longer than all arithmetic of a simple loop.)
#[cfg_attr(feature = "std", repr(align(64)))]
pub struct PushedRows<T, const L: usize, const R: usize, const N: usize> {
    /// The first `len` are written.
    rows: [MaybeUninit<[[T; L]; R]>; N],
    len: usize,
}

#[allow(unsafe_code)]
impl<T: Copy, const L: usize, const R: usize, const N: usize> PushedRows<T, L, R, N> {
    /// No rows.
    #[inline(always)]
    pub fn new() -> Self {
        PushedRows { rows: [const { MaybeUninit::uninit() }; N], len: 0 }
    }

    /// Writes the next row.
    ///
    /// # Panics
    /// If there are `N` already.
    #[inline(always)]
    pub fn push(&mut self, row: [[T; L]; R]) {
        self.rows[self.len].write(row);
        self.len += 1;
    }

    /// Row `k`, counted in the order of writing.
    ///
    /// # Panics
    /// If there is no such row.
    #[inline(always)]
    pub fn row(&self, k: usize) -> &[[T; L]; R] {
        assert!(k < self.len, "a row is written before it is read");
        // SAFETY: `len` counts the rows that `push` has written, from the first on.
        unsafe { self.rows[k].assume_init_ref() }
    }
}

impl<T: Copy, const L: usize, const R: usize, const N: usize> Default for PushedRows<T, L, R, N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Instructions that kernels use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Nothing beyond the baseline of the target.
    Plain,
    /// Fused multiplication and addition; on x86-64 with vectors of 32 bytes (AVX2).
    Fused,
    /// The same with vectors of 64 bytes (AVX-512).
    Wide,
}

/// The best level that the processor supports.
#[inline]
pub fn level() -> Level {
    processor::level()
}

/// From now on the program uses no better instructions than those of a level, which is returned: the lower one of `most`
/// and of what it used before. Generated functions with fast arithmetic then have the bits that they have on processors
/// of that level; those of exact arithmetic do not depend on it. Machine code that was made before stays as it is, and so do
/// functions for which the compiler was told the processor (`-C target-cpu`). Where the level is known at compile time,
/// nothing changes.
pub fn limit_level(most: Level) -> Level {
    processor::limit_level(most)
}

/// Runs a kernel for one state.
#[inline(always)]
pub fn call<K: Kernel<ID, 1, X>, const ID: usize, X>(arguments: X) {
    processor::call::<K, ID, 1, X, false>(arguments);
}

/// Runs a kernel for one state that is so long that it runs short of registers all the time: with AVX-512, which has twice as
/// many, where the processor has it. Shorter kernels lose by it on some processors, on which vectors of 64 bytes, which the
/// compiler uses here and there, slow down what stands beside them. Without optimisation, for which debug assertions stand,
/// nothing is gained, and a version less is compiled.
#[inline(always)]
pub fn call_long<K: Kernel<ID, 1, X>, const ID: usize, X>(arguments: X) {
    processor::call::<K, ID, 1, X, { !cfg!(debug_assertions) }>(arguments);
}

/// Runs a kernel of exact arithmetic for one state, whose body is in [`Plain`] arithmetic whatever it is called with: the same
/// bits with the instructions of every level, those of AVX-512 as in [`call_long`] if it is `LONG`. With debug assertions, only
/// the version of the target is compiled.
#[inline(always)]
pub fn call_exact<K: Kernel<ID, 1, X>, const ID: usize, const LONG: bool, X>(arguments: X) {
    #[cfg(debug_assertions)]
    K::run::<Plain>(arguments);
    #[cfg(not(debug_assertions))]
    processor::call::<K, ID, 1, X, LONG>(arguments);
}

/// Runs a kernel for `L` states of numbers of type `T`.
#[inline(always)]
pub fn call_lanes<K: Kernel<ID, L, X>, const ID: usize, const L: usize, T, X>(arguments: X) {
    // Vectors of 64 bytes only where the lanes fill them.
    if const { L * size_of::<T>() >= 64 } {
        processor::call::<K, ID, L, X, true>(arguments);
    } else {
        processor::call::<K, ID, L, X, false>(arguments);
    }
}

/// The level is detected at run time.
#[cfg(all(feature = "std", target_arch = "x86_64"))]
#[allow(unsafe_code)]
mod processor {
    use core::sync::atomic::{AtomicU8, Ordering};

    use super::{Fused, Kernel, Level, Plain};

    /// 0: not detected yet; otherwise one more than the level.
    static LEVEL: AtomicU8 = AtomicU8::new(0);

    #[inline]
    pub fn level() -> Level {
        match LEVEL.load(Ordering::Relaxed) {
            3 => Level::Wide,
            2 => Level::Fused,
            1 => Level::Plain,
            _ => ask(),
        }
    }

    #[cold]
    #[inline(never)]
    fn ask() -> Level {
        use std::is_x86_feature_detected as has;
        let wide = cfg!(avx512) && has!("avx512f") && has!("avx512dq") && has!("avx512vl");
        let found = match has!("avx2") && has!("fma") {
            true if wide => Level::Wide,
            true => Level::Fused,
            false => Level::Plain,
        };
        LEVEL.store(found as u8 + 1, Ordering::Relaxed);
        found
    }

    pub fn limit_level(most: Level) -> Level {
        let now = level().min(most);
        LEVEL.store(now as u8 + 1, Ordering::Relaxed);
        now
    }

    #[inline(always)]
    pub fn call<K: Kernel<ID, L, X>, const ID: usize, const L: usize, X, const WIDE: bool>(arguments: X) {
        #[cfg(all(target_feature = "avx2", target_feature = "fma"))]
        if !WIDE {
            // The whole program is compiled for such a processor: nothing has to be detected, and the kernel can be
            // inlined.
            return K::run::<Fused>(arguments);
        }
        match level() {
            // SAFETY: `level` says that the processor has AVX2, FMA and these three parts of AVX-512.
            #[cfg(avx512)]
            Level::Wide if WIDE => unsafe { wide::<K, ID, L, X>(arguments) },
            // SAFETY: `level` says that the processor has AVX2 and FMA.
            Level::Wide | Level::Fused => unsafe { fused::<K, ID, L, X>(arguments) },
            Level::Plain => plain::<K, ID, L, X>(arguments),
        }
    }

    #[inline(never)]
    fn plain<K: Kernel<ID, L, X>, const ID: usize, const L: usize, X>(arguments: X) {
        K::run::<Plain>(arguments);
    }

    /// # Safety
    /// The processor has AVX2 and FMA.
    #[target_feature(enable = "avx2,fma")]
    unsafe fn fused<K: Kernel<ID, L, X>, const ID: usize, const L: usize, X>(arguments: X) {
        K::run::<Fused>(arguments);
    }

    /// # Safety
    /// The processor has AVX2, FMA, and of AVX-512 F, DQ and VL.
    #[cfg(avx512)]
    #[target_feature(enable = "avx2,fma,avx512f,avx512dq,avx512vl")]
    unsafe fn wide<K: Kernel<ID, L, X>, const ID: usize, const L: usize, X>(arguments: X) {
        K::run::<Fused>(arguments);
    }
}

/// The level is known at compile time.
#[cfg(not(all(feature = "std", target_arch = "x86_64")))]
mod processor {
    use super::{Kernel, Level};

    #[cfg(all(feature = "std", target_arch = "aarch64"))]
    type Best = super::Fused;
    #[cfg(not(all(feature = "std", target_arch = "aarch64")))]
    type Best = super::Plain;

    #[inline]
    pub fn level() -> Level {
        match cfg!(all(feature = "std", target_arch = "aarch64")) {
            true => Level::Fused,
            false => Level::Plain,
        }
    }

    pub fn limit_level(_: Level) -> Level {
        level()
    }

    #[inline(always)]
    pub fn call<K: Kernel<ID, L, X>, const ID: usize, const L: usize, X, const WIDE: bool>(arguments: X) {
        K::run::<Best>(arguments);
    }
}

#[cfg(test)]
mod tests;
