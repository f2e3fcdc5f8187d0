//! Registers for the values of a body, and its machine code.
//!
//! The value whose next use is the farthest leaves the registers (Belady, 1966). Constants, inputs and tables are read
//! again from where they are; other values are stored once. The last operand of an instruction may be in memory.

mod places;

use std::collections::BTreeMap;

use super::body::{Binary, Body, Entry, Id, Item, Step};
use super::encode::{self as code, fused, Assembler, General, Label, Last, Order, Register};
use super::Width;
use crate::lower::{Array, Memory};

/// Registers for addresses of arrays.
const POINTERS: [General; 4] = [General::Rax, General::Rcx, General::R8, General::R9];

/// Number of a loop's turn, and the distance of its entries.
const TURN: General = General::R11;
const DISTANCE: General = General::R10;

/// Where the arrays of a function are.
pub struct Arrays<'a> {
    /// Places of the input arrays in the table of inputs.
    pub inputs: &'a [usize],
    /// Place of the function's own numbers in the same table.
    pub numbers: usize,
    /// Places of the tables of rolled code among these numbers.
    pub tables: &'a [usize],
    /// The constants follow there.
    pub constants: usize,
    /// Working memory.
    pub memory: &'a Memory,
}

/// Machine code of a body.
pub struct Written {
    pub bytes: Vec<u8>,
    /// Entries of the working memory, each as wide as a vector.
    pub scratch: usize,
    /// Numbers that the code reads: constants, as vectors where it reads whole ones.
    pub numbers: Vec<f64>,
}

/// What is known of a value.
#[derive(Clone, Debug, Default)]
struct Known {
    register: Option<Register>,
    /// Place among those for values that left the registers.
    slot: Option<usize>,
    /// A constant, or an entry that does not change as long as the value is used.
    source: Option<Step>,
    /// Items that use it, the next one last.
    uses: Vec<usize>,
}

/// What has an address of its own: an array, or the function's numbers.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Pointer {
    Array(Array),
    Numbers,
}

/// A body that is being written.
struct Writer<'a> {
    assembler: Assembler,
    width: Width,
    arrays: &'a Arrays<'a>,
    /// First place for values that left the registers.
    first_slot: usize,
    known: Vec<Known>,
    /// The value in each register.
    held: Vec<Option<Id>>,
    free_slots: Vec<usize>,
    slots: usize,
    constants: BTreeMap<u64, usize>,
    /// Arrays whose addresses are in [`POINTERS`], and when they were used last.
    pointers: [(Option<Pointer>, usize); POINTERS.len()],
    /// By how many bytes the entries move that [`DISTANCE`] belongs to.
    distance: Option<i32>,
    /// Beginnings of the open loops.
    loops: Vec<Label>,
    /// The item that is being written.
    now: usize,
}

/// Writes a body. `None` if it is too long for the instructions' distances, or a loop reads a value from outside.
pub fn write(body: &Body, width: Width, arrays: &Arrays) -> Option<Written> {
    let mut known = vec![Known::default(); body.values as usize];
    for (k, item) in body.items.iter().enumerate().rev() {
        match item {
            Item::Value(id, _) if known[*id as usize].uses.is_empty() => {}
            Item::Value(_, step) => step.operands().for_each(|id| known[id as usize].uses.push(k)),
            Item::Store(_, id) | Item::ExitIfSigns(id) => known[*id as usize].uses.push(k),
            Item::Open { .. } | Item::Close { .. } => {}
        }
    }
    let first_slot = arrays.memory.len() + body.carried;
    let mut writer = Writer {
        assembler: Assembler::new(width),
        width,
        arrays,
        first_slot,
        known,
        held: vec![None; width.registers()],
        free_slots: Vec::new(),
        slots: 0,
        constants: BTreeMap::new(),
        pointers: [(None, 0); POINTERS.len()],
        distance: None,
        loops: Vec::new(),
        now: 0,
    };
    for (k, item) in body.items.iter().enumerate() {
        writer.now = k;
        writer.item(*item)?;
    }
    let mut constants: Vec<(u64, usize)> = writer.constants.into_iter().collect();
    constants.sort_by_key(|(_, at)| *at);
    let copies = width.copies();
    Some(Written {
        bytes: writer.assembler.finish(),
        scratch: first_slot + writer.slots,
        numbers: constants.into_iter().flat_map(|(bits, _)| vec![f64::from_bits(bits); copies]).collect(),
    })
}

impl Writer<'_> {
    fn item(&mut self, item: Item) -> Option<()> {
        match item {
            Item::Value(id, step) if !self.known[id as usize].uses.is_empty() => self.value(id, step),
            Item::Value(..) => Some(()),
            Item::Store(entry, id) => {
                let from = self.in_register(id, &[])?;
                let address = self.entry(entry)?;
                self.assembler.vector(code::STORE, from, None, Last::Memory(address));
                self.used([id]);
                self.forget_slots([id]);
                Some(())
            }
            Item::ExitIfSigns(id) => {
                let x = self.in_register(id, &[])?;
                self.assembler.exit_if_signs(x);
                self.distance = None;
                self.used([id]);
                self.forget_slots([id]);
                Some(())
            }
            Item::Open { turns, backward } => {
                let first = if backward { turns as u64 - 1 } else { 0 };
                self.assembler.set(TURN, first);
                self.begin()?;
                self.loops.push(self.assembler.here());
                Some(())
            }
            Item::Close { turns, backward } => {
                self.begin()?;
                let label = self.loops.pop()?;
                self.assembler.add(TURN, if backward { -1 } else { 1 });
                let end = if backward { -1 } else { i32::try_from(turns).ok()? };
                self.assembler.back_unless(TURN, end, label);
                Some(())
            }
        }
    }

    /// A loop begins or ends: nothing is known of the registers, and no value may be needed later.
    fn begin(&mut self) -> Option<()> {
        for id in self.held.iter().flatten() {
            let Known { uses, source, .. } = &self.known[*id as usize];
            let fixed = matches!(source, Some(Step::Constant(_)));
            if !uses.is_empty() && !fixed {
                return None;
            }
        }
        if self.free_slots.len() != self.slots {
            return None;
        }
        for id in std::mem::take(&mut self.held).into_iter().flatten() {
            self.known[id as usize].register = None;
        }
        self.held = vec![None; self.width.registers()];
        self.pointers = [(None, 0); POINTERS.len()];
        self.distance = None;
        Some(())
    }

    fn value(&mut self, id: Id, step: Step) -> Option<()> {
        match step {
            Step::Constant(_) | Step::Load(Entry { array: Array::Input(_) | Array::Table(_), .. }) => {
                // It is read where it is used.
                self.known[id as usize].source = Some(step);
                return Some(());
            }
            Step::Load(entry) => {
                let to = self.register(&[])?;
                let address = self.entry(entry)?;
                self.assembler.vector(code::LOAD, to, None, Last::Memory(address));
                self.hold(id, to);
                return Some(());
            }
            Step::Binary(operation, a, b) => self.binary(id, operation, a, b)?,
            Step::Fused { a, b, c, minus_product, minus_addend } => {
                self.fused(id, [a, b, c], [minus_product, minus_addend])?;
            }
            Step::Sqrt(a) => {
                let last = self.last(a, &[])?;
                let to = self.result([a])?;
                self.assembler.vector(code::SQRT, to, None, last);
                self.hold(id, to);
            }
            Step::Shift(a, by) => {
                let from = self.in_register(a, &[])?;
                let to = self.result([a])?;
                self.assembler.shift_left(to, from, by);
                self.hold(id, to);
            }
            Step::Select { mask, yes, no } => {
                let [mask_, yes_, no_] = self.all_in_registers([mask, yes, no])?;
                let to = self.result([mask, yes, no])?;
                self.assembler.select(to, mask_, yes_, no_);
                self.hold(id, to);
            }
            Step::ZeroBelow { value, floor, x } => {
                let [value_, floor_, x_] = self.all_in_registers([value, floor, x])?;
                let to = self.register(&[value_, floor_, x_])?;
                self.assembler.zero_below(to, value_, floor_, x_);
                self.used([value, floor, x]);
                self.hold(id, to);
            }
        }
        self.forget_slots(step.operands());
        Some(())
    }

    fn binary(&mut self, id: Id, operation: Binary, a: Id, b: Id) -> Option<()> {
        use Binary::*;
        let commutes = !matches!(operation, Sub | Div | SubIntegers);
        let inside = |id: Id| self.known[id as usize].register.is_some();
        let (a, b) = if commutes && inside(b) && !inside(a) { (b, a) } else { (a, b) };
        let keep: Vec<Register> = self.known[b as usize].register.into_iter().collect();
        let first = self.in_register(a, &keep)?;
        let last = self.last(b, &[first])?;
        let to = self.result([a, b])?;
        let code = match operation {
            Add => code::ADD,
            Sub => code::SUB,
            Mul => code::MUL,
            Div => code::DIV,
            And => code::AND,
            Or => code::OR,
            Xor => code::XOR,
            AddIntegers => code::ADD_INTEGERS,
            SubIntegers => code::SUB_INTEGERS,
        };
        self.assembler.vector(code, to, Some(first), last);
        self.hold(id, to);
        Some(())
    }

    /// One of the operands is replaced by the result: one that is not used again, or a copy.
    fn fused(&mut self, id: Id, operands: [Id; 3], [minus_product, minus_addend]: [bool; 2]) -> Option<()> {
        let [a, b, c] = operands;
        let outside = |id: Id| self.known[id as usize].register.is_none();
        let alone = |id: Id| operands.iter().filter(|other| **other == id).count() == 1;
        // The one that stays in memory: not one that is used again soon.
        let far = |id: &Id| outside(*id) && alone(*id) && !self.soon(*id) && self.readable(*id);
        let memory = operands.iter().copied().filter(far).max_by_key(|id| self.next_use_after_now(*id));
        let mut registers = [0; 3];
        let mut keep: Vec<Register> = operands.iter().filter_map(|id| self.known[*id as usize].register).collect();
        for (register, operand) in registers.iter_mut().zip(operands) {
            if memory != Some(operand) {
                *register = self.in_register(operand, &keep)?;
                keep.push(*register);
            }
        }
        let address = match memory {
            Some(id) => Some(self.memory(id)?),
            None => None,
        };
        // Factors and addend in the order in which they are best replaced.
        let dies = |id: Id| self.next_use_after_now(id).is_none();
        let candidates = [2, 0, 1].into_iter().filter(|k| memory != Some(operands[*k]));
        let replaced = candidates.clone().find(|k| dies(operands[*k])).or_else(|| candidates.clone().next_back())?;
        let mut first = registers[replaced];
        if !dies(operands[replaced]) {
            let to = self.register(&keep)?;
            self.assembler.vector(code::COPY, to, None, Last::Register(first));
            first = to;
        }
        let place = |k: usize| match address {
            Some(address) if memory == Some(operands[k]) => Last::Memory(address),
            _ => Last::Register(registers[k]),
        };
        let (order, second, last) = match replaced {
            2 if memory == Some(a) => (Order::Product231, registers[1], place(0)),
            2 => (Order::Product231, registers[0], place(1)),
            factor => {
                let other = 1 - factor;
                match memory {
                    Some(id) if id == operands[other] => (Order::Product132, registers[2], place(other)),
                    _ => (Order::Product213, registers[other], place(2)),
                }
            }
        };
        self.assembler.vector(fused(order, minus_product, minus_addend), first, Some(second), last);
        self.used([a, b, c]);
        self.hold(id, first);
        Some(())
    }
}
