//! The header: constants, the struct of inputs, declarations.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::function::{entries, length, Function};
use super::names::{comment, literal, number, quoted, Prefix};
use crate::emit::constants::{constants, Constant, Content};
use crate::emit::fields::{initial, neutral, Field};
use crate::emit::Input;
use crate::options::{Arithmetic, Precision};
use crate::output::{flat_entry, Dim, FIELDS};
use mbd_runtime::system::Row;

/// What every file says about its compilation.
pub fn compilation(input: &Input) -> Vec<String> {
    let fast = [
        "Compiler: -O3 -ffp-contract=fast lets products and sums become fused multiply-adds; -march=native (or -mcpu=...) lets",
        "the compiler use those of the processor.",
    ];
    let exact =
        ["Compiler: -ffp-contract=off keeps the bits of the interpreter; GCC and Clang fuse operations otherwise."];
    let lines = match input.options.arithmetic {
        Arithmetic::Fast => &fast[..],
        Arithmetic::Exact => &exact[..],
    };
    let more = ["-ffast-math is an error: it breaks the sine and cosine, which are part of the code. Language: C99."];
    lines.iter().chain(&more).map(|line| line.to_string()).collect()
}

/// A comment of one line or of several.
pub fn comment_block(out: &mut String, indent: &str, lines: &[String]) {
    match lines {
        [] => {}
        [line] => {
            let _ = writeln!(out, "{indent}/* {line} */");
        }
        [first, rest @ ..] => {
            let _ = writeln!(out, "{indent}/* {first}");
            for line in rest {
                let _ = writeln!(out, "{}", format!("{indent} * {line}").trim_end());
            }
            let _ = writeln!(out, "{indent} */");
        }
    }
}

/// The header of some functions. `lines` are those of the comment at the top.
pub fn header(prefix: &Prefix, input: &Input, fields: &[Field], functions: &[Function], lines: &[String]) -> String {
    let upper = &prefix.upper;
    let mut out = String::new();
    comment_block(&mut out, "", lines);
    let _ = writeln!(out, "#ifndef {upper}_H\n#define {upper}_H\n");
    let _ =
        writeln!(out, "#ifdef __cplusplus\nextern \"C\" {{\n/* C++ has no `restrict`. */\n#define {upper}_RESTRICT");
    let _ = writeln!(out, "#else\n#define {upper}_RESTRICT restrict\n#endif\n");
    let constants = constants(input);
    constants.iter().for_each(|constant| macro_of(&mut out, prefix, input.options.precision, constant));
    dimensions(&mut out, prefix, input, functions, &constants);
    let start = neutral(input.plan, false);
    if !start.is_empty() {
        let doc = "Coordinates of the neutral position.".to_string();
        let neutral = Constant { doc, name: "NEUTRAL".to_string(), value: Content::Floats(start) };
        macro_of(&mut out, prefix, input.options.precision, &neutral);
    }
    inputs(&mut out, prefix, input, fields);
    for function in functions {
        out.push('\n');
        comment_block(&mut out, "", &function.documentation());
        let _ = writeln!(out, "{};", function.declaration());
    }
    let _ = writeln!(out, "\n#ifdef __cplusplus\n}}\n#endif\n\n#endif");
    out
}

/// A constant as a macro; lists are initialisers of arrays.
fn macro_of(out: &mut String, prefix: &Prefix, precision: Precision, Constant { doc, name, value }: &Constant) {
    let list = |values: Vec<String>| format!("{{ {} }}", values.join(", "));
    let row = |Row { constraint, holonomic, first, len }: &Row| {
        format!("{{ {constraint}, {}, {first}, {len} }}", u8::from(*holonomic))
    };
    let (more, value) = match value {
        Content::Number(n) => ("", n.to_string()),
        // C has no arrays without entries.
        Content::Numbers(all) if all.is_empty() => return,
        Content::Names(all) if all.is_empty() => return,
        Content::Floats(all) if all.is_empty() => return,
        Content::Flags(all) if all.is_empty() => return,
        Content::Numbers(all) => (" An initialiser.", list(all.iter().map(usize::to_string).collect())),
        Content::Names(all) => (" An initialiser.", list(all.iter().map(|name| quoted(name)).collect())),
        Content::Floats(all) => (" An initialiser.", list(all.iter().map(|x| literal(*x, precision)).collect())),
        Content::Flags(all) => (" An initialiser.", list(all.iter().map(|x| u8::from(*x).to_string()).collect())),
        Content::Rows(all) => {
            let more =
                " An initialiser of structs of four integers: number of the constraint, whether it binds positions, \
                        first entry, number of entries.";
            (more, list(all.iter().map(row).collect()))
        }
    };
    let _ = writeln!(out, "/* {}{more} */\n#define {}_{name} {value}", comment(doc), prefix.upper);
}

/// Dimensions of arrays that are not among the constants.
fn dimensions(out: &mut String, prefix: &Prefix, input: &Input, functions: &[Function], constants: &[Constant]) {
    let mut done: BTreeSet<String> =
        constants.iter().map(|constant| format!("{}_{}", prefix.upper, constant.name)).collect();
    let arrays = functions.iter().flat_map(|f| f.program.spec.inputs.iter().chain(f.program.spec.results));
    let fields = FIELDS.iter().map(|field| &field.array).filter(|array| array.len(&input.programs.sizes) > 0);
    for dim in fields.chain(arrays).filter(|array| array.len(&input.programs.sizes) > 0).flat_map(|array| array.dims) {
        let name = length(prefix, *dim);
        if !matches!(dim, Dim::Const(_) | Dim::Gravity) && done.insert(name.clone()) {
            let _ = writeln!(out, "/* {} */\n#define {name} {}", dim.meaning(), input.programs.sizes.of(*dim));
        }
    }
}

/// The struct of inputs.
fn inputs(out: &mut String, prefix: &Prefix, input: &Input, fields: &[Field]) {
    let (lower, number) = (&prefix.lower, number(input.options.precision));
    let _ = writeln!(out, "\n/* What is given beside the state. */\ntypedef struct {lower}_inputs {{");
    for field in fields {
        let array = FIELDS.iter().map(|field| &field.array).find(|array| array.name == field.name);
        let dims = array.map_or(String::new(), |array| entries(prefix, array.dims));
        let more = match field.dims.len() {
            1 => String::new(),
            _ => {
                let lengths: Vec<String> = field.dims.iter().map(usize::to_string).collect();
                let (indices, flat) = flat_entry(&lengths);
                format!(" Entry ({indices}) is `{}[{flat}]`.", field.name)
            }
        };
        let _ = writeln!(out, "    /* {}{more} */\n    {number} {}[{dims}];", comment(field.doc), field.name);
    }
    if fields.is_empty() {
        let _ = writeln!(out, "    /* Nothing: C has no structs without members. */\n    int none;");
    }
    let _ = writeln!(out, "}} {lower}_inputs;\n\n/* {} */", initial(fields));
    let _ = writeln!(out, "void {lower}_inputs_init({lower}_inputs *in);");
}

/// The function that gives the inputs their first values.
pub fn inputs_init(prefix: &Prefix, fields: &[Field], precision: Precision) -> String {
    let lower = &prefix.lower;
    let mut out = format!("\nvoid {lower}_inputs_init({lower}_inputs *in)\n{{\n");
    for Field { name, dims, value, .. } in fields {
        match value {
            None => {
                let (n, zero) = (dims.iter().product::<usize>(), literal(0.0, precision));
                let _ = writeln!(out, "    for (int k = 0; k < {n}; k++) {{\n        in->{name}[k] = {zero};\n    }}");
            }
            Some(values) => values.iter().enumerate().for_each(|(k, x)| {
                let _ = writeln!(out, "    in->{name}[{k}] = {};", literal(*x, precision));
            }),
        }
    }
    if fields.is_empty() {
        let _ = writeln!(out, "    in->none = 0;");
    }
    out + "}\n"
}
