//! Programs in Cranelift's intermediate language.
//!
//! A compiled function takes three addresses: a table with the addresses of the input arrays (three arguments, then
//! [`FIELDS`]), a table with those of the result arrays, and working memory. Its body is that of generated Rust for one
//! state: first the sines and cosines of all angles together, then one instruction for each operation.

use std::collections::BTreeMap;

use cranelift::codegen::ir::{BlockArg, Function, MemFlags, Signature, Type, Value};
use cranelift::prelude::*;

use crate::code::Code;
use crate::output::{InputArray, FIELDS};
use crate::rolled::{Block, Place, Repeat, RolledProgram, Start, SweepDirection, Target};
use crate::symbolic::angles::{pairs, Angles, Pairs};
use crate::symbolic::{FlooredReciprocal, Fma, Op, Operand, Program, ProgramResult};

/// Largest number of arguments of a function; the fields follow them in the table of inputs.
pub const ARGUMENTS: usize = 3;

/// Sines and cosines are computed of so many angles at once; memory for them is a multiple of it.
pub const BLOCK: usize = 4;

/// Number of input arrays of every function.
pub const INPUTS: usize = ARGUMENTS + FIELDS.len();

/// What the body of a function depends on besides its program.
pub struct Shape<'a> {
    /// The floating-point type.
    pub float: Type,
    /// The type of an address.
    pub address: Type,
    /// Whether products and sums are one instruction.
    pub fused: bool,
    /// Input arrays, whose entries the program numbers consecutively.
    pub inputs: &'a [InputArray],
    /// Lengths of the result arrays, whose entries the program's results fill in order.
    pub results: &'a [usize],
    /// Addresses of the tables of rolled code.
    pub tables: &'a [usize],
    /// Signature and address of the function that computes sines and cosines.
    pub sines: (Signature, usize),
}

/// Place of each input array in the table of inputs.
pub fn input_places(inputs: &[InputArray]) -> Vec<usize> {
    let mut arguments = 0..ARGUMENTS;
    let place = |array: &InputArray| match array.field {
        true => FIELDS.iter().position(|field| field.array.name == array.name).map(|k| ARGUMENTS + k),
        false => arguments.next(),
    };
    inputs.iter().map(place).map(|place| place.expect("every input is an argument or a field")).collect()
}

/// Working memory of a function: its parts by the number of their first entry.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// Number of angles whose sines and cosines are computed together, in whole blocks. The angles come first, then
    /// their sines, then their cosines.
    angles: usize,
    /// Values kept between the blocks of rolled code.
    kept: usize,
    /// Rows of each run.
    rows: Vec<usize>,
    /// Number of entries.
    pub len: usize,
}

impl Scratch {
    /// The memory that some code needs.
    pub fn new(code: &Code) -> Scratch {
        match code {
            Code::Straight(program) => {
                let angles = Angles::new(program).early.len().max(1).next_multiple_of(BLOCK);
                Scratch { angles, len: 3 * angles, ..Scratch::default() }
            }
            Code::Rolled(program) => {
                let together = |block: &Block| {
                    let turns = block.repeat.as_ref().filter(|r| r.way.is_none());
                    turns.map_or(1, |r| program.loops[r.run].table.len() * pairs(&block.program).len())
                };
                let angles = program.blocks.iter().map(together).max().unwrap_or(0).max(1).next_multiple_of(BLOCK);
                let kept = 3 * angles;
                let mut len = kept + program.kept;
                let rows = program.loops.iter().map(|run| {
                    let first = len;
                    len += run.table.len() * run.row;
                    first
                });
                let rows = rows.collect();
                Scratch { angles, kept, rows, len }
            }
        }
    }
}

/// Writes the body of a function.
pub fn lower(function: &mut Function, code: &Code, scratch: &Scratch, target: &Shape) {
    let mut context = FunctionBuilderContext::new();
    let mut b = FunctionBuilder::new(function, &mut context);
    let entry = b.create_block();
    b.append_block_params_for_function_params(entry);
    b.switch_to_block(entry);
    let [inputs, results, memory] = b.block_params(entry) else { unreachable!("a function has three parameters") };
    let (inputs, results, memory) = (*inputs, *results, *memory);
    let size = i64::from(target.float.bytes());
    let pointer = i32::try_from(target.address.bytes()).expect("addresses are small");
    let constant = MemFlags::trusted().with_readonly();
    let mut given = Vec::new();
    for (array, place) in target.inputs.iter().zip(input_places(target.inputs)) {
        let at = i32::try_from(place).expect("places are few") * pointer;
        let address = b.ins().load(target.address, constant, inputs, at);
        given.extend((0..array.len()).map(|k| (address, size * k as i64)));
    }
    let mut places = Vec::new();
    for (k, len) in target.results.iter().enumerate() {
        let at = i32::try_from(k).expect("results are few") * pointer;
        let address = b.ins().load(target.address, constant, results, at);
        places.extend((0..*len).map(|k| (address, size * k as i64)));
    }
    let sines = b.import_signature(target.sines.0.clone());
    let mut lowering = Lowering { b, target, scratch, size, given, places, memory, sines };
    match code {
        Code::Straight(program) => lowering.straight(program),
        Code::Rolled(program) => lowering.rolled(program),
    }
    lowering.b.ins().return_(&[]);
    lowering.b.seal_all_blocks();
    lowering.b.finalize();
}

/// A body that is being written.
struct Lowering<'a> {
    b: FunctionBuilder<'a>,
    target: &'a Shape<'a>,
    scratch: &'a Scratch,
    /// Bytes of a number.
    size: i64,
    /// Address of the array and offset in bytes of every input.
    given: Vec<(Value, i64)>,
    /// The same of every result.
    places: Vec<(Value, i64)>,
    /// Address of the working memory.
    memory: Value,
    /// Signature of the function for sines and cosines.
    sines: cranelift::codegen::ir::SigRef,
}

/// One turn of a loop.
#[derive(Clone, Copy)]
struct Turn<'a> {
    /// Its number.
    k: Value,
    run: usize,
    /// Values carried from the turn before.
    carried: &'a [Value],
}

/// Values of the nodes of a program, and the sines and cosines by their angles, as far as they are known.
struct Values {
    of: Vec<Option<Value>>,
    pairs: BTreeMap<u32, [Value; 2]>,
}

impl<'a> Lowering<'a> {
    fn load(&mut self, (address, offset): (Value, i64), flags: MemFlags) -> Value {
        let (address, offset) = self.near(address, offset);
        self.b.ins().load(self.target.float, flags, address, offset)
    }

    fn store(&mut self, value: Value, (address, offset): (Value, i64)) {
        let (address, offset) = self.near(address, offset);
        self.b.ins().store(MemFlags::trusted(), value, address, offset);
    }

    /// An address with an offset that instructions can hold.
    fn near(&mut self, address: Value, offset: i64) -> (Value, i32) {
        match i32::try_from(offset) {
            Ok(offset) => (address, offset),
            Err(_) => (self.b.ins().iadd_imm(address, offset), 0),
        }
    }

    /// Place of entry `k` of the working memory.
    fn memory(&self, k: usize) -> (Value, i64) {
        (self.memory, self.size * k as i64)
    }

    /// A place that moves on by `stride` entries with every turn.
    fn moved(&mut self, (address, offset): (Value, i64), stride: usize, turn: Value) -> (Value, i64) {
        let by = self.b.ins().imul_imm(turn, self.size * stride as i64);
        (self.b.ins().iadd(address, by), offset)
    }

    fn constant(&mut self, x: f64) -> Value {
        match self.target.float {
            types::F32 => self.b.ins().f32const(x as f32),
            _ => self.b.ins().f64const(x),
        }
    }

    fn signed(&mut self, x: Value, minus: bool) -> Value {
        if minus {
            self.b.ins().fneg(x)
        } else {
            x
        }
    }

    /// Calls the function for sines and cosines for the first `n` angles of the working memory, and the rest of the last
    /// block.
    fn call_sines(&mut self, n: usize) {
        let parts = [0, 1, 2].map(|part| self.size * (part * self.scratch.angles) as i64);
        let [angles, sines, cosines] = parts.map(|offset| self.b.ins().iadd_imm(self.memory, offset));
        let count = self.b.ins().iconst(self.target.address, n.next_multiple_of(BLOCK) as i64);
        let callee = self.b.ins().iconst(self.target.address, self.target.sines.1 as i64);
        self.b.ins().call_indirect(self.sines, callee, &[angles, count, sines, cosines]);
    }

    /// Sine and cosine of angle `k` of the working memory.
    fn pair(&mut self, k: usize) -> [Value; 2] {
        let n = self.scratch.angles;
        [n + k, 2 * n + k].map(|at| {
            let place = self.memory(at);
            self.load(place, MemFlags::trusted())
        })
    }

    /// The instruction of an operation other than inputs, sines and cosines.
    fn operation(&mut self, op: &Op, values: &Values) -> Value {
        let operand = |s: &mut Self, o: Operand| match o {
            Operand::Const(bits) => s.constant(f64::from_bits(bits)),
            Operand::Node(id) => values.get(id),
        };
        match *op {
            Op::Add(a, b) => {
                let (a, b) = (operand(self, a), operand(self, b));
                self.b.ins().fadd(a, b)
            }
            Op::Sub(a, b) => {
                let (a, b) = (operand(self, a), operand(self, b));
                self.b.ins().fsub(a, b)
            }
            Op::Mul(a, b) => {
                let (a, b) = (operand(self, a), operand(self, b));
                self.b.ins().fmul(a, b)
            }
            Op::Div(a, b) => {
                let (a, b) = (operand(self, a), operand(self, b));
                self.b.ins().fdiv(a, b)
            }
            Op::Fma(Fma { a, b, c, minus_product, minus_addend }) => {
                let (a, b, c) = (operand(self, a), operand(self, b), operand(self, c));
                let a = self.signed(a, minus_product);
                let c = self.signed(c, minus_addend);
                if self.target.fused {
                    return self.b.ins().fma(a, b, c);
                }
                let product = self.b.ins().fmul(a, b);
                self.b.ins().fadd(product, c)
            }
            Op::ReciprocalAbove(FlooredReciprocal { value, floor, minus_value, minus_floor }) => {
                let (value, floor) = (operand(self, value), operand(self, floor));
                let (value, floor) = (self.signed(value, minus_value), self.signed(floor, minus_floor));
                let (one, zero) = (self.constant(1.0), self.constant(0.0));
                let reciprocal = self.b.ins().fdiv(one, value);
                // NaN is not below the floor.
                let below = self.b.ins().fcmp(FloatCC::LessThanOrEqual, value, floor);
                self.b.ins().select(below, zero, reciprocal)
            }
            Op::Sqrt(a) => {
                let a = values.get(a);
                self.b.ins().sqrt(a)
            }
            Op::Input(_) | Op::Sin(_) | Op::Cos(_) => unreachable!("lowered by the caller"),
        }
    }

    /// The operations of a program in order, only those that are `wanted`. A result is given to `put` as soon as it is
    /// known.
    fn steps(
        &mut self,
        program: &Program,
        values: &mut Values,
        wanted: impl Fn(u32) -> bool,
        mut input: impl FnMut(&mut Self, usize) -> Value,
        mut put: impl FnMut(&mut Self, usize, Value),
    ) {
        let mut results: BTreeMap<u32, Vec<(usize, bool)>> = BTreeMap::new();
        for (k, result) in program.outputs.iter().enumerate() {
            if let ProgramResult::Node(id, minus) = result {
                results.entry(*id).or_default().push((k, *minus));
            }
        }
        for (id, op, _) in &program.steps {
            if !wanted(*id) {
                continue;
            }
            if values.of[*id as usize].is_none() {
                let value = match op {
                    Op::Input(k) => input(self, *k as usize),
                    Op::Sin(a) | Op::Cos(a) => {
                        let pair = match values.pairs.get(a) {
                            Some(pair) => *pair,
                            None => {
                                let (angle, place) = (values.get(*a), self.memory(0));
                                self.store(angle, place);
                                self.call_sines(1);
                                let pair = self.pair(0);
                                values.pairs.insert(*a, pair);
                                pair
                            }
                        };
                        pair[usize::from(matches!(op, Op::Cos(_)))]
                    }
                    op => self.operation(op, values),
                };
                values.of[*id as usize] = Some(value);
            }
            for (k, minus) in results.remove(id).unwrap_or_default() {
                let value = values.get(*id);
                let value = self.signed(value, minus);
                put(self, k, value);
            }
        }
    }

    /// The constant results of a program.
    fn constants(&mut self, program: &Program, mut put: impl FnMut(&mut Self, usize, Value)) {
        for (k, result) in program.outputs.iter().enumerate() {
            if let ProgramResult::Const(x) = result {
                let value = self.constant(*x);
                put(self, k, value);
            }
        }
    }

    fn straight(&mut self, program: &Program) {
        let angles = Angles::new(program);
        let mut values = Values::new(program);
        let readonly = MemFlags::trusted().with_readonly();
        let input = |s: &mut Self, k: usize| {
            let place = s.given[k];
            s.load(place, readonly)
        };
        let put = |s: &mut Self, k: usize, value| {
            let place = s.places[k];
            s.store(value, place);
        };
        if !angles.early.is_empty() {
            self.steps(program, &mut values, |id| angles.before.contains(&id), input, |_, _, _| {});
            for (k, angle) in angles.early.keys().enumerate() {
                let (angle, place) = (values.get(*angle), self.memory(k));
                self.store(angle, place);
            }
            self.call_sines(angles.early.len());
            for (k, angle) in angles.early.keys().enumerate() {
                let pair = self.pair(k);
                values.pairs.insert(*angle, pair);
            }
        }
        self.steps(program, &mut values, |_| true, input, put);
        self.constants(program, put);
    }

    fn rolled(&mut self, program: &RolledProgram) {
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

impl Values {
    fn new(program: &Program) -> Values {
        Values { of: vec![None; program.width()], pairs: BTreeMap::new() }
    }

    fn get(&self, id: u32) -> Value {
        self.of[id as usize].expect("operands come before the operations that use them")
    }
}
