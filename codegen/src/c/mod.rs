//! C99 of the same programs as generated Rust: a header and a source without libm, allocation and globals.
//!
//! A function takes the struct of inputs, then its arguments, then its results: flat arrays, the last index fastest. In
//! exact arithmetic, double precision and with `-ffp-contract=off` it gives the bits of the interpreter, sines and cosines included, which
//! are part of the source.
//!
//! ```
//! use mbd_codegen::read::{self, ImportOptions};
//! use mbd_codegen::{c, Options};
//!
//! let text = include_str!("../../../models/double_pendulum.toml");
//! let model = read::model("double_pendulum.toml", text, &ImportOptions::default())?.model;
//! let options = Options { type_name: "DoublePendulum".into(), ..Options::default() };
//! let code = c::generate(&model, &options, "double_pendulum")?;
//! assert!(code.source.contains("#include \"double_pendulum.h\""));
//! assert!(code.header.contains("void double_pendulum_rates("));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod fmu;
mod function;
mod header;
mod instructions;
mod names;
mod sines;

use crate::code::{Code, Programs};
use crate::emit::fields::fields;
use crate::emit::header::lines;
use crate::emit::Input;
use crate::error::GenerateError;
use crate::model::Model;
use crate::options::{Options, Precision};
use crate::output::{Output, OutputProgram};
use crate::plan::Plan;
use crate::search;
use crate::symbolic::{Counts, Op};
pub use fmu::{fmu, Fmu};
use function::Function;
use names::{comment, number, Prefix};

/// Generated C and information about it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct GeneratedC {
    /// The header.
    pub header: String,
    /// The source, which includes the header.
    pub source: String,
    /// Operations of each function.
    pub counts: Vec<(Output, Counts)>,
    /// Notices about changes, such as angles that became right angles.
    pub notices: Vec<String>,
}

/// Generates C for a checked model. The source includes `NAME.h`, `name` being that of the two files. Functions, types
/// and macros start with [`prefix`]. [`Options::runtime`] and [`Options::chunk`] have no part in it.
///
/// # Errors
/// Those of [`crate::generate()`].
pub fn generate(model: &Model, options: &Options, name: &str) -> Result<GeneratedC, GenerateError> {
    let options = &options.of_model(!model.constraints.is_empty());
    generate_from(&search::plan(model, options.searches()), options, name)
}

/// Generates C with the eliminations of a plan; [`Options::plan`] has no part in it.
///
/// # Errors
/// The same as of [`generate`].
pub fn generate_from(plan: &Plan, options: &Options, name: &str) -> Result<GeneratedC, GenerateError> {
    if options.modes.is_some() {
        return Err(GenerateError::ModesNeedRust);
    }
    let programs = Programs::new(plan, options)?.without_tables()?;
    let (header, source) = files(&Input { plan, options, programs: &programs }, name);
    Ok(GeneratedC { header, source, counts: programs.counts(options), notices: plan.notices.clone() })
}

/// What all names in the C of a type start with: `double_pendulum` for `DoublePendulum`; macros have it in upper case.
pub fn prefix(type_name: &str) -> String {
    Prefix::new(type_name).lower
}

/// Whether some code has sines, and whether it has square roots and guarded reciprocals.
#[derive(Default)]
struct Needs {
    sines: bool,
    roots: bool,
    reciprocals: bool,
}

impl Needs {
    fn of(programs: &[&OutputProgram<Code>]) -> Needs {
        let mut needs = Needs::default();
        for op in programs.iter().flat_map(|program| program.program.operations()) {
            needs.sines |= matches!(op, Op::Sin(_) | Op::Cos(_));
            needs.roots |= matches!(op, Op::Sqrt(_));
            needs.reciprocals |= matches!(op, Op::ReciprocalAbove(_));
        }
        needs
    }
}

/// Header and source.
fn files(input: &Input, name: &str) -> (String, String) {
    let (options, prefix) = (input.options, &Prefix::new(&input.options.type_name));
    let programs = input.programs.functions();
    let needs = Needs::of(&programs);
    let functions: Vec<Function> = programs.into_iter().map(|program| Function { prefix, input, program }).collect();
    let fields = fields(input.plan, &input.programs.sizes);
    let mut top: Vec<String> = lines(input).iter().map(|line| comment(line)).collect();
    top.push(String::new());
    top.extend(header::compilation(input));
    if needs.roots {
        top.push(format!("Square roots: the macro {}_SQRT, by default that of <math.h>.", prefix.upper));
    }
    let header = header::header(prefix, input, &fields, &functions, &top);
    let mut source = String::new();
    header::comment_block(&mut source, "", &top);
    source += &format!("#include \"{name}.h\"\n\n");
    source += &preamble(prefix, options.precision, &needs);
    let definitions: Vec<String> = functions.iter().map(Function::definition).collect();
    if needs.sines {
        let several = definitions.iter().any(|text| text.contains(&format!("{}_sines_cosines(", prefix.lower)));
        source += &sines::functions(prefix, options, several);
    }
    source += &header::inputs_init(prefix, &fields, options.precision);
    for text in definitions {
        source += "\n";
        source += &text;
    }
    (header, source)
}

/// Conditions, and functions that are not about angles.
fn preamble(prefix: &Prefix, precision: Precision, needs: &Needs) -> String {
    let (number, zero, one) = (number(precision), names::literal(0.0, precision), names::literal(1.0, precision));
    let mut out = "#include <float.h>\n".to_string();
    if needs.sines {
        out += "#include <stdint.h>\n";
    }
    out += "
#if defined(__FAST_MATH__)
#error \"-ffast-math does not keep the order of operations, on which the sine and cosine rely\"
#endif
#if FLT_EVAL_METHOD != 0
#error \"operations have to be rounded to their type: on 32-bit x86, compile with -msse2 -mfpmath=sse\"
#endif
";
    if needs.roots {
        let root = match precision {
            Precision::F64 => "sqrt",
            Precision::F32 => "sqrtf",
        };
        out += &format!("\n#ifndef {0}_SQRT\n#include <math.h>\n#define {0}_SQRT(x) {root}(x)\n#endif\n", prefix.upper);
    }
    if needs.reciprocals {
        out += &format!(
            "\n/* 1 / value, or 0 where the value is not above the floor. */
static inline {number} {0}_reciprocal_above({number} value, {number} floor)
{{
    return value <= floor ? {zero} : {one} / value;
}}
",
            prefix.lower
        );
    }
    out
}
