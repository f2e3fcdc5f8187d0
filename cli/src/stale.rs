//! `mbd check --generated`: compares committed code with its models.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use multibody::codegen::options::{AngleRange, EliminationStrategy, PlanOptions, RowElimination, DEFAULT_SNAP};
use multibody::codegen::read::{Base, ImportOptions};
use multibody::codegen::{self, Arithmetic, LikeBranches, Options, Output, Precision, RolledCode};
use serde::Deserialize;

use super::args::{type_name, DEFAULT_RUNTIME};
use super::generate::{self, shown};
use super::output::{note, write_file};
use super::{modes, source, Failure, Outcome};

/// The contents of `manifest.toml`: the files of the directory. Paths are relative to it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    /// Path of the runtime in the generated code.
    runtime: Option<String>,
    file: Vec<Entry>,
}

/// One generated file. Options that are not given have the defaults of `mbd generate`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    /// Name of the file.
    file: String,
    /// File of the model.
    model: PathBuf,
    #[serde(rename = "type")]
    type_name: String,
    outputs: Vec<String>,
    base: Option<String>,
    gravity: Option<[f64; 3]>,
    scalar: Option<String>,
    arithmetic: Option<String>,
    angles: Option<String>,
    elimination: Option<String>,
    rolled: Option<String>,
    branches: Option<String>,
    rows: Option<String>,
    efforts: Option<bool>,
    frames: Option<Vec<String>>,
    snap: Option<f64>,
    chunk: Option<usize>,
    /// Modes of contacts: `masked`, `all`, or a file with sets of modes.
    modes: Option<String>,
}

const MANIFEST: &str = "manifest.toml";

/// Compares every file of the manifest with the generator's present output, and `mod.rs` with the list of files.
pub fn run(directory: &Path, update: bool, out: &mut dyn Write) -> Outcome {
    let path = directory.join(MANIFEST);
    let manifest = read(&path)?;
    let mut wanted = Vec::new();
    for entry in &manifest.file {
        let runtime = manifest.runtime.as_deref().unwrap_or(DEFAULT_RUNTIME);
        wanted.push((entry.file.clone(), content(directory, &path, entry, runtime)?));
    }
    wanted.push(("mod.rs".to_string(), modules(&manifest)));
    let mut stale = 0;
    for (file, content) in &wanted {
        let path = directory.join(file);
        let Some(difference) = difference(&path, content) else { continue };
        if update {
            write_file(&path, content)?;
            writeln!(out, "{}: written", path.display())?;
        } else {
            stale += 1;
            note(format_args!("{}{difference}", path.display()));
        }
    }
    stale += strays(directory, &wanted)?;
    if stale > 0 {
        let help = format!("`mbd check --generated {} --update` writes them anew", directory.display());
        return Err(Failure::new(format!("{stale} of the generated files are stale"), help));
    }
    Ok(writeln!(out, "{}: {} generated files, all fresh", directory.display(), wanted.len())?)
}

fn read(path: &Path) -> Outcome<Manifest> {
    let text = source::read(path)?;
    toml::from_str(&text).map_err(|e| {
        let before = &text[..e.span().map_or(0, |s| s.start.min(text.len()))];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        let message = e.message().lines().next().unwrap_or_default().to_string();
        note(format_args!("{}:{line}:{column}: error: {message}\n  help: {KEYS}", path.display()));
        Failure::Shown
    })
}

const KEYS: &str = "a manifest has `runtime` and [[file]] tables with `file`, `model`, `type`, `outputs`, and perhaps \
                    `base`, `gravity`, `scalar`, `arithmetic`, `angles`, `elimination`, `rolled`, `branches`, `rows`, `efforts`, `frames`, `snap`, `chunk`, `modes`";

/// The text that a file should have.
fn content(directory: &Path, manifest: &Path, entry: &Entry, runtime: &str) -> Outcome<String> {
    let wrong = |what: String| {
        Failure::new(format!("{}: `{}`: {what}", manifest.display(), entry.file), "correct the entry in the manifest")
    };
    if module(&entry.file).is_none() {
        return Err(wrong("the name of the file must be a module's, such as `robot.rs`".into()));
    }
    let group = |name: &String| Output::from_name(name).ok_or_else(|| wrong(format!("`{name}` is no output")));
    let default = Options::default();
    let base = choice("base", &entry.base, Base::from_name).map_err(wrong)?;
    let import = ImportOptions { base, gravity: entry.gravity, ..ImportOptions::default() };
    let model = source::model(&directory.join(&entry.model), &import, None)?;
    let modes = entry.modes.as_deref().map(|word| modes::choice(word, directory, &model)).transpose()?;
    let options = Options {
        type_name: type_name(&entry.type_name).map_err(wrong)?,
        outputs: entry.outputs.iter().map(group).collect::<Outcome<_>>()?,
        precision: choice("scalar", &entry.scalar, Precision::from_name).map_err(wrong)?,
        arithmetic: choice("arithmetic", &entry.arithmetic, Arithmetic::from_name).map_err(wrong)?,
        angles: choice("angles", &entry.angles, AngleRange::from_name).map_err(wrong)?,
        efforts: entry.efforts.unwrap_or(true),
        frames: entry.frames.clone().unwrap_or_default(),
        plan: PlanOptions {
            snap: entry.snap.unwrap_or(DEFAULT_SNAP),
            elimination: choice("elimination", &entry.elimination, EliminationStrategy::from_name).map_err(wrong)?,
            rolled: choice("rolled", &entry.rolled, RolledCode::from_name).map_err(wrong)?,
            branches: choice("branches", &entry.branches, LikeBranches::from_name).map_err(wrong)?,
            rows: choice("rows", &entry.rows, RowElimination::from_name).map_err(wrong)?,
            ..PlanOptions::default()
        },
        runtime: runtime.to_string(),
        source: shown(&entry.model),
        chunk: entry.chunk.unwrap_or(default.chunk).max(1),
        modes,
    };
    Ok(codegen::generate(&model, &options).map_err(generate::failure)?.source)
}

/// The value of a word in the manifest, the default where there is none.
fn choice<T: Default>(key: &str, word: &Option<String>, from_name: fn(&str) -> Option<T>) -> Result<T, String> {
    match word {
        None => Ok(T::default()),
        Some(word) => from_name(word).ok_or_else(|| format!("`{key}` cannot be `{word}`")),
    }
}

/// Module name of a file, if its name is a valid one.
fn module(file: &str) -> Option<&str> {
    let name = file.strip_suffix(".rs")?;
    let word = name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    (word && name.starts_with(|c: char| c.is_ascii_lowercase()) && name != "mod").then_some(name)
}

fn modules(manifest: &Manifest) -> String {
    let mut text = "//! Generated by mbd: one module for each file of `manifest.toml`.\n".to_string();
    for entry in &manifest.file {
        let name = module(&entry.file).unwrap_or_default();
        let model = shown(&entry.model);
        text += &format!("\n/// From {model}.\npub mod {name};\n");
    }
    text
}

/// The first difference between a file and the text that it should have, as it is shown after its name.
fn difference(path: &Path, wanted: &str) -> Option<String> {
    let Ok(bytes) = std::fs::read(path) else { return Some(": error: the file is missing or cannot be read".into()) };
    if bytes == wanted.as_bytes() {
        return None;
    }
    let found = String::from_utf8_lossy(&bytes);
    let (mut theirs, mut ours) = (found.lines(), wanted.lines());
    for line in 1.. {
        match (theirs.next(), ours.next()) {
            (None, None) => break,
            (a, b) if a == b => {}
            (a, b) => {
                let show = |l: Option<&str>| l.map_or("the end of the file".to_string(), |l| format!("`{}`", l.trim()));
                return Some(format!(":{line}:1: error: stale: {} should be {}", show(a), show(b)));
            }
        }
    }
    Some(": error: stale: line ends differ".into())
}

/// Reports the Rust files that the manifest does not list, and returns their number.
fn strays(directory: &Path, wanted: &[(String, String)]) -> Outcome<usize> {
    let known: BTreeSet<&str> = wanted.iter().map(|(f, _)| f.as_str()).collect();
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.retain(|n| n.ends_with(".rs") && !known.contains(n.as_str()));
    names.sort_unstable();
    for name in &names {
        let path = directory.join(name);
        note(format_args!("{}: error: not in {MANIFEST}\n  help: add it to the manifest or delete it", path.display()));
    }
    Ok(names.len())
}
