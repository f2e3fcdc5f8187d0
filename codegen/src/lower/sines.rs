//! Sine and cosine as instructions: the main path of the runtime's functions, recorded once.

use std::cell::RefCell;
use std::ops::{Add, Mul, Neg, Sub};

use mbd_runtime::trig::{path_f32, path_f64, Number};

use super::{Instructions, Operation};
use crate::options::Precision;

/// One instruction; its operands are numbers of instructions before it, of which the first is the angle.
type Step = Result<Operation<usize>, f64>;

/// The instructions of the main path.
struct Recording {
    /// Instructions after the angle, constants as `Err`.
    steps: Vec<Step>,
    /// The number that holds the quadrant in its last bits, and the whole number of quarter turns.
    quadrant: [usize; 2],
    /// Sine and cosine before they are turned by the quadrant.
    pair: [usize; 2],
}

/// A number that records what is done with it. `FUSED` says whether products and sums are one instruction.
#[derive(Clone, Copy)]
struct Recorded<'a, const FUSED: bool> {
    recording: &'a RefCell<Recording>,
    id: usize,
}

impl<const FUSED: bool> Recorded<'_, FUSED> {
    fn step(self, step: Step) -> Self {
        let steps = &mut self.recording.borrow_mut().steps;
        // The angle is number 0.
        let known = steps.iter().position(|s| matches!((s, &step), (Err(a), Err(b)) if a == b));
        let id = known.map_or(steps.len() + 1, |at| at + 1);
        if known.is_none() {
            steps.push(step);
        }
        Recorded { id, ..self }
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident;)+) => {
        $(impl<const FUSED: bool> $operator for Recorded<'_, FUSED> {
            type Output = Self;
            fn $method(self, b: Self) -> Self {
                self.step(Ok(Operation::$operator(self.id, b.id)))
            }
        })+
    };
}

operators! {
    Add add;
    Sub sub;
    Mul mul;
}

impl<const FUSED: bool> Neg for Recorded<'_, FUSED> {
    type Output = Self;
    fn neg(self) -> Self {
        self.step(Ok(Operation::Negate(self.id)))
    }
}

impl<'a, const FUSED_: bool, F: Into<f64>> Number<F> for Recorded<'a, FUSED_> {
    type Quadrant = [Self; 2];

    const FUSED: bool = FUSED_;

    fn constant(self, x: F) -> Self {
        self.step(Err(x.into()))
    }

    fn fma(self, b: Self, c: Self) -> Self {
        self.step(Ok(Operation::Fma(self.id, b.id, c.id)))
    }

    fn quadrant(shifted: Self, n: Self) -> [Self; 2] {
        [shifted, n]
    }

    fn turned(quadrant: [Self; 2], sin: Self, cos: Self) -> (Self, Self) {
        let mut recording = sin.recording.borrow_mut();
        recording.quadrant = quadrant.map(|x| x.id);
        recording.pair = [sin.id, cos.id];
        (sin, cos)
    }
}

/// Tells a target the main path of sine and cosine (see [`mbd_runtime::trig`]), which holds for angles up to
/// [`mbd_runtime::trig::LIMIT_F64`] or [`mbd_runtime::trig::LIMIT_F32`], rad. `turned` gets the number whose last two
/// bits are the quadrant, the quadrant as a whole number, and the sine and cosine within the quadrant; it exchanges
/// these where the quadrant is odd, and gives them the quadrant's signs.
pub fn main_path<I: Instructions>(
    target: &mut I,
    angle: I::Value,
    precision: Precision,
    fused: bool,
    turned: impl FnOnce(&mut I, [I::Value; 2], [I::Value; 2]) -> [I::Value; 2],
) -> [I::Value; 2] {
    let recording = RefCell::new(Recording { steps: Vec::new(), quadrant: [0; 2], pair: [0; 2] });
    fn record<const FUSED: bool>(recording: &RefCell<Recording>, precision: Precision) {
        let angle = Recorded::<FUSED> { recording, id: 0 };
        match precision {
            Precision::F64 => path_f64::<Recorded<FUSED>>(angle),
            Precision::F32 => path_f32::<Recorded<FUSED>>(angle),
        };
    }
    match fused {
        true => record::<true>(&recording, precision),
        false => record::<false>(&recording, precision),
    }
    let recording = recording.into_inner();
    let mut values = vec![angle];
    for step in recording.steps {
        let value = match step {
            Err(x) => target.constant(x),
            Ok(operation) => target.operation(operation.map(|id| values[id].clone())),
        };
        values.push(value);
    }
    let [quadrant, pair] = [recording.quadrant, recording.pair].map(|ids| ids.map(|id| values[id].clone()));
    turned(target, quadrant, pair)
}
