//! The inputs of machine code of one state.

use mbd_runtime::Interpreter;

use super::instructions::{ARGUMENTS, INPUTS};
use super::memory::{Inputs, MachineCode, Number};
use super::Compiled;
use crate::output::FIELDS;

/// What machine code of one state reads: arguments, the inputs of an interpreter, parameters, and the rows that act.
pub(super) struct Given<'a, S: Number> {
    arguments: [&'a [S]; ARGUMENTS],
    inputs: &'a Interpreter<S>,
    params: &'a [S],
    acts: &'a [S],
    /// Whether gravity is an input.
    reads_gravity: bool,
}

impl<'a, S: Number> Given<'a, S> {
    /// For some code: arguments, then inputs, parameters, and the rows that act.
    #[inline]
    pub fn new(
        code: &MachineCode<S>,
        arguments: [&'a [S]; ARGUMENTS],
        (inputs, params, acts): (&'a Interpreter<S>, &'a [S], &'a [S]),
    ) -> Self {
        Given { arguments, inputs, params, acts, reads_gravity: code.reads_gravity() }
    }
}

impl<S: Number> Inputs<S> for Given<'_, S> {
    #[inline]
    fn first(&self) -> [&[S]; ARGUMENTS + 1] {
        let [a, b, c] = self.arguments;
        [a, b, c, &self.inputs.tau]
    }

    #[inline]
    fn more(&self) -> [&[S]; INPUTS - ARGUMENTS - 1] {
        // In the order of the table of fields.
        let Interpreter { drive_q, drive_v, drive_a, wrenches, gravity, .. } = self.inputs;
        let gravity = if self.reads_gravity { &gravity[..] } else { &[] };
        [drive_q, drive_v, drive_a, wrenches.as_flattened(), self.params, self.acts, gravity]
    }
}

impl<S: Number> Compiled<S> {
    /// The joint forces, N m or N. [`Compiled::inputs`] has them, too, but makes the interpreter anew after other parameters.
    pub fn efforts(&mut self) -> &mut [S] {
        &mut self.interpreter.tau
    }

    /// Sets a field of the functions ([`FIELDS`], by its number); which rows act cannot be set, nor gravity that is no input.
    ///
    /// # Panics
    /// If it has another length.
    pub fn set_field(&mut self, field: usize, row: &[S]) {
        let is_input = self.sizes().gravity > 0;
        let inputs = &mut self.interpreter;
        let to = match FIELDS[field].array.name {
            "params" => return self.set_parameters(row),
            "tau" => &mut inputs.tau[..],
            "drive_q" => &mut inputs.drive_q,
            "drive_v" => &mut inputs.drive_v,
            "drive_a" => &mut inputs.drive_a,
            "wrenches" => inputs.wrenches.as_flattened_mut(),
            "gravity" if is_input => &mut inputs.gravity,
            _ => return,
        };
        to.copy_from_slice(row);
    }
}
