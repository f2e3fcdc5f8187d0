//! Single instructions in Cranelift's intermediate language.
//!
//! A compiled function takes three addresses: a table with the addresses of the input arrays (three arguments, then
//! [`FIELDS`], then the function's constants), a table with those of the result arrays, and working memory. It returns 0.

use std::collections::BTreeMap;

use cranelift::codegen::ir::{BlockArg, Function, MemFlags, SigRef, Signature, StackSlotData, StackSlotKind, Type};
use cranelift::prelude::*;

use crate::code::Code;
use crate::lower::{self, limit, main_path, Array, Instructions, Memory, Operation, Place, Spills};
use crate::options::Precision;
use crate::output::{InputArray, OutputProgram, FIELDS};

/// Largest number of arguments of a function; the fields follow them in the table of inputs.
pub const ARGUMENTS: usize = 3;

/// The function for sines and cosines computes a multiple of so many angles.
pub const BLOCK: usize = 4;

/// Sines and cosines of more angles are computed by the function: their instructions would take more of the cache than
/// the call takes time.
const MOST_INLINE: usize = 16;

/// Number of input arrays of every function.
pub const INPUTS: usize = ARGUMENTS + FIELDS.len();

/// Place of the parameters in the table of inputs.
pub const PARAMETERS: usize = ARGUMENTS + 5;

/// What the body of a function depends on besides its program.
pub struct Shape<'a> {
    /// The number type.
    pub precision: Precision,
    /// Number of states that are computed at once: one, or as many as a vector of 16 bytes has numbers. Every array but
    /// the tables of rolled code then has that many numbers for each entry.
    pub lanes: usize,
    /// The type of an address.
    pub address: Type,
    /// Whether products and sums are one instruction.
    pub fused: bool,
    /// Lengths of the result arrays.
    pub results: &'a [usize],
    /// Working memory.
    pub memory: &'a Memory,
    /// Values of each block that leave the registers.
    pub spills: &'a [Spills],
    /// Places of constants, by their bits, in the function's table.
    pub constants: &'a BTreeMap<u64, usize>,
    /// Places of the tables of rolled code, there.
    pub tables: &'a [usize],
    /// Place of the first constant vector, there.
    pub vectors: usize,
    /// Signature and address of the function that computes sines and cosines.
    pub sines: (Signature, usize),
}

/// Numbers in a vector, in which like branches are computed together, where so many states are computed at once.
pub fn width(precision: Precision, lanes: usize) -> usize {
    match lanes {
        1 => 16 / precision.bytes(),
        _ => 1,
    }
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

/// Writes the body of a function. Returns the bits of the numbers of which the constant vectors consist that it reads.
pub fn write(function: &mut Function, program: &OutputProgram<Code>, shape: &Shape) -> Vec<u64> {
    let mut context = FunctionBuilderContext::new();
    let mut b = FunctionBuilder::new(function, &mut context);
    let entry = b.create_block();
    b.append_block_params_for_function_params(entry);
    b.switch_to_block(entry);
    let [inputs, results, memory] = b.block_params(entry) else { unreachable!("a function has three parameters") };
    let (inputs_table, results, memory) = (*inputs, *results, *memory);
    let pointer = i32::try_from(shape.address.bytes()).expect("addresses are small");
    let constant = MemFlags::trusted().with_readonly();
    let mut addresses = |table: Value, place: usize| {
        let at = i32::try_from(place).expect("arrays are few") * pointer;
        b.ins().load(shape.address, constant, table, at)
    };
    let inputs = input_places(&program.inputs).into_iter().map(|place| addresses(inputs_table, place)).collect();
    let table = addresses(inputs_table, INPUTS);
    let outputs = (0..shape.results.len()).map(|place| addresses(results, place)).collect();
    let sines = b.import_signature(shape.sines.0.clone());
    let number = of_lanes(shape.precision, shape.lanes);
    let mut writer = Writer {
        b,
        shape,
        number,
        inputs,
        outputs,
        memory,
        constants: table,
        vectors: Vec::new(),
        places: BTreeMap::new(),
        sines,
    };
    lower::lower(&mut writer, program, shape.results, shape.spills);
    let done = writer.b.ins().iconst(types::I32, 0);
    writer.b.ins().return_(&[done]);
    writer.b.seal_all_blocks();
    writer.b.finalize();
    writer.vectors
}

/// The type of so many numbers.
fn of_lanes(precision: Precision, lanes: usize) -> Type {
    let number = match precision {
        Precision::F64 => types::F64,
        Precision::F32 => types::F32,
    };
    match lanes {
        1 => number,
        lanes => number.by(lanes as u32).expect("there are vectors of 16 bytes"),
    }
}

/// A body that is being written.
struct Writer<'a> {
    b: FunctionBuilder<'a>,
    shape: &'a Shape<'a>,
    /// Type of the numbers: a vector of them for several states, for like branches, and while sines are written.
    number: Type,
    /// Addresses of the input arrays.
    inputs: Vec<Value>,
    /// Addresses of the result arrays.
    outputs: Vec<Value>,
    /// Address of the working memory.
    memory: Value,
    /// Address of the table of constants.
    constants: Value,
    /// Bits of the numbers of constant vectors.
    vectors: Vec<u64>,
    /// Where each of them stands.
    places: BTreeMap<u64, usize>,
    /// Signature of the function for sines and cosines.
    sines: SigRef,
}

/// A loop that is being written.
pub struct Loop {
    header: Block,
    exit: Block,
    turn: Value,
    /// The last turn, and the step from turn to turn.
    last: i64,
    step: i64,
}

impl Writer<'_> {
    /// Bytes of a number.
    fn size(&self) -> i64 {
        i64::from(self.number.lane_type().bytes())
    }

    /// Bytes of an entry of an array.
    fn entry(&self, array: Array) -> i64 {
        match array {
            Array::Table(_) => self.size(),
            _ => self.size() * self.shape.lanes as i64,
        }
    }

    /// What is known of loads and stores. Vectors are aligned where the function has its own numbers; in the arrays of
    /// callers they are aligned as a number is.
    fn access(&self, array: Array) -> MemFlags {
        match array {
            Array::Input(_) | Array::Result(_) if self.number.is_vector() => MemFlags::new().with_notrap(),
            _ => MemFlags::trusted(),
        }
    }

    /// Address and offset of an entry. An offset that is too large for an instruction is added to the address.
    fn address(&mut self, place: Place<Value>) -> (Value, i32) {
        let size = self.entry(place.array);
        let (address, first) = match place.array {
            Array::Input(k) => (self.inputs[k], 0),
            Array::Result(k) => (self.outputs[k], 0),
            Array::Table(run) => (self.constants, self.shape.tables[run]),
            array => (self.memory, self.shape.memory.start(array)),
        };
        let address = match place.turn {
            None => address,
            Some((turn, stride)) => {
                let by = self.b.ins().imul_imm(turn, size * stride as i64);
                self.b.ins().iadd(address, by)
            }
        };
        let offset = size * (first + place.at) as i64;
        match i32::try_from(offset) {
            Ok(offset) => (address, offset),
            Err(_) => (self.b.ins().iadd_imm(address, offset), 0),
        }
    }

    /// Calls the function for sines and cosines of `n` angles, or those that fill the last block.
    fn call_sines(&mut self, [angles, sines, cosines]: [Value; 3], n: usize) {
        let count = self.b.ins().iconst(self.shape.address, n.next_multiple_of(BLOCK) as i64);
        let callee = self.b.ins().iconst(self.shape.address, self.shape.sines.1 as i64);
        self.b.ins().call_indirect(self.sines, callee, &[angles, count, sines, cosines]);
    }

    /// Exchanges sine and cosine in odd quadrants and gives them the quadrant's signs, by their bits.
    fn turned(&mut self, quadrant: Value, [sin, cos]: [Value; 2]) -> [Value; 2] {
        let bits = self.number.as_int();
        let top = i64::from(bits.lane_bits()) - 1;
        // `bitcast` between vectors has to be told the order of bytes.
        let flags = MemFlags::new().with_endianness(cranelift::codegen::ir::Endianness::Little);
        let [quadrant, sin, cos] = [quadrant, sin, cos].map(|x| self.b.ins().bitcast(bits, flags, x));
        let one = self.b.ins().iconst(bits.lane_type(), 1);
        let one = if bits.is_vector() { self.b.ins().splat(bits, one) } else { one };
        let odd = self.b.ins().band(quadrant, one);
        // All bits are set in odd quadrants.
        let odd = self.b.ins().ineg(odd);
        let pair = [(cos, sin), (sin, cos)].map(|(a, b)| self.b.ins().bitselect(odd, a, b));
        let next = self.b.ins().iadd(quadrant, one);
        let mut signed = pair;
        for (x, quadrant) in signed.iter_mut().zip([quadrant, next]) {
            // Bit 1 becomes the sign.
            let half = self.b.ins().ushr_imm(quadrant, 1);
            let sign = self.b.ins().ishl_imm(half, top);
            let bits = self.b.ins().bxor(*x, sign);
            *x = self.b.ins().bitcast(self.number, flags, bits);
        }
        signed
    }

    /// Sines and cosines of numbers by the main path, as many together as a vector has lanes, and whether all are
    /// within its range.
    fn by_main_path(&mut self, angles: &[Value]) -> (Vec<[Value; 2]>, Option<Value>) {
        let number = self.number;
        // Vectors of several states are taken one by one.
        let lanes = (16 / number.bytes()) as usize;
        let (mut pairs, mut within): (Vec<[Value; 2]>, Option<Value>) = (Vec::new(), None);
        let vector = number.by(lanes as u32).expect("there are vectors of 16 bytes");
        for angles in angles.chunks(lanes) {
            let mut angle = angles[0];
            if angles.len() > 1 {
                self.number = vector;
                angle = self.vector(angles);
            }
            let limit = self.constant(limit(self.shape.precision));
            let size = self.b.ins().fabs(angle);
            // NaN is not within the range.
            let fits = self.b.ins().fcmp(FloatCC::LessThanOrEqual, size, limit);
            let fits = if self.number.is_vector() { self.b.ins().vall_true(fits) } else { fits };
            within = Some(within.map_or(fits, |within| self.b.ins().band(within, fits)));
            let pair = main_path(self, angle, self.shape.precision, self.shape.fused, |s, [shifted, _], pair| {
                s.turned(shifted, pair)
            });
            self.number = number;
            match angles.len() {
                1 => pairs.push(pair),
                _ => pairs.extend((0..angles.len()).map(|lane| pair.map(|x| self.part(&x, lane)))),
            }
        }
        (pairs, within)
    }

    /// Sines and cosines of numbers by the function that takes any angle.
    fn by_function(&mut self, angles: &[Value]) -> Vec<[Value; 2]> {
        let lanes = self.number.lane_count() as usize;
        let padded = (angles.len() * lanes).next_multiple_of(BLOCK);
        let slots = [0; 3].map(|_| {
            let slot = StackSlotData::new(StackSlotKind::ExplicitSlot, self.size() as u32 * padded as u32, 4);
            self.b.create_sized_stack_slot(slot)
        });
        let addresses = slots.map(|slot| self.b.ins().stack_addr(self.shape.address, slot, 0));
        let bytes = self.number.bytes() as usize;
        let offsets = (0..padded / lanes).map(move |k| (k * bytes) as i32);
        for (k, at) in offsets.clone().enumerate() {
            let angle = angles.get(k).unwrap_or(&angles[0]);
            self.b.ins().stack_store(*angle, slots[0], at);
        }
        self.call_sines(addresses, padded);
        let part = |s: &mut Self, at, part: usize| s.b.ins().stack_load(s.number, slots[part], at);
        offsets.take(angles.len()).map(|at| [1, 2].map(|which| part(self, at, which))).collect()
    }
}

#[cfg(feature = "height_fields")]
impl Writer<'_> {
    /// The entry of a table, which stays where it is for as long as the program runs.
    fn entry_of(&mut self, at: Value, table: &'static [f64], offset: usize) -> Value {
        let ins = |s: &mut Self, k: i64| s.b.ins().iconst(types::I64, k);
        // Zero where it is negative or NaN, as in Rust.
        let number = self.b.ins().fcvt_to_uint_sat(types::I64, at);
        // No table is so long that the numbers of its entries need more bits.
        let greatest = ins(self, i64::from(u32::MAX));
        let number = self.b.ins().umin(number, greatest);
        let number = self.b.ins().iadd_imm(number, offset as i64);
        let last = ins(self, table.len().saturating_sub(1) as i64);
        let number = self.b.ins().umin(number, last);
        let number = self.b.ins().imul_imm(number, 8);
        let start = ins(self, table.as_ptr() as i64);
        let place = self.b.ins().iadd(start, number);
        let entry = self.b.ins().load(types::F64, MemFlags::trusted(), place, 0);
        match self.shape.precision {
            Precision::F32 => self.b.ins().fdemote(types::F32, entry),
            Precision::F64 => entry,
        }
    }
}

impl Instructions for Writer<'_> {
    type Value = Value;
    type Turn = Value;
    type Loop = Loop;

    fn constant(&mut self, x: f64) -> Value {
        // An operand in memory takes less code than a number in a register.
        let at = match self.number.is_vector() {
            false => self.shape.constants.get(&x.to_bits()).copied(),
            true => {
                let next = self.vectors.len();
                let k = *self.places.entry(x.to_bits()).or_insert(next);
                if k == next {
                    self.vectors.push(x.to_bits());
                }
                Some(self.shape.vectors + k * self.number.lane_count() as usize)
            }
        };
        if let Some(at) = at {
            let offset = i32::try_from(self.size() * at as i64).expect("constants are few");
            return self.b.ins().load(self.number, MemFlags::trusted(), self.constants, offset);
        }
        match self.shape.precision {
            Precision::F32 => self.b.ins().f32const(x as f32),
            Precision::F64 => self.b.ins().f64const(x),
        }
    }

    fn load(&mut self, place: Place<Value>) -> Value {
        // Not `readonly`: such loads would be merged, and their values kept in registers that others need.
        let ((address, offset), access) = (self.address(place), self.access(place.array));
        if let (Array::Table(_), true) = (place.array, self.shape.lanes > 1) {
            let one = self.b.ins().load(self.number.lane_type(), MemFlags::trusted(), address, offset);
            return self.b.ins().splat(self.number, one);
        }
        self.b.ins().load(self.number, access, address, offset)
    }

    fn store(&mut self, place: Place<Value>, value: Value) {
        let ((address, offset), access) = (self.address(place), self.access(place.array));
        self.b.ins().store(access, value, address, offset);
    }

    fn operation(&mut self, operation: Operation<Value>) -> Value {
        match operation {
            Operation::Add(a, b) => self.b.ins().fadd(a, b),
            Operation::Sub(a, b) => self.b.ins().fsub(a, b),
            Operation::Mul(a, b) => self.b.ins().fmul(a, b),
            Operation::Div(a, b) => self.b.ins().fdiv(a, b),
            Operation::Fma(a, b, c) if self.shape.fused => self.b.ins().fma(a, b, c),
            Operation::Fma(a, b, c) => {
                let product = self.b.ins().fmul(a, b);
                self.b.ins().fadd(product, c)
            }
            Operation::Negate(a) => self.b.ins().fneg(a),
            Operation::ReciprocalAbove { value, floor } => {
                let (one, zero) = (self.constant(1.0), self.constant(0.0));
                let reciprocal = self.b.ins().fdiv(one, value);
                let below = self.b.ins().fcmp(FloatCC::LessThanOrEqual, value, floor);
                if !self.number.is_vector() {
                    return self.b.ins().select(below, zero, reciprocal);
                }
                let flags = MemFlags::new().with_endianness(cranelift::codegen::ir::Endianness::Little);
                let below = self.b.ins().bitcast(self.number, flags, below);
                self.b.ins().bitselect(below, zero, reciprocal)
            }
            #[cfg(feature = "height_fields")]
            Operation::LookUp { at, table, offset } => match self.number.is_vector() {
                false => self.entry_of(at, table, offset),
                true => {
                    let number = self.number;
                    let lanes = 0..number.lane_count() as u8;
                    let places: Vec<Value> = lanes.map(|k| self.b.ins().extractlane(at, k)).collect();
                    let mut vector = None;
                    for (k, at) in places.into_iter().enumerate() {
                        let entry = self.entry_of(at, table, offset);
                        vector = Some(match vector {
                            None => self.b.ins().splat(number, entry),
                            Some(vector) => self.b.ins().insertlane(vector, entry, k as u8),
                        });
                    }
                    vector.unwrap_or(at)
                }
            },
            Operation::Sqrt(a) => self.b.ins().sqrt(a),
        }
    }

    fn sines(&mut self, angles: &[Value]) -> Vec<[Value; 2]> {
        if angles.len() * self.number.lane_count() as usize > MOST_INLINE * self.shape.lanes {
            return self.by_function(angles);
        }
        let (pairs, within) = self.by_main_path(angles);
        let Some(within) = within else { return pairs };
        let (far, next) = (self.b.create_block(), self.b.create_block());
        self.b.set_cold_block(far);
        let arguments = |pairs: Vec<[Value; 2]>| pairs.into_iter().flatten().map(BlockArg::Value).collect::<Vec<_>>();
        for _ in pairs.iter().flatten() {
            self.b.append_block_param(next, self.number);
        }
        self.b.ins().brif(within, next, &arguments(pairs), far, &[]);
        self.b.switch_to_block(far);
        let pairs = self.by_function(angles);
        self.b.ins().jump(next, &arguments(pairs));
        self.b.switch_to_block(next);
        self.b.block_params(next).as_chunks().0.to_vec()
    }

    fn sines_of_array(&mut self, n: usize) {
        let arrays = [Array::Angles, Array::Sines, Array::Cosines].map(|array| {
            let offset = self.entry(array) * self.shape.memory.start(array) as i64;
            self.b.ins().iadd_imm(self.memory, offset)
        });
        self.call_sines(arrays, n * self.shape.lanes);
    }

    fn width(&self) -> usize {
        width(self.shape.precision, self.shape.lanes)
    }

    fn vectors(&mut self, on: bool) {
        self.number = of_lanes(self.shape.precision, if on { self.width() } else { self.shape.lanes });
    }

    fn vector(&mut self, numbers: &[Value]) -> Value {
        let mut vector = self.b.ins().splat(self.number, numbers[0]);
        for (lane, x) in numbers.iter().enumerate().skip(1).filter(|(_, x)| **x != numbers[0]) {
            vector = self.b.ins().insertlane(vector, *x, lane as u8);
        }
        vector
    }

    fn part(&mut self, vector: &Value, k: usize) -> Value {
        self.b.ins().extractlane(*vector, k as u8)
    }

    fn open_loop(&mut self, turns: usize, backward: bool, start: Vec<Value>) -> (Loop, Value, Vec<Value>) {
        let (header, exit) = (self.b.create_block(), self.b.create_block());
        self.b.append_block_param(header, self.shape.address);
        for _ in &start {
            self.b.append_block_param(header, self.number);
            self.b.append_block_param(exit, self.number);
        }
        let end = turns as i64 - 1;
        let (first, last, step) = if backward { (end, 0, -1) } else { (0, end, 1) };
        let first = self.b.ins().iconst(self.shape.address, first);
        let arguments: Vec<BlockArg> = [first].into_iter().chain(start).map(BlockArg::Value).collect();
        self.b.ins().jump(header, &arguments);
        self.b.switch_to_block(header);
        let parameters = self.b.block_params(header);
        let (turn, carried) = (parameters[0], parameters[1..].to_vec());
        (Loop { header, exit, turn, last, step }, turn, carried)
    }

    fn close_loop(&mut self, open: Loop, next: Vec<Value>) -> Vec<Value> {
        let done = self.b.ins().icmp_imm(IntCC::Equal, open.turn, open.last);
        let turn = self.b.ins().iadd_imm(open.turn, open.step);
        let ends: Vec<BlockArg> = next.into_iter().map(BlockArg::Value).collect();
        let again: Vec<BlockArg> = [BlockArg::Value(turn)].into_iter().chain(ends.iter().copied()).collect();
        self.b.ins().brif(done, open.exit, &ends, open.header, &again);
        self.b.switch_to_block(open.exit);
        self.b.block_params(open.exit).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_have_their_place() {
        assert_eq!(FIELDS[PARAMETERS - ARGUMENTS].array.name, "params");
    }
}
