//! Like branches at the same time, for one state: loops over four branches, whose statements are the same and whose
//! constants are in tables. The compiler makes vector instructions of such a loop. Everything else is straight-line code
//! between the loops.
//!
//! A loop reads and writes arrays of its own function only, with the branch as the last index. Sets of two or three
//! branches repeat branches in the other lanes.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::head::Head;
use super::names::{heading, Names};
use super::numbers::{minus, signed};
use crate::plan::Plan;
use crate::rolled::{Block, Place, RolledProgram, Start, Target, WIDTH};
use crate::symbolic::angles::{nodes, pairs};
use crate::symbolic::{Op, ProgramResult};

/// Writes the function that computes like branches together.
pub struct TogetherWriter<'a> {
    plan: &'a Plan,
    program: &'a RolledProgram,
    head: Head<'a>,
    /// Places of the results.
    places: Vec<(&'a str, usize)>,
    names: Vec<BTreeMap<u32, String>>,
    /// Angles that depend on inputs only, by block and node: lanes of all branches, or one lane.
    angles: BTreeMap<(usize, u32), Angle>,
    /// Number of rows of angles.
    rows: usize,
}

/// Where an angle is.
#[derive(Clone, Copy)]
struct Angle {
    row: usize,
    /// `None` where every branch has one.
    lane: Option<usize>,
}

impl<'a> TogetherWriter<'a> {
    /// A writer for one program.
    pub fn new(plan: &'a Plan, program: &'a RolledProgram, head: Head<'a>) -> Self {
        let of_block = |block| Names::default().block(plan, program, block, head.inputs);
        let names = program.blocks.iter().map(of_block).collect();
        let (mut angles, mut rows, mut single) = (BTreeMap::new(), 0, Vec::new());
        for (b, block) in program.blocks.iter().enumerate() {
            for angle in pairs(&block.program).into_keys() {
                if is_sines(block) {
                    angles.insert((b, angle), Angle { row: rows, lane: None });
                    rows += 1;
                } else if block.repeat.is_none() && is_given(block, &before(block, angle)) {
                    single.push((b, angle));
                }
            }
        }
        for (k, key) in single.iter().enumerate() {
            angles.insert(*key, Angle { row: rows + k / WIDTH, lane: Some(k % WIDTH) });
        }
        rows += single.len().div_ceil(WIDTH);
        TogetherWriter { plan, program, places: head.places(), head, names, angles, rows }
    }

    /// Name of the function.
    pub fn name(name: &str) -> String {
        format!("{name}_together")
    }

    /// Writes the function and its tables.
    pub fn write(&self, out: &mut String) {
        let rt = &self.head.options.runtime;
        let _ = writeln!(out, "\n    /// One state: like branches at the same time, in the lanes of vector registers.");
        let _ = writeln!(out, "    #[inline(always)]");
        let (name, parameters) = (Self::name(&self.head.signature.name), self.head.parameters());
        let _ = writeln!(out, "    fn {name}<A: {rt}::kernel::Arithmetic>({parameters}) {{");
        let _ = writeln!(out, "        const LANES: usize = {WIDTH};");
        self.sines(out);
        if self.program.kept > 0 {
            let _ = writeln!(out, "        let mut kept = [0.0; {}];", self.program.kept);
        }
        for (b, block) in self.program.blocks.iter().enumerate().filter(|(_, block)| !is_sines(block)) {
            if block.repeat.is_some() {
                self.head.locals(out, "        ", &format!("branches{b}"), block.outputs.len());
            }
            let _ = writeln!(out, "        {{");
            self.block(out, b, block);
            let _ = writeln!(out, "        }}");
        }
        let _ = writeln!(out, "    }}");
        for (k, run) in self.program.loops.iter().enumerate() {
            let columns = run.table.first().map_or(0, Vec::len);
            let roots: Vec<&str> = run.branches.iter().map(|&i| self.plan.nodes[i].name.as_str()).collect();
            let t = self.head.options.precision.name();
            let _ = writeln!(out, "\n    /// Constants of the branches from {} on, one column each.", roots.join(", "));
            let _ = writeln!(out, "    const {}: &'static [[{t}; {WIDTH}]; {columns}] = &[", self.table(k));
            for column in 0..columns {
                let number = |turn: usize| signed(run.table[turn][column], self.head.options.precision);
                let _ = writeln!(out, "        {},", lanes(run.table.len(), number));
            }
            let _ = writeln!(out, "    ];");
        }
    }

    fn table(&self, run: usize) -> String {
        format!("{}_BRANCHES{run}", self.head.signature.name.to_ascii_uppercase())
    }

    /// Sines and cosines of all angles that depend on inputs only.
    fn sines(&self, out: &mut String) {
        if self.rows == 0 {
            return;
        }
        let _ = writeln!(out, "        let mut angles = {};", self.head.rows(self.rows));
        for (b, block) in self.program.blocks.iter().enumerate() {
            let own = self.angles.range((b, 0)..=(b, u32::MAX));
            let wanted: BTreeSet<u32> = own.clone().flat_map(|((_, angle), _)| before(block, *angle)).collect();
            if wanted.is_empty() {
                continue;
            }
            let _ = writeln!(out, "        {{");
            self.given(out, block);
            let (indent, lane) = self.open(out, block);
            for (id, op, _) in block.program.steps.iter().filter(|(id, ..)| wanted.contains(id)) {
                let _ = writeln!(out, "{indent}let {} = {};", self.names[b][id], self.value(b, block, op));
            }
            for ((_, angle), at) in own {
                let lane = at.lane.map_or(lane.to_string(), |lane| lane.to_string());
                let _ = writeln!(out, "{indent}angles[{}][{lane}] = {};", at.row, self.names[b][angle]);
            }
            if block.repeat.is_some() {
                let _ = writeln!(out, "            }}");
            }
            let _ = writeln!(out, "        }}");
        }
        let call = self.head.sines_and_cosines("angles", self.rows);
        let _ = writeln!(out, "        let (sines, cosines) = {call};");
    }

    /// Inputs that are other ones in every branch.
    fn given(&self, out: &mut String, block: &Block) {
        let Some(repeat) = &block.repeat else { return };
        let turns = self.program.loops[repeat.run].table.len();
        for (k, place) in block.inputs.iter().enumerate() {
            if let Place::GivenOfTurn { first, stride } = *place {
                let input = |turn: usize| self.head.input(first + stride * turn, "", "0");
                let _ = writeln!(out, "            let given{k} = {};", lanes(turns, input));
            }
        }
    }

    /// The start of a loop over branches; indent of the statements, and the index of the branch.
    fn open(&self, out: &mut String, block: &Block) -> (&'static str, &'static str) {
        let Some(repeat) = &block.repeat else { return ("            ", "0") };
        if block.inputs.iter().any(|place| matches!(place, Place::Column(_))) {
            let _ = writeln!(out, "            let table = Self::{};", self.table(repeat.run));
        }
        let _ = writeln!(out, "            for k in 0..{WIDTH} {{");
        ("                ", "k")
    }

    fn block(&self, out: &mut String, b: usize, block: &Block) {
        self.given(out, block);
        let (indent, _) = self.open(out, block);
        let mut last = None;
        let mut late = pairs(&block.program);
        for (id, op, label) in &block.program.steps {
            let mut defined = [Some(*id), None];
            let text = match op {
                Op::Sin(a) | Op::Cos(a) if !self.angles.contains_key(&(b, *a)) => {
                    // The first one of a pair represents both.
                    let Some(pair) = late.remove(a) else { continue };
                    defined = pair;
                    let pair = pair.map(|id| id.map_or("_", |id| self.names[b][&id].as_str()));
                    self.head.sine_and_cosine(pair, &self.names[b][a])
                }
                op => format!("let {} = {};", self.names[b][id], self.value(b, block, op)),
            };
            if block.repeat.is_none() && last != Some(*label) && !matches!(op, Op::Input(_)) {
                let _ = writeln!(out, "{indent}// {}", heading(self.plan, *label));
                last = Some(*label);
            }
            let _ = writeln!(out, "{indent}{text}");
            for id in defined.into_iter().flatten() {
                self.store(out, b, block, Some(id), indent);
            }
        }
        self.store(out, b, block, None, indent);
        let Some(repeat) = &block.repeat else { return };
        let _ = writeln!(out, "            }}");
        for (k, target) in block.outputs.iter().enumerate() {
            let Target::ResultOfTurn { first, stride } = *target else { continue };
            for turn in 0..self.program.loops[repeat.run].table.len() {
                self.give(out, "            ", first + stride * turn, &format!("branches{b}_{k}[{turn}]"));
            }
        }
    }

    /// Writes the results of a block that are a node, or those that are constants. A number is written as soon as it is computed:
    /// at the end of a block most of them would have left the registers, and be read for it once more.
    fn store(&self, out: &mut String, b: usize, block: &Block, node: Option<u32>, indent: &str) {
        for (k, result) in block.program.outputs.iter().enumerate() {
            let of = if let ProgramResult::Node(id, _) = result { Some(*id) } else { None };
            if of != node {
                continue;
            }
            let value = self.head.value(result, &self.names[b]);
            let _ = match block.outputs[k] {
                Target::Result(result) => {
                    self.give(out, indent, result, &value);
                    continue;
                }
                Target::Kept(slot) => writeln!(out, "{indent}kept[{slot}] = {value};"),
                Target::ResultOfTurn { .. } | Target::Row(_) => {
                    writeln!(out, "{indent}branches{b}_{k}[k] = {value};")
                }
                Target::Carried(_) => unreachable!("branches hand nothing on to each other"),
            };
        }
    }

    /// Writes a result of the function.
    fn give(&self, out: &mut String, indent: &str, result: usize, value: &str) {
        let (port, at) = self.places[result];
        let _ = writeln!(out, "{indent}{port}.set({at}, 0, {value});");
    }

    fn value(&self, b: usize, block: &Block, op: &Op) -> String {
        let k = match op {
            Op::Input(k) => *k as usize,
            Op::Sin(a) | Op::Cos(a) => {
                let Angle { row, lane } = self.angles[&(b, *a)];
                let array = if matches!(op, Op::Sin(_)) { "sines" } else { "cosines" };
                return format!("{array}[{row}][{}]", lane.map_or("k".to_string(), |lane| lane.to_string()));
            }
            op => return self.head.expression(op, &self.names[b]),
        };
        match (block.inputs[k], &block.repeat) {
            (Place::Given(k), _) => self.head.input(k, "", "0"),
            (Place::GivenOfTurn { .. }, _) => format!("given{k}[k]"),
            (Place::Kept(slot), _) => format!("kept[{slot}]"),
            (Place::Column(column), _) => format!("table[{column}][k]"),
            (Place::Row(row), Some(repeat)) => self.row(repeat.run, row, "k"),
            (Place::Carried(k), Some(repeat)) => match repeat.carried[k].0 {
                Start::Const(x) => signed(x, self.head.options.precision),
                Start::Kept(slot, neg) => format!("{}kept[{slot}]", minus(neg)),
                Start::Given(k, neg) => format!("{}{}", minus(neg), self.head.input(k, "", "0")),
            },
            (Place::RowOfBranch { run, turn, row }, _) => self.row(run, row, &turn.to_string()),
            (place, None) => unreachable!("{place:?} outside of a loop"),
        }
    }

    /// Number `row` of a branch, from the loop that computes it.
    fn row(&self, run: usize, row: usize, branch: &str) -> String {
        for (b, block) in self.program.blocks.iter().enumerate() {
            if block.repeat.as_ref().is_none_or(|repeat| repeat.run != run) {
                continue;
            }
            let Some(k) = block.outputs.iter().position(|target| *target == Target::Row(row)) else { continue };
            let (true, ProgramResult::Node(id, _)) = (is_sines(block), block.program.outputs[k]) else {
                return format!("branches{b}_{k}[{branch}]");
            };
            for (angle, pair) in pairs(&block.program) {
                if let Some(part) = pair.iter().position(|node| *node == Some(id)) {
                    return format!("{}[{}][{branch}]", ["sines", "cosines"][part], self.angles[&(b, angle)].row);
                }
            }
        }
        unreachable!("what a branch keeps is computed in one of its loops")
    }
}

/// Whether a block is for the sines and cosines of a run only.
fn is_sines(block: &Block) -> bool {
    block.repeat.as_ref().is_some_and(|repeat| repeat.way.is_none())
}

/// An angle and what it is computed from.
fn before(block: &Block, angle: u32) -> BTreeSet<u32> {
    let mut before = BTreeSet::from([angle]);
    for (id, op, _) in block.program.steps.iter().rev() {
        if before.contains(id) {
            before.extend(nodes(op));
        }
    }
    before
}

/// Whether some nodes are inputs of the function, and sums and products of them.
fn is_given(block: &Block, set: &BTreeSet<u32>) -> bool {
    let own = block.program.steps.iter().filter(|(id, ..)| set.contains(id));
    own.clone().all(|(_, op, _)| match op {
        Op::Input(k) => matches!(block.inputs[*k as usize], Place::Given(_)),
        op => matches!(op, Op::Add(..) | Op::Sub(..) | Op::Mul(..) | Op::Fma(_)),
    })
}

/// One number for every lane; branches are repeated where there are fewer.
fn lanes(branches: usize, text: impl Fn(usize) -> String) -> String {
    format!("[{}]", (0..WIDTH).map(|lane| text(lane % branches)).collect::<Vec<_>>().join(", "))
}
