//! Friction of contacts that slide: directions of slip, and the forces that act back on the normal ones.

use super::WithContacts;
use crate::contact::assembly::lines;
use crate::contact::instant::Touches;
use crate::contact::solver::{factor, solve_factored};
use crate::contact::touching::add_row;
use crate::contact::{Effort, Mode, Touching};
use crate::lists::{first, first_mut, get, largest, set, split};
use crate::system::Real;
use crate::Scalar;

/// Speed of slip below which its direction is the one that it had where the step began, m/s.
const SLOW: f64 = 1e-13;
/// Speed of slip, m/s, up to which a contact that begins to slide has its friction against the acceleration of slip.
///
/// Where slip begins, friction turns it within about `|v|/(µ N/m)` into the direction of its acceleration: explicit steps
/// would have to be as short, and the speed grows from zero as slowly as `t²`. So this fast motion is left out until its
/// time has grown; the velocity then errs by about `ω m/(µ N)` times the square of this speed, where `ω` is the rate at
/// which the direction turns, which is near 1e-11 m/s.
pub(in crate::contact) const CREEP: f64 = 1e-5;
/// Part of the largest force below which a force does not tell the direction of slip.
const UNSURE: f64 = 1e-3;

impl<Y: Touching> WithContacts<Y> {
    /// Speed of slip of contact `k`, m/s, after [`WithContacts::look`].
    pub(in crate::contact) fn speed(&self, k: usize) -> Y::Scalar {
        let [x, y] = self.tangential(k);
        (x * x + y * y).sqrt()
    }

    /// Whether contact `k` slides with friction, and does not just begin to.
    pub(in crate::contact) fn slides_on(&self, k: usize) -> bool {
        self.rubs(k) && !self.begins(k)
    }

    /// Speed of slip of contact `k` along the direction that is noted for it, m/s, after [`WithContacts::look`].
    pub(in crate::contact) fn along_slip(&self, k: usize) -> Y::Scalar {
        let ([x, y], [a, b]) = (self.tangential(k), self.slip_of(k));
        x * a + y * b
    }

    /// Whether contact `k` slides against the direction of slip that is noted for it, after [`WithContacts::look`].
    pub(in crate::contact) fn is_turned(&self, k: usize) -> bool {
        self.slides_on(k) && self.along_slip(k) < Y::Scalar::zero()
    }

    /// Direction of slip of contact `k` after [`WithContacts::look`]. Beyond the end of the motion along the direction
    /// where the step began, it is the mirror image: it does not jump within a step that leads too far.
    pub(in crate::contact) fn direction(&self, k: usize) -> [Y::Scalar; 2] {
        if self.begins(k) {
            return self.slip_of(k);
        }
        let ([x, y], [a, b]) = (self.tangential(k), self.slip_of(k));
        let speed = (x * x + y * y).sqrt();
        if !(speed.to_f64() > SLOW) {
            return [a, b];
        }
        let along = self.along_slip(k);
        let back = if along < Y::Scalar::zero() { along + along } else { Y::Scalar::zero() };
        [(x - back * a) / speed, (y - back * b) / speed]
    }

    /// Notes the directions of slip where a step begins.
    pub(in crate::contact) fn note_slip(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) {
        if !self.rubs {
            return;
        }
        // Where the last step has not found the forces that give its direction, slip has that of its velocity from now on.
        let unsure = core::mem::take(&mut self.unsure);
        self.look_at_closed(t, q, p);
        for k in 0..self.modes.as_ref().len() {
            let begins = self.begins(k) && !unsure && !(self.speed(k).to_f64() > CREEP);
            set(self.begins.as_mut(), k, begins);
            if self.rubs(k) {
                let direction = self.direction(k);
                set(self.slip.as_mut(), k, direction);
            }
        }
    }

    /// Directions of slip that begins, after [`WithContacts::look`]: with forces that satisfy Coulomb's law at the level of
    /// accelerations, friction against the acceleration of slip. Where no such forces are found, the directions stay, and the
    /// next searches in the same step are brief ones.
    fn begin(&mut self, t: Y::Scalar, q: &Y::Coordinates) {
        let Some(mut instant) = self.instant.take() else { return };
        instant.take_closed(self);
        for i in 0..instant.count {
            let k = instant.contact(i);
            if self.slides_on(k) {
                instant.set_slip(i, Some(self.direction(k)));
            }
        }
        let effort = if self.unsure { Effort::brief() } else { Effort::default() };
        self.near = instant.find_forces(self, t, q, effort, self.near).is_ok();
        self.unsure |= !self.near;
        if self.near {
            for i in 0..instant.count {
                let k = instant.contact(i);
                if self.begins(k) {
                    self.turn_slip(&instant, i, k);
                }
            }
        }
        self.instant = Some(instant);
    }

    /// The direction of slip of contact `k`, which is the problem's contact `i`: against its friction, or along its
    /// acceleration where its force is small, because others can take it over.
    fn turn_slip(&mut self, instant: &Touches<Y>, i: usize, k: usize) {
        let zero = Y::Scalar::zero();
        let c = instant.touch(i).contact;
        let f = first(instant.impulses.as_ref(), instant.rows());
        let largest = largest(f);
        let [n, mut x, mut y] = [get(f, c.row), -get(f, c.row + 1), -get(f, c.row + 2)];
        if !(n > Y::Scalar::constant(UNSURE) * largest) {
            (x, y) = (instant.with_impulses(c.row + 1), instant.with_impulses(c.row + 2));
        }
        let size = (x * x + y * y).sqrt();
        if size > zero {
            set(self.slip.as_mut(), k, [x / size, y / size]);
        }
    }

    /// Whether contact `k` slides with friction.
    pub(in crate::contact) fn rubs(&self, k: usize) -> bool {
        let c = self.contact(k);
        self.mode(k) == Mode::Slide && c.tangents && c.friction > Y::Scalar::zero()
    }

    /// Friction of contact `k` on the joints for a normal force of 1 N, in `self.unit`.
    fn unit_friction(&mut self, k: usize) {
        let c = self.contact(k);
        self.unit.as_mut().fill(Y::Scalar::zero());
        let [a, b] = self.direction(k);
        for (row, along) in [(c.row + 1, a), (c.row + 2, b)] {
            add_row(&self.system, &self.at.entries, row, -(c.friction * along), &mut self.unit);
        }
    }

    /// Forces of all contacts that are closed, after [`WithContacts::look`]; the friction of those that slide as forces
    /// on the joints. With `all`, those of sticking contacts include the effect of friction elsewhere.
    pub(in crate::contact) fn loads(&mut self, t: Y::Scalar, q: &Y::Coordinates, all: bool) {
        let zero = Y::Scalar::zero();
        if self.begins.as_ref().contains(&true) {
            self.begin(t, q);
        }
        self.friction.as_mut().fill(zero);
        self.rounding = 0.0;
        if self.shares() && self.share(t, q) {
            return;
        }
        self.system.multipliers(t, q, &self.at.v, &mut self.at.lambda);
        if self.rubs {
            self.normal_forces(t, q);
        }
        if self.rubs && all {
            self.respond(t, q, false);
            for (lambda, sigma) in self.at.lambda.as_mut().iter_mut().zip(self.sigma.as_ref()) {
                *lambda = *lambda + *sigma;
            }
        }
        for k in 0..self.modes.as_ref().len() {
            let c = self.contact(k);
            let lambda = self.at.lambda.as_ref();
            let own = |row: usize, acts: bool| if acts { -get(lambda, row) } else { zero };
            let mode = self.mode(k);
            let mut force = [zero; 3];
            for (i, force) in force.iter_mut().enumerate().take(c.rows()) {
                *force = own(c.row + i, mode.acts(i));
            }
            if self.rubs(k) {
                let normal = if all { force[0] } else { get(self.normals.as_ref(), k) };
                let [a, b] = self.direction(k);
                force = [normal, -(c.friction * normal * a), -(c.friction * normal * b)];
            }
            set(self.at.forces.as_mut(), k, force);
        }
    }

    /// [`WithContacts::loads`] where contacts that slide share a load; `false` where no forces are found.
    fn share(&mut self, t: Y::Scalar, q: &Y::Coordinates) -> bool {
        let Some(mut instant) = self.instant.take() else { return false };
        // Its forces are those of other lines. Contacts that share a load have many solutions, too, of which a search that
        // starts near the last one finds others at the same state: steps that see them are rejected.
        self.near = false;
        let found = instant.share(self, t, q);
        if found {
            let zero = Y::Scalar::zero();
            let (lambda, friction) = (self.at.lambda.as_mut(), &mut self.friction);
            lambda.fill(zero);
            for (line, force) in lines(self.system.contacts(), instant.sharing()).zip(instant.impulses.as_ref()) {
                for (i, (row, force)) in line.forces(*force).enumerate() {
                    set(lambda, row, -force);
                    if i > 0 {
                        add_row(&self.system, &self.at.entries, row, force, friction);
                    }
                }
            }
            for (force, c) in self.at.forces.as_mut().iter_mut().zip(self.system.contacts()) {
                *force = core::array::from_fn(|i| if i < c.rows() { -get(lambda, c.row + i) } else { zero });
            }
        }
        self.instant = Some(instant);
        found
    }

    /// Multipliers of forces on the joints at rest, in `self.sigma`: of `self.unit`, or of all friction.
    fn respond(&mut self, t: Y::Scalar, q: &Y::Coordinates, unit: bool) {
        let force = if unit { &self.unit } else { &self.friction };
        // The state's momenta have no multipliers, so that these are those of the force alone.
        for (r, (p, f)) in self.response.as_mut().iter_mut().zip(self.p.as_ref().iter().zip(force.as_ref())) {
            *r = *p + *f;
        }
        self.answer(t, q);
    }

    /// The contacts that rub.
    fn rubbing(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.modes.as_ref().len()).filter(|k| self.rubs(*k))
    }

    /// Normal forces `N` of the contacts that rub, in [`WithContacts::normals`], from `N − R N = N₀`, and their friction in total.
    /// `R` has the normal forces of each as it answers to the friction of others.
    fn normal_forces(&mut self, t: Y::Scalar, q: &Y::Coordinates) {
        let (zero, one) = (Y::Scalar::zero(), Y::Scalar::one());
        let (count, n) = (self.modes.as_ref().len(), self.rubbing().count());
        let mut column = 0;
        for k in 0..count {
            if !self.rubs(k) {
                continue;
            }
            self.unit_friction(k);
            self.respond(t, q, true);
            let mut row = 0;
            for j in 0..count {
                if !self.rubs(j) {
                    continue;
                }
                let own = if j == k { one } else { zero };
                let response = -get(self.sigma.as_ref(), self.contact(j).row);
                set(self.table.as_mut(), row * n + column, own - response);
                row += 1;
            }
            let free = -get(self.at.lambda.as_ref(), self.contact(k).row);
            set(self.normals.as_mut(), column, free);
            column += 1;
        }
        let (matrix, exchanged) = split(self.table.as_mut(), n * n);
        let (exchanged, normals) = (first_mut(exchanged, n), first_mut(self.normals.as_mut(), n));
        if !factor(matrix, exchanged) {
            // No forces are consistent: the step that asks for them is refused.
            normals.fill(Y::Scalar::constant(f64::NAN));
        }
        solve_factored(matrix, exchanged, normals);
        for (i, normal) in normals.iter().enumerate() {
            // The pivot is a difference of numbers near one.
            let error = Y::Scalar::epsilon() * (*normal / get(matrix, i * n + i)).to_f64().abs();
            self.rounding = self.rounding.max(error);
        }
        // Behind the contacts that rub, all others have none: each goes to its own place, the last first.
        let mut place = n;
        for k in (0..count).rev() {
            let rubs = self.rubs(k);
            place -= usize::from(rubs);
            let normal = if rubs { get(self.normals.as_ref(), place) } else { zero };
            set(self.normals.as_mut(), k, normal);
            if rubs {
                self.unit_friction(k);
                for (sum, unit) in self.friction.as_mut().iter_mut().zip(self.unit.as_ref()) {
                    *sum = *sum + normal * *unit;
                }
            }
        }
    }
}
