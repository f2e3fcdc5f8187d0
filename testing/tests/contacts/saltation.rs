//! Derivatives of motions through their events, against closed forms and central differences, and limit cycles by Newton's
//! method with them.
//!
//! A central difference of step `d` errs by about `d²` times the third derivative and `ε/d` times the error `ε` of a motion.
//! Motions are computed to 1e-12 and their impact times to rounding, so that with `d` = 1e-5 both are near 1e-8 of the size of the
//! derivatives; comparisons with differences allow 1e-6, and those with closed forms 1e-9.

use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use mbd_runtime::contact::{Cause, ContactInterpreter, Hybrid, SaltationError, Tangent, WithContacts};
use mbd_runtime::integrate::{Dop853, Step, Tolerances};
use mbd_runtime::{Conjugate, Constrained, Dual, Real};

use super::known::ball;
use super::scene::Events;

type Number = Dual<f64>;
type System<S> = WithContacts<ContactInterpreter<S>>;
type Method<S> = WithPostStep<System<S>, Dop853<System<S>>, Projection<System<S>>>;

/// Motions of a scene as functions of some numbers.
trait Family {
    fn model(&self) -> Model;
    /// Sets the mechanism, and gives the start `q`, `v`.
    fn start<S: Real>(&self, x: &[S], mechanism: &mut ContactInterpreter<S>) -> (Vec<S>, Vec<S>);
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
    let mut mechanism = plan.default_contact_interpreter();
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

    /// `q`, then `v`.
    fn state(&mut self) -> Vec<f64> {
        let (mut q, mut p) = (self.system.system().default_q(), self.system.system().default_p());
        self.motion.state(&self.system, &mut q, &mut p);
        let (mut v, mut sigma) = (p.clone(), self.system.zero_rows());
        self.system.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
        [q, v].concat()
    }

    /// Derivatives of [`Run::state`], a list for each direction.
    fn derivatives(&mut self) -> Vec<Vec<f64>> {
        let lists = self.tangents.iter_mut().map(|tangent| {
            let (mut q, mut p) = (tangent.system_mut().default_q(), tangent.system_mut().default_p());
            tangent.state(&mut q, &mut p);
            tangent.velocities(&mut p);
            q.iter().chain(&p).map(|x| x.du).collect()
        });
        lists.collect()
    }
}

/// Lists of the right lengths.
trait Shape<S> {
    fn default_q(&self) -> Vec<S>;
    fn default_p(&self) -> Vec<S>;
}

impl<S: Real> Shape<S> for ContactInterpreter<S> {
    fn default_q(&self) -> Vec<S> {
        mbd_runtime::System::neutral(self)
    }
    fn default_p(&self) -> Vec<S> {
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
