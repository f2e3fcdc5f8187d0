//! `mbd-lab experiments biped`: section 7.3, momenta against accelerations on one closed loop.

use std::io::Write;

use super::forms::{Closed, Kind};
use super::mechanism::{self, Mechanism};
use super::study::{Adaptive, Method, Study, Traces, KINDS};
use super::{directory, figure, tables, thesis};
use crate::args::experiments::BipedArgs;
use mbd_cli::note;
use mbd_cli::plot::Panel;
use mbd_cli::Outcome;

const MODEL: &str = include_str!("../../../models/biped.toml");
/// Steps of the figures, s.
const STEP: f64 = 1e-3;

/// Runs the study and writes tables and figures.
pub fn run(args: &BipedArgs, out: &mut dyn Write) -> Outcome {
    directory(args.out.as_deref())?;
    let Mechanism { system, q } = mechanism::read(MODEL)?;
    let mut study = Study::new(system, &q);
    writeln!(out, "## Biped in double support (thesis 7.3), the thesis's numbers in brackets\n")?;
    let reference = agreement(&mut study, args, out)?;
    tables_of(&mut study, args, &reference, out)?;
    motion(&mut study, args, out)?;
    projected(&mut study, if args.quick { args.steps.min(1000) } else { args.steps }, out)
}

/// Runs every formulation to the end. Returns the coordinates of the first one.
fn agreement<Y: Closed>(study: &mut Study<Y>, args: &BipedArgs, out: &mut dyn Write) -> Outcome<Vec<f64>> {
    note(format_args!("reference"));
    // With order 9 the errors are far below round-off.
    let h = if args.quick { 1e-3 } else { 2.5e-4 };
    let ways = [
        ("minimal coordinates, accelerations", study.minimal_end(Kind::Velocities, h)),
        ("minimal coordinates, momenta (method 2)", study.minimal_end(Kind::Momenta, h)),
        ("augmented momenta (method 1)", study.whole_end(Kind::Momenta, h)),
        ("accelerations, index reduced", study.whole_end(Kind::Velocities, h)),
    ];
    write!(out, "{}", tables::agreement(&ways))?;
    out.flush()?;
    let [(_, first), ..] = ways;
    Ok(first.q)
}

fn tables_of<Y: Closed>(study: &mut Study<Y>, args: &BipedArgs, reference: &[f64], out: &mut dyn Write) -> Outcome {
    let steps = thesis::FIXED.map(|r| r.0);
    let steps = if args.quick { &steps[..3] } else { &steps[..] };
    note(format_args!("table 7.1"));
    let rows: Vec<_> = steps.iter().map(|&h| (h, KINDS.map(|kind| study.fixed(kind, h, reference)))).collect();
    write!(out, "{}", tables::fixed(&rows))?;
    note(format_args!("table 7.2"));
    let tolerances = thesis::ODE45.map(|r| r.0);
    let tolerances = if args.quick { &tolerances[..3] } else { &tolerances[..] };
    let rows: Vec<_> = tolerances.iter().map(|&t| (t, KINDS.map(|kind| study.ode45(kind, t, reference)))).collect();
    write!(out, "{}", tables::ode45(&rows))?;
    note(format_args!("tables 7.3 and 7.4"));
    let control = [false, true].map(|partial| KINDS.map(|kind| study.adaptive(kind, 1e-6, partial, reference)));
    write!(out, "{}{}", tables::control(&control), tables::wins(&control[0]))?;
    out.flush()?;
    if let Some(path) = &args.out {
        for (name, title, runs) in [
            ("figure_7_14", "Steps tried in every interval of 0.01 s, control of all errors", &control[0]),
            ("figure_7_15", "Steps tried in every interval of 0.01 s, control of the coordinates", &control[1]),
        ] {
            figure(out, path, name, title, "interval of 0.01 s", &[steps_panel(runs)])?;
        }
    }
    Ok(())
}

fn steps_panel(runs: &[Adaptive; 2]) -> Panel {
    let counts = |run: &Adaptive| run.tried.iter().map(|&n| n as f64).collect();
    let t = (1..=runs[0].tried.len()).map(|k| k as f64).collect();
    let names = ["accelerations", "Hamilton"].map(String::from);
    Panel::new("steps tried", t, names.into_iter().zip(runs.iter().map(counts)).collect())
}

/// One panel of lines with names.
fn panel(label: &str, names: &[&str], traces: &[&Traces]) -> Panel {
    let lines = traces.iter().flat_map(|t| &t.lines).cloned();
    let lines = names.iter().map(|n| n.to_string()).zip(lines).collect();
    Panel::new(label, traces.first().map_or(Vec::new(), |t| t.t.clone()), lines)
}

/// Figures 7.9 to 7.13, and their ranges as numbers.
fn motion<Y: Closed>(study: &mut Study<Y>, args: &BipedArgs, out: &mut dyn Write) -> Outcome {
    note(format_args!("figures 7.9 to 7.13"));
    let [q, v, p] = study.motion(STEP);
    let methods = [
        // This method is nearest to the scales of the thesis's figures; the thesis's table 7.1 uses order 5.
        ("Runge-Kutta-Fehlberg, order 4", Method::Fehlberg { lower: true }),
        ("Runge-Kutta-Fehlberg, order 5", Method::Fehlberg { lower: false }),
        ("Runge-Kutta 4", Method::Classical),
    ];
    let runs = methods.map(|(name, method)| (name, KINDS.map(|kind| study.drift(kind, STEP, method))));
    let [lagrange, hamilton] = &runs[0].1;
    let both = |k: usize| {
        let (a, b) = (lagrange[k].range(), hamilton[k].range());
        [a[0].min(b[0]), a[1].max(b[1])]
    };
    write!(out, "{}", tables::ranges(&[q.range(), v.range(), p.range(), both(0), both(1)]))?;
    let sizes = |run: &[Traces; 2]| [run[0].size(), run[1].size()];
    let rows: Vec<_> = runs.iter().map(|(name, [a, b])| (*name, [sizes(a), sizes(b)])).collect();
    write!(out, "{}", tables::drift(&rows))?;
    let Some(path) = &args.out else { return Ok(()) };
    let mut draw = |name: &str, title: &str, panel: Panel| figure(out, path, name, title, "time [s]", &[panel]);
    draw("figure_7_9", "Coordinates", panel("relative angle [rad]", &["q1", "q2", "q3"], &[&q]))?;
    draw("figure_7_10", "Velocities", panel("rad/s", &["q1", "q2", "q3"], &[&v]))?;
    draw("figure_7_11", "Momenta of the minimal states", panel("kg m²/s", &["p1", "p2", "p3"], &[&p]))?;
    let names = ["accelerations, x", "accelerations, y", "Hamilton, x", "Hamilton, y"];
    let title = "Errors of the loop, steps of 1 ms, no stabilisation";
    draw("figure_7_12", title, panel("error [m]", &names, &[&lagrange[0], &hamilton[0]]))?;
    let names = ["accelerations", "Hamilton"];
    draw("figure_7_13", "Error of the energy, steps of 1 ms", panel("error [J]", &names, &[&lagrange[1], &hamilton[1]]))
}

/// The long run with position correction after every step.
fn projected<Y: Closed>(study: &mut Study<Y>, steps: u64, out: &mut dyn Write) -> Outcome {
    let every = (steps / 10).max(1);
    let [after, before, energy] = study.projected(STEP, steps, |step| {
        if step.is_multiple_of(every) {
            note(format_args!("projection: {step} of {steps} steps"));
        }
    });
    writeln!(
        out,
        "### Projection\n\n{steps} steps of Runge-Kutta 4 of 1 ms, σ begun anew and the coordinates put back after each: the loop is open \
         by at most {after:.1e} m ({before:.1e} m before it is put back), the energy strays by {energy:.1e} J."
    )?;
    Ok(())
}
