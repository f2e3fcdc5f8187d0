//! The graph of operations, and symbolic scalars.

use std::cell::{Cell, RefCell};
use std::ops::{Add, Div, Mul, Neg, Sub};

use mbd_runtime::sweep::{Quantity, Trace};
use mbd_runtime::Scalar;

use super::index::Index;
#[cfg(feature = "height_fields")]
use super::look_up::{LookUp, Table};

/// An operand: the bits of a constant, or a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Operand {
    /// A constant, by its bits; never negative.
    Const(u64),
    /// A node.
    Node(u32),
}

/// One operation. Negative signs belong to the operands; see [`Expr`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Op {
    /// Input `k`.
    Input(u32),
    /// `a + b`.
    Add(Operand, Operand),
    /// `a − b`.
    Sub(Operand, Operand),
    /// `a · b`.
    Mul(Operand, Operand),
    /// `a / b`.
    Div(Operand, Operand),
    /// `±a · b ± c`; passes make it, sweeps do not.
    Fma(Fma),
    /// `1 / ±a` where that is above `±floor`, else zero.
    ReciprocalAbove(FlooredReciprocal),
    /// The entry of a table.
    #[cfg(feature = "height_fields")]
    LookUp(LookUp),
    /// Square root.
    Sqrt(u32),
    /// Sine.
    Sin(u32),
    /// Cosine.
    Cos(u32),
}

/// A product and a sum in one operation, `±a · b ± c`, with one rounding where the target has the instruction, and two
/// where it does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fma {
    /// First factor.
    pub a: Operand,
    /// Second factor.
    pub b: Operand,
    /// The addend.
    pub c: Operand,
    /// Whether the product is subtracted.
    pub minus_product: bool,
    /// Whether the addend is subtracted.
    pub minus_addend: bool,
}

/// Operands of a reciprocal that is zero up to a floor. Their signs cannot be moved to the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FlooredReciprocal {
    /// The value that is inverted.
    pub value: Operand,
    /// The floor that the value must exceed.
    pub floor: Operand,
    /// Whether the negative of `value` is inverted.
    pub minus_value: bool,
    /// Whether the negative of `floor` is the floor.
    pub minus_floor: bool,
}

/// The operands of an operation, one after the other. A type of its own, because the standard library's adapters are slow in macros,
/// whose crates are not optimised.
struct Operands {
    /// Those there are come first.
    list: [Option<Operand>; 3],
    next: usize,
}

impl Iterator for Operands {
    type Item = Operand;

    #[inline]
    fn next(&mut self) -> Option<Operand> {
        let operand = *self.list.get(self.next)?;
        self.next += 1;
        operand
    }
}

impl Op {
    /// Whether it reads a table.
    pub fn looks_up(&self) -> bool {
        #[cfg(feature = "height_fields")]
        return matches!(self, Op::LookUp(_));
        #[cfg(not(feature = "height_fields"))]
        false
    }

    /// The operands of the operation.
    pub fn operands(&self) -> impl Iterator<Item = Operand> {
        let list = match *self {
            Op::Input(_) => [None; 3],
            Op::Add(a, b) | Op::Sub(a, b) | Op::Mul(a, b) | Op::Div(a, b) => [Some(a), Some(b), None],
            Op::Fma(f) => [Some(f.a), Some(f.b), Some(f.c)],
            Op::ReciprocalAbove(p) => [Some(p.value), Some(p.floor), None],
            Op::Sqrt(a) | Op::Sin(a) | Op::Cos(a) => [Some(Operand::Node(a)), None, None],
            #[cfg(feature = "height_fields")]
            Op::LookUp(look) => [Some(Operand::Node(look.at)), None, None],
        };
        Operands { list, next: 0 }
    }

    /// The operation with other ids for its nodes.
    pub fn renumbered(self, id: impl Fn(u32) -> u32) -> Op {
        let o = |operand: Operand| match operand {
            Operand::Node(k) => Operand::Node(id(k)),
            constant => constant,
        };
        match self {
            Op::Input(_) => self,
            Op::Add(a, b) => Op::Add(o(a), o(b)),
            Op::Sub(a, b) => Op::Sub(o(a), o(b)),
            Op::Mul(a, b) => Op::Mul(o(a), o(b)),
            Op::Div(a, b) => Op::Div(o(a), o(b)),
            Op::Fma(f) => Op::Fma(Fma { a: o(f.a), b: o(f.b), c: o(f.c), ..f }),
            Op::ReciprocalAbove(p) => {
                Op::ReciprocalAbove(FlooredReciprocal { value: o(p.value), floor: o(p.floor), ..p })
            }
            #[cfg(feature = "height_fields")]
            Op::LookUp(look) => Op::LookUp(LookUp { at: id(look.at), ..look }),
            Op::Sqrt(a) => Op::Sqrt(id(a)),
            Op::Sin(a) => Op::Sin(id(a)),
            Op::Cos(a) => Op::Cos(id(a)),
        }
    }
}

/// Origin of an operation: node of the tree (`None`: ground) and quantity.
pub type Label = (Option<usize>, Quantity);

/// Name of a value: an entry of a quantity of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    /// Tree node (`None`: ground).
    pub node: Option<usize>,
    /// Whether the value is the negative of what is named.
    pub minus: bool,
    /// The letter, in ASCII.
    pub letter: &'static str,
    /// Which entry.
    pub entry: Entry,
}

/// An entry of a vector or matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// By the names of axes; empty for something of one entry.
    Axes(&'static str),
    /// By its number.
    Number(usize),
    /// By row and column.
    Pair(usize, usize),
}

#[derive(Debug, Default)]
struct Inner {
    ops: Vec<Op>,
    labels: Vec<Label>,
    names: Vec<Option<Name>>,
    ids: Index,
}

/// A graph of operations in the order of their first use. Equal operations exist once.
#[derive(Debug)]
pub struct Graph {
    inner: RefCell<Inner>,
    label: Cell<Label>,
}

impl Default for Graph {
    fn default() -> Self {
        Graph { inner: RefCell::default(), label: Cell::new((None, Quantity::Pose)) }
    }
}

impl Trace for Graph {
    fn at(&self, node: Option<usize>, what: Quantity) {
        self.label.set((node, what));
    }

    fn name<S: Scalar>(&self, value: S, letter: &'static str, entry: &'static str) {
        if let Some((id, minus)) = value.node() {
            self.set_name(id, Name { node: self.label.get().0, minus, letter, entry: Entry::Axes(entry) });
        }
    }
}

impl Graph {
    /// Input `k`.
    pub fn input(&self, k: usize) -> Expr<'_> {
        self.node(Op::Input(k as u32), false)
    }

    /// Number of operations created so far, inputs included.
    pub fn len(&self) -> usize {
        self.inner.borrow().ops.len()
    }

    /// Whether the graph is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Operation and origin of a node.
    pub fn get(&self, id: u32) -> (Op, Label) {
        let inner = self.inner.borrow();
        (inner.ops[id as usize], inner.labels[id as usize])
    }

    /// Names a node that has no name yet.
    pub fn set_name(&self, id: u32, name: Name) {
        self.inner.borrow_mut().names[id as usize].get_or_insert(name);
    }

    /// Name of a node.
    pub fn name_of(&self, id: u32) -> Option<Name> {
        self.inner.borrow().names[id as usize]
    }

    /// An operand of this graph as an expression.
    pub fn expr(&self, operand: Operand) -> Expr<'_> {
        match operand {
            Operand::Const(bits) => Expr::Const(f64::from_bits(bits)),
            Operand::Node(id) => Expr::Node { graph: self, id, neg: false },
        }
    }

    /// `a · b + c`, as one operation unless a constant among the operands simplifies it.
    pub fn fma<'g>(&'g self, a: Expr<'g>, b: Expr<'g>, c: Expr<'g>) -> Expr<'g> {
        let trivial = |e: Expr| [0.0, 1.0, -1.0].iter().any(|&x| e.is(x));
        if trivial(a) || trivial(b) || c.is(0.0) || (a.graph(b).is_none()) {
            return a * b + c;
        }
        let ((a, a_neg), (b, b_neg), (c, minus_addend)) = (a.split(), b.split(), c.split());
        let (a, b) = if b < a { (b, a) } else { (a, b) };
        self.node(Op::Fma(Fma { a, b, c, minus_product: a_neg != b_neg, minus_addend }), false)
    }

    /// An operation like another one on other operands, with its label and name.
    #[cfg(feature = "factored")]
    pub fn like(&self, id: u32, op: Op) -> Expr<'_> {
        let (_, label) = self.get(id);
        self.label.set(label);
        let first = |x: Operand| (matches!(x, Operand::Const(_)), x);
        let op = match op {
            Op::Add(a, b) if first(b) < first(a) => Op::Add(b, a),
            Op::Mul(a, b) if b < a => Op::Mul(b, a),
            op => op,
        };
        let made = self.node(op, false);
        if let (Expr::Node { id: made, .. }, Some(name)) = (made, self.name_of(id)) {
            self.set_name(made, name);
        }
        made
    }

    fn node(&self, op: Op, neg: bool) -> Expr<'_> {
        let mut inner = self.inner.borrow_mut();
        let Inner { ops, labels, names, ids } = &mut *inner;
        let id = ids.id(ops, &op);
        if id as usize == ops.len() {
            ops.push(op);
            labels.push(self.label.get());
            names.push(None);
        }
        Expr::Node { graph: self, id, neg }
    }
}

/// A symbolic scalar: a constant, or a signed node of a graph. `Copy`, 16 bytes.
#[derive(Clone, Copy, Debug)]
pub enum Expr<'g> {
    /// A constant; belongs to no graph.
    Const(f64),
    /// A node or its negative.
    Node {
        /// The graph.
        graph: &'g Graph,
        /// The node.
        id: u32,
        /// Whether the value is the node's negative.
        neg: bool,
    },
}

impl<'g> Expr<'g> {
    /// Splits into operand and sign.
    pub(super) fn split(self) -> (Operand, bool) {
        match self {
            Expr::Const(x) => (Operand::Const(x.abs().to_bits()), x < 0.0),
            Expr::Node { id, neg, .. } => (Operand::Node(id), neg),
        }
    }

    fn graph(self, other: Self) -> Option<&'g Graph> {
        match (self, other) {
            (Expr::Node { graph, .. }, _) | (_, Expr::Node { graph, .. }) => Some(graph),
            _ => None,
        }
    }

    fn is(self, x: f64) -> bool {
        matches!(self, Expr::Const(c) if c == x)
    }

    fn unary(self, f: impl Fn(f64) -> f64, op: impl Fn(u32) -> Op) -> (Self, bool) {
        match self {
            Expr::Const(x) => (Expr::Const(f(x)), false),
            Expr::Node { graph, id, neg } => (graph.node(op(id), false), neg),
        }
    }
}

impl Add for Expr<'_> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let Some(graph) = self.graph(other) else {
            let (Expr::Const(x), Expr::Const(y)) = (self, other) else { unreachable!("constants have no graph") };
            return Expr::Const(x + y);
        };
        if self.is(0.0) {
            return other;
        }
        if other.is(0.0) {
            return self;
        }
        let ((mut a, mut a_neg), (mut b, mut b_neg)) = (self.split(), other.split());
        if a == b && a_neg != b_neg {
            return Expr::Const(0.0);
        }
        // Operands are sorted by age, a constant last; the sign of the first operand moves to the result.
        let first = |x: Operand| (matches!(x, Operand::Const(_)), x);
        if first(b) < first(a) {
            std::mem::swap(&mut a, &mut b);
            std::mem::swap(&mut a_neg, &mut b_neg);
        }
        let op = if a_neg == b_neg { Op::Add(a, b) } else { Op::Sub(a, b) };
        graph.node(op, a_neg)
    }
}

impl Neg for Expr<'_> {
    type Output = Self;
    fn neg(self) -> Self {
        match self {
            Expr::Const(0.0) => self,
            Expr::Const(x) => Expr::Const(-x),
            Expr::Node { graph, id, neg } => Expr::Node { graph, id, neg: !neg },
        }
    }
}

impl Sub for Expr<'_> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Expr<'_> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let Some(graph) = self.graph(other) else {
            let (Expr::Const(x), Expr::Const(y)) = (self, other) else { unreachable!("constants have no graph") };
            return Expr::Const(x * y);
        };
        for (x, y) in [(self, other), (other, self)] {
            if x.is(0.0) {
                return Expr::Const(0.0);
            } else if x.is(1.0) {
                return y;
            } else if x.is(-1.0) {
                return -y;
            }
        }
        let ((a, a_neg), (b, b_neg)) = (self.split(), other.split());
        graph.node(if b < a { Op::Mul(b, a) } else { Op::Mul(a, b) }, a_neg != b_neg)
    }
}

impl Div for Expr<'_> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let Some(graph) = self.graph(other) else {
            let (Expr::Const(x), Expr::Const(y)) = (self, other) else { unreachable!("constants have no graph") };
            return Expr::Const(x / y);
        };
        if self.is(0.0) || other.is(1.0) {
            return self;
        }
        let ((a, a_neg), (b, b_neg)) = (self.split(), other.split());
        graph.node(Op::Div(a, b), a_neg != b_neg)
    }
}

impl Scalar for Expr<'_> {
    fn constant(x: f64) -> Self {
        Expr::Const(x)
    }

    fn sin_cos(self) -> (Self, Self) {
        let trig = |x: f64| Scalar::sin_cos(x);
        let (s, neg) = self.unary(|x| trig(x).0, Op::Sin);
        let (c, _) = self.unary(|x| trig(x).1, Op::Cos);
        (if neg { -s } else { s }, c)
    }

    fn node(self) -> Option<(u32, bool)> {
        match self {
            Expr::Const(_) => None,
            Expr::Node { id, neg, .. } => Some((id, neg)),
        }
    }

    fn sqrt(self) -> Self {
        match self {
            Expr::Const(x) => Expr::Const(Scalar::sqrt(x)),
            Expr::Node { graph, id, neg: false } => graph.node(Op::Sqrt(id), false),
            // The sign of a node is not that of its value: `1 − x` is stored as `−(x − 1)`.
            Expr::Node { graph, id, neg: true } => {
                let positive = match graph.get(id).0 {
                    Op::Sub(a, b) => Op::Sub(b, a),
                    _ => Op::Sub(Operand::Const(0), Operand::Node(id)),
                };
                graph.node(positive, false).sqrt()
            }
        }
    }

    fn reciprocal_above(self, floor: Self) -> Self {
        match (self, floor) {
            // Zero is not above a floor that is not negative.
            (Expr::Const(0.0), _) => self,
            (Expr::Const(x), Expr::Const(y)) => Expr::Const(Scalar::reciprocal_above(x, y)),
            (Expr::Node { graph, .. }, _) | (_, Expr::Node { graph, .. }) => {
                let ((value, minus_value), (floor, minus_floor)) = (self.split(), floor.split());
                graph.node(Op::ReciprocalAbove(FlooredReciprocal { value, floor, minus_value, minus_floor }), false)
            }
        }
    }

    #[cfg(feature = "height_fields")]
    fn look_up(self, table: &'static [f64], offset: usize) -> Self {
        match self {
            Expr::Const(x) => Expr::Const(x.look_up(table, offset)),
            Expr::Node { graph, id: at, neg: minus } => {
                graph.node(Op::LookUp(LookUp { at, minus, table: Table(table), offset: offset as u32 }), false)
            }
        }
    }

    #[cfg(not(feature = "height_fields"))]
    fn look_up(self, _: &'static [f64], _: usize) -> Self {
        unreachable!("only height fields have tables")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_small() {
        assert_eq!(std::mem::size_of::<Expr>(), 16);
    }

    #[test]
    fn exact_rules() {
        let g = Graph::default();
        let (x, y) = (g.input(0), g.input(1));
        let same = |a: Expr, b: Expr| assert_eq!(a.split(), b.split());
        let c = Expr::Const;
        same(x + c(0.0), x);
        same(c(0.0) + x, x);
        same(x * c(1.0), x);
        same(x * c(-1.0), -x);
        same(x * c(0.0), c(0.0));
        same(x - x, c(0.0));
        same(x + y, y + x);
        same(x * y, y * x);
        same(y - x, -(x - y));
        same(-x - y, -(x + y));
        same(x * -y, -(x * y));
        same(x / -y, -(x / y));
        same(x - c(2.0), -(c(2.0) - x));
        same(c(2.0) * c(3.0), c(6.0));
        same(c(4.0).reciprocal_above(c(1.0)), c(0.25));
        same(c(0.0).reciprocal_above(c(0.0)), c(0.0));
        same(c(0.0).reciprocal_above(x), c(0.0));
        // The sign of the inverted value decides.
        assert_ne!((-x).reciprocal_above(y).split(), (-(x.reciprocal_above(y))).split());
        same((-x).sin_cos().0, -(x.sin_cos().0));
        same((-x).sin_cos().1, x.sin_cos().1);
        // Rewritings that are not exact are not made.
        let (Expr::Node { id, .. }, true) = ((x + c(1.0)) + c(2.0), true) else { panic!() };
        assert!(matches!(g.get(id).0, Op::Add(Operand::Node(_), Operand::Const(_))));
    }

    #[cfg(feature = "height_fields")]
    #[test]
    fn look_ups_are_shared() {
        static TABLE: [f64; 3] = [1.0, 2.0, 4.0];
        let (g, c) = (Graph::default(), Expr::Const);
        let x = g.input(0);
        let same = |a: Expr, b: Expr| assert_eq!(a.split(), b.split());
        same(c(1.5).look_up(&TABLE, 1), c(4.0));
        same(x.look_up(&TABLE, 1), x.look_up(&TABLE, 1));
        assert_ne!(x.look_up(&TABLE, 1).split(), x.look_up(&TABLE, 0).split());
        assert_ne!(x.look_up(&TABLE, 1).split(), (-x).look_up(&TABLE, 1).split());
    }

    /// The sign that is stored with a node is not that of its value.
    #[test]
    fn roots_of_differences_are_those_of_their_values() {
        let graph = Graph::default();
        let [x, y, z] = [0, 1, 2].map(|k| graph.input(k));
        let results = [Expr::Const(1.0) - x * x, y - x, -(-y - x), -(x * z)].map(Scalar::sqrt);
        let program = crate::symbolic::Program::new(&graph, &results);
        let [x, y, z] = [0.3_f64, 0.7, -0.5];
        let wanted = [1.0 - x * x, y - x, y + x, -(x * z)].map(f64::sqrt);
        assert_eq!(program.evaluate(&[x, y, z], |a, b, c| a * b + c), wanted);
    }
}
