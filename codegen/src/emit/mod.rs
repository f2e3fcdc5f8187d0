//! Programs as Rust source. Only this module knows Rust syntax.

pub(crate) mod constants;
#[cfg(feature = "factored")]
mod factored;
pub(crate) mod fields;
pub(crate) mod head;
pub(crate) mod header;
mod lanes;
mod modes;
pub(crate) mod names;
pub(crate) mod numbers;
mod rolled;
mod signature;
mod straight;
mod together;
mod traits;
pub(crate) mod transfer;

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::code::{Code, Programs};
#[cfg(feature = "factored")]
use crate::factored::FactoredProgram;
use crate::options::Options;
use crate::output::{InputArray, Output, OutputProgram, Sizes};
use crate::plan::Plan;
use crate::rolled::{RolledProgram, Vectors};
use head::Head;
use modes::Contacts;
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
    let contacts = Contacts::new(plan, options, programs);
    let of_contacts = contacts.as_ref().map_or(Vec::new(), Contacts::lines);
    for line in header::lines(input).into_iter().chain(of_contacts) {
        let _ = writeln!(out, "{}", format!("// {line}").trim_end());
    }
    out.push('\n');
    let outputs = programs.outputs.iter().map(|p| p.spec.name).chain(programs.factored.iter().map(|p| p.spec.name));
    let outputs: Vec<&str> = outputs.collect();
    let _ = writeln!(
        out,
        "/// Dynamics of `{}` in canonical form: {}. Set the fields between calls.",
        plan.model.name,
        outputs.join(", ")
    );
    fields::type_definition(&mut out, &options.type_name, &fields, options.precision.name(), contacts.as_ref());
    let _ = writeln!(
        out,
        "\n#[allow(clippy::all, clippy::pedantic, dead_code, unused_variables, non_snake_case)]\n#[rustfmt::skip]\nimpl {} {{",
        options.type_name
    );
    constants::write(&mut out, &constants::constants(input), options);
    if let Some(contacts) = &contacts {
        contacts.constants(&mut out, plan);
    }
    #[cfg(feature = "height_fields")]
    if contacts.is_some() || plan.has_contacts() {
        constants::tables(&mut out, plan);
    }
    fields::constructor(&mut out, options, &fields, contacts.as_ref());
    let functions = functions(input, contacts.as_ref());
    let signatures: Vec<Signature> = functions.iter().map(|f| f.signature(&programs.sizes)).collect();
    let kernels = functions.iter().zip(&signatures).enumerate().map(|(id, (function, signature))| {
        let ports = signature.ports(function.inputs(), &function.used_inputs());
        lanes::Kernel { id, signature, ports }
    });
    let kernels: Vec<lanes::Kernel> = kernels.collect();
    for (function, kernel) in functions.iter().zip(&kernels) {
        let program = match &function.program {
            Kind::Whole(program) => *program,
            #[cfg(feature = "factored")]
            Kind::Factored(program) => {
                let lanes::Kernel { id, signature, ports } = kernel;
                let _ = write!(out, "\n{}", signature.documentation());
                let _ = writeln!(out, "    /// Put together from pieces for the modes of the contacts.");
                let head = Head { options, id: *id, signature, ports, inputs: &program.inputs };
                factored::FactoredWriter::new(function.plan, &program.program, head).write(&mut out);
                continue;
            }
        };
        if let (Some(contacts), true) = (&contacts, function.first) {
            contacts.dispatch(&mut out, &Signature::new(program.spec, &programs.sizes));
        }
        write_function(&mut out, function.plan, options, program, function.together(), kernel);
    }
    // Several states would have to be in the same modes of contacts.
    let lanes = contacts.is_none();
    if lanes {
        fields::broadcast(&mut out, options, &fields);
    }
    if rates && lanes {
        lanes::batch(&mut out, plan, options, &kernels);
    }
    let _ = writeln!(out, "}}");
    lanes::kernels(&mut out, options, &kernels);
    if lanes {
        lanes::lanes_type(&mut out, options, &fields, &kernels);
    }
    fields::default(&mut out, "", &options.type_name);
    traits::traits(&mut out, plan, options, &kernels);
    if rates && lanes {
        lanes::batch_trait(&mut out, plan, options);
    }
    if let Some(contacts) = &contacts {
        contacts.touching(&mut out, plan);
    }
    out
}

/// What a function computes.
enum Kind<'a> {
    /// One program.
    Whole(&'a OutputProgram<Code>),
    /// Pieces for the modes of contacts.
    #[cfg(feature = "factored")]
    Factored(&'a OutputProgram<FactoredProgram>),
}

/// A function of the type.
struct Function<'a> {
    program: Kind<'a>,
    plan: &'a Plan,
    /// Its name, where it is the part of an output.
    part: Option<String>,
    /// Whether it is the first part of its output.
    first: bool,
    /// Programs that compute like branches together, by the names of outputs: its own may be among them.
    together: &'a [(&'static str, RolledProgram, Vectors)],
}

impl<'a> Function<'a> {
    /// The program that computes like branches together for one state.
    fn together(&self) -> Option<(&'a RolledProgram, Vectors)> {
        let output = match &self.program {
            Kind::Whole(program) => program.spec.name,
            #[cfg(feature = "factored")]
            Kind::Factored(program) => program.spec.name,
        };
        let own = self.together.iter().find(|(name, ..)| *name == output);
        own.map(|(_, program, vectors)| (program, *vectors))
    }

    fn signature(&self, sizes: &Sizes) -> Signature {
        let spec = match &self.program {
            Kind::Whole(program) => program.spec,
            #[cfg(feature = "factored")]
            Kind::Factored(program) => program.spec,
        };
        let whole = Signature::new(spec, sizes);
        match &self.part {
            None => whole,
            Some(name) => whole.part(name.clone()),
        }
    }

    fn inputs(&self) -> &[InputArray] {
        match &self.program {
            Kind::Whole(program) => &program.inputs,
            #[cfg(feature = "factored")]
            Kind::Factored(program) => &program.inputs,
        }
    }

    fn used_inputs(&self) -> BTreeSet<usize> {
        match &self.program {
            Kind::Whole(program) => program.program.used_inputs(),
            #[cfg(feature = "factored")]
            Kind::Factored(program) => program.program.used_inputs(),
        }
    }
}

/// All functions, in order.
fn functions<'a>(Input { plan, programs, .. }: &Input<'a>, contacts: Option<&Contacts>) -> Vec<Function<'a>> {
    let mut functions = Vec::new();
    for program in programs.functions() {
        let part = contacts.and_then(|contacts| contacts.for_all_modes(program.spec.name));
        let first = part.is_some();
        functions.push(Function { program: Kind::Whole(program), plan, part, first, together: &programs.together });
    }
    #[cfg(feature = "factored")]
    functions.extend(programs.factored.iter().map(|program| Function {
        program: Kind::Factored(program),
        plan,
        part: None,
        first: false,
        together: &[],
    }));
    for (k, set) in programs.sets.iter().enumerate() {
        functions.extend(set.outputs.iter().map(|program| {
            let part = Some(Contacts::for_set(program.spec.name, k));
            Function { program: Kind::Whole(program), plan: &set.plan, part, first: false, together: &set.together }
        }));
    }
    functions
}

/// One function and its kernel.
fn write_function(
    out: &mut String,
    plan: &Plan,
    options: &Options,
    program: &OutputProgram<Code>,
    together: Option<(&RolledProgram, Vectors)>,
    lanes::Kernel { id, signature, ports }: &lanes::Kernel,
) {
    let _ = write!(out, "\n{}", signature.documentation());
    if let Some(counts) = head::count_line(&program.program.counts()) {
        let _ = writeln!(out, "    /// {counts}");
    }
    let head = Head { options, id: *id, signature, ports, inputs: &program.inputs };
    match &program.program {
        Code::Rolled(program) => rolled::RolledWriter::new(plan, program, head).write(out),
        Code::Straight(program) => {
            straight::Straight::new(plan, program, head).write(out, together.map(|(_, vectors)| vectors))
        }
    }
    if let Some((together, _)) = together {
        let head = Head { options, id: *id, signature, ports, inputs: &program.inputs };
        together::TogetherWriter::new(plan, together, head).write(out);
    }
}
