//! Composition of displacements, step doubling, the semi-implicit Euler method.

use super::systems::largest_difference;
use mbd_runtime::integrate::{
    Chart, Euler, Midpoint, Point, Rk4, SemiImplicitEuler, Solver, Step, StepDoubling, Stepper, Tolerances, Verner9,
};
use mbd_runtime::system::{LieGroup, LieJoint};
use mbd_runtime::System;

/// An ordinary coordinate, a rotation, a pose and a planar joint, without equations of motion, for tests of charts.
#[derive(Clone, Debug)]
struct Kinds([LieJoint; 3]);

impl Kinds {
    fn new(momenta: bool) -> Self {
        let joint = |kind, q, v| LieJoint { momenta, ..LieJoint::new(kind, q, v) };
        Kinds([joint(LieGroup::SO3, 1, 1), joint(LieGroup::SE3, 5, 4), joint(LieGroup::SE2, 12, 10)])
    }
}

impl System for Kinds {
    type Scalar = f64;
    type Coordinates = [f64; 16];
    type Momenta = [f64; 14];

    fn neutral(&self) -> [f64; 16] {
        let mut q = [0.0; 16];
        (q[4], q[11]) = (1.0, 1.0);
        q
    }
    fn zero_momenta(&self) -> [f64; 14] {
        [0.0; 14]
    }
    fn lie_joints(&self) -> &[LieJoint] {
        &self.0
    }
    fn rates_at(&mut self, _t: f64, _q: &[f64; 16], _p: &[f64; 14], _qd: &mut [f64; 16], _pd: &mut [f64; 14]) {}
    fn coordinate_rates(&self, _q: &[f64; 16], _v: &[f64; 14], _qd: &mut [f64; 16]) {}
}

/// Numbers between -1 and 1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn point(system: &Kinds, seed: &mut u64) -> Point<Kinds> {
    let mut point = Point::zero(system);
    point.parts_mut().into_iter().flatten().for_each(|x| *x = random(seed));
    point
}

#[test]
fn displacements_one_after_the_other() {
    let seed = &mut 1;
    for momenta in [true, false].repeat(50) {
        let system = Kinds::new(momenta);
        let (mut q, mut p) = (system.neutral(), system.zero_momenta());
        q.iter_mut().chain(&mut p).for_each(|x| *x += 0.5 * random(seed));
        for at in [1, 8] {
            let norm = q[at..at + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
            q[at..at + 4].iter_mut().for_each(|x| *x /= norm);
        }
        let mut chart = Chart::new(&system, false);
        chart.load(&system, 0.0, &q, &p).unwrap();
        let (first, second) = (point(&system, seed), point(&system, seed));
        let mut both = first.clone();
        Chart::compose(&system, &second, &mut both);

        // The composed displacement is compared with both displacements, one after the other.
        let (mut q1, mut p1) = (q, p);
        chart.state(&system, &both, &mut q1, &mut p1);
        chart.advance(&system, 0.0, &first).unwrap();
        let (mut q2, mut p2) = (q, p);
        chart.state(&system, &second, &mut q2, &mut p2);
        assert!(largest_difference(&q1, &q2) < 2e-15, "{q1:?} {q2:?}");
        assert!(largest_difference(&p1, &p2) < 1e-14, "{p1:?} {p2:?}");
        assert!(largest_difference(&p, &p2) > 0.1);

        Chart::relative(&system, &first, &mut both);
        let [x, p] = both.parts();
        assert!(
            largest_difference(x, &second.x) < 1e-14 && largest_difference(p, &second.p) < 1e-14,
            "{both:?} {second:?}"
        );
    }
}

/// A system like a pendulum with a mass that moves along it against a spring. The Hamiltonian is not separable:
/// `H = p₀²/2(1 + q₁²) + p₁²/2 + cos q₀ (1 − q₁) + 4 q₁²`.
#[derive(Clone, Copy)]
struct Swing;

impl Swing {
    fn energy(q: &[f64; 2], p: &[f64; 2]) -> f64 {
        p[0] * p[0] / (2.0 * (1.0 + q[1] * q[1])) + p[1] * p[1] / 2.0 + q[0].cos() * (q[1] - 1.0) + 4.0 * q[1] * q[1]
    }

    /// A state in motion.
    const START: ([f64; 2], [f64; 2]) = ([1.2, 0.3], [0.4, -0.2]);
}

impl System for Swing {
    type Scalar = f64;
    type Coordinates = [f64; 2];
    type Momenta = [f64; 2];

    fn neutral(&self) -> [f64; 2] {
        [0.0; 2]
    }
    fn zero_momenta(&self) -> [f64; 2] {
        [0.0; 2]
    }
    fn lie_joints(&self) -> &[LieJoint] {
        &[]
    }
    fn rates_at(&mut self, _t: f64, q: &[f64; 2], p: &[f64; 2], qd: &mut [f64; 2], pd: &mut [f64; 2]) {
        let inertia = 1.0 + q[1] * q[1];
        *qd = [p[0] / inertia, p[1]];
        *pd = [q[0].sin() * (q[1] - 1.0), p[0] * p[0] * q[1] / (inertia * inertia) - q[0].cos() - 8.0 * q[1]];
    }
    fn coordinate_rates(&self, _q: &[f64; 2], v: &[f64; 2], qd: &mut [f64; 2]) {
        *qd = *v;
    }
}

fn state(method: &mut impl Stepper<Swing>, time: f64, steps: u32) -> [f64; 4] {
    let (mut q, mut p) = Swing::START;
    let h = time / f64::from(steps);
    for k in 0..steps {
        method.step(&mut Swing, f64::from(k) * h, h, &mut q, &mut p).unwrap();
    }
    [q[0], q[1], p[0], p[1]]
}

fn reference(time: f64) -> [f64; 4] {
    state(&mut Verner9::new(&Swing), time, 400 * time as u32)
}

/// For separable Hamiltonians the semi-implicit Euler method is symplectic. For the oscillator `H = (p² + q²)/2` it
/// conserves `p² + q² − h q p` to round-off, and the error of the energy stays within `h/2`.
#[test]
fn semi_implicit_euler_is_symplectic_where_the_hamiltonian_is_separable() {
    struct Oscillator;
    impl System for Oscillator {
        type Scalar = f64;
        type Coordinates = [f64; 1];
        type Momenta = [f64; 1];
        fn neutral(&self) -> [f64; 1] {
            [0.0]
        }
        fn zero_momenta(&self) -> [f64; 1] {
            [0.0]
        }
        fn lie_joints(&self) -> &[LieJoint] {
            &[]
        }
        fn rates_at(&mut self, _t: f64, q: &[f64; 1], p: &[f64; 1], qd: &mut [f64; 1], pd: &mut [f64; 1]) {
            (*qd, *pd) = (*p, [-q[0]]);
        }
        fn coordinate_rates(&self, _q: &[f64; 1], v: &[f64; 1], qd: &mut [f64; 1]) {
            *qd = *v;
        }
    }
    let (h, steps) = (0.1, 100_000);
    let mut method = SemiImplicitEuler::new(&Oscillator);
    let (mut q, mut p) = ([1.0], [0.0]);
    let kept = |q: &[f64; 1], p: &[f64; 1]| p[0] * p[0] + q[0] * q[0] - h * q[0] * p[0];
    for k in 0..steps {
        method.step(&mut Oscillator, f64::from(k) * h, h, &mut q, &mut p).unwrap();
    }
    // Roundings of a few units in the last place add up as a random walk.
    let walk = f64::from(steps).sqrt() * 4.0 * f64::EPSILON;
    assert!((kept(&q, &p) - 1.0).abs() < walk, "{:e}", kept(&q, &p) - 1.0);
    assert_eq!(method.statistics().evaluations, 200_000);
}

/// For Hamiltonians that are not separable, the energy of the semi-implicit Euler method drifts, as its documentation
/// says.
#[test]
fn semi_implicit_euler_drifts_where_it_is_not() {
    let drift = |steps: u32| {
        let [a, b, c, d] = state(&mut SemiImplicitEuler::new(&Swing), 200.0, steps);
        Swing::energy(&[a, b], &[c, d]) - Swing::energy(&Swing::START.0, &Swing::START.1)
    };
    let [coarse, fine] = [20_000, 40_000].map(drift);
    println!("{coarse:.2e}, with half the step {fine:.2e}");
    // The energy drifts by some per cent in seventy periods, and by less with smaller steps.
    assert!(coarse.abs() > 1e-3 && coarse.abs() < 2e-2 && fine.abs() < coarse.abs());
}

#[test]
fn step_doubling_meets_tolerances() {
    let time = 10.0;
    let exact = reference(time);
    fn run<M: Stepper<Swing>>(method: M, tolerance: f64, time: f64) -> ([f64; 4], [u64; 3]) {
        let (mut q, mut p) = Swing::START;
        let step = Step::Adaptive(Tolerances::new(tolerance));
        let mut solver = Solver::new(&mut Swing, method, step, 0.0, &q, &p).unwrap();
        solver.limits.steps = 100_000;
        solver.run(&mut Swing, time).unwrap();
        solver.state(&Swing, &mut q, &mut p);
        let s = solver.statistics();
        ([q[0], q[1], p[0], p[1]], [s.steps, s.rejections, s.evaluations])
    }
    for tolerance in [1e-5, 1e-8] {
        let (state, counts) = run(StepDoubling::over(&Swing, Rk4::new(&Swing)), tolerance, time);
        let (better, same) = run(StepDoubling::extrapolated(&Swing, Rk4::new(&Swing)), tolerance, time);
        let (other, more) = run(StepDoubling::over(&Swing, Midpoint::new(&Swing)), tolerance, time);
        let [a, b, c] = [&state, &better, &other].map(|s| largest_difference(s, &exact) / tolerance);
        println!("{tolerance:e}: {a:.1} {counts:?}, extrapolated {b:.1} {same:?}, midpoint {c:.1} {more:?}");
        // Every step adds an error of at most one tolerance, which the motion does not magnify much in two periods.
        assert!(a < counts[0] as f64 && b < same[0] as f64 && c < more[0] as f64);
        // Each step and each rejected step takes eleven evaluations. The choice of the first step takes two more.
        let tries = counts[0] + counts[1];
        assert!(counts[2] >= 11 * tries && counts[2] <= 12 * tries + 3, "{counts:?}");
        assert!(more[0] > counts[0]);
    }
}

#[test]
fn orders_of_step_doubling() {
    let exact = reference(4.0);
    let order = |run: &dyn Fn(u32) -> [f64; 4], steps: u32| {
        let [coarse, fine] = [steps, 2 * steps].map(|n| largest_difference(&run(n), &exact));
        (coarse / fine).log2()
    };
    assert!(
        (order(&|n| state(&mut StepDoubling::extrapolated(&Swing, Euler::new(&Swing)), 4.0, n), 400) - 2.0).abs() < 0.2
    );
    assert!((order(&|n| state(&mut StepDoubling::over(&Swing, Rk4::new(&Swing)), 4.0, n), 50) - 4.0).abs() < 0.2);
    assert!(
        (order(&|n| state(&mut StepDoubling::extrapolated(&Swing, Rk4::new(&Swing)), 4.0, n), 50) - 5.0).abs() < 0.4
    );
}
