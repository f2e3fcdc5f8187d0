//! A step of Newton's method on the projection equations of Alart and Curnier (1991), for all contacts at once.

use super::{cone, Terms, Touch};
use crate::system::Real;

/// Added to the diagonal of equations for velocities: where contacts are redundant their matrix is singular, and any of
/// the solutions is wanted.
const PROXIMAL: f64 = 1e-10;
/// Largest number of halvings of a step.
const HALVINGS: u32 = 5;

/// Improves the impulses, whose relative residual is `residual`; `false` where the step does not reduce it. `work` has
/// room for a square matrix and three lists.
pub(super) fn step<S: Real>(terms: &Terms<S>, impulses: &mut [S], residual: S, work: &mut [S]) -> bool {
    let n = impulses.len();
    let (matrix, rest) = work.split_at_mut(n * n);
    let (step, rest) = rest.split_at_mut(n);
    let start = &mut rest[..n];
    matrix.fill(S::zero());
    for touch in terms.problem.touches {
        equations(terms, touch, impulses, matrix, step);
    }
    if !eliminate(matrix, step) {
        return false;
    }
    start.copy_from_slice(impulses);
    let mut part = S::one();
    for _ in 0..HALVINGS {
        for ((p, start), step) in impulses.iter_mut().zip(start.iter()).zip(step.iter()) {
            *p = *start - part * *step;
        }
        let (_, now) = cone::residual(terms, impulses);
        if now < residual {
            return true;
        }
        part = S::constant(0.5) * part;
    }
    impulses.copy_from_slice(start);
    false
}

/// Derivatives of impulses whose values are a solution: full steps, the second of which takes away what the small addition
/// to the diagonal leaves. `false` where the equations are singular.
pub(super) fn differentiate<S: Real>(terms: &Terms<S>, impulses: &mut [S], work: &mut [S]) -> bool {
    let n = impulses.len();
    let (matrix, rest) = work.split_at_mut(n * n);
    let step = &mut rest[..n];
    (0..2).all(|_| {
        matrix.fill(S::zero());
        for touch in terms.problem.touches {
            equations(terms, touch, impulses, matrix, step);
        }
        let solved = eliminate(matrix, step);
        for (p, step) in impulses.iter_mut().zip(step.iter()) {
            *p = *p - *step;
        }
        solved
    })
}

/// The equations of a contact, `F(P) = 0`, in `step`, and their derivatives in its rows of `matrix`.
fn equations<S: Real>(terms: &Terms<S>, touch: &Touch<S>, impulses: &[S], matrix: &mut [S], step: &mut [S]) {
    let (zero, one) = (S::zero(), S::one());
    let problem = terms.problem;
    let (n, c) = (problem.b.len(), touch.contact);
    let (row, mass, more) = (c.row, cone::mass(problem, touch), terms.proximal(touch));
    let (least, friction) = (terms.least[row], c.friction);
    let a = |i: usize, j: usize| mass * if i == j { problem.a[i * n + j] + more } else { problem.a[i * n + j] };
    let (p, v) = (impulses[row], terms.velocity(touch, row, impulses));
    let normal = p - mass * v;
    let pressed = normal > least;
    for j in 0..n {
        matrix[row * n + j] = if pressed { a(row, j) } else { zero };
    }
    let prox = S::constant(PROXIMAL);
    let own = row * n + row;
    matrix[own] = if pressed { matrix[own] + prox } else { one };
    step[row] = if pressed { mass * v } else { p - least };
    if !c.tangents {
        return;
    }
    let x: [S; 2] = core::array::from_fn(|i| impulses[row + 1 + i]);
    let u: [S; 2] = core::array::from_fn(|i| terms.velocity(touch, row + 1 + i, impulses));
    if let Some(slip) = touch.slip {
        for i in 0..2 {
            step[row + 1 + i] = x[i] + friction * p * slip[i];
            matrix[(row + 1 + i) * n + row + 1 + i] = one;
            matrix[(row + 1 + i) * n + row] = friction * slip[i];
        }
        return;
    }
    let held = if pressed { normal } else { least };
    let radius = friction * held;
    let z: [S; 2] = core::array::from_fn(|i| x[i] - mass * u[i]);
    let size = cone::length(z);
    for i in 0..2 {
        let at = (row + 1 + i) * n;
        let sticks = size <= radius;
        step[row + 1 + i] = if sticks { mass * u[i] } else { x[i] - radius / size * z[i] };
        for j in 0..n {
            // Derivative of z and of the radius with respect to impulse j.
            let dz: [S; 2] = core::array::from_fn(|k| {
                let unit = if j == row + 1 + k { one } else { zero };
                unit - a(row + 1 + k, j)
            });
            let dr = if pressed { friction * ((if j == row { one } else { zero }) - a(row, j)) } else { zero };
            matrix[at + j] = if sticks {
                a(row + 1 + i, j)
            } else {
                let along = (z[0] * dz[0] + z[1] * dz[1]) / (size * size);
                let turned = radius / size * (dz[i] - along * z[i]);
                (if j == row + 1 + i { one } else { zero }) - turned - dr * (z[i] / size)
            };
        }
        matrix[at + row + 1 + i] = matrix[at + row + 1 + i] + if sticks { prox } else { zero };
    }
}

/// Solves `matrix x = rhs` in place by Gaussian elimination with partial pivoting; `false` where a pivot is zero.
pub(in crate::contact) fn eliminate<S: Real>(matrix: &mut [S], rhs: &mut [S]) -> bool {
    let n = rhs.len();
    for k in 0..n {
        let size = |i: usize| matrix[i * n + k].abs();
        let mut best = k;
        for i in k + 1..n {
            if size(i) > size(best) {
                best = i;
            }
        }
        if !(size(best) > S::zero()) {
            return false;
        }
        if best != k {
            for j in 0..n {
                matrix.swap(k * n + j, best * n + j);
            }
            rhs.swap(k, best);
        }
        for i in k + 1..n {
            let factor = matrix[i * n + k] / matrix[k * n + k];
            for j in k + 1..n {
                matrix[i * n + j] = matrix[i * n + j] - factor * matrix[k * n + j];
            }
            rhs[i] = rhs[i] - factor * rhs[k];
        }
    }
    for k in (0..n).rev() {
        let mut sum = rhs[k];
        for j in k + 1..n {
            sum = sum - matrix[k * n + j] * rhs[j];
        }
        rhs[k] = sum / matrix[k * n + k];
    }
    rhs.iter().all(|x| x.is_finite())
}
