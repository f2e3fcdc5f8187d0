//! Articulated inertia, from tip to base. Every freedom is eliminated by itself; eliminating the freedoms of one joint
//! one after the other is the `LDLᵀ` factorization of its `Mj`.

use super::pass::{each_node, visit_force, visit_inertia, Sweep};
use super::{name, Quantity, Sweeps, Trace};
use crate::spatial::{ArticulatedInertia, Force};
use crate::tree::{each_freedom, for_component, Freedom, Source, Unknown};
use crate::workspace::{Factor, Pivot, Poses};
use crate::Scalar;

/// Evaluates an expression at the places of the upper triangle of a 6×6 matrix, row by row. They are constants where it
/// is compiled.
macro_rules! upper_triangle {
    (|$a:ident, $b:ident| $result:expr) => {
        upper_triangle!(@ $a, $b, $result, 0: 0 1 2 3 4 5; 1: 1 2 3 4 5; 2: 2 3 4 5; 3: 3 4 5; 4: 4 5; 5: 5)
    };
    (@ $i:ident, $k:ident, $result:expr, $($a:literal: $($b:literal)*);*) => {
        $(upper_triangle!(@row $i, $k, $result, $a: $($b)*);)*
    };
    (@row $i:ident, $k:ident, $result:expr, $a:literal: $($b:literal)*) => {
        $({
            let ($i, $k) = ($a, $b);
            $result
        })*
    };
}

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// `M*`, `U`, `Mj`, `M'` (4.48, 4.44), and the columns of unknowns that are still open.
    pub(super) const FACTOR: Self = Sweep {
        waits: false,
        begin: |cx| {
            cx.sweeps.factor_begin(&cx.w.poses, &mut cx.w.factor);
            if cx.sweeps.has_unknowns() {
                cx.sweeps.seed_columns(&cx.w.constraints.rows, &mut cx.w.factor);
            }
        },
        end: |cx| {
            if cx.sweeps.has_unknowns() {
                cx.sweeps.factor_ground(&mut cx.w.factor);
            }
        },
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
    #[inline(always)]
    fn factor_begin(&self, poses: &Poses<S>, f: &mut Factor<S>) {
        for i in 0..self.tree.nodes.len() {
            f.m[i] = self.inertia(poses, i).articulated();
        }
        if !self.has_unknowns() {
            return;
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
        for i in 0..n {
            self.elimination(i).each_open_before(|g| f.columns[g * n + i] = Force::zero());
            if let Some(g) = self.elimination(i).unknown {
                f.columns[g * n + i] = Force::zero();
            }
        }
        for (g, shared) in self.tree.unknowns.iter().enumerate() {
            match shared {
                Unknown::Velocity(_) => {
                    f.gram[g * ng..][..ng].fill(S::zero());
                    let rows = self.tree.unknowns.iter().enumerate().filter(|(_, h)| matches!(h, Unknown::Row(_)));
                    rows.for_each(|(h, _)| f.gram[h * ng + g] = S::zero());
                }
                Unknown::Row(r) => {
                    let compliance = self.compliance(*r);
                    for &h in &f.later[g] {
                        // The same row may come again in another pass.
                        let start = if self.tree.unknowns[h] == *shared { -compliance } else { S::zero() };
                        f.gram[g * ng + h] = start;
                        f.gram[h * ng + g] = start;
                    }
                    f.gram[g * ng + g] = -compliance;
                }
            }
        }
    }

    /// Screws that node `i` is to have, from its parent.
    fn screws_node(&self, i: usize, poses: &Poses<S>, f: &mut Factor<S>) {
        let (n, node) = (self.tree.nodes.len(), &self.tree.nodes[i]);
        let Some(p) = node.parent else { return };
        let inner = &self.tree.nodes[p];
        for &g in &self.elimination(i).screws {
            self.trace.at(Some(i), Quantity::Inertia);
            let at_parent = match self.elimination(p).unknown == Some(g) {
                true => inner.kind.axis(0).motion(S::one()),
                false => self.leaving(poses, p).motion(f.screws[g * n + p]),
            };
            f.screws[g * n + i] = self.entering(poses, i).motion(at_parent);
        }
    }

    /// `M*`, `U`, `Mj`, `M'` of node `i` (4.48, 4.44), after its children. For a plain revolute joint this reads: `U =
    /// M* E`, `Mj = EᵀU`, `M' = M* − U Mj⁻¹ Uᵀ`, and `XᵀM'X` is added to `M*` of the parent. The rest is for unknowns
    /// that are solved at another node than their joint's, and for joints that are eliminated in the frame before them.
    #[inline(always)]
    fn factor_node(&self, i: usize, poses: &Poses<S>, first: &[usize], f: &mut Factor<S>) {
        let n = self.tree.nodes.len();
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Inertia);
        name::inertia(self.trace, "m", &f.m[i]); // M*_i (4.48)
        if self.elimination(i).before_joint {
            self.leaving(poses, i).carry_inertia(&mut f.m[i]);
            let leaving = self.leaving(poses, i);
            self.elimination(i).each_open_before(|g| {
                f.columns[g * n + i] = leaving.force(f.columns[g * n + i]);
            });
        }
        self.trace.at(Some(i), Quantity::Pivot);
        for (k, &g) in self.elimination(i).solve_before.iter().enumerate() {
            self.solve_unknown(g, Some(i), self.elimination(i).open_before(k + 1), f);
        }
        each_freedom!(node.kind, |k, e| self.eliminate(i, e, node.passive[k].armature, first[i] + k, f));
        for (k, &g) in self.elimination(i).solve_after.iter().enumerate() {
            self.solve_unknown(g, Some(i), self.elimination(i).open_after(k + 1), f);
        }
        name::inertia(self.trace, "mp", &f.m[i]); // M'_i (4.44)
        let ng = self.tree.unknowns.len();
        for &h in &self.elimination(i).ends {
            for &g in &self.elimination(i).screws {
                let x = f.gram[g * ng + h] + f.columns[h * n + i].dot(&f.screws[g * n + i]);
                f.gram[g * ng + h] = x;
                f.gram[h * ng + g] = x;
            }
        }
        let Some(parent) = node.parent else { return };
        self.trace.at(Some(i), Quantity::Inertia);
        let mut carried = f.m[i];
        self.entering(poses, i).carry_inertia(&mut carried);
        f.m[parent] = f.m[parent].plus(&carried);
        for &g in &self.elimination(i).open {
            let column = self.entering(poses, i).force(f.columns[g * n + i]);
            f.columns[g * n + parent] = f.columns[g * n + parent].plus(&column);
        }
    }

    /// After the last [`Sweeps::factor_node`]: coordinates solved at the ground.
    fn factor_ground(&self, f: &mut Factor<S>) {
        let ground = &self.tree.solve_at_ground;
        for (k, &g) in ground.iter().enumerate() {
            self.trace.at(None, Quantity::Pivot);
            self.solve_unknown(g, None, ground[k + 1..].iter().copied(), f);
        }
    }

    /// Own freedom of node `i` along `e`: eliminated, prescribed, or added to the open column of its unknown.
    #[inline(always)]
    fn eliminate(&self, i: usize, e: Freedom<S>, armature: S, freedom: usize, f: &mut Factor<S>) {
        let node = &self.tree.nodes[i];
        let u = column(&e, &f.m[i]); // U = M* E
        name::force(self.trace, "u", &u);
        // Functions that are not compiled as part of this one get copies of `e`: it need not be kept in memory for them.
        if self.has_open(i) {
            self.cross_open(i, &{ e }, freedom, f);
        }
        if self.has_unknowns() {
            if let Some(g) = self.elimination(i).unknown {
                return self.add_to_open(i, g, &{ e }, freedom, &u.times(node.ratio), f);
            }
        }
        if let Source::Drive { .. } = node.source {
            f.pivots[freedom] = Pivot { u, k: Force::zero(), rho: S::zero(), armature };
            return;
        }
        let pivot = &mut f.pivots[freedom];
        reduce(&e, u, armature, &mut f.m[i], pivot);
        name::force(self.trace, "k", &pivot.k);
        self.trace.name(pivot.rho, "rho", "");
        if self.has_open(i) {
            self.reduce_open(i, freedom, f);
        }
    }

    /// Inertia between a freedom of node `i` and the open unknowns.
    fn cross_open(&self, i: usize, e: &Freedom<S>, freedom: usize, f: &mut Factor<S>) {
        let (n, ng) = (self.tree.nodes.len(), self.tree.unknowns.len());
        self.elimination(i).each_open_after(|h| {
            f.cross[freedom * ng + h] = e.dot(&f.columns[h * n + i]) + self.coupled(i, h);
        });
    }

    /// Adds the column of the freedom of node `i` to that of its unknown `g`.
    fn add_to_open(&self, i: usize, g: usize, e: &Freedom<S>, freedom: usize, column: &Force<S>, f: &mut Factor<S>) {
        let (n, ng, node) = (self.tree.nodes.len(), self.tree.unknowns.len(), &self.tree.nodes[i]);
        let a = node.ratio;
        let old = f.cross[freedom * ng + g];
        let column = f.columns[g * n + i].plus(column);
        let rotor = a * a * node.passive[0].armature;
        f.gram[g * ng + g] = f.gram[g * ng + g] + a * (old + e.dot(&column)) + rotor;
        self.elimination(i).each_open_after(|h| {
            if h != g {
                let x = f.gram[g * ng + h] + a * f.cross[freedom * ng + h];
                f.gram[g * ng + h] = x;
                f.gram[h * ng + g] = x;
            }
        });
        f.columns[g * n + i] = column;
    }

    /// Takes an eliminated freedom of node `i` out of the columns of open unknowns.
    fn reduce_open(&self, i: usize, freedom: usize, f: &mut Factor<S>) {
        let pivot = f.pivots[freedom];
        let (n, ng) = (self.tree.nodes.len(), self.tree.unknowns.len());
        for h in self.elimination(i).open_after(0) {
            let c = f.cross[freedom * ng + h];
            f.columns[h * n + i] = f.columns[h * n + i].minus(&pivot.k.times(c));
            if let Unknown::Row(_) = self.tree.unknowns[h] {
                f.whole[h] = f.whole[h] + c * (pivot.rho * c);
            }
            self.elimination(i).each_open_after(|h2| {
                let c2 = f.cross[freedom * ng + h2];
                f.gram[h * ng + h2] = f.gram[h * ng + h2] - self.product(f, pivot.rho, (h, c), (h2, c2));
            });
        }
    }

    /// `ρ` times the entries `c` of two unknowns. Where rows are eliminated in passes, both halves of the symmetric matrix are
    /// read: there the order of the factors is that of the rows, so that equal entries are computed once in generated code.
    #[inline(always)]
    fn product(&self, f: &Factor<S>, rho: S, (g, c): (usize, S), (h, c2): (usize, S)) -> S {
        if f.in_passes {
            if let (Unknown::Row(r), Unknown::Row(s)) = (self.tree.unknowns[g], self.tree.unknowns[h]) {
                if r > s {
                    return c2 * (rho * c);
                }
            }
        }
        c * (rho * c2)
    }

    /// Eliminates unknown `g` at node `i` (`None`: the ground), `open` being those that stay open.
    fn solve_unknown(&self, g: usize, i: Option<usize>, open: impl Iterator<Item = usize> + Clone, f: &mut Factor<S>) {
        match self.tree.unknowns[g] {
            Unknown::Velocity(_) => self.solve_open(g, i, open, f),
            Unknown::Row(_) => {
                let later = core::mem::take(&mut f.later[g]);
                self.solve_open(g, i, later.iter().copied(), f);
                f.later[g] = later;
            }
        }
    }

    fn solve_open(&self, g: usize, i: Option<usize>, open: impl Iterator<Item = usize> + Clone, f: &mut Factor<S>) {
        let (n, ng) = (self.tree.nodes.len(), self.tree.unknowns.len());
        let u = i.map_or(Force::zero(), |i| f.columns[g * n + i]);
        let rho = match self.tree.unknowns[g] {
            Unknown::Velocity(_) => S::one() / f.gram[g * ng + g],
            Unknown::Row(r) => self.row_pivot(g, r, f),
        };
        let k = u.times(rho);
        if let Some(i) = i {
            let m = &mut f.m[i];
            upper_triangle!(|a, b| *m.get_mut(a, b) = m.get(a, b) - u.get(a) * k.get(b));
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
                let c2 = f.unknown_cross[g * ng + h2];
                f.gram[h * ng + h2] = f.gram[h * ng + h2] - self.product(f, rho, (h, c), (h2, c2));
            }
        }
        f.unknown_pivots[g] = Pivot { u, k, rho, armature: S::zero() };
    }
}

/// `U = M* E`.
#[inline(always)]
fn column<S: Scalar>(e: &Freedom<S>, m: &ArticulatedInertia<S>) -> Force<S> {
    match e {
        Freedom::Unit(k) => for_component!(*k, |k| m.column(k)),
        Freedom::Screw(h) => m.column(5).plus(&m.column(2).times(*h)),
    }
}

/// `M' = M* − U Mj⁻¹ Uᵀ` (4.44). The row along `E` is known: `EᵀM' = armature · kᵀ`, zero without a rotor.
#[inline(always)]
fn reduce<S: Scalar>(e: &Freedom<S>, u: Force<S>, armature: S, m: &mut ArticulatedInertia<S>, pivot: &mut Pivot<S>) {
    let rho = S::one() / (e.dot(&u) + armature); // Mj⁻¹
    *pivot = Pivot { u, k: u.times(rho), rho, armature };
    let k = &mut pivot.k;
    let along = S::one() - armature * rho; // E · k
    match e {
        Freedom::Unit(known) => for_component!(*known, |known| {
            *k.get_mut(known) = along;
            reduce_others(known, &u, k, m);
            for b in 0..6 {
                if b != known {
                    *m.get_mut(known, b) = armature * k.get(b);
                }
            }
            *m.get_mut(known, known) = armature * k.get(known);
        }),
        Freedom::Screw(h) => {
            k.ang[2] = along - *h * k.lin[2];
            reduce_others(5, &u, k, m);
            for b in 0..6 {
                *m.get_mut(5, b) = armature * k.get(b) - *h * m.get(2, b);
            }
        }
    }
}

/// Entries of `M* − U kᵀ` outside row and column `known`.
#[inline(always)]
fn reduce_others<S: Scalar>(known: usize, u: &Force<S>, k: &Force<S>, m: &mut ArticulatedInertia<S>) {
    upper_triangle!(|a, b| {
        if a != known && b != known {
            *m.get_mut(a, b) = m.get(a, b) - u.get(a) * k.get(b);
        }
    });
}
