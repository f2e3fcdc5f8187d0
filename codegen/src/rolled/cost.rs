//! What a loop form costs to run, in the terms of [`symbolic::cost`](crate::symbolic::cost()).

use super::{rolled, Block, Place, RolledProgram, Target};
use crate::options::Options;
use crate::output::Output;
use crate::plan::Plan;
use crate::symbolic::machine::{latency, SINE, WIDTH};
use crate::symbolic::{Cost, Operand, ProgramResult, BYTES};

/// Cost of a group in loop form; `None` where it has none. Sines and cosines are left out, as everywhere.
pub fn cost(plan: &Plan, group: Output, options: &Options) -> Option<Cost> {
    rolled(plan, group, options).map(|rolled| rolled.program.cost())
}

impl RolledProgram {
    /// Its cost. Turns follow each other as fast as what they carry allows.
    pub fn cost(&self) -> Cost {
        let mut sum = Cost { operations: self.counts().total(), critical_path: SINE, ..Cost::default() };
        for block in &self.blocks {
            let instructions = block.program.instructions();
            sum.bytes += BYTES * instructions as f64;
            let (turns, path) = match &block.repeat {
                None => (1, block.program.critical_path()),
                Some(repeat) if repeat.way.is_none() => continue,
                Some(_) => (self.turns(block), carried_path(block)),
            };
            // Rows are written; what is read is an operand of instructions.
            let rows = block.outputs.iter().filter(|t| matches!(t, Target::Row(_))).count();
            let throughput = block.program.throughput().max((instructions + rows) as f64 / f64::from(WIDTH));
            sum.instructions += turns * (instructions + rows);
            sum.throughput += turns as f64 * throughput;
            sum.critical_path += turns as u32 * path;
        }
        sum
    }

    /// Cycles that the busiest pipe needs with sines, cosines and divisions: for one state, and for each of eight states at
    /// once.
    pub fn bounds(&self) -> [f64; 2] {
        self.blocks.iter().fold([0.0; 2], |[one, lane], block| {
            let turns = self.turns(block) as f64;
            [one + turns * block.program.bound(), lane + turns * block.program.bound_of_lanes()]
        })
    }
}

/// Cycles from what a turn takes from the one before it to what it hands on.
fn carried_path(block: &Block) -> u32 {
    let mut ready = std::collections::BTreeMap::new();
    for (id, op, _) in &block.program.steps {
        let at = match op {
            crate::symbolic::Op::Input(k) => matches!(block.inputs[*k as usize], Place::Carried(_)).then_some(0),
            op => {
                let operands =
                    op.operands().filter_map(|o| if let Operand::Node(k) = o { ready.get(&k) } else { None });
                operands.max().map(|at: &u32| at + latency(op))
            }
        };
        at.map(|at| ready.insert(*id, at));
    }
    let outputs = block.program.outputs.iter().zip(&block.outputs);
    let carried = outputs.filter_map(|(output, target)| match (output, target) {
        (ProgramResult::Node(id, _), Target::Carried(_)) => ready.get(id).copied(),
        _ => None,
    });
    carried.max().unwrap_or(0)
}
