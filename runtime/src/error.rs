//! Errors of steps and of constraints.

use crate::system::{Part, Real, System};

/// Reason why a step failed.
///
/// Times are those of the start of the step, in s. An adaptive driver keeps the last accepted state; a step function
/// leaves `q` and `p` as they were.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// A rate, or a component of the state that was given or of the new one, is infinite or not a number: the motion
    /// diverges, or the mechanism is singular there.
    NotFinite {
        /// Time, s.
        time: f64,
        /// Index of the component: into the velocities, and from `nv` on into the momenta.
        index: usize,
    },
    /// The state that was given has a quaternion that is not of unit length.
    Quaternion {
        /// Time, s.
        time: f64,
        /// Index into `q` of its first component.
        index: usize,
        /// Its norm.
        norm: f64,
    },
    /// The error stays above the tolerances even for steps so small that they no longer change the time.
    StepTooSmall {
        /// Time, s.
        time: f64,
        /// The last step that was attempted, s.
        step: f64,
        /// Error of that step relative to the tolerances; not a number where the rates were not finite.
        error: f64,
    },
    /// A step that is not greater than zero, or not finite, was asked for.
    InvalidStep {
        /// Time, s.
        time: f64,
        /// The step, s.
        step: f64,
    },
    /// A run was asked for whose end is not a number, or whose state is at no finite time.
    InvalidEnd {
        /// Time, s.
        time: f64,
    },
    /// A tolerance is negative or not a number, or no component has one that is greater than zero.
    InvalidTolerances {
        /// Time, s.
        time: f64,
    },
    /// Adaptive steps were requested from a method without an error estimate.
    NoEstimate {
        /// Time, s.
        time: f64,
    },
    /// The limit of steps is used up.
    TooManySteps {
        /// Time that was reached, s.
        time: f64,
        /// Steps taken, rejected ones included.
        steps: u64,
    },
    /// The equations of an implicit method were not solved.
    NoConvergence {
        /// Time, s.
        time: f64,
        /// Step, s.
        step: f64,
        /// Iterations made.
        iterations: u32,
        /// Last change of the stages relative to the tolerances of the iteration.
        change: f64,
    },
    /// The matrix of an implicit method has no inverse.
    Singular {
        /// Time, s.
        time: f64,
        /// Step, s.
        step: f64,
        /// Column without a pivot.
        column: usize,
    },
    /// The constraints do not hold at the end of the step.
    Constraint {
        /// Time, s.
        time: f64,
        /// The error of the constraints.
        error: ConstraintError,
    },
}

impl StepError {
    /// Time at the start of the step that failed, s.
    pub fn time(&self) -> f64 {
        match *self {
            StepError::NotFinite { time, .. }
            | StepError::Quaternion { time, .. }
            | StepError::StepTooSmall { time, .. }
            | StepError::InvalidStep { time, .. }
            | StepError::InvalidEnd { time }
            | StepError::InvalidTolerances { time }
            | StepError::NoEstimate { time }
            | StepError::TooManySteps { time, .. }
            | StepError::NoConvergence { time, .. }
            | StepError::Singular { time, .. }
            | StepError::Constraint { time, .. } => time,
        }
    }
}

/// Whether a motion whose state is at time `t` (s) goes on to `t_end` (s).
///
/// # Errors
/// [`StepError::InvalidEnd`] if the end is not a number, or the state's time not finite.
pub(crate) fn is_before<S: Real>(t: S, t_end: S) -> Result<bool, StepError> {
    match t_end.to_f64().is_nan() || !t.is_finite() {
        true => Err(StepError::InvalidEnd { time: t.to_f64() }),
        false => Ok(t < t_end),
    }
}

/// Names of the parts of a system, for messages.
type Names<'a> = &'a dyn Fn(Part) -> Option<&'a str>;

impl StepError {
    /// The error, shown with the names that a system gives to its parts.
    pub fn named<Y: System>(self, system: &Y) -> Named<'_, Self, Y> {
        Named { error: self, system }
    }

    /// The message for a system with `nv` velocities.
    fn describe(&self, f: &mut core::fmt::Formatter<'_>, nv: usize, names: Names<'_>) -> core::fmt::Result {
        match self {
            StepError::NotFinite { time, index } => {
                write!(f, "component {index} of the state's change")?;
                let part = Part::Velocity(if *index < nv { *index } else { index - nv });
                if let Some(name) = names(part) {
                    write!(f, " ({})", Label { part, name: Some(name) })?;
                }
                write!(f, " is not finite in the step from t = {time} s: reduce the step, or look for a singular configuration")
            }
            StepError::Quaternion { time, index, norm } => {
                write!(f, "the quaternion at q[{index}] has norm {norm} at t = {time} s: give one of unit length")
            }
            StepError::StepTooSmall { time, step, error } if !error.is_finite() => {
                write!(f, "the step fell to {step:e} s at t = {time} s, because rates in it are not finite: look for a singular configuration, or for masses and inertias near zero")
            }
            StepError::StepTooSmall { time, step, error } => {
                write!(f, "the step fell to {step:e} s at t = {time} s with {error:.1e} times the allowed error: loosen the tolerances, or take an implicit method")
            }
            StepError::InvalidStep { step, .. } => {
                write!(f, "a step of {step} s was asked for: give one that is greater than zero and finite")
            }
            StepError::InvalidEnd { .. } => {
                write!(f, "the time of the state is not finite, or that at which the run should end is not a number")
            }
            StepError::InvalidTolerances { .. } => {
                write!(f, "a tolerance is negative or not a number, or all are zero: give one greater than zero, such as 1e-9")
            }
            StepError::NoEstimate { .. } => write!(f, "this method estimates no error: give it a fixed step"),
            StepError::TooManySteps { time, steps } => {
                write!(f, "{steps} steps were used up at t = {time} s: raise the limit, loosen the tolerances, or take an implicit method")
            }
            StepError::NoConvergence { time, step, iterations, change } => {
                write!(f, "no convergence in {iterations} iterations of the step of {step:e} s from t = {time} s (last change {change:.1e}): reduce the step")
            }
            StepError::Singular { time, step, column } => {
                write!(f, "the matrix of the implicit step of {step:e} s from t = {time} s is singular in column {column}: change the step")
            }
            StepError::Constraint { time, error } => {
                write!(f, "in the step from t = {time} s: ")?;
                error.describe(f, names)
            }
        }
    }
}

impl core::fmt::Display for StepError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.describe(f, usize::MAX, &|_| None)
    }
}

impl core::error::Error for StepError {}

/// Reason why constraints cannot be satisfied.
///
/// Constraints are numbered as in [`Row::constraint`](crate::system::Row): by their place among the loops and couplings
/// of the description.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ConstraintError {
    /// No positions were found that close the constraints.
    NotClosed {
        /// The constraint with the largest residual.
        constraint: usize,
        /// Its residual, m or rad.
        residual: f64,
        /// Number of rows that are independent of one another where the search ended, coordinates that are held left
        /// out.
        rank: usize,
        /// Number of rows.
        rows: usize,
        /// Iterations made.
        iterations: u32,
    },
    /// No velocities were found that satisfy the constraints.
    Incompatible {
        /// The constraint with the largest residual of its velocities.
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
        /// Index of the row, of the velocity or of the coordinate, whichever is not finite.
        index: usize,
    },
    /// The iteration for the multipliers of a step did not converge.
    NoConvergence {
        /// Iterations made.
        iterations: u32,
        /// Last change relative to the state.
        change: f64,
    },
    /// Closing the positions would change the kinetic energy by more than is allowed: the mechanism passes a singular
    /// position, or the step was too large.
    Energy {
        /// The constraint with the largest residual.
        constraint: usize,
        /// Change of the kinetic energy in this step, J.
        taken: f64,
        /// Largest kinetic energy so far, J.
        kinetic: f64,
        /// Number of independent rows.
        rank: usize,
        /// Number of rows.
        rows: usize,
    },
}

impl ConstraintError {
    /// The error, shown with the names that a system gives to its parts.
    pub fn named<Y: System>(self, system: &Y) -> Named<'_, Self, Y> {
        Named { error: self, system }
    }

    fn describe(&self, f: &mut core::fmt::Formatter<'_>, names: Names<'_>) -> core::fmt::Result {
        let label = |constraint: &usize| {
            let part = Part::Constraint(*constraint);
            Label { part, name: names(part) }
        };
        match self {
            ConstraintError::NotClosed { constraint, residual, rank, rows, iterations } => write!(
                f,
                "{} stays open by {residual:.3e} after {iterations} iterations ({rank} of {rows} rows are independent there): start nearer to a closed position, hold fewer coordinates, or check the lengths",
                label(constraint)
            ),
            ConstraintError::Incompatible { constraint, residual, rank, rows } => write!(
                f,
                "no velocities meet {}, which is off by {residual:.3e} ({rank} of {rows} rows are independent of what is held): hold fewer velocities, or leave a singular position",
                label(constraint)
            ),
            ConstraintError::RankLoss { constraint, rank, before } => write!(
                f,
                "{rank} of {before} rows are left independent at {}: the position is singular, go through it by method 1 or move the start",
                label(constraint)
            ),
            ConstraintError::NotFinite { index } => {
                write!(f, "constraint residual or correction {index} is not finite: reduce the step, or check the start")
            }
            ConstraintError::NoConvergence { iterations, change } => write!(
                f,
                "the multipliers did not converge in {iterations} iterations (last change {change:.1e} of the state): reduce the step"
            ),
            ConstraintError::Energy { constraint, taken, kinetic, rank, rows } => write!(
                f,
                "closing {} would change the kinetic energy by {taken:.1e} J of {kinetic:.3e} J ({rank} of {rows} rows are independent there): reduce the step, keep the loops closed at every step, or look for a singular position",
                label(constraint)
            ),
        }
    }
}

impl core::fmt::Display for ConstraintError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.describe(f, &|_| None)
    }
}

impl core::error::Error for ConstraintError {}

/// A part of a mechanism by its name, or by its number where it has none.
pub(crate) struct Label<'a> {
    pub part: Part,
    pub name: Option<&'a str>,
}

impl core::fmt::Display for Label<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let (kind, index) = match self.part {
            Part::Velocity(k) => ("velocity", k),
            Part::Constraint(k) => ("constraint", k),
        };
        match self.name {
            Some(name) => write!(f, "{kind} `{name}`"),
            None => write!(f, "{kind} {index}"),
        }
    }
}

/// An error that is shown with the names a system gives to its velocities and constraints ([`System::part_name`]).
#[derive(Clone, Copy, Debug)]
pub struct Named<'a, E, Y> {
    error: E,
    system: &'a Y,
}

impl<Y: System> core::fmt::Display for Named<'_, StepError, Y> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let nv = self.system.zero_momenta().as_ref().len();
        self.error.describe(f, nv, &|part| self.system.part_name(part))
    }
}

impl<Y: System> core::fmt::Display for Named<'_, ConstraintError, Y> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.error.describe(f, &|part| self.system.part_name(part))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString;

    use super::*;
    use crate::system::LieJoint;

    /// Two velocities, one of them with a name, and a constraint.
    struct Arm;

    impl System for Arm {
        type Scalar = f64;
        type Coordinates = [f64; 2];
        type Momenta = [f64; 2];

        fn neutral(&self) -> [f64; 2] {
            [0.0; 2]
        }

        fn zero_momenta(&self) -> [f64; 2] {
            [0.0; 2]
        }

        fn lie_joints(&self) -> &[LieJoint] {
            &[]
        }

        fn part_name(&self, part: Part) -> Option<&str> {
            match part {
                Part::Velocity(1) => Some("elbow"),
                Part::Constraint(0) => Some("coupler"),
                _ => None,
            }
        }

        fn rates_at(&mut self, _: f64, _: &[f64; 2], _: &[f64; 2], _: &mut [f64; 2], _: &mut [f64; 2]) {}

        fn coordinate_rates(&self, _: &[f64; 2], _: &[f64; 2], _: &mut [f64; 2]) {}
    }

    #[test]
    fn a_step_that_is_too_small_says_why() {
        let message = |error: f64| StepError::StepTooSmall { time: 0.0, step: 1e-16, error }.to_string();
        assert!(message(2.0).contains("with 2.0e0 times the allowed error: loosen the tolerances"));
        for error in [f64::NAN, f64::INFINITY] {
            let message = message(error);
            assert!(message.contains("because rates in it are not finite: look for a singular"), "{message}");
            assert!(!message.contains("NaN") && !message.contains("inf") && !message.contains("loosen"), "{message}");
        }
    }

    #[test]
    fn messages_name_the_parts_of_a_system() {
        let error = ConstraintError::RankLoss { constraint: 0, rank: 1, before: 2 };
        assert!(error.to_string().starts_with("1 of 2 rows are left independent at constraint 0: "));
        assert!(error
            .named(&Arm)
            .to_string()
            .starts_with("1 of 2 rows are left independent at constraint `coupler`: "));
        let step = StepError::Constraint { time: 0.5, error };
        assert!(step.to_string().starts_with("in the step from t = 0.5 s: 1 of 2 rows"));
        assert!(step.named(&Arm).to_string().contains("at constraint `coupler`: "));
        // The fourth component is the momentum of the second velocity; the first velocity has no name.
        for (index, told) in [
            (3, "component 3 of the state's change (velocity `elbow`) is"),
            (0, "component 0 of the state's change is"),
        ] {
            let error = StepError::NotFinite { time: 0.0, index };
            assert!(error
                .to_string()
                .starts_with(&std::format!("component {index} of the state's change is not finite")));
            assert!(error.named(&Arm).to_string().starts_with(told), "{}", error.named(&Arm));
        }
    }
}
