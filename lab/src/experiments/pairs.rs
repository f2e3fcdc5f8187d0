//! `mbd-lab experiments pairs`: what contacts cost by the number of pairs and of corners, and how well their times are found.

use std::fmt::Write as _;
use std::io::Write;
use std::time::Instant;

use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, ImportOptions};
use multibody::runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::contact::{ContactEvent, ContactInterpreter, ContactObserver, Hybrid, WithContacts};
use multibody::runtime::integrate::{Dop853, Solver, Step, Tolerances};
use multibody::runtime::{Conjugate as _, Energetic as _};

use super::tables::{head, row};
use crate::args::experiments::PairsArgs;
use mbd_cli::{Failure, Outcome};

type Mechanism = ContactInterpreter<f64>;

/// Radius of the balls, m.
const RADIUS: f64 = 0.05;
/// Tolerance of the motions whose time is measured.
const TOLERANCE: f64 = 1e-8;

/// Prints the tables.
pub fn run(args: &PairsArgs, out: &mut dyn Write) -> Outcome {
    writeln!(out, "{}", pairs(args)?)?;
    writeln!(out, "{}", instants()?)?;
    writeln!(out, "{}", corners(args)?)?;
    Ok(())
}

fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::new(error.to_string(), "report this: the model is built in")
}

/// Where the balls of a scene are.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// 5 m apart and 100 m above the floor.
    Far,
    /// So, but the first one lies on the floor.
    OneLies,
    /// Beside each other, a few decimetres above the floor.
    Near,
}

/// A floor and balls, all of which can touch each other and the floor; or without anything to touch.
fn balls(count: usize, touch: bool, gravity: f64) -> Result<Plan, Failure> {
    let mut text = format!("gravity = [0, 0, {gravity}]\n");
    if touch {
        text += "contacts = { pairs = \"all\", restitution = 0.8 }\n[[shape]]\nname = \"floor\"\ntype = \"plane\"\n";
    }
    for k in 0..count {
        let _ = write!(
            text,
            "[[body]]\nname = \"ball{k}\"\nmass = 1\ninertia = [0.001, 0.0011, 0.0012]\n\
             [[joint]]\nname = \"ball{k}\"\ntype = \"floating\"\nchild = \"ball{k}\"\n"
        );
        if touch {
            let _ =
                writeln!(text, "[[shape]]\nname = \"s{k}\"\nbody = \"ball{k}\"\ntype = \"sphere\"\nradius = {RADIUS}");
        }
    }
    plan(&text)
}

fn plan(text: &str) -> Result<Plan, Failure> {
    let model = read::model("balls.toml", text, &ImportOptions::default()).map_err(failed)?.model;
    Ok(Plan::new(&model, 1e-9))
}

/// Places and velocities of the balls, which spin.
fn start(count: usize, place: Place) -> (Vec<f64>, Vec<f64>) {
    let side = (count as f64).sqrt().ceil() as usize;
    let (mut q, mut v) = (Vec::new(), Vec::new());
    for k in 0..count {
        let [x, y] = [k % side, k / side].map(|x| x as f64);
        let (apart, height) = if place == Place::Near { (2.5 * RADIUS, 0.3) } else { (5.0, 100.0) };
        let lies = place == Place::OneLies && k == 0;
        let z = if lies { RADIUS } else { height + 0.37 * RADIUS * (k % 11) as f64 };
        q.extend([apart * x, apart * y, z, 0.0, 0.0, 0.0, 1.0]);
        let spin = if lies { 0.0 } else { 1.0 };
        v.extend([0.0, 0.0, 0.0, spin, 0.5 * spin, 0.3 * spin * (k % 5) as f64]);
    }
    (q, v)
}

/// What a motion took.
#[derive(Clone, Copy)]
struct Cost {
    steps: u64,
    evaluations: u64,
    events: u64,
    seconds: f64,
}

impl Cost {
    /// The fastest of some runs of the same motion.
    fn least(args: &PairsArgs, run: impl Fn() -> Result<Cost, Failure>) -> Result<Cost, Failure> {
        let mut best = run()?;
        let clock = Instant::now();
        while !args.quick && clock.elapsed().as_secs_f64() < 1.0 {
            let next = run()?;
            if next.seconds < best.seconds {
                best = next;
            }
        }
        Ok(best)
    }

    /// Time of a step, µs.
    fn step(&self) -> String {
        format!("{:.1}", 1e6 * self.seconds / self.steps as f64)
    }
}

#[derive(Default)]
struct Events(Vec<ContactEvent<f64>>);

impl ContactObserver<Mechanism> for Events {
    fn event(&mut self, _: &mut WithContacts<Mechanism>, event: &ContactEvent<f64>) {
        self.0.push(*event);
    }
}

/// A motion with contacts to time `end`, s; with the energy that it gains beside that of impacts, J.
fn follow(
    plan: &Plan,
    (q, v): &(Vec<f64>, Vec<f64>),
    end: f64,
    tolerance: f64,
) -> Result<(Cost, Events, f64), Failure> {
    let mut mechanism: Mechanism = plan.default_contact_interpreter();
    let mut p = v.clone();
    mechanism.conjugate_momenta(q, v, &mut p);
    let mut system = WithContacts::new(mechanism);
    let energy = |system: &mut WithContacts<Mechanism>, q: &Vec<f64>, p: &Vec<f64>| {
        let (kinetic, potential) = system.energies(q, p);
        kinetic + potential
    };
    let before = energy(&mut system, q, &p);
    let effort = Effort { energy: f64::INFINITY, ..Effort::default() };
    let projection = Projection::new(&system, Stabilisation::Mass, effort);
    let method = WithPostStep::new(&system, Dop853::new(&system), projection);
    let step = Step::Adaptive(Tolerances::new(tolerance));
    let mut motion = Hybrid::new(&mut system, method, step, 0.0, q, &p).map_err(failed)?;
    let (mut events, clock) = (Events::default(), Instant::now());
    motion.run(&mut system, end, &mut events).map_err(failed)?;
    let seconds = clock.elapsed().as_secs_f64();
    let of = motion.statistics();
    let cost =
        Cost { steps: of.steps + of.rejections, evaluations: of.evaluations, events: events.0.len() as u64, seconds };
    let mut q = q.clone();
    motion.state(&system, &mut q, &mut p);
    let impacts: f64 = events.0.iter().filter_map(|event| Some(event.impact?.energy)).sum();
    Ok((cost, events, energy(&mut system, &q, &p) - before - impacts))
}

/// The same without contacts.
fn free(plan: &Plan, (q, v): &(Vec<f64>, Vec<f64>), end: f64) -> Result<Cost, Failure> {
    let mut system = plan.default_interpreter::<f64>();
    let mut p = v.clone();
    system.conjugate_momenta(q, v, &mut p);
    let method = Dop853::new(&system);
    let step = Step::Adaptive(Tolerances::new(TOLERANCE));
    let mut solver = Solver::new(&mut system, method, step, 0.0, q, &p).map_err(failed)?;
    let clock = Instant::now();
    solver.run(&mut system, end).map_err(failed)?;
    let of = solver.statistics();
    let seconds = clock.elapsed().as_secs_f64();
    Ok(Cost { steps: of.steps + of.rejections, evaluations: of.evaluations, events: 0, seconds })
}

/// Time over the number of pairs.
fn pairs(args: &PairsArgs) -> Result<String, Failure> {
    let columns = [
        "balls",
        "contacts",
        "ms to make",
        "without contacts: steps",
        "µs a step",
        "all far: steps",
        "evaluations a step",
        "µs a step",
        "one lies on the floor: steps",
        "µs a step",
        "all bounce: events in 1 s",
        "steps",
        "µs a step",
    ];
    let mut text = head(&format!("Balls that fall for 1 s, Dop853, tolerance {TOLERANCE:.0e}, interpreted"), &columns);
    for &count in &args.balls {
        let (bare, touching) = (balls(count, false, -9.81)?, balls(count, true, -9.81)?);
        let clock = Instant::now();
        drop(touching.default_contact_interpreter::<f64>());
        let made = 1e3 * clock.elapsed().as_secs_f64();
        let contacts = touching.model.contacts.len();
        let alone = Cost::least(args, || free(&bare, &start(count, Place::Far), 1.0))?;
        let cost = |place| Cost::least(args, || Ok(follow(&touching, &start(count, place), 1.0, TOLERANCE)?.0));
        let (far, lies, near) = (cost(Place::Far)?, cost(Place::OneLies)?, cost(Place::Near)?);
        let cells = [
            count.to_string(),
            contacts.to_string(),
            format!("{made:.1}"),
            alone.steps.to_string(),
            alone.step(),
            far.steps.to_string(),
            format!("{:.1}", far.evaluations as f64 / far.steps as f64),
            far.step(),
            lies.steps.to_string(),
            lies.step(),
            near.events.to_string(),
            near.steps.to_string(),
            near.step(),
        ];
        row(&mut text, &cells);
    }
    Ok(text)
}

/// Instants of impacts against closed forms: a ball that passes another one at 1000 m/s, and one that bounces.
fn instants() -> Result<String, Failure> {
    let (speed, way) = (1000.0_f64, 10.0_f64);
    let columns = ["offset over the sum of radii", "steps", "events", "error of the instant, s"];
    let title = format!("A ball of radius {RADIUS} m flies past another one at {speed} m/s, from {way} m away");
    let mut text = head(&title, &columns);
    let plan = balls(2, true, 0.0)?;
    for share in [0.0, 0.5, 0.9, 0.999, 0.999_999, 1.000_001, 1.1_f64] {
        let (mut q, mut v) = start(2, Place::Far);
        let sum = 2.0 * RADIUS;
        q[7] = q[0] - way;
        q[8] = q[1] + share * sum;
        q[9] = q[2];
        v.fill(0.0);
        v[6] = speed;
        let (cost, events, _) = follow(&plan, &(q, v), 1.5 * way / speed, 1e-9)?;
        let exact = (share < 1.0).then(|| (way - sum * (1.0 - share * share).sqrt()) / speed);
        let error = match (exact, events.0.first()) {
            (Some(exact), Some(event)) => format!("{:.1e}", (event.time - exact).abs()),
            (None, None) => "passes".into(),
            _ => "wrong".into(),
        };
        row(&mut text, &[share.to_string(), cost.steps.to_string(), cost.events.to_string(), error]);
    }
    text += "\n";
    text += &head(
        "A ball is dropped from 1 m and bounces, restitution 0.8",
        &["tolerance", "steps", "bounces", "largest error of an instant, s", "energy strays by, J"],
    );
    let plan = balls(1, true, -9.81)?;
    for tolerance in [1e-6, 1e-9, 1e-12] {
        let (mut q, v) = start(1, Place::Far);
        q[2] = 1.0 + RADIUS;
        let (cost, events, gained) = follow(&plan, &(q, v), 3.0, tolerance)?;
        let mut speed = (2.0 * 9.81_f64).sqrt();
        let (mut exact, mut error) = (speed / 9.81, 0.0_f64);
        for event in &events.0 {
            error = error.max((event.time - exact).abs());
            speed *= 0.8;
            exact += 2.0 * speed / 9.81;
        }
        let cells = [
            format!("{tolerance:.0e}"),
            cost.steps.to_string(),
            cost.events.to_string(),
            format!("{error:.1e}"),
            format!("{:.1e}", gained.abs()),
        ];
        row(&mut text, &cells);
    }
    Ok(text)
}

/// Time over the number of corners of a hull.
fn corners(args: &PairsArgs) -> Result<String, Failure> {
    let columns = ["corners", "deepest, mm", "far: steps", "µs a step", "thrown, 1 s: events", "steps", "µs a step"];
    let mut text = head("A hull of 2000 points of an ellipsoid, 0.2 m, 0.15 m and 0.1 m", &columns);
    let point = |k: u32| {
        let (z, angle) = (1.0 - 2.0 * (f64::from(k) + 0.5) / 2000.0, 2.399_963_229_728_653 * f64::from(k));
        let r = (1.0 - z * z).sqrt();
        [0.2 * r * angle.cos(), 0.15 * r * angle.sin(), 0.1 * z]
    };
    let points: Vec<[f64; 3]> = (0..2000).map(point).collect();
    for &most in &args.corners {
        let model = format!(
            "contacts = {{ pairs = \"all\", friction = 0.5, restitution = 0.3 }}\n\
             [[body]]\nname = \"b\"\nmass = 1\ninertia = [0.0065, 0.01, 0.0125]\n\
             [[joint]]\nname = \"b\"\ntype = \"floating\"\nchild = \"b\"\n\
             [[shape]]\nname = \"floor\"\ntype = \"plane\"\n\
             [[shape]]\nname = \"h\"\nbody = \"b\"\ntype = \"hull\"\nmost = {most}\npoints = {points:?}\n"
        );
        let reading = read::model("hull.toml", &model, &ImportOptions::default()).map_err(failed)?;
        let told = reading.findings.to_string();
        let depth = told.split("up to ").nth(1).and_then(|rest| rest.split(" mm").next()).unwrap_or("0").to_string();
        let plan = Plan::new(&reading.model, 1e-9);
        let state =
            |height: f64| (vec![0.0, 0.0, height, 0.1, 0.2, 0.3, 0.860_f64.sqrt()], vec![0.5, 0.2, 0.0, 2.0, 1.0, 0.5]);
        let cost = |height| Cost::least(args, || Ok(follow(&plan, &state(height), 1.0, TOLERANCE)?.0));
        let (far, thrown) = (cost(100.0)?, cost(0.5)?);
        let cells = [
            plan.model.contacts.len().to_string(),
            depth,
            far.steps.to_string(),
            far.step(),
            thrown.events.to_string(),
            thrown.steps.to_string(),
            thrown.step(),
        ];
        row(&mut text, &cells);
    }
    Ok(text)
}
