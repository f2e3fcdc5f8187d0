//! Schedules operations: those with the longest path to a result come first, as long as registers are free.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::symbolic::machine::{latency, pipe, Pipe, PIPES};
use crate::symbolic::{Op, Operand, Program, ProgramResult};

/// Limits of a schedule.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Largest number of values that are alive at the same time.
    pub registers: usize,
    /// Number of operations that are examined to find one that frees a register.
    pub search: usize,
}

/// Orders a program: inputs, sines and cosines first, then, cycle by cycle, the operations that are ready.
pub fn schedule(program: &Program, limits: Limits) -> Program {
    let scheduler = Scheduler::new(program, limits);
    let order = scheduler.run();
    renumber(program, &order)
}

/// Positions in the old program, in the new order, become ids.
fn renumber(program: &Program, order: &[u32]) -> Program {
    let mut new = vec![0; program.width()];
    for (k, &at) in order.iter().enumerate() {
        new[program.steps[at as usize].0 as usize] = k as u32;
    }
    let id = |k: u32| new[k as usize];
    let step = |(k, &at): (usize, &u32)| {
        let (_, op, label) = program.steps[at as usize];
        (k as u32, op.renumbered(id), label)
    };
    let output = |output: &ProgramResult| match *output {
        ProgramResult::Node(k, neg) => ProgramResult::Node(id(k), neg),
        constant => constant,
    };
    let mut names: Vec<_> = program.names.iter().map(|(k, name)| (id(*k), *name)).collect();
    names.sort_unstable_by_key(|(id, _)| *id);
    Program {
        names,
        steps: order.iter().enumerate().map(step).collect(),
        outputs: program.outputs.iter().map(output).collect(),
        created: program.created.clone(),
    }
}

/// Steps by position; an operand is the position of its step.
struct Scheduler<'p> {
    program: &'p Program,
    limits: Limits,
    operands: Vec<Vec<u32>>,
    users: Vec<Vec<u32>>,
    /// Cycles from the start of a step to the last result that needs it.
    height: Vec<u32>,
    is_result: Vec<bool>,
}

/// What changes from cycle to cycle.
struct State {
    order: Vec<u32>,
    /// For each step, the number of operands that are still to be computed.
    missing: Vec<u32>,
    /// For each step, the number of uses that are still to come.
    left: Vec<u32>,
    finish: Vec<u32>,
    /// Steps that are ready to start, for each pipe: greatest height first, then oldest.
    ready: [BinaryHeap<(u32, Reverse<u32>)>; 2],
    /// Steps whose operands have all been started, by the cycle in which they are available.
    future: BinaryHeap<Reverse<(u32, u32)>>,
    alive: usize,
}

impl<'p> Scheduler<'p> {
    fn new(program: &'p Program, limits: Limits) -> Self {
        let n = program.steps.len();
        let mut position = vec![0; program.width()];
        for (at, (id, ..)) in program.steps.iter().enumerate() {
            position[*id as usize] = at as u32;
        }
        let mut users = vec![Vec::new(); n];
        let mut operands: Vec<Vec<u32>> = vec![Vec::new(); n];
        for (at, (_, op, _)) in program.steps.iter().enumerate() {
            for operand in op.operands() {
                if let Operand::Node(id) = operand {
                    let from = position[id as usize];
                    if !operands[at].contains(&from) {
                        operands[at].push(from);
                        users[from as usize].push(at as u32);
                    }
                }
            }
        }
        let mut is_result = vec![false; n];
        for output in &program.outputs {
            if let ProgramResult::Node(id, _) = output {
                is_result[position[*id as usize] as usize] = true;
            }
        }
        let mut height = vec![0; n];
        for at in (0..n).rev() {
            let above = users[at].iter().map(|&u| height[u as usize]).max().unwrap_or(0);
            height[at] = above + latency(&program.steps[at].1);
        }
        Scheduler { program, limits, operands, users, height, is_result }
    }

    fn op(&self, at: u32) -> &Op {
        &self.program.steps[at as usize].1
    }

    /// Values that stay in memory, so that they need no register: inputs, sines and cosines.
    fn in_memory(&self, at: u32) -> bool {
        matches!(self.op(at), Op::Input(_) | Op::Sin(_) | Op::Cos(_))
    }

    fn run(&self) -> Vec<u32> {
        let n = self.program.steps.len();
        let mut state = State {
            order: Vec::with_capacity(n),
            missing: self.operands.iter().map(|o| o.len() as u32).collect(),
            left: self.users.iter().map(|u| u.len() as u32).collect(),
            finish: vec![0; n],
            ready: [BinaryHeap::new(), BinaryHeap::new()],
            future: BinaryHeap::new(),
            alive: 0,
        };
        self.start(&mut state);
        let mut cycle = 0;
        while state.order.len() < n {
            while let Some(&Reverse((at, step))) = state.future.peek() {
                if at > cycle {
                    break;
                }
                state.future.pop();
                let lane = usize::from(pipe(self.op(step)).0 == Pipe::Add);
                state.ready[lane].push((self.height[step as usize], Reverse(step)));
            }
            let mut issued = 0;
            for lane in 0..2 {
                for _ in 0..PIPES {
                    let Some(step) = self.pick(&mut state, lane) else { break };
                    self.issue(&mut state, step, cycle);
                    issued += 1;
                }
            }
            if issued == 0 {
                match state.future.peek() {
                    Some(&Reverse((at, _))) => cycle = at,
                    // Only operations that need one more register are left; the most urgent one gets it.
                    None => {
                        let lane = usize::from(state.ready[1].peek() > state.ready[0].peek());
                        let Some((_, Reverse(step))) = state.ready[lane].pop() else { break };
                        self.issue(&mut state, step, cycle);
                        cycle += 1;
                    }
                }
            } else {
                cycle += 1;
            }
        }
        state.order
    }

    /// Inputs, then sines and cosines whose angles are inputs, pairs together, the most urgent first.
    fn start(&self, state: &mut State) {
        let n = self.program.steps.len() as u32;
        for at in (0..n).filter(|&at| matches!(self.op(at), Op::Input(_))) {
            self.issue(state, at, 0);
        }
        let mut angles: Vec<(Reverse<u32>, u32, u32)> = Vec::new();
        for at in 0..n {
            if let (Op::Sin(_) | Op::Cos(_), 0) = (self.op(at), state.missing[at as usize]) {
                let angle = self.operands[at as usize][0];
                let most = self.users[angle as usize].iter().map(|&u| self.height[u as usize]).max().unwrap_or(0);
                angles.push((Reverse(most), angle, at));
            }
        }
        angles.sort_unstable();
        for (.., at) in angles {
            self.issue(state, at, 0);
        }
    }

    /// The most urgent operation of a pipe that fits the registers.
    fn pick(&self, state: &mut State, lane: usize) -> Option<u32> {
        let mut passed = Vec::new();
        let mut found = None;
        while let Some((height, Reverse(step))) = state.ready[lane].pop() {
            if state.alive < self.limits.registers || self.growth(state, step) <= 0 {
                found = Some(step);
                break;
            }
            passed.push((height, Reverse(step)));
            if passed.len() > self.limits.search {
                break;
            }
        }
        state.ready[lane].extend(passed);
        found
    }

    /// Change of the number of values that are alive.
    fn growth(&self, state: &State, step: u32) -> i32 {
        let frees = |o: &&u32| state.left[**o as usize] == 1 && !self.in_memory(**o) && !self.is_result[**o as usize];
        1 - self.operands[step as usize].iter().filter(frees).count() as i32
    }

    fn issue(&self, state: &mut State, step: u32, cycle: u32) {
        if !self.in_memory(step) {
            // Results are stored immediately; a result that is not used again needs no register.
            state.alive += usize::from(!self.users[step as usize].is_empty());
        }
        for &o in &self.operands[step as usize] {
            state.left[o as usize] -= 1;
            if state.left[o as usize] == 0 && !self.in_memory(o) {
                state.alive -= 1;
            }
        }
        state.order.push(step);
        let done = cycle + if self.in_memory(step) { 0 } else { latency(self.op(step)) };
        state.finish[step as usize] = done.max(1);
        for &user in &self.users[step as usize] {
            let missing = &mut state.missing[user as usize];
            *missing -= 1;
            if *missing == 0 && !(self.in_memory(user) && self.is_input(step)) {
                let at = self.operands[user as usize].iter().map(|&o| state.finish[o as usize]).max().unwrap_or(0);
                state.future.push(Reverse((at, user)));
            }
        }
    }

    fn is_input(&self, step: u32) -> bool {
        matches!(self.op(step), Op::Input(_))
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{integer_program, keeps_values, real_program, Rng};
    use super::*;

    const LIMITS: Limits = Limits { registers: 16, search: 64 };

    /// Largest number of values between definition and last use; inputs, sines and cosines are in memory and do not
    /// count.
    fn alive(program: &Program) -> usize {
        let mut last = std::collections::BTreeMap::new();
        for (at, (_, op, _)) in program.steps.iter().enumerate() {
            for operand in op.operands() {
                if let Operand::Node(id) = operand {
                    last.insert(id, at);
                }
            }
        }
        let in_memory = |op: &Op| matches!(op, Op::Input(_) | Op::Sin(_) | Op::Cos(_));
        let spans = program.steps.iter().enumerate().filter(|(_, s)| !in_memory(&s.1));
        let spans: Vec<(usize, usize)> = spans.map(|(at, s)| (at, last.get(&s.0).copied().unwrap_or(at))).collect();
        (0..program.steps.len()).map(|at| spans.iter().filter(|s| s.0 <= at && at < s.1).count()).max().unwrap_or(0)
    }

    #[test]
    fn the_same_operations_in_another_order() {
        for seed in 0..50 {
            let program = integer_program(seed, 120);
            let ordered = schedule(&program, LIMITS);
            assert_eq!(program.steps.len(), ordered.steps.len(), "seed {seed}");
            assert_eq!(program.counts(), ordered.counts(), "seed {seed}");
            assert_eq!(program.critical_path(), ordered.critical_path(), "seed {seed}");
            let inputs = Rng::new(seed).inputs();
            let run = |p: &Program| p.evaluate(&inputs, |a: f64, b: f64, c: f64| a * b + c);
            assert_eq!(run(&program), run(&ordered), "seed {seed}");
        }
        keeps_values(|p| schedule(p, LIMITS));
    }

    /// Without the limit, sums of products that are all ready at the same time would all be alive at the same time.
    #[test]
    fn registers_are_respected() {
        let graph = crate::symbolic::Graph::default();
        let products: Vec<_> = (0..100).map(|k| graph.input(k) * graph.input(k + 1)).collect();
        let sums: Vec<_> = products.chunks(10).map(|c| c.iter().copied().reduce(|a, b| a + b).expect("ten")).collect();
        let program = Program::new(&graph, &sums);
        let limited = alive(&schedule(&program, LIMITS));
        let free = alive(&schedule(&program, Limits { registers: 1000, search: 64 }));
        assert!(limited <= LIMITS.registers && limited < free, "{limited} values alive, {free} without limit");
    }

    #[test]
    fn sines_stand_first_in_pairs() {
        let ordered = schedule(&real_program(1, 40), LIMITS);
        let is_trigonometry = |op: &Op| matches!(op, Op::Sin(_) | Op::Cos(_));
        let first = ordered.steps.iter().position(|s| !matches!(s.1, Op::Input(_))).expect("operations");
        let count = ordered.steps.iter().filter(|s| is_trigonometry(&s.1)).count();
        assert!(ordered.steps[first..first + count].iter().all(|s| is_trigonometry(&s.1)));
    }
}
