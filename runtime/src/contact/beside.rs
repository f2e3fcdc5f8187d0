//! Trees that stand on the ground beside each other: contacts on some of them are not felt by others.

use alloc::vec::Vec;

use super::assembly::ColumnsOf;
use super::Contact;
use crate::system::{Constrained, Real};

/// Solves for momenta one after the other.
pub(super) fn one_by_one<S: Real, P: AsMut<[S]>>(
    of: &mut ColumnsOf<S>,
    [p, v]: [&mut P; 2],
    mut solve: impl FnMut(&mut P, &mut P),
) {
    for i in 0..of.count() {
        of.momenta::<1>(i, p.as_mut());
        solve(p, v);
        of.take::<1>(i, v.as_mut());
    }
}

/// The trees on which the rows of each contact act: one tree twice where there is one. Empty where trees are not known, or where
/// there is only one.
pub(super) fn trees_of<Y: Constrained>(full: &Y, contacts: &[Contact<Y::Scalar>], trees: &[usize]) -> Vec<[usize; 2]> {
    // Loops and couplings act from tree to tree as well.
    let loops = full.rows().len() > contacts.iter().map(Contact::rows).sum();
    if !cfg!(feature = "hulls") || loops || trees.iter().all(|tree| trees.first() == Some(tree)) {
        return Vec::new();
    }
    let of = |contact: &Contact<Y::Scalar>| {
        let rows = full.rows().get(contact.row..contact.row + contact.rows()).unwrap_or(&[]);
        let columns =
            rows.iter().flat_map(|row| full.entry_columns().get(row.first..row.first + row.len).unwrap_or(&[]));
        let mut all: Vec<usize> = columns.filter_map(|column| trees.get(*column).copied()).collect();
        all.sort_unstable();
        all.dedup();
        match all[..] {
            [a] => Some([a, a]),
            [a, b] => Some([a, b]),
            _ => None,
        }
    };
    contacts.iter().map(of).collect::<Option<_>>().unwrap_or_default()
}
