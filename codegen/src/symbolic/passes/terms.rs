//! Splits sums into terms and terms into factors.

use super::rebuild::{by_id, uses};
use crate::symbolic::{Op, Operand, Program};

/// The operations that can be split without computing anything twice.
pub struct Opened {
    /// Operations by node id.
    pub ops: Vec<Option<Op>>,
    /// Sums and products that are used once, by a sum.
    pub in_sum: Vec<bool>,
    /// Products that are used once, by a product.
    pub in_product: Vec<bool>,
}

impl Opened {
    pub fn new(program: &Program) -> Self {
        let (ops, uses) = (by_id(program), uses(program));
        let mut opened = Opened { in_sum: vec![false; ops.len()], in_product: vec![false; ops.len()], ops };
        for (_, op, _) in &program.steps {
            let once = |operand: Operand| match operand {
                Operand::Node(id) if uses[id as usize] == 1 => Some(id as usize),
                _ => None,
            };
            match *op {
                Op::Add(a, b) | Op::Sub(a, b) => {
                    for id in [a, b].into_iter().filter_map(once) {
                        opened.in_sum[id] = matches!(opened.ops[id], Some(Op::Add(..) | Op::Sub(..) | Op::Mul(..)));
                    }
                }
                Op::Mul(a, b) => {
                    for id in [a, b].into_iter().filter_map(once) {
                        opened.in_product[id] = matches!(opened.ops[id], Some(Op::Mul(..)));
                    }
                }
                _ => {}
            }
        }
        opened
    }

    /// The operation of an operand, if a sum may split it.
    pub fn summand(&self, operand: Operand) -> Option<Op> {
        match operand {
            Operand::Node(id) if self.in_sum.get(id as usize) == Some(&true) => self.ops[id as usize],
            _ => None,
        }
    }

    /// The terms of a sum, with inner sums split: operands with their signs, in order.
    pub fn terms(&self, op: Op) -> Vec<(Operand, bool)> {
        let (mut terms, mut open) = (Vec::new(), Vec::new());
        let mut next = Some((op, false));
        while let Some((op, minus)) = next {
            let (a, b, minus_b) = match op {
                Op::Add(a, b) => (a, b, minus),
                Op::Sub(a, b) => (a, b, !minus),
                _ => unreachable!("only sums are opened"),
            };
            for (operand, minus) in [(a, minus), (b, minus_b)] {
                match self.summand(operand) {
                    Some(sum @ (Op::Add(..) | Op::Sub(..))) => open.push((sum, minus)),
                    _ => terms.push((operand, minus)),
                }
            }
            next = open.pop();
        }
        terms
    }

    /// The factors of a term: those of its product if the sum may split it, otherwise the operand itself.
    pub fn factors(&self, operand: Operand) -> Vec<Operand> {
        match self.summand(operand) {
            Some(Op::Mul(a, b)) => self.factors_of_product(a, b),
            _ => vec![operand],
        }
    }

    /// The factors of the product of two operands.
    pub fn factors_of_product(&self, a: Operand, b: Operand) -> Vec<Operand> {
        let mut factors = Vec::new();
        self.add_factors(a, &mut factors);
        self.add_factors(b, &mut factors);
        factors
    }

    /// Adds the factors of an operand of a product.
    fn add_factors(&self, operand: Operand, factors: &mut Vec<Operand>) {
        match operand {
            Operand::Node(id) if self.in_product[id as usize] => {
                if let Some(Op::Mul(a, b)) = self.ops[id as usize] {
                    self.add_factors(a, factors);
                    self.add_factors(b, factors);
                }
            }
            operand => factors.push(operand),
        }
    }
}
