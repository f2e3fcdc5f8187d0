//! The simplest walker: M. Garcia, A. Chatterjee, A. Ruina, M. Coleman, The simplest walking model: stability, complexity,
//! and scaling, J. Biomech. Eng. 120 (1998). Its two gaits on a slope of 0.009 rad by its own equations, with massless feet,
//! and steps of the scene that is shipped, extrapolated to massless feet.

use mbd_runtime::contact::{Cause, Mode};

use super::scene::{model, Scene};

const SLOPE: f64 = 0.009;

/// Angles and rates `θ, θ̇, φ, φ̇`, in units of the time `√(l/g)`.
type State = [f64; 4];

/// Rates between impacts (1998, equations 1 and 2).
fn rates([theta, w, phi, u]: State) -> State {
    let turn = (theta - SLOPE).sin();
    [w, turn, u, turn + phi.sin() * (w * w - (theta - SLOPE).cos())]
}

fn runge_kutta(x: State, h: f64) -> State {
    let add = |x: State, k: State, h: f64| -> State { std::array::from_fn(|i| x[i] + h * k[i]) };
    let k1 = rates(x);
    let k2 = rates(add(x, k1, 0.5 * h));
    let k3 = rates(add(x, k2, 0.5 * h));
    let k4 = rates(add(x, k3, h));
    std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// A step from just after an impact to just after the next: its time, and the state. The impact is (1998, equation 3).
fn step(theta: f64, w: f64) -> (f64, State) {
    let h = 1e-3;
    let mut x = [theta, w, 2.0 * theta, (1.0 - (2.0 * theta).cos()) * w];
    let height = |x: State| x[0].cos() - (x[0] - x[2]).cos();
    let mut t = 0.0;
    loop {
        let next = runge_kutta(x, h);
        // Not where the leg passes the floor in the middle.
        if next[0] < -0.5 * theta && height(next) <= 0.0 && height(x) > 0.0 {
            break;
        }
        (x, t) = (next, t + h);
        assert!(t < 10.0);
    }
    let (mut a, mut b) = (0.0, h);
    for _ in 0..60 {
        let m = 0.5 * (a + b);
        (a, b) = if height(runge_kutta(x, m)) > 0.0 { (m, b) } else { (a, m) };
    }
    let [theta, w, ..] = runge_kutta(x, a);
    let c = (2.0 * theta).cos();
    (t + a, [-theta, c * w, -2.0 * theta, c * (1.0 - c) * w])
}

/// A gait: a state after an impact that a step comes back to, by Newton's method with differences.
pub(super) fn gait(mut theta: f64, mut w: f64) -> [f64; 2] {
    for _ in 0..20 {
        let miss = |theta: f64, w: f64| {
            let (_, end) = step(theta, w);
            [end[0] - theta, end[1] - w]
        };
        let d = 1e-5;
        let here = miss(theta, w);
        let by_theta = [miss(theta + d, w), miss(theta - d, w)];
        let by_w = [miss(theta, w + d), miss(theta, w - d)];
        let slope = |pair: [[f64; 2]; 2], i: usize| (pair[0][i] - pair[1][i]) / (2.0 * d);
        let [[a, b], [c, e]] = [[slope(by_theta, 0), slope(by_w, 0)], [slope(by_theta, 1), slope(by_w, 1)]];
        let det = a * e - b * c;
        theta -= (e * here[0] - b * here[1]) / det;
        w -= (a * here[1] - c * here[0]) / det;
    }
    [theta, w]
}

/// Derivatives of the state after a step by that before it, by central differences.
pub(super) fn step_derivatives([theta, w]: [f64; 2]) -> [[f64; 2]; 2] {
    let d = 2e-5;
    let end = |theta: f64, w: f64| step(theta, w).1;
    // Two differences, of which the errors of second order cancel.
    let slope = |at: &dyn Fn(f64) -> State, i: usize| {
        let difference = |d: f64| (at(d)[i] - at(-d)[i]) / (2.0 * d);
        (4.0 * difference(d) - difference(2.0 * d)) / 3.0
    };
    std::array::from_fn(|i| [slope(&|d| end(theta + d, w), i), slope(&|d| end(theta, w + d), i)])
}

/// The shipped scene on the slope of this file, with feet of mass `foot`.
pub(super) fn with_feet(foot: f64) -> String {
    let text = include_str!("../../../models/contacts/simplest_walker.toml");
    let (mass, com) = (1.0 + foot, -foot / (1.0 + foot));
    text.replace("gravity = [0.08828881, 0, -9.80960270]", &format!("gravity = [{}, 0, {}]", SLOPE.sin(), -SLOPE.cos()))
        .replace("mass = 1.001\n", &format!("mass = {mass}\n"))
        .replace("com = [0, 0, -0.000999000999]", &format!("com = [0, 0, {com}]"))
        .replace("inertia = [0.000999000999, 0.000999000999, 0]", &format!("inertia = [{0}, {0}, 0]", -com))
        .replace("mass = 0.001\n", &format!("mass = {foot}\n"))
}

/// A step of the shipped scene with feet of mass `foot`: the time of the impact, and `θ, θ̇` after it.
fn scene_step(foot: f64, [theta, w]: [f64; 2], time: f64) -> [f64; 3] {
    let q = [0.0, theta.cos(), theta, -2.0 * theta];
    let mut scene = Scene::new(model(&with_feet(foot)), &q, &[-w, 0.0, w, -(1.0 - (2.0 * theta).cos()) * w]);
    // In the middle of the step the straight leg has to pass the floor.
    scene.start();
    scene.motion.as_mut().unwrap().ignore(1, true);
    scene.run(0.8 * time);
    scene.motion.as_mut().unwrap().ignore(1, false);
    let landed = |scene: &Scene| scene.events.0.iter().find(|e| e.contact == 1 && e.cause == Cause::Landed).copied();
    while landed(&scene).is_none() {
        scene.advance(time + 0.3);
        assert!(scene.motion.as_ref().unwrap().time() < time + 0.3);
    }
    assert_eq!(scene.system.modes(), [Mode::Open, Mode::Stick]);
    let (strike, v) = (landed(&scene).unwrap(), scene.v());
    [strike.time, scene.q[2] + scene.q[3], v[2] + v[3]]
}

#[test]
fn the_simplest_walker_has_two_gaits() {
    for (start, digits) in
        [([0.2, -0.2], [0.200_310_901, -0.199_832_473]), ([0.193_937, -0.203_867], [0.193_937_370, -0.203_866_927])]
    {
        let [theta, w] = gait(start[0], start[1]);
        assert!((theta - digits[0]).abs() < 1e-9 && (w - digits[1]).abs() < 1e-9, "{theta} {w}");
        let (time, end) = step(theta, w);
        assert!((end[0] - theta).abs() < 1e-11 && (end[1] - w).abs() < 1e-11);
        // Polynomials in the mass through four values.
        let masses = [4e-4, 2e-4, 1e-4, 0.5e-4];
        let mut table = masses.map(|foot| scene_step(foot, [theta, w], time));
        for level in 1..4 {
            for i in (level..4).rev() {
                let (far, near) = (masses[i - level], masses[i]);
                table[i] = std::array::from_fn(|k| (far * table[i][k] - near * table[i - 1][k]) / (far - near));
            }
        }
        let [t, angle, rate] = table[3];
        assert!((t - time).abs() < 1e-10, "{:e}", t - time);
        assert!((angle - theta).abs() < 1e-10 && (rate - w).abs() < 1e-10, "{:e} {:e}", angle - theta, rate - w);
    }
}
