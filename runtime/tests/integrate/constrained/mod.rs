//! Motion with constraints: consistent states, stabilisation, orders, energy, coordinate partitions.

mod closing;
mod holding;
mod minimal;
mod multipliers;
mod systems;
