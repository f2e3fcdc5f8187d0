//! Straight-line bodies: one statement for each operation, split into parts where there are many.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::layout::Function;
use super::names::{identifier, quantity};
use crate::options::{Options, Precision};
use crate::plan::Plan;
use crate::symbolic::{Label, Op, Operand, Output};
use crate::trace::{GroupProgram, InputArray};

/// A program with names for its values and places for its results.
pub struct Body<'a> {
    plan: &'a Plan,
    options: &'a Options,
    group: &'a GroupProgram,
    names: BTreeMap<u32, String>,
    results: &'a [String],
}

/// One statement: nodes it defines, and its text.
struct Statement {
    defines: Vec<u32>,
    uses: Vec<u32>,
    label: Label,
    text: String,
}

impl<'a> Body<'a> {
    /// Names every value after its body and quantity, numbered in order.
    pub fn new(plan: &'a Plan, options: &'a Options, group: &'a GroupProgram, results: &'a [String]) -> Self {
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
        Body { plan, options, group, names, results }
    }

    /// Writes the function, and its parts before it if there are any.
    pub fn write(&self, out: &mut String, name: &str, function: &Function) {
        let statements = self.statements();
        let number = self.options.precision.name();
        if statements.len() <= self.options.chunk {
            let _ = writeln!(
                out,
                "{}    pub fn {name}(&self, {}){} {{",
                function.inline(statements.len()),
                function.arguments,
                function.returns
            );
            self.write_statements(out, &statements);
            self.write_results(out, &self.names);
            let _ = writeln!(out, "{}    }}", function.tail);
            return;
        }
        let parts: Vec<&[Statement]> = statements.chunks(self.options.chunk).collect();
        let slots = self.slots(&parts);
        let len = slots.values().max().map_or(0, |m| m + 1);
        let inputs: String = function.inputs.iter().map(|i| format!("{i}, ")).collect();
        let _ = writeln!(out, "    pub fn {name}(&self, {}){} {{", function.arguments, function.returns);
        let _ = writeln!(out, "        let mut kept = [0.0; {len}];");
        for k in 0..parts.len() {
            let _ = writeln!(out, "        self.{name}_part{}({inputs}&mut kept);", k + 1);
        }
        let kept = slots.iter().map(|(id, slot)| (*id, format!("kept[{slot}]"))).collect();
        self.write_results(out, &kept);
        let _ = writeln!(out, "{}    }}", function.tail);
        for (k, part) in parts.iter().enumerate() {
            let _ = writeln!(
                out,
                "\n    #[inline(never)]\n    fn {name}_part{}(&self, {}kept: &mut [{number}; {len}]) {{",
                k + 1,
                function.input_arguments
            );
            let defined: BTreeSet<u32> = part.iter().flat_map(|s| s.defines.iter().copied()).collect();
            let used: BTreeSet<u32> = part.iter().flat_map(|s| s.uses.iter().copied()).collect();
            for id in used.difference(&defined) {
                let _ = writeln!(out, "        let {} = kept[{}];", self.names[id], slots[id]);
            }
            self.write_statements(out, part);
            for id in defined.iter().filter(|id| slots.contains_key(id)) {
                let _ = writeln!(out, "        kept[{}] = {};", slots[id], self.names[id]);
            }
            let _ = writeln!(out, "    }}");
        }
    }

    /// Places for the values that outlive the part that computes them, each used again once its value is dead.
    fn slots(&self, parts: &[&[Statement]]) -> BTreeMap<u32, usize> {
        let mut last: BTreeMap<u32, usize> = BTreeMap::new();
        for (k, part) in parts.iter().enumerate() {
            for id in part.iter().flat_map(|s| &s.uses) {
                last.insert(*id, k);
            }
        }
        for output in &self.group.program.outputs {
            if let Output::Node(id, _) = output {
                last.insert(*id, parts.len());
            }
        }
        let mut slots = BTreeMap::new();
        let mut free: Vec<usize> = Vec::new();
        let mut count = 0;
        for (k, part) in parts.iter().enumerate() {
            for id in part.iter().flat_map(|s| &s.defines) {
                if last.get(id).is_some_and(|&end| end > k) {
                    let slot = free.pop().unwrap_or_else(|| {
                        count += 1;
                        count - 1
                    });
                    slots.insert(*id, slot);
                }
            }
            // Values read for the last time by the next part may be overwritten only after it.
            free.extend(slots.iter().filter(|(id, _)| last[*id] == k).map(|(_, slot)| *slot));
        }
        slots
    }

    fn statements(&self) -> Vec<Statement> {
        let steps = &self.group.program.steps;
        let mut pairs: BTreeMap<u32, (Option<u32>, Option<u32>)> = BTreeMap::new();
        for (id, op, _) in steps {
            match op {
                Op::Sin(a) => pairs.entry(*a).or_default().0 = Some(*id),
                Op::Cos(a) => pairs.entry(*a).or_default().1 = Some(*id),
                _ => {}
            }
        }
        let mut statements = Vec::new();
        for (id, op, label) in steps {
            let uses = op.operands().filter_map(|o| if let Operand::Node(k) = o { Some(k) } else { None }).collect();
            let (defines, text) = match op {
                Op::Sin(a) | Op::Cos(a) => {
                    // The first of a pair to be met stands for both.
                    let Some((s, c)) = pairs.remove(a) else { continue };
                    let name = |id: Option<u32>| id.map_or("_".to_string(), |id| self.names[&id].clone());
                    let call = format!(
                        "{}::trig::sincos_{}({})",
                        self.options.runtime,
                        self.options.precision.name(),
                        self.names[a]
                    );
                    (s.into_iter().chain(c).collect(), format!("let ({}, {}) = {call};", name(s), name(c)))
                }
                op => (vec![*id], format!("let {} = {};", self.names[id], self.expression(op))),
            };
            statements.push(Statement { defines, uses, label: *label, text });
        }
        statements
    }

    fn expression(&self, op: &Op) -> String {
        let text = |o: &Operand| match o {
            Operand::Const(bits) => literal(f64::from_bits(*bits), self.options.precision),
            Operand::Node(id) => self.names[id].clone(),
        };
        match op {
            Op::Input(k) => input_place(&self.group.inputs, *k as usize),
            Op::Add(a, b) => format!("{} + {}", text(a), text(b)),
            Op::Sub(a, b) => format!("{} - {}", text(a), text(b)),
            Op::Mul(a, b) => format!("{} * {}", text(a), text(b)),
            Op::Div(a, b) => format!("{} / {}", text(a), text(b)),
            Op::Fma(f) => {
                let (p, s) = (if f.minus_product { "-" } else { "" }, if f.minus_addend { "-" } else { "+" });
                format!("{p}({} * {}) {s} {}", text(&f.a), text(&f.b), text(&f.c))
            }
            Op::Sqrt(a) => format!("{}::Scalar::sqrt({})", self.options.runtime, self.names[a]),
            Op::Sin(_) | Op::Cos(_) => unreachable!("written as pairs"),
        }
    }

    fn write_statements(&self, out: &mut String, statements: &[Statement]) {
        let mut last = None;
        for s in statements {
            let is_input = s.uses.is_empty();
            if last != Some(s.label) && !is_input {
                let body = s.label.0.map_or("ground", |i| self.plan.nodes[i].name.as_str());
                let _ = writeln!(out, "        // {body}: {}", quantity(s.label.1).1);
                last = Some(s.label);
            }
            let _ = writeln!(out, "        {}", s.text);
        }
    }

    fn write_results(&self, out: &mut String, names: &BTreeMap<u32, String>) {
        for (place, output) in self.results.iter().zip(&self.group.program.outputs) {
            let value = match output {
                Output::Const(x) => {
                    let sign = if *x < 0.0 { "-" } else { "" };
                    format!("{sign}{}", literal(x.abs(), self.options.precision))
                }
                Output::Node(id, neg) => format!("{}{}", if *neg { "-" } else { "" }, names[id]),
            };
            let _ = writeln!(out, "        {place} = {value};");
        }
    }
}

/// A constant as it is written: the shortest decimal that reads back as the same number.
fn literal(x: f64, precision: Precision) -> String {
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

fn input_place(inputs: &[InputArray], k: usize) -> String {
    let (array, k) = locate(inputs, k);
    match array.sixes {
        true => format!("{}[{}][{}]", array.name, k / 6, k % 6),
        false => format!("{}[{k}]", array.name),
    }
}

fn input_name(inputs: &[InputArray], k: usize) -> String {
    let (array, k) = locate(inputs, k);
    format!("{}_{k}", array.name.trim_start_matches("self."))
}
