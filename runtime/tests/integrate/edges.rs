//! Steps, starts and times at the edge of what methods are made for.

use super::systems::*;
use mbd_runtime::integrate::{Gauss12FixedPoint, Gauss16, Gauss6FixedPoint, Rk4, Solver, Step, StepError, Stepper};

/// Fixed steps of all lengths up to where the iteration of the stages diverges end with a result or an error.
#[test]
fn long_fixed_steps_end() {
    let mut solved = 0;
    for k in 0..400 {
        let mut y = oscillator();
        let (mut method, mut q, mut p) = (Gauss16::new(&y), [1.0], [0.0]);
        let h = 4.0 + 0.04 * f64::from(k);
        match method.step(&mut y, 0.0, h, &mut q, &mut p) {
            Ok(()) => solved += 1,
            Err(error) => {
                assert!(matches!(error, StepError::NoConvergence { .. } | StepError::NotFinite { .. }), "{h}")
            }
        }
    }
    assert!(solved > 50 && solved < 400, "{solved}");
}

/// A state that was refused leaves nothing behind: the next step is that of a new method.
#[test]
fn a_refused_state_leaves_nothing_behind() {
    let mut y = rotor();
    let (mut q, mut p) = (vec![0.0, 0.0, 0.0, 1.0], vec![0.1, 0.2, 0.3]);
    let mut method = Rk4::new(&y);
    method.step(&mut y, 0.0, 0.1, &mut q, &mut p).unwrap();
    let (mut wrong, mut none) = (vec![0.6, 0.0, 0.0, 1.6], vec![0.0; 3]);
    assert!(method.step(&mut y, 0.1, 0.1, &mut wrong, &mut none).is_err());
    let (mut fresh_q, mut fresh_p) = (q.clone(), p.clone());
    method.step(&mut y, 0.1, 0.1, &mut q, &mut p).unwrap();
    Rk4::new(&y).step(&mut y, 0.1, 0.1, &mut fresh_q, &mut fresh_p).unwrap();
    let off = largest_difference(&[q, p].concat(), &[fresh_q, fresh_p].concat());
    assert!(off < 1e-14, "{off:e}");
}

/// From rest in the origin, where nothing tells the size of the state, stages are iterated until they are known. A force that
/// grows with time moves a unit mass by `t³/6`, and with a unit spring by `t − sin t`.
#[test]
fn forces_that_grow_move_what_rests_in_the_origin() {
    let check = |name: &str, [q, p]: [f64; 2], [expected_q, expected_p]: [f64; 2], most: f64| {
        assert!((q - expected_q).abs() < most && (p - expected_p).abs() < most, "{name}: {q} {p}");
    };
    macro_rules! run {
        ($method:ident, $rates:expr, $expected:expr, $most:expr) => {{
            let mut y = Plain::new($rates);
            let (mut method, mut q, mut p) = ($method::new(&y), [0.0], [0.0]);
            method.step(&mut y, 0.0, 1.0, &mut q, &mut p).unwrap();
            check(stringify!($method), [q[0], p[0]], $expected, $most);
        }};
    }
    let (free, spring) = ([1.0 / 6.0, 0.5], [1.0 - f64::sin(1.0), 1.0 - f64::cos(1.0)]);
    let pushed = |t: f64, _: &[f64; 1], p: &[f64; 1]| ([p[0]], [t]);
    let held = |t: f64, q: &[f64; 1], p: &[f64; 1]| ([p[0]], [t - q[0]]);
    run!(Gauss6FixedPoint, pushed, free, 1e-14);
    run!(Gauss12FixedPoint, pushed, free, 1e-14);
    run!(Gauss16, pushed, free, 1e-14);
    // Order 6 errs by a hundred-thousandth here.
    run!(Gauss6FixedPoint, held, spring, 1e-4);
    run!(Gauss12FixedPoint, held, spring, 1e-12);
    run!(Gauss16, held, spring, 1e-13);
}

/// Runs of fixed steps lose no time where the steps are short against the time in single precision.
#[test]
fn fixed_steps_lose_no_time_in_single_precision() {
    let mut y = Plain::new(|_, _: &[f32; 1], p: &[f32; 1]| (*p, [0.0]));
    let method = Rk4::new(&y);
    let mut solver = Solver::new(&mut y, method, Step::Fixed(1e-4), 1000.0, &[0.0], &[1.0]).expect("a start");
    for k in 1..=100 {
        solver.run(&mut y, 1000.0 + k as f32 / 1024.0).expect("a run");
    }
    let (mut q, mut p) = ([0.0], [0.0]);
    solver.state(&y, &mut q, &mut p);
    assert!((q[0] - 100.0 / 1024.0).abs() < 1e-3, "{}", q[0]);
}

/// A state at no time has no motion.
#[test]
fn a_state_has_a_time() {
    for time in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut y = oscillator();
        let method = Rk4::new(&y);
        let mut solver = Solver::new(&mut y, method, Step::Fixed(0.1), time, &[1.0], &[0.0]).expect("a start");
        assert!(matches!(solver.run(&mut y, 1.0), Err(StepError::InvalidEnd { .. })), "{time}");
    }
}

/// Dense output of `Gauss16` solves the equations of a shorter step. Where that fails, it is the cubic through both ends of the
/// step and their rates. A drag that acts for a hundredth of a second about 0.296 s is met by a node of half the step from 0 to
/// 1 s, but by none of the whole step and of its quarter.
#[test]
fn dense_output_that_cannot_be_solved_for_is_a_cubic() {
    let mut y = Plain::new(|t: f64, q: &[f64; 1], p: &[f64; 1]| {
        let drag = if (t - 0.2959).abs() < 0.005 { 1e9 } else { 0.0 };
        (*p, [-q[0] - drag * p[0]])
    });
    let method = Gauss16::new(&y);
    let mut solver = Solver::new(&mut y, method, Step::Fixed(1.0), 0.0, &[1.0], &[0.0]).expect("a start");
    solver.advance(&mut y, 1.0).expect("a step");
    let mut at = |theta: f64| {
        let (mut q, mut p) = ([f64::NAN], [f64::NAN]);
        solver.dense(&mut y, theta, &mut q, &mut p);
        [q[0], p[0]]
    };
    // The drag does not act at the nodes of these: the motion is that of the oscillator.
    for t in [0.25, 1.0] {
        assert!(largest_difference(&at(t), &[t.cos(), -t.sin()]) < 1e-14, "{t}: {:?}", at(t));
    }
    // The mean of both ends, and an eighth of the difference of their rates.
    let (s, c) = 1.0_f64.sin_cos();
    let cubic = [0.5 * (1.0 + c) + 0.125 * s, 0.5 * -s + 0.125 * (c - 1.0)];
    assert!(largest_difference(&at(0.5), &cubic) < 1e-14, "{:?} {cubic:?}", at(0.5));
}
