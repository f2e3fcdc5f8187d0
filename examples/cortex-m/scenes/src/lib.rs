//! What the firmware and its host twin both run: generated dynamics, 1000 steps of 1 ms.
#![no_std]

use mbd_runtime::integrate::{FixedIterations, ImplicitMidpoint, Rk4, Stepper};
use mbd_runtime::{Differentiable, Real, Scalar, System};

mbd_macros::mbd_model! {
    path = "../../../models/double_pendulum.toml",
    name = DoublePendulumF32,
    scalar = f32,
    outputs = [rates, momenta, energy, derivatives]
}
mbd_macros::mbd_model! {
    path = "../../../models/double_pendulum.toml",
    name = DoublePendulumF64,
    scalar = f64,
    outputs = [rates, momenta, energy]
}
mbd_macros::mbd_model! {
    path = "../../../models/ur5.urdf",
    name = Ur5F32,
    scalar = f32,
    outputs = [rates, momenta, energy, derivatives]
}
mbd_macros::mbd_model! {
    path = "../../../models/ur5.urdf",
    name = Ur5F64,
    scalar = f64,
    outputs = [rates, momenta, energy]
}

/// Number of steps.
pub const STEPS: u32 = 1000;

/// Coordinates and momenta of a system.
pub type State<Y> = (<Y as System>::Coordinates, <Y as System>::Momenta);

/// The method of Runge and Kutta of order 4: four evaluations of the dynamics a step.
pub fn rk4<Y>(system: &Y) -> Rk4<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    Rk4::new(system)
}

/// The implicit midpoint rule with two iterations: the derivatives of the dynamics once, their matrix factored once, and two
/// evaluations of the dynamics a step.
pub fn midpoint<Y>(system: &Y) -> FixedIterations<ImplicitMidpoint<Y>>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    ImplicitMidpoint::new(system).with_iterations(2)
}

/// Runs a system for [`STEPS`] steps of 1 ms from rest, each joint 0.2 rad further out than the one before.
///
/// # Errors
/// The number of the step after which the state is unusable. (The integrator's own error holds the time as a double:
/// passing it on would bring a conversion in software into the single-precision image.)
pub fn run<Y, M>(system: &mut Y, method: impl Fn(&Y) -> M) -> Result<State<Y>, u32>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    let (mut q, mut p) = (system.neutral(), system.rest());
    let mut start = Y::Scalar::constant(0.3);
    for q in q.as_mut() {
        *q = start;
        start = start + Y::Scalar::constant(0.2);
    }
    let h = Y::Scalar::constant(1.0e-3);
    let mut integrator = method(system);
    let mut t = Y::Scalar::zero();
    for step in 0..STEPS {
        integrator.step(system, t, h, &mut q, &mut p).map_err(|_| step)?;
        t = t + h;
    }
    Ok((q, p))
}

/// A number's bits, for a comparison that cannot be talked round.
pub trait Bits: Copy {
    /// The bits; of an `f32` in the lower half.
    fn bits(self) -> u64;
}

impl Bits for f32 {
    fn bits(self) -> u64 {
        self.to_bits().into()
    }
}

impl Bits for f64 {
    fn bits(self) -> u64 {
        self.to_bits()
    }
}

/// Calls `$what!(name, path of the type, path of the function that makes the method)` for every scene: one firmware image
/// each.
#[macro_export]
macro_rules! each_scene {
    ($what:ident) => {
        $what!(double_pendulum_f32, $crate::DoublePendulumF32, $crate::rk4);
        $what!(double_pendulum_f64, $crate::DoublePendulumF64, $crate::rk4);
        $what!(double_pendulum_midpoint_f32, $crate::DoublePendulumF32, $crate::midpoint);
        $what!(ur5_f32, $crate::Ur5F32, $crate::rk4);
        $what!(ur5_f64, $crate::Ur5F64, $crate::rk4);
        $what!(ur5_midpoint_f32, $crate::Ur5F32, $crate::midpoint);
    };
}
