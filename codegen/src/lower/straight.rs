//! Straight-line code: first the sines and cosines of all angles together, then one instruction for each operation.

use std::collections::BTreeMap;

use super::memory::Home;
use super::{Array, Instructions, Operation, Place, Spills};
use crate::symbolic::angles::Angles;
use crate::symbolic::{FlooredReciprocal, Fma, Label, Op, Operand, Program, ProgramResult};

/// A body that is being told.
pub(super) struct Lowering<'a, I: Instructions> {
    pub target: &'a mut I,
    /// Array and entry of each of the function's inputs.
    pub inputs: Vec<(Array, usize)>,
    /// Array and entry of each result.
    pub results: Vec<(Array, usize)>,
    /// Values that leave the registers, for each block; those of blocks that are left out are [`Spills::NONE`].
    pub spills: &'a [Spills],
}

/// Values of the nodes of a block's program, and the sines and cosines by their angles, as far as they are known.
pub(super) struct Values<V> {
    block: usize,
    of: Vec<Option<V>>,
    pub pairs: BTreeMap<u32, [V; 2]>,
}

impl<V: Clone> Values<V> {
    pub fn new(block: usize, program: &Program) -> Values<V> {
        Values { block, of: vec![None; program.width()], pairs: BTreeMap::new() }
    }

    pub fn get(&self, id: u32) -> V {
        self.of[id as usize].clone().expect("operands come before the operations that use them")
    }
}

impl<'a, I: Instructions> Lowering<'a, I> {
    /// Values of a block that leave the registers.
    fn spills_of(&self, block: usize) -> &'a Spills {
        self.spills.get(block).unwrap_or(const { &Spills::NONE })
    }

    pub fn signed(&mut self, x: I::Value, minus: bool) -> I::Value {
        if minus {
            self.target.operation(Operation::Negate(x))
        } else {
            x
        }
    }

    /// The value of an operation other than inputs, sines and cosines.
    fn operation(&mut self, id: u32, op: &Op, values: &Values<I::Value>) -> I::Value {
        // Some processors write the result where the first operand was, and read the last one from memory.
        let spills = self.spills_of(values.block);
        let gone = |o: Operand| matches!(o, Operand::Node(k) if spills.last.contains(&(id, k)));
        let loaded = |o: Operand| match o {
            Operand::Const(_) => spills.decided,
            Operand::Node(k) => gone(o) && spills.loaded.get(&id).is_some_and(|all| all.contains(&k)),
        };
        let last = |a: Operand, b: Operand| if loaded(a) && !loaded(b) { (b, a) } else { (a, b) };
        let mut operand = |o: Operand| match o {
            Operand::Const(bits) => self.target.constant(f64::from_bits(bits)),
            Operand::Node(id) => values.get(id),
        };
        let operation = match *op {
            Op::Add(a, b) => {
                let (a, b) = last(a, b);
                Operation::Add(operand(a), operand(b))
            }
            Op::Sub(a, b) => Operation::Sub(operand(a), operand(b)),
            Op::Mul(a, b) => {
                let (a, b) = last(a, b);
                Operation::Mul(operand(a), operand(b))
            }
            Op::Div(a, b) => Operation::Div(operand(a), operand(b)),
            Op::Fma(Fma { a, b, c, minus_product, minus_addend }) => {
                let (a, b) = if gone(b) && !gone(a) { (b, a) } else { last(a, b) };
                let (a, b, c) = (operand(a), operand(b), operand(c));
                Operation::Fma(self.signed(a, minus_product), b, self.signed(c, minus_addend))
            }
            Op::ReciprocalAbove(FlooredReciprocal { value, floor, minus_value, minus_floor }) => {
                let (value, floor) = (operand(value), operand(floor));
                Operation::ReciprocalAbove {
                    value: self.signed(value, minus_value),
                    floor: self.signed(floor, minus_floor),
                }
            }
            #[cfg(feature = "height_fields")]
            Op::LookUp(crate::symbolic::LookUp { at, minus, table, offset }) => {
                Operation::LookUp { at: self.signed(values.get(at), minus), table: table.0, offset: offset as usize }
            }
            Op::Sqrt(a) => Operation::Sqrt(values.get(a)),
            Op::Input(_) | Op::Sin(_) | Op::Cos(_) => unreachable!("these are no operations on numbers"),
        };
        self.target.operation(operation)
    }

    /// The operations of a program in order, only those that are `wanted`. A result is given to `put` as soon as it is
    /// known.
    pub fn steps(
        &mut self,
        program: &Program,
        values: &mut Values<I::Value>,
        wanted: impl Fn(u32) -> bool,
        mut input: impl FnMut(&mut Self, usize) -> I::Value,
        mut put: impl FnMut(&mut Self, usize, I::Value),
    ) {
        let spills = self.spills_of(values.block);
        let mut results: BTreeMap<u32, Vec<(usize, bool)>> = BTreeMap::new();
        for (k, result) in program.outputs.iter().enumerate() {
            if let ProgramResult::Node(id, minus) = result {
                results.entry(*id).or_default().push((k, *minus));
            }
        }
        for (id, op, label) in &program.steps {
            if !wanted(*id) {
                continue;
            }
            if values.of[*id as usize].is_none() {
                for value in spills.loaded.get(id).into_iter().flatten() {
                    let again = match spills.homes[value] {
                        Home::Input(k) => input(self, k),
                        Home::Stored(at) => self.target.load(Place::fixed(Array::Spilled, spills.entry(at))),
                    };
                    values.of[*value as usize] = Some(again);
                }
                let value = match op {
                    Op::Input(k) => input(self, *k as usize),
                    Op::Sin(a) | Op::Cos(a) => {
                        if !values.pairs.contains_key(a) {
                            let pair = self.target.sines(&[values.get(*a)]);
                            values.pairs.extend([*a].into_iter().zip(pair));
                        }
                        part(op, values.pairs[a].clone())
                    }
                    op => self.operation(*id, op, values),
                };
                self.define(values, *id, *label, value);
            }
            for (k, minus) in results.remove(id).unwrap_or_default() {
                let value = self.signed(values.get(*id), minus);
                put(self, k, value);
            }
        }
    }

    /// Sets the value of a node, and stores it if it leaves the registers.
    fn define(&mut self, values: &mut Values<I::Value>, id: u32, label: Label, value: I::Value) {
        let value = self.target.named(values.block, id, label, value);
        let spills = self.spills_of(values.block);
        if let Some(Home::Stored(at)) = spills.homes.get(&id) {
            self.target.store(Place::fixed(Array::Spilled, spills.entry(*at)), value.clone());
        }
        values.of[id as usize] = Some(value);
    }

    /// The constant results of a program.
    pub fn constants(&mut self, program: &Program, mut put: impl FnMut(&mut Self, usize, I::Value)) {
        for (k, result) in program.outputs.iter().enumerate() {
            if let ProgramResult::Const(x) = result {
                let value = self.target.constant(*x);
                put(self, k, value);
            }
        }
    }

    pub fn straight(&mut self, program: &Program) {
        let input = |s: &mut Self, k: usize| {
            let (array, at) = s.inputs[k];
            s.target.load(Place::fixed(array, at))
        };
        let put = |s: &mut Self, k: usize, value| {
            let (array, at) = s.results[k];
            s.target.store(Place::fixed(array, at), value);
        };
        self.body(0, program, input, put);
    }

    /// A straight-line block: its angles' sines and cosines, then the rest.
    pub fn body(
        &mut self,
        block: usize,
        program: &Program,
        input: impl Fn(&mut Self, usize) -> I::Value + Copy,
        put: impl Fn(&mut Self, usize, I::Value) + Copy,
    ) {
        let angles = Angles::new(program);
        let mut values = Values::new(block, program);
        if !angles.early.is_empty() {
            self.steps(program, &mut values, |id| angles.before.contains(&id), input, |_, _, _| {});
            let early: Vec<I::Value> = angles.early.keys().map(|angle| values.get(*angle)).collect();
            values.pairs.extend(angles.early.keys().copied().zip(self.target.sines(&early)));
            for (id, op, label) in &program.steps {
                let (Op::Sin(a) | Op::Cos(a)) = op else { continue };
                if let Some(pair) = values.pairs.get(a).cloned() {
                    self.define(&mut values, *id, *label, part(op, pair));
                }
            }
        }
        self.steps(program, &mut values, |_| true, input, put);
        self.constants(program, put);
    }
}

/// The sine or the cosine of a pair, whichever an operation is.
fn part<V>(op: &Op, [sin, cos]: [V; 2]) -> V {
    if matches!(op, Op::Sin(_)) {
        sin
    } else {
        cos
    }
}
