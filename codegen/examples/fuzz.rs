//! Fuzzes the readers: mutates the shipped and the broken models and reports every panic.
//!
//! ```sh
//! cargo run --release -p mbd-codegen --example fuzz -- --seconds 600 [--format toml|urdf|xml] [--seed 1] [--save DIR]
//! ```
//!
//! Inputs that panic, take longer than a second, or give neither model nor error are written to the folder of `--save`
//! (default `target/fuzz`) and named by their seed; the exit status is 1 if there were any. A seed gives the same input
//! as long as the corpus stays the same.

#[path = "../tests/readers/mutate.rs"]
mod mutate;

use std::panic::{catch_unwind, set_hook, AssertUnwindSafe};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use mbd_codegen::read::{self, Base, ImportOptions};
use mutate::Mutator;

const SLOW: Duration = Duration::from_secs(1);

struct Options {
    seconds: u64,
    formats: Vec<&'static str>,
    seed: u64,
    save: PathBuf,
}

fn options() -> Result<Options, String> {
    let crate_folder = env!("CARGO_MANIFEST_DIR");
    let save = PathBuf::from(crate_folder).join("../target/fuzz");
    let mut options = Options { seconds: 60, formats: vec!["toml", "urdf", "xml"], seed: 0, save };
    let mut arguments = std::env::args().skip(1);
    while let Some(key) = arguments.next() {
        let value = arguments.next().ok_or(format!("{key} needs a value"))?;
        match key.as_str() {
            "--seconds" => options.seconds = value.parse().map_err(|e| format!("{value}: {e}"))?,
            "--seed" => options.seed = value.parse().map_err(|e| format!("{value}: {e}"))?,
            "--save" => options.save = value.into(),
            "--format" if value == "toml" => options.formats = vec!["toml"],
            "--format" if value == "urdf" => options.formats = vec!["urdf"],
            "--format" if value == "xml" => options.formats = vec!["xml"],
            _ => return Err(format!("unknown option {key} {value}")),
        }
    }
    Ok(options)
}

/// What is wrong with how an input was taken, if anything.
fn problem(file: &str, text: &str, options: &ImportOptions) -> (Option<String>, bool) {
    let start = Instant::now();
    let caught = catch_unwind(AssertUnwindSafe(|| read::load(file, text, options)));
    let Ok((model, findings)) = caught else { return (Some("panic".into()), false) };
    let problem = if model.is_some() == findings.has_errors() {
        Some("neither or both of model and error".into())
    } else if start.elapsed() > SLOW {
        Some(format!("{:.1} s", start.elapsed().as_secs_f64()))
    } else {
        None
    };
    (problem, model.is_some())
}

/// Fuzzes one format for its share of the time; returns the number of problems.
fn fuzz(format: &str, seconds: f64, options: &Options) -> usize {
    let crate_folder = env!("CARGO_MANIFEST_DIR");
    let folders = [format!("{crate_folder}/tests"), format!("{crate_folder}/../models")];
    let mut seeds = mutate::corpus(&folders.each_ref().map(String::as_str), format);
    // Large files would take all the time and say little more.
    seeds.retain(|s| s.len() < 40_000);
    if seeds.is_empty() {
        println!("{format}: no files to start from");
        return 0;
    }
    let file = format!("fuzz.{format}");
    let seeds = mutate::balanced(seeds, |text| read::load(&file, text, &ImportOptions::default()).0.is_some());
    let (start, mut last, mut seed) = (Instant::now(), Instant::now(), options.seed);
    let (mut models, mut problems) = (0u64, 0);
    while start.elapsed().as_secs_f64() < seconds {
        let text = Mutator::new(seed).mutate(&seeds);
        let base = if format == "urdf" {
            [Base::Fixed, Base::Floating, Base::Planar][(seed % 3) as usize]
        } else {
            Base::Fixed
        };
        let (problem, model) = problem(&file, &text, &ImportOptions { base, ..ImportOptions::default() });
        models += u64::from(model);
        if let Some(problem) = problem {
            problems += 1;
            let path = options.save.join(format!("{seed}.{format}"));
            let saved = std::fs::create_dir_all(&options.save).and_then(|()| std::fs::write(&path, &text));
            println!(
                "{format}: seed {seed}: {problem}; input in {}{}",
                path.display(),
                if saved.is_err() { " (not written)" } else { "" }
            );
        }
        seed += 1;
        if last.elapsed() > Duration::from_secs(30) {
            last = Instant::now();
            report(format, seed - options.seed, models, problems, start);
        }
    }
    report(format, seed - options.seed, models, problems, start);
    problems
}

fn report(format: &str, runs: u64, models: u64, problems: usize, start: Instant) {
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{format}: {runs} inputs in {seconds:.0} s, {:.0} per second, {:.1} % of them models, {problems} problems",
        runs as f64 / seconds,
        100.0 * models as f64 / runs.max(1) as f64
    );
}

fn main() -> ExitCode {
    let options = match options() {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    set_hook(Box::new(|info| println!("{info}")));
    let share = options.seconds as f64 / options.formats.len() as f64;
    let problems: usize = options.formats.iter().map(|format| fuzz(format, share, &options)).sum();
    ExitCode::from(u8::from(problems > 0))
}
