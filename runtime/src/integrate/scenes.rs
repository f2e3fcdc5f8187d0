//! Mechanisms of the tests.

extern crate std;

use std::vec;
use std::vec::Vec;

use crate::spatial::{Axis, ElementaryTransform, RigidInertia};
use crate::system::{Differentiable, LieJoint, Real, StateDerivatives, System};
use crate::tree::{Dims, Elimination, Kind, Node, Passive, Source, Tree};
use crate::{Interpreter, Scalar};

/// A body: mass, centre of mass, moments of inertia about it.
fn body<S: Scalar>(mass: f64, at: [f64; 3], own: [f64; 3]) -> RigidInertia<S> {
    let c = S::constant;
    let square = at[0] * at[0] + at[1] * at[1] + at[2] * at[2];
    let diagonal = |k: usize| c(own[k] + mass * (square - at[k] * at[k]));
    let product = |i: usize, j: usize| c(-mass * at[i] * at[j]);
    RigidInertia {
        mass: c(mass),
        moment: at.map(|x| c(mass * x)),
        inertia: [diagonal(0), product(0, 1), product(0, 2), diagonal(1), product(1, 2), diagonal(2)],
    }
}

/// A joint on the node before the last `back` ones, 0.4 m and a turn away from it.
pub fn joint<S: Scalar>(tree: &mut Tree<S>, back: usize, kind: Kind<S>, stiffness: f64, damping: f64) {
    let o = S::zero();
    let k = tree.nodes.len();
    let (s, c) = (S::constant(0.6), S::constant(0.8));
    let place = vec![
        ElementaryTransform::Shift { axis: Axis::X, r: S::constant(0.4) },
        ElementaryTransform::Turn { axis: Axis::X, c, s },
    ];
    let passive = Passive { damping: S::constant(damping), stiffness: S::constant(stiffness), rest: o, armature: o };
    let size = 1.0 + 0.2 * k as f64;
    tree.nodes.push(Node {
        parent: (k + 1).checked_sub(back + 2),
        place,
        source: Source::State { q: tree.dims.nq, v: tree.dims.nv },
        ratio: S::one(),
        offset: o,
        phase: o,
        quarter: 0,
        slide: o,
        slides: false,
        inertia: body(size, [0.2, 0.05, -0.1], [0.03, 0.05, 0.06]),
        passive: vec![passive; kind.nv()],
        kind,
        elimination: Elimination::default(),
    });
    tree.dims.nq += kind.nq();
    tree.dims.nv += kind.nv();
}

pub fn empty<S: Scalar>() -> Tree<S> {
    Tree {
        nodes: vec![],
        dims: Dims::default(),
        unknowns: vec![],
        solve_at_ground: vec![],
        ground_moment: [S::zero(); 3],
        wrenches: vec![],
        constraints: vec![],
        tolerance: S::rank_tolerance(),
        early_tolerance: None,
        row_factors: None,
        frames: vec![],
        joint_nodes: vec![],
        matrix_depth: 0,
        accelerations: None,
    }
}

/// A chain of joints.
pub fn chain<S: Scalar>(kinds: &[Kind<S>], stiffness: f64, damping: f64) -> Tree<S> {
    let mut tree = empty();
    for kind in kinds {
        joint(&mut tree, 0, *kind, stiffness, damping);
    }
    tree
}

pub fn gravity<S: Scalar>() -> [S; 3] {
    [S::zero(), S::constant(-6.0), S::constant(-7.7)]
}

/// A mechanism with a state in motion.
#[derive(Clone)]
pub struct Scene<S> {
    pub name: &'static str,
    pub i: Interpreter<S>,
    pub q: Vec<S>,
    pub p: Vec<S>,
}

impl<S: Real> Scene<S> {
    pub fn new(name: &'static str, tree: Tree<S>, gravity: [S; 3], seed: u32) -> Self {
        let dims = tree.dims;
        let mut i = Interpreter::new(tree, gravity);
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            S::constant(f64::from(state >> 8) / f64::from(1 << 23) - 1.0)
        };
        let mut q = i.neutral();
        for q in &mut q {
            *q = *q + S::constant(0.5) * random();
        }
        for at in i.quaternions().collect::<Vec<_>>() {
            let norm = q[at..at + 4].iter().fold(S::zero(), |sum, x| sum + *x * *x).sqrt();
            for x in &mut q[at..at + 4] {
                *x = *x / norm;
            }
        }
        let v: Vec<S> = (0..dims.nv).map(|_| random()).collect();
        let mut p = vec![S::zero(); dims.nv];
        i.momenta(&q, &v, &mut p);
        Scene { name, i, q, p }
    }

    pub fn energy(&self, q: &[S], p: &[S]) -> S {
        let (kinetic, potential) = self.i.clone().energy(q, p);
        kinetic + potential
    }
}

/// Revolute joints and a prismatic one; a spherical joint and revolute joints; a floating tree with a planar and a
/// spherical joint.
pub fn three<S: Real>() -> [Scene<S>; 3] {
    let mixed = chain(&[Kind::Revolute, Kind::Prismatic, Kind::Revolute], 40.0, 0.0);
    let ball = chain(&[Kind::Spherical, Kind::Revolute], 5.0, 0.0);
    let mut free = chain(&[Kind::Floating, Kind::Planar], 5.0, 0.0);
    joint(&mut free, 1, Kind::Spherical, 0.0, 0.0);
    [
        Scene::new("revolute and prismatic", mixed, gravity(), 1),
        Scene::new("spherical and revolute", ball, gravity(), 2),
        Scene::new("floating, planar, spherical", free, gravity(), 3),
    ]
}

/// A mass on a spring and a damper, pushed by `force cos(ω t)`: `ẋ = p / m`, `ṗ = −k x − d p / m + force cos(ω t)`.
#[derive(Clone, Copy, Debug)]
pub struct Oscillator {
    pub mass: f64,
    pub stiffness: f64,
    pub damping: f64,
    pub force: f64,
    pub rate: f64,
}

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

    fn rates_at(&mut self, t: f64, q: &[f64; 1], p: &[f64; 1], qd: &mut [f64; 1], pd: &mut [f64; 1]) {
        *qd = [p[0] / self.mass];
        *pd = [-self.stiffness * q[0] - self.damping * p[0] / self.mass + self.force * libm::cos(self.rate * t)];
    }

    fn coordinate_rates(&self, _: &[f64; 1], v: &[f64; 1], qd: &mut [f64; 1]) {
        *qd = *v;
    }
}

impl Differentiable for Oscillator {
    type Square = [[f64; 1]; 1];

    fn square(&self) -> [[f64; 1]; 1] {
        [[0.0]]
    }

    fn depends_on_time(&self) -> bool {
        self.force != 0.0
    }

    fn rate_derivatives(
        &mut self,
        t: f64,
        q: &[f64; 1],
        p: &[f64; 1],
        out: &mut StateDerivatives<[f64; 1], [[f64; 1]; 1]>,
    ) {
        self.rates_at(t, q, p, &mut out.v, &mut out.pd);
        out.dv_dq = [[0.0]];
        out.dv_dp = [[1.0 / self.mass]];
        out.dpd_dq = [[-self.stiffness]];
        out.dpd_dp = [[-self.damping / self.mass]];
    }
}
