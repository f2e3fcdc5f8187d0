//! Tables of the sweeps.

use std::io::Write;

use multibody::runtime::catalogue;
use multibody::runtime::constrained::Stabilisation;

use super::change_points::{End, Run, Subject, Way};
use super::mechanisms::{singular, smooth};
use crate::args::stability::ChangePointArgs;
use mbd_cli::Outcome;

const HOLDS: [(&str, Stabilisation); 5] = [
    ("none", Stabilisation::None),
    ("momenta", Stabilisation::Momenta),
    ("mass", Stabilisation::Mass),
    ("gradient", Stabilisation::Gradient),
    ("partition", Stabilisation::Partition),
];

/// Energy at change points.
pub fn change_points(args: &ChangePointArgs, out: &mut dyn Write) -> Outcome {
    let smooth = Subject::new(smooth());
    let methods: Vec<&str> = catalogue::entries().filter(|e| e.adaptive).map(|e| e.name).collect();
    for mechanism in singular() {
        if !args.mechanisms.is_empty() && !args.mechanisms.iter().any(|m| m == mechanism.name) {
            continue;
        }
        let first = mechanism.name == "fourbar_equal";
        let subject = Subject::new(mechanism);
        for (name, hold) in HOLDS {
            if !args.holds.is_empty() && !args.holds.iter().any(|m| m == name) {
                continue;
            }
            for &method in &methods {
                if !args.methods.is_empty() && !args.methods.iter().any(|m| m == method) {
                    continue;
                }
                for &tolerance in &args.tolerances {
                    let way = Way { method, tolerance, hold, energy: args.energy };
                    let n = if first && method == "verner9" { args.speeds } else { args.few };
                    let smooth_runs = smooth.runs(way, &smooth.speeds(8));
                    let stopped = smooth_runs.iter().filter(|r| r.end != End::Whole).count();
                    let smooth = smooth_runs.iter().fold(0.0_f64, |m, run| m.max(run.energy));
                    let clock = std::time::Instant::now();
                    let runs = subject.runs(way, &subject.speeds(n));
                    let allowed = (100.0 * tolerance).max(10.0 * smooth);
                    let count = |of: &dyn Fn(&Run) -> bool| runs.iter().filter(|r| of(r)).count();
                    let lost = count(&|r| r.energy > allowed && r.end == End::Whole);
                    let errors = count(&|r| matches!(r.end, End::Error(_)));
                    let caps = count(&|r| r.end == End::Steps);
                    let worst = runs.iter().fold(0.0_f64, |m, r| m.max(r.energy));
                    let steps = runs.iter().map(|r| r.steps).sum::<u64>() / n as u64;
                    writeln!(
                        out,
                        "{:18} {name:9} {method:12} {tolerance:7.0e} smooth {smooth:7.1e} ({stopped}) worst {worst:7.1e} silent {lost:3} errors {errors:3} cap {caps:3} of {n} steps {steps} {:.1}s",
                        subject.mechanism.name,
                        clock.elapsed().as_secs_f64()
                    )?;
                    out.flush()?;
                    if args.verbose {
                        for r in &runs {
                            let end = match r.end {
                                End::Whole => "ok".into(),
                                End::Steps => "cap".into(),
                                End::Error(e) => e.to_string(),
                            };
                            writeln!(out, "    {:8.4} {:9.2e} {:6} {end}", r.speed, r.energy, r.steps)?;
                        }
                    }
                }
            }
        }
    }
    Ok(())
}
