//! Whether the mass matrix has full rank.

use alloc::string::String;

use super::{inputs, Interpreter};
use crate::sweep::{Inputs, Sweeps};
use crate::system::Real;
use crate::tree::Source;

/// What can be wrong with a mass matrix.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum MassMatrixError {
    /// The matrix has no full rank: a freedom moves no inertia.
    Singular {
        /// Velocity index of the freedom.
        velocity: usize,
        /// Name of the freedom, where the interpreter knows it ([`Interpreter::with_names`]).
        name: Option<String>,
        /// Inertia it moves, all other freedoms outboard of it being free: zero, negative or not a number.
        inertia: f64,
    },
}

impl core::fmt::Display for MassMatrixError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let MassMatrixError::Singular { velocity, name, inertia } = self;
        write!(f, "the mass matrix is singular: ")?;
        match name {
            Some(name) => write!(f, "freedom `{name}`")?,
            None => write!(f, "velocity {velocity}")?,
        }
        write!(f, " moves an inertia of {inertia:e}")
    }
}

impl core::error::Error for MassMatrixError {}

impl<S: Real> Interpreter<S> {
    /// Whether every freedom moves a positive inertia at the coordinates `q`. The sweeps themselves do not look: where
    /// this fails, velocities and accelerations are infinite or not numbers.
    ///
    /// # Errors
    /// [`MassMatrixError::Singular`] for the first freedom, outboard first, without inertia.
    pub fn check_rank(&mut self, q: &[S]) -> Result<(), MassMatrixError> {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.factor(q, &inputs!(self), &mut self.work);
        let own = self.tree.nodes.iter().enumerate().rev().filter_map(|(i, node)| {
            match (node.source, node.elimination.unknown) {
                (Source::State { v, .. }, None) => Some((v, self.work.first[i]..self.work.first[i + 1])),
                _ => None,
            }
        });
        let own = own.flat_map(|(v, freedoms)| freedoms.enumerate().map(move |(k, f)| (v + k, f)));
        let own = own.map(|(v, f)| (v, self.work.factor.pivots[f].rho));
        let shared = self
            .tree
            .unknowns
            .iter()
            .zip(&self.work.factor.unknown_pivots)
            .filter_map(|(s, pivot)| Some((s.velocity()?, pivot.rho)));
        // A zero pivot spoils those inboard of it: it is the one to name.
        let mut found = None;
        for (velocity, rho) in own.chain(shared) {
            let inertia = 1.0 / rho.to_f64();
            if inertia.is_nan() {
                found = found.or(Some((velocity, inertia)));
            } else if !(rho.is_finite() && rho > S::zero()) {
                found = Some((velocity, inertia));
                break;
            }
        }
        let Some((velocity, inertia)) = found else { return Ok(()) };
        let name = self.names[0].get(velocity).cloned();
        Err(MassMatrixError::Singular { velocity, name, inertia })
    }
}
