//! A UR5 that is held against gravity, then follows a path by computed torque.
//!
//! `cargo run --release --example arm_control`

use multibody::prelude::*;

multibody::mbd_model! {
    path = "models/ur5.urdf",
    name = Ur5,
    outputs = [rates, velocities, momenta, bias, inverse_dynamics],
}

const NV: usize = Ur5::NV;

/// Period of the controller, s.
const PERIOD: f64 = 1e-3;

/// Joint angles (rad) of the path at time `t` (s), their rates and accelerations: every joint swings to 0.5 to 1 rad and back
/// in 2π s.
fn path(t: f64) -> [[f64; NV]; 3] {
    let (s, c) = t.sin_cos();
    let size: [f64; NV] = core::array::from_fn(|k| 0.5 - 0.05 * k as f64);
    [size.map(|a| a * (1.0 - c)), size.map(|a| a * s), size.map(|a| a * c)]
}

/// Velocities of a state: what a robot's encoders would tell.
fn velocities(arm: &Ur5, q: &[f64; NV], p: &[f64; NV]) -> [f64; NV] {
    let mut v = [0.0; NV];
    arm.velocities(q, p, &mut v);
    v
}

/// Runs both controllers; an error of tracking above the bounds is a failure.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arm = Ur5::new();
    let mut rk4 = Rk4::new(&arm);

    // Gravity compensation: the efforts are the bias forces at rest, so nothing moves.
    let mut q = [0.3, -1.0, 0.8, -0.4, 0.6, 0.2];
    let (start, mut p) = (q, arm.zero_momenta());
    for k in 0..2000 {
        let mut effort = [0.0; NV];
        arm.bias(&q, &[0.0; NV], &mut effort);
        arm.tau = effort;
        rk4.step(&mut arm, f64::from(k) * PERIOD, PERIOD, &mut q, &mut p)?;
    }
    let moved = q.iter().zip(&start).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("gravity compensation: the arm moved by {moved:.1e} rad in 2 s");
    assert!(moved < 1e-9);

    // Computed torque: the inverse dynamics of the path's acceleration, corrected by what is off; 20 rad/s, critically
    // damped.
    let (stiffness, damping) = (400.0, 40.0);
    (q, p) = (arm.neutral(), arm.zero_momenta());
    q[0] = 0.1; // an error to begin with
    let mut last = f64::INFINITY;
    for k in 0..3000 {
        let t = f64::from(k) * PERIOD;
        let ([q_path, v_path, a_path], v) = (path(t), velocities(&arm, &q, &p));
        let a = core::array::from_fn(|k| a_path[k] + damping * (v_path[k] - v[k]) + stiffness * (q_path[k] - q[k]));
        let mut effort = [0.0; NV];
        arm.inverse_dynamics(&q, &v, &a, &mut effort);
        arm.tau = effort;
        rk4.step(&mut arm, t, PERIOD, &mut q, &mut p)?;
        last = q.iter().zip(&path(t + PERIOD)[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if k % 500 == 499 {
            println!("computed torque: {:.1} s, error of the angles {last:.1e} rad", t + PERIOD);
        }
    }
    // What is left comes from efforts that are held for a period while the arm moves on.
    assert!(last < 1e-3);
    Ok(())
}
