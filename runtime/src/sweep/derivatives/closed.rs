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

use super::pairs::add;
use super::{single, velocity, Derivatives};
use crate::spatial::{dot3, scale3, Force, Motion};
use crate::sweep::constraint::difference;
use crate::sweep::jacobian::before;
use crate::sweep::{Inputs, Quantity, Sweeps, Trace};
use crate::tree::{Bond, Constraint, Cut, Tree};
use crate::workspace::Workspace;
use crate::Scalar;

/// A freedom on the path of a loop, in axes of the second frame.
#[derive(Clone, Copy, Debug)]
struct LoopFreedom<S> {
    /// Its node.
    node: usize,
    /// Whether it is on the path to the second frame.
    second: bool,
    /// Its velocity, if it belongs to the state.
    velocity: Option<usize>,
    /// Its rate.
    rate: S,
    /// Motion of the second frame relative to the first at a unit rate.
    axis: Motion<S>,
    /// Motion of the body before the joint, relative to the first frame.
    inner: Motion<S>,
    /// The same of the body behind the joint.
    outer: Motion<S>,
    /// `(Ω_outer − Ω_inner) × s`: zero, and known to be, where the joint has no other freedom.
    twist: Motion<S>,
}

impl<S> LoopFreedom<S> {
    /// Whether a change of the coordinate of `other` turns this axis.
    fn turned_by(&self, other: &Self) -> bool {
        match self.second {
            true => other.second && other.node > self.node,
            false => other.second || other.node <= self.node,
        }
    }
}

/// Of the motions before and behind a joint with one freedom, either serves in products with its axis: that one is taken
/// which is known to be zero at an end of the loop.
impl<S: Scalar> LoopFreedom<S> {
    /// `Ω_a × s_a`.
    fn turn(&self) -> Motion<S> {
        match self.second {
            true => self.inner.cross_motion(&self.axis),
            false => difference(&self.outer.cross_motion(&self.axis), &self.twist),
        }
    }

    /// `(Ω − Ω_a) × s_a`, with the motion `Ω` of the second frame.
    fn swing(&self, motion: &Motion<S>) -> Motion<S> {
        difference(motion, &self.outer).cross_motion(&self.axis).plus(&self.twist)
    }

    /// `χ`, with the motion of the second frame, `f`, `f°` and `φ`.
    fn chi(&self, motion: &Motion<S>, f: &Force<S>, turning: &Force<S>, phi: &Force<S>) -> Force<S> {
        let ahead = difference(motion, &self.outer).cross_force(f).plus(turning);
        let all = self.outer.cross_force(phi).plus(&self.axis.cross_force(&ahead));
        all.minus(&self.twist.cross_force(f))
    }
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
    path: Vec<LoopFreedom<S>>,
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

    /// The freedoms of a loop, and the motion of its second frame relative to the first.
    fn loop_freedoms(&self, index: usize, cut: &Cut<S>, w: &Workspace<S>, d: &mut Derivatives<S>) -> Motion<S> {
        let (o, one) = (S::zero(), S::one());
        let (path, rates) = (&mut d.closed.path, &d.rate);
        path.clear();
        let mut push = |second: bool, i: usize, k: usize, [x, y, z, a, b, c]: [S; 6]| {
            let node = &self.tree.nodes[i];
            let sign = if second { one } else { -one };
            let axis = scaled(&Motion { lin: [x, y, z], ang: [a, b, c] }, sign);
            let (velocity, rate) = (velocity(node).map(|v| v + k), rates[w.first[i] + k]);
            let (inner, outer, twist) = (Motion::zero(), Motion::zero(), Motion::zero());
            path.push(LoopFreedom { node: i, second, velocity, rate, axis, inner, outer, twist });
        };
        let at = &w.constraints.relative[index];
        let mut rot = core::array::from_fn(|i| at.axis(i));
        let mut pos = core::array::from_fn(|i| dot3(at.axis(i), at.d));
        self.on_body(&w.poses, &cut.a).rev().for_each(|step| before(&step, &mut rot, &mut pos));
        self.columns_along(cut.path_a.iter().rev().copied(), (rot, pos), w, |i, k, axis| push(false, i, k, axis));
        let (mut rot, mut pos) = ([[one, o, o], [o, one, o], [o, o, one]], [o; 3]);
        self.on_body(&w.poses, &cut.b).for_each(|step| step.pose(&mut rot, &mut pos));
        self.columns_along(cut.path_b.iter().rev().copied(), (rot, pos), w, |i, k, axis| push(true, i, k, axis));
        // Around the loop: inward from the first frame, then outward to the second.
        let mut motion = Motion::zero();
        let sides = [(false, &cut.path_a), (true, &cut.path_b)];
        let order = sides[0].1.iter().rev().map(|i| (false, *i)).chain(sides[1].1.iter().map(|i| (true, *i)));
        for (second, i) in order {
            let here = |x: &&mut LoopFreedom<S>| x.second == second && x.node == i;
            let rates = path.iter_mut().filter(here).map(|x| scaled(&x.axis, x.rate));
            let own = rates.fold(Motion::zero(), |sum, rate| sum.plus(&rate));
            let start = motion;
            motion = motion.plus(&own);
            let (inner, outer, own) = if second { (start, motion, own) } else { (motion, start, scaled(&own, -one)) };
            let several = !single(&self.tree.nodes[i]);
            for x in path.iter_mut().filter(here) {
                (x.inner, x.outer) = (inner, outer);
                x.twist = if several { own.cross_motion(&x.axis) } else { Motion::zero() };
            }
        }
        motion
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
        let (nv, rows) = (self.tree.dims.nv, self.tree.dims.rows);
        let motion = self.loop_freedoms(index, cut, w, d);
        self.trace.at(None, Quantity::Derivative);
        let (at, closure) = (&w.constraints.relative[index], &cut.closure);
        let directions = |r: usize| w.constraints.rows[constraint.first + r].e;
        let wrench = |of: &dyn Fn(usize) -> Force<S>| {
            let sigma = &w.constraints.multipliers[constraint.range()];
            sigma.iter().enumerate().fold(Force::zero(), |sum, (r, sigma)| sum.plus(&of(r).times(*sigma)))
        };
        let rates = closure.direction_rates(at, &motion);
        let (f, turning) = (wrench(&directions), wrench(&|r| rates[r]));
        let path = take(&mut d.closed.path);
        let canonical = constraint.canonical();
        for k in &path {
            let Some(b) = k.velocity else { continue };
            let ratio = self.tree.nodes[k.node].ratio;
            let psi = k.turn();
            let turned = closure.direction_rates(at, &k.axis);
            let bent = closure.bent_rates(at, &motion, &k.axis, &psi);
            let (f_k, turning_k) = (wrench(&|r| turned[r]), wrench(&|r| bent[r]));
            let phi = k.axis.cross_force(&f);
            let chi = k.chi(&motion, &f, &turning, &phi);
            for a in &path {
                let Some(v) = a.velocity else { continue };
                let both = self.tree.nodes[a.node].ratio * ratio;
                let turned = a.turned_by(k);
                let mirrored = canonical && a.node != k.node;
                if mirrored && turned {
                    continue;
                }
                let (mut x, mut c) = (f_k.dot(&a.axis), turning_k.dot(&a.axis) - f_k.dot(&a.swing(&motion)));
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
                let x = directions(r).dot(&psi) + turned[r].dot(&motion) + held;
                add(&mut d.closed.rows[row * nv + b], ratio * x);
            }
        }
        for a in &path {
            let Some(v) = a.velocity else { continue };
            let node = &self.tree.nodes[a.node];
            let swing = a.swing(&motion);
            add(&mut d.pd[v], node.ratio * (turning.dot(&a.axis) - f.dot(&swing)));
            if canonical {
                continue;
            }
            add(&mut d.closed.held[v], -(node.ratio * f.dot(&a.axis)));
            for (r, row) in constraint.range().enumerate() {
                let x = rates[r].dot(&a.axis) - directions(r).dot(&swing);
                add(&mut d.closed.z[v * rows + row], node.ratio * x);
            }
        }
        d.closed.path = path;
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

fn scaled<S: Scalar>(m: &Motion<S>, x: S) -> Motion<S> {
    Motion { lin: scale3(x, m.lin), ang: scale3(x, m.ang) }
}
