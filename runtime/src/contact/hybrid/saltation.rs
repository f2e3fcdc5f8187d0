//! Derivatives of a motion with contacts, through its events.
//!
//! Between events, a tangent runs the method of integration on numbers with derivatives: it solves the variational
//! equations by the exact derivatives of the steps. At an event, whose function `g` has come to zero, the time of the event
//! shifts with the state by `δt = −D_x g δx / (D_x g f⁻ + D_t g)`. The state at the shifted time, `δx + f⁻ δt`, goes through
//! the reset `R` (impulses, modes, projection), and `f⁺ δt` is taken back from what follows. In one matrix, that is the
//! saltation matrix `Ξ = D_x R + (f⁺ − D_x R f⁻ − D_t R) D_x g / (D_x g f⁻ + D_t g)` (Aizerman and Gantmacher, Quart. J.
//! Mech. Appl. Math. 11, 1958; Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, 7.1;
//! Kong et al., Saltation matrices: the essential tool for linearizing hybrid dynamical systems, Proc. IEEE 112, 2024).
//! `R` and `g` are those of the motion itself, evaluated on numbers with derivatives.

use super::resolve::APPROACH;
use super::watch::{Found, Watched};
use super::{Cause, ContactEvent, ContactObserver, ContactStatistics, Hybrid, SaltationError};
use crate::contact::{Mode, Touching, WithContacts};
use crate::integrate::{Step, Stepper};
use crate::system::{Real, System};
use crate::{Dual, Scalar};

/// Speed of approach of a landing, m/s (rad/s), below which its time has no derivative that could be told from an infinite
/// one: derivatives grow with the reciprocal of this speed.
const GRAZING: f64 = 1e-7;
/// Derivatives below this part of the largest one of the state count as zero: what has to stay closed, and what happens at
/// the same time for all neighbouring motions.
const SAME: f64 = 1e-7;

/// Difference of the derivatives of a step and of its pieces, as a part of the largest one, that is left; largest number
/// of pieces.
const AGREE: f64 = 1e-10;
const PIECES: u32 = 1 << 12;
/// Derivatives below this count as zero.
const TINY: f64 = 1e-100;

/// The derivative of a motion along one direction: of its start, of its inputs or parameters, or of both. Tangents along
/// the unit directions are the columns of the matrix of sensitivities.
///
/// It has a mechanism of its own over [`Dual`] numbers, whose values are those of the mechanism of the motion. The
/// derivatives of its inputs, parameters, coefficients of friction and of restitution say along which direction the
/// mechanism changes.
///
/// Derivatives are exact for the steps that the method makes. Explicit methods are meant; implicit ones iterate until the
/// values are found, not until the derivatives are.
#[derive(Clone, Debug)]
pub struct Tangent<D: Touching, M> {
    system: WithContacts<D>,
    motion: Hybrid<D, M>,
    /// A state, and rates.
    near: (D::Coordinates, D::Momenta),
    rates: (D::Coordinates, D::Momenta),
    /// Time of the last event, and the state just after it, both as functions of the direction.
    event: (D::Scalar, D::Coordinates, D::Momenta),
    /// Whether there has been one.
    crossed: bool,
    /// Modes before an event.
    before: D::PerContact<Mode>,
}

impl<S, D, M> Tangent<D, M>
where
    S: Real,
    D: Touching<Scalar = Dual<S>>,
    M: Stepper<WithContacts<D>>,
{
    /// A tangent of a motion that is at time `t` (s), with the start `q` and `p` of that motion and their derivatives.
    /// These may be computed by the function that computes the start, on numbers with derivatives; those of unit
    /// quaternions keep their length. [`Tangent::along`] takes them in a basis of the tangent space.
    ///
    /// Closed contacts have to stay closed along the direction: `D_x φ δx + D_θ φ δθ = 0` for their gaps `φ`. Momenta are
    /// projected.
    ///
    /// # Errors
    /// [`SaltationError::LeavesContact`], [`SaltationError::Motion`].
    pub fn new(
        mut system: WithContacts<D>,
        method: M,
        step: Step,
        t: S,
        q: &D::Coordinates,
        p: &D::Momenta,
    ) -> Result<Self, SaltationError> {
        let motion = Hybrid::new(&mut system, method, step, Dual::new(t, S::zero()), q, p)?;
        let before = system.system().per_contact(Mode::Open);
        let (near, rates) = ((q.clone(), p.clone()), (q.clone(), p.clone()));
        let event = (Dual::new(t, S::zero()), q.clone(), p.clone());
        let mut tangent = Tangent { system, motion, near, rates, event, crossed: false, before };
        let Tangent { system, motion, .. } = &mut tangent;
        let size = largest(&motion.q);
        for k in 0..system.modes().len() {
            let derivative = system.gap(k).du.to_f64();
            if system.modes()[k] != Mode::Open && !(derivative.abs() <= SAME * size) {
                return Err(SaltationError::LeavesContact { contact: k, derivative });
            }
        }
        Ok(tangent)
    }

    /// [`Tangent::new`] with the derivative of the start in a basis of the tangent space: `dq` has `nv` numbers, the
    /// displacement in the coordinates of the velocities (`δq = N(q) dq`; for joints with quaternions and planar joints in
    /// body axes), `dp` the derivatives of the `nv` momenta.
    ///
    /// # Errors
    /// As [`Tangent::new`].
    pub fn along(
        system: WithContacts<D>,
        method: M,
        step: Step,
        t: S,
        (q, p): (&[S], &[S]),
        (dq, dp): (&[S], &[S]),
    ) -> Result<Self, SaltationError> {
        let (mut to_q, mut to_p) = (system.neutral(), system.zero_momenta());
        let (mut unit, mut rate) = (system.zero_momenta(), system.neutral());
        to_q.as_mut().iter_mut().zip(q).for_each(|(to, q)| *to = Dual::new(*q, S::zero()));
        unit.as_mut().iter_mut().zip(dq).for_each(|(to, dq)| *to = Dual::new(*dq, S::zero()));
        system.coordinate_rates(&to_q, &unit, &mut rate);
        to_q.as_mut().iter_mut().zip(rate.as_ref()).for_each(|(to, rate)| to.du = rate.re);
        for (to, (p, dp)) in to_p.as_mut().iter_mut().zip(p.iter().zip(dp)) {
            *to = Dual::new(*p, *dp);
        }
        Self::new(system, method, step, t, &to_q, &to_p)
    }

    /// The mechanism, for setting its inputs and their derivatives.
    pub fn system_mut(&mut self) -> &mut D {
        self.system.system_mut()
    }

    /// Time of the state, s.
    pub fn time(&self) -> S {
        self.motion.time().re
    }

    /// The state and its derivative, at a fixed time.
    pub fn state(&mut self, q: &mut D::Coordinates, p: &mut D::Momenta) {
        self.motion.state(&self.system, q, p);
    }

    /// The velocities and their derivatives, at a fixed time.
    pub fn velocities(&mut self, v: &mut D::Momenta) {
        let t = self.motion.time();
        let (q, p) = &mut self.near;
        self.motion.state(&self.system, q, p);
        self.system.look_at_all(t, q, p);
        v.as_mut().copy_from_slice(self.system.at.v.as_ref());
    }

    /// The derivative of the state at a fixed time in a basis of the tangent space, `nv` numbers each: `dq` and `dp` as
    /// [`Tangent::along`] takes them.
    pub fn derivative(&mut self, dq: &mut [S], dp: &mut [S]) {
        let Tangent { system, motion, near: (q, p), rates: (column, unit), .. } = self;
        motion.state(system, q, p);
        dp.iter_mut().zip(p.as_ref()).for_each(|(to, p)| *to = p.du);
        // The columns of N are at right angles to one another for all joints.
        for (k, to) in dq.iter_mut().enumerate() {
            unit.as_mut().fill(Dual::zero());
            if let Some(unit) = unit.as_mut().get_mut(k) {
                *unit = Dual::one();
            }
            system.coordinate_rates(q, unit, column);
            let (mut along, mut square) = (S::zero(), S::zero());
            for (q, n) in q.as_ref().iter().zip(column.as_ref()) {
                along = along + n.re * q.du;
                square = square + n.re * n.re;
            }
            *to = along / square;
        }
    }

    /// Time of the last event, s, and the state just after it, with their derivatives: those of the time of the event, and
    /// of the state at that time, which shifts with the direction. Where events are the section, that is the derivative of
    /// a Poincaré map. `None` before the first event.
    pub fn last_event(&self) -> Option<(Dual<S>, &D::Coordinates, &D::Momenta)> {
        let (t, q, p) = &self.event;
        self.crossed.then_some((*t, q, p))
    }

    /// Follows a step of the motion without events to time `t`.
    ///
    /// Where contacts slide, the direction of slip of a neighbouring motion turns within `|v|/(µ N/m)` to that of the
    /// motion. The error of a step does not show this fast change, because the motion itself has none: there, steps are
    /// divided until their derivatives agree.
    fn follow(&mut self, t: S) -> Result<(), SaltationError> {
        let Tangent { system, motion, near: (q, p), .. } = self;
        let start = motion.solver.time();
        motion.solver.state(system, q, p);
        system.note_slip(start, q, p);
        motion.solver.limits.first_step = (t - start.re).to_f64();
        self.run_to(t)?;
        if !(0..self.system.modes().len()).any(|k| self.system.rubs(k)) {
            return Ok(());
        }
        let longest = self.motion.solver.limits.max_step;
        let mut pieces = 1;
        let mut difference = f64::NAN;
        while pieces < PIECES {
            pieces *= 2;
            let Tangent { system, motion, near: (q, p), .. } = self;
            motion.solver.resume(system, start, q, p)?;
            motion.solver.limits.max_step = longest.min((t - start.re).to_f64() / f64::from(pieces));
            let done = self.run_to(t);
            self.motion.solver.limits.max_step = longest;
            difference = done?;
            if difference <= AGREE {
                return Ok(());
            }
        }
        Err(SaltationError::Stiff { time: start.re.to_f64(), difference })
    }

    /// Goes to time `t` without events; gives the largest difference of the derivatives to those in `self.rates`, as a part
    /// of the largest one, and leaves them there.
    fn run_to(&mut self, t: S) -> Result<f64, SaltationError> {
        let Tangent { system, motion, rates: (last_q, last_p), .. } = self;
        motion.solver.run(system, Dual::new(t, S::zero()))?;
        motion.solver.state(system, &mut motion.q, &mut motion.p);
        let differ = |new: &[Dual<S>], old: &mut [Dual<S>]| {
            let mut most = 0.0_f64;
            for (new, old) in new.iter().zip(old) {
                most = most.max((new.du - old.du).to_f64().abs());
                *old = *new;
            }
            most
        };
        let q = differ(motion.q.as_ref(), last_q.as_mut()) / largest(&motion.q).max(TINY);
        let p = differ(motion.p.as_ref(), last_p.as_mut()) / largest(&motion.p).max(TINY);
        Ok(q.max(p))
    }

    /// The function of an event at the state in `self.near`.
    fn function(&mut self, t: Dual<S>, contact: usize, cause: Cause) -> Dual<S> {
        let Tangent { system, near: (q, p), .. } = self;
        system.look_at_all(t, q, p);
        if cause != Cause::Landed {
            system.loads(t, q, true);
        }
        let Watched { first, second, .. } = system.watched(contact);
        match cause {
            Cause::Landed | Cause::Unloaded => first,
            _ => second.unwrap_or(first),
        }
    }

    /// Rates of the state in `self.near`, in `self.rates`.
    fn find_rates(&mut self, t: Dual<S>) {
        let Tangent { system, near: (q, p), rates: (qd, pd), .. } = self;
        system.rates_at(t, q, p, qd, pd);
    }

    /// Adds the rates in `self.rates` times `dt` to the derivatives of the state in `self.near`.
    fn shift(&mut self, dt: S) {
        let Tangent { near: (q, p), rates: (qd, pd), .. } = self;
        let add = |to: &mut [Dual<S>], rates: &[Dual<S>]| {
            to.iter_mut().zip(rates).for_each(|(to, rate)| to.du = to.du + rate.re * dt);
        };
        add(q.as_mut(), qd.as_ref());
        add(p.as_mut(), pd.as_ref());
    }

    /// Shift of the time of an event, s, at the state in `self.near`, with the rates of that state in `self.rates`.
    fn event_shift(&mut self, time: S, contact: usize, cause: Cause) -> Result<S, SaltationError> {
        let t = Dual::new(time, S::zero());
        let g = self.function(t, contact, cause);
        let rate = if cause == Cause::Landed {
            self.system.gap_rate(contact).re
        } else {
            // Along the motion, without what parameters add.
            let Tangent { near: (q, p), event: (_, kept_q, kept_p), .. } = self;
            kept_q.as_mut().copy_from_slice(q.as_ref());
            kept_p.as_mut().copy_from_slice(p.as_ref());
            let clear = |list: &mut [Dual<S>]| list.iter_mut().for_each(|x| x.du = S::zero());
            clear(self.near.0.as_mut());
            clear(self.near.1.as_mut());
            let rest = self.function(t, contact, cause).du;
            self.shift(S::one());
            let along = self.function(Dual::new(time, S::one()), contact, cause).du;
            core::mem::swap(&mut self.near.0, &mut self.event.1);
            core::mem::swap(&mut self.near.1, &mut self.event.2);
            along - rest
        };
        let least = if cause == Cause::Landed { GRAZING } else { 0.0 };
        let dt = -(g.du / rate);
        if !(rate.to_f64() < -least && dt.is_finite()) {
            let (time, rate) = (time.to_f64(), rate.to_f64());
            return Err(SaltationError::Grazing { time, contact, cause, rate });
        }
        Ok(dt)
    }

    /// Goes through an event that a motion has just resolved.
    fn cross<Y, N>(
        &mut self,
        of: &Hybrid<Y, N>,
        modes: &[Mode],
        event: &ContactEvent<S>,
        redundant: bool,
    ) -> Result<(), SaltationError>
    where
        Y: Touching<Scalar = S>,
    {
        let (k, cause, t) = (event.contact, event.cause, Dual::new(event.time, S::zero()));
        let time = event.time.to_f64();
        if cause == Cause::Jammed {
            return Err(SaltationError::Jammed { time, contact: k });
        }
        if redundant && matches!(cause, Cause::Unloaded | Cause::Slipped) {
            return Err(SaltationError::Redundant { time, contact: k });
        }
        self.motion.solver.state(&self.system, &mut self.near.0, &mut self.near.1);
        self.take_values(of, false);
        self.project(t);
        self.find_rates(t);
        let dt = self.event_shift(event.time, k, cause)?;
        self.shift(dt);
        self.project(t);
        self.check_order(of, modes, event)?;
        if cause != Cause::Landed {
            self.system.loads(t, &self.near.0, true);
        }
        self.before.as_mut().copy_from_slice(self.system.modes());
        let Tangent { system, motion, near, .. } = self;
        motion.rules = of.rules;
        motion.ignored.as_mut().copy_from_slice(of.ignored.as_ref());
        motion.q.as_mut().copy_from_slice(near.0.as_ref());
        motion.p.as_mut().copy_from_slice(near.1.as_ref());
        let found = Found { contact: k, cause, theta: Dual::one() };
        motion.resolve(system, Dual::new(event.time, dt), &found)?;
        if system.modes() != modes {
            return Err(SaltationError::Differs { time });
        }
        near.0.as_mut().copy_from_slice(motion.q.as_ref());
        near.1.as_mut().copy_from_slice(motion.p.as_ref());
        self.take_values(of, true);
        let Tangent { near, event, .. } = self;
        event.0 = Dual::new(t.re, dt);
        event.1.as_mut().copy_from_slice(near.0.as_ref());
        event.2.as_mut().copy_from_slice(near.1.as_ref());
        self.crossed = true;
        self.find_rates(t);
        self.shift(-dt);
        self.project(t);
        let Tangent { system, motion, near: (q, p), .. } = self;
        motion.solver.resume(system, t, q, p)?;
        Ok(())
    }

    /// Takes the values of the state of the motion: coordinates, and the momenta too.
    fn take_values<Y, N>(&mut self, of: &Hybrid<Y, N>, momenta: bool)
    where
        Y: Touching<Scalar = S>,
    {
        let (q, p) = &mut self.near;
        q.as_mut().iter_mut().zip(of.q.as_ref()).for_each(|(to, q)| to.re = *q);
        if momenta {
            p.as_mut().iter_mut().zip(of.p.as_ref()).for_each(|(to, p)| to.re = *p);
        }
    }

    /// Frees the momenta in `self.near` of multipliers, and looks at the state.
    fn project(&mut self, t: Dual<S>) {
        let Tangent { system, near: (q, p), .. } = self;
        system.look_at_all(t, q, p);
        p.as_mut().copy_from_slice(system.p.as_ref());
    }

    /// Whether other contacts take part in an event whose order neighbouring motions decide. After the state before it,
    /// at its shifted time, was looked at.
    fn check_order<Y, N>(
        &self,
        of: &Hybrid<Y, N>,
        modes: &[Mode],
        event: &ContactEvent<S>,
    ) -> Result<(), SaltationError>
    where
        Y: Touching<Scalar = S>,
    {
        let same = SAME * largest(&self.near.0).max(largest(&self.near.1));
        for (j, (before, after)) in self.system.modes().iter().zip(modes).enumerate() {
            let (gap, rate) = (self.system.gap(j), self.system.gap_rate(j));
            let collides = *before == Mode::Open
                && gap.re.to_f64() <= of.rules.touching
                && !(rate.re.to_f64() >= -APPROACH)
                && !of.ignored.as_ref()[j];
            let derivative = if j == event.contact {
                0.0
            } else if collides {
                gap.du.to_f64()
            } else if before == after || event.impact.is_some() {
                0.0
            } else if event.cause == Cause::Stopped && *after == Mode::Stick {
                let [x, y] = self.system.tangential(j);
                x.du.to_f64().abs().max(y.du.to_f64().abs())
            } else {
                f64::NAN
            };
            if !(derivative.abs() <= same) {
                let (time, contacts) = (event.time.to_f64(), [event.contact, j]);
                return Err(SaltationError::Simultaneous { time, contacts, derivative });
            }
        }
        Ok(())
    }
}

/// The largest derivative of a list.
fn largest<S: Real>(list: &impl AsRef<[Dual<S>]>) -> f64 {
    list.as_ref().iter().fold(0.0, |most: f64, x| most.max(x.du.to_f64().abs()))
}

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// [`Hybrid::run`] with tangents, which start where the motion is.
    ///
    /// # Errors
    /// [`SaltationError`]. The motion may then be a step or an event ahead of its tangents.
    pub fn run_with_tangents<D, N>(
        &mut self,
        system: &mut WithContacts<Y>,
        t_end: Y::Scalar,
        tangents: &mut [Tangent<D, N>],
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<(), SaltationError>
    where
        D: Touching<Scalar = Dual<Y::Scalar>>,
        N: Stepper<WithContacts<D>>,
    {
        let mut left = self.solver.limits.steps;
        while self.time() < t_end {
            self.solver.limits.spend(&mut left, self.time().to_f64())?;
            self.advance_with_tangents(system, t_end, tangents, observer)?;
        }
        Ok(())
    }

    /// [`Hybrid::advance`] with tangents, which are where the motion is.
    ///
    /// # Errors
    /// As [`Hybrid::run_with_tangents`].
    pub fn advance_with_tangents<D, N>(
        &mut self,
        system: &mut WithContacts<Y>,
        t_end: Y::Scalar,
        tangents: &mut [Tangent<D, N>],
        observer: &mut impl ContactObserver<Y>,
    ) -> Result<Option<ContactEvent<Y::Scalar>>, SaltationError>
    where
        D: Touching<Scalar = Dual<Y::Scalar>>,
        N: Stepper<WithContacts<D>>,
    {
        let time = self.time();
        let differs = |tangent: &Tangent<D, N>| tangent.time() != time || tangent.system.modes() != system.modes();
        if tangents.iter().any(differs) {
            return Err(SaltationError::Differs { time: time.to_f64() });
        }
        let (redundant, ContactStatistics { settled, crept, .. }) = (system.redundant, self.statistics);
        let event = self.advance(system, t_end, observer)?;
        let time = self.time();
        if let Some(ContactEvent { contact, .. }) = event.filter(|_| self.statistics.settled > settled) {
            return Err(SaltationError::Accumulation { time: time.to_f64(), contact });
        }
        if let Some(ContactEvent { contact, .. }) = event.filter(|_| self.statistics.crept > crept) {
            return Err(SaltationError::Creeps { time: time.to_f64(), contact });
        }
        for tangent in tangents {
            tangent.follow(time)?;
            if let Some(event) = &event {
                tangent.cross(self, system.modes(), event, redundant)?;
            }
        }
        Ok(event)
    }
}
