//! A four-bar linkage: its loop is closed, it swings, and it stays closed.
//!
//! `cargo run --release --example closed_loop`

use multibody::prelude::*;

multibody::mbd_model! { path = "models/mechanisms/fourbar.toml", name = Fourbar }

/// Lets the linkage fall for two seconds; an open loop or lost energy is a failure.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut bars = Fourbar::new();

    // The description holds the crank at 60 degrees; the other two angles are where the search for a closed loop
    // begins.
    let mut q = Fourbar::START;
    let closed = close(&mut bars, &mut q, &Closing::holding(&Fourbar::HELD))?;
    println!("closed in {} iterations; {} independent rows of {}", closed.iterations, closed.rank, Fourbar::ROWS);

    // Around any method: at the end of each step momenta are projected onto the constraints, and positions corrected.
    let mut p = bars.zero_momenta();
    let start: f64 = bars.energy(&q, &p).iter().sum();
    let projection = Projection::fixed_work::<1>(&bars);
    let mut method = WithPostStep::new(&bars, Rk4::new(&bars), projection);
    for k in 0..2000 {
        method.step(&mut bars, f64::from(k) * 1e-3, 1e-3, &mut q, &mut p)?;
        if k % 500 == 499 {
            println!("{:.1} s: crank at {:+.4} rad", f64::from(k + 1) * 1e-3, q[Fourbar::Q_CRANK_PIN]);
        }
    }
    let (mut gap, mut phi) = (bars.zero_rows(), bars.zero_entries());
    Fourbar::constraint_residuals(&bars, &q, &mut gap, &mut phi);
    let open = gap.iter().fold(0.0, |worst: f64, x| worst.max(x.abs()));
    let lost = (bars.energy(&q, &p).iter().sum::<f64>() - start).abs();
    println!("the loop is open by {open:.1e} m, and the energy is off by {lost:.1e} J");
    assert!(open < 1e-11 && lost < 1e-6);
    Ok(())
}
