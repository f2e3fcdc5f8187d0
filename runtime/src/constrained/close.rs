//! Consistent states: positions that close the constraints, velocities that meet them.

use super::basic::Basic;
use super::rows::{named, rates, worst};
use super::ConstraintError;
use crate::integrate::Chart;
use crate::system::{Constrained, Real};
use crate::Scalar;

/// How positions are closed.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Closing<'a> {
    /// What counts as closed, m and rad.
    pub tolerance: f64,
    /// At most so many iterations.
    pub iterations: u32,
    /// Velocities whose coordinates stay as they are, by index; those beyond the end are free.
    pub held: &'a [bool],
}

impl Default for Closing<'_> {
    fn default() -> Self {
        Closing { tolerance: 1e-12, iterations: 100, held: &[] }
    }
}

/// Positions or velocities that meet the constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Closed {
    /// Iterations made.
    pub iterations: u32,
    /// The largest residual that is left: m and rad, or m/s and rad/s.
    pub residual: f64,
    /// Number of rows that are independent of one another there, where `held` columns are left out.
    pub rank: usize,
}

impl<'a> Closing<'a> {
    /// The defaults, with the coordinates of some velocities held.
    pub fn holding(held: &'a [bool]) -> Self {
        Closing { held, ..Closing::default() }
    }
}

/// Halvings of a step after which it is given up.
const HALVINGS: u32 = 40;
/// A step must bring the sum of squares down by this part of what its slope promises (Armijo).
const SHARE: f64 = 1e-4;
/// Where the sum of squares can fall by less than this part of it, it is at its least.
const FLAT: f64 = 1e-12;

fn square<S: Real>(x: &[S]) -> f64 {
    x.iter().fold(0.0, |sum, x| sum + x.to_f64() * x.to_f64())
}

/// Moves coordinates to the nearest ones that close the constraints, by Newton's method with steps of least norm,
/// shortened where they would not bring the residuals down; where rows depend on one another, or there is no way to
/// close them all, by that of Gauss and Newton. The start decides between branches. Rotations are moved on their group.
///
/// Where it fails `q` is where the residuals could not be brought down any further.
///
/// # Errors
/// [`ConstraintError::NotClosed`], [`ConstraintError::NotFinite`].
pub fn close<Y>(system: &mut Y, q: &mut Y::Coordinates, closing: &Closing<'_>) -> Result<Closed, ConstraintError>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    let (mut residual, mut entries) = (system.zero_rows(), system.zero_entries());
    let (mut dx, mut step, mut trial) = (system.zero_momenta(), system.zero_momenta(), q.clone());
    let mut least = Basic::new(system);
    system.constraint_residuals(q, &mut residual, &mut entries);
    let mut iterations = 0;
    loop {
        let (at, size) = worst(residual.as_ref());
        if !size.is_finite() {
            return Err(ConstraintError::NotFinite { index: at });
        }
        let rank = least.least(entries.as_ref(), closing.held, residual.as_ref(), dx.as_mut());
        let size = size.to_f64();
        let closed = size <= closing.tolerance;
        let (before, mut part, mut found) = (square(residual.as_ref()), Y::Scalar::one(), false);
        // What the slope promises: twice the part of the residual that a full step would remove.
        let promise = slope(system, &entries, &dx, &mut residual);
        // Once closed, one step more, if it helps: Newton's method gives the last digits away.
        let halvings = if closed { 1 } else { HALVINGS };
        let allowed = iterations < closing.iterations && promise > FLAT * before;
        for _ in 0..if allowed { halvings } else { 0 } {
            for (step, dx) in step.as_mut().iter_mut().zip(dx.as_ref()) {
                *step = part * *dx;
            }
            trial.as_mut().copy_from_slice(q.as_ref());
            Chart::displace(system, &mut step, &mut trial);
            system.constraint_residuals(&trial, &mut residual, &mut entries);
            let after = square(residual.as_ref());
            if after < before - SHARE * part.to_f64() * promise {
                found = true;
                break;
            }
            part = Y::Scalar::constant(0.5) * part;
        }
        if found {
            iterations += 1;
            q.as_mut().copy_from_slice(trial.as_ref());
        }
        if closed {
            system.constraint_residuals(q, &mut residual, &mut entries);
            return Ok(Closed { iterations, residual: worst(residual.as_ref()).1.to_f64(), rank });
        }
        if !found {
            let (constraint, rows) = (named(system, at), system.rows().len());
            return Err(ConstraintError::NotClosed { constraint, residual: size, rank, rows, iterations });
        }
    }
}

/// `−2 φᵀ Φ dx`; destroys the residuals.
fn slope<Y>(system: &Y, entries: &Y::Entries, dx: &Y::Momenta, residual: &mut Y::Rows) -> f64
where
    Y: Constrained,
    Y::Scalar: Real,
{
    let mut change = system.zero_rows();
    rates(system, entries, dx, &mut change);
    let pairs = residual.as_ref().iter().zip(change.as_ref());
    pairs.fold(0.0, |sum, (r, c)| sum - 2.0 * r.to_f64() * c.to_f64())
}

/// Changes velocities by as little as possible so that they meet the constraints at coordinates `q` and time `t` (s),
/// those of `held` staying as they are. Momenta follow by [`Conjugate`](crate::Conjugate); where none are held,
/// [`Constrained::project_momenta`] alone does it, least in the metric of the mass matrix.
///
/// # Errors
/// [`ConstraintError::Incompatible`] where what is held leaves no way, more than `tolerance` relative to the largest
/// velocity away; [`ConstraintError::NotFinite`]. Velocities are then as they were.
pub fn complete<Y>(
    system: &mut Y,
    t: Y::Scalar,
    q: &Y::Coordinates,
    v: &mut Y::Momenta,
    held: &[bool],
    tolerance: f64,
) -> Result<Closed, ConstraintError>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    let (mut residual, mut wanted, mut entries) = (system.zero_rows(), system.zero_rows(), system.zero_entries());
    let (mut p, mut dv, mut new) = (system.zero_momenta(), system.zero_momenta(), v.clone());
    // Any velocities that meet the constraints tell what the rows have to be.
    system.project_momenta(t, q, &mut p, &mut dv, &mut residual);
    system.constraint_residuals(q, &mut residual, &mut entries);
    rates(system, &entries, &dv, &mut wanted);
    let mut least = Basic::new(system);
    let mut rank = 0;
    // The second step removes what rounding leaves of the first.
    for _ in 0..2 {
        off(system, &entries, &new, &wanted, &mut residual);
        rank = least.least_velocities(entries.as_ref(), held, residual.as_ref(), dv.as_mut());
        for (v, dv) in new.as_mut().iter_mut().zip(dv.as_ref()) {
            *v = *v + *dv;
        }
    }
    off(system, &entries, &new, &wanted, &mut residual);
    let (at, size) = worst(residual.as_ref());
    if !size.is_finite() {
        return Err(ConstraintError::NotFinite { index: at });
    }
    // Of velocities that no row binds, the residual says nothing.
    if let Some(index) = new.as_ref().iter().position(|v| !v.is_finite()) {
        return Err(ConstraintError::NotFinite { index });
    }
    let residual = size.to_f64();
    if !(residual <= tolerance * worst(new.as_ref()).1.to_f64().max(1.0)) {
        let (constraint, rows) = (named(system, at), system.rows().len());
        return Err(ConstraintError::Incompatible { constraint, residual, rank, rows });
    }
    v.as_mut().copy_from_slice(new.as_ref());
    Ok(Closed { iterations: 2, residual, rank })
}

/// `Φ v − wanted`.
fn off<Y: Constrained>(system: &Y, entries: &Y::Entries, v: &Y::Momenta, wanted: &Y::Rows, out: &mut Y::Rows) {
    rates(system, entries, v, out);
    for (out, wanted) in out.as_mut().iter_mut().zip(wanted.as_ref()) {
        *out = *out - *wanted;
    }
}
