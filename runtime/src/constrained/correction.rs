//! Correction of positions.

#[cfg(feature = "alloc")]
use super::basic::Basic;
use super::nearness::Nearness;
use super::projection::{finite, Room};
use super::rows::{named, worst};
use super::ConstraintError;
use crate::integrate::Chart;
use crate::system::{Constrained, Real};
use crate::Scalar;

/// What is done at the end of every step; see the module's table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stabilisation {
    /// Nothing is done: multipliers `σ` accumulate in the momenta, positions drift.
    None,
    /// Momenta are projected ([`Constrained::project_momenta`]); positions drift by the method's error.
    Momenta,
    /// As `Momenta`; then positions are corrected by the displacement that is least in the metric of the mass matrix
    /// ([`Constrained::position_correction`]), and momenta stay.
    #[default]
    Mass,
    /// As `Mass`, with the displacement of least norm, `−Φᵀ(Φ Φᵀ)⁻¹φ`; near singular positions with that of `Mass`.
    #[cfg(feature = "alloc")]
    Gradient,
    /// As `Mass`, with a displacement of dependent coordinates alone, which are chosen anew each time; near singular
    /// positions with that of `Mass`.
    #[cfg(feature = "alloc")]
    Partition,
}

impl Stabilisation {
    /// Whether the displacements are not those of the sweeps.
    fn has_displacements(self) -> bool {
        #[cfg(feature = "alloc")]
        return matches!(self, Stabilisation::Gradient | Stabilisation::Partition);
        #[cfg(not(feature = "alloc"))]
        false
    }
}

/// The residual at which positions count as closed, and the number of iterations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Largest number of iterations at the end of a step.
    pub iterations: u32,
    /// Residual, m and rad, after which one correction more is the last. With 0, all iterations are always done, and the
    /// last residual is not judged.
    pub tolerance: f64,
    /// Largest part of the kinetic energy that the end of one step may take or give. More is
    /// [`ConstraintError::Energy`]. With `f64::INFINITY` it is not computed.
    pub energy: f64,
}

impl Effort {
    /// For steps that are chosen by a tolerance: the end of a step may change the kinetic energy by that part.
    pub fn within(tolerance: f64) -> Self {
        Effort { energy: tolerance, ..Effort::default() }
    }
}

impl Default for Effort {
    fn default() -> Self {
        Effort { iterations: 3, tolerance: 1e-14, energy: 1e-3 }
    }
}

/// A singular position that the motion has passed or reached: fewer rows are independent there, and several motions may
/// continue from it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SingularPosition {
    /// Time, s.
    pub time: f64,
    /// The constraint, numbered as in [`Row::constraint`](crate::system::Row).
    pub constraint: usize,
    /// Number of independent rows of all constraints at the ends of the steps before and after; the same where a step
    /// led past the position.
    pub ranks: [usize; 2],
}

/// What is known of the end of a step.
#[derive(Clone, Copy, Debug)]
struct Noted<S> {
    t: S,
    /// Length of the step, if the end before it is known too.
    step: Option<S>,
    rank: usize,
    /// Whether there was no independent row at this end and the one before it.
    still: bool,
}

/// Corrects positions by a [`Stabilisation`].
#[derive(Clone, Debug)]
pub(super) struct Corrector<Y: Constrained> {
    pub stabilisation: Stabilisation,
    effort: Effort,
    /// Largest residual before the last correction.
    pub found: Y::Scalar,
    /// Number of independent rows in its last iteration.
    pub rank: usize,
    /// The last end of a step.
    noted: Option<Noted<Y::Scalar>>,
    /// Roots of the pivots at the last end and at the one before it. They go through zero with a change of sign.
    roots: [Y::Rows; 2],
    /// Number of singular positions, and the last one.
    pub singular: (u32, Option<SingularPosition>),
    /// How near singular positions are.
    pub nearness: Nearness<Y::Rows, Y::Scalar>,
    /// Whether the last state was near one.
    near: bool,
    /// Whether the last end of a step has changed the order of the rows.
    pub reordered: bool,
    #[cfg(feature = "alloc")]
    basic: Option<Basic<Y::Scalar>>,
}

impl<Y> Corrector<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    pub fn new(system: &Y, stabilisation: Stabilisation, effort: Effort) -> Self {
        Corrector {
            stabilisation,
            effort,
            found: Y::Scalar::zero(),
            rank: 0,
            noted: None,
            roots: [system.zero_rows(), system.zero_rows()],
            singular: (0, None),
            nearness: Nearness::new(system.zero_rows()),
            near: false,
            reordered: false,
            #[cfg(feature = "alloc")]
            basic: stabilisation.has_displacements().then(|| Basic::new(system)),
        }
    }

    /// Number of independent rows at the last end of a step.
    pub fn noted(&self) -> Option<usize> {
        self.noted.map(|noted| noted.rank)
    }

    /// Notes the last correction at the end of a step; states inside the last step are not noted. Before its start, another motion
    /// has begun.
    pub fn note(&mut self, system: &Y, t: Y::Scalar, pivots: &Y::Rows) {
        let zero = Y::Scalar::zero();
        let rank = self.rank;
        let last = match self.noted {
            Some(last) if t <= last.t && last.step.is_some_and(|step| t < last.t - step) => {
                self.roots.iter_mut().for_each(|roots| roots.as_mut().fill(zero));
                None
            }
            Some(last) if t <= last.t => return,
            last => last,
        };
        let step = last.map(|last| t - last.t);
        let still = rank == 0 && last.is_some_and(|last| last.rank == 0);
        self.noted = Some(Noted { t, step, rank, still });
        if still && last.is_some_and(|last| last.still) {
            // All roots are zero, and stay so.
            return;
        }
        let (mut found, mut left) = (None, None);
        let [old, older] = &mut self.roots;
        for (row, (pivot, (old, older))) in
            pivots.as_ref().iter().zip(old.as_mut().iter_mut().zip(older.as_mut())).enumerate()
        {
            let mut root = pivot.sqrt();
            if (root == zero) != (*old == zero) {
                left = left.or(Some(row));
            } else if let (Some(step), Some(before), true) = (step, last.and_then(|last| last.step), *older != zero) {
                // The root is followed linearly over the step. Its sign changes if that leads beyond zero.
                if root > zero && *old + (*old - *older) * (step / before) < zero {
                    // Where a leg cannot follow a row by itself, the mechanism may.
                    if !system.row_is_early(row) {
                        found = Some((row, t - step * (root / (root + *old))));
                    }
                    root = -root;
                }
            }
            // Only the ratio of the signs matters.
            (*older, *old) = if root < zero { (-*old, -root) } else { (*old, root) };
        }
        let event = match last {
            // Where the rank rises, the position has been noted already.
            Some(last) if last.rank < rank => None,
            Some(last) if last.rank > rank => Some((left.unwrap_or(0), t, [last.rank, rank])),
            _ => found.map(|(row, time)| (row, time, [rank; 2])),
        };
        if let Some((row, time, ranks)) = event {
            let constraint = named(system, row);
            self.singular.0 += 1;
            self.singular.1 = Some(SingularPosition { time: time.to_f64(), constraint, ranks });
        }
    }

    /// Has the system order its rows anew where one of them has lost most of its pivot, at the end of a step that has
    /// been noted.
    pub fn reorder(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, pivots: &Y::Rows) {
        if self.noted.is_none_or(|noted| noted.t != t) {
            return;
        }
        self.reordered = self.nearness.asks_for_order(pivots.as_ref()) && system.reorder_rows(q);
        if self.reordered {
            // Roots of pivots in another order say nothing about the next ones.
            self.roots.iter_mut().for_each(|roots| roots.as_mut().fill(Y::Scalar::zero()));
        }
    }

    /// Computes the residuals, and the displacement that corrects them into `room.v`, in iteration `k`.
    ///
    /// Near a singular position it is that of the sweeps for all stabilisations: at a distance `s`, a residual `φ` takes
    /// a displacement of `φ/s`, and those that are not normal to the motion have a part of that size along it, which
    /// changes the energy at every step by what the forces do on it, with the same sign.
    fn solve(&mut self, room: &mut Room<Y>, system: &mut Y, q: &Y::Coordinates, k: u32) {
        let own = self.stabilisation.has_displacements();
        if !own || k == 0 || self.near {
            system.position_correction(q, &mut room.residual, &mut room.v, &mut room.pivots);
            self.rank = room.pivots.as_ref().iter().filter(|pivot| **pivot != Y::Scalar::zero()).count();
        }
        if own && k == 0 {
            self.near = self.nearness.near(room.pivots.as_ref());
        }
        #[cfg(feature = "alloc")]
        if let Some(basic) = self.basic.as_mut().filter(|_| !self.near) {
            basic.leave_out(room.pivots.as_ref());
            system.constraint_residuals(q, &mut room.residual, &mut room.entries);
            let (residual, entries, dq) = (room.residual.as_ref(), room.entries.as_ref(), room.v.as_mut());
            match self.stabilisation {
                Stabilisation::Gradient => {
                    basic.least(entries, &[], residual, dq);
                }
                _ => basic.dependent(entries, residual, dq),
            }
        }
    }

    /// Corrects positions until the residuals are small, and once more: a residual below the tolerance is removed too,
    /// because it rotates the direction of motion the more, the nearer a singular position is.
    pub fn correct(
        &mut self,
        room: &mut Room<Y>,
        system: &mut Y,
        q: &mut Y::Coordinates,
    ) -> Result<(), ConstraintError> {
        let Effort { iterations, tolerance, .. } = self.effort;
        for k in 0..iterations {
            self.solve(room, system, q, k);
            let (at, size) = worst(room.residual.as_ref());
            if k == 0 {
                self.found = size;
            }
            if !size.is_finite() {
                return Err(ConstraintError::NotFinite { index: at });
            }
            finite(room.v.as_ref())?;
            Chart::displace(system, &mut room.v, q);
            if tolerance > 0.0 && size.to_f64() <= tolerance {
                return Ok(());
            }
        }
        if tolerance <= 0.0 {
            return Ok(());
        }
        // All iterations are used. The residual is round-off, or the step was too large.
        system.constraint_residuals(q, &mut room.residual, &mut room.entries);
        let (at, size) = worst(room.residual.as_ref());
        let residual = size.to_f64();
        if residual <= tolerance.max(libm::sqrt(Y::Scalar::epsilon())) {
            return Ok(());
        }
        let (constraint, rows, rank) = (named(system, at), system.rows().len(), self.rank);
        Err(ConstraintError::NotClosed { constraint, residual, rank, rows, iterations })
    }
}
