//! What a single state computes in vectors: sines and cosines of several angles, and like branches.

use super::{Binary, Body, Call, Entry, Id, Item, Signed, Step};
use crate::jit::instructions::BLOCK;
use crate::jit::vectors::Lanes;

impl Body {
    /// Room for so many numbers.
    fn room(&mut self, numbers: usize) -> usize {
        let at = self.carried.next_multiple_of(numbers);
        self.carried = at + numbers;
        at
    }

    /// A vector of single numbers; one stands for all.
    pub(super) fn packed(&mut self, numbers: &[Id], lanes: Lanes) -> Id {
        if lanes > Lanes::One && numbers.iter().all(|x| *x == numbers[0]) {
            return match self.constant_of(numbers[0]) {
                Some(bits) => self.value_of(lanes, Step::Constant(bits)),
                None => self.value_of(lanes, Step::Broadcast(numbers[0])),
            };
        }
        self.joined(numbers, lanes)
    }

    /// The numbers of several vectors of equal lengths in one.
    fn joined(&mut self, parts: &[Id], lanes: Lanes) -> Id {
        if parts.len() == 1 {
            return parts[0];
        }
        let half = Lanes::for_numbers(lanes.count() / 2, Lanes::Four);
        let (a, b) = parts.split_at(parts.len() / 2);
        let single = self.lanes(parts[0]) == Lanes::One;
        let [a, b] = [a, b].map(|parts| if single { self.packed(parts, half) } else { self.joined(parts, half) });
        self.value_of(lanes, Step::Binary(Binary::Join, a, b))
    }

    /// The bits of a constant.
    fn constant_of(&self, id: Id) -> Option<u64> {
        self.bits.get(&id).copied()
    }

    /// A number of a vector, which is stored when it is first asked for a part: its numbers are read where they are used.
    pub(super) fn part_of(&mut self, vector: Id, k: usize) -> Id {
        let at = match self.stored.get(&vector) {
            Some(at) => *at,
            None => {
                let at = self.room(self.lanes(vector).count());
                self.items.push(Item::Store(Body::carried(at), vector));
                self.stored.insert(vector, at);
                at
            }
        };
        self.value_of(Lanes::One, Step::Again(Body::carried(at + k)))
    }

    /// Sines and cosines of angles of one state, single numbers or vectors: as many together as the longest vector has room for.
    pub(super) fn sines_of_one(&mut self, angles: &[Signed]) -> Vec<[Signed; 2]> {
        let each = self.now;
        let most = if self.width.wide { Lanes::Eight } else { Lanes::Four };
        let mut pairs = Vec::new();
        for angles in angles.chunks(most.count() / each.count()) {
            let lanes = Lanes::for_numbers(angles.len() * each.count(), most);
            let mut ids: Vec<Id> = angles.iter().map(|angle| angle.id).collect();
            // The last ones fill the vector.
            (ids.len()..lanes.count() / each.count()).for_each(|k| ids.push(ids[if k > 1 { k - 2 } else { 0 }]));
            let vector = if each == Lanes::One { self.packed(&ids, lanes) } else { self.joined(&ids, lanes) };
            let at = self.vector_sines(vector);
            pairs.extend((0..angles.len()).map(|k| at.map(|at| self.again(each, at + k * each.count()))));
        }
        pairs
    }

    fn again(&mut self, lanes: Lanes, at: usize) -> Signed {
        Signed { id: self.value_of(lanes, Step::Again(Body::carried(at))), minus: false }
    }

    /// Sines and cosines of a vector. Returns where they are.
    fn vector_sines(&mut self, angle: Id) -> [usize; 2] {
        let lanes = self.lanes(angle);
        let room = lanes.count().max(BLOCK);
        let places = [0; 3].map(|_| self.room(room));
        let entries: [Entry; 3] = places.map(Body::carried);
        let now = std::mem::replace(&mut self.now, lanes);
        self.items.push(Item::Store(entries[0], angle));
        let angle = Signed { id: angle, minus: false };
        let beyond = self.beyond(&[angle]);
        let pair = self.pair(angle);
        for (part, to) in pair.into_iter().zip(&entries[1..]) {
            let part = self.plain(part);
            self.items.push(Item::Store(*to, part));
        }
        self.items.extend(beyond.map(|beyond| Item::CallIfSigns(beyond, Call { n: room, arrays: entries })));
        self.now = now;
        [places[1], places[2]]
    }
}
