//! The linear problem behind both levels: momenta to velocities, forces to accelerations.
//!
//! With `M'`, `U`, `Mj` known, right-hand sides travel back (`D`, 4.49, 4.45) and motions forth (4.40). On the velocity
//! level the right-hand side is `p` and nothing else; on the acceleration level it is the joint force, and every body
//! starts with the wrench it needs for a reference motion (`acceleration.rs`).

use super::{name, Inputs, Quantity, Sweeps, Trace};
use crate::spatial::{Force, Motion};
use crate::tree::{Freedom, Source, Unknown};
use crate::workspace::{Factor, Poses, Solution, Workspace};
use crate::Scalar;

/// A right-hand side.
#[derive(Clone, Copy, Debug)]
pub struct Load<'a, S> {
    /// For each velocity index: `p` or joint force.
    pub p: &'a [S],
    /// For each prescribed freedom: rate or acceleration.
    pub drive: &'a [S],
    /// `D` of every body by itself.
    pub seeds: Option<&'a [Force<S>]>,
    /// For each row of the constraints: what their motion is to be.
    pub rows: &'a [S],
    /// What the motion is, for the listener.
    pub what: Quantity,
}

impl<'a, S: Scalar> Load<'a, S> {
    /// Velocity level: momenta `p`, prescribed rates, and `b` of the constraints.
    pub fn velocities(p: &'a [S], u: &Inputs<'a, S>, rows: &'a [S]) -> Self {
        Load { p, drive: u.drive_v, seeds: None, rows, what: Quantity::Velocity }
    }

    /// Acceleration level: joint forces `p`, prescribed accelerations, `D` of every body, and what the constraints lack.
    pub fn accelerations(p: &'a [S], drive: &'a [S], seeds: &'a [Force<S>], rows: &'a [S]) -> Self {
        Load { p, drive, seeds: Some(seeds), rows, what: Quantity::Acceleration }
    }
}

impl<S> Load<'_, S> {
    /// Letters of `Ω̂`, `Ω` and the rates, or of what takes their place.
    fn letters(&self) -> [&'static str; 3] {
        match self.what {
            Quantity::Velocity => ["hat", "omega", "v"],
            Quantity::Acceleration => ["hatd", "omegad", "a"],
            _ => ["hatx", "omegax", "dq"],
        }
    }
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Solves for rates (or accelerations).
    pub(super) fn solve(
        &self,
        poses: &Poses<S>,
        first: &[usize],
        f: &Factor<S>,
        load: &Load<S>,
        sol: &mut Solution<S>,
    ) {
        self.bias_momentum_begin(load, sol);
        for i in (0..self.tree.nodes.len()).rev() {
            self.bias_momentum_node(i, poses, first, f, load, sol);
        }
        self.bias_momentum_ground(f, load, sol);
        self.motion_ground(f, load, sol);
        for i in 0..self.tree.nodes.len() {
            self.motion_node(i, poses, first, f, load, sol);
        }
    }

    /// Before the first [`Sweeps::bias_momentum_node`].
    pub fn bias_momentum_begin(&self, load: &Load<S>, sol: &mut Solution<S>) {
        match load.seeds {
            Some(seeds) => sol.d.copy_from_slice(seeds),
            None => sol.d.fill(Force::zero()),
        }
        // `unknown_rate` holds the momentum remainder of open coordinates until the forward sweep overwrites it.
        sol.unknown_rate.fill(S::zero());
    }

    /// `D`, `D'` and `(p − d) / Mj` of node `i`, all nodes behind it being done.
    pub fn bias_momentum_node(
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
        let mut d = self.leaving(poses, i).rev().fold(sol.d[i], |d, step| step.force(&d)); // D_i (4.49)
        for (k, &g) in node.elimination.solve_before.iter().enumerate() {
            let e = self.shared_remainder(g, f, load, sol, node.elimination.open_before(k + 1));
            d = d.plus(&f.unknown_pivots[g].u.times(e));
        }
        for k in 0..node.kind.nv() {
            self.remainder(i, k, first[i] + k, f, load, sol, &mut d);
        }
        for (k, &g) in node.elimination.solve_after.iter().enumerate() {
            let e = self.shared_remainder(g, f, load, sol, node.elimination.open_after(k + 1));
            d = d.plus(&f.unknown_pivots[g].u.times(e));
        }
        sol.d[i] = d; // D'_i (4.45)
        name::force(self.trace, "dp", &d);
        if let Some(parent) = node.parent {
            let carried = self.entering(poses, i).rev().fold(d, |d, step| step.force(&d));
            sol.d[parent] = sol.d[parent].plus(&carried);
        }
    }

    /// After the last [`Sweeps::bias_momentum_node`]: coordinates solved at the ground.
    pub fn bias_momentum_ground(&self, f: &Factor<S>, load: &Load<S>, sol: &mut Solution<S>) {
        let ground = &self.tree.solve_at_ground;
        for (k, &g) in ground.iter().enumerate() {
            self.shared_remainder(g, f, load, sol, ground[k + 1..].iter().copied());
        }
    }

    /// Own freedom `k` of node `i` in the backward sweep.
    fn remainder(
        &self,
        i: usize,
        k: usize,
        freedom: usize,
        f: &Factor<S>,
        load: &Load<S>,
        sol: &mut Solution<S>,
        d: &mut Force<S>,
    ) {
        let node = &self.tree.nodes[i];
        let ng = self.tree.unknowns.len();
        let axis = node.kind.axis(k);
        let pivot = &f.pivots[freedom];
        if let Some(g) = node.elimination.unknown {
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
        for h in node.elimination.open_after(0) {
            sol.unknown_rate[h] = sol.unknown_rate[h] + f.cross[freedom * ng + h] * e;
        }
        sol.e[freedom] = e;
    }

    /// A shared coordinate in the backward sweep; gives its `(p − d) / Mj`.
    fn shared_remainder(
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
    pub fn motion_ground(&self, f: &Factor<S>, load: &Load<S>, sol: &mut Solution<S>) {
        let ground = &self.tree.solve_at_ground;
        for (k, &g) in ground.iter().enumerate().rev() {
            self.trace.at(None, load.what);
            self.shared_motion(g, f, &Motion::zero(), ground[k + 1..].iter().copied(), sol);
        }
    }

    /// `Ω̂`, rates and `Ω` of node `i`, its parent being done.
    pub fn motion_node(
        &self,
        i: usize,
        poses: &Poses<S>,
        first: &[usize],
        f: &Factor<S>,
        load: &Load<S>,
        sol: &mut Solution<S>,
    ) {
        let ng = self.tree.unknowns.len();
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), load.what);
        let outer = node.parent.map_or(Motion::zero(), |p| sol.omega[p]);
        let hat = self.entering(poses, i).fold(outer, |m, step| step.motion(&m));
        sol.hat[i] = hat; // Ω̂_i
        let [hat_letter, letter, rate_letter] = load.letters();
        name::motion(self.trace, hat_letter, &hat);
        for (k, &g) in node.elimination.solve_after.iter().enumerate().rev() {
            self.shared_motion(g, f, &hat, node.elimination.open_after(k + 1), sol);
        }
        let mut omega = hat;
        for k in (0..node.kind.nv()).rev() {
            let freedom = first[i] + k;
            let axis = node.kind.axis(k);
            let rate = match (node.elimination.unknown, node.source) {
                (Some(g), _) => node.ratio * sol.unknown_rate[g],
                (None, Source::Drive { .. }) => sol.e[freedom],
                (None, Source::State { .. }) => {
                    let pivot = &f.pivots[freedom];
                    let open = |rate: S, h| rate - pivot.rho * f.cross[freedom * ng + h] * sol.unknown_rate[h];
                    if let Freedom::Unit(z) = axis {
                        // Ω along E comes first and the rate as a difference: nothing is taken off to be added again.
                        let mut row = pivot.k;
                        *row.get_mut(z) = -(pivot.armature * pivot.rho);
                        let total = sol.e[freedom] - row.dot(&omega);
                        let total = node.elimination.open_after(0).fold(total, open);
                        sol.rate[freedom] = total - omega.get(z); // (4.40)
                        self.trace.name(sol.rate[freedom], rate_letter, "");
                        *omega.get_mut(z) = total;
                        continue;
                    }
                    let rate = sol.e[freedom] - pivot.k.dot(&omega); // (4.40)
                    node.elimination.open_after(0).fold(rate, open)
                }
            };
            sol.rate[freedom] = rate;
            self.trace.name(rate, rate_letter, "");
            axis.add_to(&mut omega, rate);
        }
        for (k, &g) in node.elimination.solve_before.iter().enumerate().rev() {
            self.shared_motion(g, f, &omega, node.elimination.open_before(k + 1), sol);
        }
        sol.omega[i] = self.leaving(poses, i).fold(omega, |m, step| step.motion(&m)); // Ω_i
        name::motion(self.trace, letter, &sol.omega[i]);
    }

    fn shared_motion(
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

    /// Velocity level: `p → Ω, v`.
    pub(super) fn solve_velocities(&self, p: &[S], u: &Inputs<S>, w: &mut Workspace<S>) {
        let load = Load::velocities(p, u, &w.constraints.rhs);
        self.solve(&w.poses, &w.first, &w.factor, &load, &mut w.velocity);
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
        self.leaving(poses, i).fold(f.m[i].times(&motion).plus(&d), |f, step| step.force_back(&f))
    }

    /// The motion that `M'` of node `i` acts on and what is to be added to it, in the frame it is eliminated in: `Ω̂` and
    /// `D'` with what the open coordinates add. A freedom that is solved further inboard leaves `M*` whole: then `Ω`
    /// takes the place of `Ω̂`, and the freedom's own column, `M* E`, is in `M*` already.
    pub(super) fn acting(&self, first: &[usize], f: &Factor<S>, sol: &Solution<S>, i: usize) -> (Motion<S>, Force<S>) {
        let (n, node) = (self.tree.nodes.len(), &self.tree.nodes[i]);
        let (mut motion, mut own) = (sol.hat[i], None);
        if node.elimination.deferred {
            node.kind.axis(0).add_to(&mut motion, sol.rate[first[i]]);
            own = node.elimination.unknown;
        }
        let open = node.elimination.open.iter().chain(&node.elimination.ends).filter(|&&g| Some(g) != own);
        (motion, open.fold(sol.d[i], |d, &g| d.plus(&f.columns[g * n + i].times(sol.unknown_rate[g]))))
    }

    /// Rates of the state's velocities out of the nodes.
    pub fn collect_rates(&self, sol: &Solution<S>, first: &[usize], v: &mut [S]) {
        for (i, node) in self.tree.nodes.iter().enumerate() {
            if let (Source::State { v: at, .. }, None) = (node.source, node.elimination.unknown) {
                let nv = node.kind.nv();
                v[at..at + nv].copy_from_slice(&sol.rate[first[i]..first[i] + nv]);
            }
        }
        for (g, shared) in self.tree.unknowns.iter().enumerate() {
            if let Unknown::Velocity(at) = *shared {
                v[at] = sol.unknown_rate[g];
            }
        }
    }
}

/// `D' = D + U e` (4.45), the component along `E` being known: `EᵀD' = p − armature · e`.
fn reduce<S: Scalar>(axis: &Freedom<S>, d: &mut Force<S>, u: &Force<S>, e: S, along: S) {
    let known = match axis {
        Freedom::Unit(k) => *k,
        Freedom::Screw(_) => 5,
    };
    for k in (0..6).filter(|&k| k != known) {
        *d.get_mut(k) = d.get(k) + u.get(k) * e;
    }
    *d.get_mut(known) = match axis {
        Freedom::Unit(_) => along,
        Freedom::Screw(h) => along - *h * d.lin[2],
    };
}
