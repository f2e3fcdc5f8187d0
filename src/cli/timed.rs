//! A mechanism that knows how long its rates take.

use std::time::{Duration, Instant};

use multibody::runtime::system::Group;
use multibody::runtime::{Blocks, Differentiable, Interpreter, System};

/// Most samples that are kept. Reading the clock costs a tenth of a small mechanism's rates.
const MOST: usize = 512;

/// Time that calls of one kind take. They do the same every time: what counts is the middle one of some samples, so that an
/// interruption by other programs is not taken for work.
struct Sampled {
    calls: u64,
    /// Every so many calls one is timed.
    every: u64,
    seconds: Vec<f64>,
}

impl Sampled {
    fn new() -> Self {
        Sampled { calls: 0, every: 1, seconds: Vec::with_capacity(MOST) }
    }

    fn time<R>(&mut self, clock: f64, f: impl FnOnce() -> R) -> R {
        self.calls += 1;
        if self.calls % self.every != 0 {
            return f();
        }
        let start = Instant::now();
        let result = f();
        self.seconds.push((start.elapsed().as_secs_f64() - clock).max(0.0));
        if self.seconds.len() == MOST {
            // Every other one stays, of the next every other one comes.
            let mut stays = false;
            self.seconds.retain(|_| {
                stays = !stays;
                stays
            });
            self.every *= 2;
        }
        result
    }

    fn total(&self) -> f64 {
        let mut seconds = self.seconds.clone();
        seconds.sort_by(f64::total_cmp);
        self.calls as f64 * seconds.get(seconds.len() / 2).copied().unwrap_or(0.0)
    }
}

/// The interpreter, with the time its rates and their derivatives take.
pub struct Timed {
    inner: Interpreter<f64>,
    /// Whether calls are for dense output rather than for steps.
    pub output: bool,
    /// What reading the clock takes, s.
    clock: f64,
    /// For steps and for output.
    rates: [Sampled; 2],
    derivatives: Sampled,
}

impl Timed {
    /// Around an interpreter.
    pub fn new(inner: Interpreter<f64>) -> Self {
        let readings = (0..100).map(|_| Instant::now().elapsed());
        let clock = readings.min().unwrap_or(Duration::ZERO).as_secs_f64();
        Timed { inner, output: false, clock, rates: [Sampled::new(), Sampled::new()], derivatives: Sampled::new() }
    }

    /// Time taken in steps by the rates and by their derivatives, s, as sampled.
    pub fn seconds(&self) -> (f64, f64) {
        (self.rates[0].total(), self.derivatives.total())
    }
}

impl System for Timed {
    type Scalar = f64;
    type Coordinates = Vec<f64>;
    type Momenta = Vec<f64>;

    fn neutral(&self) -> Vec<f64> {
        self.inner.neutral()
    }
    fn rest(&self) -> Vec<f64> {
        self.inner.rest()
    }
    fn groups(&self) -> &[Group] {
        self.inner.groups()
    }
    fn state_rates(&mut self, t: f64, q: &Vec<f64>, p: &Vec<f64>, qd: &mut Vec<f64>, pd: &mut Vec<f64>) {
        let Timed { inner, rates, clock, output, .. } = self;
        rates[usize::from(*output)].time(*clock, || inner.state_rates(t, q, p, qd, pd));
    }
    fn coordinate_rates(&self, q: &Vec<f64>, v: &Vec<f64>, qd: &mut Vec<f64>) {
        self.inner.coordinate_rates(q, v, qd);
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
        v: &mut Vec<f64>,
        pd: &mut Vec<f64>,
        blocks: Blocks<'_, Vec<Vec<f64>>>,
    ) {
        let Timed { inner, derivatives, clock, .. } = self;
        derivatives.time(*clock, || inner.rate_derivatives(t, q, p, v, pd, blocks));
    }
    fn depends_on_time(&self) -> bool {
        self.inner.depends_on_time()
    }
}
