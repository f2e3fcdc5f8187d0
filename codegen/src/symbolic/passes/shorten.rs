//! Computes a shared product again where waiting for it lengthens the critical path.
//!
//! A product that several operations use is computed once. If it lies on the critical path, its users can become faster
//! by using its factors instead: a sum fuses the product, and `M − u·(v·r)` with a late `r` becomes `M − (u·v)·r`. Each
//! change costs one or two operations and saves the latency of a product. Only programs that are limited by latency are
//! changed, and only changes that save time are kept.

use super::rebuild::{by_id, uses};
use super::sums::{regroup_copying, Copies, Regrouped};
use crate::symbolic::machine::{self, waiting, PRODUCT};
use crate::symbolic::{Op, Program};

/// Largest number of rounds; each round finds the critical paths that the last one left.
const ROUNDS: usize = 24;

/// Products with more slack than this, in cycles, are not changed.
const SLACK: u32 = 1;

/// Regroups a program, with copies of products where they shorten the critical path.
pub fn regroup_short(program: &Program) -> Program {
    let (ops, uses) = (by_id(program), uses(program));
    let shared: Vec<usize> =
        (0..ops.len()).filter(|&id| uses[id] > 1 && matches!(ops[id], Some(Op::Mul(..)))).collect();
    let mut copies = Copies::none(ops.len());
    let mut now = regroup_copying(program, &copies);
    let mut best = now.program.clone();
    for _ in 0..ROUNDS {
        if waiting(now.program.critical_path(), now.program.instructions()) <= now.program.throughput() {
            break;
        }
        let mut changed = false;
        for &id in shared.iter().filter(|&&id| now.slack[id] <= SLACK) {
            changed |= copy(&mut copies, id, &now);
        }
        if !changed {
            break;
        }
        now = regroup_copying(program, &copies);
        if cycles(&now.program) < cycles(&best) {
            best = now.program.clone();
        }
    }
    best
}

/// Marks a product to be computed again. Returns whether it was not marked before.
fn copy(copies: &mut Copies, id: usize, now: &Regrouped) -> bool {
    let uneven = now.spread[id] >= PRODUCT;
    let changed = !copies.in_sums[id] || (uneven && !copies.in_products[id]);
    copies.in_sums[id] = true;
    copies.in_products[id] |= uneven;
    changed
}

/// Estimated time of a regrouped program, in cycles.
fn cycles(program: &Program) -> f64 {
    machine::cycles(program.critical_path(), program.throughput(), program.instructions())
}

#[cfg(test)]
mod tests {
    use super::super::random::keeps_values;
    use super::super::sums::regroup;
    use super::*;
    use crate::symbolic::{Expr, Graph};

    /// A continued fraction: every step waits for a quotient, a product with it that is used twice, and a sum. The
    /// other operations only make the program long.
    fn staircase(graph: &Graph) -> Program {
        let x: Vec<Expr> = (0..8).map(|k| graph.input(k)).collect();
        let (mut late, mut others) = (x[0], Vec::new());
        for k in 0..40 {
            let share = x[k % 7] / late * x[k % 5 + 1];
            others.push(share - x[2]);
            late = x[k % 3] * x[k % 6] + share;
        }
        others.push(late);
        Program::new(graph, &others)
    }

    #[test]
    fn long_paths_get_shorter() {
        let graph = Graph::default();
        let program = staircase(&graph);
        let (plain, short) = (regroup(&program), regroup_short(&program));
        assert!(short.critical_path() + 40 < plain.critical_path(), "{}", short.critical_path());
        assert!(cycles(&short) < cycles(&plain));
        let inputs = [1.5, 2.5, 0.7, 1.1, 0.9, 1.3, 2.1, 0.4];
        let run = |p: &Program| p.evaluate(&inputs, |a: f64, b: f64, c: f64| a * b + c);
        for (a, b) in run(&plain).iter().zip(run(&short)) {
            assert!((a - b).abs() <= 1e-12 * a.abs().max(1.0), "{a} became {b}");
        }
    }

    #[test]
    fn values_stay() {
        keeps_values(regroup_short);
    }
}
