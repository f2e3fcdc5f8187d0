//! Random mechanisms and states.

mod bodies;
mod joints;
mod knobs;
mod model;
mod rng;

pub use bodies::matrix as rotation_matrix;
pub use knobs::Knobs;
pub use model::random_model;
pub use rng::Rng;
