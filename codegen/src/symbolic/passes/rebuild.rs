//! The basis of every pass: it rebuilds a program's values in a new graph, and counts the uses of each value.

use mbd_runtime::sweep::Trace;
use mbd_runtime::Scalar;

use crate::symbolic::{Expr, Graph, Label, Name, Op, Operand, Program, ProgramResult};

/// A program that is being rebuilt in a new graph: the new expression of every node so far.
pub struct Rebuilt<'g> {
    /// The new graph.
    pub graph: &'g Graph,
    values: Vec<Option<Expr<'g>>>,
    /// Names of the old program's nodes.
    names: Vec<Option<Name>>,
}

impl<'g> Rebuilt<'g> {
    pub fn new(graph: &'g Graph, program: &Program) -> Self {
        let mut names = vec![None; program.width()];
        program.names.iter().for_each(|(id, name)| names[*id as usize] = Some(*name));
        Rebuilt { graph, values: vec![None; names.len()], names }
    }

    /// The new expression of an operand.
    pub fn get(&self, operand: Operand) -> Expr<'g> {
        match operand {
            Operand::Const(bits) => Expr::Const(f64::from_bits(bits)),
            Operand::Node(id) => self.values[id as usize].expect("operands come before their use"),
        }
    }

    /// Says what has become of a node, which hands on its name.
    pub fn set(&mut self, id: u32, value: Expr<'g>) {
        // Nodes that a pass adds have no names.
        if let (Some(Some(name)), Expr::Node { id, neg, .. }) = (self.names.get(id as usize), value) {
            self.graph.set_name(id, Name { minus: name.minus != neg, ..*name });
        }
        self.values[id as usize] = Some(value);
    }

    /// Sets the label of all nodes that are made from now on.
    pub fn at(&self, label: Label) {
        self.graph.at(label.0, label.1);
    }

    /// The same operation on the new operands, simplified by the exact rules.
    pub fn copy(&self, op: Op) -> Expr<'g> {
        let node = |id| self.get(Operand::Node(id));
        let signed = |x: Expr<'g>, minus: bool| if minus { -x } else { x };
        match op {
            Op::Input(k) => self.graph.input(k as usize),
            Op::Add(a, b) => self.get(a) + self.get(b),
            Op::Sub(a, b) => self.get(a) - self.get(b),
            Op::Mul(a, b) => self.get(a) * self.get(b),
            Op::Div(a, b) => self.get(a) / self.get(b),
            Op::ReciprocalAbove(p) => {
                let floor = signed(self.get(p.floor), p.minus_floor);
                signed(self.get(p.value), p.minus_value).reciprocal_above(floor)
            }
            #[cfg(feature = "height_fields")]
            Op::LookUp(look) => signed(node(look.at), look.minus).look_up(look.table.0, look.offset as usize),
            Op::Sqrt(a) => node(a).sqrt(),
            Op::Sin(a) => node(a).sin_cos().0,
            Op::Cos(a) => node(a).sin_cos().1,
            Op::Fma(f) => {
                let (a, c) = (signed(self.get(f.a), f.minus_product), signed(self.get(f.c), f.minus_addend));
                self.graph.fma(a, self.get(f.b), c)
            }
        }
    }

    /// The new program with the results of the old one.
    pub fn finish(&self, old: &Program) -> Program {
        let result = |output: &ProgramResult| match *output {
            ProgramResult::Const(x) => Expr::Const(x),
            ProgramResult::Node(id, neg) => {
                let value = self.get(Operand::Node(id));
                if neg {
                    -value
                } else {
                    value
                }
            }
        };
        let outputs: Vec<Expr> = old.outputs.iter().map(result).collect();
        Program { created: old.created.clone(), ..Program::rebuilt(self.graph, &outputs) }
    }
}

/// How often each node is used, by operations and results together.
pub fn uses(program: &Program) -> Vec<u32> {
    let mut uses = vec![0; program.width()];
    for (_, op, _) in &program.steps {
        for operand in op.operands() {
            if let Operand::Node(id) = operand {
                uses[id as usize] += 1;
            }
        }
    }
    for output in &program.outputs {
        if let ProgramResult::Node(id, _) = output {
            uses[*id as usize] += 1;
        }
    }
    uses
}

/// The operations, by node id.
pub fn by_id(program: &Program) -> Vec<Option<Op>> {
    let mut ops = vec![None; program.width()];
    for (id, op, _) in &program.steps {
        ops[*id as usize] = Some(*op);
    }
    ops
}
