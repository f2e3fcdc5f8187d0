//! Straight-line bodies: one statement for each operation, in a loop over lanes.
//!
//! One text serves one state and many: the compiler drops a loop of one turn, and makes vector instructions of a longer
//! one. For that the body has no calls that it cannot inline: angles come first, and their sines and cosines are computed
//! together, before the loop. No function is split: compile time grows in proportion to the number of statements, and parts
//! would hand their values over in memory.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::layout::Function;
use super::names::{identifier, quantity};
use super::ports::{self, Port};
use crate::options::{Arithmetic, Options, Precision};
use crate::plan::Plan;
use crate::symbolic::{FlooredReciprocal, Fma, Label, Op, Operand, ProgramResult};
use crate::trace::{InputArray, OutputProgram};

/// What every function begins with.
pub struct Head<'a> {
    /// How code is generated.
    pub options: &'a Options,
    /// Name of the function.
    pub name: &'a str,
    /// Number of its kernel.
    pub id: usize,
    /// Its signature.
    pub function: &'a Function,
    /// What the kernel reads and writes.
    pub ports: &'a [Port],
}

impl Head<'_> {
    /// Whether the kernel computes what the target computes best; otherwise the same everywhere.
    fn chooses(&self) -> bool {
        self.options.arithmetic == Arithmetic::Fast
    }

    /// Arithmetic of sines and cosines.
    pub fn arithmetic(&self) -> String {
        match self.chooses() {
            true => "A".to_string(),
            false => format!("{}::kernel::Plain", self.options.runtime),
        }
    }

    /// Writes the function, and the first line of its kernel.
    pub fn write(&self, out: &mut String, statements: usize) {
        let rt = &self.options.runtime;
        let (name, id, function) = (self.name, self.id, self.function);
        let _ = writeln!(
            out,
            "{}    pub fn {name}(&self, {}){} {{",
            function.inline(statements),
            function.arguments,
            function.returns
        );
        let arguments: Vec<&str> = self.ports.iter().map(|p| p.argument.as_str()).collect();
        let call = match self.chooses() {
            true => format!(
                "{rt}::kernel::call::<Self, {id}, _>(({}))",
                arguments.iter().map(|a| format!("{a}, ")).collect::<String>().trim_end()
            ),
            false => format!("Self::{name}_kernel::<{rt}::kernel::Plain, 1>({})", arguments.join(", ")),
        };
        match self.ports.iter().find(|p| p.returned) {
            Some(port) => {
                let (place, dims) = (&port.name, &port.dims);
                let _ = writeln!(out, "        let mut {place} = {};", ports::nested(dims, "0.0"));
                let _ = writeln!(out, "        {call};\n        {place}\n    }}");
            }
            None => {
                let _ = writeln!(out, "        {call};\n    }}");
            }
        }
        let _ = writeln!(out, "\n    #[inline(always)]");
        let _ = writeln!(
            out,
            "    fn {name}_kernel<A: {rt}::kernel::Arithmetic, const LANES: usize>({}) {{",
            self.parameters()
        );
    }

    /// Parameters of the kernel.
    pub fn parameters(&self) -> String {
        let (rt, number) = (&self.options.runtime, self.options.precision.name());
        self.ports.iter().map(|p| p.parameter(rt, number)).collect::<Vec<_>>().join(", ")
    }

    /// A kernel's own array.
    pub fn rows(&self, n: usize) -> String {
        format!("{}::kernel::Rows([[0.0; LANES]; {n}])", self.options.runtime)
    }

    /// Places of the results in order: port and number in it.
    pub fn places(&self) -> Vec<(&str, usize)> {
        let places = self.ports.iter().filter(|p| p.mutable);
        places.flat_map(|p| (0..p.dims.iter().product()).map(move |k: usize| (p.name.as_str(), k))).collect()
    }

    /// Right-hand side of an operation; inputs, sines and cosines are written by the caller.
    pub fn expression(&self, op: &Op, names: &BTreeMap<u32, String>) -> String {
        let text = |o: &Operand| match o {
            Operand::Const(bits) => literal(f64::from_bits(*bits), self.options.precision),
            Operand::Node(id) => names[id].clone(),
        };
        let minus = |yes: &bool| if *yes { "-" } else { "" };
        match op {
            Op::Add(a, b) => format!("{} + {}", text(a), text(b)),
            Op::Sub(a, b) => format!("{} - {}", text(a), text(b)),
            Op::Mul(a, b) => format!("{} * {}", text(a), text(b)),
            Op::Div(a, b) => format!("{} / {}", text(a), text(b)),
            Op::Fma(Fma { a, b, c, minus_product, minus_addend }) => {
                let (a, b, c) = (text(a), text(b), text(c));
                let number = self.options.precision.name();
                format!("A::fma_{number}({}{a}, {b}, {}{c})", minus(minus_product), minus(minus_addend))
            }
            Op::ReciprocalAbove(FlooredReciprocal { value, floor, minus_value, minus_floor }) => {
                let (value, floor) = (text(value), text(floor));
                let (rt, v, f) = (&self.options.runtime, minus(minus_value), minus(minus_floor));
                format!("{rt}::Scalar::reciprocal_above({v}{value}, {f}{floor})")
            }
            Op::Sqrt(a) => format!("{}::Scalar::sqrt({})", self.options.runtime, names[a]),
            Op::Input(_) | Op::Sin(_) | Op::Cos(_) => unreachable!("written by the caller"),
        }
    }

    /// An output of a program as it is written.
    pub fn value(&self, output: &ProgramResult, names: &BTreeMap<u32, String>) -> String {
        match output {
            ProgramResult::Const(x) => self.constant(*x),
            ProgramResult::Node(id, neg) => format!("{}{}", if *neg { "-" } else { "" }, names[id]),
        }
    }

    /// A constant with its sign; zeros have none.
    pub fn constant(&self, x: f64) -> String {
        let sign = if x < 0.0 { "-" } else { "" };
        format!("{sign}{}", literal(x.abs(), self.options.precision))
    }
}

/// An input of a function as a kernel reads it, in lane `lane`; the number may be a term to be added.
pub fn input(inputs: &[InputArray], k: usize, more: &str, lane: &str) -> String {
    let (array, k) = locate(inputs, k);
    format!("{}.get({k}{more}, {lane})", ports::local(&array.name))
}

/// A program with names for its values and places for its results.
pub struct Body<'a> {
    plan: &'a Plan,
    head: Head<'a>,
    group: &'a OutputProgram,
    names: BTreeMap<u32, String>,
    angles: Angles,
}

/// A `let`.
struct Statement {
    text: String,
    /// Nodes that it gives values to, and those that it needs.
    makes: Vec<u32>,
    uses: Vec<u32>,
    label: Label,
    is_input: bool,
}

/// Sines and cosines of a program.
#[derive(Default)]
struct Angles {
    /// Angles that follow from inputs by sums and products, with the nodes of sine and cosine.
    early: BTreeMap<u32, [Option<u32>; 2]>,
    /// The others.
    late: BTreeMap<u32, [Option<u32>; 2]>,
    /// Nodes that early angles need.
    before: BTreeSet<u32>,
    /// Nodes that the rest needs.
    after: BTreeSet<u32>,
}

impl Angles {
    fn new(group: &OutputProgram) -> Angles {
        let mut angles = Angles::default();
        let mut all: BTreeMap<u32, [Option<u32>; 2]> = BTreeMap::new();
        // Nodes that do not follow from inputs by sums and products.
        let mut involved = BTreeSet::new();
        for (id, op, _) in &group.program.steps {
            match op {
                Op::Sin(a) => all.entry(*a).or_default()[0] = Some(*id),
                Op::Cos(a) => all.entry(*a).or_default()[1] = Some(*id),
                _ => {}
            }
            let inner = |o| matches!(o, Operand::Node(k) if involved.contains(&k));
            let divides = matches!(op, Op::Sqrt(_) | Op::Div(..) | Op::ReciprocalAbove(_));
            if divides || matches!(op, Op::Sin(_) | Op::Cos(_)) || op.operands().any(inner) {
                involved.insert(*id);
            }
        }
        (angles.late, angles.early) = all.into_iter().partition(|(a, _)| involved.contains(a));
        angles.before.extend(angles.early.keys());
        for output in &group.program.outputs {
            if let ProgramResult::Node(id, _) = output {
                angles.after.insert(*id);
            }
        }
        for (id, op, _) in group.program.steps.iter().rev() {
            let nodes = || op.operands().filter_map(|o| if let Operand::Node(k) = o { Some(k) } else { None });
            if angles.before.contains(id) {
                angles.before.extend(nodes());
            }
            let early = matches!(op, Op::Sin(a) | Op::Cos(a) if angles.early.contains_key(a));
            if angles.after.contains(id) && !early {
                angles.after.extend(nodes());
            }
        }
        angles
    }
}

impl<'a> Body<'a> {
    /// Names every value after its body and quantity, numbered in order.
    pub fn new(plan: &'a Plan, group: &'a OutputProgram, head: Head<'a>) -> Self {
        let bodies: Vec<String> = plan.nodes.iter().map(|n| identifier(&n.name)).collect();
        let mut next: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        let mut names = BTreeMap::new();
        for (id, op, (node, what)) in &group.program.steps {
            let body = node.map_or("ground", |i| bodies[i].as_str());
            let short = match op {
                Op::Input(k) => {
                    names.insert(*id, input_name(&group.inputs, *k as usize));
                    continue;
                }
                Op::Sin(_) => "sin",
                Op::Cos(_) => "cos",
                _ => quantity(*what).0,
            };
            let number = next.entry((body, short)).or_default();
            names.insert(*id, format!("{body}_{short}{number}"));
            *number += 1;
        }
        Body { plan, head, group, names, angles: Angles::new(group) }
    }

    /// Writes the function and its kernel.
    pub fn write(&self, out: &mut String) {
        let statements = self.group.program.steps.iter().filter(|(_, op, _)| !matches!(op, Op::Input(_))).count();
        self.head.write(out, statements);
        self.write_sines(out);
        self.write_given(out);
        let n = self.group.program.outputs.len();
        if n > 0 {
            let _ = writeln!(out, "        let mut results = {};", self.head.rows(n));
        }
        let _ = writeln!(out, "        for l in 0..LANES {{");
        self.write_steps(out, &self.angles.after, true);
        self.write_results(out);
        let _ = writeln!(out, "    }}");
    }

    /// Sines and cosines of all angles that are known from the start.
    fn write_sines(&self, out: &mut String) {
        let n = self.angles.early.len();
        if n == 0 {
            return;
        }
        let (rt, number) = (&self.head.options.runtime, self.head.options.precision.name());
        let _ = writeln!(out, "        let mut angles = {};\n        for l in 0..LANES {{", self.head.rows(n));
        self.write_steps(out, &self.angles.before, false);
        for (k, angle) in self.angles.early.keys().enumerate() {
            let _ = writeln!(out, "            angles[{k}][l] = {};", self.names[angle]);
        }
        let _ = writeln!(out, "        }}");
        let arithmetic = self.head.arithmetic();
        let call = format!("{rt}::trig::pairs_{number}::<{arithmetic}, LANES, {n}>(&angles)");
        let _ = writeln!(out, "        let (sines, cosines) = {call};");
    }

    /// Those of the program's steps that are in a set, in order. Many are written in blocks that hand on what is needed
    /// behind them: each `let` is a scope inside the one before it, and debug information of thousands of them is deeper
    /// than the compiler's stack.
    fn write_steps(&self, out: &mut String, set: &BTreeSet<u32>, lanes: bool) {
        let mut late = self.angles.late.clone();
        // Only the loop over lanes has its inputs copied.
        let given = match lanes {
            true => self.given().enumerate().map(|(k, (id, _))| (id, k)).collect(),
            false => BTreeMap::new(),
        };
        let steps = self.group.program.steps.iter().filter(|(id, _, _)| set.contains(id));
        let statements: Vec<Statement> = steps.filter_map(|step| self.statement(step, &given, &mut late)).collect();
        let chunk = self.head.options.chunk;
        if statements.len() <= chunk {
            return self.write_statements(out, &statements, lanes, "            ");
        }
        // What is used at last, and in which chunk.
        let mut last: BTreeMap<u32, usize> = BTreeMap::new();
        for (k, statement) in statements.iter().enumerate() {
            last.extend(statement.uses.iter().map(|id| (*id, k / chunk)));
        }
        match lanes {
            true => last.extend(self.group.program.outputs.iter().filter_map(|output| match output {
                ProgramResult::Node(id, _) => Some((*id, usize::MAX)),
                ProgramResult::Const(_) => None,
            })),
            false => last.extend(self.angles.early.keys().map(|id| (*id, usize::MAX))),
        }
        for (k, statements) in statements.chunks(chunk).enumerate() {
            let made = statements.iter().flat_map(|s| &s.makes);
            let kept = made.filter(|id| last.get(id).is_some_and(|use_| *use_ > k));
            let kept: Vec<&str> = kept.map(|id| self.names[id].as_str()).collect();
            let kept = match kept[..] {
                [one] => one.to_string(),
                _ => format!("({})", kept.join(", ")),
            };
            let _ = writeln!(out, "            let {kept} = {{");
            self.write_statements(out, statements, lanes, "                ");
            let _ = writeln!(out, "                {kept}\n            }};");
        }
    }

    fn write_statements(&self, out: &mut String, statements: &[Statement], headings: bool, indent: &str) {
        let mut last = None;
        for statement in statements {
            if headings && last != Some(statement.label) && !statement.is_input {
                let (node, what) = statement.label;
                let body = node.map_or("ground", |i| self.plan.nodes[i].name.as_str());
                let _ = writeln!(out, "{indent}// {body}: {}", quantity(what).1);
                last = Some(statement.label);
            }
            let _ = writeln!(out, "{indent}{}", statement.text);
        }
    }

    fn statement(
        &self,
        (id, op, label): &(u32, Op, Label),
        given: &BTreeMap<u32, usize>,
        late: &mut BTreeMap<u32, [Option<u32>; 2]>,
    ) -> Option<Statement> {
        let (name, is_input) = (&self.names[id], matches!(op, Op::Input(_)));
        let own = |text: String, uses| Some(Statement { text, makes: vec![*id], uses, label: *label, is_input });
        if let Some(k) = given.get(id) {
            return own(format!("let {name} = given[{k}][l];"), Vec::new());
        }
        let (angle, row) = match op {
            Op::Sin(a) => (a, "sines"),
            Op::Cos(a) => (a, "cosines"),
            op => {
                let nodes = op.operands().filter_map(|o| if let Operand::Node(k) = o { Some(k) } else { None });
                return own(format!("let {name} = {};", self.expression(op)), nodes.collect());
            }
        };
        if let Some(k) = self.angles.early.keys().position(|a| a == angle) {
            return own(format!("let {name} = {row}[{k}][l];"), Vec::new());
        }
        // The first of a pair to be met stands for both.
        let pair = late.remove(angle)?;
        let [s, c] = pair.map(|id| id.map_or("_", |id| self.names[&id].as_str()));
        let (rt, number) = (&self.head.options.runtime, self.head.options.precision.name());
        let arithmetic = self.head.arithmetic();
        let text = format!("let ({s}, {c}) = {rt}::trig::pair_{number}::<{arithmetic}>({});", self.names[angle]);
        Some(Statement {
            text,
            makes: pair.into_iter().flatten().collect(),
            uses: vec![*angle],
            label: *label,
            is_input,
        })
    }

    fn expression(&self, op: &Op) -> String {
        match op {
            Op::Input(k) => input(&self.group.inputs, *k as usize, "", "l"),
            op => self.head.expression(op, &self.names),
        }
    }

    /// Inputs of the loop over lanes.
    fn given(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.group.program.steps.iter().filter_map(|(id, op, _)| match op {
            Op::Input(k) if self.angles.after.contains(id) => Some((*id, *k)),
            _ => None,
        })
    }

    /// Inputs are copied first, as results are written last: the loop over lanes then uses memory that nothing else can
    /// point to, and the compiler makes vector instructions of it without asking at run time what overlaps.
    fn write_given(&self, out: &mut String) {
        let n = self.given().count();
        if n > 0 {
            let _ = writeln!(out, "        let mut given = {};", self.head.rows(n));
        }
        for (to, (_, k)) in self.given().enumerate() {
            let (array, k) = locate(&self.group.inputs, k as usize);
            let from = ports::local(&array.name);
            let _ = writeln!(out, "        for l in 0..LANES {{ given[{to}][l] = {from}.get({k}, l); }}");
        }
    }

    /// Results are gathered in an array before they are handed over.
    fn write_results(&self, out: &mut String) {
        for (k, output) in self.group.program.outputs.iter().enumerate() {
            let value = self.head.value(output, &self.names);
            let _ = writeln!(out, "            results[{k}][l] = {value};");
        }
        let _ = writeln!(out, "        }}");
        for (result, (name, k)) in self.head.places().into_iter().enumerate() {
            let _ = writeln!(out, "        {name}.give({k}, &results[{result}]);");
        }
    }
}

/// A constant as it is written: the shortest decimal that reads back as the same number.
pub(super) fn literal(x: f64, precision: Precision) -> String {
    match precision {
        Precision::F64 => format!("{x:?}"),
        Precision::F32 => format!("{:?}", x as f32),
    }
}

fn locate(inputs: &[InputArray], mut k: usize) -> (&InputArray, usize) {
    for array in inputs {
        if k < array.len {
            return (array, k);
        }
        k -= array.len;
    }
    unreachable!("inputs are numbered through their arrays")
}

fn input_name(inputs: &[InputArray], k: usize) -> String {
    let (array, k) = locate(inputs, k);
    format!("{}_{k}", ports::local(&array.name))
}
