//! A falling arm takes a box that lies in its way, swings on with it, and throws it.
//!
//! `cargo run --release --example gripper`

use multibody::prelude::*;

multibody::mbd_model! {
    path = "models/variants/gripper.toml",
    name = Empty,
    outputs = [rates, velocities, momenta, energy, frames],
}
multibody::mbd_model! {
    path = "models/variants/gripper.toml",
    variant = "holding",
    name = Holding,
    from = Empty,
    outputs = [rates, velocities, momenta, energy, frames],
}
multibody::mbd_model! {
    path = "models/variants/gripper.toml",
    variant = "thrown",
    name = Thrown,
    from = ["holding": Holding],
    outputs = [rates, velocities, momenta, energy, frames],
}

/// Rotation and position of a frame, and the velocity of its origin, all in the axes of the ground.
macro_rules! frame {
    ($type:ident, $system:expr, $q:expr, $v:expr, $frame:ident) => {{
        let (mut rotation, mut position, mut velocity) = ([[[0.0; 3]; 3]; 3], [[0.0; 3]; 3], [[0.0; 6]; 3]);
        $system.frames($q, $v, &mut rotation, &mut position, &mut velocity);
        let (turn, own) = (rotation[$type::$frame], velocity[$type::$frame]);
        (turn, position[$type::$frame], turn.map(|row: [f64; 3]| row[0] * own[0] + row[1] * own[1] + row[2] * own[2]))
    }};
}
/// Distance of the box from the joint of the hand along the hand when it is taken, m.
const REACH: f64 = 0.4;
/// Gravity, m/s².
const GRAVITY: f64 = 9.81;

/// Takes and throws a box; wrong momenta, energies or flight are a failure.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut empty, mut holding, mut thrown) = (Empty::new(), Holding::new(), Thrown::new());

    // The arm falls from the horizontal for 0.3 s. The box lies where the hand then is.
    let (mut q, mut p) = (empty.neutral(), empty.zero_momenta());
    let mut solver = Solver::new(&mut empty, Verner9::new(&Empty::new()), step(), 0.0, &q, &p)?;
    solver.run(&mut empty, 0.3)?;
    solver.state(&empty, &mut q, &mut p);
    let mut v = empty.zero_momenta();
    empty.velocities(&q, &p, &mut v);
    let (turn, hand, _) = frame!(Empty, empty, &q, &v, FRAME_HAND);
    for k in 0..3 {
        empty.drive_q[k] = hand[k] + REACH * turn[k][0];
    }

    // The impulses of the impact act within arm and box: the arm's momenta stay as they are.
    let [before, _] = empty.energy(&q, &p);
    let (mut q, taken) = holding.transfer_from(&empty, &q, &v)?;
    let [after, _] = holding.energy(&q, &taken);
    let off = taken.iter().zip(&p).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    println!("taking the box takes {:.4} J of {before:.4} J; the momenta change by {off:.1e}", before - after);
    assert!(off < 1e-14 && before > after);

    // The arm swings on for 0.25 s and lets go: no velocity changes, and no energy is lost.
    let mut p = taken;
    let mut solver = Solver::new(&mut holding, Verner9::new(&Holding::new()), step(), 0.3, &q, &p)?;
    solver.run(&mut holding, 0.55)?;
    solver.state(&holding, &mut q, &mut p);
    let before: f64 = holding.energy(&q, &p).iter().sum();
    let mut v = holding.zero_momenta();
    holding.velocities(&q, &p, &mut v);
    let (mut q, mut p) = thrown.transfer_from(&holding, &q, &v)?;
    let after: f64 = thrown.energy(&q, &p).iter().sum();
    println!("letting go changes the energy by {:.1e} J", after - before);
    assert!((after - before).abs() < 1e-13);

    // The box flies on a parabola.
    let at = Thrown::Q_FLIGHT;
    let place: [f64; 3] = std::array::from_fn(|k| q[at + k]);
    let mut v = thrown.zero_momenta();
    thrown.velocities(&q, &p, &mut v);
    let mut solver = Solver::new(&mut thrown, Verner9::new(&Thrown::new()), step(), 0.55, &q, &p)?;
    let (_, _, rate) = frame!(Thrown, thrown, &q, &v, FRAME_BOX);
    solver.run(&mut thrown, 0.75)?;
    solver.state(&thrown, &mut q, &mut p);
    let time = 0.2;
    let flight: [f64; 3] =
        std::array::from_fn(|k| place[k] + rate[k] * time - if k == 2 { 0.5 * GRAVITY * time * time } else { 0.0 });
    let off = (0..3).fold(0.0, |most: f64, k| most.max((q[at + k] - flight[k]).abs()));
    println!("0.2 s later it is at x = {:.4} m, z = {:.4} m, off its parabola by {off:.1e} m", q[at], q[at + 2]);
    assert!(off < 1e-10);
    Ok(())
}

fn step() -> Step {
    Step::Adaptive(Tolerances::new(1e-12))
}
