//! What happened in a motion by time steps.

use crate::system::Real;

/// What happened in a motion by time steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SteppingStatistics<S = f64> {
    /// Steps.
    pub steps: u64,
    /// Steps that were divided, because impulses did not converge.
    pub divided: u64,
    /// Steps and parts of steps with impulses.
    pub touched: u64,
    /// Steps and parts in which other contacts had impulses than in those before.
    pub changes: u64,
    /// Steps and parts whose restitution was reduced, so that no energy was gained.
    pub limited: u64,
    /// Largest number of contacts with an impulse in a step.
    pub most: u32,
    /// Kinetic energy that impulses have taken, J. Where forces press contacts together, this includes the work of these.
    pub lost: S,
    /// Largest relative residual of the impulses of a step.
    pub residual: S,
    /// Largest overlap at the middle of a step, m (rad for stops of rotations).
    pub overlap: S,
}

impl<S: Real> SteppingStatistics<S> {
    pub(super) fn new() -> Self {
        let zero = S::zero();
        let [steps, divided, touched, changes, limited] = [0; 5];
        SteppingStatistics {
            steps,
            divided,
            touched,
            changes,
            limited,
            most: 0,
            lost: zero,
            residual: zero,
            overlap: zero,
        }
    }
}
