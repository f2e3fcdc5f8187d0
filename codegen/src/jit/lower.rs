//! Programs in Cranelift's intermediate language.
//!
//! A compiled function takes three addresses: a table with the addresses of the input arrays (three arguments, then
//! [`FIELDS`]), a table with those of the result arrays, and working memory. Its body is that of generated Rust for one
//! state: first the sines and cosines of all angles together, then one instruction for each operation.

use std::collections::BTreeMap;

use cranelift::codegen::ir::{Function, MemFlags, Signature, Type, Value};
use cranelift::prelude::*;

use crate::code::Code;
use crate::output::{InputArray, FIELDS};
use crate::rolled::Block;
use crate::symbolic::angles::{pairs, Angles};
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
    pub angles: usize,
    /// Values kept between the blocks of rolled code.
    pub kept: usize,
    /// Rows of each run.
    pub rows: Vec<usize>,
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
pub(super) struct Lowering<'a> {
    pub b: FunctionBuilder<'a>,
    pub target: &'a Shape<'a>,
    pub scratch: &'a Scratch,
    /// Bytes of a number.
    pub size: i64,
    /// Address of the array and offset in bytes of every input.
    pub given: Vec<(Value, i64)>,
    /// The same of every result.
    pub places: Vec<(Value, i64)>,
    /// Address of the working memory.
    memory: Value,
    /// Signature of the function for sines and cosines.
    sines: cranelift::codegen::ir::SigRef,
}

/// Values of the nodes of a program, and the sines and cosines by their angles, as far as they are known.
pub(super) struct Values {
    of: Vec<Option<Value>>,
    pairs: BTreeMap<u32, [Value; 2]>,
}

impl<'a> Lowering<'a> {
    pub fn load(&mut self, (address, offset): (Value, i64), flags: MemFlags) -> Value {
        let (address, offset) = self.near(address, offset);
        self.b.ins().load(self.target.float, flags, address, offset)
    }

    pub fn store(&mut self, value: Value, (address, offset): (Value, i64)) {
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
    pub fn memory(&self, k: usize) -> (Value, i64) {
        (self.memory, self.size * k as i64)
    }

    /// A place that moves on by `stride` entries with every turn.
    pub fn moved(&mut self, (address, offset): (Value, i64), stride: usize, turn: Value) -> (Value, i64) {
        let by = self.b.ins().imul_imm(turn, self.size * stride as i64);
        (self.b.ins().iadd(address, by), offset)
    }

    pub fn constant(&mut self, x: f64) -> Value {
        match self.target.float {
            types::F32 => self.b.ins().f32const(x as f32),
            _ => self.b.ins().f64const(x),
        }
    }

    pub fn signed(&mut self, x: Value, minus: bool) -> Value {
        if minus {
            self.b.ins().fneg(x)
        } else {
            x
        }
    }

    /// Calls the function for sines and cosines for the first `n` angles of the working memory, and the rest of the last
    /// block.
    pub fn call_sines(&mut self, n: usize) {
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
    pub fn steps(
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
    pub fn constants(&mut self, program: &Program, mut put: impl FnMut(&mut Self, usize, Value)) {
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
}

impl Values {
    pub fn new(program: &Program) -> Values {
        Values { of: vec![None; program.width()], pairs: BTreeMap::new() }
    }

    pub fn get(&self, id: u32) -> Value {
        self.of[id as usize].expect("operands come before the operations that use them")
    }
}
