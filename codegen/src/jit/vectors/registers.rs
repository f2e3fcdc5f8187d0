//! Registers for the values of a body, and its machine code.
//!
//! The value whose next use is the farthest leaves the registers (Belady, 1966). Constants, inputs and tables are read
//! again from where they are; other values are stored once. The last operand of an instruction may be in memory.

mod calls;
mod places;

use std::collections::BTreeMap;

use super::body::{Binary, Body, Call, Entry, Id, Item, Step};
use super::encode::{self as code, fused, plan, Access, Assembler, General, Jump, Label, Last, Order, Register};
use super::{Lanes, Width};
use crate::lower::{Array, Memory};

/// Registers for addresses of arrays. In bodies with loops, the last one is a distance.
const POINTERS: [General; 4] = [General::Rax, General::Rcx, General::R8, General::R9];

/// Number of a loop's turn, and the distances of its entries.
const TURN: General = General::R11;
const DISTANCES: [General; 2] = [General::R10, General::R9];

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
    /// Address of the function for sines and cosines.
    pub sines: u64,
}

/// Machine code of a body.
pub struct Written {
    pub bytes: Vec<u8>,
    /// Entries of the working memory, each with a number of every state.
    pub scratch: usize,
    /// Numbers that the code reads: constants, as vectors where it reads whole ones.
    pub numbers: Vec<f64>,
}

/// What is known of a value.
#[derive(Clone, Debug)]
struct Known {
    lanes: Lanes,
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
    /// First entry that the body has for itself.
    own: usize,
    /// First entry for values that left the registers.
    first_slot: usize,
    known: Vec<Known>,
    /// The value in each register.
    held: Vec<Option<Id>>,
    /// Places that are free, by the logarithms of their lengths.
    free_slots: [Vec<usize>; 4],
    slots: usize,
    /// Number of places that are taken.
    taken: usize,
    /// Places of constants, by their bits and the number of copies.
    constants: BTreeMap<(u64, usize), usize>,
    /// Numbers in the table of constants.
    numbers: usize,
    /// Calls at the end of the code.
    calls: Vec<FarCall>,
    /// Arrays whose addresses are in [`POINTERS`], and when they were used last.
    pointers: [(Option<Pointer>, usize); POINTERS.len()],
    /// How many of these there are.
    most_pointers: usize,
    /// By how many bytes the entries move that [`DISTANCES`] belong to, and when they were used last.
    distances: [(Option<i32>, usize); DISTANCES.len()],
    /// Beginnings of the open loops.
    loops: Vec<Label>,
    /// The item that is being written.
    now: usize,
}

/// A call that is needed rarely: the jump to it, the place after it, and the registers that hold values.
struct FarCall {
    from: Jump,
    back: Label,
    held: Vec<(Register, Lanes)>,
    call: Call,
}

/// Writes a body. `None` if it is too long for the instructions' distances, or a loop reads a value from outside.
pub fn write(body: &Body, width: Width, arrays: &Arrays) -> Option<Written> {
    let (written, accesses) = written_with(body, width, arrays, Assembler::noting(width.wide))?;
    // Registers that move would have to be where they were when a loop begins again.
    match if has_loops(body) { None } else { plan(&accesses) } {
        Some(plan) => {
            written_with(body, width, arrays, Assembler::planned(width.wide, plan)).map(|(written, _)| written)
        }
        None => Some(written),
    }
}

fn has_loops(body: &Body) -> bool {
    body.items.iter().any(|item| matches!(item, Item::Open { .. }))
}

/// The same with an assembler; and the accesses to the working memory that it has noted.
fn written_with(body: &Body, width: Width, arrays: &Arrays, assembler: Assembler) -> Option<(Written, Vec<Access>)> {
    let new = |lanes: &Lanes| Known { lanes: *lanes, register: None, slot: None, source: None, uses: Vec::new() };
    let mut known: Vec<Known> = body.lanes.iter().map(new).collect();
    for (k, item) in body.items.iter().enumerate().rev() {
        match item {
            Item::Value(id, _) if known[*id as usize].uses.is_empty() => {}
            Item::Value(_, step) => step.operands().for_each(|id| known[id as usize].uses.push(k)),
            Item::Store(_, id) | Item::ExitIfSigns(id) | Item::CallIfSigns(id, _) => known[*id as usize].uses.push(k),
            Item::Open { .. } | Item::Close { .. } | Item::Call(_) => {}
        }
    }
    // Vectors of one state begin at multiples of their lengths.
    let aligned = |at: usize| if width.states == Lanes::One { at.next_multiple_of(Lanes::Eight.count()) } else { at };
    let own = aligned(arrays.memory.len());
    let first_slot = aligned(own + body.carried);
    let mut writer = Writer {
        assembler,
        width,
        arrays,
        own,
        first_slot,
        known,
        held: vec![None; width.registers()],
        free_slots: Default::default(),
        slots: 0,
        taken: 0,
        constants: BTreeMap::new(),
        numbers: 0,
        calls: Vec::new(),
        pointers: Default::default(),
        most_pointers: POINTERS.len() - usize::from(has_loops(body)),
        distances: Default::default(),
        loops: Vec::new(),
        now: 0,
    };
    for (k, item) in body.items.iter().enumerate() {
        writer.now = k;
        writer.item(*item)?;
    }
    writer.assembler.return_0();
    let accesses = writer.assembler.end_windows();
    writer.write_calls()?;
    let mut numbers = vec![0.0; writer.numbers];
    for ((bits, copies), at) in writer.constants {
        numbers[at..at + copies].fill(f64::from_bits(bits));
    }
    Some((Written { bytes: writer.assembler.finish(), scratch: first_slot + writer.slots, numbers }, accesses))
}

impl Writer<'_> {
    fn item(&mut self, item: Item) -> Option<()> {
        match item {
            Item::Value(id, step) if !self.known[id as usize].uses.is_empty() => self.value(id, step),
            Item::Value(..) => Some(()),
            Item::Store(entry, id) => {
                let from = self.in_register(id, &[])?;
                let address = self.entry(entry)?;
                self.assembler.vector(self.lanes(id), code::STORE, from, None, Last::Memory(address));
                self.used([id]);
                self.forget_slots([id]);
                Some(())
            }
            Item::ExitIfSigns(id) => {
                let x = self.in_register(id, &[])?;
                self.assembler.exit_if_signs(self.lanes(id), x);
                self.distances = Default::default();
                self.used([id]);
                self.forget_slots([id]);
                Some(())
            }
            Item::CallIfSigns(id, call) => self.call_if_signs(id, call),
            Item::Call(call) => self.call(call),
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
        if self.taken > 0 {
            return None;
        }
        self.forget_registers();
        self.pointers = Default::default();
        self.distances = Default::default();
        Some(())
    }

    fn value(&mut self, id: Id, step: Step) -> Option<()> {
        let lanes = self.lanes(id);
        match step {
            Step::Constant(_) | Step::Again(_) | Step::Load(Entry { array: Array::Input(_) | Array::Table(_), .. }) => {
                // It is read where it is used.
                self.known[id as usize].source = Some(step);
                return Some(());
            }
            Step::Load(entry) => {
                let to = self.register(&[])?;
                let address = self.entry(entry)?;
                self.assembler.vector(lanes, code::LOAD, to, None, Last::Memory(address));
                self.hold(id, to);
                return Some(());
            }
            Step::Binary(operation, a, b) => self.binary(id, operation, a, b)?,
            Step::Fused { a, b, c, minus_product, minus_addend } => {
                self.fused(id, [a, b, c], [minus_product, minus_addend])?;
            }
            Step::Sqrt(a) => {
                // The root of a single number leaves the rest of its register as it is in another one.
                let single = lanes == Lanes::One;
                let last = if single { Last::Register(self.in_register(a, &[])?) } else { self.last(a, &[])? };
                let to = self.result([a])?;
                let rest = if let (Last::Register(from), true) = (last, single) { Some(from) } else { None };
                self.assembler.vector(lanes, code::SQRT, to, rest, last);
                self.hold(id, to);
            }
            Step::Broadcast(a) => {
                let last = self.last(a, &[])?;
                let to = self.result([a])?;
                self.assembler.broadcast(lanes, to, last);
                self.hold(id, to);
            }
            Step::Shift(a, by) => {
                let from = self.in_register(a, &[])?;
                let to = self.result([a])?;
                self.assembler.shift_left(lanes, to, from, by);
                self.hold(id, to);
            }
            Step::Select { mask, yes, no } => {
                let [mask_, yes_, no_] = self.all_in_registers([mask, yes, no])?;
                let to = self.result([mask, yes, no])?;
                self.assembler.select(lanes, to, mask_, yes_, no_);
                self.hold(id, to);
            }
            Step::ZeroBelow { value, floor, x } => {
                let [value_, floor_, x_] = self.all_in_registers([value, floor, x])?;
                let to = self.register(&[value_, floor_, x_])?;
                self.assembler.zero_below(lanes, to, [value_, floor_, x_]);
                self.used([value, floor, x]);
                self.hold(id, to);
            }
        }
        self.forget_slots(step.operands());
        Some(())
    }

    fn binary(&mut self, id: Id, operation: Binary, a: Id, b: Id) -> Option<()> {
        use Binary::{Div, Join, Sub, SubIntegers};
        let commutes = !matches!(operation, Sub | Div | SubIntegers | Join);
        let inside = |id: Id| self.known[id as usize].register.is_some();
        let (a, b) = if commutes && inside(b) && !inside(a) { (b, a) } else { (a, b) };
        let keep: Vec<Register> = self.known[b as usize].register.into_iter().collect();
        let first = self.in_register(a, &keep)?;
        let (lanes, code) = (self.lanes(id), code_of(operation));
        let whole = match code {
            // Only single numbers are joined from memory.
            None => self.lanes(b) > Lanes::One,
            // Others read 16 bytes, or one number for all lanes.
            Some(code) => lanes == Lanes::One && !code.reads_single() && !self.width.wide,
        };
        let mut last = match whole {
            true => Last::Register(self.in_register(b, &[first])?),
            false => self.last(b, &[first])?,
        };
        let to = self.result([a, b])?;
        match code {
            None => self.assembler.join(lanes, to, first, last),
            Some(code) => {
                if let (Last::Memory(address), true) = (&mut last, lanes == Lanes::One) {
                    address.broadcast |= !code.reads_single();
                }
                self.assembler.vector(lanes, code, to, Some(first), last);
            }
        }
        self.hold(id, to);
        Some(())
    }

    /// One of the operands is replaced by the result: one that is not used again, or a copy.
    fn fused(&mut self, id: Id, operands: [Id; 3], [minus_product, minus_addend]: [bool; 2]) -> Option<()> {
        let ([a, b, c], lanes) = (operands, self.lanes(id));
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
            self.assembler.vector(lanes, code::COPY, to, None, Last::Register(first));
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
        self.assembler.vector(lanes, fused(order, minus_product, minus_addend), first, Some(second), last);
        self.used([a, b, c]);
        self.hold(id, first);
        Some(())
    }
}

/// The instruction of an operation; `None` for joins.
fn code_of(operation: Binary) -> Option<code::Code> {
    Some(match operation {
        Binary::Add => code::ADD,
        Binary::Sub => code::SUB,
        Binary::Mul => code::MUL,
        Binary::Div => code::DIV,
        Binary::And => code::AND,
        Binary::Or => code::OR,
        Binary::Xor => code::XOR,
        Binary::AddIntegers => code::ADD_INTEGERS,
        Binary::SubIntegers => code::SUB_INTEGERS,
        Binary::Join => return None,
    })
}
