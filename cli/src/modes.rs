//! Sets of modes of contacts: the argument `--modes`, and what they cost.

use std::io::Write;
use std::path::{Path, PathBuf};

use multibody::codegen::jit::{CompileError, Compiled};
use multibody::codegen::model::Model;
use multibody::codegen::modes::{self, words, ModeChoice};
use multibody::codegen::plan::Plan;
use multibody::codegen::{self, Options, Output};
use multibody::runtime::contact::{rows_that_act, RegimeChoice};

use super::args::ModesArgs;
use super::output::{writable, write_files};
use super::{contacts, generate, simulate, source, verdict, Failure, Outcome};

/// The modes for which code is made: `masked`, `all`, `factored`, or a file, relative to `folder`, that lists them.
pub fn choice(argument: &str, folder: &Path, model: &Model) -> Outcome<ModeChoice> {
    match argument {
        "masked" => Ok(ModeChoice::Masked),
        "all" => Ok(ModeChoice::All),
        "factored" => Ok(ModeChoice::Factored),
        path => {
            let text = source::read(&folder.join(path))?;
            modes::parse(&text, model).map(ModeChoice::Listed).map_err(|errors| {
                let lines: Vec<String> = errors.iter().map(|(line, what)| format!("{path}:{line}: {what}")).collect();
                Failure::new(lines.join("\n"), "`mbd modes MODEL --record FILE` writes such a file")
            })
        }
    }
}

/// Runs `mbd modes`.
pub fn run(args: &ModesArgs, out: &mut dyn Write) -> Outcome {
    let (plan, _) = simulate::planned(&args.motion)?;
    let model = &plan.model;
    if model.contacts.is_empty() {
        return Err(Failure::new(
            format!("`{}` has no contacts", model.name),
            "add [[shape]] and [[contact]] to the model, or `limits` to a joint; of a URDF or MJCF model take --floor, --self-contact and --limits",
        ));
    }
    let settings = simulate::settings(&args.motion)?;
    if settings.regimes.choice == RegimeChoice::TimeSteps {
        return Err(Failure::new(
            "--contacts stepping: time steps visit no modes",
            "leave it out: modes are those between events",
        ));
    }
    let file = args.record.clone().unwrap_or_else(|| PathBuf::from(format!("{}.modes", model.name)));
    writable(&file)?;
    let (q, v, _) = simulate::start_closed(&plan, &args.motion)?;
    let settings = simulate::controlled(&plan, &args.motion, settings, &q)?;
    verdict::start(&args.motion.model.model, &plan, &q, settings.is_adaptive())?;
    let touched = contacts::simulate(&plan, (q, v), &settings, false)?;
    write_files(&[(file.as_path(), modes::text(model, &touched.visits).as_str())])?;
    writeln!(out, "{}", simulate::title(&plan, &settings))?;
    let mut visits = touched.visits;
    visits.sort_by(|a, b| b.1.total_cmp(&a.1));
    writeln!(out, "Sets of modes that it visits: {}, with the time in each:", visits.len())?;
    let width = width(visits.iter().map(|(set, _)| words(set)));
    for (set, time) in &visits {
        writeln!(out, "{:<width$}{time:>12.6} s", words(set))?;
    }
    writeln!(out)?;
    let sets = visits.into_iter().map(|(set, _)| set).collect();
    let outputs = vec![Output::Rates];
    count(&plan, &Options { outputs, modes: Some(ModeChoice::Listed(sets)), ..Options::default() }, out)?;
    Ok(writeln!(out, "\nmodes: {}", file.display())?)
}

/// Width of a column of sets of modes: there are two spaces after the longest, and room for the other entries.
fn width(sets: impl Iterator<Item = String>) -> usize {
    sets.map(|set| set.len() + 2).max().unwrap_or_default().max(40)
}

/// Operations and size of the code in every set of modes.
pub fn count(plan: &Plan, options: &Options, out: &mut dyn Write) -> Outcome {
    let generated = codegen::generate::generate_from(plan, options).map_err(generate::failure)?;
    let full = plan.with_contacts();
    let bytes = |plan: Plan, output: Output| -> Outcome<String> {
        match Compiled::<f64>::from_plan(plan, options.clone()).and_then(|code| code.code_size(output)) {
            Ok(bytes) => Ok(bytes.to_string()),
            Err(CompileError::TooLarge { .. }) => Ok("-".to_string()),
            Err(e) => Err(Failure::new(e.to_string(), "report this, with the model")),
        }
    };
    let mut interpreted = false;
    let names: Vec<&str> = plan.model.contacts.iter().map(|c| c.name.as_str()).collect();
    writeln!(out, "{}: contacts {}\n", plan.model.name, names.join(", "))?;
    writeln!(out, "Operations, and bytes of machine code, in sets of modes:")?;
    let width = width(generated.sets.iter().map(|(set, _)| words(set)));
    writeln!(out, "{:<width$}{:<24}{:>12}{:>10}", "modes", "output", "operations", "bytes")?;
    let mut line = |modes: &str, plan: &Plan, output: Output, operations: usize| -> Outcome {
        let bytes = bytes(plan.clone(), output)?;
        interpreted |= bytes == "-";
        Ok(writeln!(out, "{modes:<width$}{:<24}{operations:>12}{bytes:>10}", output.name())?)
    };
    for (set, counts) in &generated.sets {
        let acting = full.acting(&rows_that_act(full.dims.rows, &full.contacts::<f64>(), set));
        let acting = acting.with_early_contacts(&acting.early_contacts(options.arithmetic));
        for (output, counts) in counts {
            line(&words(set), &acting, *output, counts.total())?;
        }
    }
    for (output, counts) in &generated.counts {
        let whole = if *output == Output::Gaps { full.clone() } else { full.masked() };
        line("all, by numbers", &whole, *output, counts.total())?;
    }
    for pieces in &generated.pieces {
        let mut line =
            |what: &str, operations: usize| writeln!(out, "{what:<width$}{:<24}{operations:>12}", pieces.output.name());
        line(&format!("all, in {} pieces", pieces.count), pieces.operations)?;
        line("  executed where nothing touches", pieces.flight)?;
        line("  executed where everything sticks", pieces.stick)?;
    }
    if interpreted {
        writeln!(out, "\n-: no machine code is made of programs that large; they are interpreted")?;
    }
    Ok(())
}
