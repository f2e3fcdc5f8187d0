//! Without forces from outside, every method conserves the momentum to round-off.
//!
//! Momenta are integrated in outer axes ([`mbd_runtime::integrate::chart`]), where they are constants, so that a step
//! changes them by rounding only. The bounds follow from this: a step rounds each sum once, by half a unit in the last
//! place, and adds `h` times the remainder of rates that cancel, some units in the last place of the largest term. The
//! signs of such errors are random, so after `n` steps they amount to `√n` times that.

use mbd_codegen::model::{Gravity, JointKind, Placement, Value};
use mbd_codegen::read;
use mbd_codegen::search;
use mbd_runtime::integrate::{
    Euler, Gauss6, ImplicitMidpoint, Midpoint, Radau5, Rk4, Rodas5P, SemiImplicitEuler, StepDoubling, Stepper, Verner9,
};
use mbd_runtime::spatial::{add3, cross, quaternion_matrix, Vec3};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::system::LieGroup;
use mbd_runtime::{Interpreter, System};
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::random_state;

type Any = Box<dyn Stepper<Interpreter<f64>>>;

fn methods(i: &Interpreter<f64>) -> Vec<(&'static str, Any)> {
    vec![
        ("Euler", Box::new(Euler::new(i)) as Any),
        ("semi-implicit Euler", Box::new(SemiImplicitEuler::new(i))),
        ("midpoint", Box::new(Midpoint::new(i))),
        ("RK4", Box::new(Rk4::new(i))),
        ("RK4 doubled, extrapolated", Box::new(StepDoubling::extrapolated(i, Rk4::new(i)))),
        ("implicit midpoint", Box::new(ImplicitMidpoint::new(i))),
        ("Gauss 6", Box::new(Gauss6::new(i))),
        ("Radau 5", Box::new(Radau5::new(i))),
        ("Rodas5P", Box::new(Rodas5P::new(i))),
        ("Verner 9", Box::new(Verner9::new(i))),
    ]
}

fn turn(q: &[f64], v: Vec3<f64>) -> Vec3<f64> {
    quaternion_matrix([q[0], q[1], q[2], q[3]]).map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn norm(v: Vec3<f64>) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn off(a: Vec3<f64>, b: Vec3<f64>) -> f64 {
    norm([0, 1, 2].map(|k| a[k] - b[k]))
}

/// A rotor with three different moments of inertia, supported at its centre of mass. It rotates about the axis of the
/// middle moment of inertia, so that it flips over again and again (Dzhanibekov effect).
fn rotor() -> (Interpreter<f64>, Vec<f64>, Vec<f64>) {
    let text = r#"
        gravity = [0, 0, 0]
        [[body]]
        name = "rotor"
        mass = 0.5
        inertia = [1e-3, 2e-3, 2.5e-3]
        [[joint]]
        name = "centre"
        type = "spherical"
        child = "rotor"
    "#;
    let read = read::model("rotor.toml", text, &Default::default()).unwrap_or_else(|findings| panic!("{findings}"));
    let plan = search::plan(&read.model, Default::default());
    let mut i: Interpreter<f64> = plan.interpreter(&[]);
    let q = [0.1, -0.5, 0.5, 0.7];
    let length = q.iter().map(|x: &f64| x * x).sum::<f64>().sqrt();
    let q: Vec<f64> = q.iter().map(|x| x / length).collect();
    let mut p = vec![0.0; 3];
    i.momenta(&q, &[0.01, 10.0, 0.01], &mut p);
    (i, q, p)
}

/// Largest relative change of the angular momentum over `steps` steps of `h` s, and the number of times that the rotor
/// flips.
fn spin(method: &mut dyn Stepper<Interpreter<f64>>, steps: u64, h: f64) -> (f64, u64) {
    let (mut i, mut q, mut p) = rotor();
    let outer = |q: &[f64], p: &[f64]| turn(q, [p[0], p[1], p[2]]);
    let start = outer(&q, &p);
    let (mut change, mut flips, mut side) = (0.0_f64, 0, p[1] > 0.0);
    for k in 0..steps {
        method.step(&mut i, k as f64 * h, h, &mut q, &mut p).unwrap();
        change = change.max(off(outer(&q, &p), start));
        if (p[1] > 0.0) != side {
            (side, flips) = (!side, flips + 1);
        }
    }
    (change / norm(start), flips)
}

/// Bound of the change: per step half a unit in the last place for the sum, and a dozen times `h ω` units for the rate.
/// These random errors grow with the square root of the steps; the factor four makes excesses unlikely. Eight units
/// more are for the conversion of the result to body axes and back.
fn spin_bound(steps: u64, h: f64) -> f64 {
    let turn = h * 10.0;
    f64::EPSILON * (4.0 * (steps as f64).sqrt() * (0.5 + 12.0 * turn) + 8.0)
}

#[test]
fn angular_momentum_of_a_free_rotor() {
    let (i, ..) = rotor();
    for (name, mut method) in methods(&i) {
        let h = 1e-3;
        let steps = if ["semi-implicit Euler", "RK4", "Verner 9"].contains(&name) { 100_000 } else { 20_000 };
        let (change, flips) = spin(&mut *method, steps, h);
        let bound = spin_bound(steps, h);
        println!("{name}: {change:.1e} of {bound:.1e}, {flips} flips");
        assert!(change < bound, "{name}: {change:e} {bound:e}");
        // The rotor must flip over: otherwise a method that does not change momenta in body axes would pass.
        assert!(flips >= steps / 5000, "{name}: {flips}");
    }
}

/// Run it by `cargo test --release -p mbd-testing --test integrators free_motion -- --ignored --nocapture`.
#[test]
#[ignore = "ten million steps each take a minute and more"]
fn angular_momentum_over_ten_million_steps() {
    let (i, ..) = rotor();
    let methods: [(&str, Any); 3] = [
        ("RK4", Box::new(Rk4::new(&i))),
        ("semi-implicit Euler", Box::new(SemiImplicitEuler::new(&i))),
        ("Verner 9", Box::new(Verner9::new(&i))),
    ];
    for (name, mut method) in methods {
        let (steps, h) = (10_000_000, 1e-3);
        let (change, flips) = spin(&mut *method, steps, h);
        let bound = spin_bound(steps, h);
        println!("{name}: {change:.1e} of {bound:.1e}, {flips} flips");
        assert!(change < bound, "{name}: {change:e} {bound:e}");
    }
}

/// A random tree with a floating base, and the masses and centres of mass of its bodies.
struct Floating {
    i: Interpreter<f64>,
    q: Vec<f64>,
    p: Vec<f64>,
    mass: f64,
    weights: Vec<(f64, Vec3<f64>)>,
    /// First coordinate and momentum of the floating joint.
    at: (usize, usize),
}

impl Floating {
    fn new(seed: u64, gravity: f64) -> Floating {
        let kinds = [3.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 0.0, 0.0];
        let distribution =
            Distribution { bodies: (5, 5), kinds, branching: 0.5, springs: 0.5, ..Distribution::default() };
        let mut model = random_model(seed, &distribution);
        let root = model.joints.iter().position(|j| j.parent.is_none()).expect("a tree has a root");
        let joint = &mut model.joints[root];
        joint.kind = JointKind::Floating;
        joint.placement = Placement::IDENTITY;
        for list in [&mut joint.damping, &mut joint.stiffness, &mut joint.rest, &mut joint.armature] {
            list.clear();
        }
        model.gravity = Gravity::Constant([Value::ZERO, Value::ZERO, Value::Const(gravity)]);
        let plan = search::plan(&model, Default::default());
        let mut s = random_state(&plan, seed);
        s.tau.fill(0.0);
        let mut i = s.interpreter(&plan);
        let mut p = vec![0.0; s.v.len()];
        i.momenta(&s.q, &s.v, &mut p);
        let joint = *i.lie_joints().iter().find(|g| g.kind == LieGroup::SE3).expect("the base floats");
        let weights = model.joints.iter().map(|j| {
            let body = &model.bodies[j.child];
            (mbd_testing::value(body.mass, &[]), body.com.map(|x| mbd_testing::value(x, &[])))
        });
        let weights: Vec<_> = weights.collect();
        Floating { mass: weights.iter().map(|w| w.0).sum(), weights, i, q: s.q, p, at: (joint.q, joint.v) }
    }

    /// Linear momentum, and angular momentum about the ground's origin, in ground axes.
    fn momentum(&self, q: &[f64], p: &[f64]) -> [Vec3<f64>; 2] {
        let (q, p) = (&q[self.at.0..], &p[self.at.1..]);
        let linear = turn(&q[3..], [p[0], p[1], p[2]]);
        let angular = turn(&q[3..], [p[3], p[4], p[5]]);
        [linear, add3(angular, cross([q[0], q[1], q[2]], linear))]
    }

    /// Linear momentum by its definition: the sum of masses times velocities of the centres of mass.
    fn by_definition(&self, q: &[f64], p: &[f64]) -> Vec3<f64> {
        let mut i = self.i.clone();
        let mut v = vec![0.0; p.len()];
        i.velocities(q, p, &mut v);
        let mut frames = vec![FrameState::ground(); i.tree().frames.len()];
        i.frames(q, &v, &mut frames);
        frames.iter().zip(&self.weights).fold([0.0; 3], |sum, (frame, (mass, com))| {
            let local = add3(frame.velocity.lin, cross(frame.velocity.ang, *com));
            let outer = frame.rotation.map(|row| row[0] * local[0] + row[1] * local[1] + row[2] * local[2]);
            add3(sum, outer.map(|x| mass * x))
        })
    }
}

/// Number of steps for the floating trees, and the length of a step, s.
const STEPS: (u32, f64) = (500, 1e-3);

/// Without gravity, linear and angular momentum are constant; with gravity `g` the linear momentum is `P + m g t`.
fn fly(seed: u64, gravity: f64) {
    let scene = Floating::new(seed, gravity);
    let start = scene.momentum(&scene.q, &scene.p);
    let same = off(start[0], scene.by_definition(&scene.q, &scene.p));
    assert!(same < 1e-13 * norm(start[0]).max(1.0), "{same:e}");
    for (name, mut method) in methods(&scene.i) {
        let (mut i, mut q, mut p) = (scene.i.clone(), scene.q.clone(), scene.p.clone());
        let (steps, h) = STEPS;
        let (mut change, mut reach) = ([0.0_f64; 2], 0.0_f64);
        for k in 0..steps {
            method.step(&mut i, f64::from(k) * h, h, &mut q, &mut p).unwrap_or_else(|e| panic!("{seed}, {name}: {e}"));
            let [linear, angular] = scene.momentum(&q, &p);
            let fallen = scene.mass * gravity * h * f64::from(k + 1);
            change[0] = change[0].max(off(linear, add3(start[0], [0.0, 0.0, fallen])));
            change[1] = change[1].max(off(angular, start[1]));
            reach = reach.max(norm(linear)).max(norm(angular));
        }
        // Terms of the rates that cancel are products of velocities (of a few 1/s) and momenta. `h` times these terms
        // is small compared with the momenta, which a step rounds by half a unit in the last place.
        let steps = f64::from(steps);
        let bound = 4.0 * f64::EPSILON * reach * steps.sqrt();
        // Gravity adds the same momentum in every step, which many steps round in the same direction: these errors add
        // up.
        let bound = if gravity == 0.0 { bound } else { bound + 0.5 * f64::EPSILON * reach * steps };
        println!("{seed}, {name}: linear {:.1e}, angular {:.1e}, bound {bound:.1e}", change[0], change[1]);
        assert!(change[0] < bound, "{seed}, {name}: linear {:e} {bound:e}", change[0]);
        assert!(gravity != 0.0 || change[1] < bound, "{seed}, {name}: angular {:e} {bound:e}", change[1]);
    }
}

#[test]
fn momenta_of_a_floating_tree() {
    (1..4).for_each(|seed| fly(seed, 0.0));
}

#[test]
fn linear_momentum_under_gravity_grows_with_time() {
    (1..4).for_each(|seed| fly(seed, -9.81));
}
