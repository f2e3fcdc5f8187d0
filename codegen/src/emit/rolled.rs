//! Rolled programs: numbers between blocks in `kept`, numbers that a run stores from pass to pass in one row for each
//! iteration, its constants in a table. Every block is a loop over lanes, as in straight-line code.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::head::Head;
use super::names::{heading, Names};
use super::numbers::{minus, signed};
use crate::options::Precision;
use crate::plan::Plan;
use crate::rolled::{Block, Loop, Place, Repeat, RolledProgram, Start, SweepDirection, Target};
use crate::symbolic::angles::pairs;
use crate::symbolic::{Op, ProgramResult};

/// Largest size of the rows of eight lanes on the stack, bytes. If they are larger, lanes are computed one after the
/// other.
const ROWS: usize = 1 << 19;

/// Writes the function of a rolled program.
pub struct RolledWriter<'a> {
    plan: &'a Plan,
    program: &'a RolledProgram,
    head: Head<'a>,
    /// Whether lanes are computed one after the other.
    one_by_one: bool,
}

impl<'a> RolledWriter<'a> {
    /// A writer for one program.
    pub fn new(plan: &'a Plan, program: &'a RolledProgram, head: Head<'a>) -> Self {
        let bytes = match head.options.precision {
            Precision::F64 => 64,
            Precision::F32 => 32,
        };
        let rows: usize = program.loops.iter().map(|l| l.row * l.table.len()).sum();
        RolledWriter { plan, program, head, one_by_one: rows * bytes > ROWS }
    }

    /// Index of the lane in inputs and results.
    fn lane(&self) -> &'static str {
        if self.one_by_one {
            "lane"
        } else {
            "l"
        }
    }

    /// Function, kernel and tables.
    pub fn write(&self, out: &mut String) {
        let (name, rt) = (&self.head.signature.name, &self.head.options.runtime);
        self.head.write(out, usize::MAX);
        if self.one_by_one {
            let ports: String = self.head.ports.iter().map(|p| format!(", {}", p.name)).collect();
            let _ = writeln!(out, "        for lane in 0..LANES {{\n            Self::{name}_lane::<A>(lane{ports});");
            let _ =
                writeln!(out, "        }}\n    }}\n\n    /// One lane: the rows of many would not fit on the stack.");
            let _ = writeln!(
                out,
                "    #[inline(always)]\n    fn {name}_lane<A: {rt}::kernel::Arithmetic>(lane: usize, {}) {{",
                self.head.parameters()
            );
            let _ = writeln!(out, "        const LANES: usize = 1;");
        }
        let _ = writeln!(out, "        let mut kept = {};", self.head.rows(self.program.kept));
        for (k, run) in self.program.loops.iter().enumerate() {
            let _ = writeln!(out, "        let mut rows{k} = [[[0.0; LANES]; {}]; {}];", run.row, run.table.len());
        }
        for block in &self.program.blocks {
            let _ = writeln!(out, "        {{");
            match &block.repeat {
                None => self.body(out, block, "            "),
                Some(repeat) if repeat.way.is_none() => self.sines(out, block, repeat),
                Some(repeat) => self.repeated(out, block, repeat),
            }
            let _ = writeln!(out, "        }}");
        }
        let _ = writeln!(out, "    }}");
        for (k, run) in self.program.loops.iter().enumerate() {
            self.table(out, k, run);
        }
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

    /// The row of the table, if it is read.
    fn open_table(&self, out: &mut String, block: &Block, run: usize) {
        if block.inputs.iter().any(|p| matches!(p, Place::Column(_))) {
            let _ = writeln!(out, "                let table = &Self::{}[k];", self.table_name(run));
        }
    }

    fn repeated(&self, out: &mut String, block: &Block, repeat: &Repeat) {
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
        let order = if repeat.way == Some(SweepDirection::TipToBase) {
            format!("(0..{turns}).rev()")
        } else {
            format!("0..{turns}")
        };
        let _ = writeln!(out, "            for k in {order} {{");
        let _ = writeln!(out, "                let row = &mut rows{}[k];", repeat.run);
        self.open_table(out, block, repeat.run);
        self.body(out, block, "                ");
        let _ = writeln!(out, "            }}");
        for (k, (_, end)) in repeat.carried.iter().enumerate() {
            if let Some(slot) = end {
                let _ = writeln!(out, "            kept[{slot}] = carried{k};");
            }
        }
    }

    /// Sines and cosines of all iterations together.
    fn sines(&self, out: &mut String, block: &Block, repeat: &Repeat) {
        let (run, turns) = (repeat.run, self.program.loops[repeat.run].table.len());
        let names = Names::default().block(self.plan, self.program, block, self.head.inputs);
        let angles = pairs(&block.program);
        for k in 0..angles.len() {
            let _ = writeln!(out, "            let mut angles{k} = {};", self.head.rows(turns));
        }
        let _ = writeln!(out, "            for k in 0..{turns} {{");
        self.open_table(out, block, run);
        let _ = writeln!(out, "                for l in 0..LANES {{");
        for (id, op, _) in &block.program.steps {
            if !matches!(op, Op::Sin(_) | Op::Cos(_)) {
                let _ = writeln!(out, "                    let {} = {};", names[id], self.value(block, op, &names));
            }
        }
        for (k, angle) in angles.keys().enumerate() {
            let _ = writeln!(out, "                    angles{k}[k][l] = {};", names[angle]);
        }
        let _ = writeln!(out, "                }}\n            }}");
        for k in 0..angles.len() {
            let call = self.head.sines_and_cosines(&format!("angles{k}"), turns);
            let _ = writeln!(out, "            let (sines{k}, cosines{k}) = {call};");
        }
        let _ = writeln!(out, "            for k in 0..{turns} {{");
        for (result, target) in block.program.outputs.iter().zip(&block.outputs) {
            let (ProgramResult::Node(id, _), Target::Row(row)) = (result, target) else { continue };
            let part = |(k, pair): (usize, &[Option<u32>; 2])| {
                let name = ["sines", "cosines"].into_iter().zip(pair).find(|(_, node)| **node == Some(*id));
                name.map(|(name, _)| format!("{name}{k}"))
            };
            if let Some(array) = angles.values().enumerate().find_map(part) {
                let _ = writeln!(out, "                rows{run}[k][{row}] = {array}[k];");
            }
        }
        let _ = writeln!(out, "            }}");
    }

    /// Statements and results, in a loop those of one iteration. Results are first collected in an array, as in
    /// straight-line code.
    fn body(&self, out: &mut String, block: &Block, indent: &str) {
        let names = Names::default().block(self.plan, self.program, block, self.head.inputs);
        let n = block.outputs.len();
        if n > 0 {
            let _ = writeln!(out, "{indent}let mut results = {};", self.head.rows(n));
        }
        let _ = writeln!(out, "{indent}for l in 0..LANES {{");
        let mut last = None;
        let mut late = pairs(&block.program);
        for (id, op, label) in &block.program.steps {
            let text = match op {
                Op::Sin(a) | Op::Cos(a) => {
                    // The first one of a pair represents both.
                    let Some(pair) = late.remove(a) else { continue };
                    let pair = pair.map(|id| id.map_or("_", |id| names[&id].as_str()));
                    self.head.sine_and_cosine(pair, &names[a])
                }
                op => format!("let {} = {};", names[id], self.value(block, op, &names)),
            };
            if block.repeat.is_none() && last != Some(*label) && !matches!(op, Op::Input(_)) {
                let _ = writeln!(out, "{indent}    // {}", heading(self.plan, *label));
                last = Some(*label);
            }
            let _ = writeln!(out, "{indent}    {text}");
        }
        for (k, result) in block.program.outputs.iter().enumerate() {
            let _ = writeln!(out, "{indent}    results[{k}][l] = {};", self.head.value(result, &names));
        }
        let _ = writeln!(out, "{indent}}}");
        let places = self.head.places();
        for (k, target) in block.outputs.iter().enumerate() {
            let given = |result: usize, more: &str| match (places[result], self.one_by_one) {
                ((port, at), true) => format!("{port}.set({at}{more}, lane, results[{k}][0]);"),
                ((port, at), false) => format!("{port}.give({at}{more}, &results[{k}]);"),
            };
            let text = match *target {
                Target::Result(result) => given(result, ""),
                Target::ResultOfTurn { first, stride } => given(first, &of_turn(stride)),
                Target::Kept(slot) => format!("kept[{slot}] = results[{k}];"),
                Target::Row(row) => format!("row[{row}] = results[{k}];"),
                Target::Carried(carried) => format!("carried{carried} = results[{k}];"),
            };
            let _ = writeln!(out, "{indent}{text}");
        }
    }

    fn value(&self, block: &Block, op: &Op, names: &BTreeMap<u32, String>) -> String {
        let Op::Input(k) = op else { return self.head.expression(op, names) };
        match block.inputs[*k as usize] {
            Place::Given(k) => self.head.input(k, "", self.lane()),
            Place::GivenOfTurn { first, stride } => self.head.input(first, &of_turn(stride), self.lane()),
            Place::Kept(slot) => format!("kept[{slot}][l]"),
            Place::Column(column) => format!("table[{column}]"),
            Place::Row(row) => format!("row[{row}][l]"),
            Place::Carried(k) => format!("carried{k}[l]"),
            Place::RowOfBranch { run, turn, row } => format!("rows{run}[{turn}][{row}][l]"),
        }
    }
}

/// The offset of an index in iteration `k` from that in iteration 0.
fn of_turn(stride: usize) -> String {
    match stride {
        1 => " + k".to_string(),
        _ => format!(" + {stride} * k"),
    }
}
