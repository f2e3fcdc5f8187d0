//! Working memory of a function, and the values that it holds.

use std::collections::{BTreeMap, BTreeSet};

use super::Array;
use crate::code::Code;
#[cfg(feature = "jit")]
use crate::rolled::Loop;
use crate::rolled::{Block, RolledProgram};
use crate::symbolic::angles::pairs;

/// Where a value is loaded from.
// Only machine code decides about registers.
#[cfg_attr(not(feature = "jit"), expect(dead_code))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Home {
    /// The input of this number.
    Input(usize),
    /// This place in the working memory, where it is stored after it was computed.
    Stored(usize),
}

/// Which values of a straight-line body leave the registers. Where the target's compiler decides that, there are none.
#[derive(Debug, PartialEq, Eq)]
pub struct Spills {
    /// Whether it was decided here, for a processor that reads the last operand of an instruction from memory.
    pub decided: bool,
    /// Where the values are that leave the registers.
    pub homes: BTreeMap<u32, Home>,
    /// Values that are loaded before an operation, by the number of its node.
    pub loaded: BTreeMap<u32, Vec<u32>>,
    /// Number of places.
    pub places: usize,
    /// Entry of the working memory at which the first place is.
    pub first: usize,
    /// Entries of a place: the numbers of a value.
    pub width: usize,
    /// Operands that an operation is the last to use before they are loaded again, by the number of its node.
    pub last: BTreeSet<(u32, u32)>,
}

impl Spills {
    /// Those of a target whose compiler decides.
    pub const NONE: Spills = Spills {
        decided: false,
        homes: BTreeMap::new(),
        loaded: BTreeMap::new(),
        places: 0,
        first: 0,
        width: 1,
        last: BTreeSet::new(),
    };

    /// The entry of a place.
    pub fn entry(&self, place: usize) -> usize {
        self.first + place * self.width
    }
}

/// Whether code with loops computes like branches together, on a target that has vectors of `width` numbers.
pub fn is_together(program: &RolledProgram, width: usize) -> bool {
    width > 1 && program.loops.iter().any(|run| !run.branches.is_empty())
}

/// The constants of a run, one row for each turn; where like branches are computed `together`, one column after the
/// other, in which vectors are filled up with the last branch.
#[cfg(feature = "jit")]
pub fn table(run: &Loop, together: Option<usize>) -> Vec<f64> {
    let Some(width) = together else { return run.table.concat() };
    let columns = run.table.first().map_or(0, Vec::len);
    let padded = run.table.len().next_multiple_of(width);
    let last = run.table.len() - 1;
    (0..columns).flat_map(|column| (0..padded).map(move |turn| run.table[turn.min(last)][column])).collect()
}

/// Working memory of a function: lengths of its arrays, which follow one another.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Number of angles whose sines and cosines are computed together in a loop's turns.
    pub angles: usize,
    /// Values of straight-line code that leave the registers.
    pub spilled: usize,
    /// Numbers kept between the blocks of rolled code.
    pub kept: usize,
    /// Numbers in all rows of each run.
    pub rows: Vec<usize>,
}

impl Memory {
    /// The memory that some code needs; `angles` come in blocks of a length, vectors have `width` numbers.
    pub fn new(code: &Code, spills: &[Spills], block: usize, width: usize) -> Memory {
        let spilled = spills.iter().map(|of| of.entry(of.places)).max().unwrap_or(0).next_multiple_of(width);
        let Code::Rolled(program) = code else { return Memory { spilled, ..Memory::default() } };
        if is_together(program, width) {
            let rows = program.loops.iter().map(|run| run.table.len().next_multiple_of(width) * run.row).collect();
            return Memory { angles: 0, spilled, kept: program.kept.next_multiple_of(width), rows };
        }
        let together = |block: &Block| {
            let turns = block.repeat.as_ref().filter(|repeat| repeat.way.is_none());
            turns.map_or(0, |repeat| program.loops[repeat.run].table.len() * pairs(&block.program).len())
        };
        let angles = program.blocks.iter().map(together).max().unwrap_or(0).next_multiple_of(block);
        let rows = program.loops.iter().map(|run| run.table.len() * run.row).collect();
        Memory { angles, spilled: 0, kept: program.kept, rows }
    }

    /// Number of entries before an array.
    ///
    /// # Panics
    /// If the array is no part of the working memory.
    pub fn start(&self, array: Array) -> usize {
        let spilled = 3 * self.angles;
        let kept = spilled + self.spilled;
        match array {
            Array::Angles => 0,
            Array::Sines => self.angles,
            Array::Cosines => 2 * self.angles,
            Array::Spilled => spilled,
            Array::Kept => kept,
            Array::Rows(run) => kept + self.kept + self.rows[..run].iter().sum::<usize>(),
            Array::Input(_) | Array::Result(_) | Array::Table(_) => {
                unreachable!("inputs, results and tables are not in the working memory")
            }
        }
    }

    /// Number of all entries.
    pub fn len(&self) -> usize {
        self.start(Array::Rows(self.rows.len()))
    }
}
