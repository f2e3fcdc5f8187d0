//! More scenes whose motion is known by analysis: spheres that slide and roll, pendulums and mechanisms that strike stops,
//! wheels and blocks that fall from edge to edge.

use std::f64::consts::PI;

use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_runtime::constrained::{close, Closing};
use mbd_runtime::contact::{Cause, Hybrid, Mode};
use mbd_runtime::integrate::{Dop853, Step, Tolerances};

use super::known::on_floor;
use super::scene::{model, Events, Mechanism, Scene};

const G: f64 = 9.81;

/// A scene of the models that are shipped, at the start that its file gives, with its loops closed.
pub(super) fn shipped(text: &str, v: &[f64]) -> Scene {
    let model = model(text);
    let plan = Plan::new(&model, 1e-9);
    let mut start = plan.start();
    let mut mechanism: Mechanism = plan.default_contact_interpreter();
    close(&mut mechanism, &mut start, &Closing::holding(&plan.held())).unwrap();
    Scene::new(model, &start, v)
}

/// Complete elliptic integral of the first kind of modulus `k`, by the arithmetic-geometric mean.
pub(super) fn elliptic(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    for _ in 0..30 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    PI / (2.0 * a)
}

/// A sphere of 0.1 m and 0.5 kg whose moment of inertia is that of a solid one, on a floor; gravity is inclined instead of
/// the floor, so that bodies are pulled along x. Its centre of mass may be off the middle, along z.
fn sphere(friction: f64, slope: f64, off: f64) -> Model {
    let (x, z) = (G * slope.sin(), -G * slope.cos());
    let inertia = 0.4 * 0.5 * 0.1 * 0.1;
    let mut model = model(&format!(
        r#"
name = "sphere"
gravity = [{x}, 0, {z}]
[[body]]
name = "sphere"
mass = 0.5
com = [0, 0, {off}]
inertia = [{inertia}, {inertia}, {inertia}]
[[joint]]
name = "motion"
type = "floating"
child = "sphere"
"#
    ));
    on_floor(&mut model, "floor", 0, [0.0; 3], 0.1, friction, 0.0);
    model
}

const LYING: [f64; 7] = [0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0];

/// A sphere with any spin slides with a constant direction of slip `u` until `2|u|/(7 µ g)`, on a parabola, and rolls with
/// `v − 2u/7`: C. Coriolis, Théorie mathématique des effets du jeu de billard, 1835.
#[test]
fn a_billiard_ball_slides_on_a_parabola_and_rolls_on_a_line() {
    let (friction, r) = (0.2, 0.1);
    let (v, w) = ([1.5, 0.3], [-12.0, 8.0, 30.0]);
    let mut scene = Scene::new(sphere(friction, 0.0, 0.0), &LYING, &[v[0], v[1], 0.0, w[0], w[1], w[2]]);
    let u = [v[0] - r * w[1], v[1] + r * w[0]];
    let speed = u[0].hypot(u[1]);
    let time = 2.0 * speed / (7.0 * friction * G);
    scene.run(time + 0.5);
    let stop = scene.events.0.first().unwrap();
    assert_eq!(stop.cause, Cause::Stopped);
    assert!((stop.time - time).abs() < 1e-11, "{:e}", stop.time - time);
    for k in 0..2 {
        let rolls = v[k] - 2.0 / 7.0 * u[k];
        let at = 0.5 * (v[k] + rolls) * time + 0.5 * rolls;
        assert!((scene.q[k] - at).abs() < 1e-10, "{k} {:e}", scene.q[k] - at);
    }
    assert_eq!(scene.system.modes(), [Mode::Stick]);
}

/// A sphere rolls down an incline with 5/7 of the acceleration of what slides, where friction is at least 2/7 of the slope;
/// with less it slides and turns with `5 µ g cos/(2 r)`.
#[test]
fn a_sphere_rolls_or_slides_down_an_incline() {
    let (slope, r): (f64, f64) = (0.4, 0.1);
    let mut scene = Scene::new(sphere(0.3, slope, 0.0), &LYING, &[0.0; 6]);
    scene.run(1.0);
    assert_eq!(scene.system.modes(), [Mode::Stick]);
    assert!((scene.q[0] - 0.5 * 5.0 / 7.0 * G * slope.sin()).abs() < 1e-11, "{:?}", scene.q);
    let friction = 0.1;
    let mut scene = Scene::new(sphere(friction, slope, 0.0), &LYING, &[0.0; 6]);
    scene.run(1.0);
    assert_eq!(scene.system.modes(), [Mode::Slide]);
    let at = 0.5 * G * (slope.sin() - friction * slope.cos());
    assert!((scene.q[0] - at).abs() < 1e-9, "{:e}", scene.q[0] - at);
    let turn = scene.v()[4] - 2.5 * friction * G * slope.cos() / r;
    assert!(turn.abs() < 1e-8, "{turn:e}");
}

/// A small body that slides in a curve down an incline that cannot hold it in the long run stops after
/// `(a v_x + b v)/(b² − a²)`, with `a = g sin`, `b = µ g cos`.
#[test]
fn a_body_that_slides_in_a_curve_stops() {
    let (slope, friction): (f64, f64) = (0.3, 0.6);
    let slider = |name: &str, parent: &str, axis: &str, mass: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass}\n[[joint]]\nname = \"{name}\"\ntype = \"prismatic\"\n\
             parent = \"{parent}\"\nchild = \"{name}\"\naxis = {axis}\n"
        )
    };
    let mut model = model(&format!(
        "name = \"particle\"\ngravity = [{}, 0, {}]\n{}{}{}",
        G * slope.sin(),
        -G * slope.cos(),
        slider("x", "ground", "[1, 0, 0]", 0.0),
        slider("y", "x", "[0, 1, 0]", 0.0),
        slider("z", "y", "[0, 0, 1]", 0.7),
    ));
    on_floor(&mut model, "floor", 2, [0.0; 3], 0.0, friction, 0.0);
    let (vx, vy) = (0.5, 1.2);
    let mut scene = Scene::new(model, &[0.0; 3], &[vx, vy, 0.0]);
    scene.run(3.0);
    let (a, b, v) = (G * slope.sin(), friction * G * slope.cos(), f64::hypot(vx, vy));
    let time = (a * vx + b * v) / (b * b - a * a);
    let stop = scene.events.0.last().unwrap();
    assert_eq!((stop.cause, scene.system.modes()), (Cause::Stopped, &[Mode::Stick][..]));
    assert!((stop.time - time).abs() < 1e-10, "{:e}", stop.time - time);
}

/// A sphere that rolls on a turntable goes in circles with 2/7 of its angular velocity, wherever it starts: E. J. Routh,
/// Dynamics of a system of rigid bodies, part II, 1905. A table of large inertia stands for one that is driven.
#[test]
fn a_sphere_on_a_turntable_goes_in_circles() {
    let (turn, r) = (3.0, 0.1);
    let inertia = 0.4 * 0.5 * r * r;
    let model = model(&format!(
        r#"
name = "turntable"
[[body]]
name = "table"
mass = 1.0
inertia = [1e9, 1e9, 1e9]
[[joint]]
name = "table"
type = "revolute"
child = "table"
[[body]]
name = "sphere"
mass = 0.5
inertia = [{inertia}, {inertia}, {inertia}]
[[joint]]
name = "motion"
type = "floating"
child = "sphere"
[[shape]]
name = "top"
body = "table"
type = "plane"
[[shape]]
name = "skin"
body = "sphere"
type = "sphere"
radius = {r}
[[contact]]
name = "rolls"
between = ["top", "skin"]
friction = 1.0
"#
    ));
    let (x, v) = (0.3, [0.1, 0.4]);
    // The material point of the sphere at the contact has the velocity of the table there, (0, turn x).
    let w = [(turn * x - v[1]) / r, v[0] / r, 0.7];
    let q = [0.0, x, 0.0, r, 0.0, 0.0, 0.0, 1.0];
    let mut scene = Scene::new(model, &q, &[turn, v[0], v[1], 0.0, w[0], w[1], w[2]]);
    scene.run(2.0);
    assert_eq!(scene.system.modes(), [Mode::Stick]);
    let rate: f64 = 2.0 / 7.0 * turn;
    let (s, c) = (rate * 2.0).sin_cos();
    let at = [x + (v[0] * s - v[1] * (1.0 - c)) / rate, (v[0] * (1.0 - c) + v[1] * s) / rate];
    for k in 0..2 {
        // The table's speed changes by the sphere's share of the inertia, 1e-10 of it.
        assert!((scene.q[1 + k] - at[k]).abs() < 2e-9, "{k} {:e}", scene.q[1 + k] - at[k]);
    }
}

/// The angular momentum of a top with a spherical base along the line from its centre of mass to the contact is constant,
/// whatever friction does: J. H. Jellett, A treatise on the theory of friction, 1872.
#[test]
fn a_top_that_slides_keeps_jelletts_constant() {
    let off = -0.03;
    let text = format!(
        r#"
name = "top"
[[body]]
name = "top"
mass = 0.1
com = [0, 0, {off}]
inertia = [5e-4, 5e-4, 5e-4]
[[joint]]
name = "motion"
type = "floating"
child = "top"
"#
    );
    let mut top = model(&text);
    on_floor(&mut top, "floor", 0, [0.0; 3], 0.1, 0.1, 0.0);
    let tilt: f64 = 1.0;
    let q = [0.0, 0.0, 0.1, (0.5 * tilt).sin(), 0.0, 0.0, (0.5 * tilt).cos()];
    let mut scene = Scene::new(top, &q, &[0.0, 0.0, 0.0, 0.0, 0.0, 150.0]);
    scene.tolerance = 1e-10;
    let jellett = |scene: &mut Scene| {
        let v = scene.v();
        // In the body's axes: up, from the centre of mass to the contact, angular momentum about the centre of mass.
        let [x, y, z, w] = [scene.q[3], scene.q[4], scene.q[5], scene.q[6]];
        let up = [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)];
        let arm = [-0.1 * up[0], -0.1 * up[1], -0.1 * up[2] - off];
        5e-4 * (v[3] * arm[0] + v[4] * arm[1] + v[5] * arm[2])
    };
    let constant = jellett(&mut scene);
    let mut energy = scene.energy();
    for k in 1..=10 {
        scene.run(0.5 * f64::from(k));
        let now = jellett(&mut scene);
        assert!((now / constant - 1.0).abs() < 1e-7, "{k} {:e}", now / constant - 1.0);
        let left = scene.energy();
        assert!(left < energy);
        energy = left;
    }
}

/// A pendulum that swings against a stop: quarter and half periods by elliptic integrals.
#[test]
fn a_pendulum_strikes_a_stop() {
    let (length, e, start): (f64, f64, f64) = (0.8, 0.7, 1.2);
    let model = model(&format!(
        r#"
name = "pendulum"
[[body]]
name = "rod"
mass = 1.3
com = [0, 0, -{length}]
[[joint]]
name = "pin"
type = "revolute"
child = "rod"
axis = [0, 1, 0]
limits = {{ lower = 0 }}
limit_restitution = {e}
"#
    ));
    let mut scene = Scene::new(model, &[start], &[0.0]);
    scene.run(6.0);
    let rate = (G / length).sqrt();
    let (mut amplitude, mut time) = (start, 0.0);
    let mut part = 1.0;
    for event in scene.events.0.iter().take(5) {
        time += part * elliptic((0.5 * amplitude).sin()) / rate;
        part = 2.0;
        assert!((event.time - time).abs() < 1e-11, "{:e}", event.time - time);
        let speed = 2.0 * rate * (0.5 * amplitude).sin();
        assert!((event.approach - speed).abs() < 1e-10, "{:e}", event.approach - speed);
        amplitude = 2.0 * (e * (0.5 * amplitude).sin()).asin();
    }
    assert!(scene.events.0.len() >= 5);
}

/// Housner's ratio of the angular velocities of a block that rocks from one edge to the other, and the time of its first
/// impact by quadrature.
#[test]
fn a_block_rocks_from_edge_to_edge() {
    let mut scene = shipped(include_str!("../../../models/contacts/rocking_block.toml"), &[0.0; 3]);
    scene.run(1.0);
    let landing = scene.events.0.iter().find(|event| event.impact.is_some()).unwrap();
    let (half, alpha, tilt) = (0.17_f64.sqrt(), 0.25_f64.atan(), 0.1);
    // m g R (cos(alpha - tilt) - cos(alpha - now)) = I w²/2, I = 4/3 m R².
    let fall = |now: f64| (1.5 * G / half * ((alpha - now).cos() - (alpha - tilt).cos()).abs()).sqrt();
    // With tilt (1 - s²) in place of the angle the integrand is smooth; at s = 0 it is its limit.
    let n = 400;
    let integrand = |s: f64| match s == 0.0 {
        true => 2.0 * tilt / (1.5 * G / half * (alpha - tilt).sin() * tilt).sqrt(),
        false => 2.0 * tilt * s / fall(tilt * (1.0 - s * s)),
    };
    let weight = |k: usize| if k == 0 || k == n { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
    let time: f64 = (0..=n).map(|k| weight(k) * integrand(k as f64 / n as f64) / (3.0 * n as f64)).sum();
    assert!((landing.time - time).abs() < 1e-9, "{} {time}", landing.time);
    let before = fall(0.0);
    assert!((landing.approach - 0.2 * before).abs() < 1e-9, "{} {}", landing.approach, 0.2 * before);
    let ratio = 1.0 - 1.5 * alpha.sin().powi(2);
    let lost = 0.5 * (4.0 / 3.0 * 0.17) * before * before * (1.0 - ratio * ratio);
    let impact = landing.impact.unwrap();
    // The inertia of the file has nine digits.
    assert!((impact.energy + lost).abs() < 1e-9 * lost, "{} {lost}", impact.energy);
}

/// Number of spokes, length, slope, mass and inertia of the wheel without a rim.
pub(super) const SPOKES: (u32, f64, f64, f64, f64) = (8, 0.5, 0.08, 2.0, 0.1);

/// A wheel without a rim in a plane, on a slope; its coordinates are x along the slope, y across it, and an angle.
pub(super) fn rimless_wheel() -> Model {
    let (spokes, length, slope, mass, inertia) = SPOKES;
    let mut wheel = model(&format!(
        r#"
name = "rimless_wheel"
gravity = [{}, 0, {}]
[[body]]
name = "wheel"
mass = {mass}
inertia = [0.1, {inertia}, 0.1]
[[joint]]
name = "motion"
type = "planar"
child = "wheel"
rpy = [{{ deg = 90 }}, 0, 0]
"#,
        G * slope.sin(),
        -G * slope.cos()
    ));
    let half = PI / f64::from(spokes);
    for k in 0..spokes {
        let (s, c) = (half * f64::from(2 * k + 1)).sin_cos();
        on_floor(&mut wheel, &format!("spoke/{k}"), 0, [length * s, 0.0, -length * c], 0.0, 2.0, 0.0);
    }
    // The joint's axes are turned, so that the body's are as well: its y is up.
    for contact in &mut wheel.contacts {
        let mbd_codegen::model::ConstraintKind::Loop { second, .. } = &mut contact.kind else { unreachable!() };
        let [x, y, z] = second.placement.xyz;
        second.placement.xyz = [x, z, y];
    }
    wheel
}

/// It falls from spoke to spoke; its angular velocity comes to the one at which each impact takes what the slope gives:
/// T. McGeer, Passive dynamic walking, 1990.
#[test]
fn a_rimless_wheel_comes_to_its_limit_cycle() {
    let (spokes, length, slope, mass, inertia) = SPOKES;
    let (wheel, half) = (rimless_wheel(), PI / f64::from(spokes));
    let about = inertia + mass * length * length;
    let ratio = (inertia + mass * length * length * (2.0 * half).cos()) / about;
    let speed = (4.0 * mass * G * length * half.sin() * slope.sin() / (about * (1.0 - ratio * ratio))).sqrt();
    // It stands on two spokes and starts to fall over the front one.
    let start = 1.2 * speed * ratio;
    let q = [0.0, length * half.cos(), 0.0];
    let mut scene = Scene::new(wheel, &q, &[start * length * half.cos(), -start * length * half.sin(), -start]);
    scene.run(40.0);
    let last = scene.events.0.iter().rev().find(|event| event.impact.is_some()).unwrap();
    let approach = speed * 2.0 * length * half.sin();
    assert!((last.approach - approach).abs() < 1e-8, "{} {approach}", last.approach);
}

/// A mechanism with a closed loop and one freedom strikes a stop: its speed is reversed by the restitution, and energy is
/// lost with its square.
#[test]
fn a_four_bar_strikes_a_stop() {
    let mut scene = shipped(include_str!("../../../models/contacts/fourbar_stop.toml"), &[0.0; 3]);
    let before = scene.energy();
    scene.run(2.0);
    let impacts: Vec<_> =
        scene.events.0.iter().filter_map(|event| Some((event.approach, event.impact?.energy))).collect();
    let lost: f64 = impacts.iter().map(|(_, energy)| energy).sum();
    let change = scene.energy() - before;
    assert!((change - lost).abs() < 1e-9, "{change} {lost}");
    // All of them at the same place, so that the kinetic energy is the same multiple of the square of the speed: a quarter
    // of it is left.
    for pair in impacts.windows(2).take(3) {
        let [(first, taken), (second, other)] = [pair[0], pair[1]];
        assert!((second / first - 0.5).abs() < 1e-8, "{first} {second}");
        assert!((other / taken - 0.25).abs() < 1e-7, "{taken} {other}");
    }
    assert!(impacts.len() > 3, "{impacts:?}");
}

/// A hopper's landing and its leaving: free fall, a harmonic motion on its spring, and the force on the floor going to zero.
#[test]
fn a_hopper_lands_and_leaves() {
    let mut scene = shipped(include_str!("../../../models/contacts/hopper.toml"), &[0.0; 2]);
    scene.run(0.45);
    let (m, foot, k, height) = (1.0, 0.2, 400.0_f64, 0.3);
    let landing = (2.0 * height / G).sqrt();
    let (rate, v, d) = ((k / m).sqrt(), -G * landing, m * G / k);
    // x = -d + d cos + (v/rate) sin: leaves where x = foot g/k, on the way up.
    let (amplitude, phase) = (d.hypot(v / rate), (v / rate).atan2(d));
    let leaves = landing + (2.0 * PI - ((foot * G / k + d) / amplitude).acos() + phase) / rate;
    let [first, second] = [&scene.events.0[0], &scene.events.0[1]];
    assert!((first.time - landing).abs() < 1e-12, "{:e}", first.time - landing);
    assert!((first.impact.unwrap().energy + 0.5 * foot * v * v).abs() < 1e-12);
    assert_eq!(second.cause, Cause::Unloaded);
    assert!((second.time - leaves).abs() < 1e-10, "{} {leaves}", second.time);
}

/// A method that does not project momenta leaves the multipliers of the floor in them; the hopper leaves it all the same.
#[test]
fn a_hopper_leaves_with_momenta_that_were_not_projected() {
    let hopper = || shipped(include_str!("../../../models/contacts/hopper.toml"), &[0.0; 2]);
    let mut projected = hopper();
    projected.run(0.6);
    let Scene { mut system, mut q, mut p, mut events, tolerance, .. } = hopper();
    let method = Dop853::new(&system);
    let step = Step::Adaptive(Tolerances::new(tolerance));
    let mut motion = Hybrid::new(&mut system, method, step, 0.0, &q, &p).unwrap();
    motion.run(&mut system, 0.6, &mut events).unwrap();
    motion.state(&system, &mut q, &mut p);
    let causes = |events: &Events| events.0.iter().map(|event| event.cause).collect::<Vec<_>>();
    assert_eq!(causes(&events), causes(&projected.events));
    assert!(causes(&events).contains(&Cause::Unloaded));
    // Between the events, momenta lose digits to multipliers that are some hundred times as large.
    for (a, b) in q.iter().chain(&p).zip(projected.q.iter().chain(&projected.p)) {
        assert!((a - b).abs() < 1e-9, "{q:?} {p:?}, {:?} {:?}", projected.q, projected.p);
    }
}

/// A slender rod that strikes a smooth floor: its impulse is `−(1 + e) v_n` over what the rod's end weighs there.
#[test]
fn a_rod_strikes_a_smooth_floor() {
    let (mass, half, e, angle, height): (f64, f64, f64, f64, f64) = (1.5, 0.4, 0.6, 0.7, 0.5);
    let inertia = mass * half * half / 3.0;
    let mut rod = model(&format!(
        r#"
name = "rod"
[[body]]
name = "rod"
mass = {mass}
inertia = [{inertia}, {inertia}, {inertia}]
[[joint]]
name = "motion"
type = "planar"
child = "rod"
rpy = [{{ deg = 90 }}, 0, 0]
"#
    ));
    on_floor(&mut rod, "end", 0, [-half, 0.0, 0.0], 0.0, 0.0, e);
    let q = [0.0, half * angle.sin() + height, angle];
    let mut scene = Scene::new(rod, &q, &[0.0; 3]);
    scene.run(0.4);
    let landing = &scene.events.0[0];
    let time = (2.0 * height / G).sqrt();
    assert!((landing.time - time).abs() < 1e-12);
    let arm = half * angle.cos();
    let weight = 1.0 / (1.0 / mass + arm * arm / inertia);
    let lost = 0.5 * weight * (1.0 - e * e) * (G * time).powi(2);
    assert!((landing.impact.unwrap().energy + lost).abs() < 1e-11, "{:?} {lost}", landing.impact);
}
