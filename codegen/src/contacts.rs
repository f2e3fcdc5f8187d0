//! Mechanisms with contacts at run time.

use mbd_runtime::contact::{Contact, ContactInterpreter};
use mbd_runtime::Real;

use crate::model::ConstraintKind;
use crate::plan::Plan;

impl Plan {
    /// The interpreter of a mechanism with contacts, with given parameters and the model's gravity.
    pub fn contact_interpreter<S: Real>(&self, params: &[S]) -> ContactInterpreter<S> {
        let full = self.with_contacts();
        let first = full.constraints.len() - self.model.contacts.len();
        let contacts = self.model.contacts.iter().zip(&full.constraints[first..]);
        let contacts = contacts.map(|(contact, constraint)| Contact {
            row: constraint.first,
            tangents: matches!(contact.kind, ConstraintKind::Loop { .. }),
            friction: S::constant(contact.friction),
            restitution: S::constant(contact.restitution),
            law: contact.law,
        });
        ContactInterpreter::new(full.interpreter(params), contacts.collect())
    }

    /// The same with the parameters at their defaults.
    pub fn default_contact_interpreter<S: Real>(&self) -> ContactInterpreter<S> {
        self.contact_interpreter(&self.default_params().into_iter().map(S::constant).collect::<Vec<S>>())
    }
}
