//! Functions for sines and cosines: the main path of the runtime's functions, and the reduction of large angles.

use mbd_runtime::trig::{QUARTER_PI, TWO_OVER_PI};
use wasm_encoder::{BlockType, Function, Instruction, MemArg, MemArgTarget, ValType};

use super::body::{Body, Value};
use super::instructions::{Addresses, Signed, SineFunctions, Writer};
use super::number::Number;
use crate::lower::{limit, reduced, within_quadrant};
use crate::options::Precision;

/// 2/π as the functions expect it in the memory: from the last bits to the first.
pub fn table() -> Vec<u8> {
    TWO_OVER_PI.iter().rev().flat_map(|word| word.to_le_bytes()).collect()
}

/// The function for a number or a vector. `table` is the address of [`table`].
pub fn function(number: Number, functions: SineFunctions, table: usize) -> Function {
    let (body, parameters) = Body::new(&[number.ty()]);
    let (x, addresses) = (parameters[0], Addresses::default());
    let mut writer = Writer::new(body, number, &addresses, functions);
    let limit = number.constant(limit(number.precision()));
    let body = &mut writer.body;
    let size = body.one(number.abs(), &[x], number.ty());
    // NaN is not within the range.
    let within = match number.all_true() {
        None => body.one(number.not_above(), &[size, limit], ValType::I32),
        Some(all) => {
            let within = body.one(number.not_above(), &[size, limit], ValType::V128);
            body.one(all, &[within], ValType::I32)
        }
    };
    body.none(Instruction::If(BlockType::Empty), &[within]);
    let near = main_path(&mut writer, x);
    writer.body.none(Instruction::Return, &near);
    writer.body.none(Instruction::End, &[]);
    let pair = match number.lanes() {
        1 => Far { writer: &mut writer, table }.pair(x),
        lanes => {
            let scalar = Number::scalar(number.precision());
            let one = |lane| {
                let angle = writer.body.one(number.extract_lane(lane), &[x], scalar.ty());
                writer.call_sines(scalar, angle)
            };
            let pairs: Vec<[Value; 2]> = (0..lanes as u8).map(one).collect();
            [0, 1].map(|part| writer.gather(&pairs.iter().map(|pair| pair[part]).collect::<Vec<_>>()))
        }
    };
    writer.body.finish(&pair)
}

fn main_path(writer: &mut Writer, x: Value) -> [Value; 2] {
    let number = writer.number;
    let (y, [shifted, _]) = reduced(writer, x.into(), number.precision(), false);
    let pair = within_quadrant(writer, y, number.precision(), false).map(|x| writer.value(x));
    let shifted = writer.value(shifted);
    let quadrant = number.to_bits(&mut writer.body, shifted);
    turned(writer, quadrant, pair)
}

/// Sine and cosine of an angle that is larger by a number of quarter turns, of which the last two bits count.
fn turned(writer: &mut Writer, quadrant: Value, pair: [Value; 2]) -> [Value; 2] {
    let (number, body) = (writer.number, &mut writer.body);
    let ty = number.bits_ty();
    let [sin, cos] = pair.map(|x| number.to_bits(body, x));
    let one = number.bits(1);
    // In odd quadrants, all bits in which the two differ are exchanged.
    let odd = body.one(number.bits_and(), &[quadrant, one], ty);
    let odd = body.one(number.bits_sub(), &[number.bits(0), odd], ty);
    let different = body.one(number.bits_xor(), &[sin, cos], ty);
    let different = body.one(number.bits_and(), &[different, odd], ty);
    let next = body.one(number.bits_add(), &[quadrant, one], ty);
    [(sin, quadrant), (cos, next)].map(|(x, quadrant)| {
        let x = body.one(number.bits_xor(), &[x, different], ty);
        // Bit 1 of the quadrant becomes the sign.
        let half = body.one(number.bits_shr(), &[quadrant, number.places(1)], ty);
        let sign = body.one(number.bits_shl(), &[half, number.places(8 * number.precision().bytes() as u32 - 1)], ty);
        let x = body.one(number.bits_xor(), &[x, sign], ty);
        number.number_of(body, x)
    })
}

/// The reduction of Payne and Hanek, as in [`mbd_runtime::trig`], with words as long as a number.
struct Far<'w, 'a> {
    writer: &'w mut Writer<'a>,
    table: usize,
}

impl Far<'_, '_> {
    fn number(&self) -> Number {
        self.writer.number
    }

    fn word(&mut self, instruction: Instruction<'static>, a: Value, b: Value) -> Value {
        self.writer.body.one(instruction, &[a, b], self.writer.number.bits_ty())
    }

    fn add(&mut self, a: Value, b: Value) -> Value {
        self.word(self.number().bits_add(), a, b)
    }

    fn mul(&mut self, a: Value, b: Value) -> Value {
        self.word(self.number().bits_mul(), a, b)
    }

    fn and(&mut self, a: Value, b: Value) -> Value {
        self.word(self.number().bits_and(), a, b)
    }

    fn or(&mut self, a: Value, b: Value) -> Value {
        self.word(self.number().bits_or(), a, b)
    }

    fn xor(&mut self, a: Value, b: Value) -> Value {
        self.word(self.number().bits_xor(), a, b)
    }

    fn shl(&mut self, a: Value, places: Value) -> Value {
        self.word(self.number().bits_shl(), a, places)
    }

    fn shr(&mut self, a: Value, places: Value) -> Value {
        self.word(self.number().bits_shr(), a, places)
    }

    /// 1 where `a < b`, else 0.
    fn below(&mut self, a: Value, b: Value) -> Value {
        let body = &mut self.writer.body;
        match self.writer.number.precision() {
            Precision::F32 => body.one(Instruction::I32LtU, &[a, b], ValType::I32),
            Precision::F64 => {
                let below = body.one(Instruction::I64LtU, &[a, b], ValType::I32);
                body.one(Instruction::I64ExtendI32U, &[below], ValType::I64)
            }
        }
    }

    /// The upper half of a product.
    fn high(&mut self, a: Value, b: Value) -> Value {
        match self.number().precision() {
            Precision::F32 => {
                let body = &mut self.writer.body;
                let [a, b] = [a, b].map(|x| body.one(Instruction::I64ExtendI32U, &[x], ValType::I64));
                let product = body.one(Instruction::I64Mul, &[a, b], ValType::I64);
                let high = body.one(Instruction::I64ShrU, &[product, Value::I64(32)], ValType::I64);
                body.one(Instruction::I32WrapI64, &[high], ValType::I32)
            }
            Precision::F64 => {
                let (low, half) = (Value::I64(0xffff_ffff), Value::I64(32));
                let [[a0, a1], [b0, b1]] = [a, b].map(|x| [self.and(x, low), self.shr(x, half)]);
                let first = self.mul(a0, b0);
                let carry = self.shr(first, half);
                let product = self.mul(a1, b0);
                let middle = self.add(product, carry);
                let product = self.mul(a0, b1);
                let rest = self.and(middle, low);
                let other = self.add(product, rest);
                let [middle, other] = [middle, other].map(|x| self.shr(x, half));
                let product = self.mul(a1, b1);
                let sum = self.add(product, middle);
                self.add(sum, other)
            }
        }
    }

    /// Three words of 2/π, the first one first, from bit `at` of the table on.
    fn window(&mut self, at: Value) -> [Value; 3] {
        let (precision, number) = (self.number().precision(), self.number());
        let (bytes, bits) = (precision.bytes(), self.len());
        let body = &mut self.writer.body;
        // In the memory, the last word comes first.
        let end = Value::I32((8 * table().len() - 3 * 8 * bytes) as i32);
        let at = match precision {
            Precision::F32 => at,
            Precision::F64 => body.one(Instruction::I32WrapI64, &[at], ValType::I32),
        };
        let place = body.one(Instruction::I32Sub, &[end, at], ValType::I32);
        let address = body.one(Instruction::I32ShrU, &[place, Value::I32(3)], ValType::I32);
        let mut shift = body.one(Instruction::I32And, &[place, Value::I32(7)], ValType::I32);
        if precision == Precision::F64 {
            shift = body.one(Instruction::I64ExtendI32U, &[shift], ValType::I64);
        }
        let rest = self.xor(shift, number.bits(bits - 1));
        [2, 1, 0].map(|word| {
            let at = |offset: usize| MemArg {
                offset: (self.table + word * bytes + offset) as u64,
                align: 0,
                target: MemArgTarget::default(),
                ordering: None,
            };
            let (load, load_byte) = match precision {
                Precision::F32 => (Instruction::I32Load(at(0)), Instruction::I32Load8U(at(bytes))),
                Precision::F64 => (Instruction::I64Load(at(0)), Instruction::I64Load8U(at(bytes))),
            };
            let [low, next] = [load, load_byte].map(|load| self.writer.body.one(load, &[address], number.bits_ty()));
            let low = self.shr(low, shift);
            // The shift of the next byte is by one place and by the others: a shift by a whole word would do nothing.
            let next = self.shl(next, number.bits(1));
            let next = self.shl(next, rest);
            self.or(low, next)
        })
    }

    /// Stored bits of the mantissa.
    fn mantissa(&self) -> u64 {
        match self.number().precision() {
            Precision::F64 => 52,
            Precision::F32 => 23,
        }
    }

    /// Bits of a number.
    fn len(&self) -> u64 {
        8 * self.number().precision().bytes() as u64
    }

    fn bias(&self) -> u64 {
        (1 << (self.len() - 2 - self.mantissa())) - 1
    }

    fn constant(&self, x: u64) -> Value {
        self.number().bits(x)
    }

    /// Sine and cosine of `x` beyond the main path.
    fn pair(&mut self, x: Value) -> [Value; 2] {
        let number = self.number();
        let signed = number.to_bits(&mut self.writer.body, x);
        let sign = self.and(signed, self.constant(1 << (self.len() - 1)));
        let magnitude = self.xor(signed, sign);
        let (y, quadrant) = self.reduced(magnitude);
        let pair = within_quadrant(self.writer, y.map(Signed::from), number.precision(), false);
        let pair = pair.map(|x| self.writer.value(x));
        let [sin, cos] = turned(self.writer, quadrant, pair);
        let sin = self.signed(sin, sign);
        // Zero, or NaN where `x` is infinite or NaN.
        let finite = self.writer.body.one(number.sub(), &[x, x], number.ty());
        [sin, cos].map(|x| self.writer.body.one(number.add(), &[x, finite], number.ty()))
    }

    /// The angle within its quadrant, as a sum of two numbers, and the quadrant, of a number by the bits of its
    /// magnitude.
    fn reduced(&mut self, magnitude: Value) -> ([Value; 2], Value) {
        let (number, mantissa, bits) = (self.number(), self.mantissa(), self.len());
        let (top, low_two) = (self.constant(bits - 1), self.constant(bits - 2));
        let biased = self.shr(magnitude, self.constant(mantissa));
        let fraction = self.and(magnitude, self.constant((1 << mantissa) - 1));
        let m = self.or(fraction, self.constant(1 << mantissa));
        let at = self.add(biased, self.constant(62_u64.wrapping_sub(self.bias() + mantissa)));
        let [low, mid, high] = self.product(m, at);
        // The first two bits are the quadrant; the rest is the fraction of a quadrant, as a signed number around the
        // nearest, in two words.
        let [upper, lower] = [(high, mid), (mid, low)].map(|(first, second)| {
            let first = self.shl(first, self.constant(2));
            let second = self.shr(second, low_two);
            self.or(first, second)
        });
        let negative = self.shr(upper, top);
        let mask = self.word(number.bits_sub(), self.constant(0), negative);
        let [upper, lower] = [upper, lower].map(|word| self.xor(word, mask));
        let lower = self.add(lower, negative);
        let over = self.below(lower, negative);
        let upper = self.add(upper, over);
        let y = self.radians(upper, lower);
        let flip = self.shl(negative, top);
        let quadrant = self.shr(high, low_two);
        (y.map(|y| self.signed(y, flip)), self.add(quadrant, negative))
    }

    /// The last three words of the product of `m` and 2/π from bit `at` on, the last one first.
    fn product(&mut self, m: Value, at: Value) -> [Value; 3] {
        let window = self.window(at);
        let low = self.mul(m, window[2]);
        let carry = self.high(m, window[2]);
        let product = self.mul(m, window[1]);
        let mid = self.add(product, carry);
        let product = self.mul(m, window[0]);
        let upper = self.high(m, window[1]);
        let high = self.add(product, upper);
        let over = self.below(mid, carry);
        [low, mid, self.add(high, over)]
    }

    /// A fraction of a quadrant in two words, in radians: the sum of two numbers, of which the second is small.
    fn radians(&mut self, upper: Value, lower: Value) -> [Value; 2] {
        let (number, mantissa, bits) = (self.number(), self.mantissa(), self.len());
        let ty = number.ty();
        // The upper word is not zero: no number is so close to a multiple of π/2.
        let (count, convert) = match number.precision() {
            Precision::F64 => (Instruction::I64Clz, Instruction::F64ConvertI64U),
            Precision::F32 => (Instruction::I32Clz, Instruction::F32ConvertI32U),
        };
        let zeros = self.writer.body.one(count, &[upper], number.bits_ty());
        let upper = self.shl(upper, zeros);
        let others = self.xor(zeros, self.constant(bits - 1));
        let lower = self.shr(lower, self.constant(1));
        let lower = self.shr(lower, others);
        let leading = self.or(upper, lower);
        let angle = self.high(leading, self.constant(QUARTER_PI >> (64 - bits)));
        // angle · 2^(1 − bits − zeros) radians, split into two numbers exactly.
        let least = self.constant((self.bias() + 1).wrapping_sub(bits));
        let exponent = self.word(number.bits_sub(), least, zeros);
        let scale = self.shl(exponent, self.constant(mantissa));
        let scale = number.number_of(&mut self.writer.body, scale);
        let rest = self.and(angle, self.constant((1 << (bits - mantissa - 1)) - 1));
        let most = self.word(number.bits_sub(), angle, rest);
        let [big, small] = [most, rest].map(|word| {
            let part = self.writer.body.one(convert.clone(), &[word], ty);
            self.writer.body.one(number.mul(), &[part, scale], ty)
        });
        let body = &mut self.writer.body;
        let y0 = body.one(number.add(), &[big, small], ty);
        let lost = body.one(number.sub(), &[big, y0], ty);
        [y0, body.one(number.add(), &[lost, small], ty)]
    }

    /// A number with its sign changed where the sign bit of `sign` is set.
    fn signed(&mut self, x: Value, sign: Value) -> Value {
        let number = self.number();
        let bits = number.to_bits(&mut self.writer.body, x);
        let bits = self.xor(bits, sign);
        number.number_of(&mut self.writer.body, bits)
    }
}
