//! The linear problem behind both levels: momenta to velocities, forces to accelerations.
//!
//! With `M'`, `U`, `Mj` known, right-hand sides are carried from tip to base (`D`, 4.49, 4.45) and motions from base to
//! tip (4.40). `level.rs` says what the right-hand sides are.

use super::level::Load;
use super::{name, Quantity, Sweeps, Trace};
use crate::spatial::{Force, Motion};
use crate::tree::{each_freedom, for_component, Freedom, Source, Unknown};
use crate::workspace::{Factor, Poses, Solution};
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Before the first [`Sweeps::bias_momentum_node`].
    pub(super) fn bias_momentum_begin(&self, load: &Load<S>, sol: &mut Solution<S>) {
        match load.seeds {
            Some(seeds) => sol.d.copy_from_slice(seeds),
            None => sol.d.fill(Force::zero()),
        }
        // `unknown_rate` holds the bias momentum of unknowns that are still open, until the sweep of motions overwrites
        // it.
        sol.unknown_rate.fill(S::zero());
    }

    /// `D`, `D'` and `(p − d) / Mj` of node `i`, after its children.
    #[inline(always)]
    pub(super) fn bias_momentum_node(
        &self,
        i: usize,
        poses: &Poses<S>,
        first: &[usize],
        f: &Factor<S>,
        load: &Load<S>,
        sol: &mut Solution<S>,
    ) {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::BiasMomentum);
        name::force(self.trace, "d", &sol.d[i]);
        let mut d = sol.d[i]; // D_i (4.49)
        if self.elimination(i).before_joint {
            d = self.leaving(poses, i).force(d);
        }
        for (k, &g) in self.elimination(i).solve_before.iter().enumerate() {
            let e = self.unknown_bias_momentum(g, f, load, sol, self.elimination(i).open_before(k + 1));
            d = d.plus(&f.unknown_pivots[g].u.times(e));
        }
        each_freedom!(node.kind, |k, axis| self.bias_momentum(i, k, axis, first[i] + k, f, load, sol, &mut d));
        for (k, &g) in self.elimination(i).solve_after.iter().enumerate() {
            let e = self.unknown_bias_momentum(g, f, load, sol, self.elimination(i).open_after(k + 1));
            d = d.plus(&f.unknown_pivots[g].u.times(e));
        }
        sol.d[i] = d; // D'_i (4.45)
        name::force(self.trace, "dp", &d);
        if let Some(parent) = node.parent {
            let carried = self.entering(poses, i).force(d);
            sol.d[parent] = sol.d[parent].plus(&carried);
        }
    }

    /// After the last [`Sweeps::bias_momentum_node`]: coordinates solved at the ground.
    pub(super) fn bias_momentum_ground(&self, f: &Factor<S>, load: &Load<S>, sol: &mut Solution<S>) {
        let ground = &self.tree.solve_at_ground;
        for (k, &g) in ground.iter().enumerate() {
            self.unknown_bias_momentum(g, f, load, sol, ground[k + 1..].iter().copied());
        }
    }

    /// Own freedom `k` of node `i`, along `axis`, in the sweep from tip to base.
    #[inline(always)]
    fn bias_momentum(
        &self,
        i: usize,
        k: usize,
        axis: Freedom<S>,
        freedom: usize,
        f: &Factor<S>,
        load: &Load<S>,
        sol: &mut Solution<S>,
        d: &mut Force<S>,
    ) {
        let node = &self.tree.nodes[i];
        let pivot = &f.pivots[freedom];
        if let Some(g) = self.elimination(i).unknown {
            sol.unknown_rate[g] = sol.unknown_rate[g] + node.ratio * axis.dot(d);
            return;
        }
        let e = match node.source {
            Source::State { v, .. } => {
                let p = load.p[v + k];
                let e = (p - axis.dot(d)) * pivot.rho;
                self.trace.name(e, "e", "");
                reduce(&axis, d, &pivot.u, e, p - pivot.armature * e);
                e
            }
            Source::Drive { v, .. } => {
                let rate = node.ratio * load.drive[v + k];
                *d = d.plus(&pivot.u.times(rate));
                rate
            }
        };
        if self.has_open(i) {
            let ng = self.tree.unknowns.len();
            self.elimination(i).each_open_after(|h| {
                sol.unknown_rate[h] = sol.unknown_rate[h] + f.cross[freedom * ng + h] * e;
            });
        }
        sol.e[freedom] = e;
    }

    /// Unknown `g` in the sweep from tip to base; gives its `(p − d) / Mj`.
    fn unknown_bias_momentum(
        &self,
        g: usize,
        f: &Factor<S>,
        load: &Load<S>,
        sol: &mut Solution<S>,
        open: impl Iterator<Item = usize>,
    ) -> S {
        let ng = self.tree.unknowns.len();
        let given = match self.tree.unknowns[g] {
            Unknown::Velocity(v) => load.p[v],
            Unknown::Row(r) => load.rows[r],
        };
        let e = (given - sol.unknown_rate[g]) * f.unknown_pivots[g].rho;
        let mut add = |h: usize| sol.unknown_rate[h] = sol.unknown_rate[h] + f.unknown_cross[g * ng + h] * e;
        match self.tree.unknowns[g] {
            Unknown::Velocity(_) => open.for_each(add),
            Unknown::Row(_) => f.later[g].iter().for_each(|&h| add(h)),
        }
        sol.unknown_e[g] = e;
        e
    }

    /// Before the first [`Sweeps::motion_node`]: coordinates solved at the ground.
    pub(super) fn motion_ground(&self, f: &Factor<S>, load: &Load<S>, sol: &mut Solution<S>) {
        let ground = &self.tree.solve_at_ground;
        for (k, &g) in ground.iter().enumerate().rev() {
            self.trace.at(None, load.what);
            self.unknown_motion(g, f, &Motion::zero(), ground[k + 1..].iter().copied(), sol);
        }
    }

    /// `Ω̂`, rates and `Ω` of node `i`, after its parent.
    #[inline(always)]
    pub(super) fn motion_node(
        &self,
        i: usize,
        poses: &Poses<S>,
        first: &[usize],
        f: &Factor<S>,
        load: &Load<S>,
        sol: &mut Solution<S>,
    ) {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), load.what);
        let outer = node.parent.map_or(Motion::zero(), |p| sol.omega[p]);
        let hat = self.entering(poses, i).motion(outer);
        sol.hat[i] = hat; // Ω̂_i
        let [hat_letter, letter, rate_letter] = load.letters();
        name::motion(self.trace, hat_letter, &hat);
        for (k, &g) in self.elimination(i).solve_after.iter().enumerate().rev() {
            // A copy: the motion itself need not be kept in memory for a function that is not compiled as part of this one.
            self.unknown_motion(g, f, &{ hat }, self.elimination(i).open_after(k + 1), sol);
        }
        let mut omega = hat;
        each_freedom!(node.kind, rev, |k, axis| {
            let rate = self.rate_along(i, axis, first[i] + k, f, sol, &mut omega);
            sol.rate[first[i] + k] = rate;
            self.trace.name(rate, rate_letter, "");
        });
        for (k, &g) in self.elimination(i).solve_before.iter().enumerate().rev() {
            self.unknown_motion(g, f, &{ omega }, self.elimination(i).open_before(k + 1), sol);
        }
        if self.elimination(i).before_joint {
            omega = self.leaving(poses, i).motion(omega);
        }
        sol.omega[i] = omega; // Ω_i
        name::motion(self.trace, letter, &sol.omega[i]);
    }

    /// Rate of a freedom of node `i` along `axis` (4.40), which is added to the motion of the frame.
    #[inline(always)]
    fn rate_along(
        &self,
        i: usize,
        axis: Freedom<S>,
        freedom: usize,
        f: &Factor<S>,
        sol: &Solution<S>,
        omega: &mut Motion<S>,
    ) -> S {
        let node = &self.tree.nodes[i];
        let rate = match (self.elimination(i).unknown, node.source) {
            (Some(g), _) => node.ratio * sol.unknown_rate[g],
            (None, Source::Drive { .. }) => sol.e[freedom],
            (None, Source::State { .. }) => {
                let pivot = &f.pivots[freedom];
                let less_open = |rate: S| match self.has_open(i) {
                    true => self.less_open(i, freedom, f, &sol.unknown_rate, rate),
                    false => rate,
                };
                if let Freedom::Unit(z) = axis {
                    // Ω along E comes first and the rate as a difference: nothing is taken off to be added again.
                    let mut row = pivot.k;
                    return for_component!(z, |z| {
                        *row.get_mut(z) = -(pivot.armature * pivot.rho);
                        let total = less_open(sol.e[freedom] - row.dot(omega));
                        let rate = total - omega.get(z);
                        *omega.get_mut(z) = total;
                        rate
                    });
                }
                less_open(sol.e[freedom] - pivot.k.dot(omega))
            }
        };
        axis.add_to(omega, rate);
        rate
    }

    /// A rate less what the rates of open unknowns contribute to it.
    fn less_open(&self, i: usize, freedom: usize, f: &Factor<S>, unknown_rate: &[S], rate: S) -> S {
        let (ng, rho) = (self.tree.unknowns.len(), f.pivots[freedom].rho);
        let open = self.elimination(i).open_after(0);
        open.fold(rate, |rate, h| rate - rho * f.cross[freedom * ng + h] * unknown_rate[h])
    }

    fn unknown_motion(
        &self,
        g: usize,
        f: &Factor<S>,
        omega: &Motion<S>,
        open: impl Iterator<Item = usize>,
        sol: &mut Solution<S>,
    ) {
        let ng = self.tree.unknowns.len();
        let pivot = &f.unknown_pivots[g];
        let rate = sol.unknown_e[g] - pivot.k.dot(omega);
        let less = |rate: S, h: usize| rate - pivot.rho * f.unknown_cross[g * ng + h] * sol.unknown_rate[h];
        sol.unknown_rate[g] = match self.tree.unknowns[g] {
            Unknown::Velocity(_) => open.fold(rate, less),
            Unknown::Row(_) => f.later[g].iter().copied().fold(rate, less),
        };
    }

    /// Wrench (or momentum) that node `i` receives from its parent, in the node frame: `M'Ω̂ + D'` (4.43).
    pub(super) fn transmitted(
        &self,
        poses: &Poses<S>,
        first: &[usize],
        f: &Factor<S>,
        sol: &Solution<S>,
        i: usize,
    ) -> Force<S> {
        let (motion, d) = self.acting(first, f, sol, i);
        self.leaving(poses, i).iter().fold(f.m[i].times(&motion).plus(&d), |f, step| step.force_back(&f))
    }

    /// The motion that `M'` of node `i` acts on and what is to be added to it, in the frame it is eliminated in: `Ω̂`
    /// and `D'` with what the open coordinates add. A freedom that is solved further inboard leaves `M*` whole: then
    /// `Ω` takes the place of `Ω̂`, and the freedom's own column, `M* E`, is in `M*` already.
    pub(super) fn acting(&self, first: &[usize], f: &Factor<S>, sol: &Solution<S>, i: usize) -> (Motion<S>, Force<S>) {
        let (n, node) = (self.tree.nodes.len(), &self.tree.nodes[i]);
        let (mut motion, mut own) = (sol.hat[i], None);
        if self.elimination(i).deferred {
            node.kind.axis(0).add_to(&mut motion, sol.rate[first[i]]);
            own = self.elimination(i).unknown;
        }
        let mut d = sol.d[i];
        for open in [&self.elimination(i).open, &self.elimination(i).ends] {
            for &g in open {
                if Some(g) != own {
                    d = d.plus(&f.columns[g * n + i].times(sol.unknown_rate[g]));
                }
            }
        }
        (motion, d)
    }

    /// Rates of the velocities of node `i` out of a solution.
    #[inline(always)]
    pub(super) fn collect_rate_node(&self, i: usize, sol: &Solution<S>, first: &[usize], v: &mut [S]) {
        let node = &self.tree.nodes[i];
        let Source::State { v: at, .. } = node.source else { return };
        match self.elimination(i).unknown {
            Some(g) => v[at] = sol.unknown_rate[g],
            None => each_freedom!(node.kind, |k| v[at + k] = sol.rate[first[i] + k]),
        }
    }
}

/// `D' = D + U e` (4.45), the component along `E` being known: `EᵀD' = p − armature · e`.
#[inline(always)]
fn reduce<S: Scalar>(axis: &Freedom<S>, d: &mut Force<S>, u: &Force<S>, e: S, along: S) {
    let others = |known: usize, d: &mut Force<S>| {
        for k in 0..6 {
            if k != known {
                *d.get_mut(k) = d.get(k) + u.get(k) * e;
            }
        }
    };
    match axis {
        Freedom::Unit(known) => for_component!(*known, |known| {
            others(known, d);
            *d.get_mut(known) = along;
        }),
        Freedom::Screw(h) => {
            others(5, d);
            d.ang[2] = along - *h * d.lin[2];
        }
    }
}
