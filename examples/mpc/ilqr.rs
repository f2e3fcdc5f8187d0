//! Optimal control with bounded inputs: the iterative linear-quadratic regulator with box constraints (Y. Tassa,
//! N. Mansard, E. Todorov, *Control-limited differential dynamic programming*, ICRA 2014).
//!
//! The cost is `Σ ½ (y − g)ᵀ Q (y − g) + ½ uᵀ R u` over all nodes but the last, and `½ (y − g)ᵀ Q_N (y − g)` at the last,
//! with diagonal weights; `y` is the state, or what [`Dynamics`] computes of it. Nothing is allocated, and no function beyond the four operations is called, so that the bits are
//! the same on every machine.

use super::box_minimum::{box_minimum, clamp};
use super::steps::Dynamics;
use super::{Real, Scalar};

/// Weights, goal and bounds.
#[derive(Clone, Debug)]
pub struct Problem<S, const NX: usize, const NU: usize> {
    /// The values of `y` to be reached.
    pub goal: [S; NX],
    /// Diagonal of `Q`.
    pub running: [S; NX],
    /// Diagonal of `Q_N`.
    pub end: [S; NX],
    /// Diagonal of `R`.
    pub effort: [S; NU],
    /// Least inputs, greatest inputs.
    pub bounds: [[S; NU]; 2],
}

impl<S: Real, const NX: usize, const NU: usize> Problem<S, NX, NU> {
    fn state_cost(&self, weights: &[S; NX], y: &[S; NX]) -> S {
        let half = S::constant(0.5);
        (0..NX).fold(S::zero(), |sum, i| {
            let e = y[i] - self.goal[i];
            sum + half * weights[i] * e * e
        })
    }

    fn effort_cost(&self, u: &[S; NU]) -> S {
        let half = S::constant(0.5);
        (0..NU).fold(S::zero(), |sum, i| sum + half * self.effort[i] * u[i] * u[i])
    }

    fn clamp(&self, i: usize, u: S) -> S {
        clamp(u, self.bounds[0][i], self.bounds[1][i])
    }
}

/// How an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress<S> {
    /// The cost fell by this part of itself.
    Improved(S),
    /// No direction reduces the cost by more than rounding.
    Converged,
    /// No step along the direction reduces the cost; the next iteration is more cautious.
    Rejected,
}

/// Trajectory of `N` nodes, of which the last has no input, and the policy along it.
#[derive(Clone, Debug)]
pub struct Ilqr<S, const NX: usize, const NU: usize, const N: usize> {
    /// States.
    pub x: [[S; NX]; N],
    /// Inputs.
    pub u: [[S; NU]; N],
    /// Cost of the trajectory.
    pub cost: S,
    /// Feedback `δu = K δx` along the trajectory.
    pub gains: [[[S; NX]; NU]; N],
    change: [[S; NU]; N],
    trial: ([[S; NX]; N], [[S; NU]; N]),
    regular: S,
    /// Trajectories that the last iteration tried.
    pub tried: u32,
}

impl<S: Real, const NX: usize, const NU: usize, const N: usize> Ilqr<S, NX, NU, N> {
    /// The trajectory of given inputs, all the same, from a state.
    pub fn new(
        dynamics: &mut impl Dynamics<S, NX, NU>,
        problem: &Problem<S, NX, NU>,
        x: &[S; NX],
        u: &[S; NU],
    ) -> Self {
        let zero = S::zero();
        let u = [core::array::from_fn(|i| problem.clamp(i, u[i])); N];
        let (gains, change) = ([[[zero; NX]; NU]; N], [[zero; NU]; N]);
        let mut all = Ilqr { x: [*x; N], u, cost: zero, gains, change, trial: ([*x; N], u), regular: zero, tried: 0 };
        all.cost = all.roll_out(dynamics, problem, x, zero);
        all.take();
        all
    }

    /// Starts the trajectory from another state, with the inputs and the policy that it has.
    pub fn start(&mut self, dynamics: &mut impl Dynamics<S, NX, NU>, problem: &Problem<S, NX, NU>, x: &[S; NX]) {
        self.cost = self.roll_out(dynamics, problem, x, S::zero());
        self.take();
    }

    fn take(&mut self) {
        self.x = self.trial.0;
        self.u = self.trial.1;
    }

    /// Cost of the trial trajectory with inputs `u + α k + K (x̂ − x)`, within their bounds.
    fn roll_out(
        &mut self,
        dynamics: &mut impl Dynamics<S, NX, NU>,
        problem: &Problem<S, NX, NU>,
        start: &[S; NX],
        alpha: S,
    ) -> S {
        let (xs, us) = &mut self.trial;
        let (mut x, mut cost) = (*start, S::zero());
        for k in 0..N - 1 {
            xs[k] = x;
            for i in 0..NU {
                let mut u = self.u[k][i] + alpha * self.change[k][i];
                for j in 0..NX {
                    u = u + self.gains[k][i][j] * (x[j] - self.x[k][j]);
                }
                us[k][i] = problem.clamp(i, u);
            }
            let (next, y) = dynamics.step_weighed(&x, &us[k]);
            cost = cost + problem.state_cost(&problem.running, &y) + problem.effort_cost(&us[k]);
            x = next;
        }
        xs[N - 1] = x;
        cost + problem.state_cost(&problem.end, &dynamics.weighed(&x))
    }

    /// The cost after a step of length `alpha` along the policy, which is not taken.
    pub fn try_step(&mut self, dynamics: &mut impl Dynamics<S, NX, NU>, problem: &Problem<S, NX, NU>, alpha: S) -> S {
        let start = self.x[0];
        self.tried += 1;
        self.roll_out(dynamics, problem, &start, alpha)
    }

    /// One iteration: the policy from the end to the start, then a step along it that reduces the cost.
    pub fn iterate(&mut self, dynamics: &mut impl Dynamics<S, NX, NU>, problem: &Problem<S, NX, NU>) -> Progress<S> {
        self.tried = 0;
        let Some([linear, quadratic]) = self.direction(dynamics, problem) else {
            self.cautious();
            return Progress::Rejected;
        };
        if !(self.cost.is_finite() && linear.is_finite()) {
            self.cautious();
            return Progress::Rejected;
        }
        let least = S::constant(8.0 * S::epsilon()) * self.cost;
        let falls = -linear > least;
        if !falls {
            return Progress::Converged;
        }
        let half = S::constant(0.5);
        let mut alpha = S::one();
        for _ in 0..12 {
            let cost = self.try_step(dynamics, problem, alpha);
            let expected = -(alpha * linear + alpha * alpha * quadratic);
            let reduced = self.cost - cost;
            if cost.is_finite() && reduced > S::constant(1e-4) * expected {
                let part = reduced / self.cost;
                self.cost = cost;
                self.take();
                self.regular = self.regular * S::constant(0.1);
                return Progress::Improved(part);
            }
            alpha = alpha * half;
        }
        self.cautious();
        Progress::Rejected
    }

    fn cautious(&mut self) {
        let more = self.regular * S::constant(10.0);
        self.regular = if more < S::constant(1e-6) { S::constant(1e-6) } else { more };
    }

    /// The policy; returns what it changes the cost by in the first and second order, or `None` where the input's Hessian is
    /// not positive definite.
    pub fn direction(
        &mut self,
        dynamics: &mut impl Dynamics<S, NX, NU>,
        problem: &Problem<S, NX, NU>,
    ) -> Option<[S; 2]> {
        let zero = S::zero();
        let mut value = Value { x: [zero; NX], xx: [[zero; NX]; NX] };
        let y = dynamics.weighed_again(&self.x[N - 1], true);
        let d = core::array::from_fn(|i| problem.end[i] * (y[i] - problem.goal[i]));
        dynamics.add_weighed(&d, &problem.end, &mut value.x, &mut value.xx);
        let (mut a, mut b) = ([[zero; NX]; NX], [[zero; NU]; NX]);
        let mut expected = [zero; 2];
        for k in (0..N - 1).rev() {
            let (x, u) = (&self.x[k], &self.u[k]);
            dynamics.linearise(x, u, &mut a, &mut b);
            let mut q = Expansion::of(&value, &a, &b);
            let y = dynamics.weighed_again(x, false);
            let d = core::array::from_fn(|i| problem.running[i] * (y[i] - problem.goal[i]));
            dynamics.add_weighed(&d, &problem.running, &mut q.x, &mut q.xx);
            let mut regular = q.uu;
            for i in 0..NU {
                q.uu[i][i] = q.uu[i][i] + problem.effort[i];
                q.u[i] = q.u[i] + problem.effort[i] * u[i];
                regular[i][i] = q.uu[i][i] + self.regular;
            }
            let room = [0, 1].map(|side| core::array::from_fn(|i| problem.bounds[side][i] - u[i]));
            let solution = box_minimum(&regular, &q.u, &room)?;
            let (step, gain) = (solution.x, solution.gains(&q.ux));
            for i in 0..NU {
                let curved = (0..NU).fold(zero, |sum, j| sum + q.uu[i][j] * step[j]);
                expected[0] = expected[0] + step[i] * q.u[i];
                expected[1] = expected[1] + S::constant(0.5) * step[i] * curved;
            }
            q.under(&step, &gain, &mut value);
            (self.change[k], self.gains[k]) = (step, gain);
        }
        Some(expected)
    }
}

/// Cost to go from a node, to second order: gradient and Hessian in the state.
struct Value<S, const NX: usize> {
    x: [S; NX],
    xx: [[S; NX]; NX],
}

/// The same before the input is chosen.
struct Expansion<S, const NX: usize, const NU: usize> {
    x: [S; NX],
    u: [S; NU],
    xx: [[S; NX]; NX],
    ux: [[S; NX]; NU],
    uu: [[S; NU]; NU],
}

impl<S: Real, const NX: usize, const NU: usize> Expansion<S, NX, NU> {
    /// The value at the next node as a function of state and input: `Aᵀ V A`, `Bᵀ V A`, `Bᵀ V B`.
    fn of(value: &Value<S, NX>, a: &[[S; NX]; NX], b: &[[S; NU]; NX]) -> Self {
        let (va, vb) = (product(&value.xx, a), product(&value.xx, b));
        Expansion {
            x: transposed_times(a, &value.x),
            u: transposed_times(b, &value.x),
            xx: transposed_product(a, &va),
            ux: transposed_product(b, &va),
            uu: transposed_product(b, &vb),
        }
    }

    /// The value under the policy `δu = k + K δx`:
    /// `V_x = Q_x + Kᵀ (Q_uu k + Q_u) + Q_xuᵀ k`, `V_xx = Q_xx + Kᵀ (Q_uu K + Q_ux) + Q_uxᵀ K`.
    fn under(&self, step: &[S; NU], gain: &[[S; NX]; NU], value: &mut Value<S, NX>) {
        let inner: [S; NU] = core::array::from_fn(|i| (0..NU).fold(self.u[i], |sum, j| sum + self.uu[i][j] * step[j]));
        let mut curved = product(&self.uu, gain);
        for (row, ux) in curved.iter_mut().zip(&self.ux) {
            row.iter_mut().zip(ux).for_each(|(x, q)| *x = *x + *q);
        }
        let (left, right) = (transposed_product(gain, &curved), transposed_product(&self.ux, gain));
        let (first, second) = (transposed_times(gain, &inner), transposed_times(&self.ux, step));
        for i in 0..NX {
            value.x[i] = self.x[i] + first[i] + second[i];
            for j in 0..NX {
                value.xx[i][j] = self.xx[i][j] + left[i][j] + right[i][j];
            }
        }
        for i in 0..NX {
            for j in 0..i {
                let mean = S::constant(0.5) * (value.xx[i][j] + value.xx[j][i]);
                (value.xx[i][j], value.xx[j][i]) = (mean, mean);
            }
        }
    }
}

/// `A B`.
fn product<S: Scalar, const M: usize, const K: usize, const N: usize>(a: &[[S; K]; M], b: &[[S; N]; K]) -> [[S; N]; M] {
    let mut out = [[S::zero(); N]; M];
    for (row, a) in out.iter_mut().zip(a) {
        for (a, b) in a.iter().zip(b) {
            row.iter_mut().zip(b).for_each(|(x, b)| *x = *x + *a * *b);
        }
    }
    out
}

/// `Aᵀ B`.
fn transposed_product<S: Scalar, const M: usize, const K: usize, const N: usize>(
    a: &[[S; M]; K],
    b: &[[S; N]; K],
) -> [[S; N]; M] {
    let mut out = [[S::zero(); N]; M];
    for (a, b) in a.iter().zip(b) {
        for (row, a) in out.iter_mut().zip(a) {
            row.iter_mut().zip(b).for_each(|(x, b)| *x = *x + *a * *b);
        }
    }
    out
}

/// `Aᵀ x`.
fn transposed_times<S: Scalar, const M: usize, const K: usize>(a: &[[S; M]; K], x: &[S; K]) -> [S; M] {
    let mut out = [S::zero(); M];
    for (a, x) in a.iter().zip(x) {
        out.iter_mut().zip(a).for_each(|(o, a)| *o = *o + *a * *x);
    }
    out
}
