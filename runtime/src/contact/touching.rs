//! The trait through which a motion with events uses a mechanism with contacts.

use super::{Contact, Mode, Way};
use crate::constrained::rows::row;
use crate::system::{Constrained, Real};
use crate::Scalar;

/// How fast a velocity can close the gap of a contact.
///
/// A gap is closed by `Σ (rate + turn · Σ slide |q|) |v|` in a second at most, with the sums over the velocities and, inside, over
/// the coordinates that belong to them. That holds in body axes and in outer ones. All gaps but those above height fields
/// change by no more than that, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach<S> {
    /// The contact.
    pub contact: usize,
    /// The velocity.
    pub velocity: usize,
    /// Rate of the gap per unit of the velocity where no translation lengthens an arm, m (rad for stops of rotations).
    /// Infinite where prescribed motions move the bodies.
    pub rate: S,
    /// Angle by which bodies turn per unit of the velocity, rad.
    pub turn: S,
    /// Length that a unit of the coordinate adds to the arms of rotations, m.
    pub slide: S,
}

/// A mechanism with contacts. Its rows are those of loops and couplings, which always act, and those of the contacts, which
/// act by their modes; rows that do not act have no residuals, entries and multipliers in [`Constrained`].
///
/// A multiplier is the force of its row with the opposite sign: bodies that are pressed together have a negative one, and
/// `−Φᵀλ` acts on the joints.
pub trait Touching: Constrained<Scalar: Real> {
    /// One value for each contact.
    type PerContact<T: Copy + core::fmt::Debug>: Clone + core::fmt::Debug + AsRef<[T]> + AsMut<[T]>;
    /// A number for each pair of rows of the contacts, row by row, with room for what the solver of contacts needs.
    type Delassus: Clone + core::fmt::Debug + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;

    /// The contacts.
    fn contacts(&self) -> &[Contact<Self::Scalar>];
    /// The same value for each contact.
    fn per_contact<T: Copy + core::fmt::Debug>(&self, value: T) -> Self::PerContact<T>;
    /// Memory for the inverse inertia of the contacts: at least `len` zeros, where `len` is what the solver asks for.
    fn zero_delassus(&self, len: usize) -> Self::Delassus;
    /// How fast velocities can close gaps: an entry for each velocity that moves a contact's bodies, those of the first contact
    /// first. What cannot have come together in a step is not looked at; a contact without an entry always is.
    fn reaches(&self) -> &[Reach<Self::Scalar>];
    /// What computes the rates in the modes that were set last.
    fn way(&self) -> Way;
    /// Sets the modes, one for each contact, by which rows act from now on.
    fn act(&mut self, modes: &[Mode]);
    /// Gaps and their like, whatever acts: residuals of all rows (of a contact's normal row the gap, m or rad, negative
    /// where bodies overlap), their velocities at `v` (m/s, rad/s; prescribed motions at time `t` included), and the
    /// entries of `Φ`.
    fn gaps(
        &mut self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        v: &Self::Momenta,
        gaps: &mut Self::Rows,
        velocities: &mut Self::Rows,
        entries: &mut Self::Entries,
    );
}

/// Adds row `r` of `Φ` times `factor` to a list of momenta.
pub(super) fn add_row<Y: Constrained>(
    system: &Y,
    entries: &Y::Entries,
    r: usize,
    factor: Y::Scalar,
    p: &mut Y::Momenta,
) {
    let Some(of) = system.rows().get(r) else { return };
    for (column, entry) in row(of, system.entry_columns(), entries.as_ref()) {
        if let Some(p) = p.as_mut().get_mut(*column) {
            *p = *p + *entry * factor;
        }
    }
}

/// Row `r` of `Φ` times velocities.
pub(super) fn along_row<Y: Constrained>(system: &Y, entries: &Y::Entries, r: usize, v: &Y::Momenta) -> Y::Scalar {
    let zero = Y::Scalar::zero();
    let Some(of) = system.rows().get(r) else { return zero };
    let terms = row(of, system.entry_columns(), entries.as_ref());
    terms.fold(zero, |sum, (column, entry)| v.as_ref().get(*column).map_or(sum, |v| sum + *entry * *v))
}
