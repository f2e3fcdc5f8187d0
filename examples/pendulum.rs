//! A double pendulum from its description to ten seconds of motion, with the energy as the judge.
//!
//! `cargo run --release --example pendulum`

use multibody::prelude::*;

multibody::mbd_model! {
    path = "models/double_pendulum.toml",
    name = DoublePendulum,
    outputs = [rates, energy, frames],
    frames = [tip],
}

/// Swings the pendulum.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut pendulum = DoublePendulum::new();

    // Both bars are lifted to the horizontal and start at rest: zero velocities are zero momenta.
    let (mut q, mut p) = (pendulum.neutral(), pendulum.zero_momenta());
    q[DoublePendulum::Q_SHOULDER] = core::f64::consts::FRAC_PI_2;
    let start: f64 = pendulum.energy(&q, &p).iter().sum();

    let method = Verner9::new(&pendulum);
    let step = Step::Adaptive(Tolerances::new(1e-10));
    let mut solver = Solver::new(&mut pendulum, method, step, 0.0, &q, &p)?;
    println!("{:>6} {:>12} {:>12} {:>10}", "t, s", "tip x, m", "tip z, m", "energy, J");
    let mut worst = 0.0_f64;
    for second in 0..=10 {
        solver.run(&mut pendulum, f64::from(second))?;
        solver.state(&pendulum, &mut q, &mut p);
        let energy: f64 = pendulum.energy(&q, &p).iter().sum();
        let (mut rotation, mut position, mut velocity) = ([[[0.0; 3]; 3]; 1], [[0.0; 3]; 1], [[0.0; 6]; 1]);
        // The position alone is shown, so the velocities may be any.
        pendulum.frames(&q, &[0.0; DoublePendulum::NV], &mut rotation, &mut position, &mut velocity);
        println!("{second:>6} {:>12.6} {:>12.6} {energy:>10.6}", position[0][0], position[0][2]);
        worst = worst.max((energy - start).abs());
    }
    println!("largest error of the energy: {worst:.1e} J in {} steps", solver.statistics().steps);
    assert!(worst < 1e-7, "the energy of a pendulum without friction stays what it was");
    Ok(())
}
