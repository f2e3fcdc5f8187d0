//! What can be wrong with constraints.

/// Constraints that do not hold, or cannot.
///
/// Constraints are named by [`Row::constraint`](crate::system::Row): their place among the loops and couplings of the description.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConstraintError {
    /// No positions were found that close the constraints.
    NotClosed {
        /// The constraint that is furthest from closing.
        constraint: usize,
        /// How far, m or rad.
        residual: f64,
        /// Number of rows that are independent of one another where the search ended, coordinates that are held left out.
        rank: usize,
        /// Number of rows.
        rows: usize,
        /// Iterations made.
        iterations: u32,
    },
    /// No velocities were found that meet the constraints.
    Incompatible {
        /// The constraint whose row is furthest from being met.
        constraint: usize,
        /// By how much, m/s or rad/s.
        residual: f64,
        /// Number of rows that are independent of one another, velocities that are held left out.
        rank: usize,
        /// Number of rows.
        rows: usize,
    },
    /// There are not as many independent rows as before: the mechanism has reached a singular configuration.
    RankLoss {
        /// A constraint with a row that depends on others now.
        constraint: usize,
        /// Number of rows that are independent of one another, of those coupled with it.
        rank: usize,
        /// Number that was independent before.
        before: usize,
    },
    /// A residual, or a correction, is not a number or infinite.
    NotFinite {
        /// Index of the row; of the velocity where it is a correction.
        index: usize,
    },
    /// The iteration for the multipliers of a step did not converge.
    NoConvergence {
        /// Iterations made.
        iterations: u32,
        /// Last change relative to the state.
        change: f64,
    },
}

impl core::fmt::Display for ConstraintError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            ConstraintError::NotClosed { constraint, residual, rank, rows, iterations } => write!(
                f,
                "constraint {constraint} stays open by {residual:.3e} after {iterations} iterations ({rank} of {rows} rows are independent there): start nearer to a closed position, hold fewer coordinates, or check the lengths"
            ),
            ConstraintError::Incompatible { constraint, residual, rank, rows } => write!(
                f,
                "no velocities meet constraint {constraint}, which is off by {residual:.3e} ({rank} of {rows} rows are independent of what is held): hold fewer velocities, or leave a singular position"
            ),
            ConstraintError::RankLoss { constraint, rank, before } => write!(
                f,
                "{rank} of {before} rows are left independent at constraint {constraint}: the position is singular, go through it by method 1 or move the start"
            ),
            ConstraintError::NotFinite { index } => {
                write!(f, "constraint residual or correction {index} is not finite: reduce the step, or check the start")
            }
            ConstraintError::NoConvergence { iterations, change } => write!(
                f,
                "the multipliers did not converge in {iterations} iterations (last change {change:.1e} of the state): reduce the step"
            ),
        }
    }
}

impl core::error::Error for ConstraintError {}
