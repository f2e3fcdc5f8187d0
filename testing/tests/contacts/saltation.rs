//! Derivatives of motions through their events, against closed forms and central differences, and limit cycles by Newton's
//! method with them.
//!
//! A central difference of step `d` errs by about `d²` times the third derivative and `ε/d` times the error `ε` of a motion.
//! Motions are computed to 1e-12 and their impact times to rounding, so that with `d` = 1e-5 both are near 1e-8 of the size of the
//! derivatives; comparisons with differences allow 1e-6, and those with closed forms 1e-9.

use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use mbd_runtime::contact::{
    Cause, ContactError, ContactEvent, ContactInterpreter, Hybrid, HybridError, Mode, SaltationError, Tangent,
    WithContacts,
};
use mbd_runtime::integrate::{Dop853, Step, Tolerances};
use mbd_runtime::{Conjugate, Constrained, Dual, Real, Scalar};
use nalgebra::{Matrix3, Vector3};

use super::fields::{field, hills};
use super::jams::{rod, sliding_state};
use super::known::{ball, block};
use super::scene::{model, Events};

type Number = Dual<f64>;
type System<S> = WithContacts<ContactInterpreter<S>>;
type Method<S> = WithPostStep<System<S>, Dop853<System<S>>, Projection<System<S>>>;

/// Motions of a scene as functions of some numbers.
trait Family {
    fn model(&self) -> Model;
    /// Sets the mechanism, and gives the start `q`, `v`.
    fn start<S: Real>(&self, x: &[S], mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>);
    /// Parameters of the model.
    fn parameters<S: Real>(&self, _x: &[S]) -> Vec<S> {
        Vec::new()
    }
}

/// A motion and its tangents along all numbers.
struct Run {
    system: System<f64>,
    motion: Hybrid<ContactInterpreter<f64>, Method<f64>>,
    tangents: Vec<Tangent<ContactInterpreter<Number>, Method<Number>>>,
    events: Events,
}

/// A system with its method, and its start `q`, `p`.
fn ready<S: Real>(family: &impl Family, plan: &Plan, x: &[S]) -> (System<S>, Method<S>, Vec<S>, Vec<S>) {
    let mut mechanism = plan.contact_interpreter(&family.parameters(x));
    let (q, v) = family.start(x, &mut mechanism);
    let mut p = v.clone();
    mechanism.conjugate_momenta(&q, &v, &mut p);
    let system = WithContacts::new(mechanism);
    let projection =
        Projection::new(&system, Stabilisation::Mass, Effort { energy: f64::INFINITY, ..Effort::default() });
    let method = WithPostStep::new(&system, Dop853::new(&system), projection);
    (system, method, q, p)
}

fn step() -> Step {
    Step::Adaptive(Tolerances::new(1e-12))
}

impl Run {
    fn new(family: &impl Family, x: &[f64], tangents: bool) -> Run {
        Run::try_new(family, x, tangents).unwrap()
    }

    fn try_new(family: &impl Family, x: &[f64], tangents: bool) -> Result<Run, SaltationError> {
        let plan = Plan::new(&family.model(), 1e-9);
        let (mut system, method, q, p) = ready(family, &plan, x);
        let motion = Hybrid::new(&mut system, method, step(), 0.0, &q, &p)?;
        let directions = if tangents { x.len() } else { 0 };
        let tangents = (0..directions).map(|k| {
            let x: Vec<Number> =
                x.iter().enumerate().map(|(i, x)| Dual::new(*x, f64::from(u8::from(i == k)))).collect();
            let (system, method, q, p) = ready(family, &plan, &x);
            Tangent::new(system, method, step(), 0.0, &q, &p)
        });
        let tangents = tangents.collect::<Result<Vec<_>, _>>()?;
        Ok(Run { system, motion, tangents, events: Events::default() })
    }

    fn to(&mut self, t: f64) -> Result<(), SaltationError> {
        self.motion.run_with_tangents(&mut self.system, t, &mut self.tangents, &mut self.events)
    }

    /// One step, or to an event.
    fn advance(&mut self, t: f64) -> Option<ContactEvent<f64>> {
        let Run { system, motion, tangents, events } = self;
        motion.advance_with_tangents(system, t, tangents, events).unwrap()
    }

    /// `q`, then `v`.
    fn state(&mut self) -> Vec<f64> {
        let (mut q, mut p) = (self.system.system().neutral_q(), self.system.system().zero_p());
        self.motion.state(&self.system, &mut q, &mut p);
        let (mut v, mut sigma) = (p.clone(), self.system.zero_rows());
        self.system.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
        [q, v].concat()
    }

    /// Derivatives of [`Run::state`], a list for each direction.
    fn derivatives(&mut self) -> Vec<Vec<f64>> {
        let lists = self.tangents.iter_mut().map(|tangent| {
            let (mut q, mut p) = (tangent.system_mut().neutral_q(), tangent.system_mut().zero_p());
            tangent.state(&mut q, &mut p);
            tangent.velocities(&mut p);
            q.iter().chain(&p).map(|x| x.du).collect()
        });
        lists.collect()
    }
}

/// Lists of the right lengths.
trait Shape<S> {
    fn neutral_q(&self) -> Vec<S>;
    fn zero_p(&self) -> Vec<S>;
}

impl<S: Real> Shape<S> for ContactInterpreter<S> {
    fn neutral_q(&self) -> Vec<S> {
        mbd_runtime::System::neutral(self)
    }
    fn zero_p(&self) -> Vec<S> {
        mbd_runtime::System::zero_momenta(self)
    }
}

/// Compares derivatives of the state at `t` with central differences; gives the largest relative difference, and the causes
/// of the events.
fn compare(family: &impl Family, x: &[f64], t: f64, allowed: f64) -> Vec<Cause> {
    let mut run = Run::new(family, x, true);
    run.to(t).unwrap();
    let (state, found) = (run.state(), run.derivatives());
    let size = found.iter().flatten().fold(1.0_f64, |most, x| most.max(x.abs()));
    let causes = |run: &Run| run.events.0.iter().map(|event| event.cause).collect::<Vec<_>>();
    let mut worst = 0.0_f64;
    for (k, found) in found.iter().enumerate() {
        let d = 1e-5 * x[k].abs().max(0.1);
        let [more, less] = [d, -d].map(|d| {
            let mut x = x.to_vec();
            x[k] += d;
            let mut run = Run::new(family, &x, false);
            run.to(t).unwrap();
            (run.state(), causes(&run))
        });
        assert_eq!(more.1, causes(&run), "a neighbouring motion has other events");
        assert_eq!(less.1, causes(&run), "a neighbouring motion has other events");
        for (i, found) in found.iter().enumerate() {
            let difference = (more.0[i] - less.0[i]) / (2.0 * d);
            worst = worst.max((found - difference).abs() / size);
            assert!(
                (found - difference).abs() < allowed * size,
                "number {k}, state {i}: {found} {difference}; state {state:?}"
            );
        }
    }
    println!("{:?}: largest derivative {size:.3e}, difference {worst:.1e} of it", causes(&run));
    causes(&run)
}

/// A ball that bounces: height of its lowest point, velocity, restitution, gravity.
struct Ball;

impl Family for Ball {
    fn model(&self) -> Model {
        ball(0.8)
    }

    fn start<S: Real>(&self, x: &[S], mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        mechanism.set_restitution(x[2]);
        mechanism.gravity[2] = -x[3];
        (vec![x[0] + S::constant(0.1)], vec![x[1]])
    }
}

/// Its state after `bounces`, in closed form.
fn bounced<S: Real>(x: &[S], t: f64, bounces: u32) -> [S; 2] {
    let [h, v, e, g] = [x[0], x[1], x[2], x[3]];
    let two = S::constant(2.0);
    let fast = (v * v + two * g * h).sqrt();
    let (mut time, mut up) = ((v + fast) / g, e * fast);
    for _ in 1..bounces {
        (time, up) = (time + two * up / g, e * up);
    }
    let rest = S::constant(t) - time;
    [S::constant(0.1) + up * rest - g * rest * rest / two, up - g * rest]
}

#[test]
fn derivatives_of_a_bouncing_ball_are_those_of_its_closed_form() {
    let (x, t) = ([1.0, 0.3, 0.8, 9.81], 2.0);
    let mut run = Run::new(&Ball, &x, true);
    run.to(t).unwrap();
    assert_eq!(run.events.0.len(), 3);
    for (k, found) in run.derivatives().iter().enumerate() {
        let x: Vec<Number> = (0..4).map(|i| Dual::new(x[i], f64::from(u8::from(i == k)))).collect();
        for (found, known) in found.iter().zip(bounced(&x, t, 3)) {
            assert!((found - known.du).abs() < 1e-9, "{k}: {found} {}", known.du);
        }
    }
    assert_eq!(compare(&Ball, &x, t, 1e-6), [Cause::Landed; 3]);
}

#[test]
fn bounces_that_accumulate_have_no_derivative() {
    let mut run = Run::new(&Ball, &[1.0, 0.0, 0.5, 9.81], true);
    let error = run.to(3.0).unwrap_err();
    assert!(matches!(error, SaltationError::Accumulation { contact: 0, .. }), "{error}");
}

#[test]
fn a_start_that_leaves_a_contact_is_refused() {
    let error = Run::try_new(&Ball, &[0.0, 0.0, 0.5, 9.81], true).err().unwrap();
    assert!(matches!(error, SaltationError::LeavesContact { contact: 0, derivative } if derivative == 1.0), "{error}");
}

/// Two pendulums on one another, of which the lower one strikes a wall: both angles and rates, restitution, gravity.
struct OnWall;

impl Family for OnWall {
    fn model(&self) -> Model {
        model(include_str!("../../../models/contacts/pendulum_on_wall.toml"))
    }

    fn start<S: Real>(&self, x: &[S], mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        mechanism.set_restitution(x[4]);
        mechanism.gravity[2] = -x[5];
        (x[..2].to_vec(), x[2..4].to_vec())
    }
}

#[test]
fn derivatives_of_a_double_pendulum_that_strikes_a_wall() {
    let causes = compare(&OnWall, &[-1.0, 0.1, 0.2, -0.1, 0.9, 9.81], 3.0, 1e-6);
    assert!(causes.len() >= 2, "{causes:?}");
}

/// A pendulum that strikes its stop: angle, rate, restitution, and the length, a parameter of the model.
struct Stop;

impl Family for Stop {
    fn model(&self) -> Model {
        model(
            r#"
name = "pendulum"
gravity = [0, 0, -9.81]
[params]
depth = -0.7
[[body]]
name = "rod"
mass = 1
com = [0, 0, { param = "depth" }]
inertia = [0, 0, 0]
[[joint]]
name = "pivot"
type = "revolute"
child = "rod"
axis = [0, -1, 0]
limits = [-2, 0.3]
limit_restitution = 0.7
"#,
        )
    }

    fn start<S: Real>(&self, x: &[S], mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        mechanism.set_restitution(x[2]);
        (vec![x[0]], vec![x[1]])
    }

    fn parameters<S: Real>(&self, x: &[S]) -> Vec<S> {
        vec![-x[3]]
    }
}

#[test]
fn derivatives_of_a_pendulum_against_its_stop() {
    let x = [-0.8, 0.1, 0.7, 0.7];
    assert_eq!(compare(&Stop, &x, 3.0, 1e-6), [Cause::Landed; 3]);
    // Without restitution it falls back from rest at the stop, where only the time of the impact is left of its past.
    let mut run = Run::new(&Stop, &[-0.8, 0.1, 0.0, 0.7], true);
    run.to(0.8).unwrap();
    assert_eq!(run.events.0.len(), 1);
    let (state, found) = (run.state(), run.derivatives());
    for (tangent, found) in run.tangents.iter().zip(found).take(2) {
        let (event, ..) = tangent.last_event().unwrap();
        let known = [-state[1] * event.du, 9.81 / 0.7 * state[0].sin() * event.du];
        assert!(found.iter().zip(known).all(|(x, y)| (x - y).abs() < 1e-9), "{found:?} {known:?}");
    }
}

#[test]
fn a_landing_that_grazes_has_no_derivative() {
    let mut run = Run::new(&Ball, &[5e-8, -5e-8, 0.5, 0.0], true);
    let error = run.to(2.0).unwrap_err();
    let SaltationError::Grazing { contact: 0, cause: Cause::Landed, rate, time } = error else { panic!("{error}") };
    assert!((rate + 5e-8).abs() < 1e-20 && (time - 1.0).abs() < 1e-6, "{rate} {time}");
}

/// A block that slides up an incline of 30 degrees: speed, friction, slope.
struct Sliding;

impl Family for Sliding {
    fn model(&self) -> Model {
        block(0.8, 0.0, 30.0_f64.to_radians())
    }

    fn start<S: Real>(&self, x: &[S], mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        let (zero, g) = (S::zero(), S::constant(9.81));
        mechanism.set_friction(x[1]);
        let (s, c) = x[2].sin_cos();
        mechanism.gravity = [g * s, zero, -(g * c)];
        (vec![zero, S::constant(0.1), zero], vec![x[0], zero, zero])
    }
}

#[test]
fn derivatives_of_a_block_that_stops_are_those_of_its_way() {
    let x = [2.0, 0.8, 30.0_f64.to_radians()];
    let mut run = Run::new(&Sliding, &x, true);
    run.to(4.0).unwrap();
    assert_eq!(run.events.0.iter().map(|event| event.cause).collect::<Vec<_>>(), [Cause::Stopped]);
    for (k, found) in run.derivatives().iter().enumerate() {
        let [speed, friction, slope] = std::array::from_fn(|i| Number::new(x[i], f64::from(u8::from(i == k))));
        let (s, c) = slope.sin_cos();
        let g = Number::constant(9.81);
        let (way, time) =
            (speed * speed / (Number::constant(2.0) * g * (friction * c - s)), speed / (g * (friction * c - s)));
        assert!((found[0] - way.du).abs() < 1e-9, "{k}: {found:?} {way:?}");
        assert!(found[1..].iter().all(|x| x.abs() < 1e-9), "{k}: {found:?}");
        let (event, ..) = run.tangents[k].last_event().unwrap();
        assert!((event.re - time.re).abs() < 1e-11 && (event.du - time.du).abs() < 1e-9, "{k}: {event:?} {time:?}");
    }
}

#[test]
fn derivatives_of_a_block_that_stops_and_comes_back() {
    assert_eq!(compare(&Sliding, &[-2.0, 0.3, 0.5], 2.0, 1e-6), [Cause::Stopped]);
}

/// A hopper that lands, compresses its leg and leaves the floor: height, leg, and their rates.
struct Hopper;

impl Family for Hopper {
    fn model(&self) -> Model {
        model(include_str!("../../../models/contacts/hopper.toml"))
    }

    fn start<S: Real>(&self, x: &[S], _mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        (x[..2].to_vec(), x[2..].to_vec())
    }
}

#[test]
fn derivatives_of_a_hopper_that_lands_and_leaves() {
    let causes = compare(&Hopper, &[0.3, 0.0, 0.1, -0.05], 1.0, 1e-6);
    assert!(causes.contains(&Cause::Landed) && causes.contains(&Cause::Unloaded), "{causes:?}");
}

/// A box with a spin that strikes the floor with one corner, with friction: height, velocity, angular velocity, friction.
struct Corner {
    restitution: f64,
}

impl Family for Corner {
    fn model(&self) -> Model {
        let mut model = super::known::free_box(0.5, self.restitution);
        model.contacts.truncate(1);
        model
    }

    fn start<S: Real>(&self, x: &[S], mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        mechanism.set_friction(x[7]);
        let q = [0.0, 0.0, 0.0, 0.2, 0.1, -0.3].map(S::constant);
        let w = (S::one() - q[3] * q[3] - q[4] * q[4] - q[5] * q[5]).sqrt();
        (vec![q[0], q[1], x[0], q[3], q[4], q[5], w], x[1..7].to_vec())
    }
}

#[test]
fn derivatives_of_a_free_box_that_strikes_with_a_corner() {
    // It slides through the impact; with more friction it sticks in it, and begins to slide after it.
    for friction in [0.2, 2.0] {
        let x = [0.5, 1.0, 0.2, 0.1, 0.5, 1.0, 0.7, friction];
        let causes = compare(&Corner { restitution: 0.0 }, &x, 0.36, 1e-6);
        assert_eq!(causes, [Cause::Landed], "{friction}");
    }
}

#[test]
fn a_slip_that_turns_in_an_impact_is_refused() {
    let mut run = Run::new(&Corner { restitution: 0.5 }, &[0.5, 1.0, 0.2, 0.1, 0.5, 1.0, 0.7, 0.2], true);
    let error = run.to(0.4).unwrap_err();
    let SaltationError::Motion(HybridError::Contact { error, .. }) = error else { panic!("{error}") };
    assert_eq!(error, ContactError::NoDerivative);
}

/// A rod whose end slides along the floor, and which turns: its angular velocity.
struct SlidingRod;

impl Family for SlidingRod {
    fn model(&self) -> Model {
        rod(2.0)
    }

    fn start<S: Real>(&self, x: &[S], _: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        sliding_state(0.47, -5.0, x[0])
    }
}

/// Forces grow without bound before a jam, and derivatives even faster: these end there, or shortly before.
#[test]
fn a_jam_has_no_derivative() {
    let mut run = Run::new(&SlidingRod, &[2.7], true);
    run.to(0.06).unwrap();
    let error = run.to(0.07).unwrap_err();
    let (SaltationError::Jammed { time, .. } | SaltationError::Stiff { time, .. }) = error else { panic!("{error}") };
    assert!(time > 0.063 && time < 0.0631, "{time}");
}

#[test]
fn contacts_that_land_together_have_no_derivative() {
    // The block falls flat on both corners: a tangent that turns it has no derivative, those that do not turn it have one.
    let fall = |directions: &[usize]| {
        let mut run = Run::new(&Falling, &[0.5, 0.3, 0.0], true);
        run.tangents =
            run.tangents.into_iter().enumerate().filter(|(k, _)| directions.contains(k)).map(|x| x.1).collect();
        run.to(0.35).map(|()| run)
    };
    let error = fall(&[0, 1, 2]).err().unwrap();
    assert!(matches!(error, SaltationError::Simultaneous { .. }), "{error}");
    let mut run = fall(&[0, 1]).unwrap();
    let found = run.derivatives();
    // It is on the floor whatever the height was.
    assert!(found[0][1].abs() < 1e-11 && (found[1][3] - 1.0).abs() < 1e-11, "{found:?}");
}

/// A block that falls: height, speed along the floor, angle.
struct Falling;

impl Family for Falling {
    fn model(&self) -> Model {
        block(0.0, 0.0, 0.0)
    }

    fn start<S: Real>(&self, x: &[S], _mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        (vec![S::zero(), x[0] + S::constant(0.1), x[2]], vec![x[1], S::zero(), S::zero()])
    }
}

/// A wheel without a rim that stands on two spokes and falls over the front one: its angular velocity.
struct Wheel;

impl Family for Wheel {
    fn model(&self) -> Model {
        super::answers::rimless_wheel()
    }

    fn start<S: Real>(&self, x: &[S], _mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        let (spokes, length, ..) = super::answers::SPOKES;
        let (s, c) = (std::f64::consts::PI / f64::from(spokes)).sin_cos();
        let [s, c] = [length * s, length * c].map(S::constant);
        (vec![S::zero(), c, S::zero()], vec![x[0] * c, x[0] * s, -x[0]])
    }
}

#[test]
fn the_limit_cycle_of_a_rimless_wheel_is_found_by_newton_s_method() {
    let (spokes, length, slope, mass, inertia) = super::answers::SPOKES;
    let half = std::f64::consts::PI / f64::from(spokes);
    let about = inertia + mass * length * length;
    let ratio = (inertia + mass * length * length * (2.0 * half).cos()) / about;
    let gain = 4.0 * mass * 9.81 * length * half.sin() * slope.sin() / about;
    let cycle = ratio * (gain / (1.0 - ratio * ratio)).sqrt();
    let mut speed = 1.5 * cycle;
    for _ in 0..8 {
        let mut run = Run::new(&Wheel, &[speed], true);
        while run.advance(5.0).is_none_or(|event| event.impact.is_none()) {
            assert!(run.motion.time() < 5.0);
        }
        let tangent = &mut run.tangents[0];
        let (t, q, p) = tangent.last_event().unwrap();
        let (q, mut p) = (q.clone(), p.clone());
        let system = tangent.system_mut();
        let (mut v, mut sigma) = (p.clone(), system.zero_rows());
        system.project_momenta(t, &q, &mut p, &mut v, &mut sigma);
        let (after, by) = (-v[2].re, -v[2].du);
        // The impact takes a part of the speed, the fall adds to its square.
        assert!((after - ratio * (speed * speed + gain).sqrt()).abs() < 1e-10, "{after}");
        assert!((by - ratio * ratio * speed / after).abs() < 1e-9, "{by}");
        speed += (after - speed) / (1.0 - by);
    }
    assert!((speed - cycle).abs() < 1e-10, "{speed} {cycle}");
}

/// The simplest walker with feet of some mass, just after an impact: angle and rate of the leg that stands, rate between
/// the legs. Both feet are on the slope.
struct Walker {
    foot: f64,
}

impl Family for Walker {
    fn model(&self) -> Model {
        model(&super::walker::with_feet(self.foot))
    }

    fn start<S: Real>(&self, x: &[S], _mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        let (zero, two) = (S::zero(), S::constant(2.0));
        let (_, cos) = x[0].sin_cos();
        (vec![zero, cos, x[0], -(two * x[0])], vec![-x[1], zero, x[1], -x[2]])
    }
}

impl Walker {
    /// A step: the numbers after the next impact, their derivatives by those of the start, and the time of the impact.
    fn step(&self, x: Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>, f64) {
        let mut run = Run::new(self, x.as_slice(), true);
        // In the middle of the step the straight leg has to pass the floor.
        run.motion.ignore(1, true);
        run.to(2.8).unwrap();
        run.motion.ignore(1, false);
        let landed = |event: &ContactEvent<f64>| event.contact == 1 && event.cause == Cause::Landed;
        while !run.advance(5.0).is_some_and(|event| landed(&event)) {
            assert!(run.motion.time() < 5.0);
        }
        assert_eq!(run.system.modes(), [Mode::Open, Mode::Stick]);
        let (mut end, mut by, mut time) = (Vector3::zeros(), Matrix3::zeros(), 0.0);
        for (k, tangent) in run.tangents.iter_mut().enumerate() {
            let (t, q, p) = tangent.last_event().unwrap();
            let (q, mut p) = (q.clone(), p.clone());
            let system = tangent.system_mut();
            let (mut v, mut sigma) = (p.clone(), system.zero_rows());
            system.project_momenta(t, &q, &mut p, &mut v, &mut sigma);
            // The legs change their parts.
            for (i, number) in [q[2] + q[3], v[2] + v[3], v[3]].into_iter().enumerate() {
                (end[i], by[(i, k)]) = (number.re, number.du);
            }
            time = t.re;
        }
        (end, by, time)
    }

    /// A gait by Newton's method from a start, its derivatives, and its misses on the way.
    fn gait(&self, mut x: Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>, Vec<f64>) {
        let mut misses = Vec::new();
        loop {
            let (end, by, _) = self.step(x);
            let miss = end - x;
            misses.push(miss.amax());
            println!("  {:+.12} {:+.12} {:+.12}  misses by {:.1e}", x[0], x[1], x[2], miss.amax());
            if miss.amax() < 1e-12 || misses.len() > 10 {
                return (x, by, misses);
            }
            x += (Matrix3::identity() - by).lu().solve(&miss).unwrap();
        }
    }
}

#[test]
fn the_walker_s_gaits_are_found_by_newton_s_method() {
    // Angles and rates to ten digits by the equations of massless feet, of which `walker.rs` shows that they are gaits.
    for (start, stable) in [([0.21_f64, -0.21], true), ([0.19, -0.2], false)] {
        let known = super::walker::gait(if stable { 0.2 } else { 0.193_937 }, if stable { -0.2 } else { -0.203_867 });
        let by = super::walker::step_derivatives(known);
        let known_trace = by[0][0] + by[1][1];
        let known_determinant = by[0][0] * by[1][1] - by[0][1] * by[1][0];
        let masses = [4e-4, 2e-4, 1e-4, 0.5e-4];
        let mut x = Vector3::new(start[0], start[1], (1.0 - (2.0 * start[0]).cos()) * start[1]);
        let mut table = [[0.0; 4]; 4];
        for (k, foot) in masses.into_iter().enumerate() {
            println!("feet of {foot} kg:");
            let walker = Walker { foot };
            let (gait, by, misses) = walker.gait(x);
            // Convergence of second order, until rounding: from each miss to about the square of it.
            assert!(misses.len() <= 7 && *misses.last().unwrap() < 1e-11, "{misses:?}");
            for pair in misses.windows(2).filter(|pair| pair[0] < 1e-2 && pair[0] > 1e-6) {
                assert!(pair[1] < 100.0 * pair[0] * pair[0] + 1e-12, "{misses:?}");
            }
            let eigenvalues = by.complex_eigenvalues();
            let largest = eigenvalues.iter().map(|e| e.norm()).fold(0.0, f64::max);
            println!("  eigenvalues {eigenvalues:?}");
            assert_eq!(largest < 1.0, stable, "{largest}");
            // One eigenvalue is zero without feet; the others have this sum and this product.
            let sum_of_minors = 0.5 * (by.trace().powi(2) - (by * by).trace());
            table[k] = [gait[0], gait[1], by.trace(), sum_of_minors];
            x = gait;
        }
        // Polynomials in the mass through four values.
        for level in 1..4 {
            for i in (level..4).rev() {
                let (far, near) = (masses[i - level], masses[i]);
                table[i] = std::array::from_fn(|k| (far * table[i][k] - near * table[i - 1][k]) / (far - near));
            }
        }
        let [angle, rate, trace, determinant] = table[3];
        println!("massless feet: angle {angle:.11}, rate {rate:.11}, trace {trace:.9}, determinant {determinant:.9}");
        assert!((angle - known[0]).abs() < 1e-10 && (rate - known[1]).abs() < 1e-10, "{angle} {rate} {known:?}");
        // Central differences of the equations of massless feet, and what extrapolation leaves, are good to 1e-7.
        assert!((trace - known_trace).abs() < 1e-7, "{trace} {known_trace}");
        assert!((determinant - known_determinant).abs() < 1e-7, "{determinant} {known_determinant}");
    }
}

/// A point or a ball that does not turn, thrown on hilly ground, and slides over it: place, velocity, gravity.
struct OnHills(&'static str);

impl Family for OnHills {
    fn model(&self) -> Model {
        let ground = field(None, [12, 9], [0.3, 0.4], hills);
        let slide = |name: &str, parent: &str, axis: &str| {
            let mass = if name == "c" { "mass = 0.8" } else { "" };
            format!(
                "[[body]]\nname = \"{name}\"\n{mass}\n[[joint]]\nname = \"j{name}\"\ntype = \"prismatic\"\nparent = \"{parent}\"\n\
                 child = \"{name}\"\naxis = {axis}\n"
            )
        };
        let slides = [slide("a", "ground", "[1, 0, 0]"), slide("b", "a", "[0, 1, 0]"), slide("c", "b", "[0, 0, 1]")];
        model(&format!(
            "name = \"thrown\"\ngravity = [0, 0, -9.81]\n{}{ground}[[shape]]\nname = \"foot\"\nbody = \"c\"\n{}\n\
             [[contact]]\nname = \"c\"\nbetween = [\"hills\", \"foot\"]\nfriction = 0.2\n",
            slides.concat(),
            self.0
        ))
    }

    fn start<S: Real>(&self, x: &[S], mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>) {
        mechanism.gravity[2] = -x[6];
        (x[..3].to_vec(), x[3..6].to_vec())
    }
}

/// Landing on a slope and sliding over the cells of the ground.
#[test]
fn derivatives_of_what_slides_over_hills() {
    for shape in ["type = \"point\"", "type = \"sphere\"\nradius = 0.2"] {
        let causes = compare(&OnHills(shape), &[-0.8, 0.3, 0.6, 1.5, -0.4, 0.0, 9.81], 0.7, 1e-6);
        assert_eq!(causes, [Cause::Landed], "{shape}");
    }
}
