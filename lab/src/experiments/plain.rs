//! Equations on plain numbers, and explicit steps whose errors can be examined component by component.
//!
//! The library's solvers combine all errors in one norm. The thesis's tables separate them, and count evaluations as
//! MATLAB's `ode45` does.

use multibody::runtime::integrate::tableau::Tableau;
use multibody::runtime::integrate::Constant;

/// The differential equation `ẏ = f(y)`.
pub trait Equation {
    /// Rates of a state.
    fn rates(&mut self, y: &[f64], rates: &mut [f64]);
    /// Modifies a state between two steps, so that the multipliers start at zero again. Returns whether it changed the
    /// state.
    fn between(&mut self, _y: &mut [f64]) -> bool {
        false
    }
}

/// A run of steps.
pub struct Walk<'a, const S: usize> {
    equation: &'a mut dyn Equation,
    tableau: &'static Tableau<S>,
    /// The state.
    pub y: Vec<f64>,
    k: Vec<Vec<f64>>,
    first_known: bool,
    next: Vec<f64>,
    /// Estimated errors of the last attempt.
    pub error: Vec<f64>,
    /// Evaluations so far.
    pub evaluations: u64,
    /// Whether the run continues with the result of lower order, whose error is estimated.
    pub lower: bool,
}

impl<'a, const S: usize> Walk<'a, S> {
    /// Starts at a state.
    pub fn new(equation: &'a mut dyn Equation, tableau: &'static Tableau<S>, y: &[f64]) -> Self {
        let zero = vec![0.0; y.len()];
        Walk {
            equation,
            tableau,
            y: y.to_vec(),
            k: vec![zero.clone(); S],
            first_known: false,
            next: zero.clone(),
            error: zero,
            evaluations: 0,
            lower: false,
        }
    }

    fn stage(&mut self, i: usize) {
        let (_, rest) = self.k.split_at_mut(i);
        self.equation.rates(&self.next, &mut rest[0]);
        self.evaluations += 1;
    }

    /// Rates at the state.
    pub fn start(&mut self) -> &[f64] {
        if !self.first_known {
            self.next.copy_from_slice(&self.y);
            self.stage(0);
            self.first_known = true;
        }
        &self.k[0]
    }

    fn combine(&mut self, h: f64, weights: &[Constant]) {
        // The small terms are added first, so that the state is rounded once.
        self.next.fill(0.0);
        sum(&mut self.next, h, weights, &self.k);
        self.next.iter_mut().zip(&self.y).for_each(|(next, y)| *next += y);
    }

    /// Attempts a step of `h` s: computes the new state and, if the method estimates them, its errors.
    pub fn attempt(&mut self, h: f64) -> &[f64] {
        self.start();
        let tableau = self.tableau;
        for i in 1..S {
            self.combine(h, &tableau.a[i][..i]);
            self.stage(i);
        }
        self.combine(h, &tableau.b);
        if let Some(row) = tableau.error.first() {
            self.error.fill(0.0);
            sum(&mut self.error, h, row, &self.k);
            if self.lower {
                self.next.iter_mut().zip(&self.error).for_each(|(next, error)| *next -= error);
            }
        }
        &self.next
    }

    /// Accepts the last attempt.
    pub fn accept(&mut self) {
        std::mem::swap(&mut self.y, &mut self.next);
        let changed = self.equation.between(&mut self.y);
        self.first_known = self.tableau.fsal && !changed;
        if self.first_known {
            self.k.swap(0, S - 1);
        }
    }

    /// Makes steps of the same size to the end, and calls `each` after every step.
    pub fn fixed(&mut self, h: f64, end: f64, mut each: impl FnMut(f64, &Self)) {
        let steps = (end / h).round() as u64;
        for step in 1..=steps {
            self.attempt(end / steps as f64);
            self.accept();
            each(end * step as f64 / steps as f64, self);
        }
    }
}

/// Adds `h Σ w k`.
fn sum(to: &mut [f64], h: f64, weights: &[Constant], rates: &[Vec<f64>]) {
    for (weight, rates) in weights.iter().zip(rates).filter(|(w, _)| !w.is_zero()) {
        let weight = h * weight.get::<f64>();
        to.iter_mut().zip(rates).for_each(|(to, rate)| *to += weight * rate);
    }
}

/// Largest of numbers relative to the larger of `threshold` and the size of the state.
fn relative(values: &[f64], sizes: impl Iterator<Item = f64>, threshold: f64) -> f64 {
    values.iter().zip(sizes).fold(0.0, |worst: f64, (v, size)| {
        let ratio = v.abs() / size.max(threshold);
        // A value that is not a number must not be lost.
        if ratio > worst || ratio.is_nan() {
            ratio
        } else {
            worst
        }
    })
}

/// Result of a run with error control.
pub struct Controlled {
    /// State at the end.
    pub y: Vec<f64>,
    /// Evaluations.
    pub evaluations: u64,
}

/// A run from time 0 with the step-size control of MATLAB's `ode45`, with equal absolute and relative tolerances: L. F.
/// Shampine, M. W. Reichelt, The MATLAB ODE suite, SIAM Journal on Scientific Computing 18 (1997). `None` where the
/// step becomes too small.
///
/// `ode45` itself has the tableau of Dormand and Prince.
pub fn controlled<const S: usize>(
    equation: &mut dyn Equation,
    tableau: &'static Tableau<S>,
    start: &[f64],
    end: f64,
    tolerance: f64,
) -> Option<Controlled> {
    const POWER: f64 = 0.2;
    // The ratio of the absolute to the relative tolerance.
    let threshold = 1.0;
    let mut walk = Walk::new(equation, tableau, start);
    let largest = 0.1 * end;
    let sizes = start.iter().map(|y| y.abs());
    let rate = relative(walk.start(), sizes, threshold) / (0.8 * tolerance.powf(POWER));
    let mut step = if largest * rate > 1.0 { 1.0 / rate } else { largest };
    let mut t = 0.0_f64;
    while t < end {
        let least = 16.0 * f64::EPSILON * t.max(f64::MIN_POSITIVE);
        step = step.clamp(least, largest);
        let last = 1.1 * step >= end - t;
        let mut h = if last { end - t } else { step };
        let mut failed = false;
        let error = loop {
            walk.attempt(h);
            let sizes = walk.next.iter().zip(&walk.y).map(|(a, b)| a.abs().max(b.abs()));
            let error = relative(&walk.error, sizes, threshold);
            if error <= tolerance {
                break error;
            }
            if h <= least || !error.is_finite() {
                return None;
            }
            let factor = if failed { 0.5 } else { (0.8 * (tolerance / error).powf(POWER)).max(0.1) };
            h = (h * factor).max(least);
            failed = true;
        };
        walk.accept();
        t = if last && !failed { end } else { t + h };
        step = if failed { h } else { h / (1.25 * (error / tolerance).powf(POWER)).max(0.2) };
    }
    Some(Controlled { y: walk.y, evaluations: walk.evaluations })
}
