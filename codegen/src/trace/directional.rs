//! Derivatives of the rates of mechanisms with constraints: the rates themselves on numbers with derivatives, once for each
//! direction. Exact, and as long as there are directions; operations that do not depend on the direction are shared.

use mbd_runtime::sweep::{Inputs, Sweeps};
use mbd_runtime::workspace::Workspace;
use mbd_runtime::{Dual, Scalar};

use super::SymbolicInputs;
use crate::model::{Gravity, Value};
use crate::options::Output;
use crate::plan::Plan;
use crate::symbolic::{Expr, Graph};

/// Numbers that do not change.
fn fixed<'g>(x: &[Expr<'g>]) -> Vec<Dual<Expr<'g>>> {
    x.iter().map(|x| Dual::new(*x, Expr::zero())).collect()
}

/// Numbers that change at given rates.
fn moving<'g>(x: &[Expr<'g>], rates: &[Expr<'g>]) -> Vec<Dual<Expr<'g>>> {
    x.iter().zip(rates).map(|(x, rate)| Dual::new(*x, *rate)).collect()
}

/// `n` numbers, all zero but one.
fn unit<'g>(n: usize, k: usize) -> Vec<Expr<'g>> {
    (0..n).map(|j| if j == k { Expr::one() } else { Expr::zero() }).collect()
}

/// The rates along directions.
struct Rates<'a, 'g> {
    graph: &'g Graph,
    plan: &'a Plan,
    given: &'a SymbolicInputs<'g>,
    tolerance: Expr<'g>,
}

impl<'g> Rates<'_, 'g> {
    /// Velocities and momentum rates where coordinates, momenta and parameters change.
    fn along(&self, q: &[Dual<Expr<'g>>], p: &[Dual<Expr<'g>>], params: &[Dual<Expr<'g>>]) -> [Vec<Dual<Expr<'g>>>; 2] {
        let (given, zero) = (self.given, Dual::zero());
        let mut tree = self.plan.tree(params).regrouped();
        tree.tolerance = Dual::new(self.tolerance, Expr::zero());
        let gravity = match self.plan.model.gravity {
            Gravity::Constant(g) => g.map(|v| match v {
                Value::Const(x) => Dual::constant(x),
                Value::Param(k) => params[k],
            }),
            Gravity::Input => given.gravity.map(|x| Dual::new(x, Expr::zero())),
        };
        let [drive_q, drive_v, drive_a] = given.drive.each_ref().map(|x| fixed(x));
        let wrenches: Vec<[Dual<Expr>; 6]> =
            given.wrenches.iter().map(|w| w.map(|x| Dual::new(x, Expr::zero()))).collect();
        let tau = fixed(&given.tau);
        let inputs =
            Inputs { tau: &tau, drive_q: &drive_q, drive_v: &drive_v, drive_a: &drive_a, wrenches: &wrenches, gravity };
        let (nq, nv) = (self.plan.dims.nq, self.plan.dims.nv);
        let (mut v, mut qd, mut pd) = (vec![zero; nv], vec![zero; nq], vec![zero; nv]);
        let sweeps = Sweeps { tree: &tree, trace: self.graph };
        sweeps.rates(q, p, &inputs, &mut Workspace::new(&tree), &mut v, &mut qd, &mut pd);
        [v, pd]
    }
}

/// Results of [`Output::Derivatives`] or [`Output::ParameterDerivatives`].
pub(super) fn derivatives<'g>(
    graph: &'g Graph,
    plan: &Plan,
    group: Output,
    given: &SymbolicInputs<'g>,
    tolerance: Expr<'g>,
) -> Vec<Expr<'g>> {
    let (nv, np) = (plan.dims.nv, given.params.len());
    let rates = Rates { graph, plan, given, tolerance };
    let (q, p, params) = (fixed(&given.q), fixed(&given.second), fixed(&given.params));
    let du = |pair: [Vec<Dual<Expr<'g>>>; 2]| pair.map(|x| x.into_iter().map(|x| x.du).collect::<Vec<Expr>>());
    // Row by row, of a block whose columns are given.
    let block = |columns: &[[Vec<Expr<'g>>; 2]], half: usize| {
        (0..nv).flat_map(|a| columns.iter().map(move |c| c[half][a])).collect::<Vec<Expr>>()
    };
    if group == Output::ParameterDerivatives {
        let column = |k| du(rates.along(&q, &p, &moving(&given.params, &unit(np, k))));
        let columns: Vec<_> = (0..np).map(column).collect();
        return [block(&columns, 0), block(&columns, 1)].concat();
    }
    let tree = plan.tree(&given.params);
    let sweeps = Sweeps { tree: &tree, trace: graph };
    let by_q = |k: usize| {
        let mut way = vec![Expr::zero(); plan.dims.nq];
        sweeps.coordinate_rates(&given.q, &unit(nv, k), &mut way);
        du(rates.along(&moving(&given.q, &way), &p, &params))
    };
    let by_q: Vec<_> = (0..nv).map(by_q).collect();
    let by_p: Vec<_> = (0..nv).map(|k| du(rates.along(&q, &moving(&given.second, &unit(nv, k)), &params))).collect();
    let value = |pair: [Vec<Dual<Expr<'g>>>; 2]| pair.map(|x| x.into_iter().map(|x| x.re).collect::<Vec<Expr>>());
    let [v, pd] = value(rates.along(&q, &p, &params));
    [v, pd, block(&by_q, 0), block(&by_p, 0), block(&by_q, 1), block(&by_p, 1)].concat()
}
