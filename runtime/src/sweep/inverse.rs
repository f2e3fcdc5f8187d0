//! Inverse dynamics `(q, v, v̇) → τ`, bias forces, and the wrenches that joints transmit: Newton and Euler out, wrenches
//! back.

use super::newton::Accelerations;
use super::{Inputs, Quantity, Sweeps, Trace};
use crate::tree::Source;
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Joint forces `τ` that give the accelerations `a`: `(q, v, v̇) → τ = M v̇ + h`. The `τ` of the inputs is not read.
    pub fn inverse_dynamics(&self, q: &[S], v: &[S], a: &[S], u: &Inputs<S>, w: &mut Workspace<S>, tau: &mut [S]) {
        self.newton_euler(q, v, Accelerations::Given(a), u, w);
        self.joint_forces(Accelerations::Given(a), w, tau);
    }

    /// Bias forces: the joint forces that keep `v̇` zero, `(q, v) → h` with `M v̇ + h = τ`. What products of velocities,
    /// prescribed accelerations and gravity need, less what springs, dampers and external wrenches give.
    pub fn bias(&self, q: &[S], v: &[S], u: &Inputs<S>, w: &mut Workspace<S>, h: &mut [S]) {
        self.newton_euler(q, v, Accelerations::Zero, u, w);
        self.joint_forces(Accelerations::Zero, w, h);
    }

    /// Wrench `[force; moment]` that every joint transmits to its child, in the child's body frame, at accelerations `a`
    /// (4.66), on a tree that was not regrouped. The multipliers `λ` of constraints are those of the last
    /// [`Sweeps::accelerations`].
    pub fn reactions(&self, q: &[S], v: &[S], a: &[S], u: &Inputs<S>, w: &mut Workspace<S>, out: &mut [[S; 6]]) {
        self.place_rows(q, u, w, false);
        self.needed_wrenches(v, Accelerations::Given(a), u, w);
        self.add_seeds(w);
        self.wrenches_back(w);
        for (k, (&i, out)) in self.tree.joint_nodes.iter().zip(out).enumerate() {
            self.trace.at(Some(i), Quantity::Reaction);
            let f = self.on_body(&w.poses, &self.tree.frames[k]).fold(w.force[i], |f, step| step.force_back(&f));
            *out = core::array::from_fn(|c| f.get(c));
        }
    }

    /// Wrench on every node from its parent, in [`Workspace::force`].
    fn newton_euler(&self, q: &[S], v: &[S], a: Accelerations<S>, u: &Inputs<S>, w: &mut Workspace<S>) {
        self.articulate(q, u.drive_q, &mut w.poses);
        self.needed_wrenches(v, a, u, w);
        self.wrenches_back(w);
    }

    /// Wrench that every body needs beside the external ones.
    fn needed_wrenches(&self, v: &[S], a: Accelerations<S>, u: &Inputs<S>, w: &mut Workspace<S>) {
        self.newton(v, a, u, w);
        self.wrench_loads(u, w);
        self.newton_wrenches(w);
    }

    fn wrenches_back(&self, w: &mut Workspace<S>) {
        for i in (0..self.tree.nodes.len()).rev() {
            self.wrench_back_node(i, w);
        }
    }

    /// Adds the wrench on node `i`, those of its children being in it, to that of its parent.
    pub fn wrench_back_node(&self, i: usize, w: &mut Workspace<S>) {
        let Some(parent) = self.tree.nodes[i].parent else { return };
        self.trace.at(Some(i), Quantity::Load);
        let out = self.force_out(&w.poses, i, &w.force[i]);
        w.force[parent] = w.force[parent].plus(&out);
    }

    fn joint_forces(&self, a: Accelerations<S>, w: &Workspace<S>, tau: &mut [S]) {
        tau.fill(S::zero());
        for i in 0..self.tree.nodes.len() {
            self.joint_force_node(i, a, w, tau);
        }
    }

    /// `Eᵀ` of the wrench on node `i`, its rotors, less its passive forces; added to `tau`.
    pub fn joint_force_node(&self, i: usize, a: Accelerations<S>, w: &Workspace<S>, tau: &mut [S]) {
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
