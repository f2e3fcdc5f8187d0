//! Order conditions, from rooted trees (J. C. Butcher; Hairer, Nørsett, Wanner, section II.2), in double-double
//! numbers.

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
    /// Instead of `a` for a branch that is alone: with the Jacobian's part, in Rosenbrock methods.
    alone: Option<Vec<Vec<Number>>>,
    c: Vec<Number>,
}

fn numbers(list: &[Constant]) -> Vec<Number> {
    list.iter().map(|x| x.get()).collect()
}

impl Stages {
    fn new<const S: usize>(t: &Tableau<S>) -> Self {
        let a = t.a.iter().map(|row| numbers(row)).collect();
        let mut stages = Stages { a, alone: None, c: numbers(&t.c) };
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
        for tree in trees {
            let matrix = match &self.alone {
                Some(alone) if tree.branches.len() == 1 => alone,
                _ => &self.a,
            };
            let product = |row: &Vec<Number>| {
                tree.branches.iter().fold(Number::one(), |product, k| product * dot(row, &weights[*k]))
            };
            let weight = matrix.iter().map(product).collect();
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

/// Coefficients of 1, θ, θ², … of the weight of a rate: of the cubic, which has weights `b`, and of what is added to
/// it.
fn powers(b: Number, at: [bool; 2], bend: &[Constant]) -> Vec<Number> {
    let number = |x: f64| Number::constant(x);
    let times = |p: &[Number], q: &[f64]| {
        let mut product = vec![Number::zero(); p.len() + q.len() - 1];
        for (i, x) in p.iter().enumerate() {
            for (j, y) in q.iter().enumerate() {
                product[i + j] = product[i + j] + *x * number(*y);
            }
        }
        product
    };
    let mut sum = vec![Number::zero(); 4 + bend.len().max(1)];
    let mut add = |p: &[Number]| p.iter().enumerate().for_each(|(k, x)| sum[k] = sum[k] + *x);
    add(&times(&[b], &[0.0, 0.0, 3.0, -2.0]));
    add(&times(&[number(f64::from(at[0]))], &[0.0, 1.0, -2.0, 1.0]));
    add(&times(&[number(f64::from(at[1]))], &[0.0, 0.0, -1.0, 1.0]));
    let mut basis = vec![0.0, 0.0, 1.0, -2.0, 1.0];
    for c in bend {
        add(&times(&[c.get()], &basis));
        let next = times(&basis.iter().map(|x| number(*x)).collect::<Vec<Number>>(), &[-0.5, 1.0]);
        basis = next.iter().map(|x| x.to_f64()).collect();
    }
    sum
}

/// Order of the points within a step; their value at the end.
fn check_dense<const S: usize>(t: &Tableau<S>, dense: &Dense, trees: &[Tree], phi: &[Vec<Number>]) {
    let end = if t.fsal { S - 1 } else { S };
    let count = end + 1 + dense.c.len();
    assert_eq!(dense.bend.len(), count, "{}: weights", t.name);
    for (k, row) in dense.a.iter().enumerate() {
        assert_eq!(row.len(), end + 1 + k, "{}: row of extra stage {k}", t.name);
    }
    let b = |i: usize| t.b.get(i).map_or(Number::zero(), |x| x.get());
    let weights: Vec<Vec<Number>> = (0..count).map(|i| powers(b(i), [i == 0, i == end], dense.bend[i])).collect();
    let highest = weights.iter().map(|w| w.len()).max().unwrap();
    let of_power = |m: usize| weights.iter().map(|w| w.get(m).map_or(Number::zero(), |x| *x)).collect();
    let columns: Vec<Vec<Number>> = (0..highest).map(of_power).collect();
    let one_off = |order: u32, m: usize| miss(trees, phi, order, &columns[m], f64::from(m as u32 == order));
    for order in 1..=dense.order {
        let miss = (0..highest).map(|m| one_off(order, m)).fold(0.0, f64::max);
        assert!(miss < EXACT, "{}: dense output misses order {order} by {miss:e}", t.name);
    }
    let miss = (0..highest).map(|m| one_off(dense.order + 1, m)).fold(0.0, f64::max);
    assert!(miss > MISSED, "{}: dense output of higher order", t.name);
    // What is added to the cubic, in doubles: good to their rounding, and none of it at the ends.
    for i in 0..count {
        for theta in [0.0, 0.125, 0.5, 0.75, 1.0] {
            let cubic = powers(b(i), [i == 0, i == end], &[]);
            let value = |p: &[Number]| p.iter().rev().fold(Number::zero(), |v, c| v * Number::constant(theta) + *c);
            let exact = (value(&weights[i]) - value(&cubic)).to_f64();
            let miss = (dense.weight(i, theta) - exact).abs();
            assert!(miss < 2e-15, "{}: weight {i} at {theta} is off by {miss:e}", t.name);
        }
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
    check(&DORMAND_PRINCE, &[4]);
    check(&CASH_KARP, &[4]);
    check(&TSIT5, &[4]);
    check(&VERNER9, &[8]);
    check(&DOP853, &[5, 3]);
}

#[test]
fn coefficients_are_the_published_ones() {
    // Digits that polishing must not have moved: as doubles they are those of the programs named.
    assert_eq!(DOP853.a[11][10].hi(), 0.643_392_746_015_763_6);
    assert_eq!(DOP853.b[7].hi(), -5.801_203_960_010_585);
    assert_eq!(DOP853.dense.unwrap().a[2][14].hi(), -9.150_958_472_179_87);
    assert_eq!(TSIT5.a[4][3].hi(), -0.092_495_066_361_755_25);
    assert_eq!(VERNER9.a[15][8].hi(), -3.442_515_027_624_453_6);
}

/// Butcher's simplifying assumptions B(order), C(stages), D(rest): they make the order (E. Hairer, G. Wanner, Solving
/// Ordinary Differential Equations II, theorem IV.5.1).
fn check_collocation<const S: usize>(t: &Collocation<S>) {
    let (a, b, c) = (t.a.map(|row| numbers(&row)), numbers(&t.b), numbers(&t.c));
    let power = |k: u32| c.iter().map(|x| (0..k).fold(Number::one(), |p, _| p * *x)).collect::<Vec<Number>>();
    let over = |x: Number, k: u32| x / Number::constant(f64::from(k));
    let quadrature = |k: u32| (dot(&b, &power(k - 1)) - over(Number::one(), k)).to_f64().abs();
    for k in 1..=t.order {
        assert!(quadrature(k) < 1e-30, "{}: B({k})", t.name);
    }
    assert!(quadrature(t.order + 1) > 1e-8, "{}: of higher order", t.name);
    for k in 1..=S as u32 {
        let misses = (0..S).map(|i| dot(&a[i], &power(k - 1)) - over(power(k)[i], k));
        assert!(largest(misses) < 1e-30, "{}: C({k})", t.name);
    }
    for k in 1..=t.order - S as u32 {
        let weighted: Vec<Number> = b.iter().zip(power(k - 1)).map(|(b, x)| *b * x).collect();
        let column = |j: usize| a.iter().map(|row| row[j]).collect::<Vec<Number>>();
        let misses = (0..S).map(|j| dot(&weighted, &column(j)) - over(b[j] * (Number::one() - power(k)[j]), k));
        assert!(largest(misses) < 1e-30, "{}: D({k})", t.name);
    }
    if t.order == 2 * S as u32 {
        let pairs = (0..S).flat_map(|i| (0..S).map(move |j| (i, j)));
        let misses = pairs.map(|(i, j)| b[i] * a[i][j] + b[j] * a[j][i] - b[i] * b[j]);
        assert!(largest(misses) < 1e-30, "{}: not symplectic", t.name);
    } else {
        assert_eq!(t.a[S - 1], t.b, "{}: the last stage is not the end", t.name);
    }
}

#[test]
fn collocation() {
    check_collocation(&IMPLICIT_MIDPOINT);
    check_collocation(&GAUSS4);
    check_collocation(&GAUSS6);
    check_collocation(&GAUSS12);
    check_collocation(&BACKWARD_EULER);
    check_collocation(&RADAU5);
}

/// `1 / ((1 / γ) - C)`: the weights of rates in the variables `u`, lower triangular.
fn gamma<const S: usize>(t: &Rosenbrock<S>) -> Vec<Vec<Number>> {
    let mut rows: Vec<Vec<Number>> = Vec::new();
    for i in 0..S {
        let unit = |j: usize| Number::constant(f64::from(i == j));
        let earlier = |j: usize| (0..i).fold(unit(j), |sum, k| sum + t.coupling[i][k].get::<Number>() * rows[k][j]);
        let row = (0..S).map(|j| earlier(j) * t.gamma.get()).collect();
        rows.push(row);
    }
    rows
}

/// The order conditions of Rosenbrock methods (Hairer, Wanner, theorem IV.7.3) in the usual variables.
#[test]
fn rosenbrock() {
    // Sixteen digits of numbers up to 147, in sums.
    const DIGITS: f64 = 1e-12;
    let t = &RODAS5P;
    let (trees, gamma) = (trees(t.order + 1), gamma(t));
    // Weights of the rates from weights of `u`.
    let rates = |u: &[Number]| -> Vec<Number> {
        let column = |j: usize| gamma.iter().map(|row| row[j]).collect::<Vec<Number>>();
        (0..u.len()).map(|j| dot(u, &column(j))).collect()
    };
    let a: Vec<Vec<Number>> = t.a.iter().map(|row| rates(&numbers(row))).collect();
    let sum = |x: &[Number], y: &[Number]| x.iter().zip(y).map(|(x, y)| *x + *y).collect::<Vec<Number>>();
    let alone = a.iter().zip(&gamma).map(|(x, y)| sum(x, y)).collect();
    let row_sums = |rows: &[Vec<Number>], sums: &[Constant]| {
        largest(rows.iter().zip(sums).map(|(row, s)| row.iter().fold(-s.get::<Number>(), |sum, x| sum + *x)))
    };
    assert!(row_sums(&a, &t.c) < DIGITS);
    assert!(row_sums(&gamma, &t.d) < DIGITS);

    let last = numbers(&t.a[7]);
    let mut whole = last.clone();
    whole[7] = Number::one();
    let phi = Stages { a, alone: Some(alone), c: numbers(&t.c) }.weights(&trees);
    for (u, order) in [(&whole, t.order), (&last, t.error_order)] {
        let b = rates(u);
        let worst = (1..=order).map(|n| miss(&trees, &phi, n, &b, 1.0)).fold(0.0, f64::max);
        assert!(worst < DIGITS, "order {order} misses by {worst:e}");
        assert!(miss(&trees, &phi, order + 1, &b, 1.0) > MISSED);
    }
    // Powers of θ in the formula of dense output.
    let zero = vec![Number::zero(); 8];
    let part = |m: usize| t.dense.get(m).map_or(zero.clone(), |row| numbers(row));
    for m in 0..4 {
        let minus: Vec<Number> = if m > 0 { part(m - 1).iter().map(|x| -*x).collect() } else { whole.clone() };
        let b = rates(&sum(&minus, &part(m)));
        let target = |order: u32| f64::from(m as u32 + 1 == order);
        let worst = (1..=t.dense_order).map(|n| miss(&trees, &phi, n, &b, target(n))).fold(0.0, f64::max);
        assert!(worst < DIGITS, "dense output misses power {} by {worst:e}", m + 1);
    }
}

/// On `y' = z y`: never growing on the left of the plane's axis, nothing left of what is infinitely stiff.
#[test]
fn rosenbrock_is_stable() {
    let t = &RODAS5P;
    let factor = |z: f64| {
        let mut u = [0.0; 8];
        for i in 0..8 {
            let part = |row: &[Constant; 8]| row.iter().zip(&u).map(|(x, u)| x.hi() * u).sum::<f64>();
            u[i] = (z * (1.0 + part(&t.a[i])) + part(&t.coupling[i])) / (1.0 / t.gamma.hi() - z);
        }
        1.0 + t.a[7].iter().zip(&u).map(|(x, u)| x.hi() * u).sum::<f64>() + u[7]
    };
    for k in -20..20 {
        let z = -2.0_f64.powi(k);
        assert!(factor(z).abs() < 1.0, "{z}");
    }
    assert!((factor(-0.01) - f64::exp(-0.01)).abs() < 1e-13);
    assert!(factor(-1e9).abs() < 1e-7);
}
