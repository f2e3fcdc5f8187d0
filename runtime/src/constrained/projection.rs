//! Projection of states onto the constraints at the ends of steps.

use super::correction::{Corrector, Effort, SingularPosition, Stabilisation};
use super::post_step::PostStep;
use super::rows::{add_forces, named, worst};
use super::ConstraintError;
use crate::integrate::Chart;
use crate::system::{Constrained, Real};
use crate::Scalar;

/// Projects the state onto the constraints where a step ends: the [`PostStep`] of any method. Momenta are
/// projected first. Then positions are corrected with the momenta unchanged, which changes the energy least.
///
/// Methods that remember rates of past steps keep their multipliers `σ`: they are removed from the momenta, and added
/// again at the corrected positions. Near a singular position such a method is restarted without them, because a
/// multiplier of a row that vanishes there would become motion.
///
/// The policy `P` says how much work is done: [`ToTolerance`] iterates until the residuals are small, [`FixedWork`]
/// always does the same, for processors with a fixed time budget. [`Stabilisation::Momenta`], [`Stabilisation::Mass`]
/// and [`FixedWork`] allocate nothing themselves. At the first step, and where a row has lost most of its pivot,
/// [`ToTolerance`] has the system look at the order of its rows ([`Constrained::reorder_rows`]), which allocates.
#[derive(Clone, Debug)]
pub struct Projection<Y: Constrained, P = ToTolerance<Y>> {
    room: Room<Y>,
    policy: P,
}

/// Memory for one projection.
#[derive(Clone, Debug)]
pub struct Room<Y: Constrained> {
    /// Velocities; displacement of an iteration.
    pub(super) v: Y::Momenta,
    sigma: Y::Rows,
    pub(super) residual: Y::Rows,
    pub(super) pivots: Y::Rows,
    pub(super) entries: Y::Entries,
}

impl<Y: Constrained> Room<Y> {
    fn new(system: &Y) -> Self {
        let rows = || system.zero_rows();
        Room {
            v: system.zero_momenta(),
            sigma: rows(),
            residual: rows(),
            pivots: rows(),
            entries: system.zero_entries(),
        }
    }

    /// What no row gives.
    fn clear(&mut self) {
        for rows in [&mut self.residual, &mut self.sigma, &mut self.pivots] {
            rows.as_mut().fill(Y::Scalar::zero());
        }
    }

    /// Adds to the momenta the multipliers of which they were freed, at positions that have been corrected since.
    fn give_back(&mut self, system: &mut Y, q: &Y::Coordinates, p: &mut Y::Momenta) {
        system.constraint_residuals(q, &mut self.residual, &mut self.entries);
        add_forces(system, &self.entries, &self.sigma, p);
    }
}

/// The work of a [`Projection`].
pub trait Policy<Y: Constrained> {
    /// Whether [`Policy::restart`] does anything.
    const RESTARTS: bool = false;

    /// Projects the state `(q, p)` at time `t` (s). `remembers` as in [`PostStep::close`].
    ///
    /// # Errors
    /// [`ConstraintError`].
    fn close(
        &mut self,
        room: &mut Room<Y>,
        system: &mut Y,
        t: Y::Scalar,
        remembers: bool,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError>;

    /// As [`PostStep::idle`].
    fn idle(&mut self, _room: &mut Room<Y>, _system: &Y, _t: Y::Scalar) -> bool {
        false
    }

    /// As [`PostStep::may_restart`].
    fn may_restart(&self) -> bool {
        Self::RESTARTS
    }

    /// Frees the momenta of their multipliers, if it is time; as [`PostStep::restart`].
    ///
    /// # Errors
    /// [`ConstraintError`].
    fn restart(
        &mut self,
        _room: &mut Room<Y>,
        _system: &mut Y,
        _t: Y::Scalar,
        _q: &Y::Coordinates,
        _p: &mut Y::Momenta,
    ) -> Result<bool, ConstraintError> {
        Ok(false)
    }
}

/// Exactly `N` iterations with [`Stabilisation::Mass`], whatever the residuals are: nothing is compared with a
/// tolerance, and numbers stay in the precision of the system. One projection of momenta and one solve for each
/// iteration; nothing while no row acts, because all contacts are open.
#[derive(Clone, Copy, Debug)]
pub struct FixedWork<const N: usize>;

impl<Y, const N: usize> Policy<Y> for FixedWork<N>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    #[inline]
    fn close(
        &mut self,
        room: &mut Room<Y>,
        system: &mut Y,
        t: Y::Scalar,
        remembers: bool,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        system.project_momenta(t, q, p, &mut room.v, &mut room.sigma);
        finite(p.as_ref())?;
        for _ in 0..N {
            system.position_correction(q, &mut room.residual, &mut room.v, &mut room.pivots);
            Chart::displace(system, &mut room.v, q);
        }
        finite(q.as_ref())?;
        if remembers {
            room.give_back(system, q, p);
        }
        Ok(())
    }

    fn idle(&mut self, room: &mut Room<Y>, system: &Y, _t: Y::Scalar) -> bool {
        if system.rows_act() {
            return false;
        }
        room.clear();
        true
    }
}

/// Iterations of a [`Stabilisation`] until the residuals are small ([`Effort`]).
#[derive(Clone, Debug)]
pub struct ToTolerance<Y: Constrained> {
    corrector: Corrector<Y>,
    /// [`Effort::energy`].
    energy: f64,
    ledger: Ledger<Y::Scalar>,
    /// The state at closed positions, and the multipliers that its momenta are freed of.
    q: Y::Coordinates,
    p: Y::Momenta,
    sigma: Y::Rows,
    /// Whether the last end of a step has given multipliers back.
    gave_back: bool,
}

/// What corrections would take from the kinetic energy, at the ends of the last two steps.
#[derive(Clone, Copy, Debug)]
struct Ledger<S> {
    /// Time, s, and kinetic energy at closed positions less that of the state, J.
    last: Option<(S, S)>,
    before: Option<(S, S)>,
    /// Largest kinetic energy so far, J.
    most: S,
}

impl<S: Real> Ledger<S> {
    /// Before the first step.
    fn empty() -> Self {
        Ledger { last: None, before: None, most: S::zero() }
    }

    /// Kinetic energy that the end of a step at time `t` (s) changes, J, where a correction changes it from `free` to
    /// `closed`: what is more than at the end of the step before.
    fn change(&self, t: S, [free, closed]: [S; 2]) -> S {
        let from = if self.inside(t) { self.before } else { self.last };
        closed - free - from.map_or(S::zero(), |(_, gap)| gap)
    }

    /// Notes the end of a step; states inside the last step are not noted. Nothing is left for the next step where the
    /// correction was made.
    fn note(&mut self, t: S, [free, closed]: [S; 2], closes: bool) {
        if !self.inside(t) {
            let gap = if closes { S::zero() } else { closed - free };
            (self.before, self.last) = (self.last, Some((t, gap)));
        }
    }

    fn inside(&self, t: S) -> bool {
        self.last.is_some_and(|(last, _)| t <= last)
    }

    /// Forgets all where time `t` is before the last step: another motion has begun.
    fn begin(&mut self, t: S) {
        if self.before.is_some_and(|(before, _)| t < before) {
            *self = Ledger::empty();
        }
    }
}

impl<Y> Projection<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    /// A projection for one system that iterates until the residuals are small.
    pub fn new(system: &Y, stabilisation: Stabilisation, effort: Effort) -> Self {
        let policy = ToTolerance {
            corrector: Corrector::new(system, stabilisation, effort),
            energy: effort.energy,
            ledger: Ledger::empty(),
            q: system.neutral(),
            p: system.zero_momenta(),
            sigma: system.zero_rows(),
            gave_back: false,
        };
        Projection { room: Room::new(system), policy }
    }

    /// A projection for one system with exactly `N` iterations at the end of every step.
    pub fn fixed_work<const N: usize>(system: &Y) -> Projection<Y, FixedWork<N>> {
        Projection { room: Room::new(system), policy: FixedWork }
    }

    /// The largest residual, m or rad, of the last state that was corrected, at the end of a step or inside it, before
    /// the correction.
    pub fn drift(&self) -> Y::Scalar {
        self.policy.corrector.found
    }

    /// Number of independent rows at the end of the last step.
    pub fn rank(&self) -> Option<usize> {
        self.policy.corrector.noted()
    }

    /// Number of singular positions that the ends of steps have met or passed, and the last one.
    pub fn singular_positions(&self) -> (u32, Option<SingularPosition>) {
        self.policy.corrector.singular
    }
}

impl<Y: Constrained, P> Projection<Y, P> {
    /// Multipliers `σ` that the momenta of the last state had, one for each row, N s and N m s.
    pub fn sigma(&self) -> &Y::Rows {
        &self.room.sigma
    }

    /// Residuals that the last iteration found, one for each row, m and rad.
    pub fn residual(&self) -> &Y::Rows {
        &self.room.residual
    }
}

impl<Y> ToTolerance<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    /// Compares the kinetic energy of a state, `free` (J), with that of the same momenta at the closed positions in
    /// `self.q`.
    fn judge(
        &mut self,
        room: &mut Room<Y>,
        system: &mut Y,
        t: Y::Scalar,
        free: Y::Scalar,
        closes: bool,
    ) -> Result<(), ConstraintError> {
        system.project_momenta(t, &self.q, &mut self.p, &mut room.v, &mut self.sigma);
        let closed = kinetic(self.p.as_ref(), room.v.as_ref());
        self.ledger.begin(t);
        if free > self.ledger.most {
            self.ledger.most = free;
        }
        let taken = self.ledger.change(t, [free, closed]).to_f64();
        let kinetic = self.ledger.most.to_f64();
        if taken.abs() <= self.energy * kinetic {
            self.ledger.note(t, [free, closed], closes);
            return Ok(());
        }
        let (at, _) = worst(room.residual.as_ref());
        let (rank, rows) = (self.corrector.rank, system.rows().len());
        Err(ConstraintError::Energy { constraint: named(system, at), taken, kinetic, rank, rows })
    }
}

/// Half the product of momenta and velocities: the kinetic energy, J, where `p = M v`.
fn kinetic<S: Real>(p: &[S], v: &[S]) -> S {
    S::constant(0.5) * p.iter().zip(v).fold(S::zero(), |sum, (p, v)| sum + *p * *v)
}

impl<Y> Policy<Y> for ToTolerance<Y>
where
    Y: Constrained,
    Y::Scalar: Real,
{
    const RESTARTS: bool = true;

    /// Where no row acts, there is nothing to close.
    fn idle(&mut self, room: &mut Room<Y>, system: &Y, t: Y::Scalar) -> bool {
        if system.rows_act() {
            return false;
        }
        room.clear();
        (self.corrector.found, self.corrector.rank) = (Y::Scalar::zero(), 0);
        self.corrector.note(system, t, &room.pivots);
        (self.corrector.reordered, self.gave_back) = (false, false);
        true
    }

    fn may_restart(&self) -> bool {
        self.gave_back
    }

    fn close(
        &mut self,
        room: &mut Room<Y>,
        system: &mut Y,
        t: Y::Scalar,
        remembers: bool,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        let stabilisation = self.corrector.stabilisation;
        let closes = !matches!(stabilisation, Stabilisation::None | Stabilisation::Momenta);
        let frees = closes || (stabilisation == Stabilisation::Momenta && !remembers);
        let judged = self.energy < f64::INFINITY;
        if !frees && !judged {
            return Ok(());
        }
        self.p.as_mut().copy_from_slice(p.as_ref());
        system.project_momenta(t, q, &mut self.p, &mut room.v, &mut room.sigma);
        finite(self.p.as_ref())?;
        let free = kinetic(self.p.as_ref(), room.v.as_ref());
        if frees {
            p.as_mut().copy_from_slice(self.p.as_ref());
        }
        if closes {
            self.corrector.correct(room, system, q)?;
        }
        if judged {
            self.q.as_mut().copy_from_slice(q.as_ref());
            if !closes {
                self.corrector.correct(room, system, &mut self.q)?;
            }
            self.judge(room, system, t, free, closes)?;
        }
        if closes || judged {
            self.corrector.note(system, t, &room.pivots);
            self.corrector.reorder(system, t, q, &room.pivots);
        }
        self.gave_back = frees && remembers;
        if self.gave_back {
            room.give_back(system, q, p);
        }
        Ok(())
    }

    fn restart(
        &mut self,
        room: &mut Room<Y>,
        system: &mut Y,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<bool, ConstraintError> {
        if !self.gave_back {
            return Ok(false);
        }
        // Of redundant rows, another order gives the multipliers to others: rates of the past do not fit.
        if !self.corrector.nearness.asks(room.pivots.as_ref()) && !self.corrector.reordered {
            return Ok(false);
        }
        system.project_momenta(t, q, p, &mut room.v, &mut room.sigma);
        finite(p.as_ref())?;
        Ok(true)
    }
}

/// Whether all numbers are finite.
pub(super) fn finite<S: Real>(x: &[S]) -> Result<(), ConstraintError> {
    let (index, size) = worst(x);
    match size.is_finite() {
        true => Ok(()),
        false => Err(ConstraintError::NotFinite { index }),
    }
}

impl<Y, P> PostStep<Y> for Projection<Y, P>
where
    Y: Constrained,
    Y::Scalar: Real,
    P: Policy<Y>,
{
    const RESTARTS: bool = P::RESTARTS;

    #[inline]
    fn close(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        remembers: bool,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), ConstraintError> {
        self.policy.close(&mut self.room, system, t, remembers, q, p)
    }

    #[inline]
    fn idle(&mut self, system: &Y, t: Y::Scalar) -> bool {
        self.policy.idle(&mut self.room, system, t)
    }

    fn may_restart(&self) -> bool {
        self.policy.may_restart()
    }

    #[inline]
    fn restart(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<bool, ConstraintError> {
        self.policy.restart(&mut self.room, system, t, q, p)
    }
}
