//! Bytes of the x86-64 instructions that vectors of 32 and 64 bytes need: with VEX prefix (AVX2, FMA; 16 registers) or
//! EVEX prefix (AVX-512; 32 registers).
//!
//! Source: Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2, sections 2.3 (VEX), 2.7 (EVEX) and the
//! pages of the instructions.

use super::Width;

/// A vector register.
pub type Register = u8;

/// A register for addresses and counters. All of them belong to the called function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum General {
    Rax = 0,
    Rcx = 1,
    Rdx = 2,
    Rsi = 6,
    Rdi = 7,
    R8 = 8,
    R9 = 9,
    R10 = 10,
    R11 = 11,
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
}

const fn code(map: Map, prefix: u8, byte: u8) -> Code {
    Code { map, prefix, byte, w: false }
}

pub const ADD: Code = code(Map::M0f, 1, 0x58);
pub const MUL: Code = code(Map::M0f, 1, 0x59);
pub const SUB: Code = code(Map::M0f, 1, 0x5c);
pub const DIV: Code = code(Map::M0f, 1, 0x5e);
pub const SQRT: Code = code(Map::M0f, 1, 0x51);
pub const LOAD: Code = code(Map::M0f, 1, 0x10);
pub const STORE: Code = code(Map::M0f, 1, 0x11);
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
/// Takes the second operand where the sign of the mask is set (VEX).
const SELECT: Code = code(Map::M0f3a, 1, 0x4b);
/// Takes the second operand where the mask is set (EVEX).
const SELECT_BY_MASK: Code = code(Map::M0f38, 1, 0x65);
/// Signs as bits of a general register (VEX).
const SIGNS: Code = code(Map::M0f, 1, 0x50);
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
    Code { map: Map::M0f38, prefix: 1, byte: order as u8 + sign, w: true }
}

/// Predicates of comparisons.
#[derive(Clone, Copy, Debug)]
pub enum Predicate {
    /// `a <= b`, not for NaN.
    LessOrEqual = 0x12,
    /// Not `a <= b`, also for NaN.
    NotLessOrEqual = 0x16,
}

/// A place in the code to which jumps lead.
#[derive(Clone, Copy, Debug)]
pub struct Label(usize);

/// Machine code that is being written.
pub struct Assembler {
    width: Width,
    bytes: Vec<u8>,
    /// Places of the four bytes of forward jumps that lead to the exit.
    exits: Vec<usize>,
}

impl Assembler {
    pub fn new(width: Width) -> Assembler {
        Assembler { width, bytes: Vec::new(), exits: Vec::new() }
    }

    fn evex(&self) -> bool {
        self.width == Width::Eight
    }

    /// `to = code(a, last)`; instructions of two operands have no `a`.
    pub fn vector(&mut self, code: Code, to: Register, a: Option<Register>, last: Last) {
        self.prefixed(code, to, a.unwrap_or(0), last, 0, false);
    }

    /// The same with a byte at the end.
    fn with_byte(&mut self, code: Code, to: Register, a: Register, last: Last, byte: u8) {
        self.prefixed(code, to, a, last, 0, false);
        self.bytes.push(byte);
    }

    /// Prefix, code and operands. `mask` is the number of a mask register (EVEX), whose zeros zero the result if `zero`.
    fn prefixed(&mut self, code: Code, reg: u8, v: u8, last: Last, mask: u8, zero: bool) {
        // The bits that extend the numbers of registers are stored inverted.
        let (x, b) = match last {
            Last::Register(r) => (r >> 4 & 1, r >> 3 & 1),
            Last::Memory(m) => (m.index.map_or(0, |i| i as u8 >> 3), m.base as u8 >> 3),
        };
        let (r, r2) = (reg >> 3 & 1, reg >> 4 & 1);
        let low = |v: u8| (!v & 15) << 3;
        if self.evex() {
            let broadcast =
                matches!(last, Last::Memory(Address { broadcast: true, .. })) && code.byte != BROADCAST.byte;
            let first = (1 - r) << 7 | (1 - x) << 6 | (1 - b) << 5 | (1 - r2) << 4 | code.map as u8;
            let second = 1 << 7 | low(v) | 1 << 2 | code.prefix;
            let third = u8::from(zero) << 7 | 2 << 5 | u8::from(broadcast) << 4 | (1 - (v >> 4)) << 3 | mask;
            self.bytes.extend([0x62, first, second, third]);
        } else if x == 0 && b == 0 && !code.w && matches!(code.map, Map::M0f) {
            self.bytes.extend([0xc5, (1 - r) << 7 | low(v) | 1 << 2 | code.prefix]);
        } else {
            let first = (1 - r) << 7 | (1 - (x & 1)) << 6 | (1 - b) << 5 | code.map as u8;
            self.bytes.extend([0xc4, first, u8::from(code.w) << 7 | low(v) | 1 << 2 | code.prefix]);
        }
        self.bytes.push(code.byte);
        match last {
            Last::Register(rm) => self.bytes.push(0xc0 | (reg & 7) << 3 | (rm & 7)),
            Last::Memory(address) => {
                let whole = if address.broadcast { 8 } else { self.width.bytes() };
                self.address(reg, address, if self.evex() { whole } else { 1 });
            }
        }
    }

    /// Operand byte and address; short distances are counted in `unit` bytes.
    fn address(&mut self, reg: u8, Address { base, index, offset, .. }: Address, unit: i32) {
        let (distance, short) = match (offset, offset % unit) {
            (0, _) => (0, None),
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

    /// Reads one number into all lanes.
    pub fn broadcast(&mut self, to: Register, address: Address) {
        self.vector(BROADCAST, to, None, Last::Memory(Address { broadcast: true, ..address }));
    }

    /// `to = from << by`, as integers of 64 bits.
    pub fn shift_left(&mut self, to: Register, from: Register, by: u8) {
        self.with_byte(SHIFT, 6, to, Last::Register(from), by);
    }

    /// `to = if the sign of mask is set { yes } else { no }`, lane by lane.
    pub fn select(&mut self, to: Register, mask: Register, yes: Register, no: Register) {
        if self.evex() {
            self.prefixed(SIGNS_TO_MASK, 1, 0, Last::Register(mask), 0, false);
            self.prefixed(SELECT_BY_MASK, to, no, Last::Register(yes), 1, false);
        } else {
            self.with_byte(SELECT, to, no, Last::Register(yes), mask << 4);
        }
    }

    /// `to = if value <= floor { 0 } else { x }`, lane by lane; `to` is none of the others.
    pub fn zero_below(&mut self, to: Register, value: Register, floor: Register, x: Register) {
        if self.evex() {
            self.with_byte(COMPARE, 1, value, Last::Register(floor), Predicate::NotLessOrEqual as u8);
            self.prefixed(COPY, to, 0, Last::Register(x), 1, true);
        } else {
            self.with_byte(COMPARE, to, value, Last::Register(floor), Predicate::LessOrEqual as u8);
            self.vector(AND_NOT, to, Some(to), Last::Register(x));
        }
    }

    /// Goes to the exit if the sign of a lane is set. Changes `r10`.
    pub fn exit_if_signs(&mut self, x: Register) {
        if self.evex() {
            self.prefixed(SIGNS_TO_MASK, 1, 0, Last::Register(x), 0, false);
            // kmovw r10d, k1
            self.bytes.extend([0xc5, 0x78, 0x93, 0xd1]);
        } else {
            self.prefixed(SIGNS, General::R10 as u8, 0, Last::Register(x), 0, false);
        }
        // test r10b, all lanes: a mask of eight, or of four.
        self.bytes.extend([0x41, 0xf6, 0xc2, ((1_u16 << self.width.lanes()) - 1) as u8]);
        // jnz
        self.bytes.extend([0x0f, 0x85]);
        self.exits.push(self.bytes.len());
        self.bytes.extend([0; 4]);
    }

    /// Reads an address: `to = [base + offset]`.
    pub fn read_address(&mut self, to: General, base: General, offset: i32) {
        self.bytes.extend([0x48 | (to as u8 >> 3) << 2 | base as u8 >> 3, 0x8b]);
        self.address(to as u8, Address { base, index: None, offset, broadcast: false }, 1);
    }

    /// `to = x`
    pub fn set(&mut self, to: General, x: u64) {
        self.bytes.extend([0x48 | to as u8 >> 3, 0xb8 | (to as u8 & 7)]);
        self.bytes.extend(x.to_le_bytes());
    }

    /// `to = from · by`
    pub fn multiply(&mut self, to: General, from: General, by: i32) {
        let (to, from) = (to as u8, from as u8);
        self.bytes.extend([0x48 | (to >> 3) << 2 | from >> 3, 0x69, 0xc0 | (to & 7) << 3 | (from & 7)]);
        self.bytes.extend(by.to_le_bytes());
    }

    /// `to = to + by`, and the flags of it.
    pub fn add(&mut self, to: General, by: i32) {
        self.bytes.extend([0x48 | to as u8 >> 3, 0x81, 0xc0 | (to as u8 & 7)]);
        self.bytes.extend(by.to_le_bytes());
    }

    fn compare(&mut self, a: General, with: i32) {
        self.bytes.extend([0x48 | a as u8 >> 3, 0x81, 0xf8 | (a as u8 & 7)]);
        self.bytes.extend(with.to_le_bytes());
    }

    /// The place that comes next.
    pub fn here(&self) -> Label {
        Label(self.bytes.len())
    }

    /// Goes back to a label unless a register has reached a number.
    pub fn back_unless(&mut self, a: General, reached: i32, to: Label) {
        self.compare(a, reached);
        self.bytes.extend([0x0f, 0x85]);
        let distance = to.0 as i64 - (self.bytes.len() as i64 + 4);
        self.bytes.extend(i32::try_from(distance).expect("loops are short").to_le_bytes());
    }

    /// Ends the function: it returns 0, and 1 from its exits.
    pub fn finish(mut self) -> Vec<u8> {
        // xor eax, eax; vzeroupper; ret
        self.bytes.extend([0x31, 0xc0, 0xc5, 0xf8, 0x77, 0xc3]);
        for at in std::mem::take(&mut self.exits) {
            let distance = i32::try_from(self.bytes.len() - (at + 4)).expect("functions are short");
            self.bytes[at..at + 4].copy_from_slice(&distance.to_le_bytes());
        }
        // mov eax, 1; vzeroupper; ret
        self.bytes.extend([0xb8, 1, 0, 0, 0, 0xc5, 0xf8, 0x77, 0xc3]);
        self.bytes
    }
}

#[cfg(test)]
mod tests;
