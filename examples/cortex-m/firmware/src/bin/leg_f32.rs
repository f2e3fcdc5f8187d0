//! One leg that hops on a floor with friction, by time steps, in `f32`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::LegF32, |system: &mut _| scenes::leg(system, firmware::now));
