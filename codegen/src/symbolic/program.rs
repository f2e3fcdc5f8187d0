//! Programs: the operations of a graph that results need, in order, and their counts.

use std::collections::BTreeMap;

use mbd_runtime::sweep::Quantity;

use super::{Expr, Graph, Label, Name, Op, Operand};

/// A result of a program: a constant, or a node with a sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProgramResult {
    /// A constant.
    Const(f64),
    /// A node or its negative.
    Node(u32, bool),
}

/// Numbers of operations by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Additions and subtractions.
    pub additions: usize,
    /// Multiplications.
    pub multiplications: usize,
    /// Divisions, including reciprocals with a floor.
    pub divisions: usize,
    /// Square roots.
    pub roots: usize,
    /// Pairs of a sine and a cosine of one angle.
    pub sincos: usize,
}

impl Counts {
    /// Total of additions, multiplications and divisions, by which programs are compared.
    pub fn total(&self) -> usize {
        self.additions + self.multiplications + self.divisions
    }

    /// Sum.
    pub fn plus(self, o: Counts) -> Counts {
        Counts {
            additions: self.additions + o.additions,
            multiplications: self.multiplications + o.multiplications,
            divisions: self.divisions + o.divisions,
            roots: self.roots + o.roots,
            sincos: self.sincos + o.sincos,
        }
    }

    /// Those of a program that is executed `n` times.
    pub fn times(self, n: usize) -> Counts {
        Counts {
            additions: n * self.additions,
            multiplications: n * self.multiplications,
            divisions: n * self.divisions,
            roots: n * self.roots,
            sincos: n * self.sincos,
        }
    }

    fn add(&mut self, op: &Op, sine_of_pair: bool) {
        match op {
            Op::Input(_) => {}
            // No operation on numbers.
            #[cfg(feature = "height_fields")]
            Op::LookUp(_) => {}
            Op::Add(..) | Op::Sub(..) => self.additions += 1,
            Op::Mul(..) => self.multiplications += 1,
            Op::Div(..) | Op::ReciprocalAbove(_) => self.divisions += 1,
            Op::Fma(_) => {
                self.additions += 1;
                self.multiplications += 1;
            }
            Op::Sqrt(_) => self.roots += 1,
            Op::Sin(_) | Op::Cos(_) => self.sincos += usize::from(!sine_of_pair),
        }
    }
}

/// A straight-line program: the operations that its results need, operands before their use.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// Operations in order: node id, operation, origin.
    pub steps: Vec<(u32, Op, Label)>,
    /// Results, in the order they were asked for.
    pub outputs: Vec<ProgramResult>,
    /// Names of nodes, in the order of their ids.
    pub names: Vec<(u32, Name)>,
    /// Number of operations that the sweeps made, needed or not, without inputs.
    pub created: BTreeMap<Quantity, usize>,
}

impl Program {
    /// The program of some results; operations that they do not need are left out.
    pub fn new(graph: &Graph, outputs: &[Expr]) -> Program {
        let mut created = BTreeMap::new();
        for (op, (_, what)) in (0..graph.len() as u32).map(|id| graph.get(id)) {
            if !matches!(op, Op::Input(_)) {
                *created.entry(what).or_default() += 1;
            }
        }
        Program { created, ..Program::rebuilt(graph, outputs) }
    }

    /// The same for a program that is rewritten, without the number of operations that sweeps made.
    pub(super) fn rebuilt(graph: &Graph, outputs: &[Expr]) -> Program {
        let result = |e: &Expr| match *e {
            Expr::Const(x) => ProgramResult::Const(x),
            Expr::Node { id, neg, .. } => ProgramResult::Node(id, neg),
        };
        let outputs: Vec<ProgramResult> = outputs.iter().map(result).collect();
        let mut live = vec![false; graph.len()];
        for output in &outputs {
            if let ProgramResult::Node(id, _) = output {
                live[*id as usize] = true;
            }
        }
        // Operands are older than the operations that use them, so that one pass backward marks everything.
        for id in (0..live.len()).rev() {
            if live[id] {
                mark(graph, id, &mut live);
            }
        }
        let live = || (0..live.len() as u32).filter(|&id| live[id as usize]);
        let steps = live().map(|id| {
            let (op, label) = graph.get(id);
            (id, op, label)
        });
        let names = live().filter_map(|id| graph.name_of(id).map(|name| (id, name))).collect();
        let mut program = Program { steps: steps.collect(), outputs, names, created: BTreeMap::new() };
        program.turn_negated_differences();
        program
    }

    /// One more than the largest node id.
    pub fn width(&self) -> usize {
        let mut width = 0;
        for (id, ..) in &self.steps {
            width = width.max(*id as usize + 1);
        }
        width
    }

    /// Name of a node.
    pub fn name(&self, id: u32) -> Option<Name> {
        self.names.binary_search_by_key(&id, |(id, _)| *id).ok().map(|k| self.names[k].1)
    }

    /// Counts of the operations that are executed.
    pub fn counts(&self) -> Counts {
        self.counts_where(|_| true)
    }

    /// Counts of the operations whose origin satisfies a condition. A pair of sine and cosine counts at the place of
    /// its first half.
    pub fn counts_where(&self, condition: impl Fn(&Label) -> bool) -> Counts {
        let mut counts = Counts::default();
        let mut angles = std::collections::BTreeSet::new();
        for (_, op, label) in &self.steps {
            let second = match op {
                Op::Sin(a) | Op::Cos(a) => !angles.insert(*a),
                _ => false,
            };
            if condition(label) {
                counts.add(op, second);
            }
        }
        counts
    }

    /// Replaces `−(a − b)` by `b − a` where it is used as a result only.
    pub(crate) fn turn_negated_differences(&mut self) {
        if !self.outputs.iter().any(|output| matches!(output, ProgramResult::Node(_, true))) {
            return;
        }
        let mut turned = vec![false; self.width()];
        for negative in [true, false] {
            for output in &self.outputs {
                match output {
                    ProgramResult::Node(id, neg) if *neg == negative => turned[*id as usize] = negative,
                    _ => {}
                }
            }
        }
        if !turned.contains(&true) {
            return;
        }
        for (_, op, _) in &self.steps {
            for operand in op.operands() {
                if let Operand::Node(id) = operand {
                    turned[id as usize] = false;
                }
            }
        }
        for (id, op, _) in &mut self.steps {
            match *op {
                Op::Sub(a, b) if turned[*id as usize] => *op = Op::Sub(b, a),
                _ => turned[*id as usize] = false,
            }
        }
        for (_, name) in self.names.iter_mut().filter(|(id, _)| turned[*id as usize]) {
            name.minus = !name.minus;
        }
        for output in &mut self.outputs {
            if let ProgramResult::Node(id, neg) = output {
                *neg &= !turned[*id as usize];
            }
        }
    }
}

fn mark(graph: &Graph, id: usize, live: &mut [bool]) {
    for operand in graph.get(id as u32).0.operands() {
        if let Operand::Node(k) = operand {
            live[k as usize] = true;
        }
    }
}
