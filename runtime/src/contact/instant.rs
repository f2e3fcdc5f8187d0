//! Impulses, or forces, of contacts at an instant: the problem and the memory for its solution.

use super::assembly::{lines, symmetrize, Forces};
use super::solver::{factor, solve_factored, solve_near};
use super::{solve, Certificate, Contact, ContactError, Effort, HybridError, Mode};
use super::{Problem, Touch, Touching, WithContacts};
use crate::lists::{copy, first, first_mut, get, get_or, set, split};
use crate::system::Real;
use crate::Scalar;

/// Compliance of a contact among those that share a load, as a part of that by its inertia, and the number of times that
/// what it gives way is taken back. Accelerations of closed contacts that it leaves are below rounding errors where the
/// contacts that share a load are farther apart than a hundredth of the size of their bodies.
const COMPLIANCE: f64 = 1e-4;
const PASSES: u32 = 8;

/// The contacts that take part, and memory for their impulses and forces.
#[derive(Clone, Debug)]
pub(super) struct Touches<Y: Touching> {
    pub count: usize,
    pub order: Y::PerContact<usize>,
    pub problem: Y::PerContact<Touch<Y::Scalar>>,
    pub open: Y::PerContact<Mode>,
    pub modes: Y::PerContact<Mode>,
    pub slip: Y::PerContact<[Y::Scalar; 2]>,
    /// Whether a contact begins to slide.
    pub begins: Y::PerContact<bool>,
    /// Contacts that stay closed although they would depart slowly.
    pub settles: Y::PerContact<bool>,
    pub a: Y::Delassus,
    pub b: Y::Delassus,
    /// Inverse inertia along each of the lines that share a load.
    own: Y::Delassus,
    pub impulses: Y::Delassus,
    pub work: Y::Delassus,
}

impl<Y: Touching> Touches<Y> {
    pub fn new(system: &Y) -> Self {
        let rows: usize = system.contacts().iter().map(Contact::rows).sum();
        let touch = Touch { contact: Contact::nowhere(), slip: None };
        Touches {
            count: 0,
            order: system.per_contact(0),
            problem: system.per_contact(touch),
            open: system.per_contact(Mode::Open),
            modes: system.per_contact(Mode::Open),
            slip: system.per_contact([Y::Scalar::zero(); 2]),
            begins: system.per_contact(false),
            settles: system.per_contact(false),
            a: system.zero_delassus(rows * rows),
            b: system.zero_delassus(rows),
            own: system.zero_delassus(rows),
            impulses: system.zero_delassus(rows),
            work: system.zero_delassus(super::work_len(rows)),
        }
    }

    /// The contacts that take part.
    pub fn order(&self) -> &[usize] {
        first(self.order.as_ref(), self.count)
    }

    /// The contact that takes part as number `i`.
    pub fn contact(&self, i: usize) -> usize {
        get_or(self.order(), i, usize::MAX)
    }

    /// An error of the problem at time `t` (s), told of the contact by its number in the mechanism.
    pub fn error(&self, t: Y::Scalar, error: ContactError) -> HybridError {
        HybridError::Contact { time: t.to_f64(), error: error.at(|touch| self.contact(touch)) }
    }

    /// The same as a contact of the problem.
    pub fn touch(&self, i: usize) -> Touch<Y::Scalar> {
        get_or(self.problem.as_ref(), i, Touch { contact: Contact::nowhere(), slip: None })
    }

    /// Sets its direction of slip.
    pub fn set_slip(&mut self, i: usize, slip: Option<[Y::Scalar; 2]>) {
        if let Some(touch) = self.problem.as_mut().get_mut(i) {
            touch.slip = slip;
        }
    }

    /// Number of their rows.
    pub fn rows(&self) -> usize {
        first(self.problem.as_ref(), self.count).iter().map(|touch| touch.contact.rows()).sum()
    }

    /// Takes one contact into the problem.
    pub fn take(&mut self, system: &WithContacts<Y>, k: usize) {
        let touch = Touch { contact: Contact { row: self.rows(), ..system.contact(k) }, slip: None };
        set(self.order.as_mut(), self.count, k);
        set(self.problem.as_mut(), self.count, touch);
        self.count += 1;
    }

    /// Takes the contacts that are closed into the problem.
    pub fn take_closed(&mut self, system: &WithContacts<Y>) {
        self.count = 0;
        for (k, mode) in system.modes().iter().enumerate() {
            if *mode != Mode::Open {
                self.take(system, k);
            }
        }
    }

    /// Inverse inertia of the contacts in the problem; with `implicit`, for a step in which springs and dampers follow.
    pub fn assemble(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, q: &Y::Coordinates, implicit: bool) {
        let rows = self.rows();
        let all = Forces { contacts: first(self.order.as_ref(), self.count), touches: None };
        let a = first_mut(self.a.as_mut(), rows * rows);
        system.responses((t, q), all, (self.open.as_ref(), implicit), a, &mut []);
        system.restore();
        symmetrize(a, rows);
    }

    /// Inverse inertia of a row of the problem, after [`Touches::assemble`].
    pub fn inverse_inertia(&self, row: usize) -> Y::Scalar {
        get(self.a.as_ref(), row * self.rows() + row)
    }

    /// Multipliers with all rows of sticking contacts and the normal rows of sliding ones held, without friction of the
    /// latter.
    fn hold(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, q: &Y::Coordinates) {
        self.modes.as_mut().fill(Mode::Open);
        for (touch, &k) in self.problem.as_ref().iter().zip(first(self.order.as_ref(), self.count)) {
            let slides = touch.slip.is_some();
            set(self.modes.as_mut(), k, if slides { Mode::Slide } else { Mode::Stick });
        }
        system.hold(t, q, self.modes.as_ref());
        self.modes.as_mut().fill(Mode::Open);
    }

    /// Accelerations of the rows if no contact had a force, in `b`. With all rows of sticking contacts and the normal rows
    /// of sliding ones held, the forces `f` keep them from accelerating, `b + A f = 0`.
    pub fn free_accelerations(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, q: &Y::Coordinates) {
        let zero = Y::Scalar::zero();
        self.hold(system, t, q);
        let rows = self.rows();
        let (a, b) = (self.a.as_ref(), self.b.as_mut());
        b.fill(zero);
        let mut column = 0;
        for (touch, &k) in self.problem.as_ref().iter().zip(first(self.order.as_ref(), self.count)) {
            let c = system.contact(k);
            for j in 0..c.rows() {
                let held = j == 0 || touch.slip.is_none();
                let lambda = if held { get(system.at.lambda.as_ref(), c.row + j) } else { zero };
                for (row, b) in b.iter_mut().enumerate().take(rows) {
                    *b = *b + get(a, row * rows + column) * lambda;
                }
                column += 1;
            }
        }
    }

    /// The problem of `a` and `b`, memory for its impulses, and for the solver.
    #[allow(clippy::type_complexity, reason = "three parts, borrowed together")]
    pub fn parts(&mut self) -> (Problem<'_, Y::Scalar>, &mut [Y::Scalar], &mut [Y::Scalar]) {
        let rows = self.rows();
        let problem = Problem {
            a: first(self.a.as_ref(), rows * rows),
            b: first(self.b.as_ref(), rows),
            touches: first(self.problem.as_ref(), self.count),
        };
        (problem, first_mut(self.impulses.as_mut(), rows), self.work.as_mut())
    }

    /// Forces of the contacts, in `impulses`, at the state that was looked at last: forces and accelerations are
    /// complementary on the friction cones, and contacts with a direction of slip have their friction against it. With
    /// `near`, `impulses` has such forces of the same contacts at a state nearby.
    pub fn find_forces(
        &mut self,
        system: &mut WithContacts<Y>,
        t: Y::Scalar,
        q: &Y::Coordinates,
        effort: Effort,
        near: bool,
    ) -> Result<Certificate<Y::Scalar>, ContactError> {
        self.assemble(system, t, q, false);
        self.free_accelerations(system, t, q);
        let (problem, forces, work) = self.parts();
        if near {
            return solve_near(&problem, effort, forces, work);
        }
        forces.fill(Y::Scalar::zero());
        solve(&problem, effort, forces, work)
    }

    /// Forces of the closed contacts at the state that was looked at last, with the modes and directions of slip as they
    /// are: they may be outside the cones. Contacts whose rows depend on one another share their load as compliant ones
    /// would, in the limit of no compliance. `false` where there are no such forces.
    ///
    /// They are in `impulses`, one for each of the [`lines`]: all of a contact that sticks, and the normal force of one that
    /// slides, whose friction belongs to it.
    pub fn share(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar, q: &Y::Coordinates) -> bool {
        self.take_closed(system);
        for i in 0..self.count {
            let k = self.contact(i);
            if system.mode(k) == Mode::Slide {
                self.set_slip(i, Some(system.direction(k)));
            }
        }
        self.hold(system, t, q);
        let Touches { count, order, problem, .. } = self;
        let touches = Some(first(problem.as_ref(), *count));
        let shared = Forces { contacts: first(order.as_ref(), *count), touches };
        let n = lines(system.system.contacts(), shared).count();
        let a = first_mut(self.a.as_mut(), n * n);
        system.responses((t, q), shared, (self.open.as_ref(), false), a, self.own.as_mut());
        system.response_to_multipliers((t, q), shared, self.b.as_mut());
        system.restore();
        self.share_forces(n)
    }

    /// The contacts that share a load, for [`lines`].
    pub fn sharing(&self) -> Forces<'_, Y::Scalar> {
        Forces { contacts: self.order(), touches: Some(first(self.problem.as_ref(), self.count)) }
    }

    /// The `n` forces of [`Touches::share`] from `a`, `own` and `b`.
    fn share_forces(&mut self, n: usize) -> bool {
        let (zero, one) = (Y::Scalar::zero(), Y::Scalar::one());
        let more = Y::Scalar::constant(COMPLIANCE);
        let (matrix, rest) = split(self.work.as_mut(), n * n);
        let (rhs, rest) = split(rest, n);
        let exchanged = first_mut(rest, n);
        let own = first(self.own.as_ref(), n);
        let lines = matrix.chunks_exact_mut(n.max(1)).zip(self.a.as_ref().chunks_exact(n.max(1)));
        for (row, ((line, a), &own)) in lines.zip(own).enumerate() {
            line.fill(zero);
            // What cannot move has no force.
            set(line, row, one);
            if own > zero {
                for (x, a) in line.iter_mut().zip(a) {
                    *x = *a / own;
                }
                let held = get(line, row) + more;
                set(line, row, held);
            }
        }
        if !factor(matrix, exchanged) {
            return false;
        }
        let forces = first_mut(self.impulses.as_mut(), n);
        forces.fill(zero);
        (0..PASSES).all(|_| {
            for (rhs, ((&own, b), force)) in rhs.iter_mut().zip(own.iter().zip(self.b.as_ref()).zip(forces.iter())) {
                *rhs = if own > zero { more * *force - *b / own } else { zero };
            }
            let found = solve_factored(matrix, exchanged, rhs);
            copy(forces, rhs);
            found
        })
    }

    /// Acceleration of a row with the forces in `impulses`, after [`Touches::find_forces`], or velocity with the impulses there.
    pub fn with_impulses(&self, row: usize) -> Y::Scalar {
        let rows = self.rows();
        let (a, b, f) = (self.a.as_ref(), self.b.as_ref(), self.impulses.as_ref());
        (0..rows).fold(get(b, row), |sum, column| sum + get(a, row * rows + column) * get(f, column))
    }
}
