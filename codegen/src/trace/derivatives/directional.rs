//! Derivatives of the rates of mechanisms with constraints with respect to parameters. Of those that leave the rows of the
//! constraints alone: a solution with the factors of the rates for each parameter. Of others: the rates themselves on numbers with
//! derivatives. Operations that do not depend on the parameter are shared.

use std::cell::Cell;

use mbd_runtime::spatial::RigidInertia;
use mbd_runtime::sweep::{Inputs, ParameterDerivatives, Sweeps};
use mbd_runtime::tree::{Passive, Tree};
use mbd_runtime::workspace::Workspace;
use mbd_runtime::{Dual, Scalar};

use crate::plan::Plan;
use crate::symbolic::{Expr, Graph};
use crate::trace::SymbolicInputs;

impl Plan {
    /// Whether a parameter changes anything but inertias, springs, dampers and gravity: the geometry, and with it the rows of
    /// constraints, or the constraints themselves.
    pub fn changes_rows(&self, param: usize) -> bool {
        let (graph, zero) = (Graph::default(), Expr::zero());
        let defaults = self.default_params().into_iter().enumerate();
        let params: Vec<Expr> =
            defaults.map(|(k, x)| if k == param { graph.input(0) } else { Expr::constant(x) }).collect();
        let mut tree = self.tree(&params);
        tree.accelerations = None;
        for node in &mut tree.nodes {
            node.inertia = RigidInertia::zero();
            node.passive.fill(Passive { damping: zero, stiffness: zero, rest: zero, armature: zero });
        }
        let changes = Cell::new(false);
        let _: Tree<f64> = tree.map(&|x| {
            changes.set(changes.get() || !matches!(x, Expr::Const(_)));
            0.0
        });
        changes.get()
    }
}

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
    /// The tree of the rates.
    pub tree: &'a Tree<Expr<'g>>,
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
    /// The tree where parameters change, and gravity.
    fn varied(&self, params: &[Dual<Expr<'g>>]) -> (Tree<Dual<Expr<'g>>>, [Dual<Expr<'g>>; 3]) {
        let given = self.given;
        let mut tree = self.plan.tree(params).regrouped();
        tree.tolerance = Dual::new(self.tree.tolerance, Expr::zero());
        if !given.acts.is_empty() {
            tree = tree.with_row_factors(fixed(&given.acts));
        }
        (tree, self.plan.gravity_or(params, || given.gravity.map(|x| Dual::new(x, Expr::zero()))))
    }

    /// Velocities and momentum rates where parameters change.
    fn along(&self, params: &[Dual<Expr<'g>>]) -> Rates<Dual<Expr<'g>>> {
        let (given, zero) = (self.given, Dual::zero());
        let (tree, gravity) = self.varied(params);
        let [drive_q, drive_v, drive_a] = given.drive.each_ref().map(|x| fixed(x));
        let wrenches: Vec<[Dual<Expr>; 6]> =
            given.wrenches.iter().map(|w| w.map(|x| Dual::new(x, Expr::zero()))).collect();
        let tau = fixed(&given.tau);
        let inputs =
            Inputs { tau: &tau, drive_q: &drive_q, drive_v: &drive_v, drive_a: &drive_a, wrenches: &wrenches, gravity };
        let (nq, nv) = (self.plan.dims.nq, self.plan.dims.nv);
        let (mut v, mut qd, mut pd) = (vec![zero; nv], vec![zero; nq], vec![zero; nv]);
        let sweeps = Sweeps { tree: &tree, trace: self.graph };
        let (q, p) = (fixed(&given.q), fixed(&given.second));
        sweeps.rates(&q, &p, &inputs, &mut Workspace::new(&tree), &mut v, &mut qd, &mut pd);
        [v, pd]
    }

    /// Results of [`Output::ParameterDerivatives`](crate::output::Output).
    pub fn parameter_derivatives(&self) -> [Vec<Expr<'g>>; 2] {
        let (given, inputs, trace) = (self.given, self.given.inputs(), self.graph);
        let (n, dims) = (given.params.len(), self.plan.dims);
        let sweeps = Sweeps { tree: self.tree, trace };
        let [mut v, mut qd, mut pd] = [dims.nv, dims.nq, dims.nv].map(|n| vec![Expr::zero(); n]);
        let w = &mut Workspace::new(self.tree);
        sweeps.rates(&given.q, &given.second, &inputs, w, &mut v, &mut qd, &mut pd);
        let (unvaried, _) = self.varied(&fixed(&given.params));
        let column = |k| {
            let params = moving(&given.params, &unit(n, k));
            if self.plan.changes_rows(k) {
                return slopes(self.along(&params));
            }
            let (tree, gravity) = self.varied(&params);
            let mut column = ParameterDerivatives::new(&tree);
            let varied = (&Sweeps { tree: &tree, trace }, gravity);
            let unvaried = &Sweeps { tree: &unvaried, trace };
            column.compute_with_rows(varied, unvaried, (&given.q, &given.second, &v), &inputs);
            [column.dv, column.dpd]
        };
        rows(&(0..n).map(column).collect::<Vec<_>>())
    }
}
