//! Order of the Runge-Kutta method by halving the step, and the drift of what should not change.

use mbd_codegen::model::{Gravity, Value};
use mbd_codegen::plan::Plan;
use mbd_runtime::integrate::{Rk4, StepError, Stepper};
use mbd_runtime::{Interpreter, System};
use mbd_testing::random::{random_model, Knobs};
use mbd_testing::state::random_state;

struct Scene {
    name: &'static str,
    i: Interpreter<f64>,
    q: Vec<f64>,
    p: Vec<f64>,
    /// Step that resolves the motion, s: small against its periods, yet with errors well above round-off.
    h: f64,
}

impl Scene {
    /// Three or four bodies, springs and gravity, nothing that takes energy out or puts it in.
    fn new(name: &'static str, seed: u64, steps: u16, kinds: [f64; 9]) -> Scene {
        let knobs = Knobs { bodies: (3, 4), kinds, springs: 1.0, armature: 0.5, ..Knobs::default() };
        let mut model = random_model(seed, &knobs);
        model.gravity = Gravity::Constant([Value::ZERO, Value::ZERO, Value::Const(-9.81)]);
        let plan = Plan::new(&model, Default::default());
        let mut s = random_state(&plan, seed);
        s.tau.fill(0.0);
        let mut i = s.interpreter(&plan);
        let mut p = vec![0.0; s.v.len()];
        i.momenta(&s.q, &s.v, &mut p);
        Scene { name, i, q: s.q, p, h: 1.0 / f64::from(steps) }
    }

    /// State after `time` s in steps of `h` s, and the largest drift of the energy relative to the largest kinetic energy.
    fn run(&self, time: f64, h: f64) -> (Vec<f64>, f64) {
        let (mut i, mut q, mut p) = (self.i.clone(), self.q.clone(), self.p.clone());
        let mut rk4 = Rk4::new(&i);
        let mut energy = self.i.clone();
        let (kinetic, potential) = energy.energy(&q, &p);
        let (start, mut size, mut drift) = (kinetic + potential, kinetic, 0.0_f64);
        let steps = (time / h).round() as usize;
        for k in 0..steps {
            rk4.step(&mut i, k as f64 * h, h, &mut q, &mut p).unwrap_or_else(|e| panic!("{}: {e}", self.name));
            let (kinetic, potential) = energy.energy(&q, &p);
            size = size.max(kinetic);
            drift = drift.max((kinetic + potential - start).abs());
        }
        ([q, p].concat(), drift / size)
    }
}

fn scenes() -> [Scene; 3] {
    [
        Scene::new("pins and sliders", 21, 256, [3.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        Scene::new("planar, helical, universal", 22, 2048, [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
        Scene::new("spherical and floating", 23, 512, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 1.0, 0.0]),
    ]
}

#[test]
fn the_order_is_four() {
    for scene in scenes() {
        let [a, b, c] = [1.0, 2.0, 4.0].map(|k| scene.run(0.25, scene.h / k).0);
        let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let order = (off(&a, &b) / off(&b, &c)).log2();
        println!("{}: order {order:.3}, error {:.1e}", scene.name, off(&b, &c));
        assert!((order - 4.0).abs() < 0.25, "{}: order {order}", scene.name);
        assert!(off(&b, &c) > 1e-13, "{}: the error is round-off and tells nothing", scene.name);
    }
}

#[test]
fn energy_drifts_with_the_fourth_power_of_the_step() {
    for scene in scenes() {
        let [coarse, fine] = [2.0, 1.0].map(|k| scene.run(1.0, k * scene.h).1);
        println!("{}: drift {coarse:.1e}, with half the step {fine:.1e}", scene.name);
        assert!(fine < 1e-6, "{}: {fine:e}", scene.name);
        // A factor of sixteen or more, where the step is short enough; the energy often does better.
        assert!(coarse / fine > 11.0, "{}: {coarse:e} {fine:e}", scene.name);
    }
}

#[test]
fn quaternions_stay_on_the_sphere() {
    let [_, _, scene] = scenes();
    let (state, _) = scene.run(1.0, scene.h);
    assert!(scene.i.quaternions().count() > 0);
    for k in scene.i.quaternions() {
        let norm: f64 = state[k..k + 4].iter().map(|x| x * x).sum();
        assert!((norm - 1.0).abs() < 4.0 * f64::EPSILON, "{norm}");
    }
}

#[test]
fn steps_that_are_too_long_are_refused() {
    let [_, _, scene] = scenes();
    let (mut i, mut q, mut p) = (scene.i.clone(), scene.q.clone(), scene.p.clone());
    let mut rk4 = Rk4::new(&i);
    let result = (0..50).try_for_each(|k| rk4.step(&mut i, f64::from(k), 1.0, &mut q, &mut p));
    assert!(matches!(result, Err(StepError::NotFinite { .. } | StepError::Quaternion { .. })), "{result:?}");
}
