//! The interpreter as a system that methods of integration run.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use super::{inputs, Interpreter};
use crate::sweep::{Derivatives, Inputs, Sweeps};
use crate::system::{Accelerated, Conjugate, Constrained, Differentiable, Energetic};
use crate::system::{LieJoint, Part, Real, Row, StateDerivatives, System};
use crate::tree::row_order::{is_early, RowProducts};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar + core::fmt::Debug> System for Interpreter<S> {
    type Scalar = S;
    type Coordinates = Vec<S>;
    type Momenta = Vec<S>;

    fn neutral(&self) -> Vec<S> {
        self.neutral.clone()
    }

    fn zero_momenta(&self) -> Vec<S> {
        vec![S::zero(); self.tree.dims.nv]
    }

    fn lie_joints(&self) -> &[LieJoint] {
        &self.groups
    }

    fn rates_at(&mut self, _t: S, q: &Vec<S>, p: &Vec<S>, qd: &mut Vec<S>, pd: &mut Vec<S>) {
        let mut v = core::mem::take(&mut self.v);
        self.rates(q, p, &mut v, qd, pd);
        self.v = v;
    }

    fn part_name(&self, part: Part) -> Option<&str> {
        let [velocities, constraints] = &self.names;
        let name = match part {
            Part::Velocity(k) => velocities.get(k),
            Part::Constraint(k) => constraints.get(k),
        };
        name.map(String::as_str)
    }

    fn coordinate_rates(&self, q: &Vec<S>, v: &Vec<S>, qd: &mut Vec<S>) {
        Sweeps { tree: &self.tree, trace: &() }.coordinate_rates(q, v, qd);
    }
}

impl<S: Scalar + core::fmt::Debug> Energetic for Interpreter<S> {
    fn energies(&mut self, q: &Vec<S>, p: &Vec<S>) -> (S, S) {
        self.energy(q, p)
    }
}

impl<S: Scalar + core::fmt::Debug> Conjugate for Interpreter<S> {
    fn conjugate_momenta(&mut self, q: &Vec<S>, v: &Vec<S>, p: &mut Vec<S>) {
        self.momenta(q, v, p);
    }
}

impl<S: Scalar + core::fmt::Debug> Accelerated for Interpreter<S> {
    fn generalized_accelerations(&mut self, q: &Vec<S>, v: &Vec<S>, a: &mut Vec<S>) {
        self.accelerations(q, v, a);
    }
}

impl<S: Real> Constrained for Interpreter<S> {
    type Rows = Vec<S>;
    type Entries = Vec<S>;

    fn zero_rows(&self) -> Vec<S> {
        vec![S::zero(); self.rows.len()]
    }

    fn zero_entries(&self) -> Vec<S> {
        vec![S::zero(); self.entry_columns.len()]
    }

    fn rows(&self) -> &[Row] {
        &self.rows
    }

    fn entry_columns(&self) -> &[usize] {
        &self.entry_columns
    }

    fn constraint_residuals(&mut self, q: &Vec<S>, residual: &mut Vec<S>, jacobian: &mut Vec<S>) {
        self.residuals(q, residual, jacobian);
    }

    fn project_momenta(&mut self, _t: S, q: &Vec<S>, p: &mut Vec<S>, v: &mut Vec<S>, sigma: &mut Vec<S>) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        self.v.copy_from_slice(p);
        sweeps.project_momenta(q, &self.v, &inputs!(self), &mut self.work, v, p, sigma);
    }

    fn position_correction(&mut self, q: &Vec<S>, residual: &mut Vec<S>, dq: &mut Vec<S>, pivots: &mut Vec<S>) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.position_correction(q, &inputs!(self), &mut self.work, residual, dq, pivots);
    }

    fn multipliers(&mut self, _t: S, q: &Vec<S>, v: &Vec<S>, lambda: &mut Vec<S>) {
        self.constraint_multipliers(q, v, lambda);
    }

    fn row_is_early(&self, row: usize) -> bool {
        is_early(&self.tree, row)
    }

    fn reorder_rows(&mut self, q: &Vec<S>) -> bool {
        if !self.tree.rows_can_be_ordered() {
            return false;
        }
        let at = RowProducts::new(self, q);
        let changed = self.tree.reorder_rows(&at);
        if self.physical.reorder_rows(&at) || changed {
            self.work = Workspace::new(&self.tree);
            self.other_work = Self::other_work(&self.tree);
            self.derivatives = None;
        }
        changed
    }
}

impl<S: Scalar + core::fmt::Debug> Differentiable for Interpreter<S> {
    type Square = Vec<Vec<S>>;

    fn square(&self) -> Vec<Vec<S>> {
        let nv = self.tree.dims.nv;
        vec![vec![S::zero(); nv]; nv]
    }

    fn rate_derivatives(&mut self, _t: S, q: &Vec<S>, p: &Vec<S>, out: &mut StateDerivatives<Vec<S>, Vec<Vec<S>>>) {
        let mut d = self.derivatives.take().unwrap_or_else(|| Box::new(Derivatives::new(&self.tree)));
        self.derivatives(q, p, &mut d);
        out.v.copy_from_slice(&d.v);
        out.pd.copy_from_slice(&d.pd);
        let blocks = [&d.dv_dq, &d.dv_dp, &d.dpd_dq, &d.dpd_dp];
        for (to, from) in out.blocks_mut().into_iter().flatten().zip(blocks) {
            for (row, from) in to.iter_mut().zip(from.chunks(p.len().max(1))) {
                row.copy_from_slice(from);
            }
        }
        self.derivatives = Some(d);
    }
}
