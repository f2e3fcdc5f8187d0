//! Methods of integration on small systems that are written by hand.

mod constrained;
mod edges;
mod events;
mod multistep;
mod schemes;
mod solver;
mod switching;
mod systems;
