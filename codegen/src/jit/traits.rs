//! The traits of generated types for machine code made at run time. Where an output is too large to compile, the
//! interpreter computes it.

use mbd_runtime::system::{Accelerated, Conjugate, Constrained, Differentiable, Energetic};
use mbd_runtime::system::{LieJoint, Part, Row, StateDerivatives, System};
use mbd_runtime::tree::row_order::is_early;

use super::memory::Number;
use super::Compiled;
use crate::output::Output;

impl<S: Number> Compiled<S> {
    /// The rates in every case.
    #[inline(never)]
    fn any_rates(&mut self, t: S, q: &Vec<S>, p: &Vec<S>, qd: &mut Vec<S>, pd: &mut Vec<S>) {
        self.drive_to(t);
        if !self.run_any(Output::Rates, [q, p, &[]], [qd, pd]) {
            self.interpreting().rates_at(t, q, p, qd, pd);
        }
    }
}

impl<S: Number> System for Compiled<S> {
    type Scalar = S;
    type Coordinates = Vec<S>;
    type Momenta = Vec<S>;

    fn neutral(&self) -> Vec<S> {
        self.interpreter.neutral()
    }

    fn zero_momenta(&self) -> Vec<S> {
        self.interpreter.zero_momenta()
    }

    fn lie_joints(&self) -> &[LieJoint] {
        self.interpreter.lie_joints()
    }

    #[inline]
    fn rates_at(&mut self, t: S, q: &Vec<S>, p: &Vec<S>, qd: &mut Vec<S>, pd: &mut Vec<S>) {
        let code = self.shared.made(Output::Rates).filter(|_| !self.waits(Output::Rates) && self.drives.is_none());
        let done = code.is_some_and(|code| {
            // The vectors are looked into last, which leaves more registers.
            code.call_lean([q, p, &[]], (&self.interpreter.tau, &self.params), [qd, pd], &mut self.scratch)
        });
        if !done {
            self.any_rates(t, q, p, qd, pd);
        }
    }

    fn part_name(&self, part: Part) -> Option<&str> {
        self.interpreter.part_name(part)
    }

    fn coordinate_rates(&self, q: &Vec<S>, v: &Vec<S>, qd: &mut Vec<S>) {
        if !self.coordinate_rates_into(q, v, qd) {
            self.interpreter.coordinate_rates(q, v, qd);
        }
    }
}

impl<S: Number> Energetic for Compiled<S> {
    fn energies(&mut self, q: &Vec<S>, p: &Vec<S>) -> (S, S) {
        self.energy(q, p)
    }
}

impl<S: Number> Conjugate for Compiled<S> {
    fn conjugate_momenta(&mut self, q: &Vec<S>, v: &Vec<S>, p: &mut Vec<S>) {
        self.momenta(q, v, p);
    }
}

impl<S: Number> Accelerated for Compiled<S> {
    fn generalized_accelerations(&mut self, q: &Vec<S>, v: &Vec<S>, a: &mut Vec<S>) {
        self.accelerations(q, v, a);
    }
}

impl<S: Number> Differentiable for Compiled<S> {
    type Square = Vec<Vec<S>>;

    fn square(&self) -> Vec<Vec<S>> {
        self.interpreter.square()
    }

    fn depends_on_time(&self) -> bool {
        self.is_driven()
    }

    fn rate_derivatives(&mut self, t: S, q: &Vec<S>, p: &Vec<S>, out: &mut StateDerivatives<Vec<S>, Vec<Vec<S>>>) {
        self.drive_to(t);
        let nv = p.len();
        let mut copies = std::mem::take(&mut self.copies);
        copies.resize((4 * nv * nv).max(copies.len()), S::zero());
        let (rest, dpd_dp) = copies[..4 * nv * nv].split_at_mut(3 * nv * nv);
        let (rest, dpd_dq) = rest.split_at_mut(2 * nv * nv);
        let (dv_dq, dv_dp) = rest.split_at_mut(nv * nv);
        let results = [&mut out.v[..], &mut out.pd[..], dv_dq, dv_dp, dpd_dq, dpd_dp];
        let compiled = self.run(Output::Derivatives, [q, p, &[]], results);
        if compiled {
            let blocks = copies.chunks_exact((nv * nv).max(1));
            for (to, from) in out.blocks_mut().into_iter().flatten().zip(blocks) {
                for (row, from) in to.iter_mut().zip(from.chunks_exact(nv.max(1))) {
                    row.copy_from_slice(from);
                }
            }
        }
        self.copies = copies;
        if !compiled {
            self.interpreting().rate_derivatives(t, q, p, out);
        }
    }
}

impl<S: Number> Constrained for Compiled<S> {
    type Rows = Vec<S>;
    type Entries = Vec<S>;

    fn zero_rows(&self) -> Vec<S> {
        self.interpreter.zero_rows()
    }

    fn zero_entries(&self) -> Vec<S> {
        self.interpreter.zero_entries()
    }

    fn rows(&self) -> &[Row] {
        self.interpreter.rows()
    }

    fn entry_columns(&self) -> &[usize] {
        self.interpreter.entry_columns()
    }

    fn constraint_residuals(&mut self, q: &Vec<S>, residual: &mut Vec<S>, jacobian: &mut Vec<S>) {
        if !self.run(Output::ConstraintResiduals, [q, &[], &[]], [residual, jacobian]) {
            self.interpreting().constraint_residuals(q, residual, jacobian);
        }
    }

    fn project_momenta(&mut self, t: S, q: &Vec<S>, p: &mut Vec<S>, v: &mut Vec<S>, sigma: &mut Vec<S>) {
        self.drive_to(t);
        let mut augmented = std::mem::take(&mut self.copies);
        augmented.resize(p.len().max(augmented.len()), S::zero());
        augmented[..p.len()].copy_from_slice(p);
        let arguments = [&q[..], &augmented[..p.len()], &[]];
        let compiled = self.run(Output::ProjectMomenta, arguments, [v, p, sigma]);
        if !compiled {
            // Code whose early rows do not act has written what it found.
            p.iter_mut().zip(&augmented).for_each(|(p, given)| *p = *given);
        }
        self.copies = augmented;
        if !compiled {
            self.interpreting().project_momenta(t, q, p, v, sigma);
        }
    }

    fn position_correction(&mut self, q: &Vec<S>, residual: &mut Vec<S>, dq: &mut Vec<S>, pivots: &mut Vec<S>) {
        if !self.run(Output::PositionCorrection, [q, &[], &[]], [residual, dq, pivots]) {
            self.interpreting().position_correction(q, residual, dq, pivots);
        }
    }

    fn multipliers(&mut self, t: S, q: &Vec<S>, v: &Vec<S>, lambda: &mut Vec<S>) {
        self.drive_to(t);
        if !self.run(Output::Multipliers, [q, v, &[]], [lambda]) {
            self.interpreting().multipliers(t, q, v, lambda);
        }
    }

    fn row_is_early(&self, row: usize) -> bool {
        is_early(self.plan(), row)
    }

    /// The code is made again, where the order has changed, in place of that of this clone.
    fn reorder_rows(&mut self, q: &Vec<S>) -> bool {
        self.with_rows_ordered_at(q)
    }
}
