//! A hopper that lands and takes off, by time steps, in `f64`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::HopperF64, |system: &mut _| scenes::hopping(system, firmware::now));
