//! The method of a row, around loops that are kept closed.

use multibody::codegen::jit::Compiled;
use multibody::runtime::catalogue::{self, BoxedMethod};
use multibody::runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::integrate::{Solver, Step, StepError, Stepper, Tolerances};
use multibody::runtime::Constrained;

use crate::rollout::{Settings, State};
use crate::rows::Beat;

/// Steps of an adaptive method between two rows of the result.
const MOST_STEPS: u64 = 1_000_000;

/// A method with fixed steps, or one that chooses them.
pub enum Driver {
    Fixed(BoxedMethod<'static, Compiled>),
    Adaptive(Box<Solver<Compiled, BoxedMethod<'static, Compiled>>>),
}

impl Driver {
    /// The method of the settings at a state.
    pub fn new(settings: &Settings, machine: &mut Compiled, state: &State) -> Result<Driver, StepError> {
        let tolerances = settings.tolerance.map(Tolerances::new);
        let no_method = StepError::NoEstimate { time: 0.0 };
        let mut method = catalogue::any(&settings.method, machine, false).ok_or(no_method)?;
        if !machine.rows().is_empty() {
            let effort = settings.tolerance.map_or_else(Effort::default, Effort::within);
            let hold = Projection::new(machine, Stabilisation::default(), effort);
            method = Box::new(WithPostStep::new(machine, method, hold));
        }
        Ok(match tolerances {
            None => Driver::Fixed(method),
            Some(tolerances) => {
                let step = Step::Adaptive(tolerances);
                Driver::Adaptive(Box::new(Solver::new(machine, method, step, 0.0, &state.q, &state.p)?))
            }
        })
    }

    /// Goes on by one step of the settings, with new joint forces where these are `driven`. Returns whether to go on.
    pub fn step(
        &mut self,
        settings: &Settings,
        machine: &mut Compiled,
        step: usize,
        driven: bool,
        state: &mut State,
        beat: &mut Beat,
    ) -> Result<bool, StepError> {
        let (t, end) = (step as f64 * settings.dt, (step + 1) as f64 * settings.dt);
        match self {
            Driver::Fixed(method) => {
                method.step(machine, t, settings.dt, &mut state.q, &mut state.p)?;
                Ok(beat.goes_on())
            }
            Driver::Adaptive(solver) => {
                if driven && step > 0 {
                    solver.resume(machine, t, &state.q, &state.p)?;
                }
                let mut steps = 0;
                while solver.time() < end {
                    if steps == MOST_STEPS {
                        return Err(StepError::TooManySteps { time: solver.time(), steps });
                    }
                    steps += 1;
                    solver.advance(machine, end)?;
                    if !beat.goes_on() {
                        return Ok(false);
                    }
                }
                solver.state(machine, &mut state.q, &mut state.p);
                Ok(true)
            }
        }
    }
}
