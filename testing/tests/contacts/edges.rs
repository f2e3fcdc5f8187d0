//! Contacts of capsules, boxes and cylinders whose motion is known by analysis.

use mbd_codegen::plan::Plan;
use mbd_runtime::contact::{Cause, Mode};

use super::round::{contact, flying, mirrored, G};
use super::scene::{model, Scene};

/// A shape of the ground, `still`, and one of the flying body, `ball`.
fn shapes(still: &str, ball: &str) -> String {
    format!("[[shape]]\nname = \"still\"\n{still}\n[[shape]]\nname = \"ball\"\nbody = \"ball\"\n{ball}\n")
}

const CRATE: &str = "type = \"box\"\nsize = [0.6, 0.8, 0.4]";
const CAN: &str = "type = \"cylinder\"\nradius = 0.3\nlength = 0.4";
const PILL: &str = "type = \"capsule\"\nradius = 0.3\nlength = 0.8\nrpy = [0, { deg = 90 }, 0]";
const BALL: &str = "type = \"sphere\"\nradius = 0.2";
const ORDERS: [[&str; 2]; 2] = [["still", "ball"], ["ball", "still"]];

/// Faces, edges, corners, mantles, rims and ends.
#[test]
fn a_sphere_is_mirrored_by_what_it_meets() {
    // Directions of rational length: (2, 3, 6)/7, (0.6, 0, 0.8).
    let cases: [(&str, [f64; 3], [f64; 3]); 7] = [
        (CRATE, [0.1, -0.3, 0.2], [0.0, 0.0, 1.0]),
        (CRATE, [0.3, 0.1, 0.2], [0.6, 0.0, 0.8]),
        (CRATE, [-0.3, 0.4, 0.2], [-2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0]),
        (CAN, [0.1, 0.1, 0.2], [0.0, 0.0, 1.0]),
        (CAN, [0.18, 0.24, 0.2], [0.36, 0.48, 0.8]),
        (PILL, [0.1, -0.18, 0.24], [0.0, -0.6, 0.8]),
        (PILL, [0.4 + 0.3 * 2.0 / 7.0, 0.3 * 3.0 / 7.0, 0.3 * 6.0 / 7.0], [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0]),
    ];
    for (still, at, normal) in cases {
        let middle = [0, 1, 2].map(|k| at[k] + 0.2 * normal[k]);
        let start = [middle[0], middle[1], 1.3];
        for names in ORDERS {
            mirrored(&format!("{}{}", shapes(still, BALL), contact(names, 0.0, 1.0)), start, middle, normal);
        }
    }
    // A point meets the top of a box, and the end of a capsule.
    let point = |still: &str| format!("{}{}", shapes(still, "type = \"point\""), contact(ORDERS[0], 0.0, 1.0));
    mirrored(&point(CRATE), [0.1, -0.3, 1.3], [0.1, -0.3, 0.2], [0.0, 0.0, 1.0]);
    mirrored(&point(CAN), [0.1, -0.2, 1.3], [0.1, -0.2, 0.2], [0.0, 0.0, 1.0]);
    let (_, at, normal) = cases[6];
    mirrored(&point(PILL), [at[0], at[1], 1.3], at, normal);
}

/// A sphere meets the lower side of a mantle that lies.
#[test]
fn a_sphere_is_mirrored_by_a_mantle() {
    let still = format!("{CAN}\nrpy = [0, {{ deg = 90 }}, 0]");
    let rest = format!("{}{}", shapes(&still, BALL), contact(ORDERS[0], 0.0, 1.0));
    mirrored(&rest, [0.1, -0.3, 1.3], [0.1, -0.3, 0.4], [0.0, -0.6, 0.8]);
}

/// Capsules that cross at any angle touch above their crossing.
#[test]
fn a_capsule_falls_across_a_capsule() {
    for (angle, place) in [(90.0, [0.1, 0.05]), (20.0, [-0.2, 0.02]), (135.0, [0.0, -0.1])] {
        let ball =
            format!("type = \"capsule\"\nradius = 0.1\nlength = 0.7\nrpy = [0, {{ deg = 90 }}, {{ deg = {angle} }}]");
        for names in ORDERS {
            let rest = format!("{}{}", shapes(PILL, &ball), contact(names, 0.0, 1.0));
            mirrored(&rest, [place[0], place[1], 1.3], [place[0], place[1], 0.4], [0.0, 0.0, 1.0]);
        }
    }
}

/// A body of 0.2 m radius without friction goes over an edge about which its middle turns at distance `radius`: it leaves
/// where its weight no longer holds it, at `3 cos θ = 2 + v²/(g R)`.
fn leaves(still: &str, [x, z]: [f64; 2], end: f64, radius: f64, speed: f64) {
    let start = [x, 0.0, z];
    for names in ORDERS {
        let rest = format!("{}{}", shapes(still, BALL), contact(names, 0.0, 0.0));
        let mut scene = Scene::new(flying(&rest), &start, &[speed, 0.0, 0.0]);
        assert!(scene.gaps()[0].abs() < 1e-15);
        let ratio = speed * speed / (G * radius);
        let cosine = (2.0 + ratio) / 3.0;
        assert!(cosine < 1.0);
        scene.run(0.9);
        let event = *scene.events.0.iter().find(|e| e.cause == Cause::Unloaded).expect("it leaves");
        let t = 0.9 - event.time;
        assert!(t > 0.0);
        let fast = (speed * speed + 2.0 * G * radius * (1.0 - cosine)).sqrt();
        let height = start[2] - radius * (1.0 - cosine) - fast * (1.0 - cosine * cosine).sqrt() * t - 0.5 * G * t * t;
        assert!((scene.q[2] - height).abs() < 1e-8, "{still}: {} {height}", scene.q[2]);
        let v = scene.v()[0];
        assert!((v - fast * cosine).abs() < 1e-8, "{still}: {v} {}", fast * cosine);
        assert!(scene.q[1].abs() < 1e-12);
        assert!(event.time > (end - x) / speed, "{}", event.time);
    }
}

#[test]
fn what_slides_over_an_edge_leaves_it() {
    leaves(PILL, [0.1, 0.5], 0.4, 0.5, 0.9);
    leaves(CRATE, [0.1, 0.4], 0.3, 0.2, 0.5);
    leaves(CAN, [0.1, 0.4], 0.3, 0.2, 0.5);
    leaves(&format!("{CAN}\nrpy = [0, {{ deg = 90 }}, 0]"), [0.0, 0.5], 0.2, 0.2, 0.5);
}

/// A body faster than its weight can hold on an edge flies off where the edge begins.
#[test]
fn what_is_fast_leaves_at_the_edge() {
    let rest = format!("{}{}", shapes(CRATE, BALL), contact(ORDERS[0], 0.0, 0.0));
    let mut scene = Scene::new(flying(&rest), &[0.1, 0.0, 0.4], &[2.0, 0.0, 0.0]);
    scene.run(0.3);
    let event = *scene.events.0.iter().find(|e| e.cause == Cause::Unloaded).expect("it leaves");
    assert!((event.time - 0.1).abs() < 1e-9, "{}", event.time);
    assert!((scene.q[2] - (0.4 - 0.5 * G * 0.04)).abs() < 1e-8, "{}", scene.q[2]);
}

/// A solid ball of 0.2 m that rolls, on `still`, in a field of gravity that is inclined by `slope` towards x.
fn rolls(still: &str, slope: f64, height: f64, loops: Option<&str>, speed: f64) -> Scene {
    let mass = 0.5;
    let inertia = 0.4 * mass * 0.04;
    let rest = match loops {
        None => format!("{}{}", shapes(still, BALL), contact(ORDERS[0], 50.0, 0.0)),
        Some(held) => format!("[[loop]]\nname = \"c\"\nbetween = [\"ground\", \"ball\"]\n{held}\n"),
    };
    let model = model(&format!(
        r#"
name = "rolls"
gravity = [{}, 0, {}]
[[body]]
name = "ball"
mass = {mass}
inertia = [{inertia}, {inertia}, {inertia}]
[[joint]]
name = "free"
type = "floating"
parent = "ground"
child = "ball"
{rest}"#,
        G * slope.sin(),
        -G * slope.cos()
    ));
    let mut q = Plan::new(&model, 1e-9).start();
    q[2] = height;
    Scene::new(model, &q, &[speed, 0.0, 0.0, 0.0, speed / 0.2, 0.0])
}

/// `a = 5/7 g sin α` along whatever is straight.
#[test]
fn a_ball_rolls_down_what_is_straight() {
    let long = |text: &str| format!("{text}\nrpy = [0, {{ deg = 90 }}, 0]");
    let pill = long("type = \"capsule\"\nradius = 0.3\nlength = 10");
    let can = long("type = \"cylinder\"\nradius = 0.3\nlength = 10");
    let crate_ = "type = \"box\"\nsize = [10, 1, 0.6]";
    let pill_loop = "type = \"rolling_capsules\"\naxis = [1, 0, 0]\nlengths = [10, 0]\nradii = [0.3, 0.2]";
    let box_loop = "type = \"rolling_ball_on_box\"\nsize = [10, 1, 0.6]\nradius = 0.2";
    let can_loop = "type = \"rolling_ball_on_cylinder\"\naxis = [1, 0, 0]\nlength = 10\nradii = [0.3, 0.2]";
    let cases = [
        (pill.as_str(), None),
        (can.as_str(), None),
        (crate_, None),
        ("", Some(pill_loop)),
        ("", Some(box_loop)),
        ("", Some(can_loop)),
    ];
    let slope = 0.3_f64;
    let a = 5.0 / 7.0 * G * slope.sin();
    for (still, held) in cases {
        let mut scene = rolls(still, slope, 0.5, held, 0.0);
        scene.run(0.8);
        assert_eq!(scene.system.modes(), &vec![Mode::Stick; usize::from(held.is_none())][..]);
        let v = scene.v();
        assert!((scene.q[0] - 0.5 * a * 0.64).abs() < 1e-10, "{still} {held:?}: {}", scene.q[0]);
        assert!((v[0] - a * 0.8).abs() < 1e-10 || (v[4] - a * 0.8 / 0.2).abs() < 1e-9, "{v:?}");
        assert!((v[4] - a * 0.8 / 0.2).abs() < 1e-9, "{v:?}");
        assert!((scene.q[2] - 0.5).abs() < 1e-12 && scene.q[1].abs() < 1e-9, "{:?}", scene.q);
    }
}

/// `7/10 m v² + m g z` stays as a ball rolls from the straight part over an edge or end about which its middle turns.
#[test]
fn a_ball_rolls_over_an_edge() {
    for (still, radius, height, end) in [(PILL, 0.5, 0.5, 0.4), (CRATE, 0.2, 0.4, 0.3), (CAN, 0.2, 0.4, 0.3)] {
        let speed: f64 = 0.3;
        let mut scene = rolls(still, 0.0, height, None, speed);
        // The middle is at the edge, then turns by θ with R θ̈ = 5/7 g sin θ.
        scene.run(end / speed);
        assert!((scene.q[0] - end).abs() < 1e-9, "{still}: {}", scene.q[0]);
        let mut t = end / speed;
        while scene.q[2] - height > -0.15 * radius {
            t += 0.02;
            scene.run(t);
        }
        assert_eq!(scene.system.modes(), [Mode::Stick]);
        let cosine = (scene.q[2] - height) / radius + 1.0;
        let off = ((scene.q[0] - end).powi(2) + (scene.q[2] - height + radius).powi(2)).sqrt();
        assert!((off - radius).abs() < 1e-11, "{still}: {off}");
        let wanted = (speed * speed + 10.0 / 7.0 * G * radius * (1.0 - cosine)).sqrt();
        let v = scene.v();
        assert!((v[4] - wanted / 0.2).abs() < 1e-8, "{still}: {v:?} {wanted}");
    }
}

/// A point cannot turn about an edge, a ball of a tenth of a millimetre can: it leaves with its speed.
#[test]
fn what_is_small_leaves_too() {
    for still in [CRATE, CAN] {
        let rest = format!("{}{}", shapes(still, "type = \"sphere\"\nradius = 1e-4"), contact(ORDERS[0], 0.0, 0.0));
        let mut scene = Scene::new(flying(&rest), &[0.1, 0.0, 0.2001], &[2.0, 0.0, 0.0]);
        scene.run(0.3);
        let event = *scene.events.0.iter().find(|e| e.cause == Cause::Unloaded).expect("it leaves");
        assert!((event.time - 0.1).abs() < 1e-9, "{}", event.time);
        let v = scene.v();
        assert!((v[0] - 2.0).abs() < 1e-8 && (v[2] + 0.2 * G).abs() < 1e-8, "{v:?}");
        assert!(
            (scene.q[0] - 0.7).abs() < 1e-8 && (scene.q[2] - 0.2001 + 0.5 * G * 0.04).abs() < 1e-8,
            "{:?}",
            scene.q
        );
    }
}
