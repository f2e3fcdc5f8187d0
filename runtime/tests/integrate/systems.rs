//! Systems whose motion is known, and functions of the tests.
#![allow(dead_code)] // Each test uses a part.

use mbd_runtime::integrate::{Solver, Step, StepError, Stepper, Tolerances};
use mbd_runtime::spatial::RigidInertia;
use mbd_runtime::system::LieJoint;
use mbd_runtime::tree::{Dims, Elimination, Kind, Node, Passive, Source, Tree};
use mbd_runtime::{Interpreter, Real, Scalar, System};

/// Equations with `N` coordinates and no Lie groups, given by their rates `(t, q, p) → (q̇, ṗ)`.
#[derive(Clone, Debug)]
pub struct Plain<S, F, const N: usize>(pub F, core::marker::PhantomData<S>);

impl<S, F, const N: usize> Plain<S, F, N>
where
    F: FnMut(S, &[S; N], &[S; N]) -> ([S; N], [S; N]),
{
    pub fn new(rates: F) -> Self {
        Plain(rates, core::marker::PhantomData)
    }
}

impl<S, F, const N: usize> System for Plain<S, F, N>
where
    S: Real,
    F: FnMut(S, &[S; N], &[S; N]) -> ([S; N], [S; N]),
{
    type Scalar = S;
    type Coordinates = [S; N];
    type Momenta = [S; N];

    fn neutral(&self) -> [S; N] {
        [S::zero(); N]
    }
    fn zero_momenta(&self) -> [S; N] {
        [S::zero(); N]
    }
    fn lie_joints(&self) -> &[LieJoint] {
        &[]
    }
    fn rates_at(&mut self, t: S, q: &[S; N], p: &[S; N], qd: &mut [S; N], pd: &mut [S; N]) {
        (*qd, *pd) = (self.0)(t, q, p);
    }
    fn coordinate_rates(&self, _q: &[S; N], v: &[S; N], qd: &mut [S; N]) {
        *qd = *v;
    }
}

/// The oscillator with `q = cos t`, `p = −sin t` if it starts from (1, 0).
pub fn oscillator() -> impl System<Scalar = f64, Coordinates = [f64; 1], Momenta = [f64; 1]> {
    Plain::new(|_, q: &[f64; 1], p: &[f64; 1]| ([p[0]], [-q[0]]))
}

/// The pendulum `q̈ = −sin q`.
pub fn pendulum<S: Real>() -> impl System<Scalar = S, Coordinates = [S; 1], Momenta = [S; 1]> {
    Plain::new(|_, q: &[S; 1], p: &[S; 1]| ([p[0]], [-q[0].sin_cos().0]))
}

/// Quarter period of the pendulum released at rest at an angle, by the arithmetic-geometric mean.
pub fn quarter<S: Real>(half_pi: S, angle: S) -> S {
    let (mut a, mut b) = (S::one(), (S::constant(0.5) * angle).sin_cos().1);
    for _ in 0..9 {
        (a, b) = (S::constant(0.5) * (a + b), (a * b).sqrt());
    }
    half_pi / a
}

/// Eccentricity of the orbit.
pub const ECCENTRICITY: f64 = 0.5;

/// A planet with period 2π. At time zero it is nearest to the sun, at (1 − e, 0).
pub fn planet() -> impl System<Scalar = f64, Coordinates = [f64; 2], Momenta = [f64; 2]> {
    Plain::new(|_, q: &[f64; 2], p: &[f64; 2]| {
        let r2 = q[0] * q[0] + q[1] * q[1];
        let r3 = r2 * r2.sqrt();
        (*p, [-q[0] / r3, -q[1] / r3])
    })
}

/// State of the planet by Kepler's equation.
pub fn orbit(t: f64) -> ([f64; 2], [f64; 2]) {
    let (e, mut u) = (ECCENTRICITY, t);
    for _ in 0..50 {
        u -= (u - e * u.sin() - t) / (1.0 - e * u.cos());
    }
    let (b, rate) = ((1.0 - e * e).sqrt(), 1.0 / (1.0 - e * u.cos()));
    ([u.cos() - e, b * u.sin()], [-u.sin() * rate, b * u.cos() * rate])
}

/// A rigid body on a spherical joint at its centre of mass, with principal moments of inertia 1, 2, 3 kg m².
pub fn rotor() -> Interpreter<f64> {
    let (o, one) = (0.0, 1.0);
    let passive = Passive { damping: o, stiffness: o, rest: o, armature: o };
    let node = Node {
        parent: None,
        place: vec![],
        kind: Kind::Spherical,
        source: Source::State { q: 0, v: 0 },
        ratio: one,
        offset: o,
        phase: o,
        quarter: 0,
        slide: o,
        slides: false,
        inertia: RigidInertia { mass: one, moment: [o; 3], inertia: [1.0, o, o, 2.0, o, 3.0] },
        passive: vec![passive; 3],
        elimination: Elimination::default(),
    };
    let tree = Tree {
        nodes: vec![node],
        dims: Dims { nq: 4, nv: 3, ..Dims::default() },
        unknowns: vec![],
        solve_at_ground: vec![],
        ground_moment: [o; 3],
        wrenches: vec![],
        constraints: vec![],
        tolerance: 1e-10,
        early_tolerance: None,
        row_factors: None,
        frames: vec![],
        joint_nodes: vec![],
        matrix_depth: 0,
        accelerations: None,
    };
    Interpreter::new(tree, [0.0; 3])
}

/// The largest absolute value; NaN where one is NaN, over which `f64::max` passes.
pub fn largest(list: impl IntoIterator<Item = f64>) -> f64 {
    list.into_iter().map(f64::abs).max_by(f64::total_cmp).unwrap_or(0.0)
}

/// The largest difference of two lists; NaN where a number of either is NaN.
#[track_caller]
pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "lists that are compared");
    largest(a.iter().zip(b).map(|(a, b)| a - b))
}

/// Root mean square of the differences of all components.
#[track_caller]
pub fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "lists that are compared");
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

/// A solver that chooses steps by a tolerance.
pub fn adaptive<Y: System, M: Stepper<Y>>(
    system: &mut Y,
    method: M,
    tolerance: f64,
    (q, p): (&Y::Coordinates, &Y::Momenta),
) -> Solver<Y, M>
where
    Y::Scalar: Real,
{
    let step = Step::Adaptive(Tolerances::new(tolerance));
    Solver::new(system, method, step, Y::Scalar::zero(), q, p).expect("a start")
}

/// State of a solver, coordinates before momenta.
pub fn state<Y: System, M: Stepper<Y>>(solver: &mut Solver<Y, M>, system: &Y) -> Vec<f64>
where
    Y::Scalar: Real,
{
    let (mut q, mut p) = (system.neutral(), system.zero_momenta());
    solver.state(system, &mut q, &mut p);
    q.as_ref().iter().chain(p.as_ref()).map(|x| x.to_f64()).collect()
}

/// Runs a solver and returns the state at the end.
pub fn run<Y: System, M: Stepper<Y>>(
    solver: &mut Solver<Y, M>,
    system: &mut Y,
    t: Y::Scalar,
) -> Result<Vec<f64>, StepError>
where
    Y::Scalar: Real,
{
    solver.run(system, t)?;
    Ok(state(solver, system))
}
