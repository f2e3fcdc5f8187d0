//! The inner loops over rows, compiled for the instructions of the processor as generated code is. Whole rows are read
//! and written, so that the compiler keeps them in vector registers.

use super::formula::{integrals, multiply, Matrix, Row, STAGES};
use crate::kernel::{Arithmetic, Kernel};
use crate::system::Real;
use crate::Scalar;

/// The sum of a row.
pub(super) fn total<S: Scalar>(row: &Row<S>) -> S {
    let [a, b, c, d, e, f, g, h] = *row;
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

/// One iteration: from the rates at the stages their new displacements.
pub(super) struct Iterate;

/// What it reads and writes. Coordinates come before momenta.
pub(super) struct Iteration<'a, S> {
    /// `h a`.
    pub a: &'a Matrix<S>,
    /// Rates; those of the coordinates are corrected by what the momenta change.
    pub f: &'a mut [Row<S>],
    pub z: &'a mut [Row<S>],
    /// As in [`ParallelGauss`](super::ParallelGauss).
    pub mobility: &'a [S],
    pub weights: &'a [S],
    /// Changes of the momenta.
    pub changes: &'a mut [Row<S>],
    /// Sums of the squares of all changes in units of `1/weights`, lane by lane.
    pub squares: &'a mut Row<S>,
}

impl<S: Scalar> Kernel<0, STAGES, Iteration<'_, S>> for Iterate {
    #[inline(always)]
    fn run<A: Arithmetic>(iteration: Iteration<'_, S>) {
        let Iteration { a, f, z, mobility, weights, changes, squares } = iteration;
        let n = changes.len();
        let ((fx, fp), (zx, zp), (wx, wp)) = (f.split_at_mut(n), z.split_at_mut(n), weights.split_at(n));
        let mut sum = [S::zero(); STAGES];
        for (((f, z), weight), change) in fp.iter().zip(zp).zip(wp).zip(changes.iter_mut()) {
            let new = multiply(f, a);
            *change = difference(&new, z);
            sum = add_squares(&sum, change, *weight);
            *z = new;
        }
        for (k, ((f, z), weight)) in fx.iter_mut().zip(zx).zip(wx).enumerate() {
            let mut rate = *f;
            for (change, m) in changes.iter().zip(mobility.iter().skip(k * n)) {
                rate = core::array::from_fn(|i| rate[i] + *m * change[i]);
            }
            let new = multiply(&rate, a);
            sum = add_squares(&sum, &difference(&new, z), *weight);
            (*f, *z) = (rate, new);
        }
        *squares = sum;
    }
}

#[inline(always)]
fn difference<S: Scalar>(a: &Row<S>, b: &Row<S>) -> Row<S> {
    core::array::from_fn(|i| a[i] - b[i])
}

#[inline(always)]
fn add_squares<S: Scalar>(sum: &Row<S>, x: &Row<S>, weight: S) -> Row<S> {
    core::array::from_fn(|i| {
        let x = weight * x[i];
        sum[i] + x * x
    })
}

/// Rows times a matrix, and the sums of the squares of each column in units of `1/weights`.
pub(super) struct Multiply;

/// Rows, matrix, weights, products, sums.
pub(super) type Product<'a, S> = (&'a [Row<S>], &'a Matrix<S>, &'a [S], &'a mut [Row<S>], &'a mut Row<S>);

impl<S: Scalar> Kernel<0, STAGES, Product<'_, S>> for Multiply {
    #[inline(always)]
    fn run<A: Arithmetic>((rows, matrix, weights, out, squares): Product<'_, S>) {
        let mut sum = [S::zero(); STAGES];
        for ((row, weight), out) in rows.iter().zip(weights).zip(out) {
            *out = multiply(row, matrix);
            sum = add_squares(&sum, out, *weight);
        }
        *squares = sum;
    }
}

/// Displacements from the Legendre series of their rates.
pub(super) struct Integrate;

/// Series, the arguments `x`, the lower limit of the integral, half the step of the series, displacements.
pub(super) type Integral<'a, S> = (&'a [Row<S>], &'a Row<S>, S, S, &'a mut [Row<S>]);

impl<S: Real> Kernel<0, STAGES, Integral<'_, S>> for Integrate {
    #[inline(always)]
    fn run<A: Arithmetic>((series, x, from, half, out): Integral<'_, S>) {
        let mut integrals = integrals(x);
        // The others vanish at 1 as at −1.
        integrals[0] = x.map(|x| x - from);
        for (row, out) in series.iter().zip(out) {
            *out = multiply(row, &integrals).map(|x| half * x);
        }
    }
}
