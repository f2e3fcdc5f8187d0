//! Mechanisms written by hand, and functions that integrate them.

pub use crate::systems::largest_difference as apart;
use mbd_runtime::integrate::Stepper;
use mbd_runtime::system::{LieGroup, LieJoint};
use mbd_runtime::{Energetic, Real, Scalar, System};

/// A double pendulum of two bars of length and mass 1, with all mass at the ends. `H` is not a sum of functions of `q`
/// and `p`.
#[derive(Clone, Debug)]
pub struct Pendulum<S>(core::marker::PhantomData<S>);

impl<S: Real> System for Pendulum<S> {
    type Scalar = S;
    type Coordinates = [S; 2];
    type Momenta = [S; 2];

    fn neutral(&self) -> [S; 2] {
        [S::zero(); 2]
    }
    fn zero_momenta(&self) -> [S; 2] {
        [S::zero(); 2]
    }
    fn lie_joints(&self) -> &[LieJoint] {
        &[]
    }
    fn rates_at(&mut self, _t: S, q: &[S; 2], p: &[S; 2], qd: &mut [S; 2], pd: &mut [S; 2]) {
        let g = S::constant(9.81);
        let (s, c) = (q[0] - q[1]).sin_cos();
        let d = S::one() / (S::one() + s * s);
        *qd = [(p[0] - c * p[1]) * d, (p[1] + p[1] - c * p[0]) * d];
        // The derivative of the kinetic energy with respect to the difference of the angles, at constant momenta.
        let turn = s * qd[0] * qd[1];
        *pd = [-turn - (g + g) * q[0].sin_cos().0, turn - g * q[1].sin_cos().0];
    }
    fn coordinate_rates(&self, _q: &[S; 2], v: &[S; 2], qd: &mut [S; 2]) {
        *qd = *v;
    }
}

impl<S: Real> Energetic for Pendulum<S> {
    fn energies(&mut self, q: &[S; 2], p: &[S; 2]) -> (S, S) {
        let (mut v, mut pd) = ([S::zero(); 2], [S::zero(); 2]);
        self.rates_at(S::zero(), q, p, &mut v, &mut pd);
        let g = S::constant(9.81);
        let kinetic = S::constant(0.5) * (v[0] * p[0] + v[1] * p[1]);
        (kinetic, -(g + g) * q[0].sin_cos().1 - g * q[1].sin_cos().1)
    }
}

/// The cross product `a × b`.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `Rᵀ u` for the rotation `R` of the unit quaternion `q`; `R u` if `sign` is −1.
pub fn turned(q: &[f64], u: [f64; 3], sign: f64) -> [f64; 3] {
    let r = [sign * q[0], sign * q[1], sign * q[2]];
    let t = cross(u, r).map(|x| 2.0 * x);
    let tt = cross(t, r);
    [0, 1, 2].map(|k| u[k] + q[3] * t[k] + tt[k])
}

pub fn spin(q: &[f64], w: [f64; 3], qd: &mut [f64]) {
    let x = cross([q[0], q[1], q[2]], w);
    for k in 0..3 {
        qd[k] = 0.5 * (q[3] * w[k] + x[k]);
    }
    qd[3] = -0.5 * (q[0] * w[0] + q[1] * w[1] + q[2] * w[2]);
}

/// A top on a spherical joint with the given product of weight and arm. If it is zero, the top is a free rotor.
#[derive(Clone, Debug)]
pub struct Top(f64);
pub const TOP: [f64; 3] = [1.0, 2.0, 2.5];
pub const BALL: [LieJoint; 1] = [LieJoint::new(LieGroup::SO3, 0, 0)];

impl System for Top {
    type Scalar = f64;
    type Coordinates = [f64; 4];
    type Momenta = [f64; 3];

    fn neutral(&self) -> [f64; 4] {
        [0.0, 0.0, 0.0, 1.0]
    }
    fn zero_momenta(&self) -> [f64; 3] {
        [0.0; 3]
    }
    fn lie_joints(&self) -> &[LieJoint] {
        &BALL
    }
    fn rates_at(&mut self, _t: f64, q: &[f64; 4], p: &[f64; 3], qd: &mut [f64; 4], pd: &mut [f64; 3]) {
        let w = [0, 1, 2].map(|k| p[k] / TOP[k]);
        spin(q, w, qd);
        let (torque, turn) = (cross([0.0, 0.0, self.0], turned(q, [0.0, 0.0, -1.0], 1.0)), cross(*p, w));
        *pd = [0, 1, 2].map(|k| turn[k] + torque[k]);
    }
    fn coordinate_rates(&self, _q: &[f64; 4], _v: &[f64; 3], _qd: &mut [f64; 4]) {}
}

impl Energetic for Top {
    fn energies(&mut self, q: &[f64; 4], p: &[f64; 3]) -> (f64, f64) {
        let kinetic = (0..3).map(|k| 0.5 * p[k] * p[k] / TOP[k]).sum();
        (kinetic, self.0 * turned(q, [0.0, 0.0, 1.0], -1.0)[2])
    }
}

/// A falling body that accelerates the fluid around it (Kirchhoff's equations). Its linear momentum is not parallel to
/// its velocity.
#[derive(Clone, Debug)]
pub struct Body;
pub const ADDED: [f64; 6] = [1.0, 2.0, 3.0, 0.5, 0.8, 0.9];
pub const POSE: [LieJoint; 1] = [LieJoint::new(LieGroup::SE3, 0, 0)];

impl System for Body {
    type Scalar = f64;
    type Coordinates = [f64; 7];
    type Momenta = [f64; 6];

    fn neutral(&self) -> [f64; 7] {
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    }
    fn zero_momenta(&self) -> [f64; 6] {
        [0.0; 6]
    }
    fn lie_joints(&self) -> &[LieJoint] {
        &POSE
    }
    fn rates_at(&mut self, _t: f64, q: &[f64; 7], p: &[f64; 6], qd: &mut [f64; 7], pd: &mut [f64; 6]) {
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
    fn energies(&mut self, q: &[f64; 7], p: &[f64; 6]) -> (f64, f64) {
        ((0..6).map(|k| 0.5 * p[k] * p[k] / ADDED[k]).sum(), 9.81 * q[2])
    }
}

/// Such a body in the plane, with different masses of fluid along its two axes.
#[derive(Clone, Debug)]
pub struct Sledge;
pub const PLANE: [LieJoint; 1] = [LieJoint::new(LieGroup::SE2, 0, 0)];

impl System for Sledge {
    type Scalar = f64;
    type Coordinates = [f64; 3];
    type Momenta = [f64; 3];

    fn neutral(&self) -> [f64; 3] {
        [0.0; 3]
    }
    fn zero_momenta(&self) -> [f64; 3] {
        [0.0; 3]
    }
    fn lie_joints(&self) -> &[LieJoint] {
        &PLANE
    }
    fn rates_at(&mut self, _t: f64, q: &[f64; 3], p: &[f64; 3], qd: &mut [f64; 3], pd: &mut [f64; 3]) {
        let (s, c) = q[2].sin_cos();
        let (v, w) = ([p[0], 0.4 * p[1]], 2.0 * p[2]);
        *qd = [c * v[0] - s * v[1], s * v[0] + c * v[1], w];
        *pd = [w * p[1] - s * 9.81, -w * p[0] - c * 9.81, p[0] * v[1] - p[1] * v[0]];
    }
    fn coordinate_rates(&self, _q: &[f64; 3], _v: &[f64; 3], _qd: &mut [f64; 3]) {}
}

impl Energetic for Sledge {
    fn energies(&mut self, q: &[f64; 3], p: &[f64; 3]) -> (f64, f64) {
        (0.5 * (p[0] * p[0] + 0.4 * p[1] * p[1] + 2.0 * p[2] * p[2]), 9.81 * q[1])
    }
}

pub fn pendulum<S: Real>() -> (Pendulum<S>, [S; 2], [S; 2]) {
    (Pendulum(core::marker::PhantomData), [1.0, -0.4].map(S::constant), [0.3, 0.7].map(S::constant))
}

pub fn top(weight: f64) -> (Top, [f64; 4], [f64; 3]) {
    (Top(weight), [0.1, 0.5, 0.1, 0.854_400_374_531_753_1], [0.3, -0.5, 4.0])
}

pub fn body() -> (Body, [f64; 7], [f64; 6]) {
    (Body, [0.2, -0.3, 0.4, 0.1, 0.5, 0.1, 0.854_400_374_531_753_1], [1.0, -0.6, 0.8, 0.3, -0.5, 0.7])
}

/// State after `n` steps, coordinates before momenta.
pub fn walk<Y: System<Scalar = f64>>(
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

pub fn walk_on<Y: System, M: Stepper<Y>>(
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
