//! Events: times, order, directions, runs that end at events.

use super::systems::*;
use mbd_runtime::integrate::{
    Direction, Dop853, Events, Outcome, Rk4, Rkf45, Solver, Step, Stepper, Tsit5, VariableAdams, Verner9, Watch,
};
use mbd_runtime::{Interpreter, Real, System};

/// Event functions given by a closure, and a record of the events.
struct Watched<F, const N: usize> {
    watches: [Watch; N],
    values: F,
    happened: Vec<(usize, f64)>,
}

impl<F, const N: usize> Watched<F, N> {
    fn new(watches: [(Direction, bool); N], values: F) -> Self {
        let watches = watches.map(|(direction, terminal)| Watch { direction, terminal });
        Watched { watches, values, happened: Vec::new() }
    }
}

impl<Y, F, const N: usize> Events<Y, N> for Watched<F, N>
where
    Y: System,
    Y::Scalar: Real,
    F: FnMut(Y::Scalar, &[Y::Scalar], &[Y::Scalar]) -> [Y::Scalar; N],
{
    fn watches(&self) -> [Watch; N] {
        self.watches
    }
    fn values(&mut self, _: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> [Y::Scalar; N] {
        (self.values)(t, q.as_ref(), p.as_ref())
    }
    fn happened(&mut self, _: &mut Y, event: usize, t: Y::Scalar, _: &Y::Coordinates, _: &Y::Momenta) {
        self.happened.push((event, t.to_f64()));
    }
}

use Direction::{Both, Falling, Rising};

const HALF_PI: f64 = std::f64::consts::FRAC_PI_2;

/// A pendulum passes its lowest point at odd multiples of the quarter period, and is at rest at even ones.
#[test]
fn a_pendulum_by_its_quarter_periods() {
    let quarter = quarter(HALF_PI, 2.0);
    fn times<M: Stepper<Y>, Y: System<Scalar = f64, Coordinates = [f64; 1], Momenta = [f64; 1]>>(
        mut y: Y,
        method: impl Fn(&Y) -> M,
        tolerance: f64,
        end: f64,
    ) -> Vec<(usize, f64)> {
        let method = method(&y);
        let mut solver = adaptive(&mut y, method, tolerance, (&[2.0], &[0.0]));
        let watches = [(Falling, false), (Rising, false), (Both, false), (Rising, false)];
        let mut events = Watched::new(watches, |_, q: &[f64], p: &[f64]| [q[0], q[0], q[0], p[0]]);
        assert_eq!(solver.run_events(&mut y, end, &mut events), Ok(Outcome::End));
        assert_eq!(solver.time(), end);
        events.happened
    }
    // The zero p = 0 at the start is no event. Events at the same time come in the order of their functions.
    let expected: Vec<(usize, f64)> = (0..3)
        .flat_map(|k| [(0, 1), (2, 1), (3, 2), (1, 3), (2, 3)].map(|(e, n)| (e, f64::from(n + 4 * k) * quarter)))
        .collect();
    for (name, times, tolerance) in [
        // Errors of the motion are about ten tolerances here, and a little more with dense output of low order.
        ("tsit5", times(pendulum(), Tsit5::new, 1e-8, 12.0 * quarter), 3e-7),
        ("rkf45, cubic", times(pendulum(), Rkf45::new, 1e-8, 12.0 * quarter), 1e-5),
        ("dop853", times(pendulum(), Dop853::new, 1e-12, 12.0 * quarter), 1e-10),
        ("verner9", times(pendulum(), Verner9::new, 1e-12, 12.0 * quarter), 1e-10),
        ("adams", times(pendulum(), VariableAdams::new, 1e-10, 12.0 * quarter), 1e-7),
    ] {
        assert_eq!(
            times.iter().map(|e| e.0).collect::<Vec<_>>(),
            expected.iter().map(|e| e.0).collect::<Vec<_>>(),
            "{name}"
        );
        let off = largest(times.iter().zip(&expected).map(|(a, b)| a.1 - b.1));
        println!("{name}: {off:.1e}");
        assert!(off < tolerance, "{name}: {off:e}");
    }
}

/// A run ends at a terminal event. The next run does not find the same event again, and misses none.
#[test]
fn terminal_events_end_runs() {
    ends_at_events(pendulum::<f64>(), Dop853::new);
    // This method restarts after each event.
    ends_at_events(pendulum::<f64>(), VariableAdams::new);
}

fn ends_at_events<M, Y>(mut y: Y, method: impl Fn(&Y) -> M)
where
    M: Stepper<Y>,
    Y: System<Scalar = f64, Coordinates = [f64; 1], Momenta = [f64; 1]>,
{
    let quarter = quarter(HALF_PI, 2.0);
    let method = method(&y);
    let mut solver = adaptive(&mut y, method, 1e-11, (&[2.0], &[0.0]));
    let mut events = Watched::new([(Both, true), (Both, false)], |_, q: &[f64], p: &[f64]| [q[0], p[0]]);
    for k in 0..20 {
        let outcome = solver.run_events(&mut y, 1e3, &mut events).expect("a run");
        let Outcome::Event { index: 0, time } = outcome else { panic!("{outcome:?}") };
        let expected = f64::from(2 * k + 1) * quarter;
        // The error of the motion grows to some hundred tolerances in these periods.
        assert!((time - expected).abs() < 5e-9, "{k}: {time} {expected}");
        assert_eq!(solver.time(), time);
        // The bound is four units in the last place of the time, at a speed below two, and rounding of the dense
        // output, whose weights are some hundreds.
        let q = state(&mut solver, &y)[0];
        assert!(q.abs() <= 8.0 * f64::EPSILON * time + 1e-13, "{k}: {q:e}");
    }
    // Every other event is a turning point; that at the start is not an event.
    assert_eq!(events.happened.iter().map(|e| e.0).collect::<Vec<_>>(), [&[0][..], &[1, 0].repeat(19)].concat());
    let statistics = solver.statistics();
    assert!(statistics.steps > 100 && statistics.evaluations > 2 * statistics.steps, "{statistics:?}");
}

/// A ball falls from 1 m at 2 m/s² and keeps half its speed at each bounce. It hits the ground after 1 s, then after 1,
/// 1/2 and 1/4 s more.
#[test]
fn a_ball_that_bounces() {
    let mut y = Plain::new(|_, _: &[f64; 1], p: &[f64; 1]| ([p[0]], [-2.0]));
    let method = Tsit5::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-9, (&[1.0], &[0.0]));
    // The event has both directions, but the start upwards after a bounce is not an event.
    let mut events = Watched::new([(Both, true)], |_, q: &[f64], _: &[f64]| [q[0]]);
    let mut expected = 1.0;
    for k in 0..12 {
        let outcome = solver.run_events(&mut y, 10.0, &mut events);
        let Ok(Outcome::Event { index: 0, time }) = outcome else { panic!("{k}: {outcome:?}") };
        assert!((time - expected).abs() < 1e-11, "{k}: {time} {expected}");
        expected += 0.5_f64.powi(k);
        let end = state(&mut solver, &y);
        let (q, p) = ([end[0]], [-0.5 * end[1]]);
        solver.restart(&mut y, time, &q, &p).expect("a start");
    }
    assert_eq!(events.happened.len(), 12);
}

/// The motion along a parabola is one step. If the parabola is above a line for a third of the step, both zeros are
/// found; for a hundredth of the step they are missed, as the documentation allows.
#[test]
fn two_zeros_in_one_step() {
    for (share, found) in [(0.3, 2), (0.01, 0)] {
        let mut y = Plain::new(|_, _: &[f64; 1], p: &[f64; 1]| ([p[0]], [-2.0]));
        let method = Rk4::new(&y);
        let (q, p) = ([0.0], [1.0]);
        let mut solver = Solver::new(&mut y, method, Step::Fixed(1.0), 0.0, &q, &p).expect("a start");
        // The line meets the parabola t (1 − t) at the times a and b.
        let (a, b) = (0.43 - 0.5 * share, 0.43 + 0.5 * share);
        let line = move |t: f64| a * b + (1.0 - a - b) * t;
        let mut events =
            Watched::new([(Both, false), (Falling, false)], move |t, q: &[f64], _: &[f64]| [q[0] - line(t); 2]);
        assert_eq!(solver.run_events(&mut y, 1.0, &mut events), Ok(Outcome::End));
        assert_eq!(solver.statistics().steps, 1);
        let times: Vec<f64> = events.happened.iter().filter(|e| e.0 == 0).map(|e| e.1).collect();
        assert_eq!(times.len(), found, "{times:?}");
        if found > 0 {
            assert!((times[0] - a).abs() < 1e-14 && (times[1] - b).abs() < 1e-14, "{times:?}");
            assert_eq!(events.happened.iter().filter(|e| e.0 == 1).map(|e| e.1).collect::<Vec<_>>(), [times[1]]);
        }
    }
}

/// Functions whose zeros differ by rounding: a run that ends at one of them does not lose the others, and none is found
/// twice.
#[test]
fn events_at_one_instant() {
    let mut y = oscillator();
    let method = Verner9::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-10, (&[1.0], &[0.0]));
    let mut events =
        Watched::new([(Both, false), (Both, true), (Both, true), (Both, false)], |_, q: &[f64], p: &[f64]| {
            [q[0] * 3.0, q[0], q[0] * q[0] * q[0], q[0] / (p[0].abs() + 0.1)]
        });
    let mut ends = 0;
    while let Outcome::Event { index, .. } = solver.run_events(&mut y, 10.0 * HALF_PI, &mut events).expect("a run") {
        assert!(index == 1 || index == 2);
        ends += 1;
        assert!(ends < 20);
    }
    // There are five zeros, at 1, 3, 5, 7 and 9 quarter periods. The cube is flat at its zero, so its time is less
    // exact.
    for k in 0..4 {
        let times: Vec<f64> = events.happened.iter().filter(|e| e.0 == k).map(|e| e.1 / HALF_PI).collect();
        assert_eq!(times.len(), 5, "{k}: {times:?}");
        for (n, time) in times.into_iter().enumerate() {
            assert!((time - (2 * n + 1) as f64).abs() < if k == 2 { 1e-4 } else { 1e-8 }, "{k}: {time}");
        }
    }
    assert!(events.happened.windows(2).all(|w| w[0].1 <= w[1].1));
}

/// A function that is zero at the start, that is always zero, or that becomes NaN has no event. A zero at the very end
/// of a run is an event.
#[test]
fn zeros_that_are_no_events() {
    let mut y = oscillator();
    let method = Dop853::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-10, (&[1.0], &[0.0]));
    let mut events = Watched::new([(Both, true); 4], |t, _: &[f64], p: &[f64]| {
        [p[0], 0.0, if t < 1.0 { 1.0 } else { f64::NAN }, if t < 2.0 { t - 2.0 } else { 0.0 }]
    });
    assert_eq!(solver.run_events(&mut y, 2.0, &mut events), Ok(Outcome::Event { index: 3, time: 2.0 }));
    assert_eq!(solver.run_events(&mut y, 3.0, &mut events), Ok(Outcome::End));
    assert_eq!(events.happened, [(3, 2.0)]);
}

/// The components of a quaternion change sign continuously, once in every turn; they do not jump from step to step.
#[test]
fn components_of_quaternions() {
    let mut y: Interpreter<f64> = rotor();
    let spin = 2.0;
    let (q, p) = (y.neutral(), vec![0.0, 0.0, 3.0 * spin]);
    let method = Verner9::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-9, (&q, &p));
    solver.limits.max_step = 1.1;
    let mut events = Watched::new([(Falling, false), (Rising, false)], |_, q: &[f64], _: &[f64]| [q[3], q[3]]);
    assert_eq!(solver.run_events(&mut y, 50.0, &mut events), Ok(Outcome::End));
    // The expected times are the zeros of cos(spin t / 2).
    let expected = (0..).map(|n| f64::from(2 * n + 1) * HALF_PI * 2.0 / spin).take_while(|t| *t < 50.0);
    let expected: Vec<f64> = expected.collect();
    assert_eq!(events.happened.len(), expected.len());
    for (n, (event, time)) in events.happened.iter().enumerate() {
        assert_eq!(*event, n % 2);
        assert!((time - expected[n]).abs() < 1e-6, "{time} {}", expected[n]);
    }
}

#[test]
fn single_precision() {
    let mut y = pendulum::<f32>();
    let quarter = quarter(HALF_PI, 2.0);
    let method = Tsit5::new(&y);
    let mut solver = adaptive(&mut y, method, 1e-5, (&[2.0], &[0.0]));
    let mut events = Watched::new([(Both, true)], |_, q: &[f32], _: &[f32]| [q[0]]);
    for k in 0..5 {
        let Ok(Outcome::Event { time, .. }) = solver.run_events(&mut y, 50.0, &mut events) else { panic!("{k}") };
        assert!((f64::from(time) - f64::from(2 * k + 1) * quarter).abs() < 1e-3, "{k}: {time}");
    }
}
