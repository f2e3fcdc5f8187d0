//! Programs as Rust source. Only this module knows Rust syntax.

pub(crate) mod constants;
pub(crate) mod fields;
pub(crate) mod head;
pub(crate) mod header;
mod lanes;
pub(crate) mod names;
pub(crate) mod numbers;
mod rolled;
mod signature;
mod straight;
mod traits;
pub(crate) mod transfer;

use std::fmt::Write;

use crate::code::{Code, Programs};
use crate::options::Options;
use crate::output::{Output, OutputProgram};
use crate::plan::Plan;
use head::Head;
use signature::Signature;

pub use names::quantity;

/// Input of the emission.
pub struct Input<'a> {
    /// The mechanism.
    pub plan: &'a Plan,
    /// Options of the generator.
    pub options: &'a Options,
    /// The programs of all functions, with chosen frames and lengths of arrays.
    pub programs: &'a Programs,
}

/// Source of one type with a function for each program, and implementations of the runtime's traits for which it has
/// the functions.
pub fn source(input: &Input) -> String {
    let Input { plan, options, programs } = *input;
    let mut out = String::new();
    let rates = options.outputs.contains(&Output::Rates);
    let fields = fields::fields(plan, &programs.sizes);
    for line in header::lines(input) {
        let _ = writeln!(out, "{}", format!("// {line}").trim_end());
    }
    out.push('\n');
    let outputs: Vec<&str> = programs.outputs.iter().map(|p| p.spec.name).collect();
    let _ = writeln!(
        out,
        "/// Dynamics of `{}` in canonical form: {}. Set the fields between calls.",
        plan.model.name,
        outputs.join(", ")
    );
    fields::type_definition(&mut out, &options.type_name, &fields, options.precision.name());
    let _ = writeln!(
        out,
        "\n#[allow(clippy::all, clippy::pedantic, dead_code, unused_variables, non_snake_case)]\n#[rustfmt::skip]\nimpl {} {{",
        options.type_name
    );
    constants::write(&mut out, &constants::constants(input), options);
    fields::constructor(&mut out, options, &fields);
    let functions = programs.functions();
    let signatures: Vec<Signature> = functions.iter().map(|p| Signature::new(p.spec, &programs.sizes)).collect();
    let kernels = functions.iter().zip(&signatures).enumerate().map(|(id, (program, signature))| {
        let ports = signature.ports(&program.inputs, &program.program.used_inputs());
        lanes::Kernel { id, signature, ports }
    });
    let kernels: Vec<lanes::Kernel> = kernels.collect();
    for (program, kernel) in functions.iter().zip(&kernels) {
        function(&mut out, plan, options, program, kernel);
    }
    fields::broadcast(&mut out, options, &fields);
    if rates {
        lanes::batch(&mut out, plan, options, &kernels);
    }
    let _ = writeln!(out, "}}");
    lanes::kernels(&mut out, options, &kernels);
    lanes::lanes_type(&mut out, options, &fields, &kernels);
    fields::default(&mut out, "", &options.type_name);
    traits::traits(&mut out, plan, options, &kernels);
    if rates {
        lanes::batch_trait(&mut out, plan, options);
    }
    out
}

/// One function and its kernel.
fn function(
    out: &mut String,
    plan: &Plan,
    options: &Options,
    program: &OutputProgram<Code>,
    lanes::Kernel { id, signature, ports }: &lanes::Kernel,
) {
    let _ = write!(out, "\n{}", signature.documentation());
    if let Some(counts) = head::count_line(&program.program.counts()) {
        let _ = writeln!(out, "    /// {counts}");
    }
    let head = Head { options, id: *id, signature, ports, inputs: &program.inputs };
    match &program.program {
        Code::Rolled(program) => rolled::RolledWriter::new(plan, program, head).write(out),
        Code::Straight(program) => straight::Straight::new(plan, program, head).write(out),
    }
}
