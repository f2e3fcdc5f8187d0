//! The equations of a mechanism with loops in the four formulations that the experiments compare, on plain numbers.
//!
//! Every joint has one degree of freedom, so that there are as many coordinates as velocities.

use multibody::runtime::{Accelerated, Conjugate, Constrained, Energetic, System};

use super::plain::Equation;

/// The interpreter of a mechanism with loops, or another system with the same functions.
pub trait Closed:
    System<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>>
    + Constrained<Rows = Vec<f64>, Entries = Vec<f64>>
    + Accelerated
    + Conjugate
    + Energetic
{
}

impl<Y> Closed for Y where
    Y: System<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>>
        + Constrained<Rows = Vec<f64>, Entries = Vec<f64>>
        + Accelerated
        + Conjugate
        + Energetic
{
}

/// The second half of a state, after the coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Momenta, with Hamilton's equations.
    Momenta,
    /// Velocities, with accelerations.
    Velocities,
}

/// Memory for the two halves of a state and of its rates.
struct Halves {
    q: Vec<f64>,
    p: Vec<f64>,
    qd: Vec<f64>,
    pd: Vec<f64>,
}

impl Halves {
    fn new<Y: Closed>(system: &Y) -> Self {
        Halves { q: system.neutral(), p: system.zero_momenta(), qd: system.neutral(), pd: system.zero_momenta() }
    }

    fn rates<Y: Closed>(&mut self, system: &mut Y, kind: Kind) {
        let Halves { q, p, qd, pd } = self;
        match kind {
            Kind::Momenta => system.rates_at(0.0, q, p, qd, pd),
            Kind::Velocities => {
                system.coordinate_rates(q, p, qd);
                system.generalized_accelerations(q, p, pd);
            }
        }
    }
}

/// All coordinates, with augmented momenta (`σ` starts every step at zero) or with velocities (the accelerations
/// satisfy the constraints, positions and velocities drift).
pub struct Whole<'a, Y> {
    system: &'a mut Y,
    kind: Kind,
    room: Halves,
}

impl<'a, Y: Closed> Whole<'a, Y> {
    /// The equations of a mechanism.
    pub fn new(system: &'a mut Y, kind: Kind) -> Self {
        let room = Halves::new(system);
        Whole { system, kind, room }
    }
}

impl<Y: Closed> Equation for Whole<'_, Y> {
    fn rates(&mut self, y: &[f64], rates: &mut [f64]) {
        let n = self.room.q.len();
        self.room.q.copy_from_slice(&y[..n]);
        self.room.p.copy_from_slice(&y[n..]);
        self.room.rates(self.system, self.kind);
        rates[..n].copy_from_slice(&self.room.qd);
        rates[n..].copy_from_slice(&self.room.pd);
    }

    fn between(&mut self, y: &mut [f64]) -> bool {
        if self.kind == Kind::Velocities {
            return false;
        }
        let n = self.room.q.len();
        let Halves { q, p, pd: v, .. } = &mut self.room;
        q.copy_from_slice(&y[..n]);
        p.copy_from_slice(&y[n..]);
        let mut sigma = self.system.zero_rows();
        self.system.project_momenta(0.0, q, p, v, &mut sigma);
        y[n..].copy_from_slice(p);
        true
    }
}

/// Independent coordinates with their momenta or their velocities. The other coordinates follow from the loops at every
/// evaluation.
pub struct Minimal<'a, Y> {
    system: &'a mut Y,
    kind: Kind,
    independent: Vec<usize>,
    dependent: Vec<usize>,
    /// Rows of the loops from which the dependent coordinates are computed.
    rows: Vec<usize>,
    room: Halves,
    residual: Vec<f64>,
    entries: Vec<f64>,
    /// `Φ` of these rows, dense.
    phi: Vec<Vec<f64>>,
}

impl<'a, Y: Closed> Minimal<'a, Y> {
    /// The equations of a mechanism near coordinates `q`. The chosen rows do not change; the other rows must depend on
    /// them.
    pub fn new(system: &'a mut Y, kind: Kind, independent: &[usize], q: &[f64]) -> Self {
        let mut room = Halves::new(system);
        room.q.copy_from_slice(q);
        let dependent: Vec<usize> = (0..q.len()).filter(|k| !independent.contains(k)).collect();
        let (residual, entries) = (system.zero_rows(), system.zero_entries());
        let phi = vec![vec![0.0; q.len()]; system.rows().len()];
        let rows = (0..phi.len()).collect();
        let independent = independent.to_vec();
        let mut minimal = Minimal { system, kind, independent, dependent, rows, room, residual, entries, phi };
        minimal.look();
        let square = |k: &usize| minimal.dependent.iter().map(|&d| minimal.phi[*k][d]).collect();
        minimal.rows = leading(minimal.rows.iter().map(square).collect(), minimal.dependent.len());
        minimal.close();
        minimal
    }

    /// Residuals and `Φ` at the coordinates.
    fn look(&mut self) {
        self.system.constraint_residuals(&self.room.q, &mut self.residual, &mut self.entries);
        let columns = self.system.entry_columns();
        for (row, phi) in self.system.rows().iter().zip(&mut self.phi) {
            phi.fill(0.0);
            for e in row.first..row.first + row.len {
                phi[columns[e]] += self.entries[e];
            }
        }
    }

    /// `Φ` of the dependent coordinates.
    fn square(&self) -> Vec<Vec<f64>> {
        self.rows.iter().map(|&r| self.dependent.iter().map(|&d| self.phi[r][d]).collect()).collect()
    }

    /// Solves for the dependent coordinates by Newton's method, from their present values.
    fn close(&mut self) {
        let mut last = f64::INFINITY;
        for _ in 0..20 {
            self.look();
            let step = solve(self.square(), self.rows.iter().map(|&r| self.residual[r]).collect());
            let size = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            // At the level of round-off the residual no longer decreases.
            if size < 1e-9 && size >= 0.5 * last || size == 0.0 {
                break;
            }
            last = size;
            for (&d, step) in self.dependent.iter().zip(step) {
                self.room.q[d] -= step;
            }
        }
    }

    /// All coordinates and velocities of a state with velocities.
    fn complete(&mut self) {
        let known = |row: &Vec<f64>| -self.independent.iter().map(|&i| row[i] * self.room.p[i]).sum::<f64>();
        let rest = solve(self.square(), self.rows.iter().map(|&r| known(&self.phi[r])).collect());
        for (&d, v) in self.dependent.iter().zip(rest) {
            self.room.p[d] = v;
        }
    }

    /// All coordinates of a state.
    pub fn coordinates(&mut self, y: &[f64]) -> Vec<f64> {
        self.take(y);
        self.room.q.clone()
    }

    fn take(&mut self, y: &[f64]) {
        let (q, p) = y.split_at(self.independent.len());
        self.room.p.fill(0.0);
        for (k, &i) in self.independent.iter().enumerate() {
            self.room.q[i] = q[k];
            self.room.p[i] = p[k];
        }
        self.close();
        if self.kind == Kind::Velocities {
            self.complete();
        }
    }

    /// Energy of a state, J.
    pub fn energy(&mut self, y: &[f64]) -> f64 {
        self.take(y);
        let Halves { q, p, pd, .. } = &mut self.room;
        let (kinetic, potential) = match self.kind {
            Kind::Momenta => self.system.energies(q, p),
            Kind::Velocities => {
                self.system.conjugate_momenta(q, p, pd);
                self.system.energies(q, pd)
            }
        };
        kinetic + potential
    }
}

impl<Y: Closed> Equation for Minimal<'_, Y> {
    fn rates(&mut self, y: &[f64], rates: &mut [f64]) {
        self.take(y);
        self.room.rates(self.system, self.kind);
        let mut pd = self.room.pd.clone();
        if self.kind == Kind::Momenta {
            // The momenta of dependent joints stay zero. The multipliers that achieve this act on the other joints too.
            let transposed = (0..self.dependent.len())
                .map(|k| self.rows.iter().map(|&r| self.phi[r][self.dependent[k]]).collect())
                .collect();
            let y = solve(transposed, self.dependent.iter().map(|&d| pd[d]).collect());
            for &i in &self.independent {
                pd[i] -= self.rows.iter().zip(&y).map(|(&r, y)| self.phi[r][i] * y).sum::<f64>();
            }
        }
        let (first, second) = rates.split_at_mut(self.independent.len());
        for (k, &i) in self.independent.iter().enumerate() {
            (first[k], second[k]) = (self.room.qd[i], pd[i]);
        }
    }
}

/// Rows that form a square matrix of full rank, found by elimination with complete pivoting.
fn leading(mut a: Vec<Vec<f64>>, count: usize) -> Vec<usize> {
    let mut left: Vec<usize> = (0..a.len()).collect();
    let mut columns: Vec<usize> = (0..count).collect();
    let mut chosen = Vec::new();
    for _ in 0..count.min(a.len()) {
        let places = left.iter().flat_map(|&r| columns.iter().map(move |&c| (r, c)));
        let Some((row, column)) = places.max_by(|x, y| a[x.0][x.1].abs().total_cmp(&a[y.0][y.1].abs())) else { break };
        left.retain(|&r| r != row);
        columns.retain(|&c| c != column);
        chosen.push(row);
        let pivot = a[row].clone();
        for &r in &left {
            let factor = a[r][column] / pivot[column];
            a[r].iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
    chosen.sort_unstable();
    chosen
}

/// Solves `A x = b` by elimination with pivots. A singular matrix gives numbers that are not finite, at which the steps
/// of the caller stop.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap_or(k);
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            for j in k..n {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        for j in k + 1..n {
            b[k] -= a[k][j] * b[j];
        }
        b[k] /= a[k][k];
    }
    b
}
