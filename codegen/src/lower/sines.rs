//! Sine and cosine as instructions: the main path of the runtime's functions, recorded once.

use std::cell::RefCell;
use std::ops::{Add, Mul, Neg, Sub};

use mbd_runtime::trig::{kernel_f32, kernel_f64, reduced_f32, reduced_f64, Number, LIMIT_F32, LIMIT_F64};

use super::{Instructions, Operation};
use crate::options::Precision;

/// One instruction; its operands are numbers of instructions before it, of which the first are the inputs.
type Step = Result<Operation<usize>, f64>;

/// Instructions that compute a part of the main path.
struct Recording {
    /// Number of inputs.
    inputs: usize,
    /// Instructions after the inputs, constants as `Err`.
    steps: Vec<Step>,
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
        let Recording { inputs, steps, .. } = &mut *self.recording.borrow_mut();
        let known = steps.iter().position(|s| matches!((s, &step), (Err(a), Err(b)) if a == b));
        let id = *inputs + known.unwrap_or(steps.len());
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

    fn turned(_: [Self; 2], sin: Self, cos: Self) -> (Self, Self) {
        sin.recording.borrow_mut().pair = [sin.id, cos.id];
        (sin, cos)
    }
}

impl Recording {
    /// Nothing yet, of a function of so many inputs.
    fn new(inputs: usize) -> RefCell<Recording> {
        RefCell::new(Recording { inputs, steps: Vec::new(), pair: [0; 2] })
    }

    /// Tells a target the instructions. Returns the values of inputs and instructions.
    fn tell<I: Instructions>(self, target: &mut I, inputs: Vec<I::Value>) -> Vec<I::Value> {
        // The last instruction that uses each number.
        let mut last = vec![0; self.inputs + self.steps.len()];
        for (k, step) in self.steps.iter().enumerate() {
            let _ = step.as_ref().map(|operation| operation.clone().map(|id| last[id] = k));
        }
        let mut values = inputs;
        for (k, step) in self.steps.into_iter().enumerate() {
            let value = match step {
                Err(x) => target.constant(x),
                // Some processors write the result where the first operand was.
                Ok(Operation::Fma(a, b, c)) => {
                    let (a, b) = if last[a] > k && last[b] == k { (b, a) } else { (a, b) };
                    target.operation(Operation::Fma(a, b, c).map(|id| values[id].clone()))
                }
                Ok(operation) => target.operation(operation.map(|id| values[id].clone())),
            };
            values.push(value);
        }
        values
    }
}

/// Largest angle of the main path, rad.
pub fn limit(precision: Precision) -> f64 {
    match precision {
        Precision::F64 => LIMIT_F64,
        Precision::F32 => f64::from(LIMIT_F32),
    }
}

/// Tells a target the main path of sine and cosine (see [`mbd_runtime::trig`]), which holds for angles up to
/// [`limit`]. `turned` gets the number whose last two
/// bits are the quadrant, the quadrant as a whole number, and the sine and cosine within the quadrant; it exchanges
/// these where the quadrant is odd, and gives them the quadrant's signs.
#[cfg(feature = "jit")]
pub fn main_path<I: Instructions>(
    target: &mut I,
    angle: I::Value,
    precision: Precision,
    fused: bool,
    turned: impl FnOnce(&mut I, [I::Value; 2], [I::Value; 2]) -> [I::Value; 2],
) -> [I::Value; 2] {
    let (y, quadrant) = reduced(target, angle, precision, fused);
    let pair = within_quadrant(target, y, precision, fused);
    turned(target, quadrant, pair)
}

/// Tells a target the first part of the main path: `y0` and `y1` with `angle = y0 + y1 + n · π/2`, then the number whose
/// last two bits are those of `n`, and `n`.
pub fn reduced<I: Instructions>(
    target: &mut I,
    angle: I::Value,
    precision: Precision,
    fused: bool,
) -> ([I::Value; 2], [I::Value; 2]) {
    fn record<const FUSED: bool>(recording: &RefCell<Recording>, precision: Precision) -> [usize; 4] {
        let angle = Recorded::<FUSED> { recording, id: 0 };
        let (y0, y1, [shifted, n]) = match precision {
            Precision::F64 => reduced_f64::<Recorded<FUSED>>(angle),
            Precision::F32 => reduced_f32::<Recorded<FUSED>>(angle),
        };
        [y0.id, y1.id, shifted.id, n.id]
    }
    let recording = Recording::new(1);
    let places = match fused {
        true => record::<true>(&recording, precision),
        false => record::<false>(&recording, precision),
    };
    let values = recording.into_inner().tell(target, vec![angle]);
    let [y0, y1, shifted, n] = places.map(|id| values[id].clone());
    ([y0, y1], [shifted, n])
}

/// Tells a target the second part: sine and cosine of `y0 + y1` within the quadrant.
pub fn within_quadrant<I: Instructions>(
    target: &mut I,
    y: [I::Value; 2],
    precision: Precision,
    fused: bool,
) -> [I::Value; 2] {
    fn record<const FUSED: bool>(recording: &RefCell<Recording>, precision: Precision) {
        let [y0, y1] = [0, 1].map(|id| Recorded::<FUSED> { recording, id });
        match precision {
            Precision::F64 => kernel_f64::<Recorded<FUSED>>(y0, y1, [y0; 2]),
            Precision::F32 => kernel_f32::<Recorded<FUSED>>(y0, y1, [y0; 2]),
        };
    }
    let recording = Recording::new(2);
    match fused {
        true => record::<true>(&recording, precision),
        false => record::<false>(&recording, precision),
    }
    let recording = recording.into_inner();
    let pair = recording.pair;
    let values = recording.tell(target, y.to_vec());
    pair.map(|id| values[id].clone())
}
