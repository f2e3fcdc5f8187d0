//! Motions by time steps: order 1 against motions by events and known answers, friction that holds, energy that falls.

use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_runtime::constrained::{Effort, Projection, Stabilisation};
use mbd_runtime::contact::{SteppingStatistics, TimeStepping, WithContacts};
use mbd_runtime::{Conjugate, Energetic};
use mbd_testing::random::Rng;

use super::known::{ball, free_box};
use super::scene::{model, Mechanism, Scene};

type Stepping = TimeStepping<Mechanism, Projection<WithContacts<Mechanism>>>;

struct Stepped {
    system: WithContacts<Mechanism>,
    stepping: Stepping,
    t: f64,
    q: Vec<f64>,
    p: Vec<f64>,
}

impl Stepped {
    fn new(model: &Model, q: &[f64], v: &[f64]) -> Stepped {
        let plan = Plan::new(model, 1e-9);
        let mut mechanism: Mechanism = plan.default_contact_interpreter();
        let (q, mut p) = (q.to_vec(), v.to_vec());
        mechanism.conjugate_momenta(&q, &v.to_vec(), &mut p);
        let mut system = WithContacts::new(mechanism);
        let effort = Effort { energy: f64::INFINITY, ..Effort::default() };
        let projection = Projection::new(&system, Stabilisation::Mass, effort);
        let stepping = TimeStepping::new(&mut system, projection);
        Stepped { system, stepping, t: 0.0, q, p }
    }

    fn step(&mut self, h: f64) {
        self.stepping.step(&mut self.system, self.t, h, &mut self.q, &mut self.p).unwrap();
        self.t += h;
    }

    /// Goes on by `n` steps of a time in total, s.
    fn run(&mut self, time: f64, n: u32) -> &mut Self {
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

fn shipped(text: &str) -> (Model, Vec<f64>) {
    let model = model(text);
    let start = Plan::new(&model, 1e-9).start();
    (model, start)
}

/// Largest difference between the ends of a motion by events and of one by steps.
fn error(model: &Model, q: &[f64], v: &[f64], time: f64, n: u32) -> f64 {
    let mut events = Scene::new(model.clone(), q, v);
    events.run(time);
    let mut stepped = Stepped::new(model, q, v);
    stepped.run(time, n);
    events.q.iter().zip(&stepped.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
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
        let moved = q.iter().zip(&stepped.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
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
        assert!(stepped.statistics().residual < 1e-9, "{:?}", stepped.statistics());
        assert!(stepped.statistics().overlap < 2e-2, "{:?}", stepped.statistics());
    }
}

#[test]
fn a_hopper_lands_at_the_same_place() {
    let (hopper, start) = shipped(include_str!("../../../models/contacts/hopper.toml"));
    let errors = [1_000, 2_000, 4_000, 8_000].map(|n| error(&hopper, &start, &[0.0, 0.0], 1.0, n));
    for (off, n) in errors.iter().zip([1e3, 2e3, 4e3, 8e3]) {
        assert!(*off < 10.0 / n, "{errors:?}");
    }
    assert!(errors[3] < 0.5 * errors[0], "{errors:?}");
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
