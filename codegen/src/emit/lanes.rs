//! Many states at once: the type with lanes, batches, and the kernels' way to both.

use std::fmt::Write;

use super::layout::{fields, Function};
use super::ports::{declared, dims, nested, Port};
use crate::options::{Options, Precision};
use crate::plan::Plan;

/// A function that has been written.
pub struct Kernel<'a> {
    /// Its number.
    pub id: usize,
    /// Its name.
    pub name: &'a str,
    /// Its signature.
    pub signature: &'a Function,
    /// What its kernel reads and writes.
    pub ports: Vec<Port>,
}

const ALLOWED: &str =
    "#[allow(clippy::all, clippy::pedantic, dead_code, unused_variables, non_snake_case)]\n#[rustfmt::skip]";

/// A tuple of any length.
fn tuple(items: &[String]) -> String {
    items.iter().fold("(".to_string(), |all, item| format!("{all}{item}, ")).trim_end().to_string() + ")"
}

/// Lanes of a batch: two vectors of 32 bytes, one of 64.
fn width(options: &Options) -> usize {
    match options.precision {
        Precision::F64 => 8,
        Precision::F32 => 16,
    }
}

/// `impl Kernel` for each function.
pub fn kernels(out: &mut String, options: &Options, kernels: &[Kernel]) {
    let (name, rt, t) = (&options.type_name, &options.runtime, options.precision.name());
    for kernel in kernels {
        let access = |p: &Port| if p.mutable { "Write" } else { "Read" };
        let numbered = || kernel.ports.iter().enumerate();
        let generics: String =
            numbered().map(|(k, p)| format!("P{k}: {rt}::kernel::{}<{t}> + ?Sized, ", access(p))).collect();
        let types: Vec<String> =
            numbered().map(|(k, p)| format!("&'a {}P{k}", if p.mutable { "mut " } else { "" })).collect();
        let names: Vec<String> = kernel.ports.iter().map(|p| p.name.clone()).collect();
        let (types, pattern) = (tuple(&types), tuple(&names));
        let _ = writeln!(
            out,
            "
#[rustfmt::skip]
impl<'a, {generics}const LANES: usize> {rt}::kernel::Kernel<{}, LANES, {types}> for {name} {{
    #[inline(always)]
    fn run<A: {rt}::kernel::Arithmetic>({pattern}: {types}) {{
        Self::{}_kernel::<A, LANES>({});
    }}
}}",
            kernel.id,
            kernel.name,
            names.join(", ")
        );
    }
}

/// The method that copies the inputs into all lanes.
pub fn broadcast(out: &mut String, plan: &Plan, options: &Options) {
    let name = &options.type_name;
    let copies: Vec<String> = fields(plan, options)
        .into_iter()
        .map(|(field, ty, _, _)| match dims(&ty).len() {
            1 => format!("{field}: self.{field}.map(|x| [x; LANES])"),
            _ => format!("{field}: self.{field}.map(|row| row.map(|x| [x; LANES]))"),
        })
        .collect();
    let _ = writeln!(
        out,
        "
    /// The same for several states at once; the inputs are copied into every lane.
    pub fn lanes<const LANES: usize>(&self) -> {name}Lanes<LANES> {{
        {name}Lanes {{ {} }}
    }}",
        copies.join(", ")
    );
}

/// The type with lanes.
pub fn lanes_type(out: &mut String, plan: &Plan, options: &Options, kernels: &[Kernel]) {
    let (name, rt, t) = (&options.type_name, &options.runtime, options.precision.name());
    let _ = writeln!(
        out,
        "
/// `LANES` states of [`{name}`] at once, side by side in vector registers. In every array the last index is the lane:
/// `q[k][l]` is coordinate `k` of state `l`. Any number of lanes is right; {} or a multiple of it is quick.
#[derive(Clone, Debug, PartialEq)]
#[rustfmt::skip]
pub struct {name}Lanes<const LANES: usize> {{",
        width(options)
    );
    let lane = format!("[{t}; LANES]");
    for (field, ty, _, doc) in fields(plan, options) {
        let _ = writeln!(out, "    /// {doc}\n    pub {field}: {},", nested(&dims(&ty), &lane));
    }
    let _ = writeln!(out, "}}\n\n{ALLOWED}\nimpl<const LANES: usize> {name}Lanes<LANES> {{");
    let _ = write!(out, "    /// All inputs zero, parameters at their defaults.\n    pub fn new() -> Self {{\n");
    let _ = writeln!(out, "        {name}::new().lanes()\n    }}");
    for kernel in kernels {
        let returned = kernel.ports.iter().find(|p| p.returned);
        let declarations: Vec<String> = declared(kernel.signature).iter().map(|p| p.lanes_declaration(t)).collect();
        let returns = returned.map_or(String::new(), |p| format!(" -> {}", nested(&p.dims, &lane)));
        let _ = writeln!(out, "\n{}", kernel.signature.doc);
        let _ =
            writeln!(out, "    #[inline]\n    pub fn {}(&self, {}){returns} {{", kernel.name, declarations.join(", "));
        if let Some(port) = returned {
            let _ = writeln!(out, "        let mut {} = {};", port.name, nested(&port.dims, "[0.0; LANES]"));
        }
        let arguments: Vec<String> = kernel.ports.iter().map(|p| p.argument.clone()).collect();
        let call = format!("{rt}::kernel::call_lanes::<{name}, {}, LANES, {t}, _>", kernel.id);
        let _ = writeln!(out, "        {call}({});", tuple(&arguments));
        if let Some(port) = returned {
            let _ = writeln!(out, "        {}", port.name);
        }
        let _ = writeln!(out, "    }}");
    }
    let _ = writeln!(out, "}}");
    let _ = writeln!(
        out,
        "
#[rustfmt::skip]
impl<const LANES: usize> ::core::default::Default for {name}Lanes<LANES> {{
    fn default() -> Self {{
        Self::new()
    }}
}}"
    );
}

/// Columns as arguments: of joint forces only where they are inputs.
fn columns(plan: &Plan, options: &Options) -> (String, &'static str, usize) {
    let (t, nq, nv) = (options.precision.name(), plan.dims.nq, plan.dims.nv);
    let efforts = options.efforts && nv > 0;
    let (tau, given) = if efforts { (format!(", tau: [&[{t}]; {nv}]"), "tau") } else { (String::new(), "[]") };
    let list = format!("q: [&[{t}]; {nq}], p: [&[{t}]; {nv}]{tau}, qd: [&mut [{t}]; {nq}], pd: [&mut [{t}]; {nv}]");
    (list, given, if efforts { nv } else { 0 })
}

/// Rates of any number of states.
pub fn batch(out: &mut String, plan: &Plan, options: &Options, kernels: &[Kernel]) {
    let (rt, t, width) = (&options.runtime, options.precision.name(), width(options));
    let Some(kernel) = kernels.iter().find(|k| k.name == "rates") else { return };
    let (arguments, given, _) = columns(plan, options);
    // The columns are what the kernel calls by the same names; everything else is the same for all states.
    let ports = kernel.ports.iter().map(|p| match p.name.as_str() {
        "q" | "p" | "tau" | "qd" | "pd" => p.name.clone(),
        _ => p.argument.clone(),
    });
    let ports = tuple(&ports.collect::<Vec<_>>());
    let of_tau = if given == "tau" { "Joint forces are a column each; the" } else { "The" };
    let _ = writeln!(
        out,
        "
    /// Rates of any number of states, given as columns: `q[k][s]` is coordinate `k` of state `s`. {of_tau} fields of
    /// `self` are the same for all states. {width} states are computed at a time.
    ///
    /// # Errors
    /// Columns of different lengths; nothing is written then.
    pub fn rates_batch(&self, {arguments}) -> ::core::result::Result<(), {rt}::batch::BatchError> {{
        {rt}::batch::run::<{t}, {width}, {}, {}, _>(q, p, {given}, qd, pd, |q, p, tau, qd, pd| {{
            {rt}::kernel::call_lanes::<Self, {}, {width}, {t}, _>({ports});
        }})
    }}",
        plan.dims.nq, plan.dims.nv, kernel.id
    );
}

/// `impl RatesBatch`.
pub fn batch_trait(out: &mut String, plan: &Plan, options: &Options) {
    let (name, rt, t) = (&options.type_name, &options.runtime, options.precision.name());
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let (_, given, nt) = columns(plan, options);
    let given = if given == "tau" { "tau, " } else { "" };
    let _ = writeln!(
        out,
        "
#[rustfmt::skip]
impl {rt}::batch::RatesBatch<{t}, {nq}, {nv}, {nt}> for {name} {{
    fn rates_batch(&self, q: [&[{t}]; {nq}], p: [&[{t}]; {nv}], tau: [&[{t}]; {nt}], qd: [&mut [{t}]; {nq}], pd: [&mut [{t}]; {nv}]) -> ::core::result::Result<(), {rt}::batch::BatchError> {{
        let _ = tau;
        Self::rates_batch(self, q, p, {given}qd, pd)
    }}
}}"
    );
}
