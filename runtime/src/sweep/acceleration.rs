//! Accelerations `(q, v, τ) → v̇`.
//!
//! The bodies' wrenches for a reference motion without the accelerations that are sought are the seeds of the linear
//! problem; its solution is what comes on top. Nothing is imposed on the way: products of velocities, prescribed
//! accelerations and gravity are all in the reference.

use super::newton::Accelerations;
use super::solve::Load;
use super::{Inputs, Quantity, Sweeps, Trace};
use crate::tree::Source;
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Accelerations from velocities: `(q, v, τ) → v̇`.
    pub fn accelerations(&self, q: &[S], v: &[S], u: &Inputs<S>, w: &mut Workspace<S>, a: &mut [S]) {
        self.prepare(q, u, w, true);
        self.newton(v, Accelerations::Chosen, u, w);
        self.row_accelerations(v, u, w);
        self.wrench_loads(u, w);
        self.newton_wrenches(w);
        w.generalized.fill(S::zero());
        for i in 0..self.tree.nodes.len() {
            self.joint_load_node(i, w);
        }
        for (f, tau) in w.generalized.iter_mut().zip(u.tau) {
            *f = *f + *tau;
        }
        w.drive.fill(S::zero());
        let load = Load::accelerations(&w.generalized, &w.drive, &w.force, &w.constraints.rhs);
        self.solve(&w.poses, &w.first, &w.factor, &load, &mut w.acceleration);
        self.collect_rates(&w.acceleration, &w.first, a);
        self.collect_multipliers(&w.acceleration.unknown_rate, &mut w.constraints.multipliers);
        for i in 0..self.tree.nodes.len() {
            self.add_reference_node(i, w, a);
        }
    }

    /// Passive forces of node `i` and what its rotors need for the reference accelerations, added to
    /// [`Workspace::generalized`].
    pub fn joint_load_node(&self, i: usize, w: &mut Workspace<S>) {
        let node = &self.tree.nodes[i];
        let Source::State { v, .. } = node.source else { return };
        self.trace.at(Some(i), Quantity::Load);
        for k in 0..node.kind.nv() {
            let rotor = node.passive[k].armature * w.newton.reference[w.first[i] + k];
            w.generalized[v + k] = w.generalized[v + k] + node.ratio * (self.passive(node, w, i, k) - rotor);
        }
    }

    /// Adds the reference accelerations of node `i` to the solution.
    pub fn add_reference_node(&self, i: usize, w: &Workspace<S>, a: &mut [S]) {
        let node = &self.tree.nodes[i];
        let Source::State { v, .. } = node.source else { return };
        self.trace.at(Some(i), Quantity::Acceleration);
        for k in 0..node.kind.nv() {
            a[v + k] = a[v + k] + w.newton.reference[w.first[i] + k];
        }
    }
}
