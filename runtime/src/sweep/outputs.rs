//! The outputs: the sweeps of each in order, and the function that runs them over the tree.
//!
//! The generator's rolled code runs the same lists over one link of a chain and over the rest of its tree.

use super::level::{AccelerationLevel, ColumnLevel, PositionLevel, VelocityLevel};
use super::pass::{Arguments, Context, Results, Sweep, SweepList};
use super::{Accelerations, FrameState, Inputs, Sweeps, Trace};
use crate::tree::{Tree, TreeFrame};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweep<S, T> {
    const PATHS: Self = Self::paths::<false>();
    const ROWS: Self = Self::rows::<false>();
    const ALL_PATHS: Self = Self::paths::<true>();
    const ALL_ROWS: Self = Self::rows::<true>();
    const BIAS_MOMENTUM: Self = Self::bias_momentum::<VelocityLevel>();
    const MOTION: Self = Self::motion::<VelocityLevel>();
    const VELOCITIES: Self = Self::collect::<VelocityLevel>();
}

impl<S: Scalar, T: Trace> SweepList<S, T, 6> {
    /// `(q, p) → v`.
    pub const VELOCITIES: Self = SweepList {
        sweeps: [Sweep::PATHS, Sweep::ROWS, Sweep::FACTOR, Sweep::BIAS_MOMENTUM, Sweep::MOTION, Sweep::VELOCITIES],
        finish: |_| {},
    };

    /// `q →` residuals of the constraints, the change of the coordinates that takes them away, pivots.
    pub const POSITION_CORRECTION: Self = SweepList {
        sweeps: [
            Sweep::ALL_PATHS,
            Sweep::ALL_ROWS,
            Sweep::FACTOR,
            Sweep::bias_momentum::<PositionLevel>(),
            Sweep::motion::<PositionLevel>(),
            Sweep::collect::<PositionLevel>(),
        ],
        finish: |cx| {
            cx.sweeps.residuals(cx.w, cx.results.rows);
            cx.sweeps.row_pivots(cx.w, cx.results.pivots);
        },
    };
}

impl<S: Scalar, T: Trace> SweepList<S, T, 14> {
    /// `(q, p) → (v, q̇, ṗ)`.
    pub const RATES: Self = SweepList {
        sweeps: [
            Sweep::PATHS,
            Sweep::ROWS,
            Sweep::FACTOR,
            Sweep::BIAS_MOMENTUM,
            Sweep::MOTION,
            Sweep::VELOCITIES,
            Sweep::COORDINATE_RATES,
            Sweep::MOMENT,
            Sweep::GRAVITY,
            Sweep::WRENCHES,
            Sweep::MULTIPLIERS,
            Sweep::CONSTRAINT_FORCES,
            Sweep::ACCUMULATED_MOMENTA,
            Sweep::MOMENTUM_RATES,
        ],
        finish: |cx| {
            for (pd, tau) in cx.results.p.iter_mut().zip(cx.given.inputs.tau) {
                *pd = *pd + *tau;
            }
            for (pd, force) in cx.results.p.iter_mut().zip(&cx.w.constraints.forces) {
                *pd = *pd + *force;
            }
        },
    };
}

impl<S: Scalar, T: Trace> SweepList<S, T, 9> {
    /// `(q, p) → (v, energy)`.
    pub const ENERGY: Self = SweepList {
        sweeps: [
            Sweep::PATHS,
            Sweep::ROWS,
            Sweep::FACTOR,
            Sweep::BIAS_MOMENTUM,
            Sweep::MOTION,
            Sweep::VELOCITIES,
            Sweep::KINETIC,
            Sweep::MOMENT,
            Sweep::POTENTIAL,
        ],
        finish: |_| {},
    };
}

impl<S: Scalar, T: Trace> SweepList<S, T, 7> {
    /// `(q, p) → (v, p − Φᵀσ, σ)`.
    pub const PROJECT_MOMENTA: Self = SweepList {
        sweeps: [
            Sweep::PATHS,
            Sweep::ROWS,
            Sweep::FACTOR,
            Sweep::BIAS_MOMENTUM,
            Sweep::MOTION,
            Sweep::VELOCITIES,
            Sweep::FREED_MOMENTA,
        ],
        finish: |cx| cx.sweeps.projected_multipliers(cx.w, cx.results.rows),
    };
}

impl<S: Scalar, T: Trace> SweepList<S, T, 2> {
    /// `(q, v) → p`.
    pub const MOMENTA: Self = SweepList { sweeps: [Sweep::VELOCITY, Sweep::MOMENTUM], finish: |_| {} };
}

impl<S: Scalar, T: Trace> SweepList<S, T, 3> {
    /// `(q, v, v̇) → τ`, or bias forces, by the accelerations that are given.
    pub const INVERSE_DYNAMICS: Self = SweepList {
        sweeps: [Sweep::NEWTON, Sweep::NEEDED_WRENCHES, Sweep::TRANSMITTED],
        finish: |cx| cx.sweeps.joint_forces(cx.given.accelerations, cx.w, cx.results.p),
    };
}

impl<S: Scalar, T: Trace> SweepList<S, T, 11> {
    /// `(q, v, τ) → v̇`, the accelerations that are given being [`Accelerations::Chosen`].
    pub const ACCELERATIONS: Self = SweepList {
        sweeps: [
            Sweep::ALL_PATHS,
            Sweep::ALL_ROWS,
            Sweep::FACTOR,
            Sweep::NEWTON,
            Sweep::ROW_ACCELERATIONS,
            Sweep::NEEDED_WRENCHES,
            Sweep::JOINT_LOADS,
            Sweep::bias_momentum::<AccelerationLevel>(),
            Sweep::motion::<AccelerationLevel>(),
            Sweep::collect::<AccelerationLevel>(),
            Sweep::ADD_REFERENCE,
        ],
        finish: |cx| {
            cx.sweeps.collect_multipliers(&cx.w.acceleration.unknown_rate, &mut cx.w.constraints.multipliers);
        },
    };
}

impl<S: Scalar, T: Trace> SweepList<S, T, 5> {
    /// `(q, v, v̇, λ) →` reactions.
    pub const REACTIONS: Self = SweepList {
        sweeps: [Sweep::PATHS, Sweep::ROWS, Sweep::NEWTON, Sweep::NEEDED_WRENCHES, Sweep::TRANSMITTED_WITH_CONSTRAINTS],
        finish: |cx| cx.sweeps.collect_reactions(cx.w, cx.results.wrenches),
    };
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// The data on which sweeps over this tree work.
    pub(super) fn context<'b>(
        &'b self,
        given: &'b Arguments<'b, S>,
        w: &'b mut Workspace<S>,
        results: Results<'b, S>,
    ) -> Context<'b, S, T> {
        Context { sweeps: self, given, w, results }
    }

    /// Velocities from momenta.
    pub fn velocities(&self, q: &[S], p: &[S], u: &Inputs<S>, w: &mut Workspace<S>, v: &mut [S]) {
        self.context(&Arguments::new(q, p, u), w, Results { v, ..Results::none() }).run(SweepList::VELOCITIES);
    }

    /// Velocities and multipliers `σ`, after the joints' steps; the factorisation stays for [`Sweeps::solve_column`].
    pub(super) fn velocities_of_steps(&self, p: &[S], u: &Inputs<S>, w: &mut Workspace<S>, v: &mut [S]) {
        let given = Arguments::new(&[], p, u);
        self.context(&given, w, Results { v, ..Results::none() }).run_after_steps(SweepList::VELOCITIES);
        self.collect_multipliers(&w.velocity.unknown_rate, &mut w.constraints.multipliers);
    }

    /// The same linear problem with other right-hand sides: `p` for the momenta, and what stands in the place of `b` of
    /// the constraints.
    pub(super) fn solve_column(&self, p: &[S], u: &Inputs<S>, w: &mut Workspace<S>, v: &mut [S], sigma: &mut [S]) {
        let given = Arguments::new(&[], p, u);
        self.context(&given, w, Results { v, ..Results::none() }).sweep([
            Sweep::bias_momentum::<ColumnLevel>(),
            Sweep::motion::<ColumnLevel>(),
            Sweep::collect::<ColumnLevel>(),
        ]);
        self.collect_multipliers(&w.acceleration.unknown_rate, sigma);
    }

    /// Rates of the state: velocities `v`, coordinate rates `q̇`, momentum rates `ṗ`.
    pub fn rates(
        &self,
        q: &[S],
        p: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        v: &mut [S],
        qd: &mut [S],
        pd: &mut [S],
    ) {
        let (given, results) = (Arguments::new(q, p, u), Results { v, qd, p: pd, ..Results::none() });
        self.articulate(q, u.drive_q, &mut w.poses);
        rates_of_steps(self.tree, self.trace, &given, w, results);
    }

    /// Kinetic and potential energy, J. The potential is zero with every moving mass at the height of the ground's
    /// origin; bodies that are fixed to the ground do not count.
    pub fn energy(&self, q: &[S], p: &[S], u: &Inputs<S>, w: &mut Workspace<S>, v: &mut [S]) -> (S, S) {
        let mut energy = [S::zero(); 2];
        self.context(&Arguments::new(q, p, u), w, Results { v, energy: &mut energy, ..Results::none() })
            .run(SweepList::ENERGY);
        energy.into()
    }

    /// Momenta from velocities, `p = M(q) v`, without forming `M`. `p` has one entry for each velocity.
    pub fn momenta(&self, q: &[S], v: &[S], u: &Inputs<S>, w: &mut Workspace<S>, p: &mut [S]) {
        self.context(&Arguments::new(q, v, u), w, Results { p, ..Results::none() }).run(SweepList::MOMENTA);
    }

    /// Gravity and external wrenches on all subtrees, after the joints' steps.
    pub(super) fn loads(&self, u: &Inputs<S>, w: &mut Workspace<S>) {
        self.context(&Arguments::new(&[], &[], u), w, Results::none()).sweep([
            Sweep::MOMENT,
            Sweep::GRAVITY,
            Sweep::WRENCHES,
        ]);
    }

    /// Momenta of given velocities, after the joints' steps.
    pub(super) fn momentum_sweeps(&self, v: &[S], u: &Inputs<S>, w: &mut Workspace<S>, p: &mut [S]) {
        self.context(&Arguments::new(&[], v, u), w, Results { p, ..Results::none() })
            .sweep([Sweep::VELOCITY, Sweep::MOMENTUM]);
    }

    /// Joint forces `τ` that give the accelerations `a`: `(q, v, v̇) → τ = M v̇ + h`. The `τ` of the inputs is not
    /// read.
    pub fn inverse_dynamics(&self, q: &[S], v: &[S], a: &[S], u: &Inputs<S>, w: &mut Workspace<S>, tau: &mut [S]) {
        let given = Arguments { accelerations: Accelerations::Given(a), ..Arguments::new(q, v, u) };
        self.context(&given, w, Results { p: tau, ..Results::none() }).run(SweepList::INVERSE_DYNAMICS);
    }

    /// Bias forces: the joint forces that keep `v̇` zero, `(q, v) → h` with `M v̇ + h = τ`. What products of
    /// velocities, prescribed accelerations and gravity need, less what springs, dampers and external wrenches give.
    pub fn bias(&self, q: &[S], v: &[S], u: &Inputs<S>, w: &mut Workspace<S>, h: &mut [S]) {
        self.context(&Arguments::new(q, v, u), w, Results { p: h, ..Results::none() }).run(SweepList::INVERSE_DYNAMICS);
    }

    /// Accelerations from velocities: `(q, v, τ) → v̇`.
    pub fn accelerations(&self, q: &[S], v: &[S], u: &Inputs<S>, w: &mut Workspace<S>, a: &mut [S]) {
        let given = Arguments { accelerations: Accelerations::Chosen, ..Arguments::new(q, v, u) };
        self.context(&given, w, Results { v: a, ..Results::none() }).run(SweepList::ACCELERATIONS);
    }

    /// Multipliers `λ` at given velocities, and the accelerations `a`.
    pub fn multipliers(&self, q: &[S], v: &[S], u: &Inputs<S>, w: &mut Workspace<S>, a: &mut [S], lambda: &mut [S]) {
        self.accelerations(q, v, u, w, a);
        lambda.copy_from_slice(&w.constraints.multipliers);
    }

    /// Wrench `[force; moment]` that every joint transmits to its child, in the child's body frame, at accelerations
    /// `a` (4.66), on a tree that was not regrouped. The multipliers `λ` of constraints are those of the last
    /// [`Sweeps::accelerations`].
    pub fn reactions(&self, q: &[S], v: &[S], a: &[S], u: &Inputs<S>, w: &mut Workspace<S>, out: &mut [[S; 6]]) {
        let given = Arguments { accelerations: Accelerations::Given(a), ..Arguments::new(q, v, u) };
        self.context(&given, w, Results { wrenches: out, ..Results::none() }).run(SweepList::REACTIONS);
    }

    /// Velocities and multipliers `σ` of a state, and the projected momenta `M v = p⁺ − Φᵀσ`.
    pub fn project_momenta(
        &self,
        q: &[S],
        p: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        v: &mut [S],
        freed: &mut [S],
        sigma: &mut [S],
    ) {
        let results = Results { v, p: freed, rows: sigma, ..Results::none() };
        self.context(&Arguments::new(q, p, u), w, results).run(SweepList::PROJECT_MOMENTA);
    }

    /// One step of Newton's method towards closed positions, least in the metric of `M`: `δq = −M⁻¹Φᵀ(Φ M⁻¹Φᵀ)⁻¹φ`,
    /// with the residuals `φ` and the pivots of `Φ M⁻¹Φᵀ`, zero where a row was left out.
    pub fn position_correction(
        &self,
        q: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        phi: &mut [S],
        dq: &mut [S],
        pivots: &mut [S],
    ) {
        let results = Results { v: dq, rows: phi, pivots, ..Results::none() };
        self.context(&Arguments::new(q, &[], u), w, results).run(SweepList::POSITION_CORRECTION);
    }

    /// Residuals `φ(q)` of the positions and the entries of `Φ`, placed as [`crate::tree::Tree::entry_columns`] says.
    pub fn constraint_residuals(&self, q: &[S], u: &Inputs<S>, w: &mut Workspace<S>, phi: &mut [S], entries: &mut [S]) {
        let given = Arguments::new(q, &[], u);
        let mut cx = self.context(&given, w, Results::none());
        cx.articulate();
        cx.sweep([Sweep::ALL_PATHS, Sweep::ALL_ROWS]);
        self.residuals(w, phi);
        self.row_entries(w, entries);
    }

    /// Residuals `φ(q)` of the positions, velocities of the rows at velocities `v` (`Φ v` and what prescribed motions add
    /// to it), and the entries of `Φ`, placed as [`crate::tree::Tree::entry_columns`] says.
    pub fn gaps(
        &self,
        q: &[S],
        v: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        [phi, velocities, entries]: [&mut [S]; 3],
    ) {
        let given = Arguments::new(q, v, u);
        let mut cx = self.context(&given, w, Results::none());
        cx.articulate();
        cx.sweep([Sweep::ALL_PATHS, Sweep::ALL_ROWS, Sweep::VELOCITY]);
        self.residuals(w, phi);
        self.velocities_of_rows(w, velocities);
        self.row_entries(w, entries);
    }

    /// [`Sweeps::gaps`] of the rows that are `wanted`, one entry for each row. Numbers of the others mean nothing.
    pub fn gaps_of(
        &self,
        wanted: &[bool],
        (q, v): (&[S], &[S]),
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        results: [&mut [S]; 3],
    ) {
        for (left_out, constraint) in w.constraints.left_out.iter_mut().zip(&self.tree.constraints) {
            *left_out = constraint.range().all(|row| wanted.get(row) == Some(&false));
        }
        if cfg!(feature = "hulls") {
            for (left_out, wanted) in w.constraints.rows_left_out.iter_mut().zip(wanted) {
                *left_out = !wanted;
            }
        }
        self.gaps(q, v, u, w, results);
        w.constraints.left_out.fill(false);
        if cfg!(feature = "hulls") {
            w.constraints.rows_left_out.fill(false);
        }
    }

    /// Articulated inertia with all freedoms and unknowns eliminated.
    pub fn factor(&self, q: &[S], u: &Inputs<S>, w: &mut Workspace<S>) {
        let given = Arguments::new(q, &[], u);
        let mut cx = self.context(&given, w, Results::none());
        cx.articulate();
        cx.sweep([Sweep::PATHS, Sweep::ROWS, Sweep::FACTOR]);
    }

    /// Poses and velocities of frames: `(q, v)` in, one [`FrameState`] for each of `frames` out.
    pub fn frame_states<'b>(
        &self,
        q: &[S],
        v: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        frames: impl Iterator<Item = (&'b TreeFrame<S>, &'b mut FrameState<S>)>,
    ) where
        S: 'b,
    {
        let given = Arguments::new(q, v, u);
        let mut cx = self.context(&given, w, Results::none());
        cx.articulate();
        cx.sweep([Sweep::VELOCITY, Sweep::PLACEMENT]);
        for (frame, out) in frames {
            *out = self.frame(frame, w);
        }
    }

    /// Jacobians of frames, `q → J`: for each of `frames` one block of `out`, `6 × nv`, row by row. `J v` is the
    /// frame's velocity `[linear; angular]` in its own axes, at its origin, as far as it comes from `v` (prescribed
    /// rates add theirs).
    pub fn jacobians<'b>(
        &self,
        q: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        frames: impl Iterator<Item = &'b TreeFrame<S>>,
        out: &mut [S],
    ) where
        S: 'b,
    {
        self.articulate(q, u.drive_q, &mut w.poses);
        let size = 6 * self.tree.dims.nv;
        for (frame, out) in frames.zip(out.chunks_mut(size.max(1))) {
            self.jacobian(frame, w, out);
        }
    }

    /// `J̇ v` and its like for each of `frames`: acceleration `[linear; angular]` at `v̇ = 0`, prescribed accelerations
    /// included. The linear part is that of the origin as the ground sees it, both are in the axes of the frame: in
    /// ground axes the frame accelerates by `R (J v̇ + bias)`.
    pub fn bias_accelerations<'b>(
        &self,
        q: &[S],
        v: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        frames: impl Iterator<Item = (&'b TreeFrame<S>, &'b mut [S; 6])>,
    ) where
        S: 'b,
    {
        let weightless = Inputs { gravity: [S::zero(); 3], ..*u };
        let given = Arguments::new(q, v, &weightless);
        let mut cx = self.context(&given, w, Results::none());
        cx.articulate();
        cx.sweep([Sweep::NEWTON]);
        for (frame, out) in frames {
            *out = self.frame_acceleration(frame, w);
        }
    }
}

/// [`Sweeps::rates`] after the joints' steps. A function of its own, to which nobody else has references:
/// so the compiler knows that the lengths of the vectors stay what they are.
#[inline(never)]
fn rates_of_steps<S: Scalar, T: Trace>(
    tree: &Tree<S>,
    trace: &T,
    given: &Arguments<'_, S>,
    w: &mut Workspace<S>,
    results: Results<'_, S>,
) {
    let sweeps = Sweeps { tree, trace };
    let mut cx = sweeps.context(given, w, results);
    match T::PLAIN {
        true => cx.run_together(SweepList::RATES),
        false => cx.run_after_steps(SweepList::RATES),
    }
}
