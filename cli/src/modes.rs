//! Sets of modes of contacts: the argument `--modes`, and what they cost.

use std::io::Write;
use std::path::Path;

use multibody::codegen::jit::Compiled;
use multibody::codegen::model::Model;
use multibody::codegen::modes::{self, words, ModeChoice};
use multibody::codegen::plan::Plan;
use multibody::codegen::{self, Options, Output};
use multibody::runtime::contact::rows_that_act;

use super::{generate, source, Failure, Outcome};

/// The modes for which code is made: `masked`, `all`, or a file, relative to `folder`, that lists them.
pub fn choice(argument: &str, folder: &Path, model: &Model) -> Outcome<ModeChoice> {
    match argument {
        "masked" => Ok(ModeChoice::Masked),
        "all" => Ok(ModeChoice::All),
        path => {
            let text = source::read(&folder.join(path))?;
            modes::parse(&text, model).map(ModeChoice::Listed).map_err(|errors| {
                let lines: Vec<String> = errors.iter().map(|(line, what)| format!("{path}:{line}: {what}")).collect();
                Failure::new(lines.join("\n"), "`mbd simulate MODEL --record-modes FILE` writes such a file")
            })
        }
    }
}

/// Operations and size of the code in every set of modes.
pub fn count(plan: &Plan, options: &Options, out: &mut dyn Write) -> Outcome {
    let generated = codegen::generate::generate_from(plan, options).map_err(generate::failure)?;
    let full = plan.with_contacts();
    let bytes = |plan: Plan, output: Output| -> Outcome<usize> {
        let code = Compiled::<f64>::from_plan(plan, options.clone());
        code.and_then(|code| code.code_size(output))
            .map_err(|e| Failure::new(e.to_string(), "count the operations without --modes"))
    };
    let names: Vec<&str> = plan.model.contacts.iter().map(|c| c.name.as_str()).collect();
    writeln!(out, "{}: contacts {}\n", plan.model.name, names.join(", "))?;
    writeln!(out, "Operations, and bytes of machine code, in sets of modes:")?;
    writeln!(out, "{:<40}{:<24}{:>12}{:>10}", "modes", "output", "operations", "bytes")?;
    let mut line = |modes: &str, plan: &Plan, output: Output, operations: usize| -> Outcome {
        let bytes = bytes(plan.clone(), output)?;
        Ok(writeln!(out, "{modes:<40}{:<24}{operations:>12}{bytes:>10}", output.name())?)
    };
    for (set, counts) in &generated.sets {
        let acting = full.acting(&rows_that_act(full.dims.rows, &full.contacts::<f64>(), set));
        for (output, counts) in counts {
            line(&words(set), &acting, *output, counts.total())?;
        }
    }
    for (output, counts) in &generated.counts {
        let whole = if *output == Output::Gaps { full.clone() } else { full.masked() };
        line("all, by numbers", &whole, *output, counts.total())?;
    }
    Ok(())
}
