//! Reasons why a motion with contacts has no derivative.

use super::{Cause, HybridError};
use crate::error::StepError;

/// Reason why a motion with contacts has no derivative, or none that can be computed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SaltationError {
    /// The motion itself, or a step of a tangent, fails.
    Motion(HybridError),
    /// The function of an event hardly changes its sign: a neighbouring motion may miss the event.
    Grazing {
        /// Time, s.
        time: f64,
        /// The contact.
        contact: usize,
        /// Reason of the event.
        cause: Cause,
        /// Rate of the function: of the gap, m/s (rad/s); of the normal force or the distance from the friction cone, N/s;
        /// of the speed of slip, m/s².
        rate: f64,
    },
    /// Two contacts have their events at the same time, which in neighbouring motions happen one after the other. What
    /// follows depends on their order.
    Simultaneous {
        /// Time, s.
        time: f64,
        /// The contacts.
        contacts: [usize; 2],
        /// Derivative of what would have to stay zero for both to happen together: of the second one's gap, m (rad), or
        /// of its speed of slip, m/s. Not a number where forces decide.
        derivative: f64,
    },
    /// Bounces without end are left out.
    Accumulation {
        /// Time, s.
        time: f64,
        /// The contact.
        contact: usize,
    },
    /// A contact's slip came to an end ever more slowly, and was stopped by the rules.
    Creeps {
        /// Time, s.
        time: f64,
        /// The contact.
        contact: usize,
    },
    /// The forces of redundant contacts, by which the event was found, are not unique.
    Redundant {
        /// Time, s.
        time: f64,
        /// The contact.
        contact: usize,
    },
    /// Friction jams a contact: its force has no bound before.
    Jammed {
        /// Time, s.
        time: f64,
        /// The contact.
        contact: usize,
    },
    /// In the direction of a tangent's start, a closed contact opens or its bodies overlap.
    LeavesContact {
        /// The contact.
        contact: usize,
        /// Derivative of its gap, m (rad).
        derivative: f64,
    },
    /// The derivatives of sliding contacts change so fast that pieces of a step do not agree with one another.
    Stiff {
        /// Time at which the step begins, s.
        time: f64,
        /// Their difference as a part of the largest derivative.
        difference: f64,
    },
    /// The tangent is not at the state of the motion, or not in its modes: it was started elsewhere, or has other inputs.
    Differs {
        /// Time of the motion, s.
        time: f64,
    },
}

impl From<HybridError> for SaltationError {
    fn from(error: HybridError) -> Self {
        SaltationError::Motion(error)
    }
}

impl From<StepError> for SaltationError {
    fn from(error: StepError) -> Self {
        SaltationError::Motion(HybridError::Step(error))
    }
}

impl core::fmt::Display for SaltationError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            SaltationError::Motion(error) => write!(f, "{error}"),
            SaltationError::Grazing { time, contact, cause, rate } => write!(
                f,
                "the event {cause:?} of contact {contact} at t = {time} s grazes (rate {rate:.1e}): the motion has no derivative there"
            ),
            SaltationError::Simultaneous { time, contacts: [a, b], derivative } => write!(
                f,
                "contacts {a} and {b} have events at the same time, t = {time} s, whose order neighbouring motions decide (derivative {derivative:.1e}): the motion has no derivative there"
            ),
            SaltationError::Accumulation { time, contact } => write!(
                f,
                "the bounces of contact {contact} accumulate at t = {time} s: derivatives end there; make the impact plastic, or end sooner"
            ),
            SaltationError::Creeps { time, contact } => write!(
                f,
                "contact {contact} slides ever more slowly and is stopped at t = {time} s: derivatives end there; end sooner"
            ),
            SaltationError::Redundant { time, contact } => write!(
                f,
                "contact {contact} changes its mode at t = {time} s by forces that are not unique: use fewer contacts"
            ),
            SaltationError::Jammed { time, contact } => write!(
                f,
                "friction jams contact {contact} at t = {time} s: the motion has no derivative there; reduce the friction, or end sooner"
            ),
            SaltationError::LeavesContact { contact, derivative } => write!(
                f,
                "the start of a tangent opens or overlaps contact {contact}, which is closed (derivative of its gap {derivative:.1e}): start along the contact"
            ),
            SaltationError::Stiff { time, difference } => write!(
                f,
                "derivatives change too fast in the step that begins at t = {time} s (difference {difference:.1e}): limit the steps"
            ),
            SaltationError::Differs { time } => write!(
                f,
                "a tangent is not at the state of the motion at t = {time} s, or not in its modes: start it there, with the same inputs"
            ),
        }
    }
}

impl core::error::Error for SaltationError {}
