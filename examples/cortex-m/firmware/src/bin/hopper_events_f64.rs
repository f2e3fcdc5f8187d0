//! A hopper that lands and takes off, from event to event, in `f64`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::HopperEventsF64, |system: &mut _| scenes::hopping_by_events(system, firmware::now));
