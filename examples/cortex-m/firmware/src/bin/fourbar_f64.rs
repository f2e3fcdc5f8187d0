//! A planar four-bar in `f64`.
#![no_std]
#![no_main]

firmware::firmware!(scenes::FourbarF64, scenes::closed);
