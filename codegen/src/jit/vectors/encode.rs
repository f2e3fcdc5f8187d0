//! Bytes of the x86-64 instructions for single doubles and for vectors of them: with VEX prefix (AVX2, FMA; 16 registers)
//! or EVEX prefix (AVX-512; 32 registers).
//!
//! Source: Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2, sections 2.3 (VEX), 2.7 (EVEX) and the
//! pages of the instructions.

use super::Lanes;

mod control;
mod windows;

pub use control::{Jump, Label};
pub use windows::{plan, Access};

/// A vector register.
pub type Register = u8;

/// A register for addresses and counters. All but `Rbx`, `Rbp`, `R14` and `R15` belong to the called function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum General {
    Rax = 0,
    Rcx = 1,
    Rdx = 2,
    Rbx = 3,
    Rbp = 5,
    Rsi = 6,
    Rdi = 7,
    R8 = 8,
    R9 = 9,
    R10 = 10,
    R11 = 11,
    R14 = 14,
    R15 = 15,
}

/// Memory at a register, another register that is added, and a distance, bytes.
#[derive(Clone, Copy, Debug)]
pub struct Address {
    pub base: General,
    pub index: Option<General>,
    pub offset: i32,
    /// Whether it is one number, which all lanes get.
    pub broadcast: bool,
}

/// The last operand of an instruction.
#[derive(Clone, Copy, Debug)]
pub enum Last {
    Register(Register),
    Memory(Address),
}

/// What follows the prefix byte that selects the group of an instruction.
#[derive(Clone, Copy, Debug)]
pub enum Map {
    M0f = 1,
    M0f38 = 2,
    M0f3a = 3,
}

/// An instruction: its group, mandatory prefix (0 none, 1 `66`, 2 `F3`, 3 `F2`), and byte.
#[derive(Clone, Copy, Debug)]
pub struct Code {
    map: Map,
    prefix: u8,
    byte: u8,
    /// Bit W of the VEX prefix. EVEX instructions on doubles have it always.
    w: bool,
    /// Prefix and byte of the same instruction for a single number. Where there is none, that for 16 bytes does it.
    single: Option<(u8, u8)>,
}

impl Code {
    /// Whether a single number in memory can be the last operand where the result is a single number.
    pub fn reads_single(self) -> bool {
        self.single.is_some()
    }
}

const fn code(map: Map, prefix: u8, byte: u8) -> Code {
    Code { map, prefix, byte, w: false, single: None }
}

/// An instruction that has a form for single numbers.
const fn arithmetic(byte: u8) -> Code {
    Code { map: Map::M0f, prefix: 1, byte, w: false, single: Some((3, byte)) }
}

pub const ADD: Code = arithmetic(0x58);
pub const MUL: Code = arithmetic(0x59);
pub const SUB: Code = arithmetic(0x5c);
pub const DIV: Code = arithmetic(0x5e);
pub const SQRT: Code = arithmetic(0x51);
pub const LOAD: Code = arithmetic(0x10);
pub const STORE: Code = arithmetic(0x11);
pub const COPY: Code = code(Map::M0f, 1, 0x28);
pub const AND: Code = code(Map::M0f, 1, 0xdb);
pub const AND_NOT: Code = code(Map::M0f, 1, 0xdf);
pub const OR: Code = code(Map::M0f, 1, 0xeb);
pub const XOR: Code = code(Map::M0f, 1, 0xef);
pub const ADD_INTEGERS: Code = code(Map::M0f, 1, 0xd4);
pub const SUB_INTEGERS: Code = code(Map::M0f, 1, 0xfb);
const SHIFT: Code = code(Map::M0f, 1, 0x73);
const COMPARE: Code = code(Map::M0f, 1, 0xc2);
const BROADCAST: Code = code(Map::M0f38, 1, 0x19);
/// The same into 16 bytes.
const BROADCAST_TWO: Code = code(Map::M0f, 3, 0x12);
/// Two numbers beside each other, the second one from a register.
const JOIN: Code = code(Map::M0f, 1, 0x14);
/// The same from memory.
const JOIN_MEMORY: Code = code(Map::M0f, 1, 0x16);
/// Two vectors of 16 bytes beside each other.
const JOIN_TWO: Code = code(Map::M0f3a, 1, 0x18);
/// Two vectors of 32 bytes.
const JOIN_FOUR: Code = code(Map::M0f3a, 1, 0x1a);
/// Takes the second operand where the sign of the mask is set (VEX).
const SELECT: Code = code(Map::M0f3a, 1, 0x4b);
/// Takes the second operand where the mask is set (EVEX).
const SELECT_BY_MASK: Code = code(Map::M0f38, 1, 0x65);
/// Signs as bits of a general register (VEX).
const SIGNS: Code = code(Map::M0f, 1, 0x50);
/// Tells in the flag of zero whether a sign is set (VEX).
const TEST_SIGNS: Code = code(Map::M0f38, 1, 0x0f);
/// Signs as a mask (EVEX).
const SIGNS_TO_MASK: Code = code(Map::M0f38, 2, 0x39);

/// The three orders in which a fused product names its operands; the first one is replaced by the result.
#[derive(Clone, Copy, Debug)]
pub enum Order {
    /// `first = first · last + second`
    Product132 = 0x90,
    /// `first = second · first + last`
    Product213 = 0xa0,
    /// `first = second · last + first`
    Product231 = 0xb0,
}

/// A fused product with the signs of product and addend.
pub fn fused(order: Order, minus_product: bool, minus_addend: bool) -> Code {
    let sign = 8 + 2 * u8::from(minus_addend) + 4 * u8::from(minus_product);
    let byte = order as u8 + sign;
    Code { map: Map::M0f38, prefix: 1, byte, w: true, single: Some((1, byte + 1)) }
}

/// Predicates of comparisons.
#[derive(Clone, Copy, Debug)]
pub enum Predicate {
    /// `a <= b`, not for NaN.
    LessOrEqual = 0x12,
    /// Not `a <= b`, also for NaN.
    NotLessOrEqual = 0x16,
}

/// Whether a register has a name only in instructions with EVEX prefix.
fn far(register: Register) -> bool {
    register >= 16
}

/// Machine code that is being written.
pub struct Assembler {
    /// Whether the processor has AVX-512.
    wide: bool,
    bytes: Vec<u8>,
    /// Forward jumps that lead to the exit.
    exits: Vec<Jump>,
    /// Whether registers were written beyond their first 16 bytes.
    upper: bool,
    /// What happens to accesses to the working memory and the function's numbers.
    windows: windows::Windows,
    /// How many registers of the caller are in use for that.
    moving: usize,
    /// The register with the address of the function's numbers.
    pub numbers: Option<General>,
}

/// An instruction with its operands.
#[derive(Clone, Copy)]
struct Instruction {
    lanes: Lanes,
    code: Code,
    reg: u8,
    v: u8,
    last: Last,
    /// A mask register (EVEX), and whether its zeros zero the result.
    mask: Option<(u8, bool)>,
    /// Bytes that it reads or writes in memory.
    bytes: i32,
}

impl Assembler {
    pub fn new(wide: bool) -> Assembler {
        Assembler {
            wide,
            bytes: Vec::new(),
            exits: Vec::new(),
            upper: false,
            windows: windows::Windows::Off,
            moving: 0,
            numbers: None,
        }
    }

    /// `to = code(a, last)`; instructions of two operands have no `a`.
    pub fn vector(&mut self, lanes: Lanes, code: Code, to: Register, a: Option<Register>, last: Last) {
        let bytes = match last {
            Last::Memory(Address { broadcast: true, .. }) => 8,
            _ if lanes == Lanes::One && code.single.is_none() => 16,
            _ => lanes.bytes(),
        };
        self.write(Instruction { lanes, code, reg: to, v: a.unwrap_or(0), last, mask: None, bytes });
    }

    /// The same with a byte at the end, of registers.
    fn with_byte(&mut self, lanes: Lanes, code: Code, [to, a, last]: [Register; 3], byte: u8) {
        self.vector(lanes, code, to, Some(a), Last::Register(last));
        self.bytes.push(byte);
    }

    /// With a mask register (EVEX), of registers.
    fn masked(&mut self, lanes: Lanes, code: Code, [to, a, last]: [Register; 3], mask: (u8, bool)) {
        let last = Last::Register(last);
        self.write(Instruction { lanes, code, reg: to, v: a, last, mask: Some(mask), bytes: 0 });
    }

    /// Prefix, code and operands.
    fn write(&mut self, i: Instruction) {
        let i = self.near(i);
        let (prefix, byte) = match i.code.single {
            Some(single) if i.lanes == Lanes::One => single,
            _ => (i.code.prefix, i.code.byte),
        };
        self.upper |= i.lanes > Lanes::Two;
        let evex = self.evex(&i);
        if evex {
            self.evex_prefix(&i, prefix);
        } else {
            self.vex_prefix(&i, prefix);
        }
        self.bytes.push(byte);
        match i.last {
            Last::Register(rm) => self.bytes.push(0xc0 | (i.reg & 7) << 3 | (rm & 7)),
            Last::Memory(address) => self.address(i.reg, address, if evex { i.bytes } else { 1 }),
        }
    }

    /// Whether an instruction needs the prefix of AVX-512.
    fn needs_evex(&self, i: &Instruction) -> bool {
        let needed = match i.last {
            Last::Register(r) => far(r),
            Last::Memory(m) => m.broadcast && !matches!(i.code.byte, 0x12 | 0x19),
        };
        self.wide && (needed || i.mask.is_some() || i.lanes == Lanes::Eight || far(i.reg) || far(i.v))
    }

    /// Whether an instruction needs the prefix of AVX-512, or is shorter with it.
    fn evex(&self, i: &Instruction) -> bool {
        let shorter = match i.last {
            // Distances of one byte count in units.
            Last::Memory(m) => {
                let unit = m.offset % i.bytes == 0 && i8::try_from(m.offset / i.bytes).is_ok();
                unit && i8::try_from(m.offset).is_err()
            }
            Last::Register(_) => false,
        };
        self.needs_evex(i) || self.wide && shorter
    }

    fn evex_prefix(&mut self, i: &Instruction, prefix: u8) {
        // The bits that extend the numbers of registers are stored inverted.
        let (x, b) = match i.last {
            Last::Register(r) => (r >> 4 & 1, r >> 3 & 1),
            Last::Memory(m) => (m.index.map_or(0, |i| i as u8 >> 3), m.base as u8 >> 3),
        };
        let (r, r2) = (i.reg >> 3 & 1, i.reg >> 4 & 1);
        let broadcast = matches!(i.last, Last::Memory(m) if m.broadcast) && !matches!(i.code.byte, 0x12 | 0x19);
        let length = match i.lanes {
            Lanes::One | Lanes::Two => 0,
            Lanes::Four => 1,
            Lanes::Eight => 2,
        };
        let (mask, zero) = i.mask.unwrap_or((0, false));
        let first = (1 - r) << 7 | (1 - x) << 6 | (1 - b) << 5 | (1 - r2) << 4 | i.code.map as u8;
        let second = 1 << 7 | (!i.v & 15) << 3 | 1 << 2 | prefix;
        let third = u8::from(zero) << 7 | length << 5 | u8::from(broadcast) << 4 | (1 - (i.v >> 4)) << 3 | mask;
        self.bytes.extend([0x62, first, second, third]);
    }

    /// Whether the prefix has two bytes in place of three where registers allow it.
    fn has_short_vex(i: &Instruction) -> bool {
        !i.code.w && matches!(i.code.map, Map::M0f)
    }

    fn vex_prefix(&mut self, i: &Instruction, prefix: u8) {
        let (x, b) = match i.last {
            Last::Register(r) => (0, r >> 3 & 1),
            Last::Memory(m) => (m.index.map_or(0, |i| i as u8 >> 3), m.base as u8 >> 3),
        };
        let r = i.reg >> 3 & 1;
        let rest = (!i.v & 15) << 3 | u8::from(i.lanes == Lanes::Four) << 2 | prefix;
        if x == 0 && b == 0 && Assembler::has_short_vex(i) {
            self.bytes.extend([0xc5, (1 - r) << 7 | rest]);
        } else {
            let first = (1 - r) << 7 | (1 - x) << 6 | (1 - b) << 5 | i.code.map as u8;
            self.bytes.extend([0xc4, first, u8::from(i.code.w) << 7 | rest]);
        }
    }

    /// Operand byte and address; short distances are counted in `unit` bytes.
    fn address(&mut self, reg: u8, Address { base, index, offset, .. }: Address, unit: i32) {
        let (distance, short) = match (offset, offset % unit) {
            // At `rbp`, what would be no distance is another kind of address.
            (0, _) if base != General::Rbp => (0, None),
            (_, 0) => match i8::try_from(offset / unit) {
                Ok(short) => (0x40, Some(short)),
                Err(_) => (0x80, None),
            },
            _ => (0x80, None),
        };
        let base = base as u8 & 7;
        match index {
            None => self.bytes.push(distance | (reg & 7) << 3 | base),
            Some(index) => self.bytes.extend([distance | (reg & 7) << 3 | 4, (index as u8 & 7) << 3 | base]),
        }
        match (distance, short) {
            (0, _) => {}
            (_, Some(short)) => self.bytes.push(short as u8),
            _ => self.bytes.extend(offset.to_le_bytes()),
        }
    }

    /// A single number in all lanes.
    pub fn broadcast(&mut self, lanes: Lanes, to: Register, last: Last) {
        let code = if lanes == Lanes::Two { BROADCAST_TWO } else { BROADCAST };
        self.write(Instruction { lanes, code, reg: to, v: 0, last, mask: None, bytes: 8 });
    }

    /// The lanes of `a` and then those of the last operand, which is a register where these are more than one.
    pub fn join(&mut self, lanes: Lanes, to: Register, a: Register, last: Last) {
        match (lanes, last) {
            (Lanes::Four | Lanes::Eight, _) => {
                let code = if lanes == Lanes::Four { JOIN_TWO } else { JOIN_FOUR };
                self.vector(lanes, code, to, Some(a), last);
                self.bytes.push(1);
            }
            (_, Last::Register(_)) => self.vector(lanes, JOIN, to, Some(a), last),
            _ => self.write(Instruction { lanes, code: JOIN_MEMORY, reg: to, v: a, last, mask: None, bytes: 8 }),
        }
    }

    /// `to = from << by`, as integers of 64 bits.
    pub fn shift_left(&mut self, lanes: Lanes, to: Register, from: Register, by: u8) {
        self.with_byte(lanes, SHIFT, [6, to, from], by);
    }

    /// `to = if the sign of mask is set { yes } else { no }`, lane by lane.
    pub fn select(&mut self, lanes: Lanes, to: Register, mask: Register, yes: Register, no: Register) {
        if lanes == Lanes::Eight || [to, mask, yes, no].into_iter().any(far) {
            self.masked(lanes, SIGNS_TO_MASK, [1, 0, mask], (0, false));
            self.masked(lanes, SELECT_BY_MASK, [to, no, yes], (1, false));
        } else {
            self.with_byte(lanes, SELECT, [to, no, yes], mask << 4);
        }
    }

    /// `to = if value <= floor { 0 } else { x }`, lane by lane; `to` is none of the others.
    pub fn zero_below(&mut self, lanes: Lanes, to: Register, [value, floor, x]: [Register; 3]) {
        if self.wide {
            self.masked(lanes, COMPARE, [1, value, floor], (0, false));
            self.bytes.push(Predicate::NotLessOrEqual as u8);
            self.masked(lanes, COPY, [to, 0, x], (1, true));
        } else {
            self.with_byte(lanes, COMPARE, [to, value, floor], Predicate::LessOrEqual as u8);
            self.vector(lanes, AND_NOT, to, Some(to), Last::Register(x));
        }
    }
}

#[cfg(test)]
mod tests;
