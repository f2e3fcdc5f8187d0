//! The residual of the laws of contact.

use super::{Problem, Terms, Touch};
use crate::lists::{get, largest};
use crate::system::Real;

/// Length of a vector; at the origin, where it has no derivative, that of numbers with derivatives is zero.
pub(super) fn length<S: Real>([x, y]: [S; 2]) -> S {
    let square = x * x + y * y;
    if square > S::zero() {
        square.sqrt()
    } else {
        square
    }
}

/// The disc of a radius: the nearest point in it.
pub(super) fn disc<S: Real>([x, y]: [S; 2], radius: S) -> [S; 2] {
    let t = length([x, y]);
    if t <= radius || t == S::zero() {
        [x, y]
    } else {
        [radius / t * x, radius / t * y]
    }
}

/// Largest diagonal entry of a contact's rows, 1/kg.
pub(super) fn most<S: Real>(problem: &Problem<S>, touch: &Touch<S>) -> S {
    let n = problem.b.len();
    let row = touch.contact.row;
    (row..row + touch.contact.rows()).fold(S::zero(), |most, i| {
        let own = get(problem.a, i * n + i);
        if own > most {
            own
        } else {
            most
        }
    })
}

/// Mass that a contact moves, as the scale between its velocities and impulses, kg.
pub(super) fn mass<S: Real>(problem: &Problem<S>, touch: &Touch<S>) -> S {
    let most = most(problem, touch);
    if most > S::zero() {
        S::one() / most
    } else {
        S::zero()
    }
}

/// The contact with the largest residual, and that residual relative to the largest impulse; `velocity(touch, row)` is that of
/// a row.
pub(super) fn residual<S: Real>(
    terms: &Terms<S>,
    impulses: &[S],
    velocity: impl Fn(&Touch<S>, usize) -> S,
) -> (usize, S) {
    let Terms { problem, least, .. } = *terms;
    let zero = S::zero();
    let (mut worst, mut size) = ((0, zero), zero);
    for (index, touch) in problem.touches.iter().enumerate() {
        let c = touch.contact;
        let (row, mass) = (c.row, mass(problem, touch));
        let at = |k: usize| {
            if k < c.rows() {
                (get(impulses, row + k), velocity(touch, row + k))
            } else {
                (zero, zero)
            }
        };
        let [(n, vn), (x, vx), (y, vy)] = [at(0), at(1), at(2)];
        // The smaller of impulse and velocity, without a difference in which a small impulse would be lost.
        let (more, away) = (n - get(least, row), mass * vn);
        let normal = if more < away { more } else { away };
        let off = match touch.slip {
            _ if !c.tangents => [normal, zero, zero],
            Some([a, b]) => [normal, x + c.friction * n * a, y + c.friction * n * b],
            None => {
                let [px, py] = disc([x - mass * vx, y - mass * vy], c.friction * n);
                [normal, x - px, y - py]
            }
        };
        let found = largest(&off);
        if found > worst.1 || !found.is_finite() {
            worst = (index, found);
        }
        let start = mass * get(problem.b, row);
        let own = largest(&[n, x, if start.abs() > y.abs() { start } else { y }]);
        if own > size {
            size = own;
        }
    }
    (worst.0, if size > zero { worst.1 / size } else { worst.1 })
}
