//! How fast velocities can close the gaps of contacts.
//!
//! The distance of two bodies changes by the velocities of the two points that are nearest, along the line between them:
//! those of the joints between both bodies, each of which moves what is outboard of it. A rotation moves a point by its
//! angular velocity times the distance of the point from a point of the axis at most, here from the origin of the node.
//! Either of the nearest points may be taken for that, because what lies between them is along the line and turns across it.
//! Gaps above a height field are not distances: there, what the velocities can do to the distance is made larger as much as
//! the gap may be.

use alloc::vec;
use alloc::vec::Vec;

use super::{Contact, Reach};
use crate::spatial::ElementaryTransform;
use crate::system::Real;
use crate::tree::{Bond, Closure, Cut, Freedom, Kind, Node, Source, Tree, TreeFrame};

/// Distance of a frame's origin from that of the frame in front of the steps, m.
fn offset<S: Real>(steps: &[ElementaryTransform<S>]) -> f64 {
    let at = steps.iter().rev().fold([S::zero(); 3], |r, step| step.moment(S::one(), r));
    length(at)
}

fn length<S: Real, const N: usize>(x: [S; N]) -> f64 {
    libm::sqrt(x.iter().fold(0.0, |sum, x| sum + x.to_f64() * x.to_f64()))
}

/// Largest distances of points of the surfaces that a contact is between from the origins of their frames, m; `None` for
/// a plane or a height field, which have no end. `None` in place of both for constraints that are no contacts.
fn radii<S: Real>(closure: &Closure<S>) -> Option<(Option<f64>, f64)> {
    Some(match closure {
        Closure::RollingDisc { radius } | Closure::RollingBall { radius } => (None, radius.abs().to_f64()),
        Closure::RollingEllipsoid { semi_axes } => {
            (None, semi_axes.iter().fold(0.0, |most, x| if x.abs().to_f64() <= most { most } else { x.abs().to_f64() }))
        }
        Closure::RollingBalls { radii: [a, b] } => (Some(a.abs().to_f64()), b.abs().to_f64()),
        Closure::RollingCapsules { lengths, radii } => {
            let [a, b] = [0, 1].map(|k: usize| 0.5 * lengths[k].abs().to_f64() + radii[k].abs().to_f64());
            (Some(a), b)
        }
        Closure::RollingBallOnBox { size, rounding, radius } => {
            (Some(0.5 * length(*size) + rounding.abs().to_f64()), radius.abs().to_f64())
        }
        #[cfg(feature = "hulls")]
        Closure::RollingBallOnHull { hull, rounding, radius } => {
            (Some(hull.radius + rounding.abs().to_f64()), radius.abs().to_f64())
        }
        #[cfg(feature = "hulls")]
        Closure::RollingCapsuleOnCylinder { lengths: [l, m], radii: [a, b] } => {
            (Some(length([S::constant(0.5) * *l, *a])), 0.5 * m.abs().to_f64() + b.abs().to_f64())
        }
        Closure::RollingBallOnCylinder { length: l, radii: [a, b] } => {
            (Some(length([S::constant(0.5) * *l, *a])), b.abs().to_f64())
        }
        #[cfg(feature = "height_fields")]
        Closure::RollingBallOnField { ball, .. } => (None, ball.map_or(0.0, |ball| ball.radius.abs().to_f64())),
        _ => return None,
    })
}

/// Translation and angle of a freedom per unit of its coordinate.
fn parts<S: Real>(freedom: Freedom<S>) -> [f64; 2] {
    match freedom {
        Freedom::Unit(0..=2) => [1.0, 0.0],
        Freedom::Unit(_) => [0.0, 1.0],
        Freedom::Screw(pitch) => [pitch.abs().to_f64(), 1.0],
    }
}

impl<S: Real> Node<S> {
    fn freedoms(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let ratio = self.ratio.abs().to_f64();
        (0..self.kind.nv()).map(move |k| parts(self.kind.axis(k)).map(|x| ratio * x))
    }

    fn turns(&self) -> bool {
        !matches!(self.kind, Kind::Prismatic)
    }

    /// Distance of the node's origin from that of its parent, m, where its coordinates are zero: at most.
    fn arm(&self) -> f64 {
        let along = match self.kind.axis(0) {
            Freedom::Unit(0..=2) => 1.0,
            Freedom::Unit(_) => 0.0,
            Freedom::Screw(pitch) => pitch.abs().to_f64(),
        };
        let shifted = if self.kind.nv() == 1 { along * self.offset.abs().to_f64() } else { 0.0 };
        offset(&self.place) + self.slide.abs().to_f64() + shifted
    }
}

impl<S: Real> Tree<S> {
    /// How fast velocities can close the gaps of contacts, contact by contact: the velocities that can.
    pub fn reaches(&self, contacts: &[Contact<S>]) -> Vec<Reach<S>> {
        let mut all = Vec::new();
        for (k, contact) in contacts.iter().enumerate() {
            let mut table = vec![[0.0; 3]; self.dims.nv];
            match self.constraints.iter().find(|c| c.first == contact.row).map(|c| &c.bond) {
                Some(Bond::Cut(cut)) => self.reach_of_cut(cut, &mut table),
                Some(Bond::Coupling { terms, .. }) => {
                    for (i, ratio) in terms {
                        let node = &self.nodes[*i];
                        match node.source {
                            Source::State { v, .. } => {
                                let own = node.ratio.abs().to_f64();
                                table[v][0] += ratio.abs().to_f64() * if own <= 1.0 { 1.0 } else { own };
                            }
                            Source::Drive { .. } => unbounded(&mut table),
                        }
                    }
                }
                None => unbounded(&mut table),
            }
            let moves = table.into_iter().enumerate().filter(|(_, x)| *x != [0.0; 3]);
            all.extend(moves.map(|(velocity, x)| {
                let [rate, turn, slide] = x.map(S::constant);
                Reach { contact: k, velocity, rate, turn, slide }
            }));
        }
        all
    }

    /// The tree of each velocity, of those that stand on the ground beside each other, which loops and couplings may
    /// join; empty where one coordinate moves joints of several trees.
    pub fn trees(&self) -> Vec<usize> {
        let (mut root, mut trees) = (Vec::new(), vec![usize::MAX; self.dims.nv]);
        for (i, node) in self.nodes.iter().enumerate() {
            let own = node.parent.map_or(i, |parent| root[parent]);
            root.push(own);
            if let Source::State { v, .. } = node.source {
                for tree in &mut trees[v..v + node.kind.nv()] {
                    if *tree != usize::MAX && *tree != own {
                        return Vec::new();
                    }
                    *tree = own;
                }
            }
        }
        trees
    }

    fn reach_of_cut(&self, cut: &Cut<S>, table: &mut [[f64; 3]]) {
        let Some((first, second)) = radii(&cut.closure) else { return unbounded(table) };
        let to_surface = |frame: &TreeFrame<S>, radius: f64| offset(&frame.place) + radius;
        let far = self.reach_of_path(&cut.path_b, to_surface(&cut.b, second), table);
        match first {
            Some(radius) => {
                self.reach_of_path(&cut.path_a, to_surface(&cut.a, radius), table);
                self.slides(&cut.path_a, false, table);
                self.slides(&cut.path_b, false, table);
            }
            None => {
                // The point is on the other body: from a joint of the plane's, inward to where both paths begin and out
                // along the other one.
                let inward = cut.path_a.iter().map(|&i| self.nodes[i].arm()).sum::<f64>();
                self.reach_of_path(&cut.path_a, far + inward, table);
                let turns = cut.path_a.iter().any(|&i| self.nodes[i].turns());
                self.slides(&cut.path_a, turns, table);
                self.slides(&cut.path_b, turns, table);
            }
        }
        #[cfg(feature = "height_fields")]
        if let Closure::RollingBallOnField { field, .. } = cut.closure {
            // The gap is at most the way down to the ground, which is nearer than that by the cosine of the steepest slope.
            let steep = libm::sqrt(1.0 + field.slope * field.slope);
            table.iter_mut().for_each(|[rate, turn, _]| (*rate, *turn) = (steep * *rate, steep * *turn));
        }
    }

    /// Adds what the joints of a path do to a point whose distance from the last of them is `arm`, m. Gives the distance of
    /// the point from where the path begins.
    fn reach_of_path(&self, path: &[usize], mut arm: f64, table: &mut [[f64; 3]]) -> f64 {
        for &i in path.iter().rev() {
            let node = &self.nodes[i];
            match node.source {
                Source::State { v, .. } => {
                    for (entry, [shift, angle]) in table[v..].iter_mut().zip(node.freedoms()) {
                        entry[0] += shift + angle * arm;
                        entry[1] += angle;
                    }
                }
                Source::Drive { .. } => unbounded(table),
            }
            arm += node.arm();
        }
        arm
    }

    /// Notes the translations of a path that lengthen the arm of a rotation inboard of them, or of one elsewhere that has
    /// `turned` all of it.
    fn slides(&self, path: &[usize], mut turned: bool, table: &mut [[f64; 3]]) {
        for &i in path {
            let node = &self.nodes[i];
            if let (true, Source::State { v, .. }) = (turned, node.source) {
                for (entry, [shift, _]) in table[v..].iter_mut().zip(node.freedoms()) {
                    entry[2] += shift;
                }
            }
            turned |= node.turns();
        }
    }
}

/// Of a contact whose bodies move by more than the velocities say.
fn unbounded(table: &mut [[f64; 3]]) {
    table.iter_mut().for_each(|entry| entry[0] = f64::INFINITY);
}
