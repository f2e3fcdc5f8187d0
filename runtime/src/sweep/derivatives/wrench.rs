//! External wrenches: those in axes of the ground do not rotate with the body, those in axes of a frame do.

use super::pairs::add;
use super::{velocity, Derivatives};
use crate::spatial::{cross, dot3, Force, Motion};
use crate::sweep::{Inputs, Quantity, Sweeps, Trace};
use crate::tree::{TreeWrench, WrenchAxes};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Adds what external wrenches contribute to `ṗ` and `∂ṗ/∂q`. All is done in the frame each acts at.
    pub(super) fn wrench_products(&self, u: &Inputs<S>, w: &Workspace<S>, d: &mut Derivatives<S>) {
        for (wrench, given) in self.tree.wrenches.iter().zip(u.wrenches) {
            let Some(node) = wrench.frame.node else { continue };
            self.trace.at(Some(node), Quantity::Load);
            let f = self.wrench_in_frame(wrench, given, w);
            self.wrench(wrench, &f, w, d);
        }
    }

    /// One wrench, given in its frame: `s_a · δF` for all pairs of freedoms on its path.
    fn wrench(&self, wrench: &TreeWrench<S>, f: &Force<S>, w: &Workspace<S>, d: &mut Derivatives<S>) {
        let nv = self.tree.dims.nv;
        let grounded = wrench.axes == WrenchAxes::Ground;
        for (inner, &j) in wrench.path.iter().enumerate() {
            let there = &self.tree.nodes[j];
            let Some(b) = velocity(there) else { continue };
            for l in 0..there.kind.nv() {
                let sb = self.axis_at(wrench, inner, l, w);
                add(&mut d.pd[b + l], there.ratio * f.dot(&sb));
                // The wrench in ground axes does not rotate with the body; this is the difference.
                let lag = Force { lin: cross(sb.ang, f.lin), ang: cross(sb.ang, f.ang) };
                for (outer, &i) in wrench.path.iter().enumerate() {
                    let here = &self.tree.nodes[i];
                    let Some(a) = velocity(here) else { continue };
                    for k in 0..here.kind.nv() {
                        let sa = self.axis_at(wrench, outer, k, w);
                        let x = match (outer >= inner, grounded) {
                            (true, false) => continue, // axis and wrench move as one
                            (true, true) => -lag.dot(&sa),
                            (false, false) => sb.cross_force(f).dot(&sa),
                            (false, true) => dot3(cross(sb.lin, f.lin), sa.ang),
                        };
                        add(&mut d.dpd_dq[(a + k) * nv + b + l], here.ratio * there.ratio * x);
                    }
                }
            }
        }
    }

    /// Axis of freedom `k` of the node at `place` on the path of a wrench, in the frame of the wrench.
    fn axis_at(&self, wrench: &TreeWrench<S>, place: usize, k: usize, w: &Workspace<S>) -> Motion<S> {
        let axis = self.tree.nodes[wrench.path[place]].kind.axis(k).motion(S::one());
        let outward = wrench.path[place + 1..].iter().flat_map(|&i| self.steps(&w.poses, i).iter()).copied();
        outward.chain(self.on_body(&w.poses, &wrench.frame)).fold(axis, |m, step| step.motion(&m))
    }
}
