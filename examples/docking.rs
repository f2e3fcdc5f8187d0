//! A ship docks at a station: a plastic impact, after which the two move as one. It keeps all momentum, and so does the
//! ship's departure, which takes no energy.
//!
//! `cargo run --release --example docking`

use multibody::prelude::*;

multibody::mbd_model! {
    path = "models/variants/docking.toml",
    name = Apart,
    outputs = [rates, velocities, momenta, energy, frames, centroidal],
}
multibody::mbd_model! {
    path = "models/variants/docking.toml",
    variant = "docked",
    name = Docked,
    from = Apart,
    outputs = [rates, velocities, momenta, energy, frames, centroidal],
}
multibody::mbd_model! {
    path = "models/variants/docking.toml",
    name = Released,
    from = ["docked": Docked],
    outputs = [rates, velocities, momenta, energy, frames, centroidal],
}

/// Momentum of all bodies `[linear; angular]` about the origin of the ground, kg m/s and kg m²/s, and kinetic energy, J.
macro_rules! momentum {
    ($type:ident, $system:expr, $q:expr, $p:expr) => {{
        let (mut v, mut center, mut matrix, mut bias) = ([0.0; $type::NV], [0.0; 3], [[0.0; $type::NV]; 6], [0.0; 6]);
        $system.velocities($q, $p, &mut v);
        $system.centroidal($q, &v, &mut center, &mut matrix, &mut bias);
        let mut h = matrix.map(|row| row.iter().zip(&v).map(|(a, v)| a * v).sum::<f64>());
        let [x, y, z] = center;
        h[3] += y * h[2] - z * h[1];
        h[4] += z * h[0] - x * h[2];
        h[5] += x * h[1] - y * h[0];
        (h, $system.energy($q, $p)[0])
    }};
}

fn farthest(a: [f64; 6], b: [f64; 6]) -> f64 {
    a.iter().zip(&b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()))
}

/// Flies, docks, flies on, and leaves; momentum or energy that is lost is a failure.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut apart, mut docked, mut released) = (Apart::new(), Docked::new(), Released::new());

    // The station turns slowly, its wheel fast; the ship comes up to it.
    let mut q = apart.neutral();
    q[Apart::Q_FLIGHT..][..3].copy_from_slice(&[1.5, 0.2, 0.4]);
    let v = [0.01, 0.0, 0.0, 0.0, 0.05, 0.02, 30.0, -0.4, 0.05, 0.0, 0.1, 0.0, 0.2];
    let mut p = apart.zero_momenta();
    apart.momenta(&q, &v, &mut p);
    let mut solver = Solver::new(&mut apart, Verner9::new(&Apart::new()), step(), 0.0, &q, &p)?;
    solver.run(&mut apart, 2.0)?;
    solver.state(&apart, &mut q, &mut p);

    let mut v = apart.zero_momenta();
    apart.velocities(&q, &p, &mut v);
    let (before, energy) = momentum!(Apart, apart, &q, &p);
    let (mut q, mut p) = docked.transfer_from(&apart, &q, &v)?;
    let (after, left) = momentum!(Docked, docked, &q, &p);
    println!(
        "docking keeps the momentum to {:.1e}; it takes {:.4} J of {energy:.2} J",
        farthest(before, after),
        energy - left
    );
    // Sums of some ten terms, the largest about 10 kg m²/s.
    assert!(farthest(before, after) < 1e-13 && energy - left > 0.1);

    let mut solver = Solver::new(&mut docked, Verner9::new(&Docked::new()), step(), 2.0, &q, &p)?;
    solver.run(&mut docked, 12.0)?;
    solver.state(&docked, &mut q, &mut p);
    let (later, kinetic) = momentum!(Docked, docked, &q, &p);
    println!(
        "ten seconds later it is the same to {:.1e}, the energy to {:.1e} J",
        farthest(after, later),
        kinetic - left
    );
    assert!(farthest(after, later) < 1e-10 && (kinetic - left).abs() < 1e-10);

    let mut v = docked.zero_momenta();
    docked.velocities(&q, &p, &mut v);
    let (q, p) = released.transfer_from(&docked, &q, &v)?;
    let (parted, last) = momentum!(Released, released, &q, &p);
    println!("leaving changes it by {:.1e}, the energy by {:.1e} J", farthest(later, parted), last - kinetic);
    assert!(farthest(later, parted) < 1e-13 && (last - kinetic).abs() < 1e-12);
    Ok(())
}

fn step() -> Step {
    Step::Adaptive(Tolerances::new(1e-12))
}
