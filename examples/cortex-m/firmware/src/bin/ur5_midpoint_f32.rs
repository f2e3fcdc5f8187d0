//! The six-joint arm UR5 in `f32` by the implicit midpoint rule.
#![no_std]
#![no_main]

firmware::firmware!(scenes::Ur5F32, scenes::midpoint);
