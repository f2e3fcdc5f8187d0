//! A mechanism with its constraints, and without them.

use crate::system::{system_within, Conjugate, Constrained, Energetic, LieJoint, Real, Row, System};

/// A mechanism twice: `open`, without its constraints, and `closed`, with them. Both have the same state layout. Inputs
/// are to be set in both. As a [`System`] it is the closed one.
#[derive(Clone, Debug)]
pub struct OpenAndClosed<O, C> {
    /// The mechanism without constraints.
    pub open: O,
    /// The mechanism with constraints.
    pub closed: C,
}

impl<O, C: System> System for OpenAndClosed<O, C> {
    system_within!(closed: C);

    fn lie_joints(&self) -> &[LieJoint] {
        self.closed.lie_joints()
    }
    fn rates_at(
        &mut self,
        t: C::Scalar,
        q: &C::Coordinates,
        p: &C::Momenta,
        qd: &mut C::Coordinates,
        pd: &mut C::Momenta,
    ) {
        self.closed.rates_at(t, q, p, qd, pd);
    }
}

impl<O, C: Energetic> Energetic for OpenAndClosed<O, C> {
    fn energies(&mut self, q: &C::Coordinates, p: &C::Momenta) -> (C::Scalar, C::Scalar) {
        self.closed.energies(q, p)
    }
}

impl<O, C: Constrained> Constrained for OpenAndClosed<O, C> {
    type Rows = C::Rows;
    type Entries = C::Entries;

    fn zero_rows(&self) -> C::Rows {
        self.closed.zero_rows()
    }
    fn zero_entries(&self) -> C::Entries {
        self.closed.zero_entries()
    }
    fn rows(&self) -> &[Row] {
        self.closed.rows()
    }
    fn entry_columns(&self) -> &[usize] {
        self.closed.entry_columns()
    }
    fn constraint_residuals(&mut self, q: &C::Coordinates, residual: &mut C::Rows, jacobian: &mut C::Entries) {
        self.closed.constraint_residuals(q, residual, jacobian);
    }
    fn project_momenta(
        &mut self,
        t: C::Scalar,
        q: &C::Coordinates,
        p: &mut C::Momenta,
        v: &mut C::Momenta,
        sigma: &mut C::Rows,
    ) {
        self.closed.project_momenta(t, q, p, v, sigma);
    }
    fn position_correction(
        &mut self,
        q: &C::Coordinates,
        residual: &mut C::Rows,
        dq: &mut C::Momenta,
        pivots: &mut C::Rows,
    ) {
        self.closed.position_correction(q, residual, dq, pivots);
    }
    fn multipliers(&mut self, t: C::Scalar, q: &C::Coordinates, v: &C::Momenta, lambda: &mut C::Rows) {
        self.closed.multipliers(t, q, v, lambda);
    }
    fn row_is_early(&self, row: usize) -> bool {
        self.closed.row_is_early(row)
    }
    fn reorder_rows(&mut self, q: &C::Coordinates) -> bool {
        self.closed.reorder_rows(q)
    }
}

/// A constrained system that also gives its rates without constraints, for methods that find the multipliers
/// themselves.
pub trait Unconstrained: Constrained
where
    Self::Scalar: Real,
{
    /// [`System::rates_at`] without constraints.
    fn open_rates(
        &mut self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        p: &Self::Momenta,
        qd: &mut Self::Coordinates,
        pd: &mut Self::Momenta,
    );
    /// `M v`.
    fn momenta(&mut self, q: &Self::Coordinates, v: &Self::Momenta, p: &mut Self::Momenta);
}

impl<O, C> Unconstrained for OpenAndClosed<O, C>
where
    C: Constrained,
    C::Scalar: Real,
    O: Conjugate<Scalar = C::Scalar, Coordinates = C::Coordinates, Momenta = C::Momenta>,
{
    fn open_rates(
        &mut self,
        t: C::Scalar,
        q: &C::Coordinates,
        p: &C::Momenta,
        qd: &mut C::Coordinates,
        pd: &mut C::Momenta,
    ) {
        self.open.rates_at(t, q, p, qd, pd);
    }
    fn momenta(&mut self, q: &C::Coordinates, v: &C::Momenta, p: &mut C::Momenta) {
        self.open.conjugate_momenta(q, v, p);
    }
}
