//! Mass matrices that are singular in every state.

use crate::plan::Plan;
use crate::sample::State;

/// Random states that are looked at: a matrix that is singular in all of them is singular everywhere, but by chance.
const STATES: u64 = 2;

/// Velocities of the largest mass matrix that is looked at: the time grows with the cube of their number.
const LARGEST: usize = 300;

/// The name of a velocity that the inertia of what moves does not resist, as long as the velocities before it may follow: the
/// mass matrix, with the default run-time parameters, is singular in every state. `None` where there is no such velocity, or
/// where there are more than 300.
///
/// Freedoms that a body alone leaves without inertia are found where a model is read; what several joints together leave
/// without inertia, as two that slide one body along one line, is found here.
pub fn dependent_velocity(plan: &Plan) -> Option<String> {
    let n = plan.dims.nv;
    if n == 0 || n > LARGEST {
        return None;
    }
    let mut interpreter = plan.interpreter(&plan.default_params());
    let mut m = vec![0.0; n * n];
    let mut found = None;
    for seed in 0..STATES {
        let state = State::new(plan, seed);
        state.set_inputs(plan, &mut interpreter, false);
        interpreter.mass_matrix(&state.q, &mut m);
        found = Some(without_pivot(&mut m, n)?);
    }
    found.map(|at| plan.velocity_names()[at].clone())
}

/// The first row without a pivot in Cholesky's factorisation of a matrix, scaled to a unit diagonal.
fn without_pivot(m: &mut [f64], n: usize) -> Option<usize> {
    let root: Vec<f64> = (0..n).map(|i| m[i * n + i].sqrt()).collect();
    // Entries of the scaled matrix are known to a rounding, and so are the sums of up to `n` products of them.
    let least = 4.0 * n as f64 * f64::EPSILON;
    for j in 0..n {
        for i in j..n {
            let scaled = m[i * n + j] / (root[i] * root[j]);
            let sum: f64 = (0..j).map(|k| m[i * n + k] * m[j * n + k]).sum();
            m[i * n + j] = scaled - sum;
        }
        let pivot = m[j * n + j];
        if pivot.is_nan() || pivot <= least {
            return Some(j);
        }
        (j..n).for_each(|i| m[i * n + j] /= pivot.sqrt());
    }
    None
}
