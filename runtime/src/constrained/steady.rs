//! Constraints kept at step boundaries by work that is always the same.

use super::boundary::PostStep;
use super::rows::worst;
use super::ConstraintError;
use crate::integrate::Chart;
use crate::system::{Constrained, Real};

/// What [`Hold`](super::Hold) does with [`Stabilisation::Mass`](super::Stabilisation::Mass) and `N` iterations whatever the
/// residuals are, for a processor that counts its cycles: nothing is compared with a tolerance, and no double is touched where
/// numbers are single. One solve and one for each iteration. For methods that remember nothing.
#[derive(Clone, Debug)]
pub struct Steady<Y: Constrained, const N: usize> {
    v: Y::Momenta,
    sigma: Y::Rows,
    residual: Y::Rows,
    pivots: Y::Rows,
}

impl<Y: Constrained, const N: usize> Steady<Y, N> {
    /// Room for one system.
    pub fn new(system: &Y) -> Self {
        let rows = || system.zero_rows();
        Steady { v: system.zero_momenta(), sigma: rows(), residual: rows(), pivots: rows() }
    }

    /// Residuals that the last iteration found, m and rad.
    pub fn residual(&self) -> &Y::Rows {
        &self.residual
    }
}

impl<Y, const N: usize> PostStep<Y> for Steady<Y, N>
where
    Y: Constrained,
    Y::Scalar: Real,
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
        if !remembers {
            system.project_momenta(t, q, p, &mut self.v, &mut self.sigma);
        }
        for _ in 0..N {
            system.position_correction(q, &mut self.residual, &mut self.v, &mut self.pivots);
            Chart::displace(system, &mut self.v, q);
        }
        for x in [p.as_ref(), q.as_ref()] {
            let (index, size) = worst(x);
            if !size.is_finite() {
                return Err(ConstraintError::NotFinite { index });
            }
        }
        Ok(())
    }
}
