//! Times a motion with contacts within this process, at several tolerances, and prints where it ends.
//!
//! usage: contacts-ours MODEL TIME ROUNDS TOLERANCE...
//!
//! A line of JSON says the mass, kg, and the kinetic and potential energy at the start, J. A line for each tolerance follows:
//! the least time of all rounds, s, the evaluations of the rates, the times of the events, s, and the origins and centres of
//! mass of all bodies in ground axes, m. The first round is not timed.
//! Machine code is made for what is asked for a few times in a set of modes, as generated code would be before the run, so
//! that tolerances which come twice are timed with machine code the second time.

use std::time::Instant;

use multibody::codegen::jit::Compiled;
use multibody::codegen::model::Model;
use multibody::codegen::plan::Plan;
use multibody::codegen::Options;
use multibody::runtime::catalogue;
use multibody::runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::contact::{ContactEvent, ContactObserver, Hybrid, ModeTable, WithContacts};
use multibody::runtime::integrate::{Step, Tolerances};
use multibody::runtime::sweep::FrameState;
use multibody::runtime::{Conjugate, Interpreter};

/// Calls in a set of modes after which machine code is made.
const CALLS: u32 = 10;

type Mechanism = ModeTable<Compiled>;
type Failed = Box<dyn std::error::Error>;

#[derive(Default)]
struct Times(Vec<f64>);

impl ContactObserver<Mechanism> for Times {
    fn event(&mut self, _system: &mut WithContacts<Mechanism>, event: &ContactEvent<f64>) {
        self.0.push(event.time);
    }
}

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, time, rounds, tolerances @ ..] = &arguments[..] else {
        return Err("usage: contacts-ours MODEL TIME ROUNDS TOLERANCE...".into());
    };
    let (time, rounds): (f64, usize) = (time.parse()?, rounds.parse()?);
    let model = Model::load(path)?;
    let plan = Plan::new(&model, 1e-9);
    let (q, v) = (plan.start(), plan.start_velocity().unwrap_or_else(|| vec![0.0; plan.dims.nv]));
    let mut mechanism = plan.compiled_with_contacts(&Options::default(), CALLS)?;
    let mut p = v.clone();
    mechanism.conjugate_momenta(&q, &v, &mut p);
    println!("{:?}", start(&plan, &q, &v));
    let mut system = WithContacts::new(mechanism);
    for tolerance in tolerances {
        let tolerance: f64 = tolerance.parse()?;
        let mut least = f64::INFINITY;
        let mut last = None;
        for round in 0..=rounds {
            let clock = Instant::now();
            let method = catalogue::explicit("verner9", &system, false).ok_or("no method of this name")?;
            let effort = Effort { energy: f64::INFINITY, ..Effort::default() };
            let method = WithPostStep::new(&system, method, Projection::new(&system, Stabilisation::Mass, effort));
            let step = Step::Adaptive(Tolerances::new(tolerance));
            let mut motion = Hybrid::new(&mut system, method, step, 0.0, &q, &p)?;
            let mut times = Times::default();
            motion.run(&mut system, time, &mut times)?;
            let seconds = clock.elapsed().as_secs_f64();
            if round > 0 {
                least = least.min(seconds);
            }
            let (mut q, mut p) = (q.clone(), p.clone());
            motion.state(&system, &mut q, &mut p);
            last = Some((q, times.0, motion.statistics().evaluations));
        }
        let (q, times, evaluations) = last.ok_or("no rounds")?;
        println!(
            "{{\"tolerance\": {tolerance:e}, \"seconds\": {least:e}, \"evaluations\": {evaluations}, \
             \"events\": {times:?}, \"places\": {:?}}}",
            places(&plan, &q)
        );
    }
    Ok(())
}

/// Mass, kinetic and potential energy.
fn start(plan: &Plan, q: &[f64], v: &[f64]) -> [f64; 3] {
    let mut interpreter: Interpreter<f64> = plan.default_interpreter();
    let mut p = v.to_vec();
    interpreter.momenta(q, v, &mut p);
    let (kinetic, potential) = interpreter.energy(q, &p);
    [plan.model.bodies.iter().filter_map(|body| body.mass.constant()).sum(), kinetic, potential]
}

/// Origins and centres of mass of all bodies, in ground axes, m.
fn places(plan: &Plan, q: &[f64]) -> Vec<[f64; 3]> {
    let mut interpreter: Interpreter<f64> = plan.default_interpreter();
    let mut frames = vec![FrameState::ground(); plan.frames.len()];
    interpreter.frames(q, &vec![0.0; plan.dims.nv], &mut frames);
    let params = plan.default_params();
    let mut places = Vec::new();
    for body in &plan.model.bodies {
        let Some(at) = plan.frames.iter().position(|f| f.name == body.name) else { continue };
        let frame = &frames[at];
        let com = body.com.map(|x| x.constant().unwrap_or_else(|| params.first().copied().unwrap_or_default()));
        places.push(frame.position);
        places.push(std::array::from_fn(|i| {
            frame.position[i] + (0..3).map(|k| frame.rotation[i][k] * com[k]).sum::<f64>()
        }));
    }
    places
}
