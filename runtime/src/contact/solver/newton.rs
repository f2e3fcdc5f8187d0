//! A step of Newton's method on the projection equations of Alart and Curnier (1991), for all contacts at once.

use super::{cone, Terms, Touch};
use crate::lists::{copy, first_mut, get, part, part_mut, set, split, swap};
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
    let (matrix, rest) = split(work, n * n);
    let (step, rest) = split(rest, n);
    let start = first_mut(rest, n);
    matrix.fill(S::zero());
    for touch in terms.problem.touches {
        equations(terms, touch, impulses, matrix, step);
    }
    if !eliminate(matrix, step) {
        return false;
    }
    copy(start, impulses);
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
    copy(impulses, start);
    false
}

/// Derivatives of impulses whose values are a solution: full steps, the second of which takes away what the small addition
/// to the diagonal leaves. `false` where the equations are singular.
pub(super) fn differentiate<S: Real>(terms: &Terms<S>, impulses: &mut [S], work: &mut [S]) -> bool {
    let n = impulses.len();
    let (matrix, rest) = split(work, n * n);
    let step = first_mut(rest, n);
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
    let (least, friction) = (get(terms.least, row), c.friction);
    let a = |i: usize, j: usize| {
        let own = get(problem.a, i * n + j);
        mass * if i == j { own + more } else { own }
    };
    let (p, v) = (get(impulses, row), terms.velocity(touch, row, impulses));
    let normal = p - mass * v;
    let pressed = normal > least;
    let prox = S::constant(PROXIMAL);
    let line = part_mut(matrix, row * n, n);
    for (j, entry) in line.iter_mut().enumerate() {
        *entry = if pressed { a(row, j) } else { zero };
    }
    let own = if pressed { get(line, row) + prox } else { one };
    set(line, row, own);
    set(step, row, if pressed { mass * v } else { p - least });
    if !c.tangents {
        return;
    }
    let x: [S; 2] = core::array::from_fn(|i| get(impulses, row + 1 + i));
    let u: [S; 2] = core::array::from_fn(|i| terms.velocity(touch, row + 1 + i, impulses));
    if let Some(slip) = touch.slip {
        for i in 0..2 {
            set(step, row + 1 + i, x[i] + friction * p * slip[i]);
            set(matrix, (row + 1 + i) * n + row + 1 + i, one);
            set(matrix, (row + 1 + i) * n + row, friction * slip[i]);
        }
        return;
    }
    let held = if pressed { normal } else { least };
    let radius = friction * held;
    let z: [S; 2] = core::array::from_fn(|i| x[i] - mass * u[i]);
    let size = cone::length(z);
    for i in 0..2 {
        let sticks = size <= radius;
        set(step, row + 1 + i, if sticks { mass * u[i] } else { x[i] - radius / size * z[i] });
        let line = part_mut(matrix, (row + 1 + i) * n, n);
        for (j, entry) in line.iter_mut().enumerate() {
            // Derivative of z and of the radius with respect to impulse j.
            let dz: [S; 2] = core::array::from_fn(|k| {
                let unit = if j == row + 1 + k { one } else { zero };
                unit - a(row + 1 + k, j)
            });
            let dr = if pressed { friction * ((if j == row { one } else { zero }) - a(row, j)) } else { zero };
            *entry = if sticks {
                a(row + 1 + i, j)
            } else {
                let along = (z[0] * dz[0] + z[1] * dz[1]) / (size * size);
                let turned = radius / size * (dz[i] - along * z[i]);
                (if j == row + 1 + i { one } else { zero }) - turned - dr * (z[i] / size)
            };
        }
        let own = get(line, row + 1 + i) + if sticks { prox } else { zero };
        set(line, row + 1 + i, own);
    }
}

/// Solves `matrix x = rhs` in place by Gaussian elimination with partial pivoting; `false` where a pivot is zero.
pub(in crate::contact) fn eliminate<S: Real>(matrix: &mut [S], rhs: &mut [S]) -> bool {
    let n = rhs.len();
    for k in 0..n {
        let size = |i: usize| get(matrix, i * n + k).abs();
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
            let (above, below) = split(matrix, best * n);
            swap(part_mut(above, k * n, n), first_mut(below, n));
            let (above, below) = split(rhs, best);
            swap(part_mut(above, k, 1), first_mut(below, 1));
        }
        let (above, below) = split(matrix, (k + 1) * n);
        let line = part(above, k * n, n);
        let (pivot, own) = (get(line, k), get(rhs, k));
        for (other, rhs) in below.chunks_exact_mut(n).zip(rhs.iter_mut().skip(k + 1)) {
            let factor = get(other, k) / pivot;
            // Rows of contacts that are open have one entry.
            if factor == S::zero() && factor.derivative().is_none() {
                continue;
            }
            let right = n - (k + 1);
            for (x, by) in part_mut(other, k + 1, right).iter_mut().zip(part(line, k + 1, right)) {
                *x = *x - factor * *by;
            }
            *rhs = *rhs - factor * own;
        }
    }
    for k in (0..n).rev() {
        let line = part(matrix, k * n, n);
        let known = line.iter().zip(rhs.iter()).skip(k + 1);
        let sum = known.fold(get(rhs, k), |sum, (a, x)| sum - *a * *x);
        set(rhs, k, sum / get(line, k));
    }
    rhs.iter().all(|x| x.is_finite())
}
