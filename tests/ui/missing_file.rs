//! A path that leads nowhere; uses of the type add nothing.
multibody::mbd_model! { path = "models/double_pendulm.toml", name = Arm }

fn main() {
    use multibody::runtime::{
        integrate::{Rk4, Stepper},
        System,
    };
    let mut arm = Arm::new();
    let (mut q, mut p) = (arm.neutral(), arm.zero_momenta());
    q[1] = 0.5;
    arm.tau[1] = 2.0;
    let (mut qd, mut pd) = ([0.0; Arm::NQ], [0.0; Arm::NV]);
    arm.rates(&q, &p, &mut qd, &mut pd);
    let [kinetic, potential] = arm.energy(&q, &p);
    println!("{}", kinetic + potential);
    let _ = Rk4::new(&arm).step(&mut arm, 0.0, 1e-3, &mut q, &mut p);
}
