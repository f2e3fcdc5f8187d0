//! Small systems with constraints, written by hand.

use crate::systems::largest;
use mbd_runtime::constrained::{close, Closing, ConstraintError};
use mbd_runtime::system::{LieGroup, LieJoint, Row};
use mbd_runtime::{Conjugate, Constrained, Energetic, System};

/// Gravity, m/s².
pub const G: f64 = 9.81;

/// Description of a system with constraints, from which [`Open`] and [`Closed`] compute everything else.
pub trait Model {
    fn lie_joints(&self) -> &[LieJoint] {
        &[]
    }
    fn neutral(&self) -> Vec<f64>;
    fn nv(&self) -> usize;
    /// The diagonal of `M`, which has no other entries.
    fn masses(&self, q: &[f64]) -> Vec<f64>;
    /// `ṗ` at momenta `p` and velocities `v`, without constraints.
    fn forces(&self, q: &[f64], p: &[f64], v: &[f64]) -> Vec<f64>;
    fn potential(&self, q: &[f64]) -> f64;
    fn coordinate_rates(&self, _q: &[f64], v: &[f64]) -> Vec<f64> {
        v.to_vec()
    }
    /// Residuals, and rows of `Φ` with all columns.
    fn constraint_residuals(&self, q: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>);
    fn holonomic(&self) -> bool {
        true
    }
    /// The part of `ṗ⁺` that is due to `σ`, in addition to `forces` at `p⁺`. It is `Φ̇ᵀσ` if `forces` does not depend
    /// on momenta.
    fn turning(&self, q: &[f64], v: &[f64], sigma: &[f64]) -> Vec<f64>;
    /// For each row of `Φ`, the columns of its entries.
    fn pattern(&self) -> Vec<Vec<usize>>;
    fn constraint(&self, row: usize) -> usize {
        row
    }
}

/// The system without its constraints.
#[derive(Clone, Debug)]
pub struct Open<T>(pub T);

/// The system with its constraints.
#[derive(Clone, Debug)]
pub struct Closed<T> {
    pub model: T,
    rows: Vec<Row>,
    columns: Vec<usize>,
    pub solves: u32,
}

impl<T: Model> Closed<T> {
    pub fn new(model: T) -> Self {
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        for (r, pattern) in model.pattern().into_iter().enumerate() {
            let constraint = model.constraint(r);
            rows.push(Row { constraint, holonomic: model.holonomic(), first: columns.len(), len: pattern.len() });
            columns.extend(pattern);
        }
        Closed { model, rows, columns, solves: 0 }
    }

    /// Solves `A x = b` with `A = Φ M⁻¹ Φᵀ`, where redundant rows are left out. Returns `x` and the pivots.
    fn solve(&mut self, masses: &[f64], phi: &[Vec<f64>], b: &[f64]) -> (Vec<f64>, Vec<f64>) {
        self.solves += 1;
        let m = b.len();
        let mut a: Vec<Vec<f64>> = phi
            .iter()
            .map(|x| phi.iter().map(|y| x.iter().zip(y).zip(masses).map(|((x, y), m)| x * y / m).sum()).collect())
            .collect();
        let own: Vec<f64> = (0..m).map(|i| a[i][i]).collect();
        let (mut x, mut pivots) = (b.to_vec(), vec![0.0; m]);
        for k in 0..m {
            if a[k][k] <= 1e-10 * own[k] {
                continue;
            }
            pivots[k] = a[k][k];
            for i in k + 1..m {
                let f = a[i][k] / a[k][k];
                for j in k..m {
                    a[i][j] -= f * a[k][j];
                }
                x[i] -= f * x[k];
            }
        }
        for k in (0..m).rev() {
            if pivots[k] == 0.0 {
                x[k] = 0.0;
                continue;
            }
            for j in k + 1..m {
                x[k] -= a[k][j] * x[j];
            }
            x[k] /= pivots[k];
        }
        (x, pivots)
    }

    /// Velocities, multipliers `σ` and `Φ` of a state.
    pub fn velocities(&mut self, q: &[f64], p: &[f64]) -> (Vec<f64>, Vec<f64>, Vec<Vec<f64>>) {
        let (masses, (_, phi)) = (self.model.masses(q), self.model.constraint_residuals(q));
        let free: Vec<f64> = p.iter().zip(&masses).map(|(p, m)| p / m).collect();
        let b: Vec<f64> = phi.iter().map(|row| row.iter().zip(&free).map(|(a, v)| a * v).sum()).collect();
        let (sigma, _) = self.solve(&masses, &phi, &b);
        let v =
            (0..p.len()).map(|k| free[k] - phi.iter().zip(&sigma).map(|(row, s)| row[k] * s).sum::<f64>() / masses[k]);
        (v.collect(), sigma, phi)
    }

    /// The largest residual of positions and the largest of velocities.
    pub fn off(&mut self, q: &[f64], p: &[f64]) -> (f64, f64) {
        let (v, _, phi) = self.velocities(q, p);
        let residual = self.model.constraint_residuals(q).0;
        let rates = phi.iter().map(|row| row.iter().zip(&v).map(|(a, v)| a * v).sum::<f64>());
        (largest(residual), largest(rates))
    }

    #[allow(clippy::ptr_arg)] // The trait takes these types.
    pub fn energy(&mut self, q: &Vec<f64>, p: &Vec<f64>) -> f64 {
        let (t, v) = self.energies(q, p);
        t + v
    }

    /// Closed coordinates near a guess.
    pub fn closed(&mut self, guess: &[f64], held: &[bool]) -> Result<Vec<f64>, ConstraintError> {
        let mut q = guess.to_vec();
        close(self, &mut q, &Closing::holding(held)).map(|_| q)
    }
}

macro_rules! common {
    ($type:ident, $field:tt) => {
        type Scalar = f64;
        type Coordinates = Vec<f64>;
        type Momenta = Vec<f64>;
        fn neutral(&self) -> Vec<f64> {
            self.$field.neutral()
        }
        fn zero_momenta(&self) -> Vec<f64> {
            vec![0.0; self.$field.nv()]
        }
        fn lie_joints(&self) -> &[LieJoint] {
            self.$field.lie_joints()
        }
        fn coordinate_rates(&self, q: &Vec<f64>, v: &Vec<f64>, qd: &mut Vec<f64>) {
            *qd = self.$field.coordinate_rates(q, v);
        }
    };
}

impl<T: Model> System for Open<T> {
    common!(Open, 0);
    fn rates_at(&mut self, _: f64, q: &Vec<f64>, p: &Vec<f64>, qd: &mut Vec<f64>, pd: &mut Vec<f64>) {
        let v: Vec<f64> = p.iter().zip(self.0.masses(q)).map(|(p, m)| p / m).collect();
        *qd = self.0.coordinate_rates(q, &v);
        *pd = self.0.forces(q, p, &v);
    }
}

impl<T: Model> Conjugate for Open<T> {
    fn conjugate_momenta(&mut self, q: &Vec<f64>, v: &Vec<f64>, p: &mut Vec<f64>) {
        *p = v.iter().zip(self.0.masses(q)).map(|(v, m)| v * m).collect();
    }
}

impl<T: Model> System for Closed<T> {
    common!(Closed, model);
    fn rates_at(&mut self, _: f64, q: &Vec<f64>, p: &Vec<f64>, qd: &mut Vec<f64>, pd: &mut Vec<f64>) {
        let (v, sigma, _) = self.velocities(q, p);
        *qd = self.model.coordinate_rates(q, &v);
        *pd = self.model.forces(q, p, &v);
        for (pd, x) in pd.iter_mut().zip(self.model.turning(q, &v, &sigma)) {
            *pd += x;
        }
    }
}

impl<T: Model> Energetic for Closed<T> {
    fn energies(&mut self, q: &Vec<f64>, p: &Vec<f64>) -> (f64, f64) {
        let (v, _, _) = self.velocities(q, p);
        (0.5 * p.iter().zip(&v).map(|(p, v)| p * v).sum::<f64>(), self.model.potential(q))
    }
}

impl<T: Model> Constrained for Closed<T> {
    type Rows = Vec<f64>;
    type Entries = Vec<f64>;
    fn zero_rows(&self) -> Vec<f64> {
        vec![0.0; self.rows.len()]
    }
    fn zero_entries(&self) -> Vec<f64> {
        vec![0.0; self.columns.len()]
    }
    fn rows(&self) -> &[Row] {
        &self.rows
    }
    fn entry_columns(&self) -> &[usize] {
        &self.columns
    }
    fn constraint_residuals(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) {
        let (r, phi) = self.model.constraint_residuals(q);
        residual.copy_from_slice(&r);
        for (row, values) in self.rows.iter().zip(&phi) {
            for e in row.first..row.first + row.len {
                jacobian[e] = values[self.columns[e]];
            }
        }
    }
    fn project_momenta(&mut self, _: f64, q: &Vec<f64>, p: &mut Vec<f64>, v: &mut Vec<f64>, sigma: &mut Vec<f64>) {
        let (new, multipliers, phi) = self.velocities(q, p);
        for (row, s) in phi.iter().zip(&multipliers) {
            for (p, a) in p.iter_mut().zip(row) {
                *p -= a * s;
            }
        }
        v.copy_from_slice(&new);
        sigma.copy_from_slice(&multipliers);
    }
    fn position_correction(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, dq: &mut Vec<f64>, pivots: &mut Vec<f64>) {
        let (masses, (r, phi)) = (self.model.masses(q), self.model.constraint_residuals(q));
        let (x, p) = self.solve(&masses, &phi, &r);
        residual.copy_from_slice(&r);
        pivots.copy_from_slice(&p);
        for (k, dq) in dq.iter_mut().enumerate() {
            *dq = -phi.iter().zip(&x).map(|(row, x)| row[k] * x).sum::<f64>() / masses[k];
        }
    }
    fn multipliers(&mut self, _: f64, _: &Vec<f64>, _: &Vec<f64>, _: &mut Vec<f64>) {
        unimplemented!("no test asks for them")
    }
}

/// An end of a stick: a moving point, or a fixed position.
#[derive(Clone, Copy, Debug)]
pub enum End {
    Point(usize),
    Fixed([f64; 2]),
}
pub use End::{Fixed, Point};

/// Point masses in the plane at fixed distances, which are sticks without mass: `φ = (d² − l²) / 2l`. Gravity acts
/// along −y.
#[derive(Clone, Debug)]
pub struct Sticks {
    pub masses: Vec<f64>,
    pub sticks: Vec<(End, End, f64)>,
    pub gravity: f64,
}

impl Sticks {
    fn difference(&self, q: &[f64], stick: usize) -> [f64; 2] {
        let place = |end: End| match end {
            Point(i) => [q[2 * i], q[2 * i + 1]],
            Fixed(r) => r,
        };
        let (a, b) = (place(self.sticks[stick].0), place(self.sticks[stick].1));
        [b[0] - a[0], b[1] - a[1]]
    }
    fn ends(&self, stick: usize) -> impl Iterator<Item = (usize, f64)> {
        let (a, b, _) = self.sticks[stick];
        [(a, -1.0), (b, 1.0)].into_iter().filter_map(|(end, sign)| match end {
            Point(i) => Some((i, sign)),
            Fixed(_) => None,
        })
    }
    /// A pendulum of 1 m and 1 kg whose stick is present `n` times.
    pub fn pendulum(n: usize) -> Self {
        Sticks { masses: vec![1.0], sticks: vec![(Fixed([0.0; 2]), Point(0), 1.0); n], gravity: G }
    }
    /// A double pendulum with two sticks of 1 m and two masses of 1 kg.
    pub fn double() -> Self {
        let sticks = vec![(Fixed([0.0; 2]), Point(0), 1.0), (Point(0), Point(1), 1.0)];
        Sticks { masses: vec![1.0; 2], sticks, gravity: G }
    }
    /// A four-bar linkage of crank, coupler and rocker. The ground reaches from the origin to (`ground`, 0).
    pub fn four_bar([crank, coupler, rocker, ground]: [f64; 4]) -> Self {
        let sticks = vec![
            (Fixed([0.0; 2]), Point(0), crank),
            (Point(0), Point(1), coupler),
            (Fixed([ground, 0.0]), Point(1), rocker),
        ];
        Sticks { masses: vec![1.0, 2.0], sticks, gravity: G }
    }
}

impl Model for Sticks {
    fn neutral(&self) -> Vec<f64> {
        vec![0.0; 2 * self.masses.len()]
    }
    fn nv(&self) -> usize {
        2 * self.masses.len()
    }
    fn masses(&self, _: &[f64]) -> Vec<f64> {
        self.masses.iter().flat_map(|m| [*m, *m]).collect()
    }
    fn forces(&self, _: &[f64], _: &[f64], _: &[f64]) -> Vec<f64> {
        self.masses.iter().flat_map(|m| [0.0, -m * self.gravity]).collect()
    }
    fn potential(&self, q: &[f64]) -> f64 {
        self.masses.iter().enumerate().map(|(i, m)| m * self.gravity * q[2 * i + 1]).sum()
    }
    fn constraint_residuals(&self, q: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        (0..self.sticks.len())
            .map(|k| {
                let (d, l) = (self.difference(q, k), self.sticks[k].2);
                let mut row = vec![0.0; self.nv()];
                for (i, sign) in self.ends(k) {
                    row[2 * i] += sign * d[0] / l;
                    row[2 * i + 1] += sign * d[1] / l;
                }
                ((d[0] * d[0] + d[1] * d[1] - l * l) / (2.0 * l), row)
            })
            .unzip()
    }
    fn turning(&self, _: &[f64], v: &[f64], sigma: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.nv()];
        for (k, sigma) in sigma.iter().enumerate() {
            let mut d = [0.0; 2];
            for (i, sign) in self.ends(k) {
                d = [d[0] + sign * v[2 * i], d[1] + sign * v[2 * i + 1]];
            }
            for (i, sign) in self.ends(k) {
                out[2 * i] += sign * d[0] / self.sticks[k].2 * sigma;
                out[2 * i + 1] += sign * d[1] / self.sticks[k].2 * sigma;
            }
        }
        out
    }
    fn pattern(&self) -> Vec<Vec<usize>> {
        (0..self.sticks.len()).map(|k| self.ends(k).flat_map(|(i, _)| [2 * i, 2 * i + 1]).collect()).collect()
    }
}

/// A mass of 1 kg on the line `r cos θ = 1` in polar coordinates `(r, θ)`, with a spring of 4 N/m towards the point of
/// the line nearest to the origin. Its position on the line, `r sin θ`, oscillates with 2 rad/s. The mass matrix
/// depends on `r`.
#[derive(Clone, Debug)]
pub struct Polar;

impl Polar {
    /// Coordinates of the position `s` on the line.
    pub fn at(s: f64) -> Vec<f64> {
        vec![(1.0 + s * s).sqrt(), s.atan()]
    }
    pub fn place(q: &[f64]) -> f64 {
        q[0] * q[1].sin()
    }
}

impl Model for Polar {
    fn neutral(&self) -> Vec<f64> {
        vec![1.0, 0.0]
    }
    fn nv(&self) -> usize {
        2
    }
    fn masses(&self, q: &[f64]) -> Vec<f64> {
        vec![1.0, q[0] * q[0]]
    }
    fn forces(&self, q: &[f64], _: &[f64], v: &[f64]) -> Vec<f64> {
        // The potential energy is V = 2 (r sin θ)².
        let (s, c) = q[1].sin_cos();
        vec![q[0] * v[1] * v[1] - 4.0 * q[0] * s * s, -4.0 * q[0] * q[0] * s * c]
    }
    fn potential(&self, q: &[f64]) -> f64 {
        2.0 * Self::place(q).powi(2)
    }
    fn constraint_residuals(&self, q: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (s, c) = q[1].sin_cos();
        (vec![q[0] * c - 1.0], vec![vec![c, -q[0] * s]])
    }
    fn turning(&self, q: &[f64], v: &[f64], sigma: &[f64]) -> Vec<f64> {
        let (s, c) = q[1].sin_cos();
        vec![sigma[0] * -s * v[1], sigma[0] * (-s * v[0] - q[0] * c * v[1])]
    }
    fn pattern(&self) -> Vec<Vec<usize>> {
        vec![vec![0, 1]]
    }
}

/// A top of 1 kg: a free body with a spherical joint at the origin as constraint. Its three rows, in ground axes, add
/// nothing to `ṗ⁺`.
#[derive(Clone, Debug)]
pub struct Top {
    groups: [LieJoint; 1],
    pub inertia: [f64; 3],
    /// Position of the joint in the body, from its centre of mass.
    pub joint: [f64; 3],
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn rotation(q: &[f64]) -> [[f64; 3]; 3] {
    let (x, y, z, w) = (q[0], q[1], q[2], q[3]);
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

impl Top {
    pub fn new() -> Self {
        Top { groups: [LieJoint::new(LieGroup::SE3, 0, 0)], inertia: [0.02, 0.03, 0.01], joint: [0.0, 0.0, -0.3] }
    }
    /// Coordinates of the closed state in which the top leans by an angle about x, rad.
    pub fn leaning(&self, angle: f64) -> Vec<f64> {
        let (s, c) = (0.5 * angle).sin_cos();
        let mut q = vec![0.0, 0.0, 0.0, s, 0.0, 0.0, c];
        let r = rotation(&q[3..]);
        for i in 0..3 {
            q[i] = -(0..3).map(|j| r[i][j] * self.joint[j]).sum::<f64>();
        }
        q
    }
    /// Angular momentum about the vertical through the joint, which is at the origin.
    pub fn vertical(&self, q: &[f64], p: &[f64]) -> f64 {
        let r = rotation(&q[3..]);
        let out = |p: &[f64]| [0, 1, 2].map(|i| (0..3).map(|j| r[i][j] * p[j]).sum::<f64>());
        out(&p[3..])[2] + cross([q[0], q[1], q[2]], out(&p[..3]))[2]
    }
}

impl Model for Top {
    fn lie_joints(&self) -> &[LieJoint] {
        &self.groups
    }
    fn neutral(&self) -> Vec<f64> {
        vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    }
    fn nv(&self) -> usize {
        6
    }
    fn masses(&self, _: &[f64]) -> Vec<f64> {
        [1.0; 3].into_iter().chain(self.inertia).collect()
    }
    fn forces(&self, q: &[f64], p: &[f64], v: &[f64]) -> Vec<f64> {
        let r = rotation(&q[3..]);
        let three = |x: &[f64], at: usize| [x[at], x[at + 1], x[at + 2]];
        let (lin, ang, speed, spin) = (three(p, 0), three(p, 3), three(v, 0), three(v, 3));
        let (a, b, c) = (cross(spin, lin), cross(spin, ang), cross(speed, lin));
        let mut out: Vec<f64> = (0..3).map(|i| -a[i] - G * r[2][i]).collect();
        out.extend((0..3).map(|i| -b[i] - c[i]));
        out
    }
    fn potential(&self, q: &[f64]) -> f64 {
        G * q[2]
    }
    fn coordinate_rates(&self, q: &[f64], v: &[f64]) -> Vec<f64> {
        let r = rotation(&q[3..]);
        let mut out: Vec<f64> = (0..3).map(|i| (0..3).map(|j| r[i][j] * v[j]).sum()).collect();
        let (x, w) = ([q[3], q[4], q[5]], [v[3], v[4], v[5]]);
        let turn = cross(x, w);
        out.extend((0..3).map(|i| 0.5 * (q[6] * w[i] + turn[i])));
        out.push(-0.5 * (x[0] * w[0] + x[1] * w[1] + x[2] * w[2]));
        out
    }
    fn constraint_residuals(&self, q: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (r, c) = (rotation(&q[3..]), self.joint);
        (0..3)
            .map(|i| {
                // The row follows from n · R (v + ω × c) = Rᵀn · v + (c × Rᵀn) · ω.
                let about = cross(c, r[i]);
                (q[i] + (0..3).map(|j| r[i][j] * c[j]).sum::<f64>(), r[i].into_iter().chain(about).collect())
            })
            .unzip()
    }
    fn turning(&self, _: &[f64], _: &[f64], _: &[f64]) -> Vec<f64> {
        vec![0.0; 6]
    }
    fn pattern(&self) -> Vec<Vec<usize>> {
        vec![(0..6).collect(); 3]
    }
    fn constraint(&self, _: usize) -> usize {
        0
    }
}
