//! Methods of integration on interpreted mechanisms: orders, conserved quantities, constraints, allocations.

mod allocations;
mod constrained;
mod free_motion;
mod microcontroller;
mod orders;
mod parallel;
mod precision;
mod symmetry;
mod tolerances;
#[allow(dead_code)]
#[path = "../code/wide.rs"]
mod wide;
