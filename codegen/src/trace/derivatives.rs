//! Outputs that are derivatives of the rates and of the momenta.

mod directional;

use mbd_runtime::sweep::{Derivatives, ParameterDerivatives, Sweeps};
use mbd_runtime::workspace::Workspace;
use mbd_runtime::{Dual, MomentumDerivatives, Scalar};

use super::Run;
use crate::output::Output;
use crate::symbolic::Expr;
use directional::Directional;

impl<'g> Run<'_, 'g> {
    /// Calls the sweep of an output that is a derivative, which writes the arrays of [`Spec::results`](crate::output::Spec).
    pub(super) fn derivatives(&self, output: Output, results: &mut [Vec<Expr<'g>>]) {
        let (tree, trace, given) = (self.tree, self.graph, self.given);
        let (q, second, u) = (&given.q, &given.second, &given.inputs());
        let sweeps = Sweeps { tree, trace };
        let w = &mut Workspace::new(tree);
        let constrained = !self.plan.constraints.is_empty();
        let directional = Directional { graph: trace, plan: self.plan, given, tree };
        match (output, results) {
            (Output::Derivatives, [v, pd, dv_dq, dv_dp, dpd_dq, dpd_dp]) => {
                let mut d = Derivatives::new(tree);
                sweeps.derivatives(q, second, u, w, &mut d);
                (*v, *pd, *dv_dq, *dv_dp, *dpd_dq, *dpd_dp) = (d.v, d.pd, d.dv_dq, d.dv_dp, d.dpd_dq, d.dpd_dp);
            }
            (Output::MomentumDerivatives, [p, pd, dp_dq, dp_dv, dpd_dq, dpd_dv]) => {
                let (mut d, mut out) = (Derivatives::new(tree), MomentumDerivatives::new(tree));
                sweeps.momentum_derivatives(q, second, u, w, &mut d, &mut out);
                (*p, *pd, *dp_dq, *dp_dv) = (out.p, out.pd, out.dp_dq, out.dp_dv);
                (*dpd_dq, *dpd_dv) = (out.dpd_dq, out.dpd_dv);
            }
            (Output::ParameterDerivatives, [dv, dpd]) if constrained => {
                [*dv, *dpd] = directional.parameter_derivatives()
            }
            (Output::ParameterDerivatives, [dv, dpd]) => [*dv, *dpd] = self.parameter_derivatives(),
            _ => unreachable!("results are those of the table"),
        }
    }

    /// `∂v/∂params` and `∂ṗ/∂params`, row by row: one dual sweep for each parameter.
    fn parameter_derivatives(&self) -> [Vec<Expr<'g>>; 2] {
        let (tree, trace, given, inputs) = (self.tree, self.graph, self.given, self.given.inputs());
        let (q, params) = (&given.q, &given.params);
        let mut d = Derivatives::new(tree);
        Sweeps { tree, trace }.derivatives(q, &given.second, &inputs, &mut Workspace::new(tree), &mut d);
        let columns: Vec<[Vec<Expr>; 2]> = (0..params.len())
            .map(|k| {
                let one = |j: usize| if j == k { Expr::one() } else { Expr::zero() };
                let varied: Vec<Dual<Expr>> = params.iter().enumerate().map(|(j, x)| Dual::new(*x, one(j))).collect();
                let gravity = self.plan.gravity_or(&varied, || inputs.gravity.map(|x| Dual::new(x, Expr::zero())));
                let tree = self.plan.tree(&varied).regrouped();
                let mut column = ParameterDerivatives::new(&tree);
                column.compute(&Sweeps { tree: &tree, trace }, gravity, q, &inputs, &d);
                [column.dv, column.dpd]
            })
            .collect();
        let rows = |half: usize| (0..tree.dims.nv).flat_map(|a| columns.iter().map(move |c| c[half][a])).collect();
        [rows(0), rows(1)]
    }
}
