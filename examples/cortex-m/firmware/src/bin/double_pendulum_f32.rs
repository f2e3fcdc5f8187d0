//! The double pendulum in `f32`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::DoublePendulumF32, scenes::rk4);
