//! Model predictive control with bounded efforts on exact derivatives: an Acrobot swings up, and a UR5 reaches for a
//! position, planned anew every millisecond.
//!
//! `cargo run --release --example mpc`

mod acrobot;
mod box_minimum;
mod ilqr;
mod steps;
#[cfg(test)]
mod tests;
mod velocities;

use std::time::Instant;

use acrobot::{JOINTS, LENGTH, NODES, PUSH};
use ilqr::{Ilqr, Problem, Progress};
use multibody::runtime::{Differentiable, Real, Scalar};
use steps::{Dynamics, Steps};
use velocities::Velocities;

multibody::mbd_model! {
    path = "models/double_pendulum.toml",
    name = Acrobot,
    outputs = [rates, derivatives, energy],
}

multibody::mbd_model! {
    path = "models/ur5.urdf",
    name = Ur5,
    outputs = [rates, derivatives, bias, momenta],
}

fn ur5(length: f64) -> Steps<Ur5, f64, 6> {
    Steps { system: Ur5::new(), drive: |arm, u| arm.tau = *u, joints: [0, 1, 2, 3, 4, 5], length }
}

/// Swings the Acrobot up.
fn swing_up() -> (Box<Ilqr<f64, 4, 1, NODES>>, Problem<f64, 4, 1>) {
    let drive = |arm: &mut Acrobot, u: &[f64; 1]| arm.tau = [0.0, u[0]];
    let mut dynamics = Steps { system: Acrobot::new(), drive, joints: JOINTS, length: LENGTH };
    let problem = acrobot::problem();
    let mut plan = Box::new(Ilqr::<f64, 4, 1, NODES>::new(&mut dynamics, &problem, &[0.0; 4], &[PUSH]));
    let (start, clock) = (plan.cost, Instant::now());
    let mut iterations = 0;
    while iterations < 500 {
        iterations += 1;
        match plan.iterate(&mut dynamics, &problem) {
            Progress::Improved(part) if part > 1e-5 => {}
            Progress::Rejected => {}
            _ => break,
        }
    }
    let seconds = clock.elapsed().as_secs_f64();
    let [a, b, ..] = plan.x[NODES - 1];
    let largest = plan.u[..NODES - 1].iter().fold(0.0_f64, |m, u| m.max(u[0].abs()));
    println!(
        "Acrobot: cost from {start:.1} to {:.4} in {iterations} iterations of {:.0} us ({} nodes)",
        plan.cost,
        1e6 * seconds / f64::from(iterations),
        plan.x.len()
    );
    println!("  it stands {:.1e} and {:.1e} rad from upright, with at most {largest:.3} N m", a - problem.goal[0], b);
    (plan, problem)
}

/// Number of milliseconds between two plans; without optimisation a plan takes too long for one in each.
const EVERY: u32 = if cfg!(debug_assertions) { 20 } else { 1 };

/// Reaches for a position within a second, planned anew from where the arm then is.
fn reach() -> f64 {
    const NODES: usize = 101;
    let mut dynamics = Velocities::new(ur5(0.01));
    let goal = [1.0, -0.9, 1.2, -0.4, 0.6, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut x = [0.0, -1.5, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let limits = [150.0, 150.0, 150.0, 28.0, 28.0, 28.0];
    let problem = Problem {
        goal,
        running: core::array::from_fn(|i| if i < 6 { 100.0 } else { 0.1 }),
        end: core::array::from_fn(|i| if i < 6 { 1000.0 } else { 100.0 }),
        effort: [1e-4; 6],
        bounds: [limits.map(|x: f64| -x), limits],
    };
    let mut hold = [0.0; 6];
    dynamics.steps.system.bias(&core::array::from_fn(|i| x[i]), &[0.0; 6], &mut hold);
    let mut plan = Box::new(Ilqr::<f64, 12, 6, NODES>::new(&mut dynamics, &problem, &x, &hold));
    while matches!(plan.iterate(&mut dynamics, &problem), Progress::Improved(part) if part > 1e-6) {}
    // The plan is behind the arm by up to a node; its policy makes up for it.
    let mut arm = ur5(1e-3);
    let (mut worst, mut all, mut plans) = (0.0_f64, 0.0, 0);
    for k in 0..1500 {
        if k % 10 == 0 && k > 0 {
            plan.u.rotate_left(1);
            plan.gains.rotate_left(1);
            plan.x.rotate_left(1);
            (plan.u[NODES - 2], plan.x[NODES - 1]) = (plan.u[NODES - 3], plan.x[NODES - 2]);
            plan.gains[NODES - 2] = plan.gains[NODES - 3];
        }
        if k % EVERY == 0 {
            let clock = Instant::now();
            plan.start(&mut dynamics, &problem, &x);
            plan.iterate(&mut dynamics, &problem);
            let seconds = clock.elapsed().as_secs_f64();
            (worst, all, plans) = (worst.max(seconds), all + seconds, plans + 1);
        }
        x = arm.step(&x, &plan.u[0]);
    }
    let error = (0..6).fold(0.0_f64, |m, i| m.max((x[i] - goal[i]).abs()));
    println!(
        "UR5: {:.0} us a plan ({NODES} nodes), {:.0} us at most; after 1.5 s it is {error:.1e} rad from its goal",
        1e6 * all / f64::from(plans),
        1e6 * worst
    );
    error
}

/// Runs both.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (plan, problem) = swing_up();
    let [a, b, p, r] = plan.x[NODES - 1];
    assert!(
        (a - problem.goal[0]).abs() < 0.05 && b.abs() < 0.05 && p.abs() < 0.2 && r.abs() < 0.2,
        "{:?}",
        plan.x[200]
    );
    assert!(plan.u.iter().all(|u| u[0].abs() <= 4.0));
    let error = reach();
    assert!(error < 0.02, "{error}");
    Ok(())
}
