//! Motions that are stiff because bodies slide slowly: friction turns the slip within `|v| m/(µ N)`.

use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use mbd_runtime::contact::{Hybrid, Mode, WithContacts};
use mbd_runtime::integrate::{AutoSwitch, Dop853, Radau5, Statistics, Step, Stepper, Tolerances};
use mbd_runtime::{Conjugate, Differentiable};

use super::known::random;
use super::scene::{apart, model, Mechanism};

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

/// The end of a motion from `q` with velocities `v`: coordinates, momenta, modes of the contacts, and what it took.
fn run<M: Stepper<System>>(
    (plan, q, v): (&Plan, &[f64], &[f64]),
    (tolerance, time): (f64, f64),
    method: impl FnOnce(&System) -> M,
) -> (Vec<f64>, Vec<f64>, Vec<Mode>, Statistics) {
    let mut mechanism: Mechanism = plan.default_contact_interpreter();
    let (mut q, v) = (q.to_vec(), v.to_vec());
    let mut p = v.clone();
    mechanism.conjugate_momenta(&q, &v, &mut p);
    let mut system = WithContacts::new(mechanism);
    let close = Projection::new(&system, Stabilisation::Mass, Effort { energy: f64::INFINITY, ..Effort::default() });
    let method = WithPostStep::new(&system, method(&system), close);
    let step = Step::Adaptive(Tolerances::new(tolerance));
    let mut motion = Hybrid::new(&mut system, method, step, 0.0, &q, &p).unwrap();
    motion.run(&mut system, time, &mut ()).unwrap();
    motion.state(&system, &mut q, &mut p);
    (q, p, system.modes().to_vec(), motion.statistics())
}

fn switching(system: &System) -> AutoSwitch<System, Dop853<System>, Radau5<System>> {
    AutoSwitch::new(system, Dop853::new(system), Radau5::new(system))
}

#[test]
fn slow_slip_does_not_shorten_steps() {
    let plan = Plan::new(&model(CREEPING), 1e-9);
    let (start, how) = ((&plan, &[0.0; 3][..], &[1.01e-4, 1e-4, 0.0][..]), (1e-9, 0.2));
    let (slow, _, modes, explicit) = run(start, how, Dop853::new);
    assert_eq!(modes, [Mode::Slide]);
    let (fast, _, modes, switched) = run(start, how, switching);
    assert_eq!(modes, [Mode::Slide]);
    let off = apart(&slow, &fast);
    println!("{off:e} m off; {explicit:?}; {switched:?}");
    // It moves by 2e-5 m.
    assert!(slow[0] > 1e-5 && off <= 1e-12, "{slow:?} {fast:?}");
    assert!(5 * switched.steps < explicit.steps, "{switched:?} beside {explicit:?}");
    assert!(switched.jacobians > 0);
}

/// The rail and the cart of [`CREEPING`] on a level floor, held by springs, with so much damping that they do not swing.
fn sprung() -> Model {
    let text = CREEPING.replace("gravity = [3, 0, -9]", "gravity = [0, 0, -9]");
    let text = text.replace("damping = 1.5", "damping = 12\nstiffness = 60");
    model(&text.replace("damping = 1\n", "damping = 8\nstiffness = 20\n"))
}

#[test]
fn what_creeps_to_rest_is_stopped() {
    // The springs pull the point over the floor until friction carries their force. It gets there ever more slowly, and at no
    // time: it is stopped where friction that is a hundred-thousandth larger would carry it.
    let plan = Plan::new(&sprung(), 1e-9);
    let start = (&plan, &[0.05, -0.2, 0.0][..], &[0.0; 3][..]);
    let (q, _, modes, statistics) = run(start, (1e-9, 60.0), switching);
    assert_eq!(modes, [Mode::Stick]);
    let beyond = (60.0 * q[0]).hypot(20.0 * q[1]) / (0.5555 * 0.3 * 9.0) - 1.0;
    println!("{beyond:e}, {statistics:?}");
    assert!(beyond > 1e-7 && beyond < 1e-5, "{beyond:e}");
}

#[test]
fn what_is_not_stiff_is_left_to_the_explicit_method() {
    // A quadruped that falls, turns and swings its legs: nothing slides, and steps are as long as errors allow.
    let plan = Plan::new(&model(include_str!("../../../models/contacts/quadruped.toml")), 1e-9);
    let mut q = plan.start();
    q[2] += 1.0;
    let mut next = random(9);
    let v: Vec<f64> = (0..plan.dims.nv).map(|_| 2.0 * next()).collect();
    let (start, how) = ((&plan, &q[..], &v[..]), (1e-10, 0.3));
    // With the same work, too.
    assert_eq!(run(start, how, Dop853::new), run(start, how, switching));
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
