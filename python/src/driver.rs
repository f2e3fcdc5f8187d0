//! The method of a row, around loops that are kept closed.

use multibody::codegen::jit::Compiled;
use multibody::runtime::catalogue::{self, BoxedMethod};
use multibody::runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::integrate::{Events, Outcome, Solver, Step, StepError, Stepper, Tolerances};
use multibody::runtime::Constrained;

use crate::rollout::State;
use crate::rows::Beat;
use crate::settings::Settings;

/// Steps of an adaptive method between two rows of the result.
const MOST_STEPS: u64 = 1_000_000;

/// A method with fixed steps alone, or one in a solver: it chooses its steps, or events are looked for.
pub enum Driver {
    Bare(BoxedMethod<'static, Compiled>),
    Solving(Box<Solver<Compiled, BoxedMethod<'static, Compiled>>>),
}

impl Driver {
    /// The method of the settings at a state; in a solver, if it is `watched` for events.
    pub fn new(settings: &Settings, machine: &mut Compiled, state: &State, watched: bool) -> Result<Driver, StepError> {
        let step = settings.tolerance.map_or(Step::Fixed(settings.dt), |x| Step::Adaptive(Tolerances::new(x)));
        let no_method = StepError::NoEstimate { time: 0.0 };
        let mut method = catalogue::any(&settings.method, machine, false).ok_or(no_method)?;
        if !machine.rows().is_empty() {
            let effort = settings.tolerance.map_or_else(Effort::default, Effort::within);
            let hold = Projection::new(machine, Stabilisation::default(), effort);
            method = Box::new(WithPostStep::new(machine, method, hold));
        }
        if !watched && settings.tolerance.is_none() {
            return Ok(Driver::Bare(method));
        }
        Ok(Driver::Solving(Box::new(Solver::new(machine, method, step, 0.0, &state.q, &state.p)?)))
    }

    /// As [`Driver::step`], with events on the way. Without a solver nothing happens.
    pub fn step_to_event<const N: usize>(
        &mut self,
        settings: &Settings,
        machine: &mut Compiled,
        step: usize,
        driven: bool,
        state: &mut State,
        events: &mut impl Events<Compiled, N>,
    ) -> Result<bool, StepError> {
        let Driver::Solving(solver) = self else { return Ok(false) };
        if driven && step > 0 {
            solver.resume(machine, step as f64 * settings.dt, &state.q, &state.p)?;
        }
        let outcome = solver.run_events(machine, (step + 1) as f64 * settings.dt, events)?;
        solver.state(machine, &mut state.q, &mut state.p);
        Ok(outcome == Outcome::End)
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
            Driver::Bare(method) => {
                method.step(machine, t, settings.dt, &mut state.q, &mut state.p)?;
                Ok(beat.goes_on())
            }
            Driver::Solving(solver) => {
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
