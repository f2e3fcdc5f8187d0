//! The tour that `mbd` shows without arguments, on a robot that is part of the program.

use std::hint::black_box;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, ImportOptions};
use multibody::codegen::search;
use multibody::codegen::{Options, Output};
use multibody::runtime::constrained::Stabilisation;
use multibody::runtime::contact::{ImpactOrder, RegimeRules};
use multibody::runtime::integrate::{Rk4, Step, Stepper};
use multibody::runtime::Interpreter;

use super::motion::{simulate, Record, Settings};
use super::output::{note, write_file};
use super::simulate::{panels, title};
use super::start::default_start;
use super::{count, plot, Failure, Outcome};

#[path = "../tour/mod.rs"]
#[rustfmt::skip]
mod robot;
use robot::ur5::Ur5;
use robot::ur5_fast::Ur5Fast;

const FILE: &str = "models/ur5.urdf";
const TEXT: &str = include_str!("../tour/ur5.urdf");
const PLOT: &str = "mbd-tour.svg";
const STATES: usize = 1000;
const TIME: f64 = 10.0;
const STEPS: u64 = 10_000;

type Array = [f64; Ur5::NV];

/// A state and its inputs.
struct State {
    q: Array,
    v: Array,
    p: Array,
    tau: Array,
}

/// The tour.
pub fn run(out: &mut dyn Write) -> Outcome {
    let plan = plan()?;
    let mass: f64 = plan.model.bodies.iter().filter_map(|b| b.mass.constant()).sum();
    writeln!(out, "1. A real robot: Universal Robots UR5, from {FILE} (a copy is in this program)")?;
    writeln!(
        out,
        "   {} links, {:.1} kg, on {} moving joints: {}\n",
        plan.model.bodies.len(),
        mass,
        plan.slots.len(),
        plan.coordinate_names().join(", ")
    )?;
    counts(&plan, out)?;
    let params = plan.default_params();
    let mut interpreter = plan.interpreter(&params);
    let mut generated = Ur5::new();
    let states = states();
    let numbers = compare(&states, &mut generated, &mut interpreter)?;
    writeln!(out, "\n3. The generated code (cli/tour/ur5.rs, exact arithmetic, compiled in) against the interpreter, which runs the same sweeps on numbers:")?;
    writeln!(out, "   {numbers} results on {STATES} random states, equal bit for bit\n")?;
    out.flush()?;
    let record = ten_seconds(&plan, &mut generated, out)?;
    out.flush()?;
    speed(&states, &mut generated, &mut interpreter, out)?;
    let picture = plot::svg(&title(&plan, &settings()), &panels(&plan, &record));
    write_file(Path::new(PLOT), &picture)?;
    writeln!(out, "\n6. Joint angles and energy over time: {PLOT}, in the current directory")?;
    writeln!(out, "\nNext: `mbd --help`, `mbd check YOUR_ROBOT.urdf`, `mbd generate YOUR_ROBOT.urdf --outputs rates`")?;
    Ok(())
}

fn plan() -> Outcome<Plan> {
    let read = read::model(FILE, TEXT, &ImportOptions::default()).map_err(|findings| {
        note(format_args!("{findings}"));
        Failure::Shown
    })?;
    Ok(search::plan(&read.model, PlanOptions::default()))
}

fn counts(plan: &Plan, out: &mut dyn Write) -> Outcome {
    use Output::{Accelerations, Energy, MassMatrix, Momenta, Rates, Velocities};
    let outputs = vec![Rates, Velocities, Momenta, Energy, Accelerations, MassMatrix];
    let options = Options { outputs, ..Options::default() };
    let counts = count::all(plan, &options)?;
    writeln!(out, "2. What it costs to compute (`mbd count {FILE}` says more):\n")?;
    count::table(&counts, &[Rates], out)?;
    count::rivals(plan, &counts, out)
}

/// Pseudo-random numbers in (−1, 1), the same on every machine.
fn random(seed: &mut u64) -> f64 {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn states() -> Vec<State> {
    let mut seed = 0x2005_0718_1234_5678;
    let mut array = |size: f64| -> Array { std::array::from_fn(|_| size * random(&mut seed)) };
    (0..STATES).map(|_| State { q: array(3.0), v: array(2.0), p: array(2.0), tau: array(50.0) }).collect()
}

/// Number of results that agree; the first one that differs is an error.
fn compare(states: &[State], generated: &mut Ur5, interpreter: &mut Interpreter<f64>) -> Outcome<usize> {
    let mut numbers = 0;
    let mut same = |state: usize, what: &str, a: &[f64], b: &[f64]| -> Outcome {
        // The signs of zeros may differ; adding zero makes them equal.
        let equal = a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a + 0.0).to_bits() == (b + 0.0).to_bits());
        numbers += a.len();
        match equal && a.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(Failure::new(
                format!("state {state}: `{what}` of generated code and interpreter differ: {a:?} and {b:?}"),
                "cli/tour/ur5.rs is stale: run `mbd check --generated cli/tour --update` in the sources and build anew",
            )),
        }
    };
    for (k, s) in states.iter().enumerate() {
        let zero: Array = [0.0; Ur5::NV];
        generated.tau = s.tau;
        interpreter.tau.copy_from_slice(&s.tau);
        let (mut a, mut b, mut c, mut d, mut v) = (zero, zero, zero, zero, zero);
        Ur5::rates(generated, &s.q, &s.p, &mut a, &mut b);
        interpreter.rates(&s.q, &s.p, &mut v, &mut c, &mut d);
        same(k, "rates", &[a, b].concat(), &[c, d].concat())?;
        generated.velocities(&s.q, &s.p, &mut a);
        same(k, "velocities", &a, &v)?;
        generated.momenta(&s.q, &s.v, &mut a);
        interpreter.momenta(&s.q, &s.v, &mut b);
        same(k, "momenta", &a, &b)?;
        generated.accelerations(&s.q, &s.v, &mut a);
        interpreter.accelerations(&s.q, &s.v, &mut b);
        same(k, "accelerations", &a, &b)?;
        let (kinetic, potential) = interpreter.energy(&s.q, &s.p);
        same(k, "energy", &generated.energy(&s.q, &s.p), &[kinetic, potential])?;
        let (mut m, mut n) = ([zero; Ur5::NV], [0.0; Ur5::NV * Ur5::NV]);
        generated.mass_matrix(&s.q, &mut m);
        interpreter.mass_matrix(&s.q, &mut n);
        same(k, "mass_matrix", &m.concat(), &n)?;
    }
    generated.tau = [0.0; Ur5::NV];
    interpreter.tau.fill(0.0);
    Ok(numbers)
}

/// The interpreter's simulation of the same motion as the generated code's.
fn settings() -> Settings<'static> {
    let step = Step::Fixed(TIME / STEPS as f64);
    Settings {
        method: "rk4",
        step,
        time: TIME,
        every: TIME / 1000.0,
        project: false,
        hold: Stabilisation::default(),
        interpreted: true,
        regimes: RegimeRules::default(),
        impacts: ImpactOrder::default(),
        control: None,
    }
}

/// Simulates with the generated code and with the interpreter.
fn ten_seconds(plan: &Plan, generated: &mut Ur5, out: &mut dyn Write) -> Outcome<Record> {
    let failed = |e| Failure::new(format!("the simulation failed: {e}"), "report this as a bug");
    let start = default_start(plan);
    let velocity = [0.1; Ur5::NV];
    let mut q: Array = std::array::from_fn(|k| start[k]);
    let mut p = [0.0; Ur5::NV];
    generated.momenta(&q, &velocity, &mut p);
    let h = TIME / STEPS as f64;
    let mut rk4 = Rk4::new(generated);
    let clock = Instant::now();
    for k in 0..STEPS {
        rk4.step(generated, k as f64 * h, h, &mut q, &mut p).map_err(failed)?;
    }
    let ours = clock.elapsed().as_secs_f64();
    let record = simulate(plan, (start, velocity.to_vec()), &settings())?;
    let same = record.q.last().is_some_and(|end| end[..] == q) && record.p.last().is_some_and(|end| end[..] == p);
    if !same {
        return Err(Failure::new("the two simulations end in different states", "report this as a bug"));
    }
    writeln!(out, "4. Ten seconds of falling freely, {STEPS} Runge-Kutta steps of {h} s:")?;
    writeln!(out, "   generated code: {:.1} ms, {:.0} times faster than time itself", ours * 1e3, TIME / ours)?;
    writeln!(out, "   the interpreter ends in the same state, bit for bit")?;
    writeln!(
        out,
        "   energy error: at most {:.1e} of the largest kinetic energy, {:.1} J\n",
        record.ends.worst(),
        record.ends.scale
    )?;
    Ok(record)
}

/// Evaluations per second.
fn speed(states: &[State], generated: &mut Ur5, interpreter: &mut Interpreter<f64>, out: &mut dyn Write) -> Outcome {
    let zero: Array = [0.0; Ur5::NV];
    let (mut qd, mut pd, mut v) = (zero, zero, zero);
    let timed = |rounds: u32, f: &mut dyn FnMut(&State)| -> f64 {
        let clock = Instant::now();
        for _ in 0..rounds {
            states.iter().for_each(&mut *f);
        }
        f64::from(rounds) * states.len() as f64 / clock.elapsed().as_secs_f64()
    };
    let other = Ur5Fast::new();
    let (mut a, mut b) = (zero, zero);
    for s in states {
        generated.rates(&s.q, &s.p, &mut qd, &mut pd);
        other.rates(&s.q, &s.p, &mut a, &mut b);
        let size = qd.iter().chain(&pd).fold(1.0_f64, |m, x| m.max(x.abs()));
        let off = qd.iter().zip(&a).chain(pd.iter().zip(&b)).fold(0.0_f64, |m, (x, y)| m.max((x - y).abs()));
        // Some hundred roundings times the condition number of the mass matrix (below 1e3 for this arm).
        if off.is_nan() || off > 1e-11 * size {
            return Err(Failure::new(
                format!("fast and exact arithmetic differ by {off:e} where rates are {size:e}"),
                "cli/tour/ur5_fast.rs is stale: run `mbd check --generated cli/tour --update` in the sources and build anew",
            ));
        }
    }
    let fast = timed(300, &mut |s| {
        other.rates(black_box(&s.q), black_box(&s.p), &mut a, &mut b);
        black_box((&a, &b));
    });
    let exact = timed(300, &mut |s| {
        generated.rates(black_box(&s.q), black_box(&s.p), &mut qd, &mut pd);
        black_box((&qd, &pd));
    });
    let slow = timed(30, &mut |s| {
        interpreter.rates(black_box(&s.q), black_box(&s.p), &mut v, &mut qd, &mut pd);
        black_box((&qd, &pd));
    });
    writeln!(out, "5. Evaluations of (q, p) -> (q', p') in a second, one after the other, on one core:")?;
    writeln!(
        out,
        "   generated code {} with fast arithmetic (the default), {} with exact; interpreter {}: {:.0} times fewer",
        millions(fast),
        millions(exact),
        millions(slow),
        fast / slow
    )?;
    if cfg!(debug_assertions) {
        writeln!(out, "   (this is a debug build: build with --release before you believe these)")?;
    }
    Ok(())
}

fn millions(x: f64) -> String {
    format!("{:.2} million", x / 1e6)
}
