//! The solver against conditions that its results must meet.

use nalgebra::{Matrix1, Matrix2, RowVector2, SMatrix, Vector2};

use super::box_minimum::box_minimum;
use super::ilqr::{Ilqr, Problem, Progress};
use super::steps::Dynamics;
use super::velocities::Velocities;
use super::{swing_up, ur5};

/// A mass on a track in steps of 0.1 s: a linear system.
struct Mass;

const A: [[f64; 2]; 2] = [[1.0, 0.1], [0.0, 1.0]];
const B: [[f64; 1]; 2] = [[0.005], [0.1]];

impl Dynamics<f64, 2, 1> for Mass {
    fn step(&mut self, x: &[f64; 2], u: &[f64; 1]) -> [f64; 2] {
        [0, 1].map(|i| A[i][0] * x[0] + A[i][1] * x[1] + B[i][0] * u[0])
    }
    fn linearise(&mut self, _x: &[f64; 2], _u: &[f64; 1], a: &mut [[f64; 2]; 2], b: &mut [[f64; 1]; 2]) {
        (*a, *b) = (A, B);
    }
}

fn mass(bound: f64) -> Problem<f64, 2, 1> {
    Problem { goal: [0.0; 2], running: [1.0, 0.1], end: [10.0, 1.0], effort: [0.01], bounds: [[-bound], [bound]] }
}

#[test]
fn a_linear_problem_is_solved_in_one_iteration() {
    let problem = mass(1e9);
    let mut plan = Ilqr::<f64, 2, 1, 31>::new(&mut Mass, &problem, &[1.0, -0.5], &[0.0]);
    assert!(matches!(plan.iterate(&mut Mass, &problem), Progress::Improved(_)));
    let cost = plan.cost;
    // Riccati's recursion.
    let (a, b) = (Matrix2::from_fn(|i, j| A[i][j]), Vector2::from_fn(|i, _| B[i][0]));
    let mut value = Matrix2::from_diagonal(&Vector2::new(10.0, 1.0));
    for k in (0..30).rev() {
        let inner = b.transpose() * value * b + Matrix1::new(0.01);
        let gain: RowVector2<f64> = -(b.transpose() * value * a) / inner[0];
        for j in 0..2 {
            assert!((plan.gains[k][0][j] - gain[j]).abs() < 1e-12 * gain.norm(), "{k}");
        }
        value = Matrix2::from_diagonal(&Vector2::new(1.0, 0.1)) + a.transpose() * value * (a + b * gain);
    }
    let x = Vector2::new(1.0, -0.5);
    let best = 0.5 * (x.transpose() * value * x)[0];
    assert!((cost - best).abs() < 1e-12 * best, "{cost} {best}");
    assert_eq!(plan.iterate(&mut Mass, &problem), Progress::Converged);
}

/// The gradient of the cost with respect to the inputs is zero between the bounds, and points outwards on them.
#[test]
fn bounds_are_kept_and_pressed_against() {
    let problem = mass(1.0);
    let mut plan = Ilqr::<f64, 2, 1, 31>::new(&mut Mass, &problem, &[2.0, 0.0], &[0.0]);
    for _ in 0..60 {
        let before = plan.cost;
        if plan.iterate(&mut Mass, &problem) == Progress::Converged {
            break;
        }
        assert!(plan.cost <= before);
    }
    let weighted = |weights: &[f64; 2], x: &[f64; 2]| Vector2::new(weights[0] * x[0], weights[1] * x[1]);
    let (a, b) = (Matrix2::from_fn(|i, j| A[i][j]), Vector2::from_fn(|i, _| B[i][0]));
    let mut costate = weighted(&problem.end, &plan.x[30]);
    let mut pressed = 0;
    for k in (0..30).rev() {
        let u = plan.u[k][0];
        let gradient = 0.01 * u + b.dot(&costate);
        if u.abs() < 1.0 {
            assert!(gradient.abs() < 1e-6, "{k}: {gradient:e}");
        } else {
            assert!(u.abs() == 1.0 && gradient * u <= 0.0, "{k}: {gradient:e} {u}");
            pressed += 1;
        }
        costate = weighted(&problem.running, &plan.x[k]) + a.transpose() * costate;
    }
    assert!(pressed > 3, "{pressed}");
}

#[test]
fn minima_in_boxes_meet_their_conditions() {
    let mut random = fastrand::Rng::with_seed(3);
    let mut number = || 2.0 * random.f64() - 1.0;
    let mut held = 0;
    for _ in 0..2000 {
        let m = SMatrix::<f64, 6, 6>::from_fn(|_, _| number());
        let h = m * m.transpose() + SMatrix::identity() * 0.1;
        let h: [[f64; 6]; 6] = core::array::from_fn(|i| core::array::from_fn(|j| h[(i, j)]));
        let g: [f64; 6] = core::array::from_fn(|_| 2.0 * number());
        let bounds = [core::array::from_fn(|_| -number().abs()), core::array::from_fn(|_| number().abs())];
        let found = box_minimum(&h, &g, &bounds).expect("a positive definite matrix");
        for i in 0..6 {
            let (x, [low, high]) = (found.x[i], [bounds[0][i], bounds[1][i]]);
            let slope = (0..6).fold(g[i], |sum, j| sum + h[i][j] * found.x[j]);
            assert!(x >= low && x <= high);
            let ends = x == low && slope >= 0.0 || x == high && slope <= 0.0;
            assert!(ends || slope.abs() < 1e-9, "{x} in [{low}, {high}]: {slope:e}");
            held += u32::from(ends);
        }
    }
    assert!(held > 1000, "{held}");
}

#[test]
fn steps_have_exact_derivatives() {
    let mut random = fastrand::Rng::with_seed(5);
    let mut dynamics = ur5(0.01);
    let (mut a, mut b) = ([[0.0; 12]; 12], [[0.0; 6]; 12]);
    for _ in 0..10 {
        let mut x: [f64; 12] = core::array::from_fn(|_| 2.0 * random.f64() - 1.0);
        let mut u: [f64; 6] = core::array::from_fn(|_| 20.0 * (2.0 * random.f64() - 1.0));
        dynamics.linearise(&x, &u, &mut a, &mut b);
        let largest = a.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        // Central differences err by h² of the third derivative, and by rounding over h.
        let h = 1e-5;
        for j in 0..18 {
            let mut end = |h: f64| {
                let entry = if j < 12 { &mut x[j] } else { &mut u[j - 12] };
                let kept = *entry;
                *entry += h;
                let end = dynamics.step(&x, &u);
                let entry = if j < 12 { &mut x[j] } else { &mut u[j - 12] };
                *entry = kept;
                end
            };
            let (above, below) = (end(h), end(-h));
            for i in 0..12 {
                let exact = if j < 12 { a[i][j] } else { b[i][j - 12] };
                let difference = (above[i] - below[i]) / (2.0 * h);
                assert!((exact - difference).abs() < 1e-7 * largest, "{i} {j}: {exact} {difference}");
            }
        }
    }
}

#[test]
fn the_acrobot_uses_all_its_effort() {
    let (plan, problem) = swing_up();
    let most = problem.bounds[1][0];
    assert!(plan.u[..200].iter().filter(|u| u[0].abs() == most).count() > 5);
}

/// `J = ∂(q, v)/∂(q, p)` of a node, against central differences.
#[test]
fn weighed_velocities_have_exact_derivatives() {
    let mut random = fastrand::Rng::with_seed(7);
    let mut dynamics = Velocities::<_, f64, 12, 6>::new(ur5(0.01));
    let (mut a, mut b) = ([[0.0; 12]; 12], [[0.0; 6]; 12]);
    for _ in 0..10 {
        let x: [f64; 12] = core::array::from_fn(|_| 2.0 * random.f64() - 1.0);
        let weights: [f64; 12] = core::array::from_fn(|_| random.f64());
        dynamics.linearise(&x, &[0.0; 6], &mut a, &mut b);
        let y = dynamics.weighed_again(&x, false);
        assert_eq!(y, dynamics.weighed_again(&x, true));
        // Another function computes these, with other roundings.
        let again = dynamics.step_weighed(&x, &[0.0; 6]).1;
        let largest = y.iter().fold(1.0_f64, |m, y| m.max(y.abs()));
        assert!(y.iter().zip(&again).all(|(y, z)| (y - z).abs() < 1e-12 * largest), "{y:?} {again:?}");
        let h = 1e-5;
        let j = SMatrix::<f64, 12, 12>::from_columns(&core::array::from_fn::<_, 12, _>(|k| {
            let [above, below] = [h, -h].map(|h| {
                let mut x = x;
                x[k] += h;
                SMatrix::<f64, 12, 1>::from(dynamics.weighed(&x))
            });
            (above - below) / (2.0 * h)
        }));
        let mut gradient = [0.0; 12];
        let mut hessian = [[0.0; 12]; 12];
        dynamics.weighed_again(&x, true);
        dynamics.add_weighed(&weights, &weights, &mut gradient, &mut hessian);
        let w = SMatrix::<f64, 12, 1>::from(weights);
        let (first, second) = (j.transpose() * w, j.transpose() * SMatrix::from_diagonal(&w) * j);
        let largest = second.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for i in 0..12 {
            assert!((gradient[i] - first[i]).abs() < 1e-7 * largest, "{i}: {} {}", gradient[i], first[i]);
            for k in 0..12 {
                assert!(
                    (hessian[i][k] - second[(i, k)]).abs() < 1e-7 * largest,
                    "{i} {k}: {} {}",
                    hessian[i][k],
                    second[(i, k)]
                );
            }
        }
    }
}
