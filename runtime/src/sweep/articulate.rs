//! Joint coordinates to joint transforms.

use super::{Quantity, Sweeps, Trace};
use crate::spatial::{quaternion_matrix, quaternion_rate, Axis, Step};
use crate::tree::{quarter_turn, Kind, Source};
use crate::workspace::Poses;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Sets the variable steps of every joint from the coordinates of the state and of the drives.
    pub fn articulate(&self, q: &[S], drive_q: &[S], w: &mut Poses<S>) {
        for i in 0..self.tree.nodes.len() {
            self.articulate_node(i, q, drive_q, w);
        }
    }

    /// [`Sweeps::articulate`] for node `i` alone.
    pub fn articulate_node(&self, i: usize, q: &[S], drive_q: &[S], w: &mut Poses<S>) {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Pose);
        let q = match node.source {
            Source::State { q: at, .. } => &q[at..],
            Source::Drive { q: at, .. } => &drive_q[at..],
        };
        let turn = |angle: S| {
            let (s, c) = quarter_turn((angle + node.phase).sin_cos(), node.quarter);
            Step::Turn { axis: Axis::Z, c, s }
        };
        let shift = |axis: Axis, r: S| Step::Shift { axis, r };
        let x = node.ratio * q[0] + node.offset;
        w.coordinates[i][0] = x;
        if let Kind::Planar = node.kind {
            w.coordinates[i].copy_from_slice(&q[..3]);
        }
        match node.kind {
            Kind::Pin => w.joint[i].set(&[shift(Axis::Z, node.slide), turn(x)]),
            Kind::Slider => w.joint[i].set(&[turn(S::zero()), shift(Axis::Z, node.slide + x)]),
            Kind::Helical { pitch } => w.joint[i].set(&[shift(Axis::Z, node.slide + pitch * x), turn(x)]),
            Kind::Planar => w.joint[i].set(&[shift(Axis::X, q[0]), shift(Axis::Y, q[1]), turn(q[2])]),
            Kind::Spherical => w.joint[i].set(&[Step::Rotate(quaternion_matrix([q[0], q[1], q[2], q[3]]))]),
            Kind::Floating => w.joint[i].set(&[
                shift(Axis::X, q[0]),
                shift(Axis::Y, q[1]),
                shift(Axis::Z, q[2]),
                Step::Rotate(quaternion_matrix([q[3], q[4], q[5], q[6]])),
            ]),
        }
    }

    /// Coordinate rates from velocities, `q̇ = N(q) v`.
    pub fn coordinate_rates(&self, q: &[S], v: &[S], qd: &mut [S]) {
        for i in 0..self.tree.nodes.len() {
            self.coordinate_rate_node(i, q, v, qd);
        }
    }

    /// [`Sweeps::coordinate_rates`] for node `i` alone.
    pub fn coordinate_rate_node(&self, i: usize, q: &[S], v: &[S], qd: &mut [S]) {
        let node = &self.tree.nodes[i];
        let Source::State { q: at, v: vat } = node.source else { return };
        self.trace.at(Some(i), Quantity::Rate);
        let (q, v, qd) = (&q[at..], &v[vat..], &mut qd[at..]);
        match node.kind {
            Kind::Pin | Kind::Slider | Kind::Helical { .. } => qd[0] = v[0],
            Kind::Planar => {
                let (s, c) = quarter_turn((q[2] + node.phase).sin_cos(), node.quarter);
                let out = Step::Turn { axis: Axis::Z, c, s }.vector_back([v[0], v[1], v[2]]);
                qd[..3].copy_from_slice(&out);
            }
            Kind::Spherical => {
                qd[..4].copy_from_slice(&quaternion_rate([q[0], q[1], q[2], q[3]], [v[0], v[1], v[2]]));
            }
            Kind::Floating => {
                let turn = [q[3], q[4], q[5], q[6]];
                let lin = Step::Rotate(quaternion_matrix(turn)).vector_back([v[0], v[1], v[2]]);
                qd[..3].copy_from_slice(&lin);
                qd[3..7].copy_from_slice(&quaternion_rate(turn, [v[3], v[4], v[5]]));
            }
        }
    }
}
