//! A robot whose code `build.rs` has generated falls for a second.
//!
//! `cargo run --release -p mbd-example-build-script`

use multibody::prelude::*;

include!(concat!(env!("OUT_DIR"), "/iiwa.rs"));

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arm = Iiwa::new();
    let (mut q, mut p) = (arm.neutral(), arm.zero_momenta());
    q[1] = 0.5;
    let start: f64 = arm.energy(&q, &p).iter().sum();
    let mut rk4 = Rk4::new(&arm);
    for k in 0..1000 {
        rk4.step(&mut arm, f64::from(k) * 1e-3, 1e-3, &mut q, &mut p)?;
    }
    let lost = start - arm.energy(&q, &p).iter().sum::<f64>();
    println!("after 1 s: {q:.3?}; the dampers of the joints have taken {lost:.1} J");
    Ok(())
}
