//! Reasons why a state cannot be carried over, or a joint not be exchanged.

use std::fmt;

use mbd_runtime::interp::MassMatrixError;

/// Reason why a state was not carried over to another model of the same bodies.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum TransferError {
    /// A body of one model is not in the other.
    Body {
        /// Its name.
        body: String,
        /// Name of the model that lacks it.
        model: String,
    },
    /// A body has other inertial parameters in the other model.
    Inertia {
        /// Its name.
        body: String,
    },
    /// An interpreter is not one of the model, or a list has another length than the model says.
    Size {
        /// What it is.
        what: &'static str,
        /// Length that the model says.
        expected: usize,
        /// Length that was found.
        found: usize,
    },
    /// The bodies of a joint stand where the joint cannot take them.
    Position {
        /// Name of the joint in the new model.
        joint: String,
        /// Distance of the child's frame from the nearest place that the coordinates give it, m.
        length: f64,
        /// Angle between the two, rad.
        angle: f64,
    },
    /// A loop or coupling of the new model is open where the bodies stand.
    Open {
        /// Name of the loop or coupling.
        constraint: String,
        /// Largest residual of its rows, m or rad.
        residual: f64,
    },
    /// In the new model a freedom moves no inertia.
    Singular(MassMatrixError),
    /// The new momenta or velocities are not finite: a number of the state, or of an input, is not.
    NotFinite,
}

impl fmt::Display for TransferError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TransferError::Body { body, model } => {
                write!(f, "model `{model}` has no body `{body}`: both models need the same bodies, by name")
            }
            TransferError::Inertia { body } => {
                write!(f, "body `{body}` has another mass, centre of mass or inertia in the new model: make them equal")
            }
            TransferError::Size { what, expected, found } => {
                write!(f, "{what}: {found} numbers where the model has {expected}: was it made from this model?")
            }
            TransferError::Position { joint, length, angle } => write!(
                f,
                "joint `{joint}` cannot take its bodies as they stand: they are {length:.3e} m and {angle:.3e} rad away \
                 from the nearest position that it allows; bring them there first, or allow more (`Fit`)"
            ),
            TransferError::Open { constraint, residual } => write!(
                f,
                "`{constraint}` is open by {residual:.3e} (m or rad) as the bodies stand; bring them together first, or \
                 allow more (`Fit`)"
            ),
            TransferError::Singular(e) => write!(f, "in the new model {e}: give that freedom a mass or inertia"),
            TransferError::NotFinite => {
                write!(f, "the new velocities are not finite: are all numbers of the state and of the inputs finite?")
            }
        }
    }
}

impl std::error::Error for TransferError {}

/// Reason why a joint was not exchanged.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RejoinError {
    /// No joint has this name.
    NoJoint {
        /// The name.
        joint: String,
    },
    /// No body has this name.
    NoBody {
        /// The name.
        body: String,
    },
    /// The new parent is carried by the body that it is to carry.
    Cycle {
        /// The body.
        body: String,
        /// The new parent.
        parent: String,
    },
    /// Something else in the model refers to the coordinate of the joint.
    Used {
        /// Name of the joint.
        joint: String,
        /// What refers to it: a joint that mimics it, a coupling, a stop.
        by: String,
    },
}

impl fmt::Display for RejoinError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RejoinError::NoJoint { joint } => write!(f, "the model has no joint `{joint}`: use a name of its joints"),
            RejoinError::NoBody { body } => write!(f, "the model has no body `{body}`: use a name of its bodies"),
            RejoinError::Cycle { body, parent } => {
                write!(f, "`{parent}` cannot carry `{body}`, which carries it: close a loop between them instead")
            }
            RejoinError::Used { joint, by } => {
                write!(f, "joint `{joint}` cannot be exchanged: {by} refers to its coordinate; remove that first")
            }
        }
    }
}

impl std::error::Error for RejoinError {}
