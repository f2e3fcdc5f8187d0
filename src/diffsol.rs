//! Stiff methods of the crate [`diffsol`](::diffsol) on any [`System`](crate::runtime::System): feature `diffsol`.
//!
//! BDF of variable order 1 to 5, and two singly diagonally implicit Runge-Kutta pairs. They see the state as plain
//! components, `y = (q, p)`. Rates are evaluated at quaternions scaled to unit length, and what is given back is scaled
//! as well; so the norm can drift within the tolerances only, unlike in the methods of
//! [`runtime::integrate`](crate::runtime::integrate), which are what to prefer on joints with quaternions. Without
//! joints with quaternions and planar joints the derivatives are the exact ones of [`Differentiable`]; with them,
//! differences of the rates: they serve Newton's iteration alone, whose result does not depend on them. Nothing keeps loops
//! closed: of mechanisms with constraints, positions drift within the tolerances.
//!
//! ```
//! use multibody::diffsol::{Diffsol, Stiff};
//! use multibody::runtime::System;
//!
//! multibody::mbd_model! {
//!     path = "models/double_pendulum.toml",
//!     name = DoublePendulum,
//!     outputs = [rates, energy, derivatives],
//! }
//!
//! let mut pendulum = DoublePendulum::new();
//! let (mut q, mut p) = (pendulum.neutral(), pendulum.zero_momenta());
//! q[0] = 1.0;
//! let solver = Diffsol { method: Stiff::Bdf, absolute: 1e-8, relative: 1e-8, ..Diffsol::default() };
//! let statistics = solver.run(&mut pendulum, 0.0, 1.0, &mut q, &mut p, |_, _, _| {})?;
//! assert!(statistics.steps > 20);
//! # Ok::<(), multibody::diffsol::Failure>(())
//! ```

use std::cell::RefCell;

use ::diffsol::{
    DiffsolError, NalgebraLU, NalgebraMat, OdeBuilder, OdeEquations, OdeSolverMethod, OdeSolverStopReason, Vector,
};

use crate::runtime::integrate::Statistics;
use crate::runtime::{Differentiable, StateDerivatives};

/// A method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stiff {
    /// Backward differentiation, order 1 to 5 as the error asks for: for very stiff motion that is smooth.
    #[default]
    Bdf,
    /// TR-BDF2, order 2: L-stable; loose tolerances.
    TrBdf2,
    /// ESDIRK 3(4) of A. Kværnø, order 4 with a third-order estimate: L-stable; middling tolerances.
    Esdirk34,
}

/// A method and its tolerances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffsol {
    /// Method.
    pub method: Stiff,
    /// Error that is allowed in a step, in the unit of each component.
    pub absolute: f64,
    /// The same, relative to the component's size.
    pub relative: f64,
    /// Steps at most.
    pub steps: u64,
}

impl Default for Diffsol {
    fn default() -> Self {
        Diffsol { method: Stiff::Bdf, absolute: 1e-6, relative: 1e-6, steps: u64::MAX }
    }
}

/// Why it stopped before the end. The state is then the last one that the method accepted.
#[derive(Clone, Debug)]
pub enum Failure {
    /// What diffsol says.
    Diffsol {
        /// Time that was reached, s.
        time: f64,
        /// The error.
        error: DiffsolError,
    },
    /// A component of the state is infinite or not a number.
    NotFinite {
        /// Time that was reached, s.
        time: f64,
        /// Index into `q`, then on into `p`.
        index: usize,
    },
    /// The limit of steps is used up.
    TooManySteps {
        /// Time that was reached, s.
        time: f64,
        /// Steps taken.
        steps: u64,
    },
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Failure::Diffsol { time, error } => write!(f, "diffsol stopped at t = {time} s: {error}"),
            Failure::NotFinite { time, index } => write!(
                f,
                "component {index} of the state is not finite at t = {time} s: tighten the tolerances, or look for a singular configuration"
            ),
            Failure::TooManySteps { time, steps } => {
                write!(f, "{steps} steps were used up at t = {time} s: raise the limit or loosen the tolerances")
            }
        }
    }
}

impl std::error::Error for Failure {}

type Matrix = NalgebraMat<f64>;
type Solver = NalgebraLU<f64>;

impl Diffsol {
    /// Runs from time `t` to `end` (s), `q` and `p` in place, and shows every step, `each(time, q, p)`. Allocates.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn run<Y>(
        &self,
        system: &mut Y,
        t: f64,
        end: f64,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
        each: impl FnMut(f64, &Y::Coordinates, &Y::Momenta),
    ) -> Result<Statistics, Failure>
    where
        Y: Differentiable<Scalar = f64>,
    {
        if end.partial_cmp(&t) != Some(std::cmp::Ordering::Greater) {
            return Ok(Statistics::default());
        }
        let nq = q.as_ref().len();
        let start = [q.as_ref(), p.as_ref()].concat();
        let n = start.len();
        let equation = RefCell::new(Equation::new(system));
        let problem = OdeBuilder::<Matrix>::new()
            .t0(t)
            .rtol(self.relative)
            .atol([self.absolute])
            .rhs_implicit(
                |y: &[f64], _: &[f64], t, out: &mut [f64]| equation.borrow_mut().rates(t, y, out),
                |y: &[f64], _: &[f64], t, along: &[f64], out: &mut [f64]| {
                    equation.borrow_mut().derivative(t, y, along, out)
                },
            )
            .init(move |_: &[f64], _, y: &mut [f64]| y.copy_from_slice(&start), n)
            .build();
        let fail = |error| Failure::Diffsol { time: t, error };
        let problem = problem.map_err(fail)?;
        let mut run = Run { each, q, p, nq, t, end, limit: self.steps, equation: &equation };
        match self.method {
            Stiff::Bdf => run.through(problem.bdf::<Solver>().map_err(fail)?),
            Stiff::TrBdf2 => run.through(problem.tr_bdf2::<Solver>().map_err(fail)?),
            Stiff::Esdirk34 => run.through(problem.esdirk34::<Solver>().map_err(fail)?),
        }
    }
}

/// What is carried through the steps.
struct Run<'a, 's, Y: Differentiable<Scalar = f64>, F> {
    each: F,
    q: &'a mut Y::Coordinates,
    p: &'a mut Y::Momenta,
    nq: usize,
    t: f64,
    end: f64,
    limit: u64,
    equation: &'a RefCell<Equation<'s, Y>>,
}

impl<Y, F> Run<'_, '_, Y, F>
where
    Y: Differentiable<Scalar = f64>,
    F: FnMut(f64, &Y::Coordinates, &Y::Momenta),
{
    fn through<'p, Eqn, M>(&mut self, mut method: M) -> Result<Statistics, Failure>
    where
        Eqn: OdeEquations<T = f64, V = ::diffsol::NalgebraVec<f64>> + 'p,
        M: OdeSolverMethod<'p, Eqn>,
    {
        let stopped = |time: f64| move |error| Failure::Diffsol { time, error };
        method.set_stop_time(self.end).map_err(stopped(self.t))?;
        let mut steps = 0;
        loop {
            let reason = method.step().map_err(stopped(self.t))?;
            steps += 1;
            let state = method.state();
            let y = state.y.clone_as_vec();
            if let Some(index) = y.iter().position(|x| !x.is_finite()) {
                return Err(Failure::NotFinite { time: self.t, index });
            }
            self.t = state.t;
            self.q.as_mut().copy_from_slice(&y[..self.nq]);
            self.p.as_mut().copy_from_slice(&y[self.nq..]);
            self.equation.borrow().to_sphere(self.q.as_mut());
            (self.each)(self.t, self.q, self.p);
            if matches!(reason, OdeSolverStopReason::TstopReached) {
                break;
            }
            if steps >= self.limit {
                return Err(Failure::TooManySteps { time: self.t, steps });
            }
        }
        let made = method.get_statistics();
        let equation = self.equation.borrow();
        let mut statistics = Statistics::default();
        statistics.steps = steps;
        statistics.rejections = (made.number_of_error_test_failures + made.number_of_nonlinear_solver_fails) as u64;
        statistics.evaluations = equation.evaluations;
        statistics.jacobians = equation.jacobians;
        statistics.factorisations = made.number_of_linear_solver_setups as u64;
        statistics.iterations = made.number_of_nonlinear_solver_iterations as u64;
        Ok(statistics)
    }
}

/// The system in plain components.
struct Equation<'s, Y: Differentiable<Scalar = f64>> {
    system: &'s mut Y,
    quaternions: Vec<usize>,
    /// Derivatives of the system are those by its coordinates.
    plain: bool,
    q: Y::Coordinates,
    p: Y::Momenta,
    qd: Y::Coordinates,
    pd: Y::Momenta,
    /// Where the derivatives below hold; rates there.
    at: (f64, Vec<f64>),
    rate: Vec<f64>,
    shifted: Vec<f64>,
    derivatives: StateDerivatives<Y::Momenta, Y::Square>,
    evaluations: u64,
    jacobians: u64,
}

impl<'s, Y: Differentiable<Scalar = f64>> Equation<'s, Y> {
    fn new(system: &'s mut Y) -> Self {
        let (q, p) = (system.neutral(), system.zero_momenta());
        let n = q.as_ref().len() + p.as_ref().len();
        Equation {
            quaternions: system.quaternions().collect(),
            plain: system.lie_joints().is_empty(),
            qd: q.clone(),
            pd: p.clone(),
            q,
            p,
            at: (f64::NAN, vec![f64::NAN; n]),
            rate: vec![0.0; n],
            shifted: vec![0.0; n],
            derivatives: system.zero_derivatives(),
            evaluations: 0,
            jacobians: 0,
            system,
        }
    }

    /// Scales quaternions to unit length.
    fn to_sphere(&self, q: &mut [f64]) {
        for &k in &self.quaternions {
            let norm = q[k..k + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
            q[k..k + 4].iter_mut().for_each(|x| *x /= norm);
        }
    }

    fn take(&mut self, y: &[f64]) {
        let (q, p) = y.split_at(self.q.as_ref().len());
        self.p.as_mut().copy_from_slice(p);
        let mut scaled = self.q.clone();
        scaled.as_mut().copy_from_slice(q);
        self.to_sphere(scaled.as_mut());
        self.q = scaled;
    }

    fn rates(&mut self, t: f64, y: &[f64], out: &mut [f64]) {
        self.take(y);
        self.system.rates_at(t, &self.q, &self.p, &mut self.qd, &mut self.pd);
        self.evaluations += 1;
        let (qd, pd) = out.split_at_mut(self.q.as_ref().len());
        qd.copy_from_slice(self.qd.as_ref());
        pd.copy_from_slice(self.pd.as_ref());
    }

    /// `out = J along`; one evaluation of the derivatives serves all directions at a place.
    fn derivative(&mut self, t: f64, y: &[f64], along: &[f64], out: &mut [f64]) {
        let new = self.at.0 != t || self.at.1 != y;
        if new {
            self.at.0 = t;
            self.at.1.copy_from_slice(y);
            self.jacobians += 1;
        }
        if self.plain {
            self.exact(new, t, y, along, out);
        } else {
            self.difference(new, t, y, along, out);
        }
    }

    fn exact(&mut self, new: bool, t: f64, y: &[f64], along: &[f64], out: &mut [f64]) {
        if new {
            self.take(y);
            self.system.rate_derivatives(t, &self.q, &self.p, &mut self.derivatives);
        }
        let n = self.p.as_ref().len();
        let (dq, dp) = along.split_at(n);
        let times = |row: &Y::Momenta, x: &[f64]| row.as_ref().iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        for (half, [by_q, by_p]) in out.chunks_mut(n).zip(self.derivatives.blocks()) {
            for (out, (by_q, by_p)) in half.iter_mut().zip(by_q.as_ref().iter().zip(by_p.as_ref())) {
                *out = times(by_q, dq) + times(by_p, dp);
            }
        }
    }

    /// Differences of the rates over a step of half the digits.
    fn difference(&mut self, new: bool, t: f64, y: &[f64], along: &[f64], out: &mut [f64]) {
        let mut rate = std::mem::take(&mut self.rate);
        if new {
            self.rates(t, y, &mut rate);
        }
        let size = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let step = 1.5e-8 * size(y).max(1.0) / size(along).max(1e-300);
        let mut shifted = std::mem::take(&mut self.shifted);
        for (to, (y, along)) in shifted.iter_mut().zip(y.iter().zip(along)) {
            *to = y + step * along;
        }
        self.rates(t, &shifted, out);
        for (out, rate) in out.iter_mut().zip(&rate) {
            *out = (*out - rate) / step;
        }
        (self.rate, self.shifted) = (rate, shifted);
    }
}
