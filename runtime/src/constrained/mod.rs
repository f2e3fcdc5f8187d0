//! Integration of [`Constrained`] systems: closed loops, couplings, rolling.
//!
//! | method | momenta | positions | cost at the end of a step |
//! | --- | --- | --- | --- |
//! | [`Stabilisation::None`] | `σ` accumulates | drift | nothing |
//! | [`Stabilisation::Momenta`] | projected | drift, by the method's error | one solve |
//! | [`Stabilisation::Mass`] | projected | closed | one solve, and one for each iteration and for the last residuals |
//! | `Stabilisation::Gradient` | projected | closed | two solves, `Φ` and a small QR for each iteration |
//! | `Stabilisation::Partition` | projected | closed | two solves, `Φ` and a small LU for each iteration |
//! | `CoordinatePartition` with `Repartition` | gauge `p_dep = 0` | closed at every evaluation | two to four times `Φ` and a small LU at every evaluation, three more at the end |
//! | [`Rattle`] | projected | closed | within the step: 6 to 13 iterations of 3 open evaluations and 3 sweeps |
//! | [`RadauIndex2`] | projected | drift | within the step: 10 to 20 iterations of 3 open evaluations and 3 projections |
//!
//! The first five are done by a [`Projection`] around any method ([`WithPostStep`]; by name
//! `catalogue::explicit_with_post_step` and `implicit_with_post_step`). [`Projection::fixed_work`] is
//! [`Stabilisation::Mass`] with a number of iterations that is fixed when it is compiled, for firmware. A
//! `CoordinatePartition` is a [`System`](crate::System) of its own, and the last two are methods on a system with and
//! without its constraints ([`OpenAndClosed`]).
//!
//! Methods that remember rates of past steps keep their multipliers `σ`, as their history requires.
//! [`Stabilisation::Mass`] is the general choice: it costs little, and it keeps the energy when a mechanism passes a
//! singular position; near one, `Gradient` and `Partition` correct positions as it does. The end of a step that would
//! change the kinetic energy by more than [`Effort::energy`] is refused: this comparison takes one solve more, and three
//! with [`Stabilisation::None`] and [`Stabilisation::Momenta`], which do not close the positions otherwise.
//!
//! The functions `close` and `complete` compute consistent initial states.

#[cfg(feature = "alloc")]
mod basic;
#[cfg(feature = "alloc")]
mod blocks;
#[cfg(feature = "alloc")]
mod close;
#[cfg(feature = "alloc")]
mod coordinate_partition;
mod correction;
#[cfg(feature = "alloc")]
mod dense;
mod nearness;
mod open_and_closed;
mod post_step;
mod projection;
mod radau;
mod rattle;
pub(crate) mod rows;

pub use crate::error::ConstraintError;
#[cfg(feature = "alloc")]
pub use close::{close, complete, Closed, Closing};
#[cfg(feature = "alloc")]
pub use coordinate_partition::{CoordinatePartition, Repartition, Switch};
pub use correction::{Effort, SingularPosition, Stabilisation};
pub use open_and_closed::{OpenAndClosed, Unconstrained};
pub use post_step::{PostStep, WithPostStep};
pub use projection::{FixedWork, Policy, Projection, Room, ToTolerance};
pub use radau::{RadauIndex2, RadauIndex2Scheme};
pub use rattle::{Rattle, RattleScheme};

#[cfg(doc)]
use crate::Constrained;
