//! Random programs for the tests of the passes.

use crate::symbolic::{Expr, Graph, Program};

/// Inputs of a random program.
pub const INPUTS: usize = 6;

/// Pseudo-random numbers, the same for the same seed.
pub struct Rng(u64);

impl Rng {
    pub fn new(seed: u64) -> Rng {
        Rng(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    pub fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % n
    }

    /// A small integer that is not zero.
    pub fn inputs(&mut self) -> [f64; INPUTS] {
        std::array::from_fn(|_| [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0][self.below(6)])
    }
}

/// A value, and an upper bound of the sum of the magnitudes of its terms in every order of evaluation.
#[derive(Clone, Copy)]
struct Made<'g> {
    value: Expr<'g>,
    most: f64,
}

/// A program of sums and products of integers. In every order of evaluation all numbers are small enough to be exact,
/// so that a pass must give exactly the same values.
pub fn integer_program(seed: u64, operations: usize) -> Program {
    let mut rng = Rng::new(seed);
    let graph = Graph::default();
    let mut pool: Vec<Made> = (0..INPUTS).map(|k| Made { value: graph.input(k), most: 3.0 }).collect();
    for c in [1.0, 2.0, -3.0, 5.0] {
        pool.push(Made { value: Expr::Const(c), most: 5.0 });
    }
    while pool.len() < INPUTS + 4 + operations {
        // Recent values are chosen more often, so that programs get deep.
        let mut pick = || {
            let recent = pool.len().min(12);
            if rng.below(3) > 0 {
                pool[pool.len() - 1 - rng.below(recent)]
            } else {
                pool[rng.below(pool.len())]
            }
        };
        let (a, b) = (pick(), pick());
        let made = match rng.below(5) {
            0 | 1 => Made { value: a.value * b.value, most: a.most * b.most },
            2 | 3 => Made { value: a.value + b.value, most: a.most + b.most },
            _ => Made { value: a.value - b.value, most: a.most + b.most },
        };
        // 2^49 leaves room for the products that factoring may form in another order.
        if made.most < 5e14 {
            pool.push(made);
        } else {
            pool.push(Made { value: graph.input(rng.below(INPUTS)), most: 3.0 });
        }
    }
    let outputs: Vec<Expr> = pool.iter().rev().step_by(3).take(12).map(|m| m.value).collect();
    Program::new(&graph, &outputs)
}

/// A well-conditioned program with every kind of operation: sums of positive numbers near one, averaged so that they
/// stay there. In every order, the errors of its results are a few roundings for each operation.
pub fn real_program(seed: u64, operations: usize) -> Program {
    use mbd_runtime::Scalar;
    let mut rng = Rng::new(seed);
    let graph = Graph::default();
    let mut pool: Vec<Expr> = (0..INPUTS).map(|k| graph.input(k).sin_cos().1 + Expr::Const(2.0)).collect();
    while pool.len() < operations {
        let (a, b) = (pool[rng.below(pool.len())], pool[pool.len() - 1 - rng.below(pool.len().min(9))]);
        let made = match rng.below(8) {
            // Pivots that are kept and pivots that are dropped: all values are positive, and the floor is well below or
            // well above them.
            6 => (a * b).reciprocal_above(Expr::Const(0.1) * a * b) + Expr::Const(1.0),
            7 => (b - a - b).reciprocal_above(b) + a,
            0 => a / b + Expr::Const(1.0),
            1 => (a * b).sqrt(),
            2 => Expr::Const(0.25) * (a * a + b * b) / (a + b),
            3 => Expr::Const(0.3) * a + Expr::Const(0.7) * b,
            4 => (a * b + a) / (b + Expr::Const(1.5)),
            _ => (a + b) * Expr::Const(0.5),
        };
        pool.push(made);
    }
    let outputs: Vec<Expr> = pool.iter().rev().step_by(2).take(10).copied().collect();
    Program::new(&graph, &outputs)
}

/// Asserts that a pass keeps the values of random programs: exactly for integers, to rounding for others.
pub fn keeps_values(pass: impl Fn(&Program) -> Program) {
    let fused = |a: f64, b: f64, c: f64| a.mul_add(b, c);
    for seed in 0..200 {
        let old = integer_program(seed, 10 + seed as usize % 150);
        let new = pass(&old);
        in_order(&new);
        let inputs = Rng::new(seed + 1000).inputs();
        let (a, b) = (old.evaluate(&inputs, fused), new.evaluate(&inputs, fused));
        for (a, b) in a.iter().zip(&b) {
            assert!(a == b, "seed {seed}: {a} became {b}");
        }
    }
    for seed in 0..50 {
        let old = real_program(seed, 20 + seed as usize);
        let new = pass(&old);
        in_order(&new);
        let inputs = Rng::new(seed + 2000).inputs();
        let (a, b) = (old.evaluate(&inputs, fused), new.evaluate(&inputs, fused));
        for (a, b) in a.iter().zip(&b) {
            // Some hundred roundings of 1.1e-16 each, of positive numbers.
            assert!((a - b).abs() <= 1e-13 * a.abs(), "seed {seed}: {a:e} became {b:e}");
        }
    }
}

/// Asserts that a pass never makes a program more expensive.
pub fn counts_never_grow(pass: impl Fn(&Program) -> Program) {
    for seed in 0..200 {
        let old = integer_program(seed, 10 + seed as usize % 150);
        let (before, after) = (old.counts().total(), pass(&old).counts().total());
        assert!(after <= before, "seed {seed}: {before} operations became {after}");
    }
}

/// Asserts that operands come before their use and that ids are unique.
fn in_order(program: &Program) {
    let mut seen = std::collections::BTreeSet::new();
    for (id, op, _) in &program.steps {
        for operand in op.operands() {
            if let crate::symbolic::Operand::Node(k) = operand {
                assert!(seen.contains(&k), "{k} is used before it is computed");
            }
        }
        assert!(seen.insert(*id), "{id} is computed twice");
    }
}
