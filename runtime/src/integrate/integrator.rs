//! The parts that all methods have in common: the state, the rates at both ends of a step, and the order of calls. A
//! [`Scheme`] adds the stages of a method.

use super::chart::{Chart, Point};
use super::field::Field;
use super::stepper::{hermite, Statistics, Stepper};
use super::StepError;
use crate::system::{Real, System};

/// What every method knows of the step that it is making.
#[derive(Clone, Debug)]
pub struct Attempt<Y: System> {
    /// The rates of the system; displacements start from the state in its chart.
    pub field: Field<Y>,
    /// Displacement from the start of the step to its end.
    pub delta: Point<Y>,
    /// Rate at the end of the step, in the coordinates of its start; scratch while [`Attempt::end_known`] is false.
    pub end: Point<Y>,
    /// Whether [`Scheme::start`] holds the rate at the start of this step.
    pub start_known: bool,
    /// Whether [`Attempt::end`] holds the rate at the end of this step.
    pub end_known: bool,
    /// Work done so far. Evaluations are those that the field does not count itself.
    pub statistics: Statistics,
}

impl<Y> Attempt<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Nothing is known yet. Inlined, as are all constructors around it: otherwise the parts are built beside the whole
    /// and copied, and take up twice the stack.
    #[inline(always)]
    fn new(system: &Y, compensated: bool) -> Self {
        Attempt {
            field: Field::new(system, compensated),
            delta: Point::zero(system),
            end: Point::zero(system),
            start_known: false,
            end_known: false,
            statistics: Statistics::default(),
        }
    }

    /// Evaluates the rate at the start of the step into `rate`, unless that is known.
    pub fn start_rate(&mut self, system: &mut Y, t: Y::Scalar, rate: &mut Point<Y>) {
        if !self.start_known {
            self.end.clear();
            self.field.rates(system, t, &self.end, rate);
            (self.start_known, self.end_known) = (true, false);
        }
    }

    /// Rate at the end of the step, evaluated unless it is known.
    pub fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        if !self.end_known {
            self.field.rates(system, t + h, &self.delta, &mut self.end);
            self.end_known = true;
        }
        &self.end
    }

    /// Turns the rate at the end of an accepted step, if it is known, into the rate at the start of the next one: `start`. Returns
    /// whether it was known. It is lost then.
    pub fn hand_on(&mut self, system: &Y, start: &mut Point<Y>) -> bool {
        if !core::mem::take(&mut self.end_known) {
            return false;
        }
        start.copy_from(&self.end);
        self.end.copy_from(&self.delta);
        Chart::follow(system, &self.delta, &mut self.end, start);
        true
    }

    /// The error of an implicit step whose matrix has no pivot in a column: the rate at the start shows whether the
    /// rates or the matrix are the cause.
    #[inline(always)]
    pub(super) fn singular(rate: &Point<Y>, t: Y::Scalar, h: Y::Scalar, column: usize) -> StepError {
        match rate.not_finite() {
            Some(index) => StepError::NotFinite { time: t.to_f64(), index },
            None => StepError::Singular { time: t.to_f64(), step: h.to_f64(), column },
        }
    }
}

/// The part of a method that differs from other methods: how it computes the displacement of a step and its error.
pub trait Scheme<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Whether rates of past steps are used. The history continues as long as each step starts from the state that the
    /// method returned last.
    const MULTISTEP: bool = false;
    /// Whether the rate at the end of a step is always evaluated when the step is accepted, for the next one to start
    /// with.
    const ENDS_WITH_RATE: bool = false;
    /// Whether the equations of a step are solved from what the last step found. As a history, it is kept as long as each
    /// step starts from the state that the method returned last.
    const KEEPS_GUESS: bool = false;

    /// Order of convergence.
    fn order(&self) -> u32;

    /// Order of the result whose error is estimated, if an error is estimated.
    fn error_order(&self) -> Option<u32> {
        None
    }

    /// As [`Stepper::share`].
    fn share(&self) -> f64 {
        1.0
    }

    /// Discards past steps; the next step starts from a new state. Without history or guess, that is every step.
    fn begin(&mut self) {}

    /// Computes the displacement `step.delta` of a step of `h` s from time `t` (s), and its error as
    /// [`Stepper::attempt`] says. The rate at the end is unknown before. A scheme that evaluates it sets
    /// [`Attempt::end_known`].
    ///
    /// # Errors
    /// As [`Stepper::attempt`].
    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError>;

    /// As [`Stepper::advise`].
    fn advise(&mut self) -> Option<f64> {
        None
    }

    /// The memory for the rate at the start of the step.
    fn start(&mut self) -> &mut Point<Y>;

    /// Evaluates the rate at the start of the step, unless it is known.
    fn start_rate(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar) {
        step.start_rate(system, t, self.start());
    }

    /// Prepares the next step: the state has moved by `step.delta`, in `h` s. Returns whether the rate there is known.
    fn accepted(&mut self, _step: &mut Attempt<Y>, _system: &Y, _h: Y::Scalar) -> bool {
        false
    }

    /// Displacement at `t + θ h` within the step; by default the cubic through both ends and their rates.
    fn interpolate(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        theta: Y::Scalar,
        out: &mut Point<Y>,
    ) {
        self.start_rate(step, system, t);
        step.end_rate(system, t, h);
        hermite(h, theta, &step.delta, [self.start(), &step.end], out);
    }

    /// Adds to the work of the shell that of a method within this one.
    fn statistics(&self, own: Statistics) -> Statistics {
        own
    }
}

/// A [`Scheme`] that can be made from a system without further arguments.
pub trait FromSystem<Y: System> {
    /// Makes it for one system.
    fn new(system: &Y) -> Self;
}

/// A method of integration: a [`Scheme`] in the shell that all methods share. Take one by its name, [`Rk4`](super::Rk4)
/// for example; a scheme of your own becomes one by [`Integrator::from_scheme`].
#[derive(Clone, Debug)]
pub struct Integrator<Y: System, S> {
    step: Attempt<Y>,
    scheme: S,
}

impl<Y, S> Integrator<Y, S>
where
    Y: System,
    Y::Scalar: Real,
{
    /// A method made of a scheme, for one system; with `compensated` as [`Integrator::compensated`].
    #[inline(always)]
    pub fn from_scheme(system: &Y, scheme: S, compensated: bool) -> Self {
        Integrator { step: Attempt::new(system, compensated), scheme }
    }

    /// Makes it for one system.
    #[inline(always)]
    pub fn new(system: &Y) -> Self
    where
        S: FromSystem<Y>,
    {
        Integrator { step: Attempt::new(system, false), scheme: S::new(system) }
    }

    /// The method with compensated sums: the rounding error of a step is added to the next step, except for
    /// quaternions. This helps where steps are small relative to the precision, above all in `f32`.
    #[inline(always)]
    pub fn compensated(system: &Y) -> Self
    where
        S: FromSystem<Y>,
    {
        Integrator { step: Attempt::new(system, true), scheme: S::new(system) }
    }

    /// The scheme.
    pub fn scheme(&self) -> &S {
        &self.scheme
    }

    /// This method with another scheme in place of its own.
    #[inline(always)]
    pub(crate) fn map<T>(self, scheme: impl FnOnce(S) -> T) -> Integrator<Y, T> {
        Integrator { step: self.step, scheme: scheme(self.scheme) }
    }
}

impl<Y, S> Stepper<Y> for Integrator<Y, S>
where
    Y: System,
    Y::Scalar: Real,
    S: Scheme<Y>,
{
    fn order(&self) -> u32 {
        self.scheme.order()
    }

    fn error_order(&self) -> Option<u32> {
        self.scheme.error_order()
    }

    fn share(&self) -> f64 {
        self.scheme.share()
    }

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        (self.step.start_known, self.step.end_known) = (false, false);
        self.scheme.begin();
        self.step.field.load(system, t, q, p)
    }

    fn resume(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        if (S::MULTISTEP || S::KEEPS_GUESS) && self.step.field.holds(system, q, p) {
            if !S::MULTISTEP {
                (self.step.start_known, self.step.end_known) = (false, false);
            }
            return self.step.field.load(system, t, q, p);
        }
        self.begin(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.step.end_known = false;
        self.scheme.attempt(&mut self.step, system, t, h, scale)
    }

    fn advise(&mut self) -> Option<f64> {
        self.scheme.advise()
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        (&mut self.step.field, &mut self.step.delta)
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        self.scheme.start_rate(&mut self.step, system, t);
        self.scheme.start()
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        self.step.end_rate(system, t, h)
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        if S::ENDS_WITH_RATE {
            self.step.end_rate(system, t, h);
        }
        self.step.field.advance(system, t, &self.step.delta)?;
        self.step.start_known = self.scheme.accepted(&mut self.step, system, h);
        self.step.end_known = false;
        self.step.statistics.steps += 1;
        Ok(())
    }

    fn finish(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        if S::MULTISTEP {
            return self.accept(system, t, h);
        }
        self.step.field.advance(system, t, &self.step.delta)?;
        (self.step.start_known, self.step.end_known) = (false, false);
        self.step.statistics.steps += 1;
        Ok(())
    }

    fn corrected(&mut self) {
        self.step.end_known = false;
    }

    fn know_end_rate(&mut self, rate: &Point<Y>) {
        self.step.end.copy_from(rate);
        self.step.end_known = true;
    }

    fn remembers(&self) -> bool {
        S::MULTISTEP
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.scheme.interpolate(&mut self.step, system, t, h, theta, out);
    }

    fn statistics(&self) -> Statistics {
        let Attempt { field, statistics, .. } = &self.step;
        let evaluations = statistics.evaluations + field.evaluations();
        self.scheme.statistics(Statistics { evaluations, ..*statistics })
    }

    fn step(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), StepError> {
        self.resume(system, t, q, p)?;
        self.attempt(system, t, h, None)?;
        if S::MULTISTEP {
            self.accept(system, t, h)?;
        } else {
            self.step.field.advance(system, t, &self.step.delta)?;
        }
        self.step.field.store(system, q, p);
        Ok(())
    }
}
