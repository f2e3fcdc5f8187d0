//! The body of a function: values that are assigned once, and the locals that hold them.

use std::ops::Range;

use wasm_encoder::{Function, Ieee32, Ieee64, Instruction, ValType};

/// What an instruction takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A parameter, what an instruction gave, or a variable: index of [`Body::types`].
    Made(usize),
    /// Constants; those of numbers by their bits.
    I32(i32),
    I64(i64),
    F32(u32),
    F64(u64),
    V128(i128),
}

impl Value {
    /// The instruction that gives a constant.
    fn constant(self) -> Option<Instruction<'static>> {
        match self {
            Value::Made(_) => None,
            Value::I32(x) => Some(Instruction::I32Const(x)),
            Value::I64(x) => Some(Instruction::I64Const(x)),
            Value::F32(bits) => Some(Instruction::F32Const(Ieee32::new(bits))),
            Value::F64(bits) => Some(Instruction::F64Const(Ieee64::new(bits))),
            Value::V128(bits) => Some(Instruction::V128Const(bits)),
        }
    }
}

/// One instruction: operands are pushed, results are popped. Without an instruction, operands become results.
#[derive(Debug)]
struct Step {
    instruction: Option<Instruction<'static>>,
    operands: Vec<Value>,
    results: Range<usize>,
}

/// The body of a function.
#[derive(Debug, Default)]
pub struct Body {
    /// Types of all values, parameters first.
    types: Vec<ValType>,
    parameters: usize,
    steps: Vec<Step>,
}

impl Body {
    /// A body of a function with parameters of some types, and these.
    pub fn new(parameters: &[ValType]) -> (Body, Vec<Value>) {
        let body = Body { types: parameters.to_vec(), parameters: parameters.len(), steps: Vec::new() };
        (body, (0..parameters.len()).map(Value::Made).collect())
    }

    /// Writes an instruction that gives values of some types.
    pub fn step(&mut self, instruction: Instruction<'static>, operands: &[Value], results: &[ValType]) -> Vec<Value> {
        let made = self.make(results);
        self.steps.push(Step { instruction: Some(instruction), operands: operands.to_vec(), results: made.clone() });
        made.map(Value::Made).collect()
    }

    /// An instruction that gives one value.
    pub fn one(&mut self, instruction: Instruction<'static>, operands: &[Value], result: ValType) -> Value {
        self.step(instruction, operands, &[result])[0]
    }

    /// An instruction that gives nothing.
    pub fn none(&mut self, instruction: Instruction<'static>, operands: &[Value]) {
        self.step(instruction, operands, &[]);
    }

    /// New variables, one after the other, with values to begin with.
    pub fn variables(&mut self, start: &[Value], types: &[ValType]) -> Vec<Value> {
        let made = self.make(types);
        self.steps.push(Step { instruction: None, operands: start.to_vec(), results: made.clone() });
        made.map(Value::Made).collect()
    }

    /// Gives new values to all variables that were made together.
    pub fn assign(&mut self, variables: &[Value], next: &[Value]) {
        let (Some(Value::Made(first)), Some(Value::Made(last))) = (variables.first(), variables.last()) else { return };
        self.steps.push(Step { instruction: None, operands: next.to_vec(), results: *first..last + 1 });
    }

    fn make(&mut self, types: &[ValType]) -> Range<usize> {
        let first = self.types.len();
        self.types.extend(types);
        first..self.types.len()
    }

    /// The function, which ends with the values that it returns.
    pub fn finish(mut self, returned: &[Value]) -> Function {
        self.none(Instruction::End, returned);
        for k in 1..self.steps.len() {
            let [before, step] = &mut self.steps[k - 1..=k] else { unreachable!("two steps") };
            let made = Value::Made(before.results.start);
            if step.operands.get(1) == Some(&made) && step.instruction.as_ref().is_some_and(commutes) {
                step.operands.swap(0, 1);
            }
        }
        let last_uses = self.last_uses();
        Locals::new(&self, last_uses).write(&self.steps)
    }

    /// The step that uses each value last. One that exists before a loop and is used in it is used until its end.
    fn last_uses(&self) -> Vec<usize> {
        // Parameters are made by no step.
        let (mut made, mut last) = (vec![None; self.types.len()], vec![0; self.types.len()]);
        let mut open: Vec<Option<usize>> = Vec::new();
        for (k, step) in self.steps.iter().enumerate() {
            for id in step.results.clone() {
                made[id].get_or_insert(k);
                last[id] = k;
            }
            for operand in &step.operands {
                if let Value::Made(id) = *operand {
                    last[id] = k;
                }
            }
            match step.instruction {
                Some(Instruction::Loop(_)) => open.push(Some(k)),
                Some(Instruction::If(_) | Instruction::Block(_)) => open.push(None),
                Some(Instruction::End) => {
                    let Some(Some(start)) = open.pop() else { continue };
                    let older = |made: Option<usize>| made.is_none_or(|at| at < start);
                    let through = made.iter().zip(&mut last).filter(|(made, last)| older(**made) && **last > start);
                    through.for_each(|(_, last)| *last = k);
                }
                _ => {}
            }
        }
        last
    }
}

/// Whether the operands of an instruction can be exchanged.
fn commutes(instruction: &Instruction) -> bool {
    use Instruction::{
        F32Add, F32Mul, F32x4Add, F32x4Mul, F64Add, F64Mul, F64x2Add, F64x2Mul, I32Add, I32And, I32Mul, I32Or, I32Xor,
        I64Add, I64And, I64Mul, I64Or, I64Xor,
    };
    matches!(
        instruction,
        F32Add
            | F32Mul
            | F32x4Add
            | F32x4Mul
            | F64Add
            | F64Mul
            | F64x2Add
            | F64x2Mul
            | I32Add
            | I32And
            | I32Mul
            | I32Or
            | I32Xor
            | I64Add
            | I64And
            | I64Mul
            | I64Or
            | I64Xor
    )
}

/// Locals of a function while it is written. A local is used again after the last use of its value.
struct Locals<'a> {
    body: &'a Body,
    last_uses: Vec<usize>,
    /// The local of each value that has one.
    of: Vec<Option<u32>>,
    /// Types of all locals, parameters first.
    types: Vec<ValType>,
    /// Locals without a value.
    free: Vec<u32>,
}

impl<'a> Locals<'a> {
    fn new(body: &'a Body, last_uses: Vec<usize>) -> Locals<'a> {
        let parameters = body.parameters;
        let of = (0..body.types.len()).map(|id| u32::try_from(id).ok().filter(|_| id < parameters)).collect();
        Locals { body, last_uses, of, types: body.types[..parameters].to_vec(), free: Vec::new() }
    }

    /// The local of a value, which gets one where it has none.
    fn local(&mut self, id: usize) -> u32 {
        if let Some(local) = self.of[id] {
            return local;
        }
        let ty = self.body.types[id];
        let free = self.free.iter().rposition(|local| self.types[*local as usize] == ty);
        let local = free.map_or(self.types.len() as u32, |at| self.free.remove(at));
        if free.is_none() {
            self.types.push(ty);
        }
        self.of[id] = Some(local);
        local
    }

    /// Ends the life of values that step `k` used last.
    fn release(&mut self, k: usize, ids: impl Iterator<Item = usize>) {
        for id in ids.filter(|id| self.last_uses[*id] == k).collect::<Vec<_>>() {
            self.free.extend(self.of[id].take());
        }
    }

    fn write(mut self, steps: &[Step]) -> Function {
        let mut code: Vec<Instruction> = Vec::new();
        // Whether the first operand is still on the stack.
        let mut there = false;
        for (k, step) in steps.iter().enumerate() {
            for operand in step.operands.iter().skip(usize::from(there)) {
                code.push(match *operand {
                    Value::Made(id) => Instruction::LocalGet(self.local(id)),
                    constant => constant.constant().expect("what is not made is constant"),
                });
            }
            code.extend(step.instruction.clone());
            let used = step.operands.iter().filter_map(|o| if let Value::Made(id) = o { Some(*id) } else { None });
            self.release(k, used);
            there = step.results.len() == 1
                && steps.get(k + 1).is_some_and(|next| next.operands.first() == Some(&Value::Made(step.results.start)));
            for id in step.results.clone().rev() {
                let again = |next: &Step| next.operands[1..].contains(&Value::Made(id));
                match there {
                    true if self.last_uses[id] == k + 1 && !again(&steps[k + 1]) && self.of[id].is_none() => {}
                    true => code.push(Instruction::LocalTee(self.local(id))),
                    false if self.last_uses[id] == k && self.of[id].is_none() => code.push(Instruction::Drop),
                    false => code.push(Instruction::LocalSet(self.local(id))),
                }
            }
        }
        let mut function = Function::new_with_locals_types(self.types[self.body.parameters..].iter().copied());
        for instruction in &code {
            function.instruction(instruction);
        }
        function
    }
}
