//! The code of an output: straight-line code, or rolled code where that is faster.

use std::collections::BTreeSet;

use mbd_runtime::contact::{rows_that_act, Mode};

use crate::error::GenerateError;
#[cfg(feature = "factored")]
use crate::factored::factored;
use crate::factored::FactoredProgram;
use crate::modes::{ModeChoice, OF_EACH_SET};
use crate::options::{Arithmetic, Options, Precision};
use crate::output::{Output, OutputProgram, Sizes};
use crate::plan::Plan;
use crate::rolled::{rolled, together, RolledProgram, Vectors};
use crate::symbolic::{Counts, Op, Operand, Program, ProgramResult};
use crate::trace::{chosen_frames, coordinate_rates, sizes, trace};

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

    /// The straight-line programs that it consists of: itself, or the blocks of rolled code.
    pub fn blocks(&self) -> Vec<&Program> {
        match self {
            Code::Straight(program) => vec![program],
            Code::Rolled(program) => program.blocks.iter().map(|block| &block.program).collect(),
        }
    }

    /// The operations of all blocks, those of a loop's body once.
    pub fn operations(&self) -> impl Iterator<Item = &Op> {
        self.blocks().into_iter().flat_map(|program| program.steps.iter().map(|(_, op, _)| op))
    }

    /// Whether an operation reads a table.
    pub fn looks_up(&self) -> bool {
        self.operations().any(Op::looks_up)
    }

    /// Bits of the constants that operations have.
    pub fn constants(&self) -> BTreeSet<u64> {
        let bits = |o| if let Operand::Const(bits) = o { Some(bits) } else { None };
        self.operations().flat_map(|op| op.operands()).filter_map(bits).collect()
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

/// The programs of all outputs of some options, for one file of generated code.
#[derive(Clone, Debug)]
pub struct Programs {
    /// Those of the outputs, in the order of the options.
    pub outputs: Vec<OutputProgram<Code>>,
    /// Coordinate rates of given velocities, which integrators need with the rates.
    pub coordinate_rates: Option<OutputProgram<Code>>,
    /// Chosen frames, as indices into the plan's.
    pub frames: Vec<usize>,
    /// Lengths of all arrays.
    pub sizes: Sizes,
    /// Programs that compute like branches together for one state, by the names of their outputs.
    pub together: Vec<(&'static str, RolledProgram, Vectors)>,
    /// Programs of the outputs in [`OF_EACH_SET`] for sets of modes of contacts.
    pub sets: Vec<SetPrograms>,
    /// Programs of these outputs put together from pieces for the modes of contacts.
    pub factored: Vec<OutputProgram<FactoredProgram>>,
}

/// The programs for one set of modes of the contacts.
#[derive(Clone, Debug)]
pub struct SetPrograms {
    /// The mode of each contact.
    pub modes: Vec<Mode>,
    /// The plan in which the rows act that act in these modes.
    pub plan: Plan,
    /// Programs of outputs.
    pub outputs: Vec<OutputProgram<Code>>,
    /// Those that compute like branches together, by the names of their outputs.
    pub together: Vec<(&'static str, RolledProgram, Vectors)>,
}

impl Programs {
    /// Traces all of them.
    ///
    /// # Errors
    /// See [`GenerateError`].
    pub fn new(plan: &Plan, options: &Options) -> Result<Programs, GenerateError> {
        let outputs =
            options.outputs.iter().map(|&output| compile(plan, output, options)).collect::<Result<Vec<_>, _>>()?;
        let frames = chosen_frames(plan, options)?;
        let rates = options.outputs.contains(&Output::Rates);
        Ok(Programs {
            outputs,
            coordinate_rates: rates.then(|| coordinate_rates(plan, options).map(Code::Straight)),
            sizes: sizes(plan, options, frames.len()),
            frames,
            together: Vec::new(),
            sets: Vec::new(),
            factored: Vec::new(),
        })
    }

    /// Traces all of them for a mechanism with contacts: those of the outputs for all modes, where numbers say which rows
    /// act, and those for sets of modes. `full` is the plan with the rows of the contacts, all of which act.
    ///
    /// # Errors
    /// See [`GenerateError`].
    pub fn of_modes(full: &Plan, choice: &ModeChoice, options: &Options) -> Result<Programs, GenerateError> {
        let sets = choice.sets(&full.model)?;
        let gaps = |output: &Output| *output == Output::Gaps;
        #[cfg(feature = "factored")]
        let in_pieces = |output: &Output| *choice == ModeChoice::Factored && OF_EACH_SET.contains(output);
        #[cfg(not(feature = "factored"))]
        let in_pieces = |_: &Output| false;
        let others = options.outputs.iter().copied().filter(|o| !gaps(o) && !in_pieces(o)).collect();
        let others = Options { outputs: others, ..options.clone() };
        let mut programs = Programs::new(&full.masked(), &others)?;
        for output in options.outputs.iter().filter(|o| gaps(o)) {
            programs.outputs.push(compile(full, *output, options)?);
        }
        // Early rows can cost less where another elimination of the freedoms costs less than without contacts.
        let early = options.arithmetic == Arithmetic::Fast && full.model.constraints.is_empty();
        let plain = early.then(|| Plan::new(&full.model, full.snap).with_contacts());
        #[cfg(feature = "factored")]
        for output in options.outputs.iter().filter(|o| in_pieces(o)) {
            let programs_of = [Some(full), plain.as_ref()].into_iter().flatten();
            let candidates = programs_of.filter_map(|full| factored(full, *output, options));
            let program = candidates.min_by_key(|of| of.program.in_flight() + of.program.sticking());
            let program = program.ok_or_else(|| GenerateError::ModesNotFactored { model: full.model.name.clone() })?;
            for piece in program.program.pieces() {
                finite(full, *output, &Code::Straight(piece.program.clone()), options.precision)?;
            }
            programs.factored.push(program);
        }
        let (contacts, rows) = (full.contacts::<f64>(), full.dims.rows);
        let with_early = |full: &Plan, acts: &[bool]| {
            let plan = full.acting(acts);
            plan.with_early_contacts(&plan.early_contacts(options.arithmetic))
        };
        for modes in sets {
            let acts = rows_that_act(rows, &contacts, &modes);
            let plan = with_early(full, &acts);
            let other = plain.as_ref().filter(|_| plan.early_tolerance.is_some()).map(|plain| with_early(plain, &acts));
            let other = other.filter(|other| other.early_tolerance.is_some());
            let wanted = OF_EACH_SET.into_iter().filter(|output| options.outputs.contains(output));
            let cheaper = |output| {
                let first = compile(&plan, output, options)?;
                let second = other.as_ref().map(|other| Ok((other, compile(other, output, options)?))).transpose()?;
                let total = |of: &OutputProgram<Code>| of.program.counts().total();
                Ok(match second {
                    Some((other, second)) if total(&second) < total(&first) => (other, second),
                    _ => (&plan, first),
                })
            };
            let (mut outputs, mut together) = (Vec::new(), Vec::new());
            for output in wanted {
                let (plan, mut program): (&Plan, _) = cheaper(output)?;
                together.extend(like_branches(plan, output, &mut program, options));
                outputs.push(program);
            }
            programs.sets.push(SetPrograms { modes, plan, outputs, together });
        }
        Ok(programs)
    }

    /// Computes like branches together for one state where that is faster. Straight-line code gets the same statements,
    /// so that a lane has the bits of a single state.
    #[must_use]
    pub fn with_like_branches(mut self, plan: &Plan, options: &Options) -> Programs {
        for (output, program) in options.outputs.iter().zip(&mut self.outputs) {
            self.together.extend(like_branches(plan, *output, program, options));
        }
        self
    }

    /// The programs of all functions.
    pub fn functions(&self) -> Vec<&OutputProgram<Code>> {
        self.outputs.iter().chain(&self.coordinate_rates).collect()
    }

    /// Rejects programs that read tables, as those of contacts with height fields do: Rust and machine code alone have them.
    pub(crate) fn without_tables(self) -> Result<Programs, GenerateError> {
        match self.functions().iter().any(|function| function.program.looks_up()) {
            true => Err(GenerateError::TablesNeedRust),
            false => Ok(self),
        }
    }

    /// Operations of each output.
    pub fn counts(&self, options: &Options) -> Vec<(Output, Counts)> {
        let of = |output: &Output| self.outputs.iter().find(|p| p.spec.name == output.name());
        options.outputs.iter().filter_map(|output| Some((*output, of(output)?.program.counts()))).collect()
    }
}

/// The program that computes like branches together for one state, with the name of its output, where that is faster than the
/// straight-line one, which then gets the same statements.
fn like_branches(
    plan: &Plan,
    output: Output,
    program: &mut OutputProgram<Code>,
    options: &Options,
) -> Option<(&'static str, RolledProgram, Vectors)> {
    let Code::Straight(straight) = &mut program.program else { return None };
    let both = together(plan, output, options)?;
    let vectors = both.program.pays(straight, options)?;
    if options.arithmetic == Arithmetic::Fast {
        *straight = both.program.apart;
    }
    Some((output.name(), both.program.program, vectors))
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
