//! Constrained motion by dense matrices: `M` of the open tree, `Φ` from the definitions of the constraints, Cholesky
//! and singular values. Nothing is eliminated joint by joint.

#![allow(dead_code)]

use mbd_runtime::Interpreter;
use mbd_testing::closed::LoopSystem;
use mbd_testing::kkt::Rows;
use nalgebra::{DMatrix, DVector};

pub mod case;
pub mod minimal;
pub mod thesis;

pub type Matrix = DMatrix<f64>;
pub type Vector = DVector<f64>;

/// Singular values of `Φ L⁻ᵀ` with rows of unit length count as zero below this limit. If one is between this limit and
/// [`CLEAR`], rounding errors make it unclear whether the mechanism has redundant rows.
pub const ZERO: f64 = 1e-6;
/// Singular values above this limit are clearly not zero.
pub const CLEAR: f64 = 1e-3;

/// Rows of `Φ` with smaller entries are rounding errors: the entries come from unit directions and arms of about one
/// metre.
const NOTHING: f64 = 1e-12;

/// Mass matrix and constraints of a system in its state.
pub struct Dense {
    pub m: Matrix,
    pub phi: Matrix,
    /// Right-hand side of `Φ v = b`.
    pub b: Vector,
    /// Momenta of the prescribed motion alone.
    pub driven: Vector,
    /// `L` of `M = L Lᵀ`.
    lower: Matrix,
    /// Lengths of the rows of `Φ L⁻ᵀ`.
    lengths: Vector,
    /// Left singular vectors, one column for each row of `Φ` (and padding), and the right ones, in rows.
    u: Matrix,
    v_t: Matrix,
    singular: Vector,
    pub rank: usize,
}

/// Solution of `M x + Φᵀ y = f`, `Φ x = b`.
pub struct Solution {
    pub x: Vector,
    /// One of the possible solutions for `y`.
    pub y: Vector,
    /// `Φᵀ y`, the same for all solutions.
    pub force: Vector,
}

impl Dense {
    pub fn new(system: &LoopSystem) -> Dense {
        let state = &system.state;
        let nv = system.open.dims.nv;
        let mut open = state.interpreter(&system.open);
        let mut m = vec![0.0; nv * nv];
        open.mass_matrix(&state.q, &mut m);
        let mut driven = vec![0.0; nv];
        open.momenta(&state.q, &vec![0.0; nv], &mut driven);
        let (phi, b) = rows(system).jacobian();
        Dense::of(Matrix::from_row_slice(nv, nv, &m), matrix(&phi, nv), b.into(), driven.into())
    }

    pub fn of(m: Matrix, phi: Matrix, b: Vector, driven: Vector) -> Dense {
        let (rows, nv) = phi.shape();
        let lower = m.clone().cholesky().expect("M is positive definite").l();
        let mut w = lower.solve_lower_triangular(&phi.transpose()).expect("L is regular").transpose();
        // A row of rounding errors is set to zero.
        let lengths = Vector::from_fn(rows, |k, _| if phi.row(k).amax() > NOTHING { w.row(k).norm() } else { 0.0 });
        for k in 0..rows {
            w.row_mut(k).scale_mut(if lengths[k] > 0.0 { 1.0 / lengths[k] } else { 0.0 });
        }
        // Rows of zeros are added so that the decomposition gives all right singular vectors.
        let padded = w.resize_vertically(rows.max(nv), 0.0);
        let svd = padded.svd(true, true);
        let (u, v_t) = (svd.u.expect("asked for"), svd.v_t.expect("asked for"));
        let rank = svd.singular_values.iter().filter(|s| **s > ZERO).count();
        Dense { m, phi, b, driven, lower, lengths, u, v_t, singular: svd.singular_values, rank }
    }

    /// One over the smallest singular value that counts, at least one. Infinite if it is unclear which singular values
    /// are zero.
    pub fn condition(&self) -> f64 {
        let smallest = self.singular.iter().copied().filter(|s| *s > ZERO).fold(1.0, f64::min);
        if smallest < CLEAR || self.singular.iter().any(|s| *s <= ZERO && *s > 1e-12) {
            return f64::INFINITY;
        }
        1.0 / smallest
    }

    /// Column `k` of the left singular vectors, scaled for the original rows of `Φ`.
    fn left(&self, k: usize) -> Vector {
        Vector::from_fn(
            self.lengths.len(),
            |i, _| if self.lengths[i] > 0.0 { self.u[(i, k)] / self.lengths[i] } else { 0.0 },
        )
    }

    /// The part of a right-hand side that no velocity can satisfy, relative to the right-hand side.
    pub fn contradiction(&self, b: &Vector) -> f64 {
        let scaled = Vector::from_fn(b.len(), |i, _| if self.lengths[i] > 0.0 { b[i] / self.lengths[i] } else { b[i] });
        let mut rest = scaled.clone();
        for k in self.kept() {
            let u = self.u.column(k).rows(0, b.len()).clone_owned();
            rest -= &u * u.dot(&scaled);
        }
        rest.norm() / scaled.norm().max(1.0)
    }

    fn kept(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.singular.len()).filter(|&k| self.singular[k] > ZERO)
    }

    pub fn solve(&self, f: &Vector, b: &Vector) -> Solution {
        let mut z = self.lower.solve_lower_triangular(f).expect("L is regular");
        let mut y = Vector::zeros(b.len());
        let mut pull = Vector::zeros(f.len());
        let free = z.clone();
        for k in self.kept() {
            let (v, left, s) = (self.v_t.row(k).transpose(), self.left(k), self.singular[k]);
            let excess = v.dot(&free) - left.dot(b) / s;
            z -= &v * excess;
            pull += &v * excess;
            y += left * (excess / s);
        }
        let x = self.lower.tr_solve_lower_triangular(&z).expect("L is regular");
        Solution { x, y, force: &self.lower * pull }
    }

    /// Orthonormal directions that all constraints allow, in columns.
    pub fn allowed(&self) -> Matrix {
        let nv = self.m.nrows();
        let free: Vec<usize> = (0..nv).filter(|&k| self.singular[k] <= ZERO).collect();
        let columns: Vec<Vector> = free
            .iter()
            .map(|&k| self.lower.tr_solve_lower_triangular(&self.v_t.row(k).transpose()).expect("L is regular"))
            .collect();
        if columns.is_empty() {
            return Matrix::zeros(nv, 0);
        }
        Matrix::from_columns(&columns).qr().q()
    }

    /// Whether the rank stays the same along a motion with this `Φ̇`: redundant rows must remain combinations of the
    /// others to first order.
    pub fn lasting(&self, phi_rate: &Matrix) -> bool {
        let allowed = self.allowed();
        let scale = phi_rate.norm().max(1e-3);
        let rows = self.lengths.len();
        // The combinations of rows that are zero: all that the kept left singular vectors do not span.
        let mut rest = Matrix::identity(rows, rows);
        for k in self.kept() {
            let u = self.u.column(k).rows(0, rows).clone_owned();
            rest -= &u * u.transpose();
        }
        for k in 0..rows {
            let length = if self.lengths[k] > 0.0 { self.lengths[k] } else { 1.0 };
            rest.row_mut(k).scale_mut(1.0 / length);
        }
        (allowed.transpose() * phi_rate.transpose() * &rest).norm() < 1e-9 * scale * rest.norm().max(1.0)
    }
}

/// The constraints of a system, computed from the motion of its open tree.
pub fn rows(system: &LoopSystem) -> Rows<'_> {
    Rows { plan: &system.open, model: &system.model, state: &system.state }
}

pub fn matrix(rows: &[Vec<f64>], nv: usize) -> Matrix {
    Matrix::from_row_slice(rows.len(), nv, &rows.concat())
}

/// The motion of a system with momenta `p⁺`, by the definitions.
pub struct Truth {
    pub dense: Dense,
    pub v: Vector,
    /// `M⁻¹ p⁺`, the velocities without constraints. They are the scale of errors in velocities.
    pub unbound: Vector,
    pub sigma: Vector,
    /// `Φᵀσ`.
    pub pull: Vector,
    /// `Φ̇`.
    pub phi_rate: Matrix,
    /// `ṗ` of the open tree at `v`.
    pub open_rates: Vector,
    /// `v̇`, one of the multipliers `λ`, and `Φᵀλ`.
    pub motion: Solution,
    /// `M⁻¹(τ − h)`, the accelerations without constraints.
    pub unbound_motion: Vector,
    /// `γ` of `Φ v̇ + γ = 0`.
    pub gamma: Vector,
}

impl Truth {
    pub fn new(system: &LoopSystem, p: &Vector) -> Truth {
        let dense = Dense::new(system);
        let bare = p - &dense.driven;
        let unbound =
            dense.lower.tr_solve_lower_triangular(&dense.lower.solve_lower_triangular(&bare).expect("L is regular"));
        let start = dense.solve(&bare, &dense.b);
        Truth::at(system, dense, start, unbound.expect("L is regular"))
    }

    fn at(system: &LoopSystem, dense: Dense, start: Solution, unbound: Vector) -> Truth {
        let state = &system.state;
        let nv = system.open.dims.nv;
        let v = start.x;
        let mut open = state.interpreter(&system.open);
        let open_rates = open_rates(&mut open, &state.q, v.as_slice());
        let (phi_rate, gamma) = rows(system).jacobian_rates(v.as_slice());
        let (phi_rate, gamma) = (matrix(&phi_rate, nv), Vector::from(gamma));
        let mut h = vec![0.0; nv];
        open.bias(&state.q, v.as_slice(), &mut h);
        let f = Vector::from(state.tau.clone()) - Vector::from(h);
        let motion = dense.solve(&f, &-&gamma);
        let unbound_motion = dense
            .lower
            .tr_solve_lower_triangular(&dense.lower.solve_lower_triangular(&f).expect("L is regular"))
            .expect("L is regular");
        Truth {
            dense,
            v,
            unbound,
            sigma: start.y,
            pull: start.force,
            phi_rate,
            open_rates,
            motion,
            unbound_motion,
            gamma,
        }
    }

    /// `ṗ⁺` up to terms `Φᵀ x`, which change multipliers but not the motion. As `d/dt (M v) = ṗ − Φᵀλ`,
    /// `d/dt (M v + Φᵀσ) = ṗ + Φ̇ᵀσ + Φᵀ(σ̇ − λ)`.
    pub fn momentum_rates(&self) -> Vector {
        &self.open_rates + self.phi_rate.transpose() * &self.sigma
    }

    /// Whether drives and loops agree in velocities and accelerations, and the rank does not change along the motion.
    pub fn regular(&self) -> bool {
        self.dense.contradiction(&self.dense.b) < 1e-9
            && self.dense.contradiction(&self.gamma) < 1e-9
            && self.dense.lasting(&self.phi_rate)
    }
}

/// `ṗ` of the open tree at given velocities.
pub fn open_rates(open: &mut Interpreter<f64>, q: &[f64], v: &[f64]) -> Vector {
    let nv = v.len();
    let (mut p, mut again, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; q.len()], vec![0.0; nv]);
    open.momenta(q, v, &mut p);
    open.rates(q, &p, &mut again, &mut qd, &mut pd);
    pd.into()
}
