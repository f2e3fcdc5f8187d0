//! Mechanisms that touch the floor: time steps of Moreau's midpoint rule, with a fixed number of sweeps for the impulses, and
//! a motion from event to event.

use mbd_runtime::constrained::{Projection, WithPostStep};
use mbd_runtime::contact::{Cause, Hybrid, TimeStepping, Touching, WithContacts};
use mbd_runtime::integrate::{Step, Tolerances, Tsit5};
use mbd_runtime::{Energetic, Scalar};

use crate::{End, Unusable};

mbd_macros::mbd_model! {
    path = "../../../models/contacts/hopper.toml",
    name = HopperF32,
    scalar = f32,
    modes = ["open open open"]
}
mbd_macros::mbd_model! {
    path = "../../../models/contacts/hopper.toml",
    name = HopperF64,
    scalar = f64,
    modes = ["open open open"]
}
mbd_macros::mbd_model! {
    path = "../../../models/contacts/hopper.toml",
    name = HopperEventsF64,
    scalar = f64,
    modes = ["open open open", "slide open open"]
}
mbd_macros::mbd_model! {
    path = "../leg.toml",
    name = LegF32,
    scalar = f32,
    modes = ["open open open"]
}
mbd_macros::mbd_model! {
    path = "../leg.toml",
    name = LegF64,
    scalar = f64,
    modes = ["open open open"]
}

/// Number of steps of the runs with contacts.
pub const STEPS: u32 = 2000;
/// Sweeps over the contacts in a step.
const SWEEPS: u32 = 4;
/// Evaluations of the rates in a step of the midpoint rule.
const RATES: u32 = 2;

/// Two seconds of the hopper: it falls by 0.3 m, lands, is thrown up by its spring, and lands again.
///
/// # Errors
/// [`Unusable`].
pub fn hopping<Y>(system: &mut Y, now: impl Fn() -> u32) -> Result<End<Y>, Unusable>
where
    Y: Touching + Energetic + Clone,
{
    let start = start_of_hopper(system);
    stepped(system, start, now, |_, _, _| ())
}

/// The hopper at rest, 0.3 m above the floor.
fn start_of_hopper<Y: Touching>(system: &Y) -> (Y::Coordinates, Y::Momenta) {
    let mut q = system.neutral();
    for (q, start) in q.as_mut().iter_mut().zip(HopperF64::START) {
        *q = Y::Scalar::constant(start);
    }
    (q, system.zero_momenta())
}

/// Seconds of the hopper's motion by events, error allowed in a step, and the number of steps in which it must end.
const TIME: f64 = 2.0;
const TOLERANCE: f64 = 1e-8;
const MOST: u32 = 10_000;

/// The same two seconds from event to event: steps of any length, cut where a contact closes or opens. Both
/// must have happened, or the run fails.
///
/// # Errors
/// [`Unusable`].
pub fn hopping_by_events<Y>(system: &mut Y, now: impl Fn() -> u32) -> Result<End<Y>, Unusable>
where
    Y: Touching<Scalar = f64> + Energetic + Clone,
{
    let (mut q, mut p) = start_of_hopper(system);
    let mut system = WithContacts::new(system.clone());
    let projection = Projection::fixed_work::<1>(&system);
    let method = WithPostStep::new(&system, Tsit5::new(&system), projection);
    let step = Step::Adaptive(Tolerances::new(TOLERANCE));
    let mut motion = Hybrid::new(&mut system, method, step, 0.0, &q, &p).map_err(|_| Unusable(0))?;
    let (mut steps, mut landed, mut left) = (0, 0_u64, 0_u64);
    let mut costliest = [0; 2];
    while motion.time() < TIME && steps < MOST {
        let start = now();
        let event = motion.advance(&mut system, TIME, &mut ()).map_err(|_| Unusable(steps))?;
        let ticks = now().wrapping_sub(start);
        steps += 1;
        let [quiet, eventful] = &mut costliest;
        let most = if event.is_some() { eventful } else { quiet };
        *most = ticks.max(*most);
        match event.map(|event| event.cause) {
            Some(Cause::Landed) => landed += 1,
            Some(Cause::Unloaded) => left += 1,
            _ => (),
        }
    }
    if steps == MOST || landed == 0 || left == 0 {
        return Err(Unusable(steps));
    }
    motion.state(&system, &mut q, &mut p);
    let (kinetic, potential) = system.energies(&q, &p);
    let statistics = motion.contact_statistics();
    let energy = Some([kinetic + potential, statistics.lost, statistics.residual]);
    let evaluations = motion.statistics().evaluations;
    let [costliest, event] = costliest;
    let contacts = Some([costliest.into(), landed + left, event.into()]);
    Ok(End { q, p, energy, steps, evaluations, contacts })
}

/// A leg with motors at hip and knee.
pub trait Leg: Touching + Energetic + Clone {
    /// Sets the torques of hip and knee, N m.
    fn drive(&mut self, torques: [Self::Scalar; 2]);
}

macro_rules! leg {
    ($name:ident, $scalar:ty) => {
        impl Leg for $name {
            fn drive(&mut self, [hip, knee]: [$scalar; 2]) {
                self.tau = [0.0, hip, knee];
            }
        }
    };
}
leg!(LegF32, f32);
leg!(LegF64, f64);

/// Stiffness of the controller of the joints, N m/rad, and the torque to which its motors are limited, N m.
const STIFFNESS: f64 = 8.0;
const TORQUE: f64 = 2.7;
/// Angle between thigh and vertical in flight and while crouching, and at the end of a push, rad.
const CROUCHED: f64 = 1.0;
const STRETCHED: f64 = 0.5;
/// Steps of a hop, and of the push in it.
const HOP: (u32, u32) = (500, 100);

/// Two seconds of one leg that crouches and pushes off every half second. Its motors are springs between the joints and
/// where they are to be, with a limited torque; the dampers are the model's.
///
/// # Errors
/// [`Unusable`].
pub fn leg<Y: Leg>(system: &mut Y, now: impl Fn() -> u32) -> Result<End<Y>, Unusable> {
    let number = Y::Scalar::constant;
    let mut q = system.neutral();
    for (q, start) in q.as_mut().iter_mut().zip(LegF64::START) {
        *q = number(start);
    }
    let p = system.zero_momenta();
    let most = number(TORQUE);
    stepped(system, (q, p), now, |leg, step, q| {
        let pushes = step % HOP.0 >= HOP.0 - HOP.1;
        let angle = number(if pushes { STRETCHED } else { CROUCHED });
        let [_, hip, knee] = q.as_ref() else { return };
        leg.drive([angle - *hip, -(angle + angle) - *knee].map(|off| {
            let torque = number(STIFFNESS) * off;
            if torque > most {
                most
            } else if torque < -most {
                -most
            } else {
                torque
            }
        }));
    })
}

/// A run by time steps. `drive(system, step, q)` sets the inputs before every step, and `now` reads a clock. The contacts
/// must have come together and have parted, or the run fails.
fn stepped<Y>(
    system: &mut Y,
    (mut q, mut p): (Y::Coordinates, Y::Momenta),
    now: impl Fn() -> u32,
    drive: impl Fn(&mut Y, u32, &Y::Coordinates),
) -> Result<End<Y>, Unusable>
where
    Y: Touching + Energetic + Clone,
{
    let h = Y::Scalar::constant(1.0e-3);
    let mut system = WithContacts::new(system.clone());
    let mut motion = TimeStepping::fixed_work::<SWEEPS>(&mut system, ());
    let mut t = Y::Scalar::zero();
    let mut costliest = 0;
    for step in 1..=STEPS {
        let start = now();
        drive(system.system_mut(), step, &q);
        motion.step(&mut system, t, h, &mut q, &mut p).map_err(|_| Unusable(step))?;
        t = t + h;
        costliest = costliest.max(now().wrapping_sub(start));
    }
    let statistics = motion.statistics();
    let touched = statistics.touched;
    if touched == 0 || touched == u64::from(STEPS) || statistics.changes < 3 {
        return Err(Unusable(STEPS));
    }
    let (kinetic, potential) = system.energies(&q, &p);
    let energy = Some([kinetic + potential, statistics.lost, statistics.overlap]);
    let evaluations = u64::from(STEPS * RATES);
    Ok(End { q, p, energy, steps: STEPS, evaluations, contacts: Some([costliest.into(), touched, 0]) })
}
