//! Rates of many states: columns in, columns out.
//!
//! A column holds one coordinate of every state: `q[k][s]` is coordinate `k` of state `s`. Neighbouring states are
//! therefore computed together in vector registers without a transposition. Generated types have a method
//! `rates_batch`; with feature `rayon`, `rates_parallel` distributes the states over several threads.

use crate::Scalar;

/// An error in the columns of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BatchError {
    /// Two columns differ in length.
    Lengths {
        /// Length of the first column.
        expected: usize,
        /// Length of a column that differs.
        found: usize,
    },
}

impl core::fmt::Display for BatchError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let BatchError::Lengths { expected, found } = self;
        write!(f, "a column has {found} numbers, the first has {expected}")
    }
}

impl core::error::Error for BatchError {}

/// A system whose rates can be computed for many states in one call. `NT` is `NV`, or 0 without joint forces.
pub trait RatesBatch<T, const NQ: usize, const NV: usize, const NT: usize> {
    /// Computes the rates of any number of states; the columns are those of `q` (rad, m), `p`, `tau` (N m, N), `q̇` and
    /// `ṗ`.
    ///
    /// # Errors
    /// [`BatchError::Lengths`]; nothing is written then.
    fn rates_batch(
        &self,
        q: [&[T]; NQ],
        p: [&[T]; NV],
        tau: [&[T]; NT],
        qd: [&mut [T]; NQ],
        pd: [&mut [T]; NV],
    ) -> Result<(), BatchError>;
}

/// The common length of all columns.
fn length(lengths: impl IntoIterator<Item = usize>) -> Result<usize, BatchError> {
    let mut lengths = lengths.into_iter();
    let expected = lengths.next().unwrap_or(0);
    match lengths.find(|n| *n != expected) {
        Some(found) => Err(BatchError::Lengths { expected, found }),
        None => Ok(expected),
    }
}

/// Fewer than `L` states as a block: its last places are filled with the last state, which is valid.
fn padded<T: Scalar, const L: usize, const N: usize>(columns: &[&[T]; N]) -> [[T; L]; N] {
    columns.map(|column| {
        let mut lanes = [column.last().copied().unwrap_or(T::zero()); L];
        lanes.iter_mut().zip(column).for_each(|(to, from)| *to = *from);
        lanes
    })
}

/// States `at..at + L` of some columns, where they are, if the columns are so long.
#[inline(always)]
fn block<'a, T, const L: usize, const N: usize>(columns: &[&'a [T]; N], at: usize, block: &mut [&'a [T; L]; N]) {
    for (column, block) in columns.iter().zip(block) {
        if let Some(full) = column.get(at..).and_then(<[T]>::first_chunk) {
            *block = full;
        }
    }
}

/// The same for columns that are written; `spare` is written in the place of columns that are shorter.
#[inline(always)]
fn block_mut<'a, T, const L: usize, const N: usize>(
    columns: &'a mut [&mut [T]; N],
    at: usize,
    spare: &'a mut [[T; L]; N],
) -> [&'a mut [T; L]; N] {
    let mut block = spare.each_mut();
    for (column, block) in columns.iter_mut().zip(&mut block) {
        if let Some(full) = column.get_mut(at..).and_then(<[T]>::first_chunk_mut) {
            *block = full;
        }
    }
    block
}

/// Cuts columns into blocks of `L` states and runs a kernel on each; for generated code. The kernel reads and writes the
/// columns themselves. A copy would be made here by narrower instructions than those of the kernel, which would wait for
/// it. Where a block begins is found here, once: kernels that found it for every column took up to a quarter more time.
///
/// # Errors
/// [`BatchError::Lengths`].
#[inline]
pub fn run<T: Scalar, const L: usize, const NQ: usize, const NV: usize, const NT: usize>(
    q: [&[T]; NQ],
    p: [&[T]; NV],
    tau: [&[T]; NT],
    mut qd: [&mut [T]; NQ],
    mut pd: [&mut [T]; NV],
    mut kernel: impl FnMut(&[&[T; L]; NQ], &[&[T; L]; NV], &[&[T; L]; NT], &mut [&mut [T; L]; NQ], &mut [&mut [T; L]; NV]),
) -> Result<(), BatchError> {
    let inputs = q.iter().chain(&p).chain(&tau).map(|c| c.len());
    let n = length(inputs.chain(qd.iter().chain(&pd).map(|c| c.len())))?;
    let zero = [T::zero(); L];
    let (mut q_block, mut p_block, mut tau_block) = ([&zero; NQ], [&zero; NV], [&zero; NT]);
    let (mut qd_spare, mut pd_spare) = ([zero; NQ], [zero; NV]);
    let (q_padded, p_padded, tau_padded);
    if n < L {
        (q_padded, p_padded, tau_padded) = (padded(&q), padded(&p), padded(&tau));
        (q_block, p_block, tau_block) = (q_padded.each_ref(), p_padded.each_ref(), tau_padded.each_ref());
    }
    for at in (0..n).step_by(L.max(1)) {
        // The last block ends with the last state; what it has in common with the one before is computed twice.
        let at = at.min(n.saturating_sub(L));
        block(&q, at, &mut q_block);
        block(&p, at, &mut p_block);
        block(&tau, at, &mut tau_block);
        let mut qd_block = block_mut(&mut qd, at, &mut qd_spare);
        let mut pd_block = block_mut(&mut pd, at, &mut pd_spare);
        kernel(&q_block, &p_block, &tau_block, &mut qd_block, &mut pd_block);
    }
    if n < L {
        take(&mut qd, &qd_spare);
        take(&mut pd, &pd_spare);
    }
    Ok(())
}

/// Takes the results of fewer states than a block has.
fn take<T: Copy, const L: usize, const N: usize>(columns: &mut [&mut [T]; N], block: &[[T; L]; N]) {
    for (column, block) in columns.iter_mut().zip(block) {
        column.iter_mut().zip(block).for_each(|(to, from)| *to = *from);
    }
}

/// [`RatesBatch::rates_batch`] on the threads of rayon's pool. The results of every state are those of a single thread.
///
/// # Errors
/// [`BatchError::Lengths`]; nothing is written then.
#[cfg(feature = "rayon")]
pub fn rates_parallel<S, T, const NQ: usize, const NV: usize, const NT: usize>(
    system: &S,
    q: [&[T]; NQ],
    p: [&[T]; NV],
    tau: [&[T]; NT],
    qd: [&mut [T]; NQ],
    pd: [&mut [T]; NV],
) -> Result<(), BatchError>
where
    S: RatesBatch<T, NQ, NV, NT> + Sync,
    T: Scalar + Send + Sync,
{
    /// Smallest number of states for a thread; a multiple of all block sizes.
    const GRAIN: usize = 256;
    let inputs = q.iter().chain(&p).chain(&tau).map(|c| c.len());
    let n = length(inputs.chain(qd.iter().chain(&pd).map(|c| c.len())))?;
    if n < 2 * GRAIN {
        return system.rates_batch(q, p, tau, qd, pd);
    }
    let at = n / 2 / GRAIN * GRAIN;
    let ((q, q_rest), (p, p_rest), (tau, tau_rest)) = (halves(q, at), halves(p, at), halves(tau, at));
    let ((qd, qd_rest), (pd, pd_rest)) = (halves_mut(qd, at), halves_mut(pd, at));
    let (first, second) = rayon::join(
        || rates_parallel(system, q, p, tau, qd, pd),
        || rates_parallel(system, q_rest, p_rest, tau_rest, qd_rest, pd_rest),
    );
    first.and(second)
}

#[cfg(feature = "rayon")]
fn halves<T, const N: usize>(columns: [&[T]; N], at: usize) -> ([&[T]; N], [&[T]; N]) {
    (columns.map(|c| c.split_at(at).0), columns.map(|c| c.split_at(at).1))
}

#[cfg(feature = "rayon")]
fn halves_mut<T, const N: usize>(columns: [&mut [T]; N], at: usize) -> ([&mut [T]; N], [&mut [T]; N]) {
    let mut rest: [&mut [T]; N] = core::array::from_fn(|_| <&mut [T]>::default());
    let mut k = 0;
    let first = columns.map(|c| {
        let (a, b) = c.split_at_mut(at);
        rest[k] = b;
        k += 1;
        a
    });
    (first, rest)
}
