//! The linear problems that the sweeps solve: where each keeps its right-hand side and its solution.
//!
//! For velocities the right-hand side is `p` and nothing else. For accelerations it is the joint force, and every body
//! starts with the wrench that it needs for a reference motion (`acceleration.rs`). For the correction of positions it
//! is zero, and the rows of the constraints ask for the negative of their residuals. For derivatives of mechanisms with
//! constraints it is a column of partial derivatives (`derivatives/closed.rs`).

use super::pass::{each_node, visit_force, visit_motion, visit_rows, Arguments, Context, Sweep};
use super::{Quantity, Trace};
use crate::spatial::Force;
use crate::workspace::{Factor, Poses, Solution, Workspace};
use crate::Scalar;

/// A right-hand side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load<'a, S> {
    /// For each velocity index: momentum or joint force.
    pub p: &'a [S],
    /// For each prescribed freedom: rate or acceleration.
    pub drive: &'a [S],
    /// `D` of every body by itself.
    pub seeds: Option<&'a [Force<S>]>,
    /// For each row of the constraints: what their motion is to be.
    pub rows: &'a [S],
    /// What the motion is, for the listener.
    pub what: Quantity,
}

impl<S> Load<'_, S> {
    /// Letters of `Ω̂`, `Ω` and the rates, or of what takes their place.
    pub(super) fn letters(&self) -> [&'static str; 3] {
        match self.what {
            Quantity::Velocity => ["hat", "omega", "v"],
            Quantity::Acceleration => ["hatd", "omegad", "a"],
            _ => ["hatx", "omegax", "dq"],
        }
    }
}

/// A linear problem in parts that can be borrowed together.
pub(super) struct Problem<'a, S> {
    poses: &'a Poses<S>,
    first: &'a [usize],
    factor: &'a Factor<S>,
    load: Load<'a, S>,
    solution: &'a mut Solution<S>,
}

/// One of the linear problems.
pub(super) trait Level {
    /// Makes the right-hand side ready.
    fn begin<S: Scalar, T: Trace>(_: &mut Context<'_, S, T>) {}

    /// Its parts.
    fn problem<'b, S: Scalar>(given: &'b Arguments<'_, S>, w: &'b mut Workspace<S>) -> Problem<'b, S>;
}

/// Momenta to velocities, with the prescribed rates and `b` of the constraints.
pub(super) struct VelocityLevel;

/// Joint forces to accelerations on top of a reference motion, which has the prescribed accelerations already.
pub(super) struct AccelerationLevel;

/// Residuals of the constraints to the change of the coordinates that takes them away.
pub(super) struct PositionLevel;

/// Right-hand sides of one column of the derivatives to the column; the prescribed motions do not change.
pub(super) struct ColumnLevel;

impl Level for VelocityLevel {
    #[inline(always)]
    fn problem<'b, S: Scalar>(given: &'b Arguments<'_, S>, w: &'b mut Workspace<S>) -> Problem<'b, S> {
        let (p, drive, rows) = (given.second, given.inputs.drive_v, w.constraints.rhs.as_slice());
        let load = Load { p, drive, seeds: None, rows, what: Quantity::Velocity };
        Problem { poses: &w.poses, first: &w.first, factor: &w.factor, load, solution: &mut w.velocity }
    }
}

impl Level for AccelerationLevel {
    fn begin<S: Scalar, T: Trace>(cx: &mut Context<'_, S, T>) {
        for (f, tau) in cx.w.generalized.iter_mut().zip(cx.given.inputs.tau) {
            *f = *f + *tau;
        }
        cx.w.drive.fill(S::zero());
    }

    #[inline(always)]
    fn problem<'b, S: Scalar>(_: &'b Arguments<'_, S>, w: &'b mut Workspace<S>) -> Problem<'b, S> {
        let (p, drive, rows) = (w.generalized.as_slice(), w.drive.as_slice(), w.constraints.rhs.as_slice());
        let load = Load { p, drive, seeds: Some(&w.force), rows, what: Quantity::Acceleration };
        Problem { poses: &w.poses, first: &w.first, factor: &w.factor, load, solution: &mut w.acceleration }
    }
}

impl Level for PositionLevel {
    fn begin<S: Scalar, T: Trace>(cx: &mut Context<'_, S, T>) {
        cx.sweeps.aim_at_closed(cx.w);
        cx.w.generalized.fill(S::zero());
        cx.w.drive.fill(S::zero());
    }

    #[inline(always)]
    fn problem<'b, S: Scalar>(_: &'b Arguments<'_, S>, w: &'b mut Workspace<S>) -> Problem<'b, S> {
        let (p, drive, rows) = (w.generalized.as_slice(), w.drive.as_slice(), w.constraints.rhs.as_slice());
        let load = Load { p, drive, seeds: None, rows, what: Quantity::Constraint };
        Problem { poses: &w.poses, first: &w.first, factor: &w.factor, load, solution: &mut w.velocity }
    }
}

impl Level for ColumnLevel {
    fn begin<S: Scalar, T: Trace>(cx: &mut Context<'_, S, T>) {
        cx.w.drive.fill(S::zero());
    }

    #[inline(always)]
    fn problem<'b, S: Scalar>(given: &'b Arguments<'_, S>, w: &'b mut Workspace<S>) -> Problem<'b, S> {
        let (p, drive, rows) = (given.second, w.drive.as_slice(), w.constraints.rhs.as_slice());
        let load = Load { p, drive, seeds: None, rows, what: Quantity::Derivative };
        Problem { poses: &w.poses, first: &w.first, factor: &w.factor, load, solution: &mut w.acceleration }
    }
}

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// `D`, `D'` (4.49, 4.45) and `(p − d) / Mj`.
    pub(super) const fn bias_momentum<L: Level>() -> Self {
        Sweep {
            begin: |cx| {
                L::begin(cx);
                let x = L::problem(cx.given, cx.w);
                cx.sweeps.bias_momentum_begin(&x.load, x.solution);
            },
            end: |cx| {
                if cx.sweeps.has_unknowns() {
                    let x = L::problem(cx.given, cx.w);
                    cx.sweeps.bias_momentum_ground(x.factor, &x.load, x.solution);
                }
            },
            carried: |cx, i, visit| visit_force(&mut L::problem(cx.given, cx.w).solution.d[i], visit),
            running: |cx, visit| {
                visit_rows(cx.sweeps.tree, &mut L::problem(cx.given, cx.w).solution.unknown_rate, visit);
            },
            ..each_node!(TipToBase, |cx, i| let x = L::problem(cx.given, cx.w);
                cx.sweeps.bias_momentum_node(i, x.poses, x.first, x.factor, &x.load, x.solution))
        }
    }

    /// `Ω̂`, rates (4.40) and `Ω`.
    pub(super) const fn motion<L: Level>() -> Self {
        Sweep {
            begin: |cx| {
                if cx.sweeps.has_unknowns() {
                    let x = L::problem(cx.given, cx.w);
                    cx.sweeps.motion_ground(x.factor, &x.load, x.solution);
                }
            },
            carried: |cx, i, visit| visit_motion(&mut L::problem(cx.given, cx.w).solution.omega[i], visit),
            running: |cx, visit| {
                visit_rows(cx.sweeps.tree, &mut L::problem(cx.given, cx.w).solution.unknown_rate, visit);
            },
            ..each_node!(BaseToTip, |cx, i| let x = L::problem(cx.given, cx.w);
                cx.sweeps.motion_node(i, x.poses, x.first, x.factor, &x.load, x.solution))
        }
    }

    /// The solution put into the results, one number for each velocity.
    pub(super) const fn collect<L: Level>() -> Self {
        Sweep {
            ..each_node!(BaseToTip, |cx, i| let x = L::problem(cx.given, cx.w);
                cx.sweeps.collect_rate_node(i, x.solution, x.first, cx.results.v))
        }
    }
}
