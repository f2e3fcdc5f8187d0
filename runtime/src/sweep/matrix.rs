//! Mass matrix by composite inertias.
//!
//! An entry is the product of a column `F = M E`, carried towards the base, and a screw `E` at its node. In a deep tree
//! most of the work is to carry columns through the inner nodes. So the columns of the outer nodes stop at the depth
//! [`Tree::matrix_depth`](crate::tree::Tree::matrix_depth), and the screws of the inner nodes are carried outward to
//! them.

use super::{Inputs, Quantity, Sweeps, Trace};
use crate::spatial::Force;
use crate::tree::Source;
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Mass matrix of the state's velocities, row by row, `nv × nv`, symmetric.
    pub fn mass_matrix(&self, q: &[S], u: &Inputs<S>, w: &mut Workspace<S>, out: &mut [S]) {
        let nv = self.tree.dims.nv;
        out.fill(S::zero());
        self.matrix_entries(q, u, w, |_| true, |row, col, x| out[row * nv + col] = out[row * nv + col] + x);
        for a in 0..nv {
            for b in 0..a {
                out[a * nv + b] = out[b * nv + a];
            }
        }
    }

    /// Diagonal of the mass matrix. `several` tells of each velocity whether more than one joint has it.
    pub fn mass_diagonal(&self, q: &[S], u: &Inputs<S>, w: &mut Workspace<S>, several: &[bool], out: &mut [S]) {
        out.fill(S::zero());
        let add = |row: usize, col: usize, x: S| {
            if row == col {
                out[row] = out[row] + x;
            }
        };
        self.matrix_entries(q, u, w, |v| several[v], add);
    }

    /// Calls `add` with row, column and part of each entry of the upper triangle: of those columns that are `whole`, and of
    /// the others with what their own freedom adds to the diagonal.
    fn matrix_entries(
        &self,
        q: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        whole: impl Fn(usize) -> bool,
        mut add: impl FnMut(usize, usize, S),
    ) {
        self.articulate(q, u.drive_q, &mut w.poses);
        for i in 0..self.tree.nodes.len() {
            w.factor.m[i] = self.inertia(&w.poses, i).articulated();
            self.matrix_screws(i, w);
        }
        for i in (0..self.tree.nodes.len()).rev() {
            let node = &self.tree.nodes[i];
            self.trace.at(Some(i), Quantity::MassMatrix);
            if let Source::State { v, .. } = node.source {
                for k in 0..node.kind.nv() {
                    self.matrix_column((i, k, v + k), whole(v + k), w, &mut add);
                }
            }
            self.add_composite(i, w);
        }
    }

    /// Adds the composite inertia of node `i` to that of its parent, after its children.
    pub(super) fn add_composite(&self, i: usize, w: &mut Workspace<S>) {
        let Some(p) = self.tree.nodes[i].parent else { return };
        let mut carried = w.factor.m[i];
        self.steps(&w.poses, i).carry_inertia(&mut carried);
        w.factor.m[p] = w.factor.m[p].plus(&carried);
    }

    /// Screws of the inner nodes' freedoms at node `i`, if its parent is an inner node.
    fn matrix_screws(&self, i: usize, w: &mut Workspace<S>) {
        let Some(p) = self.tree.nodes[i].parent.filter(|&p| self.tree.inner(p)) else { return };
        self.trace.at(Some(i), Quantity::MassMatrix);
        let n = self.tree.nodes.len();
        let mut from = Some(p);
        while let Some(a) = from {
            for k in 0..self.tree.nodes[a].kind.nv() {
                let freedom = w.first[a] + k;
                let at_parent = match a == p {
                    true => self.tree.nodes[a].kind.axis(k).motion(S::one()),
                    false => w.screws[freedom * n + p],
                };
                w.screws[freedom * n + i] = self.steps(&w.poses, i).motion(at_parent);
            }
            from = self.tree.nodes[a].parent;
        }
    }

    /// Adds freedom `k` of node `i` (velocity `col`) with itself and, where the column is `whole`, with every freedom inboard
    /// of it.
    fn matrix_column(
        &self,
        (i, k, col): (usize, usize, usize),
        whole: bool,
        w: &Workspace<S>,
        add: &mut impl FnMut(usize, usize, S),
    ) {
        let mut force = w.factor.m[i].times(&self.tree.nodes[i].kind.axis(k).motion(S::one())); // F = M E
        let mut at = i;
        loop {
            let here = &self.tree.nodes[at];
            let last = if at == i { k + 1 } else { here.kind.nv() };
            let from = if whole { 0 } else { k };
            for k2 in from..last {
                self.matrix_entry((i, k, col), (at, k2), here.kind.axis(k2).dot(&force), add);
            }
            let Some(p) = here.parent.filter(|_| whole) else { return };
            if self.tree.inner(p) {
                return self.matrix_meeting((i, k, col), at, &force, w, add);
            }
            force = self.steps(&w.poses, at).force(force);
            at = p;
        }
    }

    /// The entries that a column at node `at` forms with the screws of all inner nodes, which are known there.
    fn matrix_meeting(
        &self,
        column: (usize, usize, usize),
        at: usize,
        force: &Force<S>,
        w: &Workspace<S>,
        add: &mut impl FnMut(usize, usize, S),
    ) {
        let n = self.tree.nodes.len();
        let mut inner = self.tree.nodes[at].parent;
        while let Some(a) = inner {
            for k in 0..self.tree.nodes[a].kind.nv() {
                let x = force.dot(&w.screws[(w.first[a] + k) * n + at]);
                self.matrix_entry(column, (a, k), x, add);
            }
            inner = self.tree.nodes[a].parent;
        }
    }

    /// Adds the product `x` of the column of a freedom (node, number, velocity) and another's screw.
    fn matrix_entry(
        &self,
        (i, k, col): (usize, usize, usize),
        (at, k2): (usize, usize),
        x: S,
        add: &mut impl FnMut(usize, usize, S),
    ) {
        let (node, here) = (&self.tree.nodes[i], &self.tree.nodes[at]);
        let Source::State { v, .. } = here.source else { return };
        let x = node.ratio * here.ratio * x;
        let (row, col) = if v + k2 < col { (v + k2, col) } else { (col, v + k2) };
        let own = at == i && k2 == k;
        if own {
            add(row, col, x);
            add(row, col, node.ratio * node.ratio * node.passive[k].armature);
        } else if row == col {
            add(row, col, x + x); // two joints of one shared coordinate
        } else {
            add(row, col, x);
        }
    }
}
