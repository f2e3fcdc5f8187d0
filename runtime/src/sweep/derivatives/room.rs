//! Results of the derivatives, and memory for their intermediate results.

use alloc::vec;
use alloc::vec::Vec;

use super::closed::Closed;
use super::order::Order;
use crate::spatial::{Force, Motion, RigidInertia, Vec3};
use crate::system::MomentumDerivatives;
use crate::tree::Tree;
use crate::Scalar;

/// Subtrees with at most this many freedoms have their momentum summed over their columns, larger ones carry it inward:
/// the counts of general chains cross here.
const SUMMED: usize = 8;

/// Derivatives of the rates, `nv × nv` each, row by row, and all that is needed to compute them. Memory grows with the
/// square of the number of joints; nothing is allocated after construction.
#[derive(Clone, Debug)]
pub struct Derivatives<S> {
    /// Velocities at `(q, p)`.
    pub v: Vec<S>,
    /// Momentum rates.
    pub pd: Vec<S>,
    /// `∂v/∂q`.
    pub dv_dq: Vec<S>,
    /// `∂v/∂p`, symmetric: the inverse of the mass matrix, of the constrained one where there are constraints.
    pub dv_dp: Vec<S>,
    /// `∂ṗ/∂q`.
    pub dpd_dq: Vec<S>,
    /// `∂ṗ/∂p`.
    pub dpd_dp: Vec<S>,
    /// `M`, then `L` below its diagonal.
    pub(super) l: Vec<S>,
    /// `1 / D`.
    pub(super) rho: Vec<S>,
    /// `B = ∂p/∂q` at given velocities, then `L⁻ᵀB`.
    pub(super) b: Vec<S>,
    /// `D⁻¹L⁻ᵀB`.
    pub(super) scaled: Vec<S>,
    /// One number for each velocity.
    pub(super) list: Vec<S>,
    /// Which velocities are coupled, and how.
    pub(super) order: Order,
    /// Coefficients that carry rows from the common path to a branch.
    pub(super) across: Vec<S>,
    /// Whether the momentum of the node is summed over the columns of its subtree.
    pub(super) summed: Vec<bool>,
    /// Composite inertia `I*` of every node, in the frame its columns are taken in.
    pub(super) inertia: Vec<RigidInertia<S>>,
    /// `F` of freedom `f` at node `i`, at `f · nodes + i`.
    pub(super) columns: Vec<Force<S>>,
    /// `Ω̂`, in the frame of the columns.
    pub(super) hat: Vec<Motion<S>>,
    /// `Ω`, in the node frame.
    pub(super) omega: Vec<Motion<S>>,
    /// Gravity in the axes of the columns, and in those of the node.
    pub(super) gravity: Vec<[Vec3<S>; 2]>,
    /// `P* − I*Ω̂` of small subtrees, `P*` of others, in the frame of the columns.
    pub(super) rest: Vec<Force<S>>,
    /// Rate of every freedom.
    pub(super) rate: Vec<S>,
    /// `ψ = Ω̂ × s` of every freedom.
    pub(super) psi: Vec<Motion<S>>,
    /// Linear part of `γ × s` of every freedom.
    pub(super) fall: Vec<Vec3<S>>,
    /// What only mechanisms with constraints have.
    pub(super) closed: Closed<S>,
}

impl<S: Scalar> MomentumDerivatives<Vec<S>, Vec<S>> {
    /// Allocates memory for a tree; nothing is allocated later.
    pub fn new(tree: &Tree<S>) -> Self {
        let (o, nv) = (S::zero(), tree.dims.nv);
        let (list, square) = (|| vec![o; nv], || vec![o; nv * nv]);
        MomentumDerivatives {
            p: list(),
            pd: list(),
            dp_dq: square(),
            dp_dv: square(),
            dpd_dq: square(),
            dpd_dv: square(),
        }
    }
}

impl<S: Scalar> Derivatives<S> {
    /// Allocates memory for a tree; nothing is allocated later.
    pub fn new(tree: &Tree<S>) -> Self {
        let (nodes, nv) = (tree.nodes.len(), tree.dims.nv);
        let freedoms = tree.nodes.iter().map(|n| n.kind.nv()).sum::<usize>();
        let order = Order::new(tree);
        let o = S::zero();
        let square = || vec![o; nv * nv];
        Derivatives {
            v: vec![o; nv],
            pd: vec![o; nv],
            dv_dq: square(),
            dv_dp: square(),
            dpd_dq: square(),
            dpd_dp: square(),
            l: square(),
            rho: vec![o; nv],
            b: square(),
            scaled: square(),
            list: vec![o; nv],
            across: vec![o; order.coefficients],
            order,
            summed: outboard(tree).iter().map(|n| *n <= SUMMED).collect(),
            inertia: vec![RigidInertia::zero(); nodes],
            columns: vec![Force::zero(); freedoms * nodes],
            hat: vec![Motion::zero(); nodes],
            omega: vec![Motion::zero(); nodes],
            gravity: vec![[[o; 3]; 2]; nodes],
            rest: vec![Force::zero(); nodes],
            rate: vec![o; freedoms],
            psi: vec![Motion::zero(); freedoms],
            fall: vec![[o; 3]; freedoms],
            closed: Closed::new(tree),
        }
    }

    /// Sets all sums to zero.
    pub(super) fn begin(&mut self) {
        let o = S::zero();
        for list in [&mut self.l, &mut self.b, &mut self.pd, &mut self.dpd_dq] {
            list.fill(o);
        }
        self.rest.fill(Force::zero());
        self.closed.begin();
    }
}

/// Freedoms of every subtree.
fn outboard<S: Scalar>(tree: &Tree<S>) -> Vec<usize> {
    let mut count: Vec<usize> = tree.nodes.iter().map(|n| n.kind.nv()).collect();
    for i in (0..count.len()).rev() {
        if let Some(p) = tree.nodes[i].parent {
            count[p] += count[i];
        }
    }
    count
}
