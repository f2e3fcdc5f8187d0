//! Exact derivatives of the rates `(q, p, τ) → (v, ṗ)`, by sweeps over pairs of joints on one path.
//!
//! **Definition.** Column `k` of a derivative with respect to `q` is the derivative along `q̇ = N(q) e_k`, the
//! direction in which velocity `k` alone moves the coordinates: the ordinary partial derivative where coordinates are
//! angles and displacements, the derivative with respect to a small displacement in body axes (`q ⊕ ξ`) for planar,
//! spherical and floating joints. Rows are velocities and momentum rates. All blocks are `nv × nv`. `∂v/∂τ = 0` and
//! `∂ṗ/∂τ = 1`.
//!
//! **Method.** At given velocities let `B = ∂p/∂q`, `C = ∂ṗ/∂q`, both by spatial algebra: with `s` the axis of a
//! freedom, `ψ = Ω̂ × s`, `I*` the composite inertia, `P*` the momentum and `γ` gravity as a motion, and for every
//! freedom `a` the columns `F = I* s`, `φ = I* ψ + s × P*`, carried inward to each freedom `b` on its path,
//!
//! | | |
//! | --- | --- |
//! | `M_ab = s_b · F_a` | |
//! | `B_ab = ψ_b · F_a` | `a` outboard of `b` or on the same joint |
//! | `B_ba = s_b · φ_a` | `a` outboard of `b` |
//! | `C_ab = C_ba = ψ_b · φ_a + (γ × s_b) · F_a` | |
//!
//! (the pattern of Carpentier & Mansard 2018 and of Singh, Russell & Wensing 2022, here of the momentum form). With
//! `M = LᵀDL` and `Y = M⁻¹B`,
//!
//! ```text
//! ∂v/∂p = M⁻¹                   ∂v/∂q = −Y
//! ∂ṗ/∂p = Yᵀ + G M⁻¹ + ad(v)    ∂ṗ/∂q = C − BᵀY − G Y
//! ```
//!
//! At given velocities, without any solution, `∂p/∂v = M`, `∂p/∂q = B`, `∂ṗ/∂v = Bᵀ + G + ad(v) M`, `∂ṗ/∂q = C + ad(v)
//! B`. `BᵀY` is symmetric and formed by halves; `G` and `ad` are small blocks: damping on the diagonal of `G`, and
//! where velocities are not coordinate rates the commutators of the joint's own axes, `ad(v)_ab = (v × e_a)_b`, `G_ab =
//! (e_b × e_a) · π`. Without those, `∂ṗ/∂p = −(∂v/∂q)ᵀ`: the canonical symmetry.
//!
//! Mechanisms with loops and couplings take the same `B` and `C`, and solve with the matrix that the rates have factored
//! (`closed.rs`).

mod closed;
mod dense;
mod loop_path;
mod order;
mod pairs;
mod parameters;
mod room;
mod wrench;

pub use parameters::ParameterDerivatives;
pub use room::Derivatives;

use alloc::vec::Vec;

use super::{Inputs, Sweeps, Trace};
use crate::system::MomentumDerivatives;
use crate::tree::{Node, Source};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// The rates `v` and `ṗ` at `(q, p)`, and their derivatives. `d` has been made for this tree.
    pub fn derivatives(&self, q: &[S], p: &[S], u: &Inputs<S>, w: &mut Workspace<S>, d: &mut Derivatives<S>) {
        self.articulate(q, u.drive_q, &mut w.poses);
        d.begin();
        self.composite_columns(w, d);
        if !self.tree.constraints.is_empty() {
            return self.closed_derivatives(p, u, w, d);
        }
        self.factor_dense(d);
        self.momentum_of_drives(u, w, d);
        self.solve_dense(p, d);
        self.outward(u, w, d);
        self.joint_momenta(w, d);
        self.pair_products(p, u, w, d);
        self.wrench_products(u, w, d);
        self.springs(w, d);
        self.solve_columns(d);
        self.assemble(p, d);
    }

    /// Momenta and their rates at `(q, v)`, and their derivatives: no matrix is factored. `d`
    /// and `out` have been made for this tree.
    pub fn momentum_derivatives(
        &self,
        q: &[S],
        v: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        d: &mut Derivatives<S>,
        out: &mut MomentumDerivatives<Vec<S>, Vec<S>>,
    ) {
        self.articulate(q, u.drive_q, &mut w.poses);
        d.begin();
        self.composite_columns(w, d);
        self.momentum_of_drives(u, w, d);
        self.momentum_dense(v, d, &mut out.p);
        self.outward(u, w, d);
        self.joint_momenta(w, d);
        self.pair_products(&out.p, u, w, d);
        self.wrench_products(u, w, d);
        self.springs(w, d);
        out.pd.copy_from_slice(&d.pd);
        self.assemble_momentum(d, out);
    }
}

/// Whether the axis of a node is the same before and after its own motion. Its columns are then taken before it, where
/// they need not be rotated.
fn single<S: Scalar>(node: &Node<S>) -> bool {
    node.kind.nv() == 1
}

/// Index of the first velocity of a node, if it belongs to the state.
fn velocity<S: Scalar>(node: &Node<S>) -> Option<usize> {
    match node.source {
        Source::State { v, .. } => Some(v),
        Source::Drive { .. } => None,
    }
}
