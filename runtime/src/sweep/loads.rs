//! Gravity by first moments, external wrenches, springs.

use super::pass::{each_node, visit_force, Sweep};
use super::{name, Inputs, Quantity, Sweeps, Trace};
use crate::spatial::{add3, cross, dot3, Force};
use crate::tree::{TreeWrench, WrenchAxes};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// First moment and mass of every subtree: `s_i = m c + Σ (R s_c + m_c r)`.
    pub(super) const MOMENT: Self = Sweep {
        waits: false,
        begin: |cx| cx.sweeps.moment_begin(cx.w),
        carried: |cx, i, visit| {
            let loads = &mut cx.w.loads;
            loads.moment[i].iter_mut().chain([&mut loads.mass[i]]).for_each(visit);
        },
        ..each_node!(TipToBase, |cx, i| cx.sweeps.moment_node(i, cx.w))
    };

    /// Gravity in the axes of every node.
    pub(super) const GRAVITY: Self = Sweep {
        waits: false,
        carried: |cx, i, visit| cx.w.loads.gravity[i].iter_mut().for_each(visit),
        ..each_node!(BaseToTip, |cx, i| cx.sweeps.gravity_node(i, &cx.given.inputs, cx.w))
    };

    /// `T*_i = T_i + Σ Xᵀ T*_c` (4.22) of external wrenches.
    pub(super) const WRENCHES: Self = Sweep {
        waits: false,
        needed: |tree| !T::PLAIN && !tree.wrenches.is_empty(),
        rolls: |_| false,
        begin: |cx| {
            cx.sweeps.wrench_loads(&cx.given.inputs, cx.w);
            cx.w.loads.total.copy_from_slice(&cx.w.loads.own);
        },
        carried: |cx, i, visit| visit_force(&mut cx.w.loads.total[i], visit),
        ..each_node!(TipToBase, |cx, i| cx.sweeps.wrench_node(i, cx.w))
    };

    /// `V = −g · s` and the springs, after [`Sweep::MOMENT`].
    pub(super) const POTENTIAL: Self = Sweep {
        begin: |cx| cx.results.energy[1] = cx.sweeps.weight_potential(&cx.given.inputs, cx.w),
        running: |cx, visit| visit(&mut cx.results.energy[1]),
        ..each_node!(BaseToTip, |cx, i| cx.results.energy[1] = cx.sweeps.spring_node(i, cx.w, cx.results.energy[1]))
    };
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Gravity in the axes of node `i`, after its parent.
    #[inline(always)]
    fn gravity_node(&self, i: usize, u: &Inputs<S>, w: &mut Workspace<S>) {
        self.trace.at(Some(i), Quantity::Load);
        let g = self.tree.nodes[i].parent.map_or(u.gravity, |p| w.loads.gravity[p]);
        w.loads.gravity[i] = self.steps(&w.poses, i).vector(g);
        name::vector(self.trace, "g", &w.loads.gravity[i]);
    }

    /// Before the first [`Sweeps::moment_node`]: every body by itself.
    #[inline(always)]
    fn moment_begin(&self, w: &mut Workspace<S>) {
        w.loads.ground_moment = self.tree.ground_moment;
        for (i, node) in self.tree.nodes.iter().enumerate() {
            (w.loads.moment[i], w.loads.mass[i]) = (self.inertia(&w.poses, i).moment, node.inertia.mass);
        }
    }

    /// First moment and mass of the subtree of node `i` added to its parent's, after its children.
    #[inline(always)]
    fn moment_node(&self, i: usize, w: &mut Workspace<S>) {
        self.trace.at(Some(i), Quantity::Load);
        let mass = w.loads.mass[i];
        name::vector(self.trace, "s", &w.loads.moment[i]);
        let out = self.steps(&w.poses, i).moment(mass, w.loads.moment[i]);
        match self.tree.nodes[i].parent {
            Some(p) => {
                w.loads.moment[p] = add3(w.loads.moment[p], out);
                w.loads.mass[p] = w.loads.mass[p] + mass;
            }
            None => w.loads.ground_moment = add3(w.loads.ground_moment, out),
        }
    }

    /// An external wrench `[force, torque]` (N, N m) in the axes of the frame it acts at, as given or turned from the
    /// ground's.
    pub(super) fn wrench_in_frame(&self, wrench: &TreeWrench<S>, given: &[S; 6], w: &Workspace<S>) -> Force<S> {
        let mut f = Force { lin: [given[0], given[1], given[2]], ang: [given[3], given[4], given[5]] };
        if wrench.axes == WrenchAxes::Ground {
            let path = wrench.path.iter().flat_map(|&i| self.steps(&w.poses, i).iter()).copied();
            for step in path.chain(self.on_body(&w.poses, &wrench.frame)) {
                f = Force { lin: step.vector(f.lin), ang: step.vector(f.ang) };
            }
        }
        f
    }

    /// Wrench on the subtree of node `i` added to that on its parent's, after its children.
    fn wrench_node(&self, i: usize, w: &mut Workspace<S>) {
        self.trace.at(Some(i), Quantity::Load);
        if let Some(p) = self.tree.nodes[i].parent {
            let out = self.steps(&w.poses, i).force(w.loads.total[i]);
            w.loads.total[p] = w.loads.total[p].plus(&out); // T*_i (4.22)
        }
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

    /// `−g · s`.
    fn weight_potential(&self, u: &Inputs<S>, w: &Workspace<S>) -> S {
        self.trace.at(None, Quantity::Energy);
        -dot3(u.gravity, w.loads.ground_moment)
    }

    /// A potential with that of the springs of node `i` added.
    fn spring_node(&self, i: usize, w: &Workspace<S>, mut potential: S) -> S {
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
    #[inline(always)]
    pub(super) fn weight(&self, w: &Workspace<S>, i: usize) -> Force<S> {
        let g = w.loads.gravity[i];
        let m = w.loads.mass[i];
        Force { lin: [m * g[0], m * g[1], m * g[2]], ang: cross(w.loads.moment[i], g) }
    }
}
