//! Programs as Rust source. Only this module knows Rust syntax.

mod lanes;
mod layout;
pub(crate) mod names;
mod ports;
mod rolled;
mod statements;
mod traits;

use std::fmt::Write;

use crate::options::{Options, Output};
use crate::plan::Plan;
use crate::trace::OutputProgram;
use statements::{Body, Head};

pub use layout::joint_word;
pub use names::{identifier, quantity};

/// Writes one implementation of a trait.
type Writer = fn(&mut String, &Plan, &Options);

/// Source of one type with a function for each group, and of its `System` where the rates are among them.
pub fn source(plan: &Plan, options: &Options, groups: &[OutputProgram], map: &OutputProgram) -> String {
    let mut out = String::new();
    let has = |x: Output| groups.iter().any(|g| g.group == x);
    let rates = has(Output::Rates);
    let traits: [(bool, Writer); 5] = [
        (has(Output::Momenta), traits::conjugate),
        (has(Output::Energy), traits::energetic),
        (has(Output::Accelerations), traits::accelerated),
        (has(Output::Derivatives), traits::differentiable),
        (Output::CONSTRAINED.into_iter().all(has), traits::constrained),
    ];
    layout::header(&mut out, plan, options, groups);
    layout::type_definition(&mut out, plan, options, groups);
    let name = &options.type_name;
    let _ = writeln!(
        out,
        "\n#[allow(clippy::all, clippy::pedantic, dead_code, unused_variables, dead_code, non_snake_case)]\n#[rustfmt::skip]\nimpl {name} {{"
    );
    layout::constants(&mut out, plan, options);
    layout::constructor(&mut out, plan, options);
    let map_signature = rates.then(|| (map, "coordinate_rates", layout::coordinate_rates_signature(plan, options)));
    let groups = groups.iter().map(|g| (g, g.group.name(), layout::signature(plan, options, g.group)));
    let functions: Vec<_> = groups.chain(map_signature).collect();
    let mut kernels = Vec::new();
    for (id, (group, name, signature)) in functions.iter().enumerate() {
        let _ = writeln!(out, "\n{}", signature.doc);
        if let Some(counts) = layout::count_line(&group.counts()) {
            let _ = writeln!(out, "    /// {counts}");
        }
        let ports = ports::ports(group, signature);
        let head = Head { options, name, id, function: signature, ports: &ports };
        match &group.loops {
            Some(program) => rolled::RolledWriter::new(plan, program, head).write(&mut out),
            None => Body::new(plan, group, head).write(&mut out),
        }
        kernels.push(lanes::Kernel { id, name, signature, ports });
    }
    lanes::broadcast(&mut out, plan, options);
    if rates {
        lanes::batch(&mut out, plan, options, &kernels);
    }
    let _ = writeln!(out, "}}");
    lanes::kernels(&mut out, options, &kernels);
    lanes::lanes_type(&mut out, plan, options, &kernels);
    layout::default(&mut out, options);
    if rates {
        traits::system(&mut out, plan, options);
        for (_, write) in traits.iter().filter(|(wanted, _)| *wanted) {
            write(&mut out, plan, options);
        }
        lanes::batch_trait(&mut out, plan, options);
    }
    out
}
