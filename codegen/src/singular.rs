//! The condition of mass matrices, and those that are singular in every state.

use crate::plan::Plan;
use crate::sample::State;

/// Condition from which on a mass matrix is singular but for rounding: an error of one rounding in its entries changes velocities
/// and accelerations by a tenth of their size.
pub const SINGULAR: f64 = 0.1 / f64::EPSILON;

/// Random states that are looked at: a matrix that is singular in all of them is singular everywhere, but by chance.
const STATES: u64 = 2;

/// Velocities of the largest mass matrix that is looked at in random states: the time grows with the cube of their number.
const LARGEST: usize = 300;

/// The name of a velocity that the inertia of what moves does not resist, as long as the velocities before it may follow: the
/// mass matrix is singular in every state, but for rounding. `None` where there is no such velocity, or where there are more
/// than 300. Parameters have their defaults, or one where these are zero: a load may be none at first.
///
/// Freedoms that a body alone leaves without inertia are found where a model is read; what several joints together leave
/// without inertia, as two that slide one body along one line, is found here.
pub fn dependent_velocity(plan: &Plan) -> Option<String> {
    let n = plan.dims.nv;
    if n == 0 || n > LARGEST {
        return None;
    }
    let mut params = plan.default_params();
    params.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = 1.0);
    let mut interpreter = plan.interpreter(&params);
    let mut m = vec![0.0; n * n];
    let mut found = None;
    for seed in 0..STATES {
        let state = State::new(plan, seed);
        state.set_inputs(plan, &mut interpreter, false);
        interpreter.mass_matrix(&state.q, &mut m);
        let (condition, at) = condition(&m, n);
        // What is not a number is no sound condition either.
        if condition <= SINGULAR {
            return None;
        }
        found = Some(at);
    }
    found.map(|at| plan.velocity_names()[at].clone())
}

/// Condition of the mass matrix `M` (`n × n`, row by row) in the norm of row sums, after scaling rows and columns so
/// that the diagonal is one: units and sizes of the coordinates do not matter then, and no scaling of rows and columns
/// has a condition more than `n` times smaller (van der Sluis, Numer. Math. 14, 1969). Infinite where rounding has left
/// the matrix indefinite. The index is that of the velocity with the least pivot.
pub fn condition(m: &[f64], n: usize) -> (f64, usize) {
    let root: Vec<f64> = (0..n).map(|i| m[i * n + i].sqrt()).collect();
    let mut l: Vec<f64> = (0..n * n).map(|at| m[at] / (root[at / n] * root[at % n])).collect();
    let largest_sum = |a: &[f64]| a.chunks(n).map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0_f64, f64::max);
    let norm = largest_sum(&l);
    // Cholesky's factor in place of the lower triangle.
    let mut least = (f64::INFINITY, 0);
    for j in 0..n {
        for i in j..n {
            let sum: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            l[i * n + j] -= sum;
        }
        let pivot = l[j * n + j];
        if pivot.is_nan() || pivot < least.0 {
            least = (pivot, j);
        }
        if pivot.is_nan() || pivot <= 0.0 {
            return (f64::INFINITY, j);
        }
        (j..n).for_each(|i| l[i * n + j] /= pivot.sqrt());
    }
    // The inverse, column by column.
    let mut inverse = vec![0.0; n * n];
    for (k, x) in inverse.chunks_mut(n).enumerate() {
        x[k] = 1.0;
        for i in 0..n {
            let sum: f64 = (0..i).map(|j| l[i * n + j] * x[j]).sum();
            x[i] = (x[i] - sum) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|j| l[j * n + i] * x[j]).sum();
            x[i] = (x[i] - sum) / l[i * n + i];
        }
    }
    (norm * largest_sum(&inverse), least.1)
}
