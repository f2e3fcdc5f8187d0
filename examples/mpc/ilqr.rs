//! Optimal control with bounded inputs: the iterative linear-quadratic regulator with box constraints (Y. Tassa,
//! N. Mansard, E. Todorov, *Control-limited differential dynamic programming*, ICRA 2014).
//!
//! The cost is `Σ ½ (x − g)ᵀ Q (x − g) + ½ uᵀ R u` over all nodes but the last, and `½ (x − g)ᵀ Q_N (x − g)` at the last,
//! with diagonal weights. Nothing is allocated, and no function beyond the four operations is called, so that the bits are
//! the same on every machine.

use super::steps::Dynamics;
use super::{Real, Scalar};

/// Weights, goal and bounds.
#[derive(Clone, Debug)]
pub struct Problem<S, const NX: usize, const NU: usize> {
    /// The state to be reached.
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
    fn state_cost(&self, weights: &[S; NX], x: &[S; NX]) -> S {
        let half = S::constant(0.5);
        (0..NX).fold(S::zero(), |sum, i| {
            let e = x[i] - self.goal[i];
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

fn clamp<S: Real>(x: S, low: S, high: S) -> S {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
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
        let mut all = Ilqr { x: [*x; N], u, cost: zero, gains, change, trial: ([*x; N], u), regular: zero };
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
            cost = cost + problem.state_cost(&problem.running, &x) + problem.effort_cost(&us[k]);
            x = dynamics.step(&x, &us[k]);
        }
        xs[N - 1] = x;
        cost + problem.state_cost(&problem.end, &x)
    }

    /// One iteration: the policy from the end to the start, then a step along it that reduces the cost.
    pub fn iterate(&mut self, dynamics: &mut impl Dynamics<S, NX, NU>, problem: &Problem<S, NX, NU>) -> Progress<S> {
        let Some([linear, quadratic]) = self.backward(dynamics, problem) else {
            self.cautious();
            return Progress::Rejected;
        };
        let least = S::constant(8.0 * S::epsilon()) * self.cost;
        let falls = -linear > least;
        if !falls {
            return Progress::Converged;
        }
        let (start, half) = (self.x[0], S::constant(0.5));
        let mut alpha = S::one();
        for _ in 0..12 {
            let cost = self.roll_out(dynamics, problem, &start, alpha);
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
    fn backward(&mut self, dynamics: &mut impl Dynamics<S, NX, NU>, problem: &Problem<S, NX, NU>) -> Option<[S; 2]> {
        let zero = S::zero();
        let mut vx: [S; NX] = core::array::from_fn(|i| problem.end[i] * (self.x[N - 1][i] - problem.goal[i]));
        let mut vxx = [[zero; NX]; NX];
        (0..NX).for_each(|i| vxx[i][i] = problem.end[i]);
        let (mut a, mut b) = ([[zero; NX]; NX], [[zero; NU]; NX]);
        let mut expected = [zero; 2];
        for k in (0..N - 1).rev() {
            let (x, u) = (&self.x[k], &self.u[k]);
            dynamics.linearise(x, u, &mut a, &mut b);
            // V A and V B.
            let (va, vb) = (product(&vxx, &a), product(&vxx, &b));
            let mut qxx = transposed_product(&a, &va);
            let mut quu = transposed_product(&b, &vb);
            let qux = transposed_product(&b, &va);
            let (mut qx, mut qu) = (transposed_times(&a, &vx), transposed_times(&b, &vx));
            for i in 0..NX {
                qxx[i][i] = qxx[i][i] + problem.running[i];
                qx[i] = qx[i] + problem.running[i] * (x[i] - problem.goal[i]);
            }
            let mut regular = quu;
            for i in 0..NU {
                quu[i][i] = quu[i][i] + problem.effort[i];
                qu[i] = qu[i] + problem.effort[i] * u[i];
                regular[i][i] = quu[i][i] + self.regular;
            }
            let room = [0, 1].map(|side| core::array::from_fn(|i| problem.bounds[side][i] - u[i]));
            let solution = box_minimum(&regular, &qu, &room)?;
            let step = solution.x;
            let gain = solution.gains(&qux);
            for i in 0..NU {
                let curved = (0..NU).fold(zero, |sum, j| sum + quu[i][j] * step[j]);
                expected[0] = expected[0] + step[i] * qu[i];
                expected[1] = expected[1] + S::constant(0.5) * step[i] * curved;
            }
            // V_x = Q_x + Kᵀ (Q_uu k + Q_u) + Q_xuᵀ k, V_xx = Q_xx + Kᵀ (Q_uu K + Q_ux) + Q_uxᵀ K.
            let inner: [S; NU] = core::array::from_fn(|i| (0..NU).fold(qu[i], |sum, j| sum + quu[i][j] * step[j]));
            let mut curved = product(&quu, &gain);
            for (row, qux) in curved.iter_mut().zip(&qux) {
                row.iter_mut().zip(qux).for_each(|(x, q)| *x = *x + *q);
            }
            let (left, right) = (transposed_product(&gain, &curved), transposed_product(&qux, &gain));
            let (first, second) = (transposed_times(&gain, &inner), transposed_times(&qux, &step));
            for i in 0..NX {
                vx[i] = qx[i] + first[i] + second[i];
                for j in 0..NX {
                    vxx[i][j] = qxx[i][j] + left[i][j] + right[i][j];
                }
            }
            for i in 0..NX {
                for j in 0..i {
                    let mean = S::constant(0.5) * (vxx[i][j] + vxx[j][i]);
                    (vxx[i][j], vxx[j][i]) = (mean, mean);
                }
            }
            (self.change[k], self.gains[k]) = (step, gain);
        }
        Some(expected)
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

/// The minimum of a quadratic function in a box.
pub struct BoxMinimum<S, const N: usize> {
    /// The minimum.
    pub x: [S; N],
    /// Which components are between their bounds.
    pub free: [bool; N],
    /// `L` and `D` of the free part of the matrix, the unit matrix elsewhere.
    factor: [[S; N]; N],
}

/// The minimum of `½ xᵀ H x + gᵀ x` between two bounds, by projected Newton steps; `None` where the free part of `H` is not
/// positive definite. The bounds enclose zero.
pub fn box_minimum<S: Real, const N: usize>(
    h: &[[S; N]; N],
    g: &[S; N],
    bounds: &[[S; N]; 2],
) -> Option<BoxMinimum<S, N>> {
    let zero = S::zero();
    let value = |x: &[S; N]| {
        (0..N).fold(zero, |sum, i| {
            let hx = (0..N).fold(zero, |sum, j| sum + h[i][j] * x[j]);
            sum + x[i] * (g[i] + S::constant(0.5) * hx)
        })
    };
    let (mut x, mut free, mut factor) = ([zero; N], [true; N], *h);
    for round in 0..4 * N + 4 {
        let gradient: [S; N] = core::array::from_fn(|i| (0..N).fold(g[i], |sum, j| sum + h[i][j] * x[j]));
        let now: [bool; N] = core::array::from_fn(|i| {
            !(x[i] <= bounds[0][i] && gradient[i] > zero || x[i] >= bounds[1][i] && gradient[i] < zero)
        });
        let settled = round > 0 && now == free;
        free = now;
        factor = factored(h, &free)?;
        let step = solved(&factor, &core::array::from_fn(|i| if free[i] { -gradient[i] } else { zero }));
        let (before, mut length) = (value(&x), S::one());
        let mut next = x;
        for _ in 0..20 {
            next = core::array::from_fn(|i| clamp(x[i] + length * step[i], bounds[0][i], bounds[1][i]));
            if value(&next) <= before {
                break;
            }
            length = length * S::constant(0.5);
        }
        let still = next == x;
        x = next;
        // A full Newton step within the box, over the components that stay free, is the minimum.
        if still || settled && (0..N).all(|i| !free[i] || x[i] > bounds[0][i] && x[i] < bounds[1][i]) {
            break;
        }
    }
    Some(BoxMinimum { x, free, factor })
}

impl<S: Real, const N: usize> BoxMinimum<S, N> {
    /// `−H⁻¹ Q` over the free components, zero for the others.
    fn gains<const M: usize>(&self, q: &[[S; M]; N]) -> [[S; M]; N] {
        let mut out = [[S::zero(); M]; N];
        for j in 0..M {
            let right = core::array::from_fn(|i| if self.free[i] { -q[i][j] } else { S::zero() });
            let column = solved(&self.factor, &right);
            (0..N).for_each(|i| out[i][j] = column[i]);
        }
        out
    }
}

/// `L D Lᵀ` of the free part of a symmetric matrix: `L` below the diagonal, `D` on it.
fn factored<S: Real, const N: usize>(h: &[[S; N]; N], free: &[bool; N]) -> Option<[[S; N]; N]> {
    let mut f = [[S::zero(); N]; N];
    for i in 0..N {
        for j in 0..=i {
            let mut x = match free[i] && free[j] {
                true => h[i][j],
                false if i == j => S::one(),
                false => S::zero(),
            };
            for k in 0..j {
                x = x - f[i][k] * f[j][k] * f[k][k];
            }
            f[i][j] = if i == j { x } else { x / f[j][j] };
        }
        let positive = f[i][i] > S::zero();
        if !positive {
            return None;
        }
    }
    Some(f)
}

fn solved<S: Real, const N: usize>(f: &[[S; N]; N], right: &[S; N]) -> [S; N] {
    let mut x = *right;
    for i in 0..N {
        for j in 0..i {
            x[i] = x[i] - f[i][j] * x[j];
        }
    }
    for i in (0..N).rev() {
        x[i] = x[i] / f[i][i];
        for j in i + 1..N {
            x[i] = x[i] - f[j][i] * x[j];
        }
    }
    x
}
