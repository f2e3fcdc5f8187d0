//! The sweeps, each written once, over any [`Scalar`].
//!
//! Letters and equation numbers are those of J. Naudet, *Forward Dynamics of Multibody Systems: A Recursive Hamiltonian
//! Approach* (2005). Joints drop what their structure makes zero (`M'E = 0`, `EᵀD' = p` are built in, not computed).
//!
//! A coordinate shared by several joints (a mimic) keeps its column `F = M* E` open while the sweep goes on inward, and
//! is eliminated where all its joints have met: exact, and still one pass.
//!
//! What a sweep does at one node is a function of its own (`factor_node`, `motion_node` ...), beside a
//! [`Sweep`](pass::Sweep) that says in which direction it goes; `outputs.rs` has the order of the sweeps of every
//! output. The generator runs the same lists over one link of a long chain.

mod acceleration;
mod articulate;
mod centroidal;
mod closure;
mod constraint;
mod constraint_acceleration;
mod derivatives;
mod factor;
mod inverse;
mod jacobian;
mod kinematics;
mod level;
mod loads;
mod matrix;
mod momentum;
mod name;
mod newton;
mod outputs;
pub mod pass;
mod rates;
mod regressor;
mod solve;
mod steps;
mod touch;

pub use derivatives::{Derivatives, ParameterDerivatives};
pub use kinematics::FrameState;
pub use newton::Accelerations;

use crate::spatial::{ElementaryTransform, RigidInertia};
use crate::tree::{Elimination, Tree, TreeFrame};
use crate::Scalar;

/// What a sweep is about to compute; a symbolic run labels its nodes with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Quantity {
    /// Sines, cosines, rotation matrices.
    Pose,
    /// `M*`, `M'`.
    Inertia,
    /// `U`, `Mj`, `k`.
    Pivot,
    /// `D`, `D'`.
    BiasMomentum,
    /// `Ω̂`, `Ω`.
    Velocity,
    /// `q̇` or `ν`.
    Rate,
    /// `Ω̇`, `q̈`.
    Acceleration,
    /// `P`, `P*`.
    Momentum,
    /// `ṗ`.
    MomentumRate,
    /// Gravity and wrenches.
    Load,
    /// Energies.
    Energy,
    /// Mass matrix.
    MassMatrix,
    /// Placements of frames.
    Placement,
    /// Reaction wrenches.
    Reaction,
    /// `τ` or bias forces.
    Effort,
    /// Jacobians.
    Jacobian,
    /// Derivatives of the rates.
    Derivative,
    /// Loops and couplings.
    Constraint,
}

/// Is told where the sweep stands. `()` listens to nothing.
pub trait Trace {
    /// Whether it listens at all.
    const LISTENS: bool = true;
    /// Whether the tree is known to be [plain](Tree::is_plain): then the sweeps are compiled without all that only other
    /// trees need.
    const PLAIN: bool = false;

    /// The next operations belong to this node (`None`: the ground) and quantity.
    fn at(&self, _node: Option<usize>, _what: Quantity) {}
    /// A value of the node where the sweep stands is an entry of something that has a letter: `m` and `xx`; the entry
    /// may be empty.
    #[inline]
    fn name<S: Scalar>(&self, _value: S, _letter: &'static str, _entry: &'static str) {}
}

impl Trace for () {
    const LISTENS: bool = false;
}

/// Listens to nothing, on a [plain](Tree::is_plain) tree.
#[derive(Clone, Copy, Debug)]
pub struct Plain;

impl Trace for Plain {
    const LISTENS: bool = false;
    const PLAIN: bool = true;
}

/// The elimination of every node of a plain tree.
const PLAIN: &Elimination = &Elimination::PLAIN;

/// What is given with every call beside the state.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a, S> {
    /// Joint forces `τ`, one for each velocity; empty where none act.
    pub tau: &'a [S],
    /// Prescribed positions.
    pub drive_q: &'a [S],
    /// Prescribed rates.
    pub drive_v: &'a [S],
    /// Prescribed accelerations.
    pub drive_a: &'a [S],
    /// External wrenches `[force; moment]`.
    pub wrenches: &'a [[S; 6]],
    /// Gravity in ground axes, m/s².
    pub gravity: [S; 3],
}

/// The sweeps over one tree.
#[derive(Debug)]
pub struct Sweeps<'a, S, T = ()> {
    /// The mechanism.
    pub tree: &'a Tree<S>,
    /// Listener.
    pub trace: &'a T,
}

impl<'a, S: Scalar, T: Trace> Sweeps<'a, S, T> {
    /// Whether there are shared coordinates or constraints. Trees without them are common, and are spared all that is
    /// about open columns.
    #[inline(always)]
    fn has_unknowns(&self) -> bool {
        !T::PLAIN && !self.tree.unknowns.is_empty()
    }

    /// Whether columns of unknowns pass through node `i` or end there.
    #[inline(always)]
    fn has_open(&self, i: usize) -> bool {
        self.has_unknowns() && !self.elimination(i).is_closed()
    }

    /// How the freedoms of node `i` are eliminated: a constant where the tree is known to be plain.
    #[inline(always)]
    fn elimination(&self, i: usize) -> &Elimination {
        match T::PLAIN {
            true => PLAIN,
            false => &self.tree.nodes[i].elimination,
        }
    }

    /// Inertia of the body of node `i` in the node frame.
    #[inline(always)]
    fn inertia<'b>(&'b self, w: &'b crate::workspace::Poses<S>, i: usize) -> &'b RigidInertia<S> {
        match self.elimination(i).non_rotating {
            true => &w.body[i].inertia,
            false => &self.tree.nodes[i].inertia,
        }
    }

    /// Steps from the frame of a node to another frame on its body.
    fn on_body<'b>(
        &'b self,
        w: &crate::workspace::Poses<S>,
        frame: &'b TreeFrame<S>,
    ) -> impl DoubleEndedIterator<Item = ElementaryTransform<S>> + 'b {
        let body = frame.node.filter(|&i| self.tree.nodes[i].elimination.non_rotating).map(|i| w.body[i].step());
        body.into_iter().chain(frame.place.iter().copied())
    }
}
