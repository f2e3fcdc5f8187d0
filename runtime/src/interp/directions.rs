//! Derivatives of the rates direction by direction, for mechanisms with constraints: the sweeps run on numbers with
//! derivatives.

use alloc::vec;
use alloc::vec::Vec;

use super::inputs;
use crate::sweep::{Inputs, Sweeps};
use crate::system::StateDerivatives;
use crate::tree::Tree;
use crate::workspace::Workspace;
use crate::{Dual, Scalar};

/// Inputs of the sweeps.
#[derive(Clone, Debug)]
struct InputValues<S> {
    tau: Vec<S>,
    drive_q: Vec<S>,
    drive_v: Vec<S>,
    drive_a: Vec<S>,
    wrenches: Vec<[S; 6]>,
    gravity: [S; 3],
}

/// Sweeps over numbers with derivatives.
#[derive(Clone, Debug)]
pub(super) struct DualRun<S> {
    tree: Tree<Dual<S>>,
    work: Workspace<Dual<S>>,
    inputs: InputValues<Dual<S>>,
    state: [Vec<Dual<S>>; 5],
    unit: Vec<Dual<S>>,
}

impl<S: Scalar> DualRun<S> {
    pub(super) fn new(tree: &Tree<S>) -> Self {
        let tree = tree.map(&|x| Dual::new(x, S::zero()));
        let (o, dims) = (Dual::constant(0.0), tree.dims);
        let inputs = InputValues {
            tau: vec![o; dims.nv],
            drive_q: vec![o; dims.drive_q],
            drive_v: vec![o; dims.drive_v],
            drive_a: vec![o; dims.drive_v],
            wrenches: vec![[o; 6]; dims.wrenches],
            gravity: [o; 3],
        };
        let state = [dims.nq, dims.nv, dims.nv, dims.nq, dims.nv].map(|n| vec![o; n]);
        DualRun { work: Workspace::new(&tree), tree, inputs, state, unit: vec![o; dims.nv] }
    }

    /// One pass for each direction of the state.
    pub(super) fn derivatives(
        &mut self,
        inputs: &Inputs<'_, S>,
        q: &[S],
        p: &[S],
        out: &mut StateDerivatives<Vec<S>, Vec<Vec<S>>>,
    ) {
        let of = |x: &S| Dual::new(*x, S::zero());
        let copy = |to: &mut [Dual<S>], from: &[S]| to.iter_mut().zip(from).for_each(|(to, from)| *to = of(from));
        copy(&mut self.inputs.tau, inputs.tau);
        copy(&mut self.inputs.drive_q, inputs.drive_q);
        copy(&mut self.inputs.drive_v, inputs.drive_v);
        copy(&mut self.inputs.drive_a, inputs.drive_a);
        copy(&mut self.inputs.gravity, &inputs.gravity);
        for (to, from) in self.inputs.wrenches.iter_mut().zip(inputs.wrenches) {
            copy(to, from);
        }
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        let [dq, dp, dv, dqd, dpd] = &mut self.state;
        let unit = &mut self.unit;
        let StateDerivatives { v, pd, dv_dq, dv_dp, dpd_dq, dpd_dp } = out;
        for k in 0..p.len() {
            for (of_q, to_v, to_pd) in [(true, &mut *dv_dq, &mut *dpd_dq), (false, &mut *dv_dp, &mut *dpd_dp)] {
                copy(dq, q);
                copy(dp, p);
                if of_q {
                    unit.fill(Dual::zero());
                    unit[k] = Dual::one();
                    sweeps.coordinate_rates(dq, unit, dqd); // q̇ = N(q) e_k
                    dq.iter_mut().zip(&*dqd).for_each(|(q, along)| q.du = along.re);
                } else {
                    dp[k].du = S::one();
                }
                sweeps.rates(dq, dp, &inputs!(self.inputs), &mut self.work, dv, dqd, dpd);
                for (row, x) in to_v.iter_mut().zip(&*dv) {
                    row[k] = x.du;
                }
                for (row, x) in to_pd.iter_mut().zip(&*dpd) {
                    row[k] = x.du;
                }
            }
        }
        v.iter_mut().zip(&*dv).for_each(|(to, from)| *to = from.re);
        pd.iter_mut().zip(&*dpd).for_each(|(to, from)| *to = from.re);
    }
}
