//! The six-joint arm UR5 in `f64`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::Ur5F64, scenes::rk4);
