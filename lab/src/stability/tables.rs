//! Tables of the sweeps.

use std::fmt::Write as _;
use std::io::Write;

use multibody::runtime::catalogue;

use super::change_points::{Judged, Subject, Way};
use super::mechanisms::{singular, smooth, Mechanism};
use crate::args::stability::ChangePointArgs;
use mbd_cli::{note, write_file, Outcome, HOLD};

/// The default method, which is run at all speeds.
const DEFAULT: &str = "verner9";
/// Number of speeds of the mechanism for comparison.
const SMOOTH: usize = 8;

const HEAD: &str = "# Energy at change points

Mechanisms that pass positions in which their constraints lose rank, driven at many speeds. A run is *lost* if its energy
errs by more than 100 times the tolerance (relative to the largest kinetic energy), and by more than 10 times what the
same method loses on a smooth four-bar (`smooth`), and it does not say so; it is *refused* if it stops with an error. Of
the others, `error` is the largest error of the energy, and `steps` the mean number of steps. `capped` counts runs that
were given up after 640,000 evaluations of the rates. `positions` counts the singular positions
that all runs together met or passed.
";

/// Whether a list of names, which is empty for all, has a name.
fn chosen(list: &[String], name: &str) -> bool {
    list.is_empty() || list.iter().any(|m| m == name)
}

/// Energy at change points.
pub fn change_points(args: &ChangePointArgs, out: &mut dyn Write) -> Outcome {
    let smooth = Subject::new(smooth());
    let mut text = String::from(HEAD);
    let command = std::env::args().skip(1).collect::<Vec<_>>().join(" ");
    let _ = writeln!(text, "\n`cargo run --release -p mbd-lab -- {command}`");
    let mut lost = 0;
    for mechanism in singular().into_iter().filter(|m| chosen(&args.mechanisms, m.name)) {
        let all = mechanism.name == "fourbar_equal";
        let head = format!("\n## {}\n{}\n", mechanism.name, mechanism.title);
        write!(out, "{head}")?;
        text += &head;
        let table = "\n| hold | method | tolerance | runs | lost | refused | capped | error | smooth | steps | positions |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
        write!(out, "{table}")?;
        text += table;
        lost += rows(args, &smooth, mechanism, all, &mut |row| {
            text += row;
            write!(out, "{row}")?;
            Ok(out.flush()?)
        })?;
    }
    writeln!(out, "\n{lost} runs lost energy without an error")?;
    if let Some(path) = &args.report {
        write_file(path, &text)?;
    }
    Ok(())
}

/// The rows of one mechanism; the number of runs that lost energy without an error.
fn rows(
    args: &ChangePointArgs,
    smooth: &Subject,
    mechanism: Mechanism,
    all: bool,
    put: &mut dyn FnMut(&str) -> Outcome,
) -> Outcome<usize> {
    let subject = Subject::new(mechanism);
    let mut lost = 0;
    for (hold, name, _) in HOLD.into_iter().filter(|(_, name, _)| chosen(&args.holds, name)) {
        note(format_args!("{}: --hold {name}", subject.mechanism.name));
        for method in catalogue::entries().filter(|e| e.adaptive && chosen(&args.methods, e.name)).map(|e| e.name) {
            for &tolerance in &args.tolerances {
                let way = Way { method, tolerance, hold };
                let n = if all && method == DEFAULT { args.speeds } else { args.few };
                let reference = smooth.judged(way, &smooth.speeds(SMOOTH), 0.0).error;
                let judged = subject.judged(way, &subject.speeds(n), reference);
                let Judged { lost: own, refused, capped, error, steps, positions } = judged;
                lost += own;
                put(&format!(
                    "| {name} | {method} | {tolerance:.0e} | {n} | {own} | {refused} | {capped} | {error:.1e} | {reference:.1e} | {steps} | {positions} |\n"
                ))?;
            }
        }
    }
    Ok(lost)
}
