//! Random mechanisms and states.

mod bodies;
mod builder;
mod contacts;
mod distribution;
mod joints;
mod model;
mod rng;

pub use bodies::matrix as rotation_matrix;
pub use contacts::{legged, with_contacts, with_feet};
pub use distribution::Distribution;
pub use model::random_model;
pub use rng::Rng;
