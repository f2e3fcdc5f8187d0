//! The sweeps, each written once, over any [`Scalar`].
//!
//! Letters and equation numbers are those of J. Naudet, *Forward Dynamics of Multibody Systems: A Recursive Hamiltonian
//! Approach* (2005). Joints drop what their structure makes zero (`M'E = 0`, `EᵀD' = p` are built in, not computed).
//!
//! A coordinate shared by several joints (a mimic) keeps its column `F = M* E` open while the sweep goes on inward, and
//! is eliminated where all its joints have met: exact, and still one pass.
//!
//! The step of every sweep for one node is a function of its own (`factor_node`, `motion_node` ...): the generator runs one
//! link of a long chain by itself.

mod acceleration;
mod articulate;
mod closure;
mod constraint;
mod constraint_acceleration;
mod derivatives;
mod factor;
mod inverse;
mod jacobian;
mod kinematics;
mod loads;
mod matrix;
mod momentum;
mod name;
mod newton;
mod rates;
mod solve;

pub use derivatives::{Derivatives, MomentumDerivatives, ParameterDerivatives};
pub use kinematics::FrameState;
pub use newton::Accelerations;
pub use solve::Load;

use crate::spatial::{ElementaryTransform, Force, Motion, RigidInertia};
use crate::tree::{Tree, TreeFrame};
use crate::workspace::Workspace;
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
    /// The next operations belong to this node (`None`: the ground) and quantity.
    fn at(&self, _node: Option<usize>, _what: Quantity) {}
    /// A value of the node where the sweep stands is an entry of something that has a letter: `m` and `xx`; the entry may be
    /// empty.
    #[inline]
    fn name<S: Scalar>(&self, _value: S, _letter: &'static str, _entry: &'static str) {}
}

impl Trace for () {}

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
#[derive(Clone, Copy, Debug)]
pub struct Sweeps<'a, S, T = ()> {
    /// The mechanism.
    pub tree: &'a Tree<S>,
    /// Listener.
    pub trace: &'a T,
}

impl<'a, S: Scalar, T: Trace> Sweeps<'a, S, T> {
    /// `X Ω` from the parent frame to node `i`.
    fn motion_in(&self, w: &crate::workspace::Poses<S>, i: usize, m: &Motion<S>) -> Motion<S> {
        self.steps(w, i).fold(*m, |m, step| step.motion(&m))
    }

    /// `Xᵀ P` from node `i` to its parent frame.
    fn force_out(&self, w: &crate::workspace::Poses<S>, i: usize, f: &Force<S>) -> Force<S> {
        self.steps(w, i).rev().fold(*f, |f, step| step.force(&f))
    }

    /// Whether the parent's frame does not turn, so that the way from it to node `i` does.
    fn swung(&self, i: usize) -> bool {
        self.tree.nodes[i].parent.is_some_and(|p| self.tree.nodes[p].elimination.non_rotating)
    }

    /// Constant steps from the parent frame to the joint of node `i`.
    fn place(&self, i: usize) -> &[ElementaryTransform<S>] {
        match self.swung(i) {
            true => &[],
            false => &self.tree.nodes[i].place,
        }
    }

    /// Inertia of the body of node `i` in the node frame.
    fn inertia<'b>(&'b self, w: &'b crate::workspace::Poses<S>, i: usize) -> &'b RigidInertia<S> {
        match self.tree.nodes[i].elimination.non_rotating {
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

    /// Steps from the parent frame to node `i`.
    fn steps<'b>(
        &'b self,
        w: &'b crate::workspace::Poses<S>,
        i: usize,
    ) -> impl DoubleEndedIterator<Item = &'b ElementaryTransform<S>> + 'b {
        self.place(i).iter().chain(w.joint[i].get())
    }

    /// The part of [`Sweeps::steps`] ahead of the frame that node `i` is eliminated in.
    fn entering<'b>(
        &'b self,
        w: &'b crate::workspace::Poses<S>,
        i: usize,
    ) -> impl DoubleEndedIterator<Item = &'b ElementaryTransform<S>> + 'b {
        let joint = &w.joint[i];
        let steps = if self.tree.nodes[i].elimination.before_joint { joint.placing() } else { joint.get() };
        self.place(i).iter().chain(steps)
    }

    /// The rest: from there to the node frame.
    fn leaving<'b>(
        &'b self,
        w: &'b crate::workspace::Poses<S>,
        i: usize,
    ) -> impl DoubleEndedIterator<Item = &'b ElementaryTransform<S>> + 'b {
        let own: &[ElementaryTransform<S>] =
            if self.tree.nodes[i].elimination.before_joint { w.joint[i].own() } else { &[] };
        own.iter()
    }

    /// Momenta from velocities, `p = M(q) v`, without forming `M`. `p` has one entry for each velocity.
    pub fn momenta(&self, q: &[S], v: &[S], u: &Inputs<S>, w: &mut Workspace<S>, p: &mut [S]) {
        self.articulate(q, u.drive_q, &mut w.poses);
        self.velocity_kinematics(v, u.drive_v, w);
        self.momentum_sweep(w, p);
    }

    /// Velocities from momenta.
    pub fn velocities(&self, q: &[S], p: &[S], u: &Inputs<S>, w: &mut Workspace<S>, v: &mut [S]) {
        self.prepare(q, u, w, false);
        self.solve_velocities(p, u, w);
        self.collect_rates(&w.velocity, &w.first, v);
    }

    /// Rates of the state: velocities `v`, coordinate rates `q̇`, momentum rates `ṗ`.
    pub fn rates(
        &self,
        q: &[S],
        p: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        v: &mut [S],
        qd: &mut [S],
        pd: &mut [S],
    ) {
        self.velocities(q, p, u, w, v);
        self.coordinate_rates(q, v, qd);
        self.loads(u, w);
        self.constraint_pull(w);
        self.accumulate_momenta(p, w);
        self.momentum_rates(u, w, pd);
    }

    /// Kinetic and potential energy, J. The potential is zero with every moving mass at the height of the ground's origin;
    /// what is welded to the ground does not count.
    pub fn energy(&self, q: &[S], p: &[S], u: &Inputs<S>, w: &mut Workspace<S>, v: &mut [S]) -> (S, S) {
        self.velocities(q, p, u, w, v);
        let kinetic = self.kinetic(p, w);
        self.gravity_moments(w);
        (kinetic, self.potential(u, w))
    }
}
