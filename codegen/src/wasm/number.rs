//! Instructions by the type of their numbers.

use wasm_encoder::{Instruction, MemArg, MemArgTarget, ValType};

use super::body::{Body, Value};
use crate::options::Precision;

/// Type of the numbers that instructions compute with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    F64,
    F32,
    /// Two of double precision.
    F64x2,
    /// Four of single precision.
    F32x4,
}

/// Methods for instructions that exist for every type of numbers.
macro_rules! instructions {
    ($($name:ident: $f64:ident $f32:ident $f64x2:ident $f32x4:ident;)+) => {
        $(pub fn $name(self) -> Instruction<'static> {
            match self {
                Number::F64 => Instruction::$f64,
                Number::F32 => Instruction::$f32,
                Number::F64x2 => Instruction::$f64x2,
                Number::F32x4 => Instruction::$f32x4,
            }
        })+
    };
}

impl Number {
    /// A number of a precision.
    pub fn scalar(precision: Precision) -> Number {
        match precision {
            Precision::F64 => Number::F64,
            Precision::F32 => Number::F32,
        }
    }

    /// A vector of numbers of a precision.
    pub fn vector(precision: Precision) -> Number {
        match precision {
            Precision::F64 => Number::F64x2,
            Precision::F32 => Number::F32x4,
        }
    }

    pub fn precision(self) -> Precision {
        match self {
            Number::F64 | Number::F64x2 => Precision::F64,
            Number::F32 | Number::F32x4 => Precision::F32,
        }
    }

    /// How many numbers there are in one.
    pub fn lanes(self) -> usize {
        match self {
            Number::F64 | Number::F32 => 1,
            Number::F64x2 => 2,
            Number::F32x4 => 4,
        }
    }

    pub fn bytes(self) -> usize {
        self.lanes() * self.precision().bytes()
    }

    pub fn ty(self) -> ValType {
        match self {
            Number::F64 => ValType::F64,
            Number::F32 => ValType::F32,
            Number::F64x2 | Number::F32x4 => ValType::V128,
        }
    }

    /// Type of the bits of a number.
    pub fn bits_ty(self) -> ValType {
        match self {
            Number::F64 => ValType::I64,
            Number::F32 => ValType::I32,
            Number::F64x2 | Number::F32x4 => ValType::V128,
        }
    }

    /// A number in every lane.
    pub fn constant(self, x: f64) -> Value {
        match self {
            Number::F64 => Value::F64(x.to_bits()),
            Number::F32 => Value::F32((x as f32).to_bits()),
            Number::F64x2 => self.bits(x.to_bits()),
            Number::F32x4 => self.bits(u64::from((x as f32).to_bits())),
        }
    }

    /// Bits in every lane.
    pub fn bits(self, bits: u64) -> Value {
        match self {
            Number::F64 => Value::I64(bits as i64),
            Number::F32 => Value::I32(bits as i32),
            Number::F64x2 => Value::V128((u128::from(bits) * (1 + (1 << 64))) as i128),
            Number::F32x4 => Value::V128((u128::from(bits as u32) * (1 + (1 << 32) + (1 << 64) + (1 << 96))) as i128),
        }
    }

    instructions! {
        add: F64Add F32Add F64x2Add F32x4Add;
        sub: F64Sub F32Sub F64x2Sub F32x4Sub;
        mul: F64Mul F32Mul F64x2Mul F32x4Mul;
        div: F64Div F32Div F64x2Div F32x4Div;
        negate: F64Neg F32Neg F64x2Neg F32x4Neg;
        sqrt: F64Sqrt F32Sqrt F64x2Sqrt F32x4Sqrt;
        abs: F64Abs F32Abs F64x2Abs F32x4Abs;
        // For vectors, all bits of the lanes in which it holds.
        not_above: F64Le F32Le F64x2Le F32x4Le;
        bits_and: I64And I32And V128And V128And;
        bits_or: I64Or I32Or V128Or V128Or;
        bits_xor: I64Xor I32Xor V128Xor V128Xor;
        bits_add: I64Add I32Add I64x2Add I32x4Add;
        bits_sub: I64Sub I32Sub I64x2Sub I32x4Sub;
        bits_mul: I64Mul I32Mul I64x2Mul I32x4Mul;
        // The number of places is a number of the same type, for vectors an i32.
        bits_shl: I64Shl I32Shl I64x2Shl I32x4Shl;
        bits_shr: I64ShrU I32ShrU I64x2ShrU I32x4ShrU;
    }

    /// A vector with a number in every lane.
    pub fn splat(self) -> Instruction<'static> {
        match self.precision() {
            Precision::F64 => Instruction::F64x2Splat,
            Precision::F32 => Instruction::F32x4Splat,
        }
    }

    /// Whether all bits of some lane are not zero, for each lane of a vector.
    pub fn all_true(self) -> Option<Instruction<'static>> {
        match self {
            Number::F64 | Number::F32 => None,
            Number::F64x2 => Some(Instruction::I64x2AllTrue),
            Number::F32x4 => Some(Instruction::I32x4AllTrue),
        }
    }

    /// The number in a lane of a vector.
    pub fn extract_lane(self, lane: u8) -> Instruction<'static> {
        match self.precision() {
            Precision::F64 => Instruction::F64x2ExtractLane(lane),
            Precision::F32 => Instruction::F32x4ExtractLane(lane),
        }
    }

    /// A vector with another number in a lane.
    pub fn replace_lane(self, lane: u8) -> Instruction<'static> {
        match self.precision() {
            Precision::F64 => Instruction::F64x2ReplaceLane(lane),
            Precision::F32 => Instruction::F32x4ReplaceLane(lane),
        }
    }

    /// How many places the bits are shifted.
    pub fn places(self, n: u32) -> Value {
        match self {
            Number::F64 => Value::I64(i64::from(n)),
            _ => Value::I32(n as i32),
        }
    }

    /// The bits of a number.
    pub fn to_bits(self, body: &mut Body, x: Value) -> Value {
        match self {
            Number::F64 => body.one(Instruction::I64ReinterpretF64, &[x], ValType::I64),
            Number::F32 => body.one(Instruction::I32ReinterpretF32, &[x], ValType::I32),
            Number::F64x2 | Number::F32x4 => x,
        }
    }

    /// The number of some bits.
    pub fn number_of(self, body: &mut Body, bits: Value) -> Value {
        match self {
            Number::F64 => body.one(Instruction::F64ReinterpretI64, &[bits], ValType::F64),
            Number::F32 => body.one(Instruction::F32ReinterpretI32, &[bits], ValType::F32),
            Number::F64x2 | Number::F32x4 => bits,
        }
    }

    /// Reads a number at an offset.
    pub fn load(self, offset: usize) -> Instruction<'static> {
        let at = memory(offset, self.precision());
        match self {
            Number::F64 => Instruction::F64Load(at),
            Number::F32 => Instruction::F32Load(at),
            Number::F64x2 | Number::F32x4 => Instruction::V128Load(at),
        }
    }

    /// Reads a constant at an offset, the same for all lanes.
    pub fn load_constant(self, offset: usize) -> Instruction<'static> {
        let at = memory(offset, self.precision());
        match self {
            Number::F64 | Number::F32 => self.load(offset),
            Number::F64x2 => Instruction::V128Load64Splat(at),
            Number::F32x4 => Instruction::V128Load32Splat(at),
        }
    }

    /// Writes a number at an offset.
    pub fn store(self, offset: usize) -> Instruction<'static> {
        let at = memory(offset, self.precision());
        match self {
            Number::F64 => Instruction::F64Store(at),
            Number::F32 => Instruction::F32Store(at),
            Number::F64x2 | Number::F32x4 => Instruction::V128Store(at),
        }
    }
}

/// An entry of an array of numbers, `offset` bytes after an address.
fn memory(offset: usize, precision: Precision) -> MemArg {
    MemArg { offset: offset as u64, align: precision.bytes().ilog2(), target: MemArgTarget::default(), ordering: None }
}
