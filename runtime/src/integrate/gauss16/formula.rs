//! The coefficients of the method, computed in the precision of the scalar.

use crate::system::Real;
use crate::Scalar;

/// Stages.
pub(super) const STAGES: usize = 8;

/// One number for each stage.
pub(super) type Row<S> = [S; STAGES];
/// By it a row is multiplied from the left: `out_i = Σ_j row_j matrix[j][i]`.
pub(super) type Matrix<S> = [Row<S>; STAGES];

/// The coefficients of the method.
#[derive(Clone, Debug)]
pub(super) struct Formula<S> {
    /// Nodes, in the step from 0 to 1.
    pub c: Row<S>,
    pub b: Row<S>,
    /// Displacements of the stages from their rates.
    pub a: Matrix<S>,
    /// Coefficients of the Legendre series from the rates of the stages.
    pub series: Matrix<S>,
}

/// `P_0` to `P_8` at each of the `x`.
#[inline(always)]
fn legendre<S: Real>(x: &Row<S>) -> [Row<S>; STAGES + 1] {
    let mut p = [[S::one(); STAGES]; STAGES + 1];
    p[1] = *x;
    for k in 1..STAGES {
        let n = S::from_index(k);
        let [first, second] = [n + n + S::one(), n].map(|weight| weight / (n + S::one()));
        p[k + 1] = core::array::from_fn(|i| first * x[i] * p[k][i] - second * p[k - 1][i]);
    }
    p
}

/// Integrals of `P_0` to `P_7` from −1 to each of the `x`, by `(2k + 1) ∫ P_k = P_{k+1} − P_{k−1}`.
#[inline(always)]
pub(super) fn integrals<S: Real>(x: &Row<S>) -> Matrix<S> {
    let p = legendre(x);
    core::array::from_fn(|k| match k {
        0 => x.map(|x| x + S::one()),
        _ => {
            let weight = S::one() / S::from_index(2 * k + 1);
            core::array::from_fn(|i| weight * (p[k + 1][i] - p[k - 1][i]))
        }
    })
}

impl<S: Real> Formula<S> {
    /// Nodes by Newton's method, in the precision of the scalar; everything else follows from them.
    pub fn new() -> Self {
        let (n, half, one) = (S::from_index(STAGES), S::constant(0.5), S::one());
        // The derivative of `P_8` at `x_i`.
        let slope =
            |x: S, i: usize, p: &[Row<S>; STAGES + 1]| n * (x * p[STAGES][i] - p[STAGES - 1][i]) / (x * x - one);
        let mut x: Row<S> = core::array::from_fn(|i| {
            let angle = core::f64::consts::PI * (i as f64 + 0.75) / (STAGES as f64 + 0.5);
            S::constant(-libm::cos(angle))
        });
        for _ in 0..8 {
            let p = legendre(&x);
            x = core::array::from_fn(|i| x[i] - p[STAGES][i] / slope(x[i], i, &p));
        }
        let p = legendre(&x);
        let b: Row<S> = core::array::from_fn(|i| {
            let slope = slope(x[i], i, &p);
            one / ((one - x[i] * x[i]) * slope * slope)
        });
        let series: Matrix<S> =
            core::array::from_fn(|j| core::array::from_fn(|k| S::from_index(2 * k + 1) * b[j] * p[k][j]));
        let integrals = integrals(&x);
        let a = series.map(|series| multiply(&series, &integrals).map(|a| half * a));
        Formula { c: x.map(|x| half * (x + one)), b, a, series }
    }
}

/// A row times a matrix.
#[inline(always)]
pub(super) fn multiply<S: Scalar>(row: &Row<S>, matrix: &Matrix<S>) -> Row<S> {
    // Four sums, so that additions wait less for one another.
    let mut sums = [[S::zero(); STAGES]; 4];
    for j in 0..STAGES {
        let (x, weights, sum) = (row[j], &matrix[j], &mut sums[j % 4]);
        *sum = core::array::from_fn(|i| sum[i] + x * weights[i]);
    }
    core::array::from_fn(|i| (sums[0][i] + sums[1][i]) + (sums[2][i] + sums[3][i]))
}

/// The root of order 2ⁿ: quicker than a power.
pub(super) fn root(x: f64, n: u32) -> f64 {
    (0..n).fold(x, |x, _| libm::sqrt(x))
}
