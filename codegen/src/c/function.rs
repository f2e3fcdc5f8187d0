//! One function: its declaration, its documentation, its body.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::instructions::Writer;
use super::names::{comment, literal, number, Prefix};
use crate::code::Code;
use crate::emit::head::count_line;
use crate::emit::names::Names;
use crate::emit::Input;
use crate::lower::{lower, Memory};
use crate::output::{flat_entry, Array, Dim, OutputProgram};
use crate::rolled::RolledProgram;

/// A function that is written.
pub struct Function<'a> {
    pub prefix: &'a Prefix,
    pub input: &'a Input<'a>,
    pub program: &'a OutputProgram<Code>,
}

/// Name of a dimension, or its number where it is always the same.
pub fn length(prefix: &Prefix, dim: Dim) -> String {
    match dim {
        // There is a joint force for each velocity.
        Dim::Efforts => length(prefix, Dim::Nv),
        Dim::Gravity => "3".to_string(),
        Dim::Const(n) => n.to_string(),
        dim => format!("{}_{}", prefix.upper, dim.text()),
    }
}

/// Number of entries of an array.
pub fn entries(prefix: &Prefix, dims: &[Dim]) -> String {
    dims.iter().map(|dim| length(prefix, *dim)).collect::<Vec<_>>().join(" * ")
}

impl Function<'_> {
    /// Result type, name and parameters.
    pub fn declaration(&self) -> String {
        let (lower, upper) = (&self.prefix.lower, &self.prefix.upper);
        let number = number(self.input.options.precision);
        let parameter = |array: &Array, constant: &str| match array.len(&self.input.programs.sizes) {
            // There are no arrays without entries.
            0 => format!("{constant}{number} *{upper}_RESTRICT {}", array.name),
            _ => format!("{constant}{number} {}[{upper}_RESTRICT {}]", array.name, entries(self.prefix, array.dims)),
        };
        let spec = self.program.spec;
        let mut parameters = vec![format!("const {lower}_inputs *{upper}_RESTRICT in")];
        parameters.extend(spec.inputs.iter().map(|array| parameter(array, "const ")));
        parameters.extend(spec.results.iter().map(|array| parameter(array, "")));
        format!("void {lower}_{}(\n    {})", spec.name, parameters.join(",\n    "))
    }

    /// Lines of the documentation.
    pub fn documentation(&self) -> Vec<String> {
        let spec = self.program.spec;
        let mut lines: Vec<String> = spec.doc().map(comment).collect();
        for array in spec.inputs.iter().chain(spec.results).filter(|array| array.dims.len() > 1) {
            let lengths: Vec<String> = array.dims.iter().map(|dim| length(self.prefix, *dim)).collect();
            let (indices, flat) = flat_entry(&lengths);
            lines.push(format!("Entry ({indices}) of `{name}` is `{name}[{flat}]`.", name = array.name));
        }
        lines.extend(count_line(&self.program.program.counts()));
        if let Code::Rolled(_) = self.program.program {
            let bytes = self.input.options.precision.bytes() * Memory::new(&self.program.program, &[], 1, 1).len();
            lines.push(format!("Working memory on the stack: {bytes} bytes."));
        }
        lines
    }

    /// The function. Its statements are those of the program.
    pub fn definition(&self) -> String {
        let Function { prefix, input, program } = *self;
        let (spec, precision) = (program.spec, input.options.precision);
        let array = |array: &crate::output::InputArray| match array.field {
            true => format!("in->{}", array.name),
            false => array.name.to_string(),
        };
        let parameters = spec.inputs.iter().chain(spec.results).map(|array| array.name);
        let taken = || Names::besides(parameters.clone().map(str::to_string));
        let mut writer = Writer {
            inputs: program.inputs.iter().map(array).collect(),
            results: spec.results.iter().map(|array| array.name.to_string()).collect(),
            plan: Some(input.plan),
            names: match &program.program {
                Code::Straight(straight) => vec![taken().straight(input.plan, straight, &program.inputs)],
                Code::Rolled(rolled) => {
                    let blocks = rolled.blocks.iter();
                    blocks.map(|block| taken().block(input.plan, rolled, block, &program.inputs)).collect()
                }
            },
            scoped: matches!(program.program, Code::Rolled(_)),
            ..Writer::new(prefix, precision)
        };
        let lengths: Vec<usize> = spec.results.iter().map(|array| array.len(&input.programs.sizes)).collect();
        lower(&mut writer, program, &lengths, &[]);
        writer.close();
        let mut out = format!("{}\n{{\n", self.declaration());
        let read: BTreeSet<&str> = writer.read.iter().map(|k| program.inputs[*k].name).collect();
        let reads_fields = writer.read.iter().any(|k| program.inputs[*k].field);
        let unread = spec.inputs.iter().filter(|array| !read.contains(array.name));
        let unwritten = spec.results.iter().filter(|array| array.len(&input.programs.sizes) == 0);
        let unused = unread.chain(unwritten).map(|array| array.name);
        for name in (!reads_fields).then_some("in").into_iter().chain(unused) {
            let _ = writeln!(out, "    (void){name};");
        }
        if let Code::Rolled(rolled) = &program.program {
            self.working_memory(&mut out, rolled);
        }
        out + &writer.out + "}\n"
    }

    /// Tables and working memory of rolled code.
    fn working_memory(&self, out: &mut String, rolled: &RolledProgram) {
        let precision = self.input.options.precision;
        let number = number(precision);
        for (k, run) in rolled.loops.iter().enumerate().filter(|(_, run)| run.table.iter().any(|row| !row.is_empty())) {
            let bodies = [run.nodes.start, run.nodes.end - 1].map(|node| comment(&self.input.plan.nodes[node].name));
            let _ = writeln!(
                out,
                "    /* Constants from {} to {}, one row for each turn of the loop. */",
                bodies[0], bodies[1]
            );
            let _ = writeln!(
                out,
                "    static const {number} table{k}[{}] = {{",
                run.table.iter().map(Vec::len).sum::<usize>()
            );
            for row in &run.table {
                let row: Vec<String> = row.iter().map(|x| literal(*x, precision)).collect();
                let _ = writeln!(out, "        {},", row.join(", "));
            }
            let _ = writeln!(out, "    }};");
        }
        let memory = Memory::new(&self.program.program, &[], 1, 1);
        let arrays = ["angles", "sines", "cosines"].map(|name| (name.to_string(), memory.angles));
        let rows = memory.rows.iter().enumerate().map(|(k, len)| (format!("rows{k}"), *len));
        for (name, len) in arrays.into_iter().chain([("kept".to_string(), memory.kept)]).chain(rows) {
            if len > 0 {
                let _ = writeln!(out, "    {number} {name}[{len}];");
            }
        }
    }
}
