//! The Gauss method whose stages are evaluated at once.

use mbd_runtime::integrate::{Gauss16, Point, Solver, Step, Stepper, Tolerances, Verner9};
use mbd_runtime::{Interpreter, System};
use mbd_testing::largest_difference;

use crate::orders::{scenes, Scene};

/// Within a step it gives what a shorter step gives, which starts from other stages: to what the iterations leave.
#[test]
fn points_within_a_step_are_shorter_steps() {
    for scene in scenes() {
        let mut i = scene.i.clone();
        let mut method = Gauss16::new(&i);
        let (h, mut within) = (16.0 * scene.h, Point::zero(&i));
        for theta in [0.0, 0.1, 0.5, 0.9, 1.0] {
            method.begin(&mut i, 0.0, &scene.q, &scene.p).expect("unit quaternions");
            method.attempt(&mut i, 0.0, h, None).expect("a step");
            method.interpolate(&mut i, 0.0, h, theta, &mut within);
            let mut short = Gauss16::new(&i);
            short.begin(&mut i, 0.0, &scene.q, &scene.p).expect("unit quaternions");
            short.attempt(&mut i, 0.0, theta * h, None).expect("a step");
            let step = short.parts().1;
            let off = largest_difference(&within.x, &step.x).max(largest_difference(&within.p, &step.p));
            let size = within.p.iter().fold(1.0, |most: f64, p| p.abs().max(most));
            assert!(off < 1e-13 * size, "{}, {theta}: {off:e}", scene.name);
        }
    }
}

/// State after a run at a tolerance, and that of its dense output half way.
fn run(scene: &Scene, method: impl Stepper<Interpreter<f64>>, tolerance: f64) -> [Vec<f64>; 2] {
    let mut i = scene.i.clone();
    let (mut q, mut p) = (i.neutral(), i.zero_momenta());
    let step = Step::Adaptive(Tolerances::new(tolerance));
    let mut solver = Solver::new(&mut i, method, step, 0.0, &scene.q, &scene.p).expect("a start");
    let mut half = Vec::new();
    while solver.time() < 1.0 {
        solver.advance(&mut i, 1.0).expect("a step");
        let (start, h) = solver.last_step();
        if half.is_empty() && start + h >= 0.5 {
            solver.dense(&mut i, (0.5 - start) / h, &mut q, &mut p);
            half = [&q[..], &p[..]].concat();
        }
    }
    solver.state(&i, &mut q, &mut p);
    [[q, p].concat(), half]
}

/// Errors of the adaptive method, at the end and between the steps, stay near the tolerance.
#[test]
fn errors_follow_the_tolerance() {
    for scene in scenes() {
        let reference = run(&scene, Verner9::new(&scene.i), 1e-13);
        let size = scene.p.iter().fold(1.0, |most: f64, p| p.abs().max(most));
        for tolerance in [1e-5, 1e-8, 1e-11] {
            let found = run(&scene, Gauss16::new(&scene.i), tolerance);
            for (found, reference) in found.iter().zip(&reference) {
                let off = largest_difference(found, reference) / size;
                println!("{}, {tolerance:e}: {:.2} tolerances", scene.name, off / tolerance);
                assert!(off < 100.0 * tolerance, "{}, {tolerance:e}: {off:e}", scene.name);
            }
        }
    }
}
