//! Products with `Φ`, row by row.

use crate::system::{Constrained, Real, Row};
#[cfg(feature = "alloc")]
use crate::Scalar;

/// Index and size of the largest of some numbers; the first that is not a number is larger than all.
pub(super) fn worst<S: Real>(x: &[S]) -> (usize, S) {
    let mut found = (0, S::zero());
    for (i, x) in x.iter().enumerate() {
        if !x.is_finite() {
            return (i, *x);
        }
        if x.abs() > found.1 {
            found = (i, x.abs());
        }
    }
    found
}

/// Columns and values of a row of `Φ`.
pub(crate) fn row<'a, S>(
    row: &Row,
    columns: &'a [usize],
    entries: &'a [S],
) -> impl Iterator<Item = (&'a usize, &'a S)> {
    let range = row.first..row.first + row.len;
    columns.get(range.clone()).unwrap_or(&[]).iter().zip(entries.get(range).unwrap_or(&[]))
}

/// `p += Φᵀ σ`.
pub(super) fn add_forces<Y: Constrained>(system: &Y, entries: &Y::Entries, sigma: &Y::Rows, p: &mut Y::Momenta) {
    for (r, sigma) in system.rows().iter().zip(sigma.as_ref()) {
        for (column, entry) in row(r, system.entry_columns(), entries.as_ref()) {
            if let Some(p) = p.as_mut().get_mut(*column) {
                *p = *p + *entry * *sigma;
            }
        }
    }
}

/// `Φ v`.
#[cfg(feature = "alloc")]
pub(super) fn rates<Y: Constrained>(system: &Y, entries: &Y::Entries, v: &Y::Momenta, out: &mut Y::Rows) {
    for (r, out) in system.rows().iter().zip(out.as_mut()) {
        *out = row(r, system.entry_columns(), entries.as_ref())
            .fold(Y::Scalar::zero(), |sum, (column, entry)| v.as_ref().get(*column).map_or(sum, |v| sum + *entry * *v));
    }
}

/// The constraint of a row.
pub(super) fn named<Y: Constrained>(system: &Y, row: usize) -> usize {
    system.rows().get(row).map_or(0, |row| row.constraint)
}
