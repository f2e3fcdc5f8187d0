//! Articulated inertia, from tip to base. Every freedom is eliminated by itself; eliminating the freedoms of one joint
//! one after the other is the `LDLᵀ` factorization of its `Mj`.

use super::pass::{each_node, visit_force, visit_inertia, Sweep};
use super::{name, Quantity, Sweeps, Trace};
use crate::spatial::{ArticulatedInertia, Force};
use crate::tree::{Freedom, Source, Unknown};
use crate::workspace::{Factor, Pivot, Poses};
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// `M*`, `U`, `Mj`, `M'` (4.48, 4.44), and the columns of unknowns that are still open.
    pub(super) const FACTOR: Self = Sweep {
        waits: false,
        begin: |cx| {
            cx.sweeps.factor_begin(&cx.w.poses, &mut cx.w.factor);
            cx.sweeps.seed_columns(&cx.w.constraints.rows, &mut cx.w.factor);
        },
        end: |cx| cx.sweeps.factor_ground(&mut cx.w.factor),
        carried: |cx, i, visit| {
            let (tree, f) = (cx.sweeps.tree, &mut cx.w.factor);
            visit_inertia(&mut f.m[i], visit);
            let n = tree.nodes.len();
            (0..tree.unknowns.len())
                .filter(|&g| tree.is_slot(g))
                .for_each(|g| visit_force(&mut f.columns[g * n + i], visit));
        },
        running: |cx, visit| {
            let (tree, f) = (cx.sweeps.tree, &mut cx.w.factor);
            let ng = tree.unknowns.len();
            (0..ng).filter(|&g| tree.is_slot(g)).for_each(|g| visit(&mut f.whole[g]));
            let both = |k: usize| tree.is_slot(k / ng) && tree.is_slot(k % ng);
            (0..ng * ng).filter(|&k| both(k)).for_each(|k| visit(&mut f.gram[k]));
        },
        ..each_node!(TipToBase, |cx, i| cx.sweeps.factor_node(i, &cx.w.poses, &cx.w.first, &mut cx.w.factor))
    };
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Before the first [`Sweeps::factor_node`]: every body by itself.
    fn factor_begin(&self, poses: &Poses<S>, f: &mut Factor<S>) {
        for i in 0..self.tree.nodes.len() {
            f.m[i] = self.inertia(poses, i).articulated();
        }
        self.clear_open(f);
        for i in 0..self.tree.nodes.len() {
            self.screws_node(i, poses, f);
        }
    }

    /// Sets the columns and inertias of open unknowns to zero, only where they are read: the work grows with the sizes
    /// of the loops, not with the square of the number of rows.
    fn clear_open(&self, f: &mut Factor<S>) {
        let (n, ng) = (self.tree.nodes.len(), self.tree.unknowns.len());
        f.whole.fill(S::zero());
        for (i, node) in self.tree.nodes.iter().enumerate() {
            for g in node.elimination.open_before(0).chain(node.elimination.unknown) {
                f.columns[g * n + i] = Force::zero();
            }
        }
        for (g, shared) in self.tree.unknowns.iter().enumerate() {
            f.gram[g * ng + g] = S::zero();
            let clear = |h: usize, gram: &mut [S]| {
                gram[g * ng + h] = S::zero();
                gram[h * ng + g] = S::zero();
            };
            match shared {
                Unknown::Velocity(_) => (0..ng).for_each(|h| clear(h, &mut f.gram)),
                Unknown::Row(r) => {
                    f.later[g].iter().for_each(|&h| clear(h, &mut f.gram));
                    f.gram[g * ng + g] = -self.compliance(*r);
                }
            }
        }
    }

    /// Screws that node `i` is to have, from its parent.
    fn screws_node(&self, i: usize, poses: &Poses<S>, f: &mut Factor<S>) {
        let (n, node) = (self.tree.nodes.len(), &self.tree.nodes[i]);
        let Some(p) = node.parent else { return };
        let inner = &self.tree.nodes[p];
        for &g in &node.elimination.screws {
            self.trace.at(Some(i), Quantity::Inertia);
            let at_parent = match inner.elimination.unknown == Some(g) {
                true => inner.kind.axis(0).motion(S::one()),
                false => self.leaving(poses, p).fold(f.screws[g * n + p], |m, step| step.motion(&m)),
            };
            f.screws[g * n + i] = self.entering(poses, i).fold(at_parent, |m, step| step.motion(&m));
        }
    }

    /// `M*`, `U`, `Mj`, `M'` of node `i` (4.48, 4.44), after its children. For a plain revolute joint this reads: `U =
    /// M* E`, `Mj = EᵀU`, `M' = M* − U Mj⁻¹ Uᵀ`, and `XᵀM'X` is added to `M*` of the parent. The rest is for unknowns
    /// that are solved at another node than their joint's, and for joints that are eliminated in the frame before them.
    fn factor_node(&self, i: usize, poses: &Poses<S>, first: &[usize], f: &mut Factor<S>) {
        let n = self.tree.nodes.len();
        let node = &self.tree.nodes[i];
        let mut m = f.m[i]; // M*_i (4.48)
        self.trace.at(Some(i), Quantity::Inertia);
        name::inertia(self.trace, "m", &m);
        if node.elimination.before_joint {
            m = self.leaving(poses, i).rev().fold(m, |m, step| step.inertia(&m));
            for g in node.elimination.open_before(0) {
                let column = f.columns[g * n + i];
                f.columns[g * n + i] = self.leaving(poses, i).rev().fold(column, |f, step| step.force(&f));
            }
        }
        self.trace.at(Some(i), Quantity::Pivot);
        for (k, &g) in node.elimination.solve_before.iter().enumerate() {
            self.solve_unknown(g, Some(i), node.elimination.open_before(k + 1), &mut m, f);
        }
        for k in 0..node.kind.nv() {
            self.eliminate(i, k, first[i] + k, &mut m, f);
        }
        for (k, &g) in node.elimination.solve_after.iter().enumerate() {
            self.solve_unknown(g, Some(i), node.elimination.open_after(k + 1), &mut m, f);
        }
        f.m[i] = m; // M'_i (4.44)
        name::inertia(self.trace, "mp", &m);
        let ng = self.tree.unknowns.len();
        for (&h, &g) in node.elimination.ends.iter().flat_map(|h| node.elimination.screws.iter().map(move |g| (h, g))) {
            let x = f.gram[g * ng + h] + f.columns[h * n + i].dot(&f.screws[g * n + i]);
            f.gram[g * ng + h] = x;
            f.gram[h * ng + g] = x;
        }
        let Some(parent) = node.parent else { return };
        self.trace.at(Some(i), Quantity::Inertia);
        let carried = self.entering(poses, i).rev().fold(m, |m, step| step.inertia(&m));
        f.m[parent] = f.m[parent].plus(&carried);
        for &g in &node.elimination.open {
            let column = self.entering(poses, i).rev().fold(f.columns[g * n + i], |f, step| step.force(&f));
            f.columns[g * n + parent] = f.columns[g * n + parent].plus(&column);
        }
    }

    /// After the last [`Sweeps::factor_node`]: coordinates solved at the ground.
    fn factor_ground(&self, f: &mut Factor<S>) {
        let ground = &self.tree.solve_at_ground;
        for (k, &g) in ground.iter().enumerate() {
            self.trace.at(None, Quantity::Pivot);
            let mut nothing = ArticulatedInertia::zero();
            self.solve_unknown(g, None, ground[k + 1..].iter().copied(), &mut nothing, f);
        }
    }

    /// Own freedom `k` of node `i`: eliminated, prescribed, or added to the open column of its unknown.
    fn eliminate(&self, i: usize, k: usize, freedom: usize, m: &mut ArticulatedInertia<S>, f: &mut Factor<S>) {
        let node = &self.tree.nodes[i];
        let (n, ng) = (self.tree.nodes.len(), self.tree.unknowns.len());
        let e = node.kind.axis(k);
        let armature = node.passive[k].armature;
        let u = column(&e, m); // U = M* E
        name::force(self.trace, "u", &u);
        for h in node.elimination.open_after(0) {
            f.cross[freedom * ng + h] = e.dot(&f.columns[h * n + i]) + self.coupled(i, h);
        }
        if let Some(g) = node.elimination.unknown {
            let a = node.ratio;
            let old = f.cross[freedom * ng + g];
            let column = f.columns[g * n + i].plus(&u.times(a));
            let rotor = a * a * armature;
            f.gram[g * ng + g] = f.gram[g * ng + g] + a * (old + e.dot(&column)) + rotor;
            for h in node.elimination.open_after(0).filter(|&h| h != g) {
                let x = f.gram[g * ng + h] + a * f.cross[freedom * ng + h];
                f.gram[g * ng + h] = x;
                f.gram[h * ng + g] = x;
            }
            f.columns[g * n + i] = column;
            return;
        }
        if let Source::Drive { .. } = node.source {
            f.pivots[freedom] = Pivot { u, k: Force::zero(), rho: S::zero(), armature };
            return;
        }
        let pivot = reduce(&e, u, armature, m);
        name::force(self.trace, "k", &pivot.k);
        self.trace.name(pivot.rho, "rho", "");
        for h in node.elimination.open_after(0) {
            let c = f.cross[freedom * ng + h];
            f.columns[h * n + i] = f.columns[h * n + i].minus(&pivot.k.times(c));
            if let Unknown::Row(_) = self.tree.unknowns[h] {
                f.whole[h] = f.whole[h] + c * (pivot.rho * c);
            }
            for h2 in node.elimination.open_after(0) {
                f.gram[h * ng + h2] = f.gram[h * ng + h2] - c * (pivot.rho * f.cross[freedom * ng + h2]);
            }
        }
        f.pivots[freedom] = pivot;
    }

    /// Eliminates unknown `g` at node `i` (`None`: the ground), `open` being those that stay open.
    fn solve_unknown(
        &self,
        g: usize,
        i: Option<usize>,
        open: impl Iterator<Item = usize> + Clone,
        m: &mut ArticulatedInertia<S>,
        f: &mut Factor<S>,
    ) {
        match self.tree.unknowns[g] {
            Unknown::Velocity(_) => self.solve_open(g, i, open, m, f),
            Unknown::Row(_) => {
                let later = core::mem::take(&mut f.later[g]);
                self.solve_open(g, i, later.iter().copied(), m, f);
                f.later[g] = later;
            }
        }
    }

    fn solve_open(
        &self,
        g: usize,
        i: Option<usize>,
        open: impl Iterator<Item = usize> + Clone,
        m: &mut ArticulatedInertia<S>,
        f: &mut Factor<S>,
    ) {
        let (n, ng) = (self.tree.nodes.len(), self.tree.unknowns.len());
        let u = i.map_or(Force::zero(), |i| f.columns[g * n + i]);
        let rho = match self.tree.unknowns[g] {
            Unknown::Velocity(_) => S::one() / f.gram[g * ng + g],
            Unknown::Row(r) => self.row_pivot(g, r, f),
        };
        let k = u.times(rho);
        for a in 0..6 {
            for b in a..6 {
                *m.get_mut(a, b) = m.get(a, b) - u.get(a) * k.get(b);
            }
        }
        for h in open.clone() {
            f.unknown_cross[g * ng + h] = f.gram[g * ng + h];
        }
        for h in open.clone() {
            let c = f.unknown_cross[g * ng + h];
            if let (Unknown::Velocity(_), Unknown::Row(_)) = (self.tree.unknowns[g], self.tree.unknowns[h]) {
                f.whole[h] = f.whole[h] + c * (rho * c);
            }
            if let Some(i) = i {
                f.columns[h * n + i] = f.columns[h * n + i].minus(&k.times(c));
            }
            for h2 in open.clone() {
                f.gram[h * ng + h2] = f.gram[h * ng + h2] - c * (rho * f.unknown_cross[g * ng + h2]);
            }
        }
        f.unknown_pivots[g] = Pivot { u, k, rho, armature: S::zero() };
    }
}

/// `U = M* E`.
fn column<S: Scalar>(e: &Freedom<S>, m: &ArticulatedInertia<S>) -> Force<S> {
    match e {
        Freedom::Unit(k) => m.column(*k),
        Freedom::Screw(h) => m.column(5).plus(&m.column(2).times(*h)),
    }
}

/// `M' = M* − U Mj⁻¹ Uᵀ` (4.44). The row along `E` is known: `EᵀM' = armature · kᵀ`, zero without a rotor.
fn reduce<S: Scalar>(e: &Freedom<S>, u: Force<S>, armature: S, m: &mut ArticulatedInertia<S>) -> Pivot<S> {
    let rho = S::one() / (e.dot(&u) + armature); // Mj⁻¹
    let mut k = u.times(rho);
    let known = match e {
        Freedom::Unit(z) => *z,
        Freedom::Screw(_) => 5,
    };
    let along = S::one() - armature * rho; // E · k
    *k.get_mut(known) = match e {
        Freedom::Unit(_) => along,
        Freedom::Screw(h) => along - *h * k.lin[2],
    };
    for a in 0..6 {
        for b in a..6 {
            if a != known && b != known {
                *m.get_mut(a, b) = m.get(a, b) - u.get(a) * k.get(b);
            }
        }
    }
    for b in (0..6).filter(|&b| b != known) {
        *m.get_mut(known, b) = match e {
            Freedom::Unit(_) => armature * k.get(b),
            Freedom::Screw(h) => armature * k.get(b) - *h * m.get(2, b),
        };
    }
    *m.get_mut(known, known) = match e {
        Freedom::Unit(_) => armature * k.get(known),
        Freedom::Screw(h) => armature * k.get(known) - *h * m.get(2, known),
    };
    Pivot { u, k, rho, armature }
}
