//! Corrections of positions that need `Φ` alone.

use alloc::vec;
use alloc::vec::Vec;

use super::blocks::{Block, Blocks};
use super::dense::{pivots, rank_tolerance, Basis, Lu};
use crate::system::{Constrained, Real};

/// `Φ` in groups of rows, with room to solve for displacements.
#[derive(Clone, Debug)]
pub(super) struct Basic<S> {
    pub blocks: Blocks<S>,
    bases: Vec<Basis<S>>,
    /// Rows that are not derivatives of conditions on positions.
    velocities: Vec<bool>,
    /// Rows that the sweeps leave out.
    left_out: Vec<bool>,
    /// For each block: dependent columns and the rows that are solved for them, a pair for each pivot.
    pub pairs: Vec<Vec<(usize, usize)>>,
    pub lus: Vec<Lu<S>>,
    b: Vec<S>,
    x: Vec<S>,
    work: Vec<S>,
}

impl<S: Real> Basic<S> {
    pub fn new<Y: Constrained<Scalar = S>>(system: &Y) -> Self {
        let blocks = Blocks::new(system);
        let most = |size: fn(&Block<S>) -> usize| blocks.list.iter().map(size).max().unwrap_or(0);
        let (m, n, mn) = (most(|b| b.rows.len()), most(|b| b.columns.len()), most(|b| b.a.len()));
        Basic {
            velocities: system.rows().iter().map(|row| !row.holonomic).collect(),
            left_out: vec![false; system.rows().len()],
            bases: blocks.list.iter().map(|b| Basis::new(b.rows.len(), b.columns.len())).collect(),
            pairs: blocks.list.iter().map(|b| Vec::with_capacity(b.rows.len())).collect(),
            lus: blocks.list.iter().map(|b| Lu::new(b.rows.len())).collect(),
            b: vec![S::zero(); m],
            x: vec![S::zero(); n],
            work: vec![S::zero(); mn],
            blocks,
        }
    }

    /// Leaves out of displacements the rows that the sweeps leave out, which have pivots of zero: while the momenta are
    /// free along a row, a displacement along it would change the energy.
    pub fn leave_out(&mut self, pivots: &[S]) {
        for (left_out, pivot) in self.left_out.iter_mut().zip(pivots) {
            *left_out = *pivot == S::zero();
        }
    }

    /// The displacement of least norm after which the residuals are least, velocities of `held` left out; the rank of
    /// the rows. Rows that bind velocities alone do not stand in the way of displacements.
    pub fn least(&mut self, entries: &[S], held: &[bool], residual: &[S], dq: &mut [S]) -> usize {
        self.blocks.fill(entries);
        self.blocks.hold(held);
        self.blocks.release(&self.velocities);
        self.blocks.release(&self.left_out);
        self.solve_least(residual, dq)
    }

    /// The same for velocities, with all rows.
    pub fn least_velocities(&mut self, entries: &[S], held: &[bool], residual: &[S], dv: &mut [S]) -> usize {
        self.blocks.fill(entries);
        self.blocks.hold(held);
        self.solve_least(residual, dv)
    }

    fn solve_least(&mut self, residual: &[S], dq: &mut [S]) -> usize {
        dq.fill(S::zero());
        let mut rank = 0;
        for (block, basis) in self.blocks.list.iter().zip(&mut self.bases) {
            let (m, n) = (block.rows.len(), block.columns.len());
            rank += basis.factor(&block.a, m, n);
            for (b, r) in self.b.iter_mut().zip(&block.rows) {
                *b = -residual[*r];
            }
            basis.solve(&self.b[..m], m, n, &mut self.x[..n]);
            for (column, x) in block.columns.iter().zip(&self.x) {
                dq[*column] = *x;
            }
        }
        rank
    }

    /// Chooses dependent velocities and the rows to solve for them, by complete pivoting, from the entries that were
    /// taken last. The rank.
    pub fn choose(&mut self) -> usize {
        (0..self.blocks.list.len()).map(|k| self.choose_of(k)).sum()
    }

    /// The same in one block.
    pub fn choose_of(&mut self, k: usize) -> usize {
        let block = &self.blocks.list[k];
        let work = &mut self.work[..block.a.len()];
        work.copy_from_slice(&block.a);
        pivots(work, block.rows.len(), block.columns.len(), rank_tolerance(), &mut self.pairs[k]);
        self.pairs[k].len()
    }

    /// Factors the dependent columns of a block; false if they are singular.
    pub fn factor(&mut self, k: usize) -> bool {
        let (block, pairs, lu) = (&self.blocks.list[k], &self.pairs[k], &mut self.lus[k]);
        let n = block.columns.len();
        lu.set(pairs.len(), |i, j| block.a[pairs[i].0 * n + pairs[j].1]);
        lu.factor()
    }

    /// `−Φ_d⁻¹ φ` of a factored block into the places of its dependent velocities.
    pub fn solve(&mut self, k: usize, residual: &[S], dq: &mut [S]) {
        let (block, pairs) = (&self.blocks.list[k], &self.pairs[k]);
        let b = &mut self.b[..pairs.len()];
        for (b, pair) in b.iter_mut().zip(pairs) {
            *b = -residual[block.rows[pair.0]];
        }
        self.lus[k].solve(b);
        for (b, pair) in b.iter().zip(pairs) {
            dq[block.columns[pair.1]] = *b;
        }
    }

    /// The displacement of dependents alone, chosen anew.
    pub fn dependent(&mut self, entries: &[S], residual: &[S], dq: &mut [S]) {
        self.blocks.fill(entries);
        self.blocks.release(&self.left_out);
        dq.fill(S::zero());
        self.choose();
        for k in 0..self.pairs.len() {
            // Pivots were found: the factors exist.
            self.factor(k);
            self.solve(k, residual, dq);
        }
    }

    /// Takes `Φᵀ Φ_d⁻ᵀ f_d` off forces `f` of a factored block: nothing is left at its dependents.
    pub fn eliminate(&mut self, k: usize, f: &mut [S]) {
        let (block, pairs) = (&self.blocks.list[k], &self.pairs[k]);
        let (n, y) = (block.columns.len(), &mut self.b[..pairs.len()]);
        for (y, pair) in y.iter_mut().zip(pairs) {
            *y = f[block.columns[pair.1]];
        }
        self.lus[k].solve_transposed(y);
        for (y, pair) in y.iter().zip(pairs) {
            for (column, a) in block.columns.iter().zip(&block.a[pair.0 * n..(pair.0 + 1) * n]) {
                f[*column] = f[*column] - *a * *y;
            }
        }
        for pair in pairs {
            f[block.columns[pair.1]] = S::zero();
        }
    }

    /// The largest of `B = −Φ_d⁻¹ Φ_ind` of a factored block: its size, the index of its dependent, its independent
    /// column.
    pub fn largest(&mut self, k: usize) -> (S, usize, usize) {
        let (block, pairs) = (&self.blocks.list[k], &self.pairs[k]);
        let (n, b) = (block.columns.len(), &mut self.b[..pairs.len()]);
        let mut found = (S::zero(), 0, 0);
        for column in (0..n).filter(|c| pairs.iter().all(|pair| pair.1 != *c)) {
            for (b, pair) in b.iter_mut().zip(pairs) {
                *b = block.a[pair.0 * n + column];
            }
            self.lus[k].solve(b);
            for (d, b) in b.iter().enumerate() {
                if b.abs() > found.0 || !b.is_finite() {
                    found = (b.abs(), d, column);
                }
            }
        }
        found
    }
}
