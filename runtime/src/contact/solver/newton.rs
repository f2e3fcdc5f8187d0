//! A step of Newton's method on the projection equations of Alart and Curnier (1991), for all contacts at once.

use super::{cone, velocities, Terms, Touch};
use crate::lists::{first_mut, get, part, part_mut, set, split, swap};
use crate::system::Real;

/// Added to the diagonal of equations for velocities: where contacts are redundant their matrix is singular, and any of
/// the solutions is wanted.
const PROXIMAL: f64 = 1e-10;

/// Takes a full step: contacts whose bodies part lose their impulses, and the equations of the others are linear ones in
/// theirs. `false` where these are singular. `work` begins with the velocities of the impulses, and has room for three more
/// lists and a square matrix.
pub(super) fn step<S: Real>(terms: &Terms<S>, impulses: &mut [S], work: &mut [S]) -> bool {
    let n = impulses.len();
    let (v, rest) = split(work, n);
    // The mass that each contact moves, at its normal row, if it acts; less than zero otherwise.
    let (acts, rest) = split(rest, n);
    let (step, rest) = split(rest, n);
    let (exchanged, matrix) = split(rest, n);
    // Number of rows that act, and whether they are the first ones, in order.
    let (mut count, mut in_order) = (0, true);
    for touch in terms.problem.touches {
        let c = touch.contact;
        let (mass, least) = (cone::mass(terms.problem, touch), get(terms.least, c.row));
        // What presses bodies together by more than the least impulse acts, and so does what has one, or slides.
        let pressed = || get(impulses, c.row) - mass * get(v, c.row) > least;
        let acting = touch.slip.is_some() || least > S::zero() || pressed();
        set(acts, c.row, if acting { mass } else { -S::one() });
        if acting {
            in_order &= c.row == count;
            count += c.rows();
            continue;
        }
        // Nothing but these impulses changes, so that the others' velocities can follow at once.
        for k in 0..c.rows() {
            let (row, to) = (c.row + k, if k == 0 { least } else { S::zero() });
            let change = to - get(impulses, row);
            if change != S::zero() || change.derivative().is_some() {
                for (v, a) in v.iter_mut().zip(part(terms.problem.a, row * n, n)) {
                    *v = *v + *a * change;
                }
                set(impulses, row, to);
            }
        }
    }
    let (matrix, step) = (first_mut(matrix, count * count), first_mut(step, count));
    let acting = |touch: &&Touch<S>| get(acts, touch.contact.row) >= S::zero();
    let mut at = 0;
    for touch in terms.problem.touches.iter().filter(acting) {
        let rows = touch.contact.rows();
        let (lines, rhs) = (part_mut(matrix, at * count, rows * count), part_mut(step, at, rows));
        let all = terms.problem.touches.iter().filter(acting);
        let mass = get(acts, touch.contact.row);
        equations(terms, (touch, mass, at), (all, in_order), (impulses, v), lines, rhs);
        at += rows;
    }
    let exchanged = first_mut(exchanged, count);
    if !(factor(matrix, exchanged) && solve_factored(matrix, exchanged, step)) {
        return false;
    }
    let mut steps = step.iter();
    for touch in terms.problem.touches.iter().filter(acting) {
        let own = part_mut(impulses, touch.contact.row, touch.contact.rows());
        for (p, step) in own.iter_mut().zip(&mut steps) {
            *p = *p - *step;
        }
    }
    true
}

/// The equations of a contact that moves a mass, `F(P) = 0`, in `rhs`, and their derivatives by the impulses of `all` contacts
/// that act, in `lines`; its own begin `at` a place. `in_order`: the rows that act are the first ones of the problem.
fn equations<'a, S: Real + 'a>(
    terms: &Terms<S>,
    (touch, mass, at): (&Touch<S>, S, usize),
    (all, in_order): (impl Iterator<Item = &'a Touch<S>> + Clone, bool),
    (impulses, v): (&[S], &[S]),
    lines: &mut [S],
    rhs: &mut [S],
) {
    let (zero, one) = (S::zero(), S::one());
    let problem = terms.problem;
    let (n, c) = (problem.b.len(), touch.contact);
    let count = (lines.len() / c.rows()).max(1);
    let (row, more) = (c.row, if terms.alpha > zero { terms.proximal(touch) } else { zero });
    let (least, friction) = (get(terms.least, row), c.friction);
    let prox = S::constant(PROXIMAL);
    let p: [S; 3] = core::array::from_fn(|i| if i < c.rows() { get(impulses, row + i) } else { zero });
    let u: [S; 3] = core::array::from_fn(|i| if i < c.rows() { get(v, row + i) } else { zero });
    let normal = p[0] - mass * u[0];
    let presses = normal > least;
    // Each line is a sum of those of `m A`, with `from` for the three rows, and of `own` at the contact's impulses.
    let mut from = [[zero; 3]; 3];
    let mut own = [[zero; 3]; 3];
    let mut residual = [if presses { mass * u[0] } else { p[0] - least }, zero, zero];
    if presses {
        (from[0][0], own[0][0]) = (mass, prox);
    } else {
        own[0][0] = one;
    }
    if let (true, Some(slip)) = (c.tangents, touch.slip) {
        for (i, slip) in [1, 2].into_iter().zip(slip) {
            residual[i] = p[i] + friction * p[0] * slip;
            (own[i][i], own[i][0]) = (one, friction * slip);
        }
    } else if c.tangents {
        let radius = friction * if presses { normal } else { least };
        let z = [p[1] - mass * u[1], p[2] - mass * u[2]];
        let size = cone::length(z);
        for (i, along) in [1, 2].into_iter().zip(z) {
            if size <= radius {
                residual[i] = mass * u[i];
                (from[i][i], own[i][i]) = (mass, prox);
                continue;
            }
            let (unit, part) = (along / size, radius / size);
            residual[i] = p[i] - part * along;
            own[i][i] = one;
            // Derivatives of the direction, and of the radius, by impulses: of `P − m v`.
            for (j, other) in [1, 2].into_iter().zip(z) {
                let turned = part * (if i == j { one } else { zero } - unit * (other / size));
                from[i][j] = mass * turned;
                own[i][j] = own[i][j] - turned;
            }
            if presses {
                from[i][0] = mass * friction * unit;
                own[i][0] = -(friction * unit);
            }
        }
    }
    for (line, from) in lines.chunks_exact_mut(count).zip(&from) {
        line.fill(zero);
        for (k, from) in from.iter().enumerate() {
            // Of most contacts, lines are those of `A` itself.
            if *from == zero && from.derivative().is_none() {
                continue;
            }
            let a = part(problem.a, (row + k) * n, n);
            if in_order {
                line.iter_mut().zip(a).for_each(|(x, a)| *x = *x + *from * *a);
                continue;
            }
            let mut rest = &mut *line;
            for other in all.clone() {
                let (own, others) = split(rest, other.contact.rows());
                for (x, a) in own.iter_mut().zip(part(a, other.contact.row, other.contact.rows())) {
                    *x = *x + *from * *a;
                }
                rest = others;
            }
        }
    }
    for (i, line) in lines.chunks_exact_mut(count).enumerate() {
        set(rhs, i, get(&residual, i));
        for (k, entry) in part_mut(line, at, c.rows()).iter_mut().enumerate() {
            // The proximal term is on the diagonal of `A`.
            let of_own = own.get(i).map_or(zero, |own| get(own, k));
            *entry = *entry + of_own + from.get(i).map_or(zero, |from| get(from, k)) * more;
        }
    }
}

/// Derivatives of impulses whose values are a solution: full steps, the second of which takes away what the small addition
/// to the diagonal leaves. `false` where the equations are singular.
pub(super) fn differentiate<S: Real>(terms: &Terms<S>, impulses: &mut [S], work: &mut [S]) -> bool {
    (0..2).all(|_| {
        velocities(terms, impulses, first_mut(work, impulses.len()));
        step(terms, impulses, work)
    })
}

/// Factors a square matrix of `exchanged.len()` rows in place, by Gaussian elimination with partial pivoting: `L` below the
/// diagonal, `U` on it and above; for each row, the later row with which it was exchanged. `false` where a pivot is zero.
pub(in crate::contact) fn factor<S: Real>(matrix: &mut [S], exchanged: &mut [S]) -> bool {
    let n = exchanged.len();
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
        set(exchanged, k, S::from_index(best));
        if best != k {
            let (above, below) = split(matrix, best * n);
            swap(part_mut(above, k * n, n), first_mut(below, n));
        }
        let (above, below) = split(matrix, (k + 1) * n);
        let line = part(above, k * n, n);
        let pivot = get(line, k);
        for other in below.chunks_exact_mut(n) {
            let factor = get(other, k) / pivot;
            set(other, k, factor);
            // Rows of contacts that are open have one entry.
            if factor == S::zero() && factor.derivative().is_none() {
                continue;
            }
            let right = n - (k + 1);
            for (x, by) in part_mut(other, k + 1, right).iter_mut().zip(part(line, k + 1, right)) {
                *x = *x - factor * *by;
            }
        }
    }
    true
}

/// Solves `matrix x = rhs` in place with the factors of [`factor`]; `false` where `x` is not finite.
pub(in crate::contact) fn solve_factored<S: Real>(factors: &[S], exchanged: &[S], rhs: &mut [S]) -> bool {
    let n = rhs.len();
    for (k, other) in exchanged.iter().enumerate() {
        let (above, below) = split(rhs, other.index());
        swap(part_mut(above, k, 1), first_mut(below, 1));
    }
    for k in 0..n {
        let (above, below) = split(rhs, k + 1);
        let own = get(above, k);
        for (rhs, line) in below.iter_mut().zip(factors.chunks_exact(n).skip(k + 1)) {
            *rhs = *rhs - get(line, k) * own;
        }
    }
    for k in (0..n).rev() {
        let line = part(factors, k * n, n);
        let known = line.iter().zip(rhs.iter()).skip(k + 1);
        let sum = known.fold(get(rhs, k), |sum, (a, x)| sum - *a * *x);
        set(rhs, k, sum / get(line, k));
    }
    rhs.iter().all(|x| x.is_finite())
}
