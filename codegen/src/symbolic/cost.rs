//! Estimate of a program's running time without rewriting it, by which eliminations are compared.

use super::machine::{latency, pipe, Pipe, PIPES, WIDTH};
use super::passes::chains::{best_plan, Arrival};
use super::passes::terms::Opened;
use super::{Op, Operand, Program, ProgramResult};

/// Bytes of code for each instruction, fused products among them, spills included: 12.5 to 13.4.
pub const BYTES: f64 = 12.5;

/// Code size, bytes, beyond which code is fetched from the second-level cache.
const CACHE: f64 = 32768.0;

/// Bytes of such code that are fetched in one cycle.
const FETCH: f64 = 24.0;

/// Cost of a program, as [`Rewrite::Shortest`](super::passes::Rewrite::Shortest) will regroup and fuse it. Sines and
/// cosines are part of the critical path, and left out of all other numbers, because eliminations do not differ in
/// them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Additions, multiplications and divisions.
    pub operations: usize,
    /// Arithmetic instructions; a fused product and sum is one.
    pub instructions: usize,
    /// Critical path: cycles from the inputs to the last result, with unlimited pipes.
    pub critical_path: u32,
    /// Throughput: cycles that the busiest pipe needs for all instructions. It determines the time of many independent
    /// states or lanes.
    pub throughput: f64,
    /// Estimated size of the code, bytes.
    pub bytes: f64,
}

impl Cost {
    /// Estimated cycles for one of several successive states: [`machine::cycles`](super::machine::cycles), and the time
    /// of fetching long code. Within 20 % of times measured on Zen 5, for chains and robots of 3 to 35 degrees of
    /// freedom.
    pub fn cycles(&self) -> f64 {
        let ideal = super::machine::cycles(self.critical_path, self.throughput, self.instructions);
        ideal + (self.bytes - CACHE).max(0.0) / FETCH
    }
}

/// Estimates the cost of a program in time linear in its length, without making a graph.
pub fn cost(program: &Program) -> Cost {
    let opened = Opened::new(program);
    let mut tally = Tally { ready: vec![0; opened.ops.len()], opened: &opened, multiply: 0, add: 0, instructions: 0 };
    for (id, op, _) in &program.steps {
        if !opened.in_sum[*id as usize] && !opened.in_product[*id as usize] {
            tally.ready[*id as usize] = tally.step(op);
        }
    }
    let last =
        |output: &ProgramResult| if let ProgramResult::Node(id, _) = output { tally.ready[*id as usize] } else { 0 };
    let busiest = f64::from(tally.multiply.max(tally.add)) / PIPES as f64;
    Cost {
        operations: program.counts().total(),
        instructions: tally.instructions as usize,
        critical_path: program.outputs.iter().map(last).max().unwrap_or(0),
        throughput: busiest.max(f64::from(tally.instructions) / f64::from(WIDTH)),
        bytes: BYTES * f64::from(tally.instructions),
    }
}

struct Tally<'p> {
    opened: &'p Opened,
    /// Cycle in which each node is available.
    ready: Vec<u32>,
    /// Cycles for which instructions occupy the pipes.
    multiply: u32,
    add: u32,
    instructions: u32,
}

impl Tally<'_> {
    /// Counts the instructions of one node, including those of split terms. Returns the cycle in which its value is
    /// available.
    fn step(&mut self, op: &Op) -> u32 {
        match op {
            Op::Add(..) | Op::Sub(..) => {
                let mut arrivals = Vec::new();
                for (operand, _) in self.opened.terms(*op) {
                    let factors = self.opened.factors(operand);
                    arrivals.push(Arrival { is_product: factors.len() > 1, ready: self.before_last_product(factors) });
                }
                arrivals.sort_unstable();
                let Some(plan) = best_plan(&arrivals) else { return 0 };
                self.instructions += plan.instructions;
                self.multiply += plan.products;
                self.add += plan.instructions - plan.products;
                plan.ready
            }
            Op::Mul(a, b) => {
                let factors = self.opened.factors_of_product(*a, *b);
                self.single(op);
                self.before_last_product(factors) + latency(op)
            }
            op => {
                self.single(op);
                op.operands().map(|o| self.at(o)).max().unwrap_or(0) + latency(op)
            }
        }
    }

    /// Counts an instruction that is not fused.
    fn single(&mut self, op: &Op) {
        if matches!(op, Op::Sin(_) | Op::Cos(_)) {
            return;
        }
        let (pipe, cycles) = pipe(op);
        match pipe {
            Pipe::Multiply => self.multiply += cycles,
            Pipe::Add => self.add += cycles,
            Pipe::None => return,
        }
        self.instructions += 1;
    }

    fn at(&self, operand: Operand) -> u32 {
        match operand {
            Operand::Const(_) => 0,
            Operand::Node(id) => self.ready[id as usize],
        }
    }

    /// Cycle in which the last product of some factors can start, if the earliest are multiplied first. Counts the
    /// products before it.
    fn before_last_product(&mut self, factors: Vec<Operand>) -> u32 {
        let mut times: Vec<u32> = factors.into_iter().map(|f| self.at(f)).collect();
        times.sort_unstable();
        while times.len() > 2 {
            let product = times[1] + super::machine::PRODUCT;
            times.drain(..2);
            times.insert(times.partition_point(|&t| t < product), product);
            self.instructions += 1;
            self.multiply += 1;
        }
        times.last().copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symbolic::{passes, Graph};

    /// The estimate equals the cost of the rewritten program, except for operations that sharing saves.
    #[test]
    fn estimates_what_regrouping_makes() {
        let graph = Graph::default();
        let x: Vec<_> = (0..8).map(|k| graph.input(k)).collect();
        let inner = x[0] * x[1] + x[2] * x[3] - x[4];
        let outputs = [inner / x[5] + x[6] * x[7] * inner, (inner + x[0] * x[7]) * x[1]];
        let program = crate::symbolic::Program::new(&graph, &outputs);
        let (cost, made) = (cost(&program), passes::sums::regroup(&program));
        assert_eq!(cost.operations, program.counts().total());
        assert_eq!(cost.instructions, made.instructions());
        assert_eq!(cost.critical_path, made.critical_path());
        assert_eq!(cost.throughput, made.throughput());
    }
}
