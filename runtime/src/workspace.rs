//! Everything that the sweeps compute, one entry for each node or degree of freedom, with the symbols of
//! [`notation`](crate::notation).

use alloc::collections::BTreeSet;
use alloc::vec;
use alloc::vec::Vec;

use crate::spatial::{ArticulatedInertia, ElementaryTransform, Force, Mat3, Motion, RigidInertia, Vec3};
use crate::tree::row_order::early_rows;
use crate::tree::{Bond, Tree};
use crate::Scalar;

/// Results of the articulation: variable steps of every joint.
#[derive(Clone, Debug)]
pub struct Poses<S> {
    /// Steps from the parent frame to the node frame.
    pub steps: NodeSteps<S>,
    /// Joint coordinates of nodes a spring can act on, three slots each: `ratio · source + offset`.
    pub coordinates: Vec<[S; 3]>,
    /// For nodes with non-rotating frames: orientation of the body in its frame, and its inertia there.
    pub body: Vec<TurnedBody<S>>,
}

/// A body in a non-rotating frame.
#[derive(Clone, Copy, Debug)]
pub struct TurnedBody<S> {
    /// Angle about z, rad, without the right angles.
    pub angle: S,
    /// Number of right angles to be added.
    pub quarter: u8,
    /// Cosine of the sum.
    pub c: S,
    /// Sine of the sum.
    pub s: S,
    /// Inertia in the frame.
    pub inertia: RigidInertia<S>,
}

impl<S: Scalar> Poses<S> {
    /// Joint coordinate `k` of node `i`.
    pub fn coordinate(&self, i: usize, k: usize) -> S {
        self.coordinates[i][k]
    }
}

impl<S: Scalar> TurnedBody<S> {
    /// The transform from the frame to the body's axes.
    pub fn step(&self) -> ElementaryTransform<S> {
        ElementaryTransform::Turn { axis: crate::spatial::Axis::Z, c: self.c, s: self.s }
    }
}

/// The elementary transforms from every node's parent frame to its own frame, those of all nodes one after the other.
#[derive(Clone, Debug)]
pub struct NodeSteps<S> {
    steps: Vec<ElementaryTransform<S>>,
    spans: Vec<Span>,
}

/// Where the steps of a node lie: those of the constant placement, then those of the joint's motion.
#[derive(Clone, Copy, Debug, Default)]
struct Span {
    first: usize,
    motion: usize,
    end: usize,
}

impl<S: Scalar> NodeSteps<S> {
    /// At most so many steps represent the motion of a joint and a placement that turns.
    const MOST: usize = 4;

    /// Room for the steps of the nodes of a tree, and for those of another one with as many nodes.
    fn new(tree: &Tree<S>, other: &Tree<S>) -> Self {
        let none = ElementaryTransform::Shift { axis: crate::spatial::Axis::Z, r: S::zero() };
        let room = |tree: &Tree<S>| tree.nodes.iter().map(|node| node.place.len() + Self::MOST).sum();
        let room = usize::max(room(tree), room(other));
        NodeSteps { steps: vec![none; room], spans: vec![Span::default(); tree.nodes.len()] }
    }

    /// Replaces the steps of node `i` after those of the nodes before it: constant ones, and those that depend on the
    /// coordinates, of which the first `placing` represent the placement too.
    #[inline(always)]
    pub fn set<const N: usize>(
        &mut self,
        i: usize,
        place: &[ElementaryTransform<S>],
        placing: usize,
        steps: [ElementaryTransform<S>; N],
    ) {
        const { assert!(N <= Self::MOST, "a joint has at most four steps") };
        let first = i.checked_sub(1).map_or(0, |before| self.spans[before].end);
        let (motion, end) = (first + place.len() + placing, first + place.len() + N);
        self.spans[i] = Span { first, motion, end };
        let (constant, own) = self.steps[first..end].split_at_mut(place.len());
        // A loop, since there is seldom more than one.
        for (to, step) in constant.iter_mut().zip(place) {
            *to = *step;
        }
        for (to, step) in own.iter_mut().zip(steps) {
            *to = step;
        }
    }

    /// All steps of node `i`, from parent to child.
    #[inline(always)]
    pub fn all(&self, i: usize) -> &[ElementaryTransform<S>] {
        let span = self.spans[i];
        &self.steps[span.first..span.end]
    }

    /// The steps of the constant placement of node `i`.
    #[inline(always)]
    pub fn placing(&self, i: usize) -> &[ElementaryTransform<S>] {
        let span = self.spans[i];
        &self.steps[span.first..span.motion]
    }

    /// The steps of the motion of the joint of node `i`.
    #[inline(always)]
    pub fn own(&self, i: usize) -> &[ElementaryTransform<S>] {
        let span = self.spans[i];
        &self.steps[span.motion..span.end]
    }
}

/// One eliminated freedom.
#[derive(Clone, Copy, Debug)]
pub struct Pivot<S> {
    /// `U = M* E`.
    pub u: Force<S>,
    /// `k = U / Mj`; its component along `E` is `1 − armature / Mj`.
    pub k: Force<S>,
    /// `1 / Mj`.
    pub rho: S,
    /// Momentum of the freedom's rotor per unit rate.
    pub armature: S,
}

/// The articulated inertia with every freedom eliminated: depends on the configuration alone.
#[derive(Clone, Debug)]
pub struct Factor<S> {
    /// `M'_i`, after the node's own freedoms.
    pub m: Vec<ArticulatedInertia<S>>,
    /// Pivots of the nodes' own freedoms, in node order.
    pub pivots: Vec<Pivot<S>>,
    /// Pivots of the unknowns of the tree: coordinates that several joints share, freedoms that are solved at another node than
    /// their joint's, and rows of constraints.
    pub unknown_pivots: Vec<Pivot<S>>,
    /// `F'_g` of unknown `g` at node `i`, at `g · nodes + i`.
    pub columns: Vec<Force<S>>,
    /// Screw of the freedom of unknown `g` at node `i`, where [`crate::tree::Elimination::screws`] asks for
    /// it, at `g · nodes + i`.
    pub screws: Vec<Motion<S>>,
    /// Inertia between unknowns, while they are open.
    pub gram: Vec<S>,
    /// `E · F_h` of every freedom with every open unknown, at `freedom · unknowns + h`.
    pub cross: Vec<S>,
    /// The same for unknowns with one another.
    pub unknown_cross: Vec<S>,
    /// Diagonal of `Φ M⁻¹Φᵀ` of every multiplier, before other multipliers are taken out of it; with the nodes of one
    /// constraint's cycle as far as they are done.
    pub whole: Vec<S>,
    /// Whether rows are eliminated in passes.
    pub in_passes: bool,
    /// For every unknown, whether it is an early row ([`early_rows`]).
    pub early: Vec<bool>,
    /// For every row of a constraint, those that are open when it is eliminated and meet it: all others are
    /// independent.
    pub later: Vec<Vec<usize>>,
}

/// One row of a constraint.
#[derive(Clone, Copy, Debug)]
pub struct RowState<S> {
    /// `E_c` at the second frame, in its axes.
    pub e: Force<S>,
    /// The wrench at the node of the first frame, with its sign.
    pub at_a: Force<S>,
    /// The wrench at the node of the second frame.
    pub at_b: Force<S>,
    /// Residual of the position, m or rad; zero where there is none.
    pub residual: S,
}

/// Constraints at the configuration.
#[derive(Clone, Debug)]
pub struct Constraints<S> {
    /// Rotation to and position in the innermost common node, along the path to each frame of a constraint as far as it
    /// is done.
    pub reach: Vec<[(Mat3<S>, Vec3<S>); 2]>,
    /// For every node the constraints that act through it: number of the constraint with 0 or 1 for a cut whose path to
    /// the first or second frame has the node, or with the number of a coupling's term.
    pub through: Vec<Vec<(usize, usize)>>,
    /// Wrenches at each constraint's frames, carried inward along the paths.
    pub end_wrenches: Vec<[Force<S>; 2]>,
    /// Whether loops through the ground act through each node.
    pub grounded: Vec<bool>,
    /// The sums of their wrenches at each node, carried inward.
    pub to_ground: Vec<Force<S>>,
    /// Constraints all of whose rows are left out: only gaps are asked for without some.
    pub left_out: Vec<bool>,
    /// Rows that are left out.
    pub rows_left_out: Vec<bool>,
    /// Relative pose of each constraint's frames.
    pub relative: Vec<Relative<S>>,
    /// Rows.
    pub rows: Vec<RowState<S>>,
    /// `b` for velocities, or the right-hand sides for accelerations.
    pub rhs: Vec<S>,
    /// Multipliers, row by row: `σ` or `λ`.
    pub multipliers: Vec<S>,
    /// Joint forces of constraints whose rows turn, one for each velocity.
    pub forces: Vec<S>,
}

/// Pose of a frame `A` in a frame `B`.
#[derive(Clone, Copy, Debug)]
pub struct Relative<S> {
    /// Components in `A` to components in `B`.
    pub turn: Mat3<S>,
    /// From the origin of `A` to that of `B`, in axes of `B`, m.
    pub d: Vec3<S>,
}

/// Rates (or accelerations) and their intermediate results.
#[derive(Clone, Debug)]
pub struct Solution<S> {
    /// `D'_i`.
    pub d: Vec<Force<S>>,
    /// `(p − d) / Mj` of every freedom; the prescribed rate where there is one.
    pub e: Vec<S>,
    /// The same for unknowns.
    pub unknown_e: Vec<S>,
    /// Rate of every freedom of every node.
    pub rate: Vec<S>,
    /// Rate of every unknown.
    pub unknown_rate: Vec<S>,
    /// `Ω̂_i`: motion of the node frame before its own freedoms.
    pub hat: Vec<Motion<S>>,
    /// `Ω_i`.
    pub omega: Vec<Motion<S>>,
}

/// Gravity and external wrenches on subtrees.
#[derive(Clone, Debug)]
pub struct Loads<S> {
    /// First moment of the subtree in the node frame.
    pub moment: Vec<Vec3<S>>,
    /// Mass of the subtree.
    pub mass: Vec<S>,
    /// Gravity in node axes.
    pub gravity: Vec<Vec3<S>>,
    /// Wrench on the node itself, in its frame.
    pub own: Vec<Force<S>>,
    /// `T*_i`, external wrenches on the subtree.
    pub total: Vec<Force<S>>,
    /// First moment of everything, in the ground frame.
    pub ground_moment: Vec3<S>,
}

/// Motion of every node with accelerations of its origin, in its own axes.
#[derive(Clone, Debug)]
pub struct Newton<S> {
    /// Angular velocity.
    pub spin: Vec<Vec3<S>>,
    /// Angular acceleration.
    pub alpha: Vec<Vec3<S>>,
    /// Acceleration of the origin, gravity taken off.
    pub accel: Vec<Vec3<S>>,
    /// Accelerations of the freedoms that were chosen on the way, zero where they were given.
    pub reference: Vec<S>,
}

/// The whole workspace.
#[derive(Clone, Debug)]
pub struct Workspace<S> {
    /// First freedom of every node, and their number at the end.
    pub first: Vec<usize>,
    /// Articulation.
    pub poses: Poses<S>,
    /// Eliminated inertia.
    pub factor: Factor<S>,
    /// Velocity level.
    pub velocity: Solution<S>,
    /// Acceleration level.
    pub acceleration: Solution<S>,
    /// Loops and couplings.
    pub constraints: Constraints<S>,
    /// Gravity and wrenches.
    pub loads: Loads<S>,
    /// Body momenta, accumulated momenta or seeds, one for each node.
    pub force: Vec<Force<S>>,
    /// Joint forces, one for each velocity.
    pub generalized: Vec<S>,
    /// Prescribed accelerations that are still to be added: zero.
    pub drive: Vec<S>,
    /// Motion with accelerations.
    pub newton: Newton<S>,
    /// Screws of the freedoms of inner nodes for the mass matrix, at `freedom · nodes + i`.
    pub screws: Vec<Motion<S>>,
    /// Pose of every node in the ground.
    pub rotation: Vec<Mat3<S>>,
    /// Origin of every node in the ground, m.
    pub position: Vec<Vec3<S>>,
}

impl<S: Scalar> Workspace<S> {
    /// Allocates memory for a tree; nothing is allocated later.
    pub fn new(tree: &Tree<S>) -> Self {
        Self::beside(tree, tree)
    }

    /// Allocates memory for [`Tree::for_accelerations`], in which the tree itself has room, too: reactions take the multipliers of
    /// the one and the bodies of the other.
    pub fn for_accelerations(tree: &Tree<S>) -> Self {
        Self::beside(tree.for_accelerations(), tree)
    }

    fn beside(tree: &Tree<S>, other: &Tree<S>) -> Self {
        let (n, g) = (tree.nodes.len(), tree.unknowns.len());
        let mut first = Vec::with_capacity(n + 1);
        let mut f = 0;
        for node in &tree.nodes {
            first.push(f);
            f += node.kind.nv();
        }
        first.push(f);
        let o = S::zero();
        let upright = TurnedBody { angle: o, quarter: 0, c: S::one(), s: o, inertia: RigidInertia::zero() };
        let pivot = Pivot { u: Force::zero(), k: Force::zero(), rho: o, armature: o };
        let solution = Solution {
            d: vec![Force::zero(); n],
            e: vec![o; f],
            unknown_e: vec![o; g],
            rate: vec![o; f],
            unknown_rate: vec![o; g],
            hat: vec![Motion::zero(); n],
            omega: vec![Motion::zero(); n],
        };
        Workspace {
            first,
            poses: Poses { steps: NodeSteps::new(tree, other), coordinates: vec![[o; 3]; n], body: vec![upright; n] },
            factor: Factor {
                m: vec![ArticulatedInertia::zero(); n],
                pivots: vec![pivot; f],
                unknown_pivots: vec![pivot; g],
                columns: vec![Force::zero(); g * n],
                screws: vec![Motion::zero(); g * n],
                gram: vec![o; g * g],
                cross: vec![o; f * g],
                unknown_cross: vec![o; g * g],
                whole: vec![o; g],
                in_passes: tree.constraints.iter().any(|c| !c.passes.is_empty()),
                early: early(tree),
                later: later(tree),
            },
            constraints: Constraints {
                through: through(tree),
                grounded: grounded(tree),
                to_ground: vec![Force::zero(); n],
                end_wrenches: vec![[Force::zero(); 2]; tree.constraints.len()],
                reach: vec![[([[o; 3]; 3], [o; 3]); 2]; tree.constraints.len()],
                left_out: vec![false; tree.constraints.len()],
                rows_left_out: vec![false; tree.dims.rows],
                relative: vec![Relative { turn: [[o; 3]; 3], d: [o; 3] }; tree.constraints.len()],
                rows: vec![
                    RowState { e: Force::zero(), at_a: Force::zero(), at_b: Force::zero(), residual: o };
                    tree.dims.rows
                ],
                rhs: vec![o; tree.dims.rows],
                multipliers: vec![o; tree.dims.rows],
                forces: vec![o; tree.dims.nv],
            },
            velocity: solution.clone(),
            acceleration: solution,
            loads: Loads {
                moment: vec![[o; 3]; n],
                mass: vec![o; n],
                gravity: vec![[o; 3]; n],
                own: vec![Force::zero(); n],
                total: vec![Force::zero(); n],
                ground_moment: [o; 3],
            },
            force: vec![Force::zero(); n],
            generalized: vec![o; tree.dims.nv],
            drive: vec![o; tree.dims.drive_v],
            newton: Newton {
                spin: vec![[o; 3]; n],
                alpha: vec![[o; 3]; n],
                accel: vec![[o; 3]; n],
                reference: vec![o; f],
            },
            screws: vec![Motion::zero(); if tree.matrix_depth > 0 { f * n } else { 0 }],
            rotation: vec![[[o; 3]; 3]; n],
            position: vec![[o; 3]; n],
        }
    }
}

/// The constraints that act through each node, with their parts.
fn through<S>(tree: &Tree<S>) -> Vec<Vec<(usize, usize)>> {
    let mut through = vec![Vec::new(); tree.nodes.len()];
    for (index, constraint) in tree.constraints.iter().enumerate() {
        match &constraint.bond {
            Bond::Cut(cut) => {
                for (part, path) in [&cut.path_a, &cut.path_b].into_iter().enumerate() {
                    path.iter().for_each(|&i| through[i].push((index, part)));
                }
            }
            Bond::Coupling { terms, .. } => {
                terms.iter().enumerate().for_each(|(part, (node, _))| through[*node].push((index, part)));
            }
        }
    }
    through
}

/// Whether loops through the ground act through each node.
fn grounded<S>(tree: &Tree<S>) -> Vec<bool> {
    let mut grounded = vec![false; tree.nodes.len()];
    for constraint in &tree.constraints {
        if let Bond::Cut(cut) = &constraint.bond {
            let path = cut.path_a.iter().chain(&cut.path_b).filter(|_| cut.grounded);
            path.for_each(|&i| grounded[i] = true);
        }
    }
    grounded
}

/// For every unknown, whether it is an early row.
fn early<S>(tree: &Tree<S>) -> Vec<bool> {
    let mut early = vec![false; tree.unknowns.len()];
    early_rows(tree).into_iter().for_each(|(_, g)| early[g] = true);
    early
}

/// Shared coordinates and rows in the order in which they are eliminated, and for each those that are coupled to it
/// then.
fn later<S: Scalar>(tree: &Tree<S>) -> Vec<Vec<usize>> {
    let mut meets = vec![BTreeSet::new(); tree.unknowns.len()];
    let mut join = |all: &[usize]| {
        for &g in all {
            meets[g].extend(all.iter().copied().filter(|&h| h != g));
        }
    };
    let mut order = Vec::new();
    for node in tree.nodes.iter().rev() {
        let open = node.elimination.solve_after.iter().chain(&node.elimination.open).chain(&node.elimination.ends);
        join(&open.chain(&node.elimination.unknown).copied().collect::<Vec<_>>());
        order.extend(node.elimination.solve_before.iter().chain(&node.elimination.solve_after).copied());
    }
    order.extend(&tree.solve_at_ground);
    let mut place = vec![usize::MAX; tree.unknowns.len()];
    order.iter().enumerate().for_each(|(k, g)| place[*g] = k);
    // What is coupled to one of them becomes coupled to each other. The next one of those to be eliminated hands that on, so
    // that a model of many rows is not a matter of the cube of their number.
    for &g in &order {
        meets[g].retain(|h| place[*h] > place[g]);
        let rest: Vec<usize> = meets[g].iter().copied().collect();
        if let Some(&next) = rest.iter().min_by_key(|h| place[**h]) {
            meets[next].extend(rest.into_iter().filter(|h| *h != next));
        }
    }
    meets.into_iter().map(|set| set.into_iter().collect()).collect()
}
