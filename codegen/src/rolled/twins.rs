//! Values that a pass carries twice: where two are the same or opposite in all turns, one of them is carried.

use crate::symbolic::Expr;

/// An earlier place among what a pass carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Twin {
    /// Its number.
    pub place: usize,
    /// Whether the value is the negative of the one there.
    pub opposite: bool,
}

/// Whether one value is the other (`false`) or its negative (`true`).
fn opposite(a: &Expr<'_>, b: &Expr<'_>) -> Option<bool> {
    match (a, b) {
        (Expr::Const(a), Expr::Const(b)) => {
            [false, true].into_iter().find(|minus| a.to_bits() == if *minus { -b } else { *b }.to_bits())
        }
        (Expr::Node { id: a, neg: sign_a, .. }, Expr::Node { id: b, neg: sign_b, .. }) => {
            (a == b).then_some(sign_a != sign_b)
        }
        _ => None,
    }
}

/// For each value the first one before it that it equals, or whose negative it is. `allowed` says whether two values may
/// be the same (`false`) or opposite (`true`).
pub fn twins(values: &[Expr<'_>], allowed: impl Fn(usize, usize, bool) -> bool) -> Vec<Option<Twin>> {
    let of = |k: usize| {
        (0..k).find_map(|place| {
            let opposite = opposite(&values[place], &values[k])?;
            allowed(place, k, opposite).then_some(Twin { place, opposite })
        })
    };
    (0..values.len()).map(of).collect()
}

/// Whether two values were the same (`false`) or opposite (`true`) so far.
pub fn were_twins(twins: &[Option<Twin>], j: usize, k: usize, opposite: bool) -> bool {
    let first = |k: usize| twins[k].map_or((k, false), |twin| (twin.place, twin.opposite));
    let ((first_j, minus_j), (first_k, minus_k)) = (first(j), first(k));
    first_j == first_k && (minus_j != minus_k) == opposite
}
