//! Eigenvalues and eigenvectors of a symmetric 3 x 3 matrix.
//!
//! Written here and not taken from a linear algebra crate because this crate is built into every macro expansion: 30
//! lines are cheaper than that dependency in every user's build.

/// A full symmetric matrix from `[xx, yy, zz, xy, xz, yz]`.
pub(crate) fn full(s: [f64; 6]) -> [[f64; 3]; 3] {
    [[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]]
}

/// Eigenvalues of `[xx, yy, zz, xy, xz, yz]` in rising order, to rounding relative to the largest (cyclic Jacobi);
/// `None` unless all entries are finite.
pub(crate) fn eigenvalues(s: [f64; 6]) -> Option<[f64; 3]> {
    let (mut values, _) = eigenvectors(s)?;
    values.sort_by(f64::total_cmp);
    Some(values)
}

/// Eigenvalues in any order, and the matrix that has their eigenvectors, of unit length, as its columns.
pub(crate) fn eigenvectors(s: [f64; 6]) -> Option<([f64; 3], [[f64; 3]; 3])> {
    let scale = s.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    if s.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    if scale == 0.0 {
        return Some(([0.0; 3], v));
    }
    let mut a = full(s.map(|x| x / scale));
    // Convergence is quadratic: 6 sweeps reach rounding from anywhere, the rest is margin.
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    Some(([a[0][0] * scale, a[1][1] * scale, a[2][2] * scale], v))
}

/// The rotation in the plane `p, q` that makes `a[p][q]` zero, also of the columns of `v`.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + libm::hypot(theta, 1.0));
    let c = 1.0 / libm::hypot(t, 1.0);
    let s = t * c;
    for k in 0..3 {
        let (x, y) = (a[k][p], a[k][q]);
        (a[k][p], a[k][q]) = (c * x - s * y, s * x + c * y);
    }
    for k in 0..3 {
        let (x, y) = (a[p][k], a[q][k]);
        (a[p][k], a[q][k]) = (c * x - s * y, s * x + c * y);
    }
    (a[p][q], a[q][p]) = (0.0, 0.0);
    for row in v {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_spectra() {
        assert_eq!(eigenvalues([3.0, 1.0, 2.0, 0.0, 0.0, 0.0]), Some([1.0, 2.0, 3.0]));
        assert_eq!(eigenvalues([0.0; 6]), Some([0.0; 3]));
        assert_eq!(eigenvalues([f64::NAN, 1.0, 1.0, 0.0, 0.0, 0.0]), None);
        // [[2,1,0],[1,2,0],[0,0,1]]: 1, 1, 3
        for (got, want) in eigenvalues([2.0, 2.0, 1.0, 1.0, 0.0, 0.0]).unwrap().iter().zip([1.0, 1.0, 3.0]) {
            assert!((got - want).abs() < 1e-14, "{got} {want}");
        }
    }

    #[test]
    fn invariants_of_many() {
        let mut seed = 1u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        for _ in 0..1000 {
            let s = [0; 6].map(|_| next() * libm::pow(10.0, 6.0 * next()));
            let scale = s.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
            let l = eigenvalues(s).unwrap();
            let m = full(s);
            let trace = s[0] + s[1] + s[2];
            let square: f64 = m.iter().flatten().map(|x| x * x).sum();
            // 12 sweeps of 3 rotations of a few roundings each, relative to the largest entry.
            assert!((l[0] + l[1] + l[2] - trace).abs() < 1e-13 * scale);
            assert!((l.iter().map(|x| x * x).sum::<f64>() - square).abs() < 1e-12 * scale * scale);
        }
    }
}
