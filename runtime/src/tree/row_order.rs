//! The order in which the rows of the constraints are eliminated.
//!
//! Rows that are nearly dependent on one another lose digits when they are eliminated one after the other: of a row `a +
//! δ u` after `a`, only `δ²` is left, and a row `u` after both of them is redundant but for rounding errors of the size
//! `ε/δ²`. Where `u` comes first, `a + δ u` is redundant, and nothing is lost. The order in which a description lists
//! its constraints must not matter; rows are therefore ordered by their pivots, as a factorization with diagonal pivoting
//! would. The sweeps have no branches: the order belongs to the tree. It is chosen when a plan is made, and anew where
//! rows become nearly dependent during a motion ([`crate::Constrained::reorder_rows`]).

use alloc::vec;
use alloc::vec::Vec;

use super::{Elimination, Tree, Unknown};
use crate::system::{Constrained, Real};
use crate::Interpreter;

/// A row of which less than this part is left waits for rows that are solved further inboard.
const SMALL: f64 = 1e-3;
/// A row of which less is left is redundant, and waits for nothing.
const NOTHING: f64 = 1e-12;

/// `Φ D⁻¹Φᵀ` at a position, with the diagonal `D` of the mass matrix, without the rows that have been eliminated.
#[derive(Clone, Debug)]
pub struct RowProducts {
    n: usize,
    a: Vec<f64>,
    /// The diagonal at first.
    whole: Vec<f64>,
}

impl RowProducts {
    /// The products at coordinates `q`, which need not be closed.
    pub fn new<S: Real>(interpreter: &mut Interpreter<S>, q: &Vec<S>) -> RowProducts {
        let (mut residual, mut entries) = (interpreter.zero_rows(), interpreter.zero_entries());
        interpreter.constraint_residuals(q, &mut residual, &mut entries);
        let nv = interpreter.tree().dims.nv;
        let mut mass = vec![S::zero(); nv * nv];
        interpreter.mass_matrix(q, &mut mass);
        let columns = interpreter.entry_columns();
        let dense = |row: &crate::system::Row| {
            let mut dense = vec![0.0; nv];
            for k in row.first..row.first + row.len {
                let v = columns[k];
                let own = mass[v * nv + v].to_f64();
                dense[v] += entries[k].to_f64() / if own > 0.0 { libm::sqrt(own) } else { 1.0 };
            }
            dense
        };
        let scaled: Vec<Vec<f64>> = interpreter.rows().iter().map(dense).collect();
        let n = scaled.len();
        let product = |k: usize| scaled[k / n].iter().zip(&scaled[k % n]).map(|(a, b)| a * b).sum();
        let a: Vec<f64> = (0..n * n).map(product).collect();
        RowProducts { n, whole: (0..n).map(|r| a[r * n + r]).collect(), a }
    }

    /// Part of a row that is left; all of a row that is zero.
    fn left(&self, r: usize) -> f64 {
        match self.whole[r] > 0.0 {
            true => self.a[r * self.n + r] / self.whole[r],
            false => 1.0,
        }
    }

    fn eliminate(&mut self, r: usize) {
        let (n, left) = (self.n, self.left(r));
        if self.whole[r] <= 0.0 || left <= NOTHING {
            return;
        }
        let row = self.a[r * n..(r + 1) * n].to_vec();
        for i in 0..n {
            let factor = row[i] / row[r];
            for j in 0..n {
                self.a[i * n + j] -= factor * row[j];
            }
        }
    }
}

/// The least part of a row that is left at any of the positions.
fn left(at: &[RowProducts], r: usize) -> f64 {
    at.iter().fold(1.0, |least, products| products.left(r).min(least))
}

/// What says in which order rows are eliminated: a tree, or the plan of one.
pub trait RowLists {
    /// Number of nodes, parents first.
    fn nodes(&self) -> usize;
    /// Parent of a node.
    fn parent(&self, node: usize) -> Option<usize>;
    /// Elimination of a node.
    fn elimination(&mut self, node: usize) -> &mut Elimination;
    /// Unknowns that are solved at the ground.
    fn ground(&mut self) -> &mut Vec<usize>;
    /// The row of an unknown.
    fn row(&self, unknown: usize) -> Option<usize>;
    /// Whether rows may wait for those of an inner node. Code of loops over links has the places of its columns.
    fn may_wait(&self) -> bool {
        true
    }
}

/// With fewer rows no order is better than another.
pub const FEWEST: usize = 3;

/// Orders the rows anew, the largest relative pivot first, where the order that they have loses digits at a position.
/// Returns whether anything has changed.
pub fn reorder_rows(lists: &mut impl RowLists, at: &RowProducts) -> bool {
    loses_digits(lists, at.clone()) && order_rows(lists, vec![at.clone()], 1.0)
}

impl<S> Tree<S> {
    /// Whether there are rows enough for their order to matter.
    pub fn rows_can_be_ordered(&self) -> bool {
        self.dims.rows >= FEWEST && self.constraints.iter().all(|c| c.passes.is_empty())
    }

    /// Chooses the order of its rows anew, where the one that it has loses digits at a position. Returns whether it has
    /// changed.
    pub fn reorder_rows(&mut self, at: &RowProducts) -> bool {
        if !self.rows_can_be_ordered() {
            return false;
        }
        let own = reorder_rows(self, at);
        let other = self.accelerations.as_deref_mut().is_some_and(|other| other.reorder_rows(at));
        own || other
    }
}

impl<S> RowLists for Tree<S> {
    fn nodes(&self) -> usize {
        self.nodes.len()
    }
    fn parent(&self, node: usize) -> Option<usize> {
        self.nodes[node].parent
    }
    fn elimination(&mut self, node: usize) -> &mut Elimination {
        &mut self.nodes[node].elimination
    }
    fn ground(&mut self) -> &mut Vec<usize> {
        &mut self.solve_at_ground
    }
    fn row(&self, unknown: usize) -> Option<usize> {
        row_of(self.unknowns[unknown])
    }
}

/// The row that an unknown is the multiplier of.
pub fn row_of(unknown: Unknown) -> Option<usize> {
    match unknown {
        Unknown::Row(r) => Some(r),
        Unknown::Velocity(_) => None,
    }
}

/// Orders the rows that are solved at the same node by the parts of them that are left at all of the positions, and
/// moves rows that are nearly dependent to an inner node. A row is taken in the order that it has if its relative pivot is
/// at least the part `large` of the largest one. Returns whether anything has changed.
pub fn order_rows(lists: &mut impl RowLists, mut at: Vec<RowProducts>, large: f64) -> bool {
    let mut changed = false;
    for i in (0..lists.nodes()).rev() {
        for after in [false, true] {
            let old = list(lists, i, after).clone();
            let inward = lists.may_wait() && inner(lists, i).is_some();
            let (new, waiting) = ordered(lists, &old, &mut at, large, inward);
            changed |= new != old;
            *list(lists, i, after) = new;
            for g in waiting {
                wait(lists, i, g);
            }
        }
    }
    let old = lists.ground().clone();
    let new = ordered(lists, &old, &mut at, large, false).0;
    changed |= new != old;
    *lists.ground() = new;
    changed
}

/// Whether the order loses digits at one position: a row that is nearly dependent on those before it is eliminated, and
/// others come after it.
fn loses_digits(lists: &mut impl RowLists, mut at: RowProducts) -> bool {
    let mut order = Vec::new();
    for i in (0..lists.nodes()).rev() {
        let Elimination { solve_before, solve_after, .. } = lists.elimination(i);
        order.extend(solve_before.iter().chain(solve_after.iter()).copied());
    }
    order.extend(lists.ground().iter().copied());
    let rows: Vec<usize> = order.into_iter().filter_map(|g| lists.row(g)).collect();
    rows.iter().enumerate().any(|(k, &r)| {
        let small = (NOTHING..SMALL).contains(&at.left(r)) && k + 1 < rows.len();
        at.eliminate(r);
        small
    })
}

/// Unknowns that are solved at node `i`, before or after its own freedoms.
fn list(lists: &mut impl RowLists, i: usize, after: bool) -> &mut Vec<usize> {
    let elimination = lists.elimination(i);
    if after {
        &mut elimination.solve_after
    } else {
        &mut elimination.solve_before
    }
}

/// The unknowns of a list with its rows in a new order, and the rows that are to wait for inner ones, if `inner` rows
/// exist. Eliminates the rows that stay. Unknowns that are no rows keep their places.
fn ordered(
    lists: &impl RowLists,
    list: &[usize],
    at: &mut [RowProducts],
    large: f64,
    inner: bool,
) -> (Vec<usize>, Vec<usize>) {
    let row = |g: usize| lists.row(g);
    let mut rest: Vec<usize> = list.iter().copied().filter(|&g| row(g).is_some()).collect();
    let (mut taken, mut waiting) = (Vec::new(), Vec::new());
    while !rest.is_empty() {
        let parts: Vec<f64> = rest.iter().map(|&g| row(g).map_or(1.0, |r| left(at, r))).collect();
        let most = parts.iter().fold(0.0_f64, |most, part| part.max(most));
        let first = parts.iter().position(|part| *part >= large * most).unwrap_or(0);
        let g = rest.remove(first);
        if inner && (NOTHING..SMALL).contains(&parts[first]) {
            waiting.push(g);
            continue;
        }
        if let Some(r) = row(g) {
            at.iter_mut().for_each(|products| products.eliminate(r));
        }
        taken.push(g);
    }
    let mut taken = taken.into_iter();
    let kept = list.iter().copied().filter(|g| !waiting.contains(g));
    let list = kept.filter_map(|g| if row(g).is_some() { taken.next() } else { Some(g) }).collect();
    (list, waiting)
}

/// The ancestors of node `i`, from its parent inward.
fn ancestors(lists: &impl RowLists, i: usize) -> Vec<usize> {
    core::iter::successors(lists.parent(i), |&k| lists.parent(k)).collect()
}

/// The nearest ancestor of node `i` at which rows are solved, `Some(None)` for the ground.
fn inner(lists: &mut impl RowLists, i: usize) -> Option<Option<usize>> {
    for k in ancestors(lists, i) {
        let Elimination { solve_before, solve_after, .. } = lists.elimination(k).clone();
        if solve_before.iter().chain(&solve_after).any(|&g| lists.row(g).is_some()) {
            return Some(Some(k));
        }
    }
    let ground = lists.ground().clone();
    ground.iter().any(|&g| lists.row(g).is_some()).then_some(None)
}

/// Has row `g`, which was to be solved at node `i`, wait for the rows that are solved next further inboard.
fn wait(lists: &mut impl RowLists, i: usize, g: usize) {
    let Some(target) = inner(lists, i) else { return };
    lists.elimination(i).open.push(g);
    for k in ancestors(lists, i).into_iter().take_while(|&k| Some(k) != target) {
        lists.elimination(k).open.push(g);
    }
    match target {
        Some(k) => lists.elimination(k).solve_after.push(g),
        None => lists.ground().push(g),
    }
}
