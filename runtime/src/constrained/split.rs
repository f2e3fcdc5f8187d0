//! A mechanism with its constraints, and without.

use crate::system::{Conjugate, Constrained, Energetic, Group, Real, Row, System};

/// The same mechanism twice: `open`, whose constraints are not looked at, and `closed`. Both have the same state layout, and the
/// same inputs, which are set in both. As a [`System`] it is the closed one.
#[derive(Clone, Debug)]
pub struct Split<O, C> {
    /// Without constraints.
    pub open: O,
    /// With them.
    pub closed: C,
}

impl<O, C: System> System for Split<O, C> {
    type Scalar = C::Scalar;
    type Coordinates = C::Coordinates;
    type Momenta = C::Momenta;

    fn neutral(&self) -> C::Coordinates {
        self.closed.neutral()
    }
    fn rest(&self) -> C::Momenta {
        self.closed.rest()
    }
    fn groups(&self) -> &[Group] {
        self.closed.groups()
    }
    fn state_rates(
        &mut self,
        t: C::Scalar,
        q: &C::Coordinates,
        p: &C::Momenta,
        qd: &mut C::Coordinates,
        pd: &mut C::Momenta,
    ) {
        self.closed.state_rates(t, q, p, qd, pd);
    }
    fn coordinate_rates(&self, q: &C::Coordinates, v: &C::Momenta, qd: &mut C::Coordinates) {
        self.closed.coordinate_rates(q, v, qd);
    }
}

impl<O, C: Energetic> Energetic for Split<O, C> {
    fn state_energy(&mut self, q: &C::Coordinates, p: &C::Momenta) -> (C::Scalar, C::Scalar) {
        self.closed.state_energy(q, p)
    }
}

impl<O, C: Constrained> Constrained for Split<O, C> {
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
    fn closure(&mut self, q: &C::Coordinates, residual: &mut C::Rows, jacobian: &mut C::Entries) {
        self.closed.closure(q, residual, jacobian);
    }
    fn settle(
        &mut self,
        t: C::Scalar,
        q: &C::Coordinates,
        p: &mut C::Momenta,
        v: &mut C::Momenta,
        sigma: &mut C::Rows,
    ) {
        self.closed.settle(t, q, p, v, sigma);
    }
    fn correction(&mut self, q: &C::Coordinates, residual: &mut C::Rows, dq: &mut C::Momenta, pivots: &mut C::Rows) {
        self.closed.correction(q, residual, dq, pivots);
    }
    fn multipliers(&mut self, t: C::Scalar, q: &C::Coordinates, v: &C::Momenta, lambda: &mut C::Rows) {
        self.closed.multipliers(t, q, v, lambda);
    }
}

/// What methods that work with multipliers of their own need of a system.
pub trait Parted: Constrained
where
    Self::Scalar: Real,
{
    /// [`System::state_rates`] without constraints.
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

impl<O, C> Parted for Split<O, C>
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
        self.open.state_rates(t, q, p, qd, pd);
    }
    fn momenta(&mut self, q: &C::Coordinates, v: &C::Momenta, p: &mut C::Momenta) {
        self.open.state_momenta(q, v, p);
    }
}
