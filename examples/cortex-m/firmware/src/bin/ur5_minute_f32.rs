//! The six-joint arm UR5 in `f32` for a minute, with one evaluation of the dynamics a step.
#![no_std]
#![no_main]

firmware::firmware!(scenes::Ur5F32, scenes::minute);
