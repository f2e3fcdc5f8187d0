//! What a motion with contacts is told and what it tells: rules, events, statistics, errors.

#[cfg(doc)]
use crate::contact::Way;
use crate::contact::{ContactError, Effort, Impact, ImpactOrder, Mode};
use crate::error::StepError;

/// Rules of a motion with contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ContactRules {
    /// Work for the forces and impulses of contacts.
    pub effort: Effort,
    /// Whether the impulses of several contacts act at once or one after the other.
    pub order: ImpactOrder,
    /// Gap below which bodies touch, m (rad for stops of rotations).
    pub touching: f64,
    /// Height of a bounce, m (rad), below which no more bounces are followed: the bodies stay together.
    pub bounce: f64,
    /// Speed of slip, m/s, below which bodies stop at an event if friction can hold them: they would within the time
    /// `|v|/(µ N/m)`. Between events, bodies that slide more slowly and come to rest ever more slowly stop where friction
    /// holds them, or would if its coefficient were larger by a hundred-thousandth.
    pub slip: f64,
    /// Largest number of events within a step of the integration, or at one instant.
    pub events: u32,
}

impl Default for ContactRules {
    fn default() -> Self {
        ContactRules {
            effort: Effort::default(),
            order: ImpactOrder::default(),
            touching: 1e-11,
            bounce: 1e-12,
            slip: 1e-6,
            events: 1000,
        }
    }
}

/// Reason of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Cause {
    /// Bodies came together.
    Landed,
    /// The normal force of a closed contact went to zero.
    Unloaded,
    /// The force of a sticking contact reached the friction cone.
    Slipped,
    /// A sliding contact came to rest.
    Stopped,
    /// Friction would press a sliding contact without bound (Painlevé).
    Jammed,
}

impl Cause {
    /// What the contact does, a verb.
    pub const fn verb(self) -> &'static str {
        match self {
            Cause::Landed => "lands",
            Cause::Unloaded => "opens",
            Cause::Slipped => "slips",
            Cause::Stopped => "stops",
            Cause::Jammed => "jams",
        }
    }
}

/// An event of a motion with contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ContactEvent<S> {
    /// Time, s.
    pub time: S,
    /// The contact that caused it.
    pub contact: usize,
    /// Its reason.
    pub cause: Cause,
    /// Its mode before and after.
    pub modes: [Mode; 2],
    /// Speed at which the contact approached, m/s; zero where it did not.
    pub approach: S,
    /// The impact, where there was one.
    pub impact: Option<Impact<S>>,
    /// Time at which the contact's bounces would have ended, where they were followed no longer, s.
    pub rest: Option<S>,
}

/// What happened in a motion with contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ContactStatistics {
    /// Events.
    pub events: u64,
    /// Events with an impact.
    pub impacts: u64,
    /// Changes of modes.
    pub switches: u64,
    /// Contacts that were closed because their bounces had become too small.
    pub settled: u64,
    /// Times at which contacts were stopped that crept: whose slip came to an end ever more slowly.
    pub crept: u64,
    /// Impacts whose expansion was reduced, so that no energy was gained.
    pub limited: u64,
    /// Impacts without an approach, of contacts that friction jams.
    pub jams: u64,
    /// Kinetic energy that impacts have taken, J.
    pub lost: f64,
    /// Largest relative residual of an impact.
    pub residual: f64,
    /// Steps, by what computed their rates ([`Way`]): code generated for the modes, generated code for all modes, code made at
    /// run time, the interpreter, generated code in pieces.
    pub steps: [u64; 5],
}

/// Reason why a motion with contacts cannot go on.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum HybridError {
    /// A step failed.
    Step(StepError),
    /// No forces or impulses of the contacts were found.
    Contact {
        /// Time, s.
        time: f64,
        /// The error of the solver.
        error: ContactError,
    },
    /// Bodies overlap where the motion starts.
    Overlap {
        /// The contact.
        contact: usize,
        /// Its gap, m or rad.
        gap: f64,
    },
    /// More events follow one another than the rules allow.
    TooManyEvents {
        /// Time, s.
        time: f64,
        /// Their number.
        events: u32,
    },
    /// Bodies turn so far in one step that it cannot be searched for contacts.
    TurnsTooFar {
        /// Time at which the step begins, s.
        time: f64,
        /// Angle, rad: an upper bound.
        angle: f64,
    },
    /// Something at an event is not finite.
    NotFinite {
        /// Time, s.
        time: f64,
    },
}

impl From<StepError> for HybridError {
    fn from(error: StepError) -> Self {
        HybridError::Step(error)
    }
}

impl core::fmt::Display for HybridError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            HybridError::Step(error) => write!(f, "{error}"),
            HybridError::Contact { time, error } => write!(f, "at t = {time} s: {error}"),
            HybridError::Overlap { contact, gap } => write!(
                f,
                "contact {contact} starts with a gap of {gap:.3e}: the bodies overlap, or the joint is beyond its stop; start where they are apart or touch, or within the limits"
            ),
            HybridError::TooManyEvents { time, events } => write!(
                f,
                "{events} events follow one another at t = {time} s: loosen the rules (`bounce`, `touching`), or raise `events`"
            ),
            HybridError::TurnsTooFar { time, angle } => write!(
                f,
                "bodies turn by up to {angle:.1e} rad in the step that begins at t = {time} s: limit the steps to search them for contacts"
            ),
            HybridError::NotFinite { time } => {
                write!(f, "a state or a force at the event at t = {time} s is not finite: look for a singular configuration")
            }
        }
    }
}

impl core::error::Error for HybridError {}
