//! Adds pairs of terms that several sums have in common only once.
//!
//! Binary sums hide such pairs: `(a + b) + c` and `(a + c) + d` share `a + c`. Sums that are used once, by a sum, are
//! therefore split into terms. The pair that most sums contain is taken first. A pair in `n` sums saves `n − 1`
//! additions.

use std::collections::{BTreeMap, BTreeSet};

use super::rebuild::Rebuilt;
use super::terms::Opened;
use crate::symbolic::{Expr, Graph, Op, Operand, Program};

/// Two terms in order, and whether their signs differ.
type Pair = (Operand, Operand, bool);

/// Sums with more terms than this are not changed, because they have too many pairs.
const LONGEST: usize = 64;

/// Shares common pairs.
pub fn share(program: &Program) -> Program {
    let opened = Opened::new(program);
    let roots = |(id, op, _): &&(u32, Op, _)| !opened.in_sum[*id as usize] && matches!(op, Op::Add(..) | Op::Sub(..));
    let mut sums: BTreeMap<u32, Vec<(Operand, bool)>> =
        program.steps.iter().filter(roots).map(|(id, op, _)| (*id, opened.terms(*op))).collect();
    let pairs = choose(&opened, &mut sums, program.width() as u32);
    build(program, &opened, &sums, &pairs)
}

/// Takes common pairs out of the sums; each becomes an operand with an id of its own, from `next` on.
fn choose(opened: &Opened, sums: &mut BTreeMap<u32, Vec<(Operand, bool)>>, next: u32) -> Vec<Pair> {
    let mut places: BTreeMap<Pair, BTreeSet<u32>> = BTreeMap::new();
    for (id, terms) in sums.iter() {
        for pair in pairs_of(opened, terms) {
            places.entry(pair).or_default().insert(*id);
        }
    }
    places.retain(|_, at| at.len() > 1);
    let mut chosen = Vec::new();
    // The most frequent pair comes first. Counts only decrease, except for pairs with a new operand; later rounds find
    // these.
    let mut queue: Vec<(usize, Pair)> = places.iter().map(|(pair, at)| (at.len(), *pair)).collect();
    queue.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    for (_, pair) in queue {
        let has = |terms: &[(Operand, bool)]| pairs_of(opened, terms).any(|p| p == pair);
        let at: Vec<u32> = places[&pair].iter().copied().filter(|id| has(&sums[id])).collect();
        // A sum that consists of the pair alone is not changed, and the other sums use it.
        if at.len() < 2 {
            continue;
        }
        let operand = Operand::Node(next + chosen.len() as u32);
        chosen.push(pair);
        for id in at {
            let Some(terms) = sums.get_mut(&id) else { continue };
            let Some((a, b)) = places_of(terms, pair) else { continue };
            let minus = terms[a].1;
            terms[a] = (operand, minus);
            terms.remove(b);
        }
    }
    chosen
}

/// Positions of the members of a pair in a sum. A sum may contain a term twice, with either sign.
fn places_of(terms: &[(Operand, bool)], pair: Pair) -> Option<(usize, usize)> {
    let of = |o: Operand| (0..terms.len()).filter(move |&k| terms[k].0 == o);
    of(pair.0).flat_map(|a| of(pair.1).map(move |b| (a, b))).find(|&(a, b)| (terms[a].1 != terms[b].1) == pair.2)
}

/// The pairs of one sum whose members may also occur in other sums.
fn pairs_of<'a>(opened: &'a Opened, terms: &'a [(Operand, bool)]) -> impl Iterator<Item = Pair> + 'a {
    let terms = if terms.len() > LONGEST { &[] } else { terms };
    let shared = |o: Operand| opened.summand(o).is_none();
    terms.iter().enumerate().flat_map(move |(k, a)| {
        terms[..k].iter().filter(move |b| shared(a.0) && shared(b.0) && a.0 != b.0).map(move |b| {
            let (x, y) = if a.0 < b.0 { (a, b) } else { (b, a) };
            (x.0, y.0, x.1 != y.1)
        })
    })
}

fn build(program: &Program, opened: &Opened, sums: &BTreeMap<u32, Vec<(Operand, bool)>>, pairs: &[Pair]) -> Program {
    let graph = Graph::default();
    let mut new = Rebuilt::new(&graph, program);
    let first = program.width() as u32;
    for (id, op, label) in &program.steps {
        if opened.in_sum[*id as usize] && !matches!(op, Op::Mul(..)) {
            continue;
        }
        new.at(*label);
        let value = match sums.get(id) {
            Some(terms) => {
                let signed = |&(operand, minus): &(Operand, bool)| {
                    let x = expression(&new, pairs, first, operand);
                    if minus {
                        -x
                    } else {
                        x
                    }
                };
                terms.iter().map(signed).reduce(|a, b| a + b).unwrap_or(Expr::Const(0.0))
            }
            None => new.copy(*op),
        };
        new.set(*id, value);
    }
    new.finish(program)
}

/// An operand of the old program, or a pair.
fn expression<'g>(new: &Rebuilt<'g>, pairs: &[Pair], first: u32, operand: Operand) -> Expr<'g> {
    match operand {
        Operand::Node(id) if id >= first => {
            let (a, b, differ) = pairs[(id - first) as usize];
            let (a, b) = (expression(new, pairs, first, a), expression(new, pairs, first, b));
            if differ {
                a - b
            } else {
                a + b
            }
        }
        operand => new.get(operand),
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{counts_never_grow, keeps_values};
    use super::*;

    #[test]
    fn common_pairs_are_added_once() {
        let graph = Graph::default();
        let [a, b, c, d] = std::array::from_fn(|k| graph.input(k));
        let program = Program::new(&graph, &[(a + b) + c, (a + d) + b, d - (a + b)]);
        assert_eq!(program.counts().additions, 5);
        assert_eq!(share(&program).counts().additions, 4);
        // a − b and b − a are one pair, with different signs.
        let program = Program::new(&graph, &[(a + c) - b, (b + d) - a]);
        assert_eq!(share(&program).counts().additions, 3);
    }

    #[test]
    fn a_term_may_stand_twice_with_either_sign() {
        let graph = Graph::default();
        let [a, b, c, d] = std::array::from_fn(|k| graph.input(k));
        let program = Program::new(&graph, &[(a + b) + (c - a), (b - a) + d]);
        let run = |p: &Program| p.evaluate(&[1.0, 2.0, 4.0, 8.0], |a: f64, b: f64, c: f64| a * b + c);
        assert_eq!(run(&program), [6.0, 9.0]);
        assert_eq!(run(&share(&program)), [6.0, 9.0]);
    }

    #[test]
    fn one_operand_may_have_both_signs() {
        let graph = Graph::default();
        let [a, b, c, d] = std::array::from_fn(|k| graph.input(k));
        let both = ((a + c) - a) + b;
        for others in [[(d - a) + b, (b - a) + c], [(d + a) + b, (b + a) + c]] {
            let program = Program::new(&graph, &[both, others[0], others[1]]);
            let value = |p: &Program| p.evaluate(&[1.0, 20.0, 300.0, 4000.0], |a: f64, b: f64, c: f64| a * b + c);
            assert_eq!(value(&share(&program)), value(&program));
        }
    }

    #[test]
    fn values_stay() {
        keeps_values(share);
    }

    #[test]
    fn counts_do_not_grow() {
        counts_never_grow(share);
    }
}
