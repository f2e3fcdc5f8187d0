//! A planar four-bar in `f32`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::FourbarF32, scenes::closed);
