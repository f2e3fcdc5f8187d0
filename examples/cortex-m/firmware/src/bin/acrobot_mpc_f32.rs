//! The Acrobot's swing planned in `f32`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::DoublePendulumF32, scenes::swing_up);
