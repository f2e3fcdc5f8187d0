//! Mass matrix by composite inertias.

use super::{Inputs, Quantity, Sweeps, Trace};
use crate::tree::Source;
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Mass matrix of the state's velocities, row by row, `nv × nv`, symmetric.
    pub fn mass_matrix(&self, q: &[S], u: &Inputs<S>, w: &mut Workspace<S>, out: &mut [S]) {
        let nv = self.tree.dims.nv;
        self.articulate(q, u.drive_q, &mut w.poses);
        out.fill(S::zero());
        for i in 0..self.tree.nodes.len() {
            w.factor.m[i] = self.inertia(&w.poses, i).articulated();
        }
        for i in (0..self.tree.nodes.len()).rev() {
            let node = &self.tree.nodes[i];
            self.trace.at(Some(i), Quantity::MassMatrix);
            if let Source::State { v, .. } = node.source {
                for k in 0..node.kind.nv() {
                    self.matrix_column(i, k, v + k, nv, w, out);
                }
            }
            if let Some(p) = node.parent {
                let composite = w.factor.m[i];
                let carried = self.steps(&w.poses, i).rev().fold(composite, |m, step| step.inertia(&m));
                w.factor.m[p] = w.factor.m[p].plus(&carried);
            }
        }
        for a in 0..nv {
            for b in 0..a {
                out[a * nv + b] = out[b * nv + a];
            }
        }
    }

    /// Adds freedom `k` of node `i` (velocity `col`) with every freedom inboard of it to the upper triangle.
    fn matrix_column(&self, i: usize, k: usize, col: usize, nv: usize, w: &Workspace<S>, out: &mut [S]) {
        let node = &self.tree.nodes[i];
        let mut force = w.factor.m[i].times(&node.kind.axis(k).motion(S::one())); // F = M E
        let mut at = i;
        loop {
            let here = &self.tree.nodes[at];
            if let Source::State { v, .. } = here.source {
                let last = if at == i { k + 1 } else { here.kind.nv() };
                for k2 in 0..last {
                    let x = node.ratio * here.ratio * here.kind.axis(k2).dot(&force);
                    let (row, col) = if v + k2 < col { (v + k2, col) } else { (col, v + k2) };
                    let entry = &mut out[row * nv + col];
                    let own = at == i && k2 == k;
                    if own {
                        *entry = *entry + x + node.ratio * node.ratio * node.passive[k].armature;
                    } else if row == col {
                        *entry = *entry + (x + x); // two joints of one shared coordinate
                    } else {
                        *entry = *entry + x;
                    }
                }
            }
            let Some(p) = here.parent else { return };
            force = self.force_out(&w.poses, at, &force);
            at = p;
        }
    }
}
