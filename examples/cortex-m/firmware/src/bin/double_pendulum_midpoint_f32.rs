//! The double pendulum in `f32` by the implicit midpoint rule.
#![no_std]
#![no_main]

firmware::firmware!(scenes::DoublePendulumF32, scenes::midpoint);
