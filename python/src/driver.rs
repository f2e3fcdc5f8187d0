//! The method of a row, around loops that are kept closed.

use multibody::codegen::jit::Compiled;
use multibody::runtime::catalogue::{self, BoxedMethod};
use multibody::runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::integrate::{Events, Outcome, Point, Solver, Step, StepError, Stepper, Tolerances};
use multibody::runtime::{Constrained, Real, System};

use crate::rollout::State;
use crate::rows::Beat;
use crate::settings::Settings;

/// Steps of an adaptive method between two rows of the result.
const MOST_STEPS: u64 = 1_000_000;

/// Methods whose steps begin with the rates at their start.
const BEGIN_WITH_RATES: [&str; 8] = ["euler", "midpoint", "rk4", "rkf45", "cash-karp", "tsit5", "dop853", "verner9"];

/// Whether the velocities of a state need not be computed: fixed steps of the method begin with rates, in which they are, since
/// without groups and constraints the rates of coordinates are the velocities.
pub fn rates_tell_velocities<Y: System>(settings: &Settings, system: &Y) -> bool {
    let begins = settings.tolerance.is_none() && BEGIN_WITH_RATES.contains(&&settings.method[..]);
    begins && !settings.momenta && system.lie_joints().is_empty()
}

/// Begins a step at a state and returns its rates, which the step does not compute again.
pub fn begin<'a, Y: System>(
    method: &'a mut (impl Stepper<Y> + ?Sized),
    system: &mut Y,
    t: Y::Scalar,
    q: &Y::Coordinates,
    p: &Y::Momenta,
) -> Result<&'a Point<Y>, StepError>
where
    Y::Scalar: Real,
{
    method.begin(system, t, q, p)?;
    Ok(method.start_rate(system, t))
}

/// Completes the step that [`begin`] has begun, of `h` s.
pub fn complete<Y: System>(
    method: &mut (impl Stepper<Y> + ?Sized),
    system: &mut Y,
    (t, h): (Y::Scalar, Y::Scalar),
    q: &mut Y::Coordinates,
    p: &mut Y::Momenta,
) -> Result<(), StepError>
where
    Y::Scalar: Real,
{
    method.attempt(system, t, h, None)?;
    let (field, delta) = method.parts();
    field.advance(system, t, delta)?;
    field.store(system, q, p);
    Ok(())
}

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

    /// Begins a step and gives its velocities, of a method that [`rates_tell_velocities`]. [`Driver::step`] then completes it.
    pub fn begin(&mut self, machine: &mut Compiled, t: f64, state: &mut State) -> Result<(), StepError> {
        if let Driver::Bare(method) = self {
            let rates = begin(method, machine, t, &state.q, &state.p)?;
            state.v.copy_from_slice(&rates.x);
        }
        Ok(())
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

    /// Goes on by one step of the settings, with new joint forces where these are `driven`; one that has `begun` is
    /// completed. Returns whether to go on.
    pub fn step(
        &mut self,
        settings: &Settings,
        machine: &mut Compiled,
        step: usize,
        (driven, begun): (bool, bool),
        state: &mut State,
        beat: &mut Beat,
    ) -> Result<bool, StepError> {
        let (t, end) = (step as f64 * settings.dt, (step + 1) as f64 * settings.dt);
        match self {
            Driver::Bare(method) => {
                match begun {
                    true => complete(method, machine, (t, settings.dt), &mut state.q, &mut state.p)?,
                    false => method.step(machine, t, settings.dt, &mut state.q, &mut state.p)?,
                }
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
