//! Single instructions of programs as those of WebAssembly.
//!
//! All arrays are at fixed addresses of the memory, so that an access needs no address but the number of a loop's turn.

use wasm_encoder::{BlockType, Instruction, ValType};

use super::body::{Body, Value};
use super::number::Number;
use crate::lower::{Array, Instructions, Memory, Operation, Place};

/// A number whose sign may still have to be changed. Engines do not make a difference of a sum with a negated number,
/// as optimising compilers do.
#[derive(Clone, Copy, Debug)]
pub struct Signed {
    value: Value,
    minus: bool,
}

impl From<Value> for Signed {
    fn from(value: Value) -> Signed {
        Signed { value, minus: false }
    }
}

/// Addresses of the arrays of a function.
#[derive(Clone, Debug, Default)]
pub struct Addresses {
    pub inputs: Vec<usize>,
    pub results: Vec<usize>,
    /// Tables of rolled code.
    pub tables: Vec<usize>,
    /// Working memory.
    pub work: usize,
    pub memory: Memory,
}

/// Numbers of the functions for sines.
#[derive(Clone, Copy, Debug, Default)]
pub struct SineFunctions {
    /// Of one angle.
    pub one: u32,
    /// Of a vector of angles.
    pub vector: u32,
}

/// Writes the body of a function.
pub struct Writer<'a> {
    pub body: Body,
    pub number: Number,
    addresses: &'a Addresses,
    functions: SineFunctions,
    /// Whether a function for sines is called.
    pub calls_sines: bool,
    /// Products of the turn of the open loop and a number of bytes.
    scaled: Vec<(Value, usize, Value)>,
}

/// A loop that is being written.
pub struct Loop {
    turn: Value,
    /// The step from turn to turn, and the number at which the loop ends.
    step: i32,
    end: i32,
    carried: Vec<Value>,
}

impl<'a> Writer<'a> {
    pub fn new(body: Body, number: Number, addresses: &'a Addresses, functions: SineFunctions) -> Writer<'a> {
        Writer { body, number, addresses, functions, calls_sines: false, scaled: Vec::new() }
    }

    /// Calls a function for sines.
    pub fn call_sines(&mut self, number: Number, angle: Value) -> [Value; 2] {
        let function = if number.lanes() > 1 { self.functions.vector } else { self.functions.one };
        self.calls_sines = true;
        let pair = self.body.step(Instruction::Call(function), &[angle], &[number.ty(); 2]);
        [pair[0], pair[1]]
    }

    /// A vector of some numbers; the lanes after them are like the first.
    pub fn gather(&mut self, numbers: &[Value]) -> Value {
        let vector = Number::vector(self.number.precision());
        let first = self.body.one(vector.splat(), &numbers[..1], ValType::V128);
        let others = (1..).zip(&numbers[1..]);
        others.fold(first, |all, (lane, x)| self.body.one(vector.replace_lane(lane), &[all, *x], ValType::V128))
    }

    /// Address and offset of an entry.
    fn place(&mut self, place: Place<Value>) -> (Value, usize) {
        let bytes = self.number.bytes();
        let (address, first, size) = match place.array {
            Array::Input(k) => (self.addresses.inputs[k], 0, bytes),
            Array::Result(k) => (self.addresses.results[k], 0, bytes),
            // The same for all states.
            Array::Table(run) => (self.addresses.tables[run], 0, self.number.precision().bytes()),
            array => (self.addresses.work, self.addresses.memory.start(array), bytes),
        };
        let moved = place.turn.map(|(turn, stride)| self.scale(turn, size * stride));
        (moved.unwrap_or(Value::I32(0)), address + size * (first + place.at))
    }

    /// A turn times a number of bytes.
    fn scale(&mut self, turn: Value, bytes: usize) -> Value {
        let known = self.scaled.iter().find(|(t, by, _)| (*t, *by) == (turn, bytes));
        if let Some((.., scaled)) = known {
            return *scaled;
        }
        let scaled = self.body.one(Instruction::I32Mul, &[turn, Value::I32(bytes as i32)], ValType::I32);
        self.scaled.push((turn, bytes, scaled));
        scaled
    }

    /// Writes an instruction that gives a number.
    fn give(&mut self, instruction: Instruction<'static>, operands: &[Value]) -> Value {
        self.body.one(instruction, operands, self.number.ty())
    }

    /// A number with its sign.
    pub fn value(&mut self, Signed { value, minus }: Signed) -> Value {
        match minus {
            true => self.give(self.number.negate(), &[value]),
            false => value,
        }
    }

    /// The sum, with the bits of the addition of numbers with their signs.
    fn sum(&mut self, a: Signed, b: Signed) -> Signed {
        let (instruction, operands) = match (a.minus, b.minus) {
            (false, false) => (self.number.add(), [a.value, b.value]),
            (true, false) => (self.number.sub(), [b.value, a.value]),
            (_, true) => (self.number.sub(), [self.value(a), b.value]),
        };
        self.give(instruction, &operands).into()
    }

    /// A product or quotient.
    fn product(&mut self, instruction: Instruction<'static>, a: Signed, b: Signed) -> Signed {
        Signed { value: self.give(instruction, &[a.value, b.value]), minus: a.minus != b.minus }
    }
}

impl Instructions for Writer<'_> {
    type Value = Signed;
    type Turn = Value;
    type Loop = Loop;

    fn constant(&mut self, x: f64) -> Signed {
        self.number.constant(x).into()
    }

    fn load(&mut self, place: Place<Value>) -> Signed {
        let (address, offset) = self.place(place);
        let load = match place.array {
            Array::Table(_) => self.number.load_constant(offset),
            _ => self.number.load(offset),
        };
        self.give(load, &[address]).into()
    }

    fn store(&mut self, place: Place<Value>, value: Signed) {
        let value = self.value(value);
        let (address, offset) = self.place(place);
        self.body.none(self.number.store(offset), &[address, value]);
    }

    fn operation(&mut self, operation: Operation<Signed>) -> Signed {
        let number = self.number;
        match operation {
            Operation::Add(a, b) => self.sum(a, b),
            Operation::Sub(a, b) => self.sum(a, Signed { minus: !b.minus, ..b }),
            Operation::Mul(a, b) => self.product(number.mul(), a, b),
            Operation::Div(a, b) => self.product(number.div(), a, b),
            Operation::Fma(a, b, c) => {
                let product = self.product(number.mul(), a, b);
                self.sum(product, c)
            }
            Operation::Negate(a) => Signed { minus: !a.minus, ..a },
            Operation::ReciprocalAbove { value, floor } => {
                let (value, floor) = (self.value(value), self.value(floor));
                let reciprocal = self.give(number.div(), &[number.constant(1.0), value]);
                let (condition, select) = match number.lanes() {
                    1 => (ValType::I32, Instruction::Select),
                    _ => (ValType::V128, Instruction::V128Bitselect),
                };
                let below = self.body.one(number.not_above(), &[value, floor], condition);
                self.give(select, &[number.constant(0.0), reciprocal, below]).into()
            }
            #[cfg(feature = "height_fields")]
            Operation::LookUp { .. } => unreachable!("only contacts look numbers up, and WebAssembly has none"),
            Operation::Sqrt(a) => {
                let a = self.value(a);
                self.give(number.sqrt(), &[a]).into()
            }
        }
    }

    fn sines(&mut self, angles: &[Signed]) -> Vec<[Signed; 2]> {
        let angles: Vec<Value> = angles.iter().map(|angle| self.value(*angle)).collect();
        let number = self.number;
        let vector = Number::vector(number.precision());
        let mut pairs = Vec::new();
        for angles in angles.chunks(vector.lanes() / number.lanes()) {
            if let [angle] = *angles {
                pairs.push(self.call_sines(number, angle).map(Signed::from));
                continue;
            }
            let gathered = self.gather(angles);
            let pair = self.call_sines(vector, gathered);
            let lanes = 0..angles.len() as u8;
            pairs.extend(lanes.map(|lane| pair.map(|x| self.give(vector.extract_lane(lane), &[x]).into())));
        }
        pairs
    }

    fn sines_of_array(&mut self, n: usize) {
        let (number, vector) = (self.number, Number::vector(self.number.precision()));
        let [angles, sines, cosines] = [Array::Angles, Array::Sines, Array::Cosines]
            .map(|array| self.addresses.work + number.bytes() * self.addresses.memory.start(array));
        let (open, turn, _) = self.open_loop(n.div_ceil(vector.lanes() / number.lanes()), false, Vec::new());
        let at = self.scale(turn, vector.bytes());
        let angle = self.body.one(vector.load(angles), &[at], ValType::V128);
        let [sine, cosine] = self.call_sines(vector, angle);
        self.body.none(vector.store(sines), &[at, sine]);
        self.body.none(vector.store(cosines), &[at, cosine]);
        self.close_loop(open, Vec::new());
    }

    fn open_loop(&mut self, turns: usize, backward: bool, start: Vec<Signed>) -> (Loop, Value, Vec<Signed>) {
        let start: Vec<Value> = start.into_iter().map(|x| self.value(x)).collect();
        let turns = turns as i32;
        let (first, step, end) = if backward { (turns - 1, -1, -1) } else { (0, 1, turns) };
        let carried = self.body.variables(&start, &vec![self.number.ty(); start.len()]);
        let turn = self.body.variables(&[Value::I32(first)], &[ValType::I32])[0];
        self.body.none(Instruction::Loop(BlockType::Empty), &[]);
        self.scaled.clear();
        (Loop { turn, step, end, carried: carried.clone() }, turn, carried.into_iter().map(Signed::from).collect())
    }

    fn close_loop(&mut self, Loop { turn, step, end, carried }: Loop, next: Vec<Signed>) -> Vec<Signed> {
        let next: Vec<Value> = next.into_iter().map(|x| self.value(x)).collect();
        self.body.assign(&carried, &next);
        let next = self.body.one(Instruction::I32Add, &[turn, Value::I32(step)], ValType::I32);
        self.body.assign(&[turn], &[next]);
        let again = self.body.one(Instruction::I32Ne, &[turn, Value::I32(end)], ValType::I32);
        self.body.none(Instruction::BrIf(0), &[again]);
        self.body.none(Instruction::End, &[]);
        carried.into_iter().map(Signed::from).collect()
    }
}
