//! General registers, jumps, and calls.

use super::{far, Address, Assembler, General, Last, Register, SIGNS, SIGNS_TO_MASK, TEST_SIGNS};
use crate::jit::vectors::Lanes;

/// A place in the code to which jumps lead.
#[derive(Clone, Copy, Debug)]
pub struct Label(usize);

/// A jump whose goal is not known yet: the place of its four bytes.
#[derive(Debug)]
pub struct Jump(usize);

/// The registers that belong to the called function and are in use here.
const KEPT: [General; 9] = [
    General::Rax,
    General::Rcx,
    General::Rdx,
    General::Rsi,
    General::Rdi,
    General::R8,
    General::R9,
    General::R10,
    General::R11,
];

impl Assembler {
    /// Jumps if the sign of a lane is set. Changes `r10`.
    pub fn jump_if_signs(&mut self, lanes: Lanes, x: Register) -> Jump {
        let by_mask = lanes == Lanes::Eight || far(x);
        if by_mask {
            self.masked(lanes, SIGNS_TO_MASK, [1, 0, x], (0, false));
            // kmovw r10d, k1
            self.bytes.extend([0xc5, 0x78, 0x93, 0xd1]);
        } else if lanes == Lanes::One {
            self.vector(lanes, SIGNS, General::R10 as u8, None, Last::Register(x));
        } else {
            self.vector(lanes, TEST_SIGNS, x, None, Last::Register(x));
        }
        if by_mask || lanes == Lanes::One {
            // test r10b, all lanes
            self.bytes.extend([0x41, 0xf6, 0xc2, ((1_u16 << lanes.count()) - 1) as u8]);
        }
        // jnz
        self.bytes.extend([0x0f, 0x85]);
        self.open_jump()
    }

    /// Goes to the exit if the sign of a lane is set. Changes `r10`.
    pub fn exit_if_signs(&mut self, lanes: Lanes, x: Register) {
        let jump = self.jump_if_signs(lanes, x);
        self.exits.push(jump);
    }

    fn open_jump(&mut self) -> Jump {
        self.bytes.extend([0; 4]);
        Jump(self.bytes.len() - 4)
    }

    /// Lets a jump lead here.
    pub fn land(&mut self, Jump(at): Jump) {
        let distance = i32::try_from(self.bytes.len() - (at + 4)).expect("functions are short");
        self.bytes[at..at + 4].copy_from_slice(&distance.to_le_bytes());
    }

    /// The distance to a label, as the last part of a jump.
    fn back(&mut self, to: Label) {
        let distance = to.0 as i64 - (self.bytes.len() as i64 + 4);
        self.bytes.extend(i32::try_from(distance).expect("functions are short").to_le_bytes());
    }

    /// Goes back to a label.
    pub fn go(&mut self, to: Label) {
        self.bytes.push(0xe9);
        self.back(to);
    }

    /// The place that comes next.
    pub fn here(&self) -> Label {
        Label(self.bytes.len())
    }

    /// Goes back to a label unless a register has reached a number.
    pub fn back_unless(&mut self, a: General, reached: i32, to: Label) {
        self.compare(a, reached);
        self.bytes.extend([0x0f, 0x85]);
        self.back(to);
    }

    /// Byte of instructions on the address `[base + offset]`, into a register of 64 bits.
    pub(super) fn of_address(&mut self, byte: u8, to: General, base: General, offset: i32) {
        self.bytes.extend([0x48 | (to as u8 >> 3) << 2 | base as u8 >> 3, byte]);
        self.address(to as u8, Address { base, index: None, offset, broadcast: false }, 1);
    }

    /// Reads an address: `to = [base + offset]`.
    pub fn read_address(&mut self, to: General, base: General, offset: i32) {
        self.of_address(0x8b, to, base, offset);
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

    pub(super) fn compare(&mut self, a: General, with: i32) {
        self.bytes.extend([0x48 | a as u8 >> 3, 0x81, 0xf8 | (a as u8 & 7)]);
        self.bytes.extend(with.to_le_bytes());
    }

    /// Calls `function(angles, n, sines, cosines)`, whose arrays are at distances from `rdx`. General registers are kept,
    /// vectors are not.
    pub fn call_sines(&mut self, function: u64, n: u64, [angles, sines, cosines]: [i32; 3]) {
        // push; the first nine of them leave the stack aligned to 16 bytes, because of the address of return.
        for register in KEPT {
            self.extended(register, 0x50);
        }
        self.of_address(0x8d, General::Rdi, General::Rdx, angles);
        self.of_address(0x8d, General::Rcx, General::Rdx, cosines);
        self.of_address(0x8d, General::Rdx, General::Rdx, sines);
        self.set(General::Rsi, n);
        self.set(General::Rax, function);
        // vzeroupper; call rax
        self.bytes.extend([0xc5, 0xf8, 0x77, 0xff, 0xd0]);
        for register in KEPT.into_iter().rev() {
            self.extended(register, 0x58);
        }
    }

    /// An instruction of one byte that contains the number of a register.
    pub(super) fn extended(&mut self, register: General, byte: u8) {
        if register as u8 >= 8 {
            self.bytes.push(0x41);
        }
        self.bytes.push(byte | (register as u8 & 7));
    }

    /// The function returns 0.
    pub fn return_0(&mut self) {
        // xor eax, eax
        self.bytes.extend([0x31, 0xc0]);
        self.leave();
    }

    /// Returns.
    fn leave(&mut self) {
        if self.upper {
            // vzeroupper
            self.bytes.extend([0xc5, 0xf8, 0x77]);
        }
        self.restore();
        self.bytes.push(0xc3);
    }

    /// Ends the code: from its exits the function returns 1.
    pub fn finish(mut self) -> Vec<u8> {
        let exits = std::mem::take(&mut self.exits);
        if !exits.is_empty() {
            exits.into_iter().for_each(|exit| self.land(exit));
            // mov eax, 1
            self.bytes.extend([0xb8, 1, 0, 0, 0]);
            self.leave();
        }
        self.bytes
    }
}
