//! Collects constant factors: `c·(d·x)` becomes `(c·d)·x`, even where `d·x` is needed elsewhere too. The number of
//! operations does not grow, and the critical path has one product less. Doubles that no sum can fuse become sums, which
//! take less time.

use super::rebuild::{uses, Rebuilt};
use super::terms::Opened;
use crate::symbolic::{Expr, Graph, Op, Operand, Program};

/// Collects the constant factors of products.
pub fn gather(program: &Program) -> Program {
    let graph = Graph::default();
    let mut new = Rebuilt::new(&graph, program);
    for (id, op, label) in &program.steps {
        new.at(*label);
        let value = match *op {
            Op::Mul(a, b) => product(&new, a, b),
            op => new.copy(op),
        };
        new.set(*id, value);
    }
    doubled(&new.finish(program))
}

/// `2·x` as `x + x` outside sums, unless `x` is a part of it that regrouping may split.
fn doubled(program: &Program) -> Program {
    let (graph, opened, uses) = (Graph::default(), Opened::new(program), uses(program));
    let mut new = Rebuilt::new(&graph, program);
    for (id, op, label) in &program.steps {
        new.at(*label);
        let value = match *op {
            Op::Mul(Operand::Const(bits), Operand::Node(x))
                if f64::from_bits(bits) == 2.0 && !opened.in_sum[*id as usize] && uses[x as usize] > 1 =>
            {
                let x = new.get(Operand::Node(x));
                x + x
            }
            op => new.copy(op),
        };
        new.set(*id, value);
    }
    new.finish(program)
}

fn product<'g>(new: &Rebuilt<'g>, a: Operand, b: Operand) -> Expr<'g> {
    let plain = (new.get(a), new.get(b));
    let (Expr::Const(c), Expr::Node { graph, id, neg }) = plain else { return plain.0 * plain.1 };
    let (Op::Mul(Operand::Const(bits), x), _) = graph.get(id) else { return plain.0 * plain.1 };
    let c = c * f64::from_bits(bits);
    graph.expr(x) * Expr::Const(if neg { -c } else { c })
}

#[cfg(test)]
mod tests {
    use super::super::random::{counts_never_grow, keeps_values};
    use super::*;

    #[test]
    fn constants_meet() {
        let graph = Graph::default();
        let c = Expr::Const;
        let y = c(2.5) * graph.input(0);
        let program = Program::new(&graph, &[y, c(4.0) * -y, c(0.4) * y]);
        let gathered = gather(&program);
        assert_eq!(gathered.counts().multiplications, 2);
        assert_eq!(gathered.evaluate(&[3.0], |a: f64, b: f64, c: f64| a * b + c), [7.5, -30.0, 3.0]);
    }

    #[test]
    fn doubles_are_sums_where_nothing_fuses_them() {
        let graph = Graph::default();
        let x = graph.input(0) * graph.input(1);
        let double = Expr::Const(2.0) * x;
        let gathered = gather(&Program::new(&graph, &[x, double * graph.input(1), Expr::Const(0.7) * double]));
        assert_eq!((gathered.counts().additions, gathered.counts().multiplications), (1, 3));
    }

    #[test]
    fn values_stay() {
        keeps_values(gather);
    }

    #[test]
    fn counts_do_not_grow() {
        counts_never_grow(gather);
    }
}
