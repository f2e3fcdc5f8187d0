//! Mechanisms with contacts in the interpreter: one interpreter for each set of modes that a motion visits.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::{Deref, DerefMut};

use super::{Contact, Mode, Touching};
use crate::interp::Interpreter;
use crate::system::{system_within, Conjugate, Constrained, Energetic, LieJoint, Real, Row, System};

/// An interpreter of a mechanism with contacts. An interpreter of the rows that act is made when a set of modes is first
/// met, and kept.
///
/// It dereferences to the interpreter that is in use, whose inputs are handed over when modes change.
#[derive(Clone, Debug)]
pub struct ContactInterpreter<S> {
    /// All rows act: for gaps.
    full: Interpreter<S>,
    modes: Vec<(Vec<Mode>, Interpreter<S>)>,
    current: usize,
    contacts: Vec<Contact<S>>,
}

impl<S: Real> ContactInterpreter<S> {
    /// From an interpreter whose constraints include the contacts' rows. All contacts are open at first.
    pub fn new(full: Interpreter<S>, contacts: Vec<Contact<S>>) -> Self {
        let open = vec![Mode::Open; contacts.len()];
        let first = full.acting(&acting(&full, &contacts, &open));
        ContactInterpreter { full, modes: vec![(open, first)], current: 0, contacts }
    }

    /// Number of sets of modes that were met.
    pub fn sets_of_modes(&self) -> usize {
        self.modes.len()
    }

    /// Sets the contacts' coefficient of friction, where they have tangential rows.
    pub fn set_friction(&mut self, friction: S) {
        self.contacts.iter_mut().filter(|c| c.tangents).for_each(|c| c.friction = friction);
    }

    /// Sets the contacts' coefficient of restitution.
    pub fn set_restitution(&mut self, restitution: S) {
        self.contacts.iter_mut().for_each(|c| c.restitution = restitution);
    }
}

/// Which rows act.
fn acting<S: Real>(full: &Interpreter<S>, contacts: &[Contact<S>], modes: &[Mode]) -> Vec<bool> {
    let mut acts = vec![true; full.rows().len()];
    for (contact, mode) in contacts.iter().zip(modes) {
        for k in 0..contact.rows() {
            acts[contact.row + k] = mode.acts(k);
        }
    }
    acts
}

impl<S> Deref for ContactInterpreter<S> {
    type Target = Interpreter<S>;
    fn deref(&self) -> &Interpreter<S> {
        &self.modes[self.current].1
    }
}

impl<S> DerefMut for ContactInterpreter<S> {
    fn deref_mut(&mut self) -> &mut Interpreter<S> {
        &mut self.modes[self.current].1
    }
}

impl<S: Real> System for ContactInterpreter<S> {
    system_within!(full: Interpreter<S>);

    fn lie_joints(&self) -> &[LieJoint] {
        self.full.lie_joints()
    }

    fn rates_at(&mut self, t: S, q: &Vec<S>, p: &Vec<S>, qd: &mut Vec<S>, pd: &mut Vec<S>) {
        (**self).rates_at(t, q, p, qd, pd);
    }
}

impl<S: Real> Energetic for ContactInterpreter<S> {
    fn energies(&mut self, q: &Vec<S>, p: &Vec<S>) -> (S, S) {
        (**self).energies(q, p)
    }
}

impl<S: Real> Conjugate for ContactInterpreter<S> {
    fn conjugate_momenta(&mut self, q: &Vec<S>, v: &Vec<S>, p: &mut Vec<S>) {
        (**self).conjugate_momenta(q, v, p);
    }
}

impl<S: Real> Constrained for ContactInterpreter<S> {
    type Rows = Vec<S>;
    type Entries = Vec<S>;

    fn zero_rows(&self) -> Vec<S> {
        self.full.zero_rows()
    }

    fn zero_entries(&self) -> Vec<S> {
        self.full.zero_entries()
    }

    fn rows(&self) -> &[Row] {
        self.full.rows()
    }

    fn entry_columns(&self) -> &[usize] {
        self.full.entry_columns()
    }

    fn constraint_residuals(&mut self, q: &Vec<S>, residual: &mut Vec<S>, jacobian: &mut Vec<S>) {
        (**self).constraint_residuals(q, residual, jacobian);
    }

    fn project_momenta(&mut self, t: S, q: &Vec<S>, p: &mut Vec<S>, v: &mut Vec<S>, sigma: &mut Vec<S>) {
        (**self).project_momenta(t, q, p, v, sigma);
    }

    fn position_correction(&mut self, q: &Vec<S>, residual: &mut Vec<S>, dq: &mut Vec<S>, pivots: &mut Vec<S>) {
        (**self).position_correction(q, residual, dq, pivots);
    }

    fn multipliers(&mut self, t: S, q: &Vec<S>, v: &Vec<S>, lambda: &mut Vec<S>) {
        (**self).multipliers(t, q, v, lambda);
    }
}

impl<S: Real> Touching for ContactInterpreter<S> {
    type PerContact<T: Copy + core::fmt::Debug> = Vec<T>;
    type Delassus = Vec<S>;

    fn contacts(&self) -> &[Contact<S>] {
        &self.contacts
    }

    fn per_contact<T: Copy + core::fmt::Debug>(&self, value: T) -> Vec<T> {
        vec![value; self.contacts.len()]
    }

    fn zero_delassus(&self, len: usize) -> Vec<S> {
        vec![S::zero(); len]
    }

    fn act(&mut self, modes: &[Mode]) {
        let before = self.current;
        self.current = match self.modes.iter().position(|(known, _)| known == modes) {
            Some(k) => k,
            None => {
                let made = self.full.acting(&acting(&self.full, &self.contacts, modes));
                self.modes.push((modes.to_vec(), made));
                self.modes.len() - 1
            }
        };
        if self.current != before {
            let (low, high) = (before.min(self.current), before.max(self.current));
            let (first, rest) = self.modes.split_at_mut(high);
            let [a, b] = [&mut first[low].1, &mut rest[0].1];
            a.swap_inputs(b);
        }
    }

    fn gaps(
        &mut self,
        _t: S,
        q: &Vec<S>,
        v: &Vec<S>,
        gaps: &mut Vec<S>,
        velocities: &mut Vec<S>,
        entries: &mut Vec<S>,
    ) {
        let current = &mut self.modes[self.current].1;
        self.full.swap_inputs(current);
        self.full.constraint_residuals(q, gaps, entries);
        self.full.row_velocities(q, v, velocities);
        self.full.swap_inputs(current);
    }
}
