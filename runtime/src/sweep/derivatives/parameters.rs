//! Derivatives with respect to constants of the mechanism.

use alloc::vec;
use alloc::vec::Vec;

use super::Derivatives;
use crate::sweep::{Inputs, Quantity, Sweeps, Trace};
use crate::tree::Tree;
use crate::workspace::Workspace;
use crate::{Dual, Scalar};

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Momenta and their rates at given velocities, `(q, v) → (p, ṗ)`, accelerations not entering.
    pub fn momenta_and_rates(&self, q: &[S], v: &[S], u: &Inputs<S>, w: &mut Workspace<S>, p: &mut [S], pd: &mut [S]) {
        self.momenta(q, v, u, w, p);
        self.loads(u, w);
        pd.fill(S::zero());
        for (i, node) in self.tree.nodes.iter().enumerate() {
            let Some(v) = super::velocity(node) else { continue };
            self.trace.at(Some(i), Quantity::MomentumRate);
            let swing = w.velocity.omega[i].cross_force(&w.force[i]); // Ω × P*
            for k in 0..node.kind.nv() {
                let axis = node.kind.axis(k);
                let sum = self.applied(w, i, &axis) - axis.dot(&swing) + self.passive(node, w, i, k);
                pd[v + k] = pd[v + k] + node.ratio * sum;
            }
        }
        for (pd, tau) in pd.iter_mut().zip(u.tau) {
            *pd = *pd + *tau;
        }
    }
}

/// Derivatives along one change of the constants of a mechanism, gravity included.
///
/// With `p` and `ṗ` at given velocities differentiated by dual numbers (sparse: few constants change), the rest follows
/// from the derivatives with respect to momenta: `dv = −(∂v/∂p) δp`, `dṗ = δṗ − (∂ṗ/∂p) δp`.
#[derive(Clone, Debug)]
pub struct ParameterDerivatives<S> {
    /// `dv`, one number for each velocity.
    pub dv: Vec<S>,
    /// `dṗ`, one number for each velocity.
    pub dpd: Vec<S>,
    work: Workspace<Dual<S>>,
    lists: [Vec<Dual<S>>; 6],
    wrenches: Vec<[Dual<S>; 6]>,
    p: Vec<Dual<S>>,
    pd: Vec<Dual<S>>,
    /// Of the solution where the momenta change: momenta, their rates, velocities, coordinate rates.
    solution: [Vec<Dual<S>>; 4],
}

impl<S: Scalar> ParameterDerivatives<S> {
    /// Allocates memory for a tree.
    pub fn new(tree: &Tree<Dual<S>>) -> Self {
        let (d, o) = (tree.dims, Dual::zero());
        let list = |n: usize| vec![o; n];
        ParameterDerivatives {
            dv: vec![S::zero(); d.nv],
            dpd: vec![S::zero(); d.nv],
            work: Workspace::new(tree),
            lists: [d.nq, d.nv, d.nv, d.drive_q, d.drive_v, d.drive_v].map(list),
            wrenches: vec![[o; 6]; d.wrenches],
            p: list(d.nv),
            pd: list(d.nv),
            solution: [d.nv, d.nv, d.nv, d.nq].map(list),
        }
    }

    /// `sweeps` is over the varied tree, regrouped or not, `gravity` varies with it; `u.gravity` is not used. `at` has
    /// been computed for the same `q` and inputs.
    pub fn compute<T: Trace>(
        &mut self,
        sweeps: &Sweeps<Dual<S>, T>,
        gravity: [Dual<S>; 3],
        q: &[S],
        u: &Inputs<S>,
        at: &Derivatives<S>,
    ) {
        self.vary(sweeps, gravity, q, &at.v, u);
        let nv = self.dv.len();
        sweeps.trace.at(None, Quantity::Derivative);
        for a in 0..nv {
            let (mut dv, mut dpd) = (S::zero(), self.pd[a].du);
            for b in 0..nv {
                dv = dv - at.dv_dp[a * nv + b] * self.p[b].du;
                dpd = dpd - at.dpd_dp[a * nv + b] * self.p[b].du;
            }
            (self.dv[a], self.dpd[a]) = (dv, dpd);
        }
    }

    /// The same for a mechanism with constraints, along a change that leaves their rows and `b` as they are: of inertias, springs,
    /// dampers and gravity. In `M v + Φᵀσ = p`, `Φ v = b` it is then like a change of the momenta by `−δp`, and the sweeps
    /// of the rates solve for that: `fixed` is over the tree that does not vary. The state is `(q, p)`, `v` its velocities.
    pub fn compute_with_rows<T: Trace>(
        &mut self,
        (sweeps, gravity): (&Sweeps<Dual<S>, T>, [Dual<S>; 3]),
        fixed: &Sweeps<Dual<S>, T>,
        (q, p, v): (&[S], &[S], &[S]),
        u: &Inputs<S>,
    ) {
        self.vary(sweeps, gravity, q, v, u);
        let [momenta, rates, velocities, coordinates] = &mut self.solution;
        for (to, (p, varied)) in momenta.iter_mut().zip(p.iter().zip(&self.p)) {
            *to = Dual::new(*p, -varied.du);
        }
        let [q, _, tau, drive_q, drive_v, drive_a] = &self.lists;
        let gravity = u.gravity.map(|x| Dual::new(x, S::zero()));
        let u = Inputs { tau, drive_q, drive_v, drive_a, wrenches: &self.wrenches, gravity };
        fixed.rates(q, momenta, &u, &mut self.work, velocities, coordinates, rates);
        fixed.trace.at(None, Quantity::Derivative);
        for (a, (velocity, rate)) in velocities.iter().zip(rates.iter()).enumerate() {
            (self.dv[a], self.dpd[a]) = (velocity.du, self.pd[a].du + rate.du);
        }
    }

    /// Momenta and their rates at given velocities, with derivatives.
    fn vary<T: Trace>(&mut self, sweeps: &Sweeps<Dual<S>, T>, gravity: [Dual<S>; 3], q: &[S], v: &[S], u: &Inputs<S>) {
        let given = [q, v, u.tau, u.drive_q, u.drive_v, u.drive_a];
        for (list, given) in self.lists.iter_mut().zip(given) {
            for (to, x) in list.iter_mut().zip(given) {
                *to = Dual::new(*x, S::zero());
            }
        }
        for (to, x) in self.wrenches.iter_mut().zip(u.wrenches) {
            *to = x.map(|x| Dual::new(x, S::zero()));
        }
        let [q, v, tau, drive_q, drive_v, drive_a] = &self.lists;
        let u = Inputs { tau, drive_q, drive_v, drive_a, wrenches: &self.wrenches, gravity };
        sweeps.momenta_and_rates(q, v, &u, &mut self.work, &mut self.p, &mut self.pd);
    }
}
