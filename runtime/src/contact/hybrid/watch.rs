//! The functions that are watched within a step, and the first of their zeros.

use super::{Cause, Hybrid, HybridError};
use crate::contact::{Mode, Touching, WithContacts};
use crate::integrate::root::{resolution, root};
use crate::integrate::Stepper;
use crate::lists::copy;
use crate::system::Real;
use crate::Scalar;

/// Number of stretches of a step at whose ends the functions are evaluated, where bodies turn little.
const STRETCHES: u32 = 4;
/// Largest number of stretches, and largest angle, rad, by which bodies turn within one: steps in which bodies spin freely
/// may be many turns long, because no error limits them.
const MOST_STRETCHES: f64 = 1e6;
pub(super) const TURN: f64 = 1.0;
/// Part of the force at the end of a stretch by which a contact pulls at its start, if it does not just begin to.
const PULLS: f64 = 1e-3;
/// Part of the normal force by which the force of a contact that sticks is beyond the friction cone, not on it.
const BEYOND: f64 = 1e-9;
/// How often a stretch is halved in search of a point where a gap is positive, and another function.
const HALVINGS: [u32; 2] = [40, 4];

/// Overlaps, m (rad), that end an open contact in free flight, and while other contacts are held closed. Rounding errors of
/// a gap that has just been zero are smaller than the first; holding a contact moves others by its own small gap. What
/// lands is moved back to where the gap is zero.
const OVERLAP: [f64; 2] = [1e-15, 1e-11];

/// The functions of one contact: it stays in its mode while both are positive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watched<S> {
    /// Gap of an open contact, normal force of a closed one.
    pub first: S,
    /// Rate of the gap of an open contact.
    pub rate: S,
    /// Speed of slip of a contact that slides.
    pub speed: S,
    /// Angular velocity of its bodies against each other, rad/s, at most.
    pub turning: S,
    /// Speed of slip along the direction where the step began; distance of the force from the friction cone.
    pub second: Option<S>,
}

/// An event of the last step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found<S> {
    pub contact: usize,
    pub cause: Cause,
    /// Where in the step.
    pub theta: S,
}

/// The causes that a mode can have.
fn causes(mode: Mode) -> [Cause; 2] {
    match mode {
        Mode::Open => [Cause::Landed; 2],
        Mode::Slide => [Cause::Unloaded, Cause::Stopped],
        Mode::Stick => [Cause::Unloaded, Cause::Slipped],
    }
}

impl<S: Real> Watched<S> {
    pub(super) fn zero() -> Self {
        let zero = S::zero();
        Watched { first: zero, rate: zero, speed: zero, turning: zero, second: None }
    }

    /// Whether the gap cannot have closed in the `h` s between here and a later point, with twice the speeds at both.
    pub(super) fn apart(&self, later: &Self, h: S) -> bool {
        let least = if self.first < later.first { self.first } else { later.first };
        let fastest = if self.rate.abs() > later.rate.abs() { self.rate.abs() } else { later.rate.abs() };
        least > S::constant(2.0) * h * fastest
    }

    fn value(&self, which: usize) -> Option<S> {
        if which == 0 {
            Some(self.first)
        } else {
            self.second
        }
    }
}

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// Evaluates the functions at the state in `self.q`, `self.p`.
    pub(super) fn evaluate(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, right: bool) {
        system.glance(t, &self.q, &self.p);
        if !system.is_open() {
            system.loads(t, &self.q, true);
        }
        self.watch(system, right);
    }

    /// Takes the functions of the contacts that are minded where the system was looked at last.
    pub(super) fn watch(&mut self, system: &WithContacts<Y>, right: bool) {
        let out = if right { &mut self.right } else { &mut self.left };
        for (k, out) in out.as_mut().iter_mut().enumerate() {
            if system.minds(k) {
                *out = system.watched(k);
            }
        }
    }

    /// Evaluates them at `θ` in the last step.
    fn sample(&mut self, system: &mut WithContacts<Y>, theta: Y::Scalar, right: bool) {
        let (t, h) = self.solver.last_step();
        self.solver.dense(system, theta, &mut self.q, &mut self.p);
        self.evaluate(system, t + theta * h, right);
    }

    /// One of the functions at `θ` in the last step.
    fn value_at(
        &mut self,
        system: &mut WithContacts<Y>,
        k: usize,
        theta: Y::Scalar,
        of: impl Fn(&Watched<Y::Scalar>) -> Y::Scalar,
    ) -> Y::Scalar {
        let (t, h) = self.solver.last_step();
        self.solver.dense(system, theta, &mut self.q, &mut self.p);
        system.glance(t + theta * h, &self.q, &self.p);
        if system.mode(k) != Mode::Open {
            system.loads(t + theta * h, &self.q, true);
        }
        of(&system.watched(k))
    }

    /// The first event of the last step. `self.left` has the functions at its start.
    pub(super) fn first_event(
        &mut self,
        system: &mut WithContacts<Y>,
    ) -> Result<Option<Found<Y::Scalar>>, HybridError> {
        let (zero, one) = (Y::Scalar::zero(), Y::Scalar::one());
        if self.left.as_ref().is_empty() {
            return Ok(None);
        }
        let known = core::mem::replace(&mut self.known, false);
        if self.stays_apart(system, known) {
            self.rests = false;
            return Ok(None);
        }
        self.note_start(system);
        self.sample(system, one, true);
        self.rests = system.at_rest();
        self.travel_with_end(system);
        let others = self.look_for_others(system);
        // The last stretch ends there too.
        copy(self.end.as_mut(), self.right.as_ref());
        let (t, h) = self.solver.last_step();
        if (!known || others) && !(0..self.count(system)).all(|k| self.is_far(system, k)) {
            let Hybrid { start, q, p, .. } = self;
            copy(q.as_mut(), start.1.as_ref());
            copy(p.as_mut(), start.2.as_ref());
            self.evaluate(system, t, false);
        }
        let Some(turn) = self.turn_of_near(system, h) else {
            self.move_on();
            self.go_on(system, others);
            return Ok(None);
        };
        if !(turn < MOST_STRETCHES) {
            return Err(HybridError::TurnsTooFar { time: t.to_f64(), angle: turn * TURN });
        }
        let stretches = libm::ceil(turn).max(f64::from(STRETCHES)) as u32;
        self.mind_searched(system, true);
        let mut from = zero;
        for j in 1..=stretches {
            let to = Y::Scalar::constant(f64::from(j) / f64::from(stretches));
            if j < stretches {
                self.sample(system, to, true);
            } else {
                copy(self.right.as_mut(), self.end.as_ref());
            }
            let mut first: Option<Found<Y::Scalar>> = None;
            for k in 0..self.left.as_ref().len() {
                for which in 0..2 {
                    if let Some(found) = self.zero_of(system, k, which, (from, to)) {
                        if first.is_none_or(|other| found.theta < other.theta) {
                            first = Some(found);
                        }
                    }
                }
            }
            if first.is_some() {
                return Ok(first);
            }
            self.move_on();
            from = to;
        }
        self.mind_searched(system, false);
        self.go_on(system, others);
        let stopped = match self.ends_turning(system) {
            Some(contact) => Some(contact),
            None => self.creeps(system, h / Y::Scalar::constant(f64::from(stretches))),
        };
        Ok(match stopped {
            Some(contact) => Some(Found { contact, cause: Cause::Stopped, theta: one }),
            None => self.overloaded(system),
        })
    }

    /// The next step starts where the last one ends. `known`: all gaps were looked at there.
    fn go_on(&mut self, system: &mut WithContacts<Y>, known: bool) {
        if !known {
            self.use_up();
        }
        self.refill(system);
        if system.minds_all() {
            self.mind_near(system);
        }
    }

    /// The event at which the forces of redundant contacts stop to be possible, if they have in the last step. Their
    /// distribution is not unique; the one that the constraints give may leave the friction cones although another does
    /// not. So the forces are solved for wherever it does.
    fn overloaded(&mut self, system: &mut WithContacts<Y>) -> Option<Found<Y::Scalar>> {
        let (zero, one) = (Y::Scalar::zero(), Y::Scalar::one());
        let contact = self.doubtful(system).filter(|_| !system.shares())?;
        if core::mem::take(&mut self.unchanged) || self.holds_at(system, one) {
            return None;
        }
        let (t, h) = self.solver.last_step();
        let (mut a, mut b) = (zero, one);
        let width = Y::Scalar::constant(2.0 * resolution(t, h));
        while b - a > width {
            let middle = Y::Scalar::constant(0.5) * (a + b);
            if !(middle > a && middle < b) {
                break;
            }
            if self.holds_at(system, middle) {
                a = middle;
            } else {
                b = middle;
            }
        }
        Some(Found { contact, cause: Cause::Unloaded, theta: b })
    }

    /// The first closed contact whose force at the end of the step is not possible.
    fn doubtful(&self, system: &WithContacts<Y>) -> Option<usize> {
        let zero = Y::Scalar::zero();
        let beyond = |(w, mode): (&Watched<Y::Scalar>, &Mode)| match mode {
            Mode::Open => false,
            Mode::Slide => w.first < zero,
            Mode::Stick => w.first < zero || w.second.is_some_and(|x| x < zero),
        };
        self.left.as_ref().iter().zip(system.modes()).position(beyond)
    }

    /// Whether the modes are those that the forces at `θ` in the last step give.
    fn holds_at(&mut self, system: &mut WithContacts<Y>, theta: Y::Scalar) -> bool {
        let (t, h) = self.solver.last_step();
        self.solver.dense(system, theta, &mut self.q, &mut self.p);
        system.look(t + theta * h, &self.q, &self.p);
        self.touching.take_closed(system);
        // Where there are no forces, friction jams a contact: an event.
        let found = self.select(system, t + theta * h).is_ok();
        found && self.touching.modes.as_ref() == system.modes()
    }

    /// Takes the end of a stretch for the start of the next one.
    fn move_on(&mut self) {
        core::mem::swap(&mut self.left, &mut self.right);
    }

    /// The first zero of a function between two points of the step, at whose ends `self.left` and `self.right` are.
    fn zero_of(
        &mut self,
        system: &mut WithContacts<Y>,
        k: usize,
        which: usize,
        (from, to): (Y::Scalar, Y::Scalar),
    ) -> Option<Found<Y::Scalar>> {
        let zero = Y::Scalar::zero();
        let (a, b) = (*self.left.as_ref().get(k)?, *self.right.as_ref().get(k)?);
        let (at_a, at_b) = (a.value(which)?, b.value(which)?);
        let mode = system.mode(k);
        if self.is_far(system, k) {
            return None;
        }
        if system.is_one_of_many(k) {
            return None;
        }
        let cause = *causes(mode).get(which)?;
        let value = move |w: &Watched<Y::Scalar>| w.value(which).unwrap_or(zero);
        let mut end = (to, at_b);
        if !(at_b <= zero) {
            // Both ends are positive: only a gap with a minimum between them can have been zero, if the bodies are near.
            let h = (to - from) * self.solver.last_step().1;
            if mode != Mode::Open || !(a.rate < zero && b.rate > zero) || a.apart(&b, h) {
                return None;
            }
            let lowest = self.root(system, k, (from, -a.rate), (to, -b.rate), |w| -w.rate);
            let gap = self.value_at(system, k, lowest, value);
            if gap > zero {
                return None;
            }
            end = (lowest, gap);
        }
        let mut start = (from, at_a);
        if !(at_a > zero) {
            // The function starts on zero, and has been positive since if it is an event.
            start = match self.positive(system, k, (from, end.0), value) {
                Some(start) => start,
                None if mode == Mode::Open => return self.sinks(system, k, (from, at_a), end),
                // The normal force has gone through infinity, not through zero.
                None if which == 0 && at_a < Y::Scalar::constant(PULLS) * at_b && system.slides_on(k) => {
                    return Some(Found { contact: k, cause: Cause::Jammed, theta: from });
                }
                // A force that has just reached the friction cone has left it.
                None if which == 1 && mode == Mode::Stick && at_b < -(Y::Scalar::constant(BEYOND) * b.first) => {
                    return Some(Found { contact: k, cause, theta: from });
                }
                // Friction would act along the slip: the direction is taken anew.
                None if which == 1 && at_a < zero && system.slides_on(k) => {
                    return Some(Found { contact: k, cause, theta: from });
                }
                None => return None,
            };
        }
        let theta = self.root(system, k, start, end, value);
        Some(Found { contact: k, cause, theta })
    }

    /// The landing of an open contact whose gap has not been positive since the stretch began, at `start`, and is smaller at
    /// its `end`: its last bounce was lower than what can be told from zero. It lands where the gap is again what it was.
    fn sinks(
        &mut self,
        system: &mut WithContacts<Y>,
        k: usize,
        start: (Y::Scalar, Y::Scalar),
        end: (Y::Scalar, Y::Scalar),
    ) -> Option<Found<Y::Scalar>> {
        let least = Y::Scalar::constant(OVERLAP[0]);
        if !(start.1 - end.1 > least) {
            return None;
        }
        let above = |w: &Watched<Y::Scalar>| w.first - start.1;
        let theta = match self.positive(system, k, (start.0, end.0), above) {
            Some(risen) => self.root(system, k, risen, (end.0, end.1 - start.1), above),
            None => start.0,
        };
        Some(Found { contact: k, cause: Cause::Landed, theta })
    }

    /// A point within a stretch where a function is positive, with its value.
    fn positive(
        &mut self,
        system: &mut WithContacts<Y>,
        k: usize,
        (from, to): (Y::Scalar, Y::Scalar),
        value: impl Fn(&Watched<Y::Scalar>) -> Y::Scalar,
    ) -> Option<(Y::Scalar, Y::Scalar)> {
        let mut width = to - from;
        let [of_gap, of_other] = HALVINGS;
        for _ in 0..if system.mode(k) == Mode::Open { of_gap } else { of_other } {
            width = Y::Scalar::constant(0.5) * width;
            let x = from + width;
            let found = self.value_at(system, k, x, &value);
            if found > Y::Scalar::zero() {
                return Some((x, found));
            }
        }
        None
    }

    /// Where a function reaches zero between two points of the step.
    fn root(
        &mut self,
        system: &mut WithContacts<Y>,
        k: usize,
        a: (Y::Scalar, Y::Scalar),
        b: (Y::Scalar, Y::Scalar),
        value: impl Fn(&Watched<Y::Scalar>) -> Y::Scalar,
    ) -> Y::Scalar {
        let (t, h) = self.solver.last_step();
        root(a, b, resolution(t, h), |x| {
            let found = self.value_at(system, k, x, &value);
            (found, found <= Y::Scalar::zero())
        })
    }
}

impl<Y: Touching> WithContacts<Y> {
    /// Whether all velocities are rounding errors, after [`WithContacts::look`].
    pub(super) fn at_rest(&self) -> bool {
        self.at.v.as_ref().iter().all(|v| v.to_f64().abs() < 1e-12)
    }

    /// The functions of contact `k`, after [`WithContacts::look`] and, if it is closed, [`WithContacts::loads`].
    pub(super) fn watched(&self, k: usize) -> Watched<Y::Scalar> {
        let c = self.contact(k);
        let [normal, x, y] = self.force(k);
        let held = usize::from(!self.is_open());
        let none = Watched { turning: self.turning(k), ..Watched::zero() };
        match self.mode(k) {
            Mode::Open => {
                Watched { first: self.gap(k) + Y::Scalar::constant(OVERLAP[held]), rate: self.gap_rate(k), ..none }
            }
            Mode::Slide => {
                let second = self.rubs(k).then(|| self.along_slip(k));
                Watched { first: normal, speed: self.speed(k), second, ..none }
            }
            Mode::Stick => {
                let tangential = (x * x + y * y).sqrt();
                Watched { first: normal, second: Some(c.friction * normal - tangential), ..none }
            }
        }
    }
}
