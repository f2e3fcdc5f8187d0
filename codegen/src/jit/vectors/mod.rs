//! Machine code for four or eight states at once, in vectors of 32 or 64 bytes, and for one state in single numbers and
//! in vectors of what can be computed together.
//!
//! Cranelift has vectors of 16 bytes only, and two of the three forms of a fused product. The bodies of the generator's
//! programs need some twenty instructions and have no branches but those of counted loops, so that they are written here
//! directly: [`body`] records what [`lower`](crate::lower) tells, [`registers`] gives its values registers, [`encode`]
//! writes the bytes.
//!
//! Where an angle is beyond the range of the main path of sine and cosine, a function of one state calls the runtime's
//! sines. A function of several states gives up (it returns 1); its caller then computes the states one by one.

mod body;
mod encode;
mod registers;

use body::Body;
use mbd_runtime::kernel::{level, Level};

use super::instructions::{input_places, BLOCK, INPUTS};
use crate::code::Code;
use crate::lower::{is_together, lower, table, Memory};
use crate::options::Precision;
use crate::output::OutputProgram;
use crate::rolled::RolledProgram;
pub use registers::Written;
use registers::{write, Arrays};

/// How many numbers an instruction computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Lanes {
    One = 1,
    Two = 2,
    Four = 4,
    Eight = 8,
}

impl Lanes {
    pub fn count(self) -> usize {
        self as usize
    }

    fn bytes(self) -> i32 {
        8 * self as i32
    }

    /// The fewest that have room for so many numbers, at most `most`.
    fn for_numbers(n: usize, most: Lanes) -> Lanes {
        let all = [Lanes::One, Lanes::Two, Lanes::Four, Lanes::Eight];
        all.into_iter().find(|lanes| lanes.count() >= n || *lanes == most).unwrap_or(most)
    }
}

/// Machine code that this module writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Width {
    /// States that are computed at once, each in a lane.
    states: Lanes,
    /// Whether it has the instructions and the registers of AVX-512 F, DQ and VL, otherwise those of AVX2 and FMA.
    wide: bool,
}

impl Width {
    /// Code for so many states of double precision, if the processor has the vectors.
    pub fn of_lanes(lanes: usize) -> Option<Width> {
        if !cfg!(all(target_arch = "x86_64", unix)) || level() < Level::Fused {
            return None;
        }
        let wide = level() >= Level::Wide;
        match lanes {
            1 => Some(Width { states: Lanes::One, wide }),
            4 => Some(Width { states: Lanes::Four, wide: false }),
            8 if wide => Some(Width { states: Lanes::Eight, wide }),
            _ => None,
        }
    }

    /// Copies of a constant in memory, where so many numbers are read: AVX-512 reads one number for all lanes.
    fn copies(self, lanes: Lanes) -> usize {
        if self.wide {
            1
        } else {
            lanes.count()
        }
    }

    fn registers(self) -> usize {
        if self.wide {
            32
        } else {
            16
        }
    }

    /// Numbers in a vector of one state, in which like branches are computed together.
    pub fn branches(self, program: &RolledProgram) -> usize {
        let turns = program.loops.iter().filter(|run| !run.branches.is_empty()).map(|run| run.table.len());
        match turns.max() {
            Some(turns) if self.states == Lanes::One && turns > 2 => 4,
            Some(_) if self.states == Lanes::One => 2,
            _ => 1,
        }
    }
}

/// Code for one state of a precision, if this module writes it on this processor.
pub fn one_state(precision: Precision) -> Option<Width> {
    Width::of_lanes(1).filter(|_| precision == Precision::F64)
}

/// Machine code of a program whose results fill arrays of the lengths `results`. `sines` is the address of the runtime's
/// function for sines and cosines. `None` if it is too long, or looks numbers up in tables, which Cranelift does.
pub fn compile(
    program: &OutputProgram<Code>,
    results: &[usize],
    fused: bool,
    width: Width,
    sines: u64,
) -> Option<Written> {
    #[cfg(feature = "height_fields")]
    if program.program.looks_up() {
        return None;
    }
    let branches = match &program.program {
        Code::Straight(_) => 1,
        Code::Rolled(rolled) => width.branches(rolled),
    };
    let mut body = Body::new(fused, width, branches);
    lower(&mut body, program, results, &[]);
    body.read_in_place();
    let inputs = input_places(&program.inputs);
    let block = if width.states == Lanes::One { BLOCK } else { 1 };
    let memory = Memory::new(&program.program, &[], block, branches);
    let mut numbers = Vec::new();
    let mut tables = Vec::new();
    if let Code::Rolled(rolled) = &program.program {
        for run in &rolled.loops {
            tables.push(numbers.len());
            numbers.extend(table(run, is_together(rolled, branches).then_some(branches)));
        }
    }
    numbers.resize(numbers.len().next_multiple_of(Lanes::Eight.count()), 0.0);
    let arrays =
        Arrays { inputs: &inputs, numbers: INPUTS, tables: &tables, constants: numbers.len(), memory: &memory, sines };
    let mut written = write(&body, width, &arrays)?;
    numbers.append(&mut written.numbers);
    Some(Written { numbers, ..written })
}

#[cfg(test)]
mod tests;
