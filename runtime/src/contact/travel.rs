//! By how much gaps can change where coordinates have moved.

use super::Reach;
use crate::lists::{get, set};
use crate::system::Real;

/// Part of the largest way of a coordinate that others are taken to move by at least.
const RESTING: f64 = 0.05;

/// Ways of the coordinates in a step like one in which they have `moved`: those that rest begin to move.
pub(super) fn next_ways<S: Real>(moved: &[S], out: &mut [S]) {
    let most = moved.iter().fold(S::zero(), |most, x| if x.abs() > most { x.abs() } else { most });
    for (way, moved) in out.iter_mut().zip(moved) {
        *way = moved.abs() + S::constant(RESTING) * most;
    }
}

/// By how much each gap can have changed, m (rad): for coordinates of the sizes `size` where the step began that have moved
/// by up to `moved`.
pub(super) fn travels<S: Real>(reaches: &[Reach<S>], moved: &[S], size: &[S], out: &mut [S]) {
    let zero = S::zero();
    // Where nothing is known, everything may have happened.
    out.fill(S::constant(f64::INFINITY));
    let mut contact = usize::MAX;
    let (mut way, mut angle, mut arm) = (zero, zero, zero);
    for reach in reaches {
        if reach.contact != contact {
            set(out, contact, way + angle * arm);
            contact = reach.contact;
            (way, angle, arm) = (zero, zero, zero);
        }
        let moved = get(moved, reach.velocity);
        way = way + reach.rate * moved;
        angle = angle + reach.turn * moved;
        if reach.slide != zero {
            arm = arm + reach.slide * (get(size, reach.velocity) + moved);
        }
    }
    set(out, contact, way + angle * arm);
}
