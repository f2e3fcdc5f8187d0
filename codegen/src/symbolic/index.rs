//! Finds an operation among those of a graph. The table has the numbers of the operations only, so that it stays in the
//! cache of the processor where the operations would not.

use std::hash::BuildHasher;

use super::hash::Words;
use super::Op;

/// Number of places with which a table begins.
const FIRST: usize = 1024;

/// A place without an operation.
const FREE: u32 = u32::MAX;

/// Numbers of operations by their hashes; where places collide, the next free one is taken. A power of two of places, of
/// which at least half are free.
#[derive(Debug, Default)]
pub struct Index {
    places: Vec<u32>,
}

impl Index {
    /// The number of an operation: that of an equal one among `ops`, or that of the next, which the table has then.
    pub fn id(&mut self, ops: &[Op], op: &Op) -> u32 {
        if 2 * ops.len() >= self.places.len() {
            self.places = vec![FREE; (4 * ops.len()).next_power_of_two().max(FIRST)];
            for (id, op) in ops.iter().enumerate() {
                let place = self.place(ops, op);
                self.places[place] = id as u32;
            }
        }
        let place = self.place(ops, op);
        if self.places[place] == FREE {
            self.places[place] = ops.len() as u32;
        }
        self.places[place]
    }

    /// Where an operation is or belongs.
    fn place(&self, ops: &[Op], op: &Op) -> usize {
        let last = self.places.len() - 1;
        let mut place = Words::default().hash_one(op) as usize & last;
        while self.places[place] != FREE && ops[self.places[place] as usize] != *op {
            place = (place + 1) & last;
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_operations_have_one_number() {
        let (mut index, mut ops) = (Index::default(), Vec::new());
        for round in 0..2 {
            for k in 0..5000 {
                let op = if k % 2 == 0 { Op::Input(k) } else { Op::Sqrt(k) };
                assert_eq!(index.id(&ops, &op), k);
                if round == 0 {
                    ops.push(op);
                }
            }
        }
        assert!(index.places.len() >= 2 * ops.len());
    }
}
