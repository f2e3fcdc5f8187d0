//! Inverse dynamics `(q, v, v̇) → τ`, bias forces, and the wrenches that joints transmit: what the bodies need for
//! their motion (`newton.rs`), summed from tip to base.

use super::newton::Accelerations;
use super::pass::{each_node, visit_force, Sweep};
use super::{Quantity, Sweeps, Trace};
use crate::lists::array;
use crate::tree::Source;
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// Wrench on every node from its parent, in [`Workspace::force`].
    pub(super) const TRANSMITTED: Self = Sweep {
        carried: |cx, i, visit| visit_force(&mut cx.w.force[i], visit),
        ..each_node!(TipToBase, |cx, i| cx.sweeps.transmitted_wrench_node(i, cx.w))
    };

    /// The same with the wrenches of the constraints, whose multipliers `λ` are known.
    pub(super) const TRANSMITTED_WITH_CONSTRAINTS: Self =
        Sweep { begin: |cx| cx.sweeps.add_seeds(cx.w), ..Self::TRANSMITTED };
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Adds the wrench on node `i`, which has those of its children in it, to that of its parent.
    fn transmitted_wrench_node(&self, i: usize, w: &mut Workspace<S>) {
        let Some(parent) = self.tree.nodes[i].parent else { return };
        self.trace.at(Some(i), Quantity::Load);
        let out = self.steps(&w.poses, i).force(w.force[i]);
        w.force[parent] = w.force[parent].plus(&out);
    }

    /// Joint forces out of the wrenches that the joints transmit.
    pub(super) fn joint_forces(&self, a: Accelerations<S>, w: &Workspace<S>, tau: &mut [S]) {
        tau.fill(S::zero());
        (0..self.tree.nodes.len()).for_each(|i| self.joint_force_node(i, a, w, tau));
    }

    /// Wrench `[force; moment]` that every joint transmits to its child, in the child's body frame (4.66).
    pub(super) fn collect_reactions(&self, w: &Workspace<S>, out: &mut [[S; 6]]) {
        for (k, (&i, out)) in self.tree.joint_nodes.iter().zip(out).enumerate() {
            self.trace.at(Some(i), Quantity::Reaction);
            let f = self.on_body(&w.poses, &self.tree.frames[k]).fold(w.force[i], |f, step| step.force_back(&f));
            *out = array(|c| f.get(c));
        }
    }

    /// `Eᵀ` of the wrench on node `i`, its rotors, less its passive forces; added to `tau`.
    fn joint_force_node(&self, i: usize, a: Accelerations<S>, w: &Workspace<S>, tau: &mut [S]) {
        let node = &self.tree.nodes[i];
        let Source::State { v, .. } = node.source else { return };
        self.trace.at(Some(i), Quantity::Effort);
        for k in 0..node.kind.nv() {
            let mut along = node.kind.axis(k).dot(&w.force[i]) - self.passive(node, w, i, k);
            if let Accelerations::Given(a) = a {
                along = along + node.passive[k].armature * (node.ratio * a[v + k]);
            }
            tau[v + k] = tau[v + k] + node.ratio * along;
        }
    }
}
