//! How the impulses of a time step are found.

use crate::contact::solver::{impact_by_sweeps, impact_near};
use crate::contact::{impact, ContactError, ContactRules, Effort, Impact, ImpactOptions, Problem};
use crate::system::Real;

/// Relative residual of impulses that is enough where that of the rules is not reached: steps err by more.
const RESIDUAL: f64 = 1e-5;
/// Rounds of sweeps and Newton steps in which the residual of the rules is to be reached.
const ROUNDS: u32 = 4;

/// How the impulses of a time step are found.
pub trait StepImpulses {
    /// Whether overlaps are taken away, for which impulses are found a second time in a step.
    const LIFTS: bool;
    /// Whether steps are divided whose impulses are not found.
    const DIVIDES: bool;

    /// The impulses of a problem, as [`impact`]; `impulses` has those of the last step.
    ///
    /// # Errors
    /// [`ContactError`].
    fn find<S: Real>(
        rules: &ContactRules,
        problem: &Problem<S>,
        impulses: &mut [S],
        work: &mut [S],
    ) -> Result<Impact<S>, ContactError>;
}

/// By the rules: [`impact`]. Impulses that do not reach the residual of the rules are accepted at one of 1e-5.
#[derive(Clone, Copy, Debug)]
pub struct ByRules;

impl StepImpulses for ByRules {
    const LIFTS: bool = true;
    const DIVIDES: bool = true;

    fn find<S: Real>(
        rules: &ContactRules,
        problem: &Problem<S>,
        impulses: &mut [S],
        work: &mut [S],
    ) -> Result<Impact<S>, ContactError> {
        let order = rules.order;
        let result = impact_near(problem, &ImpactOptions { effort: briefly(rules.effort), order }, impulses, work);
        match (result, rules.effort) {
            (Err(ContactError::NoConvergence { .. }), Effort::ToTolerance { tolerance, rounds }) => {
                let effort = Effort::ToTolerance { tolerance: tolerance.max(RESIDUAL), rounds };
                impact(problem, &ImpactOptions { effort, order }, impulses, work)
            }
            _ => result,
        }
    }
}

/// The same tolerance with few rounds: what is not found in these is hardly ever found in more.
pub(super) fn briefly(effort: Effort) -> Effort {
    match effort {
        Effort::ToTolerance { tolerance, rounds } => Effort::ToTolerance { tolerance, rounds: rounds.min(ROUNDS) },
        Effort::Sweeps(_) => effort,
    }
}

/// By exactly `N` sweeps over the contacts, all of which act at once, whatever the residual is and the rules say: for
/// processors with a fixed time budget, so that overlaps stay. Nothing is allocated, and numbers stay in the precision of
/// the system. A single contact with restitution has the impulses of several: of compression, then of expansion.
#[derive(Clone, Copy, Debug)]
pub struct FixedSweeps<const N: u32>;

impl<const N: u32> StepImpulses for FixedSweeps<N> {
    const LIFTS: bool = false;
    const DIVIDES: bool = false;

    fn find<S: Real>(
        _: &ContactRules,
        problem: &Problem<S>,
        impulses: &mut [S],
        work: &mut [S],
    ) -> Result<Impact<S>, ContactError> {
        impact_by_sweeps(problem, N, impulses, work)
    }
}
