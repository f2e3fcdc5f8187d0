//! Loops, couplings, rolling: the multipliers `σ` of the constraints are further unknowns of the sweeps.
//!
//! Momenta are the augmented ones, `p⁺ = M v + Φᵀσ` (5.7). A multiplier's column `D^σ` starts as the wrench of its row
//! at the two bodies that it binds, stays open through the sweep from tip to base like that of a shared coordinate, and
//! is eliminated where its bodies' paths have met: `M v + Φᵀσ = p⁺`, `Φ v = b` is one symmetric system, and this is its
//! elimination in the order of the tree. Where the paths have met the columns are no longer zero, although the wrenches
//! cancel there: so they cannot stop there before they are eliminated.

use super::pass::{each_node, visit_force, Context, Sweep, SweepDirection};
use super::{Quantity, Sweeps, Trace};
use crate::lists::array;
use crate::spatial::{Force, Mat3, Motion, Vec3};
use crate::system::Row;
use crate::tree::{Bond, Constraint, Cut, Source, Tree, TreeFrame, Unknown, PASSES};
use crate::workspace::{Factor, Poses, Relative, Workspace};
use crate::Scalar;
use alloc::vec::Vec;

/// What is left of an early row at least, in squares of the tolerance of other rows: 180 rounding errors in `f64`, two in `f32`.
const EARLY_TOLERANCE: f64 = 2500.0;

impl<S: Scalar> Constraint<S> {
    /// Whether its rows are constants at the one node that they act on.
    fn at_hand(&self) -> bool {
        match &self.bond {
            Bond::Cut(cut) => cut.a.node.is_none() && cut.closure.constant() && self.decay.is_none(),
            Bond::Coupling { .. } => false,
        }
    }

    /// Whether it is a joint to the ground whose rows are constants in the axes of the body. The motions that such a
    /// joint leaves free form a group, so `Ω × E_c` does no work on any of them. It changes nothing but the multiplier
    /// `σ`, which is a gauge variable, and need not be computed.
    pub(super) fn gauge(&self) -> bool {
        let held = self.decay.is_none() && self.compliance.is_none();
        matches!(&self.bond, Bond::Cut(cut) if held && cut.a.node.is_none() && cut.closure.is_joint())
    }

    /// Whether its part of `ṗ` follows from `p = ∂L/∂v` with `L = ½ vᵀM v + σᵀΦ v`: then its part of the derivatives has
    /// the canonical symmetry.
    pub(super) fn canonical(&self) -> bool {
        match &self.bond {
            Bond::Cut(cut) => self.gauge() || self.decay.is_none() && cut.closure.exact(),
            Bond::Coupling { .. } => self.decay.is_none(),
        }
    }

    /// Whether row `k` is the derivative of a condition on positions.
    pub(super) fn holonomic(&self, k: usize) -> bool {
        match &self.bond {
            Bond::Cut(cut) => cut.closure.holonomic(k),
            Bond::Coupling { .. } => true,
        }
    }

    /// Whether the residual of row `k` is an angle; others are lengths, or one number in the unit of a coupling.
    fn is_rotation(&self, k: usize) -> bool {
        match &self.bond {
            Bond::Cut(cut) => cut.closure.is_rotation(k),
            Bond::Coupling { .. } => false,
        }
    }

    /// Whether it binds two frames.
    fn is_cut(&self) -> bool {
        matches!(self.bond, Bond::Cut(_))
    }

    /// Its rows with their places among the unknowns: those of every pass where rows are eliminated in passes.
    fn places(&self) -> impl Iterator<Item = (usize, &usize)> {
        self.passes.iter().chain([&self.slots]).flat_map(|slots| self.range().zip(slots))
    }

    /// Its rows.
    pub(super) fn range(&self) -> core::ops::Range<usize> {
        self.first..self.first + self.slots.len()
    }
}

impl<S> Cut<S> {
    /// The node that it binds to the ground, and the wrench there of those at both ends; `None` where it binds two nodes.
    fn end_at_ground(&self, ends: (Force<S>, Force<S>)) -> Option<(usize, Force<S>)> {
        let (a, b) = (self.a.node.map(|i| (i, ends.0)), self.b.node.map(|i| (i, ends.1)));
        a.xor(b)
    }
}

/// Visits the wrenches of loops through the ground that come to a node.
fn visit_grounded<S, T>(cx: &mut Context<'_, S, T>, i: usize, visit: &mut dyn FnMut(&mut S)) {
    let grounded = |c: &Constraint<S>| matches!(&c.bond, Bond::Cut(cut) if cut.grounded);
    if cx.sweeps.tree.constraints.iter().any(grounded) {
        visit_force(&mut cx.w.constraints.to_ground[i], visit);
    }
}

impl<S: Scalar> Tree<S> {
    /// The constraint that a row belongs to.
    fn constraint_of(&self, row: usize) -> &Constraint<S> {
        let at = self.constraints.partition_point(|c| c.first + c.slots.len() <= row);
        &self.constraints[at]
    }

    /// Rows of the constraints, and where their entries of `Φ` stand.
    pub fn rows(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        let mut first = 0;
        for (index, constraint) in self.constraints.iter().enumerate() {
            let len = constraint.velocities.len();
            for k in 0..constraint.slots.len() {
                rows.push(Row { constraint: index, holonomic: constraint.holonomic(k), first, len });
                first += len;
            }
        }
        rows
    }

    /// Velocity index of every entry of `Φ`.
    pub fn entry_columns(&self) -> Vec<usize> {
        let rows = self.constraints.iter().flat_map(|c| c.slots.iter().map(move |_| c));
        rows.flat_map(|c| c.velocities.iter().copied()).collect()
    }
}

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// Poses of the frames of cuts along the paths to them, where rows or `b` depend on these (`ALL`: of all cuts).
    pub(super) const fn paths<const ALL: bool>() -> Self {
        Sweep {
            needed: |tree| !T::PLAIN && tree.constraints.iter().any(|c| c.is_cut() && (ALL || !c.at_hand())),
            begin: |cx| cx.sweeps.reach_begin(cx.w),
            running: |cx, visit| {
                let ends = cx.w.constraints.reach.iter_mut().flatten();
                ends.flat_map(|(rot, pos)| rot.iter_mut().flatten().chain(pos)).for_each(visit);
            },
            ..each_node!(BaseToTip, |cx, i| cx.sweeps.reach_node(i, ALL, cx.w))
        }
    }

    /// Rows of the constraints, after [`Sweep::paths`], in the same pass. Visits no node.
    pub(super) const fn rows<const ALL: bool>() -> Self {
        Sweep {
            needed: |tree| !T::PLAIN && !tree.constraints.is_empty(),
            // Rows that are constants of the body at the end of a chain: nothing pulls at its joints as they turn.
            rolls: |tree| tree.constraints.iter().all(Constraint::gauge),
            end: |cx| cx.sweeps.set_rows(cx.w, ALL),
            ..Sweep::idle(SweepDirection::BaseToTip)
        }
    }

    /// Multipliers out of the velocities. Visits no node.
    pub(super) const MULTIPLIERS: Self = Sweep {
        needed: |tree| !T::PLAIN && !tree.constraints.is_empty(),
        end: |cx| {
            let w = &mut *cx.w;
            cx.sweeps.collect_multipliers(&w.velocity.unknown_rate, &mut w.constraints.multipliers);
        },
        ..Sweep::idle(SweepDirection::BaseToTip)
    };

    /// Joint forces of constraints whose rows turn, after [`Sweep::MULTIPLIERS`].
    pub(super) const CONSTRAINT_FORCES: Self = Sweep {
        needed: |tree| !T::PLAIN && !tree.constraints.iter().all(Constraint::gauge),
        begin: |cx| cx.sweeps.constraint_forces(cx.w),
        carried: |cx, i, visit| visit_grounded(cx, i, visit),
        ..each_node!(TipToBase, |cx, i| cx.sweeps.constraint_force_node(i, cx.w))
    };

    /// Momenta without the multipliers, `p⁺ − Φᵀσ`, after the velocities.
    pub(super) const FREED_MOMENTA: Self = Sweep {
        begin: |cx| {
            cx.results.p.copy_from_slice(cx.given.second);
            cx.sweeps.freed_begin(cx.w);
        },
        carried: |cx, i, visit| visit_grounded(cx, i, visit),
        running: |cx, visit| cx.w.constraints.end_wrenches.iter_mut().flatten().for_each(|f| visit_force(f, visit)),
        ..each_node!(TipToBase, |cx, i| cx.sweeps.freed_node(i, cx.w, cx.results.p))
    };
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Before the first [`Sweeps::reach_node`].
    fn reach_begin(&self, w: &mut Workspace<S>) {
        let (o, one) = (S::zero(), S::one());
        let start = [([[one, o, o], [o, one, o], [o, o, one]], [o; 3]); 2];
        if !self.leaves_out(w) {
            return w.constraints.reach.fill(start);
        }
        let each = w.constraints.reach.iter_mut().zip(&w.constraints.left_out);
        each.filter(|(_, left_out)| !**left_out).for_each(|(reach, _)| *reach = start);
    }

    /// The steps from its parent to node `i` in the paths of the cuts that go through it, after its parent. Relative
    /// poses are left out where neither rows nor `b` ask for them, unless `all` are wanted.
    fn reach_node(&self, i: usize, all: bool, w: &mut Workspace<S>) {
        self.trace.at(Some(i), Quantity::Constraint);
        for &(index, side) in &w.constraints.through[i] {
            let constraint = &self.tree.constraints[index];
            let known = constraint.is_cut() && (all || !constraint.at_hand());
            if known && !w.constraints.left_out[index] {
                let (rot, pos) = &mut w.constraints.reach[index][side];
                self.steps(&w.poses, i).iter().for_each(|step| step.pose(rot, pos));
            }
        }
    }

    /// Rows of the constraints and `b` of each from its decay, the paths of the cuts being known that
    /// [`Sweeps::reach_node`] has followed.
    fn set_rows(&self, w: &mut Workspace<S>, all: bool) {
        for (index, constraint) in self.tree.constraints.iter().enumerate() {
            if w.constraints.left_out[index] {
                continue;
            }
            self.trace.at(None, Quantity::Constraint);
            match &constraint.bond {
                Bond::Cut(cut) => self.cut_rows(index, constraint, cut, w, all || !constraint.at_hand()),
                Bond::Coupling { terms, offset } => {
                    let sum = terms.iter().map(|(i, ratio)| *ratio * w.poses.coordinate(*i, 0));
                    let residual = sum.fold(-*offset, |sum, x| sum + x);
                    w.constraints.rows[constraint.first].residual = self.if_acts(constraint.first, residual);
                }
            }
            for r in constraint.range() {
                let decay = constraint.decay.filter(|_| constraint.holonomic(r - constraint.first));
                w.constraints.rhs[r] = decay.map_or(S::zero(), |rate| -(rate * w.constraints.rows[r].residual));
            }
        }
    }

    /// Rows of a cut, in its second frame and at the nodes; residuals if the relative pose is `known`.
    fn cut_rows(&self, index: usize, constraint: &Constraint<S>, cut: &Cut<S>, w: &mut Workspace<S>, known: bool) {
        let (mut at, mut residuals) = (w.constraints.relative[index], [S::zero(); 6]);
        if known {
            at = self.relative(cut, w.constraints.reach[index], &w.poses);
            residuals = cut.closure.residuals(&at);
        }
        let directions = match constraint.own_axes {
            true => cut.closure.directions_in_own_axes(&at),
            false => cut.closure.directions(&at),
        };
        w.constraints.relative[index] = at;
        for (k, r) in constraint.range().enumerate() {
            if self.leaves_out_row(w, r) {
                continue;
            }
            let row = &mut w.constraints.rows[r];
            (row.e, row.residual) = (directions[k], self.if_acts(constraint.first, residuals[k]));
            (row.at_a, row.at_b) = self.at_nodes(cut, &at, &directions[k], &w.poses);
        }
    }

    /// Pose of the first frame in the second, by way of the innermost common node.
    fn relative(&self, cut: &Cut<S>, reach: [(Mat3<S>, Vec3<S>); 2], poses: &Poses<S>) -> Relative<S> {
        let [mut a, mut b] = reach;
        for (frame, (rot, pos)) in [(&cut.a, &mut a), (&cut.b, &mut b)] {
            self.on_body(poses, frame).for_each(|step| step.pose(rot, pos));
        }
        let ((ra, pa), (rb, pb)) = (a, b);
        let way: Vec3<S> = array(|k| pb[k] - pa[k]);
        let along = |k: usize, x: Vec3<S>| rb[0][k] * x[0] + rb[1][k] * x[1] + rb[2][k] * x[2];
        let turn = array(|i| array(|k| along(i, [ra[0][k], ra[1][k], ra[2][k]])));
        Relative { turn, d: array(|i| along(i, way)) }
    }

    /// A wrench on the second frame and its opposite on the first, at their nodes.
    fn at_nodes(&self, cut: &Cut<S>, at: &Relative<S>, f: &Force<S>, poses: &Poses<S>) -> (Force<S>, Force<S>) {
        let a = at.force(f).times(-S::one());
        let node = |frame: &TreeFrame<S>, f: Force<S>| self.on_body(poses, frame).rev().fold(f, |f, s| s.force(&f));
        (node(&cut.a, a), node(&cut.b, *f))
    }

    /// Columns `D^σ` at the nodes where they start.
    pub(super) fn seed_columns(&self, rows: &[crate::workspace::RowState<S>], f: &mut Factor<S>) {
        let n = self.tree.nodes.len();
        for constraint in &self.tree.constraints {
            let Bond::Cut(cut) = &constraint.bond else { continue };
            for (r, &g) in constraint.places() {
                for (node, seed) in [(cut.a.node, rows[r].at_a), (cut.b.node, rows[r].at_b)] {
                    if let Some(i) = node {
                        f.columns[g * n + i] = f.columns[g * n + i].plus(&seed);
                    }
                }
            }
        }
    }

    /// Ratio with which the freedom of node `i` enters the coupling of unknown `g`; zero for all else.
    pub(super) fn coupled(&self, i: usize, g: usize) -> S {
        let Unknown::Row(r) = self.tree.unknowns[g] else { return S::zero() };
        match &self.tree.constraint_of(r).bond {
            Bond::Coupling { terms, .. } => terms.iter().find(|(node, _)| *node == i).map_or(S::zero(), |(_, a)| *a),
            Bond::Cut(_) => S::zero(),
        }
    }

    /// What couplings add to the momentum of the freedom of node `i`.
    pub(super) fn coupled_momentum(&self, i: usize, multipliers: &[S]) -> S {
        let mut sum = S::zero();
        for constraint in &self.tree.constraints {
            let Bond::Coupling { terms, .. } = &constraint.bond else { continue };
            for (_, ratio) in terms.iter().filter(|(node, _)| *node == i) {
                sum = sum + *ratio * multipliers[constraint.first];
            }
        }
        sum
    }

    /// Reciprocal pivot of row `r`, the unknown `g`: negative, or zero where the row is redundant. It is redundant if
    /// what is left of its diagonal is too small a part of the diagonals at first of all rows of its constraint with
    /// its unit: it follows from rows before it, or its bodies cannot move along it. Its own diagonal alone is no
    /// measure: where bars come to lie in one line, a row may vanish together with it. Where the bodies can move along
    /// none of the rows, all diagonals are rounding errors; the `1` compares them with what a body of 1 kg or 1 kg m²
    /// would give. All passes but the last leave more rows out, which wait for the next ones. Early rows are left out next to
    /// rounding errors only: legs that cannot follow a row for a moment are no reason to let go of it.
    pub(super) fn row_pivot(&self, g: usize, r: usize, f: &Factor<S>) -> S {
        let ng = self.tree.unknowns.len();
        let tolerance = self.tree.tolerance;
        let constraint = self.tree.constraint_of(r);
        let own = constraint.is_rotation(r - constraint.first);
        let (mut alike, mut all) = (S::zero(), S::zero());
        for (k, &h) in constraint.slots.iter().enumerate() {
            let whole = self.if_acts(constraint.first + k, f.whole[h]);
            all = all + whole;
            if constraint.is_rotation(k) == own {
                alike = alike + whole;
            }
        }
        let part = match (f.early[g], self.tree.early_tolerance) {
            (true, Some(part)) => S::constant(part),
            (true, None) => S::constant(EARLY_TOLERANCE) * (tolerance * tolerance),
            (false, _) => tolerance,
        };
        let mut floor = part * (alike + tolerance * (all + S::one()));
        if let Some((part, _)) = PASSES.iter().zip(&constraint.passes).find(|(_, slots)| slots.contains(&g)) {
            floor = floor + S::constant(*part) * f.whole[g];
        }
        self.if_acts(r, -(-f.gram[g * ng + g]).reciprocal_above(floor))
    }

    /// 1 where no early row has been left out, up to rounding errors; 0 where one has. After the factorization.
    pub fn early_rows_act(&self, f: &Factor<S>) -> S {
        let ng = self.tree.unknowns.len();
        let early = (0..ng).filter(|&g| f.early[g]);
        early.fold(S::one(), |product, g| product * (f.gram[g * ng + g] * f.unknown_pivots[g].rho))
    }

    /// `x` where row `r` acts, zero where it does not.
    pub(super) fn if_acts(&self, r: usize, x: S) -> S {
        self.tree.row_factors.as_ref().map_or(x, |factors| factors[r] * x)
    }

    /// Compliance of row `r`.
    pub(super) fn compliance(&self, r: usize) -> S {
        // Eliminations are tried on parts of a tree, which have rows of constraints that are not their own.
        let at = self.tree.constraints.partition_point(|c| c.range().end <= r);
        let own = self.tree.constraints.get(at).filter(|c| c.range().contains(&r));
        own.and_then(|c| c.compliance).unwrap_or(S::zero())
    }

    /// Multipliers out of a solution, in [`crate::workspace::Constraints::multipliers`].
    pub(super) fn collect_multipliers(&self, solved: &[S], out: &mut [S]) {
        for constraint in &self.tree.constraints {
            for (r, &g) in constraint.range().zip(&constraint.slots) {
                // A row has a multiplier in one of its passes at most.
                let others = constraint.passes.iter().map(|slots| solved[slots[r - constraint.first]]);
                out[r] = others.fold(solved[g], |sum, x| sum + x);
            }
        }
    }

    /// Calls `visit` with every velocity that a constraint binds and what a wrench `f` on its second frame, the
    /// opposite on its first, is along it.
    fn along_loop(&self, cut: &Cut<S>, ends: (Force<S>, Force<S>), poses: &Poses<S>, mut visit: impl FnMut(usize, S)) {
        for (path, f) in [(&cut.path_a, ends.0), (&cut.path_b, ends.1)] {
            path.iter().rev().fold(f, |f, &i| self.along_joint(i, &f, poses, &mut visit));
        }
    }

    /// Calls `visit` with the velocities of node `i` and what a wrench `f` on it is along them; gives `f` on its
    /// parent.
    fn along_joint(&self, i: usize, f: &Force<S>, poses: &Poses<S>, visit: &mut impl FnMut(usize, S)) -> Force<S> {
        let node = &self.tree.nodes[i];
        if let Source::State { v, .. } = node.source {
            (0..node.kind.nv()).for_each(|k| visit(v + k, node.ratio * node.kind.axis(k).dot(f)));
        }
        self.steps(poses, i).force(*f)
    }

    /// `Eᵀ` of the wrenches that constraints put on the bodies of their loops as their directions turn,
    /// `E_c° σ = (Ė_c + Ω_C × E_c) σ`, in [`crate::workspace::Constraints::forces`]; after the velocities. Those of loops
    /// through the ground are still at the ends of the loops.
    fn constraint_forces(&self, w: &mut Workspace<S>) {
        w.constraints.forces.fill(S::zero());
        w.constraints.to_ground.fill(Force::zero());
        for (index, constraint) in self.tree.constraints.iter().enumerate() {
            let Bond::Cut(cut) = &constraint.bond else { continue };
            if constraint.gauge() {
                continue;
            }
            self.trace.at(None, Quantity::Constraint);
            let at = w.constraints.relative[index];
            let [a, b] = [&cut.a, &cut.b].map(|frame| self.frame_motion(frame, w));
            let first = at.motion(&a);
            let mut own = Force::zero();
            for r in constraint.range() {
                own = own.plus(&w.constraints.rows[r].e.times(w.constraints.multipliers[r]));
            }
            let total = if cut.closure.turns_with_first() {
                // Ė_c = −(Ω_C − Ω_A) × E_c for the angular velocities: only the turning of the first body is left.
                Motion { lin: b.lin, ang: first.ang }.cross_force(&own)
            } else {
                let rates = cut.closure.direction_rates(&at, &difference(&b, &first));
                let turning = constraint
                    .range()
                    .zip(rates)
                    .fold(Force::zero(), |sum, (r, rate)| sum.plus(&rate.times(w.constraints.multipliers[r])));
                match cut.b.node.is_some() {
                    true => turning.plus(&b.cross_force(&own)),
                    false => turning,
                }
            };
            let ends = self.at_nodes(cut, &at, &total, &w.poses);
            let constraints = &mut w.constraints;
            match cut.end_at_ground(ends) {
                Some((node, f)) => constraints.to_ground[node] = constraints.to_ground[node].plus(&f),
                None => {
                    let forces = &mut constraints.forces;
                    self.along_loop(cut, ends, &w.poses, |v, f| forces[v] = forces[v] + f);
                }
            }
        }
    }

    /// Wrenches of loops through the ground along the freedoms of node `i`, after its children.
    fn constraint_force_node(&self, i: usize, w: &mut Workspace<S>) {
        let mut forces = core::mem::take(&mut w.constraints.forces);
        self.grounded_node(i, w, &mut |v, f| forces[v] = forces[v] + f);
        w.constraints.forces = forces;
    }

    /// Calls `visit` with the velocities of node `i` and what the wrenches of loops through the ground are along them, after its
    /// children; hands these wrenches to its parent.
    fn grounded_node(&self, i: usize, w: &mut Workspace<S>, visit: &mut impl FnMut(usize, S)) {
        if !w.constraints.grounded[i] {
            return;
        }
        self.trace.at(Some(i), Quantity::Constraint);
        let f = self.along_joint(i, &w.constraints.to_ground[i], &w.poses, visit);
        if let Some(parent) = self.tree.nodes[i].parent {
            w.constraints.to_ground[parent] = w.constraints.to_ground[parent].plus(&f);
        }
    }

    /// Columns of the rows where they begin, times multipliers: momenta `D^σ σ`, or wrenches that bodies need against
    /// those of the constraints; added to [`Workspace::force`].
    pub(super) fn add_seeds(&self, w: &mut Workspace<S>) {
        for constraint in &self.tree.constraints {
            let Bond::Cut(cut) = &constraint.bond else { continue };
            for r in constraint.range() {
                let (row, sigma) = (&w.constraints.rows[r], w.constraints.multipliers[r]);
                for (node, seed) in [(cut.a.node, row.at_a), (cut.b.node, row.at_b)] {
                    if let Some(i) = node {
                        w.force[i] = w.force[i].plus(&seed.times(sigma));
                    }
                }
            }
        }
    }

    /// Motion of a frame in its own axes, after a velocity sweep.
    pub(super) fn frame_motion(&self, frame: &TreeFrame<S>, w: &Workspace<S>) -> Motion<S> {
        let outer = frame.node.map_or(Motion::zero(), |i| w.velocity.omega[i]);
        self.on_body(&w.poses, frame).fold(outer, |m, step| step.motion(&m))
    }

    /// Before the first [`Sweeps::freed_node`], after the velocities: the negative multipliers, and their wrenches at
    /// the ends of cuts.
    fn freed_begin(&self, w: &mut Workspace<S>) {
        self.collect_multipliers(&w.velocity.unknown_rate, &mut w.constraints.multipliers);
        w.constraints.multipliers.iter_mut().for_each(|x| *x = -*x);
        w.constraints.to_ground.fill(Force::zero());
        for (index, constraint) in self.tree.constraints.iter().enumerate() {
            let Bond::Cut(cut) = &constraint.bond else { continue };
            self.trace.at(None, Quantity::Constraint);
            let (rows, multipliers) = (&w.constraints.rows, &w.constraints.multipliers);
            let sum = |of: fn(&crate::workspace::RowState<S>) -> Force<S>| {
                let each = constraint.range().map(|r| of(&rows[r]).times(multipliers[r]));
                each.fold(Force::zero(), |sum, f| sum.plus(&f))
            };
            let ends = (sum(|row| row.at_a), sum(|row| row.at_b));
            match cut.end_at_ground(ends) {
                Some((node, f)) => w.constraints.to_ground[node] = w.constraints.to_ground[node].plus(&f),
                None => w.constraints.end_wrenches[index] = [ends.0, ends.1],
            }
        }
    }

    /// `Φᵀ` times the multipliers of [`Sweeps::freed_begin`] along the freedoms of node `i`, added to `p`, after its
    /// children.
    fn freed_node(&self, i: usize, w: &mut Workspace<S>, p: &mut [S]) {
        self.grounded_node(i, w, &mut |v, x| p[v] = p[v] + x);
        self.trace.at(Some(i), Quantity::Constraint);
        for &(index, part) in &w.constraints.through[i] {
            let constraint = &self.tree.constraints[index];
            match &constraint.bond {
                Bond::Cut(cut) if cut.grounded => {}
                Bond::Cut(_) => {
                    let f = &mut w.constraints.end_wrenches[index][part];
                    *f = self.along_joint(i, f, &w.poses, &mut |v, x| p[v] = p[v] + x);
                }
                Bond::Coupling { terms, .. } => {
                    if let Source::State { v, .. } = self.tree.nodes[i].source {
                        p[v] = p[v] + terms[part].1 * w.constraints.multipliers[constraint.first];
                    }
                }
            }
        }
    }

    /// The constraints that are not left out, with their numbers.
    fn wanted<'a>(&'a self, w: &'a Workspace<S>) -> impl Iterator<Item = (usize, &'a Constraint<S>)> {
        let all = self.tree.constraints.iter().enumerate();
        all.filter(|(index, _)| !w.constraints.left_out[*index])
    }

    /// Whether some rows are left out: their results are not touched then. That is worth its code for shapes with many corners
    /// only.
    fn leaves_out(&self, w: &Workspace<S>) -> bool {
        cfg!(feature = "hulls") && w.constraints.rows_left_out.contains(&true)
    }

    /// Whether row `r` is left out.
    fn leaves_out_row(&self, w: &Workspace<S>, r: usize) -> bool {
        cfg!(feature = "hulls") && w.constraints.rows_left_out[r]
    }

    /// Entries of `Φ`, placed as [`Tree::entry_columns`] says, after the rows.
    pub(super) fn row_entries(&self, w: &Workspace<S>, entries: &mut [S]) {
        let parts = self.leaves_out(w);
        if !parts {
            entries.fill(S::zero());
        }
        for (_, constraint) in self.wanted(w) {
            let bound = &constraint.velocities;
            self.trace.at(None, Quantity::Constraint);
            for (k, r) in constraint.range().enumerate() {
                if self.leaves_out_row(w, r) {
                    continue;
                }
                let first = constraint.entry + k * bound.len();
                let entries = &mut entries[first..first + bound.len()];
                if parts {
                    entries.fill(S::zero());
                }
                let mut put = |v: usize, x: S| {
                    if let Ok(at) = bound.binary_search(&v) {
                        entries[at] = entries[at] + self.if_acts(constraint.first, x);
                    }
                };
                match &constraint.bond {
                    Bond::Cut(cut) => {
                        let row = &w.constraints.rows[r];
                        self.along_loop(cut, (row.at_a, row.at_b), &w.poses, put);
                    }
                    Bond::Coupling { terms, .. } => {
                        for (i, ratio) in terms {
                            if let Source::State { v, .. } = self.tree.nodes[*i].source {
                                put(v, *ratio);
                            }
                        }
                    }
                }
            }
        }
    }

    /// Velocities of the rows after a velocity sweep: of cuts along their directions, of couplings from the rates of
    /// their nodes.
    pub(super) fn velocities_of_rows(&self, w: &Workspace<S>, out: &mut [S]) {
        let parts = self.leaves_out(w);
        if !parts {
            out.fill(S::zero());
        }
        for (index, constraint) in self.wanted(w) {
            match &constraint.bond {
                Bond::Cut(cut) => {
                    let at = &w.constraints.relative[index];
                    let [a, b] = [&cut.a, &cut.b].map(|frame| self.frame_motion(frame, w));
                    let relative = difference(&b, &at.motion(&a));
                    for r in constraint.range().filter(|r| !self.leaves_out_row(w, *r)) {
                        out[r] = w.constraints.rows[r].e.dot(&relative);
                    }
                }
                Bond::Coupling { terms, .. } => {
                    let r = constraint.first;
                    if parts {
                        out[r] = S::zero();
                    }
                    for (i, ratio) in terms {
                        out[r] = out[r] + *ratio * w.velocity.rate[w.first[*i]];
                    }
                }
            }
        }
    }

    /// Residuals of the positions.
    pub(super) fn residuals(&self, w: &Workspace<S>, phi: &mut [S]) {
        if self.leaves_out(w) {
            let rows = self.wanted(w).flat_map(|(_, constraint)| constraint.range());
            let rows = rows.filter(|r| !self.leaves_out_row(w, *r));
            return rows.for_each(|r| phi[r] = w.constraints.rows[r].residual);
        }
        for (phi, row) in phi.iter_mut().zip(&w.constraints.rows) {
            *phi = row.residual;
        }
    }

    /// The multipliers `σ` after [`Sweeps::freed_begin`].
    pub(super) fn projected_multipliers(&self, w: &Workspace<S>, sigma: &mut [S]) {
        for (sigma, x) in sigma.iter_mut().zip(&w.constraints.multipliers) {
            *sigma = -*x;
        }
    }

    /// Right-hand sides that remove the residuals.
    pub(super) fn aim_at_closed(&self, w: &mut Workspace<S>) {
        for (b, row) in w.constraints.rhs.iter_mut().zip(&w.constraints.rows) {
            *b = -row.residual;
        }
    }

    /// Pivots of `Φ M⁻¹Φᵀ`, zero where a row was left out.
    pub(super) fn row_pivots(&self, w: &Workspace<S>, pivots: &mut [S]) {
        let ng = self.tree.unknowns.len();
        pivots.fill(S::zero());
        for (r, &g) in self.tree.constraints.iter().flat_map(Constraint::places) {
            // The product x · (ρ x) is zero where the row was left out, in all passes but one at least.
            let x = w.factor.gram[g * ng + g];
            pivots[r] = pivots[r] + x * (w.factor.unknown_pivots[g].rho * -x);
        }
    }
}

/// Difference of two motions.
pub(super) fn difference<S: Scalar>(a: &Motion<S>, b: &Motion<S>) -> Motion<S> {
    let minus = |a: Vec3<S>, b: Vec3<S>| array(|k| a[k] - b[k]);
    Motion { lin: minus(a.lin, b.lin), ang: minus(a.ang, b.ang) }
}
