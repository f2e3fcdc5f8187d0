//! Events: times at which a function of the state reaches zero, found on the dense output.

use super::root;
use super::solver::Solver;
use super::stepper::Stepper;
use super::StepError;
use crate::error::is_before;
use crate::system::{Real, System};
use crate::Scalar;

/// In which direction a function must reach zero to count as an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From negative values to zero.
    Rising,
    /// From positive values to zero.
    Falling,
    /// From either side.
    Both,
}

/// How one function is watched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watch {
    /// In which direction it must reach zero.
    pub direction: Direction,
    /// Whether the event ends the run.
    pub terminal: bool,
}

/// `N` functions of time and state whose zeros are events.
///
/// They should be smooth: they are compared at the ends of each eighth of a step (seven points within it), so that a
/// function that reaches zero and returns between two of these is not noticed. A value that is not a number is ignored.
/// A rotation has two quaternions of opposite sign; along a run the sign does not jump, so components may be watched,
/// but where a run starts anew it is the caller's: functions that are even in the quaternion do not depend on it.
pub trait Events<Y: System, const N: usize> {
    /// How each function is watched.
    fn watches(&self) -> [Watch; N];

    /// The functions at time `t` (s) and a state.
    fn values(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> [Y::Scalar; N];

    /// Called for every event, in the order of time, those that end the run included, with the state there. What the
    /// rates depend on must not be changed here: end the run for that.
    fn happened(&mut self, _system: &mut Y, _event: usize, _t: Y::Scalar, _q: &Y::Coordinates, _p: &Y::Momenta) {}
}

/// Why a run with events ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<S> {
    /// The end of the time span was reached.
    End,
    /// A terminal event; the state is the one there.
    Event {
        /// Index of the function.
        index: usize,
        /// Time, s.
        time: S,
    },
}

/// Number of intervals of a step at whose ends the functions are compared.
const STRETCHES: u32 = 8;

/// Largest number of functions of a run; the solver stores in one bit for each which of them ended it.
const MOST: usize = 64;

/// State of the functions during a run.
struct Track<S, const N: usize> {
    watches: [Watch; N],
    /// Which side of zero each was on: −1, 1; 0 while it is not known.
    side: [i8; N],
    /// Last value, and where in the step.
    value: [S; N],
    at: [S; N],
}

impl<S: Real, const N: usize> Track<S, N> {
    /// Whether function `k` has left its side for zero or beyond, in the way that is asked for.
    fn reached(&self, k: usize, value: S) -> bool {
        match (self.side[k], self.watches[k].direction) {
            (1, Direction::Falling | Direction::Both) => value <= S::zero(),
            (-1, Direction::Rising | Direction::Both) => value >= S::zero(),
            _ => false,
        }
    }

    fn take(&mut self, values: [S; N], theta: S) {
        for (k, value) in values.into_iter().enumerate() {
            let zero = S::zero();
            if value.is_finite() {
                self.side[k] = i8::from(value > zero) - i8::from(value < zero);
                (self.value[k], self.at[k]) = (value, theta);
            }
        }
    }

    /// The last step's end is the next one's start.
    fn turn_over(&mut self) {
        for k in 0..N {
            if self.at[k] < S::one() {
                self.side[k] = 0;
            }
            self.at[k] = S::zero();
        }
    }
}

impl<Y, M> Solver<Y, M>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    /// Takes steps until `t_end` (s) or a terminal event is reached, exactly. Times of events are found to about four
    /// units in the last place of the time, on the dense output, whose own error adds to that; the state is given just
    /// behind the event, or on it. Having ended a run, an event does not end the next one by the same zero, even if the
    /// state was changed in between (by [`Solver::restart`] at the same time): a function that starts on zero has no
    /// side to leave.
    ///
    /// Dense output makes its extra evaluations in every step here.
    ///
    /// # Errors
    /// [`StepError`]; the state is then that of the last accepted step.
    pub fn run_events<const N: usize>(
        &mut self,
        system: &mut Y,
        t_end: Y::Scalar,
        events: &mut impl Events<Y, N>,
    ) -> Result<Outcome<Y::Scalar>, StepError> {
        const { assert!(N <= MOST, "at most 64 events") };
        let zero = Y::Scalar::zero();
        let mut track = Track { watches: events.watches(), side: [0; N], value: [zero; N], at: [Y::Scalar::one(); N] };
        let start = self.look(system, Y::Scalar::one());
        track.take(self.values(system, start, events), Y::Scalar::one());
        let (handled, when) = self.handled;
        for k in 0..N {
            if start == when && handled & (1 << k) != 0 {
                track.side[k] = 0;
            }
        }
        let mut left = self.limits.steps;
        while is_before(self.time(), t_end)? {
            self.counted(system, t_end, &mut left)?;
            track.turn_over();
            if let Some(outcome) = self.scan(system, events, &mut track)? {
                return Ok(outcome);
            }
        }
        Ok(Outcome::End)
    }

    fn values<const N: usize>(
        &mut self,
        system: &mut Y,
        time: Y::Scalar,
        events: &mut impl Events<Y, N>,
    ) -> [Y::Scalar; N] {
        events.values(system, time, &self.looked.0, &self.looked.1)
    }

    fn tell<const N: usize>(&mut self, system: &mut Y, k: usize, time: Y::Scalar, events: &mut impl Events<Y, N>) {
        events.happened(system, k, time, &self.looked.0, &self.looked.1);
    }

    /// Finds the events of the last step.
    fn scan<const N: usize>(
        &mut self,
        system: &mut Y,
        events: &mut impl Events<Y, N>,
        track: &mut Track<Y::Scalar, N>,
    ) -> Result<Option<Outcome<Y::Scalar>>, StepError> {
        for j in 1..=STRETCHES {
            let theta = Y::Scalar::constant(f64::from(j) / f64::from(STRETCHES));
            let time = self.look(system, theta);
            let values = self.values(system, time, events);
            let mut roots = [None; N];
            for k in 0..N {
                if track.reached(k, values[k]) {
                    roots[k] = Some(self.locate(system, events, track, k, (theta, values[k])));
                }
            }
            while let Some((k, root)) = earliest(&roots) {
                roots[k] = None;
                let time = self.look(system, root);
                if track.watches[k].terminal {
                    return self.stop(system, events, track, (k, root)).map(Some);
                }
                self.tell(system, k, time, events);
                track.side[k] = 0;
            }
            track.take(values, theta);
        }
        Ok(None)
    }

    /// Ends the run at the root `theta` of function `k`, which is being looked at. Whatever else has happened by then
    /// is told too: where two come at once, rounding must not hide one of them behind the new start.
    fn stop<const N: usize>(
        &mut self,
        system: &mut Y,
        events: &mut impl Events<Y, N>,
        track: &Track<Y::Scalar, N>,
        (k, theta): (usize, Y::Scalar),
    ) -> Result<Outcome<Y::Scalar>, StepError> {
        let time = self.look(system, theta);
        let values = self.values(system, time, events);
        let mut handled = 0;
        for other in 0..N {
            if other == k || track.reached(other, values[other]) {
                self.tell(system, other, time, events);
                handled |= 1 << other;
            }
        }
        if theta < Y::Scalar::one() {
            self.cut(system, theta)?;
        }
        self.handled = (handled, self.time());
        Ok(Outcome::Event { index: k, time: self.time() })
    }

    /// Where function `k` reaches zero between its last value and `b`, where it has: in the last step, `θ`, not before
    /// the root.
    fn locate<const N: usize>(
        &mut self,
        system: &mut Y,
        events: &mut impl Events<Y, N>,
        track: &Track<Y::Scalar, N>,
        k: usize,
        b: (Y::Scalar, Y::Scalar),
    ) -> Y::Scalar {
        let (t, h) = self.last_step();
        root::root((track.at[k], track.value[k]), b, root::resolution(t, h), |x| {
            let time = self.look(system, x);
            let value = self.values(system, time, events)[k];
            (value, track.reached(k, value))
        })
    }
}

/// The first of the roots.
fn earliest<S: Real, const N: usize>(roots: &[Option<S>; N]) -> Option<(usize, S)> {
    let mut first: Option<(usize, S)> = None;
    for (k, root) in roots.iter().enumerate() {
        if let Some(root) = *root {
            if !first.is_some_and(|(_, least)| least <= root) {
                first = Some((k, root));
            }
        }
    }
    first
}
