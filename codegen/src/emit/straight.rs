//! Straight-line bodies: one statement for each operation, in a loop over lanes.
//!
//! The same code serves one state and many: the compiler removes a loop with one iteration, and vectorises a longer
//! one. The body must therefore not contain calls that cannot be inlined: angles come first, and their sines and
//! cosines are computed together before the loop. Functions are not split: compile time is proportional to the number
//! of statements, and parts would pass their values through memory.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::head::Head;
use super::names::{heading, Names};
use super::together::TogetherWriter;
use crate::plan::Plan;
use crate::rolled::Vectors;
use crate::symbolic::angles::{nodes, Angles, Pairs};
use crate::symbolic::{Label, Op, Program, ProgramResult};

/// A program with names for its values and places for its results.
pub struct Straight<'a> {
    plan: &'a Plan,
    head: Head<'a>,
    program: &'a Program,
    names: BTreeMap<u32, String>,
    angles: Angles,
    /// How inputs are read, where they are not those of the function.
    sources: Option<&'a [String]>,
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

impl<'a> Straight<'a> {
    /// Names every value after its body, quantity and component.
    pub fn new(plan: &'a Plan, program: &'a Program, head: Head<'a>) -> Self {
        let names = Names::default().straight(plan, program, head.inputs);
        Straight { plan, head, program, names, angles: Angles::new(program), sources: None }
    }

    #[cfg(feature = "factored")]
    /// Statements of one state whose inputs are read as `sources` say, as the body of a function that has a head of its
    /// own.
    pub fn piece(
        plan: &'a Plan,
        program: &'a Program,
        head: Head<'a>,
        names: BTreeMap<u32, String>,
        sources: &'a [String],
    ) -> Self {
        let angles = Angles { late: crate::symbolic::angles::pairs(program), ..Angles::default() };
        Straight { plan, head, program, names, angles, sources: Some(sources) }
    }

    #[cfg(feature = "factored")]
    /// The statements of a piece, and its results as they are written.
    pub fn write_piece(&self, out: &mut String) -> Vec<String> {
        let all = self.program.steps.iter().map(|(id, ..)| *id).collect();
        self.write_steps(out, &all, true);
        self.program.outputs.iter().map(|result| self.head.value(result, &self.names)).collect()
    }

    /// Writes the function and its kernel, which leaves one state to the function for like branches `together`, if there
    /// is one.
    pub fn write(&self, out: &mut String, together: Option<Vectors>) {
        let statements = self.program.steps.iter().filter(|(_, op, _)| !matches!(op, Op::Input(_))).count();
        self.head.write(out, statements);
        if let Some(vectors) = together {
            let arguments: Vec<&str> = self.head.ports.iter().map(|port| port.name).collect();
            let (rt, name) = (&self.head.options.runtime, TogetherWriter::name(&self.head.signature.name));
            let call = format!("return Self::{name}::<A>({});", arguments.join(", "));
            let condition = match vectors {
                Vectors::Any => "VECTORS",
                Vectors::Wide => "WIDE_VECTORS && A::FUSED",
            };
            let _ =
                writeln!(out, "        if LANES == 1 && {rt}::kernel::{condition} {{\n            {call}\n        }}");
        }
        self.write_sines(out);
        self.write_given(out);
        self.head.locals(out, "        ", "result", self.program.outputs.len());
        let _ = writeln!(out, "        for l in 0..LANES {{");
        self.write_steps(out, &self.angles.after, true);
        self.write_results(out);
        let _ = writeln!(out, "    }}");
    }

    /// Sines and cosines of all angles that depend on inputs only.
    fn write_sines(&self, out: &mut String) {
        let n = self.angles.early.len();
        if n == 0 {
            return;
        }
        let _ = writeln!(out, "        let mut angles = {};\n        for l in 0..LANES {{", self.head.rows(n));
        self.write_steps(out, &self.angles.before, false);
        for (k, angle) in self.angles.early.keys().enumerate() {
            let _ = writeln!(out, "            angles[{k}][l] = {};", self.names[angle]);
        }
        let _ = writeln!(out, "        }}");
        let _ = writeln!(out, "        let (sines, cosines) = {};", self.head.sines_and_cosines("angles", n));
    }

    /// Those of the program's steps that are in a set, in order. Many statements are written in blocks that return the
    /// values that are needed after them: each `let` is a scope inside the one before it, and debug information of
    /// thousands of them is deeper than the compiler's stack.
    fn write_steps(&self, out: &mut String, set: &BTreeSet<u32>, lanes: bool) {
        let mut late = self.angles.late.clone();
        // Inputs are copied for the loop over lanes only.
        let given = match lanes && self.sources.is_none() {
            true => self.given().enumerate().map(|(k, (id, _))| (id, k)).collect(),
            false => BTreeMap::new(),
        };
        let steps = self.program.steps.iter().filter(|(id, _, _)| set.contains(id));
        let statements: Vec<Statement> = steps.filter_map(|step| self.statement(step, &given, &mut late)).collect();
        let chunk = self.head.options.chunk.max(1);
        if statements.len() <= chunk {
            return self.write_statements(out, &statements, lanes, "            ");
        }
        // The chunk in which each value is used last.
        let mut last: BTreeMap<u32, usize> = BTreeMap::new();
        for (k, statement) in statements.iter().enumerate() {
            last.extend(statement.uses.iter().map(|id| (*id, k / chunk)));
        }
        match lanes {
            true => last.extend(self.program.outputs.iter().filter_map(|result| match result {
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
                let _ = writeln!(out, "{indent}// {}", heading(self.plan, statement.label));
                last = Some(statement.label);
            }
            let _ = writeln!(out, "{indent}{}", statement.text);
        }
    }

    fn statement(
        &self,
        (id, op, label): &(u32, Op, Label),
        given: &BTreeMap<u32, usize>,
        late: &mut Pairs,
    ) -> Option<Statement> {
        let (name, is_input) = (&self.names[id], matches!(op, Op::Input(_)));
        let own = |text: String, uses| Some(Statement { text, makes: vec![*id], uses, label: *label, is_input });
        if let Some(k) = given.get(id) {
            return own(format!("let {name} = given_{k}[l];"), Vec::new());
        }
        let (angle, row) = match op {
            Op::Sin(a) => (a, "sines"),
            Op::Cos(a) => (a, "cosines"),
            Op::Input(k) => {
                let from = match self.sources {
                    Some(sources) => sources[*k as usize].clone(),
                    None => self.head.input(*k as usize, "", "l"),
                };
                return own(format!("let {name} = {from};"), Vec::new());
            }
            op => return own(format!("let {name} = {};", self.head.expression(op, &self.names)), nodes(op).collect()),
        };
        if let Some(k) = self.angles.early.keys().position(|a| a == angle) {
            return own(format!("let {name} = {row}[{k}][l];"), Vec::new());
        }
        // The first one of a pair represents both.
        let pair = late.remove(angle)?;
        let names = pair.map(|id| id.map_or("_", |id| self.names[&id].as_str()));
        let text = self.head.sine_and_cosine(names, &self.names[angle]);
        let makes = pair.into_iter().flatten().collect();
        Some(Statement { text, makes, uses: vec![*angle], label: *label, is_input })
    }

    /// Inputs of the loop over lanes.
    fn given(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.program.steps.iter().filter_map(|(id, op, _)| match op {
            Op::Input(k) if self.angles.after.contains(id) => Some((*id, *k)),
            _ => None,
        })
    }

    /// Inputs are copied first, as results are written last: the loop over lanes then uses memory that nothing else can
    /// point to, and the compiler vectorises it without run-time checks for overlap.
    fn write_given(&self, out: &mut String) {
        self.head.locals(out, "        ", "given", self.given().count());
        for (to, (_, k)) in self.given().enumerate() {
            let from = self.head.input(k as usize, "", "l");
            let _ = writeln!(out, "        for l in 0..LANES {{ given_{to}[l] = {from}; }}");
        }
    }

    /// Results are collected in arrays before they are written to the arguments.
    fn write_results(&self, out: &mut String) {
        for (k, result) in self.program.outputs.iter().enumerate() {
            let value = self.head.value(result, &self.names);
            let _ = writeln!(out, "            result_{k}[l] = {value};");
        }
        let _ = writeln!(out, "        }}");
        let places = self.head.places();
        let mut at = 0;
        while let Some((name, k)) = places.get(at) {
            // Two at once where they stand beside one another.
            at += match places.get(at + 1) {
                Some((next, _)) if next == name => {
                    let _ = writeln!(out, "        {name}.give_pair({k}, [&result_{at}, &result_{}]);", at + 1);
                    2
                }
                _ => {
                    let _ = writeln!(out, "        {name}.give({k}, &result_{at});");
                    1
                }
            };
        }
    }
}
