//! `mbd count`.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

use multibody::codegen::code::{compile, Code, Programs};
use multibody::codegen::generate::quantity;
use multibody::codegen::generate::trace;
use multibody::codegen::model::{Gravity, Model, Value};
use multibody::codegen::options::{EliminationStrategy, PlanOptions};
use multibody::codegen::plan::Plan;
use multibody::codegen::search::{self, Candidate, Chosen};
use multibody::codegen::symbolic::{Cost, Counts};
use multibody::codegen::{Arithmetic, Options, Output};
use serde_json::json;

use super::args::CountArgs;
use super::generate;
use super::output::mentioned;
use super::rivals::{chain_of_pins, RIVALS};
use super::{modes, source, Outcome};

/// Operation counts of one output.
pub struct OutputCounts {
    /// The output.
    pub group: Output,
    /// Total count.
    pub counts: Counts,
    /// Count of each sweep.
    pub sweeps: Vec<(&'static str, Counts)>,
    /// Whether the operations are those of loops over like links.
    pub rolled: bool,
}

/// Estimated speed of one output in one arithmetic, on the processor of the cost model.
struct Speed {
    group: Output,
    arithmetic: Arithmetic,
    counts: Counts,
    instructions: usize,
    critical_path: u32,
    throughput: f64,
    /// With sines and cosines, for one state and for each of eight at once.
    bounds: [f64; 2],
}

/// Bodies up to which straight-line code is counted, although rolled code is generated. Tracing it takes a millisecond for
/// each body, output and arithmetic, and a kilobyte for each operation.
const UNROLLED: usize = 600;

/// Whether a model has so many bodies that the operations of each output are counted once and little else: loops over like
/// branches, speeds and parts of the scene take several times as long.
fn is_large(plan: &Plan) -> bool {
    plan.nodes.len() > UNROLLED
}

/// The code of an output: straight-line code, or for long chains the loops over like links that are generated.
fn code(plan: &Plan, group: Output, options: &Options) -> Outcome<Code> {
    let program = match is_large(plan) {
        true => compile(plan, group, options).map_err(generate::failure)?,
        false => trace(plan, group, options).map_err(generate::failure)?.map(Code::Straight),
    };
    Ok(program.program)
}

/// Estimated speeds of every output in exact and in fast arithmetic.
fn speeds(plan: &Plan, options: &Options) -> Outcome<Vec<Speed>> {
    let mut speeds = Vec::new();
    for &group in &options.outputs {
        for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
            let code = code(plan, group, &Options { arithmetic, ..options.clone() })?;
            let counts = code.counts();
            speeds.push(match &code {
                Code::Straight(program) => Speed {
                    group,
                    arithmetic,
                    counts,
                    instructions: program.instructions(),
                    critical_path: program.critical_path(),
                    throughput: program.throughput(),
                    bounds: [program.bound(), program.bound_of_lanes()],
                },
                Code::Rolled(program) => {
                    let Cost { instructions, critical_path, throughput, .. } = program.cost();
                    let bounds = program.bounds();
                    Speed { group, arithmetic, counts, instructions, critical_path, throughput, bounds }
                }
            });
        }
    }
    Ok(speeds)
}

/// The table of speeds.
fn speed_table(speeds: &[Speed], out: &mut dyn Write) -> Outcome {
    writeln!(out, "\nCycles of a processor with two pipes that multiply and two that add (latencies: sum 3, product 4, division 13, sine 40):")?;
    writeln!(
        out,
        "{:<24}{:>12}{:>14}{:>16}{:>14}{:>14}",
        "", "operations", "instructions", "critical path", "busiest pipe", "of 8 lanes"
    )?;
    for s in speeds {
        let name = format!("{}, {}", s.group.name(), s.arithmetic.name());
        let n = [s.counts.total(), s.instructions, s.critical_path as usize, s.bounds[0].round() as usize];
        writeln!(out, "{name:<24}{:>12}{:>14}{:>16}{:>14}{:>14.1}", n[0], n[1], n[2], n[3], s.bounds[1])?;
    }
    writeln!(
        out,
        "  busiest pipe: with sines and divisions; of 8 lanes: the same for each of eight states at once, on two pipes of 64 bytes"
    )?;
    Ok(())
}

/// Operations that one part of the model costs.
struct Part {
    what: &'static str,
    operations: usize,
    present: bool,
}

/// Runs `mbd count`.
pub fn run(args: &CountArgs, out: &mut dyn Write) -> Outcome {
    let Chosen { plan, candidates: tried } = source::chosen(&args.model, args.code.plan_options())?;
    let options = args.code.options(&plan.model.name);
    if let Some(argument) = &args.modes {
        let choice = Some(modes::choice(argument, Path::new(""), &plan.model)?);
        let options = Options { modes: choice, ..options }.of_model(true);
        return mentioned("making the code of every set of modes", || modes::count(&plan, &options, out));
    }
    let options = options.of_model(!plan.constraints.is_empty());
    let counts = mentioned("counting the operations of every output", || all(&plan, &options))?;
    let loops = match is_large(&plan) {
        true => Vec::new(),
        false => mentioned("counting the operations of loops", || loops(&plan, &counts, &options))?,
    };
    let parts = match options.outputs.first() {
        Some(&group) if !is_large(&plan) => {
            mentioned("counting what parts of the scene cost", || parts(&plan, &options, group))?
        }
        _ => Vec::new(),
    };
    let straight = counts.iter().any(|c| !c.rolled);
    let speeds = match is_large(&plan) && straight {
        true => Vec::new(),
        false => mentioned("estimating the speed of every output", || speeds(&plan, &options))?,
    };
    if args.json {
        return as_json(&plan, &counts, &loops, &speeds, &parts, out);
    }
    writeln!(
        out,
        "{}: {} velocities, joint forces {}, gravity {}\n",
        plan.model.name,
        plan.dims.nv,
        if options.efforts { "given" } else { "none" },
        gravity(&plan)
    )?;
    table(&counts, &options.outputs, out)?;
    let rolled: Vec<&str> = counts.iter().filter(|c| c.rolled).map(|c| c.group.name()).collect();
    if !rolled.is_empty() {
        writeln!(out, "\nOf rolled code, loops over like links, times the number of turns: {}", rolled.join(", "))?;
    }
    let loops: Vec<String> = loops.iter().map(|(output, c)| format!("{} {}", output.name(), c.total())).collect();
    if !loops.is_empty() {
        writeln!(out, "\nThat is straight-line code. Where links or branches are alike, loops over them are generated, whose body does for each what")?;
        writeln!(out, "one of them needs. They execute: {}", loops.join(", "))?;
    }
    if !speeds.is_empty() {
        speed_table(&speeds, out)?;
    }
    candidates(&plan, &tried, &options, args.candidates, out)?;
    rivals(&plan, &counts, out)?;
    if is_large(&plan) {
        writeln!(out, "\nOf more than {UNROLLED} bodies, neither parts of the scene nor loops over like branches are counted, and speeds are estimated")?;
        writeln!(out, "of code with loops over like links only: each takes as long as these counts.")?;
    }
    part_table(&parts, options.outputs.first().map_or("", |g| g.name()), out)
}

/// The table of what parts of the scene cost in an output; nothing where none is counted.
fn part_table(parts: &[Part], output: &str, out: &mut dyn Write) -> Outcome {
    if !parts.is_empty() {
        writeln!(out, "\nWhat the scene costs in `{output}`:")?;
    }
    for part in parts {
        let (sign, hint) = match (part.what, part.present) {
            (RIGHT_ANGLES | FORMS, _) => ('-', ""),
            (_, true) => ('+', ""),
            (_, false) => ('+', "  (not in this scene)"),
        };
        writeln!(out, "  {:<32}{:>8}{hint}", part.what, format!("{sign}{}", part.operations))?;
    }
    Ok(())
}

/// Eliminations that were tried: the best of every branch, or all.
fn candidates(plan: &Plan, tried: &[Candidate], options: &Options, all: bool, out: &mut dyn Write) -> Outcome {
    let strategy = options.plan.elimination;
    let mut rest = tried;
    while let Some(first) = rest.first() {
        let n = rest.iter().take_while(|c| c.branch == first.branch).count();
        let mut branch: Vec<&Candidate> = rest[..n].iter().collect();
        rest = &rest[n..];
        let key = |c: &Candidate| match strategy {
            EliminationStrategy::Fastest => c.cost.cycles(),
            _ => c.cost.operations as f64,
        };
        branch.sort_by(|a, b| key(a).total_cmp(&key(b)).then(b.taken.cmp(&a.taken)));
        let [from, to] = first.branch.map(|k| plan.nodes[k].name.as_str());
        let why = match strategy {
            EliminationStrategy::Fastest => "fewest cycles for one state",
            _ => "fewest operations",
        };
        let alone = if plan.nodes.len() > first.nodes { ", of this branch alone" } else { "" };
        writeln!(out, "\nEliminations tried from `{from}` to `{to}`: {n}; taken for its {why}{alone}: *")?;
        writeln!(
            out,
            "  {:>10}{:>15}{:>14}{:>8}{:>8}",
            "operations", "critical path", "busiest pipe", "cycles", "error"
        )?;
        for c in branch.iter().take(if all { n } else { SHOWN }) {
            let mark = if c.taken { '*' } else { ' ' };
            let (k, cycles, form) = (&c.cost, c.cost.cycles(), &c.form);
            let loss = c.loss.map_or(String::new(), |loss| format!("{loss:.2}"));
            let refused = if c.refused { " (refused for its rounding errors)" } else { "" };
            let n = [k.operations, k.critical_path as usize, k.throughput.round() as usize, cycles.round() as usize];
            writeln!(out, "{mark} {:>10}{:>15}{:>14}{:>8}{loss:>8}  {form}{refused}", n[0], n[1], n[2], n[3])?;
        }
        let refused = branch.iter().filter(|c| c.refused).count();
        writeln!(out, "  error: rounding errors in multiples of those of one joint at a time, measured where a form was faster than those")?;
        writeln!(out, "  before; {refused} refused for it")?;
    }
    Ok(())
}

/// Number of candidates of a branch that are printed without `--candidates`.
const SHOWN: usize = 4;

const RIGHT_ANGLES: &str = "right angles taken as exact";
const FORMS: &str = "elimination forms";

/// Gravity as text.
pub fn gravity(plan: &Plan) -> String {
    match plan.model.gravity {
        Gravity::Constant(g) => match g.map(Value::constant) {
            [Some(x), Some(y), Some(z)] => format!("{x},{y},{z} m/s²"),
            _ => "a parameter".to_string(),
        },
        Gravity::Input => "an input".to_string(),
    }
}

/// Counts of all outputs of the options.
pub fn all(plan: &Plan, options: &Options) -> Outcome<Vec<OutputCounts>> {
    options.outputs.iter().map(|&g| of_output(plan, g, options)).collect()
}

fn of_output(plan: &Plan, group: Output, options: &Options) -> Outcome<OutputCounts> {
    let code = code(plan, group, options)?;
    let steps = code.blocks().into_iter().flat_map(|program| &program.steps);
    let quantities: BTreeSet<_> = steps.map(|(_, _, (_, what))| *what).collect();
    let of = |what| match &code {
        Code::Straight(program) => program.counts_where(|label| label.1 == what),
        Code::Rolled(program) => program.counts_where(|label| label.1 == what),
    };
    let sweeps = quantities.into_iter().map(|what| (quantity(what), of(what)));
    let sweeps = sweeps.filter(|(_, c)| *c != Counts::default()).collect();
    Ok(OutputCounts { group, counts: code.counts(), sweeps, rolled: matches!(code, Code::Rolled(_)) })
}

/// Counts of the generated code, for the outputs in which this has loops in place of the straight-line code that `counted`
/// has.
fn loops(plan: &Plan, counted: &[OutputCounts], options: &Options) -> Outcome<Vec<(Output, Counts)>> {
    // What is counted as loops is what is generated.
    let outputs = counted.iter().filter(|c| !c.rolled).map(|c| c.group).collect();
    let options = &Options { outputs, ..options.clone() };
    let programs = Programs::new(plan, options).map_err(generate::failure)?.with_like_branches(plan, options);
    let other = |(output, counts): &(Output, Counts)| counted.iter().any(|c| c.group == *output && c.counts != *counts);
    Ok(programs.counts(options).into_iter().filter(other).collect())
}

/// The table of counts, with a row for each sweep of the outputs in `detailed`.
pub fn table(counts: &[OutputCounts], detailed: &[Output], out: &mut dyn Write) -> Outcome {
    let names = counts.iter().filter(|c| detailed.contains(&c.group)).flat_map(|c| c.sweeps.iter().map(|s| s.0));
    let wide = names.map(|n| n.chars().count() + 2).max().unwrap_or(0).max(16);
    let mut row = |name: &str, numbers: [&str; 6]| {
        let gap = " ".repeat(wide.saturating_sub(name.chars().count()));
        let cells: String = numbers.iter().map(|n| format!("{n:>8}")).collect();
        writeln!(out, "{name}{gap}{cells}")
    };
    row("operations", ["total", "add", "mul", "div", "sqrt", "sincos"])?;
    for output in counts {
        let mut line = |name: &str, c: &Counts| {
            let n = [c.total(), c.additions, c.multiplications, c.divisions, c.roots, c.sincos].map(|n| n.to_string());
            row(name, [&n[0], &n[1], &n[2], &n[3], &n[4], &n[5]])
        };
        line(output.group.name(), &output.counts)?;
        for (name, counts) in output.sweeps.iter().filter(|_| detailed.contains(&output.group)) {
            line(&format!("  {name}"), counts)?;
        }
    }
    Ok(())
}

/// Published formulas next to the count of the rates, for serial chains of revolute joints only.
pub fn rivals(plan: &Plan, counts: &[OutputCounts], out: &mut dyn Write) -> Outcome {
    let rates = counts.iter().find(|c| c.group == Output::Rates);
    let (Some(n), Some(rates)) = (chain_of_pins(plan), rates) else { return Ok(()) };
    let ours = rates.counts.total();
    writeln!(out, "\nForward dynamics of {n} revolute joints in a row, beside published formulas (upper bounds for any such chain, whereas the")?;
    writeln!(out, "structure of this one is used; models/chain6.toml is a chain without any):")?;
    writeln!(out, "  {:<36}{:>12}{:>8}", "this model, rates", "", ours)?;
    for rival in &RIVALS {
        let theirs = rival.operations(n);
        let ratio = theirs as f64 / ours.max(1) as f64;
        writeln!(out, "  {:<36}{:>12}{:>8}  {ratio:.2} times as many", rival.name, rival.formula(), theirs)?;
    }
    Ok(())
}

/// Differences of the count of one output when parts of the model are left out.
fn parts(plan: &Plan, options: &Options, group: Output) -> Outcome<Vec<Part>> {
    // The operations of the sweeps, because rewriting would hide the differences.
    let options = &Options { arithmetic: Arithmetic::Exact, ..options.clone() };
    let total = |plan: &Plan, options: &Options| -> Outcome<usize> { Ok(code(plan, group, options)?.counts().total()) };
    let changed = |change: &dyn Fn(&mut Model)| -> Outcome<usize> {
        let mut model = plan.model.clone();
        change(&mut model);
        total(&search::plan(&model, options.searches()), options)
    };
    let here = total(plan, options)?;
    let mut parts = Vec::new();
    let mut part = |what, operations, present| {
        if operations > 0 {
            parts.push(Part { what, operations, present });
        }
    };
    let weightless = Gravity::Constant([Value::ZERO; 3]);
    if plan.model.gravity == weightless {
        let down = [Value::ZERO, Value::ZERO, Value::Const(-9.81)];
        part("gravity", changed(&|m| m.gravity = Gravity::Constant(down))?.saturating_sub(here), false);
    } else {
        part("gravity", here.saturating_sub(changed(&|m| m.gravity = weightless)?), true);
    }
    let other = total(plan, &Options { efforts: !options.efforts, ..options.clone() })?;
    part("joint forces", here.abs_diff(other), options.efforts);
    part("external wrenches", here.saturating_sub(changed(&|m| m.wrenches.clear())?), true);
    part("dampers, springs and armature", here.saturating_sub(changed(&without_passive)?), true);
    let exact = search::plan(&plan.model, PlanOptions { snap: 0.0, ..options.searches() });
    part(RIGHT_ANGLES, total(&exact, options)?.saturating_sub(here), true);
    let single =
        search::plan(&plan.model, PlanOptions { elimination: EliminationStrategy::Single, ..options.searches() });
    part(FORMS, total(&single, options)?.saturating_sub(here), true);
    Ok(parts)
}

fn without_passive(model: &mut Model) {
    for joint in &mut model.joints {
        for list in [&mut joint.damping, &mut joint.stiffness, &mut joint.armature] {
            list.fill(Value::ZERO);
        }
    }
}

fn numbers(c: &Counts) -> serde_json::Map<String, serde_json::Value> {
    let pairs = [
        ("total", c.total()),
        ("additions", c.additions),
        ("multiplications", c.multiplications),
        ("divisions", c.divisions),
        ("square_roots", c.roots),
        ("sine_cosine_pairs", c.sincos),
    ];
    pairs.into_iter().map(|(k, n)| (k.to_string(), json!(n))).collect()
}

fn as_json(
    plan: &Plan,
    counts: &[OutputCounts],
    loops: &[(Output, Counts)],
    speeds: &[Speed],
    parts: &[Part],
    out: &mut dyn Write,
) -> Outcome {
    let outputs: Vec<_> = counts
        .iter()
        .map(|c| {
            let sweeps: Vec<_> = c
                .sweeps
                .iter()
                .map(|(name, counts)| {
                    let mut sweep = numbers(counts);
                    sweep.insert("sweep".into(), json!(name));
                    sweep
                })
                .collect();
            let mut output = numbers(&c.counts);
            output.insert("output".into(), json!(c.group.name()));
            output.insert("sweeps".into(), json!(sweeps));
            output.insert("rolled".into(), json!(c.rolled));
            if let Some((_, counts)) = loops.iter().find(|(output, _)| *output == c.group) {
                output.insert("loops".into(), json!(numbers(counts)));
            }
            for s in speeds.iter().filter(|s| s.group == c.group) {
                let mut speed = numbers(&s.counts);
                speed.insert("instructions".into(), json!(s.instructions));
                speed.insert("critical_path".into(), json!(s.critical_path));
                speed.insert("throughput".into(), json!(s.throughput));
                speed.insert("bound".into(), json!(s.bounds[0]));
                speed.insert("bound_of_lanes".into(), json!(s.bounds[1]));
                output.insert(s.arithmetic.name().into(), json!(speed));
            }
            output
        })
        .collect();
    let published = chain_of_pins(plan).map_or(Vec::new(), |n| {
        let rival =
            |r: &super::rivals::Rival| json!({ "name": r.name, "formula": r.formula(), "operations": r.operations(n) });
        RIVALS.iter().map(rival).collect()
    });
    let parts: Vec<_> =
        parts.iter().map(|p| json!({ "part": p.what, "operations": p.operations, "present": p.present })).collect();
    let model = json!({ "name": plan.model.name, "nq": plan.dims.nq, "nv": plan.dims.nv });
    let all = json!({ "model": model, "outputs": outputs, "published": published, "parts": parts });
    let text = serde_json::to_string_pretty(&all).map_err(std::io::Error::from)?;
    Ok(writeln!(out, "{text}")?)
}
