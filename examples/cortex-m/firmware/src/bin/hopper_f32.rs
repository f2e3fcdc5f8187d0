//! A hopper that lands and takes off, by time steps, in `f32`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::HopperF32, |system: &mut _| scenes::hopping(system, firmware::now));
