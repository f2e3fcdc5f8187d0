//! Motions from velocities, and placements.

use super::pass::{each_node, visit_motion, Sweep};
use super::{name, Quantity, Sweeps, Trace};
use crate::spatial::{Mat3, Motion, Vec3};
use crate::tree::{Source, TreeFrame};
use crate::workspace::Workspace;
use crate::Scalar;

/// Pose and motion of a frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameState<S> {
    /// Child components to ground components.
    pub rotation: Mat3<S>,
    /// Origin in the ground, m.
    pub position: Vec3<S>,
    /// Velocity in the axes of the frame, at its origin.
    pub velocity: Motion<S>,
}

impl<S: Scalar> FrameState<S> {
    /// The ground itself.
    pub fn ground() -> Self {
        let (o, one) = (S::zero(), S::one());
        FrameState { rotation: [[one, o, o], [o, one, o], [o, o, one]], position: [o; 3], velocity: Motion::zero() }
    }
}

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// `Ω_i = X_i Ω_λ + E v` from given velocities.
    pub(super) const VELOCITY: Self = Sweep {
        carried: |cx, i, visit| visit_motion(&mut cx.w.velocity.omega[i], visit),
        ..each_node!(BaseToTip, |cx, i| cx.sweeps.velocity_node(i, cx.given.second, cx.given.inputs.drive_v, cx.w))
    };

    /// Poses of all nodes in the ground.
    pub(super) const PLACEMENT: Self = each_node!(BaseToTip, |cx, i| cx.sweeps.placement_node(i, cx.w));
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// `Ω` of node `i` from given velocities, after its parent.
    pub(super) fn velocity_node(&self, i: usize, v: &[S], drive: &[S], w: &mut Workspace<S>) {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Velocity);
        let outer = node.parent.map_or(Motion::zero(), |p| w.velocity.omega[p]);
        let hat = self.steps(&w.poses, i).motion(outer);
        let mut omega = hat;
        for k in 0..node.kind.nv() {
            let rate = match node.source {
                Source::State { v: at, .. } => node.ratio * v[at + k],
                Source::Drive { v: at, .. } => node.ratio * drive[at + k],
            };
            w.velocity.rate[w.first[i] + k] = rate;
            node.kind.axis(k).add_to(&mut omega, rate);
        }
        w.velocity.hat[i] = hat;
        w.velocity.omega[i] = omega;
        name::motion(self.trace, "hat", &hat);
        name::motion(self.trace, "omega", &omega);
    }

    /// Pose of node `i` in the ground, after its parent.
    fn placement_node(&self, i: usize, w: &mut Workspace<S>) {
        self.trace.at(Some(i), Quantity::Placement);
        let (o, one) = (S::zero(), S::one());
        let (mut rot, mut pos) = match self.tree.nodes[i].parent {
            Some(p) => (w.rotation[p], w.position[p]),
            None => ([[one, o, o], [o, one, o], [o, o, one]], [o; 3]),
        };
        self.steps(&w.poses, i).iter().for_each(|step| step.pose(&mut rot, &mut pos));
        (w.rotation[i], w.position[i]) = (rot, pos);
    }

    /// Pose and velocity of a frame, after [`Sweep::VELOCITY`] and [`Sweep::PLACEMENT`].
    pub(super) fn frame(&self, frame: &TreeFrame<S>, w: &Workspace<S>) -> FrameState<S> {
        self.trace.at(frame.node, Quantity::Placement);
        let (o, one) = (S::zero(), S::one());
        let (mut rotation, mut position, mut velocity) = match frame.node {
            Some(i) => (w.rotation[i], w.position[i], w.velocity.omega[i]),
            None => ([[one, o, o], [o, one, o], [o, o, one]], [o; 3], Motion::zero()),
        };
        for step in self.on_body(&w.poses, frame) {
            step.pose(&mut rotation, &mut position);
            velocity = step.motion(&velocity);
        }
        FrameState { rotation, position, velocity }
    }
}
