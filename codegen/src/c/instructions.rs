//! Single instructions as statements of C.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::names::{comment, literal, number, Prefix};
use crate::emit::names::heading;
use crate::lower::{Array, Instructions, Operation, Place};
use crate::options::Precision;
use crate::plan::Plan;
use crate::symbolic::Label;

/// An expression.
#[derive(Clone, Debug)]
pub struct Value {
    pub text: String,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// A name or a constant.
    Simple,
    /// An entry of an array.
    Entry,
    /// Something with operators.
    Compound,
}

impl Value {
    pub fn simple(text: impl Into<String>) -> Value {
        Value { text: text.into(), kind: Kind::Simple }
    }

    /// As an operand of `*`, `/` or a sign.
    fn factor(&self) -> String {
        match self.kind {
            Kind::Compound if !self.is_negated() => format!("({})", self.text),
            _ => self.text.clone(),
        }
    }

    /// Whether it is a sign before a name, an entry or a constant.
    fn is_negated(&self) -> bool {
        self.text.starts_with('-') && !self.text.contains(' ')
    }

    fn negated(&self) -> Value {
        match self.is_negated() {
            true => Value::simple(&self.text[1..]),
            false => Value { text: format!("-{}", self.factor()), kind: Kind::Compound },
        }
    }
}

/// Writes statements of a body.
pub struct Writer<'a> {
    pub prefix: &'a Prefix,
    pub precision: Precision,
    /// Input and result arrays.
    pub inputs: Vec<String>,
    pub results: Vec<String>,
    /// Names of the values of each block, and the plan whose bodies stand in headings.
    pub names: Vec<BTreeMap<u32, String>>,
    pub plan: Option<&'a Plan>,
    /// Whether each operation gets a name of its own, `t0`.
    pub temporaries: bool,
    /// Whether `a * b + c` has to be rounded once.
    pub fused: bool,
    /// The statements.
    pub out: String,
    /// Input arrays that are read.
    pub read: BTreeSet<usize>,
    /// Number of names that were made.
    pub made: usize,
    pub depth: usize,
    pub loops: usize,
    /// Whether the names of each block have a scope of their own; the block whose scope is open; the last heading.
    pub scoped: bool,
    pub block: Option<usize>,
    pub label: Option<Label>,
}

impl<'a> Writer<'a> {
    /// A writer of a body in braces without arrays and names.
    pub fn new(prefix: &'a Prefix, precision: Precision) -> Writer<'a> {
        let (inputs, results, names, out, read) = Default::default();
        Writer {
            prefix,
            precision,
            inputs,
            results,
            names,
            plan: None,
            temporaries: false,
            fused: false,
            out,
            read,
            made: 0,
            depth: 1,
            loops: 0,
            scoped: false,
            block: None,
            label: None,
        }
    }

    pub fn line(&mut self, text: &str) {
        let _ = writeln!(self.out, "{:indent$}{text}", "", indent = 4 * self.depth);
    }

    fn entry(&mut self, place: Place<usize>) -> String {
        let array = match place.array {
            Array::Input(k) => {
                self.read.insert(k);
                self.inputs[k].clone()
            }
            Array::Result(k) => self.results[k].clone(),
            Array::Spilled => unreachable!("the compiler of C decides what stays in registers"),
            Array::Kept => "kept".to_string(),
            Array::Angles => "angles".to_string(),
            Array::Sines => "sines".to_string(),
            Array::Cosines => "cosines".to_string(),
            Array::Rows(run) => format!("rows{run}"),
            Array::Table(run) => format!("table{run}"),
        };
        let index = match (place.at, place.turn) {
            (at, None) => at.to_string(),
            (0, Some((turn, 1))) => format!("k{turn}"),
            (0, Some((turn, stride))) => format!("{stride} * k{turn}"),
            (at, Some((turn, 1))) => format!("{at} + k{turn}"),
            (at, Some((turn, stride))) => format!("{at} + {stride} * k{turn}"),
        };
        format!("{array}[{index}]")
    }

    /// `const` definition of a value.
    fn define(&mut self, name: String, value: &Value) -> Value {
        let number = number(self.precision);
        self.line(&format!("const {number} {name} = {};", value.text));
        Value::simple(name)
    }

    /// A number for names of arrays and loops.
    fn next(&mut self) -> usize {
        self.made += 1;
        self.made - 1
    }

    /// Opens the scope of a block. A loop is one by itself.
    fn open(&mut self, block: usize) {
        if self.scoped && self.loops == 0 && self.block != Some(block) {
            self.close();
            self.line("{");
            self.depth += 1;
            self.block = Some(block);
        }
    }

    /// Closes the scope of the last block.
    pub fn close(&mut self) {
        self.label = None;
        if self.block.take().is_some() {
            self.depth -= 1;
            self.line("}");
        }
    }
}

impl Instructions for Writer<'_> {
    type Value = Value;
    /// The number in the name of the index.
    type Turn = usize;
    /// Names of what is carried.
    type Loop = Vec<String>;

    fn constant(&mut self, x: f64) -> Value {
        let text = literal(x, self.precision);
        let kind = if text.starts_with('-') { Kind::Compound } else { Kind::Simple };
        Value { text, kind }
    }

    fn load(&mut self, place: Place<usize>) -> Value {
        Value { text: self.entry(place), kind: Kind::Entry }
    }

    fn store(&mut self, place: Place<usize>, value: Value) {
        let entry = self.entry(place);
        self.line(&format!("{entry} = {};", value.text));
    }

    fn operation(&mut self, operation: Operation<Value>) -> Value {
        let prefix = self.prefix;
        let sum = |a: String, b: &Value| match b.is_negated() {
            true => format!("{a} - {}", &b.text[1..]),
            false => format!("{a} + {}", b.factor()),
        };
        let text = match operation {
            Operation::Add(a, b) => sum(a.factor(), &b),
            Operation::Sub(a, b) => format!("{} - {}", a.factor(), b.factor()),
            Operation::Mul(a, b) => format!("{} * {}", a.factor(), b.factor()),
            Operation::Div(a, b) => format!("{} / {}", a.factor(), b.factor()),
            Operation::Fma(a, b, c) if self.fused => {
                format!("{}_FMA({}, {}, {})", prefix.upper, a.text, b.text, c.text)
            }
            Operation::Fma(a, b, c) => sum(format!("{} * {}", a.factor(), b.factor()), &c),
            Operation::Negate(a) if !self.temporaries => return a.negated(),
            Operation::Negate(a) => a.negated().text,
            Operation::ReciprocalAbove { value, floor } => {
                format!("{}_reciprocal_above({}, {})", prefix.lower, value.text, floor.text)
            }
            #[cfg(feature = "height_fields")]
            Operation::LookUp { .. } => unreachable!("only contacts look numbers up, and C has none"),
            Operation::Sqrt(a) => format!("{}_SQRT({})", prefix.upper, a.text),
        };
        let value = Value { text, kind: Kind::Compound };
        if !self.temporaries {
            return value;
        }
        let name = format!("t{}", self.next());
        self.define(name, &value)
    }

    fn sines(&mut self, angles: &[Value]) -> Vec<[Value; 2]> {
        let (k, number, prefix, n) = (self.next(), number(self.precision), &self.prefix.lower, angles.len());
        if let [angle] = angles {
            self.line(&format!("{number} sine{k};"));
            self.line(&format!("{number} cosine{k};"));
            self.line(&format!("{prefix}_sine_cosine({}, &sine{k}, &cosine{k});", angle.text));
            return vec![["sine", "cosine"].map(|name| Value::simple(format!("{name}{k}")))];
        }
        let list: Vec<&str> = angles.iter().map(|angle| angle.text.as_str()).collect();
        self.line(&format!("const {number} angles{k}[{n}] = {{ {} }};", list.join(", ")));
        self.line(&format!("{number} sines{k}[{n}];"));
        self.line(&format!("{number} cosines{k}[{n}];"));
        self.line(&format!("{prefix}_sines_cosines(angles{k}, sines{k}, cosines{k}, {n});"));
        let entry = |name, at| Value { text: format!("{name}{k}[{at}]"), kind: Kind::Entry };
        (0..n).map(|at| ["sines", "cosines"].map(|name| entry(name, at))).collect()
    }

    fn sines_of_array(&mut self, n: usize) {
        self.line(&format!("{}_sines_cosines(angles, sines, cosines, {n});", self.prefix.lower));
    }

    fn open_loop(&mut self, turns: usize, backward: bool, start: Vec<Value>) -> (Vec<String>, usize, Vec<Value>) {
        let (turn, number) = (self.next(), number(self.precision));
        self.close();
        let names: Vec<String> = (0..start.len()).map(|k| format!("carried{turn}x{k}")).collect();
        for (name, start) in names.iter().zip(start) {
            self.line(&format!("{number} {name} = {};", start.text));
        }
        match backward {
            true => self.line(&format!("for (int k{turn} = {}; k{turn} >= 0; k{turn}--) {{", turns - 1)),
            false => self.line(&format!("for (int k{turn} = 0; k{turn} < {turns}; k{turn}++) {{")),
        }
        self.depth += 1;
        self.loops += 1;
        let carried = names.iter().map(Value::simple).collect();
        (names, turn, carried)
    }

    fn close_loop(&mut self, names: Vec<String>, next: Vec<Value>) -> Vec<Value> {
        for (name, next) in names.iter().zip(next) {
            if next.text != *name {
                self.line(&format!("{name} = {};", next.text));
            }
        }
        self.depth -= 1;
        self.loops -= 1;
        self.line("}");
        names.into_iter().map(Value::simple).collect()
    }

    fn named(&mut self, block: usize, id: u32, label: Label, value: Value) -> Value {
        self.open(block);
        if let Some(plan) = self.plan.filter(|_| self.loops == 0 && value.kind != Kind::Entry) {
            if self.label != Some(label) {
                self.line(&format!("/* {} */", comment(&heading(plan, label))));
                self.label = Some(label);
            }
        }
        let name = self.names[block][&id].clone();
        self.define(name, &value)
    }
}
