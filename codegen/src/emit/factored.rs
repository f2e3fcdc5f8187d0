//! Factored modes: a function for each piece, and one that calls those of the modes that act.
//!
//! What pieces keep for one another is in an array `kept`, and what limbs that touch hand to the trunk is in one part
//! each of an array of parts.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::head::Head;
use super::names::{identifier, Names};
use super::signature::Port;
use super::straight::Straight;
use crate::factored::{FactoredProgram, Goal, Group, Piece, Source};
use crate::options::Arithmetic;
use crate::output::locate;
use crate::plan::Plan;

/// Writes the functions of a factored program.
pub struct FactoredWriter<'a> {
    plan: &'a Plan,
    program: &'a FactoredProgram,
    head: Head<'a>,
}

impl<'a> FactoredWriter<'a> {
    /// A writer for one program.
    pub fn new(plan: &'a Plan, program: &'a FactoredProgram, head: Head<'a>) -> Self {
        FactoredWriter { plan, program, head }
    }

    /// Function, kernel and pieces.
    pub fn write(&self, out: &mut String) {
        let program = self.program;
        self.head.write(out, usize::MAX);
        let (kept, part, groups) = (program.kept.max(1), program.part.max(1), program.groups.len().max(1));
        let _ = writeln!(out, "        let mut kept = [0.0; {kept}];");
        let _ = writeln!(out, "        let mut parts = [[0.0; {part}]; {groups}];");
        let _ = writeln!(out, "        let mut sequence = 0;");
        self.call(out, "        ", &program.always, "always", "");
        for (g, group) in program.groups.iter().enumerate() {
            let mutable = if group.modes.iter().any(|mode| mode.late.is_some()) { "mut " } else { "" };
            let _ = writeln!(out, "        let {mutable}limb{g} = {};", self.mode(group));
        }
        if !program.touching.is_empty() {
            let any: Vec<String> = (0..program.groups.len()).map(|g| format!("limb{g} > 0")).collect();
            let _ = writeln!(out, "        if {} {{", any.join(" || "));
            self.call(out, "            ", &program.touching, "touching", "");
            let _ = writeln!(out, "        }}");
        }
        self.early(out);
        self.limbs(out, false);
        let _ = writeln!(out, "        match sequence {{");
        for (k, trunk) in program.trunks.iter().enumerate() {
            let _ = writeln!(out, "            {} => {{", self.sequences(k));
            self.call(out, "                ", &trunk.solve, &format!("trunk{k}"), "&mut parts");
            let _ = writeln!(out, "            }}");
        }
        let _ = writeln!(out, "            _ => {{}}\n        }}");
        self.call(out, "        ", &program.outward, "outward", "");
        self.limbs(out, true);
        let _ = writeln!(out, "        match sequence {{");
        for (k, trunk) in program.trunks.iter().enumerate().filter(|(_, trunk)| !trunk.finish.is_empty()) {
            let _ = writeln!(out, "            {} => {{", self.sequences(k));
            self.call(out, "                ", &trunk.finish, &format!("finish{k}"), "&mut parts");
            let _ = writeln!(out, "            }}");
        }
        let _ = writeln!(out, "            _ => {{}}\n        }}");
        let _ = writeln!(out, "    }}");
        self.pieces(out);
    }

    /// All pieces.
    fn pieces(&self, out: &mut String) {
        let program = self.program;
        self.piece(out, &program.always, "always", "What is the same in all modes, inward.");
        self.piece(out, &program.touching, "touching", "What several pieces need where anything touches.");
        self.piece(out, &program.outward, "outward", "What is the same in all modes, outward.");
        for (g, group) in program.groups.iter().enumerate() {
            for (m, mode) in group.modes.iter().enumerate() {
                let words = crate::modes::words(&mode.modes);
                let names: Vec<&str> =
                    group.contacts.iter().map(|c| self.plan.model.contacts[*c].name.as_str()).collect();
                let names = names.join(", ");
                self.piece(out, &mode.inward, &format!("limb{g}_{m}"), &format!("Inward, {names}: {words}."));
                self.piece(out, &mode.outward, &format!("limb{g}_{m}_out"), &format!("Outward, {names}: {words}."));
            }
        }
        for (k, trunk) in program.trunks.iter().enumerate() {
            self.piece(out, &trunk.solve, &format!("trunk{k}"), "The trunk and the multipliers of the contacts.");
            self.piece(out, &trunk.finish, &format!("finish{k}"), "Sums over all limbs.");
        }
    }

    /// Expression of the number of the mode of a group.
    fn mode(&self, group: &Group) -> String {
        let contacts = self.plan.contacts::<f64>();
        let acts = |row: usize| format!("usize::from({} != 0.0)", self.head.input(self.program.acts + row, "", "0"));
        let mut text = String::new();
        for &contact in &group.contacts {
            let (row, friction) = (contacts[contact].row, contacts[contact].friction > 0.0);
            let (count, number) = match contacts[contact].tangents && friction {
                true => (3, format!("{} + {}", acts(row), acts(row + 1))),
                false => (2, acts(row)),
            };
            text = if text.is_empty() { number } else { format!("({text}) * {count} + {number}") };
        }
        text
    }

    /// The sequences that a trunk serves, as a pattern.
    fn sequences(&self, trunk: usize) -> String {
        let all = self.program.sequences.iter().enumerate().filter(|(_, t)| **t == trunk);
        all.map(|(k, _)| k.to_string()).collect::<Vec<_>>().join(" | ")
    }

    /// Inward calls of the limbs that may follow the rows of their contacts, each with its other mode where it cannot.
    fn early(&self, out: &mut String) {
        for (g, group) in self.program.groups.iter().enumerate() {
            for (m, mode) in group.modes.iter().enumerate() {
                let Some(late) = mode.late else { continue };
                let _ = writeln!(out, "        if limb{g} == {m} {{");
                self.call(out, "            ", &mode.inward, &format!("limb{g}_{m}"), "");
                let flag = self.program.early_rows_act + g;
                let _ = writeln!(out, "            if kept[{flag}] == 0.0 {{ limb{g} = {late}; }}\n        }}");
            }
        }
    }

    /// Calls of the limbs in their modes: in the order of their places, each with its part.
    fn limbs(&self, out: &mut String, late: bool) {
        let _ = writeln!(out, "        let mut free = parts.iter_mut();");
        let classes = self.program.classes();
        for (g, group) in self.program.groups.iter().enumerate() {
            let _ = writeln!(out, "        match limb{g} {{");
            for (m, mode) in group.modes.iter().enumerate() {
                let last = m + 1 == group.modes.len();
                let pattern = if last { "_".to_string() } else { m.to_string() };
                let (piece, name) = match late {
                    false => (&mode.inward, format!("limb{g}_{m}")),
                    true => (&mode.outward, format!("limb{g}_{m}_out")),
                };
                let _ = writeln!(out, "            {pattern} => {{");
                if !late {
                    let _ = writeln!(out, "                sequence = sequence * {} + {};", classes[g], mode.class);
                }
                if !late && mode.late.is_some() {
                    // It has been called already.
                } else if mode.reaches {
                    let _ = writeln!(out, "                if let Some(part) = free.next() {{");
                    let used = if piece.is_empty() { "                    let _ = part;\n" } else { "" };
                    let _ = write!(out, "{used}");
                    self.call(out, "                    ", piece, &name, "part");
                    let _ = writeln!(out, "                }}");
                } else {
                    self.call(out, "                ", piece, &name, "");
                }
                let _ = writeln!(out, "            }}");
            }
            let _ = writeln!(out, "        }}");
        }
    }

    /// The arrays that a piece reads and writes.
    fn ports(&self, piece: &Piece) -> Vec<&Port> {
        let mut used: BTreeSet<&str> = BTreeSet::new();
        for source in &piece.inputs {
            if let Source::Given(k) = source {
                used.insert(locate(self.head.inputs, *k).0.name);
            }
        }
        let places = self.head.places();
        for goal in &piece.outputs {
            if let Goal::Result(k) = goal {
                used.insert(places[*k].0);
            }
        }
        self.head.ports.iter().filter(|port| used.contains(port.name)).collect()
    }

    /// What a piece has beside arrays of the function and `kept`.
    fn part(&self, piece: &Piece) -> &'static str {
        let own = piece.inputs.iter().any(|s| matches!(s, Source::Own(_)))
            || piece.outputs.iter().any(|g| matches!(g, Goal::Own(_)));
        let parts = piece.inputs.iter().any(|s| matches!(s, Source::Part { .. }))
            || piece.outputs.iter().any(|g| matches!(g, Goal::Part { .. }));
        match (own, parts) {
            (true, _) => "own",
            (_, true) => "parts",
            _ => "",
        }
    }

    fn call(&self, out: &mut String, indent: &str, piece: &Piece, name: &str, part: &str) {
        if piece.is_empty() {
            return;
        }
        let mut arguments: Vec<&str> = self.ports(piece).into_iter().map(|port| port.name).collect();
        arguments.push("&mut kept");
        if !self.part(piece).is_empty() {
            arguments.push(part);
        } else if part == "part" {
            let _ = writeln!(out, "{indent}let _ = part;");
        }
        let _ = writeln!(out, "{indent}Self::{}_{name}::<A>({});", self.head.signature.name, arguments.join(", "));
    }

    fn piece(&self, out: &mut String, piece: &Piece, name: &str, doc: &str) {
        if piece.is_empty() {
            return;
        }
        let options = self.head.options;
        let (rt, t) = (&options.runtime, options.precision.name());
        let mut parameters: Vec<String> = self.ports(piece).into_iter().map(|port| port.parameter(rt, t)).collect();
        parameters.push(format!("kept: &mut [{t}; {}]", self.program.kept.max(1)));
        let (part, groups) = (self.program.part.max(1), self.program.groups.len().max(1));
        match self.part(piece) {
            "own" => parameters.push(format!("own: &mut [{t}; {part}]")),
            "parts" => parameters.push(format!("parts: &mut [[{t}; {part}]; {groups}]")),
            _ => {}
        }
        // With the instructions of the processor, a piece is part of the function that was made for them.
        let inline = if options.arithmetic == Arithmetic::Fast { "always" } else { "never" };
        let _ = writeln!(out, "\n    /// {doc}\n    #[inline({inline})]");
        let _ = writeln!(
            out,
            "    fn {}_{name}<A: {rt}::kernel::Arithmetic>({}) {{",
            self.head.signature.name,
            parameters.join(", ")
        );
        let sources: Vec<String> = piece
            .inputs
            .iter()
            .map(|source| match *source {
                Source::Given(k) => self.head.input(k, "", "0"),
                Source::Kept(k) => format!("kept[{k}]"),
                Source::Own(k) => format!("own[{k}]"),
                Source::Part { place, entry } => format!("parts[{place}][{entry}]"),
            })
            .collect();
        let taken = ["kept", "own", "parts"].map(identifier);
        let names = Names::besides(taken).piece(self.plan, piece, self.head.inputs);
        let head = Head { ports: self.head.ports, inputs: self.head.inputs, ..self.head };
        let results = Straight::piece(self.plan, &piece.program, head, names, &sources).write_piece(out);
        let places = self.head.places();
        for (goal, value) in piece.outputs.iter().zip(results) {
            let _ = match *goal {
                Goal::Result(k) => writeln!(out, "            {}.set({}, 0, {value});", places[k].0, places[k].1),
                Goal::Kept(k) => writeln!(out, "            kept[{k}] = {value};"),
                Goal::Own(k) => writeln!(out, "            own[{k}] = {value};"),
                Goal::Part { place, entry } => writeln!(out, "            parts[{place}][{entry}] = {value};"),
            };
        }
        let _ = writeln!(out, "    }}");
    }
}
