//! The wrapper of a module in JavaScript, and its types.

use std::fmt::Write;

use super::layout::{Area, Layout};
use super::module::MEMORY;
use crate::code::Code;
use crate::emit::constants::{constants, Constant, Content};
use crate::emit::head::count_line;
use crate::emit::header::lines;
use crate::emit::Input;
use crate::options::{Arithmetic, Precision};
use crate::output::{flat_entry, OutputProgram};
use mbd_runtime::system::Row;

/// What both files are written from.
pub struct Wrapper<'a> {
    input: &'a Input<'a>,
    layout: &'a Layout,
    functions: &'a [&'a OutputProgram<Code>],
    /// Lines of the comment at the top.
    top: Vec<String>,
    constants: Vec<Constant>,
}

impl<'a> Wrapper<'a> {
    /// `functions` are the programs of all functions that the module has.
    pub fn new(input: &'a Input<'a>, layout: &'a Layout, functions: &'a [&'a OutputProgram<Code>]) -> Wrapper<'a> {
        let mut wrapper = Wrapper { input, layout, functions, top: Vec::new(), constants: constants(input) };
        if let lanes @ 2.. = layout.number.lanes() {
            let (doc, name) = (format!("{LANES_DOC}."), "LANES".to_string());
            wrapper.constants.push(Constant { doc, name, value: Content::Number(lanes) });
        }
        wrapper.top = lines(input);
        wrapper.memory_lines();
        wrapper
    }

    /// Describes the memory in the comment at the top.
    fn memory_lines(&mut self) {
        let number = self.input.options.precision.name();
        let mut rows = Vec::new();
        let mut row = |area: &Area, what: &str| {
            let dims: String = area.dims.iter().map(|n| format!("[{n}]")).collect();
            rows.push(format!("  {:>8} {:>8}  {}{dims}: {what}", area.offset, area.len(), area.name));
        };
        self.layout.inputs.iter().for_each(|area| row(area, area.doc));
        for (program, areas) in self.functions.iter().zip(&self.layout.functions) {
            let what = format!("result of `{}`.", program.spec.name);
            areas.results.iter().for_each(|area| row(area, &what));
        }
        let arithmetic = match self.input.options.arithmetic {
            Arithmetic::Exact => "that of the interpreter, bit by bit",
            Arithmetic::Fast => {
                "rewritten for speed; products and sums are rounded separately, without fused operations"
            }
        };
        let states = match self.layout.number.lanes() {
            1 => String::new(),
            lanes => format!("\nFunctions compute {lanes} states at once: the last index of every array is the state."),
        };
        let text = format!(
            "
Arithmetic: {arithmetic}.

The module imports nothing. It exports `{MEMORY}`, which does not grow, and the functions, which have no arguments and
give nothing back: all arrays are in the memory, the last index fastest, numbers of type {number} with the byte order of
WebAssembly (little-endian). Functions leave inputs as they are. The memory after these arrays is the functions' own.{states}

Byte offset, number of entries, array:"
        );
        self.top.extend(text.lines().map(str::to_string));
        self.top.extend(rows);
    }

    /// Typed array of the numbers.
    fn array(&self) -> &'static str {
        match self.input.options.precision {
            Precision::F64 => "Float64Array",
            Precision::F32 => "Float32Array",
        }
    }

    /// Name of the class.
    fn class(&self) -> &str {
        &self.input.options.type_name
    }

    /// The comment at the top.
    fn head(&self) -> String {
        // JavaScript ends lines at more characters than Rust.
        let ends_line = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
        let lines = self.top.iter().map(|line| format!("// {}", line.replace(ends_line, "?")));
        lines.map(|line| line.trim_end().to_string() + "\n").collect()
    }

    /// The wrapper.
    pub fn javascript(&self) -> String {
        let mut out = self.head();
        let (class, array) = (self.class(), self.array());
        let _ = writeln!(out, "\n{}\nexport class {class} {{", comment("", &self.about()));
        for constant in &self.constants {
            let _ = writeln!(
                out,
                "{}\n  static {} = {};",
                comment("  ", &constant_doc(constant)),
                constant.name,
                literal(&constant.value)
            );
        }
        for program in self.functions {
            let _ = writeln!(out, "  #{0};", program.spec.name);
        }
        let _ = writeln!(out, "\n  /** @param {{WebAssembly.Instance}} instance an instance of the module */");
        let _ = writeln!(out, "  constructor(instance) {{\n    const {{ exports }} = instance;");
        let _ = writeln!(
            out,
            "    const view = (offset, length) => new globalThis.{array}(exports.{MEMORY}.buffer, offset, length);"
        );
        let _ = writeln!(out, "{}\n    this.{MEMORY} = exports.{MEMORY};", comment("    ", &[MEMORY_DOC.to_string()]));
        for area in &self.layout.inputs {
            let _ = writeln!(
                out,
                "{}\n    this.{} = view({}, {});",
                comment("    ", &area_doc(area)),
                area.name,
                area.offset,
                area.len()
            );
        }
        for (program, areas) in self.functions.iter().zip(&self.layout.functions) {
            let view = |area: &Area| format!("view({}, {})", area.offset, area.len());
            let results = match &areas.results[..] {
                [one] => view(one),
                all => format!(
                    "{{ {} }}",
                    all.iter().map(|area| format!("{}: {}", area.name, view(area))).collect::<Vec<_>>().join(", ")
                ),
            };
            let name = program.spec.name;
            let _ = writeln!(out, "    this.#{name} = {{ compute: exports.{name}, results: {results} }};");
        }
        let _ = writeln!(out, "  }}");
        for (k, program) in self.functions.iter().enumerate() {
            let name = program.spec.name;
            let _ = writeln!(out, "\n{}\n  {name}() {{", comment("  ", &self.function_doc(k)));
            let _ = writeln!(out, "    this.#{name}.compute();\n    return this.#{name}.results;\n  }}");
        }
        let _ = writeln!(out, "}}\n\n{}", comment("", &LOAD_DOC.map(str::to_string)));
        out + &LOAD.replace("@CLASS@", class)
    }

    /// Declarations for TypeScript.
    pub fn types(&self) -> String {
        let mut out = self.head();
        let (class, array) = (self.class(), self.array());
        let _ = writeln!(out, "\n{}\nexport declare class {class} {{", comment("", &self.about()));
        for constant in &self.constants {
            let _ = writeln!(
                out,
                "{}\n  static readonly {}: {};",
                comment("  ", &constant_doc(constant)),
                constant.name,
                constant_type(&constant.value)
            );
        }
        let _ = writeln!(out, "  constructor(instance: WebAssembly.Instance);");
        let _ = writeln!(out, "{}\n  readonly {MEMORY}: WebAssembly.Memory;", comment("  ", &[MEMORY_DOC.to_string()]));
        for area in &self.layout.inputs {
            let _ = writeln!(out, "{}\n  readonly {}: {array};", comment("  ", &area_doc(area)), area.name);
        }
        for (k, (program, areas)) in self.functions.iter().zip(&self.layout.functions).enumerate() {
            let results = match &areas.results[..] {
                [_] => array.to_string(),
                all => format!(
                    "{{ {} }}",
                    all.iter().map(|area| format!("readonly {}: {array}", area.name)).collect::<Vec<_>>().join("; ")
                ),
            };
            let _ = writeln!(out, "{}\n  {}(): {results};", comment("  ", &self.function_doc(k)), program.spec.name);
        }
        let _ = writeln!(out, "}}\n\n{}", comment("", &LOAD_DOC.map(str::to_string)));
        out + &LOAD_TYPE.replace("@CLASS@", class)
    }

    /// Documentation of the class.
    fn about(&self) -> Vec<String> {
        let outputs: Vec<&str> = self.functions.iter().map(|program| program.spec.name).collect();
        let mut lines = vec![
            format!("Dynamics of `{}` in canonical form: {}.", self.input.plan.model.name, outputs.join(", ")),
            "Inputs are views of the module's memory: fill them, then call a function.".to_string(),
        ];
        if self.layout.number.lanes() > 1 {
            lines.push(format!("`LANES`: {LANES_DOC}; the last index of every array is the state."));
        }
        lines
    }

    /// Documentation of a function.
    fn function_doc(&self, k: usize) -> Vec<String> {
        let (program, areas) = (self.functions[k], &self.layout.functions[k]);
        let mut lines: Vec<String> = program.spec.doc().map(str::to_string).collect();
        let inputs: Vec<String> = program.spec.inputs.iter().map(|array| format!("`{}`", array.name)).collect();
        let results: Vec<String> = areas.results.iter().map(|area| format!("`{}`{}", area.name, shape(area))).collect();
        let returned = match &results[..] {
            [one] => format!("Returns {one}, a view of the memory, the same one with every call."),
            all => format!("Returns {}, views of the memory, the same ones with every call.", all.join(", ")),
        };
        lines.push(format!("Reads {} and the inputs beside the state. {returned}", inputs.join(", ")));
        lines.extend(count_line(&program.program.counts()));
        lines
    }
}

const LANES_DOC: &str = "Number of states that are computed at once";

const MEMORY_DOC: &str = "The module's memory; it does not grow.";

const LOAD_DOC: [&str; 4] = [
    "Loads the module, which lies beside this file. Every call makes an instance with its own memory.",
    "`source` is a URL (a string is relative to the page), a response, the bytes of the module, or a compiled",
    "`WebAssembly.Module`. Node fetches no files: `load(await readFile(new URL(\"NAME.wasm\", import.meta.url)))` with",
    "`readFile` of `node:fs/promises`.",
];

const LOAD: &str = "export async function load(source) {
  let given = await source;
  if (given instanceof globalThis.WebAssembly.Module) {
    return new @CLASS@(await globalThis.WebAssembly.instantiate(given));
  }
  if (typeof given === \"string\" || given instanceof globalThis.URL) {
    given = await globalThis.fetch(given);
  }
  if (typeof given?.arrayBuffer === \"function\") {
    if (given.ok === false) {
      throw new globalThis.Error(`the module could not be loaded: ${given.url} answers ${given.status} ${given.statusText}`);
    }
    given = await given.arrayBuffer();
  }
  const { instance } = await globalThis.WebAssembly.instantiate(given);
  return new @CLASS@(instance);
}
";

const LOAD_TYPE: &str = "export declare function load(
  source: Source | Promise<Source>,
): Promise<@CLASS@>;

type Source = string | URL | Response | Blob | BufferSource | WebAssembly.Module;
";

/// A comment that documents what follows it.
fn comment(indent: &str, lines: &[String]) -> String {
    let safe = |line: &String| line.replace("*/", "* /").replace(char::is_control, "?");
    match lines {
        [line] => format!("{indent}/** {} */", safe(line)),
        lines => {
            let lines: String = lines.iter().map(|line| format!("{indent} * {}\n", safe(line))).collect();
            format!("{indent}/**\n{lines}{indent} */")
        }
    }
}

/// Lengths of an array with several indices, for documentation.
fn shape(area: &Area) -> String {
    match area.dims.len() {
        1 => String::new(),
        _ => format!(" ({})", area.dims.iter().map(usize::to_string).collect::<Vec<_>>().join(" × ")),
    }
}

fn area_doc(area: &Area) -> Vec<String> {
    if area.dims.len() < 2 {
        return vec![area.doc.to_string()];
    }
    let lengths: Vec<String> = area.dims.iter().map(usize::to_string).collect();
    let (indices, index) = flat_entry(&lengths);
    vec![format!("{} Entry ({indices}) has index {index}.", area.doc)]
}

fn constant_doc(constant: &Constant) -> Vec<String> {
    vec![constant.doc.clone()]
}

fn list(items: impl Iterator<Item = String>) -> String {
    format!("[{}]", items.collect::<Vec<_>>().join(", "))
}

/// A constant's value.
fn literal(value: &Content) -> String {
    match value {
        Content::Number(n) => n.to_string(),
        Content::Numbers(all) => list(all.iter().map(usize::to_string)),
        Content::Names(all) => list(all.iter().map(|name| quoted(name))),
        Content::Floats(all) => list(all.iter().map(|x| format!("{x:?}"))),
        Content::Flags(all) => list(all.iter().map(bool::to_string)),
        Content::Rows(all) => list(all.iter().map(|Row { constraint, holonomic, first, len }| {
            format!("{{ constraint: {constraint}, holonomic: {holonomic}, first: {first}, len: {len} }}")
        })),
    }
}

fn constant_type(value: &Content) -> String {
    match value {
        Content::Number(n) => n.to_string(),
        Content::Numbers(_) | Content::Floats(_) => "readonly number[]".to_string(),
        Content::Names(_) => "readonly string[]".to_string(),
        Content::Flags(_) => "readonly boolean[]".to_string(),
        Content::Rows(_) => {
            "readonly { constraint: number; holonomic: boolean; first: number; len: number }[]".to_string()
        }
    }
}

/// A string literal.
fn quoted(name: &str) -> String {
    let mut out = "\"".to_string();
    for c in name.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') => {
                let _ = write!(out, "\\u{{{:x}}}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out + "\""
}
