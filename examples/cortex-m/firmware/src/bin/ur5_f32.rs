//! The six-joint arm UR5 in `f32`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::Ur5F32, scenes::rk4);
