//! Methods that compute multipliers themselves: RATTLE, Radau IIA of index 2.

use super::holding::{apart, held, march, State};
use super::systems::*;
use crate::systems::largest;
use mbd_runtime::constrained::{OpenAndClosed, RadauIndex2, Rattle, Stabilisation};
use mbd_runtime::integrate::{Solver, Step, Stepper, Verner9};

fn split<T: Model + Clone>(model: T) -> OpenAndClosed<Open<T>, Closed<T>> {
    OpenAndClosed { open: Open(model.clone()), closed: Closed::new(model) }
}

/// RATTLE satisfies the constraints of positions and velocities at the end of every step. It has order 2 for a
/// separable Hamiltonian and for one that is not; for the latter the exact motion is known.
#[test]
fn rattle_has_order_two() {
    let mut y = split(Sticks::double());
    let start = (vec![0.8, -0.6, 1.4, 0.2], vec![0.0; 4]);
    let mut closed = Closed::new(Sticks::double());
    let mut fine = held(&closed, Verner9::new(&closed), Stabilisation::Mass);
    let reference = march(&mut closed, &mut fine, 1000, 1.0, &start).unwrap();
    let mut error = |steps| {
        let mut method = Rattle::new(&y);
        let end = march(&mut y, &mut method, steps, 1.0, &start).unwrap();
        println!("{:?} {:?}", y.closed.off(&end.0, &end.1), method.statistics());
        assert!(y.closed.off(&end.0, &end.1).0 < 1e-14);
        let sigma = y.closed.velocities(&end.0, &end.1).1;
        assert!(sigma.iter().all(|s| s.abs() < 1e-13));
        apart(&end.0, &reference.0)
    };
    let errors = [error(200), error(400)];
    assert!((errors[0] / errors[1] - 4.0).abs() < 0.3, "{errors:?}");

    let mut y = split(Polar);
    let start: State = (Polar::at(0.7), vec![0.0; 2]);
    let errors = [100, 200].map(|steps| {
        let mut method = Rattle::new(&y);
        let end = march(&mut y, &mut method, steps, 3.0, &start).unwrap();
        assert!(y.closed.off(&end.0, &end.1).0 < 1e-14);
        (Polar::place(&end.0) - 0.7 * 6.0_f64.cos()).abs()
    });
    assert!((errors[0] / errors[1] - 4.0).abs() < 0.3, "{errors:?}");
}

/// In 20 000 steps the energy oscillates but does not drift: its means over the first and the last tenth differ by far
/// less than the oscillation. (A Runge-Kutta method of order 2 would lose all of the energy.) Steps backwards lead back
/// to the start.
#[test]
fn rattle_is_symplectic() {
    let mut y = split(Polar);
    let start: State = (Polar::at(0.7), vec![0.0; 2]);
    let mut method = Rattle::new(&y);
    let ((mut q, mut p), h, n) = (start.clone(), 0.05, 20_000);
    let before = y.closed.energy(&q, &p);
    let mut off = Vec::new();
    for k in 0..n {
        method.step(&mut y, f64::from(k) * h, h, &mut q, &mut p).unwrap();
        off.push(y.closed.energy(&q, &p) - before);
    }
    let swing = largest(off.iter().copied());
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let drift = mean(&off[off.len() * 9 / 10..]) - mean(&off[..off.len() / 10]);
    println!("swing {swing:.2e}, drift {drift:.2e}, of {before:.2e} J, {:?}", method.statistics());
    assert!(swing < 1e-2 * before && drift.abs() < 1e-2 * swing);

    let mut y = split(Sticks::double());
    let (mut q, mut p) = (vec![0.8, -0.6, 1.4, 0.2], vec![0.0; 4]);
    let start = q.clone();
    let mut method = Rattle::new(&y);
    for k in 0..50 {
        method.step(&mut y, f64::from(k) * 0.01, 0.01, &mut q, &mut p).unwrap();
    }
    for k in 0..50 {
        method.step(&mut y, 0.5 - f64::from(k) * 0.01, -0.01, &mut q, &mut p).unwrap();
    }
    assert!(apart(&q, &start) < 1e-12 && apart(&p, &[0.0; 4]) < 1e-11, "{q:?} {p:?}");
}

/// RATTLE with redundant rows, and on the Lie group of a body: states are closed, and the order is 2.
#[test]
fn rattle_elsewhere() {
    let mut y = split(Sticks::pendulum(2));
    let start = (vec![1.0, 0.0], vec![0.0; 2]);
    let mut method = Rattle::new(&y);
    let end = march(&mut y, &mut method, 200, 2.0, &start).unwrap();
    assert!(y.closed.off(&end.0, &end.1).0 < 1e-14);

    let mut y = split(Top::new());
    let q = y.closed.model.leaning(0.3);
    let mut p = vec![0.0, 0.0, 0.0, 0.02 * 2.0, 0.0, 0.01 * 30.0];
    let (mut v, mut sigma) = (vec![0.0; 6], vec![0.0; 3]);
    mbd_runtime::Constrained::project_momenta(&mut y, 0.0, &q, &mut p, &mut v, &mut sigma);
    let start = (q, p);
    let mut closed = Closed::new(Top::new());
    let mut fine = held(&closed, Verner9::new(&closed), Stabilisation::Mass);
    let reference = march(&mut closed, &mut fine, 500, 0.5, &start).unwrap();
    let errors = [250, 500].map(|steps| {
        let mut method = Rattle::new(&y);
        let end = march(&mut y, &mut method, steps, 0.5, &start).unwrap();
        println!("{:?} {:?}", y.closed.off(&end.0, &end.1), method.statistics());
        assert!(y.closed.off(&end.0, &end.1).0 < 1e-13);
        apart(&end.0, &reference.0)
    });
    assert!((errors[0] / errors[1] - 4.0).abs() < 0.3, "{errors:?}");
}

/// Radau IIA has order 5 in the state and 3 in the multipliers. Velocities satisfy the constraints at the end of every
/// step; positions do so with projection.
#[test]
fn radau_has_order_five() {
    let mut y = split(Sticks::double());
    let start = (vec![0.8, -0.6, 1.4, 0.2], vec![0.0; 4]);
    let mut closed = Closed::new(Sticks::double());
    let mut fine = held(&closed, Verner9::new(&closed), Stabilisation::Mass);
    let reference = march(&mut closed, &mut fine, 1000, 0.5, &start).unwrap();
    for policy in [Stabilisation::None, Stabilisation::Mass] {
        let errors = [10, 20, 40].map(|steps| {
            let mut method = held(&y, RadauIndex2::new(&y), policy);
            let end = march(&mut y, &mut method, steps, 0.5, &start).unwrap();
            let sigma = y.closed.velocities(&end.0, &end.1).1;
            println!("{:?} {:?}", y.closed.off(&end.0, &end.1), method.statistics());
            assert!(policy == Stabilisation::Mass || sigma.iter().all(|s| s.abs() < 1e-12), "{sigma:?}");
            assert!(policy == Stabilisation::None || y.closed.off(&end.0, &end.1).0 < 1e-14);
            (apart(&end.0, &reference.0), method.method().lambda().clone())
        });
        assert!((errors[0].0 / errors[1].0).log2() > 4.5, "{errors:?}");
        // The order of the multipliers follows from differences between three step sizes.
        let found = (apart(&errors[0].1, &errors[1].1) / apart(&errors[1].1, &errors[2].1)).log2();
        assert!(found > 2.6, "{found} {errors:?}");
    }
    let mut y = split(Top::new());
    let q = y.closed.model.leaning(0.3);
    let mut p = vec![0.0, 0.0, 0.0, 0.02 * 2.0, 0.0, 0.01 * 30.0];
    let (mut v, mut sigma) = (vec![0.0; 6], vec![0.0; 3]);
    mbd_runtime::Constrained::project_momenta(&mut y, 0.0, &q, &mut p, &mut v, &mut sigma);
    let start = (q, p);
    let mut closed = Closed::new(Top::new());
    let mut fine = held(&closed, Verner9::new(&closed), Stabilisation::Mass);
    let reference = march(&mut closed, &mut fine, 500, 0.3, &start).unwrap();
    let errors = [15, 30].map(|steps| {
        let mut method = held(&y, RadauIndex2::new(&y), Stabilisation::Mass);
        let end = march(&mut y, &mut method, steps, 0.3, &start).unwrap();
        println!("{:?} {:?}", y.closed.off(&end.0, &end.1), method.statistics());
        apart(&end.0, &reference.0)
    });
    println!("{errors:?}");
    assert!((errors[0] / errors[1]).log2() > 4.5, "{errors:?}");
}

/// A step begins with the multipliers of the last one, which saves iterations. A motion does not begin with those of the
/// motion before: it has the bits of one by a new method, and takes as many iterations.
#[test]
fn multipliers_go_from_step_to_step_and_not_from_motion_to_motion() {
    type Y = OpenAndClosed<Open<Sticks>, Closed<Sticks>>;
    fn check<M: Stepper<Y>>(name: &str, make: impl Fn(&Y) -> M) {
        let mut y = split(Sticks::double());
        let rest: State = (vec![0.8, -0.6, 1.4, 0.2], vec![0.0; 4]);
        // Both masses turn about the origin with 20 rad/s; the forces of the sticks are some forty times those at rest.
        let turning: State = (rest.0.clone(), vec![12.0, 16.0, -4.0, 28.0]);
        let (steps, end) = (5, 0.05);
        let mut new = make(&y);
        let expected = march(&mut y, &mut new, steps, end, &rest).unwrap();
        let iterations = new.statistics().iterations;

        let mut used = make(&y);
        march(&mut y, &mut used, steps, end, &turning).unwrap();
        let before = used.statistics().iterations;
        assert_eq!(march(&mut y, &mut used, steps, end, &rest).unwrap(), expected, "{name}");
        assert_eq!(used.statistics().iterations - before, iterations, "{name}");

        // The same of solvers, which keep the state themselves.
        let step = Step::Fixed(end / f64::from(steps));
        let method = make(&y);
        let mut new = Solver::new(&mut y, method, step, 0.0, &rest.0, &rest.1).unwrap();
        let method = make(&y);
        let mut used = Solver::new(&mut y, method, step, 0.0, &turning.0, &turning.1).unwrap();
        used.run(&mut y, end).unwrap();
        let before = used.statistics().iterations;
        used.restart(&mut y, 0.0, &rest.0, &rest.1).unwrap();
        let [expected, found] = [&mut new, &mut used].map(|solver| {
            solver.run(&mut y, end).unwrap();
            let (mut q, mut p) = rest.clone();
            solver.state(&y, &mut q, &mut p);
            (q, p)
        });
        assert_eq!(found, expected, "{name}");
        assert_eq!(used.statistics().iterations - before, iterations, "{name}");
        assert_eq!(new.statistics().iterations, iterations, "{name}");

        let ((mut q, mut p), mut forgetful) = (rest, 0);
        for _ in 0..steps {
            let mut method = make(&y);
            method.step(&mut y, 0.0, end / f64::from(steps), &mut q, &mut p).unwrap();
            forgetful += method.statistics().iterations;
        }
        println!("{name}: {iterations} iterations, {forgetful} without multipliers of the last step");
        assert!(iterations < forgetful, "{name}: {iterations} {forgetful}");
    }
    check("rattle", Rattle::new);
    check("radau", RadauIndex2::new);
    check("radau held", |y| held(y, RadauIndex2::new(y), Stabilisation::Mass));
}
