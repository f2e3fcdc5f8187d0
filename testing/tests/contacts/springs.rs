//! Time steps with springs and dampers in the joints, which are taken implicitly.

use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;

use super::scene::{apart, closed_start, model, Scene};
use super::stepping::{shipped, Stepped};

const HOP: &str = include_str!("../../../models/contacts/quadruped_hop.toml");

/// A slider on a spring and a damper, 1 m above a floor where the spring is relaxed.
fn slider(mass: f64, stiffness: f64, damping: f64) -> String {
    format!(
        r#"
        gravity = [0, 0, 0]
        [[body]]
        name = "block"
        mass = {mass}
        [[joint]]
        name = "slide"
        type = "prismatic"
        child = "block"
        xyz = [0, 0, 1]
        axis = [0, 0, 1]
        stiffness = {stiffness}
        damping = {damping}
        [[shape]]
        name = "floor"
        type = "plane"
        [[shape]]
        name = "tip"
        body = "block"
        type = "point"
        [[contact]]
        name = "touch"
        between = ["floor", "tip"]
        friction = 0
        "#
    )
}

#[test]
fn a_step_is_the_implicit_midpoint_rule() {
    // The second is overdamped, the third and the fourth are stiff: explicit steps of this length would grow.
    for (m, k, d) in [(2.0, 8.0, 0.3), (2.0, 10.0, 90.0), (0.5, 1e6, 3.0), (0.5, 1e3, 1e5)] {
        let (h, mut q, mut v) = (0.01, 0.1, -1.0);
        let mut stepped: Stepped = Stepped::new(&model(&slider(m, k, d)), &[q], &[v]);
        for _ in 0..20 {
            stepped.step(h);
            // With the mean of both velocities in the middle: m Δ/h = −k (q + h/2 (v + Δ/2)) − d (v + Δ/2).
            let change = -h * (k * q + (d + 0.5 * h * k) * v) / (m + 0.5 * h * d + 0.25 * h * h * k);
            (q, v) = (q + h * (v + 0.5 * change), v + change);
            let off = ((stepped.q[0] - q).abs(), (stepped.p[0] / m - v).abs());
            // What stiff forces are rounded to counts by `h/m`, once where the middle is found and once from there.
            let stiff = 1.0 + h * (d + h * k) / m;
            let most = 1e-15 * stiff * stiff;
            assert!(off.0 < most && off.1 < most, "{m}, {k}, {d}: {off:?}, {most:.1e}");
        }
    }
}

#[test]
fn what_springs_hold_up_does_not_move() {
    // A light foot with a spring and a damper below a trunk: in a step alone it would come to rest at the trunk's velocity.
    let text = r#"
        [[body]]
        name = "trunk"
        mass = 3
        [[joint]]
        name = "height"
        type = "prismatic"
        child = "trunk"
        axis = [0, 0, 1]
        [[body]]
        name = "foot"
        mass = 0.01
        [[joint]]
        name = "leg"
        type = "prismatic"
        parent = "trunk"
        child = "foot"
        axis = [0, 0, -1]
        stiffness = 800
        rest = 0.5
        damping = 40
        [[shape]]
        name = "floor"
        type = "plane"
        [[shape]]
        name = "tip"
        body = "foot"
        type = "point"
        [[contact]]
        name = "touch"
        between = ["floor", "tip"]
        friction = 0
    "#;
    let length = 0.5 - 3.0 * 9.81 / 800.0;
    for h in [1e-3, 1e-2, 5e-2] {
        let mut stepped: Stepped = Stepped::new(&model(text), &[length, length], &[0.0, 0.0]);
        for _ in 0..200 {
            stepped.step(h);
        }
        let moved = stepped.q.iter().map(|q| (q - length).abs()).fold(0.0, f64::max);
        assert!(moved < 1e-13, "steps of {h} s: moved by {moved:.1e} m");
        // Dropped, it comes to rest there.
        let mut stepped: Stepped = Stepped::new(&model(text), &[0.6, 0.5], &[0.0, 0.0]);
        (0..(4.0 / h) as u32).for_each(|_| stepped.step(h));
        let (off, gap) = ((stepped.q[1] - length).abs(), stepped.q[0] - stepped.q[1]);
        println!("steps of {h} s: {off:.1e} m from where it comes to rest, with a gap of {gap:.1e} m");
        assert!(off < 1e-9, "steps of {h} s: {off:.1e} m from where it comes to rest");
    }
}

/// Largest differences between coordinates after time steps and after a motion by events.
fn errors(model: &Model, (q, v): (&[f64], &[f64]), time: f64, steps: [u32; 3]) -> [f64; 3] {
    let mut exact = Scene::new(model.clone(), q, v);
    exact.run(time);
    steps.map(|n| {
        let mut stepped: Stepped = Stepped::new(model, q, v);
        stepped.run(time, n);
        apart(&exact.q, &stepped.q)
    })
}

#[test]
fn in_flight_steps_have_order_two() {
    let (quadruped, mut start) = shipped(HOP);
    start[2] += 1.0;
    let velocities = Plan::new(&quadruped, 1e-9).dims.nv;
    let v: Vec<f64> = (0..velocities).map(|k| 0.3 * (1.7 * k as f64).sin()).collect();
    let errors = errors(&quadruped, (&start, &v), 0.1, [100, 200, 400]);
    for pair in errors.windows(2) {
        assert!((3.6..4.4).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

#[test]
fn loops_stay_closed_in_steps_of_order_two() {
    // A leg with two rods and stiff springs, far above a floor.
    let floor = r#"
        [[shape]]
        name = "floor"
        type = "plane"
        xyz = [0, 0, -3]
        [[shape]]
        name = "tip"
        body = "foot"
        type = "point"
        [[contact]]
        name = "touch"
        between = ["floor", "tip"]
    "#;
    let leg = model(&(include_str!("../../../models/mechanisms/spring_leg.toml").to_owned() + floor));
    let plan = Plan::new(&leg, 1e-9);
    let start = closed_start(&plan);
    let v = vec![0.0; plan.dims.nv];
    let errors = errors(&leg, (&start, &v), 0.1, [200, 400, 800]);
    // The longest steps err by more than their order says, because the springs are stiff.
    for pair in errors.windows(2) {
        assert!((3.5..5.0).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

#[test]
fn a_quadruped_comes_to_stand_with_long_steps() {
    let (quadruped, start) = shipped(HOP);
    let v = vec![0.0; Plan::new(&quadruped, 1e-9).dims.nv];
    let mut exact = Scene::new(quadruped.clone(), &start, &v);
    exact.tolerance = 1e-8;
    exact.run(1.0);
    for n in [62, 125, 250, 500, 1000] {
        let mut stepped: Stepped = Stepped::new(&quadruped, &start, &v);
        stepped.run(1.0, n);
        let off = apart(&exact.q, &stepped.q);
        println!("{n} steps: {off:.1e}");
        assert!(off < 6.0 / f64::from(n), "{n} steps: {off:.1e}");
    }
}
