//! Rates at the ends of a step of methods that need none themselves.

use crate::integrate::{Field, Point};
use crate::system::{Real, System};

/// Rates at both ends of a step, found when they are first asked for.
#[derive(Clone, Debug)]
pub(super) struct Ends<Y: System> {
    rates: [Point<Y>; 2],
    known: [bool; 2],
}

impl<Y: System> Ends<Y>
where
    Y::Scalar: Real,
{
    pub(super) fn new(system: &Y) -> Self {
        Ends { rates: [Point::zero(system), Point::zero(system)], known: [false; 2] }
    }

    /// Neither end is that of the step any longer.
    pub(super) fn forget(&mut self) {
        self.known = [false; 2];
    }

    /// Nor is the far one.
    pub(super) fn forget_end(&mut self) {
        self.known[1] = false;
    }

    /// Where the step starts, at time `t`.
    pub(super) fn start(&mut self, field: &mut Field<Y>, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        let [rate, zero] = &mut self.rates;
        if !self.known[0] {
            zero.clear();
            field.rates(system, t, zero, rate);
            self.known = [true, false];
        }
        &self.rates[0]
    }

    /// At the displacement `delta`, at time `t`.
    pub(super) fn end(&mut self, field: &mut Field<Y>, system: &mut Y, t: Y::Scalar, delta: &Point<Y>) -> &Point<Y> {
        if !self.known[1] {
            field.rates(system, t, delta, &mut self.rates[1]);
            self.known[1] = true;
        }
        &self.rates[1]
    }

    /// Both, after [`Ends::start`] and [`Ends::end`].
    pub(super) fn both(&self) -> [&Point<Y>; 2] {
        self.rates.each_ref()
    }
}
