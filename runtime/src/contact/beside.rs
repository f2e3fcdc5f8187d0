//! Trees that stand on the ground beside each other: contacts on some of them are not felt by others.

use alloc::vec::Vec;

use super::assembly::ColumnsOf;
use super::{Contact, Reducible};
use crate::system::Real;

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

/// The tree of each velocity, and the trees on which the rows of each contact act: one tree twice where there is one. The latter
/// are empty where trees are not known, where there is only one, and where the mechanism has few bodies, so that this is not worth
/// its code.
pub(super) fn trees<Y: Reducible>(full: &Y, contacts: &[Contact<Y::Scalar>]) -> (Vec<usize>, Vec<[usize; 2]>) {
    if !cfg!(feature = "hulls") {
        return (Vec::new(), Vec::new());
    }
    let trees = full.trees();
    // Loops and couplings act from tree to tree as well.
    let loops = full.rows().len() > contacts.iter().map(Contact::rows).sum();
    if loops || trees.iter().all(|tree| trees.first() == Some(tree)) {
        return (trees, Vec::new());
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
    let of = contacts.iter().map(of).collect::<Option<_>>().unwrap_or_default();
    (trees, of)
}
