//! A mechanism that measures the time of its rates.

use std::time::{Duration, Instant};

use multibody::runtime::system::{LieJoint, Row};
use multibody::runtime::{Constrained, Differentiable, Energetic, StateDerivatives, System};

use super::control::Driven;

/// Total time of calls of one kind.
#[derive(Clone, Copy, Debug, Default)]
struct Clocked {
    calls: u64,
    seconds: f64,
}

impl Clocked {
    fn time<R>(&mut self, f: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = f();
        self.seconds += start.elapsed().as_secs_f64();
        self.calls += 1;
        result
    }
}

/// A mechanism with its control, and the times of its rates and their derivatives.
pub struct Timed {
    inner: Driven,
    /// Whether calls are for dense output rather than for steps.
    pub output: bool,
    /// Whether the order of its rows has changed.
    pub reordered: bool,
    /// Time of reading the clock once, s.
    clock: f64,
    /// Times in steps, and in output.
    rates: [Clocked; 2],
    derivatives: Clocked,
    /// Times of projection and position correction, at the ends of steps and in output.
    constraints: [Clocked; 2],
}

impl Timed {
    /// Wraps a mechanism.
    pub fn new(inner: Driven) -> Self {
        let readings = (0..100).map(|_| Instant::now().elapsed());
        let clock = readings.min().unwrap_or(Duration::ZERO).as_secs_f64();
        Timed {
            inner,
            output: false,
            reordered: false,
            clock,
            rates: Default::default(),
            derivatives: Clocked::default(),
            constraints: Default::default(),
        }
    }

    /// Times in steps, s: of the rates, of their derivatives, of projection and position correction, and of reading the
    /// clock around them.
    pub fn seconds(&self) -> [f64; 4] {
        let kinds = [self.rates[0], self.derivatives, self.constraints[0]];
        // Each measured call includes one of its two readings of the clock.
        let [rates, derivatives, constraints] = kinds.map(|k| (k.seconds - k.calls as f64 * self.clock).max(0.0));
        [rates, derivatives, constraints, 2.0 * self.clock * kinds.iter().map(|k| k.calls as f64).sum::<f64>()]
    }
}

impl Energetic for Timed {
    fn energies(&mut self, q: &Vec<f64>, p: &Vec<f64>) -> (f64, f64) {
        self.inner.energy(q, p)
    }
}

impl System for Timed {
    type Scalar = f64;
    type Coordinates = Vec<f64>;
    type Momenta = Vec<f64>;

    fn neutral(&self) -> Vec<f64> {
        self.inner.neutral()
    }
    fn zero_momenta(&self) -> Vec<f64> {
        self.inner.zero_momenta()
    }
    fn lie_joints(&self) -> &[LieJoint] {
        self.inner.lie_joints()
    }
    fn rates_at(&mut self, t: f64, q: &Vec<f64>, p: &Vec<f64>, qd: &mut Vec<f64>, pd: &mut Vec<f64>) {
        let Timed { inner, rates, output, .. } = self;
        rates[usize::from(*output)].time(|| inner.rates_at(t, q, p, qd, pd));
    }
    fn coordinate_rates(&self, q: &Vec<f64>, v: &Vec<f64>, qd: &mut Vec<f64>) {
        self.inner.coordinate_rates(q, v, qd);
    }
}

impl Constrained for Timed {
    type Rows = Vec<f64>;
    type Entries = Vec<f64>;

    fn zero_rows(&self) -> Vec<f64> {
        self.inner.zero_rows()
    }
    fn zero_entries(&self) -> Vec<f64> {
        self.inner.zero_entries()
    }
    fn rows(&self) -> &[Row] {
        self.inner.rows()
    }
    fn entry_columns(&self) -> &[usize] {
        self.inner.entry_columns()
    }
    fn constraint_residuals(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) {
        self.inner.constraint_residuals(q, residual, jacobian);
    }
    fn project_momenta(&mut self, t: f64, q: &Vec<f64>, p: &mut Vec<f64>, v: &mut Vec<f64>, sigma: &mut Vec<f64>) {
        let Timed { inner, constraints, output, .. } = self;
        constraints[usize::from(*output)].time(|| inner.project_momenta(t, q, p, v, sigma));
    }
    fn position_correction(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, dq: &mut Vec<f64>, pivots: &mut Vec<f64>) {
        let Timed { inner, constraints, output, .. } = self;
        constraints[usize::from(*output)].time(|| inner.position_correction(q, residual, dq, pivots));
    }
    fn multipliers(&mut self, t: f64, q: &Vec<f64>, v: &Vec<f64>, lambda: &mut Vec<f64>) {
        self.inner.multipliers(t, q, v, lambda);
    }
    fn row_is_early(&self, row: usize) -> bool {
        self.inner.row_is_early(row)
    }
    fn reorder_rows(&mut self, q: &Vec<f64>) -> bool {
        let changed = self.inner.reorder_rows(q);
        self.reordered |= changed;
        changed
    }
}

impl Differentiable for Timed {
    type Square = Vec<Vec<f64>>;

    fn square(&self) -> Vec<Vec<f64>> {
        self.inner.square()
    }
    fn rate_derivatives(
        &mut self,
        t: f64,
        q: &Vec<f64>,
        p: &Vec<f64>,
        out: &mut StateDerivatives<Vec<f64>, Vec<Vec<f64>>>,
    ) {
        let Timed { inner, derivatives, .. } = self;
        derivatives.time(|| inner.rate_derivatives(t, q, p, out));
    }
    fn depends_on_time(&self) -> bool {
        self.inner.depends_on_time()
    }
}
