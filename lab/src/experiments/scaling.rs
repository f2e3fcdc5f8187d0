//! `mbd-lab experiments scaling`: section 7.2, and mechanisms with many loops.

use std::fmt::Write as _;
use std::io::Write;

use crate::scenes::experiments as texts;
use multibody::runtime::integrate::tableau::RKF45;
use multibody::runtime::{Interpreter, System};

use super::clock::{least, Line};
use super::forms::{Kind, Whole};
use super::mechanism::{self, Mechanism};
use super::plain::controlled;
use super::tables::{head, row};
use super::{directory, figure, thesis};
use crate::args::experiments::ScalingArgs;
use mbd_cli::note;
use mbd_cli::plot::Panel;
use mbd_cli::Outcome;

/// Kind of the loops: a revolute joint. In planar mechanisms three of its five rows are redundant.
const REVOLUTE: &str = "revolute";

/// Kinds of systems, as the legends name them.
const FAMILIES: [&str; 3] = ["open", "tree", "closed"];

/// Numbers of links, 32 in all as in the thesis.
fn sizes(family: &str, quick: bool) -> &'static [usize] {
    match (family, quick) {
        ("tree", true) => &[15, 30],
        (_, true) => &[10, 30],
        ("tree", false) => &[15, 30, 60, 105, 150, 210, 300, 390],
        (_, false) => &[10, 20, 35, 50, 75, 100, 150, 200, 250, 300, 350, 400],
    }
}

fn text(family: &str, n: usize) -> String {
    match family {
        "open" => texts::open(n),
        "tree" => texts::tree(n),
        _ => texts::closed(n, REVOLUTE, false),
    }
}

/// Measurements of one system.
struct Measured {
    family: &'static str,
    n: usize,
    /// Time of an evaluation, s.
    evaluation: f64,
    /// Evaluations for a second of motion; `None` where the steps became too small.
    second: Option<u64>,
}

/// Length of the measurements.
struct Effort {
    rounds: u32,
    round: f64,
}

impl Effort {
    fn new(quick: bool) -> Effort {
        match quick {
            true => Effort { rounds: 3, round: 1e-3 },
            false => Effort { rounds: 25, round: 4e-3 },
        }
    }

    /// Time of an evaluation of each mechanism.
    fn times(&self, mechanisms: &mut [Mechanism]) -> Vec<f64> {
        let mut calls: Vec<Box<dyn FnMut() + '_>> = mechanisms.iter_mut().map(call).collect();
        let mut calls: Vec<&mut dyn FnMut()> = calls.iter_mut().map(|c| &mut **c as &mut dyn FnMut()).collect();
        least(&mut calls, self.rounds, self.round)
    }
}

/// A function that makes one evaluation at the start with small velocities.
fn call(mechanism: &mut Mechanism) -> Box<dyn FnMut() + '_> {
    let Mechanism { system, q, .. } = mechanism;
    let (mut p, mut qd, mut pd) = (system.zero_momenta(), system.neutral(), system.zero_momenta());
    moving(system, q, &mut p);
    Box::new(move || system.rates_at(0.0, std::hint::black_box(q), &p, &mut qd, &mut pd))
}

/// Momenta of small velocities, so that the evaluation is not one at rest.
fn moving(system: &mut Interpreter<f64>, q: &[f64], p: &mut [f64]) {
    let v: Vec<f64> = (0..p.len()).map(|k| 0.1 - 0.02 * (k % 11) as f64).collect();
    system.momenta(q, &v, p);
}

/// Measures all systems and writes tables and figures.
pub fn run(args: &ScalingArgs, out: &mut dyn Write) -> Outcome {
    directory(args.out.as_deref())?;
    let effort = Effort::new(args.quick);
    writeln!(out, "## Number of links (thesis 7.2), interpreter\n")?;
    let mut all = Vec::new();
    for family in FAMILIES {
        note(format_args!("{family}: links {:?}", sizes(family, args.quick)));
        for &n in sizes(family, args.quick) {
            all.push(measure(family, n, &effort)?);
        }
    }
    write!(out, "{}", evaluations(&all))?;
    write!(out, "{}", seconds(&all))?;
    out.flush()?;
    if let Some(path) = &args.out {
        figures(&all, path, out)?;
    }
    #[cfg(feature = "generated")]
    write!(out, "{}", code(&effort)?)?;
    write!(out, "{}", ratios(args.quick, &effort)?)?;
    write!(out, "{}", space(&effort)?)?;
    out.flush()?;
    many_loops(args, &effort, out)
}

fn measure(family: &'static str, n: usize, effort: &Effort) -> Outcome<Measured> {
    let mut mechanism = mechanism::read(&text(family, n))?;
    let evaluation = effort.times(std::slice::from_mut(&mut mechanism))[0];
    let y: Vec<f64> = mechanism.q.iter().copied().chain(mechanism.q.iter().map(|_| 0.0)).collect();
    let run = controlled(&mut Whole::new(&mut mechanism.system, Kind::Momenta), &RKF45, &y, 1.0, 1e-6);
    Ok(Measured { family, n, evaluation, second: run.map(|run| run.evaluations) })
}

fn of<'a>(all: &'a [Measured], family: &'a str) -> impl Iterator<Item = &'a Measured> {
    all.iter().filter(move |m| m.family == family)
}

/// Figure 7.6 as a table, with a fitted line for every family.
fn evaluations(all: &[Measured]) -> String {
    let mut text = head("Figure 7.6: time of an evaluation, µs", &["links", "open", "tree", "closed"]);
    let mut sizes: Vec<usize> = all.iter().map(|m| m.n).collect();
    sizes.sort_unstable();
    sizes.dedup();
    for n in sizes {
        let cell = |family| {
            let found = of(all, family).find(|m| m.n == n);
            found.map_or(String::new(), |m| format!("{:.2}", 1e6 * m.evaluation))
        };
        row(&mut text, &[n.to_string(), cell("open"), cell("tree"), cell("closed")]);
    }
    text.push('\n');
    for family in FAMILIES {
        let points: Vec<(f64, f64)> = of(all, family).map(|m| (m.n as f64, m.evaluation)).collect();
        let _ = writeln!(text, "- {family}: {}", told(&Line::through(&points), "link"));
    }
    let _ =
        writeln!(text, "- thesis (Pentium 4, 2 GHz): {:.0} µs for the open chain of 100\n", 1e6 * thesis::CHAIN100.1);
    text
}

fn told(line: &Line, unit: &str) -> String {
    let Line { start, slope, farthest } = line;
    let (start, slope, farthest) = (1e6 * start, 1e9 * slope, 100.0 * farthest);
    format!("{start:.2} µs + {slope:.0} ns for every {unit}; no point is farther from that than {farthest:.0} %")
}

impl Measured {
    /// Time that the evaluations for a second of motion take, s.
    fn time(&self) -> Option<f64> {
        self.second.map(|count| count as f64 * self.evaluation)
    }
}

/// Figures 7.4 and 7.5 as a table.
fn seconds(all: &[Measured]) -> String {
    let columns = ["links", "evaluations, open", "tree", "closed", "their time, ms, open", "tree", "closed"];
    let title = "Figures 7.5 and 7.4: a second of motion, Runge-Kutta-Fehlberg, both tolerances 1e-6";
    let mut text = head(title, &columns);
    let mut sizes: Vec<usize> = all.iter().map(|m| m.n).collect();
    sizes.sort_unstable();
    sizes.dedup();
    for n in sizes {
        let cell = |family, told: &dyn Fn(&Measured) -> Option<String>| {
            let found = of(all, family).find(|m| m.n == n);
            found.map_or(String::new(), |m| told(m).unwrap_or_else(|| "–".into()))
        };
        let mut cells = vec![n.to_string()];
        cells.extend(FAMILIES.map(|f| cell(f, &|m| m.second.map(|count| count.to_string()))));
        cells.extend(FAMILIES.map(|f| cell(f, &|m| m.time().map(|s| format!("{:.1}", 1e3 * s)))));
        row(&mut text, &cells);
    }
    let (count, _, time) = thesis::CHAIN100;
    let _ = writeln!(
        text,
        "\nThesis, open chain of 100: {count} evaluations, {time} s. Its start is not known, and friction of eigenvalue 1900 /s, not \
         accuracy, limits the steps of long chains.\n"
    );
    text
}

/// Value at `x` on the lines between points, whose first numbers grow; not a number outside.
fn between(points: &[[f64; 2]], x: f64) -> f64 {
    let next = points.partition_point(|point| point[0] < x);
    match (next.checked_sub(1).and_then(|k| points.get(k)), points.get(next)) {
        (_, Some(&[x1, y1])) if x1 == x => y1,
        (Some(&[x0, y0]), Some(&[x1, y1])) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        _ => f64::NAN,
    }
}

/// Figures 7.4 to 7.6.
fn figures(all: &[Measured], path: &std::path::Path, out: &mut dyn Write) -> Outcome {
    let mut draw = |name: &str, title: &str, label: &str, value: &dyn Fn(&Measured) -> f64| {
        let mut t: Vec<f64> = std::iter::once(0.0).chain(all.iter().map(|m| m.n as f64)).collect();
        t.sort_by(f64::total_cmp);
        t.dedup();
        let line = |family: &str| {
            let own: Vec<[f64; 2]> = of(all, family).map(|m| [m.n as f64, value(m)]).collect();
            (family.to_string(), t.iter().map(|n| between(&own, *n)).collect())
        };
        let panel = Panel::new(label, t.clone(), FAMILIES.map(line).into());
        figure(out, path, name, title, "number of links", &[panel])
    };
    let title = "Time in the equations for a second of motion, interpreter";
    draw("figure_7_4", title, "s", &|m| m.time().unwrap_or(f64::NAN))?;
    let count = |m: &Measured| m.second.map_or(f64::NAN, |count| count as f64);
    draw("figure_7_5", "Evaluations for a second of motion", "evaluations", &count)?;
    draw("figure_7_6", "Time of an evaluation, interpreter", "µs", &|m| 1e6 * m.evaluation)
}

/// Generated code and the interpreter, with interleaved rounds of all systems.
#[cfg(feature = "generated")]
fn code(effort: &Effort) -> Outcome<String> {
    use crate::generated::visit_chain;
    note(format_args!("generated code"));
    let systems = [("open", 10), ("open", 50), ("open", 100), ("tree", 150), ("closed", 10), ("closed", 100)];
    let (mut mechanisms, mut generated) = (Vec::new(), Vec::new());
    for (family, n) in systems {
        let mut mechanism = mechanism::read(&self::text(family, n))?;
        let mut p = mechanism.system.zero_momenta();
        moving(&mut mechanism.system, &mechanism.q, &mut p);
        generated.extend(visit_chain(family, n, Repeated { q: &mechanism.q, p: &p }));
        mechanisms.push(mechanism);
    }
    let interpreted = effort.times(&mut mechanisms);
    let mut calls: Vec<&mut dyn FnMut()> = generated.iter_mut().map(|c| &mut **c as &mut dyn FnMut()).collect();
    let times = least(&mut calls, effort.rounds, effort.round);
    let columns = ["system", "links", "interpreter", "generated", "ns for every link", "to the open one"];
    let mut text = head("Generated code, time of an evaluation, µs", &columns);
    for (k, (family, n)) in systems.iter().enumerate() {
        let open = systems.iter().position(|s| s.0 == "open" && s.1 == *n);
        let mut cells = vec![family.to_string(), n.to_string()];
        cells.extend([1e6 * interpreted[k], 1e6 * times[k], 1e9 * times[k] / *n as f64].map(|x| format!("{x:.2}")));
        cells.push(open.map_or(String::new(), |open| format!("{:.2}", times[k] / times[open])));
        row(&mut text, &cells);
    }
    Ok(text + "\nThose of ten links are straight-line code, the others loops over like links.\n\n")
}

/// A call of generated rates at one state.
#[cfg(feature = "generated")]
struct Repeated<'a> {
    q: &'a [f64],
    p: &'a [f64],
}

#[cfg(feature = "generated")]
impl crate::generated::VisitRates for Repeated<'_> {
    type Out = Box<dyn FnMut()>;
    fn visit<Y: System<Scalar = f64> + 'static>(self, mut system: Y) -> Box<dyn FnMut()> {
        let (mut q, mut p, mut qd, mut pd) =
            (system.neutral(), system.zero_momenta(), system.neutral(), system.zero_momenta());
        q.as_mut().copy_from_slice(self.q);
        p.as_mut().copy_from_slice(self.p);
        Box::new(move || {
            system.rates_at(0.0, std::hint::black_box(&q), &p, &mut qd, &mut pd);
            std::hint::black_box(&pd);
        })
    }
}

/// Time of the closed chain relative to the open one, for several kinds of loops.
fn ratios(quick: bool, effort: &Effort) -> Outcome<String> {
    let kinds = [REVOLUTE, "spherical", "point_on_line"];
    let columns = [
        "links",
        "open, µs",
        "closed / open, revolute joint (5 rows)",
        "ball joint (3 rows)",
        "point on line (2 rows)",
    ];
    let mut text = head("Closed against open, rounds in turn", &columns);
    for &n in if quick { &[10][..] } else { &[10, 100, 400] } {
        let mut all = vec![mechanism::read(&texts::open(n))?];
        for kind in kinds {
            all.push(mechanism::read(&texts::closed(n, kind, false))?);
        }
        let times = effort.times(&mut all);
        let mut cells = vec![n.to_string(), format!("{:.2}", 1e6 * times[0])];
        cells.extend(times[1..].iter().map(|t| format!("{:.2}", t / times[0])));
        row(&mut text, &cells);
    }
    Ok(text + "\nIn a plane all three hold the same two directions; the further rows of the first two are found redundant.\n\n")
}

/// Chains of 20 links in space and in a plane.
fn space(effort: &Effort) -> Outcome<String> {
    let mut text = head("Chains of 20 links, time of an evaluation, µs", &["", "planar", "crosswise", "ratio"]);
    let mut line = |name: &str, texts: [String; 2]| -> Outcome {
        let mut pair = [mechanism::read(&texts[0])?, mechanism::read(&texts[1])?];
        let times = effort.times(&mut pair);
        let cells = [1e6 * times[0], 1e6 * times[1], times[1] / times[0]].map(|x| format!("{x:.2}"));
        row(&mut text, &std::iter::once(name.to_string()).chain(cells).collect::<Vec<_>>());
        Ok(())
    };
    line("open", [texts::open(20), texts::crosswise(20)])?;
    line("closed by a ball joint", [texts::closed(20, "spherical", false), texts::closed(20, "spherical", true)])?;
    line("closed by a revolute joint", [texts::closed(20, REVOLUTE, false), texts::closed(20, REVOLUTE, true)])?;
    let [crosswise, planar] = thesis::CHAIN20.map(|t| 1e6 * t);
    let cells =
        ["open, thesis".into(), format!("{planar}"), format!("{crosswise}"), format!("{:.2}", crosswise / planar)];
    row(&mut text, &cells);
    Ok(text + "\n")
}

/// Time over the number of independent loops.
fn many_loops(args: &ScalingArgs, effort: &Effort, out: &mut dyn Write) -> Outcome {
    let counts: &[usize] = if args.quick { &[1, 4] } else { &[1, 2, 5, 10, 15, 20, 30, 40, 50] };
    note(format_args!("loops: {counts:?}"));
    let mut rows = Vec::new();
    for &count in counts {
        let mut both = Vec::new();
        for series in [false, true] {
            both.push(mechanism::read(&texts::four_bars(count, REVOLUTE, series))?);
        }
        rows.push((count, effort.times(&mut both)));
    }
    let mut text = head("Four-bars, time of an evaluation, µs", &["loops", "side by side", "each on the one before"]);
    for (count, times) in &rows {
        row(&mut text, &[count.to_string(), format!("{:.2}", 1e6 * times[0]), format!("{:.2}", 1e6 * times[1])]);
    }
    text.push('\n');
    let names = ["side by side", "each on the one before"];
    for (k, name) in names.iter().enumerate() {
        let points: Vec<(f64, f64)> = rows.iter().map(|(n, t)| (*n as f64, t[k])).collect();
        let _ = writeln!(text, "- {name}: {}", told(&Line::through(&points), "loop"));
    }
    writeln!(out, "{text}")?;
    let Some(path) = &args.out else { return Ok(()) };
    let t = rows.iter().map(|r| r.0 as f64).collect();
    let line = |k: usize| (names[k].to_string(), rows.iter().map(|r| 1e6 * r.1[k]).collect());
    let panel = Panel::new("µs", t, [line(0), line(1)].into());
    figure(out, path, "loops", "Time of an evaluation, interpreter", "number of four-bars", &[panel])
}
