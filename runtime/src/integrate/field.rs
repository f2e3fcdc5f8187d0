//! A mechanism as an ordinary differential equation in local coordinates.

use super::chart::{Chart, Point};
use super::StepError;
use crate::system::{Real, System};

/// The rates of a system in the chart about a state, and the number of their evaluations.
#[derive(Clone, Debug)]
pub struct Field<Y: System> {
    pub(super) chart: Chart<Y>,
    /// State of the last evaluation, and the rates of its coordinates.
    pub(super) q: Y::Coordinates,
    pub(super) p: Y::Momenta,
    qd: Y::Coordinates,
    /// Whether `(q, p)` is the state that the last [`Field::store`] gave.
    pub(super) stored: bool,
    evaluations: u64,
}

impl<Y> Field<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Makes it for one system; `compensated` as in [`Chart::new`].
    pub fn new(system: &Y, compensated: bool) -> Self {
        let (q, p) = (system.neutral(), system.zero_momenta());
        let chart = Chart::new(system, compensated);
        Field { chart, qd: q.clone(), q, p, stored: false, evaluations: 0 }
    }

    /// Evaluations of the rates so far.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Counts evaluations that were made elsewhere.
    #[cfg(feature = "alloc")]
    pub(super) fn count(&mut self, evaluations: u64) {
        self.evaluations += evaluations;
        self.stored = false;
    }

    /// The chart about the state that displacements start from.
    pub fn chart(&self) -> &Chart<Y> {
        &self.chart
    }

    /// Takes the state `(q, p)` at time `t` (s) as the one that displacements start from. If it is the one that
    /// [`Field::store`] gave, nothing is done: so what was carried over from rounded sums lives on.
    ///
    /// # Errors
    /// [`StepError::Quaternion`].
    pub fn load(&mut self, system: &Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        if !self.holds(q, p) {
            self.chart.load(system, t.to_f64(), q, p)?;
        }
        self.stored = false;
        Ok(())
    }

    /// Whether a state is the one that [`Field::store`] gave last, and nothing has been evaluated since. Methods with
    /// a history then continue.
    pub fn holds(&self, q: &Y::Coordinates, p: &Y::Momenta) -> bool {
        self.stored && self.q.as_ref() == q.as_ref() && self.p.as_ref() == p.as_ref()
    }

    /// Copies the state from which displacements start.
    pub fn store(&mut self, system: &Y, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        self.chart.base(system, &mut self.q, &mut self.p);
        q.as_mut().copy_from_slice(self.q.as_ref());
        p.as_mut().copy_from_slice(self.p.as_ref());
        self.stored = true;
    }

    /// Moves the state from which displacements start.
    ///
    /// # Errors
    /// [`StepError::NotFinite`]; nothing has moved then.
    pub fn advance(&mut self, system: &Y, t: Y::Scalar, point: &Point<Y>) -> Result<(), StepError> {
        self.chart.advance(system, t.to_f64(), point)
    }

    /// Rates of the displacement at time `t` (s) and displacement `point`.
    #[inline]
    pub fn rates(&mut self, system: &mut Y, t: Y::Scalar, point: &Point<Y>, out: &mut Point<Y>) {
        self.chart.state(system, point, &mut self.q, &mut self.p);
        system.rates_at(t, &self.q, &self.p, &mut self.qd, &mut out.p);
        self.stored = false;
        self.evaluations += 1;
        self.chart.rates(system, point, (&self.q, &self.p), &self.qd, out);
    }

    /// The coordinates' part of [`Field::rates`] in acceleration form: `q̇ = N(q) v`, which needs no evaluation of the
    /// system. The momenta of `out` are meaningless.
    pub fn velocities(&mut self, system: &Y, point: &Point<Y>, out: &mut Point<Y>) {
        self.chart.state(system, point, &mut self.q, &mut self.p);
        system.coordinate_rates(&self.q, &self.p, &mut self.qd);
        self.stored = false;
        self.chart.rates(system, point, (&self.q, &self.p), &self.qd, out);
    }
}
