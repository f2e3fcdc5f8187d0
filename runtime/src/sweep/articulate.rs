//! Joint coordinates to joint transforms.

use super::pass::{each_node, Sweep};
use super::{Quantity, Sweeps, Trace};
use crate::spatial::{quaternion_matrix, quaternion_rate, Axis, ElementaryTransform, RigidInertia};
use crate::tree::{quarter_turn, Kind, Source};
use crate::workspace::{Poses, TurnedBody};
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// `q̇ = N(q) v` from the velocities among the results.
    pub(super) const COORDINATE_RATES: Self =
        each_node!(BaseToTip, |cx, i| cx.sweeps.coordinate_rate_node(i, cx.given.q, cx.results.v, cx.results.qd));
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Sets the variable transforms of every joint from the coordinates of the state and of the drives.
    pub(super) fn articulate(&self, q: &[S], drive_q: &[S], w: &mut Poses<S>) {
        for i in 0..self.tree.nodes.len() {
            self.articulate_node(i, q, drive_q, w);
        }
    }

    /// [`Sweeps::articulate`] for node `i` alone.
    fn articulate_node(&self, i: usize, q: &[S], drive_q: &[S], w: &mut Poses<S>) {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Pose);
        let q = match node.source {
            Source::State { q: at, .. } => &q[at..],
            Source::Drive { q: at, .. } => &drive_q[at..],
        };
        let turn = |angle: S| {
            let (s, c) = quarter_turn((angle + node.phase).sin_cos(), node.quarter);
            ElementaryTransform::Turn { axis: Axis::Z, c, s }
        };
        let shift = |axis: Axis, r: S| ElementaryTransform::Shift { axis, r };
        let x = node.ratio * q[0] + node.offset;
        w.coordinates[i][0] = x;
        if let Kind::Planar = node.kind {
            w.coordinates[i].copy_from_slice(&q[..3]);
        }
        match node.kind {
            Kind::Revolute => self.revolute(i, x, w),
            Kind::Prismatic => w.steps.set(i, &node.place, 0, [turn(S::zero()), shift(Axis::Z, node.slide + x)]),
            Kind::Helical { pitch } => {
                w.steps.set(i, &node.place, 0, [shift(Axis::Z, node.slide + pitch * x), turn(x)]);
            }
            Kind::Planar => {
                w.steps.set(i, &node.place, 0, [shift(Axis::X, q[0]), shift(Axis::Y, q[1]), turn(q[2])]);
            }
            Kind::Spherical => {
                let turn = ElementaryTransform::Rotate(quaternion_matrix([q[0], q[1], q[2], q[3]]));
                w.steps.set(i, &node.place, 0, [turn]);
            }
            Kind::Floating => {
                let turn = ElementaryTransform::Rotate(quaternion_matrix([q[3], q[4], q[5], q[6]]));
                let to = [shift(Axis::X, q[0]), shift(Axis::Y, q[1]), shift(Axis::Z, q[2]), turn];
                w.steps.set(i, &node.place, 0, to);
            }
        }
    }

    /// Elementary transforms of a revolute joint with joint coordinate `x`.
    fn revolute(&self, i: usize, x: S, w: &mut Poses<S>) {
        let node = &self.tree.nodes[i];
        let shift = |axis: Axis, r: S| ElementaryTransform::Shift { axis, r };
        let (mut angle, mut quarter, mut slide) = (x + node.phase, node.quarter, node.slide);
        let mut placing = [shift(Axis::X, S::zero()), shift(Axis::Y, S::zero())];
        let turns = self.placement_turns(i);
        if let Some(p) = node.parent.filter(|_| turns) {
            let outer = &w.body[p];
            (angle, quarter) = (angle + outer.angle, (quarter + outer.quarter) % 4);
            let at = node.place.iter().fold([S::zero(); 3], |r, step| step.moment(S::one(), r));
            let [rx, ry, rz] = outer.step().vector_back(at);
            placing = [shift(Axis::X, rx), shift(Axis::Y, ry)];
            slide = slide + rz;
        }
        let (s, c) = quarter_turn(angle.sin_cos(), quarter);
        let turn = ElementaryTransform::Turn { axis: Axis::Z, c, s };
        let ([px, py], slide) = (placing, shift(Axis::Z, slide));
        let steps = &mut w.steps;
        match (turns, self.elimination(i).non_rotating) {
            (false, false) if !T::LISTENS && !node.slides => steps.set(i, &node.place, 0, [turn]),
            (false, false) => steps.set(i, &node.place, 0, [slide, turn]),
            (false, true) => steps.set(i, &node.place, 0, [slide]),
            (true, false) => steps.set(i, &[], 2, [px, py, slide, turn]),
            (true, true) => steps.set(i, &[], 2, [px, py, slide]),
        }
        if self.elimination(i).non_rotating {
            let RigidInertia { mass, moment, inertia } = node.inertia;
            let (moment, inertia) = (turn.vector_back(moment), turn.turn_symmetric(&inertia));
            let inertia = RigidInertia { mass, moment, inertia };
            w.body[i] = TurnedBody { angle, quarter, c, s, inertia };
        }
    }

    /// Coordinate rates from velocities, `q̇ = N(q) v`.
    pub fn coordinate_rates(&self, q: &[S], v: &[S], qd: &mut [S]) {
        for i in 0..self.tree.nodes.len() {
            self.coordinate_rate_node(i, q, v, qd);
        }
    }

    /// [`Sweeps::coordinate_rates`] for node `i` alone.
    #[inline(always)]
    fn coordinate_rate_node(&self, i: usize, q: &[S], v: &[S], qd: &mut [S]) {
        let node = &self.tree.nodes[i];
        let Source::State { q: at, v: vat } = node.source else { return };
        self.trace.at(Some(i), Quantity::Rate);
        if let Kind::Revolute | Kind::Prismatic | Kind::Helical { .. } = node.kind {
            qd[at] = v[vat];
            return;
        }
        let (q, v, qd) = (&q[at..], &v[vat..], &mut qd[at..]);
        match node.kind {
            Kind::Revolute | Kind::Prismatic | Kind::Helical { .. } => {}
            Kind::Planar => {
                let (s, c) = quarter_turn((q[2] + node.phase).sin_cos(), node.quarter);
                let out = ElementaryTransform::Turn { axis: Axis::Z, c, s }.vector_back([v[0], v[1], v[2]]);
                qd[..3].copy_from_slice(&out);
            }
            Kind::Spherical => {
                qd[..4].copy_from_slice(&quaternion_rate([q[0], q[1], q[2], q[3]], [v[0], v[1], v[2]]));
            }
            Kind::Floating => {
                let turn = [q[3], q[4], q[5], q[6]];
                let lin = ElementaryTransform::Rotate(quaternion_matrix(turn)).vector_back([v[0], v[1], v[2]]);
                qd[..3].copy_from_slice(&lin);
                qd[3..7].copy_from_slice(&quaternion_rate(turn, [v[3], v[4], v[5]]));
            }
        }
    }
}
