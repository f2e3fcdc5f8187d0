//! Gauss-Legendre collocation of order 16, whose eight stages are lanes of one evaluation.
//!
//! The equations of the stages, `z_i = h Σ_j a_ij f(t + c_j h, z_j)`, are solved by fixed-point iteration. In an
//! iteration no stage waits for another: generated code evaluates all eight at once in vector registers
//! ([`System::rates_in_lanes`]), in little more time than one. An explicit method waits for one evaluation after the
//! other, and the latency of the operations is most of its time. After P. J. van der Houwen, B. P. Sommeijer, *Parallel
//! iteration of high-order Runge-Kutta methods with stepsize control*, J. Comput. Appl. Math. 29 (1990).
//!
//! Within an iteration the momenta are computed first, and the rates of the coordinates follow their changes by the
//! mobility, the inverse of the mass matrix near the middle of the step: a Gauss-Seidel iteration in place of Jacobi's. It
//! ends at the same stages after two thirds of the iterations.
//!
//! The rates at the stages are the values of a polynomial of degree 7, kept as a Legendre series `Σ c_k P_k`. It starts
//! the iteration of the next step, and the decay of its coefficients tells the error: if they fall by a factor `r` from
//! one to the next, the quadrature errs by `r¹⁷`, relative to the step. Within a step the displacement is the same
//! method's over a shorter step, which starts from the polynomial: so dense output is of order 16, too.

use alloc::vec;
use alloc::vec::Vec;

mod formula;
mod kernels;

use super::chart::{Chart, Point};
use super::in_lanes::InLanes;
use super::integrator::{Attempt, FromSystem, Integrator, Scheme};
use super::stepper::hermite;
use super::StepError;
use crate::kernel::call_lanes;
use crate::system::{Real, System};
use crate::Scalar;
use formula::{root, Formula, Row, STAGES};
use kernels::{total, Integrate, Iterate, Iteration, Multiply, Product};

/// Order of the method.
const ORDER: u32 = 16;
/// As [`Stepper::share`](super::Stepper::share).
const SHARE: f64 = 1.0 / 64.0;
/// Fraction of the allowed error that may remain after the iteration.
const PART: f64 = 0.02;
/// The decay of eight coefficients is extrapolated to the seventeenth: single steps err by a hundred times the result,
/// because the decay is uneven. With errors of order 17 this factor costs a few percent of the sweeps.
const MARGIN: f64 = 100.0;
/// Epsilons of the state that may remain where no tolerance is given.
const FLOOR: f64 = 4.0;
/// Most iterations of a step of fixed size, and of one under error control.
const LIMITS: [u32; 2] = [60, 14];
/// After more iterations than this the next step is shorter.
const MANY: u32 = 10;
/// Most evaluations, of all lanes, that the mobility may cost.
const MOBILITY: usize = 2;
/// Factor by which Legendre coefficients are expected to fall in the first step.
const DECAY: f64 = 0.2;
/// Factor of the step after an iteration that does not converge.
const SHORTER: f64 = 0.6;
/// The error that the next step is to have, relative to the allowed one, and the limits of its factor.
const TARGET: f64 = 0.1;
const FACTORS: [f64; 2] = [0.3, 2.0];
/// The largest factor after a rejected attempt, and the number of steps for which it holds: so attempts are not rejected
/// again and again where the motion is fast.
const CAUTIOUS: (f64, u32) = (1.05, 4);

/// Gauss-Legendre collocation of order 16 by fixed-point iteration, with error control: all stages at once (van der
/// Houwen and Sommeijer 1990). Its memory is allocated when it is made.
pub type Gauss16<Y> = Integrator<Y, ParallelGauss<Y>>;

/// The step whose polynomial is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Known {
    /// None.
    Nothing,
    /// One that ends where the present step starts.
    Last,
    /// An attempt from where the present step starts.
    This,
}

/// The scheme of [`Gauss16`].
#[derive(Clone, Debug)]
pub struct ParallelGauss<Y: System> {
    formula: Formula<Y::Scalar>,
    /// Displacements of the stages and their rates: `2 nv` rows.
    z: Vec<Row<Y::Scalar>>,
    f: Vec<Row<Y::Scalar>>,
    /// Legendre coefficients of the rates.
    series: Vec<Row<Y::Scalar>>,
    /// Reciprocals of the errors that the iteration may leave; zero where a component is not controlled. The number of
    /// the others.
    weights: Vec<Y::Scalar>,
    controlled: usize,
    lanes: InLanes<Y, STAGES>,
    /// The matrix by which rates of coordinates depend on momenta, row by row: the inverse mass matrix. Near the middle
    /// of the step, and empty where it would cost too many evaluations.
    mobility: Vec<Y::Scalar>,
    /// Changes of the momenta in an iteration.
    changes: Vec<Row<Y::Scalar>>,
    /// Factor by which Legendre coefficients fall.
    decay: f64,
    first: Point<Y>,
    /// Sizes of the components.
    size: Point<Y>,
    /// The step of the series, its size, s, and its displacement.
    known: Known,
    past_h: Y::Scalar,
    past: Point<Y>,
    /// Factor of the next step, and steps left in which it grows slowly.
    factor: f64,
    cautious: u32,
}

impl<Y: System> FromSystem<Y> for ParallelGauss<Y>
where
    Y::Scalar: Real,
{
    fn new(system: &Y) -> Self {
        let first = Point::zero(system);
        let nv = first.x.as_ref().len();
        let n = 2 * nv;
        let rows = || vec![[Y::Scalar::zero(); STAGES]; n];
        let mobility = if nv <= MOBILITY * (STAGES - 1) { nv * nv } else { 0 };
        ParallelGauss {
            formula: Formula::new(),
            z: rows(),
            f: rows(),
            series: rows(),
            weights: vec![Y::Scalar::zero(); n],
            controlled: 1,
            lanes: InLanes::new(system),
            mobility: vec![Y::Scalar::zero(); mobility],
            changes: vec![[Y::Scalar::zero(); STAGES]; nv],
            decay: DECAY,
            first,
            size: Point::zero(system),
            past: Point::zero(system),
            known: Known::Nothing,
            past_h: Y::Scalar::zero(),
            factor: 1.0,
            cautious: 0,
        }
    }
}

/// Whether a step may be replaced by a shorter one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pace {
    Fixed,
    Controlled,
}

/// How an iteration ended.
struct End {
    iterations: u32,
    /// Its last change, relative to what may remain.
    change: f64,
    converged: bool,
}

impl<Y: System> ParallelGauss<Y>
where
    Y::Scalar: Real,
{
    /// Sets what the iteration may leave.
    fn weigh(&mut self, step: &Attempt<Y>, system: &Y, h: Y::Scalar, scale: Option<&Point<Y>>) {
        let remaining = match scale {
            Some(scale) => scale,
            None => {
                step.field.chart().size(system, &mut self.size);
                for group in system.lie_joints() {
                    self.size.x.as_mut()[group.rotations()].fill(Y::Scalar::one());
                }
                for (size, rate) in self.size.parts_mut().into_iter().zip(self.first.parts()) {
                    let mut most = Y::Scalar::zero();
                    for (size, rate) in size.iter_mut().zip(rate) {
                        *size = *size + (h * *rate).abs();
                        most = if *size > most { *size } else { most };
                    }
                    // At rest in the origin, nothing tells the size but the unit.
                    size.fill(if most > Y::Scalar::zero() { most } else { Y::Scalar::one() });
                }
                &self.size
            }
        };
        let part = if scale.is_some() { PART } else { FLOOR * Y::Scalar::epsilon() };
        for (weight, remaining) in self.weights.iter_mut().zip(remaining.parts().into_iter().flatten()) {
            let allowed = Y::Scalar::constant(part) * *remaining;
            *weight = if allowed > Y::Scalar::zero() { Y::Scalar::one() / allowed } else { Y::Scalar::zero() };
        }
        self.controlled = self.weights.iter().filter(|w| **w > Y::Scalar::zero()).count().max(1);
    }

    /// Stages of a step of `h` on the known polynomial, or with the rate at the start if there is none.
    fn predict(&mut self, system: &Y, h: Y::Scalar) {
        if self.known == Known::Nothing {
            let c = self.formula.c.map(|c| h * c);
            for (z, rate) in self.z.iter_mut().zip(self.first.parts().into_iter().flatten()) {
                *z = c.map(|c| c * *rate);
            }
            return;
        }
        let (one, two) = (Y::Scalar::one(), Y::Scalar::constant(2.0));
        let start = if self.known == Known::Last { one } else { -one };
        let (turns, ratio) = (!system.lie_joints().is_empty(), two * h / self.past_h);
        let x = self.formula.c.map(|c| start + ratio * c);
        // Displacements that are not just added are those from the start of the known step, rewritten.
        let from = if turns { -one } else { start };
        let half = Y::Scalar::constant(0.5) * self.past_h;
        call_lanes::<Integrate, 0, STAGES, Y::Scalar, _>((&self.series[..], &x, from, half, &mut self.z[..]));
        if turns && self.known == Known::Last {
            let whole = &self.past;
            self.lanes.change_each(&mut self.z, |z| Chart::relative(system, whole, z));
        }
    }

    /// Iterates until the change of the stages says that the displacement is known well enough.
    fn converge(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar, pace: Pace) -> End {
        let times = self.formula.c.map(|c| t + c * h);
        let a = self.formula.a.map(|row| row.map(|a| h * a));
        let mean = 1.0 / (STAGES * self.controlled) as f64;
        // Squares of the changes, which spare a root and a quotient in each iteration.
        let (mut last, mut square) = (f64::INFINITY, f64::NAN);
        let end = |iterations, square, converged| End { iterations, change: libm::sqrt(square), converged };
        let limit = if pace == Pace::Controlled { LIMITS[1] } else { LIMITS[0] };
        for k in 1..=limit {
            self.lanes.rates(&mut step.field, system, &times, &self.z, &mut self.f);
            let mut squares = [Y::Scalar::zero(); STAGES];
            call_lanes::<Iterate, 0, STAGES, Y::Scalar, _>(Iteration {
                a: &a,
                f: &mut self.f,
                z: &mut self.z,
                mobility: &self.mobility,
                weights: &self.weights,
                changes: &mut self.changes,
                squares: &mut squares,
            });
            step.statistics.iterations += 1;
            square = mean * total(&squares).to_f64();
            // The last rates are those at the stages before the change, so that their error is what an iteration
            // leaves of it. Where a small change is not smaller than the one before, it is round-off.
            let left = if k == 1 { square } else { square * (square / last).min(1.0) };
            let small = PART * PART * square <= 1.0;
            if left <= 1.0 || (k > 4 && small && square >= last) {
                return end(k, square, true);
            }
            let hopeless = pace == Pace::Controlled && k > 3 && !small && square > 0.8 * last;
            if hopeless || !square.is_finite() {
                return end(k, square, false);
            }
            last = square;
        }
        end(limit, square, false)
    }

    /// The displacement at the end of a step, from the rates at its stages.
    fn displace(&self, h: Y::Scalar, out: &mut Point<Y>) {
        for (out, f) in out.parts_mut().into_iter().flatten().zip(&self.f) {
            let sum = f.iter().zip(&self.formula.b).fold(Y::Scalar::zero(), |sum, (f, b)| sum + *b * *f);
            *out = h * sum;
        }
    }

    /// Evaluates the mobility at the predicted middle of a step. Rates are linear in momenta: a lane for each momentum
    /// that is changed by one, beside one without a change.
    fn evaluate_mobility(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar) {
        let n = self.changes.len();
        let times = [t + Y::Scalar::constant(0.5) * h; STAGES];
        let of_lanes = STAGES - 1;
        let mut first = 0;
        while first < n && !self.mobility.is_empty() {
            let these = of_lanes.min(n - first);
            // The rows of the series are free until the iteration has ended.
            for (row, z) in self.series.iter_mut().zip(&self.z) {
                *row = [z[STAGES / 2]; STAGES];
            }
            for k in 0..these {
                let row = &mut self.series[n + first + k];
                row[k + 1] = row[k + 1] + Y::Scalar::one();
            }
            self.lanes.rates(&mut step.field, system, &times, &self.series, &mut self.f);
            for (f, mobility) in self.f.iter().zip(self.mobility.chunks_exact_mut(n)) {
                for k in 0..these {
                    mobility[first + k] = f[k + 1] - f[0];
                }
            }
            first += these;
        }
    }

    /// The series of the rates, and the error of the step that its decay tells, relative to the allowed one.
    fn error(&mut self, h: Y::Scalar) -> f64 {
        let mut squares = [Y::Scalar::zero(); STAGES];
        let Formula { series, .. } = &self.formula;
        let product: Product<_> = (&self.f, series, &self.weights, &mut self.series, &mut squares);
        call_lanes::<Multiply, 0, STAGES, Y::Scalar, _>(product);
        let squares = squares.map(|x| x.to_f64());
        let large = libm::sqrt(squares[0] + squares[1]);
        let mut decay = self.decay;
        // The first time with the decay of the last step, which may be much faster than that of this one.
        for _ in 0..2 {
            // The last coefficients may be small by chance: those before them tell what is to be expected.
            let square = decay * decay;
            let small = libm::sqrt(squares[STAGES / 2..].iter().fold(0.0, |small: f64, x| x.max(square * small)));
            // The coefficient that would follow, in relation to the first ones: eight steps of the decay.
            decay = root(decay * small / large, 3);
            decay = if decay > 0.0 { decay.clamp(0.02, 0.8) } else { DECAY };
        }
        self.decay = decay;
        // To the power of the order and one.
        let power = (0..4).fold(decay, |power, _| power * power) * decay;
        MARGIN * PART * h.to_f64() * large / libm::sqrt(self.controlled as f64) * power
    }
}

impl<Y: System> Scheme<Y> for ParallelGauss<Y>
where
    Y::Scalar: Real,
{
    fn order(&self) -> u32 {
        ORDER
    }

    fn error_order(&self) -> Option<u32> {
        Some(ORDER)
    }

    fn share(&self) -> f64 {
        SHARE
    }

    fn begin(&mut self) {
        self.known = Known::Nothing;
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        step.start_rate(system, t, &mut self.first);
        self.weigh(step, system, h, scale);
        self.lanes.begin(&step.field, system);
        self.predict(system, h);
        self.evaluate_mobility(step, system, t, h);
        let pace = if scale.is_some() { Pace::Controlled } else { Pace::Fixed };
        let mut end = self.converge(step, system, t, h, pace);
        if !end.converged && scale.is_none() && self.known != Known::Nothing {
            self.known = Known::Nothing;
            self.predict(system, h);
            end = self.converge(step, system, t, h, pace);
        }
        if !end.converged {
            (self.known, self.cautious) = (Known::Nothing, CAUTIOUS.1);
            let End { iterations, change, .. } = end;
            return match scale {
                Some(_) if change.is_finite() => Ok(libm::pow(SHORTER, -f64::from(ORDER + 1))),
                Some(_) => Ok(f64::NAN),
                None => Err(StepError::NoConvergence { time: t.to_f64(), step: h.to_f64(), iterations, change }),
            };
        }
        self.displace(h, &mut step.delta);
        let error = self.error(h);
        (self.known, self.past_h) = (Known::This, h);
        self.past.copy_from(&step.delta);
        // A root of order 17 would be exact; that of order 16 differs by a few percent.
        let factor = root(TARGET / error.max(1e-30), 4);
        let slow = f64::from(end.iterations.saturating_sub(MANY));
        self.cautious = if error > 1.0 { CAUTIOUS.1 } else { self.cautious.saturating_sub(1) };
        let most = match self.cautious {
            // A fixed step may take so many iterations that nothing would be left.
            _ if slow > 0.0 => (1.0 - 0.03 * slow).max(FACTORS[0]),
            0 => FACTORS[1],
            _ => CAUTIOUS.0,
        };
        self.factor = factor.clamp(FACTORS[0], most);
        Ok(if scale.is_some() { error } else { 0.0 })
    }

    fn advise(&mut self) -> Option<f64> {
        Some(self.factor)
    }

    fn start(&mut self) -> &mut Point<Y> {
        &mut self.first
    }

    fn accepted(&mut self, step: &mut Attempt<Y>, system: &Y, _h: Y::Scalar) -> bool {
        self.known = Known::Last;
        step.hand_on(system, &mut self.first)
    }

    fn interpolate(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        theta: Y::Scalar,
        out: &mut Point<Y>,
    ) {
        if theta == Y::Scalar::one() {
            return out.copy_from(&step.delta);
        }
        if theta == Y::Scalar::zero() {
            return out.clear();
        }
        self.predict(system, theta * h);
        if self.converge(step, system, t, theta * h, Pace::Fixed).converged {
            return self.displace(theta * h, out);
        }
        // The cubic through both ends and their rates, as of other methods.
        self.start_rate(step, system, t);
        step.end_rate(system, t, h);
        hermite(h, theta, &step.delta, [self.start(), &step.end], out);
    }
}
