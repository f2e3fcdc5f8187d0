//! The body of a function as a list of instructions over any number of values.

mod together;

use std::collections::BTreeMap;

use super::{Lanes, Width};
use crate::jit::instructions::BLOCK;
use crate::lower::{limit, main_path, Array, Instructions, Operation, Place};
use crate::options::Precision;

/// Number of a value, in the order in which values come.
pub type Id = u32;

/// An array of a loop's turn: entry of turn 0, and by how many entries it moves from turn to turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    pub array: Array,
    pub at: usize,
    pub stride: usize,
}

/// Instructions of two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    And,
    Or,
    Xor,
    /// Of integers.
    AddIntegers,
    /// Of integers.
    SubIntegers,
    /// The lanes of the first operand, then those of the second one.
    Join,
}

/// How a value is computed.
#[derive(Clone, Copy, Debug)]
pub enum Step {
    /// A constant by its bits.
    Constant(u64),
    Load(Entry),
    /// An entry that is not written again.
    Again(Entry),
    /// A single number in all lanes.
    Broadcast(Id),
    Binary(Binary, Id, Id),
    /// `±a · b ± c`
    Fused {
        a: Id,
        b: Id,
        c: Id,
        minus_product: bool,
        minus_addend: bool,
    },
    Sqrt(Id),
    /// Shifted to the left, as an integer.
    Shift(Id, u8),
    /// `yes` where the sign of the mask is set, otherwise `no`.
    Select {
        mask: Id,
        yes: Id,
        no: Id,
    },
    /// `x`, or 0 where `value <= floor`.
    ZeroBelow {
        value: Id,
        floor: Id,
        x: Id,
    },
}

impl Step {
    /// The values that are read.
    pub fn operands(&self) -> impl Iterator<Item = Id> {
        let operands = match *self {
            Step::Constant(_) | Step::Load(_) | Step::Again(_) => [None; 3],
            Step::Binary(_, a, b) => [Some(a), Some(b), None],
            Step::Fused { a, b, c, .. } => [Some(a), Some(b), Some(c)],
            Step::Sqrt(a) | Step::Shift(a, _) | Step::Broadcast(a) => [Some(a), None, None],
            Step::Select { mask, yes, no } => [Some(mask), Some(yes), Some(no)],
            Step::ZeroBelow { value, floor, x } => [Some(value), Some(floor), Some(x)],
        };
        operands.into_iter().flatten()
    }
}

/// A part of the body.
#[derive(Clone, Copy, Debug)]
pub enum Item {
    /// Computes the value of that number.
    Value(Id, Step),
    Store(Entry, Id),
    /// The function gives up if the sign of a lane is set.
    ExitIfSigns(Id),
    /// Sines and cosines are computed by the runtime, if the sign of a lane is set.
    CallIfSigns(Id, Call),
    /// The same always. No value keeps its register.
    Call(Call),
    /// A loop of so many turns begins. No value is read on its other side.
    Open {
        turns: usize,
        backward: bool,
    },
    /// It ends.
    Close {
        turns: usize,
        backward: bool,
    },
}

/// Arguments of the runtime's function for sines and cosines: angles, sines and cosines of so many, a multiple of
/// [`BLOCK`](crate::jit::instructions::BLOCK).
#[derive(Clone, Copy, Debug)]
pub struct Call {
    pub n: usize,
    pub arrays: [Entry; 3],
}

/// A value as the program has it: the negative of one that is computed costs nothing where it can be a part of what
/// reads it.
#[derive(Clone, Copy, Debug)]
pub struct Signed {
    id: Id,
    minus: bool,
}

/// A body that is being recorded.
pub struct Body {
    pub items: Vec<Item>,
    /// How many numbers each value has.
    pub lanes: Vec<Lanes>,
    /// Number of entries that the body has for itself in [`Array::Spilled`]: for values that loops carry from turn to turn,
    /// and for parts of vectors.
    pub carried: usize,
    fused: bool,
    width: Width,
    /// Numbers in a vector of like branches.
    branches: usize,
    /// How many numbers the next value has.
    now: Lanes,
    /// Where vectors are whose parts have been asked for.
    stored: BTreeMap<Id, usize>,
    /// Constants by their bits, each once for every number of lanes.
    constants: BTreeMap<(u64, Lanes), Id>,
    /// The bits of these.
    bits: BTreeMap<Id, u64>,
    /// Products of the sine and cosine that are being recorded, which have some in common.
    products: Option<BTreeMap<(Id, Id), Id>>,
}

/// When entries of an array are written next that move by the same from turn to turn.
#[derive(Default)]
struct Writes {
    /// Any of them.
    next: usize,
    /// Each of them, by its place in turn 0.
    of_entries: BTreeMap<usize, usize>,
}

/// A loop that is being recorded: first place of what it carries.
pub struct Loop {
    turns: usize,
    backward: bool,
    carried: usize,
}

impl Body {
    pub fn new(fused: bool, width: Width, branches: usize) -> Body {
        Body {
            items: Vec::new(),
            lanes: Vec::new(),
            carried: 0,
            fused,
            width,
            branches,
            now: width.states,
            stored: BTreeMap::new(),
            constants: BTreeMap::new(),
            bits: BTreeMap::new(),
            products: None,
        }
    }

    /// Numbers that blocks or turns have left in the working memory are read where they are used, if they are still there
    /// then: a block is given more of them than there are registers.
    pub fn read_in_place(&mut self) {
        let mut last_use = vec![0; self.lanes.len()];
        for (k, item) in self.items.iter().enumerate() {
            let mut uses = |id: Id| last_use[id as usize] = k;
            match item {
                Item::Value(_, step) => step.operands().for_each(&mut uses),
                Item::Store(_, id) | Item::ExitIfSigns(id) | Item::CallIfSigns(id, _) => uses(*id),
                Item::Call(_) | Item::Open { .. } | Item::Close { .. } => {}
            }
        }
        // When an entry is written next, by its array, by how far it moves from turn to turn, and its place in turn 0. In the
        // same turn, entries that move by the same are others if their places are; of those that move by others, nothing is
        // known.
        let mut written: BTreeMap<Array, BTreeMap<usize, Writes>> = BTreeMap::new();
        for (k, item) in self.items.iter_mut().enumerate().rev() {
            match item {
                Item::Store(entry, id) => {
                    let all = entry.at..entry.at + self.lanes[*id as usize].count();
                    let writes = written.entry(entry.array).or_default().entry(entry.stride).or_default();
                    writes.next = k;
                    writes.of_entries.extend(all.map(|at| (at, k)));
                }
                Item::Value(id, step) => {
                    let Step::Load(entry @ Entry { array: Array::Rows(_) | Array::Kept | Array::Spilled, at, stride }) =
                        *step
                    else {
                        continue;
                    };
                    let all = at..at + self.lanes[*id as usize].count();
                    let last = last_use[*id as usize];
                    let stays = |(moves, writes): (&usize, &Writes)| match *moves == stride {
                        true => all.clone().all(|at| writes.of_entries.get(&at).is_none_or(|k| *k > last)),
                        false => writes.next > last,
                    };
                    if written.get(&entry.array).is_none_or(|by_moves| by_moves.iter().all(stays)) {
                        *step = Step::Again(entry);
                    }
                }
                // No value is used on the other side.
                Item::Open { .. } | Item::Close { .. } => written.clear(),
                _ => {}
            }
        }
    }

    fn value(&mut self, step: Step) -> Id {
        let id = self.lanes.len() as Id;
        if let Step::Constant(bits) = step {
            let known = *self.constants.entry((bits, self.now)).or_insert(id);
            if known != id {
                return known;
            }
            self.bits.insert(id, bits);
        }
        self.items.push(Item::Value(id, step));
        self.lanes.push(self.now);
        id
    }

    /// The same with another number of lanes.
    fn value_of(&mut self, lanes: Lanes, step: Step) -> Id {
        let now = std::mem::replace(&mut self.now, lanes);
        let id = self.value(step);
        self.now = now;
        id
    }

    fn lanes(&self, id: Id) -> Lanes {
        self.lanes[id as usize]
    }

    fn constant_bits(&mut self, bits: u64) -> Id {
        self.value(Step::Constant(bits))
    }

    fn binary(&mut self, operation: Binary, a: Id, b: Id) -> Id {
        self.value(Step::Binary(operation, a, b))
    }

    /// The value itself.
    fn plain(&mut self, Signed { id, minus }: Signed) -> Id {
        if !minus {
            return id;
        }
        let lanes = self.lanes(id);
        let sign = self.value_of(lanes, Step::Constant(SIGN));
        self.value_of(lanes, Step::Binary(Binary::Xor, id, sign))
    }

    fn sum(&mut self, a: Signed, b: Signed) -> Signed {
        let (id, minus) = match (a.minus, b.minus) {
            (false, true) => (self.binary(Binary::Sub, a.id, b.id), false),
            (true, false) => (self.binary(Binary::Sub, b.id, a.id), false),
            (both, _) => (self.binary(Binary::Add, a.id, b.id), both),
        };
        Signed { id, minus }
    }

    fn product(&mut self, operation: Binary, a: Signed, b: Signed) -> Signed {
        let (factors, minus) = ((a.id.min(b.id), a.id.max(b.id)), a.minus != b.minus);
        let known = self.products.as_ref().filter(|_| operation == Binary::Mul);
        if let Some(id) = known.and_then(|products| products.get(&factors)) {
            return Signed { id: *id, minus };
        }
        let id = self.binary(operation, a.id, b.id);
        if let (Some(products), Binary::Mul) = (&mut self.products, operation) {
            products.insert(factors, id);
        }
        Signed { id, minus }
    }

    /// A value whose signs are set where angles are beyond the range of the main path.
    fn beyond(&mut self, angles: &[Signed]) -> Option<Id> {
        let (size, limit) = (!SIGN, limit(Precision::F64).to_bits());
        // The bits of doubles without signs have the order of the numbers, and NaN comes last.
        let mut beyond = None;
        for angle in angles {
            let (size, limit) = (self.constant_bits(size), self.constant_bits(limit));
            let size = self.binary(Binary::And, angle.id, size);
            let rest = self.binary(Binary::SubIntegers, limit, size);
            beyond = Some(beyond.map_or(rest, |beyond| self.binary(Binary::Or, beyond, rest)));
        }
        beyond
    }

    /// Sines and cosines of angles, which all have to be within the range of the main path.
    fn pairs(&mut self, angles: &[Signed]) -> Vec<[Signed; 2]> {
        let beyond = self.beyond(angles);
        self.items.extend(beyond.map(Item::ExitIfSigns));
        angles.iter().map(|angle| self.pair(*angle)).collect()
    }

    fn pair(&mut self, angle: Signed) -> [Signed; 2] {
        let fused = self.fused;
        self.products = Some(BTreeMap::new());
        let pair = main_path(self, angle, Precision::F64, fused, Body::turned);
        self.products = None;
        pair
    }

    /// Exchanges sine and cosine in odd quadrants and gives them the quadrant's signs, by their bits.
    fn turned(&mut self, [quadrant, _]: [Signed; 2], pair: [Signed; 2]) -> [Signed; 2] {
        let quadrant = self.plain(quadrant);
        let [sin, cos] = pair.map(|x| self.plain(x));
        let odd = self.value(Step::Shift(quadrant, 63));
        let one = self.constant_bits(1);
        let next = self.binary(Binary::AddIntegers, quadrant, one);
        [(quadrant, cos, sin), (next, sin, cos)].map(|(quadrant, yes, no)| {
            let turned = self.value(Step::Select { mask: odd, yes, no });
            // Bit 1 becomes the sign.
            let high = self.value(Step::Shift(quadrant, 62));
            let sign = self.constant_bits(SIGN);
            let sign = self.binary(Binary::And, high, sign);
            Signed { id: self.binary(Binary::Xor, turned, sign), minus: false }
        })
    }

    fn entry(place: Place<()>) -> Entry {
        Entry { array: place.array, at: place.at, stride: place.turn.map_or(0, |(_, stride)| stride) }
    }

    /// A place of what loops carry. Nothing else asks for this array, because it is decided later what leaves the registers.
    fn carried(slot: usize) -> Entry {
        Entry { array: Array::Spilled, at: slot, stride: 0 }
    }
}

/// The bit of the sign.
const SIGN: u64 = 1 << 63;

impl Instructions for Body {
    type Value = Signed;
    type Turn = ();
    type Loop = Loop;

    fn constant(&mut self, x: f64) -> Signed {
        Signed { id: self.constant_bits(x.to_bits()), minus: false }
    }

    fn load(&mut self, place: Place<()>) -> Signed {
        Signed { id: self.value(Step::Load(Body::entry(place))), minus: false }
    }

    fn store(&mut self, place: Place<()>, value: Signed) {
        let value = self.plain(value);
        self.items.push(Item::Store(Body::entry(place), value));
    }

    fn operation(&mut self, operation: Operation<Signed>) -> Signed {
        match operation {
            Operation::Add(a, b) => self.sum(a, b),
            Operation::Sub(a, b) => self.sum(a, Signed { minus: !b.minus, ..b }),
            Operation::Mul(a, b) => self.product(Binary::Mul, a, b),
            Operation::Div(a, b) => self.product(Binary::Div, a, b),
            Operation::Fma(a, b, c) if self.fused => {
                let (minus_product, minus_addend) = (a.minus != b.minus, c.minus);
                let step = Step::Fused { a: a.id, b: b.id, c: c.id, minus_product, minus_addend };
                Signed { id: self.value(step), minus: false }
            }
            Operation::Fma(a, b, c) => {
                let product = self.product(Binary::Mul, a, b);
                self.sum(product, c)
            }
            Operation::Negate(a) => Signed { minus: !a.minus, ..a },
            Operation::ReciprocalAbove { value, floor } => {
                let one = self.constant_bits(1_f64.to_bits());
                let [value, floor] = [value, floor].map(|x| self.plain(x));
                let x = self.binary(Binary::Div, one, value);
                Signed { id: self.value(Step::ZeroBelow { value, floor, x }), minus: false }
            }
            #[cfg(feature = "height_fields")]
            Operation::LookUp { .. } => unreachable!("programs that look numbers up are left to Cranelift"),
            Operation::Sqrt(a) => {
                let a = self.plain(a);
                Signed { id: self.value(Step::Sqrt(a)), minus: false }
            }
        }
    }

    fn sines(&mut self, angles: &[Signed]) -> Vec<[Signed; 2]> {
        let angles: Vec<Signed> = angles.iter().map(|a| Signed { id: self.plain(*a), minus: false }).collect();
        match self.width.states {
            Lanes::One => self.sines_of_one(&angles),
            _ => self.pairs(&angles),
        }
    }

    fn sines_of_array(&mut self, n: usize) {
        if self.width.states == Lanes::One {
            let arrays = [Array::Angles, Array::Sines, Array::Cosines].map(|array| Entry { array, at: 0, stride: 0 });
            self.items.push(Item::Call(Call { n: n.next_multiple_of(BLOCK), arrays }));
            return;
        }
        let (open, (), _) = self.open_loop(n, false, Vec::new());
        let angle = self.load(Place::moving(Array::Angles, 0, (), 1));
        for (array, value) in [Array::Sines, Array::Cosines].into_iter().zip(self.pairs(&[angle])[0]) {
            self.store(Place::moving(array, 0, (), 1), value);
        }
        self.close_loop(open, Vec::new());
    }

    fn width(&self) -> usize {
        self.branches
    }

    fn vectors(&mut self, on: bool) {
        if self.branches > 1 {
            self.now = if on { Lanes::for_numbers(self.branches, Lanes::Four) } else { self.width.states };
        }
    }

    fn vector(&mut self, numbers: &[Signed]) -> Signed {
        let numbers: Vec<Id> = numbers.iter().map(|x| self.plain(*x)).collect();
        Signed { id: self.packed(&numbers, self.now), minus: false }
    }

    fn part(&mut self, vector: &Signed, k: usize) -> Signed {
        let vector = self.plain(*vector);
        Signed { id: self.part_of(vector, k), minus: false }
    }

    fn open_loop(&mut self, turns: usize, backward: bool, start: Vec<Signed>) -> (Loop, (), Vec<Signed>) {
        let (carried, n) = (self.carried, start.len());
        self.carried += n;
        for (slot, value) in start.into_iter().enumerate() {
            let value = self.plain(value);
            self.items.push(Item::Store(Body::carried(carried + slot), value));
        }
        self.items.push(Item::Open { turns, backward });
        let load = |slot| Signed { id: self.value(Step::Load(Body::carried(carried + slot))), minus: false };
        let values = (0..n).map(load).collect();
        (Loop { turns, backward, carried }, (), values)
    }

    fn close_loop(&mut self, Loop { turns, backward, carried }: Loop, next: Vec<Signed>) -> Vec<Signed> {
        let n = next.len();
        let next: Vec<Id> = next.into_iter().map(|value| self.plain(value)).collect();
        for (slot, value) in next.into_iter().enumerate() {
            self.items.push(Item::Store(Body::carried(carried + slot), value));
        }
        self.items.push(Item::Close { turns, backward });
        let load = |slot| Signed { id: self.value(Step::Load(Body::carried(carried + slot))), minus: false };
        (0..n).map(load).collect()
    }
}

#[cfg(test)]
mod tests;
