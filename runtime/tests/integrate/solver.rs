//! The solver: tolerances, exact ends of runs, limits, kinds of failures, order of dense output.

use std::cell::Cell;

use super::systems::*;
use mbd_runtime::constrained::{ConstraintError, PostStep, WithPostStep};
use mbd_runtime::integrate::tableau;
use mbd_runtime::integrate::{
    CashKarp, Dop853, Euler, Midpoint, Rk4, Rkf45, Solver, Statistics, Step, StepError, Stepper, Tolerance, Tolerances,
    Tsit5, VariableAdams, Verner9,
};
use mbd_runtime::System;

const HALF_PI: f64 = std::f64::consts::FRAC_PI_2;

/// Runs the body once for every adaptive method, which `$make!(&system)` makes.
macro_rules! for_each {
    ($name:ident, $make:ident => $body:block) => {
        for_each!(@ $name, $make, $body, ($), "rkf45" Rkf45 "cash-karp" CashKarp "tsit5" Tsit5 "dop853" Dop853 "verner9" Verner9)
    };
    (@ $name:ident, $make:ident, $body:block, ($d:tt), $($text:literal $type:ident)*) => {{
        $({
            let $name = $text;
            macro_rules! $make {
                ($d y:expr) => { $type::new($d y) };
            }
            $body
        })*
    }};
}

/// The largest error at the end in multiples of the tolerance, for motions over a few periods and all tolerances from
/// 1e-4 to 1e-12. The pair of Cash and Karp underestimates its errors most, and a planet that passes its sun magnifies
/// errors.
fn factor(name: &str) -> f64 {
    match name {
        "verner9" => 1.0,
        "dop853" => 2.0,
        "tsit5" => 20.0,
        _ => 80.0,
    }
}

#[test]
fn tolerances_are_met() {
    for_each!(name, make => {
        for digits in [4, 6, 8, 10, 12] {
            let tolerance = 10_f64.powi(-digits);
            let mut y = oscillator();
            let method = make!(&y);
            let mut solver = adaptive(&mut y, method, tolerance, (&[1.0], &[0.0]));
            let end = run(&mut solver, &mut y, 20.0).expect("a run");
            let oscillator = apart(&end, &[20_f64.cos(), -20_f64.sin()]) / tolerance;

            let mut y = pendulum::<f64>();
            let method = make!(&y);
            let mut solver = adaptive(&mut y, method, tolerance, (&[2.0], &[0.0]));
            let end = run(&mut solver, &mut y, 4.0 * quarter(HALF_PI, 2.0)).expect("a run");
            let pendulum = apart(&end, &[2.0, 0.0]) / tolerance;

            let mut y = planet();
            let (q, p) = orbit(0.0);
            let method = make!(&y);
            let mut solver = adaptive(&mut y, method, tolerance, (&q, &p));
            let end = run(&mut solver, &mut y, 10.0).expect("a run");
            let (q, p) = orbit(10.0);
            let planet = apart(&end, &[q, p].concat()) / tolerance;

            let worst = largest([oscillator, pendulum, planet]);
            println!("{name} {tolerance:e}: oscillator {oscillator:.2}, pendulum {pendulum:.2}, planet {planet:.2}");
            assert!(worst < factor(name), "{name} {tolerance:e}: {worst}");
            assert!(worst > 1e-3 * factor(name), "{name} {tolerance:e}: {worst}, far too careful");
        }
    });
}

/// A body that tumbles on a spherical joint, computed by the interpreter. Error control acts on coordinates and momenta
/// of the chart.
#[test]
fn a_rotor_meets_its_tolerance() {
    let (q, p) = (rotor().neutral(), vec![0.5, 2.0, 3.0]);
    let mut y = rotor();
    let method = Dop853::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-14, (&q, &p));
    let reference = run(&mut solver, &mut y, 20.0).expect("a run");
    for_each!(name, make => {
        for digits in [4, 8, 12] {
            let tolerance = 10_f64.powi(-digits);
            let mut y = rotor();
            let method = make!(&y);
            let mut solver = adaptive(&mut y, method, tolerance, (&q, &p));
            let end = run(&mut solver, &mut y, 20.0).expect("a run");
            let off = apart(&end, &reference) / tolerance;
            let norm: f64 = end[..4].iter().map(|x| x * x).sum::<f64>().sqrt();
            // Every method conserves angular momentum in outer axes, whatever its error.
            let (v, w, l) = ([end[0], end[1], end[2]], end[3], [end[4], end[5], end[6]]);
            let cross = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]] };
            let turn = cross(v, l);
            let twice = cross(v, turn);
            let outer: Vec<f64> = (0..3).map(|k| l[k] + 2.0 * (w * turn[k] + twice[k])).collect();
            println!("{name} {tolerance:e}: {off:.2}, angular momentum {:.1e}", apart(&outer, &p));
            assert!((norm - 1.0).abs() < 1e-15 * 4.0, "{name}: {norm}");
            // The bound is rounding of numbers near 3 in all steps.
            assert!(apart(&outer, &p) < 1e-13, "{name}: {outer:?}");
            // The body makes six turns, over which errors of the angular velocity grow into errors of the angle.
            assert!(off < 10.0 * factor(name), "{name} {tolerance:e}: {off}");
        }
    });
}

/// Numbers of steps and evaluations for one motion. A change of them means that the cost of every simulation has
/// changed.
#[test]
fn statistics_do_not_change() {
    let mut found = Vec::new();
    for_each!(name, make => {
        let mut y = pendulum::<f64>();
        let method = make!(&y);
        let mut solver = adaptive(&mut y, method, 1e-8, (&[2.0], &[0.0]));
        run(&mut solver, &mut y, 4.0 * quarter(HALF_PI, 2.0)).expect("a run");
        let Statistics { steps, rejections, evaluations, jacobians, factorisations, iterations, .. } = solver.statistics();
        assert_eq!([jacobians, factorisations, iterations], [0; 3]);
        found.push((name, steps, rejections, evaluations));
    });
    let expected = [
        ("rkf45", 90, 0, 541),
        ("cash-karp", 70, 0, 421),
        ("tsit5", 81, 0, 488),
        ("dop853", 47, 1, 576),
        ("verner9", 29, 0, 465),
    ];
    assert_eq!(found, expected);
    // RK4 takes four evaluations a step and none for the rate at the end.
    for steps in [10, 13] {
        let mut y = pendulum::<f64>();
        let rk4 = Rk4::new(&y);
        let (q, p) = ([2.0], [0.0]);
        let mut solver = Solver::new(&mut y, rk4, Step::Fixed(1.0 / 8.0), 0.0, &q, &p).expect("a start");
        run(&mut solver, &mut y, steps as f64 / 8.0).expect("a run");
        let statistics = solver.statistics();
        assert_eq!((statistics.steps, statistics.evaluations), (steps, 4 * steps));
    }
}

#[test]
fn runs_land_on_their_ends() {
    fn land(step: Step) {
        let mut y = oscillator();
        let method = Tsit5::new(&y);
        let (q, p) = ([1.0], [0.0]);
        let mut solver = Solver::new(&mut y, method, step, 0.1, &q, &p).expect("a start");
        let ends = [0.1, 0.2, 0.2 + 1e-9, 0.3, 1.0, 7.3, 7.3 + 1e-15, 1e1, 1e1 + 2e-15, 33.3];
        let tiny = ends.map(|t: f64| [t, f64::from_bits(t.to_bits() + 1)]);
        for t in tiny.into_iter().flatten() {
            run(&mut solver, &mut y, t).unwrap_or_else(|e| panic!("{step:?} {t}: {e}"));
            assert_eq!(solver.time(), t, "{step:?}");
        }
        // A run never goes backwards.
        run(&mut solver, &mut y, 1.0).expect("a run");
        solver.advance(&mut y, 1.0).expect("no step");
        let end = state(&mut solver, &y);
        assert_eq!(solver.last_step().1, 0.0);
        let t: f64 = solver.time() - 0.1;
        assert!(apart(&end, &[t.cos(), -t.sin()]) < 1e-4, "{step:?} {end:?}");
    }
    land(Step::Fixed(0.1));
    land(Step::Fixed(1e-2));
    for tolerance in [1e-5, 1e-12] {
        land(Step::Adaptive(Tolerances::new(tolerance)));
    }
}

/// A run over a multiple of the step takes exactly that many steps. Rounding does not cause a tiny last step, in either
/// precision.
#[test]
fn fixed_steps_are_counted() {
    let mut y = pendulum::<f64>();
    let method = Rk4::new(&y);
    let (q, p) = ([1.0], [0.0]);
    let mut solver = Solver::new(&mut y, method, Step::Fixed(1e-3), 0.0, &q, &p).expect("a start");
    for k in 1..=20 {
        run(&mut solver, &mut y, f64::from(k)).expect("a run");
        assert_eq!((solver.time(), solver.statistics().steps), (f64::from(k), 1000 * k as u64));
    }
    let mut y = pendulum::<f32>();
    let method = Rk4::compensated(&y);
    let (q, p) = ([1.0], [0.0]);
    let mut solver = Solver::new(&mut y, method, Step::Fixed(1e-3), 0.0, &q, &p).expect("a start");
    run(&mut solver, &mut y, 60.0).expect("a run");
    assert_eq!((solver.time(), solver.statistics().steps), (60.0, 60_000));
}

#[test]
fn limits_are_kept() {
    let mut y = pendulum::<f64>();
    let method = Verner9::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-8, (&[2.0], &[0.0]));
    (solver.limits.max_step, solver.limits.first_step) = (0.05, 1e-3);
    let mut first = true;
    while solver.time() < 3.0 {
        solver.advance(&mut y, 3.0).expect("a step");
        let h = solver.last_step().1;
        assert!(h <= 0.05 && (!first || h == 1e-3), "{h}");
        first = false;
    }
    assert!(solver.statistics().steps >= 60);

    // The number of steps of one call is limited, rejected steps included. The state that was reached is kept.
    let mut y = pendulum::<f64>();
    let method = Tsit5::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-10, (&[2.0], &[0.0]));
    solver.limits.steps = 10;
    let error = run(&mut solver, &mut y, 50.0).expect_err("a limit");
    let StepError::TooManySteps { time, steps: 10 } = error else { panic!("{error:?}") };
    assert!(time > 0.0 && time == solver.time());
    let statistics = solver.statistics();
    assert_eq!(statistics.steps + statistics.rejections, 10);
    // The next call continues from there.
    solver.limits.steps = u64::MAX;
    run(&mut solver, &mut y, 50.0).expect("a run");

    // The smallest allowed step is too large for the tolerance.
    let mut y = pendulum::<f64>();
    let method = Tsit5::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-12, (&[2.0], &[0.0]));
    solver.limits.min_step = 0.1;
    let error = run(&mut solver, &mut y, 50.0).expect_err("a limit");
    let StepError::StepTooSmall { time: 0.0, step, error } = error else { panic!("{error:?}") };
    assert!(step < 0.1 && error > 1.0, "{step} {error}");

    // Steps that are not positive could never end a run, so they are refused.
    for h in [0.0, -1.0, f64::NAN] {
        let mut y = pendulum::<f64>();
        let method = Tsit5::new(&y);
        let made = Solver::new(&mut y, method, Step::Fixed(h), 0.0, &[2.0], &[0.0]);
        assert!(matches!(made, Err(StepError::InvalidStep { .. })), "{h}");
        let method = Tsit5::new(&y);
        let mut solver = adaptive(&mut y, method, 1e-6, (&[2.0], &[0.0]));
        solver.limits.max_step = h;
        let ended = run(&mut solver, &mut y, 1.0);
        if h.is_nan() {
            // What is no number is no limit.
            let method = Tsit5::new(&y);
            let free = run(&mut adaptive(&mut y, method, 1e-6, (&[2.0], &[0.0])), &mut y, 1.0);
            assert!(ended.is_ok() && ended == free, "{ended:?} {free:?}");
        } else {
            assert!(matches!(ended, Err(StepError::InvalidStep { .. })), "{h}: {ended:?}");
        }
    }
}

/// After a kick, and with another force from then on, a motion goes on as that of a new solver does: nothing is left of what
/// came before. Where the largest momentum is that of the kick, too, bit for bit.
pub(super) fn goes_on_as_new<Y, M>(name: &str, mut y: Y, force: &Cell<f64>, make: impl Fn(&Y) -> M, factor: f64)
where
    Y: System<Scalar = f64, Coordinates = [f64; 1], Momenta = [f64; 1]>,
    M: Stepper<Y>,
{
    let tolerance = 1e-9;
    // Before, no momentum is larger than 3.
    for (kick, same) in [(-5.0, true), (0.2, false)] {
        force.set(0.0);
        let method = make(&y);
        let mut solver = adaptive(&mut y, method, tolerance, (&[2.0], &[0.0]));
        let before = run(&mut solver, &mut y, 1.0).expect("a run");
        assert!(before[1].abs() < 3.0, "{name}: {before:?}");
        force.set(0.7);
        let (q, p) = ([before[0]], [before[1] + kick]);
        solver.resume(&mut y, 1.0, &q, &p).expect("a state");
        let at = |solver: &mut Solver<Y, M>, theta: f64, y: &mut Y| {
            let (mut q, mut p) = ([f64::NAN], [f64::NAN]);
            solver.dense(y, theta, &mut q, &mut p);
            [q[0], p[0]]
        };
        // There is no step to look into, only the state.
        for theta in [0.0, 0.3, 1.0] {
            assert_eq!(at(&mut solver, theta, &mut y), [q[0], p[0]], "{name}: {kick}, {theta}");
        }
        assert_eq!((solver.time(), solver.last_step()), (1.0, (1.0, 0.0)), "{name}");
        let method = make(&y);
        let step = Step::Adaptive(Tolerances::new(tolerance));
        let mut new = Solver::new(&mut y, method, step, 1.0, &q, &p).expect("a start");
        solver.advance(&mut y, 4.0).expect("a step");
        new.advance(&mut y, 4.0).expect("a step");
        assert_eq!(at(&mut solver, 0.0, &mut y), [q[0], p[0]], "{name}: {kick}");
        if same {
            assert_eq!(solver.last_step(), new.last_step(), "{name}");
            for theta in [0.2, 0.5, 0.9, 1.0] {
                assert_eq!(at(&mut solver, theta, &mut y), at(&mut new, theta, &mut y), "{name}: {theta}");
            }
        }
        let ends = [&mut solver, &mut new].map(|solver| run(solver, &mut y, 4.0).expect("a run"));
        let off = apart(&ends[0], &ends[1]);
        println!("{name}: {kick}: {off:e}");
        // Both err by some tolerances.
        assert!(if same { ends[0] == ends[1] } else { off < 2.0 * factor * tolerance }, "{name}: {kick}: {ends:?}");
    }
}

#[test]
fn a_motion_goes_on_after_a_kick() {
    let force = Cell::new(0.0);
    let pushed = || Plain::new(|_, q: &[f64; 1], p: &[f64; 1]| ([p[0]], [-q[0].sin() + force.get()]));
    for_each!(name, make => { goes_on_as_new(name, pushed(), &force, |y| make!(y), factor(name)); });
    goes_on_as_new("adams", pushed(), &force, |y| VariableAdams::new(y), 100.0);
}

/// What says nothing, or what no motion can begin with, is an error, not a motion without error control.
#[test]
fn what_cannot_be_meant_is_refused() {
    let start = |tolerances: Tolerances| {
        let mut y = pendulum::<f64>();
        let method = Verner9::new(&y);
        Solver::new(&mut y, method, Step::Adaptive(tolerances), 1.0, &[2.0], &[0.0]).map(|_| ())
    };
    for tolerance in [0.0, -1e-9, f64::NAN] {
        assert_eq!(start(Tolerances::new(tolerance)), Err(StepError::InvalidTolerances { time: 1.0 }), "{tolerance}");
    }
    let none = Tolerance { absolute: 0.0, relative: 0.0 };
    let momenta_only = Tolerances { coordinates: none, rotations: 0.0, ..Tolerances::new(1e-9) };
    assert_eq!(start(momenta_only), Ok(()));
    assert_eq!(start(momenta_only.coordinates_only()), Err(StepError::InvalidTolerances { time: 1.0 }));

    // A run to a time that is not a number takes no step.
    let mut y = pendulum::<f64>();
    let method = Verner9::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-9, (&[2.0], &[0.0]));
    for _ in 0..2 {
        assert_eq!(solver.run(&mut y, f64::NAN), Err(StepError::InvalidEnd { time: 0.0 }));
        assert_eq!(solver.advance(&mut y, f64::NAN), Err(StepError::InvalidEnd { time: 0.0 }));
    }

    // A coordinate on which no rate depends is not a number.
    let mut cart = Plain::new(|_, _: &[f64; 1], p: &[f64; 1]| (*p, [0.0]));
    let method = Rk4::new(&cart);
    let made = Solver::new(&mut cart, method, Step::Fixed(0.1), 0.0, &[f64::NAN], &[1.0]);
    assert_eq!(made.err(), Some(StepError::NotFinite { time: 0.0, index: 0 }));
}

/// A step towards an end at infinity is finite, although nothing limits it where nothing moves.
#[test]
fn a_step_at_rest_ends() {
    let mut y = pendulum::<f64>();
    let method = Verner9::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-9, (&[0.0], &[0.0]));
    for _ in 0..500 {
        solver.advance(&mut y, f64::INFINITY).expect("a step");
    }
    assert!(solver.time().is_finite() && state(&mut solver, &y) == [0.0, 0.0]);
}

/// Cannot restart after half a second.
struct BreaksDown;

impl<Y: System<Scalar = f64>> PostStep<Y> for BreaksDown {
    const RESTARTS: bool = true;

    fn close(
        &mut self,
        _: &mut Y,
        _: f64,
        _: bool,
        _: &mut Y::Coordinates,
        _: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        Ok(())
    }

    fn restart(
        &mut self,
        _: &mut Y,
        t: f64,
        _: &mut Y::Coordinates,
        _: &mut Y::Momenta,
    ) -> Result<bool, ConstraintError> {
        if t > 0.55 {
            return Err(ConstraintError::NotFinite { index: 3 });
        }
        Ok(false)
    }
}

/// Where a step has been accepted, and what follows cannot be prepared, the state is that at the end of the step.
#[test]
fn a_failure_after_a_step_leaves_its_end() {
    let mut cart = Plain::new(|_, _: &[f64; 1], _: &[f64; 1]| ([1.0], [0.0]));
    let method = WithPostStep::new(&cart, Rk4::new(&cart), BreaksDown);
    let mut solver = Solver::new(&mut cart, method, Step::Fixed(0.1), 0.0, &[0.0], &[0.0]).expect("a start");
    let failed = solver.run(&mut cart, 1.0);
    assert!(matches!(failed, Err(StepError::Constraint { .. })), "{failed:?}");
    // Six steps of a tenth of a second, at a speed of 1 m/s.
    let q = state(&mut solver, &cart)[0];
    assert!((solver.time() - 0.6).abs() < 1e-12 && (q - solver.time()).abs() < 1e-12, "{q} at {}", solver.time());
}

/// Refuses every end of a step.
struct Refuses;

impl<Y: System> PostStep<Y> for Refuses {
    fn close(
        &mut self,
        _: &mut Y,
        _: Y::Scalar,
        _: bool,
        _: &mut Y::Coordinates,
        _: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        Err(ConstraintError::NotFinite { index: 7 })
    }
}

/// A pendulum that gains hold against its weight comes to rest, where the forces cancel but for rounding. Steps must not
/// follow that noise: they are as long as stability allows, some 4 to 20 in a second.
#[test]
fn rest_needs_few_steps() {
    let rates = |_, q: &[f64; 1], p: &[f64; 1]| ([p[0]], [-9.81 * q[0].sin() + 50.0 * (0.8 - q[0]) - 20.0 * p[0]]);
    for_each!(name, make => {
        let mut y = Plain::new(rates);
        let method = make!(&y);
        let mut solver = adaptive(&mut y, method, 1e-9, (&[0.8], &[0.0]));
        solver.limits.steps = 40_000;
        let ran = solver.run(&mut y, 500.0);
        assert!(ran.is_ok(), "{name}: {ran:?} at {} s", solver.time());
        let end = state(&mut solver, &y);
        assert!((50.0 * (0.8 - end[0]) - 9.81 * end[0].sin()).abs() < 1e-7, "{name}: {end:?}");
    });
}

#[test]
fn a_refused_end_keeps_its_reason() {
    // Wherever the steps become too small, the reason is that of the last attempt.
    for k in 0..100 {
        let least = 0.1 * 0.8_f64.powi(k);
        let mut y = pendulum::<f64>();
        let method = WithPostStep::new(&y, Tsit5::new(&y), Refuses);
        let mut solver = adaptive(&mut y, method, 1e-6, (&[2.0], &[0.0]));
        solver.limits.min_step = least;
        let error = ConstraintError::NotFinite { index: 7 };
        assert_eq!(run(&mut solver, &mut y, 1.0), Err(StepError::Constraint { time: 0.0, error }), "{least}");
    }
}

#[test]
fn failures_have_their_type_and_time() {
    for_each!(name, make => {
        // Both equations have the solution q = 1 / (1 − t): the first is q̇ = q², the second q̇ = 1 / (t − 1)².
        for pole in [true, false] {
            let mut y = Plain::new(move |t: f64, q: &[f64; 1], _: &[f64; 1]| {
                ([if pole { q[0] * q[0] } else { 1.0 / ((t - 1.0) * (t - 1.0)) }], [0.0])
            });
            let method = make!(&y);
            let coordinates = Tolerance { absolute: 1e-8, relative: 1e-8 };
            let step = Step::Adaptive(Tolerances { coordinates, ..Tolerances::new(1e-8) });
            let mut solver = Solver::new(&mut y, method, step, 0.0, &[1.0], &[0.0]).expect("a start");
            let error = run(&mut solver, &mut y, 2.0).expect_err("a pole");
            println!("{name}: {error}");
            let StepError::StepTooSmall { time, step, .. } = error else { panic!("{name}: {error:?}") };
            assert!((time - 1.0).abs() < 1e-6 && step < 1e-14, "{name}: {time} {step:e}");
            assert_eq!(time, solver.time());
            // The state is that of the last accepted step, close to the pole.
            let q = state(&mut solver, &y)[0];
            assert!(q.is_finite() && q > 1e6, "{name}: {q:e}");
        }
        // The rate is singular at the start.
        let mut y = Plain::new(|_, q: &[f64; 1], p: &[f64; 1]| ([p[0] / q[0]], [0.0]));
        let method = make!(&y);
        let mut solver = adaptive(&mut y, method, 1e-8, (&[0.0], &[0.0]));
        assert_eq!(run(&mut solver, &mut y, 1.0), Err(StepError::NotFinite { time: 0.0, index: 0 }), "{name}");
        // Fixed steps past the pole overflow.
        let mut y = Plain::new(|_, q: &[f64; 1], _: &[f64; 1]| ([q[0] * q[0]], [0.0]));
        let method = make!(&y);
        let (q, p) = ([1.0], [0.0]);
        let mut solver = Solver::new(&mut y, method, Step::Fixed(0.1), 0.0, &q, &p).expect("a start");
        let error = run(&mut solver, &mut y, 5.0).expect_err("a pole");
        let StepError::NotFinite { time, index: 0 } = error else { panic!("{name}: {error:?}") };
        assert!((1.0..2.0).contains(&time) && time == solver.time(), "{name}: {time}");
        assert!(state(&mut solver, &y)[0].is_finite(), "{name}");
        // The quaternion does not have unit length.
        let mut y = rotor();
        let method = make!(&y);
        let (q, p) = (vec![0.0, 0.0, 0.0, 1.01], vec![0.0; 3]);
        let error = Solver::new(&mut y, method, Step::Fixed(0.1), 3.0, &q, &p).expect_err("no rotation");
        let StepError::Quaternion { time: 3.0, index: 0, norm } = error else { panic!("{name}: {error:?}") };
        assert!((norm - 1.01).abs() < 1e-15, "{name}: {norm}");
    });
    // A method without error estimate cannot choose steps.
    let mut y = pendulum::<f64>();
    let method = Rk4::new(&y);
    let made = Solver::new(&mut y, method, Step::Adaptive(Tolerances::new(1e-6)), 2.0, &[1.0], &[0.0]);
    assert_eq!(made.err(), Some(StepError::NoEstimate { time: 2.0 }));
}

/// A small force that oscillates fast makes momenta need smaller steps than coordinates. Without error control of
/// momenta there are fewer steps, and coordinates still meet the tolerance.
#[test]
fn control_by_coordinates_alone() {
    let runs = [false, true].map(|partial| {
        let mut y = Plain::new(|t: f64, q: &[f64; 1], p: &[f64; 1]| ([p[0]], [-q[0] + (100.0 * t).cos()]));
        let method = Dop853::new(&y);
        let tolerances = Tolerances { momenta: Tolerance { absolute: 0.0, relative: 1e-10 }, ..Tolerances::new(1e-6) };
        let tolerances = if partial { tolerances.coordinates_only() } else { tolerances };
        let step = Step::Adaptive(tolerances);
        let mut solver = Solver::new(&mut y, method, step, 0.0, &[1.0], &[0.0]).expect("a start");
        let end = run(&mut solver, &mut y, 10.0).expect("a run");
        // The equation is q̈ + q = cos ωt.
        let a = 1.0 / (1.0 - 1e4);
        let exact = (1.0 - a) * 10_f64.cos() + a * 1e3_f64.cos();
        ((end[0] - exact).abs(), solver.statistics().evaluations)
    });
    println!("{runs:?}");
    let [full, partial] = runs;
    assert!(2 * partial.1 < full.1, "{runs:?}");
    assert!(partial.0 < 20.0 * 1e-6 && full.0 < 1e-8, "{runs:?}");
}

/// Largest error within single steps of `h` s from points of the orbit.
fn dense_error<Y, M>(mut y: Y, method: impl Fn(&Y) -> M, h: f64) -> f64
where
    Y: System<Scalar = f64, Coordinates = [f64; 2], Momenta = [f64; 2]>,
    M: Stepper<Y>,
{
    let mut worst = 0.0_f64;
    for k in 0..12 {
        let t = 0.5 * f64::from(k);
        let (q, p) = orbit(t);
        let method = method(&y);
        let mut solver = Solver::new(&mut y, method, Step::Fixed(h), t, &q, &p).expect("a start");
        solver.advance(&mut y, 100.0).expect("a step");
        for j in 0..=16 {
            let theta = f64::from(j) / 16.0;
            let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
            solver.dense(&mut y, theta, &mut a, &mut b);
            let (q, p) = orbit(t + theta * h);
            worst = largest([worst, apart(&[a, b].concat(), &[q, p].concat())]);
        }
    }
    worst
}

/// The error of dense output of order `k` within a step falls as `h^(k + 1)`.
#[test]
fn dense_output_has_its_order() {
    fn order(name: &str, expected: u32, h: f64, error: impl Fn(f64) -> f64) {
        let (coarse, fine) = (error(h), error(0.5 * h));
        let found = (coarse / fine).log2();
        println!("{name}: {found:.2} ({coarse:.1e}, {fine:.1e})");
        // Steps that are not very small show the order only approximately. Where the leading term of the error is
        // small, the next one shows.
        let least = f64::from(expected) - 0.5;
        assert!((least..least + 1.5).contains(&found), "{name}: {found}, expected {expected}");
        assert!(fine > 1e-13, "{name}: round-off");
    }
    // Methods without dense output of their own use a cubic.
    order("euler", 2, 0.01, |h| dense_error(planet(), Euler::new, h));
    order("midpoint", 3, 0.01, |h| dense_error(planet(), Midpoint::new, h));
    order("rk4", 4, 0.02, |h| dense_error(planet(), Rk4::new, h));
    order("rkf45", 4, 0.02, |h| dense_error(planet(), Rkf45::new, h));
    order("cash-karp", 4, 0.02, |h| dense_error(planet(), CashKarp::new, h));
    let of = |dense: Option<&tableau::Dense>| dense.expect("dense output").order + 1;
    assert_eq!([of(tableau::TSIT5.dense), of(tableau::DOP853.dense), of(tableau::VERNER9.dense)], [5, 8, 9]);
    order("tsit5", 5, 0.02, |h| dense_error(planet(), Tsit5::new, h));
    order("dop853", 8, 0.08, |h| dense_error(planet(), Dop853::new, h));
    order("verner9", 9, 0.12, |h| dense_error(planet(), Verner9::new, h));
}

/// From one step to the next, dense output and its rate are continuous, also for rotations.
#[test]
fn dense_output_is_smooth() {
    for_each!(name, make => {
        let mut y = rotor();
        let (q, p) = (y.neutral(), vec![0.5, 3.0, 1.0]);
        let method = make!(&y);
        let mut solver = adaptive(&mut y, method, 1e-9, (&q, &p));
        let at = |solver: &mut Solver<_, _>, theta: f64, y: &mut _| {
            let (mut a, mut b) = (q.clone(), p.clone());
            solver.dense(y, theta, &mut a, &mut b);
            [a, b].concat()
        };
        let mut last: Option<(Vec<f64>, Vec<f64>)> = None;
        for _ in 0..20 {
            solver.advance(&mut y, 1e3).expect("a step");
            let h = solver.last_step().1;
            // Rates are differences over 1 µs. Their error is 1e-6 times a curvature below ten, and rounding is 1e-16 /
            // 1e-6.
            let d = 1e-6;
            let (start, end) = (at(&mut solver, 0.0, &mut y), at(&mut solver, 1.0, &mut y));
            let rate = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| (b - a) / d).collect() };
            let in_rate = rate(&start, &at(&mut solver, d / h, &mut y));
            let out_rate = rate(&at(&mut solver, 1.0 - d / h, &mut y), &end);
            if let Some((value, rate)) = &last {
                assert!(apart(value, &start) < 1e-14, "{name}: {value:?} {start:?}");
                assert!(apart(rate, &in_rate) < 1e-4, "{name}: {rate:?} {in_rate:?}");
            }
            let near = at(&mut solver, 1.0 - f64::EPSILON, &mut y);
            // The bound is rounding times weights of up to some hundreds.
            assert!(apart(&near, &end) < 2e-12, "{name}: {near:?} {end:?}");
            assert_eq!(end, state(&mut solver, &y), "{name}");
            last = Some((end, out_rate));
        }
    });
}

/// Steps change smoothly with the motion. Few are rejected, and no step grows directly after a rejected one.
#[test]
fn the_controller_is_calm() {
    for_each!(name, make => {
        let mut y = planet();
        let (q, p) = orbit(0.0);
        let method = make!(&y);
        let mut solver = adaptive(&mut y, method, 1e-8, (&q, &p));
        let (mut steps, mut rejections) = (Vec::new(), 0);
        while solver.time() < 60.0 {
            solver.advance(&mut y, 60.0).expect("a step");
            let statistics = solver.statistics();
            let ((t, h), rejected) = (solver.last_step(), statistics.rejections > rejections);
            rejections = statistics.rejections;
            steps.push((t, h, rejected));
        }
        for pair in steps[..steps.len() - 2].windows(2) {
            let ratio = pair[1].1 / pair[0].1;
            assert!((0.2 * 0.2..=6.0).contains(&ratio), "{name}: {ratio}");
            // A step after a rejected one is not larger than it.
            assert!(!pair[0].2 || ratio <= 1.0 + 1e-12, "{name}: {ratio}");
        }
        // The extreme 5 % are left out: where an error estimate passes through zero, a step or two are longer.
        let mut sizes: Vec<f64> = steps.iter().map(|s| s.1).collect();
        sizes.sort_by(f64::total_cmp);
        let (least, most) = (sizes[sizes.len() / 20], sizes[sizes.len() - 1 - sizes.len() / 20]);
        println!("{name}: {} steps of {least:.3} to {most:.3} s, {rejections} rejections", steps.len());
        // Steps go as r^(3/2), with distances r from 1/2 to 3/2.
        assert!((3.0..12.0).contains(&(most / least)), "{name}: {most} {least}");
        // There are a few rejected steps at each of ten passages of the sun, whatever the number of steps.
        assert!(rejections <= 60, "{name}: {rejections} of {}", steps.len());
    });
}

#[test]
fn single_precision() {
    let quarter = quarter(HALF_PI, 2.0);
    for_each!(name, make => {
        let mut y = pendulum::<f32>();
        let method = make!(&y);
        let mut solver = adaptive(&mut y, method, 1e-5, (&[2.0], &[0.0]));
        let end = run(&mut solver, &mut y, (4.0 * quarter) as f32).expect("a run");
        let off = apart(&end, &[2.0, 0.0]);
        println!("{name}: {off:.1e} in {} steps", solver.statistics().steps);
        // The bound is ten tolerances (see `factor`; a little more for Cash and Karp), and rounding of some tens of
        // steps.
        assert!(off < 3e-4, "{name}: {off}");
        // A tolerance below rounding must neither give a wrong result nor an endless run.
        let method = make!(&y);
        let mut solver = adaptive(&mut y, method, 1e-9, (&[2.0], &[0.0]));
        solver.limits.steps = 20_000;
        let end = run(&mut solver, &mut y, (4.0 * quarter) as f32);
        match end {
            Ok(end) => assert!(apart(&end, &[2.0, 0.0]) < 1e-4, "{name}: {end:?}"),
            Err(e) => assert!(matches!(e, StepError::StepTooSmall { .. } | StepError::TooManySteps { .. }), "{name}: {e}"),
        }
    });
}

/// One period of the pendulum in numbers of 32 digits. The run ends at a time that is no double.
#[cfg(feature = "wide")]
#[test]
fn double_double() {
    use mbd_runtime::integrate::decimal;
    use mbd_runtime::wide::Wide;
    use mbd_runtime::{Real, Scalar};
    type W = Wide<false>;
    let half_pi: W = decimal("1.5707963267948966192313216916397514421").get();
    let period = W::constant(4.0) * quarter(half_pi, W::constant(2.0));
    let mut y = pendulum::<W>();
    let method = Verner9::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-27, (&[W::constant(2.0)], &[W::zero()]));
    solver.run(&mut y, period).expect("a run");
    assert_eq!(solver.time(), period);
    let (mut q, mut p) = (y.neutral(), y.zero_momenta());
    solver.state(&y, &mut q, &mut p);
    let (q, p) = ((q[0] - W::constant(2.0)).to_f64(), p[0].to_f64());
    println!("{q:e} {p:e} in {} steps", solver.statistics().steps);
    assert!(q.abs() < 1e-25 && p.abs() < 1e-25, "{q:e} {p:e}");
}
