//! The table of outputs as text: help of the command, documentation of the macro.

use std::fmt::Write;

use super::{Availability, Output, Spec};

/// Names separated by commas.
fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

impl Spec {
    /// Arguments and results: `(q, p) -> qd, pd`.
    pub fn arrow(&self) -> String {
        let [inputs, results] = [self.inputs, self.results].map(|arrays| names(arrays.iter().map(|array| array.name)));
        format!("({inputs}) -> {results}")
    }

    /// The first sentence of the documentation, which may go on in its second line.
    fn summary(&self) -> String {
        let doc = self.doc().collect::<Vec<_>>().join(" ");
        match doc.split_once(". ") {
            Some((first, _)) => format!("{first}."),
            None => doc,
        }
    }
}

/// Help of an option that lists outputs.
pub fn help() -> String {
    let mut out = "What to compute, with commas between, or `all`:".to_string();
    let rows = |out: &mut String, constrained: bool| {
        // Code for the modes of contacts has its own outputs, which nobody asks for one by one.
        let with = |spec: &&Spec| match spec.availability {
            Availability::Every | Availability::WithoutConstraints => !constrained,
            Availability::WithConstraints => constrained,
            Availability::WithContacts => false,
        };
        for spec in Output::ALL.iter().map(|output| output.spec()).filter(with) {
            let _ = write!(out, "\n  {} {}", spec.name, spec.arrow());
            let _ = write!(out, "\n      {}", spec.summary());
        }
    };
    rows(&mut out, false);
    let _ = write!(out, "\nOf models with loops or couplings (they get these beside the defaults):");
    rows(&mut out, true);
    let lacking = Output::available(false).filter(|output| !output.spec().available(true)).map(Output::name);
    let lacking: Vec<String> = lacking.map(|name| format!("`{name}`")).collect();
    let _ = write!(out, "\nSuch models have no {}.", lacking.join(", "));
    out
}

/// The table as Markdown, for documentation.
pub fn table() -> String {
    let mut out = "| output | arguments | results | meaning |\n| --- | --- | --- | --- |\n".to_string();
    for spec in Output::ALL.iter().map(|output| output.spec()) {
        let results = spec.results.iter().map(|array| {
            let dims: String = array.dims.iter().map(|dim| format!("[{}]", dim.text())).collect();
            format!("`{}{dims}`", array.name)
        });
        let only = match spec.availability {
            Availability::Every => "",
            Availability::WithConstraints => " Only with loops or couplings.",
            Availability::WithoutConstraints => " Not with loops or couplings.",
            Availability::WithContacts => " Only in code for the modes of contacts.",
        };
        let fields = spec.structure.map_or(String::new(), |name| format!("fields of `{name}`: "));
        let inputs = names(spec.inputs.iter().map(|array| array.name));
        let (results, doc) = (results.collect::<Vec<_>>().join(", "), spec.doc().collect::<Vec<_>>().join(" "));
        let _ = writeln!(out, "| `{}` | `{inputs}` | {fields}{results} | {doc}{only} |", spec.name);
    }
    out
}
