//! Programs as single instructions, for every target that has one state, loads and stores: machine code at run time, C,
//! WebAssembly.
//!
//! [`lower`] walks through a program and tells a target, by its [`Instructions`], one instruction after the other. A
//! target knows how an instruction is written and where its arrays are, and nothing of programs. (Rust is written by
//! `emit`, which has one text for one state and many.)

mod memory;
#[cfg(feature = "jit")]
mod registers;
mod rolled;
mod sines;
mod straight;
mod together;

use crate::code::Code;
use crate::output::OutputProgram;
use crate::symbolic::Label;

#[cfg(feature = "jit")]
pub use memory::{is_together, table};
pub use memory::{Memory, Spills};
#[cfg(feature = "jit")]
pub use sines::main_path;
pub use sines::{limit, reduced, within_quadrant};
use straight::Lowering;

/// An array that a function reads or writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Array {
    /// Input array of this number, in the order of [`OutputProgram::inputs`].
    Input(usize),
    /// Result array of this number, in the order of the output's specification.
    Result(usize),
    /// Values of straight-line code that leave the registers.
    Spilled,
    /// Numbers that rolled code keeps between its blocks.
    Kept,
    /// Angles of all turns of a run.
    Angles,
    /// Their sines.
    Sines,
    /// Their cosines.
    Cosines,
    /// Rows of the run of this number, one for each turn.
    Rows(usize),
    /// Constants of the run of this number, one row for each turn.
    Table(usize),
}

/// An entry of an array.
#[derive(Clone, Copy, Debug)]
pub struct Place<T> {
    /// The array.
    pub array: Array,
    /// Its entry, in a loop that of turn 0.
    pub at: usize,
    /// In a loop the number of the turn, and by how many entries the place moves from turn to turn.
    pub turn: Option<(T, usize)>,
}

impl<T> Place<T> {
    /// The same entry in every turn.
    pub fn fixed(array: Array, at: usize) -> Place<T> {
        Place { array, at, turn: None }
    }

    /// An entry that moves on by `stride` entries with every turn.
    pub fn moving(array: Array, at: usize, turn: T, stride: usize) -> Place<T> {
        Place { array, at, turn: Some((turn, stride)) }
    }
}

/// An operation on numbers.
#[derive(Clone, Debug)]
pub enum Operation<V> {
    /// `a + b`
    Add(V, V),
    /// `a − b`
    Sub(V, V),
    /// `a · b`
    Mul(V, V),
    /// `a / b`
    Div(V, V),
    /// `a · b + c`, rounded once where the target has an instruction for it.
    Fma(V, V, V),
    /// `−a`
    Negate(V),
    /// `1 / value`, or 0 where the value is not above the floor; NaN is above.
    ReciprocalAbove {
        /// The value.
        value: V,
        /// The floor.
        floor: V,
    },
    /// An entry of a table, as [`Scalar::look_up`](mbd_runtime::Scalar::look_up) finds it.
    #[cfg(feature = "height_fields")]
    LookUp {
        /// The number of the entry.
        at: V,
        /// The table.
        table: &'static [f64],
        /// What is added to the number.
        offset: usize,
    },
    /// `√a`
    Sqrt(V),
}

impl<V> Operation<V> {
    /// The same with other operands.
    pub fn map<W>(self, mut f: impl FnMut(V) -> W) -> Operation<W> {
        match self {
            Operation::Add(a, b) => Operation::Add(f(a), f(b)),
            Operation::Sub(a, b) => Operation::Sub(f(a), f(b)),
            Operation::Mul(a, b) => Operation::Mul(f(a), f(b)),
            Operation::Div(a, b) => Operation::Div(f(a), f(b)),
            Operation::Fma(a, b, c) => Operation::Fma(f(a), f(b), f(c)),
            Operation::Negate(a) => Operation::Negate(f(a)),
            Operation::ReciprocalAbove { value, floor } => {
                Operation::ReciprocalAbove { value: f(value), floor: f(floor) }
            }
            #[cfg(feature = "height_fields")]
            Operation::LookUp { at, table, offset } => Operation::LookUp { at: f(at), table, offset },
            Operation::Sqrt(a) => Operation::Sqrt(f(a)),
        }
    }
}

/// Instructions of a target language, which are written one after the other.
pub trait Instructions {
    /// A number that an instruction gave.
    type Value: Clone;
    /// The number of a loop's turn.
    type Turn: Copy;
    /// A loop that is being written.
    type Loop;

    /// A constant.
    fn constant(&mut self, x: f64) -> Self::Value;

    /// Reads an entry of an array.
    fn load(&mut self, place: Place<Self::Turn>) -> Self::Value;

    /// Writes an entry of an array.
    fn store(&mut self, place: Place<Self::Turn>, value: Self::Value);

    /// Computes an operation.
    fn operation(&mut self, operation: Operation<Self::Value>) -> Self::Value;

    /// Sines and cosines of some angles, whose values the instructions before gave.
    fn sines(&mut self, angles: &[Self::Value]) -> Vec<[Self::Value; 2]>;

    /// The same for the first `n` entries of [`Array::Angles`], into [`Array::Sines`] and [`Array::Cosines`].
    fn sines_of_array(&mut self, n: usize);

    /// Numbers in a vector, in which like branches are computed together. Where it is 1, they are computed one after the
    /// other.
    fn width(&self) -> usize {
        1
    }

    /// Whether values are vectors from here on, or single numbers as in the beginning.
    fn vectors(&mut self, _on: bool) {}

    /// A vector of single numbers; one number stands for all.
    fn vector(&mut self, numbers: &[Self::Value]) -> Self::Value {
        numbers[0].clone()
    }

    /// A single number of a vector.
    fn part(&mut self, vector: &Self::Value, _k: usize) -> Self::Value {
        vector.clone()
    }

    /// Begins a loop of `turns` turns, from the last to the first if `backward`. Returns the number of the turn and the
    /// values that are carried from turn to turn, which are `start` in the first one.
    fn open_loop(
        &mut self,
        turns: usize,
        backward: bool,
        start: Vec<Self::Value>,
    ) -> (Self::Loop, Self::Turn, Vec<Self::Value>);

    /// Ends the loop that was begun last. `next` is carried to the next turn; the values after the last one are
    /// returned.
    fn close_loop(&mut self, open: Self::Loop, next: Vec<Self::Value>) -> Vec<Self::Value>;

    /// Is told each value before it is used: it is that of node `id` of a block's program (straight-line code is block
    /// 0). A target that has names gives it one.
    fn named(&mut self, _block: usize, _id: u32, _label: Label, value: Self::Value) -> Self::Value {
        value
    }
}

/// Tells a target the body of a function, whose results fill arrays of the lengths `results`. Targets whose compiler
/// decides by itself what stays in registers have no `spills`, others one for each block.
pub fn lower<I: Instructions>(target: &mut I, program: &OutputProgram<Code>, results: &[usize], spills: &[Spills]) {
    let entries = |lengths: Vec<usize>, array: fn(usize) -> Array| {
        let of = move |(k, len)| (0..len).map(move |at| (array(k), at));
        lengths.into_iter().enumerate().flat_map(of).collect::<Vec<_>>()
    };
    let inputs = entries(program.inputs.iter().map(|array| array.len()).collect(), Array::Input);
    let results = entries(results.to_vec(), Array::Result);
    let mut lowering = Lowering { target, inputs, results, spills };
    match &program.program {
        Code::Straight(program) => lowering.straight(program),
        Code::Rolled(program) => lowering.rolled(program),
    }
}
