//! Time stepping: the impulses of all contacts of a step at once, without events.
//!
//! A step of Moreau's midpoint rule on `(q, p)`: the explicit midpoint rule gives the end of the step without contacts.
//! There, impulses of the contacts are added to the momenta. They act in the middle of the step: half a step with the
//! velocities that they add leads to the end (J. J. Moreau, Numerical aspects of the sweeping process, Comput. Methods
//! Appl. Mech. Eng. 177, 1999).
//!
//! A contact takes part where its gap would be closed before the middle of the next step: `0 ≤ P_n ⊥ v_n + max(g, 0)/h ≥ 0`,
//! with its velocity `v_n` after the impulses and its gap `g = g₁ − h v₁/2` in the middle of the step, from gap and rate at the
//! end without contacts, and Coulomb's law on the exact cone. What lands between the middles of two steps gets a part of its
//! impulse in each, so that the time of both, in the mean, is that at which it lands. So it does not overlap, but for the
//! curvature of its path; what overlaps all the same is taken apart by coordinates alone. With restitution, a contact waits
//! until its gap in the middle is closed, and then collides as in an [`impact`]; one whose approach is not faster than twice what forces add
//! in a step has none.
//!
//! Springs and dampers of the joints follow the implicit midpoint rule where the mechanism can do that
//! ([`Touching::steps_implicitly`]), in the motion without contacts as in the answer to impulses.
//!
//! A step whose impulses do not converge is divided: other states in between seldom have the same difficulty.
//!
//! The method is of order 1 at impacts and where slip ends, of order 2 in between. Impulses never add energy: their work is
//! that of an impact with velocities that approach no slower. What friction holds does not move.

mod approach;
mod fall;
#[cfg(feature = "hulls")]
mod far;
mod impulses;
mod statistics;

pub use impulses::{ByRules, FixedSweeps, StepImpulses};
pub use statistics::SteppingStatistics;

use super::instant::Touches;
use super::{ContactError, ContactRules, HybridError, Stretch, Touching, WithContacts};
use crate::constrained::PostStep;
use crate::error::StepError;
use crate::integrate::{Chart, Point};
use crate::lists::{copy, first, first_mut, get, get_or, part, part_mut, set};
use crate::system::Real;
use crate::Scalar;
use approach::middle_gap;
use core::marker::PhantomData;
#[cfg(feature = "hulls")]
use far::Far;
use impulses::briefly;

/// Overlap in the middle of a step that stays, m (rad for stops of rotations), and as a part of what the fastest gap changes by
/// in the step: what moves fast errs by more.
const OVERLAP: [f64; 2] = [1e-6, 0.01];

/// Parts into which a step is divided at most.
const PARTS: u32 = 16;

/// A motion by time steps. The state is the caller's.
///
/// `B` closes loops at the ends of steps: a [`Projection`](crate::constrained::Projection), or `()` where there are none.
/// `I` says how the impulses are found.
#[derive(Clone, Debug)]
pub struct TimeStepping<Y: Touching, B, I = ByRules> {
    /// Work for the impulses, and their order; other rules have no part in it.
    pub rules: ContactRules,
    /// What closes loops.
    pub post_step: B,
    /// Whether overlaps are taken away, where the way in which impulses are found allows it.
    pub lifts: bool,
    chart: Chart<WithContacts<Y>>,
    start: Point<WithContacts<Y>>,
    point: Point<WithContacts<Y>>,
    q: Y::Coordinates,
    p: Y::Momenta,
    qd: Y::Coordinates,
    pd: Y::Momenta,
    /// Whether any contact has restitution; velocities of the rows at the start of the step then.
    bounces: bool,
    before: Y::Rows,
    /// Impulses of each contact in the last step, or the last part of one that was divided, and its length, s.
    last_impulses: Y::PerContact<[Y::Scalar; 3]>,
    impulse_time: Y::Scalar,
    /// Velocities with which coordinates go on.
    v: Y::Momenta,
    /// Whether springs and dampers of the joints are taken implicitly in this step.
    implicit: bool,
    /// Whether a contact had an impulse in the last step, and whether it has one in this step.
    pressed: [Y::PerContact<bool>; 2],
    /// What the fastest gap that closes changes by in this step, m (rad for stops of rotations).
    near: Y::Scalar,
    /// Contacts that are not looked at.
    #[cfg(feature = "hulls")]
    far: Far<Y>,
    /// Times of the ends of the last step, s, and the state at its start.
    span: [Y::Scalar; 2],
    last: (Y::Coordinates, Y::Momenta),
    touching: Touches<Y>,
    statistics: SteppingStatistics<Y::Scalar>,
    impulses: PhantomData<I>,
}

impl<Y, B> TimeStepping<Y, B>
where
    Y: Touching,
    B: PostStep<WithContacts<Y>>,
{
    /// For a mechanism, whose contacts are all opened: between steps none of them acts.
    pub fn new(system: &mut WithContacts<Y>, post_step: B) -> Self {
        TimeStepping::with(system, post_step)
    }

    /// The same with `N` sweeps for the impulses of every step: [`FixedSweeps`].
    pub fn fixed_work<const N: u32>(system: &mut WithContacts<Y>, post_step: B) -> TimeStepping<Y, B, FixedSweeps<N>> {
        TimeStepping::with(system, post_step)
    }
}

impl<Y, B, I> TimeStepping<Y, B, I>
where
    Y: Touching,
    B: PostStep<WithContacts<Y>>,
    I: StepImpulses,
{
    fn with(system: &mut WithContacts<Y>, post_step: B) -> Self {
        system.open_all();
        let inner = system.system();
        TimeStepping {
            rules: ContactRules::default(),
            post_step,
            lifts: true,
            chart: Chart::new(system, false),
            start: Point::zero(system),
            point: Point::zero(system),
            q: inner.neutral(),
            p: inner.zero_momenta(),
            qd: inner.neutral(),
            pd: inner.zero_momenta(),
            bounces: false,
            before: inner.zero_rows(),
            last_impulses: inner.per_contact([Y::Scalar::zero(); 3]),
            impulse_time: Y::Scalar::zero(),
            v: inner.zero_momenta(),
            implicit: false,
            pressed: [inner.per_contact(false), inner.per_contact(false)],
            near: Y::Scalar::zero(),
            #[cfg(feature = "hulls")]
            far: Far::new(inner),
            span: [Y::Scalar::zero(); 2],
            last: (inner.neutral(), inner.zero_momenta()),
            touching: Touches::new(inner),
            statistics: SteppingStatistics::new(),
            impulses: PhantomData,
        }
    }

    /// What happened so far.
    pub fn statistics(&self) -> &SteppingStatistics<Y::Scalar> {
        &self.statistics
    }

    /// Whether each contact had an impulse in the last step.
    pub fn pressed(&self) -> &[bool] {
        self.pressed[0].as_ref()
    }

    /// Mean forces of the contacts `[normal, tangential, tangential]` in the last step, N (N m for stops of rotations), on the
    /// second body: its impulses over its length, of which those of an impact are a part. Of a step that was divided, they are
    /// those of its last part. Zero before the first step.
    pub fn mean_forces(&self) -> Y::PerContact<[Y::Scalar; 3]> {
        let mut forces = self.last_impulses.clone();
        if self.impulse_time > Y::Scalar::zero() {
            forces.as_mut().as_flattened_mut().iter_mut().for_each(|force| *force = *force / self.impulse_time);
        }
        forces
    }

    /// The last step, which ended in a state: what is between its ends, to first order.
    pub fn last_step<'a>(&'a mut self, q: &'a Y::Coordinates, p: &'a Y::Momenta) -> LastTimeStep<'a, Y, B, I> {
        LastTimeStep { stepping: self, q, p }
    }

    /// Takes a step of `h` s, which is greater than zero, from time `t` (s).
    ///
    /// # Errors
    /// [`HybridError`]; the state is then as it was.
    pub fn step(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), HybridError> {
        if !(h > Y::Scalar::zero() && h.is_finite()) {
            return Err(StepError::InvalidStep { time: t.to_f64(), step: h.to_f64() }.into());
        }
        match self.whole(system, t, h, q, p) {
            Err(error) if I::DIVIDES && unconverged(&error) => self.divided(system, (t, h), (q, p))?,
            result => result?,
        }
        self.statistics.steps += 1;
        Ok(())
    }

    /// A step in parts, which are halved wherever one fails.
    fn divided(
        &mut self,
        system: &mut WithContacts<Y>,
        (t, h): (Y::Scalar, Y::Scalar),
        (q, p): (&mut Y::Coordinates, &mut Y::Momenta),
    ) -> Result<(), HybridError> {
        let begin = (q.clone(), p.clone());
        let (mut done, mut part) = (0, PARTS / 2);
        let time = |parts: u32| h * Y::Scalar::constant(f64::from(parts) / f64::from(PARTS));
        while done < PARTS {
            match self.whole(system, t + time(done), time(part), q, p) {
                Ok(()) => done += part,
                Err(error) if part > 1 && unconverged(&error) => part /= 2,
                Err(error) => {
                    copy(q.as_mut(), begin.0.as_ref());
                    copy(p.as_mut(), begin.1.as_ref());
                    return Err(error);
                }
            }
        }
        self.span = [t, t + h];
        self.last = begin;
        self.statistics.divided += 1;
        Ok(())
    }

    /// A step that is not divided.
    fn whole(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), HybridError> {
        let half = Y::Scalar::constant(0.5) * h;
        self.fall(system, t, h, (q, p))?;
        self.touching.count = 0;
        if self.look_near(system, [t, h], (q, p)) {
            self.take(system, h);
        }
        self.pressed[1].as_mut().fill(false);
        if self.touching.count > 0 {
            self.collide(system, t + h)?;
            if I::LIFTS && self.lifts {
                self.lift(system, t + h, half);
            }
            self.drift(system, t + h, half)?;
        } else {
            self.last_impulses.as_mut().fill([Y::Scalar::zero(); 3]);
            #[cfg(feature = "hulls")]
            self.point.clear();
        }
        let free = self.post_step.idle(system, t + h);
        if !free {
            let closed = self.post_step.close(system, t + h, false, &mut self.q, &mut self.p);
            closed.map_err(|error| StepError::Constraint { time: t.to_f64(), error })?;
        }
        (self.span, self.impulse_time) = ([t, t + h], h);
        copy(self.last.0.as_mut(), q.as_ref());
        copy(self.last.1.as_mut(), p.as_ref());
        copy(q.as_mut(), self.q.as_ref());
        copy(p.as_mut(), self.p.as_ref());
        #[cfg(feature = "hulls")]
        self.far.end(q, free.then_some(&self.point.x));
        let [last, now] = &mut self.pressed;
        self.statistics.changes += u64::from(last.as_ref() != now.as_ref());
        copy(last.as_mut(), now.as_ref());
        Ok(())
    }

    /// Adds the impulses to the momenta `self.p` at `self.q`, where the system was looked at; the change of the velocities
    /// is in `self.v`.
    fn collide(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar) -> Result<(), HybridError> {
        let touching = &mut self.touching;
        touching.assemble(system, t, &self.q, self.implicit);
        // The search begins with the impulses of the last step.
        for (i, k) in first(touching.order.as_ref(), touching.count).iter().enumerate() {
            let (last, c) =
                (get_or(self.last_impulses.as_ref(), *k, [Y::Scalar::zero(); 3]), touching.touch(i).contact);
            copy(part_mut(touching.impulses.as_mut(), c.row, c.rows()), &last);
        }
        let (problem, impulses, work) = touching.parts();
        let result = I::find(&self.rules, &problem, impulses, work).map_err(|error| touching.error(t, error))?;
        // The work of the impulses: less than that with the velocities that were asked for, by what is still to be closed.
        let ahead = first(touching.order.as_ref(), touching.count).iter().zip(touching.problem.as_ref());
        let shift = ahead.fold(Y::Scalar::zero(), |sum, (k, touch)| {
            let row = touch.contact.row;
            sum + get(touching.impulses.as_ref(), row) * (get(touching.b.as_ref(), row) - system.gap_rate(*k))
        });
        if self.implicit {
            system.respond_to_impulses((t, &self.q), touching.order(), touching.impulses.as_ref(), true);
            copy(self.v.as_mut(), system.response_v.as_ref());
            for (p, (before, more)) in
                self.p.as_mut().iter_mut().zip(system.p.as_ref().iter().zip(system.response.as_ref()))
            {
                *p = *before + *more;
            }
        } else {
            copy(self.v.as_mut(), system.at.v.as_ref());
            system.kick(touching.order(), touching.impulses.as_ref());
            copy(self.p.as_mut(), system.p.as_ref());
            system.free(t, &self.q, &self.p);
            for (v, after) in self.v.as_mut().iter_mut().zip(system.at.v.as_ref()) {
                *v = *after - *v;
            }
        }
        self.last_impulses.as_mut().fill([Y::Scalar::zero(); 3]);
        let mut pressed = 0;
        for (k, touch) in first(touching.order.as_ref(), touching.count).iter().zip(touching.problem.as_ref()) {
            let own = part(touching.impulses.as_ref(), touch.contact.row, touch.contact.rows());
            let mut impulse = [Y::Scalar::zero(); 3];
            copy(&mut impulse, own);
            set(self.last_impulses.as_mut(), *k, impulse);
            let presses = impulse[0] > Y::Scalar::zero();
            set(self.pressed[1].as_mut(), *k, presses);
            pressed += u32::from(presses);
        }
        let s = &mut self.statistics;
        s.touched += 1;
        s.limited += u64::from(result.limited.is_some());
        s.most = s.most.max(pressed);
        s.lost = s.lost - (result.energy - shift);
        s.residual = larger(s.residual, result.certificate.residual);
        Ok(())
    }

    /// Takes bodies apart that would overlap at the end of the step, by velocities of the coordinates alone, which are added
    /// to `self.v`: momenta stay as they are. Where none are found, the overlap stays for the next step.
    fn lift(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, half: Y::Scalar) {
        let zero = Y::Scalar::zero();
        let Self { touching, .. } = self;
        let rows = touching.rows();
        let [all, part] = OVERLAP.map(Y::Scalar::constant);
        let (least, mut overlaps) = (larger(all, part * self.near), false);
        for i in 0..touching.count {
            let (k, c) = (touching.contact(i), touching.touch(i).contact);
            let gap = middle_gap(system, k, half);
            overlaps |= gap < -least;
            for row in c.row..c.row + c.rows() {
                let ahead = if gap < zero { gap / half } else { zero };
                let asked = if row == c.row { touching.with_impulses(row) + ahead } else { zero };
                set(touching.work.as_mut(), row, asked);
            }
        }
        if !overlaps {
            return;
        }
        copy(first_mut(touching.b.as_mut(), rows), touching.work.as_ref());
        touching.problem.as_mut().iter_mut().for_each(|touch| touch.contact.restitution = zero);
        touching.impulses.as_mut().fill(zero);
        let (problem, impulses, work) = touching.parts();
        let rules = ContactRules { effort: briefly(self.rules.effort), ..self.rules };
        if I::find(&rules, &problem, impulses, work).is_err() {
            return;
        }
        let (order, impulses) = (touching.order(), touching.impulses.as_ref());
        system.respond_to_impulses((t, &self.q), order, impulses, self.implicit);
        for (v, more) in self.v.as_mut().iter_mut().zip(system.response_v.as_ref()) {
            *v = *v + *more;
        }
    }
}

/// Whether a step failed because impulses did not converge.
fn unconverged(error: &HybridError) -> bool {
    matches!(error, HybridError::Contact { error: ContactError::NoConvergence { .. }, .. })
}

/// The larger of two numbers, of which the second may be none.
fn larger<S: Real>(most: S, x: S) -> S {
    if x > most {
        x
    } else {
        most
    }
}

/// The last of the time steps.
pub struct LastTimeStep<'a, Y: Touching, B, I = ByRules> {
    stepping: &'a mut TimeStepping<Y, B, I>,
    q: &'a Y::Coordinates,
    p: &'a Y::Momenta,
}

impl<Y, B, I> Stretch<Y> for LastTimeStep<'_, Y, B, I>
where
    Y: Touching,
    B: PostStep<WithContacts<Y>>,
    I: StepImpulses,
{
    fn span(&self) -> [Y::Scalar; 2] {
        self.stepping.span
    }

    fn state(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        let [begin, end] = self.stepping.span;
        let stepping = &mut *self.stepping;
        let (at, from_q, from_p) = match t - begin < end - t {
            true => (begin, stepping.last.0.as_ref(), stepping.last.1.as_ref()),
            false => (end, self.q.as_ref(), self.p.as_ref()),
        };
        copy(stepping.q.as_mut(), from_q);
        copy(stepping.p.as_mut(), from_p);
        copy(q.as_mut(), from_q);
        copy(p.as_mut(), from_p);
        system.free(at, &stepping.q, &stepping.p);
        copy(stepping.v.as_mut(), system.at.v.as_ref());
        // Where the state cannot be continued, that of the nearer end is the answer.
        if stepping.drift(system, at, t - at).is_ok() {
            copy(q.as_mut(), stepping.q.as_ref());
            copy(p.as_mut(), stepping.p.as_ref());
        }
    }
}
