//! Machine code for four or eight states at once, in vectors of 32 or 64 bytes.
//!
//! Cranelift has vectors of 16 bytes only. The bodies of the generator's programs need some twenty instructions and have
//! no branches but those of counted loops, so that they are written here directly: [`body`] records what
//! [`lower`](crate::lower) tells, [`registers`] gives its values registers, [`encode`] writes the bytes.
//!
//! A function gives up (it returns 1) where an angle is beyond the range of the main path of sine and cosine; its caller
//! then computes the states one by one.

mod body;
mod encode;
mod registers;

use body::Body;
use mbd_runtime::kernel::{level, Level};

use super::instructions::{input_places, INPUTS};
use crate::code::Code;
use crate::lower::{lower, table, Memory};
use crate::output::OutputProgram;
pub use registers::Written;
use registers::{write, Arrays};

/// Vectors that this module writes code for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// Four doubles, AVX2 and FMA.
    Four,
    /// Eight doubles, AVX-512 F, DQ and VL.
    Eight,
}

impl Width {
    /// The vectors of so many doubles, if the processor has them.
    pub fn of_lanes(lanes: usize) -> Option<Width> {
        let known = cfg!(all(target_arch = "x86_64", unix));
        match lanes {
            4 if known && level() >= Level::Fused => Some(Width::Four),
            8 if known && level() >= Level::Wide => Some(Width::Eight),
            _ => None,
        }
    }

    /// Number of doubles.
    pub fn lanes(self) -> usize {
        match self {
            Width::Four => 4,
            Width::Eight => 8,
        }
    }

    fn bytes(self) -> i32 {
        8 * self.lanes() as i32
    }

    /// Copies of a constant in memory: vectors of 64 bytes read one number for all lanes.
    fn copies(self) -> usize {
        match self {
            Width::Four => 4,
            Width::Eight => 1,
        }
    }

    fn registers(self) -> usize {
        match self {
            Width::Four => 16,
            Width::Eight => 32,
        }
    }
}

/// Machine code of a program whose results fill arrays of the lengths `results`. `None` if it is too long.
pub fn compile(program: &OutputProgram<Code>, results: &[usize], fused: bool, width: Width) -> Option<Written> {
    let mut body = Body::new(fused);
    lower(&mut body, program, results, &[]);
    let inputs = input_places(&program.inputs);
    let memory = Memory::new(&program.program, &[], 1, 1);
    let mut numbers = Vec::new();
    let mut tables = Vec::new();
    if let Code::Rolled(rolled) = &program.program {
        for run in &rolled.loops {
            tables.push(numbers.len());
            numbers.extend(table(run, None));
        }
    }
    numbers.resize(numbers.len().next_multiple_of(width.lanes()), 0.0);
    let arrays =
        Arrays { inputs: &inputs, numbers: INPUTS, tables: &tables, constants: numbers.len(), memory: &memory };
    let mut written = write(&body, width, &arrays)?;
    numbers.append(&mut written.numbers);
    Some(Written { numbers, ..written })
}
