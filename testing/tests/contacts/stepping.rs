//! Motions by time steps: order 1 against motions by events and known answers, friction that holds, energy that falls.

use mbd_codegen::model::Model;
use mbd_codegen::options::Arithmetic;
use mbd_codegen::plan::Plan;
use mbd_codegen::Options;
use mbd_runtime::catalogue::{self, BoxedMethod};
use mbd_runtime::constrained::WithPostStep;
use mbd_runtime::constrained::{Effort, Projection, Stabilisation};
use mbd_runtime::contact::{
    ByRules, ContactError, ContactMotion, ContactObserver, Effort as ContactEffort, FixedSweeps, HybridError, Regime,
    RegimeChange, RegimeChoice, RegimeReason, RegimeRules, StepImpulses, SteppingStatistics, TimeStepping, Touching,
    WithContacts,
};
use mbd_runtime::integrate::{Step, Tolerances};
use mbd_runtime::{Conjugate, Energetic, System as _};
use mbd_testing::random::Rng;

use super::known::{ball, free_box};
use super::scene::{apart, model, Mechanism, Scene};

type Closing = Projection<WithContacts<Mechanism>>;

/// A motion by time steps.
pub struct Stepped<I = ByRules> {
    system: WithContacts<Mechanism>,
    stepping: TimeStepping<Mechanism, Closing, I>,
    t: f64,
    pub q: Vec<f64>,
    pub p: Vec<f64>,
}

impl Stepped {
    pub fn new(model: &Model, q: &[f64], v: &[f64]) -> Stepped {
        Stepped::by(model, (q, v), TimeStepping::new)
    }
}

impl<const N: u32> Stepped<FixedSweeps<N>> {
    fn by_sweeps(model: &Model, q: &[f64], v: &[f64]) -> Self {
        Stepped::by(model, (q, v), TimeStepping::fixed_work)
    }
}

impl<I: StepImpulses> Stepped<I> {
    fn by(
        model: &Model,
        (q, v): (&[f64], &[f64]),
        stepping: impl Fn(&mut WithContacts<Mechanism>, Closing) -> TimeStepping<Mechanism, Closing, I>,
    ) -> Self {
        let plan = Plan::new(model, 1e-9);
        let mut mechanism: Mechanism = plan.default_contact_interpreter();
        let (q, mut p) = (q.to_vec(), v.to_vec());
        mechanism.conjugate_momenta(&q, &v.to_vec(), &mut p);
        let mut system = WithContacts::new(mechanism);
        let effort = Effort { energy: f64::INFINITY, ..Effort::default() };
        let projection = Projection::new(&system, Stabilisation::Mass, effort);
        let stepping = stepping(&mut system, projection);
        Stepped { system, stepping, t: 0.0, q, p }
    }

    pub fn step(&mut self, h: f64) {
        self.stepping.step(&mut self.system, self.t, h, &mut self.q, &mut self.p).unwrap();
        self.t += h;
    }

    /// Goes on by `n` steps of a time in total, s.
    pub fn run(&mut self, time: f64, n: u32) -> &mut Self {
        (0..n).for_each(|_| self.step(time / f64::from(n)));
        self
    }

    fn energy(&mut self) -> f64 {
        let (kinetic, potential) = self.system.energies(&self.q, &self.p);
        kinetic + potential
    }

    fn statistics(&self) -> SteppingStatistics {
        *self.stepping.statistics()
    }
}

/// A model and its start.
pub fn shipped(text: &str) -> (Model, Vec<f64>) {
    let model = model(text);
    let start = Plan::new(&model, 1e-9).start();
    (model, start)
}

/// Largest difference between the ends of a motion by events and of one by steps.
pub fn error(model: &Model, q: &[f64], v: &[f64], time: f64, n: u32) -> f64 {
    let mut events = Scene::new(model.clone(), q, v);
    events.run(time);
    let mut stepped = Stepped::new(model, q, v);
    stepped.run(time, n);
    apart(&events.q, &stepped.q)
}

#[test]
fn a_bouncing_ball_errs_by_the_step() {
    // Three bounces. A landing is late by up to a step, which the speeds of up to 5 m/s multiply.
    for n in [200, 2_000, 20_000] {
        let (e, time) = (0.8, 2.0);
        let off = error(&ball(e), &[1.1], &[0.0], time, n);
        assert!(off < 3.0 * 5.0 * time / f64::from(n), "{n} steps: {off:.1e}");
    }
}

#[test]
fn what_friction_holds_does_not_move() {
    let (block, start) = shipped(include_str!("../../../models/contacts/block_on_incline.toml"));
    let mut v = vec![0.0; 6];
    v[0] = 1.5;
    let mut places = Vec::new();
    for n in [500, 1_000, 2_000] {
        let mut stepped = Stepped::new(&block, &start, &v);
        stepped.run(2.0, n);
        let q = stepped.q.clone();
        stepped.run(1.0, n / 2);
        // It rests to rounding errors of the impulses, which do not add up to a motion.
        let moved = apart(&q, &stepped.q);
        assert!(moved < 1e-13, "{n} steps: moved by {moved:.1e}");
        places.push(error(&block, &start, &v, 2.0, n));
    }
    // Slip of 1.5 m/s ends within a step.
    for (off, n) in places.iter().zip([500.0, 1_000.0, 2_000.0]) {
        assert!(*off < 1.5 * 2.0 / n, "{n} steps: {places:?}");
    }
}

#[test]
fn impulses_never_add_energy() {
    let mut rng = Rng::new(3, 1);
    for seed in 0..6 {
        let (friction, restitution) = (rng.range(0.0, 1.0), if seed % 2 == 0 { 0.0 } else { rng.range(0.1, 0.9) });
        let body = free_box(friction, restitution);
        let mut v: Vec<f64> = (0..6).map(|_| rng.around(2.0)).collect();
        v[2] = -1.0;
        let mut stepped = Stepped::new(&body, &[0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0], &v);
        let first = stepped.energy();
        let mut lost = 0.0;
        for _ in 0..600 {
            stepped.step(2e-3);
            let now = stepped.statistics().lost;
            // Forces press the box on the floor: their work in a step is rounding beside the energy.
            assert!(now >= lost - 1e-12 * first.abs().max(1.0), "seed {seed}: {now} after {lost}");
            lost = now;
        }
        let last = stepped.energy();
        assert!(last < first, "seed {seed}: {first} J, then {last} J");
        assert!(stepped.statistics().residual <= 1e-5, "{:?}", stepped.statistics());
        assert!(stepped.statistics().overlap < 2e-2, "{:?}", stepped.statistics());
    }
}

#[test]
fn a_hopper_lands_at_the_same_place() {
    let (hopper, start) = shipped(include_str!("../../../models/contacts/hopper.toml"));
    let errors = [1_000, 2_000, 4_000, 8_000].map(|n| error(&hopper, &start, &[0.0, 0.0], 1.0, n));
    // In the mean, the impulse of a landing comes in time: without that, it would be off by a step, which speeds of metres a
    // second multiply.
    for (off, n) in errors.iter().zip([1e3, 2e3, 4e3, 8e3]) {
        assert!(*off < 0.3 / n, "{errors:?}");
    }
}

/// By events, its trunk is at 0.10155 m after 3 s: it kneels on the stops of its knees.
#[test]
fn a_quadruped_kneels_as_by_events() {
    let (quadruped, start) = shipped(include_str!("../../../models/contacts/quadruped.toml"));
    let mut stepped = Stepped::new(&quadruped, &start, &[0.0; 18]);
    stepped.run(3.0, 3_000);
    assert!((stepped.q[2] - 0.10155).abs() < 5e-3, "the trunk is at {} m", stepped.q[2]);
    assert!(stepped.statistics().overlap < 5e-3, "{:?}", stepped.statistics());
}

/// A single contact without friction or restitution is solved by one sweep. The hopper's stops are not reached.
#[test]
fn one_sweep_solves_one_contact() {
    let (hopper, start) = shipped(include_str!("../../../models/contacts/hopper.toml"));
    let mut by_rules = Stepped::new(&hopper, &start, &[0.0, 0.0]);
    let mut by_sweeps = Stepped::<FixedSweeps<1>>::by_sweeps(&hopper, &start, &[0.0, 0.0]);
    by_rules.stepping.lifts = false;
    by_rules.run(2.0, 2_000);
    by_sweeps.run(2.0, 2_000);
    assert!(by_rules.statistics().touched > 0 && by_rules.statistics().most == 1, "{:?}", by_rules.statistics());
    assert_eq!((by_rules.q, by_rules.p), (by_sweeps.q, by_sweeps.p));
}

/// The residual and the error of a quadruped's fall with a number of sweeps a step, against impulses by the rules.
fn fall_by_sweeps<const N: u32>(model: &Model, start: &[f64], by_rules: &[f64]) -> (f64, f64) {
    let mut stepped = Stepped::<FixedSweeps<N>>::by_sweeps(model, start, &[0.0; 18]);
    stepped.run(0.5, 500);
    let off = apart(by_rules, &stepped.q);
    (stepped.statistics().residual, off)
}

#[test]
fn more_sweeps_leave_less() {
    let (quadruped, start) = shipped(include_str!("../../../models/contacts/quadruped.toml"));
    let mut by_rules = Stepped::new(&quadruped, &start, &[0.0; 18]);
    by_rules.run(0.5, 500);
    let left = [
        fall_by_sweeps::<2>(&quadruped, &start, &by_rules.q),
        fall_by_sweeps::<8>(&quadruped, &start, &by_rules.q),
        fall_by_sweeps::<32>(&quadruped, &start, &by_rules.q),
        fall_by_sweeps::<128>(&quadruped, &start, &by_rules.q),
    ];
    println!("{left:?}");
    // Feet and stops of the joints act on light legs: sweeps converge slowly, by a factor each.
    for ((few, off), (more, less)) in left.iter().zip(&left[1..]) {
        assert!(*more < 0.4 * few && *less < 0.4 * off, "{left:?}");
    }
}

/// All feet of a quadruped begin to slip at the same instant, 2 ms before they leave the floor: both ways of following them end at
/// the same place, but for an error that falls with the step.
#[test]
fn a_hop_by_steps_is_that_by_events() {
    let (quadruped, q) = shipped(include_str!("../../../models/contacts/quadruped_hop.toml"));
    let errors = [200, 800].map(|n| error(&quadruped, &q, &[0.0; 18], 0.04, n));
    assert!(errors[1] < 0.35 * errors[0], "{errors:?}");
}

/// A quadruped on springs above the ground, thrown and turned at random.
fn thrown(seed: u64) -> Stepped {
    let (quadruped, mut q) = shipped(include_str!("../../../models/contacts/quadruped_hop.toml"));
    let mut rng = Rng::new(seed, 1);
    q[2] += 0.1;
    q[3] = rng.around(0.15);
    q[6] = (1.0 - q[3] * q[3]).sqrt();
    q[7..].iter_mut().for_each(|q| *q += rng.around(0.2));
    let v: Vec<f64> = (0..18).map(|_| rng.around(0.3)).collect();
    Stepped::new(&quadruped, &q, &v)
}

/// Without rounds of the solver, only the steps from the impulses of the step before find any: in these two motions they fail
/// once. (Where that changes, most of the first 40 will do as well.)
#[test]
fn steps_without_convergence_are_divided() {
    let briefly = |seed| {
        let mut stepped = thrown(seed);
        stepped.stepping.rules.effort = ContactEffort::ToTolerance { tolerance: 1e-11, rounds: 0 };
        stepped
    };
    let mut stepped = briefly(9);
    stepped.run(0.4, 800);
    let SteppingStatistics { steps, divided, residual, .. } = stepped.statistics();
    assert!((steps, divided) == (800, 1) && residual <= 1e-11, "{:?}", stepped.statistics());
    let mut whole = thrown(9);
    whole.run(0.4, 800);
    assert_eq!(whole.statistics().divided, 0);
    let off = apart(&stepped.q, &whole.q);
    // Errors of such motions with these steps are up to 3e-3.
    assert!(off < 5e-3, "{off:.1e}");

    // Here a part fails after others, and the state is what it was.
    let mut stepped = briefly(1);
    let error = loop {
        let (mut q, mut p) = (stepped.q.clone(), stepped.p.clone());
        let result = stepped.stepping.step(&mut stepped.system, stepped.t, 5e-4, &mut q, &mut p);
        if let Err(error) = result {
            assert_eq!((q, p), (stepped.q, stepped.p));
            break error;
        }
        (stepped.t, stepped.q, stepped.p) = (stepped.t + 5e-4, q, p);
        assert!(stepped.t < 0.4, "no step fails");
    };
    let HybridError::Contact { time, error: ContactError::NoConvergence { .. } } = error else { panic!("{error}") };
    assert!(time > stepped.t + 1e-4, "{time} s, from {} s", stepped.t);
}

/// With all rounds, impulses are found in every step of all these motions; before Newton's method began at random impulses, seven
/// of the first 120 had steps in which they were not.
#[test]
fn impulses_of_thrown_quadrupeds_are_found() {
    for seed in [26, 38, 43, 87] {
        let mut stepped = thrown(seed);
        stepped.run(0.4, 800);
        let SteppingStatistics { divided, residual, .. } = stepped.statistics();
        assert!(divided == 0 && residual <= 1e-11, "{seed}: {:?}", stepped.statistics());
    }
}

type System = WithContacts<Mechanism>;

/// The changes of the regime, and the times at which rows of a table would be written.
#[derive(Default)]
struct Changes(Vec<RegimeChange>);

impl ContactObserver<Mechanism> for Changes {
    fn regime(&mut self, _system: &mut System, change: &RegimeChange) {
        self.0.push(*change);
    }
}

struct Chosen {
    system: System,
    motion: ContactMotion<Mechanism, BoxedMethod<'static, System>, Projection<System>>,
    changes: Changes,
}

impl Chosen {
    fn new(model: &Model, rules: RegimeRules, q: &[f64], v: &[f64]) -> Chosen {
        Chosen::try_new(model, rules, q, v).unwrap()
    }

    fn try_new(model: &Model, rules: RegimeRules, q: &[f64], v: &[f64]) -> Result<Chosen, HybridError> {
        let mut mechanism: Mechanism = Plan::new(model, 1e-9).default_contact_interpreter();
        let (q, mut p) = (q.to_vec(), v.to_vec());
        mechanism.conjugate_momenta(&q, &v.to_vec(), &mut p);
        let mut system = WithContacts::new(mechanism);
        let effort = Effort { energy: f64::INFINITY, ..Effort::default() };
        let projection = |system: &System| Projection::new(system, Stabilisation::Mass, effort);
        let method = catalogue::explicit("verner9", &system, false).expect("a method");
        let method = Box::new(WithPostStep::new(&system, method, projection(&system)));
        let step = (method as BoxedMethod<'static, System>, Step::Adaptive(Tolerances::new(1e-12)));
        let close = projection(&system);
        let motion = ContactMotion::new(&mut system, step, close, rules, 0.0, (&q, &p))?;
        Ok(Chosen { system, motion, changes: Changes::default() })
    }

    fn run(&mut self, time: f64) -> (Vec<f64>, Vec<f64>) {
        self.motion.run(&mut self.system, time, &mut self.changes).unwrap();
        assert_eq!(self.motion.time(), time);
        let inner = self.system.system();
        let (mut q, mut p) = (inner.neutral(), inner.zero_momenta());
        self.motion.state(&self.system, &mut q, &mut p);
        (q, p)
    }
}

#[test]
fn crowded_bounces_are_stepped_over() {
    // A ball that keeps 0.98 of its speed: from 1 m it would bounce 700 times before it lies still.
    let time = 60.0;
    for (rules, crowded) in
        [(RegimeRules::new(RegimeChoice::Automatic, 1e-3), true), (RegimeRules::new(RegimeChoice::Events, 1e-3), false)]
    {
        let mut motion = Chosen::new(&ball(0.98), rules, &[1.1], &[0.0]);
        let (q, p) = motion.run(time);
        // The ball of radius 0.1 m lies on the floor.
        assert!((q[0] - 0.1).abs() < 1e-11, "{q:?}");
        assert!(p[0].abs() < 1e-9, "{p:?}");
        let statistics = *motion.motion.statistics();
        assert!((statistics.time[0] + statistics.time[1] - time).abs() < 1e-9, "{statistics:?}");
        let changes = &motion.changes.0;
        assert_eq!(changes.len() as u64, statistics.changes);
        if crowded {
            let [first, .., last] = &changes[..] else { panic!("{changes:?}") };
            assert!(matches!(first.reason, RegimeReason::ManyEvents(100)), "{changes:?}");
            assert!(first.regime == Regime::TimeSteps && last.regime == Regime::Events, "{changes:?}");
            assert!(last.reason == RegimeReason::Quiet, "{changes:?}");
            // Steps of 1 ms leave a bounce out that is lower than what the ball falls in a few of them.
            assert!(statistics.closed < 1e-4, "{statistics:?}");
        } else {
            assert!(changes.is_empty(), "{changes:?}");
        }
    }
}

#[test]
fn what_events_cannot_resolve_is_stepped_over() {
    let rules = RegimeRules::new(RegimeChoice::Automatic, 1e-3);
    let start = [0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0];
    let mut motion = Chosen::new(&free_box(0.5, 0.0), rules, &start, &[0.3, 0.0, 0.0, 0.0, 0.0, 0.0]);
    // Four corners land at once, and the solver of the motion by events may do nothing about them.
    motion.motion.events.rules.effort = ContactEffort::ToTolerance { tolerance: 1e-12, rounds: 0 };
    let (q, _) = motion.run(1.0);
    let [change] = &motion.changes.0[..] else { panic!("{:?}", motion.changes.0) };
    assert!(matches!(change.reason, RegimeReason::Failed(HybridError::Contact { .. })), "{change:?}");
    // It falls by 0.2 m. Friction in the impact at 2 m/s could take 1 m/s: it slides no more. Each to a time step's motion.
    let landing = (2.0 * 0.2 / 9.81_f64).sqrt();
    assert!(change.time < landing && landing - change.time < 0.1, "{change:?}");
    assert!((q[2] - 0.1).abs() < 3e-3, "{q:?}");
    assert!((q[0] - 0.3 * landing).abs() < 1e-3, "{q:?}");
}

#[test]
fn only_time_steps() {
    let (hopper, start) = shipped(include_str!("../../../models/contacts/hopper.toml"));
    let mut stepped = Stepped::new(&hopper, &start, &[0.0, 0.0]);
    // Sums of these times are exact.
    let h = 1.0 / 1024.0;
    (0..1024).for_each(|_| stepped.step(h));
    let rules = RegimeRules::new(RegimeChoice::TimeSteps, h);
    let mut motion = Chosen::new(&hopper, rules, &start, &[0.0, 0.0]);
    let (q, p) = motion.run(stepped.t);
    assert_eq!((q, p), (stepped.q, stepped.p));
    assert_eq!(motion.motion.statistics().time, [0.0, stepped.t]);
}

/// Coordinates and momenta of a quadruped that has been dropped and kneels.
fn kneeling<Y>(mut mechanism: Y, plan: &Plan) -> (Vec<f64>, Vec<f64>)
where
    Y: Touching<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>> + Conjugate,
{
    let mut q = plan.start();
    let v = vec![0.0; plan.dims.nv];
    let mut p = v.clone();
    mechanism.conjugate_momenta(&q, &v, &mut p);
    let mut system = WithContacts::new(mechanism);
    let mut stepping = TimeStepping::new(&mut system, ());
    for k in 0..150 {
        stepping.step(&mut system, 2e-3 * f64::from(k), 2e-3, &mut q, &mut p).unwrap();
    }
    assert!(stepping.statistics().most >= 4);
    (q, p)
}

/// Machine code computes several columns of the inverse inertia at once: they have the bits of single ones.
#[test]
fn columns_at_once_have_the_bits_of_single_ones() {
    let model = model(include_str!("../../../models/contacts/quadruped.toml"));
    let plan = Plan::new(&model, 1e-9);
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let machine = plan.compiled_with_contacts::<f64>(&options, 10).unwrap();
    assert_eq!(kneeling(plan.default_contact_interpreter::<f64>(), &plan), kneeling(machine, &plan));
}
