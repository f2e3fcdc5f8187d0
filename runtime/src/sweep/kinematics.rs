//! Motions from velocities, and placements.

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

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// `Ω_i = X_i Ω_λ + E v` from given velocities.
    pub(super) fn velocity_kinematics(&self, v: &[S], drive: &[S], w: &mut Workspace<S>) {
        for i in 0..self.tree.nodes.len() {
            self.velocity_node(i, v, drive, w);
        }
    }

    /// `Ω` of node `i` from given velocities, its parent being done.
    pub fn velocity_node(&self, i: usize, v: &[S], drive: &[S], w: &mut Workspace<S>) {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Velocity);
        let outer = node.parent.map_or(Motion::zero(), |p| w.velocity.omega[p]);
        let hat = self.motion_in(&w.poses, i, &outer);
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

    /// Poses of all nodes in the ground.
    pub fn placements(&self, w: &mut Workspace<S>) {
        let (o, one) = (S::zero(), S::one());
        for (i, node) in self.tree.nodes.iter().enumerate() {
            self.trace.at(Some(i), Quantity::Placement);
            let (mut rot, mut pos) = match node.parent {
                Some(p) => (w.rotation[p], w.position[p]),
                None => ([[one, o, o], [o, one, o], [o, o, one]], [o; 3]),
            };
            for step in self.steps(&w.poses, i) {
                step.pose(&mut rot, &mut pos);
            }
            w.rotation[i] = rot;
            w.position[i] = pos;
        }
    }

    /// Pose and velocity of a frame, after [`Sweeps::placements`] and a velocity sweep.
    pub fn frame(&self, frame: &TreeFrame<S>, w: &Workspace<S>) -> FrameState<S> {
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

    /// Poses and velocities of frames: `(q, v)` in, one [`FrameState`] for each of `frames` out.
    pub fn frame_states<'b>(
        &self,
        q: &[S],
        v: &[S],
        u: &super::Inputs<S>,
        w: &mut Workspace<S>,
        frames: impl Iterator<Item = (&'b TreeFrame<S>, &'b mut FrameState<S>)>,
    ) where
        S: 'b,
    {
        self.articulate(q, u.drive_q, &mut w.poses);
        self.velocity_kinematics(v, u.drive_v, w);
        self.placements(w);
        for (frame, out) in frames {
            *out = self.frame(frame, w);
        }
    }
}
