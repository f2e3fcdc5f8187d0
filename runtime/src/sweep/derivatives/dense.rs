//! `M = LᵀDL`, solutions with it, and the four blocks put together.

use alloc::vec::Vec;

use super::order::{Across, Meeting, Order};
use super::pairs::{add, bracket, own_motion};
use super::{velocity, Derivatives};
use crate::sweep::{Quantity, Sweeps, Trace};
use crate::system::MomentumDerivatives;
use crate::tree::Node;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// `M = LᵀDL` from the last velocity to the first, and `M⁻¹`.
    pub(super) fn factor_dense(&self, d: &mut Derivatives<S>) {
        self.trace.at(None, Quantity::Pivot);
        let (nv, order) = (self.tree.dims.nv, &d.order);
        for k in (0..nv).rev() {
            d.rho[k] = S::one() / d.l[k * nv + k];
            for i in order.row(k) {
                let f = d.l[k * nv + i] * d.rho[k];
                for j in order.row(k).filter(|&j| j <= i) {
                    let x = f * d.l[k * nv + j];
                    add(&mut d.l[i * nv + j], -x);
                }
                d.l[k * nv + i] = f;
            }
        }
        self.trace.at(None, Quantity::Derivative);
        for across in &order.across {
            self.coefficients(across, order, &d.l, &mut d.across);
        }
        // Row a of M⁻¹ from those above it: L M⁻¹ = D⁻¹ L⁻ᵀ is upper triangular.
        for a in 0..nv {
            for b in 0..=a {
                let through = match order.meeting(a, b) {
                    Meeting::Path => order.shorter(a, b),
                    Meeting::Branch(k) => order.across.get(k as usize),
                    Meeting::Apart => continue,
                };
                let x = match through {
                    Some(across) => {
                        product(&d.across[across.at..], order.path(across.end).map(|j| d.dv_dp[j * nv + b]))
                    }
                    None => {
                        let first = if a == b { d.rho[a] } else { S::zero() };
                        order.row(a).fold(first, |sum, j| sum - d.l[a * nv + j] * d.dv_dp[j * nv + b])
                    }
                };
                d.dv_dp[a * nv + b] = x;
                d.dv_dp[b * nv + a] = x;
            }
        }
    }

    /// The coefficients of one velocity on one path.
    fn coefficients(&self, across: &Across, order: &Order, l: &[S], h: &mut [S]) {
        let row = across.of * self.tree.dims.nv;
        for (place, j) in order.path(across.end).enumerate() {
            h[across.at + place] = match across.longer {
                Some(at) => {
                    let steps = across.steps.iter();
                    steps.fold(h[at + place], |sum, &(factor, own)| sum + h[factor] * h[own + place])
                }
                None => {
                    let steps = across.steps.iter();
                    steps.fold(-l[row + j], |sum, &(factor, own)| sum - l[factor] * h[own + place])
                }
            };
        }
    }

    /// Velocities from `p`, the momenta of prescribed rates in `list` being taken off.
    pub(super) fn solve_dense(&self, p: &[S], d: &mut Derivatives<S>) {
        self.trace.at(None, Quantity::Velocity);
        let (nv, order) = (self.tree.dims.nv, &d.order);
        for (v, (p, drive)) in d.v.iter_mut().zip(p.iter().zip(&d.list)) {
            *v = *p - *drive;
        }
        for k in (0..nv).rev() {
            for i in order.row(k) {
                d.v[i] = d.v[i] - d.l[k * nv + i] * d.v[k];
            }
        }
        for k in 0..nv {
            d.v[k] = order.row(k).fold(d.rho[k] * d.v[k], |sum, i| sum - d.l[k * nv + i] * d.v[i]);
        }
    }

    /// `L⁻ᵀB`, `D⁻¹L⁻ᵀB` and `−Y = −M⁻¹B`.
    pub(super) fn solve_columns(&self, d: &mut Derivatives<S>) {
        self.trace.at(None, Quantity::Derivative);
        let (nv, order) = (self.tree.dims.nv, &d.order);
        for c in 0..nv {
            for k in (0..nv).rev().filter(|&k| order.meeting(k, c) == Meeting::Path) {
                for i in order.row(k) {
                    let x = d.l[k * nv + i] * d.b[k * nv + c];
                    add(&mut d.b[i * nv + c], -x);
                }
            }
            for k in 0..nv {
                let y = match order.meeting(k, c) {
                    Meeting::Path => {
                        let first = d.rho[k] * d.b[k * nv + c];
                        d.scaled[k * nv + c] = first;
                        order.row(k).fold(-first, |sum, i| sum - d.l[k * nv + i] * d.dv_dq[i * nv + c])
                    }
                    Meeting::Branch(m) => {
                        let across = &order.across[m as usize];
                        product(&d.across[across.at..], order.path(across.end).map(|j| d.dv_dq[j * nv + c]))
                    }
                    Meeting::Apart => S::zero(),
                };
                d.dv_dq[k * nv + c] = y;
            }
        }
    }

    /// The blocks of `ṗ`, `C` being in place.
    pub(super) fn assemble(&self, p: &[S], d: &mut Derivatives<S>) {
        let nv = self.tree.dims.nv;
        self.trace.at(None, Quantity::Derivative);
        for a in 0..nv {
            for b in 0..=a {
                let both = (0..nv).filter(|&k| [a, b].iter().all(|&c| d.order.meeting(k, c) == Meeting::Path));
                let sum = both.fold(S::zero(), |sum, k| sum + d.b[k * nv + a] * d.scaled[k * nv + b]);
                add(&mut d.dpd_dq[a * nv + b], -sum);
                if a != b {
                    add(&mut d.dpd_dq[b * nv + a], -sum);
                }
                d.dpd_dp[a * nv + b] = -d.dv_dq[b * nv + a];
                d.dpd_dp[b * nv + a] = -d.dv_dq[a * nv + b];
            }
        }
        self.own_blocks(p, d);
    }

    /// Adds `G ∂v` and `ad(v)` to the blocks of `ṗ`.
    pub(super) fn own_blocks(&self, p: &[S], d: &mut Derivatives<S>) {
        let nv = self.tree.dims.nv;
        for (i, node) in self.tree.nodes.iter().enumerate() {
            let Some(v) = velocity(node) else { continue };
            self.trace.at(Some(i), Quantity::Derivative);
            for (a, b) in pairs(node) {
                let (g, turned) = own_terms(node, &p[v..], &d.v[v..], a, b);
                self.add_rows(v + a, v + b, g, d);
                add(&mut d.dpd_dp[(v + a) * nv + v + b], turned);
            }
        }
    }

    /// `p`, and the blocks at given velocities: `∂p/∂v = M`, `∂p/∂q = B`, `∂ṗ/∂v = Bᵀ + G + ad(v) M`,
    /// `∂ṗ/∂q = C + ad(v) B`; `M` and `C` are in place, the rest goes into `out`.
    pub(super) fn assemble_momentum(&self, d: &Derivatives<S>, out: &mut MomentumDerivatives<Vec<S>, Vec<S>>) {
        let nv = self.tree.dims.nv;
        self.trace.at(None, Quantity::Derivative);
        for a in 0..nv {
            for b in 0..nv {
                out.dp_dq[a * nv + b] = d.b[a * nv + b];
                out.dp_dv[a * nv + b] = d.l[a.max(b) * nv + a.min(b)];
                out.dpd_dq[a * nv + b] = d.dpd_dq[a * nv + b];
                out.dpd_dv[a * nv + b] = d.b[b * nv + a];
            }
        }
        for (i, node) in self.tree.nodes.iter().enumerate() {
            let Some(v) = velocity(node) else { continue };
            self.trace.at(Some(i), Quantity::Derivative);
            for (a, b) in pairs(node) {
                let (g, turned) = own_terms(node, &out.p[v..], &d.v[v..], a, b);
                add(&mut out.dpd_dv[(v + a) * nv + v + b], g);
                for c in 0..nv {
                    let (x, y) = (turned * out.dp_dv[(v + b) * nv + c], turned * out.dp_dq[(v + b) * nv + c]);
                    add(&mut out.dpd_dv[(v + a) * nv + c], x);
                    add(&mut out.dpd_dq[(v + a) * nv + c], y);
                }
            }
        }
    }

    /// `p = M v` and what prescribed rates (in `list`) add; `M` is not factored yet.
    pub(super) fn momentum_dense(&self, v: &[S], d: &mut Derivatives<S>, p: &mut [S]) {
        let nv = self.tree.dims.nv;
        self.trace.at(None, Quantity::Momentum);
        p.copy_from_slice(&d.list);
        for a in 0..nv {
            for b in (0..nv).filter(|&b| d.order.meeting(a, b) == Meeting::Path) {
                p[a] = p[a] + d.l[a.max(b) * nv + a.min(b)] * v[b];
            }
        }
        d.v.copy_from_slice(v);
    }

    /// Adds `g` times row `b` of `∂v` to row `a` of `∂ṗ`.
    fn add_rows(&self, a: usize, b: usize, g: S, d: &mut Derivatives<S>) {
        let nv = self.tree.dims.nv;
        for c in 0..nv {
            let (x, y) = (g * d.dv_dp[b * nv + c], g * d.dv_dq[b * nv + c]);
            add(&mut d.dpd_dp[a * nv + c], x);
            add(&mut d.dpd_dq[a * nv + c], y);
        }
    }
}

/// `Σ h x`.
fn product<S: Scalar>(h: &[S], x: impl Iterator<Item = S>) -> S {
    h.iter().zip(x).fold(S::zero(), |sum, (h, x)| sum + *h * x)
}

/// Pairs of a node's own freedoms.
fn pairs<S: Scalar>(node: &Node<S>) -> impl Iterator<Item = (usize, usize)> {
    let n = node.kind.nv();
    (0..n).flat_map(move |a| (0..n).map(move |b| (a, b)))
}

/// `G_ab` and `ad(v)_ab`, from a node's own momenta and velocities.
fn own_terms<S: Scalar>(node: &Node<S>, p: &[S], v: &[S], a: usize, b: usize) -> (S, S) {
    let (n, kind) = (node.kind.nv(), &node.kind);
    if n == 1 {
        // Damping: no other part.
        return (-(node.ratio * node.ratio * node.passive[0].damping), S::zero());
    }
    let unit = kind.axis(b).motion(S::one());
    let turned = bracket(kind, &own_motion(node, v), a, b);
    // The momentum of the body alone: that of the rotors does not turn with it.
    let momentum = |c: usize| p[c] - node.passive[c].armature * v[c];
    let swing = (0..n).fold(S::zero(), |sum, c| sum + bracket(kind, &unit, a, c) * momentum(c));
    let g = swing - turned * node.passive[b].armature;
    match a == b {
        true => (g - node.passive[a].damping, turned),
        false => (g, turned),
    }
}
