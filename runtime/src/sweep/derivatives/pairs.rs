//! Columns of every freedom, carried inward and met by every freedom on the way.

use super::{single, velocity, Derivatives};
use crate::spatial::{cross, dot3, ElementaryTransform, Force, Motion, RigidInertia, Vec3};
use crate::sweep::{Inputs, Quantity, Sweeps, Trace};
use crate::tree::{Freedom, Kind, Node, Source};
use crate::workspace::{Poses, Workspace};
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Steps from the parent's node frame to the frame that the columns of node `i` are taken in.
    fn to_columns<'b>(&self, poses: &'b Poses<S>, i: usize) -> core::slice::Iter<'b, ElementaryTransform<S>> {
        let single = single(&self.tree.nodes[i]);
        if single { poses.steps.placing(i) } else { poses.steps.all(i) }.iter()
    }

    /// Steps from there to the node frame.
    pub(super) fn past_columns<'b>(&'b self, poses: &'b Poses<S>, i: usize) -> &'b [ElementaryTransform<S>] {
        match single(&self.tree.nodes[i]) {
            true => poses.steps.own(i),
            false => &[],
        }
    }

    /// Wrench at the columns' frame of node `i`, at the columns' frame of its parent.
    pub(super) fn force_inward(&self, poses: &Poses<S>, i: usize, f: &Force<S>) -> Force<S> {
        let f = self.to_columns(poses, i).rev().fold(*f, |f, step| step.force(&f));
        let parent = self.tree.nodes[i].parent;
        let steps = parent.map_or(&[][..], |p| self.past_columns(poses, p));
        steps.iter().rev().fold(f, |f, step| step.force(&f))
    }

    /// `I*`, the columns `F` at every node on their path, and `M`.
    pub(super) fn composite_columns(&self, w: &Workspace<S>, d: &mut Derivatives<S>) {
        for i in 0..self.tree.nodes.len() {
            d.inertia[i] = *self.inertia(&w.poses, i);
        }
        for i in (0..self.tree.nodes.len()).rev() {
            let node = &self.tree.nodes[i];
            self.trace.at(Some(i), Quantity::Inertia);
            let steps = self.past_columns(&w.poses, i).iter();
            let own = steps.rev().fold(d.inertia[i], |m, step| inertia_out(step, &m));
            d.inertia[i] = own;
            if let Some(p) = node.parent {
                let carried = self.to_columns(&w.poses, i).rev().fold(own, |m, step| inertia_out(step, &m));
                d.inertia[p] = d.inertia[p].plus(&carried);
            }
            self.trace.at(Some(i), Quantity::MassMatrix);
            for k in 0..node.kind.nv() {
                self.column(i, k, w, d);
            }
        }
    }

    /// `F` of freedom `k` of node `i` all the way, with its row of `M`.
    fn column(&self, i: usize, k: usize, w: &Workspace<S>, d: &mut Derivatives<S>) {
        let (n, nv) = (self.tree.nodes.len(), self.tree.dims.nv);
        let node = &self.tree.nodes[i];
        let mut f = d.inertia[i].momentum(&node.kind.axis(k).motion(S::one()));
        let mut at = i;
        loop {
            d.columns[(w.first[i] + k) * n + at] = f;
            let here = &self.tree.nodes[at];
            if let (Some(a), Some(b)) = (velocity(node), velocity(here)) {
                let (a, last) = (a + k, if at == i { k + 1 } else { here.kind.nv() });
                for l in 0..last {
                    let x = node.ratio * here.ratio * here.kind.axis(l).dot(&f);
                    let b = b + l;
                    let entry = &mut d.l[a.max(b) * nv + a.min(b)];
                    *entry = *entry
                        + match (at == i, a == b) {
                            (true, true) => x + node.ratio * node.ratio * node.passive[k].armature,
                            (false, true) => x + x, // two joints of one coordinate
                            _ => x,
                        };
                }
            }
            let Some(p) = here.parent else { return };
            f = self.force_inward(&w.poses, at, &f);
            at = p;
        }
    }

    /// Momenta of the prescribed rates alone, into `list`.
    pub(super) fn momentum_of_drives(&self, u: &Inputs<S>, w: &mut Workspace<S>, d: &mut Derivatives<S>) {
        d.list.fill(S::zero());
        if u.drive_v.is_empty() {
            return;
        }
        d.v.fill(S::zero());
        self.momentum_sweeps(&d.v, u, w, &mut d.list);
    }

    /// `Ω̂`, `Ω`, gravity, and `ψ` and `γ × s` of every freedom, base to leaves.
    pub(super) fn outward(&self, u: &Inputs<S>, w: &mut Workspace<S>, d: &mut Derivatives<S>) {
        for (i, node) in self.tree.nodes.iter().enumerate() {
            self.trace.at(Some(i), Quantity::Velocity);
            let mut hat = node.parent.map_or(Motion::zero(), |p| d.omega[p]);
            let mut g = node.parent.map_or(u.gravity, |p| d.gravity[p][1]);
            for step in self.to_columns(&w.poses, i) {
                hat = step.motion(&hat);
                g = step.vector(g);
            }
            let mut omega = hat;
            for k in 0..node.kind.nv() {
                let freedom = w.first[i] + k;
                let rate = match node.source {
                    Source::State { v, .. } => node.ratio * d.v[v + k],
                    Source::Drive { v, .. } => node.ratio * u.drive_v[v + k],
                };
                let axis = node.kind.axis(k);
                axis.add_to(&mut omega, rate);
                d.rate[freedom] = rate;
                w.velocity.rate[freedom] = rate;
                let s = axis.motion(S::one());
                d.psi[freedom] = hat.cross_motion(&s);
                d.fall[freedom] = cross(g, s.ang);
            }
            d.hat[i] = hat;
            let own = self.past_columns(&w.poses, i).iter();
            d.omega[i] = own.clone().fold(omega, |m, step| step.motion(&m));
            d.gravity[i] = [g, own.fold(g, |g, step| step.vector(g))];
        }
    }

    /// `P* − I*Ω̂` of nodes with small subtrees, summed over their columns; `P*` of the others, carried inward.
    pub(super) fn joint_momenta(&self, w: &Workspace<S>, d: &mut Derivatives<S>) {
        let n = self.tree.nodes.len();
        for i in (0..n).rev() {
            let node = &self.tree.nodes[i];
            self.trace.at(Some(i), Quantity::Momentum);
            if d.summed[i] {
                for freedom in w.first[i]..w.first[i + 1] {
                    let path = core::iter::successors(Some(i), |&j| self.tree.nodes[j].parent);
                    for j in path.take_while(|&j| d.summed[j]) {
                        d.rest[j] = d.rest[j].plus(&d.columns[freedom * n + j].times(d.rate[freedom]));
                    }
                }
            } else {
                // The momenta of the children have arrived, in the node frame.
                let all = self.inertia(&w.poses, i).momentum(&d.omega[i]).plus(&d.rest[i]);
                d.rest[i] = self.past_columns(&w.poses, i).iter().rev().fold(all, |f, step| step.force(&f));
            }
            let Some(p) = node.parent.filter(|&p| !d.summed[p]) else { continue };
            let all = self.momentum_at(i, d);
            let all = self.to_columns(&w.poses, i).rev().fold(all, |f, step| step.force(&f));
            d.rest[p] = d.rest[p].plus(&all);
        }
    }

    /// `P*` of a node in the frame of its columns.
    fn momentum_at(&self, i: usize, d: &Derivatives<S>) -> Force<S> {
        match d.summed[i] {
            true => d.inertia[i].momentum(&d.hat[i]).plus(&d.rest[i]),
            false => d.rest[i],
        }
    }

    /// `ṗ`, and `φ` of every freedom carried inward; with it and `F`, all of `B` and `C`.
    pub(super) fn pair_products(&self, p: &[S], u: &Inputs<S>, w: &Workspace<S>, d: &mut Derivatives<S>) {
        for (i, node) in self.tree.nodes.iter().enumerate().rev() {
            let Some(a) = velocity(node) else { continue };
            self.trace.at(Some(i), Quantity::Derivative);
            for k in 0..node.kind.nv() {
                let (phi, swing) = self.phi(i, k, w, d);
                self.meet(i, k, a + k, phi, w, d);
                self.trace.at(Some(i), Quantity::MomentumRate);
                let f = d.columns[(w.first[i] + k) * self.tree.nodes.len() + i];
                let weight = dot3(f.lin, d.gravity[i][0]);
                let sum = weight + swing + self.own_swing(i, k, p, d) + self.passive(node, w, i, k);
                add(&mut d.pd[a + k], node.ratio * sum);
                self.trace.at(Some(i), Quantity::Derivative);
            }
        }
        for (pd, tau) in d.pd.iter_mut().zip(u.tau) {
            *pd = *pd + *tau;
        }
    }

    /// `φ = I* ψ + s × P*` of freedom `k` of node `i`, and `ψ · P*`, its share of `ṗ`.
    fn phi(&self, i: usize, k: usize, w: &Workspace<S>, d: &Derivatives<S>) -> (Force<S>, S) {
        let node = &self.tree.nodes[i];
        let s = node.kind.axis(k).motion(S::one());
        let psi = &d.psi[w.first[i] + k];
        if matches!(node.kind, Kind::Revolute) && d.summed[i] {
            let turned = turned_momentum(&d.inertia[i], &d.hat[i]);
            let swing = S::constant(0.5) * turned.dot(&d.hat[i]) + d.rest[i].dot(psi);
            return (turned.plus(&s.cross_force(&d.rest[i])), swing);
        }
        let all = self.momentum_at(i, d);
        (d.inertia[i].momentum(psi).plus(&s.cross_force(&all)), all.dot(psi))
    }

    /// What the joint's own velocity adds to `ṗ` of freedom `k` where it has several: `(v × e_k) · π`.
    fn own_swing(&self, i: usize, k: usize, p: &[S], d: &Derivatives<S>) -> S {
        let node = &self.tree.nodes[i];
        let Some(v) = velocity(node).filter(|_| !single(node)) else { return S::zero() };
        let own = own_motion(node, &d.v[v..]);
        let momentum = |c: usize| p[v + c] - node.passive[c].armature * d.v[v + c];
        let n = node.kind.nv();
        (0..n).fold(S::zero(), |sum, c| sum + bracket(&node.kind, &own, k, c) * momentum(c))
    }

    /// Carries `φ` of freedom `k` of node `i`, velocity `a`, inward, and adds its products.
    fn meet(&self, i: usize, k: usize, a: usize, mut phi: Force<S>, w: &Workspace<S>, d: &mut Derivatives<S>) {
        let (n, nv) = (self.tree.nodes.len(), self.tree.dims.nv);
        let ratio = self.tree.nodes[i].ratio;
        let mut at = i;
        loop {
            let here = &self.tree.nodes[at];
            let f = d.columns[(w.first[i] + k) * n + at];
            if let Some(b) = velocity(here) {
                for l in 0..here.kind.nv() {
                    let (psi, fall, b) = (d.psi[w.first[at] + l], d.fall[w.first[at] + l], b + l);
                    let both = ratio * here.ratio;
                    let weight = dot3(fall, f.lin);
                    let c = both * (phi.dot(&psi) + weight);
                    add(&mut d.b[a * nv + b], both * f.dot(&psi));
                    add(&mut d.dpd_dq[a * nv + b], c);
                    if at != i {
                        add(&mut d.b[b * nv + a], both * here.kind.axis(l).dot(&phi));
                        add(&mut d.dpd_dq[b * nv + a], c);
                    }
                }
            }
            let Some(p) = here.parent else { return };
            phi = self.force_inward(&w.poses, at, &phi);
            at = p;
        }
    }

    /// Stiffness of the springs, into `∂ṗ/∂q`.
    pub(super) fn springs(&self, w: &Workspace<S>, d: &mut Derivatives<S>) {
        let nv = self.tree.dims.nv;
        for (i, node) in self.tree.nodes.iter().enumerate() {
            let Some(v) = velocity(node) else { continue };
            self.trace.at(Some(i), Quantity::Derivative);
            let mut take = |a: usize, b: usize, x: S| add(&mut d.dpd_dq[(v + a) * nv + v + b], -x);
            let k = |k: usize| node.passive[k].stiffness;
            match node.kind {
                Kind::Spherical | Kind::Floating => {}
                Kind::Revolute | Kind::Prismatic | Kind::Helical { .. } => take(0, 0, node.ratio * node.ratio * k(0)),
                Kind::Planar => {
                    // The springs act in the parent's axes, the degrees of freedom in those of the node.
                    let turn = w.poses.steps.own(i)[2];
                    let o = S::zero();
                    for b in 0..2 {
                        let mut unit = [o; 3];
                        unit[b] = S::one();
                        let [x, y, _] = turn.vector_back(unit);
                        let [x, y, _] = turn.vector([k(0) * x, k(1) * y, o]);
                        take(0, b, x);
                        take(1, b, y);
                    }
                    let pull = |l: usize| k(l) * (w.poses.coordinate(i, l) - node.passive[l].rest);
                    let [x, y, _] = turn.vector([pull(0), pull(1), o]);
                    take(0, 2, y);
                    take(1, 2, -x);
                    take(2, 2, k(2));
                }
            }
        }
    }
}

pub(super) fn add<S: Scalar>(to: &mut S, x: S) {
    *to = *to + x;
}

/// `(z × I − I z×) Ω̂` with `z` the unit rotation: the change of the momentum when the bodies are rotated, but not
/// their motion.
fn turned_momentum<S: Scalar>(m: &RigidInertia<S>, hat: &Motion<S>) -> Force<S> {
    let ([cx, cy, _], j, v, w) = (m.moment, &m.inertia, hat.lin, hat.ang);
    let (twice, across) = (j[1] + j[1], j[0] - j[3]);
    Force {
        lin: [-(w[2] * cx), -(w[2] * cy), w[0] * cx + w[1] * cy],
        ang: [
            cx * v[2] - twice * w[0] + across * w[1] - j[4] * w[2],
            cy * v[2] + across * w[0] + twice * w[1] + j[2] * w[2],
            j[2] * w[1] - j[4] * w[0] - (cy * v[1] + cx * v[0]),
        ],
    }
}

/// Inertia of a rigid body in the parent frame of a step.
fn inertia_out<S: Scalar>(step: &ElementaryTransform<S>, m: &RigidInertia<S>) -> RigidInertia<S> {
    use crate::spatial::SYM;
    let moment: Vec3<S> = step.moment(m.mass, m.moment);
    let mut j = m.inertia;
    if let ElementaryTransform::Shift { axis, r } = step {
        let (a, b, n) = axis.cyclic();
        let add = *r * (m.moment[n] + moment[n]);
        j[SYM[a][a]] = j[SYM[a][a]] + add;
        j[SYM[b][b]] = j[SYM[b][b]] + add;
        j[SYM[a][n]] = j[SYM[a][n]] - *r * m.moment[a];
        j[SYM[b][n]] = j[SYM[b][n]] - *r * m.moment[b];
        return RigidInertia { mass: m.mass, moment, inertia: j };
    }
    RigidInertia { mass: m.mass, moment, inertia: step.turn_symmetric(&j) }
}

/// Motion of a joint across itself.
pub(super) fn own_motion<S: Scalar>(node: &Node<S>, v: &[S]) -> Motion<S> {
    (0..node.kind.nv()).fold(Motion::zero(), |sum, k| sum.plus(&node.kind.axis(k).motion(v[k])))
}

/// Components of the bracket of a motion with axis `a`, on the axes of a joint that is closed under it.
pub(super) fn bracket<S: Scalar>(kind: &Kind<S>, motion: &Motion<S>, a: usize, on: usize) -> S {
    let out = motion.cross_motion(&kind.axis(a).motion(S::one()));
    match kind.axis(on) {
        Freedom::Unit(k) => out.get(k),
        Freedom::Screw(_) => S::zero(),
    }
}
