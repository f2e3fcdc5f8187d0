//! Contacts between rounded bodies whose motion is known by analysis.

use std::f64::consts::PI;

use mbd_codegen::model::Model;
use mbd_runtime::contact::{Cause, ImpactOrder, Mode};
use mbd_runtime::spatial::{add3, dot3, scale3, Vec3};

use super::answers::{elliptic, shipped};
use super::scene::{model, Scene};

pub(super) const G: f64 = 9.81;

/// A body on slides along x, y and z, with shapes and contacts.
pub(super) fn flying(rest: &str) -> Model {
    let slide = |name: &str, parent: &str, child: &str, axis: &str| {
        format!(
            r#"
[[joint]]
name = "{name}"
type = "prismatic"
parent = "{parent}"
child = "{child}"
axis = {axis}
"#
        )
    };
    model(&format!(
        r#"
name = "flying"
gravity = [0, 0, -{G}]
[[body]]
name = "x"
[[body]]
name = "y"
[[body]]
name = "ball"
mass = 0.7
inertia = [0.01, 0.01, 0.01]
{}{}{}{rest}"#,
        slide("x", "ground", "x", "[1, 0, 0]"),
        slide("y", "x", "y", "[0, 1, 0]"),
        slide("z", "y", "ball", "[0, 0, 1]"),
    ))
}

/// Speeds of the balls of the cradle after the first impact, relative to that of the first ball before it, and the time
/// of the impact, s.
fn cradle(order: ImpactOrder) -> (Vec3<f64>, f64) {
    let mut scene = shipped(include_str!("../../../models/contacts/newtons_cradle.toml"), &[0.0; 3]);
    scene.order = order;
    scene.run(0.5);
    let first = scene.events.0[0];
    assert_eq!(first.cause, Cause::Landed);
    let (inertia, moment) = (0.1 * 0.25 + 1.6e-5, 0.1 * G * 0.5);
    let lowest = (2.0 * moment / inertia * (1.0 - 0.5_f64.cos())).sqrt();
    // The balls have moved on since; each has kept its energy.
    let (q, v) = (scene.q.clone(), scene.v());
    let then = |k: usize| {
        let squared = v[k] * v[k] + 2.0 * moment / inertia * (1.0 - q[k].cos());
        squared.sqrt().copysign(q[k]) / lowest
    };
    ([then(0), then(1), then(2)], first.time)
}

#[test]
fn newtons_cradle_divides_its_speed_by_the_order_of_the_impacts() {
    let (inertia, moment) = (0.1 * 0.25 + 1.6e-5, 0.1 * G * 0.5);
    let quarter = (inertia / moment).sqrt() * elliptic(0.25_f64.sin());
    for (order, wanted) in
        [(ImpactOrder::Simultaneous, [-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]), (ImpactOrder::Sequential, [0.0, 0.0, 1.0])]
    {
        let (speeds, time) = cradle(order);
        assert!((time - quarter).abs() < 1e-10, "{time} {quarter}");
        for (got, wanted) in speeds.iter().zip(wanted) {
            // A ball at rest is found by the square root of its energy.
            let error = if wanted == 0.0 { 1e-7 } else { 1e-10 };
            assert!((got - wanted).abs() < error, "{order:?}: {speeds:?}");
        }
    }
}

/// What is dropped at rest from `start` and bounces without friction and loss off a surface whose normal where it meets it
/// at `place` is `normal` is mirrored there.
pub(super) fn mirrored(rest: &str, start: Vec3<f64>, place: Vec3<f64>, normal: Vec3<f64>) {
    let mut scene = Scene::new(flying(rest), &start, &[0.0; 3]);
    let time = (2.0 * (start[2] - place[2]) / G).sqrt();
    let after = time + 0.01;
    scene.run(after);
    assert_eq!(scene.events.0.len(), 1, "{:?}", scene.events.0);
    assert!((scene.events.0[0].time - time).abs() < 1e-10, "{} {time}", scene.events.0[0].time);
    let before = [0.0, 0.0, -G * time];
    let v = add3(before, scale3(-2.0 * dot3(before, normal), normal));
    let wanted = add3(v, [0.0, 0.0, -G * (after - time)]);
    let got = scene.v();
    for k in 0..3 {
        assert!((got[k] - wanted[k]).abs() < 1e-9, "{got:?} {wanted:?}");
        let fallen = if k == 2 { 0.5 * G * 1e-4 } else { 0.0 };
        assert!((scene.q[k] - (place[k] + 0.01 * v[k] - fallen)).abs() < 1e-9);
    }
}

const SPHERES: &str = r#"
[[shape]]
name = "still"
body = "ground"
type = "sphere"
radius = 0.3
[[shape]]
name = "ball"
body = "ball"
type = "sphere"
radius = 0.2
"#;

pub(super) fn contact(names: [&str; 2], friction: f64, restitution: f64) -> String {
    let [a, b] = names;
    format!(
        "[[contact]]\nname = \"c\"\nbetween = [\"{a}\", \"{b}\"]\nfriction = {friction}\nrestitution = {restitution}\n"
    )
}

#[test]
fn a_sphere_is_mirrored_by_a_sphere() {
    let (x, y) = (0.12, -0.16);
    let z = (0.25_f64 - x * x - y * y).sqrt();
    // The contact point is on either side of the middle of the first frame.
    for names in [["still", "ball"], ["ball", "still"]] {
        let rest = format!("{SPHERES}{}", contact(names, 0.0, 1.0));
        mirrored(&rest, [x, y, 1.3], [x, y, z], scale3(2.0, [x, y, z]));
    }
    let point = SPHERES.replace("type = \"sphere\"\nradius = 0.2", "type = \"point\"");
    let z = (0.09_f64 - x * x - y * y).sqrt();
    let rest = format!("{point}{}", contact(["ball", "still"], 0.0, 1.0));
    mirrored(&rest, [x, y, 1.3], [x, y, z], scale3(1.0 / 0.3, [x, y, z]));
}

/// It leaves where the normal force is zero: `m g cos θ = m v²/R` with `v² = 2 g R (cos θ₀ − cos θ)`.
#[test]
fn what_slides_off_a_sphere_leaves_at_two_thirds_of_its_height() {
    let start: f64 = 0.2;
    let rest = format!("{SPHERES}{}", contact(["still", "ball"], 0.0, 0.0));
    let at = scale3(0.5, [start.sin() * 0.6, start.sin() * 0.8, start.cos()]);
    let mut scene = Scene::new(flying(&rest), &at, &[0.0; 3]);
    assert!(scene.gaps()[0].abs() < 1e-15);
    scene.run(0.9);
    let leaves = scene.events.0.iter().find(|e| e.cause == Cause::Unloaded).expect("it leaves");
    let cosine = start.cos() * 2.0 / 3.0;
    let speed = (2.0 * G * 0.5 * (start.cos() - cosine)).sqrt();
    let t = 0.9 - leaves.time;
    assert!(t > 0.0);
    let height = 0.5 * cosine - speed * (1.0 - cosine * cosine).sqrt() * t - 0.5 * G * t * t;
    assert!((scene.q[2] - height).abs() < 1e-8, "{} {height}", scene.q[2]);
    let across = (scene.q[0] * scene.q[0] + scene.q[1] * scene.q[1]).sqrt();
    let wanted = 0.5 * (1.0 - cosine * cosine).sqrt() + speed * cosine * t;
    assert!((across - wanted).abs() < 1e-8, "{across} {wanted}");
}

/// A solid ball that rolls down from a ball keeps `7/10 m v² + m g R cos θ` and turns by its way over its own radius.
#[test]
fn a_ball_rolls_down_from_a_ball() {
    let (mass, big, small) = (0.5, 0.3, 0.2);
    let inertia = 0.4 * mass * small * small;
    let text = |loops: &str| {
        format!(
            r#"
name = "rolls"
gravity = [0, 0, -{G}]
[[body]]
name = "ball"
mass = {mass}
inertia = [{inertia}, {inertia}, {inertia}]
[[joint]]
name = "free"
type = "floating"
parent = "ground"
child = "ball"
{SPHERES}{loops}"#
        )
    };
    let sticks = contact(["still", "ball"], 50.0, 0.0);
    let held =
        "[[loop]]\nname = \"c\"\ntype = \"rolling_balls\"\nbetween = [\"ground\", \"ball\"]\nradii = [0.3, 0.2]\n";
    let start: f64 = 0.3;
    let (r, cosine) = (big + small, |q: &[f64]| q[2] / (big + small));
    for (text, many) in [(text(&sticks), 1), (text(held), 0)] {
        let model = model(&text);
        let plan = mbd_codegen::plan::Plan::new(&model, 1e-9);
        let (mut q, v) = (plan.start(), vec![0.0; 6]);
        for (k, x) in [start.sin() * 0.6, start.sin() * 0.8, start.cos()].into_iter().enumerate() {
            q[k] = r * x;
        }
        let mut scene = Scene::new(model, &q, &v);
        scene.run(0.5);
        assert_eq!(scene.system.modes(), &vec![Mode::Stick; many][..]);
        let at = &scene.q[..3];
        let distance = dot3([at[0], at[1], at[2]], [at[0], at[1], at[2]]).sqrt();
        assert!((distance - r).abs() < 1e-11, "{distance}");
        assert!((at[0] * 0.8 - at[1] * 0.6).abs() < 1e-10, "{at:?} leaves its plane");
        let speed = (10.0 / 7.0 * G * r * (start.cos() - cosine(at))).sqrt();
        assert!(speed > 0.5 && cosine(at) > 10.0 / 17.0 * start.cos(), "{speed}");
        let v = scene.v();
        let [linear, angular] = [0, 3].map(|k| dot3([v[k], v[k + 1], v[k + 2]], [v[k], v[k + 1], v[k + 2]]).sqrt());
        assert!((linear - speed).abs() < 1e-9 && (angular - speed / small).abs() < 1e-8, "{linear} {angular} {speed}");
    }
}

/// A quarter of the period of the balls, to which the cradle's impact is compared, is that of small swings for small ones.
#[test]
fn the_elliptic_integral_begins_at_a_right_angle() {
    assert!((elliptic(0.0) - 0.5 * PI).abs() < 1e-15);
}
