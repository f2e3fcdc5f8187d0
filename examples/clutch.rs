//! A clutch locks: two rotors get one speed, and the impact takes energy.
//!
//! `cargo run --release --example clutch`

use multibody::prelude::*;

multibody::mbd_model! { path = "models/variants/clutch.toml", name = Open }
multibody::mbd_model! { path = "models/variants/clutch.toml", variant = "locked", name = Locked, from = Open }

/// The moments of inertia of the two rotors about their axis, kg m².
const ROTORS: [f64; 2] = [0.3, 0.7];

/// Locks a clutch between two rotors of different speed; a wrong speed or energy is a failure.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (open, mut locked) = (Open::new(), Locked::new());
    let [engine, load] = ROTORS;

    // The engine turns at 10 rad/s, the load at 2 rad/s; the second joint is the angle between them.
    let (q, v) = ([0.4, 1.1], [10.0, 2.0 - 10.0]);
    let mut p = [0.0; Open::NV];
    open.momenta(&q, &v, &mut p);
    let [before, _] = open.energy(&q, &p);

    let (q, p) = locked.transfer_from(&open, &q, &v)?;
    let [after, _] = locked.energy(&q, &p);
    let (mut qd, mut pd) = ([0.0; Locked::NQ], [0.0; Locked::NV]);
    locked.rates(&q, &p, &mut qd, &mut pd);

    let speed = (engine * 10.0 + load * 2.0) / (engine + load);
    let lost = 0.5 * engine * load / (engine + load) * (10.0_f64 - 2.0).powi(2);
    println!("the clutch holds at {:.3} rad between the rotors", locked.drive_q[Locked::DRIVE_Q_CLUTCH]);
    println!("both turn at {:.6} rad/s; known: {speed:.6} rad/s", qd[0]);
    println!("the impact takes {:.6} J; known: {lost:.6} J", before - after);
    // Round-off of a few operations.
    assert!((qd[0] - speed).abs() < 1e-14 * speed && (before - after - lost).abs() < 1e-14 * before);
    Ok(())
}
