//! Accelerations `(q, v, τ) → v̇`.
//!
//! A reference motion has the given velocities and any accelerations. The wrenches that the bodies need for it are the
//! right-hand side of the linear problem, whose solution is added to the accelerations of the reference. Products of
//! velocities, prescribed accelerations and gravity are all in the reference, so the linear problem has none of them.

use super::pass::{each_node, Sweep};
use super::{Quantity, Sweeps, Trace};
use crate::tree::Source;
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// Joint forces of the linear problem, but for `τ`.
    pub(super) const JOINT_LOADS: Self = Sweep {
        begin: |cx| cx.w.generalized.fill(S::zero()),
        ..each_node!(BaseToTip, |cx, i| cx.sweeps.joint_load_node(i, cx.w))
    };

    /// The reference accelerations added to the solution.
    pub(super) const ADD_REFERENCE: Self =
        each_node!(BaseToTip, |cx, i| cx.sweeps.add_reference_node(i, cx.w, cx.results.v));
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Passive forces of node `i` and what its rotors need for the reference accelerations, added to
    /// [`Workspace::generalized`].
    fn joint_load_node(&self, i: usize, w: &mut Workspace<S>) {
        let node = &self.tree.nodes[i];
        let Source::State { v, .. } = node.source else { return };
        self.trace.at(Some(i), Quantity::Load);
        for k in 0..node.kind.nv() {
            let rotor = node.passive[k].armature * w.newton.reference[w.first[i] + k];
            w.generalized[v + k] = w.generalized[v + k] + node.ratio * (self.passive(node, w, i, k) - rotor);
        }
    }

    /// Adds the reference accelerations of node `i` to the solution.
    fn add_reference_node(&self, i: usize, w: &Workspace<S>, a: &mut [S]) {
        let node = &self.tree.nodes[i];
        let Source::State { v, .. } = node.source else { return };
        self.trace.at(Some(i), Quantity::Acceleration);
        for k in 0..node.kind.nv() {
            a[v + k] = a[v + k] + w.newton.reference[w.first[i] + k];
        }
    }
}
