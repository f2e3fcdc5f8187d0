//! Motion with constraints: closing, staying closed, orders, energy, partitions.

mod closing;
mod holding;
mod minimal;
mod multipliers;
mod systems;
