//! `mbd-lab experiments breaking`: section 7.4, a chain of 100 links of which a joint breaks.

use std::fmt::Write as _;
use std::io::Write;
use std::time::Instant;

use multibody::runtime::integrate::{Dop853, Rk4, Step, Tolerances, Verner9};
use multibody::runtime::sweep::FrameState;
use multibody::runtime::wide::Wide;
use multibody::runtime::{Conjugate, Interpreter, Real, System};

use super::clock::least;
use super::tables::{head, row};
use super::{directory, figure, thesis};
use crate::args::experiments::BreakingArgs;
use crate::scenes::breaking::{Breaking, Part, State, BREAK, END, LENGTH, LINK, LINKS, STEP};
use mbd_cli::ink;
use mbd_cli::plot::Panel;
use mbd_cli::{note, write_file, Failure, Outcome};

/// Tolerances of the two runs with double-double numbers.
const TOLERANCES: [f64; 2] = [1e-11, 1e-13];
/// Moment of inertia that the thesis prints, kg m².
const PRINTED: f64 = 0.83e-7;
/// Time between two configurations of figure 7.16, s.
const SHOWN: f64 = 0.18;

fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::new(error.to_string(), "report this: the model is built in")
}

/// Runs the chain and writes tables and figures.
pub fn run(args: &BreakingArgs, out: &mut dyn Write) -> Outcome {
    directory(args.out.as_deref())?;
    writeln!(out, "## A chain of {LINKS} links breaks (thesis 7.4), the thesis's numbers in brackets\n")?;
    note(format_args!("plans"));
    let chain = Breaking::thesis().map_err(failed)?;
    motion(&chain, args, out)?;
    times(&chain, args, out)?;
    printed_inertia(out)?;
    if args.end > 0.0 {
        accuracy(&chain, args.end, out)?;
    }
    Ok(())
}

/// A moment of the run: time, both parts, power of the friction and the energy that it took.
struct Moment {
    t: f64,
    parts: [Part; 2],
    power: f64,
    friction: f64,
}

impl Moment {
    /// Energy and what the friction took, J.
    fn sum(&self) -> f64 {
        self.parts[0].total() + self.parts[1].total() + self.friction
    }
}

/// Integrates the power of the friction over equal steps, on both sides of the break at `at`, by cubics: of order 4, as
/// the run is.
fn integrate(moments: &mut [Moment], at: usize) {
    let mut sum = 0.0;
    for range in [0..at + 1, at + 1..moments.len()] {
        let f: Vec<f64> = moments[range.clone()].iter().map(|m| m.power).collect();
        moments[range.start].friction = sum;
        for k in 1..f.len() {
            let inner = match k {
                1 => 9.0 * f[0] + 19.0 * f[1] - 5.0 * f[2] + f[3],
                k if k + 1 == f.len() => 9.0 * f[k] + 19.0 * f[k - 1] - 5.0 * f[k - 2] + f[k - 3],
                k => 13.0 * (f[k] + f[k - 1]) - f[k - 2] - f[k + 1],
            };
            sum += STEP / 24.0 * inner;
            moments[range.start + k].friction = sum;
        }
    }
}

/// Runs the thesis's simulation: conservation through the break, figure 7.16.
fn motion(chain: &Breaking, args: &BreakingArgs, out: &mut dyn Write) -> Outcome {
    note(format_args!("motion"));
    let damping = chain.whole.model.joints[0].damping[0].constant().unwrap_or(0.0);
    let mut moments: Vec<Moment> = Vec::new();
    let mut shapes: Vec<Shape> = Vec::new();
    let seen = |after: bool, system: &mut Interpreter<f64>, state: &State<f64>| {
        let mut v = system.zero_momenta();
        system.velocities(&state.q, &state.p, &mut v);
        // After the break the first joint of the free chain is planar, without friction.
        let rates = v.iter().enumerate().filter(|(k, _)| !(after && chain.planar().contains(k)));
        let power = rates.map(|(_, v)| damping * v * v).sum();
        if state.t >= SHOWN * shapes.len() as f64 - 1e-9 {
            let links = chain.links(after, system, &state.q, &v);
            shapes.push(Shape::new(&links, chain.planar().start, after));
        }
        moments.push(Moment { t: state.t, parts: chain.parts(after, system, state), power, friction: 0.0 });
    };
    let (_, broken) = chain.doubles([BREAK, END], Step::Fixed(STEP), Rk4::new, seen).map_err(failed)?;
    let at = moments.windows(2).position(|m| m[0].t == m[1].t).unwrap_or(0);
    integrate(&mut moments, at);
    let (before, after) = (&moments[at], &moments[at + 1]);
    let last = &moments[moments.len() - 1];
    let mut text = head("Through the break at 1.8 s", &["quantity", "before", "after", "difference"]);
    let total = |m: &Moment, k: usize| m.parts[0].momentum[k] + m.parts[1].momentum[k];
    let energy = |m: &Moment, k: usize| m.parts[0].energy[k] + m.parts[1].energy[k];
    let quantities: [(&str, [f64; 2]); 6] = [
        ("kinetic energy, J", [energy(before, 0), energy(after, 0)]),
        ("potential energy, J", [energy(before, 1), energy(after, 1)]),
        ("momentum along x, kg m/s", [total(before, 0), total(after, 0)]),
        ("momentum along y, kg m/s", [total(before, 1), total(after, 1)]),
        ("angular momentum about the origin, kg m²/s", [total(before, 2), total(after, 2)]),
        ("spin of the free part, kg m²/s", [before.parts[1].spin(), after.parts[1].spin()]),
    ];
    for (name, [a, b]) in quantities {
        row(&mut text, &[name.into(), format!("{a:.12}"), format!("{b:.12}"), format!("{:.1e}", b - a)]);
    }
    if let Some(jump) = broken.and_then(|b| b.jump) {
        let (l, a) = (jump.linear, jump.angular);
        text += &format!("\nThe largest change of a body's velocity is {l:.1e} m/s and {a:.1e} rad/s.\n");
    }
    text += &free_flight(&after.parts[1], last);
    let stray = moments.iter().map(|m| (m.sum() - moments[0].sum()).abs()).fold(0.0, f64::max);
    text += &format!("Energy and what friction took stray by {stray:.1e} J of {:.3} J.\n\n", last.friction);
    write!(out, "{text}")?;
    let Some(folder) = &args.out else { return Ok(()) };
    let path = folder.join("figure_7_16.svg");
    write_file(&path, &picture(&shapes))?;
    writeln!(out, "figure: {}", path.display())?;
    let line = |name: &str, value: &dyn Fn(&Moment) -> f64| (name.to_string(), moments.iter().map(value).collect());
    let energies = Panel::new(
        "energy [J]",
        moments.iter().map(|m| m.t).collect(),
        vec![
            line("links 1 to 40", &|m| m.parts[0].total()),
            line("links 41 to 100", &|m| m.parts[1].total()),
            line("taken by friction", &|m| m.friction),
            line("sum", &Moment::sum),
        ],
    );
    let kinetic = Panel::new(
        "kinetic energy [J]",
        energies.t.clone(),
        vec![line("links 1 to 40", &|m| m.parts[0].energy[0]), line("links 41 to 100", &|m| m.parts[1].energy[0])],
    );
    figure(out, folder, "breaking_energy", "Energy of a breaking chain", "time [s]", &[energies, kinetic])
}

/// What is known of the free part from the break to the end.
fn free_flight(start: &Part, last: &Moment) -> String {
    let (end, time) = (&last.parts[1], last.t - BREAK);
    let fall = [0.0, -9.81];
    let momentum = [0, 1].map(|k| end.momentum[k] - start.momentum[k] - start.mass * fall[k] * time);
    let place = [0, 1].map(|k| {
        let flight = start.momentum[k] / start.mass * time + 0.5 * fall[k] * time * time;
        end.center[k] - start.center[k] - flight
    });
    let spin = end.spin() - start.spin();
    format!(
        "The free part then flies for {time:.1} s: its momentum is off that of a free fall by {:.1e} kg m/s, its centre \
         of mass by {:.1e} m, its spin changes by {spin:.1e} kg m²/s.\n",
        momentum[0].hypot(momentum[1]),
        place[0].hypot(place[1])
    )
}

/// Table 7.5.
fn times(chain: &Breaking, args: &BreakingArgs, out: &mut dyn Write) -> Outcome {
    note(format_args!("table 7.5"));
    let mut halves = [f64::INFINITY; 2];
    for _ in 0..if args.quick { 1 } else { 5 } {
        let (start, mut broken) = (Instant::now(), None);
        let seen = |after: bool, _: &mut Interpreter<f64>, _: &State<f64>| {
            if after {
                broken.get_or_insert_with(Instant::now);
            }
        };
        chain.doubles([BREAK, END], Step::Fixed(STEP), Rk4::new, seen).map_err(failed)?;
        let broken = broken.unwrap_or(start);
        halves[0] = halves[0].min((broken - start).as_secs_f64());
        halves[1] = halves[1].min(broken.elapsed().as_secs_f64());
    }
    let (mut old, mut new) = (chain.whole.default_interpreter::<f64>(), chain.broken.default_interpreter::<f64>());
    let start = State { t: 0.0, steps: 0, q: chain.whole.start(), p: old.zero_momenta() };
    let v = vec![0.1; start.p.len()];
    let mut transfer = chain.transfer().map_err(failed)?;
    let state = transfer.apply(&mut old, &start.q, &v, &mut new).map_err(failed)?;
    let mut p = old.zero_momenta();
    old.momenta(&start.q, &v, &mut p);
    let (mut a, mut b) =
        (rates_call(old.clone(), start.q.clone(), p), rates_call(new.clone(), state.q.clone(), state.p));
    let mut p = new.zero_momenta();
    let mut extraction = {
        let (mut new, q, v) = (new.clone(), state.q.clone(), state.v.clone());
        move || new.conjugate_momenta(&q, &v, &mut p)
    };
    let mut kinematics = {
        let (mut old, q, v) = (old.clone(), start.q.clone(), v.clone());
        move || drop(chain.carried(&mut old, &q, &v))
    };
    let mut whole = || drop(transfer.apply(&mut old, &start.q, &v, &mut new));
    let (rounds, round) = if args.quick { (3, 1e-3) } else { (25, 4e-3) };
    let least = least(&mut [&mut a, &mut b, &mut extraction, &mut kinematics, &mut whole], rounds, round);
    let calls = (4.0 * BREAK / STEP, 4.0 * (END - BREAK) / STEP);
    let average = (least[0] * calls.0 + least[1] * calls.1) / (calls.0 + calls.1);
    let [total, before, change] = thesis::BREAKING;
    let mut text = head("Table 7.5: processing times, s", &["part", "this simulation", "100000 calls"]);
    let mut put = |name: &str, all: f64, call: f64, theirs: Option<[f64; 2]>| {
        let beside = |x: f64, k: usize| match theirs {
            Some(theirs) => format!("{x:.3} ({:.2})", theirs[k]),
            None => format!("{x:.3}"),
        };
        row(&mut text, &[name.into(), beside(all, 0), beside(1e5 * call, 1)]);
    };
    put("total simulation", halves[0] + halves[1] + least[4], average, Some(total));
    put("till joint failure", halves[0], least[0], Some(before));
    put("after joint failure", halves[1], least[1], None);
    put("topology change: coordinates, velocities, momenta", least[3] + least[2], least[3] + least[2], Some(change));
    put("of that the momenta `p = M v`", least[2], least[2], None);
    put("topology change with all checks (`Transfer::apply`)", least[4], least[4], None);
    let ratio = least[2] / least[1];
    text += &format!(
        "\nThe momenta alone take {ratio:.2} of a call of the rates. The thesis's 0.04 s for 100000 changes would be {:.4}.\n\n",
        change[1] / before[1]
    );
    write!(out, "{text}")?;
    Ok(())
}

/// A function that makes one evaluation.
fn rates_call(mut system: Interpreter<f64>, q: Vec<f64>, p: Vec<f64>) -> impl FnMut() {
    let (mut v, mut qd, mut pd) = (system.zero_momenta(), system.neutral(), system.zero_momenta());
    move || system.rates(&q, &p, &mut v, &mut qd, &mut pd)
}

/// What happens with the moment of inertia that is printed.
fn printed_inertia(out: &mut dyn Write) -> Outcome {
    let damping = 1e-3;
    let chain = Breaking::with_inertia(LINKS, LINK, damping, PRINTED).map_err(failed)?;
    let run = chain.doubles([BREAK, END], Step::Fixed(STEP), Rk4::new, |_, _, _| ());
    let happens = match run {
        Ok(_) => "runs to the end".to_string(),
        Err(error) => format!("fails ({error})"),
    };
    writeln!(
        out,
        "With the printed inertia of 0.83 g cm², in place of that of a uniform link, 20.8 g cm², the thesis's simulation \
         {happens}.\n"
    )?;
    Ok(())
}

/// The motion to a later time, against double-double numbers.
fn accuracy(chain: &Breaking, end: f64, out: &mut dyn Write) -> Outcome {
    let times = [BREAK.min(end), end];
    let step = |tolerance: f64| Step::Adaptive(Tolerances::new(tolerance));
    let (doubles, _) = chain.doubles(times, step(1e-10), Dop853::new, |_, _, _| ()).map_err(failed)?;
    let (classical, _) = chain.doubles(times, Step::Fixed(STEP), Rk4::new, |_, _, _| ()).map_err(failed)?;
    note(format_args!("double-double numbers to {end} s, tolerance 1e-11 ({} steps with doubles)", doubles.steps));
    let coarser = chain.precise::<Wide, _>(times, step(TOLERANCES[0]), Dop853::new).map_err(failed)?;
    note(format_args!("double-double numbers to {end} s, tolerance 1e-13"));
    let start = Instant::now();
    let reference = chain.precise::<Wide, _>(times, step(TOLERANCES[1]), Verner9::new).map_err(failed)?;
    let (steps, took) = (reference.steps, start.elapsed().as_secs_f64());
    let title = format!(
        "Joints at {end} s against double-double numbers (verner9, tolerance 1e-13, {steps} steps, {took:.0} s)"
    );
    let mut text = head(&title, &["run", "steps", "farthest joint off by, m"]);
    let nearest: Vec<f64> = coarser.q.iter().map(|x| x.to_f64()).collect();
    for (name, steps, q) in [
        ("double-double numbers, dop853, tolerance 1e-11", coarser.steps, &nearest),
        ("doubles, dop853, tolerance 1e-10", doubles.steps, &doubles.q),
        ("doubles, classical, 1 ms", classical.steps, &classical.q),
    ] {
        row(&mut text, &[name.into(), steps.to_string(), format!("{:.1e}", chain.apart(q, &reference.q))]);
    }
    writeln!(out, "{text}")?;
    Ok(())
}

/// Joints and tips of the parts at a moment, m.
struct Shape {
    lines: Vec<Vec<[f64; 2]>>,
}

impl Shape {
    /// The shape of links of which the one at `at` begins the second part.
    fn new(links: &[FrameState<f64>], at: usize, apart: bool) -> Shape {
        let line = |links: &[FrameState<f64>]| {
            let joints = links.iter().map(|link| [link.position[0], link.position[1]]);
            let tip = links.last().map(|link| {
                let [along, up] = [link.rotation[0][0], link.rotation[1][0]];
                [link.position[0] + LENGTH * along, link.position[1] + LENGTH * up]
            });
            joints.chain(tip).collect::<Vec<_>>()
        };
        Shape { lines: if apart { vec![line(&links[..at]), line(&links[at..])] } else { vec![line(links)] } }
    }
}

/// Shapes over each other, to scale, as SVG text: later ones darker, the free part in another colour.
fn picture(shapes: &[Shape]) -> String {
    const SCALE: f64 = 60.0;
    const EDGE: f64 = 20.0;
    let points = shapes.iter().flat_map(|s| s.lines.iter().flatten());
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for point in points {
        for k in 0..2 {
            low[k] = low[k].min(point[k]);
            high[k] = high[k].max(point[k]);
        }
    }
    let place = |[x, y]: [f64; 2]| [EDGE + SCALE * (x - low[0]), EDGE + SCALE * (high[1] - y)];
    let [width, height] = place([high[0], low[1]]).map(|x| x + EDGE);
    let mut text = ink::head([width, height], "The chain at equal times; the free part has another colour");
    for (k, shape) in shapes.iter().enumerate() {
        let opacity = 0.3 + 0.7 * (k + 1) as f64 / shapes.len() as f64;
        for (line, class) in shape.lines.iter().zip(["c0", "c5"]) {
            let points: Vec<String> = line.iter().map(|p| place(*p)).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(
                text,
                "<polyline points=\"{}\" class=\"curve {class}\" stroke-opacity=\"{opacity:.2}\"/>",
                points.join(" ")
            );
        }
    }
    text + "</svg>\n"
}
