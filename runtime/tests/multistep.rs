//! Adams methods: order, start, restart, evaluations; energy projection.

use mbd_runtime::integrate::{
    Ab4, Ab6, Abm12, Abm4, Abm6, Abm8, AdamsBashforth, Chart, Field, Point, Projection, Rk4, Solver, Step, Stepper,
    Tolerances, VariableAdams, Verner9,
};
use mbd_runtime::system::{Group, GroupKind};
use mbd_runtime::{Energetic, Real, Scalar, System};

/// Two bars of length and mass 1, all mass at the ends: `H` is not a sum of parts of `q` and `p`.
#[derive(Clone, Debug)]
struct Pendulum<S>(core::marker::PhantomData<S>);

impl<S: Real> System for Pendulum<S> {
    type Scalar = S;
    type Coordinates = [S; 2];
    type Momenta = [S; 2];

    fn neutral(&self) -> [S; 2] {
        [S::zero(); 2]
    }
    fn rest(&self) -> [S; 2] {
        [S::zero(); 2]
    }
    fn groups(&self) -> &[Group] {
        &[]
    }
    fn state_rates(&mut self, _t: S, q: &[S; 2], p: &[S; 2], qd: &mut [S; 2], pd: &mut [S; 2]) {
        let g = S::constant(9.81);
        let (s, c) = (q[0] - q[1]).sin_cos();
        let d = S::one() / (S::one() + s * s);
        *qd = [(p[0] - c * p[1]) * d, (p[1] + p[1] - c * p[0]) * d];
        // By the difference of the angles, at momenta that stay.
        let turn = s * qd[0] * qd[1];
        *pd = [-turn - (g + g) * q[0].sin_cos().0, turn - g * q[1].sin_cos().0];
    }
    fn coordinate_rates(&self, _q: &[S; 2], v: &[S; 2], qd: &mut [S; 2]) {
        *qd = *v;
    }
}

impl<S: Real> Energetic for Pendulum<S> {
    fn state_energy(&mut self, q: &[S; 2], p: &[S; 2]) -> (S, S) {
        let (mut v, mut pd) = ([S::zero(); 2], [S::zero(); 2]);
        self.state_rates(S::zero(), q, p, &mut v, &mut pd);
        let g = S::constant(9.81);
        let kinetic = S::constant(0.5) * (v[0] * p[0] + v[1] * p[1]);
        (kinetic, -(g + g) * q[0].sin_cos().1 - g * q[1].sin_cos().1)
    }
}

/// Spin of a top or of a body in a fluid: `(a, b, a × b)`.
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `Rᵀ u`, or `R u` with `sign` −1, of the unit quaternion `q`.
fn turned(q: &[f64], u: [f64; 3], sign: f64) -> [f64; 3] {
    let r = [sign * q[0], sign * q[1], sign * q[2]];
    let t = cross(u, r).map(|x| 2.0 * x);
    let tt = cross(t, r);
    [0, 1, 2].map(|k| u[k] + q[3] * t[k] + tt[k])
}

fn spin(q: &[f64], w: [f64; 3], qd: &mut [f64]) {
    let x = cross([q[0], q[1], q[2]], w);
    for k in 0..3 {
        qd[k] = 0.5 * (q[3] * w[k] + x[k]);
    }
    qd[3] = -0.5 * (q[0] * w[0] + q[1] * w[1] + q[2] * w[2]);
}

/// A top on a ball joint, its weight times its arm given; zero: a free rotor.
#[derive(Clone, Debug)]
struct Top(f64);
const TOP: [f64; 3] = [1.0, 2.0, 2.5];
const BALL: [Group; 1] = [Group::new(GroupKind::Rotation, 0, 0)];

impl System for Top {
    type Scalar = f64;
    type Coordinates = [f64; 4];
    type Momenta = [f64; 3];

    fn neutral(&self) -> [f64; 4] {
        [0.0, 0.0, 0.0, 1.0]
    }
    fn rest(&self) -> [f64; 3] {
        [0.0; 3]
    }
    fn groups(&self) -> &[Group] {
        &BALL
    }
    fn state_rates(&mut self, _t: f64, q: &[f64; 4], p: &[f64; 3], qd: &mut [f64; 4], pd: &mut [f64; 3]) {
        let w = [0, 1, 2].map(|k| p[k] / TOP[k]);
        spin(q, w, qd);
        let (torque, turn) = (cross([0.0, 0.0, self.0], turned(q, [0.0, 0.0, -1.0], 1.0)), cross(*p, w));
        *pd = [0, 1, 2].map(|k| turn[k] + torque[k]);
    }
    fn coordinate_rates(&self, _q: &[f64; 4], _v: &[f64; 3], _qd: &mut [f64; 4]) {}
}

impl Energetic for Top {
    fn state_energy(&mut self, q: &[f64; 4], p: &[f64; 3]) -> (f64, f64) {
        let kinetic = (0..3).map(|k| 0.5 * p[k] * p[k] / TOP[k]).sum();
        (kinetic, self.0 * turned(q, [0.0, 0.0, 1.0], -1.0)[2])
    }
}

/// A body in a fluid that is carried along (Kirchhoff), in gravity: momenta of a pose that do not point along its velocity.
#[derive(Clone, Debug)]
struct Body;
const ADDED: [f64; 6] = [1.0, 2.0, 3.0, 0.5, 0.8, 0.9];
const POSE: [Group; 1] = [Group::new(GroupKind::Pose, 0, 0)];

impl System for Body {
    type Scalar = f64;
    type Coordinates = [f64; 7];
    type Momenta = [f64; 6];

    fn neutral(&self) -> [f64; 7] {
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    }
    fn rest(&self) -> [f64; 6] {
        [0.0; 6]
    }
    fn groups(&self) -> &[Group] {
        &POSE
    }
    fn state_rates(&mut self, _t: f64, q: &[f64; 7], p: &[f64; 6], qd: &mut [f64; 7], pd: &mut [f64; 6]) {
        let (v, w) = ([0, 1, 2].map(|k| p[k] / ADDED[k]), [0, 1, 2].map(|k| p[k + 3] / ADDED[k + 3]));
        qd[..3].copy_from_slice(&turned(&q[3..], v, -1.0));
        spin(&q[3..], w, &mut qd[3..]);
        let (linear, angular) = ([p[0], p[1], p[2]], [p[3], p[4], p[5]]);
        let weight = turned(&q[3..], [0.0, 0.0, -9.81], 1.0);
        let (force, along, turn) = (cross(linear, w), cross(linear, v), cross(angular, w));
        for k in 0..3 {
            pd[k] = force[k] + weight[k];
            pd[k + 3] = turn[k] + along[k];
        }
    }
    fn coordinate_rates(&self, _q: &[f64; 7], _v: &[f64; 6], _qd: &mut [f64; 7]) {}
}

impl Energetic for Body {
    fn state_energy(&mut self, q: &[f64; 7], p: &[f64; 6]) -> (f64, f64) {
        ((0..6).map(|k| 0.5 * p[k] * p[k] / ADDED[k]).sum(), 9.81 * q[2])
    }
}

/// The same in the plane: along its sides it carries different masses.
#[derive(Clone, Debug)]
struct Sledge;
const PLANE: [Group; 1] = [Group::new(GroupKind::Plane, 0, 0)];

impl System for Sledge {
    type Scalar = f64;
    type Coordinates = [f64; 3];
    type Momenta = [f64; 3];

    fn neutral(&self) -> [f64; 3] {
        [0.0; 3]
    }
    fn rest(&self) -> [f64; 3] {
        [0.0; 3]
    }
    fn groups(&self) -> &[Group] {
        &PLANE
    }
    fn state_rates(&mut self, _t: f64, q: &[f64; 3], p: &[f64; 3], qd: &mut [f64; 3], pd: &mut [f64; 3]) {
        let (s, c) = q[2].sin_cos();
        let (v, w) = ([p[0], 0.4 * p[1]], 2.0 * p[2]);
        *qd = [c * v[0] - s * v[1], s * v[0] + c * v[1], w];
        *pd = [w * p[1] - s * 9.81, -w * p[0] - c * 9.81, p[0] * v[1] - p[1] * v[0]];
    }
    fn coordinate_rates(&self, _q: &[f64; 3], _v: &[f64; 3], _qd: &mut [f64; 3]) {}
}

impl Energetic for Sledge {
    fn state_energy(&mut self, q: &[f64; 3], p: &[f64; 3]) -> (f64, f64) {
        (0.5 * (p[0] * p[0] + 0.4 * p[1] * p[1] + 2.0 * p[2] * p[2]), 9.81 * q[1])
    }
}

fn pendulum<S: Real>() -> (Pendulum<S>, [S; 2], [S; 2]) {
    (Pendulum(core::marker::PhantomData), [1.0, -0.4].map(S::constant), [0.3, 0.7].map(S::constant))
}

fn top(weight: f64) -> (Top, [f64; 4], [f64; 3]) {
    (Top(weight), [0.1, 0.5, 0.1, 0.854_400_374_531_753_1], [0.3, -0.5, 4.0])
}

fn body() -> (Body, [f64; 7], [f64; 6]) {
    (Body, [0.2, -0.3, 0.4, 0.1, 0.5, 0.1, 0.854_400_374_531_753_1], [1.0, -0.6, 0.8, 0.3, -0.5, 0.7])
}

/// State after `n` steps, coordinates before momenta.
fn walk<Y: System<Scalar = f64>>(
    mut method: impl Stepper<Y>,
    (mut y, mut q, mut p): (Y, Y::Coordinates, Y::Momenta),
    h: f64,
    n: u32,
) -> Vec<f64> {
    for i in 0..n {
        method.step(&mut y, f64::from(i) * h, h, &mut q, &mut p).expect("a step");
    }
    q.as_ref().iter().chain(p.as_ref()).copied().collect()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

/// The order that halvings of the step show: over a time of 2 s with the first step, and in the first `K + 2` steps, whose
/// error is of one order more, with the second one. Errors near round-off do not count.
fn orders<Y: System<Scalar = f64>, M: Stepper<Y>>(
    make: fn(&Y) -> M,
    scene: &dyn Fn() -> (Y, Y::Coordinates, Y::Momenta),
    [h, h_first]: [f64; 2],
) -> [f64; 2] {
    let make = || make(&scene().0);
    let error = |h: f64, n: u32| {
        // A method of another kind tells.
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
        // Steps so large that the order shows before round-off does.
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
        // Five of the start with nine more each.
        let expected = i + 1 + 9 * (i + 1).min(5);
        assert_eq!(method.statistics().evaluations, expected);
    }
    assert_eq!(method.statistics().steps, 100);
    let mut moulton = Abm6::new(&y);
    walk_on(&mut moulton, &mut y, 0.005, 100, &mut (start_q, start_p));
    assert_eq!(moulton.statistics().evaluations, 5 * 10 + 95 * 2);

    // Another step, or a state from elsewhere: as if begun there, to the last bit.
    let elsewhere = ([q[0] + 1e-9, q[1]], p);
    for (h, state) in [(0.004, (q, p)), (0.005, elsewhere)] {
        let (mut old, mut new) = (method.clone(), Ab6::new(&y));
        let (mut a, mut b) = (state, state);
        let before = old.statistics().evaluations;
        walk_on(&mut old, &mut y, h, 20, &mut a);
        walk_on(&mut new, &mut y, h, 20, &mut b);
        assert_eq!(a, b);
        // The start rate is not known before either.
        assert_eq!(old.statistics().evaluations - before, new.statistics().evaluations);
    }
    // A step that differs by rounding goes on.
    let before = method.statistics().evaluations;
    method.step(&mut y, 0.0, 0.005 * (1.0 + 1e-12), &mut q, &mut p).unwrap();
    assert_eq!(method.statistics().evaluations - before, 1);
}

fn walk_on<Y: System, M: Stepper<Y>>(
    method: &mut M,
    y: &mut Y,
    h: Y::Scalar,
    n: u32,
    (q, p): &mut (Y::Coordinates, Y::Momenta),
) where
    Y::Scalar: Real,
{
    for _ in 0..n {
        method.step(y, Y::Scalar::zero(), h, q, p).expect("a step");
    }
}

#[test]
fn a_solver_asks_no_more_evaluations() {
    let (mut y, q, p) = pendulum::<f64>();
    let method = Ab4::new(&y);
    let mut solver = Solver::new(&mut y, method, Step::Fixed(0.005), 0.0, &q, &p).unwrap();
    solver.run(&mut y, 1.0).unwrap();
    assert_eq!(solver.statistics().evaluations, 200 + 3 * 4);
    let (mut a, mut b) = ((q, p), (q, p));
    solver.state(&y, &mut a.0, &mut a.1);
    walk_on(&mut Ab4::new(&y), &mut y, 0.005, 200, &mut b);
    // The last step is what is left of the time: it differs by rounding.
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
        println!("{off:e}");
        assert!(off < 5e-12, "{off}");
        assert!(apart(&q, &state.0) > 0.1);
    }
    let y = top(0.0).0;
    run(&mut Ab4::new(&y), 100_000);
    run(&mut Ab6::new(&y), 100_000);
    run(&mut Abm8::new(&y), 100_000);
    run(&mut VariableAdams::new(&y), 100_000);
}

/// State at 5 s by a tolerance, and the work.
fn solve<Y: System<Scalar = f64>>(
    method: impl Stepper<Y>,
    (mut y, mut q, mut p): (Y, Y::Coordinates, Y::Momenta),
    tolerance: f64,
) -> (Vec<f64>, mbd_runtime::integrate::Statistics) {
    let step = Step::Adaptive(Tolerances::new(tolerance));
    let mut solver = Solver::new(&mut y, method, step, 0.0, &q, &p).expect("a state");
    solver.run(&mut y, 5.0).expect("a run");
    solver.state(&y, &mut q, &mut p);
    (q.as_ref().iter().chain(p.as_ref()).copied().collect(), solver.statistics())
}

fn tolerances<Y: System<Scalar = f64>>(scene: impl Fn() -> (Y, Y::Coordinates, Y::Momenta)) {
    let reference = walk(Verner9::new(&scene().0), scene(), 1e-3, 5000);
    for k in 3..=12 {
        let tolerance = 10_f64.powi(-k);
        let (state, work) = solve(VariableAdams::new(&scene().0), scene(), tolerance);
        let error = apart(&state, &reference) / tolerance;
        let (other, more) = solve(Verner9::new(&scene().0), scene(), tolerance);
        let other = apart(&other, &reference) / tolerance;
        println!("{tolerance:e} {error:.1} {other:.1} {} {}", work.evaluations, more.evaluations);
        // One evaluation at the prediction, one at the start; two more for the first step.
        let tries = work.steps + work.rejections;
        assert_eq!(work.evaluations, tries + work.steps + 1, "{work:?}");
    }
}

#[test]
fn tolerances_are_met() {
    tolerances(pendulum::<f64>);
    tolerances(|| top(3.0));
    tolerances(body);
}
