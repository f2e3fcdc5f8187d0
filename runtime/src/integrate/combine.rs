//! Weighted sums of the rates of a step's stages.

use crate::Scalar;

/// What is done to a sum of rates.
#[derive(Clone, Copy)]
pub(super) enum Then<'a, S> {
    /// It is multiplied by the step.
    Scale(S),
    /// It is added to the state at the start of the step.
    AddTo(&'a [S]),
}

/// `out = Σ wⱼ k(j)` over the pairs `(j, wⱼ)`, and then `then`: a few components at a time, so that their sums stay in
/// registers, and by pairs at the end, so that who reads the result as vectors finds vectors. Every list is as long as
/// `out`: where the compiler cannot know that, there must not be a panic path either.
#[inline(always)]
pub(super) fn combine<'a, S: Scalar + 'a>(
    out: &mut [S],
    then: Then<S>,
    weights: impl Iterator<Item = (usize, S)> + Clone,
    k: impl Fn(usize) -> &'a [S],
) {
    let mut at = 0;
    while combine_some::<S, 4>(out, at, then, weights.clone(), &k) {
        at += 4;
    }
    // Without vector instructions these would be more instructions of the same kind.
    let pairs = cfg!(any(target_arch = "x86_64", target_arch = "aarch64"));
    if pairs && combine_some::<S, 2>(out, at, then, weights.clone(), &k) {
        at += 2;
    }
    while combine_some::<S, 1>(out, at, then, weights.clone(), &k) {
        at += 1;
    }
}

/// [`combine`] for `N` components from `at` on; returns whether there were as many.
#[inline(always)]
fn combine_some<'a, S: Scalar + 'a, const N: usize>(
    out: &mut [S],
    at: usize,
    then: Then<S>,
    weights: impl Iterator<Item = (usize, S)>,
    k: &impl Fn(usize) -> &'a [S],
) -> bool {
    fn some<S, const N: usize>(list: &[S], at: usize) -> Option<&[S; N]> {
        list.get(at..).and_then(|list| list.first_chunk())
    }
    let Some(out) = out.get_mut(at..).and_then(|out| out.first_chunk_mut::<N>()) else { return false };
    // The sum starts at minus zero: minus zero plus a term is that term, and the compiler removes this addition. It
    // could not remove an addition of plus zero.
    let mut sum = [-S::zero(); N];
    for (j, w) in weights {
        let Some(k) = some::<S, N>(k(j), at) else { continue };
        for l in 0..N {
            sum[l] = sum[l] + w * k[l];
        }
    }
    *out = match then {
        Then::Scale(h) => sum.map(|sum| h * sum),
        Then::AddTo(base) => {
            let Some(base) = some::<S, N>(base, at) else { return false };
            core::array::from_fn(|l| base[l] + sum[l])
        }
    };
    true
}
