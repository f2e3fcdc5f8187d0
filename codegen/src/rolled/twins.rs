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

/// For each value that a pass carries the first one before it that it equals, or whose negative it is, in all turns so far.
pub struct Twins {
    of: Vec<Option<Twin>>,
    /// Values that are zero before the first turn, until one is made: zero is its own negative.
    zero: Vec<bool>,
}

impl Twins {
    /// Those before the first turn.
    pub fn before(values: &[Expr<'_>]) -> Twins {
        let zero = values.iter().map(|value| matches!(value, Expr::Const(x) if *x == 0.0)).collect();
        Twins { of: find(values, |_, _, _| true), zero }
    }

    /// Parts those whose values a turn makes different; whether there are none.
    pub fn part(&mut self, values: &[Expr<'_>]) -> bool {
        let zero = std::mem::replace(&mut self.zero, vec![false; values.len()]);
        let still = find(values, |j, k, opposite| zero[j] && zero[k] || self.were(j, k, opposite));
        let same = still == self.of;
        self.of = still;
        same
    }

    /// Whether two values were the same (`false`) or opposite (`true`) so far.
    fn were(&self, j: usize, k: usize, opposite: bool) -> bool {
        let first = |k: usize| self.of[k].map_or((k, false), |twin| (twin.place, twin.opposite));
        let ((first_j, minus_j), (first_k, minus_k)) = (first(j), first(k));
        first_j == first_k && (minus_j != minus_k) == opposite
    }

    /// The twin of each value.
    pub fn places(self) -> Vec<Option<Twin>> {
        self.of
    }

    /// The twin of value `k`.
    pub fn of(&self, k: usize) -> Option<Twin> {
        self.of[k]
    }
}

/// Value `k` of those whose twins are given, by the `own` value of every place without one.
pub fn value<'g>(twin: Option<Twin>, k: usize, own: impl Fn(usize) -> Expr<'g>) -> Expr<'g> {
    twin.map_or_else(|| own(k), |twin| signed(own(twin.place), twin.opposite))
}

/// A value, or its negative.
pub fn signed(value: Expr<'_>, negative: bool) -> Expr<'_> {
    if negative {
        -value
    } else {
        value
    }
}

/// For each value the first one before it that it equals, or whose negative it is. `allowed` says whether two values may
/// be the same (`false`) or opposite (`true`).
fn find(values: &[Expr<'_>], allowed: impl Fn(usize, usize, bool) -> bool) -> Vec<Option<Twin>> {
    let of = |k: usize| {
        (0..k).find_map(|place| {
            let opposite = opposite(&values[place], &values[k])?;
            allowed(place, k, opposite).then_some(Twin { place, opposite })
        })
    };
    (0..values.len()).map(of).collect()
}
