//! Scenes whose motion is known by analysis.

use mbd_codegen::model::{ConstraintKind, Contact, LoopKind, Model, Mount, Origin, Placement, Value};
use mbd_runtime::contact::{Mode, RestitutionLaw};

use super::scene::{apart, model, Scene};

/// A ball about a point of a body touches the floor.
pub(super) fn on_floor(
    model: &mut Model,
    name: &str,
    body: usize,
    xyz: [f64; 3],
    radius: f64,
    friction: f64,
    restitution: f64,
) {
    let first = Mount { body: None, placement: Placement::IDENTITY };
    let second = Mount { body: Some(body), placement: Placement { xyz: xyz.map(Value::Const), ..Placement::IDENTITY } };
    let kind = LoopKind::RollingBall { normal: [0.0, 0.0, 1.0], radius: Value::Const(radius) };
    model.contacts.push(Contact {
        name: name.into(),
        kind: ConstraintKind::Loop { kind, first, second },
        shapes: None,
        friction,
        restitution,
        law: RestitutionLaw::Poisson,
        origin: Origin::default(),
    });
}

pub(super) fn ball(restitution: f64) -> Model {
    let mut model = model(
        r#"
name = "ball"
[[body]]
name = "ball"
mass = 0.3
inertia = [0.01, 0.01, 0.01]
[[joint]]
name = "height"
type = "prismatic"
parent = "ground"
child = "ball"
axis = [0, 0, 1]
"#,
    );
    on_floor(&mut model, "floor", 0, [0.0; 3], 0.1, 0.0, restitution);
    model
}

#[test]
fn a_bouncing_ball_comes_to_rest_at_the_sum_of_its_bounces() {
    let (g, height, e) = (9.81, 1.0, 0.8);
    let mut scene = Scene::new(ball(e), &[height + 0.1], &[0.0]);
    scene.run(6.0);
    let first = (2.0 * height / g).sqrt();
    let mut t = first;
    let mut v = g * first;
    for event in scene.events.0.iter().take(20) {
        assert!((event.time - t).abs() < 1e-12, "{} {t}", event.time);
        assert!((event.approach - v).abs() < 1e-11);
        v *= e;
        t += 2.0 * v / g;
    }
    let rest = first * (1.0 + e) / (1.0 - e);
    let last = scene.events.0.last().unwrap();
    assert!((last.rest.unwrap() - rest).abs() < 1e-10, "{:?} {rest}", last);
    assert_eq!(scene.system.modes(), [Mode::Slide]);
    assert!((scene.q[0] - 0.1).abs() < 1e-14, "{:e}", scene.q[0] - 0.1);
    let force = scene.system.forces(6.0, &scene.q.clone(), &scene.p.clone())[0];
    assert!((force[0] - 0.3 * g).abs() < 1e-12);
}

/// A block with two corners on the floor, in the plane of x and z; gravity is inclined instead of the floor.
pub(super) fn block(friction: f64, restitution: f64, slope: f64) -> Model {
    let (x, z) = (9.81 * slope.sin(), -9.81 * slope.cos());
    let slider = |name: &str, parent: &str, axis: &str| {
        format!(
            r#"
[[body]]
name = "{name}"
[[joint]]
name = "{name}"
type = "prismatic"
parent = "{parent}"
child = "{name}"
axis = {axis}
"#
        )
    };
    let mut model = model(&format!(
        r#"
name = "block"
gravity = [{x}, 0, {z}]
{}{}
[[body]]
name = "block"
mass = 2.0
inertia = [0.02, 0.03, 0.04]
[[joint]]
name = "turn"
type = "revolute"
parent = "z"
child = "block"
axis = [0, 1, 0]
"#,
        slider("x", "ground", "[1, 0, 0]"),
        slider("z", "x", "[0, 0, 1]"),
    ));
    let body = model.bodies.len() - 1;
    for (name, x) in [("back", -0.2), ("front", 0.2)] {
        on_floor(&mut model, name, body, [x, 0.0, -0.1], 0.0, friction, restitution);
    }
    model
}

#[test]
fn a_block_on_an_incline_stops_and_does_not_move() {
    let (friction, slope, speed, g) = (0.8_f64, 30.0_f64.to_radians(), 2.0, 9.81_f64);
    let mut scene = Scene::new(block(friction, 0.0, slope), &[0.0, 0.1, 0.0], &[speed, 0.0, 0.0]);
    scene.run(4.0);
    let braking = g * (friction * slope.cos() - slope.sin());
    let (time, way) = (speed / braking, speed * speed / (2.0 * braking));
    let stop = scene.events.0.first().unwrap();
    assert!((stop.time - time).abs() < 1e-12, "{} {time}", stop.time);
    assert!((scene.q[0] - way).abs() < 1e-12, "{:e}", scene.q[0] - way);
    assert_eq!(scene.events.0.len(), 1, "{:?}", scene.events.0);
    assert_eq!(scene.system.modes(), [Mode::Stick; 2]);
    let there = scene.q.clone();
    scene.run(100.0);
    for (before, after) in there.iter().zip(&scene.q) {
        assert_eq!(before, after);
    }
}

#[test]
fn a_block_that_slides_up_an_incline_comes_back() {
    let (friction, slope, speed, g) = (0.3_f64, 30.0_f64.to_radians(), -2.0_f64, 9.81_f64);
    let mut scene = Scene::new(block(friction, 0.0, slope), &[0.0, 0.1, 0.0], &[speed, 0.0, 0.0]);
    scene.run(2.0);
    let (up, down) = (g * (slope.sin() + friction * slope.cos()), g * (slope.sin() - friction * slope.cos()));
    let turn = -speed / up;
    let at = speed * turn + 0.5 * up * turn * turn + 0.5 * down * (2.0 - turn) * (2.0 - turn);
    let stop = scene.events.0.first().unwrap();
    assert!((stop.time - turn).abs() < 1e-12, "{} {turn}", stop.time);
    assert!((scene.q[0] - at).abs() < 1e-11, "{:e}", scene.q[0] - at);
    assert_eq!(scene.system.modes(), [Mode::Slide; 2]);
}

/// A body slides on two feet, 1 m below its centre of mass, which is behind both of them: only friction keeps it from tipping
/// back. From a unit of friction at the front foot, the normal force there grows by `µ·1 m/0.5 m = 1`, so that the front foot
/// alone could have any normal force. Of both feet they are known: half the weight each.
#[test]
fn feet_share_a_weight_that_friction_holds() {
    let (g, friction, speed, end) = (9.81, 0.5, 3.0, 0.5);
    for feet in [[("front", 0.75), ("rear", 0.25)], [("rear", 0.25), ("front", 0.75)]] {
        let mut model = block(friction, 0.0, 0.0);
        model.contacts.clear();
        let body = model.bodies.len() - 1;
        for (name, x) in feet {
            on_floor(&mut model, name, body, [x, 0.0, -1.0], 0.0, friction, 0.0);
        }
        let mut scene = Scene::new(model, &[0.0, 1.0, 0.0], &[speed, 0.0, 0.0]);
        scene.run(end);
        assert!(scene.events.0.is_empty(), "{feet:?}: {:?}", scene.events.0);
        assert_eq!(scene.system.modes(), [Mode::Slide; 2]);
        let expected = [speed * end - 0.5 * friction * g * end * end, 1.0, 0.0];
        assert!(apart(&scene.q, &expected) < 1e-12, "{feet:?}: {:?} {expected:?}", scene.q);
        let forces = scene.system.forces(end, &scene.q.clone(), &scene.p.clone());
        for force in forces.iter() {
            // Half the weight of 2 kg, and friction against the way.
            assert!(apart(force, &[g, -friction * g, 0.0]) < 1e-11, "{feet:?}: {forces:?}");
        }
    }
}

/// A free body.
pub(super) const CASE: &str = r#"
[[body]]
name = "case"
mass = 2.0
inertia = [0.02, 0.03, 0.04]
[[joint]]
name = "case"
type = "floating"
child = "case"
"#;

/// A free box with eight corners on the floor.
pub(super) fn free_box(friction: f64, restitution: f64) -> Model {
    let mut model = model(CASE);
    for k in 0..8 {
        let side = |bit: u32, size: f64| if k >> bit & 1 == 0 { -size } else { size };
        let corner = [side(0, 0.2), side(1, 0.15), side(2, 0.1)];
        on_floor(&mut model, &format!("corner/{k}"), 0, corner, 0.0, friction, restitution);
    }
    model
}

#[test]
fn a_box_that_is_dropped_comes_to_rest() {
    let mut scene =
        Scene::new(free_box(0.5, 0.3), &[0.0, 0.0, 0.5, 0.1, 0.2, 0.05, 1.0], &[1.0, 0.2, 0.0, 0.5, 1.0, 0.7]);
    let n = scene.q[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
    scene.q[3..].iter_mut().for_each(|x| *x /= n);
    scene.tolerance = 1e-9;
    let before = scene.energy();
    scene.run(2.0);
    let statistics = *scene.motion.as_ref().unwrap().contact_statistics();
    assert!(scene.energy() <= before - statistics.lost + 1e-6);
    assert!(statistics.residual <= 1e-11, "{statistics:?}");
    // It lies on its largest side.
    assert!((scene.q[2] - 0.1).abs() < 1e-10, "{:?}", scene.q);
    let held = scene.system.modes().iter().filter(|mode| **mode == Mode::Stick).count();
    assert_eq!(held, 4, "{:?}", scene.system.modes());
}

/// A generator of numbers between −1 and 1.
pub(super) fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    }
}

/// Boxes that are thrown on the floor bounce, slide and come to rest. None of them falls through or gains energy. Gives the
/// number of those that are not followed to their end.
fn drops(count: usize) -> usize {
    let mut next = random(7);
    let mut failed = 0;
    for k in 0..count {
        let (friction, restitution) = (0.5 + 0.5 * next(), 0.25 + 0.25 * next());
        let mut q = vec![0.0, 0.0, 0.7, next(), next(), next(), next()];
        let n = q[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
        q[3..].iter_mut().for_each(|x| *x /= n);
        let v: Vec<f64> = (0..6).map(|_| 2.0 * next()).collect();
        let mut scene = Scene::new(free_box(friction, restitution), &q, &v);
        scene.tolerance = 1e-8;
        scene.steps = 3000;
        let before = scene.energy();
        if let Err(error) = scene.try_run(2.0) {
            failed += 1;
            println!("{k}: friction {friction}, restitution {restitution}: {error}");
            continue;
        }
        let after = scene.energy();
        let lost = scene.motion.as_ref().map_or(0.0, |motion| motion.contact_statistics().lost);
        // Friction takes the rest.
        assert!(after <= before - lost + 1e-6, "{k}: {before} {after} {lost}");
        assert!(scene.q[2] > 0.1 - 1e-9, "{k}: {:?}", scene.q);
        assert!(scene.q.iter().all(|x| x.is_finite()), "{k}");
    }
    failed
}

#[test]
fn boxes_that_are_thrown_end_on_the_floor() {
    assert_eq!(drops(12), 0);
}

/// A hundred of them, which take a minute, or as many as `MBD_DROPS` says.
#[test]
#[ignore = "a hundred take a minute"]
fn many_boxes_that_are_thrown_end_on_the_floor() {
    let count = std::env::var("MBD_DROPS").map_or(100, |count| count.parse().unwrap());
    let failed = drops(count);
    assert!(failed * 50 <= count, "{failed} of {count}");
}

#[test]
fn a_quadruped_that_is_dropped_lands_on_its_feet_and_kneels() {
    let model = model(include_str!("../../../models/contacts/quadruped.toml"));
    let plan = mbd_codegen::plan::Plan::new(&model, 1e-9);
    let mut scene = Scene::new(model, &plan.start(), &vec![0.0; plan.dims.nv]);
    scene.tolerance = 1e-9;
    scene.steps = 600;
    let before = scene.energy();
    scene.run(0.3);
    // All four feet fall by the same height: that of the lowest point of a sphere below the legs.
    let height = 0.3 - 0.016 - 2.0 * 0.16 * 0.7_f64.cos();
    let landing = &scene.events.0[0];
    assert!((landing.time - (2.0 * height / 9.81).sqrt()).abs() < 1e-9, "{landing:?}");
    let taken: usize = scene.system.modes().iter().filter(|mode| **mode == Mode::Stick).count();
    assert_eq!(taken, 4, "{:?}", scene.system.modes());
    assert!(scene.energy() < before);
    // The gaps of the feet stay closed.
    assert!(scene.gaps().iter().step_by(3).take(4).all(|gap| gap.abs() < 1e-11), "{:?}", scene.gaps());
}

/// A rod without weight that spins fast on a carriage, which drifts slowly towards a wall. No error limits the steps of such a motion; the
/// wall is hit where a tip reaches it first, `z₀ − v t = L |sin ω t|`.
#[test]
fn a_rod_that_spins_freely_does_not_pass_a_wall() {
    let (length, height, drift, spin) = (0.5, 2.0, 1.0, 300.0);
    let mut rod = model(
        r#"
name = "rod"
gravity = [0, 0, 0]
[[body]]
name = "carriage"
mass = 1
inertia = [0.01, 0.01, 0.01]
[[body]]
name = "rod"
mass = 1
inertia = [0.001, 0.08, 0.08]
[[joint]]
name = "height"
type = "prismatic"
child = "carriage"
axis = [0, 0, 1]
[[joint]]
name = "spin"
type = "revolute"
parent = "carriage"
child = "rod"
axis = [0, 1, 0]
"#,
    );
    on_floor(&mut rod, "left", 1, [-length, 0.0, 0.0], 0.0, 0.0, 0.0);
    on_floor(&mut rod, "right", 1, [length, 0.0, 0.0], 0.0, 0.0, 0.0);
    let gap = |t: f64| height - drift * t - length * (spin * t).sin().abs();
    // Stretches in which the rod turns by a thousandth of a radian.
    let mut t = (height - length) / drift - 0.01;
    while gap(t) > 0.0 {
        t += 1e-3 / spin;
    }
    let (mut a, mut b) = (t - 1e-3 / spin, t);
    for _ in 0..60 {
        let middle = 0.5 * (a + b);
        (a, b) = if gap(middle) > 0.0 { (middle, b) } else { (a, middle) };
    }
    let mut scene = Scene::new(rod, &[height, 0.0], &[-drift, spin]);
    scene.tolerance = 1e-9;
    scene.run(a + 1e-3);
    let event = scene.events.0.first().expect("the rod hits the wall");
    assert!((event.time - a).abs() < 1e-10, "{} {a}", event.time);
}

#[test]
fn a_box_that_holds_does_not_feel_what_slides_beside_it() {
    // A box on four corners stands on a slope, and a sled that hangs on it by a rail slides down. The load of the rear corners is
    // smaller than their part of the friction if all corners share it, so that they would slip; but together they hold, and the
    // force that the sled feels is its own whatever they do.
    let (slope, friction) = (0.3_f64.atan(), 0.2);
    let (along, across) = (9.81 * slope.sin(), 9.81 * slope.cos());
    let model = model(&format!(
        r#"
name = "box_and_sled"
gravity = [{along}, 0, -{across}]
[[body]]
name = "box"
mass = 2
com = [0, 0, 0.15]
inertia = [0.02, 0.03, 0.04]
[[body]]
name = "rail"
mass = 0.01
[[body]]
name = "sled"
mass = 0.5
[[joint]]
name = "motion"
type = "floating"
child = "box"
[[joint]]
name = "height"
type = "prismatic"
parent = "box"
child = "rail"
xyz = [0, 0.6, -0.1]
axis = [0, 0, 1]
[[joint]]
name = "way"
type = "prismatic"
parent = "rail"
child = "sled"
axis = [1, 0, 0]
[[shape]]
name = "floor"
type = "plane"
[[shape]]
name = "crate"
body = "box"
type = "box"
size = [0.4, 0.3, 0.2]
[[shape]]
name = "sole"
body = "sled"
type = "point"
[[contact]]
name = "crate"
between = ["floor", "crate"]
friction = 0.4
[[contact]]
name = "sole"
between = ["floor", "sole"]
friction = {friction}
"#
    ));
    let start = [0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let mut scene = Scene::new(model, &start, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1]);
    scene.steps = 10_000;
    scene.run(0.5);
    // The rail, of 0.01 kg, lies on the sled.
    let way = 0.1 * 0.5 + 0.5 * (along - friction * across * 0.51 / 0.5) * 0.25;
    println!("{} events, {:e} m off", scene.events.0.len(), scene.q[8] - way);
    assert!(scene.events.0.is_empty(), "{:?}", scene.events.0.last());
    assert!((scene.q[8] - way).abs() < 1e-12, "{} {way}", scene.q[8]);
    let moved = scene.q[..7].iter().zip(start).map(|(q, start)| (q - start).abs());
    assert!(moved.fold(0.0, f64::max) < 1e-14, "{:?}", scene.q);
}
