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
use crate::symbolic::angles::{nodes, with_operands, Angles, Pairs};
use crate::symbolic::{Label, Op, Program, ProgramResult};

/// Places in memory that a loop may use: LLVM compares no more than 250 with each other (`alias-set-saturation-threshold`).
pub(super) const LOCATIONS: usize = 250;

/// A program with names for its values and places for its results.
pub struct Straight<'a> {
    plan: &'a Plan,
    head: Head<'a>,
    program: &'a Program,
    names: BTreeMap<u32, String>,
    angles: Angles,
    /// Number of the inputs that the loop over lanes reads.
    given: usize,
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
        let angles = Angles::new(program);
        let straight = Straight { plan, head, program, names, angles, given: 0, sources: None };
        Straight { given: straight.given().count(), ..straight }
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
        Straight { plan, head, program, names, angles, given: 0, sources: Some(sources) }
    }

    #[cfg(feature = "factored")]
    /// The statements of a piece, and its results as they are written.
    pub fn write_piece(&self, out: &mut String) -> Vec<String> {
        let all = self.program.steps.iter().map(|(id, ..)| *id).collect();
        self.write_steps(out, &all, &BTreeMap::new(), true);
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
        if self.in_one_array() {
            let rows = self.head.rows(self.locations());
            let _ = writeln!(out, "        let mut rows = {rows};");
        }
        self.write_sines(out);
        let copied = self.write_given(out);
        if !self.in_one_array() {
            self.head.locals(out, "        ", "result", self.program.outputs.len());
        }
        let _ = writeln!(out, "        for l in 0..LANES {{");
        self.write_steps(out, &self.angles.after, &copied, true);
        self.write_results(out);
        let _ = writeln!(out, "    }}");
    }

    /// Numbers that the loop over lanes reads and writes: inputs, results, sines and cosines.
    fn locations(&self) -> usize {
        self.given + self.program.outputs.len() + 2 * self.angles.early.len()
    }

    /// Whether they are rows of one array.
    fn in_one_array(&self) -> bool {
        self.locations() > LOCATIONS
    }

    /// The row of an input of the loop over lanes, or of one of its results.
    fn row(&self, name: &str, k: usize) -> String {
        match (self.in_one_array(), name) {
            (false, _) => format!("{name}_{k}"),
            (true, "result") => format!("rows[{}]", self.given + k),
            (true, _) => format!("rows[{k}]"),
        }
    }

    /// The row of the sine or cosine of an angle that is known before the loop.
    fn row_of_angle(&self, row: &str, k: usize) -> String {
        let before = self.given + self.program.outputs.len();
        match (self.in_one_array(), row) {
            (false, _) => format!("{row}[{k}]"),
            (true, "sines") => format!("rows[{}]", before + k),
            (true, _) => format!("rows[{}]", before + self.angles.early.len() + k),
        }
    }

    /// Sines and cosines of all angles that depend on inputs only.
    fn write_sines(&self, out: &mut String) {
        let n = self.angles.early.len();
        if n == 0 {
            return;
        }
        let _ = writeln!(out, "        let mut angles = {};", self.head.rows(n));
        let mut copied = self.write_plain_angles(out);
        let composite: Vec<(usize, u32)> =
            self.angles.early.keys().copied().enumerate().filter(|(_, angle)| !copied.contains_key(angle)).collect();
        if !composite.is_empty() {
            let steps = with_operands(self.program, composite.iter().map(|(_, angle)| *angle).collect());
            // No vectors are made of a loop whose inputs may overlap with what it writes. In one array, its rows are free until the
            // inputs of the other loop are copied.
            let read: Vec<(u32, u32)> = self.given_of(&steps).filter(|(id, _)| !copied.contains_key(id)).collect();
            if !self.in_one_array() {
                self.head.locals(out, "        ", "read", read.len());
            }
            if !self.in_one_array() || read.len() <= self.locations() {
                copied.extend(self.write_copies(out, "read", read.into_iter()));
            }
            let _ = writeln!(out, "        for l in 0..LANES {{");
            self.write_steps(out, &steps, &copied, false);
            for (k, angle) in composite {
                let _ = writeln!(out, "            angles[{k}][l] = {};", self.names[&angle]);
            }
            let _ = writeln!(out, "        }}");
        }
        let _ = writeln!(out, "        let (sines, cosines) = {};", self.head.sines_and_cosines("angles", n));
        if self.in_one_array() {
            for (name, k) in ["sines", "cosines"].into_iter().flat_map(|name| (0..n).map(move |k| (name, k))) {
                let _ = writeln!(out, "        {} = {name}[{k}];", self.row_of_angle(name, k));
            }
        }
    }

    /// Copies inputs that are angles to the rows of these, and tells which.
    fn write_plain_angles(&self, out: &mut String) -> BTreeMap<u32, String> {
        let inputs: BTreeMap<u32, u32> = self.given_of(&self.angles.before).collect();
        let mut copied = BTreeMap::new();
        for (k, angle) in self.angles.early.keys().enumerate() {
            let Some(input) = inputs.get(angle) else { continue };
            let from = self.head.input(*input as usize, "", "l");
            let _ = writeln!(out, "        for l in 0..LANES {{ angles[{k}][l] = {from}; }}");
            copied.insert(*angle, format!("angles[{k}]"));
        }
        copied
    }

    /// Those of the program's steps that are in a set, in order. Many statements are written in blocks that return the
    /// values that are needed after them: each `let` is a scope inside the one before it, and debug information of
    /// thousands of them is deeper than the compiler's stack.
    fn write_steps(&self, out: &mut String, set: &BTreeSet<u32>, copied: &BTreeMap<u32, String>, lanes: bool) {
        let mut late = self.angles.late.clone();
        let steps = self.program.steps.iter().filter(|(id, _, _)| set.contains(id));
        let statements: Vec<Statement> = steps.filter_map(|step| self.statement(step, copied, &mut late)).collect();
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
        copied: &BTreeMap<u32, String>,
        late: &mut Pairs,
    ) -> Option<Statement> {
        let (name, is_input) = (&self.names[id], matches!(op, Op::Input(_)));
        let own = |text: String, uses| Some(Statement { text, makes: vec![*id], uses, label: *label, is_input });
        if let Some(row) = copied.get(id) {
            return own(format!("let {name} = {row}[l];"), Vec::new());
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
            return own(format!("let {name} = {}[l];", self.row_of_angle(row, k)), Vec::new());
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
        self.given_of(&self.angles.after)
    }

    /// Inputs among some steps: node, and number of the input.
    fn given_of<'s>(&'s self, set: &'s BTreeSet<u32>) -> impl Iterator<Item = (u32, u32)> + 's {
        self.program.steps.iter().filter_map(|(id, op, _)| match op {
            Op::Input(k) if set.contains(id) => Some((*id, *k)),
            _ => None,
        })
    }

    /// Inputs are copied first, as results are written last: the loop over lanes then uses memory that nothing else can
    /// point to, and the compiler vectorises it without run-time checks for overlap.
    fn write_given(&self, out: &mut String) -> BTreeMap<u32, String> {
        if !self.in_one_array() {
            self.head.locals(out, "        ", "given", self.given);
        }
        self.write_copies(out, "given", self.given())
    }

    /// Copies inputs into rows, and tells which.
    fn write_copies(
        &self,
        out: &mut String,
        name: &str,
        inputs: impl Iterator<Item = (u32, u32)>,
    ) -> BTreeMap<u32, String> {
        let copy = |(to, (id, k)): (usize, (u32, u32))| {
            let (row, from) = (self.row(name, to), self.head.input(k as usize, "", "l"));
            let _ = writeln!(out, "        for l in 0..LANES {{ {row}[l] = {from}; }}");
            (id, row)
        };
        inputs.enumerate().map(copy).collect()
    }

    /// Results are collected in arrays before they are written to the arguments.
    fn write_results(&self, out: &mut String) {
        for (k, result) in self.program.outputs.iter().enumerate() {
            let value = self.head.value(result, &self.names);
            let _ = writeln!(out, "            {}[l] = {value};", self.row("result", k));
        }
        let _ = writeln!(out, "        }}");
        let places = self.head.places();
        let mut at = 0;
        while let Some((name, k)) = places.get(at) {
            // Two at once where they stand beside one another.
            at += match places.get(at + 1) {
                Some((next, _)) if next == name => {
                    let [first, second] = [at, at + 1].map(|at| self.row("result", at));
                    let _ = writeln!(out, "        {name}.give_pair({k}, [&{first}, &{second}]);");
                    2
                }
                _ => {
                    let _ = writeln!(out, "        {name}.give({k}, &{});", self.row("result", at));
                    1
                }
            };
        }
    }
}
