//! Closed loops and couplings: comparisons with dense matrices, with definitions, and of different descriptions.

#[allow(dead_code)]
#[path = "../tree/cases.rs"]
mod cases;
mod choices;
mod dense;
mod dense_reference;
mod derivatives;
mod penalty;
mod platforms;
mod reactions;
mod row_order;
mod row_order_motion;
mod truth;
