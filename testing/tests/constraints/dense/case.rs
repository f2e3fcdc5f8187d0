//! Random systems with constraints in a state, and the errors of comparisons.

use mbd_codegen::plan::Plan;
use mbd_runtime::{Constrained, Interpreter, System};
use mbd_testing::closed::{random_loops, LoopKnobs, LoopSystem};
use mbd_testing::eliminations::random_plan;
use mbd_testing::random::{Distribution, Rng};

use super::{Matrix, Truth, Vector};

/// Number of seeds. The systems of a few seeds are left out.
pub const SYSTEMS: u64 = 510;

/// A system in a state, its motion by the reference, and the interpreter under test.
pub struct Case {
    pub seed: u64,
    pub system: LoopSystem,
    pub i: Interpreter<f64>,
    pub p: Vector,
    pub truth: Truth,
    /// Smallest pivot of the elimination of rows in `Φ M⁻¹Φᵀ`, relative to the diagonal entry; redundant rows do not
    /// count.
    pub pivot: f64,
}

pub fn system(seed: u64) -> LoopSystem {
    match seed % 5 {
        0 => random_loops(seed, &LoopKnobs::plain()),
        // In a plane, only two or three rows of each joint that closes a loop are independent.
        1 => {
            let mut kinds = [0.0; 20];
            for (k, weight) in [(0, 3.0), (1, 1.0), (6, 1.0), (7, 1.0), (8, 1.0), (9, 1.0)] {
                kinds[k] = weight;
            }
            [12, 14, 15, 16, 17, 18].iter().for_each(|k| kinds[*k] = 0.5);
            let tree = Distribution {
                bodies: (3, 8),
                branching: 0.3,
                kinds: [4.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                ..Distribution::default()
            };
            random_loops(seed, &LoopKnobs { planar: true, kinds, tree, ..LoopKnobs::plain() })
        }
        2 => random_loops(seed, &LoopKnobs::platforms(seed)),
        _ => random_loops(seed, &LoopKnobs::everything(seed, [4, 6, 10][seed as usize / 5 % 3])),
    }
}

pub fn plan_of(system: &LoopSystem, seed: u64) -> Plan {
    random_plan(&system.model, seed)
}

impl Case {
    /// `None` if drives and loops contradict each other, if the rank is about to change, or if it is unclear.
    pub fn new(seed: u64) -> Option<Case> {
        Case::of(seed, system(seed))
    }

    pub fn of(seed: u64, system: LoopSystem) -> Option<Case> {
        let mut rng = Rng::new(seed, 9);
        let p = Vector::from_fn(system.open.dims.nv, |_, _| rng.around(1.0));
        let truth = Truth::new(&system, &p);
        if !truth.regular() || !truth.dense.condition().is_finite() {
            return None;
        }
        let i = system.state.interpreter(&plan_of(&system, seed));
        let mut case = Case { seed, system, i, p, truth, pivot: 1.0 };
        case.pivot = case.least_pivot();
        Some(case)
    }

    pub fn q(&self) -> Vec<f64> {
        self.system.state.q.clone()
    }

    /// Coordinates moved along velocities; quaternions are scaled to unit length.
    pub fn moved(&self, v: &Vector) -> Vec<f64> {
        let mut q: Vec<f64> = self.q().iter().zip(self.coordinate_rates(v).iter()).map(|(q, qd)| q + qd).collect();
        for at in self.i.quaternions() {
            let norm = q[at..at + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
            q[at..at + 4].iter_mut().for_each(|x| *x /= norm);
        }
        q
    }

    pub fn least_pivot(&mut self) -> f64 {
        let phi = self.phi(&self.q()).1;
        let (mut residual, mut dq, mut pivots) = (self.i.zero_rows(), self.i.zero_momenta(), self.i.zero_rows());
        self.i.position_correction(&self.q(), &mut residual, &mut dq, &mut pivots);
        let a = &phi * self.truth.dense.m.clone().cholesky().expect("M is positive definite").solve(&phi.transpose());
        let kept = pivots.iter().enumerate().filter(|(_, pivot)| **pivot > 0.0);
        kept.map(|(k, pivot)| pivot / a[(k, k)]).fold(1.0, f64::min)
    }

    /// Residuals and `Φ` of the interpreter.
    pub fn phi(&mut self, q: &[f64]) -> (Vec<f64>, Matrix) {
        let (mut residual, mut entries) = (self.i.zero_rows(), self.i.zero_entries());
        self.i.constraint_residuals(&q.to_vec(), &mut residual, &mut entries);
        let mut phi = Matrix::zeros(residual.len(), self.p.len());
        for (k, row) in self.i.rows().iter().enumerate() {
            for at in row.first..row.first + row.len {
                phi[(k, self.i.entry_columns()[at])] += entries[at];
            }
        }
        (residual, phi)
    }

    pub fn rates(&mut self, p: &Vector) -> (Vector, Vector) {
        let (mut qd, mut pd) = (self.i.neutral(), self.i.zero_momenta());
        self.i.rates_at(0.0, &self.q(), &p.as_slice().to_vec(), &mut qd, &mut pd);
        (qd.into(), pd.into())
    }

    pub fn coordinate_rates(&self, v: &Vector) -> Vector {
        let mut qd = self.i.neutral();
        self.i.coordinate_rates(&self.q(), &v.as_slice().to_vec(), &mut qd);
        qd.into()
    }
}

/// Errors of one comparison on all systems.
pub struct Errors {
    what: &'static str,
    tolerance: f64,
    all: Vec<(f64, u64, f64, f64)>,
}

impl Errors {
    pub fn new(what: &'static str, tolerance: f64) -> Errors {
        Errors { what, tolerance, all: Vec::new() }
    }

    pub fn add(&mut self, c: &Case, ours: &Vector, reference: &Vector, scale: f64) {
        assert_eq!(ours.len(), reference.len());
        let finite = ours.iter().all(|x| x.is_finite());
        let error = if finite { (ours - reference).amax() / scale.max(1e-3) } else { f64::INFINITY };
        self.all.push((error, c.seed, c.truth.dense.condition(), c.pivot));
    }

    /// Fails if an error exceeds the tolerance. Rows are eliminated one after the other in `Φ M⁻¹Φᵀ`: where earlier
    /// rows leave only a small part of a row, that factor is lost in accuracy, so a small pivot raises the tolerance.
    pub fn done(mut self) {
        self.all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let n = self.all.len();
        let at = |part: f64| self.all[((n as f64 * part) as usize).min(n - 1)];
        println!("{}: {n} systems, median {:.1e}, 99 % {:.1e}", self.what, at(0.5).0, at(0.99).0);
        for (error, seed, condition, pivot) in self.all.iter().rev().take(3) {
            println!("    seed {seed}: {error:.1e}, condition {condition:.0e}, pivot {pivot:.0e}");
        }
        let beyond =
            |(error, _, _, pivot): &&(f64, u64, f64, f64)| *error > self.tolerance * f64::max(1.0, 1e-3 / pivot);
        let bad: Vec<_> = self.all.iter().filter(beyond).collect();
        assert!(bad.is_empty(), "{}: {} of {n} beyond {:e}: {bad:?}", self.what, bad.len(), self.tolerance);
    }
}
