//! Rolled code: loops over the turns of a run, whose rows are in the working memory.

use std::collections::BTreeMap;

use super::memory::is_together;
use super::straight::{Lowering, Values};
use super::{Array, Instructions, Place};
use crate::rolled::{Place as Source, Repeat, RolledProgram, Start, SweepDirection, Target};
use crate::symbolic::angles::pairs;
use crate::symbolic::ProgramResult;

/// One turn of a loop.
pub struct Turn<'a, I: Instructions> {
    /// Its number.
    k: I::Turn,
    run: usize,
    /// Values carried from the turn before.
    carried: &'a [I::Value],
}

impl<I: Instructions> Turn<'_, I> {
    /// Number `at` of its row.
    fn row(&self, program: &RolledProgram, at: usize) -> Place<I::Turn> {
        Place::moving(Array::Rows(self.run), at, self.k, program.loops[self.run].row)
    }
}

impl<I: Instructions> Lowering<'_, I> {
    pub fn rolled(&mut self, program: &RolledProgram) {
        if is_together(program, self.target.width()) {
            return self.together(program);
        }
        for (number, block) in program.blocks.iter().enumerate() {
            match &block.repeat {
                None => {
                    self.block(program, number, None);
                }
                Some(repeat) if repeat.way.is_none() => self.all_sines(program, number, repeat),
                Some(repeat) => self.repeated(program, number, repeat),
            }
        }
    }

    /// An input of a block.
    pub fn source(&mut self, program: &RolledProgram, source: Source, turn: Option<&Turn<I>>) -> I::Value {
        let place = match (source, turn) {
            (Source::Given(k), _) => {
                let (array, at) = self.inputs[k];
                Place::fixed(array, at)
            }
            (Source::Kept(at), _) => Place::fixed(Array::Kept, at),
            (Source::RowOfBranch { run, turn, row }, _) => {
                Place::fixed(Array::Rows(run), turn * program.loops[run].row + row)
            }
            (Source::GivenOfTurn { first, stride }, Some(turn)) => {
                let (array, at) = self.inputs[first];
                Place::moving(array, at, turn.k, stride)
            }
            (Source::Column(column), Some(turn)) => {
                let columns = program.loops[turn.run].table.first().map_or(0, Vec::len);
                Place::moving(Array::Table(turn.run), column, turn.k, columns)
            }
            (Source::Row(row), Some(turn)) => turn.row(program, row),
            (Source::Carried(k), Some(turn)) => return turn.carried[k].clone(),
            (source, None) => unreachable!("{source:?} outside of a loop"),
        };
        self.target.load(place)
    }

    /// Gives a value to an output of a block; those that are carried to the next turn are the caller's.
    pub fn give(&mut self, program: &RolledProgram, target: Target, turn: Option<&Turn<I>>, value: I::Value) {
        let place = match (target, turn) {
            (Target::Result(k), _) => {
                let (array, at) = self.results[k];
                Place::fixed(array, at)
            }
            (Target::Kept(at), _) => Place::fixed(Array::Kept, at),
            (Target::ResultOfTurn { first, stride }, Some(turn)) => {
                let (array, at) = self.results[first];
                Place::moving(array, at, turn.k, stride)
            }
            (Target::Row(row), Some(turn)) => turn.row(program, row),
            (Target::Carried(_), Some(_)) => return,
            (target, None) => unreachable!("{target:?} outside of a loop"),
        };
        self.target.store(place, value);
    }

    /// The body of a block. Returns what is carried to the next turn.
    fn block(&mut self, program: &RolledProgram, number: usize, turn: Option<&Turn<I>>) -> BTreeMap<usize, I::Value> {
        let block = &program.blocks[number];
        let mut values = Values::new(number, &block.program);
        let mut carried = BTreeMap::new();
        let input = |s: &mut Self, k: usize| s.source(program, block.inputs[k], turn);
        let mut put = |s: &mut Self, k: usize, value: I::Value| {
            if let Target::Carried(slot) = block.outputs[k] {
                carried.insert(slot, value.clone());
            }
            s.give(program, block.outputs[k], turn, value);
        };
        self.steps(&block.program, &mut values, |_| true, input, &mut put);
        self.constants(&block.program, put);
        carried
    }

    fn repeated(&mut self, program: &RolledProgram, number: usize, repeat: &Repeat) {
        let start = repeat.carried.iter().map(|(start, _)| self.start(program, *start)).collect();
        let (turns, backward) = (program.loops[repeat.run].table.len(), repeat.way == Some(SweepDirection::TipToBase));
        let (open, k, carried) = self.target.open_loop(turns, backward, start);
        let next = self.block(program, number, Some(&Turn { k, run: repeat.run, carried: &carried }));
        let next = carried.iter().enumerate().map(|(slot, old)| next.get(&slot).unwrap_or(old).clone()).collect();
        let ends = self.target.close_loop(open, next);
        for ((_, end), value) in repeat.carried.iter().zip(ends) {
            if let Some(at) = *end {
                self.target.store(Place::fixed(Array::Kept, at), value);
            }
        }
    }

    /// First value of something carried.
    pub fn start(&mut self, program: &RolledProgram, start: Start) -> I::Value {
        let (source, minus) = match start {
            Start::Const(x) => return self.target.constant(x),
            Start::Kept(slot, minus) => (Source::Kept(slot), minus),
            Start::Given(k, minus) => (Source::Given(k), minus),
        };
        let value = self.source(program, source, None);
        self.signed(value, minus)
    }

    /// Sines and cosines of all turns together.
    fn all_sines(&mut self, program: &RolledProgram, number: usize, repeat: &Repeat) {
        let block = &program.blocks[number];
        let (run, turns) = (repeat.run, program.loops[repeat.run].table.len());
        let angles = pairs(&block.program);
        let (open, k, _) = self.target.open_loop(turns, false, Vec::new());
        let turn = Turn { k, run, carried: &[] };
        let mut values = Values::new(number, &block.program);
        let others = |id: u32| angles.values().flatten().flatten().all(|node| *node != id);
        let input = |s: &mut Self, k: usize| s.source(program, block.inputs[k], Some(&turn));
        self.steps(&block.program, &mut values, others, input, |s, k, value| {
            s.give(program, block.outputs[k], Some(&turn), value);
        });
        for (n, angle) in angles.keys().enumerate() {
            let place = Place::moving(Array::Angles, n * turns, k, 1);
            self.target.store(place, values.get(*angle));
        }
        self.target.close_loop(open, Vec::new());
        self.target.sines_of_array(turns * angles.len());
        let (open, k, _) = self.target.open_loop(turns, false, Vec::new());
        let turn = Turn { k, run, carried: &[] };
        for (result, target) in block.program.outputs.iter().zip(&block.outputs) {
            let ProgramResult::Node(id, minus) = result else { continue };
            for (n, pair) in angles.values().enumerate() {
                let Some(part) = pair.iter().position(|node| *node == Some(*id)) else { continue };
                let array = [Array::Sines, Array::Cosines][part];
                let value = self.target.load(Place::moving(array, n * turns, k, 1));
                let value = self.signed(value, *minus);
                self.give(program, *target, Some(&turn), value);
            }
        }
        self.target.close_loop(open, Vec::new());
    }
}
