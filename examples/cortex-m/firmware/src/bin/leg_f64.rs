//! One leg that hops on a floor with friction, by time steps, in `f64`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::LegF64, |system: &mut _| scenes::leg(system, firmware::now));
