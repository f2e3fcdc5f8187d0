//! The order in which constraints are listed does not matter, even where their rows are nearly dependent.

use std::fmt::Write;

use mbd_codegen::model::{Model, Value};
use mbd_codegen::plan::{Plan, PlanBond};
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::search::{self, Wide};
use mbd_runtime::system::Real;
use mbd_runtime::{Accelerated, Constrained, Interpreter, System};

/// A chain of four bodies on revolute joints about changing axes, and couplings with given rows.
fn text(rows: &[[f64; 4]]) -> String {
    let mut text = String::from("name = \"coupled\"\n");
    for k in 0..4 {
        let (parent, axis) = (["ground", "b0", "b1", "b2"][k], [[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 1, 1]][k]);
        let _ = write!(
            text,
            "\n[[body]]\nname = \"b{k}\"\nmass = {}\ncom = [0.1, 0.02, 0.05]\ninertia = [0.01, 0.02, 0.025]\n\n[[joint]]\nname = \"j{k}\"\n\
             type = \"revolute\"\nparent = \"{parent}\"\nchild = \"b{k}\"\nxyz = [0.3, 0.1, 0]\naxis = {axis:?}\n",
            1.5 - 0.3 * k as f64
        );
    }
    for (k, row) in rows.iter().enumerate() {
        let bound: Vec<usize> = (0..4).filter(|&j| row[j] != 0.0).collect();
        let names: Vec<String> = bound.iter().map(|j| format!("j{j}")).collect();
        let ratios: Vec<f64> = bound.iter().map(|&j| row[j]).collect();
        let _ = write!(text, "\n[[coupling]]\nname = \"c{k}\"\njoints = {names:?}\nratios = {ratios:?}\n");
    }
    text
}

/// Number of states in which an order is judged, by the median of its errors: in one state rounding errors may cancel,
/// and one may be nearly singular.
const STATES: usize = 7;

/// Velocities that meet the constraints, accelerations, and the number of independent rows, in one of the states.
fn motion<S: Real>(plan: &Plan, state: usize) -> ([Vec<f64>; 2], usize) {
    let params: Vec<S> = plan.default_params().iter().map(|x| S::constant(*x)).collect();
    let gravity = plan.gravity(&plan.default_params()).map(S::constant);
    let mut y = Interpreter::<S>::new(plan.tree(&params), gravity);
    let numbers =
        |first: usize| (0..4).map(|k| S::constant((0.7 + 1.3 * (first + k + 8 * state) as f64).sin())).collect();
    let (q, mut p): (Vec<S>, Vec<S>) = (numbers(0), numbers(4));
    let (mut v, mut a, mut sigma) = (y.zero_momenta(), y.zero_momenta(), y.zero_rows());
    y.project_momenta(S::zero(), &q, &mut p, &mut v, &mut sigma);
    y.generalized_accelerations(&q, &v, &mut a);
    let (mut residual, mut dq, mut pivots) = (y.zero_rows(), y.zero_momenta(), y.zero_rows());
    y.position_correction(&q, &mut residual, &mut dq, &mut pivots);
    let rank = pivots.iter().filter(|pivot| pivot.to_f64() != 0.0).count();
    ([v, a].map(|x| x.iter().map(|x| x.to_f64()).collect()), rank)
}

/// Error of velocities and accelerations in doubles, relative to the largest of each, the median of all states; whether
/// three rows are independent in all of them.
fn error(rows: &[[f64; 4]], plan: impl Fn(&Model) -> Plan) -> (f64, bool) {
    let read = read::model("coupled.toml", &text(rows), &ImportOptions::default());
    let plan = plan(&read.unwrap_or_else(|e| panic!("{e}")).model);
    let largest = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| x.abs().max(m));
    let (mut errors, mut three) = (Vec::new(), true);
    for state in 0..STATES {
        let (found, rank) = motion::<f64>(&plan, state);
        let (exact, _) = motion::<Wide>(&plan, state);
        three &= rank == 3;
        let mut worst = 0.0_f64;
        for (found, exact) in found.iter().zip(&exact) {
            let off: Vec<f64> = found.iter().zip(exact).map(|(a, b)| a - b).collect();
            worst = worst.max(largest(&off) / largest(exact));
        }
        errors.push(worst);
    }
    errors.sort_by(f64::total_cmp);
    (errors[STATES / 2], three)
}

/// All orders of four rows.
fn orders() -> Vec<[usize; 4]> {
    let all = (0..256).map(|k| [k & 3, k >> 2 & 3, k >> 4 & 3, k >> 6]);
    all.filter(|order| (0..4).all(|k| order.contains(&k))).collect()
}

/// Rows `a, a + δ u, u, w`, of which three are independent.
fn rows(a: [f64; 4], u: [f64; 4], w: [f64; 4], delta: f64) -> [[f64; 4]; 4] {
    [a, std::array::from_fn(|k| a[k] + delta * u[k]), u, w]
}

/// Errors of the rows in all orders, and whether three of them are independent in all of them.
fn errors(rows: &[[f64; 4]; 4], plan: impl Fn(&Model, &[[f64; 4]]) -> Plan) -> (Vec<f64>, bool) {
    let of = |order: [usize; 4]| {
        let listed = order.map(|k| rows[k]);
        error(&listed, |model| plan(model, &listed))
    };
    let all: Vec<(f64, bool)> = orders().into_iter().map(of).collect();
    (all.iter().map(|(error, _)| *error).collect(), all.iter().all(|(_, three)| *three))
}

fn extremes(errors: &[f64]) -> [f64; 2] {
    [f64::min, f64::max].map(|of| errors.iter().copied().reduce(of).expect("orders"))
}

fn any_order(plan: impl Fn(&Model) -> Plan + Copy, deltas: &[f64]) {
    let (a, u, w) = ([1.0, -2.0, 0.5, 0.3], [0.2, 1.0, -1.0, 0.7], [0.5, 0.1, 1.0, 1.0]);
    // In the second set `u` binds the outer joints alone, in the third it binds the inner ones.
    for u in [u, [0.0, 0.0, -1.0, 0.7], [0.6, -1.0, 0.0, 0.0]] {
        for &delta in deltas {
            let rows = rows(a, u, w, delta);
            let (errors, three) = errors(&rows, |model, _| plan(model));
            assert!(three, "{u:?}, {delta:e}");
            let [best, worst] = extremes(&errors);
            println!("u = {u:?}, δ = {delta:e}: errors between {best:.1e} and {worst:.1e}");
            assert!(worst <= 10.0 * best, "{u:?}, {delta:e}: {errors:?}");
        }
    }
}

#[test]
fn nearly_dependent_rows_may_come_in_any_order() {
    any_order(|model| Plan::new(model, 0.0), &[1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7]);
}

#[test]
fn and_with_the_elimination_that_is_searched() {
    any_order(|model| search::plan(model, Default::default()), &[1e-4]);
}

/// The order is chosen once, at the start and near it. Where rows become nearly dependent far from there, a bad order
/// loses digits: errors are bounded by `1e5 ε/δ²` until a row is left out, and any order is as good as another from there
/// on. Of 8,064 states with random rows and δ from 1e-2 to 6e-5 the worst erred by `2e4 ε/δ²`.
#[test]
fn rows_that_become_nearly_dependent_later_lose_a_bounded_number_of_digits() {
    let (a, u, w) = ([1.0, -2.0, 0.5, 0.3], [0.2, 1.0, -1.0, 0.7], [0.5, 0.1, 1.0, 1.0]);
    // The plan is made for other ratios, of which none is zero, and these are put in their places.
    let later = |delta: f64| {
        let far = rows(a, u, w, 0.25);
        let near = rows(a, u, w, delta);
        errors(&far, |model, listed| {
            let mut plan = Plan::new(model, 0.0);
            for (constraint, row) in plan.constraints.iter_mut().zip(listed) {
                let row = far.iter().position(|far| far == row).map_or(*row, |k| near[k]);
                if let PlanBond::Coupling { terms, .. } = &mut constraint.bond {
                    terms.iter_mut().zip(row).for_each(|(term, ratio)| term.1 = Value::Const(ratio));
                }
            }
            plan
        })
    };
    for delta in [1e-2, 1e-3, 1e-4] {
        let [best, worst] = extremes(&later(delta).0);
        println!("δ = {delta:e}: errors between {best:.1e} and {worst:.1e}");
        assert!(worst <= 1e5 * f64::EPSILON / (delta * delta), "{delta:e}: {worst:e}");
    }
    for delta in [1e-5, 1e-6, 1e-7] {
        let (errors, three) = later(delta);
        let [best, worst] = extremes(&errors);
        assert!(three && worst <= 10.0 * best, "{delta:e}: {errors:?}");
    }
}
