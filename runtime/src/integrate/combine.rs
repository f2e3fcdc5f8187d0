//! Weighted sums of the rates of a step's stages.

use super::chart::Point;
use super::weights::Row;
use crate::system::System;
use crate::Scalar;

/// Coordinates and momenta, or their displacements.
pub(super) type Parts<'a, S> = [&'a [S]; 2];

/// What a sum of rates is added to, where it is a state and not a displacement.
#[derive(Clone, Copy)]
pub(super) struct Start<'a, S> {
    /// The state at the start of the step.
    pub state: Parts<'a, S>,
    /// What rounding removed from the sums of the last steps: summed up with the rates.
    pub carry: Option<Parts<'a, S>>,
}

/// Whether code may use vectors of more than 16 bytes: generated code writes its results in pairs, and what reads a
/// vector wider than what was written into it waits until that is in the cache.
const NARROW: bool = cfg!(target_feature = "avx");

/// `out = start + h Σ wⱼ k_j`, in one pass: a few coordinates and as many momenta at a time, so
/// that their sums stay in registers, and by pairs at the end, so that who reads the result as vectors finds vectors.
/// Every list is as long as its part of `out`: where the compiler cannot know that, there must not be a panic path
/// either.
#[inline(always)]
pub(super) fn combine<Y: System>(
    mut out: [&mut [Y::Scalar]; 2],
    start: Option<Start<Y::Scalar>>,
    h: Y::Scalar,
    weights: Row,
    k: &[Point<Y>],
) {
    #[cfg(feature = "std")]
    if Y::Scalar::LANES > 1 {
        return in_vectors::combine::<Y>((out, start, h, weights, k));
    }
    let mut at = 0;
    while !NARROW && some::<Y, 4>(&mut out, at, start, h, weights, k) {
        at += 4;
    }
    while some::<Y, 2>(&mut out, at, start, h, weights, k) {
        at += 2;
    }
    some::<Y, 1>(&mut out, at, start, h, weights, k);
}

/// Sums of numbers that stand for many: compiled for the instructions of the processor, as generated code is. Not in the code of
/// small processors, which has no such numbers and would grow by a second copy.
#[cfg(feature = "std")]
mod in_vectors {
    use super::{some, Point, Row, Start, System};
    use crate::kernel::{call_lanes, Arithmetic, Kernel};

    /// Doubles of the longest vectors.
    const LANES: usize = 8;

    /// The arguments of [`combine`](super::combine).
    type Sums<'a, Y> = (
        [&'a mut [<Y as System>::Scalar]; 2],
        Option<Start<'a, <Y as System>::Scalar>>,
        <Y as System>::Scalar,
        Row<'a>,
        &'a [Point<Y>],
    );

    struct InVectors;

    impl<Y: System> Kernel<0, LANES, Sums<'_, Y>> for InVectors {
        #[inline(always)]
        fn run<A: Arithmetic>((mut out, start, h, weights, k): Sums<Y>) {
            let mut at = 0;
            while some::<Y, 4>(&mut out, at, start, h, weights, k) {
                at += 4;
            }
            while some::<Y, 1>(&mut out, at, start, h, weights, k) {
                at += 1;
            }
        }
    }

    pub fn combine<Y: System>(sums: Sums<Y>) {
        call_lanes::<InVectors, 0, LANES, f64, Sums<Y>>(sums);
    }
}

/// [`combine`] for `N` components of both parts from `at` on; returns whether there were as many.
#[inline(always)]
fn some<Y: System, const N: usize>(
    out: &mut [&mut [Y::Scalar]; 2],
    at: usize,
    start: Option<Start<Y::Scalar>>,
    h: Y::Scalar,
    weights: Row,
    k: &[Point<Y>],
) -> bool {
    fn pair<'a, S, const N: usize>([x, p]: Parts<'a, S>, at: usize) -> Option<[&'a [S; N]; 2]> {
        Some([x.get(at..)?.first_chunk()?, p.get(at..)?.first_chunk()?])
    }
    let [x, p] = out;
    let (Some(x), Some(p)) = (
        x.get_mut(at..).and_then(|x| x.first_chunk_mut::<N>()),
        p.get_mut(at..).and_then(|p| p.first_chunk_mut::<N>()),
    ) else {
        return false;
    };
    // A sum starts at minus zero: minus zero plus a term is that term, and the compiler removes this addition. It could
    // not remove an addition of plus zero.
    let nothing = [-Y::Scalar::zero(); N];
    let [mut dx, mut dp] = [nothing; 2];
    if let Some([cx, cp]) = start.and_then(|start| start.carry).and_then(|carry| pair(carry, at)) {
        (dx, dp) = (*cx, *cp);
    }
    for (j, w) in weights.iter() {
        let Some([kx, kp]) = k.get(j).and_then(|k| pair::<_, N>(k.parts(), at)) else { continue };
        // The compiler does not copy a loop that has this in it: the code of a small processor stays small.
        #[cfg(target_arch = "arm")]
        core::hint::black_box(());
        let w = h * w.get();
        for l in 0..N {
            dx[l] = dx[l] + w * kx[l];
            dp[l] = dp[l] + w * kp[l];
        }
    }
    match start {
        None => (*x, *p) = (dx, dp),
        Some(start) => {
            let Some([x0, p0]) = pair::<_, N>(start.state, at) else { return false };
            for l in 0..N {
                x[l] = x0[l] + dx[l];
                p[l] = p0[l] + dp[l];
            }
        }
    }
    true
}
