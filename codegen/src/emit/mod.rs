//! Programs as Rust source. Only this module knows Rust syntax.

mod layout;
pub(crate) mod names;
mod statements;

use std::fmt::Write;

use crate::options::{Group, Options};
use crate::plan::Plan;
use crate::trace::GroupProgram;
use statements::Body;

pub use layout::joint_word;
pub use names::{identifier, quantity};

/// Source of one type with a function for each group, and of its `System` where the rates are among them.
pub fn source(plan: &Plan, options: &Options, groups: &[GroupProgram], map: &GroupProgram) -> String {
    let mut out = String::new();
    let rates = groups.iter().any(|g| g.group == Group::Rates);
    layout::header(&mut out, plan, options, groups);
    layout::type_definition(&mut out, plan, options, groups);
    let name = &options.type_name;
    let _ = writeln!(
        out,
        "\n#[allow(clippy::all, clippy::pedantic, dead_code, unused_variables, dead_code, non_snake_case)]\n#[rustfmt::skip]\nimpl {name} {{"
    );
    layout::constants(&mut out, plan, options);
    layout::constructor(&mut out, plan, options);
    for group in groups {
        function(&mut out, plan, options, group, group.group.name(), &layout::signature(plan, options, group.group));
    }
    if rates {
        function(&mut out, plan, options, map, "coordinate_rates", &layout::coordinate_rates_signature(plan, options));
    }
    let _ = writeln!(out, "}}");
    layout::default(&mut out, options);
    if rates {
        layout::system(&mut out, plan, options);
        if groups.iter().any(|g| g.group == Group::Derivatives) {
            layout::differentiable(&mut out, plan, options);
        }
    }
    out
}

/// One function, split into parts if it is long.
fn function(
    out: &mut String,
    plan: &Plan,
    options: &Options,
    group: &GroupProgram,
    name: &str,
    signature: &layout::Function,
) {
    let body = Body::new(plan, options, group, &signature.results);
    let _ = writeln!(out, "\n{}", signature.doc);
    if let Some(counts) = layout::count_line(&group.program.counts()) {
        let _ = writeln!(out, "    /// {counts}");
    }
    body.write(out, name, signature);
}
