//! Like branches together: the blocks of branches are straight-line code on vectors, one branch in each number. Where
//! there are more branches than a vector has numbers, the code follows for the next ones; the last vector is filled up
//! with the last branch.
//!
//! The working memory has the rows of the branches by columns, so that a vector is loaded and stored whole.

use super::straight::Lowering;
use super::{Array, Instructions, Place};
use crate::rolled::{Place as Source, Repeat, RolledProgram, Target};

impl<I: Instructions> Lowering<'_, I> {
    pub fn together(&mut self, program: &RolledProgram) {
        for (number, block) in program.blocks.iter().enumerate() {
            let Some(repeat) = &block.repeat else {
                let input = |s: &mut Self, k: usize| s.common(program, block.inputs[k]);
                let put = |s: &mut Self, k: usize, value| s.give(program, block.outputs[k], None, value);
                self.body(number, &block.program, input, put);
                continue;
            };
            self.target.vectors(true);
            let turns = program.loops[repeat.run].table.len();
            for first in (0..turns).step_by(self.target.width()) {
                let input = |s: &mut Self, k: usize| s.of_branches(program, repeat, first, block.inputs[k]);
                let put =
                    |s: &mut Self, k: usize, value| s.give_branches(program, repeat, first, block.outputs[k], value);
                self.body(number, &block.program, input, put);
            }
            self.target.vectors(false);
        }
    }

    /// A number of all branches together.
    fn common(&mut self, program: &RolledProgram, source: Source) -> I::Value {
        let Source::RowOfBranch { run, turn, row } = source else { return self.source(program, source, None) };
        let place = self.entry(program, run, row, turn);
        self.target.load(Place::fixed(Array::Rows(run), place))
    }

    /// Entry of a number of the branch `turn`, or of the vector that begins with it, among the columns of a run.
    fn entry(&self, program: &RolledProgram, run: usize, column: usize, turn: usize) -> usize {
        column * program.loops[run].table.len().next_multiple_of(self.target.width()) + turn
    }

    /// A vector of the branches from `first` on.
    fn of_branches(&mut self, program: &RolledProgram, repeat: &Repeat, first: usize, source: Source) -> I::Value {
        let run = repeat.run;
        let (array, column) = match source {
            Source::Column(column) => (Array::Table(run), column),
            Source::Row(row) => (Array::Rows(run), row),
            source => {
                self.target.vectors(false);
                let numbers = self.numbers(program, repeat, first, source);
                self.target.vectors(true);
                return self.target.vector(&numbers);
            }
        };
        let at = self.entry(program, run, column, first);
        self.target.load(Place::fixed(array, at))
    }

    /// The numbers of the branches from `first` on, or one for all.
    fn numbers(&mut self, program: &RolledProgram, repeat: &Repeat, first: usize, source: Source) -> Vec<I::Value> {
        match source {
            Source::GivenOfTurn { first: at, stride } => {
                let last = program.loops[repeat.run].table.len() - 1;
                let turns = (first..first + self.target.width()).map(|turn| turn.min(last));
                turns.map(|turn| self.common(program, Source::Given(at + stride * turn))).collect()
            }
            Source::Carried(k) => vec![self.start(program, repeat.carried[k].0)],
            source => vec![self.common(program, source)],
        }
    }

    /// Gives a vector of the branches from `first` on to an output of a block.
    fn give_branches(
        &mut self,
        program: &RolledProgram,
        repeat: &Repeat,
        first: usize,
        target: Target,
        value: I::Value,
    ) {
        match target {
            Target::Row(row) => {
                let at = self.entry(program, repeat.run, row, first);
                self.target.store(Place::fixed(Array::Rows(repeat.run), at), value);
            }
            Target::ResultOfTurn { first: at, stride } => {
                let end = program.loops[repeat.run].table.len().min(first + self.target.width());
                for turn in first..end {
                    let number = self.target.part(&value, turn - first);
                    self.give(program, Target::Result(at + stride * turn), None, number);
                }
            }
            // Branches hand nothing on to each other.
            Target::Result(_) | Target::Kept(_) | Target::Carried(_) => {}
        }
    }
}
