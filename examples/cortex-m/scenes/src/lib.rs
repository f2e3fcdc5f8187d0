//! The runs of the firmware and of its host twin: generated dynamics in steps of 1 ms.
#![no_std]

use mbd_runtime::constrained::{Projection, WithPostStep};
use mbd_runtime::integrate::{Ab6, ImplicitMidpoint, Rk4, Stepper};
use mbd_runtime::{Constrained, Differentiable, Energetic, Real, Scalar, System};
use mpc::acrobot;
use mpc::ilqr::Ilqr;
use mpc::steps::{Dynamics, Steps};

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
    elimination = fewest,
    angles = bounded,
    outputs = [rates, momenta, energy, derivatives]
}
mbd_macros::mbd_model! {
    path = "../../../models/ur5.urdf",
    name = Ur5F64,
    scalar = f64,
    elimination = fewest,
    angles = bounded,
    outputs = [rates, momenta, energy]
}
mbd_macros::mbd_model! {
    path = "../../../models/mechanisms/fourbar.toml",
    name = FourbarF32,
    scalar = f32,
    outputs = [rates, constraint_residuals, project_momenta, position_correction, multipliers, energy]
}
mbd_macros::mbd_model! {
    path = "../../../models/mechanisms/fourbar.toml",
    name = FourbarF64,
    scalar = f64,
    outputs = [rates, constraint_residuals, project_momenta, position_correction, multipliers, energy]
}

mod contacts;
mod mpc;

pub use contacts::{hopping, hopping_by_events, leg, HopperEventsF64, HopperF32, HopperF64, LegF32, LegF64};

/// Number of steps of the short runs.
pub const STEPS: u32 = 1000;
/// Number of steps of the run of a minute, and number of steps between two evaluations of the energy.
pub const MINUTE: (u32, u32) = (60_000, 100);

/// Number of steps of the four-bar's run, and number of steps between two evaluations of the energy.
pub const LOOP: (u32, u32) = (3000, 100);
/// Coordinates at which the four-bar starts, rad: closed, with the crank at 60 degrees.
const FOURBAR: [f64; 3] = [1.047_197_551_196_597_6, -0.541_626_669_742_253_2, 1.633_456_164_175_602_2];

/// The end of a run and its work.
pub struct End<Y: System> {
    /// Coordinates.
    pub q: Y::Coordinates,
    /// Momenta.
    pub p: Y::Momenta,
    /// Energies of the run of a minute, J, as the system itself computes them: energy at the start, largest change,
    /// largest kinetic energy.
    pub energy: Option<[Y::Scalar; 3]>,
    /// Number of steps.
    pub steps: u32,
    /// Number of evaluations of the dynamics.
    pub evaluations: u64,
    /// Of runs with contacts: ticks of the clock that the costliest step without an event took, steps with impulses or
    /// events, and ticks of the costliest step with an event; zero where the run takes time steps.
    pub contacts: Option<[u64; 3]>,
}

/// Error: the number of the step after which the state is unusable. (The integrator's own error contains the time as a
/// double, and passing it on would add a software conversion to the single-precision image.)
#[derive(Debug)]
pub struct Unusable(pub u32);

/// The method of Runge and Kutta of order 4: four evaluations of the dynamics in each step.
///
/// # Errors
/// [`Unusable`].
pub fn rk4<Y>(system: &mut Y) -> Result<End<Y>, Unusable>
where
    Y: System,
    Y::Scalar: Real,
{
    let method = Rk4::new(system);
    short(system, method)
}

/// The implicit midpoint rule with two iterations. Each step evaluates the derivatives of the dynamics once, factors
/// their matrix once, and evaluates the dynamics twice.
///
/// # Errors
/// [`Unusable`].
pub fn midpoint<Y>(system: &mut Y) -> Result<End<Y>, Unusable>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    let method = ImplicitMidpoint::new(system).with_iterations(2);
    short(system, method)
}

/// A minute by Adams and Bashforth's method of order 6 with compensated sums, from rest at ±0.3 rad in turn: one
/// evaluation of the dynamics in each step, and some more in the first five.
///
/// # Errors
/// [`Unusable`].
pub fn minute<Y>(system: &mut Y) -> Result<End<Y>, Unusable>
where
    Y: Energetic,
    Y::Scalar: Real,
{
    watched_minute(system, |_, _| ())
}

/// The same, with a look at every state from the start on.
///
/// # Errors
/// [`Unusable`].
pub fn watched_minute<Y>(system: &mut Y, watch: impl FnMut(&Y::Coordinates, &Y::Momenta)) -> Result<End<Y>, Unusable>
where
    Y: Energetic,
    Y::Scalar: Real,
{
    let mut q = system.neutral();
    let mut start = Y::Scalar::constant(0.3);
    for q in q.as_mut() {
        *q = start;
        start = -start;
    }
    let p = system.zero_momenta();
    let method = Ab6::compensated(system);
    watched(system, method, MINUTE, (q, p), watch)
}

/// A run with a given number of steps, which passes every state to a function, and evaluates the energy at intervals.
fn watched<Y, M>(
    system: &mut Y,
    method: M,
    (steps, often): (u32, u32),
    (q, p): (Y::Coordinates, Y::Momenta),
    mut watch: impl FnMut(&Y::Coordinates, &Y::Momenta),
) -> Result<End<Y>, Unusable>
where
    Y: Energetic,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    watch(&q, &p);
    let (kinetic, potential) = system.energies(&q, &p);
    let start = kinetic + potential;
    let (mut change, mut largest) = (Y::Scalar::zero(), kinetic);
    let end = run(system, method, steps, (q, p), |system, step, q, p| {
        watch(q, p);
        if step % often == 0 {
            let (kinetic, potential) = system.energies(q, p);
            let off = ((potential - start) + kinetic).abs();
            change = if off > change { off } else { change };
            largest = if kinetic > largest { kinetic } else { largest };
        }
    })?;
    Ok(End { energy: Some([start, change, largest]), ..end })
}

/// Three seconds of the four-bar from rest by the method of Runge and Kutta of order 4. The end of every step does the
/// same work: one momentum projection and one position correction.
///
/// # Errors
/// [`Unusable`].
pub fn closed<Y>(system: &mut Y) -> Result<End<Y>, Unusable>
where
    Y: Constrained + Energetic,
    Y::Scalar: Real,
{
    watched_closed(system, |_, _| ())
}

/// The same, with a look at every state from the start on.
///
/// # Errors
/// [`Unusable`].
pub fn watched_closed<Y>(system: &mut Y, watch: impl FnMut(&Y::Coordinates, &Y::Momenta)) -> Result<End<Y>, Unusable>
where
    Y: Constrained + Energetic,
    Y::Scalar: Real,
{
    let (mut q, p) = (system.neutral(), system.zero_momenta());
    for (q, start) in q.as_mut().iter_mut().zip(FOURBAR) {
        *q = Y::Scalar::constant(start);
    }
    let projection = Projection::fixed_work::<1>(system);
    let method = WithPostStep::new(system, Rk4::new(system), projection);
    watched(system, method, LOOP, (q, p), watch)
}

/// Iterations in which the Acrobot's swing is planned.
pub const ITERATIONS: u32 = 120;

/// Steps of the dynamics that are counted.
struct Counted<D>(D, u64);

impl<D: Dynamics<f32, 4, 1>> Dynamics<f32, 4, 1> for Counted<D> {
    fn step(&mut self, x: &[f32; 4], u: &[f32; 1]) -> [f32; 4] {
        self.1 += 2;
        self.0.step(x, u)
    }
    fn linearise(&mut self, x: &[f32; 4], u: &[f32; 1], a: &mut [[f32; 4]; 4], b: &mut [[f32; 1]; 4]) {
        self.1 += 2;
        self.0.linearise(x, u, a, b);
    }
}

/// Plans how the Acrobot swings up, by model predictive control's solver: a step is an iteration. The state is that at the end
/// of the plan, and the energies are its cost, the first input and the largest.
///
/// # Errors
/// [`Unusable`], where the plan ends more than 0.1 rad from upright.
pub fn swing_up(system: &mut DoublePendulumF32) -> Result<End<DoublePendulumF32>, Unusable> {
    let drive = |arm: &mut DoublePendulumF32, u: &[f32; 1]| arm.tau = [0.0, u[0]];
    let steps = Steps { system: system.clone(), drive, joints: acrobot::JOINTS, length: acrobot::LENGTH as f32 };
    let (mut dynamics, problem) = (Counted(steps, 0), acrobot::problem());
    let push = [acrobot::PUSH as f32];
    let mut plan = Ilqr::<f32, 4, 1, { acrobot::NODES }>::new(&mut dynamics, &problem, &[0.0; 4], &push);
    for _ in 0..ITERATIONS {
        plan.iterate(&mut dynamics, &problem);
    }
    let [a, b, c, d] = plan.x[acrobot::NODES - 1];
    let off = |x: f32, goal: f32| x - goal < 0.1 && goal - x < 0.1;
    if !(off(a, problem.goal[0]) && off(b, 0.0)) {
        return Err(Unusable(ITERATIONS));
    }
    let largest = plan.u.iter().fold(0.0_f32, |m, u| if u[0] > m { u[0] } else { m });
    let energy = Some([plan.cost, plan.u[0][0], largest]);
    Ok(End { q: [a, b], p: [c, d], energy, steps: ITERATIONS, evaluations: dynamics.1, contacts: None })
}

/// [`STEPS`] steps from rest, each joint 0.2 rad further than the one before.
fn short<Y, M>(system: &mut Y, method: M) -> Result<End<Y>, Unusable>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    let mut q = system.neutral();
    let mut start = Y::Scalar::constant(0.3);
    for q in q.as_mut() {
        *q = start;
        start = start + Y::Scalar::constant(0.2);
    }
    let p = system.zero_momenta();
    run(system, method, STEPS, (q, p), |_, _, _, _| ())
}

/// Steps of 1 ms, each followed by a call with its number, from 1 on, and the new state.
fn run<Y, M>(
    system: &mut Y,
    mut method: M,
    steps: u32,
    (mut q, mut p): (Y::Coordinates, Y::Momenta),
    mut after: impl FnMut(&mut Y, u32, &Y::Coordinates, &Y::Momenta),
) -> Result<End<Y>, Unusable>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    let h = Y::Scalar::constant(1.0e-3);
    let mut t = Y::Scalar::zero();
    for step in 1..=steps {
        method.step(system, t, h, &mut q, &mut p).map_err(|_| Unusable(step))?;
        t = t + h;
        after(system, step, &q, &p);
    }
    Ok(End { q, p, energy: None, steps, evaluations: method.statistics().evaluations, contacts: None })
}

/// The bits of a number, for an exact comparison.
pub trait Bits: Copy {
    /// The bits; those of an `f32` are in the lower half.
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

/// Calls `$what!(name, path of the type, run)` for every scene: one firmware image each.
#[macro_export]
macro_rules! each_scene {
    ($what:ident) => {
        $what!(double_pendulum_f32, $crate::DoublePendulumF32, $crate::rk4);
        $what!(double_pendulum_f64, $crate::DoublePendulumF64, $crate::rk4);
        $what!(double_pendulum_midpoint_f32, $crate::DoublePendulumF32, $crate::midpoint);
        $what!(ur5_f32, $crate::Ur5F32, $crate::rk4);
        $what!(ur5_f64, $crate::Ur5F64, $crate::rk4);
        $what!(ur5_midpoint_f32, $crate::Ur5F32, $crate::midpoint);
        $what!(ur5_minute_f32, $crate::Ur5F32, $crate::minute);
        $what!(fourbar_f32, $crate::FourbarF32, $crate::closed);
        $what!(fourbar_f64, $crate::FourbarF64, $crate::closed);
        $what!(acrobot_mpc_f32, $crate::DoublePendulumF32, $crate::swing_up);
        $what!(hopper_f32, $crate::HopperF32, |system: &mut _| $crate::hopping(system, || 0));
        $what!(hopper_f64, $crate::HopperF64, |system: &mut _| $crate::hopping(system, || 0));
        $what!(hopper_events_f64, $crate::HopperEventsF64, |system: &mut _| $crate::hopping_by_events(system, || 0));
        $what!(leg_f32, $crate::LegF32, |system: &mut _| $crate::leg(system, || 0));
        $what!(leg_f64, $crate::LegF64, |system: &mut _| $crate::leg(system, || 0));
    };
}
