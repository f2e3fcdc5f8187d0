//! Products computed again where a shared one makes the longest path wait.
//!
//! A product that several operations use is computed once. If it lies on the longest path, its users are better off with
//! its factors: a sum fuses the product, `M − u·(v·r)` with a late `r` becomes `M − (u·v)·r`. Each costs an operation or
//! two and saves a product's latency. Only programs that wait more than they compute are treated, and only changes that
//! pay are kept.

use super::rebuild::{by_id, uses};
use super::sums::{regroup_copying, Copies, Regrouped};
use crate::symbolic::machine::{self, waiting, PRODUCT};
use crate::symbolic::{Op, Program};

/// Rounds at the most; each finds the paths that the last one left.
const ROUNDS: usize = 24;

/// Products with more slack than this are left alone.
const SLACK: u32 = 1;

/// Regroups a program, with copies of products where they shorten it.
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

/// Marks a product as one to be computed again; says whether that is new.
fn copy(copies: &mut Copies, id: usize, now: &Regrouped) -> bool {
    let uneven = now.spread[id] >= PRODUCT;
    let changed = !copies.in_sums[id] || (uneven && !copies.in_products[id]);
    copies.in_sums[id] = true;
    copies.in_products[id] |= uneven;
    changed
}

/// Cycles of a regrouped program.
fn cycles(program: &Program) -> f64 {
    machine::cycles(program.critical_path(), program.throughput(), program.instructions())
}

#[cfg(test)]
mod tests {
    use super::super::random::keeps_values;
    use super::super::sums::regroup;
    use super::*;
    use crate::symbolic::{Expr, Graph};

    /// A continued fraction whose every step waits for a quotient, a product of it that is used twice, and a sum; beside it
    /// nothing but what makes the program long.
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
