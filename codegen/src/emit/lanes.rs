//! Many states at once: the type with lanes, batches, and the kernels for both.

use std::fmt::Write;

use super::fields::{default, initial, type_definition, Field};
use super::head::tuple;
use super::signature::{Port, Signature};
use crate::options::{Options, Precision};
use crate::output::Output;
use crate::plan::Plan;

/// A function that has been written.
pub struct Kernel<'a> {
    /// Its number.
    pub id: usize,
    /// Its signature.
    pub signature: &'a Signature,
    /// Arrays that its kernel reads and writes.
    pub ports: Vec<Port>,
}

const ALLOWED: &str =
    "#[allow(clippy::all, clippy::pedantic, dead_code, unused_variables, non_snake_case)]\n#[rustfmt::skip]";

/// Lanes of a batch: two vectors of 32 bytes, or one of 64.
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
        let numbered = || kernel.ports.iter().enumerate();
        // The letter of the generic parameters; a type of the name `P0` needs another one.
        let letter = if name.starts_with('P') && name[1..].parse::<usize>().is_ok() { 'G' } else { 'P' };
        let generics: String =
            numbered().map(|(k, p)| format!("{letter}{k}: {rt}::kernel::{}<{t}> + ?Sized, ", p.access())).collect();
        let types: Vec<String> =
            numbered().map(|(k, p)| p.reference(&format!("{letter}{k}")).replacen('&', "&'a ", 1)).collect();
        let names: Vec<String> = kernel.ports.iter().map(|p| p.name.to_string()).collect();
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
            kernel.signature.name,
            names.join(", ")
        );
    }
}

/// The type with lanes.
pub fn lanes_type(out: &mut String, options: &Options, fields: &[Field], kernels: &[Kernel]) {
    let (name, t) = (&options.type_name, options.precision.name());
    let _ = writeln!(
        out,
        "
/// `LANES` states of [`{name}`] at once, side by side in vector registers. In every array the last index is the lane:
/// `q[k][l]` is coordinate `k` of state `l`. Any number of lanes is right; {} are quickest.",
        width(options)
    );
    let lane = format!("[{t}; LANES]");
    type_definition(out, &format!("{name}Lanes<const LANES: usize>"), fields, &lane, None);
    let _ = writeln!(
        out,
        "
{ALLOWED}
impl<const LANES: usize> {name}Lanes<LANES> {{
    /// {}
    pub fn new() -> Self {{
        {name}::new().lanes()
    }}",
        initial(fields)
    );
    for kernel in kernels {
        lanes_function(out, options, kernel, &lane);
    }
    let _ = writeln!(out, "}}");
    default(out, "<const LANES: usize>", &format!("{name}Lanes<LANES>"));
}

/// One function of the type with lanes.
fn lanes_function(out: &mut String, options: &Options, Kernel { id, signature, ports }: &Kernel, lane: &str) {
    let (name, rt, t) = (&options.type_name, &options.runtime, options.precision.name());
    let declaration = signature.declaration(rt, lane);
    let arguments: Vec<String> = ports.iter().map(Port::argument).collect();
    let call = format!("{rt}::kernel::call_lanes::<{name}, {id}, LANES, {t}, _>({})", tuple(&arguments));
    let body = signature.body(rt, "[0.0; LANES]", &call);
    let _ = write!(out, "\n{}    #[inline]\n    pub fn {declaration} {{\n{body}    }}\n", signature.documentation());
}

/// Columns as arguments: of joint forces only where they are inputs.
fn columns(plan: &Plan, options: &Options) -> (String, &'static str, usize) {
    let (t, nq, nv) = (options.precision.name(), plan.dims.nq, plan.dims.nv);
    let efforts = options.efforts && nv > 0;
    let (tau, given) = if efforts { (format!(", tau: [&[{t}]; {nv}]"), "tau") } else { (String::new(), "[]") };
    let list = format!("q: [&[{t}]; {nq}], p: [&[{t}]; {nv}]{tau}, qd: [&mut [{t}]; {nq}], pd: [&mut [{t}]; {nv}]");
    (list, given, if efforts { nv } else { 0 })
}

/// The call of a kernel for `lanes` states from a function of the type itself. The arrays in `local` are variables of
/// this function with rows of lanes; everything else is the same for all states.
pub fn call(options: &Options, kernel: &Kernel, lanes: &str, local: &[&str]) -> String {
    let (rt, t) = (&options.runtime, options.precision.name());
    let ports = kernel.ports.iter().map(|port| match local.contains(&port.name) {
        true => port.name.to_string(),
        false => port.argument(),
    });
    let ports = tuple(&ports.collect::<Vec<_>>());
    format!("{rt}::kernel::call_lanes::<Self, {}, {lanes}, {t}, _>({ports});", kernel.id)
}

/// Rates of any number of states. What is marked `#[inline]` is compiled where it is called only: the code for lanes takes a
/// library's compiler as long as that for one state.
pub fn batch(out: &mut String, plan: &Plan, options: &Options, kernels: &[Kernel]) {
    let (rt, t, width) = (&options.runtime, options.precision.name(), width(options));
    let Some(kernel) = kernels.iter().find(|k| k.signature.name == Output::Rates.name()) else { return };
    let (arguments, given, _) = columns(plan, options);
    // The columns have the names of the kernel's arrays.
    let call = call(options, kernel, &width.to_string(), &["q", "p", "tau", "qd", "pd"]);
    let of_tau = if given == "tau" { "Joint forces are a column each; the" } else { "The" };
    let _ = writeln!(
        out,
        "
    /// Rates of any number of states, given as columns: `q[k][s]` is coordinate `k` of state `s`. {of_tau} fields of
    /// `self` are the same for all states. {width} states are computed at a time.
    ///
    /// # Errors
    /// Columns of different lengths; nothing is written then.
    #[inline]
    pub fn rates_batch(&self, {arguments}) -> ::core::result::Result<(), {rt}::batch::BatchError> {{
        {rt}::batch::run::<{t}, {width}, {}, {}, _>(q, p, {given}, qd, pd, |q, p, tau, qd, pd| {{
            {call}
        }})
    }}",
        plan.dims.nq, plan.dims.nv
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
    #[inline]
    fn rates_batch(&self, q: [&[{t}]; {nq}], p: [&[{t}]; {nv}], tau: [&[{t}]; {nt}], qd: [&mut [{t}]; {nq}], pd: [&mut [{t}]; {nv}]) -> ::core::result::Result<(), {rt}::batch::BatchError> {{
        let _ = tau;
        Self::rates_batch(self, q, p, {given}qd, pd)
    }}
}}"
    );
}
