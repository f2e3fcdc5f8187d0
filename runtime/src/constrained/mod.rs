//! Motion of [`Constrained`] systems.
//!
//! | variant | momenta | positions | cost at the end of a step |
//! | --- | --- | --- | --- |
//! | [`Stabilisation::None`] | `σ` adds up | drift | nothing |
//! | [`Stabilisation::Momenta`] | re-zeroed | drift, by the method's error | one solve |
//! | [`Stabilisation::Mass`] | re-zeroed | closed | one solve, and one for each iteration and the last look |
//! | `Stabilisation::Gradient` | re-zeroed | closed | one solve, `Φ` and a small QR for each iteration |
//! | `Stabilisation::Partition` | re-zeroed | closed | one solve, `Φ` and a small LU for each iteration |
//!
//! | `CoordinatePartition` with `Repartition` | gauge `p_dep = 0` | closed at every evaluation | two to four times `Φ` and a small LU at every evaluation, three more at the end |
//! | [`Rattle`] | re-zeroed | closed | inside of the step: 6 to 13 iterations of 3 open evaluations and 3 sweeps |
//! | [`RadauIndex2`] | re-zeroed | drift | inside of the step: 10 to 20 iterations of 3 open evaluations and 3 projections |
//!
//! The first five are wrapped around any method ([`WithPostStep`], [`Hold`]; by name `catalogue::explicit_bounded` and
//! `implicit_bounded`); minimal coordinates are a [`System`](crate::System) of their own, and the last two are methods on a
//! system with and without its constraints ([`OpenAndClosed`]).
//!
//! Methods that remember rates of the past go on with their `σ`, as their history must. [`Stabilisation::Mass`] is the choice
//! where nothing speaks for another: what it costs is small, and of a mechanism that passes a singular position it loses least.
//! There steps of given size step past; a tight error control sees the rates' round-off and may not get by.
//!
//! [`Steady`] is the third of them with a number of iterations that is fixed when it is compiled, for firmware.
//!
//! States to begin with come from `close` and `complete`.

#[cfg(feature = "alloc")]
mod basic;
#[cfg(feature = "alloc")]
mod blocks;
mod boundary;
#[cfg(feature = "alloc")]
mod close;
#[cfg(feature = "alloc")]
mod dense;
mod hold;
mod index_two;
#[cfg(feature = "alloc")]
mod minimal;
mod rattle;
mod rows;
mod split;
mod steady;

pub use crate::error::ConstraintError;
pub use boundary::{PostStep, WithPostStep};
#[cfg(feature = "alloc")]
pub use close::{close, complete, Closed, Closing};
pub use hold::{Effort, Hold, Stabilisation};
pub use index_two::{RadauIndex2, RadauIndex2Scheme};
#[cfg(feature = "alloc")]
pub use minimal::{CoordinatePartition, Repartition, Switch};
pub use rattle::{Rattle, RattleScheme};
pub use split::{OpenAndClosed, Unconstrained};
pub use steady::Steady;

#[cfg(doc)]
use crate::Constrained;
