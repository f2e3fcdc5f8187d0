//! Orders sums and products by the times at which their operands become available, and fuses products with sums.
//!
//! Many orders of addition give the same sum, up to rounding. The terms that are available first are added first, in
//! two or three parallel chains where that is faster. In a product, the latest factor is multiplied last. A product
//! that is used once, by a sum, is fused with its addition.

use super::chains::{best_plan, Arrival};
use super::rebuild::Rebuilt;
use super::terms::Opened;
use crate::symbolic::machine::latency;
use crate::symbolic::{Expr, Graph, Op, Operand, Program};

/// Regroups all sums and products of a program.
pub fn regroup(program: &Program) -> Program {
    regroup_copying(program, &Copies::none(program.width())).program
}

/// Shared products that their users compute again, by node id.
#[derive(Clone, Debug)]
pub struct Copies {
    /// Those that sums compute again.
    pub in_sums: Vec<bool>,
    /// Those that products compute again.
    pub in_products: Vec<bool>,
}

impl Copies {
    /// No product, for ids below `width`.
    pub fn none(width: usize) -> Copies {
        Copies { in_sums: vec![false; width], in_products: vec![false; width] }
    }
}

/// A regrouped program, and the times of the old program's nodes in it, in cycles.
pub struct Regrouped {
    /// The program.
    pub program: Program,
    /// Cycles by which a node may be late without delaying a result; the largest number where it is not computed.
    pub slack: Vec<u32>,
    /// Cycles between the times at which the two operands of a product are available.
    pub spread: Vec<u32>,
}

/// Regroups all sums and products, some of the shared products opened.
pub fn regroup_copying(program: &Program, copies: &Copies) -> Regrouped {
    let mut opened = Opened::new(program);
    let skipped: Vec<bool> = opened.in_sum.iter().zip(&opened.in_product).map(|(a, b)| *a || *b).collect();
    let open = |flags: &mut Vec<bool>, more: &[bool]| flags.iter_mut().zip(more).for_each(|(f, m)| *f |= *m);
    open(&mut opened.in_sum, &copies.in_sums);
    open(&mut opened.in_product, &copies.in_products);
    let graph = Graph::default();
    let mut pass = Pass { new: Rebuilt::new(&graph, program), arrival: Vec::new(), opened: &opened };
    let mut spread = vec![0; skipped.len()];
    for (id, op, label) in &program.steps {
        if skipped[*id as usize] {
            continue;
        }
        pass.new.at(*label);
        let value = match op {
            Op::Add(..) | Op::Sub(..) => {
                let terms = opened.terms(*op);
                let terms = terms.into_iter().map(|(operand, minus)| pass.term(operand, minus)).collect();
                pass.sum(terms)
            }
            Op::Mul(a, b) => {
                let factors = opened.factors_of_product(*a, *b);
                match pass.product(factors) {
                    Term::Value(x) => x,
                    Term::Product(x, y) => {
                        spread[*id as usize] = pass.ready(x).abs_diff(pass.ready(y));
                        x * y
                    }
                }
            }
            op => pass.new.copy(*op),
        };
        pass.new.set(*id, value);
    }
    let regrouped = pass.new.finish(program);
    let by_node = slacks(&regrouped, graph.len());
    let mut slack = vec![u32::MAX; skipped.len()];
    for (id, ..) in program.steps.iter().filter(|(id, ..)| !skipped[*id as usize]) {
        if let Expr::Node { id: new, .. } = pass.new.get(Operand::Node(*id)) {
            slack[*id as usize] = by_node[new as usize];
        }
    }
    Regrouped { program: regrouped, slack, spread }
}

/// Cycles by which each node may be late without delaying a result; the largest number for nodes that are not in the
/// program.
fn slacks(program: &Program, width: usize) -> Vec<u32> {
    let (mut ready, mut after, mut slack) = (vec![0; width], vec![0; width], vec![u32::MAX; width]);
    let nodes = |op: &Op| {
        let node = |o: Operand| if let Operand::Node(k) = o { Some(k as usize) } else { None };
        op.operands().filter_map(node).collect::<Vec<_>>()
    };
    for (id, op, _) in &program.steps {
        ready[*id as usize] = nodes(op).into_iter().map(|k| ready[k]).max().unwrap_or(0) + latency(op);
    }
    for (id, op, _) in program.steps.iter().rev() {
        for k in nodes(op) {
            after[k] = after[k].max(after[*id as usize] + latency(op));
        }
    }
    let path = program.critical_path();
    for (id, ..) in &program.steps {
        slack[*id as usize] = path.saturating_sub(ready[*id as usize] + after[*id as usize]);
    }
    slack
}

/// One term of a sum.
#[derive(Clone, Copy, Debug)]
enum Term<'g> {
    Value(Expr<'g>),
    Product(Expr<'g>, Expr<'g>),
}

struct Pass<'g, 'p> {
    new: Rebuilt<'g>,
    /// Time at which each new node is available, in cycles.
    arrival: Vec<u32>,
    opened: &'p Opened,
}

impl<'g> Pass<'g, '_> {
    fn term(&mut self, operand: Operand, minus: bool) -> Term<'g> {
        match (self.product(self.opened.factors(operand)), minus) {
            (term, false) => term,
            (Term::Value(x), true) => Term::Value(-x),
            (Term::Product(x, y), true) => Term::Product(-x, y),
        }
    }

    /// A product up to its last multiplication. The factors that are available first are multiplied first.
    fn product(&mut self, factors: Vec<Operand>) -> Term<'g> {
        let mut factors: Vec<Expr<'g>> = factors.into_iter().map(|f| self.new.get(f)).collect();
        loop {
            match factors[..] {
                [x] => return Term::Value(x),
                [x, y] => return Term::Product(x, y),
                _ => {
                    let mut timed: Vec<(u32, Expr)> = factors.iter().map(|&f| (self.ready(f), f)).collect();
                    timed.sort_by_key(|(ready, _)| *ready);
                    let first = timed[0].1 * timed[1].1;
                    factors = std::iter::once(first).chain(timed[2..].iter().map(|t| t.1)).collect();
                }
            }
        }
    }

    fn ready(&mut self, e: Expr<'g>) -> u32 {
        // The ids of this graph are consecutive, so the table is extended to its length.
        while self.arrival.len() < self.new.graph.len() {
            let (op, _) = self.new.graph.get(self.arrival.len() as u32);
            let start =
                op.operands().map(|o| if let Operand::Node(k) = o { self.arrival[k as usize] } else { 0 }).max();
            self.arrival.push(start.unwrap_or(0) + latency(&op));
        }
        match e {
            Expr::Const(_) => 0,
            Expr::Node { id, .. } => self.arrival[id as usize],
        }
    }

    fn sum(&mut self, mut terms: Vec<Term<'g>>) -> Expr<'g> {
        let constant: f64 = terms.iter().map(|t| if let Term::Value(Expr::Const(x)) = t { *x } else { 0.0 }).sum();
        terms.retain(|t| !matches!(t, Term::Value(Expr::Const(_))));
        if constant != 0.0 {
            terms.push(Term::Value(Expr::Const(constant)));
        }
        let mut timed: Vec<(Arrival, Term)> = Vec::with_capacity(terms.len());
        for term in terms {
            timed.push(match term {
                Term::Value(x) => (Arrival { ready: self.ready(x), is_product: false }, term),
                Term::Product(x, y) => (Arrival { ready: self.ready(x).max(self.ready(y)), is_product: true }, term),
            });
        }
        // The sort is stable: terms with equal times keep the order of the sweep.
        timed.sort_by_key(|t| t.0);
        let arrivals: Vec<Arrival> = timed.iter().map(|t| t.0).collect();
        match best_plan(&arrivals) {
            Some(best) => self.build(&timed, best.chains, &best.places(&arrivals)),
            None => Expr::Const(0.0),
        }
    }

    fn build(&mut self, timed: &[(Arrival, Term<'g>)], chains: usize, places: &[usize]) -> Expr<'g> {
        let mut chains: Vec<Option<Expr<'g>>> = vec![None; chains];
        for ((_, term), &k) in timed.iter().zip(places) {
            chains[k] = Some(match (chains[k], *term) {
                (None, Term::Value(x)) => x,
                (None, Term::Product(x, y)) => x * y,
                (Some(sum), Term::Value(x)) => sum + x,
                (Some(sum), Term::Product(x, y)) => self.new.graph.fma(x, y, sum),
            });
        }
        let mut chains: Vec<Expr<'g>> = chains.into_iter().flatten().collect();
        while chains.len() > 1 {
            let mut timed: Vec<(u32, Expr)> = chains.iter().map(|&c| (self.ready(c), c)).collect();
            timed.sort_by_key(|(ready, _)| *ready);
            let first = timed[0].1 + timed[1].1;
            chains = std::iter::once(first).chain(timed[2..].iter().map(|t| t.1)).collect();
        }
        chains[0]
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{counts_never_grow, integer_program, keeps_values};
    use super::*;

    #[test]
    fn products_are_fused() {
        let graph = Graph::default();
        let [a, b, c, d] = std::array::from_fn(|k| graph.input(k));
        let fused = |e: Expr| regroup(&Program::new(&graph, &[e])).instructions();
        assert_eq!(fused(a * b + c), 1);
        assert_eq!(fused(c - a * b), 1);
        assert_eq!(fused(a * b - c * d), 2);
        assert_eq!(fused(a * b * c + d), 2);
    }

    #[test]
    fn late_factors_are_multiplied_last() {
        let graph = Graph::default();
        let [a, b, c, _] = std::array::from_fn(|k| graph.input(k));
        let late = a / b;
        let program = Program::new(&graph, &[(late * b) * c]);
        assert_eq!(
            program.critical_path() - regroup(&program).critical_path(),
            latency(&Op::Mul(Operand::Node(0), Operand::Node(0)))
        );
    }

    #[test]
    fn paths_get_shorter() {
        for seed in 0..100 {
            let program = integer_program(seed, 120);
            assert!(regroup(&program).critical_path() <= program.critical_path(), "seed {seed}");
        }
    }

    #[test]
    fn values_stay() {
        keeps_values(regroup);
    }

    #[test]
    fn counts_do_not_grow() {
        counts_never_grow(regroup);
    }
}
