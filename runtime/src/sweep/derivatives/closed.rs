//! Derivatives of mechanisms with loops and couplings: the constrained problem is differentiated as a whole.
//!
//! Velocities and multipliers solve `M v + Φᵀσ = p`, `Φ v = b`. With the matrix `K` of this problem, which the sweeps of
//! the rates have factored, and with partial derivatives at fixed `v` and `σ`,
//!
//! ```text
//! B⁺ = ∂(M v + Φᵀσ)/∂q = B + A,    R = ∂(Φ v − b)/∂q
//! K [∂v/∂q; ∂σ/∂q] = −[B⁺; R],     K [∂v/∂p; ∂σ/∂p] = [1; 0]
//! ∂ṗ/∂q = C⁺ + Y ∂v/∂q + Z ∂σ/∂q + G ∂v/∂q,    ∂ṗ/∂p = ad(v) + Y ∂v/∂p + Z ∂σ/∂p + G ∂v/∂p
//! ```
//!
//! Rows that are left out as redundant have no multiplier, here as in the rates.
//!
//! **Canonical constraints.** Where `ṗ` is that of `L = ½ vᵀM v + σᵀΦ v`, `Y = B⁺ᵀ` and `Z = Rᵀ`: then `∂ṗ/∂p` is
//! `−(∂v/∂q)ᵀ` with what single joints add, as for trees, and `∂ṗ/∂q` is symmetric and formed by halves, without
//! `∂σ/∂p`. This holds for rows that are the derivatives of residuals at all poses, for couplings, and for joints to the
//! ground, whose rows are constants in a body: their wrench `E σ` is a momentum that is fixed to this body. It is added
//! to `P*`, and the sweeps over pairs of joints take it with all other momenta.
//!
//! **Other constraints.** `Φ̇ᵀσ` is their part of `ṗ`, so `Y = Bᵀ + A` and `Z` is its derivative with respect to `σ`.
//!
//! **Loops** are treated in the axes of the second frame `B`, with moments about its origin. Let `s_a` be the motion of `B`
//! relative to `A` at a unit rate of freedom `a`, `Ω_a` that of the body before its joint relative to `A`, and `Ω` that of
//! `B`; `f = Σ E σ` the wrench, `E'(s)` the rate of the directions `E` along `s`, and `f'`, `f°` the sums of `E'(s_k) σ` and
//! `E'(Ω) σ`. A change of `q_k` turns the axis `s_a` if `B` is carried past it (`k` outboard of `a` towards `B`) or the axis is
//! carried with `A` past `k`: `∂s_a = −s_k × s_a`. So
//!
//! | | |
//! | --- | --- |
//! | `A_ak = f' · s_a` | `+ φ · s_a` |
//! | `C⁺_ak = ∂_k f° · s_a − f' · ((Ω − Ω_a) × s_a)` | `+ χ · s_a + φ · (Ω_a × s_a)` |
//! | `Z_ar = E_r'(Ω) · s_a − E_r · ((Ω − Ω_a) × s_a)` | |
//! | `R_rk = E_r · (Ω_k × s_k) + E_r'(s_k) · Ω` | and the decay |
//!
//! with `φ = s_k × f` and `χ = Ω_k × φ + s_k × ((Ω − Ω_k) × f + f°)`, which are added only if `k` turns `a`. The joint's own
//! motion is left out of `Ω_a`: its part is in `ad(v)`. Of two freedoms of different joints, one turns the other and not the
//! reverse; where the constraint is canonical, `A` and `C⁺` are symmetric between them, and the shorter of the two entries
//! serves for both. Derivatives of `E` are those of dual numbers through the directions of one loop; most kinds have constant
//! directions.

use alloc::vec;
use alloc::vec::Vec;
use core::mem::take;

use super::loop_path::LoopFreedom;
use super::pairs::add;
use super::{velocity, Derivatives};
use crate::lists::array;
use crate::spatial::{Force, Motion};
use crate::sweep::{Inputs, Quantity, Sweeps, Trace};
use crate::tree::{Bond, Closure, Constraint, Cut, Tree};
use crate::workspace::{Relative, Workspace};
use crate::Scalar;

/// A loop in the axes of its second frame `B`.
struct Loop<'a, S> {
    constraint: &'a Constraint<S>,
    closure: &'a Closure<S>,
    at: Relative<S>,
    /// Multipliers of its rows.
    sigma: &'a [S],
    /// `Ω`: motion of the second frame relative to the first.
    motion: Motion<S>,
    /// `E` of every row, and `E'(Ω)`.
    directions: [Force<S>; 6],
    rates: [Force<S>; 6],
    /// `f` and `f°`.
    f: Force<S>,
    turning: Force<S>,
}

/// `Σ E σ`.
fn wrench<S: Scalar>(directions: &[Force<S>; 6], sigma: &[S]) -> Force<S> {
    directions.iter().zip(sigma).fold(Force::zero(), |sum, (e, sigma)| sum.plus(&e.times(*sigma)))
}

/// Partial derivatives and columns of mechanisms with constraints; empty for all others.
#[derive(Clone, Debug)]
pub(super) struct Closed<S> {
    /// Whether a constraint is not canonical.
    mixed: bool,
    /// `A` of the loops that are not canonical.
    bend: Vec<S>,
    /// `R`, row by row.
    rows: Vec<S>,
    /// `Y`, where a constraint is not canonical.
    y: Vec<S>,
    /// `Z`, where a constraint is not canonical; one row for each velocity.
    z: Vec<S>,
    /// `∂σ/∂q` and `∂σ/∂p`, row by row.
    multipliers: [Vec<S>; 2],
    /// Momenta without those of the loops that are not canonical.
    held: Vec<S>,
    /// A right-hand side.
    load: Vec<S>,
    /// One multiplier for each row.
    sigma: Vec<S>,
    /// Freedoms of one loop.
    pub path: Vec<LoopFreedom<S>>,
}

impl<S: Scalar> Closed<S> {
    pub fn new(tree: &Tree<S>) -> Self {
        let any = !tree.constraints.is_empty();
        let mixed = tree.constraints.iter().any(|c| !c.canonical());
        let nv = if any { tree.dims.nv } else { 0 };
        let list = |n: usize| vec![S::zero(); n];
        let freedoms = |constraint: &Constraint<S>| match &constraint.bond {
            Bond::Cut(cut) => cut.path_a.iter().chain(&cut.path_b).map(|&i| tree.nodes[i].kind.nv()).sum(),
            Bond::Coupling { .. } => 0_usize,
        };
        let longest = tree.constraints.iter().map(freedoms).max().unwrap_or(0);
        let rows = tree.dims.rows;
        Closed {
            mixed,
            bend: list(if mixed { nv * nv } else { 0 }),
            rows: list(rows * nv),
            y: list(if mixed { nv * nv } else { 0 }),
            z: list(if mixed { nv * rows } else { 0 }),
            multipliers: [list(rows * nv), list(rows * nv)],
            held: list(nv),
            load: list(nv),
            sigma: list(rows),
            path: Vec::with_capacity(longest),
        }
    }

    /// Sets all sums to zero.
    pub fn begin(&mut self) {
        for list in [&mut self.bend, &mut self.rows, &mut self.z] {
            list.fill(S::zero());
        }
    }
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// [`Sweeps::derivatives`] of a mechanism with constraints, after the composite columns.
    pub(super) fn closed_derivatives(&self, p: &[S], u: &Inputs<S>, w: &mut Workspace<S>, d: &mut Derivatives<S>) {
        self.velocities_of_steps(p, u, w, &mut d.v);
        self.outward(u, w, d);
        d.closed.held.copy_from_slice(p);
        for (index, constraint) in self.tree.constraints.iter().enumerate() {
            self.trace.at(None, Quantity::Derivative);
            match &constraint.bond {
                Bond::Cut(cut) if constraint.gauge() => self.fixed_wrench(constraint, cut, w, d),
                Bond::Cut(cut) => self.loop_products(index, constraint, cut, w, d),
                Bond::Coupling { terms, .. } => {
                    let Some(decay) = constraint.decay else { continue };
                    let rate = self.if_acts(constraint.first, decay);
                    for (i, ratio) in terms {
                        let Some(v) = velocity(&self.tree.nodes[*i]) else { continue };
                        let node = self.tree.nodes[*i].ratio;
                        add(&mut d.closed.rows[constraint.first * self.tree.dims.nv + v], rate * (*ratio * node));
                    }
                }
            }
        }
        self.joint_momenta(w, d);
        self.pair_products(p, u, w, d);
        self.wrench_products(u, w, d);
        self.springs(w, d);
        self.other_products(d);
        self.closed_columns(u, w, d);
        self.closed_blocks(d);
        let held = take(&mut d.closed.held);
        self.own_blocks(&held, d);
        d.closed.held = held;
    }

    /// A joint to the ground: its wrench as a momentum of the body, and its rows of `R`.
    fn fixed_wrench(&self, constraint: &Constraint<S>, cut: &Cut<S>, w: &Workspace<S>, d: &mut Derivatives<S>) {
        let (nv, Some(b)) = (self.tree.dims.nv, cut.b.node) else { return };
        let to_columns = |f: Force<S>| self.past_columns(&w.poses, b).iter().rev().fold(f, |f, step| step.force(&f));
        let mut sum = Force::zero();
        for r in constraint.range() {
            let seed = w.constraints.rows[r].at_b;
            sum = sum.plus(&seed.times(w.constraints.multipliers[r]));
            cut.path_b.iter().rev().fold(to_columns(seed), |f, &i| {
                let node = &self.tree.nodes[i];
                for k in (0..node.kind.nv()).filter(|_| velocity(node).is_some()) {
                    let v = velocity(node).map_or(k, |v| v + k);
                    add(&mut d.closed.rows[r * nv + v], node.ratio * f.dot(&d.psi[w.first[i] + k]));
                }
                self.force_inward(&w.poses, i, &f)
            });
        }
        // As far as momenta are summed over the columns, here too; from there on they are carried.
        if !d.summed[b] {
            d.rest[b] = d.rest[b].plus(&sum);
            return;
        }
        let (mut at, mut f) = (b, to_columns(sum));
        loop {
            d.rest[at] = d.rest[at].plus(&f);
            let Some(parent) = self.tree.nodes[at].parent.filter(|&p| d.summed[p]) else { return };
            f = self.force_inward(&w.poses, at, &f);
            at = parent;
        }
    }

    /// Partial derivatives of a loop whose wrench is no momentum of a body.
    fn loop_products(
        &self,
        index: usize,
        constraint: &Constraint<S>,
        cut: &Cut<S>,
        w: &Workspace<S>,
        d: &mut Derivatives<S>,
    ) {
        let motion = self.loop_freedoms(index, cut, w, d);
        self.trace.at(None, Quantity::Derivative);
        let at = w.constraints.relative[index];
        let (rates, zero) = (cut.closure.direction_rates(&at, &motion), Force::zero());
        let sigma = &w.constraints.multipliers[constraint.range()];
        let directions: [Force<S>; 6] = array(|r| match r < sigma.len() {
            true => w.constraints.rows[constraint.first + r].e,
            false => zero,
        });
        let [f, turning] = [&directions, &rates].map(|e| wrench(e, sigma));
        let of = Loop { constraint, closure: &cut.closure, at, sigma, motion, directions, rates, f, turning };
        let path = take(&mut d.closed.path);
        for k in &path {
            self.loop_column(&of, k, &path, d);
        }
        for a in &path {
            self.loop_momentum(&of, a, d);
        }
        d.closed.path = path;
    }

    /// `A`, `C⁺` and `R` of a loop for a change of the coordinate of freedom `k`.
    fn loop_column(&self, of: &Loop<S>, k: &LoopFreedom<S>, path: &[LoopFreedom<S>], d: &mut Derivatives<S>) {
        let (nv, Some(b)) = (self.tree.dims.nv, k.velocity) else { return };
        let Loop { constraint, closure, at, motion, .. } = of;
        let (ratio, canonical) = (self.tree.nodes[k.node].ratio, constraint.canonical());
        let psi = k.turn();
        let turned = closure.direction_rates(at, &k.axis);
        let bent = closure.bent_rates(at, motion, &k.axis, &psi);
        let [f_k, turning_k] = [&turned, &bent].map(|e| wrench(e, of.sigma));
        let phi = k.axis.cross_force(&of.f);
        let chi = k.chi(motion, &of.f, &of.turning, &phi);
        for a in path {
            let Some(v) = a.velocity else { continue };
            let both = self.tree.nodes[a.node].ratio * ratio;
            let turned = a.turned_by(k);
            let mirrored = canonical && a.node != k.node;
            if mirrored && turned {
                continue;
            }
            let (mut x, mut c) = (f_k.dot(&a.axis), turning_k.dot(&a.axis) - f_k.dot(&a.swing(motion)));
            if turned {
                x = x + phi.dot(&a.axis);
                c = c + chi.dot(&a.axis) + phi.dot(&a.turn());
            }
            let bend = if canonical { &mut d.b } else { &mut d.closed.bend };
            add(&mut bend[v * nv + b], both * x);
            add(&mut d.dpd_dq[v * nv + b], both * c);
            if mirrored {
                add(&mut bend[b * nv + v], both * x);
                add(&mut d.dpd_dq[b * nv + v], both * c);
            }
        }
        let residuals = constraint.decay.map(|decay| {
            let acts = self.if_acts(constraint.first, decay);
            closure.residual_rates(at, &k.axis).map(|x| acts * x)
        });
        for (r, row) in constraint.range().enumerate() {
            let held = residuals.filter(|_| constraint.holonomic(r)).map_or(S::zero(), |x| x[r]);
            let x = of.directions[r].dot(&psi) + turned[r].dot(motion) + held;
            add(&mut d.closed.rows[row * nv + b], ratio * x);
        }
    }

    /// The part of a loop in `ṗ` of freedom `a`; and that in its momentum and in `Z`, where the constraint is not canonical.
    fn loop_momentum(&self, of: &Loop<S>, a: &LoopFreedom<S>, d: &mut Derivatives<S>) {
        let Some(v) = a.velocity else { return };
        let (ratio, rows) = (self.tree.nodes[a.node].ratio, self.tree.dims.rows);
        let swing = a.swing(&of.motion);
        add(&mut d.pd[v], ratio * (of.turning.dot(&a.axis) - of.f.dot(&swing)));
        if of.constraint.canonical() {
            return;
        }
        add(&mut d.closed.held[v], -(ratio * of.f.dot(&a.axis)));
        for (r, row) in of.constraint.range().enumerate() {
            let x = of.rates[r].dot(&a.axis) - of.directions[r].dot(&swing);
            add(&mut d.closed.z[v * rows + row], ratio * x);
        }
    }

    /// `Y`, `Z` and the rest of `B⁺`, where a constraint is not canonical.
    fn other_products(&self, d: &mut Derivatives<S>) {
        let (nv, rows) = (self.tree.dims.nv, self.tree.dims.rows);
        let Derivatives { closed, b, .. } = d;
        if !closed.mixed {
            return;
        }
        self.trace.at(None, Quantity::Derivative);
        for x in 0..nv {
            for c in 0..nv {
                closed.y[x * nv + c] = b[c * nv + x] + closed.bend[x * nv + c];
            }
        }
        for (b, bend) in b.iter_mut().zip(&closed.bend) {
            *b = *b + *bend;
        }
        for constraint in self.tree.constraints.iter().filter(|c| c.canonical()) {
            for r in constraint.range() {
                for x in 0..nv {
                    closed.z[x * rows + r] = closed.rows[r * nv + x];
                }
            }
        }
    }

    /// Columns of `∂v` and `∂σ`.
    fn closed_columns(&self, u: &Inputs<S>, w: &mut Workspace<S>, d: &mut Derivatives<S>) {
        let nv = self.tree.dims.nv;
        let mut load = take(&mut d.closed.load);
        let mut sigma = take(&mut d.closed.sigma);
        for c in 0..nv {
            for (a, x) in load.iter_mut().enumerate() {
                *x = -d.b[a * nv + c];
            }
            for (r, x) in w.constraints.rhs.iter_mut().enumerate() {
                *x = -d.closed.rows[r * nv + c];
            }
            self.solve_column(&load, u, w, &mut d.list, &mut sigma);
            (0..nv).for_each(|a| d.dv_dq[a * nv + c] = d.list[a]);
            sigma.iter().enumerate().for_each(|(r, x)| d.closed.multipliers[0][r * nv + c] = *x);
            load.fill(S::zero());
            load[c] = S::one();
            w.constraints.rhs.fill(S::zero());
            self.solve_column(&load, u, w, &mut d.list, &mut sigma);
            // One half: it is symmetric.
            for a in 0..=c {
                (d.dv_dp[a * nv + c], d.dv_dp[c * nv + a]) = (d.list[a], d.list[a]);
            }
            sigma.iter().enumerate().for_each(|(r, x)| d.closed.multipliers[1][r * nv + c] = *x);
        }
        (d.closed.load, d.closed.sigma) = (load, sigma);
    }

    /// The blocks of `ṗ` but for what [`Sweeps::own_blocks`] adds.
    fn closed_blocks(&self, d: &mut Derivatives<S>) {
        let (nv, rows) = (self.tree.dims.nv, self.tree.dims.rows);
        self.trace.at(None, Quantity::Derivative);
        let Derivatives { closed, b, dv_dq, dv_dp, dpd_dq, dpd_dp, .. } = d;
        if closed.mixed {
            for x in 0..nv {
                for c in 0..nv {
                    let product = |of: &[S], multipliers: &[S]| {
                        let first = (0..nv).fold(S::zero(), |sum, k| sum + closed.y[x * nv + k] * of[k * nv + c]);
                        (0..rows).fold(first, |sum, r| sum + closed.z[x * rows + r] * multipliers[r * nv + c])
                    };
                    add(&mut dpd_dq[x * nv + c], product(dv_dq, &closed.multipliers[0]));
                    dpd_dp[x * nv + c] = product(dv_dp, &closed.multipliers[1]);
                }
            }
            return;
        }
        for x in 0..nv {
            for c in 0..=x {
                let first = (0..nv).fold(S::zero(), |sum, k| sum + b[k * nv + x] * dv_dq[k * nv + c]);
                let multipliers = &closed.multipliers[0];
                let sum = (0..rows).fold(first, |sum, r| sum + closed.rows[r * nv + x] * multipliers[r * nv + c]);
                add(&mut dpd_dq[x * nv + c], sum);
                if x != c {
                    add(&mut dpd_dq[c * nv + x], sum);
                }
                dpd_dp[x * nv + c] = -dv_dq[c * nv + x];
                dpd_dp[c * nv + x] = -dv_dq[x * nv + c];
            }
        }
    }
}
