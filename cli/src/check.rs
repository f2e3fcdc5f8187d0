//! `mbd check`.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use multibody::codegen::model::{ConstraintKind, Model, Value};
use multibody::codegen::options::PlanOptions;
use multibody::codegen::singular::dependent_velocity;
use multibody::codegen::words;
use multibody::runtime::tree::Source;

use super::args::CheckArgs;
use super::{loops, source, stale, Failure, Outcome};

/// Checks models, or the generated files of a directory.
pub fn run(args: &CheckArgs, out: &mut dyn Write) -> Outcome {
    if let Some(directory) = &args.generated {
        return stale::run(directory, args.update, out);
    }
    let mut worst = Ok(());
    for path in &args.models {
        let checked = source::models(path, &args.touch.of(args.import.import())).and_then(|(model, variants)| {
            let all = std::iter::once((None, &model)).chain(variants.iter().map(|v| (Some(v.name.as_str()), &v.model)));
            let mut worst = Ok(());
            for (variant, model) in all {
                match reported(path, variant, model, out) {
                    Err(Failure::Pipe) => return Err(Failure::Pipe),
                    Err(failure) => worst = Err(failure),
                    Ok(()) => {}
                }
            }
            worst
        });
        match checked {
            Err(Failure::Pipe) => return Err(Failure::Pipe),
            Err(Failure::Message(what, help)) => {
                super::output::note(format_args!("error: {what}\n  help: {help}"));
                worst = Err(Failure::Shown);
            }
            Err(failure) => worst = Err(failure),
            Ok(()) => {}
        }
    }
    worst
}

/// The summary of a model or variant; what fails is told.
fn reported(path: &Path, variant: Option<&str>, model: &Model, out: &mut dyn Write) -> Outcome {
    let file = path.display();
    let name = variant.map_or(file.to_string(), |variant| format!("{file}: variant {}", words::quote(variant)));
    match summary(path, &name, model, out) {
        Err(Failure::Message(what, help)) => {
            super::output::note(format_args!("{name}: error: {what}\n  help: {help}"));
            Err(Failure::Shown)
        }
        done => done,
    }
}

/// The numbers of loops and of couplings as text.
fn counted_constraints(model: &Model) -> (Option<String>, Option<String>) {
    let loops = model.constraints.iter().filter(|c| matches!(c.kind, ConstraintKind::Loop { .. })).count();
    let count = |n: usize, what: &str| (n > 0).then(|| format!("{n} {what}{}", if n == 1 { "" } else { "s" }));
    (count(loops, "loop"), count(model.constraints.len() - loops, "coupling"))
}

fn summary(path: &Path, name: &str, model: &Model, out: &mut dyn Write) -> Outcome {
    let plan = source::planned(model, PlanOptions::default()).plan;
    source::tell_notices(path, &plan.notices);
    if let Some(name) = dependent_velocity(&plan) {
        let what = format!(
            "the mass matrix is singular in every state, as far as doubles tell: no inertia resists `{name}` while the \
             velocities before it may follow"
        );
        let help =
            format!("give what `{name}` moves mass and inertia, give its joint an `armature`, or make it `fixed`");
        return Err(Failure::new(what, help));
    }
    let params = plan.default_params();
    let closed = match model.constraints.is_empty() {
        true => None,
        false => {
            let mut interpreter = plan.interpreter(&params);
            let start = plan.start();
            let assembly = loops::assemble(path, &plan, &mut interpreter, &start)?;
            loops::tell(path, &plan, &assembly);
            Some(assembly)
        }
    };
    let value = |v: Value| match v {
        Value::Const(x) => x,
        Value::Param(k) => params[k],
    };
    let mass: f64 = model.bodies.iter().map(|b| value(b.mass)).sum();
    let d = plan.dims;
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for joint in &model.joints {
        *kinds.entry(joint.kind.word()).or_default() += 1;
    }
    let kinds: Vec<String> = kinds.iter().map(|(kind, n)| format!("{n} {kind}")).collect();
    let prescribed = plan.slots.iter().filter(|s| matches!(s.at, Some(Source::Drive { .. })));
    let mut line = format!(
        "{name}: sound: {} bodies, {} joints ({}), nq {}, nv {}, mass {} kg",
        model.bodies.len(),
        model.joints.len(),
        kinds.join(", "),
        d.nq,
        d.nv,
        (mass * 1e9).round() / 1e9,
    );
    let stops = model.contacts.iter().filter(|c| c.stop().is_some()).count();
    let follows = plan.slots.iter().filter(|s| s.at.is_none()).count();
    // Elements that the model does not have are not mentioned.
    let counted = [
        (follows, "joints that follow others"),
        (prescribed.count(), "prescribed joints"),
        (model.params.len(), "parameters"),
        (model.wrenches.len(), "external wrenches"),
        (model.shapes.len(), "shapes"),
        (model.contacts.len() - stops, "contacts"),
        (stops, "stops"),
    ];
    for (n, what) in counted.into_iter().filter(|(n, _)| *n > 0) {
        line += &format!(", {what}: {n}");
    }
    if let Some(assembly) = closed {
        let (loops, couplings) = counted_constraints(model);
        line += &format!(
            "; {}: {}",
            [loops, couplings].into_iter().flatten().collect::<Vec<_>>().join(", "),
            assembly.summary()
        );
    }
    Ok(writeln!(out, "{line}")?)
}
