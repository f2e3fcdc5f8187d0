//! Adams methods: order, start, restart, number of evaluations; energy projection.

mod projection;
mod systems;

use crate::systems::largest;
use mbd_runtime::integrate::{
    Ab4, Ab6, Abm4, Abm6, Abm8, AdamsMoulton, Solver, Statistics, Step, Stepper, Tolerances, VariableAdams, Verner9,
};
use mbd_runtime::{Energetic, System};

use systems::{apart, body, pendulum, top, turned, walk, walk_on, Top};

/// The method of the highest order.
type Abm12<Y> = AdamsMoulton<Y, 12>;

/// Two measurements of the order by halving the step: over 2 s, beginning with the step `h`, and over the first `K + 2`
/// steps, whose error has one order more, beginning with `h_first`. Errors near round-off do not count.
fn orders<Y: System<Scalar = f64>, M: Stepper<Y>>(
    make: fn(&Y) -> M,
    scene: &dyn Fn() -> (Y, Y::Coordinates, Y::Momenta),
    [h, h_first]: [f64; 2],
) -> [f64; 2] {
    let make = || make(&scene().0);
    let error = |h: f64, n: u32| {
        // The reference is a method of another kind.
        let reference = walk(Verner9::new(&scene().0), scene(), h * f64::from(n) / 400.0, 400);
        apart(&walk(make(), scene(), h, n), &reference)
    };
    let slope = |errors: [f64; 4], noise: f64| {
        let last = errors.iter().rposition(|e| *e > noise).unwrap_or(0);
        assert!(last > 0, "{errors:?}: take a larger step");
        (errors[0] / errors[last]).log2() / last as f64
    };
    let first = make().order() + 2;
    [
        slope([1, 2, 4, 8].map(|m| error(h / f64::from(m), (2.0 / h).round() as u32 * m)), 5e-12),
        slope([1, 2, 4, 8].map(|m| error(h_first / f64::from(m), first)), 5e-13) - 1.0,
    ]
}

macro_rules! order_tests {
    ($($method:ident $order:literal $pendulum:expr, $top:expr, $body:expr;)*) => {$(
        // Steps are so large that errors are above round-off.
        let found = [
            orders($method::new, &pendulum::<f64>, $pendulum),
            orders($method::new, &|| top(3.0), $top),
            orders($method::new, &body, $body),
        ];
        for order in found.into_iter().flatten() {
            assert!(order > f64::from($order) - 0.5, "{} {found:?}", stringify!($method));
        }
    )*};
}

#[test]
fn order_over_a_time_and_from_the_first_steps() {
    order_tests! {
        Ab4 4 [0.005, 0.01], [0.01, 0.02], [0.005, 0.01];
        Ab6 6 [0.005, 0.01], [0.02, 0.04], [0.005, 0.01];
        Abm4 4 [0.005, 0.01], [0.02, 0.04], [0.005, 0.01];
        Abm6 6 [0.01, 0.02], [0.05, 0.05], [0.01, 0.02];
        Abm8 8 [0.0125, 0.03], [0.04, 0.1], [0.0125, 0.03];
        Abm12 12 [0.01, 0.04], [0.1, 0.25], [0.01, 0.05];
    }
}

#[test]
fn evaluations_and_restarts() {
    let (mut y, start_q, start_p) = pendulum::<f64>();
    let (mut q, mut p) = (start_q, start_p);
    let mut method = Ab6::new(&y);
    for i in 0..100 {
        method.step(&mut y, 0.0, 0.005, &mut q, &mut p).unwrap();
        // Each of the five steps of the start takes nine more evaluations.
        let expected = i + 1 + 9 * (i + 1).min(5);
        assert_eq!(method.statistics().evaluations, expected);
    }
    assert_eq!(method.statistics().steps, 100);
    let mut moulton = Abm6::new(&y);
    walk_on(&mut moulton, &mut y, 0.005, 100, &mut (start_q, start_p));
    assert_eq!(moulton.statistics().evaluations, 5 * 10 + 95 * 2);

    // After a change of the step or of the state, the method restarts, with the bits of a new method.
    let elsewhere = ([q[0] + 1e-9, q[1]], p);
    for (h, state) in [(0.004, (q, p)), (0.005, elsewhere)] {
        let (mut old, mut new) = (method.clone(), Ab6::new(&y));
        let (mut a, mut b) = (state, state);
        let before = old.statistics().evaluations;
        walk_on(&mut old, &mut y, h, 20, &mut a);
        walk_on(&mut new, &mut y, h, 20, &mut b);
        assert_eq!(a, b);
        // Neither of the methods knows the rate at the start in advance.
        assert_eq!(old.statistics().evaluations - before, new.statistics().evaluations);
    }
    // A step that differs by rounding does not restart the method.
    let before = method.statistics().evaluations;
    method.step(&mut y, 0.0, 0.005 * (1.0 + 1e-12), &mut q, &mut p).unwrap();
    assert_eq!(method.statistics().evaluations - before, 1);
}

#[test]
fn a_solver_needs_no_more_evaluations() {
    let (mut y, q, p) = pendulum::<f64>();
    let method = Ab4::new(&y);
    let mut solver = Solver::new(&mut y, method, Step::Fixed(0.005), 0.0, &q, &p).unwrap();
    solver.run(&mut y, 1.0).unwrap();
    assert_eq!(solver.statistics().evaluations, 200 + 3 * 4);
    let (mut a, mut b) = ((q, p), (q, p));
    solver.state(&y, &mut a.0, &mut a.1);
    walk_on(&mut Ab4::new(&y), &mut y, 0.005, 200, &mut b);
    // The solver's last step is the remaining time, which differs from the step by rounding.
    assert!(apart(&a.0, &b.0) < 1e-14 && apart(&a.1, &b.1) < 1e-13, "{a:?} {b:?}");
}

#[test]
fn a_free_rotor_keeps_its_momentum() {
    fn run(method: &mut impl Stepper<Top>, n: u32) {
        let (mut y, q, p) = top(0.0);
        let outer = |q: &[f64; 4], p: &[f64; 3]| turned(q, *p, -1.0);
        let mut state = (q, p);
        walk_on(method, &mut y, 0.01, n, &mut state);
        let off = apart(&outer(&q, &p), &outer(&state.0, &state.1));
        // At worst, each step rounds the rate (terms of some 4 N m that cancel) in the same direction, over 1000 s.
        assert!(off < 1000.0 * 4.0 * 2.0 * f64::EPSILON, "{off}");
        assert!(apart(&q, &state.0) > 0.1);
    }
    let y = top(0.0).0;
    run(&mut Ab4::new(&y), 100_000);
    run(&mut Ab6::new(&y), 100_000);
    run(&mut Abm8::new(&y), 100_000);
    run(&mut VariableAdams::new(&y), 100_000);
}

/// State at 5 s for a tolerance, and the work.
fn solve<Y: System<Scalar = f64>>(
    method: impl Stepper<Y>,
    (mut y, mut q, mut p): (Y, Y::Coordinates, Y::Momenta),
    tolerance: f64,
) -> (Vec<f64>, Statistics) {
    let step = Step::Adaptive(Tolerances::new(tolerance));
    let mut solver = Solver::new(&mut y, method, step, 0.0, &q, &p).expect("a state");
    solver.run(&mut y, 5.0).expect("a run");
    solver.state(&y, &mut q, &mut p);
    (q.as_ref().iter().chain(p.as_ref()).copied().collect(), solver.statistics())
}

/// Errors are within `factor` times the tolerance, with fewer evaluations than Verner's method takes.
fn tolerances<Y: System<Scalar = f64>>(scene: impl Fn() -> (Y, Y::Coordinates, Y::Momenta), factor: f64) {
    let reference = walk(Verner9::new(&scene().0), scene(), 1e-3, 5000);
    for k in 3..=12 {
        let tolerance = 10_f64.powi(-k);
        let (state, work) = solve(VariableAdams::new(&scene().0), scene(), tolerance);
        let error = apart(&state, &reference) / tolerance;
        let (_, more) = solve(Verner9::new(&scene().0), scene(), tolerance);
        assert!(error < factor, "{tolerance:e}: {error}");
        assert!(100 * work.evaluations < 85 * more.evaluations, "{tolerance:e}: {work:?} {more:?}");
        // Each try takes one evaluation at the predicted state and each step one at its start; the choice of the first
        // step takes one more.
        let tries = work.steps + work.rejections;
        assert_eq!(work.evaluations, tries + work.steps + 1, "{work:?}");
    }
}

#[test]
fn tolerances_are_met() {
    tolerances(pendulum::<f64>, 30.0);
    tolerances(|| top(3.0), 5.0);
    // The body falls ever faster and magnifies errors some hundred times; errors of Verner's method reach 110
    // tolerances.
    tolerances(body, 500.0);
}

#[test]
fn points_within_a_step() {
    let scene = || top(3.0);
    let (mut y, mut q, mut p) = scene();
    let mut times = Vec::new();
    let mut points = Vec::new();
    let method = VariableAdams::new(&y);
    let mut solver = Solver::new(&mut y, method, Step::Adaptive(Tolerances::new(1e-9)), 0.0, &q, &p).unwrap();
    while solver.time() < 3.0 {
        solver.advance(&mut y, 3.0).unwrap();
        let (t, h) = solver.last_step();
        for theta in [0.0, 0.3, 0.8, 1.0] {
            solver.dense(&mut y, theta, &mut q, &mut p);
            times.push(t + theta * h);
            points.push((q, p));
        }
        // Dense output must give the end of the step, and the rates there are evaluated only once.
        let end = (q, p);
        solver.state(&y, &mut q, &mut p);
        assert!(apart(&end.0, &q) < 1e-14 && apart(&end.1, &p) < 1e-13);
    }
    let work = solver.statistics();
    assert_eq!(work.evaluations, 2 * work.steps + work.rejections + 2);
    let (mut y, mut q, mut p) = scene();
    let mut reference = Verner9::new(&y);
    let mut t = 0.0;
    for (time, point) in times.into_iter().zip(points) {
        reference.step(&mut y, t, time - t, &mut q, &mut p).unwrap();
        t = time;
        assert!(apart(&q, &point.0) < 1e-8 && apart(&p, &point.1) < 1e-8, "{t} {q:?} {point:?}");
    }
}

#[test]
fn single_precision() {
    // A minute at 1 kHz; errors are relative to the largest kinetic energy, some 40 J. Sums without compensation lose a
    // rounding of the state in every step.
    let worst = |compensated: bool| {
        let (mut y, mut q, mut p) = pendulum::<f32>();
        let mut exact = pendulum::<f64>().0;
        let mut method = if compensated { Ab6::compensated(&y) } else { Ab6::new(&y) };
        let mut energy = |q: [f32; 2], p: [f32; 2]| {
            let (kinetic, potential) = exact.energies(&q.map(f64::from), &p.map(f64::from));
            (kinetic + potential) / 40.0
        };
        let (start, mut worst) = (energy(q, p), 0.0_f64);
        for _ in 0..60_000 {
            method.step(&mut y, 0.0, 1e-3, &mut q, &mut p).unwrap();
            worst = largest([worst, energy(q, p) - start]);
        }
        worst
    };
    let found = [worst(true), worst(false)];
    println!("{found:?}");
    assert!(found[0] < 1e-5 && found[0] < 0.2 * found[1], "{found:?}");
}
