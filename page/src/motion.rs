//! The motion of a mechanism in fixed steps: free, with loops, or with contacts.

use multibody::runtime::catalogue::BoxedMethod;
use multibody::runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::contact::{
    ContactMotion, HybridError, Mode, ModeTable, Regime, RegimeChoice, RegimeRules, WithContacts,
};
use multibody::runtime::integrate::{Dop853, Midpoint, Rk4, SemiImplicitEuler, Solver, Step, StepError};
use multibody::runtime::{Constrained, Energetic};

use crate::evaluator::Evaluator;

/// A mechanism, with contacts or without.
pub type System = WithContacts<ModeTable<Evaluator>>;
type Method = BoxedMethod<'static, System>;

/// A time that no motion reaches, s.
const NEVER: f64 = 1e9;
/// Largest number of steps and events of a motion with contacts within one step of the page.
const MOST: u32 = 2000;

/// How a motion is computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Name of a method, one of those of [`method`].
    pub method: String,
    /// Length of a step, s.
    pub step: f64,
    /// How contacts are followed.
    pub contacts: RegimeChoice,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { method: "rk4".into(), step: 1e-3, contacts: RegimeChoice::Automatic }
    }
}

/// A motion.
enum Run {
    Free(Box<Solver<System, Method>>),
    Touching(Box<ContactMotion<ModeTable<Evaluator>, Method, Projection<System>>>),
}

/// A motion at a state.
pub struct Motion {
    run: Run,
    settings: Settings,
    /// Work of what has no potential since the start, J.
    pub work: f64,
    middle: (Vec<f64>, Vec<f64>, Vec<f64>),
}

/// A method by its name in the catalogue of the runtime: those that the page offers, because each makes it larger.
fn method(name: &str, system: &System) -> Option<Method> {
    Some(match name {
        "semi-implicit-euler" => Box::new(SemiImplicitEuler::new(system)),
        "midpoint" => Box::new(Midpoint::new(system)),
        "rk4" => Box::new(Rk4::new(system)),
        "dop853" => Box::new(Dop853::new(system)),
        _ => return None,
    })
}

/// What closes loops and contacts.
fn projection(system: &System) -> Projection<System> {
    Projection::new(system, Stabilisation::default(), Effort { energy: f64::INFINITY, ..Effort::default() })
}

impl Motion {
    /// From time `t`, s, and a state.
    ///
    /// # Errors
    /// What a user can do nothing about but start elsewhere: a message.
    pub fn new(
        system: &mut System,
        settings: &Settings,
        t: f64,
        (q, p): (&Vec<f64>, &Vec<f64>),
    ) -> Result<Motion, String> {
        let plain =
            method(&settings.method, system).ok_or_else(|| format!("no method is named `{}`", settings.method))?;
        let method: Method = match system.rows().is_empty() {
            true => plain,
            false => Box::new(WithPostStep::new(system, plain, projection(system))),
        };
        let step = Step::Fixed(settings.step);
        let run = match system.modes().is_empty() {
            true => Run::Free(Box::new(Solver::new(system, method, step, t, q, p).map_err(|e| e.to_string())?)),
            false => {
                let rules = RegimeRules::new(settings.contacts, settings.step);
                let close = projection(system);
                let motion = ContactMotion::new(system, (method, step), close, rules, t, (q, p));
                Run::Touching(Box::new(motion.map_err(|e| contact_error(system, &e))?))
            }
        };
        let middle = (q.clone(), p.clone(), p.clone());
        Ok(Motion { run, settings: settings.clone(), work: 0.0, middle })
    }

    /// Takes one step, of which `(q, p)` is the start and then the end. Returns the time, s.
    ///
    /// # Errors
    /// Why the motion cannot go on; the state is that of the start.
    pub fn step(&mut self, system: &mut System, q: &mut Vec<f64>, p: &mut Vec<f64>) -> Result<f64, String> {
        let works = system.system().load.borrow().works();
        let before = if works { power(system, q, p, &mut self.middle.2) } else { 0.0 };
        match &mut self.run {
            Run::Free(solver) => {
                solver.advance(system, NEVER).map_err(|e| step_error(system, &e))?;
                if works {
                    let (q, p, v) = &mut self.middle;
                    solver.dense(system, 0.5, q, p);
                    let middle = power(system, q, p, v);
                    solver.dense(system, 1.0, q, p);
                    self.work += solver.last_step().1 / 6.0 * (before + 4.0 * middle + power(system, q, p, v));
                }
                solver.state(system, q, p);
                Ok(solver.time())
            }
            Run::Touching(motion) => {
                let end = motion.time() + self.settings.step;
                for _ in 0..MOST {
                    motion.advance(system, end, &mut ()).map_err(|e| contact_error(system, &e))?;
                    if motion.time() >= end {
                        break;
                    }
                }
                motion.state(system, q, p);
                if works {
                    self.work += 0.5 * self.settings.step * (before + power(system, q, p, &mut self.middle.2));
                }
                Ok(motion.time())
            }
        }
    }

    /// Goes on after a change of what acts on the mechanism.
    ///
    /// # Errors
    /// As [`Motion::step`].
    pub fn resume(&mut self, system: &mut System, t: f64, q: &Vec<f64>, p: &Vec<f64>) -> Result<(), String> {
        match &mut self.run {
            Run::Free(solver) => solver.resume(system, t, q, p).map_err(|e| step_error(system, &e)),
            Run::Touching(motion) => motion.resume(system).map_err(|e| contact_error(system, &e)),
        }
    }

    /// Whether contacts are followed by time steps.
    pub fn by_time_steps(&self) -> bool {
        matches!(&self.run, Run::Touching(motion) if motion.regime() == Regime::TimeSteps)
    }

    /// What each contact does: 0 open, 1 slides, 2 sticks. Time steps do not tell the last two apart.
    pub fn modes(&self, system: &System) -> Vec<f64> {
        match &self.run {
            Run::Touching(motion) if motion.regime() == Regime::TimeSteps => {
                motion.steps.pressed().iter().map(|pressed| f64::from(u8::from(*pressed))).collect()
            }
            _ => system.modes().iter().map(|mode| f64::from(*mode as u8 * u8::from(*mode != Mode::Open))).collect(),
        }
    }
}

/// Power of what acts on the mechanism and has no potential, W.
fn power(system: &mut System, q: &[f64], p: &[f64], v: &mut [f64]) -> f64 {
    let mechanism = system.system_mut();
    mechanism.velocities(q, p, v);
    let load = mechanism.load.clone();
    let power = load.borrow_mut().power(q, v);
    power
}

/// Kinetic and potential energy, and that of the spring, J.
pub fn energies(system: &mut System, q: &Vec<f64>, p: &Vec<f64>) -> [f64; 3] {
    let mechanism = system.system_mut();
    let (kinetic, potential) = mechanism.energies(q, p);
    let spring = mechanism.load.borrow_mut().energy(q);
    [kinetic, potential, spring]
}

fn step_error(_system: &System, error: &StepError) -> String {
    error.to_string()
}

fn contact_error(_system: &System, error: &HybridError) -> String {
    error.to_string()
}
