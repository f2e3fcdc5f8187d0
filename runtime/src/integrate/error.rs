//! What can go wrong in a step.

use crate::constrained::ConstraintError;

/// A step that must not be used.
///
/// Times are those of the start of the step, in s. An adaptive driver keeps the last accepted state; a step function
/// leaves `q` and `p` as they were.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepError {
    /// A rate or a component of the new state is infinite or not a number: the motion diverges, or the mechanism is
    /// singular there.
    NotFinite {
        /// Time, s.
        time: f64,
        /// Index into `v`, then on into `p`.
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
    /// The error stays above the tolerances down to steps that no longer change the time.
    StepTooSmall {
        /// Time, s.
        time: f64,
        /// Step at which it was given up, s.
        step: f64,
        /// Error of that step relative to the tolerances; not a number where the rates were not finite.
        error: f64,
    },
    /// Steps are to be chosen by an error that the method does not estimate.
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
        /// What is wrong with them.
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
            | StepError::NoEstimate { time }
            | StepError::TooManySteps { time, .. }
            | StepError::NoConvergence { time, .. }
            | StepError::Singular { time, .. }
            | StepError::Constraint { time, .. } => time,
        }
    }
}

impl core::fmt::Display for StepError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            StepError::NotFinite { time, index } => {
                write!(f, "component {index} of the state's change is not finite in the step from t = {time} s: reduce the step, or look for a singular configuration")
            }
            StepError::Quaternion { time, index, norm } => {
                write!(f, "the quaternion at q[{index}] has norm {norm} at t = {time} s: give one of unit length")
            }
            StepError::StepTooSmall { time, step, error } => {
                write!(f, "the step fell to {step:e} s at t = {time} s with {error:.1e} times the allowed error: loosen the tolerances, or take an implicit method")
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
            StepError::Constraint { time, error } => write!(f, "in the step from t = {time} s: {error}"),
        }
    }
}

impl core::error::Error for StepError {}
