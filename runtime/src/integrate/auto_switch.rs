//! A method that changes between an explicit and an implicit one by what they cost.
//!
//! Where a motion is stiff, the steps of an explicit method are as short as its stability allows: the rates hardly change in
//! a step, and yet it cannot be longer. An implicit method is tried where they hardly change for many steps, and stays where it
//! takes less work for the same time. No estimate of an eigenvalue is needed, and a motion that is not stiff keeps the explicit
//! method, bit for bit.

use super::chart::Point;
use super::field::Field;
use super::stepper::{Statistics, Stepper};
use super::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// Part of the rates by which they change in a step that is short for another reason than its error.
const LITTLE: f64 = 0.01;
/// Number of such steps, one after the other, after which the implicit method is tried; at most, after trials in vain.
const WAIT: u32 = 20;
const LONGEST_WAIT: u32 = 1280;
/// Steps of the implicit method after which its work is compared with that of the explicit one.
const TRIAL: u32 = 5;
/// It stays where it takes less than this part of the work of the explicit one.
const PART: f64 = 0.5;
/// Steps of the implicit method after which the explicit one is tried again.
const TERM: u32 = 500;

/// An explicit method `E`, and an implicit one `I` where the motion is stiff. It begins with the explicit one wherever a motion
/// begins, and after every event.
#[derive(Clone, Debug)]
pub struct AutoSwitch<Y: System, E, I> {
    explicit: E,
    implicit: I,
    /// Whether the implicit method is in use.
    stiff: bool,
    /// Steps of the explicit method, one after the other, in which the rates have hardly changed; steps of the implicit one.
    steps: u32,
    wait: u32,
    /// Time and work where they began to be counted.
    mark: (Y::Scalar, f64),
    /// Work of the explicit method for a second of the motion, where it was left.
    pace: f64,
    implicit_steps: u64,
    rate: Point<Y>,
    state: (Y::Coordinates, Y::Momenta),
}

impl<Y, E, I> AutoSwitch<Y, E, I>
where
    Y: System,
    Y::Scalar: Real,
    E: Stepper<Y>,
    I: Stepper<Y>,
{
    /// Made of both methods.
    pub fn new(system: &Y, explicit: E, implicit: I) -> Self {
        AutoSwitch {
            explicit,
            implicit,
            stiff: false,
            steps: 0,
            wait: WAIT,
            mark: (Y::Scalar::zero(), 0.0),
            pace: 0.0,
            implicit_steps: 0,
            rate: Point::zero(system),
            state: (system.neutral(), system.zero_momenta()),
        }
    }

    /// Number of steps that the implicit method has taken.
    pub fn implicit_steps(&self) -> u64 {
        self.implicit_steps
    }

    /// Work done so far, in evaluations of the rates: derivatives count as one for each of their columns.
    fn work(&self) -> f64 {
        let columns = self.state.1.as_ref().len() as f64 * 2.0;
        let Statistics { evaluations, jacobians, .. } = self.statistics();
        evaluations as f64 + jacobians as f64 * (1.0 + columns)
    }

    /// Work for a second of the motion since the mark, up to time `t` (s).
    fn pace_until(&self, t: Y::Scalar) -> f64 {
        (self.work() - self.mark.1) / (t - self.mark.0).to_f64()
    }

    /// Whether the rates hardly change in the step of the explicit method that is accepted next.
    fn hardly_changes(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> bool {
        let largest = |list: &[Y::Scalar]| list.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        self.explicit.parts().0.chart().size(system, &mut self.rate);
        // Where forces are in balance, their changes are small against what would change the momenta in the step.
        let balance = LITTLE * largest(self.rate.p.as_ref()) / h.to_f64();
        self.rate.copy_from(self.explicit.start_rate(system, t));
        let end = self.explicit.end_rate(system, t, h);
        self.rate.parts().into_iter().zip(end.parts()).zip([0.0, LITTLE * balance]).all(|((before, after), enough)| {
            let pairs = before.iter().zip(after);
            let change = pairs.map(|(a, b)| (b.to_f64() - a.to_f64()).abs()).fold(0.0, f64::max);
            change <= (LITTLE * largest(before)).max(enough)
        })
    }

    /// Goes on with the other method from the state at time `t` (s).
    fn change(&mut self, system: &mut Y, t: Y::Scalar) -> Result<(), StepError> {
        let AutoSwitch { explicit, implicit, state: (q, p), .. } = self;
        if self.stiff {
            implicit.parts().0.store(system, q, p);
            explicit.begin(system, t, q, p)?;
        } else {
            explicit.parts().0.store(system, q, p);
            implicit.begin(system, t, q, p)?;
        }
        (self.stiff, self.steps) = (!self.stiff, 0);
        self.mark = (t, self.work());
        Ok(())
    }

    /// Counts an accepted step of the explicit method, and tries the other one after many that are suspicious.
    fn suspect(&mut self, system: &mut Y, (t, h): (Y::Scalar, Y::Scalar), suspicious: bool) -> Result<(), StepError> {
        if !suspicious {
            self.steps = 0;
            return Ok(());
        }
        if self.steps == 0 {
            self.mark = (t + h, self.work());
        }
        self.steps += 1;
        if self.steps < self.wait {
            return Ok(());
        }
        self.pace = self.pace_until(t + h);
        self.change(system, t + h)
    }

    /// Counts an accepted step of the implicit method, and leaves it where it gains too little.
    fn compare(&mut self, system: &mut Y, t: Y::Scalar) -> Result<(), StepError> {
        (self.steps, self.implicit_steps) = (self.steps + 1, self.implicit_steps + 1);
        if self.steps % TRIAL != 0 {
            return Ok(());
        }
        let gains = self.pace_until(t) < PART * self.pace;
        self.mark = (t, self.work());
        if gains && self.steps < TERM {
            return Ok(());
        }
        self.wait = if gains { WAIT } else { (4 * self.wait).min(LONGEST_WAIT) };
        self.change(system, t)
    }
}

/// The method in use.
macro_rules! active {
    ($self:ident.$($call:tt)*) => {
        if $self.stiff { $self.implicit.$($call)* } else { $self.explicit.$($call)* }
    };
}

impl<Y, E, I> Stepper<Y> for AutoSwitch<Y, E, I>
where
    Y: System,
    Y::Scalar: Real,
    E: Stepper<Y>,
    I: Stepper<Y>,
{
    fn order(&self) -> u32 {
        active!(self.order())
    }

    fn error_order(&self) -> Option<u32> {
        active!(self.error_order())
    }

    fn share(&self) -> f64 {
        active!(self.share())
    }

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        (self.stiff, self.steps, self.wait) = (false, 0, WAIT);
        self.explicit.begin(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        active!(self.attempt(system, t, h, scale))
    }

    fn advise(&mut self) -> Option<f64> {
        active!(self.advise())
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        active!(self.parts())
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        active!(self.start_rate(system, t))
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        active!(self.end_rate(system, t, h))
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        if self.stiff {
            self.implicit.accept(system, t, h)?;
            return self.compare(system, t + h);
        }
        let suspicious = self.hardly_changes(system, t, h);
        self.explicit.accept(system, t, h)?;
        self.suspect(system, (t, h), suspicious)
    }

    fn finish(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        active!(self.finish(system, t, h))
    }

    fn corrected(&mut self) {
        active!(self.corrected())
    }

    fn know_end_rate(&mut self, rate: &Point<Y>) {
        active!(self.know_end_rate(rate))
    }

    fn remembers(&self) -> bool {
        active!(self.remembers())
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        active!(self.interpolate(system, t, h, theta, out))
    }

    fn statistics(&self) -> Statistics {
        let (a, b) = (self.explicit.statistics(), self.implicit.statistics());
        Statistics {
            steps: a.steps + b.steps,
            rejections: a.rejections + b.rejections,
            evaluations: a.evaluations + b.evaluations,
            jacobians: a.jacobians + b.jacobians,
            factorisations: a.factorisations + b.factorisations,
            iterations: a.iterations + b.iterations,
        }
    }
}
