//! Motions that are stiff because bodies slide slowly: friction turns the slip within `|v| m/(µ N)`.

use mbd_codegen::plan::Plan;
use mbd_runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use mbd_runtime::contact::{Hybrid, Mode, WithContacts};
use mbd_runtime::integrate::{AutoSwitch, Dop853, Radau5, Statistics, Step, Stepper, Tolerances};
use mbd_runtime::{Conjugate, Differentiable};

use super::known::random;
use super::scene::{model, Mechanism};

type System = WithContacts<Mechanism>;

/// A point that creeps down a slope: its weight, friction and a damper leave it a speed of 0.1 mm/s. It starts across.
const CREEPING: &str = r#"
name = "creeping_point"
gravity = [3, 0, -9]
[[body]]
name = "rail"
mass = 0.1
inertia = [0.1, 0.1, 0.1]
[[body]]
name = "cart"
mass = 0.1
inertia = [0.1, 0.1, 0.1]
[[body]]
name = "block"
mass = 0.3
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "x"
type = "prismatic"
parent = "ground"
child = "rail"
axis = [1, 0, 0]
damping = 1.5
[[joint]]
name = "y"
type = "prismatic"
parent = "rail"
child = "cart"
axis = [0, 1, 0]
damping = 1
[[joint]]
name = "z"
type = "prismatic"
parent = "cart"
child = "block"
axis = [0, 0, 1]
[[shape]]
name = "floor"
type = "plane"
[[shape]]
name = "foot"
type = "point"
body = "block"
[contacts]
pairs = "all"
friction = 0.5555
"#;

/// The state after 0.2 s, with what it took.
fn creep<M: Stepper<System>>(method: impl FnOnce(&System) -> M) -> (Vec<f64>, Statistics) {
    let plan = Plan::new(&model(CREEPING), 1e-9);
    let mut mechanism: Mechanism = plan.default_contact_interpreter();
    let (q, v) = (vec![0.0; 3], vec![1.01e-4, 1e-4, 0.0]);
    let mut p = v.clone();
    mechanism.conjugate_momenta(&q, &v, &mut p);
    let mut system = WithContacts::new(mechanism);
    let close = Projection::new(&system, Stabilisation::Mass, Effort { energy: f64::INFINITY, ..Effort::default() });
    let method = WithPostStep::new(&system, method(&system), close);
    let step = Step::Adaptive(Tolerances::new(1e-9));
    let mut motion = Hybrid::new(&mut system, method, step, 0.0, &q, &p).unwrap();
    motion.run(&mut system, 0.2, &mut ()).unwrap();
    assert_eq!(system.modes(), [Mode::Slide]);
    let (mut q, mut p) = (q, p);
    motion.state(&system, &mut q, &mut p);
    (q, motion.statistics())
}

#[test]
fn slow_slip_does_not_shorten_steps() {
    let (slow, explicit) = creep(Dop853::new);
    let (fast, switched) = creep(|system| AutoSwitch::new(system, Dop853::new(system), Radau5::new(system)));
    let off = slow.iter().zip(&fast).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("{off:e} m off; {explicit:?}; {switched:?}");
    // It moves by 2e-5 m.
    assert!(slow[0] > 1e-5 && off <= 1e-12, "{slow:?} {fast:?}");
    assert!(5 * switched.steps < explicit.steps, "{switched:?} beside {explicit:?}");
    assert!(switched.jacobians > 0);
}

#[test]
fn what_is_not_stiff_is_left_to_the_explicit_method() {
    // A quadruped that falls, turns and swings its legs: nothing slides, and steps are as long as errors allow.
    let plan = Plan::new(&model(include_str!("../../../models/contacts/quadruped.toml")), 1e-9);
    let run = |switch: bool| {
        let mechanism: Mechanism = plan.default_contact_interpreter();
        let mut system = WithContacts::new(mechanism);
        let (mut q, mut p) = (plan.start(), vec![0.0; plan.dims.nv]);
        q[2] += 1.0;
        let mut next = random(9);
        let v: Vec<f64> = p.iter().map(|_| 2.0 * next()).collect();
        system.conjugate_momenta(&q, &v, &mut p);
        let step = Step::Adaptive(Tolerances::new(1e-10));
        let explicit = Dop853::new(&system);
        let result = if switch {
            let method = AutoSwitch::new(&system, explicit, Radau5::new(&system));
            let mut motion = Hybrid::new(&mut system, method, step, 0.0, &q, &p).unwrap();
            motion.run(&mut system, 0.3, &mut ()).unwrap();
            motion.state(&system, &mut q, &mut p);
            motion.statistics()
        } else {
            let mut motion = Hybrid::new(&mut system, explicit, step, 0.0, &q, &p).unwrap();
            motion.run(&mut system, 0.3, &mut ()).unwrap();
            motion.state(&system, &mut q, &mut p);
            motion.statistics()
        };
        (q, p, result.steps, result.jacobians)
    };
    let (plain, switched) = (run(false), run(true));
    assert_eq!(plain, switched);
}

#[test]
fn derivatives_by_differences_are_those_by_sweeps() {
    let plan = Plan::new(&model(include_str!("../../../models/contacts/quadruped.toml")), 1e-9);
    let mut mechanism: Mechanism = plan.default_contact_interpreter();
    let mut next = random(3);
    let mut q = plan.start();
    q.iter_mut().for_each(|x| *x += 0.1 * next());
    q[2] += 1.0;
    let size = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
    q[3..7].iter_mut().for_each(|x| *x /= size);
    let v: Vec<f64> = (0..plan.dims.nv).map(|_| next()).collect();
    let mut p = v.clone();
    mechanism.conjugate_momenta(&q, &v, &mut p);
    let mut exact = mechanism.zero_derivatives();
    mechanism.rate_derivatives(0.0, &q, &p, &mut exact);
    let mut system = WithContacts::new(mechanism);
    let mut near = system.zero_derivatives();
    system.rate_derivatives(0.0, &q, &p, &mut near);
    for (a, b) in exact.blocks().into_iter().flatten().zip(near.blocks().into_iter().flatten()) {
        let largest = a.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            // Forward differences of half the digits; momenta that are small beside the largest have fewer.
            assert!((a - b).abs() <= 1e-4 * largest, "{a} {b} of {largest}");
        }
    }
}
