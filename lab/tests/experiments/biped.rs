//! The biped of thesis 7.3, written by hand: Lagrange's equations in absolute angles with dense matrices. They are
//! independent of the library except for the trait that integrators need.
//!
//! Link `i` points along `(cos θ_i, sin θ_i)`. The position of a point is a sum of links, so the kinetic energy is
//! `½ Σ c_ij cos(θ_i − θ_j) ω_i ω_j` and the potential energy `g Σ w_i sin θ_i`, where `c` and `w` are constants of the
//! chain.

use multibody::runtime::system::LieJoint;
use multibody::runtime::System;

/// Number of links.
pub const N: usize = 5;
/// Number of rows of the loop.
pub const M: usize = 2;
/// Length of the links (m), gravity (m/s²), position of the second foot on x (m). Each link has a mass of 1 kg.
const LENGTH: f64 = 0.25;
const GRAVITY: f64 = 9.81;
const FOOT: f64 = 0.25;
/// Inertia about the centre of mass, kg m².
const INERTIA: f64 = 1.0 / 192.0;
const PARENT: [Option<usize>; N] = [None, Some(0), Some(1), Some(1), Some(3)];
/// Links from the first foot to the second.
const PATH: [bool; N] = [true, true, false, true, true];

pub type Vector = [f64; N];
type Matrix = [[f64; N]; N];

/// Solves `A x = b` by elimination with pivots.
pub fn solve<const K: usize>(mut a: [[f64; K]; K], mut b: [f64; K]) -> [f64; K] {
    for k in 0..K {
        let pivot = (k..K).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap_or(k);
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..K {
            let factor = a[i][k] / a[k][k];
            for j in k..K {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..K).rev() {
        for j in k + 1..K {
            b[k] -= a[k][j] * b[j];
        }
        b[k] /= a[k][k];
    }
    b
}

/// Factor of link `j` in the position of the centre of mass of link `i`: 1 for links below it, ½ for the link itself.
fn share(i: usize, j: usize) -> f64 {
    let mut at = PARENT[i];
    while let Some(k) = at {
        if k == j {
            return 1.0;
        }
        at = PARENT[k];
    }
    if i == j {
        0.5
    } else {
        0.0
    }
}

/// The mechanism.
pub struct Biped {
    c: Matrix,
    w: Vector,
    /// Angles from which Newton's method closes the loop.
    pub theta: Vector,
}

impl Biped {
    pub fn new() -> Self {
        let (mut c, mut w) = ([[0.0; N]; N], [0.0; N]);
        for j in 0..N {
            for k in 0..N {
                c[j][k] = (0..N).map(|i| share(i, j) * share(i, k) * LENGTH * LENGTH).sum();
            }
            c[j][j] += INERTIA;
            w[j] = (0..N).map(|i| share(i, j) * LENGTH * GRAVITY).sum();
        }
        let mut biped = Biped { c, w, theta: absolute(&[1.7, -0.7, 0.3, -1.986, -0.548]) };
        biped.close();
        biped
    }

    pub fn residual(theta: &Vector) -> [f64; M] {
        let sum = |f: fn(f64) -> f64| (0..N).filter(|&i| PATH[i]).map(|i| LENGTH * f(theta[i])).sum::<f64>();
        [sum(f64::cos) - FOOT, sum(f64::sin)]
    }

    fn jacobian(theta: &Vector) -> [Vector; M] {
        let on = |i: usize| if PATH[i] { LENGTH } else { 0.0 };
        [std::array::from_fn(|i| -on(i) * theta[i].sin()), std::array::from_fn(|i| on(i) * theta[i].cos())]
    }

    /// Closes the loop by Newton's method on the last two angles.
    pub fn close(&mut self) {
        for _ in 0..20 {
            let (r, j) = (Self::residual(&self.theta), Self::jacobian(&self.theta));
            let d = solve([[j[0][3], j[0][4]], [j[1][3], j[1][4]]], r);
            self.theta[3] -= d[0];
            self.theta[4] -= d[1];
            if d[0].abs().max(d[1].abs()) < 1e-15 {
                break;
            }
        }
    }

    /// Angular velocities of the last two links from those of the others.
    fn complete(&self, omega: &mut Vector) {
        let j = Self::jacobian(&self.theta);
        let known = |row: &Vector| -(0..3).map(|i| row[i] * omega[i]).sum::<f64>();
        let rest = solve([[j[0][3], j[0][4]], [j[1][3], j[1][4]]], [known(&j[0]), known(&j[1])]);
        (omega[3], omega[4]) = (rest[0], rest[1]);
    }

    /// Angular accelerations and multipliers, from `M α + Jᵀλ = Q`, `J α = −J̇ ω`.
    fn accelerations(&self, omega: &Vector) -> Vector {
        let (theta, j) = (&self.theta, Self::jacobian(&self.theta));
        let mut a = [[0.0; N + M]; N + M];
        let mut b = [0.0; N + M];
        for i in 0..N {
            for k in 0..N {
                a[i][k] = self.c[i][k] * (theta[i] - theta[k]).cos();
                b[i] -= self.c[i][k] * (theta[i] - theta[k]).sin() * omega[k] * omega[k];
            }
            b[i] -= self.w[i] * theta[i].cos();
            for row in 0..M {
                a[i][N + row] = j[row][i];
                a[N + row][i] = j[row][i];
            }
        }
        for i in (0..N).filter(|&i| PATH[i]) {
            b[N] += LENGTH * theta[i].cos() * omega[i] * omega[i];
            b[N + 1] += LENGTH * theta[i].sin() * omega[i] * omega[i];
        }
        let x = solve(a, b);
        std::array::from_fn(|i| x[i])
    }

    /// Kinetic and potential energy, J.
    pub fn energy(&self, theta: &Vector, omega: &Vector) -> f64 {
        let mut sum = 0.0;
        for i in 0..N {
            for k in 0..N {
                sum += 0.5 * self.c[i][k] * (theta[i] - theta[k]).cos() * omega[i] * omega[k];
            }
            sum += self.w[i] * theta[i].sin();
        }
        sum
    }

    /// All angles and angular velocities of a minimal state.
    pub fn whole(&mut self, theta: &[f64], omega: &[f64]) -> (Vector, Vector) {
        self.theta[..3].copy_from_slice(theta);
        self.close();
        let mut all = [omega[0], omega[1], omega[2], 0.0, 0.0];
        self.complete(&mut all);
        (self.theta, all)
    }
}

/// Joint angles from absolute angles. [`absolute`] is the inverse.
pub fn relative(theta: &Vector) -> Vector {
    std::array::from_fn(|i| theta[i] - PARENT[i].map_or(0.0, |p| theta[p]))
}

pub fn absolute(q: &Vector) -> Vector {
    let mut theta = [0.0; N];
    for i in 0..N {
        theta[i] = q[i] + PARENT[i].map_or(0.0, |p| theta[p]);
    }
    theta
}

/// The state consists of the first three angles and their rates.
impl System for Biped {
    type Scalar = f64;
    type Coordinates = Vec<f64>;
    type Momenta = Vec<f64>;

    fn neutral(&self) -> Vec<f64> {
        self.theta[..3].to_vec()
    }
    fn zero_momenta(&self) -> Vec<f64> {
        vec![0.0; 3]
    }
    fn lie_joints(&self) -> &[LieJoint] {
        &[]
    }
    fn rates_at(&mut self, _t: f64, q: &Vec<f64>, v: &Vec<f64>, qd: &mut Vec<f64>, a: &mut Vec<f64>) {
        let (_, omega) = self.whole(q, v);
        qd.copy_from_slice(v);
        a.copy_from_slice(&self.accelerations(&omega)[..3]);
    }
    fn coordinate_rates(&self, _q: &Vec<f64>, v: &Vec<f64>, qd: &mut Vec<f64>) {
        qd.copy_from_slice(v);
    }
}
