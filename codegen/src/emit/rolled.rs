//! Rolled programs: numbers between blocks in `kept`, numbers that a run stores from pass to pass in one row for each
//! iteration, its constants in a table. Every block is a loop over lanes, as in straight-line code.

mod angles;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::head::Head;
use super::names::{heading, Names};
use super::numbers::{minus, signed};
use super::straight::LOCATIONS;
use crate::options::Precision;
use crate::plan::Plan;
use crate::rolled::{Block, Loop, Place, Repeat, RolledProgram, Start, Target};
use crate::symbolic::angles::Angles;
use crate::symbolic::Op;

/// Largest size of the rows on the stack, bytes. Lanes whose rows are larger are computed in groups, one after the other.
const ROWS: usize = 1 << 19;

/// Writes the function of a rolled program.
pub struct RolledWriter<'a> {
    plan: &'a Plan,
    program: RolledProgram,
    head: Head<'a>,
    /// What every block keeps for later ones: numbers of the turn's row.
    kept: Vec<Vec<usize>>,
    /// Number of lanes of a group, where there are groups.
    group: Option<usize>,
}

impl<'a> RolledWriter<'a> {
    /// A writer for one program.
    pub fn new(plan: &'a Plan, program: &'a RolledProgram, head: Head<'a>) -> Self {
        let program = program.with_sines_in_loops();
        let kept: Vec<Vec<usize>> = (0..program.blocks.len()).map(|k| kept_rows(&program.blocks, k)).collect();
        let (lanes, size) = match head.options.precision {
            Precision::F64 => (8, 8),
            Precision::F32 => (16, 4),
        };
        let turns = |block: &Block| block.run().map_or(0, |run| program.loops[run].table.len());
        let numbers: usize = program.blocks.iter().zip(&kept).map(|(block, kept)| turns(block) * kept.len()).sum();
        let mut group = lanes;
        while group > 1 && numbers * size * group > ROWS {
            group /= 2;
        }
        let group = (group < lanes || numbers * size * group > ROWS).then_some(group);
        RolledWriter { plan, program, head, kept, group }
    }

    /// Index of the lane in inputs and results.
    fn lane(&self) -> &'static str {
        if self.group.is_some() {
            "lane + l"
        } else {
            "l"
        }
    }

    /// Function, kernel and tables.
    pub fn write(&self, out: &mut String) {
        self.head.write(out, usize::MAX);
        if let Some(group) = self.group {
            self.groups(out, group);
        }
        let _ = writeln!(out, "        let mut kept = {};", self.head.rows(self.program.kept));
        for (k, block) in self.program.blocks.iter().enumerate() {
            let Some(run) = block.run().filter(|_| !self.kept[k].is_empty()) else { continue };
            let (rt, t) = (&self.head.options.runtime, self.head.options.precision.name());
            let (row, turns) = (self.kept[k].len(), self.program.loops[run].table.len());
            let _ = writeln!(
                out,
                "        let mut rows{k} = {rt}::kernel::PushedRows::<{t}, LANES, {row}, {turns}>::new();"
            );
        }
        for k in 0..self.program.blocks.len() {
            self.all_turns(out, k);
        }
        for (k, block) in self.program.blocks.iter().enumerate() {
            let _ = writeln!(out, "        {{");
            match &block.repeat {
                None => self.body(out, k, "            "),
                Some(repeat) => self.repeated(out, k, repeat),
            }
            let _ = writeln!(out, "        }}");
        }
        let _ = writeln!(out, "    }}");
        for (k, run) in self.program.loops.iter().enumerate() {
            self.table(out, k, run);
        }
    }

    /// The body of the kernel and the head of another one for some of its lanes.
    fn groups(&self, out: &mut String, group: usize) {
        let (name, rt) = (&self.head.signature.name, &self.head.options.runtime);
        let ports: String = self.head.ports.iter().map(|p| format!(", {}", p.name)).collect();
        let _ = writeln!(out, "        let mut lane = 0;");
        for group in [group, 1].into_iter().take(if group > 1 { 2 } else { 1 }) {
            let _ = writeln!(out, "        while LANES - lane >= {group} {{");
            let _ = writeln!(out, "            Self::{name}_group::<A, {group}>(lane{ports});");
            let _ = writeln!(out, "            lane += {group};\n        }}");
        }
        let _ = writeln!(
            out,
            "    }}\n\n    /// Some of the lanes: the rows of all would take too much of the stack.\n    #[inline(always)]"
        );
        let _ = writeln!(
            out,
            "    fn {name}_group<A: {rt}::kernel::Arithmetic, const LANES: usize>(lane: usize, {}) {{",
            self.head.parameters()
        );
    }

    fn table(&self, out: &mut String, k: usize, run: &Loop) {
        let (t, columns) = (self.head.options.precision.name(), run.table.first().map_or(0, Vec::len));
        let bodies = (&self.plan.nodes[run.nodes.start].name, &self.plan.nodes[run.nodes.end - 1].name);
        let _ =
            writeln!(out, "\n    /// Constants from {} to {}, one row for each turn of the loop.", bodies.0, bodies.1);
        let (name, turns) = (self.table_name(k), run.table.len());
        let _ = writeln!(out, "    const {name}: &'static [[{t}; {columns}]; {turns}] = &[");
        for row in &run.table {
            let numbers: Vec<String> = row.iter().map(|x| signed(*x, self.head.options.precision)).collect();
            let _ = writeln!(out, "        [{}],", numbers.join(", "));
        }
        let _ = writeln!(out, "    ];");
    }

    fn table_name(&self, run: usize) -> String {
        format!("{}_TABLE{run}", self.head.signature.name.to_ascii_uppercase())
    }

    fn repeated(&self, out: &mut String, k: usize, repeat: &Repeat) {
        for (k, (start, _)) in repeat.carried.iter().enumerate() {
            let start = match *start {
                Start::Const(x) => {
                    let _ = writeln!(
                        out,
                        "            let mut carried{k} = [{}; LANES];",
                        signed(x, self.head.options.precision)
                    );
                    continue;
                }
                Start::Kept(slot, neg) => format!("{}kept[{slot}][l]", minus(neg)),
                Start::Given(k, neg) => {
                    format!("{}{}", minus(neg), self.head.input(k, "", self.lane()))
                }
            };
            let _ = writeln!(out, "            let mut carried{k} = [0.0; LANES];");
            let _ = writeln!(out, "            for l in 0..LANES {{ carried{k}[l] = {start}; }}");
        }
        let turns = self.program.loops[repeat.run].table.len();
        let order = if repeat.is_backward() { format!("(0..{turns}).rev()") } else { format!("0..{turns}") };
        let _ = writeln!(out, "            for k in {order} {{");
        self.open_rows(out, k, repeat);
        self.body(out, k, "                ");
        let _ = writeln!(out, "            }}");
        for (k, (_, end)) in repeat.carried.iter().enumerate() {
            if let Some(slot) = end {
                let _ = writeln!(out, "            kept[{slot}] = carried{k};");
            }
        }
    }

    /// The rows that the body of a loop reads, and the row of the table.
    fn open_rows(&self, out: &mut String, k: usize, repeat: &Repeat) {
        let block = &self.program.blocks[k];
        let read = block.rows_read();
        for (from, kept) in self.kept[..k].iter().enumerate() {
            let source = &self.program.blocks[from];
            let Some(of) = source.repeat.as_ref().filter(|of| of.run == repeat.run) else { continue };
            if kept.iter().any(|row| read.contains(row)) {
                let turns = self.program.loops[repeat.run].table.len();
                let number = if of.is_backward() { format!("{} - k", turns - 1) } else { "k".to_string() };
                let _ = writeln!(out, "                let row{from} = rows{from}.row({number});");
            }
        }
        self.open_table(out, block, repeat.run);
    }

    /// The row of the table, if it is read.
    fn open_table(&self, out: &mut String, block: &Block, run: usize) {
        if block.inputs.iter().any(|p| matches!(p, Place::Column(_))) {
            let _ = writeln!(out, "                let table = &Self::{}[k];", self.table_name(run));
        }
    }

    /// Statements and results, in a loop those of one iteration. Inputs are copied first and results are collected in
    /// an array, as in straight-line code.
    fn body(&self, out: &mut String, k: usize, indent: &str) {
        let block = &self.program.blocks[k];
        let names = Names::default().block(self.plan, &self.program, block, self.head.inputs);
        let angles = Angles::new(&block.program);
        self.angles(out, k, &angles, &names, indent);
        let n = block.outputs.len();
        let in_one_array = self.in_one_array(block, &angles);
        let (copied, [from, to], first) = if in_one_array {
            let copied = self.copy_all(out, k, &angles, indent);
            let first = copied.len();
            (copied, ["all"; 2], first)
        } else {
            (self.given(out, block, &angles, indent), ["given", "results"], 0)
        };
        if n > 0 && !in_one_array {
            let _ = writeln!(out, "{indent}let mut results = {};", self.head.rows(n));
        }
        let _ = writeln!(out, "{indent}for l in 0..LANES {{");
        let mut last = None;
        let mut late = angles.late.clone();
        for (id, op, label) in block.program.steps.iter().filter(|(id, ..)| angles.after.contains(id)) {
            let text = match op {
                Op::Sin(a) | Op::Cos(a) => match angles.early.keys().position(|angle| angle == a) {
                    Some(k) => {
                        let row = if matches!(op, Op::Sin(_)) { "sines" } else { "cosines" };
                        let row = copied.get(id).map_or_else(|| format!("{row}[{k}]"), |k| format!("{from}[{k}]"));
                        format!("let {} = {row}[l];", names[id])
                    }
                    None => {
                        // The first one of a pair represents both.
                        let Some(pair) = late.remove(a) else { continue };
                        let pair = pair.map(|id| id.map_or("_", |id| names[&id].as_str()));
                        self.head.sine_and_cosine(pair, &names[a])
                    }
                },
                op => match copied.get(id) {
                    Some(k) => format!("let {} = {from}[{k}][l];", names[id]),
                    None => format!("let {} = {};", names[id], self.value(k, op, &names)),
                },
            };
            if block.repeat.is_none() && last != Some(*label) && !matches!(op, Op::Input(_)) {
                let _ = writeln!(out, "{indent}    // {}", heading(self.plan, *label));
                last = Some(*label);
            }
            let _ = writeln!(out, "{indent}    {text}");
        }
        for (k, result) in block.program.outputs.iter().enumerate() {
            let value = self.head.value(result, &names);
            let _ = writeln!(out, "{indent}    {to}[{}][l] = {value};", first + k);
        }
        let _ = writeln!(out, "{indent}}}");
        if n > 0 && in_one_array {
            let _ = writeln!(out, "{indent}let results = &all[{first}..];");
        }
        self.results(out, k, indent);
    }

    /// Copies inputs of the function. Returns their places in the copy.
    fn given(&self, out: &mut String, block: &Block, angles: &Angles, indent: &str) -> BTreeMap<u32, usize> {
        let steps = block.program.steps.iter().filter(|(id, ..)| angles.after.contains(id));
        let inputs: Vec<(u32, String)> = steps
            .filter_map(|(id, op, _)| match op {
                Op::Input(k) => self.given_input(block.inputs[*k as usize]).map(|text| (*id, text)),
                _ => None,
            })
            .collect();
        if !inputs.is_empty() {
            let _ = writeln!(out, "{indent}let mut given = {};", self.head.rows(inputs.len()));
        }
        for (k, (_, text)) in inputs.iter().enumerate() {
            let _ = writeln!(out, "{indent}for l in 0..LANES {{ given[{k}][l] = {text}; }}");
        }
        inputs.iter().enumerate().map(|(k, (id, _))| (*id, k)).collect()
    }

    /// Whether what the loop over lanes of a block reads and writes are rows of one array, as in straight-line code.
    fn in_one_array(&self, block: &Block, angles: &Angles) -> bool {
        let read = block.inputs.iter().filter(|place| !matches!(place, Place::Column(_))).count();
        read + block.outputs.len() + 2 * angles.early.len() > LOCATIONS
    }

    /// Copies all that the loop over lanes of a block reads to the first rows of an array that has room for the results, too.
    /// Returns the places in it.
    fn copy_all(&self, out: &mut String, k: usize, angles: &Angles, indent: &str) -> BTreeMap<u32, usize> {
        let block = &self.program.blocks[k];
        let angle = |a: &u32| angles.early.keys().position(|angle| angle == a);
        let copy = |op: &Op, to: usize| match op {
            Op::Sin(a) => angle(a).map(|k| format!("all[{to}] = sines[{k}];")),
            Op::Cos(a) => angle(a).map(|k| format!("all[{to}] = cosines[{k}];")),
            Op::Input(input) => {
                let place = block.inputs[*input as usize];
                let given = || Some(format!("for l in 0..LANES {{ all[{to}][l] = {}; }}", self.given_input(place)?));
                self.row(k, place).map(|row| format!("all[{to}] = {row};")).or_else(given)
            }
            _ => None,
        };
        let mut places = BTreeMap::new();
        let mut copies = String::new();
        for (id, op, _) in block.program.steps.iter().filter(|(id, ..)| angles.after.contains(id)) {
            if let Some(copy) = copy(op, places.len()) {
                places.insert(*id, places.len());
                let _ = writeln!(copies, "{indent}{copy}");
            }
        }
        let _ = writeln!(out, "{indent}let mut all = {};", self.head.rows(places.len() + block.outputs.len()));
        out.push_str(&copies);
        places
    }

    /// An input of the function, if the place is one.
    fn given_input(&self, place: Place) -> Option<String> {
        match place {
            Place::Given(k) => Some(self.head.input(k, "", self.lane())),
            Place::GivenOfTurn { first, stride } => Some(self.head.input(first, &of_turn(stride), self.lane())),
            _ => None,
        }
    }

    /// Writes the results of a block to their places.
    fn results(&self, out: &mut String, k: usize, indent: &str) {
        let places = self.head.places();
        let mut row: BTreeMap<usize, usize> = BTreeMap::new();
        for (k, target) in self.program.blocks[k].outputs.iter().enumerate() {
            let given = |result: usize, more: &str| match (places[result], self.group) {
                ((port, at), Some(_)) => {
                    format!("for l in 0..LANES {{ {port}.set({at}{more}, lane + l, results[{k}][l]); }}")
                }
                ((port, at), None) => format!("{port}.give({at}{more}, &results[{k}]);"),
            };
            let text = match *target {
                Target::Result(result) => given(result, ""),
                Target::ResultOfTurn { first, stride } => given(first, &of_turn(stride)),
                Target::Kept(slot) => format!("kept[{slot}] = results[{k}];"),
                Target::Row(number) => {
                    row.insert(number, k);
                    continue;
                }
                Target::Carried(carried) => format!("carried{carried} = results[{k}];"),
            };
            let _ = writeln!(out, "{indent}{text}");
        }
        if !self.kept[k].is_empty() {
            let row: Vec<String> = self.kept[k].iter().map(|number| format!("results[{}]", row[number])).collect();
            let _ = writeln!(out, "{indent}rows{k}.push([{}]);", row.join(", "));
        }
    }

    fn value(&self, k: usize, op: &Op, names: &BTreeMap<u32, String>) -> String {
        let Op::Input(input) = op else { return self.head.expression(op, names) };
        match self.program.blocks[k].inputs[*input as usize] {
            Place::Column(column) => format!("table[{column}]"),
            place => self.row(k, place).map(|row| format!("{row}[l]")).or(self.given_input(place)).unwrap_or_default(),
        }
    }

    /// What a block reads in all lanes, if it is a row of an array.
    fn row(&self, k: usize, place: Place) -> Option<String> {
        match place {
            Place::Kept(slot) => Some(format!("kept[{slot}]")),
            Place::Row(row) => {
                let run = self.program.blocks[k].run();
                let from =
                    (0..k).find(|from| self.program.blocks[*from].run() == run && self.kept[*from].contains(&row));
                let from = from.expect("a row is written before it is read");
                let at = self.kept[from].iter().position(|kept| *kept == row).unwrap_or(0);
                Some(format!("row{from}[{at}]"))
            }
            Place::Carried(k) => Some(format!("carried{k}")),
            Place::Column(_) | Place::Given(_) | Place::GivenOfTurn { .. } => None,
            Place::RowOfBranch { .. } => unreachable!("like branches have a writer of their own"),
        }
    }
}

/// Numbers of the turn's row that a block writes and a later one reads.
fn kept_rows(blocks: &[Block], k: usize) -> Vec<usize> {
    let later: BTreeSet<usize> =
        blocks[k + 1..].iter().filter(|block| block.run() == blocks[k].run()).flat_map(Block::rows_read).collect();
    let rows = blocks[k].outputs.iter().filter_map(|target| match target {
        Target::Row(row) if later.contains(row) => Some(*row),
        _ => None,
    });
    rows.collect()
}

/// The offset of an index in iteration `k` from that in iteration 0.
fn of_turn(stride: usize) -> String {
    match stride {
        1 => " + k".to_string(),
        _ => format!(" + {stride} * k"),
    }
}
