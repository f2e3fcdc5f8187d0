//! Minimal coordinates by dense matrices: `p_ind = Bᵀ M v` with `v = B v_ind`, and all choices of independent
//! velocities.

use mbd_testing::closed::LoopSystem;
use nalgebra::SVD;

use super::{Dense, Matrix, Truth, Vector};

/// Indices of dependent velocities, in order.
pub type Dependents = Vec<usize>;

/// All choices of `k` out of `n` indices.
pub fn choices(n: usize, k: usize) -> Vec<Vec<usize>> {
    if k == 0 {
        return vec![Vec::new()];
    }
    let with_last = |last: usize| choices(last, k - 1).into_iter().map(move |c| [c, vec![last]].concat());
    (k - 1..n).flat_map(with_last).collect()
}

pub fn others(n: usize, some: &[usize]) -> Vec<usize> {
    (0..n).filter(|k| !some.contains(k)).collect()
}

/// Solves `a x = b`, which has a solution, by least squares.
pub fn least(a: &Matrix, b: &Matrix) -> Matrix {
    SVD::new(a.clone(), true, true).solve(b, 1e-11).expect("singular vectors are there")
}

/// Smallest singular value of `Φ_d`, the columns of dependent velocities of `Φ` with rows of unit length. As many
/// singular values count as the rank of `Φ`.
pub fn pivot(dense: &Dense, dependents: &[usize]) -> f64 {
    let mut phi = dense.phi.clone();
    for k in 0..phi.nrows() {
        let length = phi.row(k).norm();
        phi.row_mut(k).scale_mut(if length > 1e-12 { 1.0 / length } else { 0.0 });
    }
    let mut values: Vec<f64> = phi.select_columns(dependents).singular_values().iter().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values[dense.rank - 1]
}

/// `B` of `v = B v_ind`, rows in the order of the velocities.
pub fn tangents(phi: &Matrix, dependents: &[usize]) -> Matrix {
    let n = phi.ncols();
    let independents = others(n, dependents);
    let depend = -least(&phi.select_columns(dependents), &phi.select_columns(&independents));
    let mut b = Matrix::zeros(n, independents.len());
    for (row, &k) in dependents.iter().enumerate() {
        b.row_mut(k).copy_from(&depend.row(row));
    }
    for (column, &k) in independents.iter().enumerate() {
        b[(k, column)] = 1.0;
    }
    b
}

/// Full momenta with zeros for the dependents.
pub fn full(p: &Vector, n: usize, dependents: &[usize]) -> Vector {
    let mut all = Vector::zeros(n);
    for (x, k) in p.iter().zip(others(n, dependents)) {
        all[k] = *x;
    }
    all
}

/// `d/dt (Bᵀ M v)` of the motion that starts with independent momenta `p` and zero dependent momenta. It needs no
/// multipliers.
pub fn rates(system: &LoopSystem, truth: &Truth, dependents: &[usize]) -> Vector {
    let dense = &truth.dense;
    let b = tangents(&dense.phi, dependents);
    let carried = &dense.m * &truth.v + &dense.driven;
    let b_rate = -least(&dense.phi.select_columns(dependents), &(&truth.phi_rate * &b));
    let mut turning = Vector::zeros(b.ncols());
    for (row, &k) in dependents.iter().enumerate() {
        turning += b_rate.row(row).transpose() * carried[k];
    }
    debug_assert_eq!(system.open.dims.nv, b.nrows());
    b.transpose() * &truth.open_rates + turning
}
