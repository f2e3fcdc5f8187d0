//! A mechanism as an ordinary differential equation in local coordinates.

use super::chart::{Chart, Point};
use super::weights::Row;
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
    #[inline(always)]
    pub fn new(system: &Y, compensated: bool) -> Self {
        Field {
            chart: Chart::new(system, compensated),
            q: system.neutral(),
            p: system.zero_momenta(),
            qd: system.neutral(),
            stored: false,
            evaluations: 0,
        }
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
        // Where nothing is carried over, it is less work to copy a state than to compare it.
        let known = !(Self::is_plain(system) && self.chart.is_exact()) && self.holds(system, q, p);
        // A state that is refused leaves the chart somewhere else than at the one that was stored.
        self.stored = false;
        match known {
            true => Ok(()),
            false => self.chart.load(system, t.to_f64(), q, p),
        }
    }

    /// Whether the chart's state is the state itself, because all displacements are added.
    fn is_plain(system: &Y) -> bool {
        system.lie_joints().is_empty()
    }

    /// Whether a state is the one that [`Field::store`] gave last, and nothing has been evaluated since. Methods with
    /// a history then continue.
    pub fn holds(&self, system: &Y, q: &Y::Coordinates, p: &Y::Momenta) -> bool {
        let (q0, p0) = match Self::is_plain(system) {
            true => self.chart.held(),
            false => (self.q.as_ref(), self.p.as_ref()),
        };
        self.stored && q0 == q.as_ref() && p0 == p.as_ref()
    }

    /// Copies the state from which displacements start.
    pub fn store(&mut self, system: &Y, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        self.chart.base(system, q, p);
        if !Self::is_plain(system) {
            self.q.as_mut().copy_from_slice(q.as_ref());
            self.p.as_mut().copy_from_slice(p.as_ref());
        }
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
        self.evaluate(system, t, point, out);
    }

    /// Rates at time `t` (s) and the displacement `h Σ wⱼ k_j`. Overwrites `stage`, where the
    /// displacement is stored if it takes more than addition to reach the state there.
    #[inline(always)]
    pub(super) fn stage_rates(
        &mut self,
        system: &mut Y,
        (t, h): (Y::Scalar, Y::Scalar),
        (weights, k): (Row, &[Point<Y>]),
        stage: &mut Point<Y>,
        out: &mut Point<Y>,
    ) {
        if Self::is_plain(system) {
            self.chart.stage(h, (weights, k), &mut self.q, &mut self.p);
        } else {
            stage.combine(h, weights, k);
            self.chart.stage_state(system, stage, &mut self.q, &mut self.p);
        }
        self.evaluate(system, t, stage, out);
    }

    /// Rates at the state `(q, p)` of this field, to which the displacement `point` leads.
    #[inline(always)]
    fn evaluate(&mut self, system: &mut Y, t: Y::Scalar, point: &Point<Y>, out: &mut Point<Y>) {
        self.stored = false;
        self.evaluations += 1;
        if system.rates_by_velocities(t, &self.q, &self.p, &mut out.x, &mut out.p) {
            return;
        }
        system.rates_at(t, &self.q, &self.p, &mut self.qd, &mut out.p);
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
