//! Constraints kept at step boundaries.

#[cfg(feature = "alloc")]
use super::basic::Basic;
use super::boundary::PostStep;
use super::rows::{add_forces, named, worst};
use super::ConstraintError;
use crate::integrate::Chart;
use crate::system::{Constrained, Real};
use crate::Scalar;

/// What is done at the end of every step; see the module's table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stabilisation {
    /// Nothing: multipliers `σ` add up in the momenta, positions drift.
    None,
    /// Momenta are freed of `σ` ([`Constrained::project_momenta`]); positions drift with the method's error.
    Momenta,
    /// After that positions are moved back, least in the metric of the mass matrix ([`Constrained::correction`]); momenta stay.
    #[default]
    Mass,
    /// The same with displacements of least norm, `−Φᵀ(Φ Φᵀ)⁻¹φ`.
    #[cfg(feature = "alloc")]
    Gradient,
    /// The same with displacements of dependent coordinates alone, which are chosen anew each time.
    #[cfg(feature = "alloc")]
    Partition,
}

/// How positions are brought back, and when that counts as done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Iterations at the end of a step, at most.
    pub iterations: u32,
    /// Residual, m and rad, below which nothing is done; zero: all iterations are always made, for constant cost.
    pub tolerance: f64,
}

impl Default for Effort {
    fn default() -> Self {
        Effort { iterations: 3, tolerance: 1e-14 }
    }
}

impl Effort {
    /// Exactly so many iterations.
    pub const fn fixed(iterations: u32) -> Self {
        Effort { iterations, tolerance: 0.0 }
    }
}

/// A [`Stabilisation`] as the [`PostStep`] of a method: re-zeroes momenta first, then moves positions and keeps the momenta,
/// which disturbs the energy least.
///
/// Methods that remember rates of the past keep their `σ`: it is taken off, and put back where the positions are then.
/// [`Stabilisation::Momenta`] and [`Stabilisation::Mass`] allocate nothing.
#[derive(Clone, Debug)]
pub struct Hold<Y: Constrained> {
    policy: Stabilisation,
    effort: Effort,
    v: Y::Momenta,
    sigma: Y::Rows,
    residual: Y::Rows,
    pivots: Y::Rows,
    /// The largest pivot of every row so far.
    most: Y::Rows,
    entries: Y::Entries,
    /// Largest residual before the last end of a step was corrected.
    found: Y::Scalar,
    rank: Option<usize>,
    changes: u32,
    #[cfg(feature = "alloc")]
    basic: Option<Basic<Y::Scalar>>,
}

impl<Y> Hold<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    /// Room for one system.
    pub fn new(system: &Y, policy: Stabilisation, effort: Effort) -> Self {
        Hold {
            policy,
            effort,
            v: system.zero_momenta(),
            sigma: system.zero_rows(),
            residual: system.zero_rows(),
            pivots: system.zero_rows(),
            most: system.zero_rows(),
            entries: system.zero_entries(),
            found: Y::Scalar::zero(),
            rank: None,
            changes: 0,
            #[cfg(feature = "alloc")]
            basic: match policy {
                Stabilisation::Gradient | Stabilisation::Partition => Some(Basic::new(system)),
                _ => None,
            },
        }
    }

    /// The largest residual of the last state that was corrected, at the end of a step or inside of it, before anything was
    /// done, m or rad.
    pub fn drift(&self) -> Y::Scalar {
        self.found
    }

    /// Multipliers `σ` that it had.
    pub fn sigma(&self) -> &Y::Rows {
        &self.sigma
    }

    /// Number of independent rows at the last correction of positions, and how often it has changed.
    pub fn rank(&self) -> (Option<usize>, u32) {
        (self.rank, self.changes)
    }

    /// Residuals, and the displacement that corrects them into `v`. The number of independent rows.
    fn position_correction(&mut self, system: &mut Y, q: &Y::Coordinates) -> usize {
        #[cfg(feature = "alloc")]
        if let Some(basic) = &mut self.basic {
            system.constraint_residuals(q, &mut self.residual, &mut self.entries);
            let (residual, entries, dq) = (self.residual.as_ref(), self.entries.as_ref(), self.v.as_mut());
            return match self.policy {
                Stabilisation::Gradient => basic.least(entries, &[], residual, dq),
                _ => basic.dependent(entries, residual, dq),
            };
        }
        system.position_correction(q, &mut self.residual, &mut self.v, &mut self.pivots);
        self.pivots.as_ref().iter().filter(|pivot| **pivot != Y::Scalar::zero()).count()
    }

    /// Whether rows depend on one another much more than they used to. Positions are left alone there: several ways lead on from a
    /// singular position, and at a distance `s` from it a correction by `φ/s` turns the way by `φ/s²`, which takes energy from
    /// momenta that stay. Pivots go with `s²`. What is left open is put back when the position has been passed.
    fn near_fork(&mut self) -> bool {
        let part = Y::Scalar::constant(libm::cbrt(Y::Scalar::epsilon()));
        let mut near = false;
        for (most, pivot) in self.most.as_mut().iter_mut().zip(self.pivots.as_ref()) {
            if *pivot > *most {
                *most = *pivot;
            }
            near |= *pivot < part * *most;
        }
        near
    }

    /// Positions back; momenta stay.
    fn project(&mut self, system: &mut Y, q: &mut Y::Coordinates) -> Result<(), ConstraintError> {
        let constant = self.effort.tolerance <= 0.0;
        let iterations = self.effort.iterations;
        for k in 0..iterations {
            let rank = self.position_correction(system, q);
            let (at, size) = worst(self.residual.as_ref());
            if k == 0 {
                self.found = size;
                self.changes += u32::from(self.rank.is_some_and(|before| before != rank));
                self.rank = Some(rank);
            }
            if !size.is_finite() {
                return Err(ConstraintError::NotFinite { index: at });
            }
            if !constant && size.to_f64() <= self.effort.tolerance {
                return Ok(());
            }
            if let (index, true) = unfit(self.v.as_ref()) {
                return Err(ConstraintError::NotFinite { index });
            }
            if self.policy == Stabilisation::Mass
                && self.near_fork()
                && size.to_f64() <= libm::sqrt(Y::Scalar::epsilon())
            {
                return Ok(());
            }
            Chart::displace(system, &mut self.v, q);
        }
        if constant {
            return Ok(());
        }
        // All iterations are used up: round-off is left, or the step went too far.
        system.constraint_residuals(q, &mut self.residual, &mut self.entries);
        let (at, size) = worst(self.residual.as_ref());
        let residual = size.to_f64();
        if residual <= self.effort.tolerance.max(libm::sqrt(Y::Scalar::epsilon())) {
            return Ok(());
        }
        let (constraint, rows, rank) = (named(system, at), system.rows().len(), self.rank.unwrap_or(0));
        Err(ConstraintError::NotClosed { constraint, residual, rank, rows, iterations })
    }
}

fn unfit<S: Real>(x: &[S]) -> (usize, bool) {
    let (index, size) = worst(x);
    (index, !size.is_finite())
}

impl<Y> PostStep<Y> for Hold<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    fn close(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        remembers: bool,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        if self.policy == Stabilisation::None || (remembers && self.policy == Stabilisation::Momenta) {
            return Ok(());
        }
        system.project_momenta(t, q, p, &mut self.v, &mut self.sigma);
        if let (index, true) = unfit(p.as_ref()) {
            return Err(ConstraintError::NotFinite { index });
        }
        if self.policy != Stabilisation::Momenta {
            self.project(system, q)?;
        }
        if remembers {
            system.constraint_residuals(q, &mut self.residual, &mut self.entries);
            add_forces(system, &self.entries, &self.sigma, p);
        }
        Ok(())
    }
}
