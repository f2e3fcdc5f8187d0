//! Contacts that are too far apart for a time step to close them: their gaps are not computed.
//!
//! How far each coordinate moves is summed up from step to step. Contacts whose gaps the table of
//! [`Reach`](crate::contact::Reach) says to last for some ways of the coordinates are left out until one of the coordinates has gone
//! its way. Then the table says what may be left of their gaps, and only those are looked at again whose gaps may not last. A part
//! of the gap is kept back for what impulses on other contacts might close, and of the way what the next steps move, so that what
//! is left out could have no part in the step: results do not change.

use super::{StepImpulses, TimeStepping};
use crate::constrained::PostStep;
use crate::contact::travel::{next_ways, travels};
use crate::contact::{Touching, WithContacts};
use crate::lists::{copy, get, set};
use crate::system::Real;
use crate::Scalar;

/// Ways among which is chosen how far contacts are left out, in steps like the last one.
const HORIZONS: [u32; 9] = [6, 8, 12, 16, 32, 64, 128, 256, 1024];
/// A gap is far where it lasts for so many more steps like the last one than it is left out for.
const SPARE: u32 = 4;
/// A gap is left over as well for what the impulses of others might close: so many times as much as the fastest closes in a step.
const MARGIN: f64 = 2.0;
/// Number of steps in which all contacts are looked at where leaving some out saves nothing.
const PAUSE: u32 = 16;
/// What it costs to find how long the gap of a contact lasts, in gaps.
const COST: f64 = 0.05;

/// What is known of contacts that are far.
#[derive(Clone, Debug)]
pub(super) struct Far<Y: Touching> {
    /// Where the last step ended, with which the next one begins if nothing was changed in between.
    end: Y::Coordinates,
    /// Whether the ways below are known to there, and to where the step looks at the contacts.
    known: bool,
    counted: bool,
    /// How far coordinates have moved since gaps were known, and how far they may.
    gone: Y::Momenta,
    allowed: Y::Momenta,
    /// What is left of each gap, at least, m or rad, less what was gone since; by how much each can change, and for how many steps
    /// each lasts.
    left: Y::PerContact<Y::Scalar>,
    travel: Y::PerContact<Y::Scalar>,
    /// What other contacts may close by in a step, by gaps as they are left out, m or rad.
    margin: Y::Scalar,
    /// Steps until some contacts may be left out again.
    pause: u32,
}

impl<Y: Touching> Far<Y> {
    pub fn new(system: &Y) -> Self {
        let zero = Y::Scalar::zero();
        Far {
            end: system.neutral(),
            known: false,
            counted: false,
            gone: system.zero_momenta(),
            allowed: system.zero_momenta(),
            left: system.per_contact(zero),
            travel: system.per_contact(zero),
            margin: zero,
            pause: 0,
        }
    }

    /// The last step ended at `q`, by a displacement `x` after the look at the contacts. Without one, nothing is known of the
    /// way there.
    pub fn end(&mut self, q: &Y::Coordinates, x: Option<&Y::Momenta>) {
        copy(self.end.as_mut(), q.as_ref());
        self.known = self.counted && x.is_some();
        if let Some(x) = x {
            self.go(x);
        }
    }

    fn go(&mut self, x: &Y::Momenta) {
        self.gone.as_mut().iter_mut().zip(x.as_ref()).for_each(|(gone, x)| *gone = *gone + x.abs());
    }

    /// Coordinates are displaced by `x` from `q`, where a step begins. Returns whether contacts that are left out stay far.
    fn lasts(&mut self, q: &Y::Coordinates, x: &Y::Momenta) -> bool {
        // A step that fails leaves the ways unknown.
        self.counted = core::mem::take(&mut self.known) && self.end.as_ref() == q.as_ref();
        if !self.counted {
            return false;
        }
        self.go(x);
        let spare = Y::Scalar::constant(f64::from(SPARE - 1));
        let mut ways = self.gone.as_ref().iter().zip(x.as_ref()).zip(self.allowed.as_ref());
        ways.all(|((gone, x), allowed)| *gone + spare * x.abs() <= *allowed)
    }

    /// Takes what coordinates have gone off the gaps, but of those that were just looked at. `size`: bounds of the absolute values
    /// of the coordinates on the way.
    fn settle(&mut self, system: &WithContacts<Y>, size: &Y::Momenta) {
        travels(system.system().reaches(), self.gone.as_ref(), size.as_ref(), self.travel.as_mut());
        for (left, travel) in self.left.as_mut().iter_mut().zip(self.travel.as_ref()) {
            *left = *left - *travel;
        }
        self.note(system);
        self.gone.as_mut().fill(Y::Scalar::zero());
        self.counted = true;
    }

    /// The gaps of what was looked at are known.
    fn note(&mut self, system: &WithContacts<Y>) {
        for (k, left) in self.left.as_mut().iter_mut().enumerate().filter(|(k, _)| system.minds(*k)) {
            *left = system.gap(k);
        }
    }

    /// Leaves those contacts out that are far, after a displacement `x` to coordinates of absolute values up to `size`, where
    /// others close by `near` in a step. Returns whether some have to be looked at that were not.
    fn choose(&mut self, system: &mut WithContacts<Y>, near: Y::Scalar, x: &Y::Momenta, size: &Y::Momenta) -> bool {
        let zero = Y::Scalar::zero();
        self.margin = Y::Scalar::constant(MARGIN) * near;
        let Self { allowed, left, travel, margin, .. } = self;
        next_ways(x.as_ref(), allowed.as_mut());
        travels(system.system().reaches(), allowed.as_ref(), size.as_ref(), travel.as_mut());
        for (lasts, left) in travel.as_mut().iter_mut().zip(left.as_ref()) {
            *lasts = (*left - *margin) / *lasts;
        }
        let mut last = None;
        for contact in system.system().reaches().iter().filter(|reach| reach.slide != zero).map(|reach| reach.contact) {
            let steps = get(travel.as_ref(), contact);
            if last.replace(contact) != Some(contact) && steps > zero {
                // Where arms become longer, too, a gap changes in `n` times the way by `n²` times as much at most.
                set(travel.as_mut(), contact, steps.sqrt());
            }
        }
        let (mut far, all) = ([0_u32; HORIZONS.len()], travel.as_ref().len() as u32);
        for lasts in travel.as_ref() {
            let steps = HORIZONS.iter().take_while(|n| *lasts > Y::Scalar::constant(f64::from(**n)));
            far.iter_mut().zip(steps).for_each(|(far, _)| *far += 1);
        }
        // What is computed in a step in the mean, in gaps.
        let parts = system.system().sees_parts();
        let (mut least, mut chosen) = (f64::from(all), None);
        for (far, n) in far.into_iter().zip(HORIZONS) {
            let looked_at = if parts || far == all { all - far } else { all };
            let cost = f64::from(looked_at) + (COST * f64::from(all) + f64::from(looked_at)) / f64::from(n + 1 - SPARE);
            if cost < least {
                (least, chosen) = (cost, Some(n));
            }
        }
        let n = Y::Scalar::constant(chosen.map_or(f64::INFINITY, f64::from));
        let mut new = false;
        system.mind_if(|k, minded| {
            let near = !(get(travel.as_ref(), k) > n);
            new |= near && !minded;
            near
        });
        if chosen.is_none() {
            (self.pause, self.counted) = (PAUSE, false);
        }
        self.allowed.as_mut().iter_mut().for_each(|allowed| *allowed = n * *allowed);
        new
    }
}

impl<Y, B, I> TimeStepping<Y, B, I>
where
    Y: Touching,
    B: PostStep<WithContacts<Y>>,
    I: StepImpulses,
{
    /// Looks at the contacts that can have a part in a step to the end without contacts, in `self.q` and `self.p`, to which
    /// `self.point` leads from `(q, p)`: their velocities there, too, if any contact has restitution. Returns whether there are
    /// such.
    pub(super) fn look_near(
        &mut self,
        system: &mut WithContacts<Y>,
        [t, h]: [Y::Scalar; 2],
        at: (&Y::Coordinates, &Y::Momenta),
    ) -> bool {
        // Loops are closed by displacements that nobody knows.
        if !system.has_many() || system.has_loops() {
            if !system.modes().is_empty() {
                self.look_at_end(system, [t, h]);
            }
            return !system.modes().is_empty();
        }
        let lasts = self.far.lasts(at.0, &self.point.x);
        if !self.far.counted {
            self.look_at_all(system, [t, h], at);
            self.far.pause = self.far.pause.saturating_sub(1);
            // Where all gaps are computed together, nothing is saved while one contact is near.
            let worthwhile = system.system().sees_parts() || !(self.near > Y::Scalar::zero());
            if self.far.pause == 0 && worthwhile {
                self.leave_out(system);
            }
            return system.minds_any();
        }
        if system.minds_any() {
            self.look_at_end(system, [t, h]);
        } else {
            self.near = Y::Scalar::zero();
        }
        if lasts && self.near <= self.far.margin {
            return system.minds_any();
        }
        if self.leave_out(system) {
            self.look_at_start(system, t, at);
            self.look_at_end(system, [t, h]);
            self.far.note(system);
            if !(self.near <= self.far.margin) {
                self.look_at_all(system, [t, h], at);
                self.far.counted = false;
            }
        }
        system.minds_any()
    }

    /// Leaves out what is far from now on. Returns whether contacts have to be looked at that were not.
    fn leave_out(&mut self, system: &mut WithContacts<Y>) -> bool {
        let Self { chart, start, point, far, near, .. } = self;
        chart.size(system, start);
        start.x.as_mut().iter_mut().zip(point.x.as_ref()).for_each(|(size, x)| *size = *size + x.abs());
        far.settle(system, &start.x);
        far.choose(system, *near, &point.x, &start.x)
    }

    fn look_at_start(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, (q, p): (&Y::Coordinates, &Y::Momenta)) {
        if self.bounces {
            system.look(t, q, p);
            copy(self.before.as_mut(), system.at.velocities.as_ref());
        }
    }

    fn look_at_all(
        &mut self,
        system: &mut WithContacts<Y>,
        [t, h]: [Y::Scalar; 2],
        at: (&Y::Coordinates, &Y::Momenta),
    ) {
        if !system.minds_all() {
            system.mind(|_| true);
            self.look_at_start(system, t, at);
        }
        self.look_at_end(system, [t, h]);
    }
}
