//! Impacts of a double pendulum: with stops in its joints, and of its tip with a floor.

use mbd_codegen::model::Model;
use mbd_runtime::contact::{Cause, Touching};
use mbd_testing::random::Rng;

use super::scene::{model, Scene};

/// Two uniform links of 1 m and 1 kg. `stops` is added to both joints, `more` to the end.
fn double_pendulum(stops: &str, more: &str) -> Model {
    let link = |name: &str, joint: &str, parent: &str, z: f64| {
        format!(
            r#"
[[body]]
name = "{name}"
mass = 1
com = [0, 0, -0.5]
inertia = [0.0833, 0.0833, 0]
[[joint]]
name = "{joint}"
type = "revolute"
parent = "{parent}"
child = "{name}"
xyz = [0, 0, {z}]
axis = [0, 1, 0]
{stops}
"#
        )
    };
    let [upper, lower] = [link("upper", "shoulder", "ground", 0.0), link("lower", "elbow", "upper", -1.0)];
    model(&format!("name = \"double_pendulum\"\ngravity = [0, 0, -9.81]\n{upper}{lower}{more}"))
}

#[test]
fn ten_thousand_elastic_impacts_of_a_double_pendulum_keep_the_energy() {
    let pendulum = double_pendulum("limits = [-0.5, 0.6]\nlimit_restitution = 1", "");
    let mut scene = Scene::new(pendulum, &[0.4, -0.3], &[1.0, 0.0]);
    let before = scene.energy();
    let (mut seen, mut open) = (0, 0.0_f64);
    while seen < 10_000 {
        scene.advance(1e6);
        while seen < scene.events.0.len() {
            let event = scene.events.0[seen];
            assert_eq!(event.cause, Cause::Landed);
            let row = scene.system.system().contacts()[event.contact].row;
            open = open.max(scene.gaps()[row].abs());
            seen += 1;
        }
    }
    let change = scene.energy() - before;
    assert!(change.abs() < 1e-9 * before.abs(), "{change:e} of {before} J");
    assert!(open < 1e-11, "a landing is {open:e} rad off");
}

/// T. R. Kane and D. A. Levinson (Dynamics: theory and applications, 1985) found that a double pendulum whose tip strikes a
/// rough floor can gain energy under Newton's law. Under Poisson's, which is the default, it does not.
#[test]
fn a_double_pendulum_that_strikes_a_floor_gains_energy_under_newtons_law_alone() {
    let mut gained = [0, 0];
    let mut rng = Rng::new(5, 7);
    for _ in 0..300 {
        let q = [rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)];
        let v = [rng.around(2.0), rng.around(2.0)];
        let (friction, restitution) = (rng.range(0.2, 1.0), rng.range(0.3, 0.9));
        let both = q[0] + q[1];
        let (tip, sinks) = (-q[0].cos() - both.cos(), q[0].sin() * v[0] + both.sin() * (v[0] + v[1]));
        if sinks > -0.1 {
            continue;
        }
        for (law, gains) in ["newton", "poisson"].into_iter().zip(&mut gained) {
            let contact = format!(
                r#"
[[shape]]
name = "floor"
type = "plane"
xyz = [0, 0, {}]
[[shape]]
name = "tip"
type = "point"
body = "lower"
xyz = [0, 0, -1]
[[contact]]
name = "strike"
between = ["floor", "tip"]
friction = {friction}
restitution = {restitution}
law = "{law}"
"#,
                tip - 1e-6
            );
            let mut scene = Scene::new(double_pendulum("", &contact), &q, &v);
            scene.run(2e-5);
            let impact = scene.events.0.first().and_then(|event| event.impact).expect("an impact");
            *gains += usize::from(impact.energy > 1e-3);
        }
    }
    assert!(gained[0] >= 3 && gained[1] == 0, "{gained:?} gain energy");
}
