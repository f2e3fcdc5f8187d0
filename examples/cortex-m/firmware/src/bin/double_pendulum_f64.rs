//! The double pendulum in `f64`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::DoublePendulumF64, scenes::rk4);
