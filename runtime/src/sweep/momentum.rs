//! Momenta from velocities, and kinetic energy.

use super::pass::{each_node, visit_force, Sweep};
use super::{name, Quantity, Sweeps, Trace};
use crate::tree::{Source, Unknown};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// `P*_i = M_i Ω_i + Σ Xᵀ P*_c`, and `p = EᵀP*` with the rotors.
    pub(super) const MOMENTUM: Self = Sweep {
        begin: |cx| {
            cx.results.p.fill(S::zero());
            cx.sweeps.momentum_begin(cx.w);
        },
        carried: |cx, i, visit| visit_force(&mut cx.w.force[i], visit),
        ..each_node!(TipToBase, |cx, i| cx.sweeps.momentum_node(i, cx.w, cx.results.p))
    };

    /// `T = ½ pᵀq̇`, prescribed freedoms with the momentum their joints carry.
    pub(super) const KINETIC: Self = Sweep {
        begin: |cx| cx.results.energy[0] = S::zero(),
        end: |cx| cx.results.energy[0] = cx.sweeps.kinetic_end(cx.given.second, cx.w, cx.results.energy[0]),
        running: |cx, visit| visit(&mut cx.results.energy[0]),
        ..each_node!(BaseToTip, |cx, i| cx.results.energy[0] =
            cx.sweeps.kinetic_node(i, cx.given.second, cx.w, cx.results.energy[0]))
    };
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Before the first [`Sweeps::momentum_node`]: `M_i Ω_i` of every body by itself.
    fn momentum_begin(&self, w: &mut Workspace<S>) {
        for i in 0..self.tree.nodes.len() {
            self.trace.at(Some(i), Quantity::Momentum);
            w.force[i] = self.inertia(&w.poses, i).momentum(&w.velocity.omega[i]);
        }
    }

    /// `p` of node `i` (added to `p`) and `P*` carried to its parent, after its children.
    fn momentum_node(&self, i: usize, w: &mut Workspace<S>, p: &mut [S]) {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Momentum);
        let total = w.force[i];
        name::force(self.trace, "p", &total);
        if let Source::State { v, .. } = node.source {
            for (k, passive) in node.passive.iter().enumerate() {
                let along = node.kind.axis(k).dot(&total) + passive.armature * w.velocity.rate[w.first[i] + k];
                p[v + k] = p[v + k] + node.ratio * along;
            }
        }
        if let Some(parent) = node.parent {
            let out = self.steps(&w.poses, i).force(total);
            w.force[parent] = w.force[parent].plus(&out);
        }
    }

    /// Kinetic energy from twice the sum of all nodes: shared coordinates, and the half.
    fn kinetic_end(&self, p: &[S], w: &Workspace<S>, mut twice: S) -> S {
        for (g, shared) in self.tree.unknowns.iter().enumerate() {
            twice = match *shared {
                Unknown::Velocity(v) => twice + p[v] * w.velocity.unknown_rate[g],
                // Of p⁺ᵀv the part σᵀΦv is no energy.
                Unknown::Row(r) => {
                    let sigma = w.velocity.unknown_rate[g];
                    twice - (w.constraints.rhs[r] + self.compliance(r) * sigma) * sigma
                }
            };
        }
        S::constant(0.5) * twice
    }

    /// Twice the kinetic energy with the share of node `i` added.
    fn kinetic_node(&self, i: usize, p: &[S], w: &Workspace<S>, mut twice: S) -> S {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Energy);
        let rate = |k: usize| w.velocity.rate[w.first[i] + k];
        match node.source {
            Source::State { v, .. } if node.elimination.unknown.is_none() => {
                for k in 0..node.kind.nv() {
                    twice = twice + p[v + k] * rate(k);
                }
            }
            Source::State { .. } => {}
            Source::Drive { .. } => {
                let momentum = self.transmitted(&w.poses, &w.first, &w.factor, &w.velocity, i);
                for (k, passive) in node.passive.iter().enumerate() {
                    let along = node.kind.axis(k).dot(&momentum) + passive.armature * rate(k);
                    twice = twice + along * rate(k);
                }
            }
        }
        twice
    }
}
