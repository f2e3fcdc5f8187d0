//! The mechanism in the form on which the sweeps run: a tree of nodes whose constants are scalars of any type.
//!
//! A node is one joint and the rigid body that it carries. Joints whose motion consists of independent rotations and
//! translations (universal, cylindrical) are two nodes with a massless body between them. All other joints have a
//! constant motion subspace `E` in the node frame; rotations are about, and translations along, its z axis.

mod elimination;
mod implicit;
mod map;
pub mod row_order;
mod unrolled;

use alloc::vec::Vec;

#[cfg(feature = "height_fields")]
use crate::field::{Ball, Field};
#[cfg(feature = "hulls")]
use crate::hull::Polyhedron;
use crate::spatial::{ElementaryTransform, Force, Motion, RigidInertia, Vec3};
use crate::Scalar;

pub use elimination::Elimination;
pub(crate) use unrolled::{each_freedom, for_component};

/// The motion of a node's joint, in the node frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind<S> {
    /// Rotation about z.
    Revolute,
    /// Translation along z.
    Prismatic,
    /// Rotation about z with a translation of `pitch` m per radian.
    Helical {
        /// Metres per radian.
        pitch: S,
    },
    /// Translations along x and y of the parent's axes, then a rotation about z; velocities in the axes of the node.
    Planar,
    /// Any rotation, by a unit quaternion; velocities in the axes of the node.
    Spherical,
    /// A position and a unit quaternion; velocities in the axes of the node.
    Floating,
}

impl<S: Copy> Kind<S> {
    /// Number of coordinates of the node.
    pub fn nq(&self) -> usize {
        match self {
            Kind::Revolute | Kind::Prismatic | Kind::Helical { .. } => 1,
            Kind::Planar => 3,
            Kind::Spherical => 4,
            Kind::Floating => 7,
        }
    }

    /// Number of degrees of freedom.
    pub fn nv(&self) -> usize {
        match self {
            Kind::Spherical => 3,
            Kind::Floating => 6,
            other => other.nq(),
        }
    }

    /// Column `k` of the joint matrix `E`.
    #[inline]
    pub fn axis(&self, k: usize) -> Freedom<S> {
        match self {
            Kind::Revolute => Freedom::Unit(5),
            Kind::Prismatic => Freedom::Unit(2),
            Kind::Helical { pitch } => Freedom::Screw(*pitch),
            Kind::Planar => Freedom::Unit([0, 1, 5][k]),
            Kind::Spherical => Freedom::Unit(3 + k),
            Kind::Floating => Freedom::Unit(k),
        }
    }

    /// Number of coordinates on which a linear spring can act.
    pub fn springs(&self) -> usize {
        match self {
            Kind::Spherical | Kind::Floating => 0,
            other => other.nq(),
        }
    }
}

/// One column of `E`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Freedom<S> {
    /// Unit vector `k`: 0–2 linear, 3–5 angular.
    Unit(usize),
    /// `[pitch z; z]`.
    Screw(S),
}

impl<S: Scalar> Freedom<S> {
    /// `E · F`.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    pub fn dot(&self, f: &Force<S>) -> S {
        match self {
            Freedom::Unit(k) => for_component!(*k, |k| f.get(k)),
            Freedom::Screw(h) => f.ang[2] + *h * f.lin[2],
        }
    }

    /// `E · Ω`, for products that are linear in a row.
    pub fn motion(&self, rate: S) -> Motion<S> {
        let mut m = Motion::zero();
        match self {
            Freedom::Unit(k) => *m.get_mut(*k) = rate,
            Freedom::Screw(h) => {
                m.ang[2] = rate;
                m.lin[2] = *h * rate;
            }
        }
        m
    }

    /// Adds `E rate` to a motion.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    pub fn add_to(&self, m: &mut Motion<S>, rate: S) {
        match self {
            Freedom::Unit(k) => for_component!(*k, |k| *m.get_mut(k) = m.get(k) + rate),
            Freedom::Screw(h) => {
                m.ang[2] = m.ang[2] + rate;
                m.lin[2] = m.lin[2] + *h * rate;
            }
        }
    }
}

/// Source of a node's coordinates and velocities, with the indices of the first ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Coordinates and velocities of the state.
    State {
        /// Into `q`.
        q: usize,
        /// Into `v`, `p`, `τ`.
        v: usize,
    },
    /// Prescribed positions, rates and accelerations (a rheonomic drive).
    Drive {
        /// Into the positions.
        q: usize,
        /// Into the rates and accelerations.
        v: usize,
    },
}

/// Passive elements of one degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passive<S> {
    /// Viscous damping, N m s/rad or N s/m.
    pub damping: S,
    /// Spring stiffness, N m/rad or N/m.
    pub stiffness: S,
    /// Rest position of the spring.
    pub rest: S,
    /// Reflected rotor inertia, kg m² or kg.
    pub armature: S,
}

/// A joint and the rigid body that it carries.
#[derive(Clone, Debug)]
pub struct Node<S> {
    /// Parent node, `None` for the ground. Parents come before children.
    pub parent: Option<usize>,
    /// Constant transforms from the parent frame to the joint.
    pub place: Vec<ElementaryTransform<S>>,
    /// Joint.
    pub kind: Kind<S>,
    /// Coordinates.
    pub source: Source,
    /// `coordinate = ratio · source + offset`, for nodes with one degree of freedom only.
    pub ratio: S,
    /// Constant added to the coordinate of the source (a mimic's offset).
    pub offset: S,
    /// Constant rotation, rad, from the coordinate to the angle of the node frame.
    pub phase: S,
    /// Additional rotation by this number of right angles, exact.
    pub quarter: u8,
    /// Constant displacement along the joint axis, m.
    pub slide: S,
    /// Whether there is such a displacement. Where it is zero by structure, numbers are run without it.
    pub slides: bool,
    /// Inertia of the bodies that move with the node, in its frame.
    pub inertia: RigidInertia<S>,
    /// Passive elements, one entry for each degree of freedom.
    pub passive: Vec<Passive<S>>,
    /// Elimination of its degrees of freedom.
    pub elimination: Elimination,
}

/// A frame of interest, constant on a node or on the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeFrame<S> {
    /// Node, `None` for the ground.
    pub node: Option<usize>,
    /// Steps from the node frame.
    pub place: Vec<ElementaryTransform<S>>,
}

/// Axes of an external wrench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrenchAxes {
    /// Those of the frame it acts at.
    Frame,
    /// Those of the ground.
    Ground,
}

/// An external wrench that is given with every call, acting at the origin of a frame.
#[derive(Clone, Debug)]
pub struct TreeWrench<S> {
    /// Where it acts.
    pub frame: TreeFrame<S>,
    /// Axes of its components.
    pub axes: WrenchAxes,
    /// Nodes from the root to the one it acts on.
    pub path: Vec<usize>,
}

/// The unknown of a column that is carried past its own joint in the sweep from tip to base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// A coordinate, by its velocity index: shared by several joints, or solved at another node.
    Velocity(usize),
    /// The multiplier of a constraint, by its row.
    Row(usize),
}

impl Unknown {
    /// The velocity index of a coordinate.
    pub fn velocity(self) -> Option<usize> {
        match self {
            Unknown::Velocity(v) => Some(v),
            Unknown::Row(_) => None,
        }
    }
}

/// Kinds of constraints between two frames on bodies. `x`, `y`, `z` are axes of the first or the second frame; rows are
/// components in the axes and at the origin of the second frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Closure<S> {
    /// Allows a rotation about z.
    Revolute,
    /// Allows a translation along z.
    Prismatic,
    /// Allows both.
    Cylindrical,
    /// Allows a screw motion about z.
    Helical {
        /// Metres per radian.
        pitch: S,
    },
    /// Allows rotations about x of the first and y of the second frame.
    Universal,
    /// Allows translations along x and y and a rotation about z.
    Planar,
    /// Allows all rotations.
    Spherical,
    /// Allows no motion.
    Fixed,
    /// Keeps the origins at a distance.
    Distance {
        /// Length, m.
        length: S,
    },
    /// Keeps the second origin on z of the first frame.
    PointOnLine,
    /// Keeps the second origin in the plane across z of the first frame.
    PointOnPlane,
    /// Keeps the second origin on a cylinder about z of the first frame.
    PointOnCylinder {
        /// Radius, m.
        radius: S,
    },
    /// A thin disc across z of the second frame, about its origin, rolls on the plane across z of the first.
    RollingDisc {
        /// Radius, m.
        radius: S,
    },
    /// A ball about the second origin rolls on the plane across z of the first frame.
    RollingBall {
        /// Radius, m.
        radius: S,
    },
    /// An ellipsoid about the second origin, with its axes along those of the second frame, rolls on the plane across z of
    /// the first.
    RollingEllipsoid {
        /// Semi-axes along x, y and z, m.
        semi_axes: [S; 3],
    },
    /// A ball about the second origin rolls on a ball about the first.
    RollingBalls {
        /// Radii of the first and the second, m.
        radii: [S; 2],
    },
    /// A capsule about z of the second frame, with its middle at the origin, rolls on one about z of the first. Where a
    /// length is zero, it is a ball.
    RollingCapsules {
        /// Lengths of the straight parts of the first and the second, m.
        lengths: [S; 2],
        /// Radii of the first and the second, m.
        radii: [S; 2],
    },
    /// A ball about the second origin rolls on a box about the first, with its edges along the axes, or on what lies within
    /// some distance of the box.
    RollingBallOnBox {
        /// Lengths of the edges of the box, m.
        size: [S; 3],
        /// That distance, m: the radius of rounded edges and corners.
        rounding: S,
        /// Radius of the ball, m.
        radius: S,
    },
    /// A ball about the second origin rolls on a convex polyhedron in the axes of the first frame, or on what lies within
    /// some distance of it.
    #[cfg(feature = "hulls")]
    RollingBallOnHull {
        /// The polyhedron.
        hull: &'static Polyhedron,
        /// That distance, m: the radius of rounded edges and corners.
        rounding: S,
        /// Radius of the ball, m.
        radius: S,
    },
    /// A capsule about z of the second frame, with its middle at the origin, rolls on a cylinder about z of the first. Where
    /// its length is zero, it is a ball.
    #[cfg(feature = "hulls")]
    RollingCapsuleOnCylinder {
        /// Lengths of the cylinder and of the straight part of the capsule, m.
        lengths: [S; 2],
        /// Radii of the cylinder and the capsule, m.
        radii: [S; 2],
    },
    /// A ball about the second origin rolls on a cylinder about z of the first frame, with its middle at the origin.
    RollingBallOnCylinder {
        /// Length of the cylinder, m.
        length: S,
        /// Radii of the cylinder and the ball, m.
        radii: [S; 2],
    },
    /// A ball about the second origin, or that point, rolls on a height field in the axes of the first frame.
    #[cfg(feature = "height_fields")]
    RollingBallOnField {
        /// The field.
        field: &'static Field,
        /// The ball; none for a point.
        ball: Option<Ball<S>>,
    },
    /// No velocity of the second origin along z of the second frame.
    KnifeEdge,
    /// One linear condition on the relative motion.
    Pfaffian {
        /// Coefficients of linear and angular velocity.
        row: [S; 6],
    },
}

/// A constraint between two frames on bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut<S> {
    /// What it holds together: points, axes, frames, or surfaces that touch.
    pub closure: Closure<S>,
    /// First frame, `A`.
    pub a: TreeFrame<S>,
    /// Second frame, `B`.
    pub b: TreeFrame<S>,
    /// Nodes from the innermost common one, which is left out, to that of the first frame.
    pub path_a: Vec<usize>,
    /// The same for the second frame.
    pub path_b: Vec<usize>,
    /// Whether it binds a node to the ground.
    pub grounded: bool,
}

/// The two frames or the joints that a constraint connects.
#[derive(Clone, Debug, PartialEq)]
pub enum Bond<S> {
    /// Two frames.
    Cut(Cut<S>),
    /// Freedoms of single-freedom nodes: `Σ ratio q = offset`.
    Coupling {
        /// Node and ratio.
        terms: Vec<(usize, S)>,
        /// Offset, rad or m.
        offset: S,
    },
}

/// Parts of its diagonal entry that a row must have left in the passes of an elimination in passes. After them comes a
/// last pass with the [tolerance](Tree::tolerance) of all eliminations. So a row is eliminated before another one only
/// if it has a thirtieth of what the other has, at least.
pub const PASSES: [f64; 4] = [1e-1, 3e-3, 1e-4, 3e-6];

/// Rows of `Φ v = b` that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraint<S> {
    /// The frames or joints that it connects.
    pub bond: Bond<S>,
    /// Its place among [`Tree::unknowns`], one for each row.
    pub slots: Vec<usize>,
    /// Further places of its rows, as many as `slots` for each of the [passes](PASSES) before the last, where rows are
    /// eliminated in passes; none elsewhere. A pass leaves out rows of which too little is left, and the next ones take
    /// them: so the order of the rows need not be known in advance ([`row_order`]).
    pub passes: Vec<Vec<usize>>,
    /// Its first row among all.
    pub first: usize,
    /// The first entry of its rows among all entries of `Φ`.
    pub entry: usize,
    /// Velocities that it binds, in ascending order.
    pub velocities: Vec<usize>,
    /// Rate at which position errors decay (Baumgarte), 1/s.
    pub decay: Option<S>,
    /// Compliance `μ` of the rows in `Φ v = b + μ σ`: the penalty method with the weight `1/μ`, in place of exact
    /// constraints.
    pub compliance: Option<S>,
    /// Whether its rows, the three of a ball that rolls on a plane and has no slip, are taken along the axes of the second
    /// frame. They bind the same, with fewer operations, but multipliers are along these axes, too.
    pub own_axes: bool,
}

/// A mechanism. `S` is the scalar of its constants and of everything computed from them.
#[derive(Clone, Debug)]
pub struct Tree<S> {
    /// Nodes, parents first.
    pub nodes: Vec<Node<S>>,
    /// Number of coordinates, velocities, prescribed positions, prescribed rates.
    pub dims: Dims,
    /// Coordinates shared by several nodes, and multipliers of constraints.
    pub unknowns: Vec<Unknown>,
    /// Those of them whose members meet only at the ground.
    pub solve_at_ground: Vec<usize>,
    /// First moment of bodies that regrouping has moved to the ground, kg m.
    pub ground_moment: Vec3<S>,
    /// External wrenches.
    pub wrenches: Vec<TreeWrench<S>>,
    /// Loops and couplings.
    pub constraints: Vec<Constraint<S>>,
    /// Fraction of a row's diagonal entry of `Φ M⁻¹Φᵀ`; a row of which less remains counts as redundant.
    pub tolerance: S,
    /// The same of early rows ([`row_order::early_rows`]) and the sum of the diagonals of their constraint, where another
    /// elimination serves when one of them is left out; without it they are left out next to rounding errors only.
    pub early_tolerance: Option<f64>,
    /// One factor for each row of the constraints, where rows act or not by numbers: 1 for a row that acts, 0 for one
    /// that does not. All act where there are none. Rows that do not act have no multipliers, and no pivots; a
    /// constraint whose first row does not act has no residuals and entries either.
    pub row_factors: Option<Vec<S>>,
    /// Frames of interest: first that of every joint's child body, in joint order, then the others.
    pub frames: Vec<TreeFrame<S>>,
    /// Joint of each leading frame: node whose transmitted wrench is the joint's reaction.
    pub joint_nodes: Vec<usize>,
    /// Nodes with fewer ancestors than this are the inner ones of the mass matrix: their screws are carried outward.
    pub matrix_depth: usize,
    /// The same mechanism with another elimination, where that one needs fewer operations for accelerations.
    pub accelerations: Option<alloc::boxed::Box<Tree<S>>>,
}

/// Number of inertial parameters of a body.
pub const INERTIAL_PARAMETERS: usize = 10;

/// Dimensions of a mechanism.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Dims {
    /// Coordinates.
    pub nq: usize,
    /// Velocities, momenta, joint forces.
    pub nv: usize,
    /// Prescribed positions.
    pub drive_q: usize,
    /// Prescribed rates and accelerations.
    pub drive_v: usize,
    /// External wrenches.
    pub wrenches: usize,
    /// Rows of constraints.
    pub rows: usize,
}

impl<S> Tree<S> {
    /// Places of the rows that do not act, as closed columns: constraints none of whose rows act are removed. Rows keep
    /// their numbers, and have no residuals, entries and multipliers.
    ///
    /// `acts` has one entry for each row. With every choice of rows the sweeps eliminate those that act in the same
    /// order.
    #[must_use]
    pub fn acting(mut self, acts: &[bool]) -> Tree<S> {
        let rows = |c: &Constraint<S>| c.first..c.first + c.slots.len();
        let silent = |g: usize| matches!(self.unknowns[g], Unknown::Row(r) if !acts[r]);
        for node in &mut self.nodes {
            node.elimination.retain_columns(|g| !silent(g));
        }
        self.solve_at_ground.retain(|&g| !silent(g));
        self.constraints.retain(|c| acts[rows(c)].contains(&true));
        // Only shapes with many corners are worth the code.
        #[cfg(feature = "hulls")]
        self.retain_unknowns();
        self.accelerations = self.accelerations.map(|tree| alloc::boxed::Box::new(tree.acting(acts)));
        self
    }

    /// Leaves out the unknowns of constraints that were removed: sweeps do work for each, and their memory grows with the
    /// square of the number.
    #[cfg(feature = "hulls")]
    fn retain_unknowns(&mut self) {
        let mut kept = alloc::vec![false; self.unknowns.len()];
        let slots = self.constraints.iter().flat_map(|c| c.passes.iter().chain([&c.slots]).flatten());
        slots.for_each(|&g| kept[g] = true);
        let stays = |(kept, unknown): (&bool, &Unknown)| *kept || matches!(unknown, Unknown::Velocity(_));
        let mut free = 0..;
        let numbers: Vec<Option<usize>> =
            kept.iter().zip(&self.unknowns).map(|of| if stays(of) { free.next() } else { None }).collect();
        let mut each = numbers.iter();
        self.unknowns.retain(|_| each.next().is_some_and(Option::is_some));
        // Columns of the others are closed: what is left has a number.
        let renumber = |g: &mut usize| *g = numbers[*g].unwrap_or(*g);
        self.nodes.iter_mut().flat_map(|node| node.elimination.unknowns_mut()).for_each(renumber);
        self.solve_at_ground.iter_mut().for_each(renumber);
        let slots = self.constraints.iter_mut().flat_map(|c| c.passes.iter_mut().chain([&mut c.slots]).flatten());
        slots.for_each(renumber);
    }

    /// The same mechanism in which [rows act by numbers](Tree::row_factors): one factor for each row.
    #[must_use]
    pub fn with_row_factors(mut self, factors: Vec<S>) -> Tree<S>
    where
        S: Clone,
    {
        self.accelerations =
            self.accelerations.map(|tree| alloc::boxed::Box::new(tree.with_row_factors(factors.clone())));
        self.row_factors = Some(factors);
        self
    }

    /// Whether number `g` of [`Tree::unknowns`] is a row of one of the constraints.
    pub fn is_slot(&self, g: usize) -> bool {
        self.constraints.iter().any(|c| c.slots.contains(&g) || c.passes.iter().flatten().any(|h| *h == g))
    }
}

impl<S: Scalar> Tree<S> {
    /// The same mechanism with penalties in place of multipliers: momenta `σ = α (Φ v + ω φ)` with the weight `α` in kg
    /// (for rotations kg m²) and `ω` in 1/s. That is Bayo's method on the level of velocities, without the integral of
    /// the positions' errors (Bayo and others 1988; C.7 of the thesis). Rows hold to `σ/α` only, and none is ever
    /// redundant.
    pub fn penalised(&self, weight: S, rate: S) -> Tree<S> {
        let mut tree = self.clone();
        let other = tree.accelerations.as_deref_mut();
        let all = tree.constraints.iter_mut().chain(other.into_iter().flat_map(|tree| &mut tree.constraints));
        for constraint in all {
            (constraint.compliance, constraint.decay) = (Some(S::one() / weight), Some(rate));
        }
        tree
    }

    /// Number of columns of the regressor: ten inertial parameters of every moving joint's child body, with what is
    /// fixed to it, a damping and a dry friction of every velocity.
    pub fn regressor_columns(&self) -> usize {
        self.joint_nodes.len() * INERTIAL_PARAMETERS + 2 * self.dims.nv
    }

    /// The dynamic parameters `π` of the [regressor](crate::sweep::Sweeps::regressor), of a tree that was not
    /// regrouped: for every moving joint, in joint order, [`RigidInertia::parameters`] of its child body with what is
    /// fixed to it, at the child's frame; the damping of every velocity, N m s or N s/m; the dry friction of every
    /// velocity, N m or N, which is zero in a model.
    pub fn dynamic_parameters(&self) -> Vec<S> {
        let mut damping = alloc::vec![S::zero(); 2 * self.dims.nv];
        for node in &self.nodes {
            let Source::State { v, .. } = node.source else { continue };
            for (entry, passive) in damping[v..].iter_mut().zip(&node.passive) {
                *entry = *entry + node.ratio * node.ratio * passive.damping;
            }
        }
        let inertial = self.frames.iter().take(self.joint_nodes.len()).flat_map(|frame| {
            let at_node = frame.node.map_or(RigidInertia::zero(), |i| self.nodes[i].inertia).articulated();
            let m = frame.place.iter().fold(at_node, |m, step| step.inverse().inertia(&m));
            RigidInertia::from_articulated(&m).parameters()
        });
        inertial.chain(damping).collect()
    }

    /// Whether node `i` is less than [`Tree::matrix_depth`] nodes away from the ground.
    pub fn inner(&self, i: usize) -> bool {
        let up = core::iter::successors(self.nodes[i].parent, |&i| self.nodes[i].parent);
        up.take(self.matrix_depth).count() < self.matrix_depth
    }

    /// The tree for [`crate::sweep::Sweeps::accelerations`].
    pub fn for_accelerations(&self) -> &Tree<S> {
        self.accelerations.as_deref().unwrap_or(self)
    }

    /// Whether the tree has no shared coordinates, no constraints and no external wrenches, and eliminates every freedom at
    /// its own node, in its own frame. Many trees are so, and the sweeps are compiled apart for them.
    pub fn is_plain(&self) -> bool {
        let nothing_else = self.unknowns.is_empty() && self.constraints.is_empty() && self.wrenches.is_empty();
        nothing_else && self.nodes.iter().all(|node| node.elimination == Elimination::PLAIN)
    }

    /// The same mechanism with fewer non-zero inertial parameters. Inertia of a body that has the same effect as
    /// inertia of its parent is moved to the parent, from the tips to the base (Khalil and Kleinfinger's base
    /// parameters). Through a revolute joint this is all inertia that is symmetric about its axis, `{m, m c_z, (J_yy,
    /// J_yy, 0)}`, through a prismatic joint the rotational inertia, through a spherical joint the mass. Motion,
    /// momenta and energies are unchanged; wrenches inside the joints are not, so reactions must come from the
    /// original.
    pub fn regrouped(&self) -> Tree<S> {
        let mut tree = self.clone();
        if let Some(other) = &mut tree.accelerations {
            **other = other.regrouped();
        }
        for i in (0..tree.nodes.len()).rev() {
            let moved = match tree.nodes[i].kind {
                Kind::Revolute => regroup_pin(&mut tree.nodes[i].inertia),
                Kind::Prismatic => {
                    let mut moved = RigidInertia::zero();
                    core::mem::swap(&mut moved.inertia, &mut tree.nodes[i].inertia.inertia);
                    moved
                }
                Kind::Spherical => {
                    let mut moved = RigidInertia::zero();
                    core::mem::swap(&mut moved.mass, &mut tree.nodes[i].inertia.mass);
                    moved
                }
                Kind::Helical { .. } | Kind::Planar | Kind::Floating => continue,
            };
            // The inertia is invariant under the joint's own motion, so that only the constant transforms count. The
            // displacement along the axis of a revolute joint shifts it.
            let z = crate::spatial::Axis::Z;
            let mut m = moved.articulated();
            match tree.nodes[i].kind {
                Kind::Revolute => m = ElementaryTransform::Shift { axis: z, r: tree.nodes[i].slide }.inertia(&m),
                Kind::Prismatic => m = phase_step(&tree.nodes[i]).inertia(&m),
                _ => {}
            }
            for step in tree.nodes[i].place.iter().rev() {
                m = step.inertia(&m);
            }
            let at_parent = RigidInertia::from_articulated(&m);
            match tree.nodes[i].parent {
                Some(p) => tree.nodes[p].inertia = tree.nodes[p].inertia.plus(&at_parent),
                None => tree.ground_moment = crate::spatial::add3(tree.ground_moment, at_parent.moment),
            }
        }
        tree
    }
}

/// The constant rotation of a prismatic joint about its axis.
fn phase_step<S: Scalar>(node: &Node<S>) -> ElementaryTransform<S> {
    let (s, c) = quarter_turn(node.phase.sin_cos(), node.quarter);
    ElementaryTransform::Turn { axis: crate::spatial::Axis::Z, c, s }
}

/// Sine and cosine after `quarter` more right angles, exact.
pub(crate) fn quarter_turn<S: Scalar>((s, c): (S, S), quarter: u8) -> (S, S) {
    match quarter % 4 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

fn regroup_pin<S: Scalar>(body: &mut RigidInertia<S>) -> RigidInertia<S> {
    let o = S::zero();
    let mut moved = RigidInertia::zero();
    core::mem::swap(&mut moved.mass, &mut body.mass);
    core::mem::swap(&mut moved.moment[2], &mut body.moment[2]);
    let yy = body.inertia[3];
    moved.inertia = [yy, o, o, yy, o, o];
    body.inertia[0] = body.inertia[0] - yy;
    body.inertia[3] = o;
    moved
}
