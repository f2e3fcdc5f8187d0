//! Which values a straight-line body keeps in registers.
//!
//! Long bodies have many more live values than a processor has registers. A register allocator that sees one value
//! after the other stores and loads them by instructions of their own. Here the value whose next use is the farthest
//! leaves the registers (Belady, 1966): it is stored once, where it was computed, and loaded where it is used, as part
//! of the instruction that uses it.

use std::collections::{BTreeMap, BTreeSet};

use super::memory::{is_together, Home};
use super::Spills;
use crate::code::Code;
use crate::rolled::Block;
use crate::symbolic::angles::{nodes, Angles};
use crate::symbolic::{Op, Program};

impl Spills {
    /// Those of each block of some code, for a target with vectors of `width` numbers; loops over links are short and
    /// keep their values.
    pub fn of(code: &Code, registers: usize, width: usize) -> Vec<Spills> {
        let new = |program: &Program| Spills::new(program, &Angles::new(program), registers);
        let program = match code {
            Code::Straight(program) => return vec![new(program)],
            Code::Rolled(program) => program,
        };
        if !is_together(program, width) {
            return program.blocks.iter().map(|_| Spills { decided: true, ..Spills::NONE }).collect();
        }
        let mut first = 0;
        let of_block = |block: &Block| {
            let width = if block.repeat.is_some() { width } else { 1 };
            let spills = Spills { first: usize::next_multiple_of(first, width), width, ..new(&block.program) };
            first = spills.entry(spills.places);
            spills
        };
        program.blocks.iter().map(of_block).collect()
    }

    /// Decides for a body that computes `angles.before`, then sines and cosines, then the rest, with so many registers.
    fn new(program: &Program, angles: &Angles, registers: usize) -> Spills {
        let early: BTreeSet<u32> = angles.early.values().flatten().flatten().copied().collect();
        let (before, after): (Vec<_>, Vec<_>) = program
            .steps
            .iter()
            .filter(|(id, _, _)| !early.contains(id))
            .map(|(id, op, _)| (*id, op))
            .partition(|(id, _)| angles.before.contains(id));
        let order: Vec<(u32, &Op)> = before.into_iter().chain(after).collect();
        // Uses of each value, the last one first.
        let mut uses: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (k, (_, op)) in order.iter().enumerate().rev() {
            for id in nodes(op) {
                uses.entry(id).or_default().push(k);
            }
        }
        let mut spills = Spills { decided: true, ..Spills::NONE };
        let mut memory: BTreeSet<u32> = early.clone();
        // Values in registers.
        let mut held: BTreeSet<u32> = BTreeSet::new();
        for (k, (id, op)) in order.iter().enumerate() {
            let operands: BTreeSet<u32> = nodes(op).collect();
            for operand in &operands {
                if held.insert(*operand) {
                    spills.loaded.entry(*id).or_default().push(*operand);
                }
            }
            for operand in &operands {
                let uses = uses.get_mut(operand).expect("operands are used");
                while uses.last().is_some_and(|use_| *use_ <= k) {
                    uses.pop();
                }
            }
            held.insert(*id);
            held.retain(|value| uses.get(value).is_some_and(|uses| !uses.is_empty()));
            while held.len() > registers {
                let next = |value: &&u32| uses[*value].last().copied();
                let farthest = *held.iter().max_by_key(next).expect("more than none");
                held.remove(&farthest);
                memory.insert(farthest);
            }
            let gone = operands.iter().filter(|operand| !held.contains(operand));
            spills.last.extend(gone.map(|operand| (*id, *operand)));
        }
        spills.assign(&order, &memory);
        spills
    }

    /// Gives places to the values in memory; one that is not used any more leaves its place to another. Inputs have
    /// places of their own.
    fn assign(&mut self, order: &[(u32, &Op)], memory: &BTreeSet<u32>) {
        let mut last: BTreeMap<u32, usize> = BTreeMap::new();
        for (k, (id, _)) in order.iter().enumerate() {
            last.extend(self.loaded.get(id).into_iter().flatten().map(|value| (*value, k)));
        }
        let mut ends: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for (value, k) in &last {
            ends.entry(*k).or_default().push(*value);
        }
        let mut free: Vec<usize> = Vec::new();
        // Sines and cosines of early angles are in memory from the start.
        let computed: BTreeSet<u32> = order.iter().map(|(id, _)| *id).collect();
        for value in last.keys().filter(|value| !computed.contains(value)) {
            self.give(*value, &mut free);
        }
        for (k, (id, op)) in order.iter().enumerate() {
            for value in ends.get(&k).into_iter().flatten() {
                if let Some(Home::Stored(place)) = self.homes.get(value) {
                    free.push(*place);
                }
            }
            match op {
                _ if !memory.contains(id) => {}
                Op::Input(k) => {
                    self.homes.insert(*id, Home::Input(*k as usize));
                }
                _ => self.give(*id, &mut free),
            }
        }
    }

    fn give(&mut self, value: u32, free: &mut Vec<usize>) {
        let place = free.pop().unwrap_or(self.places);
        self.places = self.places.max(place + 1);
        self.homes.insert(value, Home::Stored(place));
    }
}
