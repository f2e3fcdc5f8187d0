//! Small dense matrices: a basis of rows with a rank, LU factors, complete pivoting.

use alloc::vec;
use alloc::vec::Vec;

use crate::system::Real;

/// Rows that stand out of the others by less than this part of the largest count as dependent on them: 6e-6 in
/// doubles. Rows are compared by their lengths here, and not by squares as in the sweeps.
pub(super) fn rank_tolerance<S: Real>() -> S {
    S::constant(libm::cbrt(S::epsilon()))
}

fn dot<S: Real>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).fold(S::zero(), |sum, (a, b)| sum + *a * *b)
}

/// An orthonormal basis `Q` of the rows of a matrix `A = L Q`, by the modified Gram-Schmidt process with the largest
/// row first.
#[derive(Clone, Debug, Default)]
pub(super) struct Basis<S> {
    rank: usize,
    /// Rows of `Q`.
    q: Vec<S>,
    /// `rows × rank`, at most `rows × rows`.
    l: Vec<S>,
    work: Vec<S>,
    /// `Lᵀ L` with its factors, and a right side.
    normal: Vec<S>,
    z: Vec<S>,
    used: Vec<bool>,
}

impl<S: Real> Basis<S> {
    pub fn new(m: usize, n: usize) -> Self {
        let o = S::zero();
        Basis {
            rank: 0,
            q: vec![o; m * n],
            l: vec![o; m * m],
            work: vec![o; m * n],
            normal: vec![o; m * m],
            z: vec![o; m],
            used: vec![false; m],
        }
    }

    /// Of `m` rows of `n` numbers. Returns their rank.
    pub fn factor(&mut self, a: &[S], m: usize, n: usize) -> usize {
        self.work.copy_from_slice(a);
        self.used.fill(false);
        self.l.fill(S::zero());
        self.rank = 0;
        let mut largest = S::zero();
        for k in 0..m.min(n) {
            let (mut best, mut size) = (0, S::zero());
            for i in (0..m).filter(|i| !self.used[*i]) {
                let row = &self.work[i * n..(i + 1) * n];
                let square = dot(row, row);
                if square > size {
                    (best, size) = (i, square);
                }
            }
            let norm = size.sqrt();
            if k == 0 {
                largest = norm;
            }
            // A value that is not a number never compares as larger.
            if size == S::zero() || norm <= rank_tolerance::<S>() * largest {
                break;
            }
            self.used[best] = true;
            for j in 0..n {
                self.q[k * n + j] = self.work[best * n + j] / norm;
            }
            let q = &self.q[k * n..(k + 1) * n];
            for i in 0..m {
                let row = &mut self.work[i * n..(i + 1) * n];
                let part = dot(row, q);
                if i == best || !self.used[i] {
                    self.l[i * m + k] = part;
                    for (x, q) in row.iter_mut().zip(q) {
                        *x = *x - part * *q;
                    }
                }
            }
            self.rank = k + 1;
        }
        self.rank
    }

    /// The `x` of least norm among those with the least `|A x − b|`.
    pub fn solve(&mut self, b: &[S], m: usize, n: usize, x: &mut [S]) {
        // L has full column rank: the normal equations are r × r. Where no row depends on others L is triangular but
        // for the order of its rows, and they are met exactly; their condition only slows a Newton iteration down.
        let r = self.rank;
        for i in 0..r {
            self.z[i] = (0..m).fold(S::zero(), |sum, k| sum + self.l[k * m + i] * b[k]);
            for j in 0..=i {
                let mut sum = (0..m).fold(S::zero(), |sum, k| sum + self.l[k * m + i] * self.l[k * m + j]);
                for k in 0..j {
                    sum = sum - self.normal[i * m + k] * self.normal[j * m + k];
                }
                self.normal[i * m + j] = if i == j { sum.sqrt() } else { sum / self.normal[j * m + j] };
            }
        }
        for i in 0..r {
            for k in 0..i {
                self.z[i] = self.z[i] - self.normal[i * m + k] * self.z[k];
            }
            self.z[i] = self.z[i] / self.normal[i * m + i];
        }
        for i in (0..r).rev() {
            for k in i + 1..r {
                self.z[i] = self.z[i] - self.normal[k * m + i] * self.z[k];
            }
            self.z[i] = self.z[i] / self.normal[i * m + i];
        }
        x.fill(S::zero());
        for (z, q) in self.z.iter().take(r).zip(self.q.chunks_exact(n.max(1))) {
            for (x, q) in x.iter_mut().zip(q) {
                *x = *x + *z * *q;
            }
        }
    }
}

/// Rows and columns of pivots into `found`, the largest of what is left each time, until that is below `tolerance` of
/// the first. The matrix is destroyed.
pub(super) fn pivots<S: Real>(a: &mut [S], m: usize, n: usize, tolerance: S, found: &mut Vec<(usize, usize)>) {
    found.clear();
    let mut first = S::zero();
    while found.len() < m.min(n) {
        let (mut at, mut size) = ((0, 0), S::zero());
        for i in (0..m).filter(|i| found.iter().all(|f| f.0 != *i)) {
            for j in (0..n).filter(|j| found.iter().all(|f| f.1 != *j)) {
                if a[i * n + j].abs() > size {
                    (at, size) = ((i, j), a[i * n + j].abs());
                }
            }
        }
        if found.is_empty() {
            first = size;
        }
        // A value that is not a number never compares as larger.
        if size == S::zero() || size <= tolerance * first {
            break;
        }
        found.push(at);
        for i in (0..m).filter(|i| found.iter().all(|f| f.0 != *i)) {
            let factor = a[i * n + at.1] / a[at.0 * n + at.1];
            for j in 0..n {
                a[i * n + j] = a[i * n + j] - factor * a[at.0 * n + j];
            }
        }
    }
}

/// LU factors of a square matrix with partial pivoting, in place.
#[derive(Clone, Debug, Default)]
pub(super) struct Lu<S> {
    n: usize,
    a: Vec<S>,
    exchanged: Vec<usize>,
}

impl<S: Real> Lu<S> {
    pub fn new(n: usize) -> Self {
        Lu { n, a: vec![S::zero(); n * n], exchanged: vec![0; n] }
    }

    /// Takes the elements of a matrix no larger than the first one.
    pub fn set(&mut self, n: usize, element: impl Fn(usize, usize) -> S) {
        self.n = n;
        for i in 0..n {
            for j in 0..n {
                self.a[i * n + j] = element(i, j);
            }
        }
    }

    /// Factors the matrix in `a`. Returns false if a pivot is zero or not a number.
    pub fn factor(&mut self) -> bool {
        let n = self.n;
        for k in 0..n {
            let (mut best, mut size) = (k, S::zero());
            for i in k..n {
                if self.a[i * n + k].abs() > size {
                    (best, size) = (i, self.a[i * n + k].abs());
                }
            }
            if size == S::zero() || !size.is_finite() {
                return false;
            }
            self.exchanged[k] = best;
            for j in 0..n {
                self.a.swap(k * n + j, best * n + j);
            }
            for i in k + 1..n {
                let factor = self.a[i * n + k] / self.a[k * n + k];
                self.a[i * n + k] = factor;
                for j in k + 1..n {
                    self.a[i * n + j] = self.a[i * n + j] - factor * self.a[k * n + j];
                }
            }
        }
        true
    }

    /// `A x = b`, in place.
    pub fn solve(&self, b: &mut [S]) {
        let n = self.n;
        for k in 0..n {
            b.swap(k, self.exchanged[k]);
        }
        for i in 0..n {
            for k in 0..i {
                b[i] = b[i] - self.a[i * n + k] * b[k];
            }
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                b[i] = b[i] - self.a[i * n + k] * b[k];
            }
            b[i] = b[i] / self.a[i * n + i];
        }
    }

    /// `Aᵀ x = b`, in place.
    pub fn solve_transposed(&self, b: &mut [S]) {
        let n = self.n;
        for i in 0..n {
            for k in 0..i {
                b[i] = b[i] - self.a[k * n + i] * b[k];
            }
            b[i] = b[i] / self.a[i * n + i];
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                b[i] = b[i] - self.a[k * n + i] * b[k];
            }
        }
        for k in (0..n).rev() {
            b.swap(k, self.exchanged[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize, seed: u64) -> Vec<f64> {
        let mut x = seed;
        (0..n)
            .map(|_| {
                x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (x >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
            })
            .collect()
    }

    fn times(a: &[f64], x: &[f64], i: usize, n: usize) -> f64 {
        dot(&a[i * n..(i + 1) * n], x)
    }

    /// Condition numbers of these are below 1e3: 1e-11 is 1e3 · 1e3 · ε of slack for the normal equations.
    #[test]
    fn linear_solves() {
        for n in 1..7 {
            let a = matrix(n * n, n as u64);
            let mut lu = Lu::new(n);
            lu.a.copy_from_slice(&a);
            assert!(lu.factor());
            let b = matrix(n, 99);
            let (mut x, mut y) = (b.clone(), b.clone());
            lu.solve(&mut x);
            lu.solve_transposed(&mut y);
            for i in 0..n {
                assert!((times(&a, &x, i, n) - b[i]).abs() < 1e-12);
                let sum: f64 = (0..n).map(|k| a[k * n + i] * y[k]).sum();
                assert!((sum - b[i]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn least_norm_and_rank() {
        let (m, n) = (3, 5);
        let mut a = matrix(m * n, 3);
        let b = [0.3, -0.2, 0.7];
        let mut basis = Basis::new(m, n);
        assert_eq!(basis.factor(&a, m, n), 3);
        let mut x = vec![0.0; n];
        basis.solve(&b, m, n, &mut x);
        for i in 0..m {
            assert!((times(&a, &x, i, n) - b[i]).abs() < 1e-11);
        }
        // The third row becomes the sum of the others: the residual of least squares is normal to the columns.
        for j in 0..n {
            a[2 * n + j] = a[j] + a[n + j];
        }
        assert_eq!(basis.factor(&a, m, n), 2);
        basis.solve(&b, m, n, &mut x);
        let r: Vec<f64> = (0..m).map(|i| times(&a, &x, i, n) - b[i]).collect();
        for j in 0..n {
            let sum: f64 = (0..m).map(|i| a[i * n + j] * r[i]).sum();
            assert!(sum.abs() < 1e-11, "{sum}");
        }
        let mut found = Vec::new();
        pivots(&mut a, m, n, 1e-9, &mut found);
        assert_eq!(found.len(), 2);
    }
}
