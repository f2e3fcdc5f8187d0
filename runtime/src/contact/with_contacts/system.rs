//! A mechanism with contacts as a system to be integrated: the mechanism's own functions, with friction.

use super::WithContacts;
use crate::contact::Touching;
use crate::system::{system_within, Conjugate, Constrained, Energetic, LieJoint, Row, System};

impl<Y: Touching> System for WithContacts<Y> {
    system_within!(system: Y);

    fn lie_joints(&self) -> &[LieJoint] {
        self.system.lie_joints()
    }

    fn rates_at(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
        qd: &mut Y::Coordinates,
        pd: &mut Y::Momenta,
    ) {
        self.system.rates_at(t, q, p, qd, pd);
        if self.rubs {
            self.look_at_closed(t, q, p);
            self.loads(t, q, false);
            for (rate, force) in pd.as_mut().iter_mut().zip(self.friction.as_ref()) {
                *rate = *rate + *force;
            }
        }
    }

    fn rounding(&self) -> f64 {
        self.rounding
    }
}

impl<Y: Touching + Energetic> Energetic for WithContacts<Y> {
    fn energies(&mut self, q: &Y::Coordinates, p: &Y::Momenta) -> (Y::Scalar, Y::Scalar) {
        self.system.energies(q, p)
    }
}

impl<Y: Touching + Conjugate> Conjugate for WithContacts<Y> {
    fn conjugate_momenta(&mut self, q: &Y::Coordinates, v: &Y::Momenta, p: &mut Y::Momenta) {
        self.system.conjugate_momenta(q, v, p);
    }
}

impl<Y: Touching> Constrained for WithContacts<Y> {
    type Rows = Y::Rows;
    type Entries = Y::Entries;

    fn zero_rows(&self) -> Y::Rows {
        self.system.zero_rows()
    }

    fn zero_entries(&self) -> Y::Entries {
        self.system.zero_entries()
    }

    fn rows(&self) -> &[Row] {
        self.system.rows()
    }

    /// Rows of loops and couplings always act, those of contacts that are closed do.
    fn rows_act(&self) -> bool {
        self.closed || self.has_loops()
    }

    fn entry_columns(&self) -> &[usize] {
        self.system.entry_columns()
    }

    fn constraint_residuals(&mut self, q: &Y::Coordinates, residual: &mut Y::Rows, jacobian: &mut Y::Entries) {
        self.system.constraint_residuals(q, residual, jacobian);
    }

    fn project_momenta(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &mut Y::Momenta,
        v: &mut Y::Momenta,
        sigma: &mut Y::Rows,
    ) {
        self.system.project_momenta(t, q, p, v, sigma);
    }

    fn position_correction(
        &mut self,
        q: &Y::Coordinates,
        residual: &mut Y::Rows,
        dq: &mut Y::Momenta,
        pivots: &mut Y::Rows,
    ) {
        self.system.position_correction(q, residual, dq, pivots);
    }

    /// Without the effect of friction on the other multipliers; [`WithContacts::forces`] includes it.
    fn multipliers(&mut self, t: Y::Scalar, q: &Y::Coordinates, v: &Y::Momenta, lambda: &mut Y::Rows) {
        self.system.multipliers(t, q, v, lambda);
    }

    fn row_is_early(&self, row: usize) -> bool {
        self.system.row_is_early(row)
    }

    fn reorder_rows(&mut self, q: &Y::Coordinates) -> bool {
        self.system.reorder_rows(q)
    }
}
