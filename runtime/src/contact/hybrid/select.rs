//! The modes of contacts that touch, by the accelerations and forces of the instant.

use super::{Cause, Hybrid, HybridError};
use crate::contact::{solve, Contact, Mode, Touch, Touching, WithContacts};
use crate::integrate::Stepper;
use crate::system::Real;
use crate::Scalar;

/// Part of the largest acceleration, or force, that counts as zero.
const SMALL: f64 = 1e-9;

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// Takes the contacts that are closed into the problem.
    pub(super) fn take_closed(&mut self, system: &WithContacts<Y>) {
        self.touching.count = 0;
        for k in 0..self.count(system) {
            if system.modes()[k] != Mode::Open {
                self.take(system, k);
            }
        }
    }

    /// Takes one contact into the problem.
    pub(super) fn take(&mut self, system: &WithContacts<Y>, k: usize) {
        let row = self.touching.rows();
        let touching = &mut self.touching;
        touching.order.as_mut()[touching.count] = k;
        touching.problem.as_mut()[touching.count] = Touch { contact: Contact { row, ..system.contact(k) }, slip: None };
        touching.count += 1;
    }

    /// Computes the modes of the contacts in the problem, into `self.touching`; all others are open. Their bodies stay
    /// together at the state that was looked at last: forces and accelerations are complementary on the friction cones,
    /// and contacts that slide already have their friction against the motion.
    pub(super) fn select(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar) -> Result<(), HybridError> {
        let zero = Y::Scalar::zero();
        self.touching.modes.as_mut().fill(Mode::Open);
        self.touching.slip.as_mut().fill([zero; 2]);
        self.redundant = false;
        if self.touching.count == 0 {
            return Ok(());
        }
        self.set_slips(system);
        self.assemble(system, t);
        self.free_accelerations(system, t);
        let touching = &mut self.touching;
        let rows = touching.rows();
        let problem = super::Problem {
            a: &touching.a.as_ref()[..rows * rows],
            b: &touching.b.as_ref()[..rows],
            touches: &touching.problem.as_ref()[..touching.count],
        };
        let impulses = &mut touching.impulses.as_mut()[..rows];
        impulses.fill(zero);
        solve(&problem, self.rules.effort, impulses, touching.work.as_mut())
            .map_err(|error| HybridError::Contact { time: t.to_f64(), error })?;
        self.read_modes();
        Ok(())
    }

    /// Inverse inertia of the contacts in the problem.
    pub(super) fn assemble(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar) {
        let rows = self.touching.rows();
        let touching = &mut self.touching;
        let order = &touching.order.as_ref()[..touching.count];
        let a = &mut touching.a.as_mut()[..rows * rows];
        system.inverse_inertia(t, &self.q, order, touching.open.as_ref(), a);
    }

    /// Directions of contacts that slide.
    fn set_slips(&mut self, system: &WithContacts<Y>) {
        let least = self.rules.slip;
        for i in 0..self.touching.count {
            let k = self.touching.order()[i];
            let [x, y] = system.tangential(k);
            let speed = (x * x + y * y).sqrt();
            let slides = speed.to_f64() > least;
            let slip = match self.forced {
                // The bodies begin to slide against the force that has reached the cone.
                Some((contact, Cause::Slipped, [_, x, y])) if contact == k => {
                    let size = (x * x + y * y).sqrt();
                    Some([-(x / size), -(y / size)])
                }
                _ => slides.then(|| [x / speed, y / speed]),
            };
            self.touching.problem.as_mut()[i].slip = slip;
        }
    }

    /// Accelerations of the rows if no contact had a force, in `b`. With all rows of sticking contacts and the normal rows
    /// of sliding ones held, the forces `f` keep them from accelerating, `b + A f = 0`.
    fn free_accelerations(&mut self, system: &mut WithContacts<Y>, t: Y::Scalar) {
        let zero = Y::Scalar::zero();
        let touching = &mut self.touching;
        touching.modes.as_mut().fill(Mode::Open);
        for (i, &k) in touching.order.as_ref()[..touching.count].iter().enumerate() {
            let slides = touching.problem.as_ref()[i].slip.is_some();
            touching.modes.as_mut()[k] = if slides { Mode::Slide } else { Mode::Stick };
        }
        system.hold(t, &self.q, touching.modes.as_ref());
        let rows = touching.rows();
        let (a, b) = (touching.a.as_ref(), touching.b.as_mut());
        b.fill(zero);
        let mut column = 0;
        for (i, &k) in touching.order.as_ref()[..touching.count].iter().enumerate() {
            let c = system.contact(k);
            for j in 0..c.rows() {
                let held = j == 0 || touching.problem.as_ref()[i].slip.is_none();
                let lambda = if held { system.at.lambda.as_ref()[c.row + j] } else { zero };
                for (row, b) in b.iter_mut().enumerate().take(rows) {
                    *b = *b + a[row * rows + column] * lambda;
                }
                column += 1;
            }
        }
        touching.modes.as_mut().fill(Mode::Open);
    }

    /// Modes from the forces and accelerations of the problem.
    fn read_modes(&mut self) {
        let zero = Y::Scalar::zero();
        let rows = self.touching.rows();
        let touching = &mut self.touching;
        let (a, b, f) = (touching.a.as_ref(), touching.b.as_ref(), touching.impulses.as_ref());
        let acceleration = |row: usize| (0..rows).fold(b[row], |sum, column| sum + a[row * rows + column] * f[column]);
        let size =
            |list: &[Y::Scalar]| list[..rows].iter().fold(zero, |most, x| if x.abs() > most { x.abs() } else { most });
        let small = Y::Scalar::constant(SMALL);
        let (still, unloaded) = (small * size(b), small * size(f));
        for (i, &k) in touching.order.as_ref()[..touching.count].iter().enumerate() {
            let Touch { contact: c, slip } = touching.problem.as_ref()[i];
            // Where the force has just gone to zero, the acceleration starts from zero too.
            let released = matches!(self.forced, Some((contact, Cause::Unloaded, _)) if contact == k);
            if f[c.row] <= unloaded && (released || acceleration(c.row) > still) {
                continue;
            }
            let mode = &mut touching.modes.as_mut()[k];
            *mode = Mode::Slide;
            if !c.tangents || !(c.friction > zero) {
                continue;
            }
            if let Some(direction) = slip {
                touching.slip.as_mut()[k] = direction;
                continue;
            }
            let [x, y] = [acceleration(c.row + 1), acceleration(c.row + 2)];
            let along = (x * x + y * y).sqrt();
            if along > still {
                touching.slip.as_mut()[k] = [x / along, y / along];
            } else {
                *mode = Mode::Stick;
            }
        }
    }
}

impl<Y: Touching> WithContacts<Y> {
    /// Multipliers of the rows that act by `modes`, in `self.at.lambda`, after [`WithContacts::look`].
    fn hold(&mut self, t: Y::Scalar, q: &Y::Coordinates, modes: &[Mode]) {
        self.borrow_modes(modes);
        self.system.multipliers(t, q, &self.at.v, &mut self.at.lambda);
        self.restore();
    }
}
