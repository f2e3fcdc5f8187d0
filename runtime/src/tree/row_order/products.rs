//! How far rows depend on one another at a position.

use alloc::vec;
use alloc::vec::Vec;

use super::{late_nodes, NOTHING};
use crate::system::{Constrained, Real};
use crate::tree::Source;
use crate::Interpreter;

/// `Φ D⁻¹Φᵀ` at a position, with the diagonal `D` of the mass matrix, without the rows that have been eliminated. Velocities
/// that are eliminated after early rows stand behind the rows until then: `[Φ D⁻¹Φᵀ, Φ_l; Φ_lᵀ, −1]`.
#[derive(Clone, Debug)]
pub struct RowProducts {
    /// Number of rows and late velocities.
    n: usize,
    a: Vec<f64>,
    /// The diagonal of the rows without what has been taken off it by other rows.
    whole: Vec<f64>,
    /// The diagonal of the rows by all velocities.
    full: Vec<f64>,
    /// Nodes of the late velocities.
    late: Vec<usize>,
}

impl RowProducts {
    /// The products at coordinates `q`, which need not be closed.
    pub fn new<S: Real>(interpreter: &mut Interpreter<S>, q: &Vec<S>) -> RowProducts {
        let (mut residual, mut entries) = (interpreter.zero_rows(), interpreter.zero_entries());
        interpreter.constraint_residuals(q, &mut residual, &mut entries);
        let nv = interpreter.tree().dims.nv;
        let mut mass = vec![S::zero(); nv];
        interpreter.mass_diagonal(q, &mut mass);
        let columns = interpreter.entry_columns();
        let dense = |row: &crate::system::Row| {
            let mut dense = vec![0.0; nv];
            for k in row.first..row.first + row.len {
                let v = columns[k];
                let own = mass[v].to_f64();
                dense[v] += entries[k].to_f64() / if own > 0.0 { libm::sqrt(own) } else { 1.0 };
            }
            dense
        };
        let scaled: Vec<Vec<f64>> = interpreter.rows().iter().map(dense).collect();
        let (mut late, mut velocities) = (Vec::new(), Vec::new());
        for i in late_nodes(interpreter.tree()) {
            let node = &interpreter.tree().nodes[i];
            if let Source::State { v, .. } = node.source {
                velocities.extend(v..v + node.kind.nv());
                late.resize(velocities.len(), i);
            }
        }
        RowProducts::of(&scaled, &velocities, late)
    }

    /// Of rows by velocities, of which some are late, those of the nodes `late`.
    fn of(scaled: &[Vec<f64>], velocities: &[usize], late: Vec<usize>) -> RowProducts {
        let rows = scaled.len();
        let n = rows + late.len();
        let mut a = vec![0.0; n * n];
        for (r, one) in scaled.iter().enumerate() {
            for (s, other) in scaled.iter().enumerate() {
                let early = (0..one.len()).filter(|v| !velocities.contains(v));
                a[r * n + s] = early.map(|v| one[v] * other[v]).sum();
            }
            for (k, &v) in velocities.iter().enumerate() {
                a[r * n + rows + k] = one[v];
                a[(rows + k) * n + r] = one[v];
            }
        }
        (rows..n).for_each(|k| a[k * n + k] = -1.0);
        let full = scaled.iter().map(|row| row.iter().map(|x| x * x).sum()).collect();
        RowProducts { n, whole: (0..rows).map(|r| a[r * n + r]).collect(), full, a, late }
    }

    /// Part of a row that is left; all of a row that is zero.
    pub(super) fn left(&self, r: usize) -> f64 {
        match self.whole[r] > 0.0 {
            true => self.a[r * self.n + r] / self.whole[r],
            false => 1.0,
        }
    }

    /// The part of an early row that the joints before it can follow; all of a row that is zero.
    pub(super) fn followed(&self, r: usize) -> f64 {
        match self.full[r] > 0.0 {
            true => self.a[r * self.n + r] / self.full[r],
            false => 1.0,
        }
    }

    /// Whether a row is zero, next to the others.
    pub(super) fn is_zero(&self, r: usize) -> bool {
        self.full[r] <= NOTHING * NOTHING * self.full.iter().fold(0.0_f64, |most, x| most.max(*x))
    }

    pub(super) fn eliminate(&mut self, r: usize) {
        if self.whole[r] > 0.0 && self.left(r) > NOTHING {
            self.take_off(r);
        }
    }

    /// Eliminates the velocities of a node, those that have not been from the start.
    pub(super) fn eliminate_node(&mut self, i: usize) {
        let rows = self.whole.len();
        for k in (0..self.late.len()).filter(|&k| self.late[k] == i).map(|k| rows + k).collect::<Vec<_>>() {
            let pivot = self.a[k * self.n + k];
            for r in 0..rows {
                let entry = self.a[k * self.n + r];
                self.whole[r] -= entry * entry / pivot;
            }
            self.take_off(k);
        }
    }

    /// Takes what the row or velocity `r` accounts for off all others.
    fn take_off(&mut self, r: usize) {
        let n = self.n;
        let row = self.a[r * n..(r + 1) * n].to_vec();
        for i in 0..n {
            let factor = row[i] / row[r];
            for j in 0..n {
                self.a[i * n + j] -= factor * row[j];
            }
        }
    }
}
