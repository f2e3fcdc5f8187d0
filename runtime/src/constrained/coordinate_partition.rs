//! Coordinate partitioning: minimal coordinates (thesis 5.3, C.7.1).

use alloc::vec::Vec;

use super::basic::Basic;
use super::post_step::PostStep;
use super::rows::{named, worst};
use super::ConstraintError;
use crate::integrate::Chart;
use crate::system::{system_within, Constrained, Energetic, LieJoint, Real, System};
use crate::Scalar;

/// Iterations for the dependent coordinates of one evaluation.
const ITERATIONS: u32 = 25;
/// Entries of the record that are kept.
const KEPT: usize = 1024;

/// A dependent and an independent velocity that changed places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switch {
    /// Time, s.
    pub time: f64,
    /// Index of the velocity that was dependent.
    pub dependent: usize,
    /// Index of the one that became so in its place.
    pub independent: usize,
    /// By which factor `|det Φ_d|` grew: the rate of the one by that of the other.
    pub pivot: f64,
}

/// A constrained system in minimal coordinates (5.3): method 1 in the gauge in which dependent freedoms have no
/// momenta,
///
/// `ṗ_ind = ṗ⁺_ind − Φ_indᵀ y`, `Φ_dᵀ y = ṗ⁺_dep`, `p_dep = 0`.
///
/// State and sizes are those of the constrained system, so that every method runs it; of the dependent coordinates the
/// state is no more than where Newton's method starts from at each evaluation, and `ṗ_dep = 0`. A motion is never wrong
/// for want of `p_dep = 0`: every constant `p_dep` is a gauge too.
///
/// Dependent velocities are single freedoms, chosen for each group of coupled rows by complete pivoting, with as many
/// rows as are independent; redundant ones are left out. [`Repartition`] changes the choice between steps where it has
/// become poor.
///
/// Where the dependents cannot be found, rates are not numbers, which every method reports;
/// [`CoordinatePartition::trouble`] says why.
#[derive(Clone, Debug)]
pub struct CoordinatePartition<Y: Constrained> {
    /// The system itself; inputs may be set between calls.
    pub system: Y,
    basic: Basic<Y::Scalar>,
    ratio: f64,
    residual: Y::Rows,
    entries: Y::Entries,
    q: Y::Coordinates,
    dq: Y::Momenta,
    trouble: Option<ConstraintError>,
    switches: u64,
    record: Vec<Switch>,
    /// Evaluations of `Φ`.
    closures: u64,
}

impl<Y> CoordinatePartition<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    /// Chooses dependents at a state: closes its coordinates by them, and changes its momenta to the gauge `p_dep = 0`.
    ///
    /// # Errors
    /// [`ConstraintError::NotClosed`] if the coordinates are not near closed ones, [`ConstraintError::NotFinite`].
    pub fn new(system: Y, q: &mut Y::Coordinates, p: &mut Y::Momenta) -> Result<Self, ConstraintError> {
        let mut minimal = CoordinatePartition {
            basic: Basic::new(&system),
            ratio: 2.0,
            residual: system.zero_rows(),
            entries: system.zero_entries(),
            q: q.clone(),
            dq: system.zero_momenta(),
            trouble: None,
            switches: 0,
            record: Vec::with_capacity(KEPT),
            closures: 0,
            system,
        };
        minimal.choose(q, p)?;
        Ok(minimal)
    }

    /// With the ratio `ρ > 1` of rates at which a dependent and an independent velocity change places; 2 unless given.
    /// Infinity: never.
    #[must_use]
    pub fn with_ratio(mut self, ratio: f64) -> Self {
        self.ratio = ratio.max(1.0 + 1e-6);
        self
    }

    /// Chooses dependents anew, for coordinates `q`, which are closed, and momenta `p`, which change to the new gauge.
    ///
    /// # Errors
    /// As [`CoordinatePartition::new`].
    pub fn choose(&mut self, q: &mut Y::Coordinates, p: &mut Y::Momenta) -> Result<(), ConstraintError> {
        self.look(Some(q));
        self.basic.choose();
        self.close(q)?;
        self.gauge(p);
        Ok(())
    }

    /// Takes the dependents as given, by indices of velocities, in groups of rows as far as they are enough for each;
    /// for coordinates and momenta as [`CoordinatePartition::choose`].
    ///
    /// # Errors
    /// As [`CoordinatePartition::new`], and [`ConstraintError::RankLoss`] where the other velocities do not determine
    /// these.
    pub fn choose_among(
        &mut self,
        dependents: &[usize],
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        self.look(Some(q));
        let before = self.basic.choose();
        let held: Vec<bool> = (0..p.as_ref().len()).map(|v| !dependents.contains(&v)).collect();
        self.basic.blocks.hold(&held);
        let rank = self.basic.choose();
        if rank < before || dependents.len() > rank {
            let constraint = named(&self.system, 0);
            self.choose(q, p)?;
            return Err(ConstraintError::RankLoss { constraint, rank, before });
        }
        self.close(q)?;
        self.gauge(p);
        Ok(())
    }

    /// Indices of the dependent velocities.
    pub fn dependents(&self) -> impl Iterator<Item = usize> + '_ {
        let blocks = self.basic.blocks.list.iter().zip(&self.basic.pairs);
        blocks.flat_map(|(block, pairs)| pairs.iter().map(|pair| block.columns[pair.1]))
    }

    /// Number of switches so far, and the first 1024 of them.
    pub fn switches(&self) -> (u64, &[Switch]) {
        (self.switches, &self.record)
    }

    /// Evaluations of `Φ` so far.
    pub fn closures(&self) -> u64 {
        self.closures
    }

    /// Why the last evaluation gave no numbers, if it did not.
    pub fn trouble(&self) -> Option<ConstraintError> {
        self.trouble
    }

    /// `Φ` at coordinates, or at those that are being closed.
    fn look(&mut self, q: Option<&Y::Coordinates>) {
        self.system.constraint_residuals(q.unwrap_or(&self.q), &mut self.residual, &mut self.entries);
        self.basic.blocks.fill(self.entries.as_ref());
        self.closures += 1;
    }

    /// Dependent coordinates by Newton's method from those that are given.
    ///
    /// # Errors
    /// [`ConstraintError::NotClosed`], [`ConstraintError::RankLoss`], [`ConstraintError::NotFinite`]; `q` is then as it
    /// was.
    pub fn close(&mut self, q: &mut Y::Coordinates) -> Result<(), ConstraintError> {
        self.find(q)?;
        q.as_mut().copy_from_slice(self.q.as_ref());
        Ok(())
    }

    /// As [`CoordinatePartition::close`], into `self.q`. Leaves `Φ` there, with the dependents factored.
    fn find(&mut self, start: &Y::Coordinates) -> Result<(), ConstraintError> {
        self.q.as_mut().copy_from_slice(start.as_ref());
        let epsilon = Y::Scalar::epsilon();
        let mut last = f64::INFINITY;
        for iteration in 0..=ITERATIONS {
            self.look(None);
            self.dq.as_mut().fill(Y::Scalar::zero());
            for k in 0..self.basic.pairs.len() {
                if !self.basic.factor(k) {
                    return Err(self.lost(k));
                }
                self.basic.solve(k, self.residual.as_ref(), self.dq.as_mut());
            }
            let (index, step) = worst(self.dq.as_ref());
            if !step.is_finite() {
                return Err(ConstraintError::NotFinite { index });
            }
            let step = step.to_f64();
            let size = worst(self.q.as_ref()).1.to_f64().max(1.0);
            // Round-off, or as near to it as an ill-conditioned mechanism lets.
            if step <= 8.0 * epsilon * size || (step >= 0.5 * last && last <= libm::sqrt(epsilon) * size) {
                break;
            }
            if iteration == ITERATIONS {
                return Err(self.open(iteration));
            }
            last = step;
            Chart::displace(&self.system, &mut self.dq, &mut self.q);
        }
        // Rows that were left out as redundant must be closed with the others.
        let (_, left) = worst(self.residual.as_ref());
        if left.to_f64() <= libm::sqrt(epsilon) {
            return Ok(());
        }
        Err(self.open(ITERATIONS))
    }

    fn open(&self, iterations: u32) -> ConstraintError {
        let (at, size) = worst(self.residual.as_ref());
        let rank = self.basic.pairs.iter().map(Vec::len).sum();
        let (constraint, rows) = (named(&self.system, at), self.system.rows().len());
        ConstraintError::NotClosed { constraint, residual: size.to_f64(), rank, rows, iterations }
    }

    /// A block whose dependents do not follow from the others any more.
    fn lost(&mut self, k: usize) -> ConstraintError {
        let before = self.basic.pairs[k].len();
        let kept = self.basic.pairs[k].clone();
        let rank = self.basic.choose_of(k);
        self.basic.pairs[k] = kept;
        let constraint = self.basic.blocks.list[k].rows.first().map_or(0, |row| named(&self.system, *row));
        ConstraintError::RankLoss { constraint, rank: rank.min(before.saturating_sub(1)), before }
    }

    /// Momenta in the gauge of the dependents that are factored.
    fn gauge(&mut self, p: &mut Y::Momenta) {
        for k in 0..self.basic.pairs.len() {
            self.basic.eliminate(k, p.as_mut());
        }
    }

    /// Exchanges dependents for independents that move more than `ratio` times as fast, and changes momenta that are
    /// given to the new gauge `p_dep = 0`. Whether any were.
    ///
    /// # Errors
    /// As [`CoordinatePartition::close`]; the dependents are chosen anew before.
    pub fn watch(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: Option<&mut Y::Momenta>,
    ) -> Result<bool, ConstraintError> {
        self.look(Some(q));
        let before = self.switches;
        for k in 0..self.basic.pairs.len() {
            // Every exchange multiplies |det Φ_d| by more than ρ: there are few.
            for _ in 0..64 {
                if !self.basic.factor(k) {
                    // Never in reach of a step with ρ; after a jump, or where ρ is infinite.
                    self.basic.choose_of(k);
                    self.switches += 1;
                    if !self.basic.factor(k) {
                        return Err(self.lost(k));
                    }
                }
                let (size, d, column) = self.basic.largest(k);
                if !size.is_finite() {
                    return Err(self.lost(k));
                }
                if size.to_f64() <= self.ratio {
                    break;
                }
                let (block, pairs) = (&self.basic.blocks.list[k], &mut self.basic.pairs[k]);
                let switch = Switch {
                    time: t.to_f64(),
                    dependent: block.columns[pairs[d].1],
                    independent: block.columns[column],
                    pivot: size.to_f64(),
                };
                pairs[d].1 = column;
                self.switches += 1;
                if self.record.len() < KEPT {
                    self.record.push(switch);
                }
            }
        }
        if self.switches == before {
            return Ok(false);
        }
        for k in 0..self.basic.pairs.len() {
            if !self.basic.factor(k) {
                return Err(self.lost(k));
            }
        }
        if let Some(p) = p {
            self.gauge(p);
        }
        Ok(true)
    }

    /// `q̇` at closed coordinates becomes that at others, where quaternions are.
    fn turn_rates(&mut self, q: &Y::Coordinates, qd: &mut Y::Coordinates) {
        if self.system.lie_joints().is_empty() {
            return;
        }
        let (from, v) = (qd.as_ref(), self.dq.as_mut());
        // Plain coordinates before each group, and after the last.
        let (mut at, mut to) = (0, 0);
        for group in self.system.lie_joints() {
            let n = group.v - to;
            v[to..group.v].copy_from_slice(&from[at..at + n]);
            group.body(self.q.as_ref(), from, v);
            let (nq, nv) = group.kind.sizes();
            (at, to) = (group.q + nq, group.v + nv);
        }
        v[to..].copy_from_slice(&from[at..]);
        self.system.coordinate_rates(q, &self.dq, qd);
    }
}

impl<Y> System for CoordinatePartition<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    system_within!(system: Y);

    fn lie_joints(&self) -> &[LieJoint] {
        self.system.lie_joints()
    }

    fn rates_at(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
        qd: &mut Y::Coordinates,
        pd: &mut Y::Momenta,
    ) {
        self.trouble = self.find(q).err();
        if self.trouble.is_some() {
            qd.as_mut().fill(Y::Scalar::constant(f64::NAN));
            pd.as_mut().fill(Y::Scalar::constant(f64::NAN));
            return;
        }
        self.system.rates_at(t, &self.q, p, qd, pd);
        self.turn_rates(q, qd);
        self.gauge(pd);
    }
}

impl<Y> Energetic for CoordinatePartition<Y>
where
    Y: Constrained + Energetic,
    Y::Scalar: Real,
{
    fn energies(&mut self, q: &Y::Coordinates, p: &Y::Momenta) -> (Y::Scalar, Y::Scalar) {
        self.system.energies(q, p)
    }
}

/// The [`PostStep`] of a [`CoordinatePartition`]: closes the dependents at the end of every step, and changes the
/// partition before the next one where it has become poor.
#[derive(Clone, Copy, Debug, Default)]
pub struct Repartition {
    /// Whether each step starts with `σ = 0` instead of `p_dep = 0`: `p_dep` is then that of `M v`, and constant during
    /// the step. This costs one more solve in each step. Choose it for motions through singular positions: near them the
    /// multipliers of the gauge `p_dep = 0` grow without bound, and energy is lost where a row is left out, a thousandth of
    /// it at once. Not for methods that use rates of past steps, whose gauge must not change.
    pub project_momenta: bool,
}

impl<Y> PostStep<CoordinatePartition<Y>> for Repartition
where
    Y: Constrained,
    Y::Scalar: Real,
{
    const RESTARTS: bool = true;

    fn close(
        &mut self,
        system: &mut CoordinatePartition<Y>,
        t: Y::Scalar,
        remembers: bool,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        system.close(q)?;
        if self.project_momenta {
            if !remembers {
                system.system.project_momenta(t, q, p, &mut system.dq, &mut system.residual);
            }
            return Ok(());
        }
        // Zero already, but where a rotation has mixed the components of a joint's momenta.
        system.gauge(p);
        Ok(())
    }

    fn restart(
        &mut self,
        system: &mut CoordinatePartition<Y>,
        t: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<bool, ConstraintError> {
        system.watch(t, q, if self.project_momenta { None } else { Some(p) })
    }
}
