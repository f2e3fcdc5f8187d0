//! Closed loops and couplings against dense matrices, definitions and each other.

#[allow(dead_code)]
#[path = "../tree/cases.rs"]
mod cases;
mod choices;
mod dense;
mod dense_reference;
mod penalty;
mod reactions;
mod truth;
