//! Contacts: pairs of bodies that can touch, and stops of joints.
//!
//! A contact is a constraint that acts only while its bodies are pressed together. Its first row is the normal one: its
//! residual is the gap (m; rad for stops of rotations), positive while the bodies are apart. Where there is friction, two
//! tangential rows follow.

mod assembly;
#[cfg(feature = "alloc")]
mod beside;
mod derivatives;
mod hybrid;
mod instant;
#[cfg(feature = "alloc")]
mod mode_table;
mod motion;
#[cfg(feature = "alloc")]
mod reach;
mod solver;
mod stepping;
mod touching;
mod travel;
mod with_contacts;

use crate::Scalar;

pub use assembly::{Columns, ColumnsOf};
pub use hybrid::{
    Cause, ContactEvent, ContactObserver, ContactRules, ContactStatistics, Hybrid, HybridError, SaltationError,
    Stretch, Tangent,
};
#[cfg(feature = "alloc")]
pub use mode_table::{ContactInterpreter, ModeTable, Reducible};
pub use motion::{ContactMotion, Regime, RegimeChange, RegimeChoice, RegimeReason, RegimeRules, RegimeStatistics};
pub use solver::{
    impact, solve, work_len, Certificate, ContactError, Effort, Impact, ImpactOptions, ImpactOrder, Problem, Touch,
};
pub use stepping::{ByRules, FixedSweeps, LastTimeStep, StepImpulses, SteppingStatistics, TimeStepping};
pub use touching::{Reach, Touching};
pub use with_contacts::WithContacts;

/// How a contact with restitution throws its bodies apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RestitutionLaw {
    /// The normal impulse of expansion is the coefficient times that of compression. It never adds energy.
    #[default]
    Poisson,
    /// The work of expansion is the square of the coefficient times that of compression. It never adds energy.
    Stronge,
    /// The normal velocity after the impact is the coefficient times that before it, reversed. With friction it may add
    /// energy.
    Newton,
}

/// A contact of a system, by its rows among those of the system's constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<S> {
    /// Its normal row.
    pub row: usize,
    /// Whether the two rows after it are tangential ones, at right angles to each other.
    pub tangents: bool,
    /// Coefficient of Coulomb's friction; zero without tangential rows.
    pub friction: S,
    /// Coefficient of restitution, from 0 (the bodies stay together) to 1.
    pub restitution: S,
    /// Law of restitution.
    pub law: RestitutionLaw,
}

impl<S: Scalar> Contact<S> {
    /// In the place of a contact that a mechanism does not have: none of its rows is a row of the mechanism.
    pub(crate) fn nowhere() -> Self {
        let (row, law) = (usize::MAX / 2, RestitutionLaw::Poisson);
        Contact { row, tangents: false, friction: S::zero(), restitution: S::zero(), law }
    }
}

impl<S> Contact<S> {
    /// Number of its rows.
    pub fn rows(&self) -> usize {
        if self.tangents {
            3
        } else {
            1
        }
    }
}

/// What computes the rates of a mechanism with contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Way {
    /// Code that was generated for the modes of the contacts.
    Generated,
    /// Generated code for all modes, where numbers say which rows act.
    Masked,
    /// Code that was made for the modes at run time.
    Compiled,
    /// The interpreter.
    Interpreted,
    /// Generated code that is put together from pieces for the modes of the contacts.
    Factored,
}

/// Which rows of the constraints act in given modes of the contacts, of a mechanism with `rows` rows: those that are no
/// contacts' always do.
#[cfg(feature = "alloc")]
pub fn rows_that_act<S>(rows: usize, contacts: &[Contact<S>], modes: &[Mode]) -> alloc::vec::Vec<bool> {
    let mut acts = alloc::vec![true; rows];
    for (contact, mode) in contacts.iter().zip(modes) {
        for k in 0..contact.rows() {
            if let Some(acts) = acts.get_mut(contact.row + k) {
                *acts = mode.acts(k);
            }
        }
    }
    acts
}

/// What a contact does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// The bodies are apart, or about to be: no force.
    #[default]
    Open,
    /// The bodies stay together and slide, or may slide freely: the normal row acts, and friction against the motion.
    Slide,
    /// The bodies stay together and do not slide: all rows act.
    Stick,
}

impl Mode {
    /// Whether row `k` of the contact acts.
    pub fn acts(self, k: usize) -> bool {
        match self {
            Mode::Open => false,
            Mode::Slide => k == 0,
            Mode::Stick => true,
        }
    }
}
