//! Motion of [`Constrained`] systems.
//!
//! | variant | momenta | positions | cost at the end of a step |
//! | --- | --- | --- | --- |
//! | [`Stabilisation::None`] | `σ` adds up | drift | nothing |
//! | [`Stabilisation::Settle`] | re-zeroed | drift, by the method's error | one solve |
//! | [`Stabilisation::Mass`] | re-zeroed | closed | one solve, and one for each iteration and the last look |
//! | `Stabilisation::Gradient` | re-zeroed | closed | one solve, `Φ` and a small QR for each iteration |
//! | `Stabilisation::Partition` | re-zeroed | closed | one solve, `Φ` and a small LU for each iteration |
//!
//! | `Minimal` with `Watch` | gauge `p_dep = 0` | closed at every evaluation | `Φ` and a small LU, three or four times an evaluation |
//! | [`Rattle`] | re-zeroed | closed | inside of the step: 6 to 13 iterations of 3 open evaluations and 3 sweeps |
//! | [`IndexTwo`] | re-zeroed | drift | inside of the step: iterations of 3 open evaluations and 3 projections |
//!
//! [`Steady`] is the third of them with a number of iterations that is fixed when it is compiled.
//! They are wrapped around any method ([`Bounded`], [`Hold`]); minimal coordinates are a [`System`](crate::System) of their own.

#[cfg(feature = "alloc")]
mod basic;
#[cfg(feature = "alloc")]
mod blocks;
mod boundary;
#[cfg(feature = "alloc")]
mod close;
#[cfg(feature = "alloc")]
mod dense;
mod error;
mod hold;
mod index_two;
#[cfg(feature = "alloc")]
mod minimal;
mod rattle;
mod rows;
mod split;
mod steady;

pub use boundary::{Boundary, Bounded};
#[cfg(feature = "alloc")]
pub use close::{close, complete, Closed, Closing};
pub use error::ConstraintError;
pub use hold::{Effort, Hold, Stabilisation};
pub use index_two::IndexTwo;
#[cfg(feature = "alloc")]
pub use minimal::{Minimal, Switch, Watch};
pub use rattle::Rattle;
pub use split::{Parted, Split};
pub use steady::Steady;

#[cfg(doc)]
use crate::Constrained;
