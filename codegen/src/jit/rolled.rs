//! Rolled programs in Cranelift's intermediate language: loops over the turns of a run, whose rows are in the working
//! memory.

use std::collections::BTreeMap;

use cranelift::codegen::ir::{BlockArg, MemFlags, Value};
use cranelift::prelude::*;

use super::lower::{Lowering, Values};
use crate::rolled::{Block, Place, Repeat, RolledProgram, Start, SweepDirection, Target};
use crate::symbolic::angles::{pairs, Pairs};
use crate::symbolic::ProgramResult;

/// One turn of a loop.
#[derive(Clone, Copy)]
struct Turn<'a> {
    /// Its number.
    k: Value,
    run: usize,
    /// Values carried from the turn before.
    carried: &'a [Value],
}

impl Lowering<'_> {
    pub fn rolled(&mut self, program: &RolledProgram) {
        for block in &program.blocks {
            match &block.repeat {
                None => {
                    self.block(program, block, None);
                }
                Some(repeat) if repeat.way.is_none() => self.all_sines(program, block, repeat),
                Some(repeat) => self.repeated(program, block, repeat),
            }
        }
    }

    /// An input of a block.
    fn place(&mut self, program: &RolledProgram, place: Place, turn: Option<Turn>) -> Value {
        let readonly = MemFlags::trusted().with_readonly();
        match (place, turn) {
            (Place::Given(k), _) => {
                let place = self.given[k];
                self.load(place, readonly)
            }
            (Place::Kept(slot), _) => {
                let place = self.memory(self.scratch.kept + slot);
                self.load(place, MemFlags::trusted())
            }
            (Place::GivenOfTurn { first, stride }, Some(turn)) => {
                let place = self.moved(self.given[first], stride, turn.k);
                self.load(place, readonly)
            }
            (Place::Column(column), Some(Turn { k, run, .. })) => {
                let columns = program.loops[run].table.first().map_or(0, Vec::len);
                let table = self.b.ins().iconst(self.target.address, self.target.tables[run] as i64);
                let place = self.moved((table, self.size * column as i64), columns, k);
                self.load(place, readonly)
            }
            (Place::Row(row), Some(turn)) => {
                let place = self.row(program, row, turn);
                self.load(place, MemFlags::trusted())
            }
            (Place::Carried(k), Some(turn)) => turn.carried[k],
            (place, None) => unreachable!("{place:?} outside of a loop"),
        }
    }

    /// Place of a number of the row of a turn.
    fn row(&mut self, program: &RolledProgram, row: usize, Turn { k, run, .. }: Turn) -> (Value, i64) {
        let place = self.memory(self.scratch.rows[run] + row);
        self.moved(place, program.loops[run].row, k)
    }

    /// Gives a value to an output of a block; those that are carried to the next turn are the caller's.
    fn give(&mut self, program: &RolledProgram, target: Target, turn: Option<Turn>, value: Value) {
        let place = match (target, turn) {
            (Target::Result(k), _) => self.places[k],
            (Target::Kept(slot), _) => self.memory(self.scratch.kept + slot),
            (Target::ResultOfTurn { first, stride }, Some(turn)) => self.moved(self.places[first], stride, turn.k),
            (Target::Row(row), Some(turn)) => self.row(program, row, turn),
            (Target::Carried(_), Some(_)) => return,
            (target, None) => unreachable!("{target:?} outside of a loop"),
        };
        self.store(value, place);
    }

    /// The body of a block. Returns what is carried to the next turn.
    fn block(&mut self, program: &RolledProgram, block: &Block, turn: Option<Turn>) -> BTreeMap<usize, Value> {
        let mut values = Values::new(&block.program);
        let mut carried = BTreeMap::new();
        let input = |s: &mut Self, k: usize| s.place(program, block.inputs[k], turn);
        let mut put = |s: &mut Self, k: usize, value| {
            if let Target::Carried(slot) = block.outputs[k] {
                carried.insert(slot, value);
            }
            s.give(program, block.outputs[k], turn, value);
        };
        self.steps(&block.program, &mut values, |_| true, input, &mut put);
        self.constants(&block.program, put);
        carried
    }

    /// A loop over the turns of a run. `body` gets the number of the turn and the carried values, and returns those for
    /// the next turn.
    fn turns(
        &mut self,
        turns: usize,
        backward: bool,
        start: Vec<Value>,
        mut body: impl FnMut(&mut Self, Value, &[Value]) -> Vec<Value>,
    ) -> Vec<Value> {
        let (header, exit) = (self.b.create_block(), self.b.create_block());
        let address = self.target.address;
        self.b.append_block_param(header, address);
        for _ in &start {
            self.b.append_block_param(header, self.target.float);
            self.b.append_block_param(exit, self.target.float);
        }
        let arguments = |k: Option<Value>, carried: &[Value]| -> Vec<BlockArg> {
            k.into_iter().chain(carried.iter().copied()).map(BlockArg::Value).collect()
        };
        let last = turns as i64 - 1;
        let (from, to, by) = if backward { (last, 0, -1) } else { (0, last, 1) };
        let first = self.b.ins().iconst(address, from);
        self.b.ins().jump(header, &arguments(Some(first), &start));
        self.b.switch_to_block(header);
        let parameters = self.b.block_params(header).to_vec();
        let (k, carried) = (parameters[0], &parameters[1..]);
        let next = body(self, k, carried);
        let done = self.b.ins().icmp_imm(IntCC::Equal, k, to);
        let k = self.b.ins().iadd_imm(k, by);
        self.b.ins().brif(done, exit, &arguments(None, &next), header, &arguments(Some(k), &next));
        self.b.switch_to_block(exit);
        self.b.block_params(exit).to_vec()
    }

    fn repeated(&mut self, program: &RolledProgram, block: &Block, repeat: &Repeat) {
        let mut start = Vec::new();
        for (value, _) in &repeat.carried {
            start.push(match *value {
                Start::Const(x) => self.constant(x),
                Start::Kept(slot, minus) => {
                    let value = self.place(program, Place::Kept(slot), None);
                    self.signed(value, minus)
                }
                Start::Given(k, minus) => {
                    let value = self.place(program, Place::Given(k), None);
                    self.signed(value, minus)
                }
            });
        }
        let (turns, backward) = (program.loops[repeat.run].table.len(), repeat.way == Some(SweepDirection::TipToBase));
        let ends = self.turns(turns, backward, start, |s, k, carried| {
            let next = s.block(program, block, Some(Turn { k, run: repeat.run, carried }));
            carried.iter().enumerate().map(|(slot, old)| next.get(&slot).copied().unwrap_or(*old)).collect()
        });
        for ((_, end), value) in repeat.carried.iter().zip(ends) {
            if let Some(slot) = end {
                let place = self.memory(self.scratch.kept + slot);
                self.store(value, place);
            }
        }
    }

    /// Sines and cosines of all turns together.
    fn all_sines(&mut self, program: &RolledProgram, block: &Block, repeat: &Repeat) {
        let (run, turns) = (repeat.run, program.loops[repeat.run].table.len());
        let angles: Pairs = pairs(&block.program);
        self.turns(turns, false, Vec::new(), |s, k, carried| {
            let turn = Some(Turn { k, run, carried });
            let mut values = Values::new(&block.program);
            let others = |id: u32| angles.values().flatten().flatten().all(|node| *node != id);
            let input = |s: &mut Self, k: usize| s.place(program, block.inputs[k], turn);
            s.steps(&block.program, &mut values, others, input, |s, k, value| {
                s.give(program, block.outputs[k], turn, value);
            });
            for (n, angle) in angles.keys().enumerate() {
                let (angle, place) = (values.get(*angle), s.memory(n * turns));
                let place = s.moved(place, 1, k);
                s.store(angle, place);
            }
            Vec::new()
        });
        self.call_sines(turns * angles.len());
        self.turns(turns, false, Vec::new(), |s, k, carried| {
            let turn = Some(Turn { k, run, carried });
            for (result, target) in block.program.outputs.iter().zip(&block.outputs) {
                let ProgramResult::Node(id, minus) = result else { continue };
                for (n, pair) in angles.values().enumerate() {
                    let Some(part) = pair.iter().position(|node| *node == Some(*id)) else { continue };
                    let place = s.memory((1 + part) * s.scratch.angles + n * turns);
                    let place = s.moved(place, 1, k);
                    let value = s.load(place, MemFlags::trusted());
                    let value = s.signed(value, *minus);
                    s.give(program, *target, turn, value);
                }
            }
            Vec::new()
        });
    }
}
