//! The code of an output: straight-line code, or rolled code where that is faster.

use std::collections::BTreeSet;

use crate::error::GenerateError;
use crate::options::{Options, Precision};
use crate::output::{Output, OutputProgram};
use crate::plan::Plan;
use crate::rolled::{rolled, RolledProgram};
use crate::symbolic::{Counts, Op, Operand, Program, ProgramResult};
use crate::trace::trace;

/// The code of an output.
#[derive(Clone, Debug)]
pub enum Code {
    /// Straight-line code.
    Straight(Program),
    /// Rolled code: loops over like links.
    Rolled(RolledProgram),
}

impl Code {
    /// Counts of the operations that are executed.
    pub fn counts(&self) -> Counts {
        match self {
            Code::Straight(program) => program.counts(),
            Code::Rolled(program) => program.counts(),
        }
    }

    /// Bits of the constants that operations have.
    pub fn constants(&self) -> BTreeSet<u64> {
        let of = |program: &Program| -> Vec<u64> {
            let operands = program.steps.iter().flat_map(|(_, op, _)| op.operands());
            operands.filter_map(|o| if let Operand::Const(bits) = o { Some(bits) } else { None }).collect()
        };
        match self {
            Code::Straight(program) => of(program).into_iter().collect(),
            Code::Rolled(program) => program.blocks.iter().flat_map(|block| of(&block.program)).collect(),
        }
    }

    /// Indices of the inputs that are read.
    pub fn used_inputs(&self) -> BTreeSet<usize> {
        match self {
            Code::Straight(program) => {
                let input = |op: &Op| if let Op::Input(k) = op { Some(*k as usize) } else { None };
                program.steps.iter().filter_map(|(_, op, _)| input(op)).collect()
            }
            Code::Rolled(program) => program.used_inputs(),
        }
    }
}

/// The program of an output.
///
/// # Errors
/// See [`GenerateError`].
pub fn compile(plan: &Plan, output: Output, options: &Options) -> Result<OutputProgram<Code>, GenerateError> {
    let program = match rolled(plan, output, options) {
        Some(program) => program.map(Code::Rolled),
        None => trace(plan, output, options)?.map(Code::Straight),
    };
    finite(plan, output, &program.program, options.precision)?;
    Ok(program)
}

/// Rejects infinite numbers, which literals cannot express, and thus models that divide by zero in every state.
fn finite(plan: &Plan, output: Output, code: &Code, precision: Precision) -> Result<(), GenerateError> {
    let fits = |x: f64| match precision {
        Precision::F64 => x.is_finite(),
        Precision::F32 => (x as f32).is_finite(),
    };
    let program = match code {
        Code::Rolled(program) if program.all_constants(fits) => return Ok(()),
        Code::Rolled(_) => return Err(GenerateError::InfiniteNumber { output, body: None }),
        Code::Straight(program) => program,
    };
    for (_, op, (node, _)) in &program.steps {
        if op.operands().any(|o| matches!(o, Operand::Const(bits) if !fits(f64::from_bits(bits)))) {
            let body = node.map_or("ground", |i| plan.nodes[i].name.as_str());
            return Err(GenerateError::InfiniteNumber { output, body: Some(body.to_string()) });
        }
    }
    match program.outputs.iter().any(|r| matches!(r, ProgramResult::Const(x) if !fits(*x))) {
        true => Err(GenerateError::InfiniteResult { output }),
        false => Ok(()),
    }
}
