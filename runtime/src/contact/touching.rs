//! The trait through which a motion with events uses a mechanism with contacts.

use super::assembly::Columns;
use super::{Contact, Mode, Way};
use crate::constrained::rows::row;
use crate::system::{Constrained, Real, Row};
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
    /// Whether bodies may move without momenta: by prescribed joints, or by loops that follow these.
    fn moves_at_rest(&self) -> bool {
        true
    }
    /// Whether [`Touching::gaps_of`] takes less than [`Touching::gaps`] where few contacts are asked for.
    fn sees_parts(&self) -> bool {
        false
    }
    /// [`Touching::gaps`] of some contacts, with one entry for each in the first list, and of the rows that are no contacts'. Of
    /// those that the second list does not have, only the normal rows are asked for. Numbers of other rows mean nothing
    /// afterwards: those of all of them may be computed, or not.
    fn gaps_of(
        &mut self,
        _of: [&[bool]; 2],
        t: Self::Scalar,
        (q, v): (&Self::Coordinates, &Self::Momenta),
        gaps: &mut Self::Rows,
        velocities: &mut Self::Rows,
        entries: &mut Self::Entries,
    ) {
        self.gaps(t, q, v, gaps, velocities, entries);
    }
    /// [`Constrained::project_momenta`] of several momenta at one state, for all of whose velocities there is a use; each has the
    /// bits that it has alone. Returns whether that was done: where several are no faster than one after the other, nothing is.
    fn project_columns(
        &mut self,
        _t: Self::Scalar,
        _q: &Self::Coordinates,
        _columns: &mut Columns<Self::Scalar>,
    ) -> bool {
        false
    }
    /// Makes the mechanism ready for [`Touching::project_implicitly`] in steps of `step` s. Returns whether it has springs or
    /// dampers and can do that.
    fn steps_implicitly(&mut self, _step: Self::Scalar) -> bool {
        false
    }
    /// Velocities that momenta `p` give in such a step, beyond those of prescribed motions, if springs and dampers of the
    /// joints follow: `(M + D h/2 + K h²/4) v = p`, with loops closed and contacts open. `p` becomes `M v`.
    fn project_implicitly(
        &mut self,
        _t: Self::Scalar,
        _q: &Self::Coordinates,
        _p: &mut Self::Momenta,
        _v: &mut Self::Momenta,
    ) {
    }
    /// Adds the forces of springs that velocities `v` have stretched for `time` s.
    fn pull(&self, _time: Self::Scalar, _v: &Self::Momenta, _forces: &mut Self::Momenta) {}
    /// [`Touching::project_columns`] of such velocities.
    fn project_columns_implicitly(
        &mut self,
        _t: Self::Scalar,
        _q: &Self::Coordinates,
        _columns: &mut Columns<Self::Scalar>,
    ) {
    }
}

/// Adds row `r` of `Φ` times `factor` to a list of momenta.
pub(super) fn add_row<Y: Constrained>(
    system: &Y,
    entries: &Y::Entries,
    r: usize,
    factor: Y::Scalar,
    p: &mut Y::Momenta,
) {
    add_entries(system.rows(), system.entry_columns(), entries.as_ref(), r, factor, p.as_mut());
}

/// Row `r` of `Φ` times velocities.
pub(super) fn along_row<Y: Constrained>(system: &Y, entries: &Y::Entries, r: usize, v: &Y::Momenta) -> Y::Scalar {
    along_entries(system.rows(), system.entry_columns(), entries.as_ref(), r, v.as_ref())
}

/// [`add_row`] of a system with such rows.
pub(super) fn add_entries<S: Scalar>(rows: &[Row], columns: &[usize], entries: &[S], r: usize, factor: S, p: &mut [S]) {
    let Some(of) = rows.get(r) else { return };
    for (column, entry) in row(of, columns, entries) {
        if let Some(p) = p.get_mut(*column) {
            *p = *p + *entry * factor;
        }
    }
}

/// [`along_row`] of a system with such rows.
pub(super) fn along_entries<S: Scalar>(rows: &[Row], columns: &[usize], entries: &[S], r: usize, v: &[S]) -> S {
    let Some(of) = rows.get(r) else { return S::zero() };
    row(of, columns, entries).fold(S::zero(), |sum, (column, entry)| v.get(*column).map_or(sum, |v| sum + *entry * *v))
}
