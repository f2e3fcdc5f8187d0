//! Derivatives of the rates of mechanisms with constraints with respect to parameters: the rates themselves on numbers
//! with derivatives, once for each parameter. Operations that do not depend on the parameter are shared.

use mbd_runtime::sweep::{Inputs, Sweeps};
use mbd_runtime::workspace::Workspace;
use mbd_runtime::{Dual, Scalar};

use crate::plan::Plan;
use crate::symbolic::{Expr, Graph};
use crate::trace::SymbolicInputs;

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

/// Velocities and momentum rates.
type Rates<S> = [Vec<S>; 2];

/// The rates along directions.
pub(super) struct Directional<'a, 'g> {
    pub graph: &'g Graph,
    pub plan: &'a Plan,
    pub given: &'a SymbolicInputs<'g>,
    pub tolerance: Expr<'g>,
}

/// Derivatives along a direction.
fn slopes(rates: Rates<Dual<Expr<'_>>>) -> Rates<Expr<'_>> {
    rates.map(|x| x.into_iter().map(|x| x.du).collect())
}

/// Derivatives of velocities and of momentum rates, row by row, from those along all directions.
fn rows<'g>(columns: &[Rates<Expr<'g>>]) -> [Vec<Expr<'g>>; 2] {
    [0, 1].map(|half| {
        let n = columns.first().map_or(0, |column| column[half].len());
        (0..n).flat_map(|a| columns.iter().map(move |column| column[half][a])).collect()
    })
}

impl<'g> Directional<'_, 'g> {
    /// Velocities and momentum rates where coordinates, momenta and parameters change.
    fn along(&self, q: &[Dual<Expr<'g>>], p: &[Dual<Expr<'g>>], params: &[Dual<Expr<'g>>]) -> Rates<Dual<Expr<'g>>> {
        let (given, zero) = (self.given, Dual::zero());
        let mut tree = self.plan.tree(params).regrouped();
        tree.tolerance = Dual::new(self.tolerance, Expr::zero());
        if !given.acts.is_empty() {
            tree = tree.with_row_factors(fixed(&given.acts));
        }
        let gravity = self.plan.gravity_or(params, || given.gravity.map(|x| Dual::new(x, Expr::zero())));
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

    /// Results of [`Output::ParameterDerivatives`](crate::output::Output).
    pub fn parameter_derivatives(&self) -> [Vec<Expr<'g>>; 2] {
        let (given, n) = (self.given, self.given.params.len());
        let (q, p) = (fixed(&given.q), fixed(&given.second));
        let column = |k| slopes(self.along(&q, &p, &moving(&given.params, &unit(n, k))));
        rows(&(0..n).map(column).collect::<Vec<_>>())
    }
}
