//! The growth of errors: the tangent flow, by integrating dual numbers.

use multibody::codegen::plan::Plan;
use multibody::runtime::constrained::Effort;
use multibody::runtime::integrate::{Step, StepError, Tolerances};
use multibody::runtime::{Dual, Interpreter, Scalar, System};

use super::{driver, interpreter, Record, Settings};
use crate::displacement::displacement;

/// Number of parts of the run at whose ends the growth is measured.
const PARTS: usize = 64;
/// Tolerance of the tangent flow: rates of growth are wanted to a few digits.
const TOLERANCE: f64 = 1e-8;

/// Growth by this power of e in the second half of a run counts as exponential; it would be that of `t⁴·³`.
const E_FOLDS: f64 = 3.0;

/// Growth of errors over a run.
pub struct Growth {
    /// Slope of the logarithm of errors over the second half, 1/s: the largest Lyapunov exponent as far as the run
    /// shows it.
    pub rate: f64,
    /// Increase of the logarithm over the second half.
    pub increase: f64,
    /// Factor by which errors grow from the start to the end.
    pub factor: f64,
}

impl Growth {
    /// Whether errors grow exponentially as far as the run shows it: in its second half by more than [`E_FOLDS`].
    /// Regular motions have errors that grow with the time or its square, by `k ln 2` in the second half.
    pub fn exponential(&self) -> bool {
        self.increase > E_FOLDS
    }

    /// Exponent `k` of errors that grow with `tᵏ`.
    pub fn power(&self) -> f64 {
        self.increase / 2.0_f64.ln()
    }
}

/// Integrates the tangent flow along the motion of a record.
///
/// The start has a displacement with a component along every coordinate and momentum, so that the direction that grows
/// most is in it. After each part of the run its logarithm is taken and the displacement scaled back: its equation is
/// linear. Components count in the measure of the tolerances, rad and m, and momenta relative to the largest one.
pub fn growth(plan: &Plan, settings: &Settings, record: &Record) -> Result<Growth, StepError> {
    let mut system = interpreter::<Dual<f64>>(plan);
    let largest = record.p.iter().flatten().fold(0.0_f64, |m, p| m.max(p.abs()));
    let unit = if largest > 0.0 { largest } else { 1.0 };
    let constant = |x: &Vec<f64>| x.iter().map(|x| Dual::constant(*x)).collect::<Vec<_>>();
    let (mut q, mut p) = (constant(&record.q[0]), constant(&record.p[0]));
    // Irrational parts of the golden ratio: no component is small, and none is a multiple of another.
    let mut part = (1..).map(|k| 0.3 + (f64::from(k) * 0.618_033_988_749_894_9).fract());
    let along: Vec<Dual<f64>> = p.iter().zip(&mut part).map(|(_, x)| Dual::constant(x)).collect();
    let mut qd = q.clone();
    system.coordinate_rates(&q, &along, &mut qd);
    q.iter_mut().zip(&qd).for_each(|(q, along)| q.du = along.re);
    p.iter_mut().zip(&mut part).for_each(|(p, x)| p.du = x * unit);
    let tolerances = match settings.step {
        Step::Adaptive(tolerances) => Tolerances::new(tolerances.rotations.max(TOLERANCE)),
        Step::Fixed(_) => Tolerances::new(TOLERANCE),
    };
    let length = settings.time / PARTS as f64;
    let (mut logarithm, mut points) = (0.0, vec![0.0]);
    let first = size(&system, &q, &p, unit);
    scale(&mut q, &mut p, 1.0 / first);
    for _ in 0..PARTS {
        let mut driver = driver(&mut system, (&q, &p), tolerances, settings, Effort::default().tolerance)?;
        driver.run(&mut system, Dual::constant(length))?;
        driver.state(&system, &mut q, &mut p);
        let grown = size(&system, &q, &p, unit);
        logarithm += grown.ln();
        points.push(logarithm);
        scale(&mut q, &mut p, 1.0 / grown);
    }
    let second = &points[PARTS / 2..];
    let rate = slope(second) / length;
    Ok(Growth { rate, increase: rate * (second.len() - 1) as f64 * length, factor: logarithm.exp() })
}

/// Length of the displacement that a state carries.
fn size(system: &Interpreter<Dual<f64>>, q: &Vec<Dual<f64>>, p: &Vec<Dual<f64>>, unit: f64) -> f64 {
    let still = |x: &Vec<Dual<f64>>| x.iter().map(|x| Dual::constant(x.re)).collect::<Vec<_>>();
    let x = displacement(system, (&still(q), &still(p)), (q, p));
    let momenta = p.iter().map(|p| p.du / unit);
    x.iter().map(|x| x.du).chain(momenta).fold(0.0_f64, |n, x| n.hypot(x))
}

fn scale(q: &mut [Dual<f64>], p: &mut [Dual<f64>], factor: f64) {
    q.iter_mut().chain(p).for_each(|x| x.du *= factor);
}

/// Slope of the line of least squares through values at 0, 1, 2, ..
fn slope(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let (middle, mean) = ((n - 1.0) / 2.0, values.iter().sum::<f64>() / n);
    let offset = |k: usize| k as f64 - middle;
    let above: f64 = values.iter().enumerate().map(|(k, y)| offset(k) * (y - mean)).sum();
    above / (0..values.len()).map(|k| offset(k) * offset(k)).sum::<f64>()
}
