//! Reads a path into a checked model and its plan, and reports the findings.

use std::io::Read;
use std::path::Path;

use multibody::codegen::diag::Diagnostics;
use multibody::codegen::model::{Model, Wrench, WrenchAxes};
use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{load_variant, load_with, read_bytes, ImportOptions, Variant};
use multibody::codegen::search::{self, Chosen};
use multibody::codegen::words;
use multibody::runtime::interp::MassMatrixError;

use super::args::ModelArgs;
use super::output::{is_input, mentioned, note};
use super::{Failure, Outcome};

/// Largest size of a file, bytes. No description of a mechanism is as long, but a device file may be endless.
const LONGEST: u64 = 256 << 20;

/// Reads the text of a file.
pub fn read(path: &Path) -> Outcome<String> {
    let file = path.display();
    is_input(path);
    let mut bytes = Vec::new();
    let read = std::fs::File::open(path).and_then(|f| f.take(LONGEST + 1).read_to_end(&mut bytes));
    if let Err(e) = read {
        return Err(Failure::new(format!("cannot read `{file}`: {e}"), similar(path)));
    }
    if bytes.len() as u64 > LONGEST {
        return Err(Failure::new(
            format!("cannot read `{file}`: it is longer than {} MiB", LONGEST >> 20),
            "name a file that holds one model",
        ));
    }
    String::from_utf8(bytes).map_err(|e| {
        let good = String::from_utf8_lossy(&e.as_bytes()[..e.utf8_error().valid_up_to()]).into_owned();
        let line = good.matches('\n').count() + 1;
        let column = good.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        note(format_args!("{file}:{line}:{column}: error: not UTF-8 text\n  help: save the file as UTF-8"));
        Failure::Shown
    })
}

/// Reads JSON from a file, or from standard input where its name is `-`. Returns the name for messages and the text, without the
/// byte order mark that some editors put in front.
pub fn json(path: &Path) -> Outcome<(String, String)> {
    let (name, text) = match path.as_os_str() == "-" {
        true => ("standard input".to_string(), standard_input()?),
        false => (path.display().to_string(), read(path)?),
    };
    let unmarked = text.strip_prefix('\u{feff}').map(str::to_string);
    Ok((name, unmarked.unwrap_or(text)))
}

/// Reads JSON from standard input.
fn standard_input() -> Outcome<String> {
    let mut text = String::new();
    let read = std::io::stdin().lock().take(LONGEST + 1).read_to_string(&mut text);
    read.map_err(|e| Failure::new(format!("cannot read standard input: {e}"), "pipe JSON in, as UTF-8"))?;
    if text.len() as u64 > LONGEST {
        let what = format!("cannot read standard input: it is longer than {} MiB", LONGEST >> 20);
        return Err(Failure::new(what, "pipe fewer states in"));
    }
    Ok(text)
}

/// What to do about a path that cannot be read.
fn similar(path: &Path) -> String {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort_unstable();
    let wanted = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let names = names.iter().map(String::as_str).filter(|n| *n != wanted);
    words::did_you_mean(&wanted, names, || "check the path and that you may read it".to_string())
}

/// Reads and checks a model. All findings go to standard error.
pub fn model(path: &Path, options: &ImportOptions, variant: Option<&str>) -> Outcome<Model> {
    told(path, |file, text| load_variant(file, text, options, &base, variant))
}

/// Reads and checks a model and its variants. All findings go to standard error.
pub fn models(path: &Path, options: &ImportOptions) -> Outcome<(Model, Vec<Variant>)> {
    told(path, |file, text| load_with(file, text, options, &base))
}

/// A file that a description names.
pub fn base(path: &Path) -> std::io::Result<Vec<u8>> {
    is_input(path);
    read_bytes(path)
}

/// What is read from a file, with the findings told.
fn told<T>(path: &Path, read_text: impl FnOnce(&str, &str) -> (Option<T>, Diagnostics)) -> Outcome<T> {
    let text = read(path)?;
    let reading = format!("reading and checking {}", path.display());
    let (read, findings) = mentioned(reading, || read_text(&path.to_string_lossy(), &text));
    if !findings.0.is_empty() {
        note(format_args!("{findings}"));
    }
    read.ok_or(Failure::Shown)
}

/// The model of a command's arguments, with the wrenches they ask for.
pub fn model_of(args: &ModelArgs) -> Outcome<Model> {
    model_with(args, &args.import.import())
}

/// The same, read with given options.
pub fn model_with(args: &ModelArgs, options: &ImportOptions) -> Outcome<Model> {
    let mut model = model(&args.model, options, args.variant.as_deref())?;
    for name in &args.wrenches {
        let names = model.bodies.iter().map(|b| b.name.as_str());
        let Some(body) = model.bodies.iter().position(|b| b.name == *name) else {
            let help = words::did_you_mean(name, names.clone(), || format!("bodies are {}", words::list(names)));
            return Err(Failure::new(format!("--wrench: no body is named {}", words::quote(name)), help));
        };
        if model.wrenches.iter().any(|w| w.name == *name) {
            let what = format!("--wrench: there is a wrench named {} already", words::quote(name));
            return Err(Failure::new(what, "name each body once, and none that the model names"));
        }
        model.wrenches.push(Wrench { name: name.clone(), body, axes: WrenchAxes::Body });
    }
    Ok(model)
}

/// The plan of a model and what was tried on the way to it, with its notices told.
pub fn chosen(args: &ModelArgs, options: PlanOptions) -> Outcome<Chosen> {
    let chosen = planned(&model_of(args)?, options);
    tell_notices(&args.model, &chosen.plan.notices);
    Ok(chosen)
}

/// The plan of a model and what was tried on the way to it.
pub fn planned(model: &Model, options: PlanOptions) -> Chosen {
    mentioned("choosing the elimination", || search::best(Plan::new(model, options.snap), options))
}

/// Plans a model and reports the notices.
pub fn plan(args: &ModelArgs, options: PlanOptions) -> Outcome<Plan> {
    Ok(chosen(args, options)?.plan)
}

/// Notices of a plan that are told one by one; of more, only the number.
const NOTICES: usize = 5;

/// Reports the notices of a plan.
pub fn tell_notices(path: &Path, notices: &[String]) {
    let file = path.display();
    for notice in notices.iter().take(NOTICES) {
        note(format_args!("{file}: notice: {notice}"));
    }
    if let more @ 1.. = notices.len().saturating_sub(NOTICES) {
        note(format_args!(
            "{file}: notice: {more} more of such notices (`--snap 0` of `mbd generate` keeps every number)"
        ));
    }
}

/// The failure of a model whose mass matrix is singular: the mechanism cannot be moved by its own laws.
pub fn rank_failure(e: &MassMatrixError) -> Failure {
    Failure::new(e.to_string(), "give the bodies behind this joint mass and inertia, or the joint an armature")
}
