//! Symmetric methods on joints with quaternions: a step back returns, compositions have the order that symmetric
//! methods give them, and the energy stays bounded.

use mbd_runtime::integrate::{
    Gauss12FixedPoint, Gauss4, Gauss6, Gauss6FixedPoint, ImplicitMidpoint, StepError, Stepper,
};
use mbd_runtime::{Interpreter, System};
use mbd_testing::largest_difference as apart;
use mbd_testing::motions::MOTIONS;

use crate::orders::{scenes, Scene};

type Any = Box<dyn Stepper<Interpreter<f64>>>;

fn methods(i: &Interpreter<f64>) -> Vec<(&'static str, Any)> {
    vec![
        ("implicit midpoint", Box::new(ImplicitMidpoint::new(i)) as Any),
        ("Gauss 4", Box::new(Gauss4::new(i))),
        ("Gauss 6", Box::new(Gauss6::new(i))),
        ("Gauss 6, fixed-point", Box::new(Gauss6FixedPoint::new(i))),
        ("Gauss 12", Box::new(Gauss12FixedPoint::new(i))),
    ]
}

/// Spherical joints and a floating one.
fn scene() -> Scene {
    let [_, _, scene] = scenes();
    assert!(scene.i.quaternions().count() > 1);
    scene
}

/// Ten steps forward and ten back. Every step solves its equations to round-off and rounds its sums, and an error grows
/// by the motion between, which lasts a fraction of a second.
#[test]
fn a_step_back_returns() {
    let scene = scene();
    for (name, mut method) in methods(&scene.i) {
        let (mut i, mut q, mut p) = (scene.i.clone(), scene.q.clone(), scene.p.clone());
        let h = 8.0 * scene.h;
        let go = |method: &mut Any, i: &mut _, h: f64, q: &mut Vec<f64>, p: &mut Vec<f64>| {
            (0..10).for_each(|_| method.step(i, 0.0, h, q, p).unwrap_or_else(|e| panic!("{name}: {e}")));
        };
        go(&mut method, &mut i, h, &mut q, &mut p);
        let way = apart(&q, &scene.q);
        go(&mut method, &mut i, -h, &mut q, &mut p);
        // A quaternion and its opposite are the same rotation; so short a motion does not exchange them.
        let off = apart(&q, &scene.q).max(apart(&p, &scene.p));
        println!("{name}: {off:.1e} after {way:.1e}");
        assert!(way > 0.05 && off < 200.0 * f64::EPSILON, "{name}: {off:e}");
    }
}

/// The triple jump: of a symmetric method of order `2 k` three steps, of `x`, `1 − 2 x` and `x` times the step, are one
/// of order `2 k + 2`; of another method they are one of order `2 k + 1`. H. Yoshida, Phys. Lett. A 150, 1990.
fn jumps(levels: u32) -> Vec<f64> {
    let mut parts = vec![1.0];
    for level in 1..=levels {
        let x = 1.0 / (2.0 - 2.0_f64.powf(1.0 / f64::from(2 * level + 1)));
        parts = [x, 1.0 - 2.0 * x, x].iter().flat_map(|x| parts.iter().map(move |part| x * part)).collect();
    }
    parts
}

#[test]
fn compositions_have_even_orders() -> Result<(), StepError> {
    let scene = scene();
    for (levels, coarse) in [(1, 8.0), (2, 8.0)] {
        let run = |steps: u32| -> Result<Vec<f64>, StepError> {
            let (mut i, mut q, mut p) = (scene.i.clone(), scene.q.clone(), scene.p.clone());
            let mut method = ImplicitMidpoint::new(&i);
            let h = 8.0 * coarse * scene.h / f64::from(steps);
            for _ in 0..steps {
                for part in jumps(levels) {
                    method.step(&mut i, 0.0, part * h, &mut q, &mut p)?;
                }
            }
            Ok([q, p].concat())
        };
        let [a, b, c] = [run(8)?, run(16)?, run(32)?];
        let order = (apart(&a, &b) / apart(&b, &c)).log2();
        let expected = f64::from(2 + 2 * levels);
        println!("order {order:.2} of {expected}, error {:.1e}", apart(&b, &c));
        assert!((order - expected).abs() < 0.4 && apart(&b, &c) > 1e-11, "{order} of {expected}");
    }
    Ok(())
}

/// Largest errors of the energy, relative to the potential energy's range, in the first tenth of `steps` steps and in
/// all of them.
fn energy_of_the_heavy_top(method: &mut dyn Stepper<Interpreter<f64>>, h: f64, steps: u32) -> [f64; 2] {
    let motion = MOTIONS.iter().find(|m| m.name == "heavy top").expect("it is in the table");
    let (mut system, mut q, mut p) = motion.start();
    let energy = |i: &mut Interpreter<f64>, q: &Vec<f64>, p: &Vec<f64>| {
        let (kinetic, potential) = i.energy(q, p);
        kinetic + potential
    };
    let before = energy(&mut system, &q, &p);
    let mut worst = [0.0_f64; 2];
    for k in 0..steps {
        method.step(&mut system, f64::from(k) * h, h, &mut q, &mut p).unwrap();
        let off = (energy(&mut system, &q, &p) - before).abs();
        worst[1] = worst[1].max(off);
        if k < steps / 10 {
            worst[0] = worst[1];
        }
    }
    worst
}

/// The energy goes to and fro and does not drift: ten times as long a run finds the same largest error, but for
/// round-off, which is a random walk of some units in the last place.
fn bounded(steps: u32) {
    let (i, ..) = MOTIONS[3].start();
    for (name, mut method) in methods(&i) {
        let h = if name == "implicit midpoint" { 2e-3 } else { 1e-2 };
        let [first, all] = energy_of_the_heavy_top(&mut *method, h, steps);
        println!("{name}: {first:.1e} J, {all:.1e} J");
        let rounding = 20.0 * f64::EPSILON * f64::from(steps).sqrt();
        assert!(all < 1.2 * first + rounding, "{name}: {first:e} {all:e}");
    }
}

#[test]
fn the_energy_of_a_heavy_top_is_bounded() {
    bounded(4_000);
}

/// Run it by `cargo test --release -p mbd-testing --test integrators symmetry -- --ignored --nocapture`.
#[test]
#[ignore = "a hundred thousand steps each take half a minute"]
fn the_energy_of_a_heavy_top_is_bounded_for_long() {
    bounded(100_000);
}
