//! The order in which the rows of the constraints are eliminated.
//!
//! Rows that are nearly dependent on one another lose digits when they are eliminated one after the other: of a row `a +
//! δ u` after `a`, only `δ²` is left, and a row `u` after both of them is redundant but for rounding errors of the size
//! `ε/δ²`. Where `u` comes first, `a + δ u` is redundant, and nothing is lost. The order in which a description lists
//! its constraints must not matter; rows are therefore ordered by their pivots at a few positions, as a factorization
//! with diagonal pivoting would. It is chosen once, when the plan is made: the sweeps have no branches.

use mbd_runtime::integrate::Chart;
use mbd_runtime::tree::Unknown;
use mbd_runtime::{Constrained, Interpreter, System};

use super::structure::Plan;

/// A row is taken in the order of the description if its relative pivot is at least this part of the largest one.
const LARGE: f64 = 0.1;
/// A row of which less than this part is left waits for rows that are solved further inboard.
const SMALL: f64 = 1e-3;
/// A row of which less is left is redundant, and waits for nothing.
const NOTHING: f64 = 1e-12;
/// Displacements of the positions beside the start at which pivots are computed, rad and m.
const DISPLACEMENTS: [f64; 2] = [0.3, 0.05];

/// Orders the rows that are solved at the same node, and moves rows that are nearly dependent to an inner node.
pub(super) fn order(plan: &mut Plan) {
    if plan.dims.rows < 3 {
        return;
    }
    let mut grams = grams(plan);
    for i in (0..plan.nodes.len()).rev() {
        for after in [false, true] {
            let elimination = &plan.nodes[i].elimination;
            let list = if after { &elimination.solve_after } else { &elimination.solve_before };
            let (list, waiting) = ordered(plan, list.clone(), &mut grams, inner(plan, i).is_some());
            let elimination = &mut plan.nodes[i].elimination;
            *(if after { &mut elimination.solve_after } else { &mut elimination.solve_before }) = list;
            for g in waiting {
                wait(plan, i, g);
            }
        }
    }
    let ground = plan.solve_at_ground.clone();
    plan.solve_at_ground = ordered(plan, ground, &mut grams, false).0;
}

/// `Φ D⁻¹Φᵀ` at a position, with the diagonal `D` of the mass matrix, without the rows that have been eliminated.
struct Gram {
    n: usize,
    a: Vec<f64>,
    /// The diagonal at first.
    whole: Vec<f64>,
}

impl Gram {
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
fn left(grams: &[Gram], r: usize) -> f64 {
    grams.iter().fold(1.0, |least, gram| gram.left(r).min(least))
}

/// At the start and at positions beside it, which need not be closed.
fn grams(plan: &Plan) -> Vec<Gram> {
    let params = plan.default_params();
    let mut interpreter = Interpreter::new(plan.tree(&params), [0.0; 3]);
    let start = plan.start();
    let moved = DISPLACEMENTS.iter().map(|size| {
        let mut q = start.clone();
        // Irrational steps, so that no symmetry is met.
        let mut dx = (0..plan.dims.nv).map(|k| size * libm::sin(1.0 + 2.0_f64.sqrt() * k as f64)).collect();
        Chart::displace(&interpreter, &mut dx, &mut q);
        q
    });
    let positions: Vec<Vec<f64>> = moved.chain([start.clone()]).collect();
    positions.iter().map(|q| gram(&mut interpreter, q)).collect()
}

fn gram(interpreter: &mut Interpreter<f64>, q: &Vec<f64>) -> Gram {
    let (mut residual, mut entries) = (interpreter.zero_rows(), interpreter.zero_entries());
    interpreter.constraint_residuals(q, &mut residual, &mut entries);
    let nv = interpreter.zero_momenta().len();
    let mut mass = vec![0.0; nv * nv];
    interpreter.mass_matrix(q, &mut mass);
    let columns = interpreter.entry_columns();
    let scaled: Vec<Vec<f64>> = interpreter
        .rows()
        .iter()
        .map(|row| {
            let mut dense = vec![0.0; nv];
            for k in row.first..row.first + row.len {
                let v = columns[k];
                let own = mass[v * nv + v];
                dense[v] += entries[k] / if own > 0.0 { own.sqrt() } else { 1.0 };
            }
            dense
        })
        .collect();
    let n = scaled.len();
    let product = |k: usize| scaled[k / n].iter().zip(&scaled[k % n]).map(|(a, b)| a * b).sum();
    let a: Vec<f64> = (0..n * n).map(product).collect();
    Gram { n, whole: (0..n).map(|r| a[r * n + r]).collect(), a }
}

/// The unknowns of a list with its rows in a new order, and the rows that are to wait for inner ones, if `inner` rows
/// exist. Eliminates the rows that stay. Unknowns that are no rows keep their places.
fn ordered(plan: &Plan, list: Vec<usize>, grams: &mut [Gram], inner: bool) -> (Vec<usize>, Vec<usize>) {
    let row = |g: usize| match plan.unknowns[g] {
        Unknown::Row(r) => Some(r),
        Unknown::Velocity(_) => None,
    };
    let mut rest: Vec<usize> = list.iter().copied().filter(|&g| row(g).is_some()).collect();
    let (mut taken, mut waiting) = (Vec::new(), Vec::new());
    while !rest.is_empty() {
        let parts: Vec<f64> = rest.iter().map(|&g| row(g).map_or(1.0, |r| left(grams, r))).collect();
        let most = parts.iter().fold(0.0_f64, |most, part| part.max(most));
        let first = parts.iter().position(|part| *part >= LARGE * most).unwrap_or(0);
        let g = rest.remove(first);
        if inner && (NOTHING..SMALL).contains(&parts[first]) {
            waiting.push(g);
            continue;
        }
        if let Some(r) = row(g) {
            grams.iter_mut().for_each(|gram| gram.eliminate(r));
        }
        taken.push(g);
    }
    let mut taken = taken.into_iter();
    let kept = list.into_iter().filter(|g| !waiting.contains(g));
    let list = kept.filter_map(|g| if row(g).is_some() { taken.next() } else { Some(g) }).collect();
    (list, waiting)
}

/// The nearest ancestor of node `i` at which rows are solved, `Some(None)` for the ground.
fn inner(plan: &Plan, i: usize) -> Option<Option<usize>> {
    let rows = |list: &[usize]| list.iter().any(|&g| matches!(plan.unknowns[g], Unknown::Row(_)));
    let solves = |k: usize| {
        let elimination = &plan.nodes[k].elimination;
        rows(&elimination.solve_before) || rows(&elimination.solve_after)
    };
    let node = plan.ancestors(i).into_iter().skip(1).find(|&k| solves(k));
    node.map(Some).or(rows(&plan.solve_at_ground).then_some(None))
}

/// Has row `g`, which was to be solved at node `i`, wait for the rows that are solved next further inboard.
fn wait(plan: &mut Plan, i: usize, g: usize) {
    let Some(target) = inner(plan, i) else { return };
    for k in plan.ancestors(i).into_iter().take_while(|&k| Some(k) != target) {
        plan.nodes[k].elimination.open.push(g);
    }
    match target {
        Some(k) => plan.nodes[k].elimination.solve_after.push(g),
        None => plan.solve_at_ground.push(g),
    }
}
