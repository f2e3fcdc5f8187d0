//! A hash function for operations: a product for each word. Operations are looked up for every operation that a sweep
//! makes, and nobody chooses them to collide. And one that is the same on every machine, for names.

use std::hash::{BuildHasherDefault, Hasher};

/// A number that differs where bytes do, by the method of Fowler, Noll and Vo: the same on every machine.
pub fn fingerprint(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Builder of [`WordHasher`].
pub type Words = BuildHasherDefault<WordHasher>;

/// Hash of the words that it has been given.
#[derive(Clone, Copy, Debug, Default)]
pub struct WordHasher(u64);

impl WordHasher {
    fn word(&mut self, x: u64) {
        // An odd number without pattern: the fractional digits of the golden ratio.
        self.0 = (self.0.rotate_left(5) ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

impl Hasher for WordHasher {
    fn finish(&self) -> u64 {
        // The upper bits of a product depend on all bits of its factors, and tables use the lower ones.
        self.0.rotate_left(26)
    }
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.word(u64::from(*byte)));
    }
    fn write_u8(&mut self, x: u8) {
        self.word(u64::from(x));
    }
    fn write_u32(&mut self, x: u32) {
        self.word(u64::from(x));
    }
    fn write_u64(&mut self, x: u64) {
        self.word(x);
    }
    fn write_usize(&mut self, x: usize) {
        self.word(x as u64);
    }
    fn write_isize(&mut self, x: isize) {
        self.word(x as u64);
    }
}
