//! Outputs whose programs are too large to compile, by the interpreter.

use mbd_runtime::sweep::{Derivatives, FrameState};
use mbd_runtime::system::{Constrained, Differentiable};
use mbd_runtime::MomentumDerivatives;

use super::memory::Number;
use super::{CompileError, Compiled};
use crate::output::{Array, Output, Sizes, Spec};

impl<S: Number> Compiled<S> {
    /// As [`Compiled::evaluate`], but what is too large to compile is computed by the interpreter, which allocates; after
    /// [`Compiled::interpreted`] everything that it has.
    ///
    /// # Errors
    /// Those of [`Compiled::evaluate`]; [`CompileError::TooLarge`] only for `parameter_derivatives`, and where the options
    /// choose frames.
    pub fn evaluate_or_interpret(
        &mut self,
        output: Output,
        arguments: &[&[S]],
        results: &mut [&mut [S]],
    ) -> Result<(), CompileError> {
        let available = Output::available(!self.plan().constraints.is_empty()).any(|other| other == output);
        let chosen = self.interpreted && available;
        if !chosen {
            match self.evaluate(output, arguments, results) {
                Err(CompileError::TooLarge { .. }) => {}
                done => return done,
            }
        }
        // Not seen by `evaluate`, which did not get that far.
        self.check_arrays(output, arguments, results)?;
        let all_frames = self.sizes().frames == self.plan().frames.len();
        let possible = all_frames || !output.spec().of_frames();
        match possible && interpret(self, output, arguments, results).is_some() {
            true => Ok(()),
            false => self.evaluate(output, arguments, results),
        }
    }

    /// Whether the arrays are those of an output.
    pub(super) fn check_arrays(
        &self,
        output: Output,
        arguments: &[&[S]],
        results: &[&mut [S]],
    ) -> Result<(), CompileError> {
        check(output.spec(), self.sizes(), arguments, results).map_err(|words| CompileError::Arrays { output, words })
    }
}

/// Compares the lengths of arguments and results with those of an output.
fn check<S>(spec: &Spec, sizes: &Sizes, arguments: &[&[S]], results: &[&mut [S]]) -> Result<(), String> {
    let lengths = |arrays: &[Array]| arrays.iter().map(|a| a.len(sizes)).collect::<Vec<_>>();
    let given = [arguments.iter().map(|a| a.len()).collect(), results.iter().map(|r| r.len()).collect::<Vec<_>>()];
    for (name, given, expected) in
        [("arguments", &given[0], lengths(spec.inputs)), ("results", &given[1], lengths(spec.results))]
    {
        if *given != expected {
            return Err(format!("its {name} have the lengths {expected:?}, and {given:?} were given"));
        }
    }
    Ok(())
}

/// Computes an output whose arrays are right; `None` where the interpreter does not have it.
pub(super) fn interpret<S: Number>(
    of: &mut Compiled<S>,
    output: Output,
    given: &[&[S]],
    to: &mut [&mut [S]],
) -> Option<()> {
    let interpreter = of.inputs();
    match (output, given, to) {
        (Output::Rates, [q, p], [qd, pd]) => interpreter.rates(q, p, &mut vec![S::zero(); p.len()], qd, pd),
        (Output::Velocities, [q, p], [v]) => interpreter.velocities(q, p, v),
        (Output::Momenta, [q, v], [p]) => interpreter.momenta(q, v, p),
        (Output::Energy, [q, p], [energy]) => energy.copy_from_slice(&<[S; 2]>::from(interpreter.energy(q, p))),
        (Output::Accelerations, [q, v], [a]) => interpreter.accelerations(q, v, a),
        (Output::Reactions, [q, v], [wrenches]) => {
            let mut out = vec![[S::zero(); 6]; wrenches.len() / 6];
            interpreter.reactions(q, v, &mut vec![S::zero(); v.len()], &mut out);
            wrenches.copy_from_slice(out.as_flattened());
        }
        (Output::MassMatrix, [q], [m]) => interpreter.mass_matrix(q, m),
        (Output::Frames, [q, v], [rotation, position, velocity]) => {
            let mut states = vec![FrameState::ground(); position.len() / 3];
            interpreter.frames(q, v, &mut states);
            for (k, state) in states.iter().enumerate() {
                rotation[9 * k..9 * k + 9].copy_from_slice(state.rotation.as_flattened());
                position[3 * k..3 * k + 3].copy_from_slice(&state.position);
                velocity[6 * k..6 * k + 3].copy_from_slice(&state.velocity.lin);
                velocity[6 * k + 3..6 * k + 6].copy_from_slice(&state.velocity.ang);
            }
        }
        (Output::InverseDynamics, [q, v, a], [tau]) => interpreter.inverse_dynamics(q, v, a, tau),
        (Output::Bias, [q, v], [h]) => interpreter.bias(q, v, h),
        (Output::Regressor, [q, v, a], [y]) => interpreter.regressor(q, v, a, y),
        (Output::Jacobians, [q], [jacobian]) => interpreter.jacobians(q, jacobian),
        (Output::BiasAccelerations, [q, v], [bias]) => {
            let mut out = vec![[S::zero(); 6]; bias.len() / 6];
            interpreter.bias_accelerations(q, v, &mut out);
            bias.copy_from_slice(out.as_flattened());
        }
        (Output::Centroidal, [q, v], [center, matrix, bias]) => interpreter.centroidal(q, v, center, matrix, bias),
        (output, given, to) => return differentiate(of, output, given, to),
    }
    Some(())
}

/// Derivatives, and what models with constraints have.
fn differentiate<S: Number>(of: &mut Compiled<S>, output: Output, given: &[&[S]], to: &mut [&mut [S]]) -> Option<()> {
    let interpreter = of.inputs();
    let (mut rows, mut entries) = (interpreter.zero_rows(), interpreter.zero_entries());
    match (output, given, to) {
        (Output::Derivatives, [q, p], results) => {
            let mut d = interpreter.zero_derivatives();
            interpreter.rate_derivatives(S::zero(), &q.to_vec(), &p.to_vec(), &mut d);
            let [[a, b], [c, e]] = d.blocks().map(|blocks| blocks.map(|rows| rows.concat()));
            copy(&[&d.v, &d.pd, &a, &b, &c, &e], results);
        }
        (Output::MomentumDerivatives, [q, v], results) => {
            let mut d = Derivatives::new(interpreter.tree());
            let mut out = MomentumDerivatives::new(interpreter.tree());
            interpreter.momentum_derivatives(q, v, &mut d, &mut out);
            copy(&[&out.p, &out.pd, &out.dp_dq, &out.dp_dv, &out.dpd_dq, &out.dpd_dv], results);
        }
        (Output::ConstraintResiduals, [q], results) => {
            interpreter.constraint_residuals(&q.to_vec(), &mut rows, &mut entries);
            copy(&[&rows, &entries], results);
        }
        (Output::ProjectMomenta, [q, p], results) => {
            let (mut v, mut freed) = (p.to_vec(), p.to_vec());
            interpreter.project_momenta(S::zero(), &q.to_vec(), &mut freed, &mut v, &mut rows);
            copy(&[&v, &freed, &rows], results);
        }
        (Output::PositionCorrection, [q], results) => {
            let (mut dq, mut pivots) = (vec![S::zero(); interpreter.tau.len()], rows.clone());
            interpreter.position_correction(&q.to_vec(), &mut rows, &mut dq, &mut pivots);
            copy(&[&rows, &dq, &pivots], results);
        }
        (Output::Multipliers, [q, v], results) => {
            interpreter.multipliers(S::zero(), &q.to_vec(), &v.to_vec(), &mut rows);
            copy(&[&rows], results);
        }
        _ => return None,
    }
    Some(())
}

fn copy<S: Copy>(from: &[&Vec<S>], to: &mut [&mut [S]]) {
    to.iter_mut().zip(from).for_each(|(to, from)| to.copy_from_slice(from));
}
