//! Projection of states onto the constraints at the ends of steps.

#[cfg(feature = "alloc")]
use super::basic::Basic;
use super::post_step::PostStep;
use super::rows::{add_forces, named, worst};
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
    /// As `Mass`, with the displacement of least norm, `−Φᵀ(Φ Φᵀ)⁻¹φ`.
    #[cfg(feature = "alloc")]
    Gradient,
    /// As `Mass`, with a displacement of dependent coordinates alone, which are chosen anew each time.
    #[cfg(feature = "alloc")]
    Partition,
}

/// The residual at which positions count as closed, and the number of iterations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Largest number of iterations at the end of a step.
    pub iterations: u32,
    /// Residual, m and rad, below which positions are not corrected. With 0, all iterations are always done, and the
    /// last residual is not judged.
    pub tolerance: f64,
}

impl Default for Effort {
    fn default() -> Self {
        Effort { iterations: 3, tolerance: 1e-14 }
    }
}

/// Projects the state onto the constraints where a step ends: the [`PostStep`] of any method. Momenta are
/// projected first. Then positions are corrected with the momenta unchanged, which changes the energy least.
///
/// Methods that remember rates of past steps keep their multipliers `σ`: they are removed from the momenta, and added
/// again at the corrected positions.
///
/// The policy `P` says how much work is done: [`ToTolerance`] iterates until the residuals are small, [`FixedWork`]
/// always does the same, for processors with a fixed time budget. [`Stabilisation::Momenta`], [`Stabilisation::Mass`]
/// and [`FixedWork`] allocate nothing.
#[derive(Clone, Debug)]
pub struct Projection<Y: Constrained, P = ToTolerance<Y>> {
    room: Room<Y>,
    policy: P,
}

/// Memory for one projection.
#[derive(Clone, Debug)]
pub struct Room<Y: Constrained> {
    /// Velocities; displacement of an iteration.
    v: Y::Momenta,
    sigma: Y::Rows,
    residual: Y::Rows,
    pivots: Y::Rows,
    entries: Y::Entries,
}

impl<Y: Constrained> Room<Y> {
    fn new(system: &Y) -> Self {
        let rows = || system.zero_rows();
        Room {
            v: system.zero_momenta(),
            sigma: rows(),
            residual: rows(),
            pivots: rows(),
            entries: system.zero_entries(),
        }
    }
}

/// The work of a [`Projection`].
pub trait Policy<Y: Constrained> {
    /// Whether momenta are projected. `remembers` as in [`PostStep::close`].
    fn frees_momenta(&self, remembers: bool) -> bool;

    /// Corrects positions.
    ///
    /// # Errors
    /// [`ConstraintError`].
    fn move_positions(
        &mut self,
        room: &mut Room<Y>,
        system: &mut Y,
        q: &mut Y::Coordinates,
    ) -> Result<(), ConstraintError>;
}

/// Exactly `N` iterations with [`Stabilisation::Mass`], whatever the residuals are: nothing is compared with a
/// tolerance, and numbers stay in the precision of the system. One projection of momenta and one solve for each
/// iteration.
#[derive(Clone, Copy, Debug)]
pub struct FixedWork<const N: usize>;

impl<Y, const N: usize> Policy<Y> for FixedWork<N>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    #[inline]
    fn frees_momenta(&self, _remembers: bool) -> bool {
        true
    }

    #[inline]
    fn move_positions(
        &mut self,
        room: &mut Room<Y>,
        system: &mut Y,
        q: &mut Y::Coordinates,
    ) -> Result<(), ConstraintError> {
        for _ in 0..N {
            system.position_correction(q, &mut room.residual, &mut room.v, &mut room.pivots);
            Chart::displace(system, &mut room.v, q);
        }
        finite(q.as_ref())
    }
}

/// Iterations of a [`Stabilisation`] until the residuals are small ([`Effort`]).
#[derive(Clone, Debug)]
pub struct ToTolerance<Y: Constrained> {
    stabilisation: Stabilisation,
    effort: Effort,
    /// The largest pivot of every row so far.
    most: Y::Rows,
    /// Largest residual before the last correction.
    found: Y::Scalar,
    rank: Option<usize>,
    changes: u32,
    #[cfg(feature = "alloc")]
    basic: Option<Basic<Y::Scalar>>,
}

impl<Y> Projection<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    /// A projection for one system that iterates until the residuals are small.
    pub fn new(system: &Y, stabilisation: Stabilisation, effort: Effort) -> Self {
        let policy = ToTolerance {
            stabilisation,
            effort,
            most: system.zero_rows(),
            found: Y::Scalar::zero(),
            rank: None,
            changes: 0,
            #[cfg(feature = "alloc")]
            basic: match stabilisation {
                Stabilisation::Gradient | Stabilisation::Partition => Some(Basic::new(system)),
                _ => None,
            },
        };
        Projection { room: Room::new(system), policy }
    }

    /// A projection for one system with exactly `N` iterations at the end of every step.
    pub fn fixed_work<const N: usize>(system: &Y) -> Projection<Y, FixedWork<N>> {
        Projection { room: Room::new(system), policy: FixedWork }
    }

    /// The largest residual, m or rad, of the last state that was corrected, at the end of a step or inside it, before
    /// the correction.
    pub fn drift(&self) -> Y::Scalar {
        self.policy.found
    }

    /// Number of independent rows at the last correction of positions, and how often it has changed.
    pub fn rank(&self) -> (Option<usize>, u32) {
        (self.policy.rank, self.policy.changes)
    }
}

impl<Y: Constrained, P> Projection<Y, P> {
    /// Multipliers `σ` that the momenta of the last state had, one for each row, N s and N m s.
    pub fn sigma(&self) -> &Y::Rows {
        &self.room.sigma
    }

    /// Residuals that the last iteration found, one for each row, m and rad.
    pub fn residual(&self) -> &Y::Rows {
        &self.room.residual
    }
}

impl<Y> ToTolerance<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    /// Computes the residuals, and the displacement that corrects them into `room.v`. Returns the number of independent
    /// rows.
    fn correct(&mut self, room: &mut Room<Y>, system: &mut Y, q: &Y::Coordinates) -> usize {
        #[cfg(feature = "alloc")]
        if let Some(basic) = &mut self.basic {
            system.constraint_residuals(q, &mut room.residual, &mut room.entries);
            let (residual, entries, dq) = (room.residual.as_ref(), room.entries.as_ref(), room.v.as_mut());
            return match self.stabilisation {
                Stabilisation::Gradient => basic.least(entries, &[], residual, dq),
                _ => basic.dependent(entries, residual, dq),
            };
        }
        system.position_correction(q, &mut room.residual, &mut room.v, &mut room.pivots);
        room.pivots.as_ref().iter().filter(|pivot| **pivot != Y::Scalar::zero()).count()
    }

    /// Whether the rows are much closer to linear dependence than before. Positions are not corrected then. Several
    /// motions continue from a singular position; at a distance `s` from it, a correction by `φ/s` rotates the
    /// direction of motion by `φ/s²`, which changes the energy, because the momenta stay. Pivots are proportional to
    /// `s²`. The residual is corrected after the position has been passed.
    fn near_fork(&mut self, pivots: &Y::Rows) -> bool {
        let part = Y::Scalar::constant(libm::cbrt(Y::Scalar::epsilon()));
        let mut near = false;
        for (most, pivot) in self.most.as_mut().iter_mut().zip(pivots.as_ref()) {
            if *pivot > *most {
                *most = *pivot;
            }
            near |= *pivot < part * *most;
        }
        near
    }
}

impl<Y> Policy<Y> for ToTolerance<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    fn frees_momenta(&self, remembers: bool) -> bool {
        match self.stabilisation {
            Stabilisation::None => false,
            Stabilisation::Momenta => !remembers,
            _ => true,
        }
    }

    fn move_positions(
        &mut self,
        room: &mut Room<Y>,
        system: &mut Y,
        q: &mut Y::Coordinates,
    ) -> Result<(), ConstraintError> {
        if self.stabilisation == Stabilisation::Momenta {
            return Ok(());
        }
        let Effort { iterations, tolerance } = self.effort;
        let flat = libm::sqrt(Y::Scalar::epsilon());
        for k in 0..iterations {
            let rank = self.correct(room, system, q);
            let (at, size) = worst(room.residual.as_ref());
            if k == 0 {
                self.found = size;
                self.changes += u32::from(self.rank.is_some_and(|before| before != rank));
                self.rank = Some(rank);
            }
            if !size.is_finite() {
                return Err(ConstraintError::NotFinite { index: at });
            }
            if tolerance > 0.0 && size.to_f64() <= tolerance {
                return Ok(());
            }
            finite(room.v.as_ref())?;
            if self.stabilisation == Stabilisation::Mass && self.near_fork(&room.pivots) && size.to_f64() <= flat {
                return Ok(());
            }
            Chart::displace(system, &mut room.v, q);
        }
        if tolerance <= 0.0 {
            return Ok(());
        }
        // All iterations are used. The residual is round-off, or the step was too large.
        system.constraint_residuals(q, &mut room.residual, &mut room.entries);
        let (at, size) = worst(room.residual.as_ref());
        let residual = size.to_f64();
        if residual <= tolerance.max(flat) {
            return Ok(());
        }
        let (constraint, rows, rank) = (named(system, at), system.rows().len(), self.rank.unwrap_or(0));
        Err(ConstraintError::NotClosed { constraint, residual, rank, rows, iterations })
    }
}

/// Whether all numbers are finite.
fn finite<S: Real>(x: &[S]) -> Result<(), ConstraintError> {
    let (index, size) = worst(x);
    match size.is_finite() {
        true => Ok(()),
        false => Err(ConstraintError::NotFinite { index }),
    }
}

impl<Y, P> PostStep<Y> for Projection<Y, P>
where
    Y: Constrained,
    Y::Scalar: Real,
    P: Policy<Y>,
{
    #[inline]
    fn close(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        remembers: bool,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        let Projection { room, policy } = self;
        if !policy.frees_momenta(remembers) {
            return Ok(());
        }
        system.project_momenta(t, q, p, &mut room.v, &mut room.sigma);
        finite(p.as_ref())?;
        policy.move_positions(room, system, q)?;
        if remembers {
            system.constraint_residuals(q, &mut room.residual, &mut room.entries);
            add_forces(system, &room.entries, &room.sigma, p);
        }
        Ok(())
    }
}
