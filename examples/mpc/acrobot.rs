//! The Acrobot's task: two bars of 1 m and 1 kg with a motor at the elbow swing up in 5 s, from hanging down to standing up.

use super::ilqr::Problem;
use super::Real;

/// Length of a step, s, and number of nodes.
pub const LENGTH: f64 = 0.025;
pub const NODES: usize = 201;
/// The joint that is driven.
pub const JOINTS: [usize; 1] = [1];
/// Input with which the search begins, N m: hanging down is at rest, and without a push it stays so.
pub const PUSH: f64 = 0.1;

/// The task, with at most 4 N m.
pub fn problem<S: Real>() -> Problem<S, 4, 1> {
    Problem {
        goal: [core::f64::consts::PI, 0.0, 0.0, 0.0].map(S::constant),
        running: [S::zero(); 4],
        end: [1000.0, 1000.0, 200.0, 200.0].map(S::constant),
        effort: [S::constant(0.01)],
        bounds: [[S::constant(-4.0)], [S::constant(4.0)]],
    }
}
