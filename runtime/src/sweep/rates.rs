//! Momentum rates `ṗ` (4.36).

use super::pass::{each_node, visit_force, Sweep};
use super::{Quantity, Sweeps, Trace};
use crate::spatial::{ArticulatedInertia, Force, Motion};
use crate::tree::{each_freedom, for_component, Freedom, Kind, Node, Source};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// `P*` of the nodes whose momentum rates come from it.
    pub(super) const ACCUMULATED_MOMENTA: Self = Sweep {
        needed: |tree| !T::PLAIN && tree.nodes.iter().any(|node| node.elimination.accumulates_momentum),
        begin: |cx| cx.sweeps.accumulate_begin(cx.w),
        carried: |cx, i, visit| {
            if cx.sweeps.elimination(i).accumulates_momentum {
                visit_force(&mut cx.w.force[i], visit);
            }
        },
        ..each_node!(TipToBase, |cx, i| cx.sweeps.accumulate_node(i, cx.given.second, cx.w))
    };

    /// `ṗ_i = E_iᵀ (T*_i − Ω_i × P*_i)` (4.36), to which `τ_i` comes at the end.
    pub(super) const MOMENTUM_RATES: Self = Sweep {
        begin: |cx| cx.results.p.fill(S::zero()),
        ..each_node!(BaseToTip, |cx, i| cx.sweeps.momentum_rate_node(i, cx.w, cx.results.p))
    };
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// `P*` of the nodes whose momentum rates come from it, in the frames they are eliminated in. Its component along a
    /// node's own axis is known: `EᵀP* = p − armature · rate`, less what couplings hold of `p`.
    fn accumulate_begin(&self, w: &mut Workspace<S>) {
        for i in (0..self.tree.nodes.len()).filter(|&i| self.elimination(i).accumulates_momentum) {
            self.trace.at(Some(i), Quantity::Momentum);
            w.force[i] = self.inertia(&w.poses, i).momentum(&w.velocity.omega[i]);
        }
        self.add_seeds(w);
    }

    /// `P*` of node `i` added to that of its parent, after its children.
    fn accumulate_node(&self, i: usize, p: &[S], w: &mut Workspace<S>) {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Momentum);
        let accumulates = self.elimination(i).accumulates_momentum;
        let mut total = w.force[i];
        if accumulates {
            total = self.leaving(&w.poses, i).force(total);
            w.force[i] = total;
        }
        let Some(parent) = node.parent.filter(|&p| self.elimination(p).accumulates_momentum) else { return };
        if !accumulates {
            let (motion, d) = self.acting(&w.first, &w.factor, &w.velocity, i);
            total = w.factor.m[i].times(&motion).plus(&d);
        }
        if let (Freedom::Unit(z), 1, Source::State { v, .. }) = (node.kind.axis(0), node.kind.nv(), node.source) {
            if self.elimination(i).unknown.is_none() || self.elimination(i).deferred {
                let rotor = node.passive[0].armature * w.velocity.rate[w.first[i]];
                let along = p[v] - rotor - self.coupled_momentum(i, &w.constraints.multipliers);
                for_component!(z, |z| *total.get_mut(z) = along);
            }
        }
        let out = self.entering(&w.poses, i).force(total);
        w.force[parent] = w.force[parent].plus(&out);
    }

    /// `ṗ_i` (4.36) without `τ`, added to `pd`. `P*` is `M'Ω̂ + D'`, and for a single freedom only a quadratic form of
    /// it is needed.
    #[inline(always)]
    fn momentum_rate_node(&self, i: usize, w: &Workspace<S>, pd: &mut [S]) {
        let node = &self.tree.nodes[i];
        let Source::State { v, .. } = node.source else { return };
        self.trace.at(Some(i), Quantity::MomentumRate);
        if self.elimination(i).accumulates_momentum {
            let mut motion = w.velocity.hat[i];
            each_freedom!(node.kind, |_k, axis| {
                axis.add_to(&mut motion, w.velocity.rate[w.first[i]]);
                let sum = self.applied(w, i, &axis) - axis.dot(&motion.cross_force(&w.force[i]));
                pd[v] = pd[v] + node.ratio * (sum + self.passive(node, w, i, 0));
            });
            return;
        }
        let m = &w.factor.m[i];
        let acting;
        let (hat, d) = match self.has_unknowns() && (self.elimination(i).deferred || self.has_open(i)) {
            true => {
                acting = self.acting(&w.first, &w.factor, &w.velocity, i);
                (&acting.0, &acting.1)
            }
            false => (&w.velocity.hat[i], &w.velocity.d[i]),
        };
        let gyro = match node.kind {
            Kind::Revolute => gyro_turn(m, hat, d),
            Kind::Prismatic => gyro_slide(m, hat, d),
            Kind::Helical { pitch } => gyro_turn(m, hat, d) + pitch * gyro_slide(m, hat, d),
            Kind::Planar | Kind::Spherical | Kind::Floating => {
                let force = w.velocity.omega[i].cross_force(&m.times(hat).plus(d));
                for k in 0..node.kind.nv() {
                    let axis = node.kind.axis(k);
                    let sum = self.applied(w, i, &axis) - axis.dot(&force);
                    pd[v + k] = sum + self.passive(node, w, i, k);
                }
                return;
            }
        };
        let sum = self.applied(w, i, &node.kind.axis(0)) - gyro;
        pd[v] = pd[v] + node.ratio * (sum + self.passive(node, w, i, 0));
    }

    /// `Eᵀ T*`: gravity and external wrenches.
    #[inline(always)]
    pub(super) fn applied(&self, w: &Workspace<S>, i: usize, axis: &Freedom<S>) -> S {
        let weight = axis.dot(&self.weight(w, i));
        if T::PLAIN || self.tree.wrenches.is_empty() {
            return weight;
        }
        weight + axis.dot(&w.loads.total[i])
    }

    /// Damping and spring on freedom `k` of node `i`.
    #[inline(always)]
    pub(super) fn passive(&self, node: &Node<S>, w: &Workspace<S>, i: usize, k: usize) -> S {
        let passive = &node.passive[k];
        let damper = -(passive.damping * w.velocity.rate[w.first[i] + k]);
        let pull = |k: usize| node.passive[k].stiffness * (w.poses.coordinate(i, k) - node.passive[k].rest);
        match node.kind {
            Kind::Spherical | Kind::Floating => damper,
            // The springs of a planar joint act in the parent's axes.
            Kind::Planar if k < 2 => damper - w.poses.steps.own(i)[2].vector([pull(0), pull(1), S::zero()])[k],
            _ => damper - pull(k),
        }
    }
}

/// `z`-moment of `Ω × (M'Ω̂ + D')` with the products that cancel left out; `ω_z` does not enter, so `Ω̂` serves for
/// `Ω`. The differences `Axx − Ayy` and the like are those the rotation of `M'` forms.
fn gyro_turn<S: Scalar>(m: &ArticulatedInertia<S>, w: &Motion<S>, d: &Force<S>) -> S {
    let ([vx, vy, vz], [wx, wy, wz]) = (w.lin, w.ang);
    let (a, h, j) = (&m.a, &m.h, &m.j);
    let (da, dh, dj) = (a[0] - a[3], h[0][0] - h[1][1], j[0] - j[3]);
    let s = h[0][1] + h[1][0];
    let ly = a[1] * vx - da * vy + s * wx - dh * wy + a[4] * vz + h[2][1] * wz + d.lin[1];
    let lx = a[1] * vy + s * wy + dh * wx + a[2] * vz + h[2][0] * wz + d.lin[0];
    let ay = j[1] * wx - dj * wy + h[1][2] * vz + j[4] * wz + d.ang[1];
    let ax = j[1] * wy + h[0][2] * vz + j[2] * wz + d.ang[0];
    vx * ly - vy * lx + wx * ay - wy * ax
}

/// `z`-force of `Ω × (M'Ω̂ + D')`; `v_z` does not enter.
fn gyro_slide<S: Scalar>(m: &ArticulatedInertia<S>, w: &Motion<S>, d: &Force<S>) -> S {
    let ([vx, vy, vz], [wx, wy, wz]) = (w.lin, w.ang);
    let (a, h) = (&m.a, &m.h);
    let dh = h[0][0] - h[1][1];
    let ly = a[1] * vx + a[3] * vy + a[4] * vz + h[0][1] * wx - dh * wy + h[2][1] * wz + d.lin[1];
    let lx = a[0] * vx + a[1] * vy + a[2] * vz + h[1][0] * wy + h[2][0] * wz + d.lin[0];
    wx * ly - wy * lx
}
