//! Gravity by first moments, external wrenches, springs.

use super::{name, Inputs, Quantity, Sweeps, Trace};
use crate::spatial::{add3, cross, dot3, Force};
use crate::tree::{TreeWrench, WrenchAxes};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Everything [`Sweeps::momentum_rates`] needs of gravity and wrenches.
    pub(super) fn loads(&self, u: &Inputs<S>, w: &mut Workspace<S>) {
        self.gravity_moments(w);
        for i in 0..self.tree.nodes.len() {
            self.gravity_node(i, u, w);
        }
        self.wrench_loads(u, w);
        if self.tree.wrenches.is_empty() {
            return;
        }
        w.loads.total.copy_from_slice(&w.loads.own);
        for i in (0..self.tree.nodes.len()).rev() {
            self.trace.at(Some(i), Quantity::Load);
            if let Some(p) = self.tree.nodes[i].parent {
                let out = self.force_out(&w.poses, i, &w.loads.total[i]);
                w.loads.total[p] = w.loads.total[p].plus(&out); // T*_i (4.22)
            }
        }
    }

    /// Gravity in the axes of node `i`, its parent being done.
    pub fn gravity_node(&self, i: usize, u: &Inputs<S>, w: &mut Workspace<S>) {
        self.trace.at(Some(i), Quantity::Load);
        let g = self.tree.nodes[i].parent.map_or(u.gravity, |p| w.loads.gravity[p]);
        w.loads.gravity[i] = self.steps(&w.poses, i).fold(g, |g, step| step.vector(g));
        name::vector(self.trace, "g", &w.loads.gravity[i]);
    }

    /// First moment and mass of every subtree: `s_i = m c + Σ (R s_c + m_c r)`.
    pub(super) fn gravity_moments(&self, w: &mut Workspace<S>) {
        self.moment_begin(w);
        for i in (0..self.tree.nodes.len()).rev() {
            self.moment_node(i, w);
        }
    }

    /// Before the first [`Sweeps::moment_node`]: every body by itself.
    pub fn moment_begin(&self, w: &mut Workspace<S>) {
        w.loads.ground_moment = self.tree.ground_moment;
        for (i, node) in self.tree.nodes.iter().enumerate() {
            (w.loads.moment[i], w.loads.mass[i]) = (self.inertia(&w.poses, i).moment, node.inertia.mass);
        }
    }

    /// First moment and mass behind node `i` added to its parent's, all nodes behind it being done.
    pub fn moment_node(&self, i: usize, w: &mut Workspace<S>) {
        self.trace.at(Some(i), Quantity::Load);
        let mass = w.loads.mass[i];
        name::vector(self.trace, "s", &w.loads.moment[i]);
        let out = self.steps(&w.poses, i).rev().fold(w.loads.moment[i], |s, step| step.moment(mass, s));
        match self.tree.nodes[i].parent {
            Some(p) => {
                w.loads.moment[p] = add3(w.loads.moment[p], out);
                w.loads.mass[p] = w.loads.mass[p] + mass;
            }
            None => w.loads.ground_moment = add3(w.loads.ground_moment, out),
        }
    }

    /// An external wrench `[force, torque]` (N, N m) in the axes of the frame it acts at, as given or turned from the ground's.
    pub(super) fn wrench_in_frame(&self, wrench: &TreeWrench<S>, given: &[S; 6], w: &Workspace<S>) -> Force<S> {
        let mut f = Force { lin: [given[0], given[1], given[2]], ang: [given[3], given[4], given[5]] };
        if wrench.axes == WrenchAxes::Ground {
            let path = wrench.path.iter().flat_map(|&i| self.steps(&w.poses, i)).copied();
            for step in path.chain(self.on_body(&w.poses, &wrench.frame)) {
                f = Force { lin: step.vector(f.lin), ang: step.vector(f.ang) };
            }
        }
        f
    }

    /// External wrenches at the nodes they act on.
    pub(super) fn wrench_loads(&self, u: &Inputs<S>, w: &mut Workspace<S>) {
        if self.tree.wrenches.is_empty() {
            return;
        }
        w.loads.own.fill(Force::zero());
        for (wrench, given) in self.tree.wrenches.iter().zip(u.wrenches) {
            let Some(node) = wrench.frame.node else { continue };
            self.trace.at(Some(node), Quantity::Load);
            let f = self.wrench_in_frame(wrench, given, w);
            let f = self.on_body(&w.poses, &wrench.frame).rev().fold(f, |f, step| step.force(&f));
            w.loads.own[node] = w.loads.own[node].plus(&f);
        }
    }

    /// `V = −g · s` and the springs.
    pub(super) fn potential(&self, u: &Inputs<S>, w: &Workspace<S>) -> S {
        (0..self.tree.nodes.len()).fold(self.weight_potential(u, w), |sum, i| self.spring_node(i, w, sum))
    }

    /// `−g · s`.
    pub fn weight_potential(&self, u: &Inputs<S>, w: &Workspace<S>) -> S {
        self.trace.at(None, Quantity::Energy);
        -dot3(u.gravity, w.loads.ground_moment)
    }

    /// A potential with that of the springs of node `i` added.
    pub fn spring_node(&self, i: usize, w: &Workspace<S>, mut potential: S) -> S {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Energy);
        for k in 0..node.kind.springs() {
            let passive = &node.passive[k];
            let stretch = w.poses.coordinate(i, k) - passive.rest;
            potential = potential + S::constant(0.5) * passive.stiffness * stretch * stretch;
        }
        potential
    }

    /// Gravity's wrench on the subtree of node `i`, in its frame: `(m g, s × g)`.
    pub(super) fn weight(&self, w: &Workspace<S>, i: usize) -> Force<S> {
        let g = w.loads.gravity[i];
        let m = w.loads.mass[i];
        Force { lin: [m * g[0], m * g[1], m * g[2]], ang: cross(w.loads.moment[i], g) }
    }
}
