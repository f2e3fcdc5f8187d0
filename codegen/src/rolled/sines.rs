//! Sines and cosines in the loops that read them, for code that computes several states at once: the angles of one turn
//! fill a vector there, and what is made of them stays in registers.

use std::collections::{BTreeMap, BTreeSet};

use super::{Block, Place, RolledProgram, Target};
use crate::symbolic::angles::nodes;
use crate::symbolic::{Op, ProgramResult};

impl RolledProgram {
    /// The same program without loops for sines and cosines alone: the first loop that reads one computes it, and keeps
    /// it in the row for later ones. The operations are the same, and so are the results.
    pub fn with_sines_in_loops(&self) -> RolledProgram {
        let is_sines = |block: &&Block| block.repeat.as_ref().is_some_and(|repeat| repeat.way.is_none());
        let (sines, rest): (Vec<&Block>, Vec<&Block>) = self.blocks.iter().partition(is_sines);
        let mut blocks: Vec<Block> = rest.into_iter().cloned().collect();
        for sines in sines {
            let run = sines.repeat.as_ref().map(|repeat| repeat.run);
            let mut functions: BTreeMap<usize, u32> = BTreeMap::new();
            for (result, target) in sines.program.outputs.iter().zip(&sines.outputs) {
                if let (ProgramResult::Node(id, _), Target::Row(row)) = (result, target) {
                    functions.insert(*row, *id);
                }
            }
            let angle = |id: u32| {
                let step = sines.program.steps.iter().find(|step| step.0 == id);
                step.and_then(|(_, op, _)| nodes(op).next())
            };
            let of_run: Vec<usize> = (0..blocks.len()).filter(|k| blocks[*k].run() == run).collect();
            for (k, block) in of_run.iter().enumerate() {
                let read = blocks[*block].rows_read();
                let later: BTreeSet<usize> = of_run[k + 1..].iter().flat_map(|k| blocks[*k].rows_read()).collect();
                // Both functions of an angle are computed together.
                let angles: BTreeSet<u32> =
                    read.iter().filter_map(|row| functions.get(row).and_then(|id| angle(*id))).collect();
                let is_here = |id: u32| angle(id).is_some_and(|angle| angles.contains(&angle));
                let (here, rest) = functions.into_iter().partition(|(_, id)| is_here(*id));
                functions = rest;
                blocks[*block].compute(sines, &here, &later);
            }
        }
        RolledProgram { blocks, ..self.clone() }
    }
}

impl Block {
    /// The run of which the block is a loop.
    pub fn run(&self) -> Option<usize> {
        self.repeat.as_ref().map(|repeat| repeat.run)
    }

    /// Numbers of the turn's row that the block reads.
    pub fn rows_read(&self) -> BTreeSet<usize> {
        self.program.steps.iter().filter_map(|(_, op, _)| self.row_read(op)).collect()
    }

    fn row_read(&self, op: &Op) -> Option<usize> {
        match op {
            Op::Input(k) => match self.inputs[*k as usize] {
                Place::Row(row) => Some(row),
                _ => None,
            },
            _ => None,
        }
    }

    /// Lets the block compute sines and cosines, nodes of `sines` by their numbers in the row, instead of reading them.
    /// It writes those that are read later.
    fn compute(&mut self, sines: &Block, functions: &BTreeMap<usize, u32>, later: &BTreeSet<usize>) {
        let offset = self.program.width() as u32;
        let is_function = |op: &Op| matches!(op, Op::Sin(_) | Op::Cos(_));
        let mut needed: BTreeSet<u32> = functions.values().copied().collect();
        for (id, op, _) in sines.program.steps.iter().rev() {
            if needed.contains(id) {
                needed.extend(nodes(op));
            }
        }
        let mut steps = Vec::new();
        for (id, op, label) in sines.program.steps.iter().filter(|(id, op, _)| needed.contains(id) && !is_function(op))
        {
            let op = match op {
                Op::Input(k) => {
                    self.inputs.push(sines.inputs[*k as usize]);
                    Op::Input(self.inputs.len() as u32 - 1)
                }
                op => op.renumbered(|id| id + offset),
            };
            steps.push((id + offset, op, *label));
        }
        let function =
            |id: u32| sines.program.steps.iter().find(|step| step.0 == id).map(|(_, op, label)| (*op, *label));
        let mut made: BTreeMap<usize, u32> = BTreeMap::new();
        let old = std::mem::take(&mut self.program.steps);
        let mut rest = Vec::with_capacity(old.len());
        for (id, op, label) in old {
            let row = self.row_read(&op).filter(|row| functions.contains_key(row));
            match row.and_then(|row| Some((row, function(functions[&row])?))) {
                Some((row, (op, label))) => {
                    rest.push((id, op.renumbered(|id| id + offset), label));
                    made.insert(row, id);
                }
                None => rest.push((id, op, label)),
            }
        }
        for (row, id) in functions.iter().filter(|(row, _)| later.contains(row)) {
            let Some((op, label)) = function(*id) else { continue };
            let here = *made.entry(*row).or_insert_with(|| {
                steps.push((id + offset, op.renumbered(|id| id + offset), label));
                id + offset
            });
            self.program.outputs.push(ProgramResult::Node(here, false));
            self.outputs.push(Target::Row(*row));
        }
        steps.extend(rest);
        self.program.steps = steps;
        let names = sines.program.names.iter().filter(|(id, _)| needed.contains(id));
        self.program.names.extend(names.map(|(id, name)| (id + offset, *name)));
    }
}
