//! Calls of the runtime's function for sines and cosines.

use super::{code, Call, FarCall, General, Id, Last, Register, Writer};
use crate::jit::vectors::encode::Address;
use crate::jit::vectors::Lanes;

impl Writer<'_> {
    /// Distances of the arrays of a call from the beginning of the working memory, bytes.
    fn distances(&mut self, call: Call) -> Option<[i32; 3]> {
        let mut distances = [0; 3];
        for (to, entry) in distances.iter_mut().zip(call.arrays) {
            *to = self.entry(entry)?.offset;
        }
        Some(distances)
    }

    /// A call that is always needed: every value leaves its register.
    pub(super) fn call(&mut self, call: Call) -> Option<()> {
        for register in 0..self.held.len() {
            self.leave(register as Register)?;
        }
        let distances = self.distances(call)?;
        self.assembler.call_sines(self.arrays.sines, call.n as u64, distances);
        Some(())
    }

    /// One that is needed if a sign is set: it comes after the end of the code, and keeps all registers.
    pub(super) fn call_if_signs(&mut self, id: Id, call: Call) -> Option<()> {
        let x = self.in_register(id, &[])?;
        let from = self.assembler.jump_if_signs(self.lanes(id), x);
        self.distances = Default::default();
        self.used([id]);
        self.forget_slots([id]);
        let held = self.held.iter().enumerate().filter_map(|(register, id)| Some((register as Register, (*id)?)));
        let held = held.map(|(register, id)| (register, self.lanes(id))).collect();
        let back = self.assembler.here();
        self.calls.push(FarCall { from, back, held, call });
        Some(())
    }

    /// Writes the calls that are rarely needed.
    pub(super) fn write_calls(&mut self) -> Option<()> {
        let first = self.slots.next_multiple_of(Lanes::Eight.count());
        for FarCall { from, back, held, call } in std::mem::take(&mut self.calls) {
            self.assembler.land(from);
            let mut saved = Vec::new();
            for (k, (register, lanes)) in held.into_iter().enumerate() {
                let place = first + k * Lanes::Eight.count();
                self.slots = self.slots.max(place + Lanes::Eight.count());
                let address = Last::Memory(Address { base: General::Rdx, ..self.slot(place)? });
                self.assembler.vector(lanes, code::STORE, register, None, address);
                saved.push((register, lanes, address));
            }
            let distances = self.distances(call)?;
            self.assembler.call_sines(self.arrays.sines, call.n as u64, distances);
            for (register, lanes, address) in saved {
                self.assembler.vector(lanes, code::LOAD, register, None, address);
            }
            self.assembler.go(back);
        }
        Some(())
    }

    /// Nothing is known of the registers any more.
    pub(super) fn forget_registers(&mut self) {
        for id in std::mem::take(&mut self.held).into_iter().flatten() {
            self.known[id as usize].register = None;
        }
        self.held = vec![None; self.width.registers()];
    }
}
