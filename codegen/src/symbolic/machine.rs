//! Model of the processor for schedules and cost estimates: roughly a Zen 4 or Skylake.

use super::{Counts, Op, Operand, Program, ProgramResult};

/// Latency of an operation, in cycles.
pub fn latency(op: &Op) -> u32 {
    match op {
        Op::Input(_) => 0,
        Op::Add(..) | Op::Sub(..) => SUM,
        Op::Mul(..) | Op::Fma(_) => PRODUCT,
        Op::Div(..) => DIVISION,
        // A division and a mask.
        Op::ReciprocalAbove(_) => DIVISION + 1,
        // A conversion, two comparisons and a load.
        #[cfg(feature = "height_fields")]
        Op::LookUp(_) => 14,
        Op::Sqrt(_) => 15,
        Op::Sin(_) | Op::Cos(_) => SINE,
    }
}

/// Latency of a sum: 4 on Skylake, 3 on Golden Cove and Zen 4, 2 on Zen 5.
pub const SUM: u32 = 3;
/// Latency of a product, fused with a sum or not.
pub const PRODUCT: u32 = 4;
/// Latency of a division.
const DIVISION: u32 = 13;
/// Latency of a sine with its cosine.
pub const SINE: u32 = 40;

/// Number of pipes that multiply, and of pipes that add.
pub const PIPES: usize = 2;

/// Largest number of instructions in one cycle.
pub const WIDTH: u32 = 4;

/// Number of instructions that the processor looks ahead. Shorter programs overlap with the evaluation before them.
const WINDOW: f64 = 250.0;

/// Estimated cycles for one of several successive states: the larger of critical path and throughput, plus a quarter of
/// the smaller for the part that does not overlap. Sines come first and overlap with the work before; most latencies
/// are shorter than in the model.
pub fn cycles(critical_path: u32, throughput: f64, instructions: usize) -> f64 {
    let path = waiting(critical_path, instructions);
    path.max(throughput) + 0.25 * path.min(throughput)
}

/// Cycles of the critical path that contribute to the time of a program.
pub fn waiting(critical_path: u32, instructions: usize) -> f64 {
    let shows = (instructions as f64 / WINDOW).min(1.0);
    0.85 * shows * f64::from(critical_path.saturating_sub(SINE))
}

/// Execution unit of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pipe {
    /// Products, fused or not, and divisions.
    Multiply,
    /// Sums.
    Add,
    /// None: inputs are read from memory by the operations that use them.
    None,
}

/// The pipe of an operation, and the cycles for which it is occupied.
pub fn pipe(op: &Op) -> (Pipe, u32) {
    match op {
        Op::Input(_) => (Pipe::None, 0),
        Op::Add(..) | Op::Sub(..) => (Pipe::Add, 1),
        Op::Mul(..) | Op::Fma(_) => (Pipe::Multiply, 1),
        Op::Div(..) | Op::ReciprocalAbove(_) => (Pipe::Multiply, 5),
        // The conversion; units that the model does not have do the rest.
        #[cfg(feature = "height_fields")]
        Op::LookUp(_) => (Pipe::Add, 1),
        Op::Sqrt(_) => (Pipe::Multiply, 7),
        // Half of a pair; both together take about thirty products.
        Op::Sin(_) | Op::Cos(_) => (Pipe::Multiply, 15),
    }
}

fn is_sine(op: &Op) -> bool {
    matches!(op, Op::Sin(_) | Op::Cos(_))
}

/// Cycles for which a division of eight numbers at once occupies its pipe (measured on Sapphire Rapids: 15.4).
const WIDE_DIVISION: f64 = 16.0;

impl Counts {
    /// Instructions of the sines and cosines with their reduction, counted in machine code of AVX-512: those that
    /// multiply, fused or not, and those that add or combine bits.
    fn sincos_instructions(&self) -> (usize, usize) {
        (26 * self.sincos, 19 * self.sincos)
    }
}

impl Program {
    /// Critical path: cycles from the inputs to the last result, with unlimited pipes.
    pub fn critical_path(&self) -> u32 {
        let mut ready = vec![0; self.width()];
        for (id, op, _) in &self.steps {
            let start = op.operands().map(|o| if let Operand::Node(k) = o { ready[k as usize] } else { 0 }).max();
            ready[*id as usize] = start.unwrap_or(0) + latency(op);
        }
        let last =
            |output: &ProgramResult| if let ProgramResult::Node(id, _) = output { ready[*id as usize] } else { 0 };
        self.outputs.iter().map(last).max().unwrap_or(0)
    }

    /// Smallest number of cycles that the pipes need for all operations except sines and cosines.
    pub fn throughput(&self) -> f64 {
        let busy = |which: Pipe| {
            let pipes = self.steps.iter().map(|(_, op, _)| op).filter(|op| !is_sine(op)).map(pipe);
            pipes.filter(|(pipe, _)| *pipe == which).map(|(_, cycles)| cycles).sum::<u32>()
        };
        let busiest = f64::from(busy(Pipe::Multiply).max(busy(Pipe::Add))) / PIPES as f64;
        busiest.max(self.instructions() as f64 / f64::from(WIDTH))
    }

    /// Smallest number of cycles that the pipes need for all operations, sines and cosines included.
    pub fn bound(&self) -> f64 {
        let busy = |which: Pipe| {
            let pipes = self.steps.iter().map(|(_, op, _)| op).filter(|op| !is_sine(op)).map(pipe);
            pipes.filter(|(pipe, _)| *pipe == which).map(|(_, cycles)| cycles).sum::<u32>() as usize
        };
        let (multiply, add) = self.counts().sincos_instructions();
        let all = self.instructions() + multiply + add;
        let busiest = (busy(Pipe::Multiply) + multiply).max(busy(Pipe::Add) + add) as f64 / PIPES as f64;
        busiest.max(all as f64 / f64::from(WIDTH))
    }

    /// The same for each of eight states at once, on two pipes of 64 bytes that do everything, except that one of them
    /// divides.
    pub fn bound_of_lanes(&self) -> f64 {
        let counts = self.counts();
        let divisions = counts.divisions + counts.roots;
        let (multiply, add) = counts.sincos_instructions();
        let rest = self.instructions() - divisions + multiply + add;
        let dividing = divisions as f64 * WIDE_DIVISION;
        (0.5 * (rest as f64 + dividing)).max(dividing) / 8.0
    }

    /// Number of operations that become instructions: all except inputs, sines and cosines; a fused product and sum is
    /// one.
    pub fn instructions(&self) -> usize {
        self.steps.iter().filter(|(_, op, _)| !matches!(op, Op::Input(_) | Op::Sin(_) | Op::Cos(_))).count()
    }
}
