//! The interpreter: it runs the sweeps directly on numbers, for any tree.

mod rank;
mod system;

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

pub use rank::MassMatrixError;

use crate::sweep::{Derivatives, FrameState, Inputs, Plain, Sweeps};
use crate::system::{LieGroup, LieJoint, MomentumDerivatives, Real, Row};
use crate::tree::{Kind, Source, Tree};
use crate::workspace::Workspace;
use crate::Scalar;

/// The inputs of an interpreter as the sweeps take them: a macro, since it borrows the fields of the inputs alone.
macro_rules! inputs {
    ($of:expr) => {
        Inputs {
            tau: &$of.tau,
            drive_q: &$of.drive_q,
            drive_v: &$of.drive_v,
            drive_a: &$of.drive_a,
            wrenches: &$of.wrenches,
            gravity: $of.gravity,
        }
    };
}
use inputs;

/// Runs the sweeps on numbers. It allocates when it is made and not afterwards, except for the memory of derivatives,
/// which is allocated when it is first needed, and where rows are put into another order ([`Constrained::reorder_rows`]).
///
/// [`Constrained::reorder_rows`]: crate::system::Constrained::reorder_rows
///
/// All calls take slices in the order of the state; a slice of another length than [`Tree::dims`] says is a programming
/// error and panics.
#[derive(Clone, Debug)]
pub struct Interpreter<S> {
    /// Regrouped: everything but the wrenches of reactions.
    tree: Tree<S>,
    /// As described: reactions.
    physical: Tree<S>,
    work: Workspace<S>,
    /// Memory for the tree for accelerations, where it is another one: its rows are coupled in another way.
    other_work: Option<Box<Workspace<S>>>,
    /// Whether the regrouped tree is plain.
    plain: bool,
    /// Joint forces, `nv` numbers, N m or N.
    pub tau: Vec<S>,
    /// Prescribed positions, rad, m; unit quaternions.
    pub drive_q: Vec<S>,
    /// Prescribed rates, rad/s, m/s.
    pub drive_v: Vec<S>,
    /// Prescribed accelerations, rad/s², m/s²; needed for accelerations and reactions only.
    pub drive_a: Vec<S>,
    /// External wrenches `[force; moment]`, N and N m.
    pub wrenches: Vec<[S; 6]>,
    /// Gravity in ground axes, m/s².
    pub gravity: [S; 3],
    /// Names of the velocities and of the constraints, as far as they were given.
    names: [Vec<String>; 2],
    v: Vec<S>,
    groups: Vec<LieJoint>,
    rows: Vec<Row>,
    entry_columns: Vec<usize>,
    neutral: Vec<S>,
    /// Made when [`Differentiable::rate_derivatives`] is first called.
    derivatives: Option<Box<Derivatives<S>>>,
}

impl<S: Scalar> Interpreter<S> {
    /// An interpreter of a tree as it was described (not regrouped), with zero inputs and the given gravity.
    pub fn new(physical: Tree<S>, gravity: [S; 3]) -> Self {
        let tree = physical.regrouped();
        let dims = tree.dims;
        let o = S::zero();
        let (mut groups, mut drive_q) = (Vec::new(), vec![o; dims.drive_q]);
        let mut neutral = vec![o; dims.nq];
        for node in &tree.nodes {
            let kind = match node.kind {
                Kind::Spherical => LieGroup::SO3,
                Kind::Floating => LieGroup::SE3,
                Kind::Planar => LieGroup::SE2,
                _ => continue,
            };
            let group = |q, v| LieJoint::new(kind, q, v);
            match node.source {
                Source::State { q, v } => {
                    // Nodes stand in the order of the elimination.
                    let at = groups.partition_point(|other: &LieJoint| other.q < q);
                    groups.insert(at, group(q, v));
                    if let Some(at) = group(q, v).quaternion() {
                        neutral[at + 3] = S::one();
                    }
                }
                Source::Drive { q, v } => {
                    if let Some(at) = group(q, v).quaternion() {
                        drive_q[at + 3] = S::one();
                    }
                }
            }
        }
        Interpreter {
            tau: vec![o; dims.nv],
            drive_q,
            drive_v: vec![o; dims.drive_v],
            drive_a: vec![o; dims.drive_v],
            wrenches: vec![[o; 6]; dims.wrenches],
            gravity,
            names: [Vec::new(), Vec::new()],
            work: Workspace::new(&tree),
            other_work: Self::other_work(&tree),
            plain: tree.is_plain(),
            v: vec![o; dims.nv],
            rows: tree.rows(),
            entry_columns: tree.entry_columns(),
            tree,
            physical,
            groups,
            neutral,
            derivatives: None,
        }
    }

    /// Memory for the tree for accelerations, where it is another one.
    fn other_work(tree: &Tree<S>) -> Option<Box<Workspace<S>>> {
        tree.accelerations.is_some().then(|| Box::new(Workspace::for_accelerations(tree)))
    }

    /// The interpreter in which only some rows of the constraints act, with zero inputs and the gravity of this one. Its
    /// rows have the numbers that they have here; those that do not act have no residuals, entries and multipliers.
    ///
    /// `acts` has one entry for each row.
    pub fn acting(&self, acts: &[bool]) -> Self {
        let reduced = Self::new(self.physical.clone().acting(acts), self.gravity);
        let (rows, entry_columns) = (self.rows.clone(), self.entry_columns.clone());
        Interpreter { rows, entry_columns, names: self.names.clone(), ..reduced }
    }

    /// Exchanges its inputs with those of another interpreter of the same mechanism.
    pub(crate) fn swap_inputs(&mut self, other: &mut Self) {
        use core::mem::swap;
        swap(&mut self.tau, &mut other.tau);
        swap(&mut self.drive_q, &mut other.drive_q);
        swap(&mut self.drive_v, &mut other.drive_v);
        swap(&mut self.drive_a, &mut other.drive_a);
        swap(&mut self.wrenches, &mut other.wrenches);
        swap(&mut self.gravity, &mut other.gravity);
    }

    /// Whether bodies may move without momenta: by prescribed joints, or by loops that follow these.
    pub fn moves_at_rest(&self) -> bool {
        self.tree.dims.drive_v > 0 || !self.tree.constraints.is_empty()
    }

    /// Residuals of all rows of the constraints, their velocities `Φ v` with what prescribed motions add, one number for
    /// each row, and the entries of `Φ`: `(q, v) → (φ, Φ v, Φ)`.
    pub fn gaps(&mut self, q: &[S], v: &[S], gaps: &mut [S], velocities: &mut [S], entries: &mut [S]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.gaps(q, v, &inputs!(self), &mut self.work, [gaps, velocities, entries]);
    }

    /// [`Interpreter::gaps`] of the rows that are `wanted`, one entry for each row. Numbers of the others mean nothing.
    pub fn gaps_of(
        &mut self,
        wanted: &[bool],
        (q, v): (&[S], &[S]),
        gaps: &mut [S],
        velocities: &mut [S],
        entries: &mut [S],
    ) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.gaps_of(wanted, (q, v), &inputs!(self), &mut self.work, [gaps, velocities, entries]);
    }

    /// Takes the names of the velocities and of the constraints, in their order, for the messages of errors.
    #[must_use]
    pub fn with_names(mut self, velocities: Vec<String>, constraints: Vec<String>) -> Self {
        self.names = [velocities, constraints];
        self
    }

    /// The inputs of the next call, as the sweeps take them.
    pub fn inputs(&self) -> Inputs<'_, S> {
        inputs!(self)
    }

    /// The tree that is run.
    pub fn tree(&self) -> &Tree<S> {
        &self.tree
    }

    /// `(q, p) → (v, q̇, ṗ)`.
    pub fn rates(&mut self, q: &[S], p: &[S], v: &mut [S], qd: &mut [S], pd: &mut [S]) {
        if S::IS_NATIVE && self.plain {
            let sweeps = Sweeps { tree: &self.tree, trace: &Plain };
            return sweeps.rates(q, p, &inputs!(self), &mut self.work, v, qd, pd);
        }
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.rates(q, p, &inputs!(self), &mut self.work, v, qd, pd);
    }

    /// `(q, p) → v`.
    pub fn velocities(&mut self, q: &[S], p: &[S], v: &mut [S]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.velocities(q, p, &inputs!(self), &mut self.work, v);
    }

    /// `(q, v) → p`.
    pub fn momenta(&mut self, q: &[S], v: &[S], p: &mut [S]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.momenta(q, v, &inputs!(self), &mut self.work, p);
    }

    /// `(q, p) → (kinetic, potential)`, J.
    pub fn energy(&mut self, q: &[S], p: &[S]) -> (S, S) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.energy(q, p, &inputs!(self), &mut self.work, &mut self.v)
    }

    /// `(q, v) → v̇`.
    pub fn accelerations(&mut self, q: &[S], v: &[S], a: &mut [S]) {
        let sweeps = Sweeps { tree: self.tree.for_accelerations(), trace: &() };
        let work = self.other_work.as_deref_mut().unwrap_or(&mut self.work);
        sweeps.accelerations(q, v, &inputs!(self), work, a);
    }

    /// Residuals of the constraints and entries of `Φ`, `q → (φ, Φ)`:
    /// [`Constrained::constraint_residuals`](crate::system::Constrained::constraint_residuals), also for scalars that
    /// cannot be compared.
    pub fn residuals(&mut self, q: &[S], residual: &mut [S], entries: &mut [S]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.constraint_residuals(q, &inputs!(self), &mut self.work, residual, entries);
    }

    /// Forces and moments of the constraints, `(q, v) → λ`:
    /// [`Constrained::multipliers`](crate::system::Constrained::multipliers), also for scalars that cannot be compared.
    pub fn constraint_multipliers(&mut self, q: &[S], v: &[S], lambda: &mut [S]) {
        let sweeps = Sweeps { tree: self.tree.for_accelerations(), trace: &() };
        let work = self.other_work.as_deref_mut().unwrap_or(&mut self.work);
        sweeps.multipliers(q, v, &inputs!(self), work, &mut self.v, lambda);
    }

    /// `(q, v) → (v̇, reaction wrenches)`: `[force; moment]` transmitted by every joint to its child, in the child's
    /// body frame, one for each entry of [`Tree::joint_nodes`].
    pub fn reactions(&mut self, q: &[S], v: &[S], a: &mut [S], wrenches: &mut [[S; 6]]) {
        self.accelerations(q, v, a);
        let sweeps = Sweeps { tree: &self.physical, trace: &() };
        // It has the multipliers.
        let work = self.other_work.as_deref_mut().unwrap_or(&mut self.work);
        sweeps.reactions(q, v, a, &inputs!(self), work, wrenches);
    }

    /// `(q, v, v̇) → τ = M v̇ + h`. The joint forces of the inputs are not read.
    pub fn inverse_dynamics(&mut self, q: &[S], v: &[S], a: &[S], tau: &mut [S]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.inverse_dynamics(q, v, a, &inputs!(self), &mut self.work, tau);
    }

    /// Regressor `Y` of the joint forces, `(q, v, v̇) → Y` with `τ = Y π`, row by row: one row for each velocity, one
    /// column for each of [`Tree::dynamic_parameters`]. Springs, rotor inertias and external wrenches are not in it.
    pub fn regressor(&mut self, q: &[S], v: &[S], a: &[S], out: &mut [S]) {
        let sweeps = Sweeps { tree: &self.physical, trace: &() };
        sweeps.regressor(q, v, a, &inputs!(self), &mut self.work, out);
    }

    /// Bias forces, `(q, v) → h` with `M v̇ + h = τ`: products of velocities, prescribed accelerations and gravity,
    /// less springs, dampers and external wrenches.
    pub fn bias(&mut self, q: &[S], v: &[S], h: &mut [S]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.bias(q, v, &inputs!(self), &mut self.work, h);
    }

    /// `q →` Jacobian of every frame of [`Tree::frames`], `6 × nv` each, row by row: `J v` is the frame's velocity
    /// `[linear; angular]` in its own axes, at its origin, as far as it comes from `v`. In ground axes it is `R J`,
    /// with the rotation of [`Interpreter::frames`] on both halves.
    pub fn jacobians(&mut self, q: &[S], out: &mut [S]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.jacobians(q, &inputs!(self), &mut self.work, self.tree.frames.iter(), out);
    }

    /// `(q, v) →` acceleration `[linear; angular]` of every frame of [`Tree::frames`] at `v̇ = 0`, in its own axes:
    /// that of the origin as the ground sees it, and angular; the frame accelerates by `J v̇` more. In ground axes,
    /// with the rotation on both halves, it is `J̇ v` of the Jacobian in ground axes. Prescribed motions are included.
    pub fn bias_accelerations(&mut self, q: &[S], v: &[S], out: &mut [[S; 6]]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        let frames = self.tree.frames.iter().zip(out);
        sweeps.bias_accelerations(q, v, &inputs!(self), &mut self.work, frames);
    }

    /// `(q, v) →` centre of mass in the ground (3 numbers, m), centroidal momentum matrix `A` (`6 × nv`, row by row)
    /// and bias (6 numbers): the momentum `[linear; angular]` of all bodies about the centre of mass, in ground axes,
    /// is `A v`, and changes at the rate `A v̇ + bias`. Prescribed rates add to the momentum; prescribed accelerations
    /// are in the bias.
    pub fn centroidal(&mut self, q: &[S], v: &[S], center: &mut [S], matrix: &mut [S], bias: &mut [S]) {
        let sweeps = Sweeps { tree: &self.physical, trace: &() };
        sweeps.centroidal(q, v, &inputs!(self), &mut self.work, center, matrix, bias);
    }

    /// `q → M`, `nv × nv`, row by row.
    pub fn mass_matrix(&mut self, q: &[S], m: &mut [S]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.mass_matrix(q, &inputs!(self), &mut self.work, m);
    }

    /// `q →` diagonal of `M`, `nv` numbers. It allocates.
    pub(crate) fn mass_diagonal(&mut self, q: &[S], m: &mut [S]) {
        let mut joints = vec![0; self.tree.dims.nv];
        for node in &self.tree.nodes {
            if let Source::State { v, .. } = node.source {
                joints[v..v + node.kind.nv()].iter_mut().for_each(|count| *count += 1);
            }
        }
        let several: Vec<bool> = joints.iter().map(|count| *count > 1).collect();
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.mass_diagonal(q, &inputs!(self), &mut self.work, &several, m);
    }

    /// Momenta, their rates and derivatives of both at given velocities; `d` and `out` are made of
    /// [`Interpreter::tree`].
    pub fn momentum_derivatives(
        &mut self,
        q: &[S],
        v: &[S],
        d: &mut Derivatives<S>,
        out: &mut MomentumDerivatives<Vec<S>, Vec<S>>,
    ) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.momentum_derivatives(q, v, &inputs!(self), &mut self.work, d, out);
    }

    /// `v`, `ṗ` and their derivatives with respect to `q` and `p`. `d` is [`Derivatives::new`] of
    /// [`Interpreter::tree`].
    pub fn derivatives(&mut self, q: &[S], p: &[S], d: &mut Derivatives<S>) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        sweeps.derivatives(q, p, &inputs!(self), &mut self.work, d);
    }

    /// `(q, v) →` pose and velocity of every frame of [`Tree::frames`].
    pub fn frames(&mut self, q: &[S], v: &[S], out: &mut [FrameState<S>]) {
        let sweeps = Sweeps { tree: &self.tree, trace: &() };
        let frames = self.tree.frames.iter().zip(out);
        sweeps.frame_states(q, v, &inputs!(self), &mut self.work, frames);
    }
}

/// A mechanism for steps by the implicit midpoint rule.
#[derive(Clone, Debug)]
pub struct ImplicitSprings<Y, P> {
    /// The mechanism whose joints have the inertia that such a step adds for springs and dampers.
    pub evaluator: Y,
    /// What is added to the inertia of each velocity, kg m² or kg.
    pub added: P,
    /// Stiffness of springs at each velocity, N m/rad or N/m.
    pub stiffness: P,
    /// Whether there are velocities without momenta: of prescribed motions, and of loops that close.
    pub driven: bool,
}

impl<Y, P> ImplicitSprings<Y, P> {
    /// The same with another evaluator.
    pub fn map<Z>(self, of: impl FnOnce(Y) -> Z) -> ImplicitSprings<Z, P> {
        let ImplicitSprings { evaluator, added, stiffness, driven } = self;
        ImplicitSprings { evaluator: of(evaluator), added, stiffness, driven }
    }
}

impl<S: Real> Interpreter<S> {
    /// The mechanism for steps of `step` s that are implicit in springs and dampers of the joints, with zero inputs and the
    /// gravity of this one. `None` where no joint has a spring or a damper.
    pub fn with_implicit_springs(&self, step: S) -> Option<ImplicitSprings<Self, Vec<S>>> {
        if !self.physical.has_springs_or_dampers() {
            return None;
        }
        let made = Self::new(self.physical.clone().with_implicit_springs(step), self.gravity);
        let (rows, entry_columns) = (self.rows.clone(), self.entry_columns.clone());
        let evaluator = Interpreter { rows, entry_columns, names: self.names.clone(), ..made };
        let driven = self.moves_at_rest();
        let (added, stiffness) = (self.physical.implicit_inertias(step), self.physical.stiffnesses());
        Some(ImplicitSprings { evaluator, added, stiffness, driven })
    }
}
