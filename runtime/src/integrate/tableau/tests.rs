//! Order conditions, from rooted trees (J. C. Butcher; Hairer, Nørsett, Wanner, section II.2), in double-double numbers.

extern crate std;

use std::{vec, vec::Vec};

use super::*;
use crate::wide::Wide;
use crate::Real;

/// Residuals below are those of coefficients of 36 digits; of sums in numbers of 106 bits over terms of at most 1e4.
const EXACT: f64 = 1e-26;
/// What is not of an order misses its conditions by more.
const MISSED: f64 = 1e-6;

/// A rooted tree: its order, its density γ, the trees at its root by index.
struct Tree {
    order: u32,
    density: f64,
    branches: Vec<usize>,
}

/// All up to an order, by order.
fn trees(largest: u32) -> Vec<Tree> {
    /// Trees up to an index, as many as give an order together.
    fn branchings(known: &[Tree], order: u32, last: usize, taken: &mut Vec<usize>, out: &mut Vec<Vec<usize>>) {
        if order == 0 {
            out.push(taken.clone());
        }
        for k in 0..last {
            if known[k].order <= order {
                taken.push(k);
                branchings(known, order - known[k].order, k + 1, taken, out);
                taken.pop();
            }
        }
    }
    let mut known = Vec::new();
    for order in 1..=largest {
        let mut new = Vec::new();
        branchings(&known, order - 1, known.len(), &mut Vec::new(), &mut new);
        let density = |branches: &[usize]| branches.iter().fold(f64::from(order), |d, k| d * known[*k].density);
        let new: Vec<Tree> = new.into_iter().map(|b| Tree { order, density: density(&b), branches: b }).collect();
        known.extend(new);
    }
    known
}

type Number = Wide;

/// A method with all its stages: those of the step, the rate at the end, those of the interpolant.
struct Stages {
    a: Vec<Vec<Number>>,
    c: Vec<Number>,
}

fn numbers(list: &[Constant]) -> Vec<Number> {
    list.iter().map(|x| x.get()).collect()
}

impl Stages {
    fn new<const S: usize>(t: &Tableau<S>) -> Self {
        let mut stages = Stages { a: t.a.iter().map(|row| numbers(row)).collect(), c: numbers(&t.c) };
        if let Some(dense) = t.dense {
            if !t.fsal {
                stages.a.push(numbers(&t.b));
                stages.c.push(Number::one());
            }
            stages.a.extend(dense.a.iter().map(|row| numbers(row)));
            stages.c.extend(numbers(dense.c));
        }
        stages
    }

    /// Elementary weights of every stage for every tree: products over branches of what the row makes of the branch.
    fn weights(&self, trees: &[Tree]) -> Vec<Vec<Number>> {
        let mut weights: Vec<Vec<Number>> = Vec::new();
        let mut branches: Vec<Vec<Number>> = Vec::new();
        for tree in trees {
            let product = |i: usize| tree.branches.iter().fold(Number::one(), |p, k| p * branches[*k][i]);
            let weight: Vec<Number> = (0..self.a.len()).map(product).collect();
            branches.push(self.a.iter().map(|row| dot(row, &weight)).collect());
            weights.push(weight);
        }
        weights
    }
}

fn dot(a: &[Number], b: &[Number]) -> Number {
    a.iter().zip(b).fold(Number::zero(), |sum, (x, y)| sum + *x * *y)
}

/// The largest of some numbers.
fn largest(list: impl Iterator<Item = Number>) -> f64 {
    list.map(|x| x.to_f64().abs()).fold(0.0, f64::max)
}

/// The largest miss of the conditions of one order, `Σ b Φ = target / γ`.
fn miss(trees: &[Tree], weights: &[Vec<Number>], order: u32, b: &[Number], target: f64) -> f64 {
    let of_order = trees.iter().zip(weights).filter(|(t, _)| t.order == order);
    largest(of_order.map(|(t, phi)| dot(b, phi) - Number::constant(target) / Number::constant(t.density)))
}

/// Everything a tableau says of itself. `rows` are the orders of its error estimators.
fn check<const S: usize>(t: &Tableau<S>, rows: &[u32]) {
    let (trees, stages) = (trees(t.order + 1), Stages::new(t));
    let sums = stages.a.iter().zip(&stages.c).map(|(row, c)| row.iter().fold(-*c, |sum, x| sum + *x));
    assert!(largest(sums) < EXACT, "{}: row sums", t.name);
    let square = t.a.iter().enumerate().flat_map(|(i, row)| &row[i..]);
    assert!(square.into_iter().all(|x| x.is_zero()), "{}: not explicit", t.name);

    let weights = stages.weights(&trees);
    let b = numbers(&t.b);
    for order in 1..=t.order {
        let miss = miss(&trees, &weights, order, &b, 1.0);
        assert!(miss < EXACT, "{}: order {order} misses by {miss:e}", t.name);
    }
    assert!(miss(&trees, &weights, t.order + 1, &b, 1.0) > MISSED, "{}: of higher order", t.name);

    assert_eq!(t.error.len(), rows.len());
    for (row, lower) in t.error.iter().zip(rows) {
        let row = numbers(row);
        for order in 1..=*lower {
            let miss = miss(&trees, &weights, order, &row, 0.0);
            assert!(miss < EXACT, "{}: estimate of order {lower} misses {order} by {miss:e}", t.name);
        }
        assert!(miss(&trees, &weights, lower + 1, &row, 0.0) > MISSED, "{}: no estimate", t.name);
    }
    if t.fsal {
        assert_eq!(t.a[S - 1], t.b, "{}: the last stage is not the end", t.name);
        assert_eq!(t.c[S - 1].hi(), 1.0);
    }
    if let Some(dense) = t.dense {
        check_dense(t, dense, &trees, &weights);
    }
}

/// Order of the points within a step; value and slope at its ends.
fn check_dense<const S: usize>(t: &Tableau<S>, dense: &Dense, trees: &[Tree], phi: &[Vec<Number>]) {
    let end = if t.fsal { S - 1 } else { S };
    let count = end + 1 + dense.c.len();
    assert_eq!(dense.weights.len(), count, "{}: weights", t.name);
    for (k, row) in dense.a.iter().enumerate() {
        assert_eq!(row.len(), end + 1 + k, "{}: row of extra stage {k}", t.name);
    }
    let powers = dense.weights.iter().map(|w| w.len()).max().unwrap();
    let of_power = |m: usize| dense.weights.iter().map(|w| w.get(m).map_or(Number::zero(), |x| x.get())).collect();
    let columns: Vec<Vec<Number>> = (0..powers).map(of_power).collect();
    let one_off = |order: u32, m: usize| miss(trees, phi, order, &columns[m], f64::from(m as u32 + 1 == order));
    for order in 1..=dense.order {
        let miss = (0..powers).map(|m| one_off(order, m)).fold(0.0, f64::max);
        assert!(miss < EXACT, "{}: dense output misses order {order} by {miss:e}", t.name);
    }
    if dense.order < t.order {
        let miss = (0..powers).map(|m| one_off(dense.order + 1, m)).fold(0.0, f64::max);
        assert!(miss > MISSED, "{}: dense output of higher order", t.name);
    }
    for i in 0..count {
        let b = t.b.get(i).map_or(Number::zero(), |x| x.get());
        let value = dense.weight(i, Number::one()) - b;
        let coefficient = |m: usize| columns[m][i];
        let slope_start = coefficient(0) - Number::constant(f64::from(i == 0));
        let slope_end = (0..powers).fold(-Number::constant(f64::from(i == end)), |sum, m| {
            sum + Number::constant((m + 1) as f64) * coefficient(m)
        });
        let miss = largest([value, slope_start, slope_end].into_iter());
        assert!(miss < EXACT, "{}: weight {i} at the ends, {miss:e}", t.name);
        assert_eq!(dense.weight(i, 0.0), 0.0);
    }
}

#[test]
fn trees_are_counted() {
    let trees = trees(10);
    let count = |order| trees.iter().filter(|t| t.order == order).count();
    let counts: Vec<usize> = (1..=10).map(count).collect();
    assert_eq!(counts, vec![1, 1, 2, 4, 9, 20, 48, 115, 286, 719]);
}

#[test]
fn low_orders() {
    check(&EULER, &[]);
    check(&MIDPOINT, &[]);
    check(&RK4, &[]);
}

#[test]
fn pairs() {
    check(&RKF45, &[4]);
    check(&CASH_KARP, &[4]);
    check(&TSIT5, &[4]);
    check(&VERNER9, &[8]);
    check(&DOP853, &[5, 3]);
}

#[test]
fn coefficients_are_the_published_ones() {
    // Digits that polishing must not have moved: as doubles they are those of the programs named.
    assert_eq!(DOP853.a[11][10].hi(), 6.43392746015763530355970484046e-1);
    assert_eq!(DOP853.b[7].hi(), -5.8012039600105847814672114227);
    assert_eq!(DOP853.dense.unwrap().a[2][14].hi(), -9.15095847217987001081870187138);
    assert_eq!(TSIT5.a[4][3].hi(), -0.09249506636175525);
    assert_eq!(VERNER9.a[15][8].hi(), -3.442515027624453437985);
}
