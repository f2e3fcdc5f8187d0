//! Sums and products in the order in which their operands arrive, products fused with sums.
//!
//! A sum of many terms is one value that many orders give. The terms that are ready first are added first; where that is
//! faster, in two or three chains at once. Likewise the factors of a product: what is late is multiplied last. A product
//! that is used once, by the sum, is fused with its addition.

use super::rebuild::Rebuilt;
use super::terms::Opened;
use crate::symbolic::machine::{latency, PRODUCT, SUM};
use crate::symbolic::{Expr, Graph, Op, Operand, Program};

/// Chains of one sum at the most.
const CHAINS: usize = 3;

/// Cycles that one more operation has to save.
const WORTH: u32 = 1;

/// Regroups all sums and products.
pub fn regroup(program: &Program) -> Program {
    let opened = Opened::new(program);
    let graph = Graph::default();
    let mut pass = Pass { new: Rebuilt::new(&graph, program), arrival: Vec::new(), opened: &opened };
    for (id, op, label) in &program.steps {
        if opened.in_sum[*id as usize] || opened.in_product[*id as usize] {
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
                let factors = [opened.factors_of_product(*a), opened.factors_of_product(*b)].concat();
                match pass.product(factors) {
                    Term::Value(x) => x,
                    Term::Product(x, y) => x * y,
                }
            }
            op => pass.new.copy(*op),
        };
        pass.new.set(*id, value);
    }
    pass.new.finish(program)
}

/// One term of a sum.
#[derive(Clone, Copy, Debug)]
enum Term<'g> {
    Value(Expr<'g>),
    Product(Expr<'g>, Expr<'g>),
}

struct Pass<'g, 'p> {
    new: Rebuilt<'g>,
    /// When each new node is ready.
    arrival: Vec<u32>,
    opened: &'p Opened,
}

/// A term and when it is ready to be added.
struct Timed<'g> {
    ready: u32,
    is_product: bool,
    term: Term<'g>,
}

impl<'g> Pass<'g, '_> {
    fn term(&mut self, operand: Operand, minus: bool) -> Term<'g> {
        match (self.product(self.opened.factors(operand)), minus) {
            (term, false) => term,
            (Term::Value(x), true) => Term::Value(-x),
            (Term::Product(x, y), true) => Term::Product(-x, y),
        }
    }

    /// A product up to its last multiplication. What is ready first is multiplied first.
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
        // Nodes of this graph come in order, so the table is extended to what is there.
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
        let mut timed: Vec<Timed> = Vec::with_capacity(terms.len());
        for term in terms {
            timed.push(match term {
                Term::Value(x) => Timed { ready: self.ready(x), is_product: false, term },
                Term::Product(x, y) => Timed { ready: self.ready(x).max(self.ready(y)), is_product: true, term },
            });
        }
        // Stable: equal times keep the order of the sweep.
        timed.sort_by_key(|t| (t.ready, t.is_product));
        let best = (1..=CHAINS.min(timed.len())).map(|k| plan(&timed, k)).min_by_key(|p| p.cost);
        match best {
            Some(best) => self.build(&timed, &best),
            None => Expr::Const(0.0),
        }
    }

    fn build(&mut self, timed: &[Timed<'g>], plan: &Plan) -> Expr<'g> {
        let mut chains: Vec<Option<Expr<'g>>> = vec![None; plan.chains];
        for (t, &k) in timed.iter().zip(&plan.places) {
            chains[k] = Some(match (chains[k], t.term) {
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

/// Terms shared out to chains.
struct Plan {
    /// Cycles, and what the operations are worth.
    cost: u32,
    chains: usize,
    /// The chain of each term.
    places: Vec<usize>,
}

/// Each term goes to the chain that is free first.
fn plan(timed: &[Timed], chains: usize) -> Plan {
    let mut free: Vec<u32> = Vec::with_capacity(chains);
    let mut places = Vec::with_capacity(timed.len());
    let mut operations = 0;
    for t in timed {
        if free.len() < chains {
            places.push(free.len());
            free.push(t.ready + if t.is_product { PRODUCT } else { 0 });
            operations += u32::from(t.is_product);
            continue;
        }
        let (k, at) = free.iter().copied().enumerate().min_by_key(|(_, at)| *at).unwrap_or((0, 0));
        free[k] = at.max(t.ready) + if t.is_product { PRODUCT } else { SUM };
        operations += 1;
        places.push(k);
    }
    while free.len() > 1 {
        free.sort_unstable();
        let joined = free[1] + SUM;
        free.drain(..2);
        free.push(joined);
        operations += 1;
    }
    Plan { cost: free.first().copied().unwrap_or(0) + WORTH * operations, chains, places }
}
