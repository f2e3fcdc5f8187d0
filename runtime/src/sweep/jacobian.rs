//! Jacobians of frames, and their bias accelerations: the accelerations of the frames at `v̇ = 0`.

use super::newton::ClassicMotion;
use super::{Quantity, Sweeps, Trace};
use crate::lists::array;
use crate::spatial::{add3, scale3, ElementaryTransform, Mat3, Vec3};
use crate::tree::{Freedom, Source, TreeFrame};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// One of [`Sweeps::jacobians`], after the articulation.
    pub(super) fn jacobian(&self, frame: &TreeFrame<S>, w: &Workspace<S>, out: &mut [S]) {
        out.fill(S::zero());
        self.jacobian_columns(frame, w, |v, column| {
            for (c, x) in column.into_iter().enumerate() {
                let entry = &mut out[c * self.tree.dims.nv + v];
                *entry = *entry + x;
            }
        });
    }

    /// Calls `add` with the number of a velocity and what it adds to its column of the Jacobian, for every freedom
    /// inboard of a frame. The frame's pose is carried inward from node to node: only its ancestors are met, and each
    /// turns three axes and one arm.
    pub(super) fn jacobian_columns(&self, frame: &TreeFrame<S>, w: &Workspace<S>, mut add: impl FnMut(usize, [S; 6])) {
        let (o, one) = (S::zero(), S::one());
        self.trace.at(frame.node, Quantity::Jacobian);
        let (mut rot, mut pos) = ([[one, o, o], [o, one, o], [o, o, one]], [o; 3]);
        self.on_body(&w.poses, frame).for_each(|step| step.pose(&mut rot, &mut pos));
        let path = core::iter::successors(frame.node, |&i| self.tree.nodes[i].parent);
        self.columns_along(path, (rot, pos), w, |i, k, column| {
            let node = &self.tree.nodes[i];
            if let Source::State { v, .. } = node.source {
                add(v + k, column.map(|x| node.ratio * x));
            }
        });
    }

    /// Calls `add` with a node, the number of one of its freedoms and the motion of a frame for a unit rate of it, in the
    /// frame's axes, for every freedom of the nodes of a path inward. The frame has the pose `(rot, pos)` in the first
    /// of these nodes, and is fixed to it.
    pub(super) fn columns_along(
        &self,
        path: impl Iterator<Item = usize>,
        (mut rot, mut pos): (Mat3<S>, Vec3<S>),
        w: &Workspace<S>,
        mut add: impl FnMut(usize, usize, [S; 6]),
    ) {
        for i in path {
            self.trace.at(Some(i), Quantity::Jacobian);
            let node = &self.tree.nodes[i];
            for k in 0..node.kind.nv() {
                add(i, k, column(&node.kind.axis(k), &rot, pos));
            }
            self.steps(&w.poses, i).iter().rev().for_each(|step| before(step, &mut rot, &mut pos));
        }
    }

    /// Motion of a frame in its own axes, after [`Sweep::NEWTON`](super::pass::Sweep::NEWTON); `None` on the ground.
    pub(super) fn classic_frame_motion(&self, frame: &TreeFrame<S>, w: &Workspace<S>) -> Option<ClassicMotion<S>> {
        let i = frame.node?;
        self.trace.at(Some(i), Quantity::Acceleration);
        let mut m = ClassicMotion { spin: w.newton.spin[i], alpha: w.newton.alpha[i], accel: w.newton.accel[i] };
        self.on_body(&w.poses, frame).for_each(|step| m.carry(&step));
        Some(m)
    }

    /// Acceleration `[linear; angular]` of a frame in its own axes, after
    /// [`Sweep::NEWTON`](super::pass::Sweep::NEWTON).
    pub(super) fn frame_acceleration(&self, frame: &TreeFrame<S>, w: &Workspace<S>) -> [S; 6] {
        let Some(m) = self.classic_frame_motion(frame, w) else { return [S::zero(); 6] };
        let ([ax, ay, az], [bx, by, bz]) = (m.accel, m.alpha);
        [ax, ay, az, bx, by, bz]
    }
}

/// Velocity of a frame at the pose `(rot, pos)` in a node, in the frame's axes, for a unit rate of a degree of freedom
/// of the node.
fn column<S: Scalar>(axis: &Freedom<S>, rot: &Mat3<S>, pos: Vec3<S>) -> [S; 6] {
    // Rᵀ e × r, row a of R being Rᵀ e_a.
    let turned = |k: usize| {
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        array(|c| pos[a] * rot[b][c] - pos[b] * rot[a][c])
    };
    let (lin, ang): (Vec3<S>, Vec3<S>) = match *axis {
        Freedom::Unit(k) if k < 3 => (rot[k], [S::zero(); 3]),
        Freedom::Unit(k) => (turned(k - 3), rot[k - 3]),
        Freedom::Screw(h) => (add3(turned(2), scale3(h, rot[2])), rot[2]),
    };
    [lin[0], lin[1], lin[2], ang[0], ang[1], ang[2]]
}

/// Applies a transform before the pose `(rot, pos)`.
pub(super) fn before<S: Scalar>(step: &ElementaryTransform<S>, rot: &mut Mat3<S>, pos: &mut Vec3<S>) {
    if let ElementaryTransform::Shift { axis, r } = step {
        let (_, _, n) = axis.cyclic();
        pos[n] = pos[n] + *r;
        return;
    }
    *pos = step.vector_back(*pos);
    for c in 0..3 {
        let turned = step.vector_back([rot[0][c], rot[1][c], rot[2][c]]);
        (rot[0][c], rot[1][c], rot[2][c]) = (turned[0], turned[1], turned[2]);
    }
}
