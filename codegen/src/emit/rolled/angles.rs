//! Sines and cosines in loops: those of a turn, or of all turns at once for a single state.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::super::names::Names;
use super::RolledWriter;
use crate::rolled::Place;
use crate::symbolic::angles::Angles;
use crate::symbolic::Op;

impl RolledWriter<'_> {
    /// Sines and cosines of the angles that depend on what the block reads.
    pub(super) fn angles(
        &self,
        out: &mut String,
        k: usize,
        angles: &Angles,
        names: &BTreeMap<u32, String>,
        indent: &str,
    ) {
        let n = angles.early.len();
        if n == 0 {
            return;
        }
        let open = match self.turns_of_angles(k, angles) {
            None => "let (sines, cosines) = {".to_string(),
            Some(_) => {
                let of_turn = ["sines", "cosines"].map(|name| {
                    let all: Vec<String> = (0..n).map(|i| format!("{name}{k}[{n} * k + {i}]")).collect();
                    format!("[{}]", all.join(", "))
                });
                format!("let (sines, cosines) = if LANES == 1 {{ ({}) }} else {{", of_turn.join(", "))
            }
        };
        let _ = writeln!(out, "{indent}{open}");
        let inner = &format!("{indent}    ");
        let _ = writeln!(out, "{inner}let mut angles = {};", self.head.rows(n));
        self.fill_angles(out, k, angles, names, inner, "");
        let _ = writeln!(out, "{inner}{}\n{indent}}};", self.head.sines_and_cosines("angles", n));
    }

    /// Writes the angles of a turn to an array, from an index on.
    fn fill_angles(
        &self,
        out: &mut String,
        k: usize,
        angles: &Angles,
        names: &BTreeMap<u32, String>,
        indent: &str,
        from: &str,
    ) {
        let _ = writeln!(out, "{indent}for l in 0..LANES {{");
        let steps = &self.program.blocks[k].program.steps;
        for (id, op, _) in steps.iter().filter(|(id, ..)| angles.before.contains(id)) {
            let _ = writeln!(out, "{indent}    let {} = {};", names[id], self.value(k, op, names));
        }
        for (k, angle) in angles.early.keys().enumerate() {
            let _ = writeln!(out, "{indent}    angles[{from}{k}][l] = {};", names[angle]);
        }
        let _ = writeln!(out, "{indent}}}");
    }

    /// Number of turns, where the angles of all of them are known before the loop.
    fn turns_of_angles(&self, k: usize, angles: &Angles) -> Option<usize> {
        let block = &self.program.blocks[k];
        let known = |place: Place| matches!(place, Place::Given(_) | Place::GivenOfTurn { .. } | Place::Column(_));
        let steps = block.program.steps.iter().filter(|(id, ..)| angles.before.contains(id));
        let mut inputs = steps.filter_map(|(_, op, _)| if let Op::Input(k) = op { Some(*k as usize) } else { None });
        (!angles.early.is_empty() && inputs.all(|k| known(block.inputs[k])))
            .then(|| block.run().map(|run| self.program.loops[run].table.len()))?
    }

    /// Sines and cosines of all turns of a loop, for a single state.
    pub(super) fn all_turns(&self, out: &mut String, k: usize) {
        let block = &self.program.blocks[k];
        let angles = Angles::new(&block.program);
        let (Some(turns), Some(run)) = (self.turns_of_angles(k, &angles), block.run()) else { return };
        let names = Names::default().block(self.plan, &self.program, block, self.head.inputs);
        let n = angles.early.len();
        let all = n * turns;
        let _ = writeln!(out, "        let (sines{k}, cosines{k}) = if LANES == 1 {{");
        let _ = writeln!(out, "            let mut angles = {};", self.head.rows(all));
        let _ = writeln!(out, "            for k in 0..{turns} {{");
        self.open_table(out, block, run);
        self.fill_angles(out, k, &angles, &names, "                ", &format!("{n} * k + "));
        let _ = writeln!(out, "            }}\n            {}", self.head.sines_and_cosines("angles", all));
        let _ = writeln!(out, "        }} else {{ ([[0.0; LANES]; {all}], [[0.0; LANES]; {all}]) }};");
    }
}
