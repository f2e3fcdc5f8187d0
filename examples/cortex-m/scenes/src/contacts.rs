//! Mechanisms that touch the floor: time steps of Moreau's midpoint rule, with a fixed number of sweeps for the impulses.

use mbd_runtime::contact::{TimeStepping, Touching, WithContacts};
use mbd_runtime::{Energetic, Scalar};

use crate::{End, Unusable};

mbd_macros::mbd_model! {
    path = "../../../models/contacts/hopper.toml",
    name = HopperF32,
    scalar = f32,
    modes = all
}
mbd_macros::mbd_model! {
    path = "../../../models/contacts/hopper.toml",
    name = HopperF64,
    scalar = f64,
    modes = all
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
    let mut q = system.neutral();
    for (q, start) in q.as_mut().iter_mut().zip(HopperF64::START) {
        *q = Y::Scalar::constant(start);
    }
    let p = system.zero_momenta();
    stepped(system, (q, p), now, |_, _, _| ())
}

/// A run by time steps. `drive` sets the inputs from the state before every step, and `now` reads a clock. The contacts
/// must have come together and have parted, or the run fails.
fn stepped<Y>(
    system: &mut Y,
    (mut q, mut p): (Y::Coordinates, Y::Momenta),
    now: impl Fn() -> u32,
    drive: impl Fn(&mut Y, &Y::Coordinates, &Y::Momenta),
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
        drive(system.system_mut(), &q, &p);
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
    Ok(End { q, p, energy, steps: STEPS, evaluations, contacts: Some([costliest.into(), touched]) })
}
