//! Hulls on a floor.

use mbd_codegen::model::Model;

use super::known::{random, CASE};
use super::scene::{model, Scene};

/// A free body with a shape on a floor.
fn thrown(shape: &str, friction: f64, restitution: f64) -> Model {
    model(&format!(
        r#"{CASE}
[[shape]]
name = "floor"
type = "plane"
[[shape]]
name = "solid"
body = "case"
{shape}
[[contact]]
name = "solid"
between = ["floor", "solid"]
friction = {friction}
restitution = {restitution}
"#
    ))
}

/// Any orientation, and velocities up to 2 m/s and 2 rad/s.
fn throw(next: &mut impl FnMut() -> f64) -> (Vec<f64>, Vec<f64>) {
    let mut q = vec![0.0, 0.0, 0.7, next(), next(), next(), next()];
    let n = q[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
    q[3..].iter_mut().for_each(|x| *x /= n);
    (q, (0..6).map(|_| 2.0 * next()).collect())
}

/// A hull of the corners of a box, with points on its edges, on its faces and inside, moves with the bits of the box.
#[test]
fn a_hull_of_the_corners_of_a_box_moves_as_the_box() {
    let point = |k: i32, n: i32| [k % n, k / n % n, k / n / n].map(|x| f64::from(2 * x - (n - 1)) / f64::from(n - 1));
    let mut points: Vec<[f64; 3]> = (0..27).map(|k| point(k, 3)).collect();
    points.extend((0..125).map(|k| point(k, 5)));
    let points: Vec<[f64; 3]> = points.iter().map(|[x, y, z]| [0.2 * x, 0.15 * y, 0.1 * z]).collect();
    let mut next = random(3);
    for _ in 0..2 {
        let (friction, restitution) = (0.5 + 0.5 * next(), 0.25 + 0.25 * next());
        let (q, v) = throw(&mut next);
        let ends = ["type = 'box'\nsize = [0.4, 0.3, 0.2]".to_string(), format!("type = 'hull'\npoints = {points:?}")];
        let [boxed, hull] = ends.map(|shape| {
            let mut scene = Scene::new(thrown(&shape, friction, restitution), &q, &v);
            scene.tolerance = 1e-9;
            scene.run(1.0);
            assert!(scene.events.0.len() > 2);
            let events: Vec<_> = scene.events.0.iter().map(|e| (e.time, e.contact, e.cause, e.modes)).collect();
            (scene.q, scene.p, events)
        });
        assert_eq!(boxed, hull);
    }
}

/// Without friction and loss, hulls keep their energy, and no corner comes below the floor.
#[test]
fn hulls_that_bounce_keep_their_energy() {
    let mut next = random(11);
    for _ in 0..6 {
        let points: Vec<[f64; 3]> = (0..40).map(|_| [0.2 * next(), 0.2 * next(), 0.2 * next()]).collect();
        let (q, v) = throw(&mut next);
        let mut scene = Scene::new(thrown(&format!("type = 'hull'\npoints = {points:?}"), 0.0, 1.0), &q, &v);
        let before = scene.energy();
        for k in 1..=20 {
            scene.run(0.1 * f64::from(k));
            assert!(scene.gaps().iter().all(|gap| *gap > -1e-11));
        }
        assert!(scene.events.0.len() > 2);
        // A few hundred steps with an error of 1e-12 of the velocities each.
        assert!((scene.energy() - before).abs() < 1e-9 * before, "{:e}", scene.energy() / before - 1.0);
    }
}
