//! The macro without the facade, in a crate without the standard library.
#![no_std]
#![deny(warnings, missing_docs)]

/// Types as a user's module has them.
pub mod made {
    mbd_macros::mbd_model! { path = "../models/double_pendulum.toml", name = DoublePendulum, scalar = f32 }
    mbd_macros::mbd_model! { path = "../models/satellite.toml", name = Satellite, outputs = [rates, reactions, frames] }
}

#[test]
fn a_step_without_std() {
    use mbd_runtime::integrate::{Rk4, Stepper};
    use mbd_runtime::System;
    let mut pendulum = made::DoublePendulum::new();
    let (mut q, mut p) = ([0.5, 0.0], pendulum.zero_momenta());
    let before: f32 = pendulum.energy(&q, &p).iter().sum();
    assert!(Rk4::new(&pendulum).step(&mut pendulum, 0.0, 1e-2, &mut q, &mut p).is_ok());
    let after: f32 = pendulum.energy(&q, &p).iter().sum();
    // Single precision: some units in the last place of 30 J.
    assert!(q[0] < 0.5 && (after - before).abs() < 1e-4);
    assert_eq!(made::Satellite::NQ, 7);
}
