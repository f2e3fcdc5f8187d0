//! `mbd-lab bench`: work against error, long runs, stress, and the report of all three.

mod erased;
mod figure;
mod long;
mod report;
mod sample;
mod stress;
mod tables;
mod work;

use std::io::Write;
use std::path::Path;

use crate::scenes::{self, Scene};

use crate::args::bench::{Bench, BenchArgs, Choice, LongArgs, WorkArgs};
use mbd_cli::{note, write_file};
use mbd_cli::{Failure, Outcome};
use multibody::runtime::catalogue;
use sample::Sample;
use work::{Reference, Variant};

/// Runs the bench.
pub fn run(args: &BenchArgs, out: &mut dyn Write) -> Outcome {
    match &args.bench {
        Bench::WorkPrecision(args) => work_precision(args, out),
        Bench::Longrun(args) => longrun(args, out),
        Bench::Stress(args) => {
            let rows = stress::rows(&chosen(&args.choice)?, &args.choice.methods);
            Ok(write!(out, "{}", tables::stress(&rows))?)
        }
        Bench::Report(args) => report::write(args, out),
    }
}

/// The scenes of a list of names, or all of them. The methods of the list must exist.
fn chosen(choice: &Choice) -> Outcome<Vec<Scene>> {
    for name in &choice.methods {
        if catalogue::entry(name).is_none() {
            let all: Vec<&str> = catalogue::entries().map(|e| e.name).collect();
            return Err(Failure::new(format!("there is no method `{name}`"), format!("one of {}", all.join(", "))));
        }
    }
    if choice.scenes.is_empty() {
        return Ok(scenes::all());
    }
    let scene = |name: &String| {
        scenes::by_name(name).ok_or_else(|| {
            let all: Vec<&str> = scenes::names().collect();
            Failure::new(format!("there is no scene `{name}`"), format!("one of {}", all.join(", ")))
        })
    };
    choice.scenes.iter().map(scene).collect()
}

/// Samples of one scene.
pub struct Measured {
    /// The scene.
    pub scene: Scene,
    /// The reference from which errors are measured.
    pub reference: Option<Reference>,
    /// Samples of this project, then of the rivals.
    pub samples: Vec<Sample>,
}

fn measured(scene: Scene, methods: &[String], rivals: &[Sample]) -> Measured {
    let (reference, mut samples) = work::scene(&scene, &Variant::ALL, methods);
    if let Some(reference) = &reference {
        let theirs = rivals.iter().filter(|s| s.scene == scene.name).cloned();
        samples.extend(theirs.map(|mut s| {
            s.end_error = Some(sample::end_error(&s.q, &reference.q));
            s
        }));
    }
    Measured { scene, reference, samples }
}

/// Samples of rivals.
fn read_rivals(path: Option<&Path>) -> Outcome<Vec<Sample>> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let text = std::fs::read_to_string(path).map_err(|e| {
        Failure::new(format!("cannot read `{}`: {e}", path.display()), "benches/integrators/run.sh writes it")
    })?;
    let lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty());
    let read = lines.map(|(k, line)| {
        serde_json::from_str::<Sample>(line).map_err(|e| {
            let place = format!("{}:{}:{}", path.display(), k + 1, e.column());
            Failure::new(format!("{place}: {e}"), "one JSON object a line, as benches/integrators/run.sh writes them")
        })
    });
    // Lines about something else (times of single evaluations) have no coordinates.
    Ok(read.collect::<Outcome<Vec<_>>>()?.into_iter().filter(|s| !s.q.is_empty()).collect())
}

fn work_precision(args: &WorkArgs, out: &mut dyn Write) -> Outcome {
    let scenes = chosen(&args.choice)?;
    let rivals = read_rivals(args.rivals.as_deref())?;
    let (mut lines, mut all) = (String::new(), Vec::new());
    for scene in scenes {
        let measured = measured(scene, &args.choice.methods, &rivals);
        write!(out, "{}", tables::work(&measured))?;
        out.flush()?;
        for sample in &measured.samples {
            lines += &serde_json::to_string(sample).unwrap_or_default();
            lines.push('\n');
        }
        if let Some(directory) = &args.figures {
            write_figure(&measured, directory)?;
        }
        all.push(measured);
    }
    if !rivals.is_empty() {
        write!(out, "### Our time divided by the rivals'\n\n{}", tables::ratios(&all))?;
    }
    match &args.samples {
        Some(path) => write_file(path, &lines),
        None => Ok(()),
    }
}

/// The figure of a scene, if it has samples.
fn write_figure(measured: &Measured, directory: &Path) -> Outcome {
    let Some(figure) = tables::figure(measured) else { return Ok(()) };
    let svg = figure.svg();
    std::fs::create_dir_all(directory)
        .map_err(|e| Failure::new(format!("cannot make `{}`: {e}", directory.display()), "name another directory"))?;
    write_file(&directory.join(format!("{}.svg", measured.scene.name)), &svg)
}

/// Default scenes of the long runs.
pub const LONG: [&str; 4] = ["double_pendulum", "double_pendulum_chaotic", "arm7", "chain10_swing"];

fn longrun(args: &LongArgs, out: &mut dyn Write) -> Outcome {
    let mut choice = args.choice.clone();
    if choice.scenes.is_empty() {
        choice.scenes = LONG.map(String::from).to_vec();
    }
    for scene in chosen(&choice)? {
        if !scene.conservative {
            note(format_args!("{}: notice: its energy is no constant, it is left out", scene.name));
            continue;
        }
        let rows = long::scene(&scene, &long::methods(&choice.methods), args.steps);
        write!(out, "{}", tables::long(&scene, &rows))?;
        out.flush()?;
    }
    Ok(())
}
