//! Contacts of the model: pairs of places that can touch, and stops of joints.

use mbd_runtime::contact::RestitutionLaw;

use super::{ConstraintKind, Origin};

/// A contact: a constraint that acts only while its bodies are pressed together.
///
/// A pair of shapes that can touch at several places (the corners of a box on a plane) is as many contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// Name, unique among constraints and contacts. Those of a pair that can touch at several places are numbered,
    /// `box/1`, `box/2`.
    pub name: String,
    /// Its geometry: a loop of a kind that rolls, whose first row is the normal one, or the coupling of one joint with
    /// its limit, with ratio 1 for a lower limit and −1 for an upper one. The residual of the first row is the gap.
    pub kind: ConstraintKind,
    /// Coefficient of friction; zero for stops.
    pub friction: f64,
    /// Coefficient of restitution, from 0 to 1.
    pub restitution: f64,
    /// Law of restitution.
    pub law: RestitutionLaw,
    /// Place of its description.
    pub origin: Origin,
}
