//! Takes common factors out of sums: `a·b + a·c` becomes `a·(b + c)`. Equal terms are
//! collected, and cancel where their signs differ: like bodies that move against each other, such as the fingers of a
//! gripper, have such terms.
//!
//! Only products that are used once are split into factors. Every factor that is taken out of `n` terms then saves `n −
//! 1` products, and nothing is computed twice. The factor that saves most is taken first; the sum in brackets is
//! treated in the same way.

use std::cell::Cell;
use std::collections::BTreeMap;

use super::rebuild::Rebuilt;
use super::terms::Opened;
use crate::symbolic::{Expr, Graph, Op, Operand, Program};

/// Takes common factors out of all sums, and collects equal terms if `collects` has a value: it is set if there are any.
pub fn factor(program: &Program, collects: Option<&Cell<bool>>) -> Program {
    let opened = Opened::new(program);
    let graph = Graph::default();
    let mut new = Rebuilt::new(&graph, program);
    for (id, op, label) in &program.steps {
        if opened.in_sum[*id as usize] && !matches!(op, Op::Mul(..)) {
            continue;
        }
        new.at(*label);
        let value = match op {
            Op::Add(..) | Op::Sub(..) => sum(&mut new, &opened, *op, collects),
            op => new.copy(*op),
        };
        new.set(*id, value);
    }
    new.finish(program)
}

/// A product with its sign.
#[derive(Clone, Debug)]
struct Term {
    minus: bool,
    factors: Vec<Operand>,
}

fn sum<'g>(new: &mut Rebuilt<'g>, opened: &Opened, op: Op, collects: Option<&Cell<bool>>) -> Expr<'g> {
    let mut terms: Vec<Term> = Vec::new();
    for (operand, minus) in opened.terms(op) {
        let mut term = Term { minus, factors: Vec::new() };
        for factor in opened.factors(operand) {
            let (factor, minus) = new.get(factor).split();
            term.minus ^= minus;
            term.factors.push(factor);
        }
        terms.push(term);
    }
    total(new.graph, terms, collects)
}

/// Counts equal products: those with different signs leave nothing, several with the same sign become a multiple.
fn collected(terms: Vec<Term>, any: &Cell<bool>) -> Vec<Term> {
    // The number of each product, and the first term with it.
    let mut found: BTreeMap<Vec<Operand>, (i32, usize)> = BTreeMap::new();
    for (k, term) in terms.iter().enumerate() {
        let mut product = term.factors.clone();
        product.sort_unstable();
        found.entry(product).or_insert((0, k)).0 += if term.minus { -1 } else { 1 };
    }
    if found.len() == terms.len() {
        return terms;
    }
    any.set(true);
    let mut firsts: Vec<(usize, i32)> = found.into_values().map(|(number, k)| (k, number)).collect();
    firsts.retain(|(_, number)| *number != 0);
    firsts.sort_unstable();
    let multiple = |(k, number): (usize, i32)| {
        let mut factors = terms[k].factors.clone();
        if number.abs() > 1 {
            factors.insert(0, Operand::Const(f64::from(number.abs()).to_bits()));
        }
        Term { minus: number < 0, factors }
    };
    firsts.into_iter().map(multiple).collect()
}

/// The value of a sum of products, factored.
fn total<'g>(graph: &'g Graph, mut terms: Vec<Term>, collects: Option<&Cell<bool>>) -> Expr<'g> {
    if let Some(any) = collects {
        terms = collected(terms, any);
    }
    while let Some(factor) = best(&terms) {
        let (with, without): (Vec<Term>, Vec<Term>) = terms.into_iter().partition(|t| t.factors.contains(&factor));
        let inner = with.into_iter().map(|mut t| {
            let at = t.factors.iter().position(|f| *f == factor).expect("it is there");
            t.factors.remove(at);
            t
        });
        let inner = total(graph, inner.collect(), collects);
        let (inner, minus) = inner.split();
        terms = without;
        terms.push(Term { minus, factors: vec![factor, inner] });
    }
    let values = terms.into_iter().map(|t| {
        let product = t.factors.iter().map(|&f| graph.expr(f)).reduce(|a, b| a * b).unwrap_or(Expr::Const(1.0));
        if t.minus {
            -product
        } else {
            product
        }
    });
    values.reduce(|a, b| a + b).unwrap_or(Expr::Const(0.0))
}

/// The factor that saves most products, if one saves any; among equals the oldest.
fn best(terms: &[Term]) -> Option<Operand> {
    // For each factor: the number of terms with it, and how many of them are products.
    let mut found: BTreeMap<Operand, (usize, usize)> = BTreeMap::new();
    for term in terms {
        for (k, factor) in term.factors.iter().enumerate() {
            if !term.factors[..k].contains(factor) {
                let (all, products) = found.entry(*factor).or_default();
                *all += 1;
                *products += usize::from(term.factors.len() > 1);
            }
        }
    }
    // The product with the bracket costs one.
    let gain = |(all, products): (usize, usize)| if all > 1 { products.saturating_sub(1) } else { 0 };
    let mut best: Option<(usize, Operand)> = None;
    for (factor, counts) in found {
        let gain = gain(counts);
        if gain > best.map_or(0, |b| b.0) {
            best = Some((gain, factor));
        }
    }
    best.map(|b| b.1)
}

#[cfg(test)]
mod tests {
    use super::super::random::{counts_never_grow, keeps_values};
    use super::*;

    /// Additions and multiplications of a factored expression of six inputs.
    fn factored(make: impl for<'g> Fn([Expr<'g>; 6]) -> Expr<'g>) -> (usize, usize) {
        let graph = Graph::default();
        let program = Program::new(&graph, &[make(std::array::from_fn(|k| graph.input(k)))]);
        let counts = factor(&program, Some(&Cell::new(false))).counts();
        (counts.additions, counts.multiplications)
    }

    #[test]
    fn common_factors_are_taken_out() {
        assert_eq!(factored(|[a, b, c, ..]| a * b - a * c), (1, 1));
        assert_eq!(factored(|[a, b, c, d, e, f]| a * b + c * d + a * e + f), (3, 2));
        assert_eq!(factored(|[a, b, c, d, ..]| a * c + a * d + b * c + b * d), (2, 1));
        assert_eq!(factored(|[a, b, c, ..]| a + a * b + a * c), (2, 1));
        let two = Expr::Const(2.5);
        assert_eq!(factored(|[a, b, ..]| two * a - two * b), (1, 1));
        assert_eq!(factored(|[a, b, ..]| two * a + Expr::Const(3.0) * a + b), (1, 1));
    }

    #[test]
    fn equal_terms_are_collected() {
        assert_eq!(factored(|[a, b, c, ..]| (a + b) - (a - c)), (1, 0));
        assert_eq!(factored(|[a, b, c, d, ..]| (a * b + c) - (b * a - d)), (1, 0));
        assert_eq!(factored(|[a, b, ..]| (a + b) - (b + a)), (0, 0));
        assert_eq!(factored(|[a, b, c, ..]| (a + b) - (c - a)), (2, 1));
    }

    #[test]
    fn what_saves_nothing_stays() {
        assert_eq!(factored(|[a, b, ..]| a + a * b), (1, 1));
        // The product is used twice; if it were split, it would be computed again.
        assert_eq!(factored(|[a, b, c, ..]| (a * b + a * c) / (a * b)), (1, 2));
    }

    #[test]
    fn values_stay() {
        keeps_values(|p| factor(p, None));
        keeps_values(|p| factor(p, Some(&Cell::new(false))));
    }

    #[test]
    fn counts_do_not_grow() {
        counts_never_grow(|p| factor(p, None));
        counts_never_grow(|p| factor(p, Some(&Cell::new(false))));
    }
}
