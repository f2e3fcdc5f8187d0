//! Mechanisms with contacts at run time.

#[cfg(feature = "jit")]
use mbd_runtime::contact::ModeTable;
use mbd_runtime::contact::{Contact, ContactInterpreter};
use mbd_runtime::Real;

#[cfg(feature = "jit")]
use crate::jit::{CompileError, Compiled, Number};
use crate::model::ConstraintKind;
#[cfg(feature = "jit")]
use crate::options::Options;
use crate::plan::{Plan, PlanConstraint};

impl Plan {
    /// The contacts, by their rows in [`Plan::with_contacts`], of this plan or of the one it was called on.
    pub fn contacts<S: Real>(&self) -> Vec<Contact<S>> {
        let all = self.with_all_rows();
        let full = if all.has_contacts() { all.clone() } else { all.with_contacts() };
        let first = full.constraints.len() - self.model.contacts.len();
        let contact = |(contact, constraint): (&crate::model::Contact, &PlanConstraint)| Contact {
            row: constraint.first,
            tangents: matches!(contact.kind, ConstraintKind::Loop { .. }),
            friction: S::constant(contact.friction),
            restitution: S::constant(contact.restitution),
            law: contact.law,
        };
        self.model.contacts.iter().zip(&full.constraints[first..]).map(contact).collect()
    }

    /// The interpreter of a mechanism with contacts, with given parameters and the model's gravity.
    pub fn contact_interpreter<S: Real>(&self, params: &[S]) -> ContactInterpreter<S> {
        ContactInterpreter::new(self.with_contacts().interpreter(params), self.contacts())
    }

    /// The same with the parameters at their defaults.
    pub fn default_contact_interpreter<S: Real>(&self) -> ContactInterpreter<S> {
        self.contact_interpreter(&self.default_params().into_iter().map(S::constant).collect::<Vec<S>>())
    }

    /// A mechanism with contacts, with machine code for the sets of modes in which an output is asked for more than
    /// `calls` times ([`Compiled::compiled_after`]; [`Compiled::WORTHWHILE`] is a good number), and the interpreter for
    /// the others. Parameters are at their defaults.
    ///
    /// # Errors
    /// As of [`Compiled::from_plan`].
    #[cfg(feature = "jit")]
    pub fn compiled_with_contacts<S: Number>(
        &self,
        options: &Options,
        calls: u32,
    ) -> Result<ModeTable<Compiled<S>>, CompileError> {
        let full = Compiled::from_plan(self.with_contacts(), options.of_model(true))?;
        Ok(ModeTable::new(full.compiled_after(calls), self.contacts()))
    }
}
