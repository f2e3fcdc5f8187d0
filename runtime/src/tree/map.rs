//! The same mechanism over other numbers.

use alloc::boxed::Box;

use super::{Bond, Closure, Constraint, Cut, Kind, Node, Passive, Tree, TreeFrame, TreeWrench};
#[cfg(feature = "height_fields")]
use crate::field::Ball;
use crate::spatial::{ElementaryTransform, RigidInertia};
use crate::Scalar;

impl<S: Scalar> Tree<S> {
    /// Every constant taken to another scalar by `of`, zeros and ones to zeros and ones.
    pub fn map<R: Scalar>(&self, of: &impl Fn(S) -> R) -> Tree<R> {
        Tree {
            nodes: self.nodes.iter().map(|node| node.map(of)).collect(),
            dims: self.dims,
            unknowns: self.unknowns.clone(),
            solve_at_ground: self.solve_at_ground.clone(),
            ground_moment: self.ground_moment.map(of),
            wrenches: self
                .wrenches
                .iter()
                .map(|w| TreeWrench { frame: w.frame.map(of), axes: w.axes, path: w.path.clone() })
                .collect(),
            constraints: self.constraints.iter().map(|c| c.map(of)).collect(),
            tolerance: of(self.tolerance),
            early_tolerance: self.early_tolerance,
            row_factors: self.row_factors.as_ref().map(|factors| factors.iter().map(|x| of(*x)).collect()),
            frames: self.frames.iter().map(|f| f.map(of)).collect(),
            joint_nodes: self.joint_nodes.clone(),
            matrix_depth: self.matrix_depth,
            accelerations: self.accelerations.as_ref().map(|tree| Box::new(tree.map(of))),
        }
    }
}

fn step<S: Scalar, R: Scalar>(step: &ElementaryTransform<S>, of: &impl Fn(S) -> R) -> ElementaryTransform<R> {
    match *step {
        ElementaryTransform::Turn { axis, c, s } => ElementaryTransform::Turn { axis, c: of(c), s: of(s) },
        ElementaryTransform::Shift { axis, r } => ElementaryTransform::Shift { axis, r: of(r) },
        ElementaryTransform::Rotate(m) => ElementaryTransform::Rotate(m.map(|row| row.map(of))),
    }
}

impl<S: Scalar> TreeFrame<S> {
    fn map<R: Scalar>(&self, of: &impl Fn(S) -> R) -> TreeFrame<R> {
        TreeFrame { node: self.node, place: self.place.iter().map(|s| step(s, of)).collect() }
    }
}

impl<S: Scalar> Node<S> {
    fn map<R: Scalar>(&self, of: &impl Fn(S) -> R) -> Node<R> {
        let inertia = &self.inertia;
        Node {
            parent: self.parent,
            place: self.place.iter().map(|s| step(s, of)).collect(),
            kind: self.kind.map(of),
            source: self.source,
            ratio: of(self.ratio),
            offset: of(self.offset),
            phase: of(self.phase),
            quarter: self.quarter,
            slide: of(self.slide),
            slides: self.slides,
            inertia: RigidInertia {
                mass: of(inertia.mass),
                moment: inertia.moment.map(of),
                inertia: inertia.inertia.map(of),
            },
            passive: self
                .passive
                .iter()
                .map(|p| Passive {
                    damping: of(p.damping),
                    stiffness: of(p.stiffness),
                    rest: of(p.rest),
                    armature: of(p.armature),
                })
                .collect(),
            elimination: self.elimination.clone(),
        }
    }
}

impl<S: Scalar> Constraint<S> {
    fn map<R: Scalar>(&self, of: &impl Fn(S) -> R) -> Constraint<R> {
        let bond = match &self.bond {
            Bond::Cut(cut) => Bond::Cut(Cut {
                grounded: cut.grounded,
                closure: cut.closure.map(of),
                a: cut.a.map(of),
                b: cut.b.map(of),
                path_a: cut.path_a.clone(),
                path_b: cut.path_b.clone(),
            }),
            Bond::Coupling { terms, offset } => {
                Bond::Coupling { terms: terms.iter().map(|(i, ratio)| (*i, of(*ratio))).collect(), offset: of(*offset) }
            }
        };
        Constraint {
            bond,
            slots: self.slots.clone(),
            passes: self.passes.clone(),
            first: self.first,
            entry: self.entry,
            velocities: self.velocities.clone(),
            decay: self.decay.map(of),
            compliance: self.compliance.map(of),
            own_axes: self.own_axes,
        }
    }
}

impl<S: Copy> Kind<S> {
    /// The same over other numbers.
    pub fn map<R>(self, mut of: impl FnMut(S) -> R) -> Kind<R> {
        match self {
            Kind::Revolute => Kind::Revolute,
            Kind::Prismatic => Kind::Prismatic,
            Kind::Helical { pitch } => Kind::Helical { pitch: of(pitch) },
            Kind::Planar => Kind::Planar,
            Kind::Spherical => Kind::Spherical,
            Kind::Floating => Kind::Floating,
        }
    }
}

impl<S: Copy> Closure<S> {
    /// The same over other numbers.
    pub fn map<R>(self, mut of: impl FnMut(S) -> R) -> Closure<R> {
        match self {
            Closure::Revolute => Closure::Revolute,
            Closure::Prismatic => Closure::Prismatic,
            Closure::Cylindrical => Closure::Cylindrical,
            Closure::Helical { pitch } => Closure::Helical { pitch: of(pitch) },
            Closure::Universal => Closure::Universal,
            Closure::Planar => Closure::Planar,
            Closure::Spherical => Closure::Spherical,
            Closure::Fixed => Closure::Fixed,
            Closure::Distance { length } => Closure::Distance { length: of(length) },
            Closure::PointOnLine => Closure::PointOnLine,
            Closure::PointOnPlane => Closure::PointOnPlane,
            Closure::PointOnCylinder { radius } => Closure::PointOnCylinder { radius: of(radius) },
            Closure::RollingDisc { radius } => Closure::RollingDisc { radius: of(radius) },
            Closure::RollingBall { radius } => Closure::RollingBall { radius: of(radius) },
            Closure::RollingEllipsoid { semi_axes } => Closure::RollingEllipsoid { semi_axes: semi_axes.map(of) },
            Closure::RollingBalls { radii } => Closure::RollingBalls { radii: radii.map(of) },
            Closure::RollingCapsules { lengths, radii } => {
                Closure::RollingCapsules { lengths: lengths.map(&mut of), radii: radii.map(of) }
            }
            Closure::RollingBallOnBox { size, rounding, radius } => {
                Closure::RollingBallOnBox { size: size.map(&mut of), rounding: of(rounding), radius: of(radius) }
            }
            #[cfg(feature = "hulls")]
            Closure::RollingBallOnHull { hull, rounding, radius } => {
                Closure::RollingBallOnHull { hull, rounding: of(rounding), radius: of(radius) }
            }
            #[cfg(feature = "hulls")]
            Closure::RollingCapsuleOnCylinder { lengths, radii } => {
                Closure::RollingCapsuleOnCylinder { lengths: lengths.map(&mut of), radii: radii.map(of) }
            }
            Closure::RollingBallOnCylinder { length, radii } => {
                Closure::RollingBallOnCylinder { length: of(length), radii: radii.map(of) }
            }
            #[cfg(feature = "height_fields")]
            Closure::RollingBallOnField { field, ball } => Closure::RollingBallOnField {
                field,
                ball: ball.map(|Ball { radius, steps }| Ball { radius: of(radius), steps }),
            },
            Closure::KnifeEdge => Closure::KnifeEdge,
            Closure::Pfaffian { row } => Closure::Pfaffian { row: row.map(of) },
        }
    }
}
