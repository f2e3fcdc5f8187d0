//! The scenes that are shipped, as their files describe them.

use std::path::{Path, PathBuf};

use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_codegen::read;
use mbd_runtime::constrained::{close, Closing};
use mbd_runtime::contact::{Cause, Mode, Touching};
use mbd_runtime::spatial::{add3, dot3, scale3, Vec3};

use super::scene::{apart, Mechanism, Scene};
use super::solid::{back, turned};
use super::stepping::error;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/contacts")
}

/// A model that is shipped, in which nothing is found.
fn sound(path: &Path) -> Model {
    let text = std::fs::read_to_string(path).expect("UTF-8");
    let (model, findings) = read::load("scene.toml", &text, &Default::default());
    assert!(findings.0.is_empty(), "{}: {findings}", path.display());
    model.expect("a model without findings")
}

/// Coordinates and velocities with which a model starts; its loops are closed.
fn start(model: &Model) -> [Vec<f64>; 2] {
    let plan = Plan::new(model, 1e-9);
    let mut q = plan.start();
    let mut mechanism: Mechanism = plan.default_contact_interpreter();
    close(&mut mechanism, &mut q, &Closing::holding(&plan.held())).expect("loops that close");
    [q, plan.start_velocity().unwrap_or_else(|| vec![0.0; plan.dims.nv])]
}

fn begun(name: &str) -> Scene {
    let model = sound(&folder().join(format!("{name}.toml")));
    let [q, v] = start(&model);
    Scene::new(model, &q, &v)
}

/// Every scene is read without a finding, and moves without gaining energy.
#[test]
fn every_scene_loads_and_gains_no_energy() {
    let mut count = 0;
    for entry in std::fs::read_dir(folder()).expect("the scenes").flatten() {
        let path = entry.path();
        let model = sound(&path);
        count += 1;
        let [q, v] = start(&model);
        // A hundred links take long where they land: their first hundredths of a second.
        let time = if model.bodies.len() > 50 { 0.02 } else { 0.1 };
        let mut scene = Scene::new(model, &q, &v);
        scene.tolerance = 1e-9;
        let first = scene.energy();
        let mut before = first;
        for k in 1..=10 {
            scene.run(0.1 * time * f64::from(k));
            let now = scene.energy();
            // Errors of the steps and of the correction of positions, whose energy is not kept.
            assert!(now <= before + 1e-7 * first.abs().max(1.0), "{}: {before} J, then {now} J", path.display());
            before = now;
        }
        assert!(scene.q.iter().all(|x| x.is_finite()), "{}", path.display());
    }
    assert!(count >= 18, "{count}");
}

/// Both ways to follow contacts end at the same place, but for an error that falls with the step, or with which of several
/// landings fall into one step. They share the forces at an instant, and nothing that finds events.
#[test]
fn every_scene_moves_by_steps_as_by_events() {
    for entry in std::fs::read_dir(folder()).expect("the scenes").flatten() {
        let path = entry.path();
        let model = sound(&path);
        // A hundred links take long.
        if model.bodies.len() > 50 {
            continue;
        }
        let [q, v] = start(&model);
        let errors = [500, 2_000].map(|n| error(&model, &q, &v, 0.2, n));
        assert!(errors[1] < 0.5 * errors[0] || errors[1] < 3e-5, "{}: {errors:?}", path.display());
    }
}

/// Its axis turns from near the vertical to near the opposite, while the energy falls; Jellett's quantity, the angular
/// momentum about the centre of mass along the line to the contact point, has no moment from any force at that point.
#[test]
fn a_tippe_top_turns_over() {
    let (com, inertia, radius): (Vec3<f64>, Vec3<f64>, f64) = ([0.0, 0.0, -0.003], [2.9e-6, 2.9e-6, 3.2e-6], 0.02);
    let mut scene = begun("tippe_top");
    let jellett = |scene: &mut Scene| {
        let v = scene.v();
        let momentum = turned(&scene.q, std::array::from_fn(|k| inertia[k] * v[3 + k]));
        let to_contact = add3([0.0, 0.0, -radius], scale3(-1.0, turned(&scene.q, com)));
        dot3(momentum, to_contact)
    };
    let cosine = |scene: &Scene| back(&scene.q, [0.0, 0.0, 1.0])[2];
    assert!((cosine(&scene) - 0.1_f64.cos()).abs() < 1e-9);
    let (first, mut energy) = (jellett(&mut scene), scene.energy());
    for k in 1..=45 {
        scene.run(0.1 * f64::from(k));
        let now = scene.energy();
        assert!(now < energy + 1e-12, "{k}: {energy} J, then {now} J");
        energy = now;
        let change = jellett(&mut scene) / first - 1.0;
        assert!(change.abs() < 1e-8, "{k}: {change:e}");
        assert!(scene.gaps()[0].abs() < 1e-11);
    }
    assert!(cosine(&scene) < -0.99, "{}", cosine(&scene));
    // It stands on its head and rolls.
    assert_eq!(scene.system.modes(), [Mode::Stick]);
}

/// Spun one way it turns back, spun the other way it goes on. It rolls without slip, so that the energy does not change.
#[test]
fn a_rattleback_turns_back_in_one_direction_only() {
    let spin = |sign: f64, time: f64| {
        let model = sound(&folder().join("rattleback.toml"));
        let [q, mut v] = start(&model);
        v[5] *= sign;
        let mut scene = Scene::new(model, &q, &v);
        scene.tolerance = 1e-10;
        // Friction takes up the slip of the first motion at once.
        scene.run(0.01);
        assert_eq!(scene.system.modes(), [Mode::Stick]);
        let energy = scene.energy();
        let spins: Vec<f64> = (1..=40)
            .map(|k| {
                scene.run(0.01 + time * f64::from(k) / 40.0);
                let v = scene.v();
                turned(&scene.q, [v[3], v[4], v[5]])[2]
            })
            .collect();
        let change = scene.energy() - energy;
        assert!(change.abs() < 1e-7 * energy.abs(), "{change:e}");
        spins
    };
    let back = spin(1.0, 1.5);
    assert!(back[0] < -4.5 && back.iter().any(|w| *w > 1.0), "{back:?}");
    let on = spin(-1.0, 1.5);
    assert!(on.iter().all(|w| *w > 3.5), "{on:?}");
}

/// It leaves the floor with all feet, lands, and comes to rest on them.
#[test]
fn a_quadruped_hops_and_stands() {
    let mut scene = begun("quadruped_hop");
    scene.tolerance = 1e-8;
    let start = scene.q[2];
    scene.run(0.25);
    assert_eq!(scene.system.modes()[..4], [Mode::Open; 4]);
    let lowest = scene.gaps().iter().step_by(3).take(4).fold(f64::INFINITY, |a, b| a.min(*b));
    assert!(lowest > 0.05 && scene.q[2] > start + 0.2, "{lowest} {}", scene.q[2]);
    scene.run(2.0);
    assert_eq!(scene.system.modes()[..4], [Mode::Stick; 4]);
    assert!(scene.v().iter().all(|v| v.abs() < 1e-2), "{:?}", scene.v());
    assert!(scene.q[2] > start + 0.05, "{}", scene.q[2]);
}

/// The feet of a quadruped that is symmetric reach the friction cone at the same instant, before they leave the floor. All of them
/// slide then: none goes on sticking by a force that friction cannot give.
#[test]
fn feet_that_begin_to_slip_at_once_slide() {
    for tolerance in [1e-8, 1e-10, 1e-12] {
        let mut scene = begun("quadruped_hop");
        scene.tolerance = tolerance;
        let (mut t, mut together) = (0.0, 0);
        let mut aside = scene.system.clone();
        while t < 0.04 {
            scene.advance(0.04);
            t = scene.motion.as_ref().expect("it has begun").time();
            let modes = scene.system.modes().to_vec();
            let forces = scene.system.clone().forces(t, &scene.q, &scene.p).to_vec();
            // One copy that takes the modes over does as well as a new one at every state.
            aside.take_modes_of(&scene.system);
            assert_eq!(aside.modes(), modes);
            let copied = aside.forces(t, &scene.q, &scene.p);
            let most = apart(forces.as_flattened(), copied.as_flattened());
            assert!(most < 1e-6, "{t} s: {forces:?} N and {copied:?} N");
            for (contact, (mode, [normal, x, y])) in
                scene.system.system().contacts().iter().zip(modes.iter().zip(&forces))
            {
                // Forces are of the order of 10 N.
                let beyond = x.hypot(*y) - contact.friction * normal;
                assert!(
                    *mode == Mode::Open || beyond < 1e-6 && *normal > -1e-6,
                    "{t} s: {mode:?}, {beyond:e} N, {normal} N"
                );
            }
            together += usize::from(modes[..4] == [Mode::Slide; 4]);
        }
        assert!(together > 0 && scene.system.modes()[..4] == [Mode::Open; 4]);
        assert!(scene.events.0.iter().filter(|event| event.cause == Cause::Slipped).count() < 4);
    }
}

/// The pin crosses the clearance and strikes the bushing; it never leaves it.
#[test]
fn a_pin_stays_in_its_bushing() {
    let mut scene = begun("slider_crank_clearance");
    scene.tolerance = 1e-9;
    // From the middle, faces are 1 mm away, corners 1 mm / cos(22.5°).
    let farthest = 2e-3 + 1e-3 / (0.125 * std::f64::consts::PI).cos();
    let mut energy = scene.energy();
    for k in 1..=20 {
        scene.run(0.005 * f64::from(k));
        let gaps = scene.gaps();
        for gap in gaps.iter().step_by(3) {
            assert!((-1e-10..farthest).contains(gap), "{k}: {gaps:?}");
        }
        let now = scene.energy();
        assert!(now < energy + 1e-9, "{k}: {energy} J, then {now} J");
        energy = now;
    }
    assert!(scene.events.0.iter().filter(|e| e.cause == Cause::Landed).count() > 20);
}

/// The compass gait by its own equations: legs that roll on feet of radius `R`, with the point masses of the file. Angles
/// of the standing and the swinging leg against the normal of the slope, and their rates.
type State = [f64; 4];

const R: f64 = 0.001;
/// Masses of the hip and of a leg, kg; distance of that of a leg from the hip, m; the length of a leg is 1 m.
const MASSES: [f64; 2] = [10.0, 5.0];
const B: f64 = 0.5;

type Plane = [f64; 2];

fn along(a: Plane, b: Plane) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Mass, partial velocities by both rates, and acceleration at constant rates, of the hip, the standing and the swinging leg.
fn points([t, s, w, u]: State) -> [(f64, [Plane; 2], Plane); 3] {
    let on_leg = |length: f64| {
        let by_rate = [-R - length * t.cos(), -length * t.sin()];
        (by_rate, [length * t.sin() * w * w, -length * t.cos() * w * w])
    };
    let ((hip, hip_turn), (stand, stand_turn)) = (on_leg(1.0 - R), on_leg(1.0 - B - R));
    let swing_turn = [hip_turn[0] - B * s.sin() * u * u, hip_turn[1] + B * s.cos() * u * u];
    [
        (MASSES[0], [hip, [0.0; 2]], hip_turn),
        (MASSES[1], [stand, [0.0; 2]], stand_turn),
        (MASSES[1], [hip, [B * s.cos(), B * s.sin()]], swing_turn),
    ]
}

/// Solves for the two rates, or accelerations, that give the masses the momenta `of`.
fn solved(x: State, of: impl Fn(usize) -> Plane) -> [f64; 2] {
    let (mut m, mut f) = ([[0.0; 2]; 2], [0.0; 2]);
    for (k, (mass, partial, _)) in points(x).into_iter().enumerate() {
        for i in 0..2 {
            (0..2).for_each(|j| m[i][j] += mass * along(partial[i], partial[j]));
            f[i] += mass * along(partial[i], of(k));
        }
    }
    let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    [(m[1][1] * f[0] - m[0][1] * f[1]) / det, (m[0][0] * f[1] - m[1][0] * f[0]) / det]
}

fn rates(x: State) -> State {
    let slope = 3.0_f64.to_radians();
    let g = [9.81 * slope.sin(), -9.81 * slope.cos()];
    let all = points(x);
    let [a, b] = solved(x, |k| [g[0] - all[k].2[0], g[1] - all[k].2[1]]);
    [x[2], x[3], a, b]
}

fn runge_kutta(x: State, h: f64) -> State {
    let add = |k: State, h: f64| -> State { std::array::from_fn(|i| x[i] + h * k[i]) };
    let k1 = rates(x);
    let k2 = rates(add(k1, 0.5 * h));
    let k3 = rates(add(k2, 0.5 * h));
    let k4 = rates(add(k3, h));
    std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// A step from just after an impact to just after the next: its time, and the state.
fn step(mut x: State) -> (f64, State) {
    let (h, mut t) = (1e-3, 0.0);
    let height = |x: State| x[0].cos() - x[1].cos();
    loop {
        let next = runge_kutta(x, h);
        if next[0] < -0.05 && next[1] > 0.05 && height(next) < 0.0 && height(x) >= 0.0 {
            break;
        }
        (x, t) = (next, t + h);
        assert!(t < 3.0, "no landing");
    }
    let (mut a, mut b) = (0.0, h);
    for _ in 0..60 {
        let m = 0.5 * (a + b);
        (a, b) = if height(runge_kutta(x, m)) > 0.0 { (m, b) } else { (a, m) };
    }
    let x = runge_kutta(x, a);
    let velocities = points(x).map(|(_, [p, q], _)| [p[0] * x[2] + q[0] * x[3], p[1] * x[2] + q[1] * x[3]]);
    // The legs change their parts; the impulse at the new foot has no part in the equations of its own rates.
    let then = [x[1], x[0], 0.0, 0.0];
    let [w, u] = solved(then, |k| velocities[[0, 2, 1][k]]);
    (t + a, [x[1], x[0], w, u])
}

/// Passive steps on stones, against the limit cycle of its own equations: A. Goswami, B. Espiau, A. Keramane (1996) give
/// steps of 0.734 s and 0.535 m for point feet.
#[test]
fn the_compass_gait_walks_on_stones() {
    // Steps come back to the gait; what is left of a disturbance falls by 0.58 in a step.
    let mut x = [0.27, -0.27, -1.09, -0.38];
    for _ in 0..60 {
        x = step(x).1;
    }
    let (time, again) = step(x);
    assert!((time - 0.734_357_80).abs() < 1e-7 && x.iter().zip(again).all(|(a, b)| (a - b).abs() < 1e-10));
    let length = 2.0 * ((1.0 - R) * x[0].sin() + R * x[0]);
    assert!((length - 0.535_975).abs() < 1e-6, "{length}");
    // The file states the start to ten digits.
    let mut scene = begun("compass_gait");
    let v = scene.v();
    let start = [scene.q[2], scene.q[2] + scene.q[3], v[2], v[2] + v[3]];
    assert!(start.iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-9), "{start:?} {x:?}");
    scene.run(3.0);
    let landings: Vec<f64> = scene.events.0.iter().filter(|e| e.cause == Cause::Landed).map(|e| e.time).collect();
    assert_eq!(landings.len(), 4, "{:?}", scene.events.0);
    for (k, t) in landings.iter().enumerate() {
        let wanted = time * (k + 1) as f64;
        assert!((t - wanted).abs() < 1e-8, "{t} {wanted}");
    }
}
