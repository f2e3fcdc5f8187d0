//! Times a motion with contacts within this process, by events at several tolerances and by time steps of several lengths, and
//! prints where it ends.
//!
//! usage: contacts-ours MODEL TIME ROUNDS (TOLERANCE | steps:LENGTH)...
//!
//! A line of JSON says the mass, kg, and the kinetic and potential energy at the start, J. A line for each tolerance or length, s,
//! follows: the least time of all rounds, s, the times of the events, s, and the origins and centres of mass of all bodies in
//! ground axes, m. The first round is not timed. Time steps that do not find their impulses have no line.
//! Machine code is made for what is asked for a few times in a set of modes, as generated code would be before the run, so
//! that tolerances which come twice are timed with machine code the second time.

use std::time::Instant;

use multibody::codegen::jit::Compiled;
use multibody::codegen::model::Model;
use multibody::codegen::plan::Plan;
use multibody::codegen::Options;
use multibody::runtime::catalogue;
use multibody::runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::contact::{
    ContactEvent, ContactObserver, Hybrid, HybridError, ModeTable, TimeStepping, WithContacts,
};
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
    let [path, time, rounds, ways @ ..] = &arguments[..] else {
        return Err("usage: contacts-ours MODEL TIME ROUNDS (TOLERANCE | steps:LENGTH)...".into());
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
    for way in ways {
        let mut least = f64::INFINITY;
        let (mut end, mut times) = (q.clone(), Vec::new());
        let mut done = true;
        for round in 0..=rounds {
            let clock = Instant::now();
            let mut state = (q.clone(), p.clone());
            match way.strip_prefix("steps:") {
                Some(length) => done &= by_time_steps(&mut system, time, length.parse()?, &mut state).is_ok(),
                None => times = by_events(&mut system, time, way.parse()?, &mut state)?,
            }
            if round > 0 {
                least = least.min(clock.elapsed().as_secs_f64());
            }
            end = state.0;
        }
        if done {
            println!("{{\"way\": {way:?}, \"seconds\": {least:e}, \"events\": {times:?}, \"places\": {:?}}}", places(&plan, &end));
        }
    }
    Ok(())
}

type State = (Vec<f64>, Vec<f64>);

/// Moves a state from event to event for so many seconds, to a tolerance. Returns the times of the events, s.
fn by_events(
    system: &mut WithContacts<Mechanism>,
    time: f64,
    tolerance: f64,
    (q, p): &mut State,
) -> Result<Vec<f64>, Failed> {
    let method = catalogue::explicit("verner9", system, false).ok_or("no method of this name")?;
    let effort = Effort { energy: f64::INFINITY, ..Effort::default() };
    let method = WithPostStep::new(system, method, Projection::new(system, Stabilisation::Mass, effort));
    let step = Step::Adaptive(Tolerances::new(tolerance));
    let mut motion = Hybrid::new(system, method, step, 0.0, q, p)?;
    let mut times = Times::default();
    motion.run(system, time, &mut times)?;
    motion.state(system, q, p);
    Ok(times.0)
}

/// Moves a state by time steps of a length, s, for so many seconds.
fn by_time_steps(
    system: &mut WithContacts<Mechanism>,
    time: f64,
    length: f64,
    (q, p): &mut State,
) -> Result<(), HybridError> {
    // The models of this comparison have no loops, which would have to be kept closed.
    let mut motion = TimeStepping::new(system, ());
    for step in 0..(time / length).round() as u32 {
        motion.step(system, f64::from(step) * length, length, q, p)?;
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
