//! Runs a method over a time: error control, dense output, statistics.

use super::chart::Point;
use super::control::{Control, Limits, Step, Tolerance, Tolerances};
use super::stepper::{norm, Statistics, Stepper};
use super::{EnergyProjection, StepError};
use crate::error::is_before;
use crate::system::{Energetic, Real, System};
use crate::Scalar;

/// The next step as a fraction of the step that the error would allow.
const SAFETY: f64 = 0.9;
/// Rounding error of a component in a step, in epsilons of the largest one's size, below which a method's share of the
/// tolerance does not take the allowed error. The same number of errors of [`System::rounding`] is always allowed.
const ROUNDING: f64 = 4.0;
/// Smallest step, s.
const LEAST: f64 = 1e-15;
/// Largest step, s: one towards an end at infinity is finite.
const LARGEST: f64 = 1e12;
/// A step changes by at most these factors.
const SHRINK: f64 = 0.2;
const GROW: f64 = 6.0;
/// Weight of the last error in the choice of the next step: a PI controller (Gustafsson, ACM TOMS 17, 1991).
const INTEGRAL: f64 = 0.04;

/// Runs a method `M` over a time. It owns the state; [`Solver::state`] copies it.
#[derive(Clone, Debug)]
pub struct Solver<Y: System, M> {
    method: M,
    step: Step,
    /// Limits of the work.
    pub limits: Limits,
    t: Y::Scalar,
    /// Rounding error of the time.
    t_carry: Y::Scalar,
    /// The attempt that has not been accepted yet: the state is at its end.
    pending: Option<Pending<Y::Scalar>>,
    /// Next step, s; zero if it has not been chosen.
    next: f64,
    last_error: f64,
    /// Largest momentum so far.
    largest: f64,
    rejections: u64,
    /// Steps that were cut by an event or a restart before the method accepted them.
    cut: u64,
    scale: Point<Y>,
    size: Point<Y>,
    at: Point<Y>,
    /// A state at which events are evaluated.
    pub(super) looked: (Y::Coordinates, Y::Momenta),
    /// Which events the last run ended with, a bit for each, and when.
    pub(super) handled: (u64, Y::Scalar),
}

/// A step that waits to be accepted.
#[derive(Clone, Copy, Debug)]
struct Pending<S> {
    h: S,
    /// Time at its end, and what rounding takes from it.
    end: S,
    carry: S,
}

impl<Y, M> Solver<Y, M>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    /// At time `t` (s) and a state. Methods that estimate no error take [`Step::Fixed`] only.
    ///
    /// # Errors
    /// [`StepError::Quaternion`] if one is not of unit length, [`StepError::NotFinite`] if a number of the state is not finite,
    /// [`StepError::NoEstimate`], [`StepError::InvalidStep`], [`StepError::InvalidTolerances`].
    pub fn new(
        system: &mut Y,
        method: M,
        step: Step,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
    ) -> Result<Self, StepError> {
        let time = t.to_f64();
        match step {
            Step::Adaptive(_) if method.error_order().is_none() => return Err(StepError::NoEstimate { time }),
            Step::Adaptive(tolerances) if !tolerances.control_errors() => {
                return Err(StepError::InvalidTolerances { time });
            }
            Step::Fixed(step) if !(step > 0.0 && step.is_finite()) => {
                return Err(StepError::InvalidStep { time, step });
            }
            _ => {}
        }
        let point = || Point::zero(system);
        let (scale, size, at) = (point(), point(), point());
        let mut solver = Solver {
            method,
            step,
            limits: Limits::default(),
            t,
            t_carry: Y::Scalar::zero(),
            pending: None,
            next: 0.0,
            last_error: 1e-4,
            largest: 0.0,
            rejections: 0,
            cut: 0,
            looked: (system.neutral(), system.zero_momenta()),
            handled: (0, t),
            scale,
            size,
            at,
        };
        solver.restart(system, t, q, p)?;
        Ok(solver)
    }

    /// Starts again from another state, as a new solver would.
    ///
    /// # Errors
    /// [`StepError::Quaternion`], [`StepError::NotFinite`].
    pub fn restart(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
    ) -> Result<(), StepError> {
        self.largest = 0.0;
        self.resume(system, t, q, p)
    }

    /// Goes on with the same motion from another state: after an event, an impact, or a change of inputs. In contrast to
    /// [`Solver::restart`], the largest momentum so far stays the measure of small ones.
    ///
    /// # Errors
    /// [`StepError::Quaternion`], [`StepError::NotFinite`].
    pub fn resume(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
    ) -> Result<(), StepError> {
        self.cut += u64::from(self.pending.is_some());
        (self.t, self.t_carry, self.pending) = (t, Y::Scalar::zero(), None);
        (self.next, self.last_error) = (0.0, 1e-4);
        self.method.begin(system, t, q, p)?;
        // A coordinate on which no rate depends would stay what it is, without an error in any step.
        self.method.parts().0.chart().size(system, &mut self.size);
        match self.size.not_finite() {
            Some(index) => Err(StepError::NotFinite { time: t.to_f64(), index }),
            None => Ok(()),
        }
    }

    /// Ends the last step early, at `t + θ h`: the state becomes that of the dense output there.
    ///
    /// # Errors
    /// [`StepError::Quaternion`], only where a rate was not finite.
    pub fn cut(&mut self, system: &mut Y, theta: Y::Scalar) -> Result<(), StepError> {
        let time = self.look(system, theta);
        self.cut += u64::from(self.pending.is_some());
        // The motion continues unchanged, and so does the choice of steps.
        (self.t, self.t_carry, self.pending) = (time, Y::Scalar::zero(), None);
        self.method.begin(system, time, &self.looked.0, &self.looked.1)
    }

    /// Computes the state at `t + θ h` of the last step. Returns its time. At the end it is the state that the next
    /// step starts from, bit for bit.
    pub(super) fn look(&mut self, system: &mut Y, theta: Y::Scalar) -> Y::Scalar {
        let Solver { method, at, looked: (q, p), .. } = self;
        match self.pending {
            None => {
                method.parts().0.store(system, q, p);
                self.t
            }
            Some(step) => {
                let inside = theta < Y::Scalar::one();
                if inside {
                    method.interpolate(system, self.t, step.h, theta, at);
                }
                let (field, delta) = method.parts();
                field.chart().state(system, if inside { at } else { delta }, q, p);
                if inside {
                    self.t + theta * step.h
                } else {
                    step.end
                }
            }
        }
    }

    /// The method.
    pub fn method(&self) -> &M {
        &self.method
    }

    /// Time of the state, s.
    pub fn time(&self) -> Y::Scalar {
        self.pending.map_or(self.t, |step| step.end)
    }

    /// The state where the last step began, that of the solver if there is none.
    pub(crate) fn start(&mut self, system: &Y, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        self.method.parts().0.store(system, q, p);
    }

    /// The state.
    pub fn state(&mut self, system: &Y, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        let (field, delta) = self.method.parts();
        match self.pending {
            None => field.store(system, q, p),
            Some(_) => field.chart().state(system, delta, q, p),
        }
    }

    /// The work done so far.
    pub fn statistics(&self) -> Statistics {
        let mut statistics = self.method.statistics();
        statistics.steps += self.cut + u64::from(self.pending.is_some());
        statistics.rejections += self.rejections;
        statistics
    }

    /// Takes steps until `t_end` (s) is reached exactly.
    ///
    /// # Errors
    /// [`StepError`]; the state is then that of the last accepted step.
    pub fn run(&mut self, system: &mut Y, t_end: Y::Scalar) -> Result<(), StepError> {
        let mut left = self.limits.steps;
        while is_before(self.time(), t_end)? {
            self.counted(system, t_end, &mut left)?;
        }
        Ok(())
    }

    /// One step of at most `left`, rejected ones included.
    pub(super) fn counted(&mut self, system: &mut Y, t_end: Y::Scalar, left: &mut u64) -> Result<(), StepError> {
        self.limits.spend(left, self.time().to_f64())?;
        let before = self.rejections;
        self.advance(system, t_end)?;
        *left = left.saturating_sub(self.rejections - before);
        Ok(())
    }

    /// Takes one step, not beyond `t_end` (s); none if that is not ahead.
    ///
    /// # Errors
    /// [`StepError`]; the state is then that of the last accepted step. [`StepError::InvalidEnd`] if `t_end` is not a number.
    pub fn advance(&mut self, system: &mut Y, t_end: Y::Scalar) -> Result<(), StepError> {
        self.accept_pending(system)?;
        if !is_before(self.t, t_end)? {
            return Ok(());
        }
        // Where it is small against the time, this difference is exact. It is the step that ends exactly at the end.
        let rest = t_end - self.t - self.t_carry;
        if rest <= Y::Scalar::zero() {
            return Ok(());
        }
        match self.step {
            Step::Fixed(h) => self.fixed(system, h, t_end, rest),
            Step::Adaptive(tolerances) => self.controlled(system, tolerances, t_end, rest),
        }
    }

    fn fixed(&mut self, system: &mut Y, h: f64, t_end: Y::Scalar, rest: Y::Scalar) -> Result<(), StepError> {
        // A remainder that differs from the step by rounding only counts as one step.
        let slack = (1e-9 * h + 2.0 * Y::Scalar::epsilon() * t_end.to_f64().abs()).min(0.5 * h);
        let over = rest.to_f64() - h;
        let last = over < slack;
        let whole = !last || over.abs() <= slack.min(1e-3 * h);
        let step = if whole { Y::Scalar::constant(h) } else { rest };
        self.method.attempt(system, self.t, step, None)?;
        self.check()?;
        self.wait(step, last.then_some(t_end));
        Ok(())
    }

    /// Notes a step that succeeded; `end` if it leads exactly there.
    fn wait(&mut self, h: Y::Scalar, end: Option<Y::Scalar>) {
        let step = h + self.t_carry;
        let sum = self.t + step;
        self.pending = Some(match end {
            Some(end) => Pending { h, end, carry: Y::Scalar::zero() },
            None => Pending { h, end: sum, carry: step - (sum - self.t) },
        });
    }

    /// State at `t + θ h` of the last step, `0 ≤ θ ≤ 1`.
    pub fn dense(&mut self, system: &mut Y, theta: Y::Scalar, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        self.look(system, theta);
        q.as_mut().copy_from_slice(self.looked.0.as_ref());
        p.as_mut().copy_from_slice(self.looked.1.as_ref());
    }

    /// Moves the end of the last step back to the energy that was there at the start, before the next step begins.
    pub fn project(&mut self, system: &mut Y, projection: &mut EnergyProjection<Y>)
    where
        Y: Energetic,
    {
        if let Some(step) = self.pending {
            projection.correct(&mut self.method, system, self.t, step.h);
        }
    }

    /// Start and length of the last step, s.
    pub fn last_step(&self) -> (Y::Scalar, Y::Scalar) {
        (self.t, self.pending.map_or(Y::Scalar::zero(), |step| step.h))
    }

    /// Bounds of how far each coordinate has come from where the last step began, at any time within it: twice what its mean
    /// rate gives in the step, and twice what its rates at the start and end give, where these are asked for. With them the
    /// absolute values of the coordinates where the step began, zero for rotations: those of now if `sizes` are asked for, of the
    /// last call that did otherwise.
    ///
    /// These rates are what the method needs anyway, but for methods that do not start the next step with the rate at the
    /// end of this one.
    pub(crate) fn travel(&mut self, system: &mut Y, rates: [bool; 2], sizes: bool) -> [&mut Y::Momenta; 2] {
        let (two, (t, h)) = (Y::Scalar::constant(2.0), self.last_step());
        let Solver { method, at, size, .. } = self;
        let (field, delta) = method.parts();
        if sizes {
            field.chart().size(system, size);
        }
        let further = |x: &mut Y::Scalar, way: Y::Scalar| *x = if way.abs() <= *x { *x } else { way.abs() };
        at.x.as_mut().iter_mut().zip(delta.x.as_ref()).for_each(|(x, delta)| *x = (two * *delta).abs());
        let mut reach = |rate: &Point<Y>| {
            at.x.as_mut().iter_mut().zip(rate.x.as_ref()).for_each(|(x, rate)| further(x, two * h * *rate));
        };
        if rates[0] {
            reach(method.start_rate(system, t));
        }
        if rates[1] {
            reach(method.end_rate(system, t, h));
        }
        [&mut at.x, &mut size.x]
    }

    /// Accepts the pending step.
    fn accept_pending(&mut self, system: &mut Y) -> Result<(), StepError> {
        let Some(step) = self.pending else { return Ok(()) };
        let accepted = self.method.accept(system, self.t, step.h);
        if !matches!(accepted, Err(StepError::NotFinite { .. })) {
            // The state has moved, even if the next step cannot be prepared.
            (self.t, self.t_carry, self.pending) = (step.end, step.carry, None);
        }
        accepted
    }

    fn check(&mut self) -> Result<(), StepError> {
        let time = self.t.to_f64();
        let (_, delta) = self.method.parts();
        delta.not_finite().map_or(Ok(()), |index| Err(StepError::NotFinite { time, index }))
    }

    /// Makes one adaptive step.
    fn controlled(
        &mut self,
        system: &mut Y,
        tolerances: Tolerances,
        t_end: Y::Scalar,
        all: Y::Scalar,
    ) -> Result<(), StepError> {
        let rest = all.to_f64();
        let exponent = 1.0 / f64::from(self.method.error_order().unwrap_or(0) + 1);
        if self.next == 0.0 {
            self.next = self.first(system, &tolerances, exponent, rest);
        }
        let least = self.limits.min_step.max(4.0 * Y::Scalar::epsilon() * self.t.to_f64().abs()).max(LEAST);
        let mut h = self.next.max(least).min(self.limits.max_step).min(LARGEST);
        if h <= 0.0 {
            return Err(StepError::InvalidStep { time: self.t.to_f64(), step: h });
        }
        let mut rejected = false;
        loop {
            let last = rest <= h * 1.0001;
            // Two steps of half the remainder are better than a full step and a very small last one.
            let tried = if last {
                rest
            } else if rest < 2.0 * h {
                0.5 * rest
            } else {
                h
            };
            self.weigh(system, &tolerances, tried);
            let step = if last { all } else { Y::Scalar::constant(tried) };
            let (error, refused) = match self.method.attempt(system, self.t, step, Some(&self.scale)) {
                Ok(error) => (error, None),
                // A smaller step may succeed: of an implicit method, or with loops that open less.
                Err(e) => (f64::NAN, Some(e)),
            };
            if error <= 1.0 && self.check().is_ok() {
                let factor = self.method.advise().unwrap_or_else(|| {
                    let size = error.max(1e-10);
                    SAFETY * libm::pow(size, 0.75 * INTEGRAL - exponent) * libm::pow(self.last_error, INTEGRAL)
                });
                let factor = factor.clamp(SHRINK, if rejected { 1.0 } else { GROW });
                // A step that the end has shortened says little about the next step.
                self.next = if tried < h { h.max(tried * factor) } else { tried * factor };
                self.last_error = error.max(1e-4);
                self.wait(step, last.then_some(t_end));
                return Ok(());
            }
            self.rejections += 1;
            rejected = true;
            let factor = if error.is_finite() { SAFETY * libm::pow(error, -exponent) } else { SHRINK };
            h = tried * factor.clamp(SHRINK, SAFETY);
            if h < least {
                if let Some(refused) = refused {
                    return Err(refused);
                }
                let start = self.method.start_rate(system, self.t);
                let time = self.t.to_f64();
                return Err(match start.not_finite() {
                    Some(index) => StepError::NotFinite { time, index },
                    None => StepError::StepTooSmall { time, step: h, error },
                });
            }
        }
    }

    /// Allowed errors of a step of `h` s from the state.
    fn weigh(&mut self, system: &mut Y, tolerances: &Tolerances, h: f64) {
        let (field, _) = self.method.parts();
        field.chart().size(system, &mut self.size);
        let rate = self.method.start_rate(system, self.t);
        let h = Y::Scalar::constant(h);
        self.largest = self.size.p.as_ref().iter().fold(self.largest, |m, p| m.max(p.to_f64().abs()));
        for (size, rate) in self.size.parts_mut().into_iter().zip(rate.parts()) {
            for (size, rate) in size.iter_mut().zip(rate) {
                *size = *size + (h * *rate).abs();
            }
        }
        // The method's share of what is allowed, but no less than rounding takes anyway: that of the largest component,
        // from which rates of small ones may come by cancellation.
        let (share, rounding) = (self.method.share(), ROUNDING * Y::Scalar::epsilon());
        let part = |allowed: f64, most: f64| Y::Scalar::constant((share * allowed).max(allowed.min(rounding * most)));
        let largest = |part: &[Y::Scalar]| part.iter().fold(0.0_f64, |m, x| m.max(x.to_f64()));
        let (most_x, most_p) = (largest(self.size.x.as_ref()), largest(self.size.p.as_ref()).max(self.largest));
        let allowed = |t: Tolerance, size: f64, most: f64| part(t.absolute + t.relative * size, most);
        for (scale, size) in self.scale.x.as_mut().iter_mut().zip(self.size.x.as_ref()) {
            *scale = allowed(tolerances.coordinates, size.to_f64(), most_x);
        }
        for group in system.lie_joints() {
            if let Some(rotations) = self.scale.x.as_mut().get_mut(group.rotations()) {
                rotations.fill(part(tolerances.rotations, 1.0));
            }
        }
        // What rounding adds in a step is no less in many short ones.
        let least = h * Y::Scalar::constant(ROUNDING * system.rounding());
        let full = tolerances.control == Control::Full;
        for (scale, size) in self.scale.p.as_mut().iter_mut().zip(self.size.p.as_ref()) {
            let size = size.to_f64().max(1e-3 * most_p);
            *scale = if full { allowed(tolerances.momenta, size, most_p) } else { Y::Scalar::zero() };
            if full && *scale < least {
                *scale = least;
            }
        }
    }

    /// First step, s, from the rates and how they change: Hairer, Nørsett, Wanner, *Solving Ordinary Differential
    /// Equations I*, II.4.
    fn first(&mut self, system: &mut Y, tolerances: &Tolerances, exponent: f64, rest: f64) -> f64 {
        if self.limits.first_step > 0.0 {
            return self.limits.first_step;
        }
        let trial = rest.min(self.limits.max_step).min(1e-5);
        let h = Y::Scalar::constant(trial);
        self.weigh(system, tolerances, trial);
        let start = self.method.start_rate(system, self.t);
        let first = norm(start, &self.scale);
        self.at.copy_from(start);
        self.at.scale(h);
        self.size.copy_from(start);
        let (field, delta) = self.method.parts();
        field.rates(system, self.t + h, &self.at, delta);
        delta.add(-Y::Scalar::one(), &self.size);
        let second = norm(delta, &self.scale) / trial;
        let larger = if second.is_finite() { first.max(second) } else { first.max(1e30) };
        if larger > 1e-15 {
            libm::pow(0.01 / larger, exponent).min(100.0 * rest)
        } else {
            rest
        }
    }
}
