//! Where values are: in registers, in memory, or to be read again.

use super::{Known, Pointer, Writer, DISTANCES, POINTERS, TURN};
use crate::jit::vectors::body::{Entry, Id, Step};
use crate::jit::vectors::encode::{self as code, Address, General, Last, Register};
use crate::jit::vectors::Lanes;
use crate::lower::Array;

/// A value that is used again within so many instructions is read into a register.
const SOON: usize = 12;

impl Writer<'_> {
    /// The next item after this one that uses a value.
    pub(super) fn next_use_after_now(&self, id: Id) -> Option<usize> {
        self.known[id as usize].uses.iter().rev().copied().find(|k| *k > self.now)
    }

    /// Whether a value is used again so soon that it is read into a register. Constants are not: instructions read them at
    /// no cost.
    pub(super) fn soon(&self, id: Id) -> bool {
        let constant = matches!(self.known[id as usize].source, Some(Step::Constant(_)));
        !constant && self.next_use_after_now(id).is_some_and(|k| k <= self.now + SOON)
    }

    /// How many numbers a value has.
    pub(super) fn lanes(&self, id: Id) -> Lanes {
        self.known[id as usize].lanes
    }

    /// Whether an instruction can read the value from memory.
    pub(super) fn readable(&self, id: Id) -> bool {
        let table = matches!(self.known[id as usize].source, Some(Step::Load(Entry { array: Array::Table(_), .. })));
        self.width.wide || self.width.states == Lanes::One || !table
    }

    /// The value as the last operand of an instruction.
    pub(super) fn last(&mut self, id: Id, keep: &[Register]) -> Option<Last> {
        if let Some(register) = self.known[id as usize].register {
            return Some(Last::Register(register));
        }
        match self.soon(id) || !self.readable(id) {
            true => self.in_register(id, keep).map(Last::Register),
            false => self.memory(id).map(Last::Memory),
        }
    }

    pub(super) fn all_in_registers(&mut self, ids: [Id; 3]) -> Option<[Register; 3]> {
        let mut keep: Vec<Register> = ids.iter().filter_map(|id| self.known[*id as usize].register).collect();
        let mut registers = [0; 3];
        for (register, id) in registers.iter_mut().zip(ids) {
            *register = self.in_register(id, &keep)?;
            keep.push(*register);
        }
        Some(registers)
    }

    /// The register of a value, which is read if it has none.
    pub(super) fn in_register(&mut self, id: Id, keep: &[Register]) -> Option<Register> {
        if let Some(register) = self.known[id as usize].register {
            return Some(register);
        }
        let address = self.memory(id)?;
        let to = self.register(keep)?;
        let lanes = self.lanes(id);
        match address.broadcast {
            true => self.assembler.broadcast(lanes, to, Last::Memory(address)),
            false => self.assembler.vector(lanes, code::LOAD, to, None, Last::Memory(address)),
        }
        self.hold(id, to);
        Some(to)
    }

    pub(super) fn hold(&mut self, id: Id, register: Register) {
        self.held[register as usize] = Some(id);
        self.known[id as usize].register = Some(register);
    }

    /// Operands are used by the current item; those that are not used again leave their registers, of which one is chosen
    /// for the result.
    pub(super) fn result<const N: usize>(&mut self, operands: [Id; N]) -> Option<Register> {
        self.used(operands);
        self.register(&[])
    }

    pub(super) fn used<const N: usize>(&mut self, operands: [Id; N]) {
        for id in operands {
            let known = &mut self.known[id as usize];
            while known.uses.last().is_some_and(|k| *k <= self.now) {
                known.uses.pop();
            }
            if known.uses.is_empty() {
                if let Some(register) = known.register.take() {
                    self.held[register as usize] = None;
                }
            }
        }
    }

    /// Places of operands that are not used again become free.
    pub(super) fn forget_slots(&mut self, operands: impl IntoIterator<Item = Id>) {
        for id in operands {
            let known = &mut self.known[id as usize];
            if known.uses.is_empty() {
                if let Some(slot) = known.slot.take() {
                    self.free_slots[known.lanes.count().ilog2() as usize].push(slot);
                    self.taken -= 1;
                }
            }
        }
    }

    /// A register that is free, or becomes free: not one of `keep`.
    pub(super) fn register(&mut self, keep: &[Register]) -> Option<Register> {
        if let Some(free) = self.held.iter().position(Option::is_none) {
            return Some(free as Register);
        }
        let distance = |register: &usize| {
            let id = self.held[*register]?;
            let Known { uses, slot, source, .. } = &self.known[id as usize];
            // A value that need not be stored may be needed twice as soon.
            let there = usize::from(slot.is_some() || source.is_some());
            Some((uses.last()? - self.now) << there)
        };
        let candidates = (0..self.held.len()).filter(|register| !keep.contains(&(*register as Register)));
        let farthest = candidates.max_by_key(distance)?;
        self.leave(farthest as Register)?;
        Some(farthest as Register)
    }

    /// The value of a register leaves it, and is stored if it can be had nowhere else.
    pub(super) fn leave(&mut self, register: Register) -> Option<()> {
        let Some(id) = self.held[register as usize].take() else { return Some(()) };
        let Known { slot, source, lanes, .. } = self.known[id as usize];
        if slot.is_none() && source.is_none() {
            let slot = self.free_slots[lanes.count().ilog2() as usize].pop().unwrap_or_else(|| {
                let entries = if self.width.states == Lanes::One { lanes.count() } else { 1 };
                let at = self.slots.next_multiple_of(entries);
                self.slots = at + entries;
                at
            });
            self.taken += 1;
            let address = self.slot(slot)?;
            self.assembler.vector(lanes, code::STORE, register, None, Last::Memory(address));
            self.known[id as usize].slot = Some(slot);
        }
        self.known[id as usize].register = None;
        Some(())
    }

    /// Where a value is that has no register.
    pub(super) fn memory(&mut self, id: Id) -> Option<Address> {
        match (self.known[id as usize].slot, self.known[id as usize].source) {
            (Some(slot), _) => self.slot(slot),
            (None, Some(Step::Constant(bits))) => {
                let lanes = self.lanes(id);
                let copies = self.width.copies(lanes);
                let numbers = &mut self.numbers;
                let at = *self.constants.entry((bits, copies)).or_insert_with(|| {
                    let at = numbers.next_multiple_of(copies);
                    *numbers = at + copies;
                    at
                });
                let base = self.pointer(Pointer::Numbers)?;
                let offset = offset(self.arrays.constants + at, 8)?;
                Some(Address { base, index: None, offset, broadcast: copies < lanes.count() })
            }
            (None, Some(Step::Load(entry) | Step::Again(entry))) => self.entry(entry),
            _ => None,
        }
    }

    pub(super) fn slot(&self, slot: usize) -> Option<Address> {
        let offset = offset(self.first_slot + slot, self.width.states.bytes())?;
        Some(Address { base: General::Rdx, index: None, offset, broadcast: false })
    }

    pub(super) fn entry(&mut self, Entry { array, at, stride }: Entry) -> Option<Address> {
        let one_for_all = matches!(array, Array::Table(_));
        let size = if one_for_all { 8 } else { self.width.states.bytes() };
        let broadcast = one_for_all && self.width.states != Lanes::One;
        let memory = self.arrays.memory;
        let (base, first) = match array {
            Array::Input(_) | Array::Result(_) => (self.pointer(Pointer::Array(array))?, 0),
            Array::Table(run) => (self.pointer(Pointer::Numbers)?, *self.arrays.tables.get(run)?),
            Array::Spilled => (General::Rdx, self.own),
            array => (General::Rdx, memory.start(array)),
        };
        let index = match stride {
            0 => None,
            _ => Some(self.distance(offset(stride, size)?)),
        };
        Some(Address { base, index, offset: offset(first + at, size)?, broadcast })
    }

    /// A register with the distance of entries that move by so many bytes from turn to turn.
    fn distance(&mut self, step: i32) -> General {
        let known = self.distances.iter().position(|(of, _)| *of == Some(step));
        let at = known.unwrap_or_else(|| {
            let at = usize::from(self.distances[1].1 < self.distances[0].1);
            self.assembler.multiply(DISTANCES[at], TURN, step);
            at
        });
        self.distances[at] = (Some(step), self.now + 1);
        DISTANCES[at]
    }

    /// A register with the address of an array.
    pub(super) fn pointer(&mut self, of: Pointer) -> Option<General> {
        let known = self.pointers.iter().position(|(array, _)| *array == Some(of));
        let at = match known {
            Some(at) => at,
            None => {
                let at = (0..self.most_pointers).min_by_key(|at| self.pointers[*at].1)?;
                let to = POINTERS[at];
                let (table, place) = match of {
                    Pointer::Array(Array::Result(k)) => (General::Rsi, k),
                    Pointer::Array(Array::Input(k)) => (General::Rdi, self.arrays.inputs[k]),
                    Pointer::Numbers => (General::Rdi, self.arrays.numbers),
                    Pointer::Array(_) => return None,
                };
                self.assembler.read_address(to, table, offset(place, 8)?);
                at
            }
        };
        self.pointers[at] = (Some(of), self.now + 1);
        let numbers = self.pointers.iter().position(|(of, _)| *of == Some(Pointer::Numbers));
        self.assembler.numbers = numbers.map(|at| POINTERS[at]);
        Some(POINTERS[at])
    }
}

/// A distance in bytes.
fn offset(entries: usize, size: i32) -> Option<i32> {
    i32::try_from(entries).ok()?.checked_mul(size)
}
